"""Tables of numbers as instruments and spreadsheets write them: any usual encoding, separator and decimal sign.

    # set punch.loads.0.force = ["0 N", "-5 kN"]
    # after = 3600 m
    Instrument 3, 2024-01-01
    x (mm); depth (µm)
    -1,95; 0,3

The heading is the first line that names a known column; lines before it are those of an instrument and are listed. A
heading has a name and a unit, in brackets, behind a slash, or in a row of units below; case does not count. Lines that
begin with # are directives, NAME = VALUE, or words for people. A row without a value is an error, unless the directive
`missing = skip` leaves such rows out.
"""

from __future__ import annotations

import codecs
import csv
import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import did_you_mean

MISSING = ("", "nan", "na", "n/a", "-", "--", "null", "none", "#n/a", "inf", "-inf")
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}
SUGGESTED, LIKE = 8, 0.7  # names of columns in a message, and how alike they are to an unknown one
MOST_HEAD = 200  # lines that an instrument may write before the heading
_HEADING = re.compile(
    r"\s*(?P<name>[^\W\d][\w \-]*?)\s*(?:[(\[]\s*(?P<unit>.*?)\s*[)\]]|\s/\s*(?P<slash>\S.*?)|/(?P<tight>[^\s()]+))?\s*"
)
_DIRECTIVE = re.compile(r"(?P<set>set\b\s*)?(?P<name>[^\s=:]+)\s*(?P<sign>[=:])\s*(?P<value>.+)", re.IGNORECASE)
_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?")
_POINTS = re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+")
_BOTH = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+,\d*")
_VALUE = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)


class TableError(ValueError):
    """Problem of a table: where, and what to do."""

    def __init__(self, where: str, message: str) -> None:
        self.where, self.message = where, message
        super().__init__(f"{where}: {message}" if where else message)


@dataclass(frozen=True)
class Head:
    """The heading of a column: its name in small letters, its unit, "" for none, and whether one is written."""

    name: str
    unit: str
    has_unit: bool


