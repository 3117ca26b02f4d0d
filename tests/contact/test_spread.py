"""Contacts whose compliance the ranks share: against the same with all of it on every rank."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import ConvergenceError, Tribosystem, assemble, jump, load_case, march, steady, vary
from fenwear.arrays import Array
from fenwear.assembly import resources_of, resources_text, tribosystem
from fenwear.contact import CondensedContact, SlidingContact, phase_rows, spread, spread_nodes
from fenwear.cycle import stability_number
from fenwear.interface import PressureCompliance
from fenwear.parallel import Rows, Team

COMM = MPI.COMM_WORLD
several = pytest.mark.skipif(COMM.size == 1, reason="needs several ranks: mpirun -n 2 python3 -m pytest -m mpi")
SMALL = ("geometry.degree=2",)
BALL = ("geometry.degree=1", "geometry.order=1")


@several
@pytest.mark.mpi
@pytest.mark.parametrize(("name", "settings"), [("example1", SMALL), ("ball-on-flat", BALL)])
def test_runs_are_the_same(name: str, settings: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """A strip that stays and one that moves: each rank has a part, and all agree; sets eliminated and iterated."""
    whole = assemble(load_case(name, settings))
    monkeypatch.setattr(tribosystem, "SHARED", 0)
    monkeypatch.setattr(spread, "RUN", 7)
    monkeypatch.setattr(phase_rows, "RUN", 30)
    shared = assemble(load_case(name, settings))
    n, rows = len(shared.pair.weights), shared.interface.dense().shape[0]
    assert rows <= -(-n // COMM.size)
    assert shared.condensed.punch.response.shape[2] == rows
    assert shared.condensed.strip.response.shape[2] < whole.condensed.strip.response.shape[2]
    assert shared.interface.elastic_length == pytest.approx(whole.interface.elastic_length, rel=1e-12)
    expected = whole.interface.compliance(whole.friction_ratio(1)).matrix()
    found = shared.interface.compliance(shared.friction_ratio(1)).matrix()
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    runs: list[Callable[[Tribosystem], Array]] = [
        lambda system: list(march(system, 3))[-1].pressure[-2:],
        lambda system: list(march(system, 3, implicit=True))[-1].pressure[-2:],
        lambda system: list(jump(system, 200, tolerance=3e-2))[-1].pressure[-2:],
    ]
    for few in (0, 2000):
        monkeypatch.setattr(spread, "FEW", few)
        monkeypatch.setattr(spread_nodes, "FEW", few)
        for run in runs[: 3 if few or name == "example1" else 2]:
            one, other = run(whole), run(shared)
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * one.max())
            np.testing.assert_array_equal(other, COMM.bcast(other))


@several
@pytest.mark.mpi
def test_steady_states_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """With another friction and stroke, and none where there is none; the explicit limit, too; check tells."""
    whole = assemble(load_case("example1", SMALL))
    needed, changes = resources_of(whole).memory, ("contact.friction=0.2", "motion.amplitude=2")
    expected = [steady(vary(whole, change)).phase_pressure for change in changes]
    monkeypatch.setattr(tribosystem, "SHARED", 0)
    monkeypatch.setattr(phase_rows, "RUN", 30)
    shared = assemble(load_case("example1", SMALL))
    few = resources_of(shared).memory
    assert stability_number(shared) == pytest.approx(stability_number(whole), rel=1e-6)
    lines = resources_text(shared, resources_of(shared))
    assert any(f"{COMM.size} ranks share the rows of its {len(shared.pair.weights)} nodes" in line for line in lines)
    assert few < needed
    monkeypatch.setattr(PressureCompliance, "matrix", None)  # no matrix of all nodes is made
    for change, one in zip(changes, expected, strict=True):
        other = steady(vary(shared, change)).phase_pressure
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * one.max())
        np.testing.assert_array_equal(other, COMM.bcast(other))
    with pytest.raises(ConvergenceError, match="friction tips the punch so far"):
        steady(vary(shared, "contact.friction=0.9"))


def alone(system: Tribosystem, direction: int) -> CondensedContact:
    """A contact in which one rank asks itself for products."""
    rows = Rows.equal(MPI.COMM_SELF, len(system.pair.weights))
    return CondensedContact(
        [SlidingContact(replace(system.interface, rows=rows), system.friction_ratio(direction))], system.remedies
    )


@pytest.mark.parametrize("few", [0, 2000])
def test_one_rank(assembled: Callable[..., Tribosystem], few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """From cold and warm, with edges that open; run by run of nodes, by iterations that are fewer than nodes."""
    monkeypatch.setattr(spread, "FEW", few)
    monkeypatch.setattr(spread, "RUN", 10)
    system = assembled("example1", "contact.friction=0.4", "geometry.parameters.pin_height_1=40")
    usual, shared = system.contact((1,)), alone(system, 1)
    before = None
    for depth in (0.0, 1e-4, 1e-2):
        gap = system.pair.initial_gap + depth * np.cos(system.pair.x / 7) ** 2
        expected, before = usual.solve(gap), shared.solve(gap, before)
        scale = expected.pressure.max()
        assert (expected.pressure == 0).any()
        np.testing.assert_allclose(before.pressure, expected.pressure, rtol=0, atol=1e-9 * scale)
        length = scale * system.interface.elastic_length
        np.testing.assert_allclose(before.gap, expected.gap, rtol=0, atol=1e-9 * length)


def test_iterations_that_fail_are_replaced(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """GMRES that may take one iteration cannot do it: then rank 0 eliminates the set."""
    monkeypatch.setattr(spread, "FEW", 0)
    monkeypatch.setattr(spread, "RUN", 3)
    monkeypatch.setattr("fenwear.contact.krylov.RESTART", 1)
    monkeypatch.setattr("fenwear.contact.krylov.RESTARTS", 1)
    system = assembled("example1", *SMALL)
    found = alone(system, 1).solve(system.pair.initial_gap).pressure
    expected = system.contact((1,)).solve(system.pair.initial_gap).pressure
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * expected.max())


class Part:
    """What a rank has of something."""

    def give(self, factor: int) -> int:
        """Return this rank's number, so many times."""
        if factor < 0 and COMM.rank == COMM.size - 1:
            raise ConvergenceError("not here")
        return factor * COMM.rank


@pytest.mark.mpi
def test_one_leads() -> None:
    """Rank 0 asks all; what it returns or raises all do, and what another rank raises, too."""
    team = Team.of(COMM)
    part = team.serve(Part())
    assert team.lead(lambda: [team.call(part, "give", k) for k in (1, 2)]) == [
        [k * rank for rank in range(COMM.size)] for k in (1, 2)
    ]
    with pytest.raises(ConvergenceError, match="not here"):
        team.lead(lambda: team.call(part, "give", -1))
    assert team.lead(lambda: part) is part
    assert team.lead(lambda: COMM.rank) == 0
