"""A ball in a cup, both worn, the ball's material turning under the cup; rigid limits stand in the verification."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fenwear import CaseError, Tribosystem, march
from fenwear.common.arrays import Array

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
        float(c.pressure[0] @ (pair.weights * s))
        for c, s in zip(end.contacts, system.sliding.path, strict=True)
        if c.solved
    )
    assert volumes[0] == pytest.approx(3 * RATE * pressed, rel=1e-6)
    assert end.worn.strip.min() >= 0
    # In the middle of both steps the ball has turned by 10 degrees: its own scar lies as far back.
    middles = [(w * d) @ n for w, d, n in ((pair.weights, end.worn.punch, pair.normal),
                                          (pair.strip.weights, end.worn.strip, pair.strip.outward))]  # fmt: skip
    on_cup, on_ball = (middle / np.linalg.norm(middle) for middle in middles)
    assert np.degrees(np.cross(on_cup, on_ball) @ AXIS) == pytest.approx(-np.degrees(np.sin(np.radians(10))), abs=0.1)


def about_axes() -> tuple[str, list[Rotation]]:
    """Return the motion through turns about several axes, and where the ball is in the middle of each step."""
    places = [Rotation.from_rotvec(np.array(one), degrees=True) for one in ([0, 0, 0], [14, 4, 0], [5, -12, 16])]
    places.append(places[0])
    rows = [[float(k), *map(float, place.as_rotvec(degrees=True)), -FORCE] for k, place in enumerate(places)]
    columns = ["time (s)", "rotation_x (deg)", "rotation_y (deg)", "rotation_z (deg)", "force_z (N)"]
    motion = f"motion={{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_back', through=[0,0,0]}}}}"
    turns = [(b * a.inv()).as_rotvec() for a, b in pairwise(places)]
    return motion, [Rotation.from_rotvec(turn / 2) * a for turn, a in zip(turns, places, strict=False)]


@pytest.mark.slow
def test_both_bodies_wear_point_by_point(assembled: Callable[..., Tribosystem]) -> None:
    """The cup's nodes lose k sum of p s of their own; the ball's material what the cup had where it was turned to.

    Turns are about three axes. On the ball as means over 2 mm around its nodes, by the nodes of either mesh: an error
    that falls with the meshes.
    """
    errors, (motion, middles) = [], about_axes()
    for across, around, overlap in ((4, 3, 2), (6, 4, 4)):
        finer = (
            f"geometry.parameters={{across={across}, around={around}, overlap_elements={overlap}, overlap_angle=25}}"
        )
        system = assembled("ball-in-cup", *COARSE, finer, "wear.strip.coefficient=3e-10", motion)
        *_, last = march(system, 1)
        end, cup, ball = last.end, system.pair, system.pair.strip
        doses = [
            RATE * way * c.pressure[0] for c, way in zip(end.contacts, system.sliding.path, strict=True) if c.solved
        ]
        np.testing.assert_allclose(end.worn.punch, sum(doses), rtol=0, atol=1e-12 * end.worn.punch.max())
        volume = 0.3 * cup.weights @ sum(doses)
        assert ball.weights @ end.worn.strip == pytest.approx(volume, rel=1e-12)
        centres = ball.x[np.linalg.norm(ball.x[:, :2], axis=1) < 0.8 * RADIUS]

        def means(x: Array, weights: Array, depth: Array, centres: Array = centres) -> Array:
            near = np.exp(-((x[:, None] - centres) ** 2).sum(axis=2) / (2 * 2.0**2))
            return np.asarray((weights * depth) @ near / (weights @ near))

        wanted: Array = np.zeros(len(centres))
        for dose, middle in zip(doses, middles, strict=True):
            wanted += means(middle.inv().apply(cup.punch.x), cup.weights, 0.3 * dose)
        errors.append(float(np.abs(means(ball.x, ball.weights, end.worn.strip) - wanted).max() / wanted.max()))
    assert errors[1] < errors[0] / 2, errors
    assert errors[1] < 0.025


def test_bad_cups(assembled: Callable[..., Tribosystem]) -> None:
    """A ball that turns out of its meshed surface, and about another point than its middle."""
    wears = "wear.strip.coefficient=3e-10"
    with pytest.raises(CaseError, match="runs off the meshed strip"):
        assembled("ball-in-cup", *COARSE, wears, turning([0, 60, 0]))
    with pytest.raises(CaseError, match=r"motion\.rows: .*1.*2"):
        assembled("ball-in-cup", *COARSE, turning([0, 20, 0], centre="[5, 0, 5]"))
