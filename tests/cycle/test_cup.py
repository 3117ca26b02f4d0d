"""A ball in a cup, against rigid limits; both worn, with the ball's material turning under the cup."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, jump, march, steady

RADIUS, FORCE, RATE = 14.0, 1000.0, 1e-9
COARSE = (
    "geometry.parameters={radius=14, clearance=0, contact_angle=90, across=4, around=3, cup_layers=1, ball_layers=1, "
    "overlap_angle=5}",
    "contact.friction=0",
)
AXIS = np.array([np.cos(np.radians(95.6)), np.sin(np.radians(95.6)), 0.0])  # square to the pole, through no node


def turning(angles: list[float], **more: str) -> str:
    """Return the motion about the axis through these angles in degrees, under a constant force along the pole."""
    turns = np.radians(np.array(angles))[:, None] * AXIS
    rows = [[float(k), *(float(c) for c in turn), -FORCE] for k, turn in enumerate(turns)]
    columns = ["time (s)", "rotation_x (rad)", "rotation_y (rad)", "rotation_z (rad)", "force_z (N)"]
    further = "".join(f", {key}={value}" for key, value in more.items())
    return (
        f"motion={{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_back', through=[0,0,0]}}{further}}}"
    )


@pytest.mark.mpi
def test_steady_state_of_a_cup(assembled: Callable[..., Tribosystem]) -> None:
    """Verification 43: p = p_0 cos(longitude about the axis), and the approach of a cycle, whatever the bodies."""
    system = assembled("ball-in-cup", *COARSE, turning([-20, 20, -20]))
    state, normal = steady(system), system.pair.normal
    longitude = normal[:, 2] / np.linalg.norm(np.cross(normal, AXIS), axis=1)
    largest = 4 * FORCE / (np.pi**2 * RADIUS**2)
    np.testing.assert_allclose(state.phase_pressure, np.tile(largest * longitude, (2, 1)), atol=0.01 * largest)
    angle = np.radians(80)
    assert state.velocity["lambda_F"] == pytest.approx(4 * RATE * angle * FORCE / (np.pi**2 * RADIUS), rel=5e-4)
    volume = float((state.wear_per_cycle * system.pair.weights).sum())
    assert volume == pytest.approx(4 / np.pi * RATE * FORCE * angle * RADIUS, rel=2e-3)
    # All that touches wears by one rigid motion; at the rim, whose normals are square to it, a few nodes do not.
    spread = (state.wear_per_cycle - state.velocity["lambda_F"] * normal[:, 2])[state.pressure[0] > 0]
    assert np.abs(spread).max() < 1e-9 * state.wear_per_cycle.max()


def test_growing_contact(assembled: Callable[..., Tribosystem]) -> None:
    """Verification 44: sliding, volume and depth of a cup with clearance at 30, 60 and 85 degrees from the pole.

    With stiff bodies the limit is of rigid ones; what they give way, 1.5 um, is a tenth of the depth at 30 degrees.
    """
    clearance, way = 0.1, RADIUS * np.radians(80)
    stiff = ("geometry.parameters.clearance=0.1", "materials.polyethylene.young='20 GPa'", "geometry.follow_wear=never",
             "materials.cobalt-chromium.young='1000 TPa'")  # fmt: skip
    system = assembled("ball-in-cup", *COARSE, *stiff, turning([-20, 20, -20]))
    height, end = system.pair.normal[:, 2], None
    for angle, slid, volume, share in (
        (30, 0.06362049, 0.06511247, 0.1),
        (60, 1.425326, 1.570796, 0.012),
        (85, 24.33386, 30.03636, 0.004),
    ):
        cycles = round(slid * RADIUS**2 * clearance / (RATE * FORCE * way))
        *_, last = jump(system, cycles, tolerance=3e-3, start=end)
        end, depth = last.end, last.end.worn.punch
        assert system.pair.weights @ depth == pytest.approx(volume * RADIUS**2 * clearance, rel=2e-3)
        rigid = np.maximum(clearance * (height / np.cos(np.radians(angle)) - 1), 0)
        np.testing.assert_allclose(depth, rigid, rtol=0, atol=share * rigid.max())


def test_both_bodies_worn_under_turns(assembled: Callable[..., Tribosystem]) -> None:
    """Volumes by depth on every material point are those metered and k sum of p s; the ball has its scar turned."""
    wide = (*COARSE, "geometry.parameters.overlap_angle=25", "geometry.parameters.overlap_elements=2",
            "wear.strip.coefficient=3e-10")  # fmt: skip
    system = assembled("ball-in-cup", *wide, turning([0, 20, 0]))
    *_, last = march(system, 3)
    pair, end = system.pair, last.end
    volumes = pair.weights @ end.worn.punch, pair.strip.weights @ end.worn.strip
    np.testing.assert_allclose(volumes, [end.totals.of("volume_punch"), end.totals.of("volume_strip")], rtol=1e-12)
    assert volumes[1] == pytest.approx(0.3 * volumes[0], rel=1e-12)
    pressed = sum(
        float(c.pressure[0] @ (pair.weights * s)) for c, s in zip(end.contacts, system.path, strict=True) if c
    )
    assert volumes[0] == pytest.approx(3 * RATE * pressed, rel=1e-6)
    assert end.worn.strip.min() >= 0
    # In the middle of both steps the ball has turned by 10 degrees: its own scar lies as far back.
    middles = [(w * d) @ n for w, d, n in ((pair.weights, end.worn.punch, pair.normal),
                                          (pair.strip.weights, end.worn.strip, pair.strip.outward))]  # fmt: skip
    on_cup, on_ball = (middle / np.linalg.norm(middle) for middle in middles)
    assert np.degrees(np.cross(on_cup, on_ball) @ AXIS) == pytest.approx(-np.degrees(np.sin(np.radians(10))), abs=0.1)


def test_bad_cups(assembled: Callable[..., Tribosystem]) -> None:
    """A ball that turns out of its meshed surface, and about another point than its middle."""
    wears = "wear.strip.coefficient=3e-10"
    with pytest.raises(CaseError, match="runs off the meshed strip"):
        assembled("ball-in-cup", *COARSE, wears, turning([0, 60, 0]))
    with pytest.raises(CaseError, match=r"motion\.rows: from row 1 to row 2 .* open the contact"):
        assembled("ball-in-cup", *COARSE, turning([0, 20, 0], centre="[5, 0, 5]"))
