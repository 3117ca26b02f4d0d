"""Tables of a case's files: each heading is a known name with its unit, each cell a finite number; profiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError, check_names, heading, known_units, read_table

AXES = dict.fromkeys(("x", "r", "s", "y", "z"), "mm")
DEPTHS = {"depth": "mm", "height": "mm"}
PLACES = (("x",), ("r",), ("s",), ("x", "y"), ("x", "y", "z"))


@dataclass(frozen=True)
class CsvTable:
    """The numbers of a file.

    Attributes:
        path: Of the file.
        key: Of the case, which messages name.
        names: Of the columns, in their order.
        lines: Of the file in which each row stands.
        rows: In the units of the known columns.
    """

    path: Path
    key: str
    names: list[str]
    lines: list[int]
    rows: list[list[float]]

    def wrong(self, message: str) -> CaseError:
        """Return the error that says what is wrong with it."""
        return _wrong(self.path, self.key, message)


def read_csv(path: Path, key: str, columns: Mapping[str, str], least: int) -> CsvTable:
    """Return the table of a file.

    Args:
        path: Of the file.
        key: Of the case, for messages.
        columns: Units of the known columns by their names; "" for pure numbers.
        least: Rows of numbers that are expected.

    Raises:
        CaseError: it cannot be read; names column and row.
    """
    try:
        table = read_table(path, columns)
        known_units(table.heads, columns)
        values = [table.numbers(k, columns[head.name]) for k, head in enumerate(table.heads)]
    except TableError as error:
        raise _wrong(path, key, str(error)) from None
    if len(table.rows) < least:
        few = {1: "one row", 2: "two rows"}.get(least, f"{least} rows")
        message = f"expected a row of headings and at least {few} of numbers, got {len(table.rows)}"
        raise _wrong(path, key, message)
    rows = [list(row) for row in zip(*(column.tolist() for column in values), strict=True)]
    return CsvTable(path, key, table.names, list(table.lines), rows)


def _wrong(path: Path, key: str, message: str) -> CaseError:
    return CaseError(InputError(key, f"{path}: {message}"))


def headings(row: Sequence[str], columns: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Return the names of the columns under these headings, and their units.

    Args:
        row: A heading each, such as "load (N)".
        columns: Units of the known columns by their names; "" for pure numbers.

    Raises:
        ValueError: a column is not known, or its unit is missing or of another kind; says which.
    """
    heads = [heading(cell) for cell in row]
    check_names(heads, columns, "")
    known_units(heads, columns)
    return [head.name for head in heads], [head.unit for head in heads]


def read_profile(path: Path, key: str, measured: Mapping[str, str] = DEPTHS) -> dict[str, Any]:
    """Return the table of a profile in a CSV file: the points of its rows, mm, and along what they go.

    Args:
        path: Of the file; each heading has its unit, as in "depth (um)"; height is minus the depth.
        key: Of the case, for messages.
        measured: Units of the columns that may be measured, of which the file has one.

    Raises:
        CaseError: it cannot be read; names column and row.
    """
    table = read_csv(path, key, {**AXES, **measured}, least=2)
    names = table.names
    places = [name for name in names if name not in measured]
    if tuple(sorted(places)) not in PLACES or len(places) + 1 != len(names):
        columns = " or ".join(measured)
        raise table.wrong(f"expected the columns x and {columns}, r of rings, s along a curve, or x, y, (z) of solids")
    order = [names.index(name) for name in sorted(places)]
    (at,) = (k for k, name in enumerate(names) if name not in places)
    sign = -1.0 if names[at] == "height" else 1.0
    along = "arc" if "s" in places else "x"
    points = [[*(row[k] for k in order), sign * row[at] + 0.0] for row in table.rows]
    return {"points": points, "along": along}


def profile_text(kind: str, profile: Mapping[str, Any]) -> str:
    """Return a CSV file that reads back as the table of a profile of a kind of model; depths in micrometres."""
    points, first = profile["points"], "r" if kind == "axisymmetric" else "x"
    axes = ("s",) if profile["along"] == "arc" else (first, "y", "z")[: len(points[0]) - 1]
    lines = [",".join([*(f"{axis} (mm)" for axis in axes), "depth (um)"])]
    lines += [",".join([*(f"{place:.9g}" for place in row[:-1]), f"{1e3 * row[-1]:.9g}"]) for row in points]
    return "\n".join(lines) + "\n"
