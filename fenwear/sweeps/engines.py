"""Computation of one variant, and its processes: this process, local processes, or the ranks of an MPI job.

Ranks use mpi4py's MPICommExecutor, which needs no process to be started by another one and so runs under
every launcher and in every container. Local processes are joblib's loky: they are started as new processes, as MPI and
PETSc do not survive a fork, and need no guard in the script that starts them. Either way rank 0, or the process that
began, shares out pieces and gathers; each worker has a system of its own.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from pathlib import Path
from typing import cast

import numpy as np
from mpi4py import MPI
from mpi4py.futures import MPICommExecutor
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Preparation, Tribosystem, assemble, set_up_by, with_case
from fenwear.case import Case
from fenwear.cycle import Block, at_step, evolve, steady
from fenwear.cycle.steady_cycle import SteadyCycle, cycle_of_state
from fenwear.errors import ConvergenceError, FenwearError, InterruptedRunError, OutputError
from fenwear.law_choice import check_decided
from fenwear.results import registry
from fenwear.results.quantity import RECORD, computed
from fenwear.results.summary import nominal_pressure
from fenwear.stick.final import FinalShape, cycle_of_final
from fenwear.sweeps.plan import Of, Variant, in_pieces, preparation_for
from fenwear.sweeps.store import Outcome, Values, keep

FIELDS = ("pressure", "wear", "temperature_punch", "temperature_strip")  # of the registry; and single numbers
LEFT_OUT = ("half_cycle", "time", "direction")


class VariantRunner:
    """Computes one variant after another, on this process alone, and keeps what the next may share."""

    def __init__(self) -> None:
        self._system: Tribosystem | None = None
        self._key: tuple[object, ...] = ()

    def values(self, case: Case, of: Of) -> Values:
        """Return the results of a case by their names.

        Raises:
            FenwearError: as the assembly of the case and its solution.
        """
        system = self._assembled(case, preparation_for(case, of))
        if of != "optimum":
            check_decided(system)
        return {**_nodes(system), **COMPUTED[of](system)}

    def _assembled(self, case: Case, heat: Preparation) -> Tribosystem:
        key = (heat, *set_up_by(case))
        if self._system is None or self._key != key:
            self._system = None  # two at once may be more than there is room for
            self._system, self._key = assemble(case, MPI.COMM_SELF, heat=heat), key
        else:
            self._system = with_case(self._system, case)
        return self._system


def _nodes(system: Tribosystem) -> dict[str, Array]:
    nodes = system.pair.punch.x
    across = {"y": nodes[:, 1]} if system.case.model.kind == "solid" else {}
    return {"x": nodes[:, 0], **across, "weight": system.pair.weights}


def _registered(system: Tribosystem, records: Block | SteadyCycle) -> dict[str, Array]:
    """Return the quantities of the last cycle of records of half-cycles, by their names."""
    strokes = system.motion.half_cycles
    numbers = [
        one
        for one in registry.quantities_of(system).values()
        if (one.dims in (RECORD, ()) or one.name in FIELDS)
        and one.name not in LEFT_OUT
        and (isinstance(records, Block) or (one.steady and (records.moves or one.nodal)))
    ]
    found, nominal = computed(records, numbers), nominal_pressure(system, float(records.load[-1]))
    values = {"direction": np.array(system.motion.stroke_directions, dtype=float)}
    for one in numbers:
        rows = np.asarray(found[one.name], dtype=float)
        if one.dims:
            rows = rows[-1] if one.cycle == "last" else _by_half_cycle(rows, records.half_cycle, strokes)
        values[one.name] = rows
    return {**values, **{name: np.array(value) for name, value in nominal.items()}}


def _by_half_cycle(rows: Array, numbers: NDArray[np.int64], count: int) -> Array:
    """Return the last row of each half-cycle of the cycle, NaN where there is none."""
    found = np.full((count, *rows.shape[1:]), np.nan)
    found[(numbers[-count:] - 1) % count] = rows[-count:]
    return found


def _final_shape(system: Tribosystem) -> Values:
    """Return the shape to which partial slip wears."""
    found = cast(FinalShape, steady(system))  # under Coulomb's law
    system, thickness = found.system, found.system.bodies.punch.thickness
    values = _registered(system, cycle_of_final(found))
    size = "stick_area" if system.pair.punch.dim == 3 else "stick_width"
    values |= {size: np.array(found.size), "wear": found.worn.punch, "largest_depth": found.worn.punch.max()}
    values["worn_volume"] = np.array(thickness * float(system.pair.weights @ found.worn.punch))
    if system.strip_wears:
        values["largest_depth_strip"] = np.array(found.worn.strip.max())
        volume = thickness * float(system.pair.strip.weights @ found.worn.strip)
        values["worn_volume_strip"] = np.array(volume)
    return values


def _steady(system: Tribosystem) -> Values:
    if system.sticks:
        return _final_shape(system)
    state = steady(system)
    return {
        **_registered(state.system, cycle_of_state(state)),
        "shape": state.shape,
        "wear_per_cycle": state.wear_per_cycle,
        **{name: np.array(value) for name, value in state.velocity.items()},
        "iterations": np.array(float(state.iterations)),
    }


def _optimum(system: Tribosystem) -> Values:
    system = at_step(system)
    directions = system.motion.stroke_directions
    found = [system.optimum(d) for d in directions]
    nominal = nominal_pressure(system, system.normal_force)
    return {
        "direction": np.array(directions, dtype=float),
        "pressure": np.array([one.pressure for one in found]),
        "largest_pressure": np.array([one.pressure.max() for one in found]),
        **{name: np.array(value) for name, value in nominal.items()},
        "angle": np.array([one.tilt for one in found]),
        **{name: np.array([one.velocity[name] for one in found]) for name in found[0].velocity},
    }


def _run(system: Tribosystem) -> Values:
    """Return the last cycle of the case's run."""
    ends = deque(evolve(system), maxlen=1)
    if not ends:
        raise ConvergenceError("no half-cycle was done: expected run.half_cycles of one cycle at least")
    last = ends[0]
    found = {**_registered(last.system, last), "half_cycles": np.array(float(last.half_cycle[-1]))}
    return {name: np.asarray(values, dtype=float) for name, values in found.items()}


