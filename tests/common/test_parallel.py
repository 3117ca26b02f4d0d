"""Ranks: the same numbers, and errors on all of them alike."""

from __future__ import annotations

import subprocess
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from mpi4py import MPI

from fenwear import CaseError, ConvergenceError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.common.errors import InputError, RanksError
from fenwear.common.parallel import Team, on_root, total
from fenwear.contact.inequality import Inequality
from fenwear.heat.contact_fluxes import FluxFactor
from fenwear.laws.friction import Friction
from fenwear.laws.wear import PhasesWear
from fenwear.steps import Block, critical_speed, cycles_to_reach, growth_rate, stability_number
from fenwear.steps import run_state as cycle_state
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.jump_method import Sizes
from fenwear.steps.stick_equations import Step
from fenwear.steps.stick_final import final_shape
from fenwear.steps.stick_setup import fine_enough, with_steps
from fenwear.system import with_reduced_heat

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
    mine = (system.elastic.interface.dense(), steady(system).pressure)
    for array in mine:
        for other in COMM.allgather(array):
            np.testing.assert_array_equal(array, other)


def noisy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the arithmetic of all ranks but 0 that of other processors, far worse: their contacts even fail."""
    noise = np.random.default_rng(COMM.rank)

    def disturb(owner: Any, name: str) -> None:
        original = getattr(owner, name)

        def disturbed(*arguments: Any, **options: Any) -> Any:
            found = original(*arguments, **options)
            if isinstance(found, tuple):
                return (found[0] * (1 + 1e-9 * noise.standard_normal(np.shape(found[0]))), *found[1:])
            return found * (1 + 1e-9 * noise.standard_normal(np.shape(found)))

        monkeypatch.setattr(owner, name, disturbed)

    def fail(*_: Any, **__: Any) -> None:
        raise ConvergenceError("on this rank alone")

    if COMM.rank:
        for owner, name in (
            *((module, name) for module in (np.linalg, scipy.linalg) for name in ("lstsq", "solve", "norm")),
            (np.linalg, "eigvals"),
            (scipy.linalg, "lu_solve"),
            (FluxFactor, "of"),
            (Friction, "values"),
            (PhasesWear, "opening"),
            (cycle_state, "pressure_scales"),
            (Sizes, "area"),
        ):
            disturb(owner, name)
        monkeypatch.setattr(Inequality, "solve", fail)
        monkeypatch.setattr(Step, "solve", fail)


def check_same(*found: Any) -> None:
    """To the last bit on all ranks, whatever it is."""
    mine = [np.asarray(one) for one in found]
    for one, other in zip(mine, COMM.bcast(mine), strict=True):
        np.testing.assert_array_equal(one, other)


FEW_NODES = ("geometry.degree=2", "geometry.parameters.elements_along_contact=4")
STICK = ("geometry.parameters.elements_along_contact=12", "stick.steps=6", "stick.step_tolerance=0.2")
BY_PRESSURE = "contact.friction={expression='0.2*(1+0.5*exp(-p/16))'}"


@several
@pytest.mark.mpi
@pytest.mark.parametrize(
    "settings",
    [
        ("example1", BY_PRESSURE),
        ("example1-heat", BY_PRESSURE),
        ("example1-heat", BY_PRESSURE, "heat.operator=full"),
    ],
)
def test_ranks_whose_arithmetic_differs(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch, settings: tuple[str, ...]
) -> None:
    """As of unlike processors: rank 0 decides, all have its results, and no rank waits for another."""
    name, *changes = settings
    system = assembled(name, *FEW_NODES, *changes)
    noisy(monkeypatch)
    spread = "heat.operator=full" in changes
    for block in (
        *march_within(system, RunLimits(6 if spread else 40, periodic_within=1e-3, block=3), implicit=True),
        *march_within(system, RunLimits(4, block=3)),
        *(() if spread else jump_within(system, RunLimits(400, periodic_within=1e-4, block=8), tolerance=1e-2)),
    ):
        check_same(block.half_cycle, block.pressure, block.wear, block.totals.sums, block.periodicity)
        if block.heat is not None:
            check_same(block.heat.temperature_punch, block.heat.terms)
    if spread:
        return
    state = steady(system)
    check_same(state.phase_pressure, state.shape, state.iterations, stability_number(system))
    check_same(growth_rate(system, state.phase_pressure), cycles_to_reach(system, state, 0.1))
    if system.case.heat is not None:
        check_same(critical_speed(system, 1))


@several
@pytest.mark.mpi
@pytest.mark.parametrize("failing", [0, 1])
def test_contacts_that_fail_on_one_rank(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    """On rank 0: remedies on all ranks, the same, and in the end the same error. On another one: nothing."""
    system, solve = assembled("example1-heat", *FEW_NODES, "heat.conductance=20"), Inequality.solve
    calls, runs = [0], (lambda: march_within(system, RunLimits(40, block=7)), lambda: jump(system, 400, tolerance=1e-3))
    system.remedies.take()  # of runs that failed
    usual = [told(run) for run in runs]

    def sometimes(self: Inequality, *arguments: Any, **options: Any) -> Any:
        calls[0] += 1
        if COMM.rank == failing and 20 < calls[0] <= last:
            raise ConvergenceError(f"on purpose on rank {COMM.rank}")
        return solve(self, *arguments, **options)

    monkeypatch.setattr(Inequality, "solve", sometimes)
    for last in (26, 10**9):
        for run, (pressure, remedies, _) in zip(runs, usual, strict=True):
            calls[0], found = 0, told(run)
            check_same(*found)
            if failing:
                assert found[1:] == (remedies, "")
                np.testing.assert_array_equal(found[0], pressure)
            else:
                assert (last > 26 and "on purpose on rank 0" in found[2]) or set(found[1]) - set(remedies)


def told(run: Callable[[], Iterator[Block]]) -> tuple[Any, list[Any], str]:
    """Return the last pressure, all remedies, and the error of a run."""
    blocks: list[Block] = []
    message = ""
    try:
        blocks.extend(run())
    except ConvergenceError as error:
        message = str(error)
    remedies = sum((block.remedies for block in blocks), start=Counter[str]())
    return blocks[-1].pressure[-1] if blocks else None, sorted(remedies.elements()), message


@several
@pytest.mark.mpi
def test_stick_on_ranks_whose_arithmetic_differs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time steps as fine as they need to be, cycles, jumps and the final shape; rank 0's error is that of all."""
    case = load_case("fretting-partial-slip", STICK)
    system = assemble(case)
    given = with_steps(system.law_state.problem, case, case.stick.steps)
    noisy(monkeypatch)
    problem, fineness = fine_enough(given, case)
    check_same(fineness.change, fineness.steps)
    system = replace(system, law_state=replace(system.law_state, problem=problem))
    for block in (*march(system, 4), *jump_within(system, RunLimits(60, block=1), tolerance=0.1)):
        check_same(block.half_cycle, block.wear, block.end.jump_length, *(steps.pressure for steps in block.steps))
    found = final_shape(problem)
    check_same(found.pressure, found.depth)

    def fail(*_: Any) -> None:
        raise ConvergenceError(f"on rank {COMM.rank}")

    monkeypatch.setattr(Step, "solve", fail)
    with pytest.raises(ConvergenceError, match="on rank 0"):
        list(march(system, 2))


