"""Several runs in one figure and one table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.case.names import BY_ROLE, Names
from fenwear.errors import CaseError, InputError
from fenwear.report.compare_figure import has_stick, runs_figure
from fenwear.report.figures import of_half_cycles
from fenwear.report.key_numbers import flat, label_of, number_text, read_case, read_summary, unit_of
from fenwear.report.style import name_bodies, save
from fenwear.report.surface import model_of
from fenwear.results.cycles import by_cycles, resolves
from fenwear.results.degrees import in_kelvin
from fenwear.results.disk import writing
from fenwear.results.reading import load_history
from fenwear.results.sheet import BODIES, LINES, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".pdf", ".svg")


@dataclass(frozen=True)
class Comparison:
    """Runs side by side: each row of the tables has a value for every run, None where it has none.

    Attributes:
        names: Of the runs, each different.
        histories: Of the runs.
        numbers: The numbers and the words of the summaries.
        cases: Those keys of the cases that differ.
        versions: Those versions of the stack that differ.
        bodies: What the first run calls its bodies.
    """

    names: list[str]
    histories: list[xarray.Dataset]
    numbers: dict[str, list[Any]]
    cases: dict[str, list[Any]]
    versions: dict[str, list[Any]]
    bodies: Names = BY_ROLE

    def as_json(self) -> dict[str, Any]:
        """Return the tables; what is no finite number is null."""
        numbers = {k: [None if _not_finite(v) else v for v in row] for k, row in self.numbers.items()}
        return {"runs": self.names, "numbers": numbers, "cases": self.cases, "versions": self.versions}

    def text(self) -> str:
        """Return the tables for people, a column per run: names and units of results, keys of cases."""
        parts = []
        tables = {"differences of the cases": self.cases, "differences of the versions": self.versions}
        for title, table in {**self.named(), **tables}.items():
            if table:
                parts.append(_columns(title, self.names, {self.bodies.told(key): row for key, row in table.items()}))
        if not self.cases:
            parts.append("the cases are equal")
        return "\n\n".join(parts)

    def named(self) -> dict[str, dict[str, list[Any]]]:
        """Return the results by their names and units: the sheet, what is at the same places, and the rest."""
        of_sheet = {f"{part}.{key}" for part in ("sliding", *BODIES) for key in LINES}
        # At quarters of each run's own contact: not the same places.
        own_places = ("x_mm", "wear_mm", "pressure_MPa", "temperature_punch_", "temperature_strip_")
        rest = {
            _name(key): row
            for key, row in self.numbers.items()
            if key not in of_sheet and not key.rpartition(".")[2].startswith(own_places)
        }
        return {"results": self._sheet(), "at the same places": at_same_places(self.histories), "further": rest}

    def _sheet(self) -> dict[str, list[Any]]:
        """Return what stands on a tribometer's sheet, in the units in which it is read."""
        found = {}
        for part in ("sliding", *BODIES):
            for key, line in LINES.items():
                row = self.numbers.get(f"{part}.{key}")
                if row is not None:
                    unit = f" ({line.unit})" if line.unit else ""
                    of = "" if part == "sliding" else f", {part}"
                    found[f"{line.label}{of}{unit}"] = [shown(value, line) for value in row]
        return found


def at_same_places(histories: Sequence[xarray.Dataset]) -> dict[str, list[Any]]:
    """Return depths and pressures at the end of plane runs at places that all of them have, by names with units."""
    if any(model_of(history) != "plane" or has_stick(history) for history in histories):
        return {}
    low, high = (pick(float(end(history.x)) for history in histories) for pick, end in ((max, np.min), (min, np.max)))
    if high <= low:
        return {}
    places = (low + high) / 2 + (high - low) * np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
    places = np.round(places, 9) + 0.0
    found: dict[str, list[Any]] = {}
    values = {
        "worn depth of the punch (µm)": ("wear", "x", 1e3),
        "worn depth of the strip (µm)": ("wear_strip", "x_strip", 1e3),
        "pressure, last half-cycle (MPa)": ("pressure", "x", 1.0),
    }
    for name, (variable, along, factor) in values.items():
        if not any(variable in history for history in histories):
            continue
        rows = [
            np.interp(places, history[along], factor * history[variable].isel(half_cycle=-1))
            if variable in history
            else np.full(len(places), np.nan)
            for history in histories
        ]
        for k, x in enumerate(places):
            found[f"{name} at x = {x:.4g} mm"] = [float(row[k]) for row in rows]
    return found


