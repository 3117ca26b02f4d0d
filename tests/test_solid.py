"""Solids and rings from a case to their contact: what only the geometry tells is refused in words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, load_case
from fenwear.case import Case
from fenwear.steps import march, steady
from fenwear.system import assemble, place_case
from fenwear_verify.solid import describe

COARSE = ("geometry.degree=1", "geometry.order=1")


def test_an_axis_that_is_none_of_the_disc() -> None:
    """Turned about x in place, the disc's face would leave the pin."""
    with pytest.raises(CaseError, match=r"motion\.axis:"):
        place_case(load_case("pin-on-disc", [*COARSE, "motion.axis=[1, 0, 0]"]))


def test_nothing_wears_on_the_axis_itself() -> None:
    """Where wear goes by v^2 no pressure that has an integral wears a pin evenly that turns on its own axis."""
    placed = place_case(load_case("pin-on-disc", [*COARSE, "geometry.parameters.track_radius=0",
                                                  "geometry.parameters.around=2",
                                                  "wear.punch={coefficient=1e-8, speed_exponent=2}"]))  # fmt: skip
    with pytest.raises(CaseError, match=r"motion\.centre: lies within the contact"):
        placed.optimum(1)


def test_elements_that_fold() -> None:
    """An arc of 45 degrees in a thin element: the chord of its neighbour lies beyond where its map folds."""
    with pytest.raises(CaseError, match=r"geometry\.order:"):
        place_case(load_case("pin-on-disc", ["geometry.parameters.around=2"]))


def test_a_pin_that_turns_off_its_disc() -> None:
    """The part of the disc that is meshed does not reach as far as the pin turns."""
    motion = "motion={kind='oscillation', amplitude=1.0, period=1.0, positions=3}"
    with pytest.raises(CaseError, match="motion: the stroke runs off the meshed strip: turned by"):
        place_case(load_case("pin-on-disc", [*COARSE, motion, "wear.strip.coefficient=1e-9"]))


def test_an_axis_that_leans() -> None:
    """A disc that turns about an axis 3 degrees off its normal would not stay under the pad."""
    with pytest.raises(CaseError, match=r"^motion\.axis: "):
        place_case(load_case("brake-pad", [*COARSE, "motion.axis=[0, 0.05, 1]"]))


def test_a_ball_that_leaves_its_flat() -> None:
    """The message names the motion and how far the strip reaches."""
    with pytest.raises(CaseError, match="motion: the stroke runs off the meshed strip: moved by"):
        place_case(load_case("ball-on-flat", [*COARSE, "motion.along=[0, 1, 0]"]))


@pytest.mark.parametrize(("settings", "message"), [
    (["punch.supports=[]"], "the punch is free to slide along x and to slide along y"),
    (["punch.supports=[{at=[15, 0, 12], fix=['x', 'y']}]"], "spin about z"),
])  # fmt: skip
def test_too_few_supports(settings: list[str], message: str) -> None:
    """The modes in which friction would carry the pin away are named."""
    with pytest.raises(CaseError, match=message):
        place_case(load_case("pin-on-disc", [*COARSE, "geometry.parameters.around=2", *settings]))


@pytest.mark.parametrize(("name", "settings", "message"), [
    ("pin-on-disc", "strip.supports=[{on='strip_sides', fix=['x', 'y']}]",
     r"strip\.supports: .* counterclockwise sliding: the strip is free to move along z, and the punch pushes it away"),
    ("pin-on-disc", "strip.supports=[{on='strip_bottom', fix=['x', 'y']}]",
     "the strip is free to move along z and to tilt about x and to tilt about y, and"),
    ("ring-on-ring", "strip.supports=[]", r"strip\.supports: .* the strip is free to move along z, and"),
    ("pin-on-disc", "contact.friction=0.5", r"punch\.loads: .* the punch tips over, free to tilt about x"),
    ("pin-on-disc", "punch.loads=[{on='punch_top', force=[0, 0, 100]}]", r"punch\.loads: .* the punch lifts off"),
    ("ball-on-flat", "motion.along=[0, 0, 1]", r"motion\.along: .* out of the contact.* at right angles"),
    ("ball-on-flat", "motion.along=[1, 0, 1]", r"motion\.along: .* out of the contact.* \(0\.707, 0, 0\)"),
])  # fmt: skip
def test_what_nothing_balances(name: str, settings: str, message: str) -> None:
    """The body at fault is named, the modes in which it would go, and the key."""
    with pytest.raises(CaseError, match=message):
        place_case(load_case(name, [*COARSE, settings]))


