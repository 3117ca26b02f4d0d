"""Runs whose meshes follow large wear."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from fenwear import Tribosystem, assemble, evolve, make_case, march
from fenwear.case.templates import fill_in, find_template
from fenwear.laws.wear import WornDepths
from fenwear.steps import Block, follow
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import LATE, jump_within, march_within
from fenwear.steps.slow_changes import _in_place

SMALL = ("geometry.parameters.elements_along_contact=16", "geometry.parameters.contact_width=0.4")


def run(system: Tribosystem, half_cycles: int, tolerance: float = 0.1) -> list[Block]:
    return list(follow(system, partial(jump_within, tolerance=tolerance), RunLimits(half_cycles)))


def test_moved_meshes_agree_with_the_offset(assembled: Callable[..., Tribosystem]) -> None:
    """Both descriptions give the same wear to the square of the scar's slope (1e-2) where there is no friction."""
    offset, moved = (
        run(assembled("fretting", *SMALL, "contact.friction=0", f"geometry.follow_wear={limit}"), 4000)
        for limit in ("never", 0.01)
    )
    assert all(block.system is offset[0].system for block in offset)
    assert moved[-1].system is not moved[0].system
    one, other = offset[-1], moved[-1]
    np.testing.assert_allclose(other.wear_strip[-1], one.wear_strip[-1], atol=2e-3 * one.wear_strip[-1].max())
    np.testing.assert_allclose(other.wear[-1], one.wear[-1], atol=2e-3 * one.wear[-1].max())
    np.testing.assert_allclose(other.pressure[-1], one.pressure[-1], atol=0.01 * one.pressure[-1].max())


@pytest.mark.mpi
def test_jumps_end_where_meshes_follow(assembled: Callable[..., Tribosystem]) -> None:
    """Friction's lever falls as a punch wears: one jump had passed ten meshes, pressures 1 % off."""
    settings = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2", "geometry.follow_wear=0.05")
    system = assembled("monotonic-lz40", *settings)
    ends = [list(evolve(system, 300, integration=how)) for how in ("jump", "implicit")]
    for block in ends[0]:
        assert block.system.bodies.wear_on_meshes(block.end.worn, block.system.case) <= LATE
    jumped, marched = ends[0][-1], ends[1][-1]
    np.testing.assert_allclose(jumped.pressure[-1], marched.pressure[-1], atol=1e-3 * marched.pressure[-1].max())
    assert len(ends[0]) > 10


def test_meshes_of_solids_agree_with_the_offset(assembled: Callable[..., Tribosystem]) -> None:
    """A ball and its flat that both wear: k F s, depths and pressures are those of the gap's offset."""
    sizes = ("geometry.parameters.across=4", "geometry.parameters.core=0", "motion.positions=3", "contact.friction=0")
    offset, moved = (
        run(assembled("ball-on-flat", *sizes, f"geometry.follow_wear={limit}"), 100) for limit in ("never", 0.004)
    )
    last = moved[-1].system
    assert last is not moved[0].system
    one, other = offset[-1], moved[-1]
    np.testing.assert_allclose(other.wear_strip[-1], one.wear_strip[-1], atol=1e-3 * one.wear_strip[-1].max())
    np.testing.assert_allclose(other.wear[-1], one.wear[-1], atol=1e-3 * one.wear[-1].max())
    np.testing.assert_allclose(other.pressure[-1], one.pressure[-1], atol=3e-3 * one.pressure[-1].max())
    first = moved[0].system.pair
    slid = 20.0 * 0.2 * 100  # N mm
    assert first.punch.weights @ other.wear[-1] == pytest.approx(1e-8 * slid, rel=1e-3)  # along the curved normal
    assert first.strip.weights @ other.wear_strip[-1] == pytest.approx(2e-8 * slid, rel=1e-5)


@pytest.mark.parametrize("elements", [16, 32])
def test_a_bushing_agrees_with_the_offset(elements: int) -> None:
    """On a contact to 50 degrees around depths agree at every node, and volumes by depth with the metered ones.

    What is left is of the second order: half the depth over the radius, on any mesh.
    """
    data = tomllib.loads(fill_in(find_template("bushing")))
    data["geometry"]["parameters"]["elements_along_contact"] = elements
    for coefficient in (2e-9, 5e-10):
        data["wear"]["punch"]["coefficient"] = f"{coefficient} mm^3/(N mm)"
        found = []
        for limit in ("never", 0.01):
            data["geometry"]["follow_wear"] = limit
            blocks = run(assemble(make_case(data)), 100_000, tolerance=0.02)
            found.append((blocks[0].system, blocks[-1]))
        (system, offset), (_, moved) = found
        assert moved.system is not system
        depth = offset.wear[-1].max()
        np.testing.assert_allclose(moved.wear[-1], offset.wear[-1], atol=0.5 * depth / 10 * depth)
        areas = system.bodies.punch.thickness * system.pair.weights
        metered = moved.totals.of("volume_punch")[-1]
        assert areas @ moved.wear[-1] == pytest.approx(metered, rel=0.5 * depth / 10)
        assert areas @ offset.wear[-1] == pytest.approx(offset.totals.of("volume_punch")[-1], rel=1e-12)


@pytest.mark.mpi
def test_temperature_keeps_its_place(assembled: Callable[..., Tribosystem]) -> None:
    """A linear temperature on the moved mesh is the same function of the place."""
    settings = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2")
    system = assembled("example1-heat", *settings)
    worn = WornDepths(0.3 + 0.1 * (system.pair.x / 30) ** 2, 0.1 + 0 * system.pair.strip.weights)
    moved = assemble(system.case, system.bodies.comm, worn)
    for old, new in zip(system.bodies.heat, moved.bodies.heat, strict=True):
        x, there = (body.space.tabulate_dof_coordinates()[: body.owned] for body in (old, new))
        linear = partial(np.dot, b=np.array([0.3, 2.0, 0.0]))
        carried = _in_place(old.function(linear(x)), new.function(linear(x)))
        np.testing.assert_allclose(carried, linear(there), atol=1e-9)


def test_a_run_with_heat_goes_on(assembled: Callable[..., Tribosystem]) -> None:
    """Moved at nearly no wear, the march with heat goes on as if nothing had happened."""
    settings = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2", "heat.operator=full")
    plain = assembled("example1-heat", *settings, "geometry.follow_wear=never")
    moving = assembled("example1-heat", *settings, "geometry.follow_wear=1e-7")
    *_, expected = march(plain, 6)

    blocks = list(follow(moving, march_within, RunLimits(6)))
    assert blocks[-1].system is not moving
    assert expected.heat is not None
    assert blocks[-1].heat is not None
    np.testing.assert_allclose(blocks[-1].pressure[-1], expected.pressure[-1], rtol=1e-5)
    np.testing.assert_allclose(blocks[-1].heat.temperature_punch[-1], expected.heat.temperature_punch[-1], rtol=1e-5)
