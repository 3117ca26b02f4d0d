"""Measured data: CSV files with a unit in every column's heading, and what they were measured under.

    # set punch.loads.0.force = ["0 N", "-5 kN"]
    # after = 3600 m
    # body = punch
    x (mm), depth (um), sigma (um)
    -1.95, 0.3, 0.5
    ...

Lines that start with # may set keys of the case for this file (set KEY = VALUE), the amount of sliding
after which all rows were measured (after), the worn body (body), the standard deviation of the
measurement (sigma), how it scatters (scatter), and the density that turns a lost mass into a volume (density).
Columns: x with depth or height (the profile of a worn surface; height is minus the depth), or after with volume, mass,
depth, scar_width, friction or temperature; sigma belongs to the measured column. Several profiles follow each other
with a column after. Measurements scatter in one of three ways:

    independent      each row has an error of its own, with the standard deviation sigma;
    adds up          a specimen is weighed and runs again: the increments since the row before are independent. sigma is
                     that of an increment; without it their variance grows with the sliding between the rows;
    alike over l     the roughness of a profile: neighbours have the correlation exp(-|x - x'| / l).

Residuals are whitened by it (generalised least squares), so that standard errors and Student's intervals hold for any
number of rows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fenwear.case import Case, Rotation, changed_case
from fenwear.case.program import cycle_of
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError, read_table
from fenwear.common.units import convert
from fenwear.results.registry import names_known
from fenwear.studies.quantities import GROWING, Quantity, of_case, parse_amount, registered_name, unit_of

TIED = 0.1  # of the usual spacing: how far apart places count that are the same
NONE: Array = np.zeros(0)  # of what a file does not give
FEW, SMOOTH = 20, 1.5  # rows that say little of their scatter; von Neumann's ratio below which they are correlated


@dataclass(frozen=True)
class Noise:
    """Dependence of the errors of a series on each other.

    Attributes:
        kind: Of the module's docstring; "" where the file does not say, which counts as independent.
        length: Over which errors are alike, mm.
    """

    kind: Literal["", "independent", "adds up", "alike"] = ""
    length: float = 0.0

    @classmethod
    def parse(cls, text: str) -> Noise:
        """Return the noise that a file asks for.

        Raises:
            ValueError: none of the three.
        """
        if text in ("independent", "adds up"):
            return cls(text)  # type: ignore[arg-type]
        if not text.startswith("alike over "):
            raise ValueError(f"expected independent, adds up or alike over LENGTH (such as 0.2 mm), got {text!r}")
        length = convert(text.removeprefix("alike over "), "mm")
        if not length > 0:
            raise ValueError(f"expected a length above zero, got {text!r}")
        return cls("alike", length)

    def check(self, quantity: str, *, profile: bool) -> None:
        """Check that a quantity, along a profile or not, can scatter so.

        Raises:
            ValueError: it cannot.
        """
        if self.kind == "adds up" and (profile or quantity not in GROWING):
            raise ValueError(f"{quantity} does not add up; expected {', '.join(GROWING)} after more and more sliding")
        if self.kind == "alike" and not profile:
            raise ValueError("expected a profile, with a column x")

    def whitened(self, values: Array, sigma: Array, x: Array, after: Array) -> Array:
        """Return residuals or columns of their Jacobian (n, ...) as those of independent errors of one size.

        Args:
            values: In the unit of the measurement (n, ...).
            sigma: (n,); `NONE` where none is known.
            x: Places of a profile (n,), mm; else `NONE`.
            after: Sliding before each row (n,).
        """
        over = sigma if len(sigma) else np.ones(len(values))
        wide = (slice(None),) + (None,) * (values.ndim - 1)
        if self.kind == "adds up":
            steps = in_order(np.concatenate([[0.0], after]))[1]
            over = sigma if len(sigma) else np.sqrt(steps / steps.mean())
            return np.diff(values, axis=0, prepend=0.0) / over[wide]
        scaled = values / over[wide]
        if self.kind != "alike":
            return np.asarray(scaled)
        order, gaps = in_order(x)
        alike, rest, ordered = np.exp(-gaps / self.length), np.sqrt(-np.expm1(-2 * gaps / self.length)), scaled[order]
        return np.concatenate([ordered[:1], (ordered[1:] - alike[wide] * ordered[:-1]) / rest[wide]])


def in_order(x: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the order of places (n,), and the gaps between them (n - 1,), mm."""
    order: NDArray[np.int64] = np.argsort(x, kind="stable")
    gaps = np.diff(x[order])
    usual = float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else 1.0
    return order, np.maximum(gaps, TIED * usual)


