"""A whole run: from a case to the folder of its results, and on from its checkpoint."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from fenwear.case import Case, OneWay, Reciprocating, Rotation, plausibility_warnings
from fenwear.case.motion_table import MOST_POSITIONS
from fenwear.checks import (
    HeatMonitor,
    Seen,
    StateMonitor,
    law_warnings,
    passing_text,
    sliding_text,
    unique_text,
    uniques,
)
from fenwear.checks.law_choice import resolve_law
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import (
    CaseError,
    ConvergenceError,
    FenwearError,
    InputError,
    InterruptedRunError,
    MeshQualityError,
    OutputError,
)
from fenwear.common.parallel import agreed, on_root
from fenwear.common.progress import How, Log, Progress
from fenwear.common.signals import RunMonitor, Signals
from fenwear.results import checkpoint, layer_results, time_steps
from fenwear.results.fields import body_fields, write_fields
from fenwear.results.history import (
    HISTORY,
    HistoryWriter,
    free_directory,
    grid_of,
    make_directory,
    write_case,
    write_summary,
)
from fenwear.results.history_surfaces import surface_cells
from fenwear.results.quantity import degrees_of
from fenwear.results.summary import HOTTEST, HOTTEST_AT, summarise
from fenwear.steps import (
    Block,
    explicit_growth,
    follow_program,
    integrate,
    stability_number,
    stationary_growth,
)
from fenwear.steps.driver import RunLimits
from fenwear.steps.program_stages import at_loads
from fenwear.steps.run_state import RunState, all_phases, beginning, on_other_grid
from fenwear.surfaces.motion import DEFAULT_POSITIONS
from fenwear.surfaces.sliding_chart import sliding_chart
from fenwear.system import Preparation, Tribosystem, regridded

ACROSS = 0.3  # over what it goes along the sliding: a side of a facet that leads along it
EVEN = 1e-2  # of the range of a profile: a change from node to node that is none
FAR_APART = 2.0  # contact nodes between neighbouring positions of a strip that wears: more leaves steps in its scar
if TYPE_CHECKING:
    from fenwear.studies.run_until import RunLevel

BLOCK_SECONDS = 2.0  # after which a block ends


def print_once(message: str) -> None:
    """Print a message, once on all ranks."""
    if MPI.COMM_WORLD.rank == 0:
        print(message)


def run_case(
    case: Case,
    name: str = "run",
    output: Path | str | None = None,
    log: Log = print_once,
    *,
    resume: bool = False,
    progress: How = "bar",
    comm: MPI.Comm = MPI.COMM_WORLD,
    fresh: bool = False,
) -> tuple[dict[str, Any], Path]:
    """Run a case and write its results; collective.

    Args:
        case: The problem.
        name: Names the folder results/NAME where `output` is None: a new one, NAME-2 where there is NAME.
        output: New folder of the results, or with `resume` the folder of the run to resume.
        log: Called with each message; by default the first rank prints it.
        resume: Go on from the checkpoint in `output`.
        progress: A bar where standard error is a terminal, a line for every block, or none.
        comm: The ranks.
        fresh: Condense the bodies again, even where they are kept on disk.

    Returns:
        The summary and the folder.

    Raises:
        CaseError: the case, its geometry or its checkpoint is wrong, or the folder cannot be made;
            nothing is written.
        ConvergenceError: a half-cycle failed; the results up to it are in the folder.
        InterruptedRunError: a signal ended the run; it can be resumed.
        OutputError: a file cannot be written; what was written before it is whole.
    """
    return run_with(Signals(comm), case, name, output, log, resume=resume, progress=progress, fresh=fresh)


def run_with(
    signals: Signals,
    case: Case,
    name: str,
    output: Path | str | None,
    log: Log,
    *,
    resume: bool,
    progress: How,
    fresh: bool,
) -> tuple[dict[str, Any], Path]:
    """Run a case and write its results, as `run_case`, with signals to look out for; collective."""
    begin, comm = time.perf_counter(), signals.comm
    log = case.names.telling(log)
    resolved = resolve_law(case, log, comm, heat=preparation_of(case), fresh=fresh)
    for line in resolved.system.bodies.solved_by:
        log(line)
    if not resume:
        resolved.system.law.check_touching(resolved.system)
    how = {"setup_seconds": time.perf_counter() - begin, **resolved.numbers}
    directory = Path(output) if output else on_root(comm, lambda: free_directory(Path("results") / name))
    try:
        summary = _run(resolved.system, directory, log, progress, how, signals, resume=resume)
        return summary, directory
    except OutputError as error:
        way_on = on_root(comm, lambda: _way_on(checkpoint.reached(directory)))
        raise OutputError(error.path, error.reason, way_on) from error


def _run(
    system: Tribosystem,
    directory: Path,
    log: Log,
    progress: How,
    how: Mapping[str, Any],
    noted: Signals,
    *,
    resume: bool,
) -> dict[str, Any]:
    run = _Run(system, directory, log, resume=resume)
    failure: FenwearError | None = None
    begin, summary = time.perf_counter(), dict[str, Any]()
    with noted as signals:
        try:
            run.march(progress, signals)
        except (ConvergenceError, InterruptedRunError) as error:
            failure = error
        run.close()  # only a second signal does not wait for it
        if run.last is not None:
            ended = {"stop": run.stop(failure), **how, "half_cycles_seconds": time.perf_counter() - begin}
            summary = run.finish(run.last, ended)
    # Who interrupts a run is in a hurry: its figures can be drawn later.
    hurry = isinstance(failure, InterruptedRunError) or agreed(system.bodies.comm, signals.received)
    if run.last is not None and not hurry:
        summary |= run.uncertainty_and_report(run.last, summary, uncertain=failure is None)
    if failure is not None:
        raise type(failure)(f"{failure}\n{run.results_so_far(failure)}") from failure
    return summary


def preparation_of(case: Case) -> Preparation:
    """Return how the heat of a case's run is prepared: jumps need it reduced."""
    return "reduced" if case.run.integration == "jump" else "as set"


