"""One step of contact with stick: the laws, equilibrium, energy; other methods; bad input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from laws import check_energy, check_laws

from fenwear import load_case
from fenwear.checks import unique_text
from fenwear.common.errors import ConvergenceError
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.steps.stick_equations import project
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.steps.stick_state import Imposed, StickState, TimeStepRecords
from fenwear.surfaces import Interface

RADIUS, LOAD = 200.0, 100.0
SOFT_ON_STIFF = (
    "geometry.parameters.elements_along_contact=12",
    "geometry.parameters.overlap='0.6 mm'",
    "motion.amplitude='100 um'",
    "motion.positions=1",
    "stick.steps=8",
    "materials.soft={young='40 GPa', poisson=0}",
    "punch.regions={punch_body='soft'}",
)
MU = 0.5


def imposed(interface: StickInterface, **how: float | None) -> Imposed:
    x = interface.middle.pair.x
    return Imposed(interface.loaded(None), x**2 / (2 * RADIUS), **how)


def pressed(interface: StickInterface, mu: float = MU) -> tuple[StickState, Imposed]:
    end = imposed(interface)
    start = replace(end, loaded=end.loaded.times(0))
    return advance(interface, untouched(interface), start, end, np.full(len(end.opening), mu)), end


paths = st.lists(st.tuples(st.floats(0.2, 1.5), st.floats(-0.9, 0.9), st.floats(-2e-4, 2e-4)), min_size=1, max_size=6)


@given(path=paths, mu=st.sampled_from([0.05, 0.3, 0.7]), by_force=st.booleans())
@example(path=[(1.0, 0.5, 0.0), (0.3, 0.1, 0.0)], mu=0.7, by_force=True)
def test_random_paths(unlike: Callable[[], StickInterface], path: list, mu: float, by_force: bool) -> None:
    """Whatever load, force or displacement, and strain: cone, slip against traction, stick inside, energy."""
    interface = unlike()
    before, start = pressed(interface, mu)
    friction = np.full(len(start.opening), mu)
    for load, drive, strain in path:
        how = {"displacement": None, "force": drive * mu * load * LOAD} if by_force else {"displacement": drive * 2e-3}
        end = imposed(interface, strain=strain, **how)
        end = replace(end, loaded=end.loaded.times(load))
        if by_force:
            start = replace(start, displacement=None, force=before.force)
        if by_force and abs(before.force) > 0.95 * mu * load * LOAD:
            continue  # on the way the force would be more than friction can hold
        state = advance(interface, before, start, end, friction)
        check_laws(interface.middle, before, state, end, mu, LOAD)
        if state.parts == 1:
            check_energy(interface.middle, before, state, end, LOAD)
        before, start = state, end


def test_alternation_finds_the_same(unlike: Callable[[], StickInterface]) -> None:
    """Normal contact by PETSc's inequality, alternated with the projection of the tractions at its pressures."""
    interface = unlike()
    before, start = pressed(interface)
    end = imposed(interface, displacement=1.2e-3)
    friction = np.full(len(end.opening), MU)
    state = advance(interface, before, start, end, friction)
    position, n = interface.middle, len(end.opening)
    assert 0 < state.sticking.sum() < state.closed.sum()
    joined = Interface(position.rigid, interface.punch, interface.strip, strip_moves=False)
    normal = CondensedContact([SlidingContact(joined, np.zeros((n, 2)))])
    every, t = np.arange(2 * n), before.traction
    C = position.compliance.entries(every, every)
    pace = 0.9 / np.linalg.norm(C[n:, n:], 2)
    free = end.loaded.on_punch - before.on_punch - position.reading @ (end.loaded.on_strip - before.on_strip)
    moved = position.in_frame(free)[n:] - position.drive[n:] * 1.2e-3
    for _ in range(400):
        contact = normal.solve(end.opening + C[:n, n:] @ t[:, 0])
        p = contact.pressure[0]
        for _ in range(200):
            slip = C[n:, :n] @ p + C[n:, n:] @ t[:, 0] + moved
            t = project(t - pace * slip[:, None], MU * p)
        if np.abs(t - state.traction).max() < 1e-8 * p.max():
            break
    assert np.abs(p - state.pressure).max() < 1e-7 * p.max()
    assert np.abs(t - state.traction).max() < 1e-7 * p.max()


@pytest.mark.parametrize("direction", [1, -1])
def test_gross_sliding_is_the_limit(unlike: Callable[[], StickInterface], direction: int) -> None:
    """After a long stroke every node slips, with the pressures of contact of known direction."""
    interface = unlike()
    state, start = pressed(interface)
    end = imposed(interface, displacement=direction * 0.05)
    state = advance(interface, state, start, end, np.full(len(end.opening), MU))
    joined = Interface(interface.middle.rigid, interface.punch, interface.strip, strip_moves=False)
    ratio = direction * MU * interface.middle.frame[:, 1]
    sliding = CondensedContact([SlidingContact(joined, ratio)]).solve(end.opening)
    assert not state.sticking.any()
    assert np.abs(state.pressure - sliding.pressure[0]).max() < 1e-9 * state.pressure.max()
    assert state.force == pytest.approx(direction * MU * LOAD, rel=1e-9)


def test_more_force_than_friction_holds(unlike: Callable[[], StickInterface]) -> None:
    """It is told what the contact can carry, and what starts there."""
    interface = unlike()
    state, start = pressed(interface)
    start = replace(start, displacement=None, force=0.0)
    end = imposed(interface, displacement=None, force=1.01 * MU * LOAD)
    with pytest.raises(ConvergenceError, match=r"gross sliding starts: the tangential force .* reaches mu P = 50"):
        advance(interface, state, start, end, np.full(len(end.opening), MU))
    end = replace(end, force=0.99 * MU * LOAD)
    assert advance(interface, state, start, end, np.full(len(end.opening), MU)).sticking.any()


def test_friction_too_large_is_seen() -> None:
    """Soft on stiff: with mu = 6 Newton meets pieces of both orientations, and what is taken is said; with 0.9 none."""
    found = {}
    for mu in (0.9, 6.0):
        case = load_case("fretting-partial-slip", [*SOFT_ON_STIFF, f"contact.friction={mu}"])
        problem = partial_slip_problem(case)
        records = TimeStepRecords.joined(problem.cycle(problem.beginning())[1])
        found[mu] = records.unique.astype(bool)
    assert found[0.9].all()
    assert unique_text(found[0.9]) == ""
    assert not found[6.0].all()
    text = unique_text(found[6.0])
    assert text.startswith("contact.friction: ")
    assert f"{(~found[6.0]).sum()} of 16 time steps" in text
