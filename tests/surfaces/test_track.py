"""Wear spread along a closed track: circles on a disc, lines along a translation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.case import load_case, make_case
from fenwear.common.arrays import Array
from fenwear.results.history_surfaces import extents, scar_geometry
from fenwear.steps import march, steady
from fenwear.surfaces.track import _part_below
from fenwear.system import place_case

DISC = ("geometry.degree=2", "wear.strip.coefficient=2e-8", "geometry.parameters.disc_layers=2",
        "geometry.parameters.pin_layers=2")  # fmt: skip


def blocks(motion: dict[str, Any], **sizes: float) -> Tribosystem | Any:
    """Return a block of 1 mm on a larger one, placed; both wear."""
    wide = {"margin_x": 0.5, "margin_y": 0.5, "margin_elements": 2, "across_x": 4, "across_y": 4}
    return place_case(make_case({
        "geometry": {"file": "solid_blocks.geo", "degree": 1, "parameters": {**wide, **sizes}},
        "model": {"kind": "solid"},
        "materials": {"steel": {"young": 2e5, "poisson": 0.3}},
        "punch": {"regions": {"punch_body": "steel"}, "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
                  "loads": [{"on": "punch_far", "force": [0, 0, -10]}]},
        "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
        "wear": {"punch": {"coefficient": 1e-8}, "strip": {"coefficient": 2e-8}},
        "motion": motion,
        "run": {"half_cycles": 1},
    }))  # fmt: skip


def line(**motion: Any) -> dict[str, Any]:
    return {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0, "track": 50.0, **motion}


@pytest.mark.parametrize("along", [[1, 0, 0], [0, 1, 0]])
@pytest.mark.parametrize("cells", [{}, {"strip_tetrahedra": 1, "strip_across_x": 3}])
def test_uniform_wear_along_a_line(along: list[float], cells: dict[str, float]) -> None:
    """A block of 1 mm that loses a depth of 1 everywhere lowers a track of 50 mm by 1 / 50 over its own width."""
    placed = blocks(line(along=along), **cells)
    depth = placed.pair.wear_projection @ np.ones(len(placed.pair.weights))
    across = np.abs(placed.pair.strip.x[:, along.index(0)])
    np.testing.assert_allclose(depth[across < 0.5 + 1e-9], 0.02, rtol=1e-9)
    assert depth[across > 0.75 - 1e-9].max() == 0
    np.testing.assert_allclose(placed.pair.opening(0 * placed.pair.weights, depth), 0.02, rtol=1e-9)


def test_a_turn_about_a_far_axis_is_a_line() -> None:
    """About an axis along y 1,000 mm below, the track is 2 pi 1,000 mm long; s is the distance along the axis."""
    depth: dict[str, Array] = {}
    turn = {"kind": "rotation", "axis": [0, 1, 0], "centre": [0, 0, -1000], "angular_speed": 1.0, "duration": 1.0}
    for name, motion in (("turn", turn), ("line", line(track=2000 * np.pi))):
        placed = blocks(motion)
        pressure = 1 + placed.pair.punch.x[:, 1] ** 2
        depth[name] = placed.pair.wear_projection @ pressure
    np.testing.assert_allclose(depth["turn"], depth["line"], rtol=1e-6)


def test_pin_on_a_disc(assembled: Callable[..., Tribosystem]) -> None:
    """A round pin is 2 r arccos((r² + d² - a²) / 2 r d) long on the circle of radius r: nodes have that mean."""
    system = assembled("pin-on-disc", *DISC)
    x = system.pair.strip.x
    r, a, d = np.hypot(x[:, 0], x[:, 1]), 3.0, 15.0
    found = system.pair.wear_projection @ np.ones(len(system.pair.weights))
    chord = np.arccos(np.clip((r**2 + d**2 - a**2) / (2 * r * d), -1, 1)) / np.pi
    inside = np.abs(r - d) < 0.7 * a
    np.testing.assert_allclose(found[inside], chord[inside], rtol=0.03)
    assert system.pair.wear_projection.min() >= 0
    # All around: the volume of the profile is that of the layer worn off under the pin, 9 pi.
    order = np.argsort(r)
    volume = np.trapezoid(2 * np.pi * r[order] * found[order], r[order])
    assert volume == pytest.approx(9 * np.pi, rel=0.02)


def test_volume_of_a_turning_disc(assembled: Callable[..., Tribosystem]) -> None:
    """beta~ phi times the integral of p r, exactly, on the disc as on the pin; all of a ring is worn alike."""
    system = assembled("pin-on-disc", *DISC)
    *_, block = march(system, 3, implicit=True)
    x, xs = system.pair.punch.x, system.pair.strip.x
    torque = block.pressure @ (system.pair.weights * np.hypot(x[:, 0], x[:, 1]))
    np.testing.assert_allclose(block.worn_area_increment_strip, 2e-8 * 2 * np.pi * torque, rtol=1e-12)
    np.testing.assert_allclose(block.worn_area_increment, 1e-8 * 2 * np.pi * torque, rtol=1e-12)
    r, depth = np.hypot(xs[:, 0], xs[:, 1]), block.wear_strip[-1]
    below, above = np.abs(xs[:, 1]) < 0.3, np.abs(r - 15) < 2
    middle = np.interp(r[above], *np.array(sorted(zip(r[below], depth[below], strict=True))).T)
    np.testing.assert_allclose(depth[above], middle, rtol=0.05)


@pytest.mark.parametrize("same_face", [0, 1])
def test_faces_of_a_disc_have_the_wear_of_their_own_pads(same_face: int) -> None:
    """At each node of the disc the mean along a pad's arc by its share of the circle; on one face that of both."""
    errors = []
    for across in (2, 4):
        sizes = {"across": across, "along": 2 * across, "around": 12 * across, "same_face": same_face,
                 "front_angle": 50, "back_angle": 40, "pad_layers": 1, "disc_layers": 1, "hub_elements": 1}  # fmt: skip
        told = ", ".join(f"{key}={value}" for key, value in sizes.items())
        more = ("wear={punch={coefficient=1e-8}, strip={coefficient=1e-9}}",
                f"punch.loads.1.force=[0, 0, {-5000 if same_face else 5000}]")  # fmt: skip
        placed = place_case(load_case("disc-brake-two-pads", [f"geometry.parameters={{{told}}}", *more]))
        x, disc = placed.pair.punch.x[:, 0], placed.pair.strip.x
        found, r = placed.pair.wear_projection @ (1 + x / 80) ** 2, np.hypot(*disc[:, :2].T)
        exact: Array = np.zeros(len(r))
        for degrees, side, own in ((50, 1, disc[:, 2] > -1), (40, 1 - 2 * same_face, (disc[:, 2] > -1) == same_face)):
            half, far = np.radians(degrees / 2), side * r / 80  # the mean of (1 + far cos phi)² over the arc
            mean = 1 + 2 * far * np.sin(half) / half + far**2 * (0.5 + np.sin(2 * half) / (4 * half))
            exact += np.where(own, half / np.pi * mean, 0.0)
        inside = np.abs(r - 80) < 12
        worst = float(np.abs(found - exact)[inside].max())
        errors.append(worst)
    assert errors[1] < 0.01, errors
    assert errors[1] < errors[0] / 1.8, errors


