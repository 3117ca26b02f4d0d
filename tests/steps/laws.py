"""What every time step of contact with stick must keep, in the plane and in solids."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.steps.stick_position import Position
from fenwear.steps.stick_state import Imposed, StickState


def check_laws(
    position: Position,
    before: StickState,
    state: StickState,
    end: Imposed,
    mu: float,
    load: float,
    close: float = 1e-9,
) -> None:
    """All laws of a step, from the displacements of both bodies rather than the compliance that was solved with."""
    p, t, s, n = state.pressure, state.traction, state.slip, len(state.pressure)
    size, top = np.linalg.norm(t, axis=1), p.max()
    assert (p >= 0).all()
    assert (size <= mu * p * (1 + 1e-12)).all(), "no node outside of the cone"
    assert (state.gap >= -1e-10 * np.abs(state.gap).max()).all()
    assert not (p * state.gap).any()
    if state.parts == 1:
        slid = np.linalg.norm(s, axis=1)
        moved = state.closed & (slid > 0)
        assert np.abs(size - mu * p)[moved].max(initial=0) < close * top, "what slips carries mu p"
        against = -np.einsum("nm,nm->n", t, s)
        assert np.abs(against - size * slid)[moved].max(initial=0) < 10 * close * top * slid.max(initial=0)
        turned = np.linalg.norm(size[:, None] * s + slid[:, None] * t, axis=1)  # of the first order in the angle
        assert turned[moved].max(initial=0) < 100 * close * top * slid.max(initial=0), "slip is against traction"
        inside = state.closed & (size < (1 - 1e-7) * mu * p)
        assert not slid[inside].any(), "it sticks inside"
    jumps = []
    for one in (before, state):
        moved_by = position.in_frame(one.on_punch - position.reading @ one.on_strip)
        jumps.append(moved_by + position.modes @ one.rigid - position.drive * one.displacement)
    scale = np.abs(jumps[1]).max()
    assert np.abs(jumps[1][:n] + end.opening - state.gap).max() < close * scale
    slips = (jumps[1] - jumps[0])[n:].reshape(-1, n).T
    assert np.abs(slips - s)[state.closed].max() < close * scale
    f = np.concatenate([p, t.T.ravel()])
    assert np.abs(position.balance @ f + end.loaded.resultant).max() < close * load
    if t.shape[1] == 1:
        assert state.force == pytest.approx(position.pair.weights @ t[:, 0], abs=close * load)


def check_energy(position: Position, before: StickState, state: StickState, end: Imposed, load: float) -> None:
    """Work of rig and load = what the bodies store + friction, which never gives any back at any node."""
    f = np.concatenate([state.pressure, state.traction.T.ravel()])
    force = position.in_space(f * position.weights)
    back = position.reading.T @ force
    stored = np.vdot(force, state.on_punch - before.on_punch) - np.vdot(back, state.on_strip - before.on_strip)
    each = -(state.traction * state.slip).sum(axis=1)
    assert each.min() >= 0
    closed = position.pair.weights @ (state.pressure * state.approach)
    work = state.force * (state.displacement - before.displacement)
    work += float(end.loaded.resultant @ (state.rigid - before.rigid))
    rubbed = float(position.pair.weights @ each)
    assert abs(work - stored - rubbed + closed) < 1e-8 * (abs(work) + abs(stored) + rubbed + 1e-8 * load)
