"""Cycles as tables: what a reciprocating motion does in another form, and rounds of any direction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import CaseError, Tribosystem, jump, load_case, march

POSITIONS = 3
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "geometry.parameters.overlap=3",
         'wear.strip={coefficient="1e-8 1/MPa"}')  # fmt: skip


def table(rows: list[list[float]], *columns: str) -> str:
    return f"motion={{kind='cycle', positions='steps', columns={['time (s)', *columns]}, rows={rows}}}"


def sine() -> str:
    """Return the reciprocating motion of example 1 as rows at its positions' ends."""
    half = load_case("example1").motion.half_period  # type: ignore[union-attr]
    times = np.linspace(0, 2 * half, 2 * POSITIONS + 1)
    return table([[float(t), float(-1.5 * np.cos(np.pi * t / half))] for t in times], "shift_x (mm)")


@pytest.mark.mpi
def test_a_sine_is_the_reciprocating_motion(assembled: Callable[..., Tribosystem]) -> None:
    """Pressures, depths of both bodies and totals to rounding, in marches of both kinds and in jumps."""
    known, own = assembled("example1", *SMALL, f"motion.positions={POSITIONS}"), assembled("example1", *SMALL, sine())
    runs = [
        (list(march(known, 20, implicit=implicit))[-1], list(march(own, 10, implicit=implicit))[-1])
        for implicit in (False, True)
    ]
    runs.append((list(jump(known, 20000, tolerance=1e-2))[-1], list(jump(own, 10000, tolerance=1e-2))[-1]))
    for one, other in runs:
        for body in ("punch", "strip"):
            depth = getattr(one.end.worn, body)
            np.testing.assert_allclose(getattr(other.end.worn, body), depth, rtol=0, atol=1e-12 * depth.max())
        for first, second in zip(one.end.contacts, other.end.contacts, strict=True):
            assert first is not None
            assert second is not None
            np.testing.assert_allclose(second.pressure, first.pressure, rtol=0, atol=1e-12 * first.pressure.max())
        np.testing.assert_allclose(other.end.totals.sums, one.end.totals.sums, rtol=1e-12)


def test_a_group_that_is_none(assembled: Callable[..., Tribosystem]) -> None:
    rows = "rows=[[0, 0, -1], [1, 1, -1], [2, 0, -1]], load={on='punch_top'}"
    motion = f"motion={{kind='cycle', columns=['time (s)', 'shift_x (mm)', 'force_z (N)'], {rows}}}"
    with pytest.raises(CaseError, match=r"motion\.load\.on: no physical curve 'punch_top'"):
        assembled("example1", *SMALL[:3], motion)


def test_a_step_that_opens_the_contact(assembled: Callable[..., Tribosystem]) -> None:
    turned = table([[0, 0], [1, 1], [2, 0]], "angle_y (deg)")
    with pytest.raises(CaseError, match=r"motion.rows: from row 1 to row 2 .* open the contact"):
        assembled("example1", *SMALL[:3], turned)
