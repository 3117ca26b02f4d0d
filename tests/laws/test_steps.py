"""Steps of a table: screws between rows, exact for turns of any size."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from fenwear.case import Cycle
from fenwear.surfaces.motion import make_motion


def test_screws_take_one_row_to_the_next() -> None:
    """Half a step leads to the middle place, a whole one to the next row, about any centre."""
    rng = np.random.default_rng(3)
    rotations, shifts = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    rows = [[k, *r, *s] for k, (r, s) in enumerate(zip(rotations, shifts, strict=True))]
    rows.append([5.5, *rotations[0], *shifts[0]])
    columns = [f"{name}_{axis} ({unit})" for name, unit in (("rotation", "rad"), ("shift", "mm")) for axis in "xyz"]
    centre = (3.0, -1.0, 2.0)
    table = Cycle(kind="cycle", columns=["time (s)", *columns], rows=rows, centre=centre, positions="steps")  # type: ignore[arg-type]
    motion = make_motion(table)
    assert [phase.duration for phase in motion.phases] == [1, 1, 1, 2.5]
    x = rng.normal(size=(5, 3))

    def at(k: int) -> np.ndarray:
        k = k % 4
        return Rotation.from_rotvec(rotations[k]).apply(x - centre) + centre + shifts[k]

    for k, phase in enumerate(motion.phases):
        assert phase.field is not None
        np.testing.assert_allclose(phase.field.placement(1.0).points(at(k)), at(k + 1), atol=1e-12)
        np.testing.assert_allclose(phase.field.placement(0.5).points(at(k)), phase.place.points(x), atol=1e-11)
        # The velocity is that of the way: differences of it.
        moved = phase.field.placement(1e-5).points(at(k)) - phase.field.placement(-1e-5).points(at(k))
        np.testing.assert_allclose(phase.field.velocity(at(k)), moved / 2e-5, atol=1e-9)


def test_parts_of_steps() -> None:
    """Steps of unequal times, cut into parts, slide as much in all, at any exponent."""
    table = Cycle(kind="cycle", columns=["time (s)", "shift_x (mm)"], rows=[[0, 0], [1, 2], [4, 0]])  # type: ignore[arg-type]
    motion = make_motion(table).measured([2.0, 2.0])
    np.testing.assert_allclose(motion.sliding(), [2, 2])
    np.testing.assert_allclose(motion.sliding(2.0), [4, 4 / 3])
    parts = motion.in_parts(3)
    for exponent in (1.0, 2.0):
        np.testing.assert_allclose(parts.sliding(exponent).reshape(2, 3).sum(axis=1), motion.sliding(exponent))
    assert motion.time(np.array([1, 2])).tolist() == [4, 8]