@dataclass(frozen=True)
class Table:
    """A table as it is written.

    Attributes:
        path: Of the file.
        heads: Of the columns.
        lines: Of the file in which each row stands.
        rows: Cells, numbers with a decimal point.
        directives: Line, name (in small letters, `set KEY` with the key as it is) and value of each.
        comments: Lines for people, with their numbers.
        skipped: Lines before the heading, with their numbers.
        left_out: Lines of rows without a value.
        encoding, separator, decimal: Its notation, in words.
    """

    path: Path
    heads: tuple[Head, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    directives: tuple[tuple[int, str, str], ...]
    comments: tuple[tuple[int, str], ...]
    skipped: tuple[tuple[int, str], ...]
    left_out: tuple[int, ...]
    encoding: str
    separator: str
    decimal: str

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [head.name for head in self.heads]

    def numbers(self, column: int, unit: str) -> Array:
        """Return a column in a unit (n,).

        Raises:
            TableError: a cell is no finite number, or the unit is of another kind.
        """
        head = self.heads[column]
        scale, zero = self.scale(head, unit)
        cells = [row[column] for row in self.rows]
        try:
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            return np.array([self._cell(k, cell, head, unit, scale, zero) for k, cell in enumerate(cells)])
        values = values * scale + zero
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            where = f"row {self.lines[bad[0]]}, column {head.name!r}"
            raise TableError(where, f"expected a finite number, got {cells[bad[0]]!r}")
        return values

    @staticmethod
    def scale(head: Head, unit: str) -> tuple[float, float]:
        """Return factor and offset from a column's unit to another."""
        from fenwear.common.units import convert  # cases read tables

        try:
            if not head.unit and unit:
                raise ValueError(f"expected a unit such as {unit}, got a pure number")
            if not head.unit:
                return 1.0, 0.0
            at_zero, at_one = (convert(f"{number} {head.unit}", unit) for number in (0, 1))
        except ValueError as error:
            message = str(error).replace(f"got '0 {head.unit}'", f"got {head.unit!r}")  # no row has that number
            raise TableError(f"column {head.name!r}", f"unit: {message}") from None
        return at_one - at_zero, at_zero

    def _cell(self, row: int, cell: str, head: Head, unit: str, scale: float, zero: float) -> float:
        """Return a cell that may have a unit of its own."""
        from fenwear.common.units import convert

        try:
            try:
                value = float(cell) * scale + zero
            except ValueError:
                value = convert(cell, unit)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            where = f"row {self.lines[row]}, column {head.name!r}"
            raise TableError(where, f"expected a finite number, got {cell!r}")
        return value

    def listing(self) -> str:
        """Return the content that was read, in lines."""
        columns = ", ".join(f"{head.name} ({head.unit or '1'})" for head in self.heads)
        how = f"{self.encoding}, {self.separator}, {self.decimal}"
        lines = [f"{self.path.name}: {len(self.rows)} rows of {columns}; {how}"]
        lines += [f"  line {line}: {name} = {value}" for line, name, value in self.directives]
        lines += [f"  line {line}, instrument: {text[:70]}" for line, text in self.skipped[:5]]
        lines += [f"  lines {', '.join(map(str, self.left_out))}: no value, left out"] if self.left_out else []
        lines += [f"  line {line}, comment: {text[:70]}" for line, text in self.comments[:5]]
        return "\n".join(lines)


def read_table(
    path: Path, known: Collection[str], directives: Collection[str] = (), *, keys: bool = False, unit_free: bool = False
) -> Table:
    """Return the table of a file.

    Args:
        path: Of the file.
        known: Names of columns; none for any.
        directives: Names of directives that the caller understands.
        keys: Whether headings are keys of a case, kept as they are written.
        unit_free: Whether headings without a unit are as good as others.

    Raises:
        TableError: it cannot be read; names the line, what was expected and what to do.
    """
    text, encoding = decoded(path)
    given, comments, body = _parted(text, [*directives, "missing"] if directives else ["missing"])
    if not body:
        example = ", ".join(f"{name} (unit)" for name in [*known][:2]) or "x (mm), depth (um)"
        raise TableError("", f"holds nothing; expected a heading such as '{example}' and rows of numbers")
    at, separator = _heading_at(body, known, keys=keys)
    header_line, header = body[at]
    cells = _cells(header, separator)
    heads = [Head(cell.strip(), "", False) if keys else heading(cell) for cell in cells]
    while heads and not heads[-1].name:
        heads.pop()
    rest = body[at + 1 :]
    rows = _rows(rest, separator, len(heads))
    heads, rows = _with_unit_row(heads, rows, unit_free or keys)
    _check_heads(heads, known, header_line)
    rows, decimal = _decimals(rows, separator)
    missing = next((value for _, name, value in given if name == "missing"), "error").strip().casefold()
    if missing not in ("error", "skip"):
        raise TableError("# missing", f"expected skip or error, got {missing!r}")
    rows, left_out = _complete(rows, heads, skip=missing == "skip", keys=keys)
    return Table(
        path, tuple(heads), tuple(line for line, _ in rows), tuple(tuple(row) for _, row in rows), tuple(given),
        tuple(comments), tuple(body[:at]), tuple(left_out), encoding, SEPARATORS[separator], decimal,
    )  # fmt: skip


def decoded(path: Path) -> tuple[str, str]:
    """Return the text of a file, and its encoding."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise TableError("", f"cannot be read: {error.strerror}") from None
    for mark, name in ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")):
        if raw.startswith(mark):
            return raw.decode("utf-8-sig" if name == "utf-8" else "utf-16", "replace").lstrip("\ufeff"), name.upper()
    nulls = raw[:2000:2].count(0), raw[1:2000:2].count(0)
    if max(nulls) > 0.4 * min(len(raw), 2000) / 2 and len(raw) > 1:
        return raw.decode("utf-16-le" if nulls[1] > nulls[0] else "utf-16-be", "replace"), "UTF-16"
    if b"\0" in raw:
        raise TableError("", "is no text: expected a table such as 'x (mm), depth (um)' and numbers, or an input deck")
    try:
        return raw.decode("utf-8"), "UTF-8"
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace"), "Latin-1"


def _parted(
    text: str, known: Collection[str]
) -> tuple[list[tuple[int, str, str]], list[tuple[int, str]], list[tuple[int, str]]]:
    """Return directives, comments, and the lines of the table with their numbers."""
    given: list[tuple[int, str, str]] = []
    comments: list[tuple[int, str]] = []
    body: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.strip()
        if stripped.startswith("#") and not stripped.casefold().startswith("#n/a"):
            words = stripped.lstrip("#").strip()
            directive = _directive(number, words, known)
            if directive is None:
                comments.append((number, words))
            else:
                given.append((number, *directive))
        elif stripped.strip(",;\t "):
            body.append((number, line))
    return given, comments, body


def _directive(number: int, text: str, known: Collection[str]) -> tuple[str, str] | None:
    """Return name and value of a directive; None of words for people.

    Raises:
        TableError: it is nearly one: it would be lost in silence.
    """
    first = re.split(r"[\s=:]", text, maxsplit=1)[0].casefold()
    match = _DIRECTIVE.fullmatch(text)
    where = f"line {number}"
    if match is None:
        if first in known or (first == "set" and "set" in known):
            raise TableError(where, f"expected '# {first} = VALUE', got '# {text}'. Begin a comment with another word.")
        return None
    name, value = match["name"], match["value"].strip()
    is_set = match["set"] is not None
    key = is_set or "." in name
    if not key and name.casefold() not in known:
        for close in difflib.get_close_matches(name.casefold(), known, 1, 0.8):
            raise TableError(where, f"the directive {name!r} is not known. Write '# {close} = {value}'.")
        return None
    if key and "set" not in known:
        return None
    if key and not is_set and not re.fullmatch(r"[a-z_]+(\.[a-z_0-9]+)+", name):
        return None
    if match["sign"] == ":" or (key and not is_set):
        written = f"set {name} = {value}" if key else f"{name.casefold()} = {value}"
        raise TableError(where, f"is no directive: '# {text}'. Write '# {written}'.")
    return (f"set {name}" if is_set else name.casefold()), value


def heading(cell: str) -> Head:
    """Return the heading of a cell: "Depth [µm]", "depth / µm", "Scar width (mm)"."""
    text = cell.strip().strip('"').strip()
    match = _HEADING.fullmatch(text)
    if match is None:
        return Head(text.casefold(), "", False)
    unit = next((match[group] for group in ("unit", "slash", "tight") if match[group] is not None), None)
    name = re.sub(r"[ \-]+", "_", match["name"].strip()).casefold()
    return Head(name, "" if unit in (None, "1", "-", "–", "") else str(unit), unit is not None)


def _heading_at(body: Sequence[tuple[int, str]], known: Collection[str], *, keys: bool) -> tuple[int, str]:
    """Return the place of the heading among the lines, and the separator."""
    for at, (_, line) in enumerate(body[:MOST_HEAD]):
        separator = _separator(line)
        cells = [cell for cell in _cells(line, separator) if cell.strip()]
        names = [heading(cell).name for cell in cells]
        if known and any(name in known for name in names):
            return at, separator
        if not known and cells and (keys or at + 1 < len(body)) and not any(_is_number(cell) for cell in cells):
            follow = _cells(body[min(at + 1, len(body) - 1)][1], separator)
            if keys or (len(follow) == len(cells) and any(_is_number(cell) for cell in follow)):
                return at, separator
    return 0, _separator(body[0][1])


def _separator(line: str) -> str:
    """Return the separator of the cells of a heading."""
    bare = re.sub(r"[(\[][^)\]]*[)\]]|\"[^\"]*\"", "", line)
    return next((separator for separator in "\t;," if separator in bare), " ")


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if separator == " ":
        return [cell.strip() for cell in re.findall(r"[^\s(\[]+\s*(?:\([^)]*\)|\[[^\]]*\])|\S+", line)]
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:
        cells = line.split(separator)
    return [cell.strip() for cell in cells]


def _rows(rest: Sequence[tuple[int, str]], separator: str, count: int) -> list[tuple[int, list[str]]]:
    """Return the rows of as many cells as there are columns; commas with spaces part decimal commas.

    Raises:
        TableError: a row has another number of cells.
    """
    rows = [(line, _cells(text, separator)) for line, text in rest]
    trimmed = [(line, cells[:count] if not any(cells[count:]) else cells) for line, cells in rows]
    wrong = next(((line, cells) for line, cells in trimmed if len(cells) != count), None)
    if wrong is None:
        return trimmed
    if separator == ",":
        spaced = [(line, [cell.strip() for cell in re.split(r",\s+", text.strip())]) for line, text in rest]
        if all(len(cells) == count for _, cells in spaced):
            return spaced
    hint = ""
    if separator == "," and len(wrong[1]) > count:
        hint = ". Write decimal points, or semicolons between the columns"
    raise TableError(f"row {wrong[0]}", f"expected {count} columns, got {len(wrong[1])}{hint}")


def _with_unit_row(
    heads: list[Head], rows: list[tuple[int, list[str]]], unit_free: bool
) -> tuple[list[Head], list[tuple[int, list[str]]]]:
    """Return headings with the units of a row below them, where they have none themselves."""
    if unit_free or not rows or any(head.has_unit for head in heads):
        return heads, rows
    cells = rows[0][1]
    if all(_is_number(cell) or cell.casefold() in MISSING[1:] for cell in cells) or not any(cells):
        return heads, rows
    if any(_is_number(cell) for cell in cells):
        return heads, rows
    units = [cell.strip("()[] ") for cell in cells]
    named = [Head(h.name, "" if u in ("", "1", "-") else u, True) for h, u in zip(heads, units, strict=True)]
    return named, rows[1:]


def _check_heads(heads: Sequence[Head], known: Collection[str], line: int) -> None:
    """Raise where a column is not known, or is there twice."""
    names = [head.name for head in heads]
    check_names(heads, known, f" (line {line})")
    for name in names:
        if names.count(name) > 1:
            raise TableError(f"column {name!r}", f"given twice in line {line}. Remove one of the columns.")


def check_names(heads: Sequence[Head], known: Collection[str], where: str) -> None:
    """Raise where columns are not among the known ones.

    Raises:
        TableError: names the column.
    """
    for name in (head.name for head in heads if known and head.name not in known):
        hint = did_you_mean(name, known, LIKE) or "."
        message = f"not known{where}{hint} Expected a name with its unit, such as {', '.join(list(known)[:SUGGESTED])}"
        raise TableError(f"column {name!r}", message)


def _is_number(cell: str) -> bool:
    match = _VALUE.fullmatch(cell.strip())
    return match is not None and bool(re.search(r"\d", match[1]))


def _decimals(rows: list[tuple[int, list[str]]], separator: str) -> tuple[list[tuple[int, list[str]]], str]:
    """Return rows whose numbers have decimal points, and how they were written.

    Raises:
        TableError: a comma may stand for a decimal point or for thousands, or a point for thousands.
    """
    parts = [(line, [_VALUE.fullmatch(cell) for cell in cells]) for line, cells in rows]
    numbers = [(line, match[1]) for line, matches in parts for match in matches if match is not None]
    commas = [(line, text) for line, text in numbers if "," in text]
    points = [(line, text) for line, text in numbers if "." in text]
    if not commas and separator == ";" and points and all(_POINTS.fullmatch(text) for _, text in points):
        line, text = points[0]
        message = f"{text!r} may be {text.replace('.', '')} or {text}0. Write one of these."
        raise TableError(f"row {line}", message)
    if not commas:
        return rows, "decimal points"
    decimal = any(_BOTH.fullmatch(t) or (_COMMA.fullmatch(t) and not _THOUSANDS.fullmatch(t)) for _, t in commas)
    decimal |= any(re.fullmatch(r"[+-]?0,\d+", text) for _, text in commas)
    thousands = any("." in text and not _BOTH.fullmatch(text) for _, text in numbers)
    if decimal and thousands:
        line, text = next((n, t) for n, t in numbers if "." in t and not _BOTH.fullmatch(t))
        message = f"{text!r} has a decimal point, other rows have decimal commas. Use one of them."
        raise TableError(f"row {line}", message)
    if not decimal and not thousands:
        line, text = commas[0]
        message = f"{text!r} may be {text.replace(',', '')} or {text.replace(',', '.')}. Write it without a comma."
        raise TableError(f"row {line}", message)

    def plain(text: str) -> str:
        return text.replace(".", "").replace(",", ".") if decimal else text.replace(",", "")

    changed = []
    for line, cells in rows:
        matches = [_VALUE.fullmatch(cell) for cell in cells]
        changed.append((
            line,
            [cell if match is None or "," not in match[1] else plain(match[1]) + match[2]
             for cell, match in zip(cells, matches, strict=True)],
        ))  # fmt: skip
    return changed, "decimal commas" if decimal else "commas between thousands"


def _complete(
    rows: list[tuple[int, list[str]]], heads: Sequence[Head], *, skip: bool, keys: bool
) -> tuple[list[tuple[int, list[str]]], list[int]]:
    """Return the rows with a value in every column, and the lines of the others.

    Raises:
        TableError: a value is missing, and rows without one are not to be skipped.
    """
    kept, left_out = [], []
    for line, cells in rows:
        empty = [head.name for head, cell in zip(heads, cells, strict=True) if cell.strip().casefold() in MISSING]
        if keys or not empty:
            kept.append((line, cells))
        elif skip:
            left_out.append(line)
        else:
            cell = cells[[head.name for head in heads].index(empty[0])].strip()
            expected = f"expected a finite number, got {cell!r}" if cell else "expected a number, got none"
            message = f"{expected}. Fill it, remove the row, or write '# missing = skip' above."
            raise TableError(f"row {line}, column {empty[0]!r}", message)
    return kept, left_out


def known_units(heads: Sequence[Head], columns: Mapping[str, str]) -> None:
    """Raise where a column that has a unit is written without it.

    Raises:
        TableError: names the column, and how to write it.
    """
    for head in heads:
        wanted = columns[head.name]
        if wanted and not head.unit:
            message = f"has no unit; expected one in brackets, such as '{head.name} ({wanted})'"
            raise TableError(f"column {head.name!r}", message)
        Table.scale(head, wanted)
