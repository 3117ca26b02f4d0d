"""Tables of numbers in CSV files: each heading is a known name with its unit, each cell a finite number."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError

_HEADING = re.compile(r"\s*(?P<name>[A-Za-z_]+)\s*([(\[]\s*(?P<unit>[^)\]]*?)\s*[)\]])?\s*")


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
    """Return the table of a CSV file.

    Args:
        path: Of the file, in UTF-8.
        key: Of the case, for messages.
        columns: Units of the known columns by their names; "" for pure numbers.
        least: Rows of numbers that are expected.

    Raises:
        CaseError: it cannot be read; names column and row.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [(n, row) for n, row in enumerate(csv.reader(file), 1) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "not a CSV file in UTF-8"
        raise _wrong(path, key, f"cannot be read: {reason}") from None
    if len(rows) < 1 + least:
        few = {1: "one row", 2: "two rows"}.get(least, f"{least} rows")
        raise _wrong(path, key, f"expected a row of headings and at least {few} of numbers, got {len(rows)} in all")
    try:
        names, units = headings(rows[0][1], columns)
    except ValueError as error:
        raise _wrong(path, key, str(error)) from None
    values = [_numbers(path, key, line, row, names, units, columns) for line, row in rows[1:]]
    return CsvTable(path, key, names, [line for line, _ in rows[1:]], values)


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
    names, units = [], []
    for cell in row:
        match = _HEADING.fullmatch(cell)
        name = match["name"] if match else cell.strip()
        if name not in columns:
            close = difflib.get_close_matches(name, columns, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(columns)}"
            raise ValueError(f"the column {name!r} is not known; {hint}")
        unit = (match["unit"] if match else None) or ""
        wanted = columns[name]
        if wanted and not unit:
            raise ValueError(f"the column {name} has no unit; expected such as '{name} ({wanted})'")
        try:
            convert(f"1 {unit}" if unit else 1.0, wanted)
        except ValueError as error:
            raise ValueError(f"the column {name}: {error}") from None
        names.append(name)
        units.append(unit)
    return names, units


def _numbers(
    path: Path, key: str, line: int, row: Sequence[str], names: list[str], units: list[str], columns: Mapping[str, str]
) -> list[float]:
    if len(row) != len(names):
        raise _wrong(path, key, f"row {line}: expected {len(names)} values, got {len(row)}")
    found = []
    for cell, name, unit in zip(row, names, units, strict=True):
        try:
            found.append(convert(f"{cell.strip()} {unit}".strip(), columns[name]))
        except ValueError:
            raise _wrong(path, key, f"row {line}: {name}: expected a finite number, got {cell.strip()!r}") from None
    return found
