"""Half-cycle by half-cycle: invariants, symmetries, units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Case, Tribosystem, assemble
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear_verify.full_space import nothing_condensed

A, MEAN = 30.0, 1e4 / 600
COEFFICIENT = 1.25e-8 * np.pi
OPENING = ("contact.friction=0.4", "geometry.parameters.pin_height_1=40")
FAST = ("geometry.degree=2", "wear.punch.coefficient=4e-6")  # 100 times the paper's


def run(system: Tribosystem, half_cycles: int, periodic_within: float | None = None, **options: Any) -> Block:
    """Return all half-cycles in one block."""
    (block,) = march_within(system, RunLimits(half_cycles, periodic_within, block=half_cycles), **options)
    return block


def one_way(direction: str, distance: float) -> str:
    return f"motion={{kind='one-way', direction='{direction}', speed={distance}, duration=1}}"


@pytest.mark.parametrize("settings", [(), OPENING])
@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.mpi("False-settings0", "True-settings1")
def test_equilibrium_in_every_half_cycle(
    assembled: Callable[..., Tribosystem], settings: tuple[str, ...], implicit: bool
) -> None:
    """Verification 7: force F0 and no moment about O, recomputed from p alone, to 1e-8; complementarity."""
    system = assembled("example1", *settings, "wear.punch.coefficient=4e-7")
    mu, height = system.case.contact.friction, system.bodies.punch.pivot[1] - 100
    block = run(system, 40, implicit=implicit)
    force = block.pressure * system.pair.weights
    np.testing.assert_allclose(force.sum(axis=1) * 10, 1e4, rtol=1e-8)
    moment = force @ (system.pair.x - A) + block.direction * mu * height * force.sum(axis=1) + 1000 * A
    np.testing.assert_allclose(moment, 0, atol=1e-8 * 1000 * A)
    assert block.equilibrium_error.max() < 1e-8
    assert (block.pressure >= 0).all()
    np.testing.assert_allclose(block.pressure * block.gap, 0, atol=1e-9)
    np.testing.assert_array_equal(block.direction, np.where(block.half_cycle % 2, 1, -1))


def test_wear_is_what_the_pressure_wears(assembled: Callable[..., Tribosystem]) -> None:
    """w grows by beta~ 2 u0 p in each half-cycle, and never shrinks; equation (26)."""
    block = run(assembled("example1"), 30)
    growth = np.diff(block.wear, axis=0, prepend=0)
    np.testing.assert_allclose(growth, COEFFICIENT * 3 * block.pressure, rtol=1e-9, atol=1e-16)


def test_example_2_is_symmetric(assembled: Callable[..., Tribosystem]) -> None:
    """p+(x) = p-(-x): exactly on the flat punch; after wear up to the one half-cycle between the two."""
    system = assembled("example2")
    first, back = (system.contact((d,)).solve(system.pair.initial_gap).pressure[0] for d in (1, -1))
    np.testing.assert_allclose(first, back[::-1], rtol=1e-8)
    block = run(system, 400)
    step = np.abs(block.pressure[-2] - block.pressure[-4]).max()  # what a cycle changes
    np.testing.assert_allclose(block.pressure[-2], block.pressure[-1][::-1], atol=max(step, 0.01 * MEAN))
    np.testing.assert_allclose(block.wear[-1], block.wear[-1][::-1], atol=2 * COEFFICIENT * 3 * MEAN)


def test_mirror_image_of_example_1(assembled: Callable[..., Tribosystem]) -> None:
    """The pin on the left side and the other sliding direction: the mirrored pressure in every half-cycle."""
    mirrored = "punch.supports.0={at=[-30, 120], fix=['x']}"
    right = run(assembled("example1", *FAST, one_way("rightward", 3)), 20)
    left = run(assembled("example1", *FAST, one_way("leftward", 3), mirrored), 20)
    np.testing.assert_allclose(left.pressure[:, ::-1], right.pressure, rtol=1e-8, atol=1e-9 * MEAN)
    np.testing.assert_allclose(left.wear[:, ::-1], right.wear, rtol=1e-8)


def scaled(length: float, force: float) -> Callable[[dict[str, Any]], None]:
    """Return the change of a case to units of length and force `length` and `force` times smaller."""

    def number(text: Any) -> float:
        return float(str(text).split()[0])

    def scale(case: dict[str, Any]) -> None:
        pressure = force / length**2
        geometry = case["geometry"]["parameters"]
        for name in ("punch_width", "punch_height", "layer_height", "pin_height_1", "strip_length", "strip_height"):
            geometry[name] *= length
        case["model"]["thickness"] = number(case["model"]["thickness"]) * length
        for material in case["materials"].values():
            material["young"] = number(material["young"]) * pressure
        for load in case["punch"]["loads"]:
            load["force"] = [number(f) * force for f in load["force"]]
        case["motion"]["amplitude"] = number(case["motion"]["amplitude"]) * length
        case["wear"]["punch"]["coefficient"] = number(case["wear"]["punch"]["coefficient"]) / pressure

    return scale


@pytest.mark.parametrize(("length", "force"), [(1.0, 1000.0), (1e-3, 1.0), (25.4, 4.4)])
def test_the_choice_of_units_changes_nothing(
    assembled: Callable[..., Tribosystem], edited: Callable[..., Case], length: float, force: float
) -> None:
    """The same problem in other units of length and force: p scales with force / length², wear with length."""
    system = assembled("example1", *FAST)
    other = assemble(edited("example1", scaled(length, force), *FAST))
    one, two = run(system, 10), run(other, 10)
    np.testing.assert_allclose(other.pair.x, system.pair.x * length, atol=1e-10 * length)
    np.testing.assert_allclose(two.pressure * length**2 / force, one.pressure, rtol=0, atol=1e-7 * one.pressure.max())
    np.testing.assert_allclose(two.wear / length, one.wear, rtol=0, atol=1e-7 * one.wear.max())


@pytest.mark.parametrize("a", [1.0, 2.0])
def test_only_the_product_of_coefficient_and_sliding_matters(assembled: Callable[..., Tribosystem], a: float) -> None:
    """beta~ (u0 omega)^a / omega is all that a half-cycle knows of beta~, u0 and omega."""
    exponent = f"wear.punch.speed_exponent={a}"
    one = run(assembled("example1", "geometry.degree=2", exponent, "wear.punch.coefficient=1e-8"), 10)
    other_motion = ("motion.amplitude=3", "motion.angular_frequency=20")
    coefficient = f"wear.punch.coefficient={1e-8 / (2**a * 2 ** (a - 1))!r}"
    two = run(assembled("example1", "geometry.degree=2", exponent, coefficient, *other_motion), 10)
    np.testing.assert_allclose(two.pressure, one.pressure, rtol=1e-10)


def test_stops_when_periodic(assembled: Callable[..., Tribosystem]) -> None:
    """The run ends after the first whole cycle in which nothing changes by more than the tolerance."""
    system = assembled("example1", *FAST)
    tolerance = 1e-3
    block = run(system, 5000, implicit=True, periodic_within=tolerance)
    n = len(block)
    assert n < 5000
    weights = system.pair.weights
    scale = (block.pressure**2 @ weights) / (block.pressure @ weights)  # where the load is carried
    change = np.abs(block.pressure[2:] - block.pressure[:-2]).max(axis=1) / scale[2:]
    np.testing.assert_allclose(block.periodicity[2:], change, rtol=1e-12)
    assert np.isnan(block.periodicity[:2]).all()
    within = change < tolerance
    assert within[-2:].all()
    assert not (within[:-2] & within[1:-1]).any()


def test_blocks_are_one_sequence(assembled: Callable[..., Tribosystem]) -> None:
    """Cutting the run into blocks cuts nothing else."""
    system = assembled("example1", *FAST)
    whole = run(system, 10)
    parts = list(march_within(system, RunLimits(10, block=3)))
    assert [len(p) for p in parts] == [3, 3, 3, 1]
    for name in ("half_cycle", "direction", "pressure", "gap", "wear", "worn_area_increment", "periodicity"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))


def test_full_solver_marches_the_same(assembled: Callable[..., Tribosystem]) -> None:
    """Contacts on all displacements give the history of the condensed ones to 1e-8."""
    system = assembled("example1", *FAST, "geometry.parameters.elements_along_contact=8")
    one = run(system, 6)
    with nothing_condensed():
        two = run(system, 6)
    np.testing.assert_allclose(two.pressure, one.pressure, rtol=0, atol=1e-8 * one.pressure.max())
    np.testing.assert_allclose(two.wear, one.wear, rtol=1e-7)


def test_implicit_tends_to_explicit(assembled: Callable[..., Tribosystem]) -> None:
    """At the same worn depth the two differ by first order in the step: half the step, half the difference."""
    differences = []
    for steps in (40, 80, 160):
        system = assembled(
            "example1", "geometry.degree=2", one_way("rightward", 120 / steps), "wear.punch.coefficient=1e-7"
        )
        ends = [run(system, steps, implicit=implicit).pressure[-1] for implicit in (True, False)]
        differences.append(np.abs(ends[0] - ends[1]).max())
    assert np.divide(differences[:-1], differences[1:]) == pytest.approx([2, 2], rel=0.15)
