"""Rate identities of curved and of several contacts: what is worn is k p s at every place, and all of it is metered."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fenwear import Tribosystem, jump, march
from fenwear.common.arrays import Array
from fenwear.surfaces.placement import in_space

PUNCH, STRIP, FRICTION = 1e-8, 3e-9, 0.3  # wear coefficients, 1/MPa
ROUND_Y, ROUND_Z = [[0.0, 2 * np.pi, 0.0]], [[0.0, 0.0, 2 * np.pi]]
SWING = [[0, 0, 0], [20, 0, 0], [25, -15, 10], [-5, -20, 30], [0, 0, 0]]  # of a ball, rotation vectors, degrees
TABLE = ", ".join(str([float(k), *map(float, row), -1000.0]) for k, row in enumerate(SWING))
COLUMNS = ["time (s)", "rotation_x (deg)", "rotation_y (deg)", "rotation_z (deg)", "force_z (N)"]
_ROWS = [Rotation.from_rotvec(np.array(row), degrees=True) for row in SWING]
STEPS = [list((b * a.inv()).as_rotvec()) for a, b in pairwise(_ROWS)]
CASES = {
    "bushing": (ROUND_Y, ("geometry.parameters.elements_along_contact=60",)),
    "drum-brake": (
        ROUND_Y,
        ("geometry.parameters.elements_along_lining=12", "geometry.parameters.elements_along_drum=60"),
    ),
    "disc-brake-two-pads": (
        ROUND_Z,
        ("geometry.parameters={across=2, along=3, around=12, hub_elements=1, pad_layers=1, disc_layers=2}",),
    ),
    "ball-in-cup": (
        STEPS,
        (
            "geometry.parameters={clearance=0.02, contact_angle=60, across=4, around=2, cup_layers=1, ball_layers=1, "
            "overlap_angle=45, overlap_elements=3}",
            f"motion={{kind='cycle', columns={COLUMNS}, rows=[{TABLE}], "
            "load={on='punch_back', through=[0, 0, 0]}}",
        ),
    ),
}  # fmt: skip


def ways(system: Tribosystem, turns: list[list[float]]) -> Array:
    """Return the way past each contact node by turns of the strip about the origin (m, 3), rad: (m, n), mm."""
    found = []
    for turn, pair in zip(turns, system.sliding.pairs, strict=True):
        moved, normal = np.cross(turn, in_space(pair.opposite)), in_space(pair.normal)
        along = moved - np.einsum("ic,ic->i", moved, normal)[:, None] * normal
        found.append(np.linalg.norm(along, axis=1))
    return np.array(found)


@pytest.mark.parametrize("name", CASES)
def test_what_is_worn_is_k_p_s_everywhere(assembled: Callable[..., Tribosystem], name: str) -> None:
    """At every node of the punch k sum of p s, also over k by the energy of friction; volumes by depth are metered.

    The ways are those of the turns themselves, here about three axes for the ball; in marches and in jumps.
    """
    turns, settings = CASES[name]
    wears = (f"wear={{punch={{coefficient={PUNCH}}}, strip={{coefficient={STRIP}}}}}", f"contact.friction={FRICTION}")
    system = assembled(name, *settings, *wears, "geometry.follow_wear=never")
    pair, thick, slid = system.pair, system.bodies.punch.thickness, ways(system, turns)
    if name == "ball-in-cup":  # its axes pass through the contact: nodes slide what their areas do, not their places
        by_area = system.phases.wear.sliding[0]
        np.testing.assert_allclose(by_area, slid, rtol=0, atol=0.05 * slid.max())
        slid = by_area
    end, dose, volume = None, np.zeros(len(pair.weights)), 0.0
    for cycle in range(3):
        *_, last = march(system, cycle + 1, start=end)
        end = last.end
        for k, (contact, way) in enumerate(zip(end.contacts, slid, strict=True)):
            assert contact is not None
            dose += contact.pressure[0] * way
            volume += thick * float(system.sliding.pairs[k].weights @ (contact.pressure[0] * way))
    np.testing.assert_allclose(end.worn.punch, PUNCH * dose, rtol=0, atol=1e-9 * end.worn.punch.max())
    assert float(end.totals.of("volume_punch")) == pytest.approx(PUNCH * volume, rel=1e-9)
    *_, jumped = jump(system, 1000, tolerance=0.03, start=end)
    for state in (end, jumped.end):
        worn, totals = state.worn, state.totals
        np.testing.assert_allclose(worn.punch, PUNCH * totals.energy / FRICTION, rtol=0, atol=1e-12 * worn.punch.max())
        by_depth = [thick * float(pair.weights @ worn.punch), thick * float(pair.strip.weights @ worn.strip)]
        metered = [float(totals.of("volume_punch")), float(totals.of("volume_strip"))]
        rings = name == "disc-brake-two-pads"  # whose areas are those of circles, the mesh's those of chords
        np.testing.assert_allclose(by_depth, metered, rtol=2e-4 if rings else 1e-6)
        assert metered[1] == pytest.approx(STRIP / PUNCH * metered[0], rel=1e-12)
        assert metered[0] == pytest.approx(PUNCH * float(totals.of("work")) / FRICTION, rel=1e-12)
        assert worn.strip.min() >= 0
