"""A sweep from the case and its keys to the dataset, and the files and texts of the command."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import xarray
from tqdm import tqdm

from fenwear.case import Case, load_case
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root
from fenwear.results.disk import finite
from fenwear.studies.study import Outcome, Progress, Study, StudyOptions, in_results, named
from fenwear.studies.sweep_dataset import gathered, records, write
from fenwear.studies.sweep_picture import draw
from fenwear.studies.sweep_plan import Axis, Plan, make_axis, make_plan, parse_axis, read_table, run_of
from fenwear.studies.variant import VariantRunner


def sweep(
    case: Case | str | Path,
    over: Mapping[str, object] | Sequence[Axis],
    *,
    of: str = "steady",
    zipped: bool = False,
    progress: Progress = lambda done, total: None,
    **how: Unpack[StudyOptions],
) -> xarray.Dataset:
    """Return the results of a case for many values of its keys; collective.

    Args:
        case: The case that is varied, a case file or the name of a built-in case.
        over: Values of each key: numbers in its internal unit, texts as in a case file, or one text as
            behind `fenwear sweep --over`, such as "0.1:0.3:9".
        of: "steady" for the cyclic steady state, "optimum" for the optimal pressures, "run" for the end of the run.
        zipped: Whether the first values go together, the second ones, and so on; else each with each.
        progress: Called with the numbers of variants done and of all, on rank 0.
        how: Folder, parts, processes, executor and ranks, as `fenwear.studies.StudyOptions`.

    Returns:
        The dataset, whose dimensions are the keys, or "variant" where `zipped`; NaN where a variant failed,
        whose `trouble` gives the reason.

    Raises:
        CaseError: what is asked for makes no sense; nothing is computed.
        InterruptedRunError: interrupted; what is in the folder stays.
        OutputError: the folder takes no file.
        PartDoneError: other parts of the sweep are not done.
    """
    study = Study(**how)
    varied, plan = on_root(study.comm, lambda: _plan(case, over, of, zipped=zipped))
    runs = {variant.place: run_of(variant, plan.of) for variant in plan.variants if variant.possible}
    store = study.open(varied, named("sweep", of))
    done = study.outcomes(VariantRunner(plan.of), list(runs.values()), store, progress)
    outcomes = {place: done[run.name] for place, run in runs.items()}
    for variant in plan.variants:
        if not variant.possible:
            outcomes[variant.place] = Outcome({}, " ".join(str(variant.error).split()))

    def end() -> xarray.Dataset:
        dataset = gathered(varied, plan, outcomes)
        if study.folder is not None:
            write(study.folder, dataset)
        return dataset

    return on_root(study.comm, end)


def _plan(
    given: Case | str | Path, over: Mapping[str, object] | Sequence[Axis], of: str, *, zipped: bool
) -> tuple[Case, Plan]:
    case = given if isinstance(given, Case) else load_case(given)
    axes = [make_axis(case, key, values) for key, values in over.items()] if isinstance(over, Mapping) else list(over)
    return case, make_plan(case, axes, of, zipped=zipped)


Log = Callable[[str], None]
ROWS = 40  # of the table that is printed; all are in sweep.csv
TOLD = 5  # variants that failed


def run_sweep(
    case: Case,
    name: str,
    over: Sequence[str],
    rows: Path | None,
    of: str,
    log: Log,
    *,
    zipped: bool,
    quiet: bool,
    **how: Unpack[StudyOptions],
) -> tuple[xarray.Dataset, Path]:
    """Compute a sweep; write sweep.nc, sweep.csv and sweep.png; collective.

    Args:
        case: The case that is varied.
        name: Names the folder results/sweep-NAME where none is given.
        over: Texts KEY=VALUES.
        rows: A table of variants, instead of `over`.
        of: Computation for each variant.
        log: Called with each message.
        zipped, how: As of `sweep`.
        quiet: Whether there is no progress.

    Raises:
        CaseError, InterruptedRunError, OutputError, PartDoneError: as `sweep`.
    """
    if rows is not None and over:
        raise CaseError(InputError("--table", "given together with --over; expected one of them"))
    how, folder, comm = in_results(how, f"sweep-{name}")
    axes = on_root(comm, lambda: [parse_axis(case, text) for text in over] if rows is None else read_table(rows))
    hidden = quiet or comm.rank != 0 or not sys.stderr.isatty()
    with tqdm(unit=" variants", disable=hidden) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        dataset = sweep(case, axes, of=of, zipped=zipped or rows is not None, progress=progress, **how)
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
        variant = trouble[tuple(place)]
        names = ", ".join(f"{key} = {_text(variant[key])}" for key in variant.coords)
        lines.append(f"failed: {names}: {variant.item()}")
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
    rest = f"\n... {len(frame) - ROWS} more in sweep.csv" if len(frame) > ROWS else ""
    failed = int((dataset["trouble"].values != "").sum())
    count = f"{len(frame)} variants" + (f", {failed} of them failed" if failed else "")
    return f"{shown}{rest}\n{count}"


def as_json(dataset: xarray.Dataset) -> dict[str, Any]:
    """Return what --json prints: a row of numbers for each variant, null where it failed."""
    rows = [{str(key): value for key, value in row.items()} for row in records(dataset).to_dict("records")]
    failed = int((dataset["trouble"].values != "").sum())
    return {"of": dataset.attrs["of"], "variants": finite(rows), "failed": failed}