COMPUTED: Mapping[Of, Callable[[Tribosystem], Values]] = {"steady": _steady, "optimum": _optimum, "run": _run}


WORTH = 8.0  # s of work for one process from which on several are started: each takes about 2 s to begin
_workshop = VariantRunner()  # of a worker: what its last variant was computed on


def compute(piece: Sequence[Variant], of: Of, folder: Path | None) -> list[Outcome]:
    """Compute variants that share their set-up, on this process, and keep each in the folder as it is done.

    Raises:
        OutputError: the folder takes no file.
    """
    return [_one(_workshop, variant, of, folder) for variant in piece]


def _one(workshop: VariantRunner, variant: Variant, of: Of, folder: Path | None) -> Outcome:
    begin = time.perf_counter()
    try:
        values = workshop.values(variant.case, of)
    except OutputError:
        raise
    except FenwearError as error:
        return Outcome(variant.place, {}, " ".join(str(error).split()), time.perf_counter() - begin)
    except Exception as error:  # one variant must not cost the others
        print(f"fenwear: {', '.join(variant.settings)}", file=sys.__stderr__)
        traceback.print_exc(file=sys.__stderr__)
        text = f"an error that was not foreseen: {' '.join(str(error).split())}"
        return Outcome(variant.place, {}, text, time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    if folder is not None:
        keep(folder, variant.name, values, seconds)
    return Outcome(variant.place, values, "", seconds)


def outcomes(
    left: Sequence[Variant], of: Of, folder: Path | None, processes: int | None, comm: MPI.Intracomm
) -> Iterator[list[Outcome]]:
    """Yield the outcomes of variants as they are done, on rank 0; the others work, and yield nothing; collective.

    Args:
        left: The variants; of the other ranks' nothing is asked.
        of: Computation for each variant.
        folder: Where each is kept as it is done; None for nowhere.
        processes: Local processes; None for as many as there are cores, where that is worth their start. On
            several ranks these are the workers instead.
        comm: The ranks.

    Raises:
        InterruptedRunError: a process has ended.
        OutputError: the folder takes no file.
    """
    if comm.size > 1:
        with MPICommExecutor(comm, root=0) as executor:
            if executor is not None:
                yield from _shared_out(cast(Executor, executor), in_pieces(left, of, comm.size - 1), of, folder)
        return
    rest = list(left)
    if processes is None or processes == 1:
        cores = len(os.sched_getaffinity(0)) if processes is None else 1
        for outcome in _alone(left, of, folder, cores):
            rest = [variant for variant in rest if variant.place != outcome.place]
            yield [outcome]
        processes = cores
    if rest:
        pieces = in_pieces(rest, of, processes)
        with _processes(min(processes, len(pieces))) as executor:
            yield from _shared_out(executor, pieces, of, folder)


def _alone(left: Sequence[Variant], of: Of, folder: Path | None, cores: int) -> Iterator[Outcome]:
    """Yield the outcomes that this process computes: all, or those before several cores are worth their start."""
    workshop, seconds = VariantRunner(), 0.0
    ordered = [variant for piece in in_pieces(left, of, 1) for variant in piece]
    for done, variant in enumerate(ordered, 1):
        outcome = _one(workshop, variant, of, folder)
        seconds += outcome.seconds
        yield outcome
        if cores > 1 and done > 1 and seconds / done * (len(ordered) - done) > WORTH:
            return


def _shared_out(
    executor: Executor, pieces: Sequence[Sequence[Variant]], of: Of, folder: Path | None
) -> Iterator[list[Outcome]]:
    waiting: set[Future[list[Outcome]]] = set()
    try:
        waiting |= {executor.submit(compute, piece, of, folder) for piece in pieces}
        while waiting:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BrokenExecutor as error:
        raise InterruptedRunError(
            "a process of the sweep has ended, perhaps for lack of memory: expected fewer processes at once"
        ) from error
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def _processes(count: int) -> Iterator[Executor]:
    """Open local processes; what is not done when the caller leaves is not begun any more."""
    from joblib.externals.loky import ProcessPoolExecutor

    # One thread each: their number times the threads of BLAS must not exceed the cores.
    threads = {name: os.environ.get(name, "1") for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    executor = ProcessPoolExecutor(max_workers=count, env=threads, initializer=_begin)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, kill_workers=True)
        raise
    executor.shutdown()


def _begin() -> None:
    """Leave an interruption to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
