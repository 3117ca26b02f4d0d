"""A whole run: from a case to the folder of its results, and on from its checkpoint."""

from __future__ import annotations

import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, Literal

import numpy as np
from mpi4py import MPI
from tqdm import tqdm

from fenwear.assembly import Preparation, Tribosystem, assemble
from fenwear.case import Case
from fenwear.cycle import Block, follow, growth_rate, jump, march, stability_number
from fenwear.cycle.moment import Moment, joined
from fenwear.errors import CaseError, ConvergenceError, InterruptedRunError, MeshQualityError, OutputError, Problem
from fenwear.heat.exchange import HeatExchange
from fenwear.parallel import on_root
from fenwear.report.page import try_report
from fenwear.results import checkpoint
from fenwear.results.fields import body_fields, write_fields
from fenwear.results.history import (
    HISTORY,
    HistoryWriter,
    free_directory,
    make_directory,
    summarise,
    write_case,
    write_summary,
)

FAR_APART = 2.0  # contact nodes between neighbouring positions of a strip that wears: more leaves steps in its scar
Log = Callable[[str], None]
Progress = Literal["bar", "lines", "none"]


def run_case(
    case: Case,
    name: str,
    output: Path | None,
    log: Log,
    *,
    resume: bool = False,
    progress: Progress = "bar",
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> tuple[dict[str, Any], Path]:
    """Run a case and write its results; collective.

    Args:
        case: The problem.
        name: Names the folder results/NAME where `output` is None.
        output: New folder of the results, or with `resume` the folder of the run to go on with.
        log: Called with each message.
        resume: Go on from the checkpoint in `output`.
        progress: A bar where standard error is a terminal, a line for every block, or none.
        comm: The ranks.

    Returns:
        The summary and the folder.

    Raises:
        CaseError: the case, its geometry or its checkpoint is wrong, or the folder cannot be made;
            nothing is written.
        ConvergenceError: a half-cycle failed; the results up to it are in the folder.
        InterruptedRunError: a signal ended the run; it can be resumed.
        OutputError: a file cannot be written; what was written before it is whole.
    """
    if case.model.kind != "plane":
        reason = "results are written of plane models so far; `steady`, `optimum` and Python's march and jump take all"
        raise CaseError(Problem("model.kind", reason))
    begin = time.perf_counter()
    system = assemble(case, comm, heat=preparation_of(case))
    if not resume:
        system.check_touching()
    setup = time.perf_counter() - begin
    directory = output or on_root(comm, lambda: free_directory(Path("results") / name))
    try:
        return _run(system, directory, log, progress, setup, resume=resume), directory
    except OutputError as error:
        raise OutputError(error.path, error.reason, on_root(comm, lambda: _way_on(directory))) from error


def _run(
    system: Tribosystem, directory: Path, log: Log, progress: Progress, setup: float, *, resume: bool
) -> dict[str, Any]:
    run = _Run(system, directory, log, resume=resume)
    failure: Exception | None = None
    begin = time.perf_counter()
    try:
        run.march(progress)
    except (ConvergenceError, InterruptedRunError) as error:
        failure = error
    times = {"setup_seconds": setup, "half_cycles_seconds": time.perf_counter() - begin}
    # Who interrupts a run is in a hurry: its figures can be drawn later.
    report = system.case.output.report and not isinstance(failure, InterruptedRunError)
    how = {"stop": run.stop(failure), **times, "warnings": run.warnings, "retries": run.remedies}
    summary = run.finish(how, report=report)
    if failure is not None:
        raise type(failure)(f"{failure}\n{run.results_so_far(failure)}") from failure
    return summary


def preparation_of(case: Case) -> Preparation:
    """Return how the heat of a case's run is prepared: jumps need it reduced."""
    return "reduced" if case.run.integration == "jump" else "as set"


def _way_on(directory: Path) -> str:
    """Say how to go on after a fault of the disk."""
    reached = checkpoint.reached(directory)
    if reached is None:
        return "there is no checkpoint to go on from: mend the cause, then start anew in a new folder"
    return f"mend the cause, then go on from the checkpoint of half-cycle {reached}: --resume"


class _Run:
    """A run in its folder: takes the blocks, keeps history and checkpoints."""

    def __init__(self, system: Tribosystem, directory: Path, log: Log, *, resume: bool) -> None:
        self.directory, self.log = directory, log
        self.comm, self.case = system.comm, system.case
        start: Moment | None = None
        if resume:
            followed = checkpoint.followed(directory, system)
            if followed is not None:
                system = assemble(self.case, self.comm, followed, heat=preparation_of(self.case))
            start = checkpoint.load(directory, system, self._exchange(system))
            if start.half_cycle >= self.case.run.half_cycles:
                message = f"the run is at half-cycle {start.half_cycle} already; expected more to go on to"
                raise CaseError(Problem("run.half_cycles", message))
        else:
            on_root(self.comm, lambda: make_directory(directory))
        self.system = system
        on_root(self.comm, lambda: write_case(directory, self.case))
        self.writer: HistoryWriter | None = None  # of rank 0
        on_root(self.comm, lambda: self._open_history(None if start is None else start.half_cycle))
        self.start = start
        self.moment = start or Moment(0, system.unworn(), (), None)
        self.last: Block | None = None
        self.extremes = {"largest_equilibrium_error": 0.0}
        self.warnings: list[str] = []
        self.remedies: Counter[str] = Counter()
        if self.case.run.integration == "explicit":
            self.extremes["wear_step_over_explicit_limit"] = stability_number(system)
            self.warnings = _warnings(self.extremes["wear_step_over_explicit_limit"])
        self.warnings += position_warnings(system)
        for warning in self.warnings:
            log(f"warning: {warning}")
        self._fields_at = frozenset(self.case.output.fields_at or ())
        self._checkpoint_due = time.monotonic() + self.case.output.checkpoint

    def _open_history(self, after: int | None) -> None:
        if after is not None and not (self.directory / HISTORY).exists():
            self.log(f"warning: {HISTORY} is gone from {self.directory}: a new one begins after half-cycle {after}")
        self.writer = HistoryWriter(self.directory, self.system, after)

    def _on_history(self, act: Callable[[HistoryWriter], None]) -> None:
        """Let rank 0 write; collective, so that every rank knows of an error."""
        writer = self.writer
        on_root(self.comm, lambda: None if writer is None else act(writer))

    def march(self, progress: Progress) -> None:
        """Compute all half-cycles; collective.

        Raises:
            ConvergenceError: a half-cycle failed.
            InterruptedRunError: a signal has come; the checkpoint is written.
            OutputError: a file cannot be written.
        """
        last, done = self.case.run.half_cycles, self.moment.half_cycle
        with _Signals() as signals:
            for block in _with_progress(self._blocks(), last, done, self.comm, progress):
                self._take(block)
                wishes = signals.received or (time.monotonic() > self._checkpoint_due)
                interrupted, due = self.comm.allreduce(np.array([bool(signals.received), bool(wishes)], dtype=int)) > 0
                if due:
                    self._save()
                if interrupted:
                    raise InterruptedRunError(f"interrupted after half-cycle {self.moment.half_cycle}")

    def _exchange(self, system: Tribosystem) -> HeatExchange | None:
        """Return the heat exchange that the run integrates."""
        return system.exchange

    def _blocks(self) -> Iterator[Block]:
        return follow(self.system, self._integrate, self._exchange, self.start)

    def _integrate(self, system: Tribosystem, start: Moment | None, leave: Callable[[Moment], bool]) -> Iterator[Block]:
        run = self.case.run
        shared: dict[str, Any] = {"periodic_within": run.periodic_within, "start": start, "stops": self._fields_at}
        if run.integration == "jump":
            return jump(system, run.half_cycles, tolerance=run.jump_tolerance, leave=leave, **shared)
        return march(system, run.half_cycles, implicit=run.integration == "implicit", leave=leave, **shared)

    def _take(self, block: Block) -> None:
        if block.system is not self.system:
            self.log(f"after half-cycle {self.moment.half_cycle:,} the meshes follow the worn shape")
            self.system = block.system
        self.last, self.moment = block, block.end
        self._note("largest_equilibrium_error", block.equilibrium_error)
        if block.heat is not None:
            self._note("largest_heat_balance_error", block.heat.balance_error)
        self._tell_remedies(block)
        self._on_history(lambda writer: writer.add(block))
        if int(block.half_cycle[-1]) in self._fields_at:
            self._write_fields(block)

    def _tell_remedies(self, block: Block) -> None:
        for name, count in block.remedies.items():
            times = "once" if count == 1 else f"{count} times"
            which = block.half_cycle[block.retries > 0]
            self.log(
                f"half-cycles {which[0]:,} to {which[-1]:,}: {name}, {times}, where the usual way did not converge"
            )
        self.remedies += block.remedies

    def _note(self, name: str, values: Any) -> None:
        self.extremes[name] = max(self.extremes.get(name, 0.0), float(values.max()))

    def _write_fields(self, block: Block) -> None:
        temperature = block.end.temperature
        temperatures = None
        exchange = self._exchange(self.system)
        if exchange is not None and temperature is not None:
            temperatures = exchange.temperatures(temperature)
        half_cycle, motion = int(block.half_cycle[-1]), self.system.motion
        stroke = (half_cycle - 1) % motion.half_cycles
        phase = stroke * motion.positions + motion.positions // 2
        fields = body_fields(self.system, block.pressure[-1], block.rigid[-1], phase, temperatures)
        write_fields(self.directory, self.system, half_cycle, fields, int(block.direction[-1]), block.end.worn)

    def _save(self) -> None:
        """Write history and checkpoint, in this order: the history reaches as far or farther."""
        self._on_history(HistoryWriter.flush)
        checkpoint.save(self.directory, self.system, self._exchange(self.system), self.moment)
        self._checkpoint_due = time.monotonic() + self.case.output.checkpoint

    def stop(self, failure: Exception | None) -> str:
        """Return how the half-cycles ended."""
        if failure is not None:
            return str(failure)
        return "all half-cycles done" if self.moment.half_cycle >= self.case.run.half_cycles else "periodic"

    def results_so_far(self, failure: Exception) -> str:
        """Say what there is after a run that ended early, and how to go on."""
        if self.moment.half_cycle == 0:
            return f"no half-cycle was done; {self.directory} can be removed"
        reached = f"the results up to half-cycle {self.moment.half_cycle} are in {self.directory}"
        if isinstance(failure, MeshQualityError):
            return f"{reached}; to get further: start anew with coarser elements at the contact, or a thicker body"
        how = "" if isinstance(failure, InterruptedRunError) else ", such as with other solver options behind --"
        return f"{reached}, to go on: --resume{how}"

    def finish(self, how: dict[str, Any], *, report: bool) -> dict[str, Any]:
        """Write what a run ends with, and return the summary; collective."""
        self._on_history(HistoryWriter.close)
        if self.last is None:
            return {}
        if self.moment.half_cycle not in self._fields_at and self.case.output.fields_at is None:
            self._write_fields(self.last)
        if self.moment.half_cycle > 0:
            self._save()
        contacts = joined(self.moment.contacts)
        if self.last.heat is not None and contacts is not None and not self.system.track_deepens:
            self.extremes["growth_rate_per_s"] = growth_rate(self.system, contacts.pressure)
        summary = summarise(self.system, self.last, self.extremes, how)
        on_root(self.comm, lambda: write_summary(self.directory, summary))
        if report:
            on_root(self.comm, lambda: try_report(self.directory, self.log))
        return summary


class _Signals:
    """Notes SIGINT and SIGTERM instead of dying at once."""

    def __enter__(self) -> _Signals:
        self.received = 0
        self._before = {s: signal.signal(s, self._note) for s in (signal.SIGINT, signal.SIGTERM)}
        return self

    def _note(self, number: int, _frame: FrameType | None) -> None:
        if self.received:  # asked twice: now
            raise KeyboardInterrupt
        self.received = number

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)


