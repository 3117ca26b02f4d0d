"""What the command sweep does: computes, writes into a folder, tells."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from mpi4py import MPI
from tqdm import tqdm

from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.parallel import on_root
from fenwear.results.history import free_directory
from fenwear.sweeps.axes import parse_axis, read_table
from fenwear.sweeps.picture import draw
from fenwear.sweeps.store import records
from fenwear.sweeps.sweep import sweep

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
        of: What is computed of each variant.
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
        raise CaseError(InputError("--resume", "expected the folder of the sweep to go on with, as -o DIR"))
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
    frame = records(dataset)
    rows = [
        {str(k): None if isinstance(v, float) and not np.isfinite(v) else v for k, v in row.items()}
        for row in frame.to_dict("records")
    ]
    failed = int((dataset["trouble"].values != "").sum())
    return {"of": dataset.attrs["of"], "variants": rows, "failed": failed}