@pytest.mark.parametrize("cells", [{}, {"strip_tetrahedra": 1, "strip_across_x": 3, "strip_across_y": 3}])
@pytest.mark.parametrize("along", [0, 1])
def test_sides_of_a_track_to_and_fro(along: int, cells: dict[str, float]) -> None:
    """A block worn evenly cuts a track with upright sides: across it all is as deep, and felt so; volumes are kept."""
    direction = [float(k == along) for k in range(3)]
    motion = {"kind": "reciprocating", "amplitude": 0.3, "angular_frequency": 1.0, "along": direction, "positions": 12}
    placed = blocks(motion, **cells)
    worn = placed.phases.mean_wear.worn(np.ones((len(placed.sliding.pairs), len(placed.pair.weights))))
    beside, x, xs = 1 - along, placed.pair.punch.x, placed.pair.strip.x
    for pair in placed.sliding.pairs:
        felt = pair.opening(0 * pair.weights, worn.strip)
        for k in np.unique(x[:, along].round(6)):
            row = felt[np.abs(x[:, along] - k) < 1e-6]  # triangles divide the areas of their nodes unevenly
            np.testing.assert_allclose(row, row.mean(), rtol=0, atol=(0.15 if cells else 1e-6) * felt.max())
    assert worn.strip[np.abs(xs[:, beside]) > 0.75].max() == 0
    scar = scar_geometry(placed, placed.pair.strip)
    assert extents(worn.strip[None], scar.coordinates, scar.edges)[0, 1] == pytest.approx(1.0, rel=1e-9)  # its width
    slid = placed.sliding.motion.sliding().sum()
    assert placed.pair.strip.weights @ worn.strip == pytest.approx(2e-8 * slid, rel=1e-12)