def _name(key: str) -> str:
    unit = unit_of(key)
    return f"{label_of(key)} ({unit})" if unit else label_of(key)


def compare(directories: Sequence[Path]) -> Comparison:
    """Read the runs.

    Raises:
        CaseError: fewer than two, or one is no run; lists all that are wrong.
    """
    if len(directories) < 2:
        raise CaseError(InputError("DIR", "expected the folders of at least two runs"))
    problems: list[InputError] = []
    read = []
    for directory in directories:
        try:
            read.append((in_kelvin(_read(directory)), read_summary(directory), read_case(directory)))
        except CaseError as error:
            problems += error.problems
    if problems:
        raise CaseError(problems)
    if len({has_stick(history) for history, _, _ in read}) > 1:
        raise CaseError(InputError("DIR", "expected runs with stick, or runs in gross sliding, not both"))
    summaries = [summary for _, summary, _ in read]
    shown = [
        {k: v for k, v in s.items() if k not in ("versions", "warnings", "title", "uncertainty")} for s in summaries
    ]
    return Comparison(
        names=_names(directories),
        histories=[history for history, _, _ in read],
        numbers=_rows([flat(s) for s in shown]),
        cases=_differing(_rows([flat(case) for _, _, case in read])),
        versions=_differing(_rows([s.get("versions", {}) for s in summaries])),
        bodies=Names.of(read[0][2]),
    )


def _read(directory: Path) -> xarray.Dataset:
    """Return the history of a run, in memory.

    Raises:
        CaseError: there is none, or it holds nothing yet.
    """
    history = load_history(directory)
    return by_cycles(history) if resolves(history) else of_half_cycles(directory, history)


def comparison_figure(comparison: Comparison) -> Figure:
    """Draw shape and pressures at the end of each run, and what it comes to over its cycles."""
    return runs_figure(comparison.names, comparison.histories)


def draw_comparison(comparison: Comparison, path: Path) -> Path:
    """Write the figure.

    Raises:
        CaseError: the file's ending is unknown, or its folder takes no file.
        OutputError: there is no room for it.
    """
    if path.suffix not in FORMATS:
        raise CaseError(InputError("-o", f"expected a file ending in {', '.join(FORMATS)}, got {str(path)!r}"))
    try:
        path.touch()
    except OSError as error:
        raise CaseError(InputError("-o", f"{path} cannot be written: {error.strerror}")) from None
    with writing(path):
        figure = comparison_figure(comparison)
        name_bodies([figure], comparison.bodies)
        save(figure, path, dpi=150)
    return path


def _names(directories: Sequence[Path]) -> list[str]:
    """Return the folders' names, or their paths where names repeat."""
    names = [directory.resolve().name for directory in directories]
    return names if len(set(names)) == len(names) else [str(directory) for directory in directories]


def _rows(tables: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    keys = {key: None for table in tables for key in table}  # in order, each once
    return {key: [table.get(key) for table in tables] for key in keys}


def _differing(rows: dict[str, list[Any]]) -> dict[str, list[Any]]:
    return {key: row for key, row in rows.items() if any(value != row[0] for value in row)}


def _not_finite(value: Any) -> bool:
    return isinstance(value, float) and not math.isfinite(value)


def _columns(title: str, names: Sequence[str], table: dict[str, list[Any]]) -> str:
    lines = [[title, *names], *([key, *(_short(number_text(value)) for value in row)] for key, row in table.items())]
    widths = [max(len(line[k]) for line in lines) for k in range(len(names) + 1)]
    return "\n".join(
        "  ".join([line[0].ljust(widths[0]), *(text.rjust(w) for text, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    )


def _short(text: str, length: int = 32) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"