def _way_on(reached: int | None) -> str:
    """Return how to resume after a fault of the disk, from a checkpoint of this half-cycle."""
    if reached is None:
        return "there is no checkpoint to resume from. Mend the cause, then start again in a new folder"
    return f"Mend the cause, then resume from the checkpoint of half-cycle {reached}: --resume"


class NoLevel:
    """Stands for the level of a quantity in a run that ends at none."""

    reached = False

    def see(self, _block: Block) -> int:
        """Return 0: no block reaches it."""
        return 0

    def missed(self, _half_cycle: int) -> list[str]:
        """Return no warnings."""
        return []

    def summary(self, _system: Tribosystem, _state: RunState, _log: Log) -> dict[str, Any]:
        """Return no entries."""
        return {}


class _Run:
    """A run in its folder: takes the blocks, keeps history and checkpoints.

    Attributes:
        writer: Of the history, on rank 0.
    """

    writer: HistoryWriter
    _lookout: RunMonitor  # while it marches

    def __init__(self, system: Tribosystem, directory: Path, log: Log, *, resume: bool) -> None:
        self.directory, self.log = directory, log
        self.comm, self.case = system.bodies.comm, system.case
        self.watch = StateMonitor(system)
        start: RunState | None = None
        self.extremes: dict[str, float] = {}  # of all half-cycles so far
        if resume:
            system, start, self.extremes = checkpoint.load(directory, system)
            laid = on_root(self.comm, lambda: grid_of(directory, system.pair))
            if laid is not None and laid != system.pair.punch.grid:  # killed just after it had grown
                before, system = system, regridded(system, laid)
                start = on_other_grid(start, before, system)
            if start.half_cycle >= self.case.run.half_cycles:
                message = f"the run is at half-cycle {start.half_cycle} already; set a larger number to resume it"
                raise CaseError(InputError("run.half_cycles", message))
        else:
            on_root(self.comm, lambda: make_directory(directory))
        if system.pair.punch.grid != self.watch.system.pair.punch.grid:
            self.watch.move(system)
        self.system = system
        on_root(self.comm, lambda: write_case(directory, self.case))
        on_root(self.comm, lambda: self._open_history(None if start is None else start.half_cycle))
        self.start = start
        self.state = start or beginning(system)
        self.last: Block | None = None
        self._level = level_of(self.case)
        self.numbers: dict[str, float] = {}
        self.warnings: list[str] = []
        self.remedies: Counter[str] = Counter()
        self.unique: list[Mask] = []  # of time steps, whether their answer was the only one near
        if self.case.run.integration == "explicit" and not system.law.sticks:
            self.numbers["wear_step_over_explicit_limit"] = stability_number(system)
            self.warnings = explicit_warnings(system, self.numbers["wear_step_over_explicit_limit"])
        self.warnings += [*position_warnings(system), *system.bodies.remarks, *plausibility_warnings(self.case)]
        self.warnings += [*law_warnings(system), *Seen.of_system(system).warnings("system")]
        if self.case.leaves_positions and system.motion.positions > DEFAULT_POSITIONS:
            log(f"motion.positions: {system.motion.positions} are taken, about as near to each other as contact nodes")
        for warning in self.warnings:
            log(f"warning: {warning}")
        self._heat_watch = HeatMonitor(self.extremes)
        if self.case.program is None:  # else the motion and surroundings of its stages are what counts
            self._see_heat(system, self.state)
        self._fields_at = frozenset(self.case.output.fields_at or ())

    def _see_heat(self, system: Tribosystem, state: RunState) -> None:
        """Look at the heat of a system with the contact of a state; of unworn bodies where it has none; collective."""
        pressure = all_phases(state.contacts).pressure
        known: tuple[Any, Any] = (pressure, state.temperature) if len(pressure) else (None, None)
        for warning in self._heat_watch.see(system, *known):
            self.log(f"warning: {warning}")
        self.extremes.update(self._heat_watch.numbers)

    def _open_history(self, after: int | None) -> None:
        if after is not None and not (self.directory / HISTORY).exists():
            self.log(f"warning: {HISTORY} is gone from {self.directory}: a new one begins after half-cycle {after}")
        self.writer = HistoryWriter(self.directory, self.system, after)

    def _on_history(self, act: Callable[[HistoryWriter], None]) -> None:
        """Let rank 0 write; collective, so that every rank knows of an error."""
        on_root(self.comm, lambda: act(self.writer))

    def march(self, progress: How, signals: Signals) -> None:
        """Compute all half-cycles; collective.

        Raises:
            ConvergenceError: a half-cycle failed.
            InterruptedRunError: a signal has come; the checkpoint is written.
            OutputError: a file cannot be written.
        """
        with Progress("half-cycle", self.case.run.half_cycles, self.state.half_cycle, self.comm, progress) as course:
            every = self.case.output.checkpoint
            self._lookout = RunMonitor(self.comm, signals, course, self._save, every=every, block=BLOCK_SECONDS)
            for block in self._blocks():
                self._take(block)
                course.reached(int(block.half_cycle[-1]), _in_short(block))
                self._lookout.begin_block()
                if self._lookout.look():
                    self._save()
                    raise InterruptedRunError(f"interrupted after half-cycle {self.state.half_cycle}")

    def _watch(self) -> bool:
        """Look, between two solves, whether something is due; return whether the block is to end; collective.

        Raises:
            InterruptedRunError: a signal has come.
        """
        if self._lookout.too_soon:
            return False
        if self._lookout.look():
            raise InterruptedRunError(f"interrupted in the step after half-cycle {self.state.half_cycle}")
        return self._lookout.block_over

    def _blocks(self) -> Iterator[Block]:
        start, last = self.start, self._last
        while last:
            last, end = 0, last
            within = self.case.run.periodic_within
            limits = RunLimits(end, within, stops=self._fields_at, watch=self._watch)
            for block in follow_program(self.system, self._integrate, limits, start):
                at = self.comm.bcast(self._level.see(block))
                reached = int(block.end.half_cycle)
                if 0 < at < reached:  # a jump went beyond the level: made again, up to it
                    start, last = self.state if self.state.half_cycle else self.start, at
                    break
                yield block
                if at or reached >= self._last:  # meshes that nothing more is computed on need not follow
                    return
                if reached >= end:  # not quite at the level yet
                    start, last = block.end, min(reached + self.system.motion.half_cycles, self._last)
                    break

    @property
    def _last(self) -> int:
        """The last half-cycle: cycle jumps take whole cycles only."""
        strokes = self.system.motion.half_cycles if self.case.run.integration == "jump" else 1
        return self.case.run.half_cycles // strokes * strokes

    def _integrate(self, system: Tribosystem, limits: RunLimits, start: RunState | None) -> Iterator[Block]:
        run = self.case.run
        if run.until:
            limits = replace(limits, block=system.motion.half_cycles)
        return integrate(system, limits, start, how=run.integration, tolerance=run.jump_tolerance)

    def _take(self, block: Block) -> None:
        if block.system.bodies.followed is not self.system.bodies.followed:
            self.log(f"after half-cycle {self.state.half_cycle:,} the meshes follow the worn shape")
        elif block.system.pair.punch.grid != self.system.pair.punch.grid:
            self._take_grid(block.system)
        elif block.system.bodies.warmed is not self.system.bodies.warmed:
            self.log(f"after half-cycle {self.state.half_cycle:,} properties are those of the temperatures there")
        if block.system.exchange is not self.system.exchange:
            self._see_heat(block.system, beginning(block.system))
            self._see_heat(block.system, block.end)
        self.system = block.system
        self.extremes |= layer_results.worn_through(block, self.state, self.extremes)
        self.last, self.state = block, block.end
        self._note("largest_equilibrium_error", block.equilibrium_error)
        self._note("largest_complementarity_error", block.complementarity_error)
        if block.heat is not None:
            self._note("largest_heat_balance_error", block.heat.balance_error)
            self._note_hottest(block, time_steps.hottest(block, block.heat))
        for name, value in time_steps.extremes(block).items():
            self._note(name, np.array(value))
        self.unique.append(uniques(block))
        self._tell_remedies(block)
        for warning in self.watch.see(block):
            self.log(f"warning: {warning}")
        self._on_history(lambda writer: writer.add(block))
        if int(block.half_cycle[-1]) in self._fields_at:
            self._write_fields(block)

    def _take_grid(self, system: Tribosystem) -> None:
        """Go on with another contact grid; collective."""
        grid, before = system.pair.punch.grid, self.system
        if grid is None:
            return
        nodes, step = " x ".join(map(str, grid.counts)), max(grid.spacing)
        self.log(f"after half-cycle {self.state.half_cycle:,} the contact grid has {nodes} nodes, {step:.3g} mm apart")
        self.watch.move(system)
        self._on_history(lambda writer: writer.relay(before, system))

    def _tell_remedies(self, block: Block) -> None:
        for name, count in block.remedies.items():
            times = "once" if count == 1 else f"{count} times"
            which = block.half_cycle[block.retries > 0]
            self.log(
                f"half-cycles {which[0]:,} to {which[-1]:,}: {name}, {times}, as the first attempt did not converge"
            )
        self.remedies += block.remedies

    def _note(self, name: str, values: Any) -> None:
        self.extremes[name] = max(self.extremes.get(name, -np.inf), float(values.max()))

    def _note_hottest(self, block: Block, temperatures: Array) -> None:
        at = int(temperatures.argmax())
        if temperatures[at] > self.extremes.get(HOTTEST, -np.inf):
            self.extremes[HOTTEST] = float(temperatures[at])
            self.extremes[HOTTEST_AT] = int(block.half_cycle[at])

    def _write_fields(self, block: Block) -> None:
        temperature = block.end.temperature
        temperatures = None if temperature is None else temperature.temperatures()
        half_cycle, motion = int(block.half_cycle[-1]), self.system.motion
        stroke = (half_cycle - 1) % motion.half_cycles
        phase = stroke * motion.positions + motion.positions // 2
        pressed = at_loads(self.system, float(block.load_factor[-1]))
        friction = block.friction_ratio[-1] if self.system.law.sticks else None
        direction, worn = int(block.direction[-1]), block.end.worn
        now = block.pressure[-1], block.rigid[-1], phase
        fields = body_fields(pressed, *now, temperatures, friction, worn)
        write_fields(self.directory, self.system, half_cycle, fields, direction, worn, block.pressure[-1])

    def _save(self) -> None:
        """Write history and checkpoint, in this order: the history reaches as far or farther."""
        if self.state.half_cycle > 0:
            self._on_history(HistoryWriter.flush)
            checkpoint.save(self.directory, self.system, self.state, self.extremes)

    def _warnings_at_the_end(self, last: Block) -> list[str]:
        """Return the warnings of the case, of all stages and half-cycles; log those of all time steps; collective."""
        if len(all_phases(self.state.contacts).pressure):  # a first half-cycle is no cycle
            self._see_heat(self.system, self.state)
        texts = unique_text(np.concatenate(self.unique)), sliding_text(last), passing_text(last)
        warnings = [*(text for text in texts if text), *self._level.missed(self.state.half_cycle)]
        for warning in warnings:
            self.log(f"warning: {warning}")
        return [*self.warnings, *self._heat_watch.warnings(), *self.watch.warnings(), *warnings]

    def stop(self, failure: Exception | None) -> str:
        """Return how the half-cycles ended."""
        if failure is not None:
            return str(failure)
        if self._level.reached:
            return f"{self.case.run.until} is reached"
        return "all half-cycles done" if self.state.half_cycle >= self._last else "periodic"

    def results_so_far(self, failure: Exception) -> str:
        """Return the text on the results of a run that ended early, and on how to resume it."""
        if self.state.half_cycle == 0:
            return f"no half-cycle was done; {self.directory} can be removed"
        reached = f"the results up to half-cycle {self.state.half_cycle} are in {self.directory}"
        if isinstance(failure, MeshQualityError):
            return f"{reached}. Start again with coarser elements at the contact, or a thicker body"
        how = "" if isinstance(failure, InterruptedRunError) else ", such as with other solver options behind --"
        return f"{reached}, to resume: --resume{how}"

    def close(self) -> None:
        """Write the rest of the history; collective."""
        self._on_history(HistoryWriter.close)

    def finish(self, last: Block, how: dict[str, Any]) -> dict[str, Any]:
        """Write the checkpoint first, then fields and summary of a run, and return the summary; collective."""
        said = [self.system.case.names.with_names(text) for text in self._warnings_at_the_end(last)]
        self._save()
        how |= {"warnings": said, "retries": self.remedies}
        if self.state.half_cycle not in self._fields_at and self.case.output.fields_at is None:
            self._write_fields(last)
        how |= self._level.summary(self.system, self.state, self.log)
        if reason := self._note_growth(last):
            how["no_growth_rate"] = reason
        summary = summarise(self.system, last, {**self.extremes, **self.numbers}, how)
        on_root(self.comm, lambda: write_summary(self.directory, summary))
        return summary

    def uncertainty_and_report(self, last: Block, summary: dict[str, Any], *, uncertain: bool) -> dict[str, Any]:
        """Estimate the uncertainty of what is written, draw it, and return the summary with it; collective."""
        if uncertain and self.case.output.uncertainty:
            summary |= self._uncertainty(last)
            on_root(self.comm, lambda: write_summary(self.directory, summary))
        if self.case.output.report:
            from fenwear.report.page import try_report  # plotting libraries, which few runs of many need

            on_root(self.comm, lambda: try_report(self.directory, self.log))
        return summary

    def _uncertainty(self, last: Block) -> dict[str, Any]:
        """Return the table of the uncertainty of the final numbers; collective.

        The results are safe by now: what fails here is a warning.
        """
        from fenwear.checks import uncertainty, uncertainty_table

        try:
            estimate = uncertainty(self.case, last)
        except (FenwearError, ArithmeticError, RuntimeError, ValueError) as error:
            self.log(f"warning: the numerical uncertainty of the run could not be estimated: {error}")
            return {}
        return {"uncertainty": uncertainty_table(last.system, estimate)}

    def _note_growth(self, last: Block) -> str:
        """Note the growth rate of a stationary end with heat; return why there is none, if it could be."""
        pressure, motion = all_phases(self.state.contacts).pressure, self.system.motion
        if last.heat is None or not len(pressure) or self.system.phases.track_changes or self.system.law.sticks:
            return ""
        if self.case.program is not None and self.case.program.steps[-1].ramps:
            return "the last step of the program changes speed or loads, so that no state is stationary"
        surfaces = (last.heat.temperature_punch[-1], last.heat.temperature_strip[-1])
        phase = self.state.half_cycle % motion.half_cycles * motion.positions
        change = float(last.periodicity[-motion.half_cycles :].max())
        rate, reason = stationary_growth(self.system, pressure, surfaces, phase, change)
        if rate is not None:
            self.numbers["growth_rate_per_s"] = rate
        return reason


