"""A sweep from the case and its keys to the dataset, and what the command does with it: writes it, reports it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from mpi4py import MPI
from tqdm import tqdm

from fenwear.case import Case, load_case
from fenwear.errors import CaseError, InputError, InterruptedRunError
from fenwear.parallel import on_root
from fenwear.results.disk import finite, writing
from fenwear.results.history import free_directory, make_directory, write_case
from fenwear.sweeps.engines import outcomes
from fenwear.sweeps.picture import draw
from fenwear.sweeps.plan import Axis, Plan, make_axis, make_plan, parse_axis, read_table
from fenwear.sweeps.store import VARIANTS, Outcome, gathered, kept, records, write

Progress = Callable[[int, int], None]


def sweep(
    case: Case | str | Path,
    over: Mapping[str, object] | Sequence[Axis],
    *,
    of: str = "steady",
    zipped: bool = False,
    folder: Path | str | None = None,
    resume: bool = False,
    processes: int | None = 1,
    comm: MPI.Intracomm = MPI.COMM_WORLD,
    progress: Progress = lambda done, total: None,
) -> xarray.Dataset:
    """Return the results of a case for many values of its keys; collective.

    Args:
        case: The case that is varied, a case file or the name of a built-in case.
        over: Values of each key: numbers in its internal unit, texts as in a case file, or one text as
            behind `fenwear sweep --over`, such as "0.1:0.3:9".
        of: "steady" for the cyclic steady state, "optimum" for the optimal pressures, "run" for the end of the run.
        zipped: Whether the first values go together, the second ones, and so on; else each with each.
        folder: New folder of sweep.nc and sweep.csv, where each variant is kept as soon as it is done.
        resume: Go on in the folder: what it has is not computed again.
        processes: Local processes; None for as many as there are cores, where that is worth their start.
        comm: The ranks; from two on, all but the first compute.
        progress: Told of the variants done and of all, on rank 0.

    Returns:
        The dataset, whose dimensions are the keys, or "variant" where `zipped`; NaN where a variant failed,
        whose `trouble` says why.

    Raises:
        CaseError: what is asked for makes no sense; nothing is computed.
        InterruptedRunError: interrupted; what is in the folder stays.
        OutputError: the folder takes no file.
    """
    folder = None if folder is None else Path(folder)
    if processes is not None and processes < 1:
        raise CaseError(InputError("--processes", f"expected one or more, got {processes}"))
    if resume and folder is None:
        raise CaseError(InputError("--resume", "expected the folder of the sweep to resume, as -o DIR"))
    begun: list[tuple[Case, Plan, dict[tuple[int, ...], Outcome]]] = []
    on_root(comm, lambda: begun.append(_begin(case, over, of, folder, zipped=zipped, resume=resume)))
    failure: Exception | None = None
    if not begun:
        for _ in outcomes([], "steady", folder, processes, comm):  # works for rank 0
            pass
    else:
        try:
            _compute(begun[0][1], begun[0][2], folder, processes, comm, progress)
        except (Exception, KeyboardInterrupt) as error:  # raised below, on all ranks
            failure = _told(error, begun[0][1], folder)
    return on_root(comm, lambda: _end(*begun[0], folder, failure))


def _begin(
    given: Case | str | Path,
    over: Mapping[str, object] | Sequence[Axis],
    of: str,
    folder: Path | None,
    *,
    zipped: bool,
    resume: bool,
) -> tuple[Case, Plan, dict[tuple[int, ...], Outcome]]:
    """Return the case, the plan and what is known of it before any computation."""
    case = given if isinstance(given, Case) else load_case(given)
    axes = [make_axis(case, key, values) for key, values in over.items()] if isinstance(over, Mapping) else list(over)
    plan = make_plan(case, axes, of, zipped=zipped)
    known: dict[tuple[int, ...], Outcome] = {}
    for variant in plan.variants:
        if not variant.possible:
            known[variant.place] = Outcome(variant.place, {}, " ".join(str(variant.error).split()), 0.0)
    if folder is None:
        return case, plan, known
    if not resume:
        if (folder / VARIANTS).is_dir():
            how = "a new or an empty folder, or --resume to continue it"
            raise CaseError(InputError("-o", f"{folder} holds a sweep already; expected {how}"))
        make_directory(folder)
    elif not (folder / VARIANTS).is_dir():
        raise CaseError(InputError("--resume", f"{folder} holds no sweep to resume"))
    with writing(folder):
        (folder / VARIANTS).mkdir(exist_ok=True)
    write_case(folder, case)
    known |= {found.place: found for variant in plan.variants for found in kept(folder, variant)}
    return case, plan, known


def _compute(
    plan: Plan,
    known: dict[tuple[int, ...], Outcome],
    folder: Path | None,
    processes: int | None,
    comm: MPI.Intracomm,
    progress: Progress,
) -> None:
    left = [variant for variant in plan.variants if variant.place not in known]
    progress(len(known), len(plan.variants))
    for done in outcomes(left, plan.of, folder, processes, comm):
        known |= {one.place: one for one in done}
        progress(len(known), len(plan.variants))


def _told(error: BaseException, plan: Plan, folder: Path | None) -> Exception:
    """Return the reason that ended the sweep, with the way to resume it."""
    if isinstance(error, Exception) and not isinstance(error, InterruptedRunError):
        return error
    what = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
    if folder is None:
        return InterruptedRunError(what)
    count = sum(len(kept(folder, variant)) for variant in plan.variants)
    return InterruptedRunError(f"{what}\n{count} of {len(plan.variants)} variants are in {folder}, to resume: --resume")


def _end(
    case: Case,
    plan: Plan,
    known: Mapping[tuple[int, ...], Outcome],
    folder: Path | None,
    failure: Exception | None,
) -> xarray.Dataset:
    if failure is not None:
        raise failure
    dataset = gathered(case, plan, known)
    if folder is not None:
        write(folder, dataset)
    return dataset


Log = Callable[[str], None]
ROWS = 40  # of the table that is printed; all are in sweep.csv
TOLD = 5  # variants that failed


def run_sweep(
    case: Case,
    name: str,
    over: Sequence[str],
    rows: Path | None,
    of: str,
    output: Path | None,
    log: Log,
    *,
    zipped: bool,
    resume: bool,
    processes: int | None,
    quiet: bool,
    comm: MPI.Intracomm = MPI.COMM_WORLD,
) -> tuple[xarray.Dataset, Path]:
    """Compute a sweep; write sweep.nc, sweep.csv and sweep.png; collective.

    Args:
        case: The case that is varied.
        name: Names the folder results/sweep-NAME where `output` is None.
        over: Texts KEY=VALUES.
        rows: A table of variants, instead of `over`.
        of: Computation for each variant.
        output: The folder.
        log: Called with each message.
        zipped, resume, processes: As of `sweep`.
        quiet: Whether there is no progress.
        comm: The ranks.

    Raises:
        CaseError, InterruptedRunError, OutputError: as `sweep`.
    """
    if rows is not None and over:
        raise CaseError(InputError("--table", "given together with --over; expected one of them"))
    if resume and output is None:
        raise CaseError(InputError("--resume", "expected the folder of the sweep to resume, as -o DIR"))
    axes = on_root(comm, lambda: [parse_axis(case, text) for text in over] if rows is None else read_table(rows))
    folder = output or on_root(comm, lambda: free_directory(Path("results") / f"sweep-{name}"))
    hidden = quiet or comm.rank != 0 or not sys.stderr.isatty()
    with tqdm(unit=" variants", disable=hidden) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        dataset = sweep(
            case, axes, of=of, zipped=zipped or rows is not None, folder=folder, resume=resume, processes=processes,
            comm=comm, progress=progress,
        )  # fmt: skip
    on_root(comm, lambda: draw(dataset, folder))
    for line in failures(dataset):
        log(line)
    return dataset, folder


def failures(dataset: xarray.Dataset) -> list[str]:
    """Return what is to be said of variants that failed."""
    trouble = dataset["trouble"]
    places = np.argwhere(trouble.values != "")
    lines = []
    for place in places[:TOLD]:
        own = trouble[tuple(place)]
        names = ", ".join(f"{key} = {_text(own[key])}" for key in own.coords)
        lines.append(f"failed: {names}: {own.item()}")
    if len(places) > TOLD:
        lines.append(f"failed: {len(places) - TOLD} more; sweep.csv has them all")
    return lines


def _text(value: xarray.DataArray) -> str:
    unit = value.attrs.get("units", "")
    return f"{value.item():.6g} {unit}".strip() if value.dtype.kind in "if" else str(value.item())


def text(dataset: xarray.Dataset) -> str:
    """Return the table of the variants' numbers for people."""
    frame = records(dataset).drop(columns=["trouble", "seconds (s)"])
    if "variant" in frame and "variant" not in dataset.coords:
        frame["variant"] += 1
    shown = frame.head(ROWS).to_string(index=False, float_format=lambda value: f"{value:.5g}")
    more = f"\n... {len(frame) - ROWS} more in sweep.csv" if len(frame) > ROWS else ""
    failed = int((dataset["trouble"].values != "").sum())
    count = f"{len(frame)} variants" + (f", {failed} of them failed" if failed else "")
    return f"{shown}{more}\n{count}"


def as_json(dataset: xarray.Dataset) -> dict[str, Any]:
    """Return what --json prints: a row of numbers for each variant, null where it failed."""
    rows = [{str(key): value for key, value in row.items()} for row in records(dataset).to_dict("records")]
    failed = int((dataset["trouble"].values != "").sum())
    return {"of": dataset.attrs["of"], "variants": finite(rows), "failed": failed}