def test_friction_of_a_turning_disc(assembled: Callable[..., Tribosystem]) -> None:
    """The traction on the pin is mu across the arm from the disc's axis, the other way if it turns back."""
    system = assembled("pin-on-disc", *COARSE)
    arm = system.pair.punch.x[:, :2]
    for direction in (1, -1):
        ratio = system.phases.middle_ratio(direction)
        across = np.column_stack([-arm[:, 1], arm[:, 0]]) / np.linalg.norm(arm, axis=1, keepdims=True)
        np.testing.assert_allclose(ratio[:, :2], direction * 0.05 * across, atol=1e-14)
        np.testing.assert_allclose(ratio[:, 2], 0, atol=1e-15)


def test_heat_of_rings(assembled: Callable[..., Tribosystem]) -> None:
    """Hot rings end at p = F / (2 pi (r_o - r_i) r), too, warm."""
    system = assembled("ring-on-ring-heat", "geometry.degree=2", "geometry.parameters.across=4")
    state = steady(system)
    (pressure,) = state.pressure
    np.testing.assert_allclose(pressure, 2000 / (2 * np.pi * 10 * system.pair.x), rtol=1e-6)
    assert state.heat is not None
    assert (state.heat.punch > 50).all()
    *_, block = march(system, 3)  # where they touch in a part of their width only
    assert (block.pressure == 0).any()
    assert block.heat is not None
    assert block.heat.balance_error.max() < 1e-9


def blocks(tmp_path: Path, *, turned: bool, **punch: Any) -> Case:
    """Return two cubes, one on the other, or turned about y: side by side then, with the plane x = 0 between them."""
    mesh = Path(__file__).parents[1] / "meshes" / "solid_blocks.geo"
    geometry = tmp_path / "blocks.geo"
    geometry.write_text(
        f'Include "{mesh}";\nRotate {{{{0, 1, 0}}, {{0, 0, 0}}, {int(turned)} * Pi / 2}} {{Volume{{:}};}}\n'
    )
    held = {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]}
    along = {"kind": "reciprocating", "amplitude": 0.01, "period": 1.0, "along": [0, 1, 0], "positions": 1}
    return describe({"file": str(geometry), "degree": 1}, punch, held, motion=along)


def test_a_free_body_whose_contact_does_not_face_z(tmp_path: Path) -> None:
    """It is refused for where its contact looks, not for supports that fit it: all but x held."""
    punch = {"supports": [{"on": "punch_far", "fix": ["y", "z"]}], "loads": [{"on": "punch_far", "force": [-9, 0, 0]}]}
    with pytest.raises(CaseError, match="geometry: punch_contact looks along x, and the punch is not held"):
        place_case(blocks(tmp_path, turned=True, **punch))


def test_a_held_body_may_face_any_way(tmp_path: Path) -> None:
    """Pressed by a displacement of its back: the pressure is that of the same blocks upright."""
    pressure = {}
    for turned, by in ((False, [0, 0, -1e-3]), (True, [-1e-3, 0, 0])):
        supports = [{"on": "punch_far", "fix": ["x", "y", "z"], "by": by}]
        system = assemble(blocks(tmp_path, turned=turned, supports=supports))
        found = system.contact((1,)).solve(system.gap(0, system.unworn())).pressure[0]
        pressure[turned] = np.sort(found)
    np.testing.assert_allclose(pressure[True], pressure[False], rtol=1e-9)
    assert pressure[True].min() > 0
