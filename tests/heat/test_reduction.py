"""The reduced heat operator against the full one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Case, ConvergenceError, Tribosystem, assemble, load_case, march
from fenwear.common.arrays import Array
from fenwear.heat import passing_strip, prepare
from fenwear.heat.heat_exchange import TERMS
from fenwear.heat.reduction import _Growing
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within

# Faces that convect and no debris: all losses, and a strong feedback.
COARSE = (
    "geometry.parameters.elements_along_contact=4",
    "geometry.degree=2",
    "heat.convecting_faces=true",
    "heat.debris=0",
)
WARM = (
    "heat.initial=-10",
    "heat.ambient=35",
    "strip.temperatures=[{on='strip_bottom', temperature=-30}, {on='strip_ends', temperature=12}]",
)


def run(system: Tribosystem) -> Block:
    (block,) = march_within(system, RunLimits(100, block=100))
    return block


def heated(system: Tribosystem, pressures: Array) -> Array:
    """Return both contact temperatures after each half-cycle at these pressures, which say what conducts."""
    exchange = system.exchange
    state, found = exchange.initial(), []
    for number, pressure in enumerate(pressures):
        state, terms = exchange.half_cycle(state, number % 2, pressure, exchange.conductance(pressure))
        assert abs(terms[0] - terms[1 : len(TERMS)].sum()) < 1e-9 * np.abs(terms).max()
        found.append(exchange.contact_temperatures(state, number % 2))
    return np.array(found).transpose(1, 0, 2)


@pytest.mark.parametrize("settings", [(), WARM, ("heat.conductance=perfect", "heat.partition=0.3")])
@pytest.mark.mpi
def test_reduced_equals_full(assembled: Callable[..., Tribosystem], settings: tuple[str, ...]) -> None:
    """Contact temperatures within 0.05 K over the pressures of 100 half-cycles, with a fraction of the unknowns."""
    full = assembled("example1-heat", *COARSE, *settings, "heat.operator=full")
    reduced = assembled("example1-heat", *COARSE, *settings)
    sizes = [sum(system.bodies.comm.allreduce(body.owned) for body in system.bodies.heat) for system in (full, reduced)]
    assert len(reduced.exchange.initial().values) < sizes[0] / 5
    block = run(full)  # a pressure that opens nodes, and closes them again
    expected = heated(full, block.pressure)
    assert np.ptp(expected) > 12
    np.testing.assert_allclose(heated(reduced, block.pressure), expected, rtol=0, atol=0.05)


def test_error_follows_the_tolerance(assembled: Callable[..., Tribosystem]) -> None:
    """A smaller tolerance keeps more of the basis, and the error falls with it."""
    full = assembled("example1-heat", *COARSE, "heat.operator=full")
    block = run(full)
    expected = heated(full, block.pressure)
    errors, sizes = [], []
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-6):
        as_it_is = (f"heat.reduction_tolerance={tolerance}", "heat.reduction_difference=0.99")  # not enlarged
        system = assembled("example1-heat", *COARSE, *as_it_is)
        errors.append(np.abs(heated(system, block.pressure) - expected).max())
        sizes.append(len(system.exchange.bases[0]))
    assert sizes == sorted(set(sizes))
    assert errors[0] > 5 * errors[1] > 25 * errors[2]
    assert errors[3] < 2e-3 < errors[2]


@pytest.mark.mpi
def test_of_many_nodes_only_what_lasts_is_kept(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is gone a step later is not in the basis, and yet in the temperatures of the contact; no heat is lost."""
    full = assembled("example1-heat", *COARSE, *WARM, "heat.operator=full")
    block = run(full)
    expected = heated(full, block.pressure)
    for module in (prepare, passing_strip):  # of the punch, and of the strip
        monkeypatch.setattr(module, "MANY", 0)
    errors, sizes = [], []
    for tolerance in (1e-2, 1e-3, 1e-4, 3e-5):
        settings = [*COARSE, *WARM, f"heat.reduction_tolerance={tolerance}", "heat.reduction_difference=0.9"]
        system = assemble(load_case("example1-heat", settings))  # as it is, not sharpened until it is near enough
        errors.append(np.abs(heated(system, block.pressure) - expected).max())
        sizes.append(sum(len(basis) for basis in system.exchange.bases))
    assert sizes == sorted(set(sizes))
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert errors[3] < 0.1


def test_steady_state_is_in_the_basis(assembled: Callable[..., Tribosystem]) -> None:
    """Long times too: half-cycles without number end at the same temperatures."""
    ends = []
    for operator in ("full", "reduced"):
        system = assembled(
            "example1-heat", *COARSE, *WARM, "motion.angular_frequency=0.01", f"heat.operator={operator}"
        )
        exchange, pressure = system.exchange, np.full(len(system.pair.x), 5.0)
        state = exchange.initial()
        for half_cycle in range(60):  # of 314 s each
            state, _ = exchange.half_cycle(state, half_cycle % 2, pressure, exchange.conductance(pressure))
        ends.append(np.array(exchange.contact_temperatures(state)))
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=0.02)


def test_bodies_that_hardly_lose_heat(edited: Callable[..., Case]) -> None:
    """The mean temperature, far above all else where next to no heat is lost, hides nothing of the contact's."""

    def edit(tables: dict[str, Any]) -> None:
        tables["motion"] = {"kind": "one-way", "direction": "rightward", "speed": 500.0, "duration": 1.0}
        for body in ("punch", "strip"):
            tables[body].pop("temperatures", None)
        for material in tables["materials"].values():
            material["conductivity"] = "400 W/(m*K)"
        tables["heat"] = {"steps": 4, "convection": 1e-9, "inflow": 0.0}

    small = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", "contact.friction=0.05")
    ends = []
    for operator in ("full", "reduced"):
        system = assemble(edited("example1-heat", edit, *small, f"heat.operator={operator}"))
        ends.append(list(march(system, 5))[-1].heat.temperature_strip[-1])
    assert np.abs(ends[1] - ends[0]).max() < 5e-3 * ends[0].max()


def test_dependent_fields_are_appended_once(assembled: Callable[..., Tribosystem]) -> None:
    """Fields of which one depends on the others, to the last bit, give a basis of the others: no failed factor."""
    body = assembled("example1-heat", *COARSE).bodies.heat[0]
    basis = _Growing(body, None)
    before = basis.columns.shape[1]
    x = np.linspace(0, 1, body.owned)
    fields = np.array([np.sin(x), np.cos(3 * x), x**2, 0 * x]).T
    fields[body.held] = 0.0
    fields = np.hstack([fields, fields[:, :1] + 2 * fields[:, 1:2], 1e-200 * fields[:, :1]])
    basis._append(basis._beside(fields))
    assert basis.columns.shape[1] == before + 3
    gram = basis.columns.T @ body.store(basis.columns)
    np.testing.assert_allclose(gram, np.eye(before + 3), rtol=0, atol=1e-10)
    left = basis._beside(fields)
    assert np.abs(left).max() < 1e-7
    with pytest.raises(ConvergenceError, match="beyond all numbers"):
        basis._append(np.full((body.owned, 2), np.nan))
