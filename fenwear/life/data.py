"""Measured data: CSV files with a unit in every column's heading, and what they were measured under.

    # set punch.loads.0.force = ["0 N", "-5 kN"]
    # after = 3600 m
    # body = punch
    x (mm), depth (um), sigma (um)
    -1.95, 0.3, 0.5
    ...

Lines that start with # may set keys of the case for this file (set KEY = VALUE), the amount of sliding
after which all rows were measured (after), the worn body (body), the standard deviation of the
measurement (sigma), how it scatters (scatter, see `fenwear.life.noise`), and the density that turns a lost mass into a
volume (density). Columns: x with depth or height (the profile of a worn surface; height is minus the depth), or after
with volume, mass, depth, scar_width, friction or temperature; sigma belongs to the measured column. Several profiles
follow each other with a column after.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Case, changed_case
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError
from fenwear.life.noise import Noise
from fenwear.life.quantities import UNITS, Quantity, of_case, parse_amount

MEASURED = {
    "depth": "mm", "height": "mm", "volume": "mm^3", "mass": "N*s^2/mm", "scar_width": "mm", "friction": "",
    "temperature": "K",
}  # fmt: skip
PLACES = {"x": "mm"}
DIRECTIVES = ("set", "after", "body", "sigma", "density", "scatter")
LEAST_ROWS = 3
_HEADING = re.compile(r"\s*(?P<name>[A-Za-z_]+)\s*([(\[]\s*(?P<unit>[^)\]]*?)\s*[)\]])?\s*")


@dataclass(frozen=True)
class Series:
    """Measurements of one quantity; of a profile, at one time.

    Attributes:
        quantity: Its name, as of a quantity of interest.
        body: punch or strip.
        x: Places of a profile (k,), mm; None for what is one number at a time.
        after: Amount of sliding of each measurement (k,): cycles, mm or s.
        counted: What that is: cycles, distance or time.
        values: (k,), in the internal unit.
        sigma: Standard deviations (k,); None where the file gives none.
        rows: Lines of the file (k,).
        noise: How the errors depend on each other.
    """

    quantity: str
    body: str
    x: Array | None
    after: Array
    counted: str
    values: Array
    sigma: Array | None
    rows: tuple[int, ...]
    noise: Noise = field(default_factory=Noise)

    def whitened(self, values: Array) -> Array:
        """Return residuals, or columns of their Jacobian (k, ...), as those of independent errors."""
        return self.noise.whitened(values, self.sigma, self.x, self.after)


@dataclass(frozen=True)
class DataSet:
    """What one file holds.

    Attributes:
        name: Of the file.
        settings: Overrides `key.path=value` of the case it was measured under.
        series: One of each profile and of each column.
    """

    name: str
    settings: tuple[str, ...]
    series: tuple[Series, ...]


def read_data(path: str | Path, case: Case) -> DataSet:
    """Read a CSV file of measurements.

    Args:
        path: Of the file.
        case: What it belongs to.

    Raises:
        CaseError: the file cannot be read, or what it holds is wrong; names column and row.
    """
    return _Reader(Path(path), case).read()


def measured_folder() -> Path:
    """Return the folder of the measurements that come with fenwear: the scars of a block on a ring, and their case."""
    return Path(__file__).parent / "measured"


class _Reader:
    def __init__(self, path: Path, case: Case) -> None:
        self.path, self.case = path, case
        self.settings: list[str] = []
        self.directives: dict[str, str] = {}

    def _fail(self, where: str, message: str) -> CaseError:
        return CaseError(InputError(f"{self.path}{where and ': ' + where}", message))

    def read(self) -> DataSet:
        rows = self._rows()
        names, units = self._headings(rows[0][1])
        body = self._body()
        columns = self._numbers(names, rows[1:])
        lines = tuple(line for line, _ in rows[1:])
        # Without a standard deviation the scatter of the rows has to tell it.
        least = 1 if "sigma" in {*names, *self.directives} else LEAST_ROWS
        if len(lines) < least:
            how = "" if least == 1 else ", or sigma, how sure they are"
            raise self._fail("", f"expected at least {least} {'row' if least == 1 else 'rows'} of numbers{how}, "
                             f"got {len(lines)}")  # fmt: skip
        measured = [name for name in names if name in MEASURED]
        case = changed_case(self.case, *self.settings) if self.settings else self.case
        after, counted = self._after(names, units, columns, lines)
        series: list[Series] = []
        for name in measured:
            values, sigma, quantity = self._measured(name, units, columns, lines, only=len(measured) == 1)
            wanted = Quantity(f"{self.path}: column {name}", quantity, "snapshot", UNITS[quantity], body)
            of_case(wanted, case, str(self.path))
            x = self._converted("x", units["x"], "mm", columns["x"]) if "x" in names else None
            whole = Series(quantity, body, None, after, counted, values, sigma, lines, self._noise(quantity, x))
            if x is not None:
                series += self._profiles(whole, x)
            else:
                self._check_rising(after, lines, strictly=True)
                series.append(whole)
        return DataSet(self.path.name, tuple(self.settings), tuple(series))

    def _rows(self) -> list[tuple[int, list[str]]]:
        """Return heading and rows with their line numbers; take the directives."""
        try:
            text = self.path.read_bytes().decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise self._fail("", f"not a UTF-8 text (byte {error.start})") from None
        except OSError as error:
            raise self._fail("", f"cannot be read: {error.strerror}") from None
        rows: list[tuple[int, list[str]]] = []
        for number, line in enumerate(text.splitlines(), 1):
            if line.lstrip().startswith("#"):
                self._directive(line.lstrip()[1:].strip())
            elif line.strip():
                rows.append((number, next(csv.reader([line]))))
        if not rows:
            raise self._fail("", "holds nothing; expected a heading such as 'x (mm), depth (um)' and rows of numbers")
        return rows

    def _directive(self, text: str) -> None:
        match = re.fullmatch(r"(?P<name>set\s+\S+|\w+)\s*=\s*(?P<value>.+)", text)
        if match is None:
            return  # words for people
        name, value = match["name"], match["value"].strip()
        if name.startswith("set"):
            self.settings.append(f"{name.split()[1]}={value}")
        elif name in DIRECTIVES:
            self.directives[name] = value

    def _body(self) -> str:
        default = "strip" if self.case.wear.punch is None else "punch"
        names = self.case.names
        body = names.role_of(self.directives.get("body", default))
        if body not in ("punch", "strip"):
            raise self._fail("# body", names.told(f"expected punch or strip, got {body!r}"))
        return body

    def _headings(self, cells: Sequence[str]) -> tuple[list[str], dict[str, str]]:
        """Return the columns' names and units."""
        names: list[str] = []
        units: dict[str, str] = {}
        known = [*PLACES, "after", *MEASURED, "sigma"]
        for cell in cells:
            match = _HEADING.fullmatch(cell)
            if match is None or match["name"] not in known:
                message = f"not known; expected some of {', '.join(known)}, each with its unit, such as 'depth (um)'"
                if ";" in cell:
                    message = "has a semicolon; expected commas between columns, and points in numbers"
                raise self._fail(f"column {cell.strip()!r}", message)
            name = match["name"]
            if name in names:
                raise self._fail(f"column {name!r}", "given twice")
            if match["unit"] is None:
                example = {"x": "mm", "after": "m", "friction": "1", "temperature": "K"}.get(name, "um")
                raise self._fail(
                    f"column {name!r}", f"has no unit; expected one in brackets, such as '{name} ({example})'"
                )
            names.append(name)
            units[name] = "" if match["unit"] in ("1", "-") else match["unit"]
        measured = [name for name in names if name in MEASURED]
        if not measured:
            raise self._fail("", f"no measured column; expected one of {', '.join(MEASURED)}")
        if "x" in names and (len(measured) > 1 or measured[0] not in ("depth", "height")):
            raise self._fail("column 'x'", "expected with one column depth or height, and no other measurement")
        return names, units

    def _numbers(self, names: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> dict[str, Array]:
        """Return the columns' numbers, as they stand."""
        table = np.empty((len(rows), len(names)))
        for r, (line, cells) in enumerate(rows):
            if len(cells) != len(names):
                raise self._fail(f"row {line}", f"expected {len(names)} columns, got {len(cells)}")
            for c, (name, cell) in enumerate(zip(names, cells, strict=True)):
                try:
                    table[r, c] = float(cell)
                except ValueError:
                    raise self._fail(
                        f"row {line}, column {name!r}", f"expected a number, got {cell.strip()!r}"
                    ) from None
                if not math.isfinite(table[r, c]):
                    raise self._fail(f"row {line}, column {name!r}", f"expected a finite number, got {cell.strip()!r}")
        return {name: table[:, c] for c, name in enumerate(names)}

    def _converted(self, name: str, unit: str, to: str, values: Array) -> Array:
        try:
            if not unit and to:
                raise ValueError(f"expected a unit such as {to}, got a pure number")
            zero, one = (convert(f"{number} {unit}".strip(), to) for number in (0, 1))
        except ValueError as error:
            message = str(error).replace(f"got '0 {unit}'", f"got {unit!r}")  # no row has that number
            raise self._fail(f"column {name!r}", f"unit: {message}") from None
        return values * (one - zero) + zero

    def _after(
        self, names: Sequence[str], units: dict[str, str], columns: dict[str, Array], lines: Sequence[int]
    ) -> tuple[Array, str]:
        given = self.directives.get("after")
        if "after" not in names:
            if given is None:
                raise self._fail("", "does not say after how much sliding it was measured; expected a column "
                                 "'after (m)' or a line '# after = 3600 m'")  # fmt: skip
            amount, counted = parse_amount(given, f"{self.path}: # after")
            return np.full(len(lines), amount), counted
        if given is not None:
            raise self._fail("# after", "given together with a column after; expected one of them")
        unit = re.sub(r"^cycles?$", "", units["after"])
        one, counted = parse_amount(f"1 {unit}".strip(), f"{self.path}: column 'after'")
        values = columns["after"] * one
        if (values <= 0).any():
            row = lines[int(np.flatnonzero(values <= 0)[0])]
            raise self._fail(f"row {row}, column 'after'", "expected more than zero: nothing has worn before")
        self._check_rising(values, lines, strictly=False)
        return values, counted

    def _check_rising(self, after: Array, lines: Sequence[int], *, strictly: bool) -> None:
        steps = np.diff(after)
        wrong = np.flatnonzero(steps <= 0 if strictly else steps < 0)
        if len(wrong):
            raise self._fail(
                f"row {lines[int(wrong[0]) + 1]}, column 'after'", "expected amounts that rise from row to row"
            )

    def _measured(
        self, name: str, units: dict[str, str], columns: dict[str, Array], lines: Sequence[int], *, only: bool
    ) -> tuple[Array, Array | None, str]:
        """Return values, standard deviations and the name of the quantity."""
        unit, quantity, factor = MEASURED[name], name, 1.0
        if name == "height":
            quantity, factor = "depth", -1.0
        if name == "mass":
            text = self.directives.get("density")
            if text is None:
                raise self._fail(
                    "column 'mass'", "needs the density of what was lost: a line '# density = 7800 kg/m^3'"
                )
            try:
                factor = 1 / convert(text, "N*s^2/mm^4")
            except (ValueError, ZeroDivisionError) as error:
                raise self._fail("# density", str(error)) from None
            quantity = "volume"
        values = factor * self._converted(name, units[name], unit, columns[name])
        if name == "friction" and (values < 0).any():
            row = lines[int(np.flatnonzero(values < 0)[0])]
            raise self._fail(f"row {row}, column 'friction'", "expected zero or more")
        sigma = self._sigma(units, columns, lines, unit, only=only)
        return values, None if sigma is None else np.abs(factor) * sigma, quantity

    def _sigma(
        self, units: dict[str, str], columns: dict[str, Array], lines: Sequence[int], unit: str, *, only: bool
    ) -> Array | None:
        given = self.directives.get("sigma")
        if ("sigma" in columns or given is not None) and not only:
            raise self._fail("sigma", "belongs to one measured column; expected a file for each of several")
        if "sigma" in columns:
            sigma = self._converted("sigma", units["sigma"], unit, columns["sigma"])
            if (sigma <= 0).any():
                row = lines[int(np.flatnonzero(sigma <= 0)[0])]
                raise self._fail(f"row {row}, column 'sigma'", "expected more than zero")
            return sigma
        if given is None:
            return None
        try:
            value = convert(given, unit)
        except ValueError as error:
            raise self._fail("# sigma", str(error)) from None
        if value <= 0:
            raise self._fail("# sigma", f"expected more than zero, got {given!r}")
        return np.full(len(lines), value)

    def _noise(self, quantity: str, x: Array | None) -> Noise:
        """Return how a measured quantity scatters."""
        try:
            noise = Noise.parse(self.directives["scatter"]) if "scatter" in self.directives else Noise()
            noise.check(quantity, x)
        except ValueError as error:
            raise self._fail("# scatter", str(error)) from None
        return noise

    def _profiles(self, whole: Series, x: Array) -> list[Series]:
        """Return one series for each time."""
        found = []
        for amount in np.unique(whole.after):
            own = np.flatnonzero(whole.after == amount)
            if len(own) < LEAST_ROWS:
                raise self._fail(f"row {whole.rows[int(own[0])]}", f"expected at least {LEAST_ROWS} rows of a profile, "
                                 f"got {len(own)}")  # fmt: skip
            sigma = None if whole.sigma is None else whole.sigma[own]
            rows = tuple(whole.rows[int(k)] for k in own)
            found.append(
                replace(whole, x=x[own], after=whole.after[own], values=whole.values[own], sigma=sigma, rows=rows)
            )
        return found
