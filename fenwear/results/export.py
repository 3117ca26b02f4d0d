"""CSV files of a run, made from history.nc alone: its course, and the profiles of both surfaces.

Nothing here knows the kind of the model: a variable over the records is a column of the course, one over the records
and the nodes of a surface a column of that surface's profile for each chosen record. A record is a kept half-cycle; in
partial slip a kept cycle, whose time steps make a file of their own: the loops of force and displacement.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from fenwear.errors import CaseError, InputError
from fenwear.results.cycles import by_cycles, resolves
from fenwear.results.disk import write_text, writing
from fenwear.results.history import HISTORY
from fenwear.results.reading import load_history

FOLDER = "export"
COURSE, LOOPS = "history.csv", "loops.csv"
RECORDS = {"half_cycle": "half-cycle"}  # what the records of a run are, and its word
SURFACES = {"profile_punch.csv": ("x", "node"), "profile_strip.csv": ("x_strip", "node_strip")}
STEPS = "step"
RAISED = {"": 1, "_strip": -1}  # wear lowers the strip; the punch's surface, which looks down, it raises
ENDS = ("first", "last")

Column = tuple[str, Sequence[Any]]  # heading and values


def export(directory: Path, folder: Path | None = None, at: str = "first,last") -> list[Path]:
    """Write a run's history and profiles as CSV, a line of names and units above the values.

    Args:
        directory: Of the run.
        folder: Where to; by default `export` in the run's. Files of an earlier export are replaced.
        at: Kept half-cycles whose profiles are wanted, with commas; first and last stand for numbers.

    Returns:
        The files.

    Raises:
        CaseError: there is no readable history, or a half-cycle was not kept.
        OutputError: a file cannot be written.
    """
    history = load_history(directory)
    record = _record(directory / HISTORY, history)
    rows = chosen_rows(history, record, at)
    tables = {COURSE: _course(history, record)}
    if resolves(history):
        tables[LOOPS] = _loops(history, rows)
    for name, dimensions in SURFACES.items():
        for dimension in dimensions:
            if dimension in history.sizes:
                tables[name] = _profile(history, record, dimension, rows)
    target = directory / FOLDER if folder is None else folder
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
    for name, columns in tables.items():
        write_text(target / name, _text(columns))
    return [target / name for name in tables]


def _record(path: Path, history: xarray.Dataset) -> str:
    """Return the dimension of the records.

    Raises:
        CaseError: the file is no history, or holds no record yet.
    """
    record = next((name for name in RECORDS if name in history.sizes and name in history.variables), None)
    if record is None:
        raise CaseError(InputError(str(path), "no history of a run: it has other variables"))
    if history.sizes[record] == 0:
        raise CaseError(InputError(str(path), f"holds no {RECORDS[record]} yet"))
    return record


def chosen_rows(history: xarray.Dataset, record: str, at: str) -> list[int]:
    """Return the rows of the chosen records, in their order.

    Raises:
        CaseError: one was not kept, or is no number.
    """
    kept: list[int] = [int(number) for number in history[record].values]
    rows = {str(number): row for row, number in enumerate(kept)}
    rows |= {"first": 0, "last": len(kept) - 1}
    words = [word.strip() for word in at.split(",") if word.strip()]
    plain = [word.lstrip("0") or "0" if word.isdecimal() else word for word in words]
    wrong = [word for word in plain if not (word.isdecimal() or word in ENDS)]
    if wrong or not words:
        text = f"expected numbers of kept {RECORDS[record]}s, first or last, with commas, got {(wrong or [at])[0]!r}"
        raise CaseError(InputError("--at", text))
    missing = [word for word in plain if word not in rows]
    if missing:
        wanted = int(missing[0])
        near = min(kept, key=lambda number: abs(number - wanted))
        text = (
            f"{RECORDS[record]} {missing[0]} was not kept, but {near} was, the nearest of {len(kept)} "
            f"from {kept[0]} to {kept[-1]}"
        )
        raise CaseError(InputError("--at", text))
    return sorted({rows[word] for word in plain})


def _course(history: xarray.Dataset, record: str) -> list[Column]:
    names = [record, *(name for name in history.data_vars if history[name].dims == (record,))]
    return [(_heading(history, name), history[name].values.tolist()) for name in names]


def _loops(history: xarray.Dataset, rows: Sequence[int]) -> list[Column]:
    """Return the time steps of the cycles that end with the chosen half-cycles or hold them, one below the other."""
    cycles = by_cycles(history)
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    wanted = {-(-int(history.half_cycle[row]) // strokes) for row in rows}
    cycles = cycles.isel(cycle=[k for k, number in enumerate(cycles.cycle.values) if int(number) in wanted])
    there = np.isfinite(cycles.fraction.values)
    columns: list[Column] = [("cycle", np.repeat(cycles.cycle.values, there.sum(axis=1)).tolist())]
    for name in cycles.variables:
        if cycles[name].dims == ("cycle", STEPS):
            columns.append((_heading(cycles, name), cycles[name].values[there].tolist()))
    return columns


def _profile(history: xarray.Dataset, record: str, dimension: str, rows: Sequence[int]) -> list[Column]:
    """Return the places on a surface, its unworn height where known, and what there is of each chosen record."""
    places = [name for name in history.variables if history[name].dims == (dimension,)]
    columns: list[Column] = [(_heading(history, name), history[name].values.tolist()) for name in places]
    end = "_strip" if dimension.endswith("_strip") else ""
    for row in rows:
        number = int(history[record].values[row])
        at = f" at {RECORDS[record]} {number}"
        for name in history.data_vars:
            if history[name].dims != (record, dimension):
                continue
            values = history[name][row].values
            columns.append((_heading(history, name, at), values.tolist()))
            if name == f"wear{end}" and f"height{end}" in history:
                worn = history[f"height{end}"].values + RAISED[end] * values
                columns.append((f"worn_height{end}{at} (mm)", worn.tolist()))
    return columns


def _heading(history: xarray.Dataset, name: Any, at: str = "") -> str:
    """Return the name of a column with its unit, as pressure at half-cycle 2 (MPa)."""
    unit = history[name].attrs.get("units", "1")
    return f"{name}{at}" if unit == "1" else f"{name}{at} ({unit})"


def _text(columns: Sequence[Column]) -> str:
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([heading for heading, _ in columns])
    writer.writerows(map(_cells, zip(*(values for _, values in columns), strict=True)))
    return file.getvalue()


def _cells(row: Iterable[Any]) -> list[Any]:
    """Return the cells of a row, empty where there is no number."""
    return ["" if isinstance(value, float) and math.isnan(value) else value for value in row]
