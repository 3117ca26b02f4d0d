"""Signorini's conditions, looked at after the solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from half_space_ball import ball

from fenwear import Tribosystem, assemble, evolve, march, steady
from fenwear.checks import Seen, StateMonitor
from fenwear.contact import ContactState
from fenwear.contact.complementarity import complementarity_error
from fenwear.contact.condensed import CondensedContact
from fenwear.steps.jump_method import FINE
from fenwear.steps.jump_step import LOOSEST
from fenwear.surfaces import compliance

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=6", "geometry.parameters.growth=1.5")


@pytest.mark.parametrize(
    ("pressure", "gap", "error"),
    [
        ([2.0, 1.0, 0.0], [0.0, 0.0, 5.0], 0.0),
        ([2.0, 1.0, 0.0], [0.0, -0.02, 5.0], 0.1),  # overlap: 0.02 mm, 2 MPa open 0.2 mm
        ([2.0, -0.5, 0.0], [0.0, 0.0, 5.0], 0.25),  # pull
        ([2.0, 1.0, 0.0], [0.0, 0.02, 5.0], 0.1),  # pressure over a gap
        ([0.0, 0.0, 0.0], [0.1, 0.2, 5.0], 0.0),
    ],
)
def test_error(pressure: list[float], gap: list[float], error: float) -> None:
    """Each of the three conditions is seen, over the scales of both."""
    found = complementarity_error(np.array(pressure), np.array(gap), 0.1)
    assert found == pytest.approx(error, abs=1e-15)


def test_of_runs_and_steady_states(assembled: Callable[..., Tribosystem]) -> None:
    """What is solved fulfils them; partial contact as well."""
    system = assembled("example1", *SMALL)
    *_, block = march(system, 20)
    assert block.complementarity_error.max() < 1e-8
    state = steady(system)
    assert state.complementarity_error < 1e-8
    assert not [text for text in Seen.of_steady(system, state).warnings() if "p gap = 0" in text]


def test_jumps_solve_grids_to_a_share_of_their_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """The products of a grid cost by their digits, and the end of a jump has those that it needs; matrices have all."""

    def error(tolerance: float) -> float:
        blocks = evolve(assemble(ball(600.0)), 8, tolerance=tolerance)
        return max(float(block.complementarity_error.max()) for block in blocks)

    for tolerance in (0.1, 1e-4):
        assert error(tolerance) < FINE * min(tolerance, LOOSEST)
    monkeypatch.setattr(compliance, "on_one_grid", lambda *_: None)
    assert error(0.1) < 1e-12


def test_a_contact_that_lies(assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch) -> None:
    """F / A everywhere, as of two parts with one balance of forces: force and volume are right, and it is told."""
    system = assembled("example2", *SMALL)
    solve = CondensedContact.solve

    def lies(contact: CondensedContact, gap: np.ndarray, *args: object) -> ContactState:
        found = solve(contact, gap, *args)  # type: ignore[arg-type]
        even = np.full_like(found.pressure, system.rigid.mean_pressure)
        return replace(found, pressure=even, gap=found.gap + 1e-3 * np.linspace(-1, 1, even.shape[1]))

    monkeypatch.setattr(CondensedContact, "solve", lies)
    *_, block = march(system, 2)
    assert block.equilibrium_error.max() < 1e-12
    assert block.complementarity_error.min() > 0.05
    assert any("did not converge in half-cycle" in text for text in StateMonitor(system).see(block))
