"""A whole run with stick: from a case to the folder of its results, and on from its checkpoint."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from fenwear.arrays import Mask
from fenwear.case import Case, doubts
from fenwear.contact.complementarity import broken_text, complementarity_error
from fenwear.errors import CaseError, ConvergenceError, InputError, InterruptedRunError
from fenwear.lookout import Lookout
from fenwear.parallel import on_root
from fenwear.progress import How, Log, Progress
from fenwear.report.stick import write_stick_report
from fenwear.results import checkpoint as stored
from fenwear.results.history import HISTORY, make_directory, write_case, write_summary
from fenwear.signals import Signals
from fenwear.stick import checkpoint
from fenwear.stick.cycle import Rig
from fenwear.stick.fineness import Fineness, fine_enough
from fenwear.stick.interface import meshed
from fenwear.stick.jump import Cycle, jump, march
from fenwear.stick.results import dataset, extremes_with, net_of, row_of, summary_of
from fenwear.stick.setup import reaches_border
from fenwear.stick.writer import CycleWriter
from fenwear.versions import versions
from fenwear.watch.few import few_text
from fenwear.watch.size import size_warnings


def run_stick(
    rig: Rig,
    case: Case,
    directory: Path,
    log: Log,
    progress: How,
    how: Mapping[str, Any],
    signals: Signals,
    *,
    resume: bool,
) -> dict[str, Any]:
    """Drive the bodies of a case with stick over its cycles, write its results and return the summary; collective.

    Args:
        rig: The bodies.
        case: The problem.
        directory: New folder of the results, or with `resume` the folder of the run to go on with.
        log: Called with each message.
        progress: A bar where standard error is a terminal, a line now and then, or none.
        how: What the summary says besides of how the run went.
        signals: That end it.
        resume: Go on from the checkpoint in the folder.

    Raises:
        CaseError: the checkpoint is wrong, or the folder cannot be made.
        ConvergenceError: a time step failed; the results up to it are in the folder.
        InterruptedRunError: a signal ended the run; it can be resumed.
        OutputError: a file cannot be written; what was written before it is whole.
    """
    with signals:
        run = _Run(rig, case, directory, log, signals, progress, resume=resume)
        return run.all_cycles(how)


class _Run:
    """A run in its folder: takes the cycles, keeps history and checkpoints."""

    def __init__(
        self,
        rig: Rig,
        case: Case,
        directory: Path,
        log: Log,
        signals: Signals,
        progress: How,
        *,
        resume: bool,
    ) -> None:
        self.case, self.directory, self.log = case, directory, log
        self.comm = comm = meshed(rig.interface).bodies.comm
        self.cycles, rest = divmod(case.run.half_cycles, rig.program.half_cycles)
        if rest:
            message = f"expected a multiple of the {rig.program.half_cycles} half-cycles of a cycle with stick"
            raise CaseError(InputError("run.half_cycles", message))
        self.jumps = case.run.integration == "jump"
        self.unique: list[bool] = []  # of the time steps of this run
        self.extremes: dict[str, float] = {}  # of all cycles so far
        self.few: str | None = None  # what is to be said of how few nodes lie across the first contact of this run
        self.rig, self.resume = rig.watched(self._watch), resume
        self.last = checkpoint.load(directory, case, rig) if resume else None
        if self.last is not None:
            self.extremes = stored.extremes(directory, comm)
            if self.done >= self.cycles:
                message = f"the run has done {self.done} cycles already; expected more half-cycles to go on to"
                raise CaseError(InputError("run.half_cycles", message))
        if not resume:
            on_root(comm, lambda: make_directory(directory))
        on_root(comm, lambda: write_case(directory, case))
        self.writer: CycleWriter | None = None  # of rank 0
        on_root(comm, self._open_history)
        self.told = Progress("cycle", self.cycles, self.done, comm, progress)
        self._lookout = Lookout(comm, signals, self.told, self._save, every=case.output.checkpoint)

    def _open_history(self) -> None:
        after = None if self.last is None else self.last.number
        if after is not None and not (self.directory / HISTORY).exists():
            self.log(f"warning: {HISTORY} is gone from {self.directory}: a new one begins after cycle {after}")
        self.writer = CycleWriter(self.directory, after, 1 if self.jumps else self.case.output.every)

    @property
    def done(self) -> int:
        """Cycles whose wear is in the last one's shape."""
        return 0 if self.last is None else self.last.number

    def all_cycles(self, how: Mapping[str, Any]) -> dict[str, Any]:
        """Compute all cycles and return the summary; collective."""
        begin, fineness = time.perf_counter(), None
        failure: ConvergenceError | InterruptedRunError | None = None
        try:
            with self.told:
                self.rig, fineness = fine_enough(self.rig, self.case)
                for cycle in self._cycles():
                    self._take(cycle)
        except (ConvergenceError, InterruptedRunError) as error:
            failure = error
        if self.last is None:
            none = f"no cycle was done: {failure}; {self.directory} can be removed"
            raise type(failure or ConvergenceError())(none) from failure
        self._save()
        several = [text for text in (unique_text(np.array(self.unique, dtype=bool)), self.few) if text]
        interface = meshed(self.rig.interface)
        sizes = size_warnings(self.case, interface.bodies, interface.middle.rigid)
        warnings = [*sizes, *interface.bodies.remarks, *doubts(self.case), *several]
        warnings += _warnings(self.rig, self.last, fineness)
        for warning in warnings:
            self.log(f"warning: {warning}")
        found = {**how, "cycles_seconds": time.perf_counter() - begin, "warnings": warnings}
        stop = "all cycles done" if failure is None else str(failure)
        # Who interrupts a run is in a hurry: its figures can be drawn later.
        report = self.case.output.report and not isinstance(failure, InterruptedRunError)
        summary = on_root(self.comm, lambda: self._finish({"stop": stop, **found}, report=report))
        if failure is not None:
            so_far = f"the results up to cycle {self.last.number} are in {self.directory}, to go on: --resume"
            raise type(failure)(f"{failure}\n{so_far}") from failure
        return summary

    def _cycles(self) -> Iterator[Cycle]:
        if self.jumps:
            return jump(self.rig, self.cycles, self.case.run.jump_tolerance, self.last)
        return march(self.rig, self.cycles + 1, self.last)  # the last begins with what all of them have worn

    def _take(self, cycle: Cycle) -> None:
        """Keep a cycle; collective, so that every rank knows of an error."""
        self.last = cycle
        self.extremes = extremes_with(self.extremes, self.rig, cycle)
        if self.few is None:
            self.few = few_text(self.case, net_of(self.rig), cycle.records.pressure[0], "at the start")
        self.unique.extend(bool(unique) for unique in cycle.records.unique)
        keep = self.jumps or cycle.number % self.case.output.every == 0

        def row() -> xarray.Dataset:
            return dataset(self.rig, self.case, [row_of(self.rig, self.case, cycle)])

        on_root(self.comm, lambda: None if self.writer is None else self.writer.add(row, keep=keep))
        self.told.reached(self.done, f"p max {cycle.half_cycles[-1].pressure.max():.4g} MPa")

    def _watch(self) -> None:
        """Look, between two solves, whether something is due; collective.

        Raises:
            InterruptedRunError: a signal has come.
        """
        if not self._lookout.too_soon and self._lookout.look():
            raise InterruptedRunError("interrupted")

    def _save(self) -> None:
        """Write history and checkpoint, in this order: the history reaches as far or farther."""
        if self.last is not None:
            on_root(self.comm, lambda: None if self.writer is None else self.writer.flush())
            checkpoint.save(self.directory, self.case, self.rig, self.last, self.extremes)

    def _finish(self, how: dict[str, Any], *, report: bool) -> dict[str, Any]:
        """Write what a run ends with, and return the summary; for rank 0."""
        if self.writer is None or self.last is None:
            return {}
        summary = {
            **how,
            "steps_per_half_cycle": len(self.rig.program.steps) // self.rig.program.half_cycles,
            "contact_nodes": len(self.rig.weights),
            "ranks": self.comm.size,
            "versions": versions(),
        }
        with self.writer.close() as data:
            summary = {**summary_of(self.rig, data, self.last.worn, self.extremes), **summary}
        write_summary(self.directory, summary)
        if report:
            write_stick_report(self.directory)
        return summary


