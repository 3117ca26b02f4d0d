"""Random steps of solids with stick, unlike bodies and any direction: the laws, equilibrium and the energy of each."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fenwear import load_case
from fenwear.errors import ConvergenceError
from fenwear.stick import Imposed, Position, StickInterface, StickState, advance, untouched
from fenwear.stick.setup import make_rig

LOAD = 50.0
COARSE = (
    "geometry.parameters={radius='10 mm', contact_width='0.4 mm', stroke='0 mm', across=4, margin_elements=1,"
    " ball_layers=2, flat_layers=2}",
    "materials.soft={young='70 GPa', poisson=0.1}",
    "punch.regions={punch_body='soft'}",
)


@lru_cache
def unlike() -> StickInterface:
    interface = make_rig(load_case("fretting-sphere", list(COARSE))).interface
    assert isinstance(interface, StickInterface)
    return interface


def pulled(angle: float) -> Position:
    """Return the bodies with a rig that moves the strip in any direction in the contact."""
    middle = unlike().middle
    n = len(middle.pair.weights)
    drive = np.repeat([0.0, np.cos(angle), np.sin(angle)], n)
    return replace(middle, drive=drive)


def check(position: Position, before: StickState, state: StickState, end: Imposed, mu: float) -> None:
    """All laws, from the displacements of both bodies rather than the compliance that was solved with."""
    p, t, s, n = state.pressure, state.traction, state.slip, len(state.pressure)
    size, top = np.linalg.norm(t, axis=1), p.max()
    assert (p >= 0).all()
    assert (size <= mu * p * (1 + 1e-12)).all(), "no node outside of the cone"
    assert (state.gap >= -1e-10 * np.abs(state.gap).max()).all()
    assert not (p * state.gap).any()
    if state.parts == 1:
        slid = np.linalg.norm(s, axis=1)
        moved = state.closed & (slid > 0)
        assert np.abs(size - mu * p)[moved].max(initial=0) < 1e-8 * top, "what slips carries mu p"
        against = -np.einsum("nm,nm->n", t, s)
        assert np.abs(against - size * slid)[moved].max(initial=0) < 1e-8 * top * slid.max(initial=0)
        inside = state.closed & (size < (1 - 1e-7) * mu * p)
        assert not slid[inside].any(), "it sticks inside"
    jumps = []
    for one in (before, state):
        moved_by = position.in_frame(one.on_punch - position.reading @ one.on_strip)
        jumps.append(moved_by + position.modes @ one.rigid - position.drive * one.displacement)
    scale = np.abs(jumps[1]).max()
    assert np.abs(jumps[1][:n] + end.opening - state.gap).max() < 1e-9 * scale
    slips = (jumps[1] - jumps[0])[n:].reshape(2, n).T
    assert np.abs(slips - s)[state.closed].max() < 1e-9 * scale
    f = np.concatenate([p, t.T.ravel()])
    assert np.abs(position.balance @ f + end.loaded.resultant).max() < 1e-9 * LOAD


def energy(position: Position, before: StickState, state: StickState, end: Imposed) -> None:
    """Work of rig and load = what the bodies store + friction; friction never gives any back."""
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
    assert abs(work - stored - rubbed + closed) < 1e-8 * (abs(work) + abs(stored) + rubbed + 1e-8 * LOAD)


paths = st.lists(st.tuples(st.floats(0.3, 1.5), st.floats(-0.9, 0.9), st.floats(-1e-4, 1e-4)), min_size=1, max_size=5)


@given(path=paths, mu=st.sampled_from([0.05, 0.3, 0.8]), angle=st.floats(0, 6.28), by_force=st.booleans())
def test_random_paths(path: list, mu: float, angle: float, by_force: bool) -> None:
    """Whatever load, force or displacement, in any direction, and bulk strain."""
    interface, position = unlike(), pulled(angle)
    loaded, gap = interface.loaded(None), position.pair.initial_gap
    friction = np.full(len(gap), mu)
    start = Imposed(loaded.times(0), gap)
    end = replace(start, loaded=loaded)
    before, start = advance(interface, untouched(interface), start, end, friction, position), end
    check(position, untouched(interface), before, end, mu)
    for load, drive, strain in path:
        if by_force and abs(before.force) > 0.95 * mu * load * LOAD:
            continue  # on the way the force would be more than friction can hold
        how = {"displacement": None, "force": drive * mu * load * LOAD} if by_force else {"displacement": 3e-3 * drive}
        end = Imposed(loaded.times(load), gap, strain=strain, **how)
        if by_force:
            start = replace(start, displacement=None, force=before.force)
        state = advance(interface, before, start, end, friction, position)
        check(position, before, state, end, mu)
        if state.parts == 1:
            energy(position, before, state, end)
        before, start = state, end


def test_more_force_than_friction_holds() -> None:
    """In any direction it is told what the contact carries."""
    interface, position = unlike(), pulled(1.0)
    loaded, gap = interface.loaded(None), position.pair.initial_gap
    friction = np.full(len(gap), 0.5)
    start = Imposed(loaded.times(0), gap)
    end = replace(start, loaded=loaded)
    state, start = advance(interface, untouched(interface), start, end, friction, position), end
    start, end = replace(start, displacement=None, force=0.0), replace(start, displacement=None, force=0.51 * LOAD)
    with pytest.raises(ConvergenceError, match=r"gross sliding starts: the tangential force 25\.5 reaches mu P = 2"):
        advance(interface, state, start, end, friction, position)