def level_of(case: Case) -> RunLevel | NoLevel:
    """Return the level of a quantity that ends a run."""
    if not case.run.until:
        return NoLevel()
    from fenwear.studies.run_until import RunLevel  # with all that studies need

    return RunLevel(case)


def position_warnings(system: Tribosystem) -> list[str]:
    """Return the warnings of the positions of a strip that wears, or that is uneven."""
    spacing, motion = system.sliding.position_spacing, system.motion
    stands = _standing_profile(system)
    if stands or not system.phases.track_changes or spacing <= FAR_APART:
        return stands
    wanted = int(np.ceil(motion.positions * spacing))
    return [
        f"motion.positions: positions of the strip in a half-cycle lie {spacing:.1f} contact nodes apart. Its track "
        f"will have steps. {_with_positions(wanted)}"
    ]


def _with_positions(number: int) -> str:
    """Return the advice to take a number of positions of the strip, or a mesh that needs fewer."""
    if number <= MOST_POSITIONS:
        return f"Set `motion.positions = {number}`"
    longer = f"Make elements at the contact {number / MOST_POSITIONS:.2g} times as long"
    return f"{longer}, and set `motion.positions = {MOST_POSITIONS}`, the most"


def _standing_profile(system: Tribosystem) -> list[str]:
    """Return the warning of an uneven strip that slides by: in each position it stands still."""
    slid = system.sliding.position_spacing or float(system.sliding.path.max()) / system.pair.punch.spacing()
    rough = bool(system.pair.strip.heights.any())
    if not system.case.passes or slid <= 1 or not (rough or _uneven(system)):
        return []
    key = "strip.topography" if rough else "strip.profile"
    motion = system.case.motion
    if isinstance(motion, OneWay | Rotation):
        wanted = f"Sliding one way has no positions that follow it: give {key.replace('strip', 'punch')} instead"
    elif isinstance(motion, Reciprocating):
        positions = system.motion.positions
        needed = math.ceil(slid * (positions if positions > 1 else math.pi / 2))  # in the middle they are far apart
        wanted = _with_positions(needed)
    else:
        wanted = "Give rows of the cycle as close to each other as contact nodes"
    return [
        f"{key}: the strip slides over {slid:.3g} contact nodes from position to position, and its uneven surface "
        f"stands still in each. The punch takes its imprint, where it should pass. {wanted}"
    ]


