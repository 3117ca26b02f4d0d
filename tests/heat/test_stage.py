"""Stages of few nodes as matrices: what they make of states, changes and the heat balance is what each stage solves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear.heat.heat_exchange import HeatExchange

Make = Callable[..., Any]
COARSE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=12", "heat.steps=3")
TRACK = (
    "motion={kind='one-way', direction='rightward', speed=200, duration=0.2}",
    "strip.temperatures=[]",
    "heat.track={heat_capacity='40 J/K', loss='0.5 W/K'}",
)
CASES = {
    "to and fro": ("heat.convection=0.5", "heat.ambient=35", "heat.initial=-10"),
    "some nodes open": ("heat.convection=0.5", "heat.conducting='closed'", "heat.partition=0.2"),
    "debris, a conductance": ("heat.debris=0.3", "heat.conductance=2.0"),
    "one way": ("motion={kind='one-way', direction='leftward', speed=200, duration=0.2}", "heat.ambient=35"),
    "closed track": TRACK,
}


def conducted(exchange: HeatExchange, few: int, patch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Return states, terms and changes of a few half-cycles, by matrices up to so many nodes."""
    patch.setattr("fenwear.heat.heat_exchange.FEW", few)
    exchange._forget()
    n, state, found = len(exchange.weights), exchange.initial(), []
    pressure = np.linspace(0.0, 3.0, n)
    for half_cycle in range(4):
        phase = half_cycle % len(exchange.plans)
        conductance = exchange.conductance(pressure)
        state, terms = exchange.half_cycle(state, phase, pressure, conductance)
        found += [state.values, terms, *exchange.contact_temperatures(state, phase)]
    few_changes = np.eye(len(state.values), 5)
    found += exchange.change(0, conductance, few_changes, np.eye(n, 5))
    return found


@pytest.mark.parametrize("name", CASES)
def test_matrices_are_what_each_stage_solves(assembled: Make, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same states, terms and changes as with fluxes that are solved for in each stage from both bodies' steps."""
    exchange = assembled("example1-heat", *COARSE, *CASES[name]).exchange
    assert exchange.reduced
    by_matrices, by_solving = (conducted(exchange, few, monkeypatch) for few in (300, 0))
    exchange._forget()
    for one, other in zip(by_matrices, by_solving, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-11 * max(float(np.abs(other).max()), 1e-3))