@pytest.mark.parametrize("across", [2, 3, 4])
def test_edges_of_a_track_are_felt_as_deep_as_they_are(across: int) -> None:
    """Where the rims of pads lie within elements of the disc, each node feels the depth of its ring, not the step's."""
    sizes = {"across": across, "along": 2 * across, "around": 12 * across, "same_face": 1,
             "pad_layers": 1, "disc_layers": 1, "hub_elements": 1, "front_angle": 60, "back_angle": 30}  # fmt: skip
    told = ", ".join(f"{key}={value}" for key, value in sizes.items())
    more = ("wear={punch={coefficient=1e-8}, strip={coefficient=1e-9}}", "punch.loads.1.force=[0, 0, -5000]")
    pair = place_case(load_case("disc-brake-two-pads", [f"geometry.parameters={{{told}}}", *more])).pair
    depth = pair.wear_projection @ np.ones(len(pair.weights))
    felt = pair.opening(0 * pair.weights, depth)
    assert np.abs(felt * 4 - 1).max() < 0.1 / across, felt


def test_steady_state_is_the_optimum(assembled: Callable[..., Tribosystem]) -> None:
    """The punch's wear and the track's together are a rigid motion, in both."""
    system = assembled("pin-on-disc", *DISC)
    optimum, state = system.optimum(1), steady(system)
    np.testing.assert_allclose(state.pressure[0], optimum.pressure, rtol=1e-7, atol=1e-9)
    rigid = system.rigid.rigid_normal @ [state.velocity[name] for name in system.rigid.mode_names]
    np.testing.assert_allclose(state.wear_per_cycle, rigid, rtol=1e-8)
    alone = assembled("pin-on-disc", *DISC[:1], *DISC[2:]).optimum(1)
    assert np.abs(optimum.pressure - alone.pressure).max() > 0.01 * alone.pressure.max()


def test_part_of_a_triangle() -> None:
    """Below s = c the triangle (0, 0), (1, 0), (0, 1) with s = x + 2 y has the area of its clipped polygon."""
    s = np.sort(np.array([[0.0, 1.0, 2.0]] * 5), axis=1)
    found = _part_below(s, np.array([-1.0, 0.5, 1.0, 1.5, 3.0]))
    np.testing.assert_allclose(found, [0, 0.125, 0.5, 0.875, 1], atol=1e-14)


def test_rounding_sweeps_no_area(assembled: Callable[..., Tribosystem]) -> None:
    """The ball's rim ends where two nodes' areas meet, at either end of the stroke: both ends are swept alike."""
    sizes = "radius=5, contact_width=0.4, stroke=0.1, core=0.166, core_elements=4, across=6"
    whole = ("geometry.degree=1", "geometry.order=1", f"geometry.parameters={{{sizes}}}", "motion.amplitude='0.1 mm'")
    strip = assembled("ball-on-flat", *whole, "motion.positions=3").pair.strip
    ends = [strip.weights[np.abs(strip.x - (x, 0, 0)).sum(axis=1).argmin()] for x in (-0.3, 0.3)]
    assert ends[1] == pytest.approx(ends[0], rel=1e-6)