@pytest.mark.mpi
def test_on_root() -> None:
    """Rank 0 computes; all return its result or raise its error."""
    assert on_root(COMM, lambda: COMM.rank) == 0

    def fail() -> None:
        raise CaseError(InputError("key", f"on rank {COMM.rank}"))

    with pytest.raises(CaseError, match="key: on rank 0"):
        on_root(COMM, fail)


@pytest.fixture
def small() -> Callable[[], Tribosystem]:
    """Return small(): a small system with heat that is not prepared; made once."""
    case = load_case("example1-heat", ["geometry.degree=1", "geometry.parameters.elements_along_contact=8"])
    system = assemble(case, COMM, heat="none")
    return lambda: system


class Unpackable(Exception):
    """An error that cannot cross ranks."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.held = (value for value in ())  # no generator can be packed


class HalfPackable(Exception):
    """An error that can be packed, and not unpacked."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f"{one} {other}")


class Part:
    """What every rank has a part of; the others' fails, or returns what cannot cross ranks."""

    def answer(self, how: str) -> object:
        if COMM.rank and how == "raise":
            raise Unpackable("of a part")
        return (value for value in ()) if COMM.rank else None


@several
@pytest.mark.mpi
def test_whatever_fails_no_rank_waits(small: Callable[..., Tribosystem]) -> None:
    """Errors and results that cannot cross ranks, interrupts, and what all ranks have to do together where one leads:
    each ends in a typed error on every rank, and the ranks go on together."""
    team, part = Team.of(COMM), Part()
    team.serve(part)

    def fail(error: BaseException) -> None:
        raise error

    case = small().case
    led: list[tuple[Callable[[], object], type[BaseException], str]] = [
        (lambda: fail(Unpackable("of rank 0")), RanksError, "Unpackable: of rank 0"),
        (lambda: fail(HalfPackable("of", "rank 0")), RanksError, "HalfPackable: of rank 0"),
        (lambda: fail(KeyboardInterrupt()), KeyboardInterrupt, ""),
        (lambda: (value for value in ()), RanksError, "generator"),
        (lambda: team.call(part, "answer", "raise"), RanksError, "Unpackable: of a part"),
        (lambda: team.call(part, "answer", "return"), RanksError, "generator"),
        (lambda: total(COMM, np.ones(2)), RanksError, "one leads the others"),
        (lambda: assemble(case), RanksError, "one leads the others"),
        (lambda: with_reduced_heat(small()), RanksError, "one leads the others"),
    ]
    for function, kind, text in led:
        with pytest.raises(kind, match=text):
            team.lead(function)
        assert COMM.allreduce(1) == COMM.size
        assert team.lead(lambda: 7) == 7


FEW = """
from pathlib import Path
from mpi4py import MPI
from fenwear import assemble, load_case
from fenwear.studies.run import run_case

changes = ("elements_along_contact=2", "growth=8")
case = load_case("example1", ["geometry.degree=2", *(f"geometry.parameters.{change}" for change in changes)])
together, alone = assemble(case), assemble(case, MPI.COMM_SELF)
cells = together.bodies.punch.body.mesh.topology.index_map(2)
assert cells.size_global < together.bodies.comm.size
assert 0 in together.bodies.comm.allgather(cells.size_local)
found, expected = (s.contact((1,)).solve(s.pair.initial_gap).pressure for s in (together, alone))
assert abs(found - expected).max() <= 1e-9 * expected.max()

settings = ["geometry.degree=2", *(f"geometry.parameters.{change}" for change in changes)]
settings += ["output.report=false", "output.uncertainty=false"]
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