def neighbours_ratio(residual: Sequence[float] | Array) -> float:
    """Return von Neumann's ratio: 2 for independent residuals, near 0 for those like their neighbours."""
    residuals = np.asarray(residual)
    return float((np.diff(residuals) ** 2).sum() / max(float(residuals @ residuals), 1e-300))


# Words for what is measured, and the registry's names of it; a column may have any name of the registry, too.
MEASURED = {
    "depth": "largest_depth", "height": "wear", "volume": "worn_volume", "mass": "worn_volume",
    "friction": "friction_coefficient", "temperature": "largest_temperature",
}  # fmt: skip
PROFILES = ("depth", "height", "wear")  # what has places
OTHERS = ("x", "after", "sigma")  # columns that are not measured
DIRECTIVES = ("set", "after", "body", "sigma", "density", "scatter")
LEAST_ROWS = 3
_COUNTED = re.compile(
    r"(?P<number>[-+]?\d[\d.]*(?:[eE][-+]?\d+)?)\s*(?:(?P<half>half[ _-]?cycles?)|rev(?:olution)?s?|turns?)",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Series:
    """Measurements of one quantity; of a profile, at one time.

    Attributes:
        quantity: Its name, as of a quantity of interest.
        body: punch or strip.
        x: Places of a profile (k,), mm; `NONE` for what is one number at a time.
        after: Amount of sliding of each measurement (k,): cycles, mm or s.
        counted: Its meaning: cycles, distance or time.
        values: (k,), in the internal unit.
        sigma: Standard deviations (k,); `NONE` where the file gives none.
        rows: Lines of the file (k,).
        noise: Dependence of the errors on each other.
    """

    quantity: str
    body: str
    x: Array
    after: Array
    counted: str
    values: Array
    sigma: Array
    rows: tuple[int, ...]
    noise: Noise = field(default_factory=Noise)

    @property
    def is_profile(self) -> bool:
        """Whether it has places."""
        return len(self.x) > 0

    @property
    def has_sigma(self) -> bool:
        """Whether the file gives standard deviations."""
        return len(self.sigma) > 0

    @property
    def places(self) -> Array:
        """Its horizontal axis: the places of a profile, else the amounts of sliding (k,)."""
        return self.x if self.is_profile else self.after

    @property
    def scale(self) -> Array:
        """Standard deviations (k,); ones where the file gives none."""
        return self.sigma if self.has_sigma else np.ones(len(self.values))

    def whitened(self, values: Array) -> Array:
        """Return residuals, or columns of their Jacobian (k, ...), as those of independent errors."""
        return self.noise.whitened(values, self.sigma, self.x, self.after)


@dataclass(frozen=True)
class DataSet:
    """Contents of a file.

    Attributes:
        name: Of the file.
        settings: Overrides `key.path=value` of the case it was measured under.
        series: One of each profile and of each column.
        listing: Description of the data, in lines.
    """

    name: str
    settings: tuple[str, ...]
    series: tuple[Series, ...]
    listing: str = ""


def read_data(path: str | Path, case: Case) -> DataSet:
    """Read a CSV file of measurements.

    Args:
        path: Of the file.
        case: Its condition.

    Raises:
        CaseError: the file cannot be read, or what it holds is wrong; names column and row.
    """
    return _Reader(Path(path), case).read()


def measured_folder() -> Path:
    """Return the folder of the measurements that come with fenwear: the scars of a block on a ring, and their case."""
    return Path(__file__).parent / "measured"


def _name(column: str) -> str:
    """Return the registry's name of what a column has, one number at a time."""
    return registered_name(MEASURED.get(column, column), at_a_place=False)


def _unit(column: str) -> str:
    """Return the internal unit of a column."""
    return "N*s^2/mm" if column == "mass" else unit_of(_name(column))


class _Reader:
    def __init__(self, path: Path, case: Case) -> None:
        self.path, self.case = path, case
        known = ["x", "after", *MEASURED, "sigma", *names_known()]
        try:
            self.table = read_table(path, known, DIRECTIVES)
            self._check_heads()
        except TableError as error:
            raise self._fail(error.where, error.message) from None
        self.settings = [
            f"{name.split()[1]}={value}" for _, name, value in self.table.directives if name.startswith("set ")
        ]
        self.directives = {name: value for _, name, value in self.table.directives if not name.startswith("set ")}

    def _fail(self, where: str, message: str) -> CaseError:
        return CaseError(InputError(f"{self.path}{where and ': ' + where}", message))

    def _check(self, right: Mask, column: str, message: str) -> None:
        """Raise what is wrong in the first row in which a column is not right (n,)."""
        for k in np.flatnonzero(~right)[:1]:
            raise self._fail(f"row {self.table.lines[k]}, column {column!r}", message)

    def _directive(self, name: str, unit: str) -> float:
        """Return the number above zero that a line `# name = ...` gives, in a unit."""
        given = self.directives[name]
        try:
            value = convert(given, unit)
        except ValueError as error:
            raise self._fail(f"# {name}", str(error)) from None
        if value <= 0:
            raise self._fail(f"# {name}", f"expected more than zero, got {given!r}")
        return value

    def read(self) -> DataSet:
        names = self.table.names
        body = self._body()
        after, counted = self._after()
        self._without_start(after)
        lines, after = self.table.lines, after[after != 0] if "after" in names else after
        # Without a standard deviation the scatter of the rows has to tell it.
        least = 1 if "sigma" in {*names, *self.directives} else LEAST_ROWS
        if len(lines) < least:
            how = "" if least == 1 else ", or `# sigma`, their standard deviation"
            raise self._fail("", f"expected at least {least} {'row' if least == 1 else 'rows'} of numbers{how}, "
                             f"got {len(lines)}")  # fmt: skip
        measured = [name for name in names if name not in OTHERS]
        case = changed_case(self.case, *self.settings) if self.settings else self.case
        series: list[Series] = []
        for name in measured:
            values, sigma = self._measured(name, only=len(measured) == 1)
            quantity = "wear" if "x" in names else _name(name)
            wanted = Quantity(f"{self.path}: column {name}", quantity, "snapshot", unit_of(quantity), body)
            of_case(wanted, case, str(self.path))
            of_file = Series(quantity, body, NONE, after, counted, values, sigma, lines, self._noise(quantity))
            if "x" in names:
                series += self._profiles(of_file, self._column("x", "mm"))
            else:
                self._check_rising(after, strictly=True)
                series.append(of_file)
        return DataSet(self.path.name, tuple(self.settings), tuple(series), self.table.listing())

    def _column(self, name: str, unit: str, *, as_written: bool = False) -> Array:
        """Return a column (n,) in a unit, or as its numbers are written."""
        table = self.table
        if as_written:
            table = replace(table, heads=tuple(replace(head, unit="") for head in table.heads))
        try:
            return table.numbers(table.names.index(name), unit)
        except TableError as error:
            raise self._fail(error.where, error.message) from None

    def _without_start(self, after: Array) -> None:
        """Leave out rows at the start, where nothing has worn.

        Raises:
            CaseError: such a row has another value than zero.
        """
        if "after" not in self.table.names or not (after == 0).any():
            return
        for name in (name for name in self.table.names if _name(name) in (*GROWING, "wear")):
            right = (after != 0) | (self._column(name, _unit(name)) == 0)
            self._check(right, "after", "expected more than zero, or a zero beside it: nothing has worn before")
        kept = np.flatnonzero(after != 0)
        self.table = replace(
            self.table,
            lines=tuple(self.table.lines[k] for k in kept),
            rows=tuple(self.table.rows[k] for k in kept),
            left_out=(*self.table.left_out, *(self.table.lines[k] for k in np.flatnonzero(after == 0))),
        )

    def _body(self) -> str:
        default = "strip" if self.case.wear.punch is None else "punch"
        names = self.case.names
        body = names.role_of(self.directives.get("body", default))
        if body not in ("punch", "strip"):
            raise self._fail("# body", names.with_names(f"expected punch or strip, got {body!r}"))
        return body

    def _check_heads(self) -> None:
        """Raise where a column has no unit, or columns do not go together."""
        for head in self.table.heads:
            if not head.has_unit:
                example = {"x": "mm", "after": "m", "friction": "1", "temperature": "K"}.get(head.name, "um")
                message = f"has no unit; expected one in brackets, such as '{head.name} ({example})'"
                raise TableError(f"column {head.name!r}", message)
        names = self.table.names
        measured = [name for name in names if name not in OTHERS]
        if not measured:
            raise TableError("", f"no measured column; expected one of {', '.join(MEASURED)}")
        if "x" in names and (len(measured) > 1 or measured[0] not in PROFILES):
            raise TableError("column 'x'", "expected with one column depth or height, and no other measurement")

    def _after(self) -> tuple[Array, str]:
        given = "after" in self.directives
        if "after" not in self.table.names:
            if not given:
                raise self._fail("", "does not say after how much sliding it was measured; expected a column "
                                 "'after (m)' or a line '# after = 3600 m'")  # fmt: skip
            amount, counted = self._amount(self.directives["after"], "# after")
            return np.full(len(self.table.lines), amount), counted
        if given:
            raise self._fail("# after", "given together with a column after; expected one of them")
        unit = self.table.heads[self.table.names.index("after")].unit
        per_unit, counted = self._amount(f"1 {unit}".strip(), "column 'after'")
        values = per_unit * self._column("after", "", as_written=True)
        self._check(values >= 0, "after", "expected more than zero: nothing has worn before")
        self._check_rising(values, strictly=False)
        return values, counted

    def _amount(self, text: str, where: str) -> tuple[float, str]:
        """Return an amount of sliding, with what it is; half-cycles and revolutions are numbers of cycles."""
        match = _COUNTED.fullmatch(text.strip())
        if not match:
            return parse_amount(text, f"{self.path}: {where}")
        _, slid, halves = cycle_of(self.case)
        if match["half"]:
            return parse_amount(f"{float(match['number']) / halves!r}", f"{self.path}: {where}")
        if not isinstance(self.case.motion, Rotation):
            message = "counts revolutions, but the strip does not turn. Write cycles, a distance or a time."
            raise self._fail(where, message)
        return parse_amount(f"{float(match['number']) * 2 * np.pi / slid!r}", f"{self.path}: {where}")

    def _check_rising(self, after: Array, *, strictly: bool) -> None:
        steps = np.diff(after, prepend=-np.inf)
        self._check(steps > 0 if strictly else steps >= 0, "after", "expected amounts that rise from row to row")

    def _measured(self, name: str, *, only: bool) -> tuple[Array, Array]:
        """Return values and standard deviations."""
        unit, factor = _unit(name), -1.0 if name == "height" else 1.0
        if name == "mass":
            if "density" not in self.directives:
                raise self._fail(
                    "column 'mass'", "needs the density of the lost material: a line '# density = 7800 kg/m^3'"
                )
            factor = 1 / self._directive("density", "N*s^2/mm^4")
        values = factor * self._column(name, unit)
        if name == "friction":
            self._check(values >= 0, "friction", "expected zero or more")
        return values, np.abs(factor) * self._sigma(unit, only=only)

    def _sigma(self, unit: str, *, only: bool) -> Array:
        if "sigma" not in {*self.table.names, *self.directives}:
            return NONE
        if not only:
            raise self._fail("sigma", "belongs to one measured column; expected a file for each of several")
        if "sigma" in self.table.names:
            sigma = self._column("sigma", unit)
            self._check(sigma > 0, "sigma", "expected more than zero")
            return sigma
        return np.full(len(self.table.lines), self._directive("sigma", unit))

    def _noise(self, quantity: str) -> Noise:
        """Return how a measured quantity scatters."""
        try:
            noise = Noise.parse(self.directives["scatter"]) if "scatter" in self.directives else Noise()
            noise.check(quantity, profile="x" in self.table.names)
        except ValueError as error:
            raise self._fail("# scatter", str(error)) from None
        return noise

    def _profiles(self, measured: Series, x: Array) -> list[Series]:
        """Return one series for each time."""
        profiles = []
        for amount in np.unique(measured.after):
            at_time = np.flatnonzero(measured.after == amount)
            if len(at_time) < LEAST_ROWS:
                message = f"expected at least {LEAST_ROWS} rows of a profile, got {len(at_time)}"
                raise self._fail(f"row {measured.rows[int(at_time[0])]}", message)
            sigma = measured.sigma[at_time] if measured.has_sigma else NONE
            rows = tuple(measured.rows[int(k)] for k in at_time)
            profiles.append(
                replace(
                    measured,
                    x=x[at_time],
                    after=measured.after[at_time],
                    values=measured.values[at_time],
                    sigma=sigma,
                    rows=rows,
                )
            )
        return profiles
