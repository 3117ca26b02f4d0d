"""Ranks: the same numbers, and errors on all of them alike."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.arrays import Array
from fenwear.contact.inequality import Inequality
from fenwear.errors import InputError
from fenwear.parallel import on_root

COMM = MPI.COMM_WORLD
several = pytest.mark.skipif(COMM.size == 1, reason="needs several ranks: mpirun -n 2 python3 -m pytest -m mpi")


@several
@pytest.mark.mpi
@pytest.mark.parametrize("name", ["example1", "example2"])
def test_a_distributed_system_is_the_same_system(assembled: Callable[..., Tribosystem], name: str) -> None:
    """Verification 18: this communicator against each rank on its own, to 1e-9 relative."""
    alone = assemble(load_case(name), MPI.COMM_SELF)
    together = assembled(name)
    assert (
        together.bodies.punch.body.mesh.topology.index_map(2).size_local
        < alone.bodies.punch.body.mesh.topology.index_map(2).size_local
    )
    np.testing.assert_allclose(together.pair.x, alone.pair.x, atol=1e-12)
    np.testing.assert_allclose(together.rigid.resultant, alone.rigid.resultant, rtol=1e-12)
    for solve in (
        lambda s: s.contact((1,)).solve(s.pair.initial_gap).pressure,
        lambda s: s.contact((-1,)).solve(s.pair.initial_gap).pressure,
        lambda s: next(march(s, 30)).pressure,
        lambda s: list(jump(s, 2000, tolerance=3e-3))[-1].pressure,
        lambda s: steady(s).pressure,
    ):
        one, other = solve(alone), solve(together)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * one.max())


@several
@pytest.mark.mpi
def test_all_ranks_hold_the_same_bits(assembled: Callable[..., Tribosystem]) -> None:
    """The replicated interface is equal to the last bit, so that no rank takes another Newton step."""
    system = assembled("example1")
    mine = (system.interface.gap_by_force, steady(system).pressure)
    for array in mine:
        for other in COMM.allgather(array):
            np.testing.assert_array_equal(array, other)


@several
@pytest.mark.mpi
@pytest.mark.parametrize("name", ["example1", "example1-heat"])
def test_ranks_whose_arithmetic_differs_agree(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """As of unlike processors: one rank's contacts are off by far more than rounding, and no rank waits for another."""
    system, noise, solve = assemble(load_case(name, ["geometry.degree=2"])), np.random.default_rng(1), Inequality.solve

    def noisy(self: Inequality, *arguments: Any, **options: Any) -> Array:
        found = solve(self, *arguments, **options)
        return found * (1 + 1e-13 * noise.standard_normal(found.shape)) if COMM.rank == 1 else found

    monkeypatch.setattr(Inequality, "solve", noisy)
    for pressure in (
        next(march(system, 20)).pressure,
        list(jump(system, 400, tolerance=1e-2))[-1].pressure,
        steady(system).phase_pressure,
    ):
        first = COMM.bcast(pressure)
        np.testing.assert_allclose(pressure, first, rtol=0, atol=1e-9 * first.max())
    assert COMM.rank != 1 or (pressure != first).any()


@pytest.mark.mpi
def test_on_root() -> None:
    """Rank 0 computes; all return its result or raise its error."""
    assert on_root(COMM, lambda: COMM.rank) == 0

    def fail() -> None:
        raise CaseError(InputError("key", f"on rank {COMM.rank}"))

    with pytest.raises(CaseError, match="key: on rank 0"):
        on_root(COMM, fail)


FEW = """
from pathlib import Path
from mpi4py import MPI
from fenwear import assemble, load_case
from fenwear.run import run_case

changes = ("elements_along_contact=2", "growth=8")
case = load_case("example1", ["geometry.degree=2", *(f"geometry.parameters.{change}" for change in changes)])
together, alone = assemble(case), assemble(case, MPI.COMM_SELF)
cells = together.bodies.punch.body.mesh.topology.index_map(2)
assert cells.size_global < together.comm.size
assert 0 in together.comm.allgather(cells.size_local)
found, expected = (s.contact((1,)).solve(s.pair.initial_gap).pressure for s in (together, alone))
assert abs(found - expected).max() <= 1e-9 * expected.max()

settings = ["geometry.degree=2", *(f"geometry.parameters.{change}" for change in changes), "output.report=false"]
for half_cycles in (4, 6):  # fields and checkpoints of ranks without cells, written and read
    warm = load_case("example1-heat", [*settings, f"run.half_cycles={half_cycles}"])
    summary, _ = run_case(warm, "few", Path("few"), lambda _: None, resume=half_cycles == 6, progress="none")
assert summary["half_cycles"] == 6 and summary["largest_heat_balance_error"] < 1e-8
"""


@pytest.mark.slow
def test_more_ranks_than_cells(run_python: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path) -> None:
    """Some have none, and all have the same pressures as one alone; runs with heat are written, and go on."""
    done = run_python("-m", "mpi4py", "-c", FEW, ranks=5, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