def check_touching(rig: Rig) -> None:
    """Make sure that the load brings the surfaces together; collective.

    Raises:
        CaseError: it does not.
    """
    if not rig.led(lambda: bool(rig.beginning().contact.closed.any())):
        raise CaseError(InputError("geometry", "the surfaces never meet under the load"))


def unique_text(unique: Mask) -> str:
    """Say that friction is so large that there may be several answers, and which was taken; "" if it is not."""
    if unique.all():
        return ""
    return (
        f"friction is so large that the contact may have no or several answers in {int((~unique).sum())} of "
        f"{len(unique)} time steps; those taken are the ones that Newton's method came to from the step before; "
        "expected less friction"
    )


def _warnings(rig: Rig, last: Cycle, fineness: Fineness | None) -> list[str]:
    """Return what the user should know of the run."""
    found = [fineness.text()] if fineness is not None and not fineness.enough else []
    records = last.records
    error = complementarity_error(records.pressure, records.gap, rig.interface.middle.elastic_length).max()
    found += [text for text in (broken_text(float(error), "in the last cycle"),) if text]
    slipping = (records.pressure > 0).any(axis=1) & ~records.sticking.any(axis=1)
    if slipping.any():
        share = float(np.mean(slipping))
        found.append(f"gross sliding: in {100 * share:.0f} % of the last cycle's time steps nothing sticks")
    if reaches_border(rig, records.pressure):
        found.append("the contact reaches the end of its meshed surface; expected a wider one")
    return found
