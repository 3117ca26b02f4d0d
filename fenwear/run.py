"""A whole run: from a case to the folder of its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from tqdm import tqdm

from fenwear.case import Case
from fenwear.cycle import Block, growth_rate, jump, march, stability_number
from fenwear.errors import ConvergenceError
from fenwear.figures import draw_figures
from fenwear.parallel import on_root
from fenwear.results import HistoryWriter, free_directory, make_directory, summarise, write_case, write_summary
from fenwear.system import System


def run_case(
    case: Case, name: str, output: Path | None, log: Callable[[str], None], comm: MPI.Comm = MPI.COMM_WORLD
) -> tuple[dict[str, Any], Path]:
    """Run a case and write its results; collective.

    Args:
        case: The problem.
        name: Names the folder results/NAME where `output` is None.
        output: New folder of the results.
        log: Called with each message.

    Returns:
        The summary and the folder.

    Raises:
        CaseError: the case or its geometry is wrong, or the folder cannot be made; nothing is written.
        ConvergenceError: a half-cycle failed; the results up to it are in the folder.
    """
    begin = time.perf_counter()
    system = System(case, comm)
    system.prepare()
    setup = time.perf_counter() - begin
    directory = on_root(comm, lambda: output if output is not None else free_directory(Path("results") / name))
    on_root(comm, lambda: make_directory(directory))
    on_root(comm, lambda: write_case(directory, case))
    warnings = _warnings(system)
    for warning in warnings:
        log(f"warning: {warning}")
    writer = HistoryWriter(directory, system) if comm.rank == 0 else None

    begin = time.perf_counter()
    last: Block | None = None
    stop, failure = "all half-cycles done", None
    extremes = {"largest_equilibrium_error": 0.0}
    try:
        for last in _with_progress(_half_cycles(system), case.run.half_cycles, comm):
            extremes["largest_equilibrium_error"] = max(
                extremes["largest_equilibrium_error"], float(last.equilibrium_error.max())
            )
            if last.heat is not None:
                error = float(last.heat.balance_error.max())
                extremes["largest_heat_balance_error"] = max(extremes.get("largest_heat_balance_error", 0.0), error)
            if writer is not None:
                writer.add(last)
    except ConvergenceError as error:
        done = 0 if last is None else int(last.half_cycle[-1])
        stop = str(error)
        failure = ConvergenceError(f"{stop}\nthe results up to half-cycle {done} are in {directory}")
    seconds = time.perf_counter() - begin
    if writer is not None:
        writer.close()
    if last is None:
        raise failure or ConvergenceError("no half-cycle was computed")
    if failure is None and int(last.half_cycle[-1]) < case.run.half_cycles:
        stop = "periodic" if last.periodicity[-1] < (case.run.periodic_within or 0) else stop
    times = {"setup_seconds": setup, "half_cycles_seconds": seconds}
    if last.heat is not None and len(last) >= len(system.motion.directions):
        state = last.pressure[-len(system.motion.directions) :]
        order = [int(np.flatnonzero(last.direction[-len(state) :] == d)[0]) for d in system.motion.directions]
        extremes["growth_rate_per_s"] = growth_rate(system, state[order])
    summary = summarise(system, last, extremes, {"stop": stop, **times, "warnings": warnings})
    on_root(comm, lambda: write_summary(directory, summary))
    on_root(comm, lambda: draw_figures(directory, case.output.figures_at) and None)
    if failure is not None:
        raise failure
    return summary, directory


def _half_cycles(system: System) -> Iterator[Block]:
    run = system.case.run
    if run.integration == "jump":
        return jump(system, run.half_cycles, tolerance=run.jump_tolerance, periodic_within=run.periodic_within)
    return march(system, run.half_cycles, implicit=run.integration == "implicit", periodic_within=run.periodic_within)


def _warnings(system: System) -> list[str]:
    if system.case.run.integration != "explicit":
        return []
    number = stability_number(system)
    if number <= 1:
        return []
    return [
        f"the wear of a half-cycle is {number:.3g} times the limit of explicit steps: pressure will oscillate from "
        'node to node; set run.integration = "implicit" or "jump", or use fewer elements along the contact'
    ]


def _with_progress(blocks: Iterator[Block], half_cycles: int, comm: MPI.Comm) -> Iterator[Block]:
    """Pass the blocks on, with a progress bar on rank 0 where standard error is a terminal."""
    quiet = comm.rank != 0 or not sys.stderr.isatty()
    with tqdm(total=half_cycles, unit=" half-cycles", disable=quiet) as bar:
        for block in blocks:
            bar.update(int(block.half_cycle[-1]) - bar.n)
            hot = "" if block.heat is None else f", {block.heat.max_temperature[-1]:.1f} K"
            bar.set_postfix_str(f"p max {block.max_pressure[-1]:.2f} MPa{hot}, change {block.periodicity[-1]:.1e}")
            yield block