def position_warnings(system: Tribosystem) -> list[str]:
    """Return what is to be said of the positions of a strip that wears."""
    spacing, motion = system.position_spacing, system.motion
    if not system.track_deepens or spacing <= FAR_APART:
        return []
    wanted = int(np.ceil(motion.positions * spacing))
    return [
        f"the positions of the strip in a half-cycle lie {spacing:.1f} contact nodes apart: its scar will have steps; "
        f"set motion.positions = {wanted}, or use fewer elements along the contact"
    ]


def _warnings(number: float) -> list[str]:
    if number <= 1:
        return []
    return [
        f"the wear of a half-cycle is {number:.3g} times the limit of explicit steps: pressure will oscillate from "
        'node to node; set run.integration = "implicit" or "jump", or use fewer elements along the contact'
    ]


def _with_progress(
    blocks: Iterator[Block], half_cycles: int, done: int, comm: MPI.Comm, progress: Progress
) -> Iterator[Block]:
    """Pass the blocks on and tell of them: on rank 0, and a bar on a terminal only."""
    bar_hidden = progress != "bar" or comm.rank != 0 or not sys.stderr.isatty()
    begin = time.perf_counter()
    with tqdm(total=half_cycles, initial=done, unit=" half-cycles", disable=bar_hidden) as bar:
        for block in blocks:
            number = int(block.half_cycle[-1])
            hot = "" if block.heat is None else f", {block.heat.max_temperature[-1]:.1f} K"
            state = f"p max {block.max_pressure[-1]:.2f} MPa{hot}, change {block.periodicity[-1]:.1e}"
            bar.update(number - bar.n)
            bar.set_postfix_str(state)
            if progress == "lines" and comm.rank == 0:
                rate = (number - done) / (time.perf_counter() - begin)
                left = (half_cycles - number) / rate
                line = f"half-cycle {number:,} of {half_cycles:,}, {rate:,.0f} a second, {left:,.0f} s left, {state}"
                print(line, file=sys.stderr, flush=True)
            yield block