def _uneven(system: Tribosystem) -> bool:
    """Return whether the strip's profile changes along the sliding: a worn track that is uniform does not."""
    strip, depth = system.pair.strip, system.pair.strip.below_mesh
    if system.case.strip.profile is None:
        return False
    places = np.column_stack([strip.abscissa, np.zeros(len(depth))])
    if strip.dim == 3:
        places = sliding_chart(system.sliding.field, system.pair).coordinates(strip.x)
    cells = surface_cells(strip)
    sides = np.vstack([cells[:, [k - 1, k]] for k in range(cells.shape[1])])
    along, across = np.abs(np.diff(places[sides], axis=1)[:, 0]).T
    changes = np.abs(np.diff(depth[sides], axis=1)[:, 0])[across < ACROSS * along]
    return bool(changes.max(initial=0.0) > EVEN * np.ptp(depth))


def explicit_warnings(system: Tribosystem, number: float) -> list[str]:
    """Return the warnings of explicit steps of wear whose step is a number of times their limit; collective."""
    if number > 1:
        return [
            f"run.integration: the wear of a half-cycle is {number:.3g} times the limit of explicit steps. Pressures "
            'will oscillate from node to node. Set `run.integration = "implicit"` or "jump", or use fewer elements '
            "along the contact"
        ]
    growth = explicit_growth(system)
    if growth is None:
        return []
    return [
        f"run.integration: with heat, explicit steps of wear let disturbances of the contact grow by {growth:.3g} 1/s. "
        'Pressures will not settle. Set `run.integration = "implicit"` or "jump"'
    ]


def _in_short(block: Block) -> str:
    """Return the state at the end of a block, in a line."""
    degrees = degrees_of(block.system.case)
    hot = "" if block.heat is None else f", {block.heat.largest_temperature[-1] - degrees.zero:.1f} {degrees.shown}"
    return f"p max {block.largest_pressure[-1]:.2f} MPa{hot}, change {block.periodicity[-1]:.1e}"
