"""Random steps of solids with stick, unlike bodies and any direction: the laws, equilibrium and the energy of each."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import check_energy, check_laws

from fenwear import load_case
from fenwear.common.errors import ConvergenceError
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_position import Position
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import Imposed

LOAD = 50.0
COARSE = (
    "geometry.parameters={radius='10 mm', contact_width='0.4 mm', stroke='0 mm', across=4, margin_elements=1,"
    " ball_layers=2, flat_layers=2}",
    "materials.soft={young='70 GPa', poisson=0.1}",
    "punch.regions={punch_body='soft'}",
)


@lru_cache
def unlike() -> StickInterface:
    interface = partial_slip_problem(load_case("fretting-sphere", list(COARSE))).interface
    assert isinstance(interface, StickInterface)
    return interface


def pulled(angle: float) -> Position:
    """Return the bodies with a rig that moves the strip in any direction in the contact."""
    middle = unlike().middle
    n = len(middle.pair.weights)
    drive = np.repeat([0.0, np.cos(angle), np.sin(angle)], n)
    return replace(middle, drive=drive)


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
    check_laws(position, untouched(interface), before, end, mu, LOAD)
    for load, drive, strain in path:
        if by_force and abs(before.force) > 0.95 * mu * load * LOAD:
            continue  # on the way the force would be more than friction can hold
        how = {"displacement": None, "force": drive * mu * load * LOAD} if by_force else {"displacement": 3e-3 * drive}
        end = Imposed(loaded.times(load), gap, strain=strain, **how)
        if by_force:
            start = replace(start, displacement=None, force=before.force)
        state = advance(interface, before, start, end, friction, position)
        check_laws(position, before, state, end, mu, LOAD)
        if state.parts == 1:
            check_energy(position, before, state, end, LOAD)
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
