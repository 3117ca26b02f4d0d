"""Heat over whole cycles against the same half-cycles one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.common.arrays import Array
from fenwear.heat.periodic_heat import CycleHeat
from fenwear.heat.temperature import HeatState
from fenwear.steps.coupled_phases import cycle_heat

# Faces that convect and no debris: all losses, and a strong feedback.
COARSE = (
    "geometry.parameters.elements_along_contact=4",
    "geometry.degree=2",
    "heat.convecting_faces=true",
    "heat.debris=0",
)
WARM = ("heat.initial=-10", "heat.ambient=35", "strip.temperatures=[{on='strip_bottom', temperature=-30}]")


@pytest.fixture(params=["reciprocating", "one-way"])
def heat(request: pytest.FixtureRequest, assembled: Callable[..., Tribosystem]) -> tuple[CycleHeat, Array, Array]:
    """Return the maps of cycles, pressures of the phases with open nodes, and the conductances there."""
    one_way = ("motion={kind='one-way', direction='leftward', speed=9.5, duration=3}",)
    system = assembled("example1-heat", *COARSE, *WARM, *(one_way if request.param == "one-way" else ()))
    cycles = cycle_heat(system)
    assert cycles is not None
    x = system.pair.x
    pressure = np.array([np.maximum(17 + d * x, 0.0) for d in system.motion.directions])
    return cycles, pressure, cycles.conductances(pressure)


def follow(heat: CycleHeat, state: HeatState, pressure: Array, conductances: Array) -> tuple[HeatState, list[Array]]:
    """Return the end of a cycle, half-cycle by half-cycle, and the thermal gap at the end of each."""
    gaps = []
    for phase in range(len(pressure)):
        state, _ = heat.exchange.half_cycle(state, phase, pressure[phase], conductances[phase])
        gaps.append(heat.exchange.gap(state, phase))
    return state, gaps


@pytest.mark.mpi
def test_infinitely_many_cycles_are_the_fixed_point(heat: tuple[CycleHeat, Array, Array]) -> None:
    """A cycle from the periodic state ends where it began, with the thermal gaps of the jump on its way."""
    cycles, pressure, conductances = heat
    end = cycles.jump(cycles.initial(), np.inf, conductances)
    state = end.state(pressure)
    after, gaps = follow(cycles, cycles.exchange.at(state), pressure, conductances)
    np.testing.assert_allclose(after.values, state, rtol=0, atol=1e-9 * np.abs(state).max())
    linear = end.gap + np.einsum("ikjl,jl->ik", end.coupling(np.ones_like(pressure)), pressure)
    np.testing.assert_allclose(linear, gaps, rtol=0, atol=1e-9 * np.abs(gaps).max())


def test_many_cycles_tend_to_the_periodic_state(heat: tuple[CycleHeat, Array, Array]) -> None:
    """Cycle by cycle, from the initial temperature: the same end, found without any linear algebra."""
    cycles, pressure, conductances = heat
    state = cycles.exchange.at(cycles.initial())
    for _ in range(3000):
        state, _ = follow(cycles, state, pressure, conductances)
    periodic = cycles.exchange.at(cycles.jump(cycles.initial(), np.inf, conductances).state(pressure))
    surfaces = [np.array(cycles.exchange.contact_temperatures(s)) for s in (state, periodic)]
    assert np.ptp(surfaces[1]) > 5
    np.testing.assert_allclose(surfaces[0], surfaces[1], rtol=0, atol=0.01)


@pytest.mark.mpi
def test_a_jump_is_an_implicit_step(heat: tuple[CycleHeat, Array, Array]) -> None:
    """N cycles at once: s1 = s0 + N (C s1 - s1), C the cycle that starts from s1; its gaps are of that cycle."""
    cycles, pressure, conductances = heat
    for count in (0.5, 1.0, 40.0):
        start = cycles.initial()
        end = cycles.jump(start, count, conductances)
        state = end.state(pressure)
        after, gaps = follow(cycles, cycles.exchange.at(state), pressure, conductances)
        change = count * (after.values - state)
        np.testing.assert_allclose(state - start, change, rtol=0, atol=1e-8 * np.abs(state).max())
        linear = end.gap + np.einsum("ikjl,jl->ik", end.coupling(np.ones_like(pressure)), pressure)
        np.testing.assert_allclose(linear, gaps, rtol=0, atol=1e-9 * np.abs(gaps).max())


@pytest.mark.parametrize("updated", [0.0, 1.0], ids=["own factor", "factor of other nodes"])
def test_many_nodes_take_the_same_way(
    heat: tuple[CycleHeat, Array, Array], monkeypatch: pytest.MonkeyPatch, updated: float
) -> None:
    """By factors of the fluxes, or by those of other nodes and what they are changed by: the same maps of a cycle."""
    cycles, pressure, conductances = heat
    expected = cycles.cycle(conductances)
    monkeypatch.setattr("fenwear.heat.heat_exchange.FEW", 0)
    monkeypatch.setattr("fenwear.heat.contact_fluxes.UPDATED", updated)
    exchange = cycles.exchange.varied(cycles.exchange.heat, cycles.exchange.friction)
    many = CycleHeat(exchange)
    before = conductances.copy()
    before[:, 1], before[:, -2] = np.nan, before[0, -3]
    many.cycle(before)
    found = many.cycle(conductances)
    for one, other in zip(found.maps, expected.maps, strict=True):
        for name in ("propagator", "source", "response"):
            size = np.abs(getattr(other, name)).max()
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-11 * size)
    state = cycles.initial() + 1.0
    for one, other in zip(found.states(state, pressure), expected.states(state, pressure), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-11 * np.abs(other).max())
    after, _ = exchange.half_cycle(exchange.at(state), 0, pressure[0], conductances[0])
    np.testing.assert_allclose(after.values, found.states(state, pressure)[0], rtol=0, atol=1e-11 * np.abs(state).max())
