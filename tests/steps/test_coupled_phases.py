"""Contact of all phases with the heat of its own cycle: one rule says which nodes conduct."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.common.arrays import Array
from fenwear.contact import ContactState
from fenwear.steps.coupled_phases import Coupled, DepthEvolution, Solved

CYCLES, NODE = 20.0, 3
SETTINGS = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "heat.conductance=perfect")


def pressed(system: Tribosystem, share: float, start: float) -> tuple[Coupled, Array, Solved]:
    """Return a step of so many cycles at whose end a node carries a share of the largest pressure, from another."""
    coupled, shape = Coupled(system, lambda _conditions: None), (len(system.motion.phases), len(system.pair.weights))
    heat = coupled.heat
    assert heat is not None

    def state(least: float) -> ContactState:
        pressure = np.linspace(10, 20, shape[1]) * np.ones((shape[0], 1))
        pressure[:, NODE] = least * pressure.max()
        return ContactState(pressure, np.zeros(shape), np.zeros((shape[0], 2)), 1)

    initial = heat.initial()
    passing = DepthEvolution(system.unworn(), CYCLES, lambda _: system.unworn(), 0.0)
    return coupled, initial, coupled.solve(initial, CYCLES, state(start), lambda *_: state(share), passing)


@pytest.mark.parametrize(("share", "start", "conducts"), [(0.0, 1.0, False), (1e-13, 0.5, False), (1e-3, 0.0, True)])
def test_one_rule_says_what_conducts(
    assembled: Callable[..., Tribosystem], share: float, start: float, conducts: bool
) -> None:
    """y = y_0 + N f(y) holds at each node, also where a pressure is nothing but for rounding.

    A node that conducts has one temperature on both surfaces over the last step; one that does not has two.
    """
    coupled, initial, solved = pressed(assembled("example1-heat", *SETTINGS), share, start)
    assert coupled.heat is not None
    assert solved.temperature is not None
    assert solved.conductances is not None
    assert (~np.isnan(solved.conductances[:, NODE]) == conducts).all()
    end = coupled.through(solved.temperature, solved.contact.pressure, solved.conductances)[-1]
    missed = solved.temperature - initial - CYCLES * (end - solved.temperature)
    exchange = coupled.heat.exchange
    rise = exchange.contact_changes((end - initial)[:, None])
    for part, whole in zip(exchange.contact_changes(missed[:, None]), rise, strict=True):
        assert np.abs(part).max() < 1e-9 * np.abs(whole).max()
    plan, parts = exchange.plans[-1][-1], np.split(end, [len(exchange.bases[0])])
    kinds = (plan.punch, plan.strip)
    punch, strip = (side.contacts[k](part) for side, k, part in zip(exchange.sides, kinds, parts, strict=True))
    apart = np.abs(punch - strip) / np.abs(punch).max()
    assert (apart[NODE] < 1e-9) == conducts
    assert np.delete(apart, NODE).max() < 1e-9
