"""A whole run with stick: from a case to the folder of its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from mpi4py import MPI

from fenwear.case import Case, doubts
from fenwear.errors import CaseError, ConvergenceError, InputError
from fenwear.parallel import on_root
from fenwear.report.stick import write_stick_report
from fenwear.results.history import free_directory, make_directory, write_case, write_summary
from fenwear.stick.cycle import Rig
from fenwear.stick.jump import Cycle, jump, march
from fenwear.stick.results import Row, dataset, row_of, summary_of, write_history
from fenwear.stick.setup import Fineness, fine_enough, make_rig, reaches_border
from fenwear.versions import versions

Log = Callable[[str], None]


def run_stick(
    case: Case, name: str, output: Path | None, log: Log, *, told: bool = True, comm: MPI.Comm = MPI.COMM_WORLD
) -> tuple[dict[str, Any], Path]:
    """Run a case with contact.law = "coulomb" and write its results; collective.

    Args:
        case: The problem.
        name: Names the folder results/NAME where `output` is None.
        output: New folder of the results.
        log: Called with each message.
        told: Whether progress is told where standard error is a terminal.
        comm: The ranks.

    Returns:
        The summary and the folder.

    Raises:
        CaseError: the case or its geometry is wrong, or the folder cannot be made.
        ConvergenceError: a time step failed; the results up to it are in the folder.
        OutputError: a file cannot be written.
    """
    begin = time.perf_counter()
    rig = make_rig(case, comm)
    check_touching(rig)
    setup = time.perf_counter() - begin
    directory = output or on_root(comm, lambda: free_directory(Path("results") / name))
    on_root(comm, lambda: make_directory(directory))
    on_root(comm, lambda: write_case(directory, case))
    begin = time.perf_counter()
    rig, fineness = fine_enough(rig, case)
    rows, last, failure = _follow(rig, case, told=told and comm.rank == 0)
    warnings = [*doubts(case), *_warnings(rig, last, fineness)]
    for warning in warnings:
        log(f"warning: {warning}")
    if last is None:
        raise failure or ConvergenceError("no cycle was done")
    how = {
        "stop": "all cycles done" if failure is None else str(failure),
        "steps_per_half_cycle": len(rig.program.steps) // rig.program.half_cycles,
        "setup_seconds": setup,
        "cycles_seconds": time.perf_counter() - begin,
        "warnings": warnings,
        "contact_nodes": len(rig.weights),
        "ranks": comm.size,
        "versions": versions(),
    }
    data = dataset(rig, case, rows)
    summary = {**summary_of(data, last.worn), **how}
    on_root(comm, lambda: _write(directory, data, summary, report=case.output.report))
    if failure is not None:
        raise ConvergenceError(f"{failure}\nthe results up to cycle {last.number} are in {directory}") from failure
    return summary, directory


def _write(directory: Path, data: xarray.Dataset, summary: dict[str, Any], *, report: bool) -> None:
    write_history(directory, data)
    write_summary(directory, summary)
    if report:
        write_stick_report(directory)


def check_touching(rig: Rig) -> None:
    """Make sure that the load brings the surfaces together.

    Raises:
        CaseError: it does not.
    """
    if not rig.beginning().contact.closed.any():
        raise CaseError(InputError("geometry", "the surfaces never meet under the load"))


def _follow(rig: Rig, case: Case, *, told: bool) -> tuple[list[Row], Cycle | None, ConvergenceError | None]:
    """Return what is kept of the cycles, the last cycle, and what ended them early."""
    from tqdm import tqdm

    cycles, every = max(case.run.half_cycles // rig.program.half_cycles, 1), case.output.every
    rows: list[Row] = []
    last: Cycle | None = None
    with tqdm(total=cycles, unit="cycle", disable=None if told and sys.stderr.isatty() else True) as bar:
        try:
            for cycle in _cycles(rig, case, cycles):
                bar.update(cycle.number - bar.n)
                if case.run.integration == "jump" or cycle.number % every == 0 or cycle.number == cycles - 1:
                    rows.append(row_of(rig, case, cycle))
                last = cycle
        except ConvergenceError as error:
            return rows, last, error
    return rows, last, None


def _cycles(rig: Rig, case: Case, cycles: int) -> Iterator[Cycle]:
    if case.run.integration == "jump":
        return jump(rig, cycles, case.run.jump_tolerance)
    return march(rig, cycles)


def _warnings(rig: Rig, last: Cycle | None, fineness: Fineness) -> list[str]:
    """Return what the user should know of the run."""
    found = []
    if not fineness.enough:
        found.append(
            f"the time steps are coarse: with {fineness.steps} in a half-cycle force or friction's work of the first "
            f"cycle still change by {100 * fineness.change:.2g} %; expected more stick.steps"
        )
    if last is None:
        return found
    records = last.records
    if not records.unique.all():
        found.append(
            "friction is so large that the contact has no or several answers in some time steps; those taken are the "
            "ones that Newton's method came to from the step before"
        )
    slipping = (records.pressure > 0).any(axis=1) & ~records.sticking.any(axis=1)
    if slipping.any():
        share = float(np.mean(slipping))
        found.append(f"gross sliding: in {100 * share:.0f} % of the last cycle's time steps nothing sticks")
    if reaches_border(rig, records.pressure):
        found.append("the contact reaches the end of its meshed surface; expected a wider one")
    return found
