"""Several runs in one figure and one table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray
from matplotlib.figure import Figure

from fenwear.case.body_names import BY_ROLE, Names
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.report.drawn_surface import gaps_of, model_of, part_lines
from fenwear.report.key_numbers import ALL_LINES, flat, line_of, number_text, read_case, read_summary
from fenwear.report.lines import fields_of, tracks_of, worn_range
from fenwear.report.run_figures import directions_present, mark_few
from fenwear.report.stick_figures import loop_of
from fenwear.report.style import (
    direction_words,
    from_zero,
    legend_beside,
    name_bodies,
    panels,
    run_style,
    save,
    strip_moves,
)
from fenwear.results.disk import finite, writing
from fenwear.results.quantity import in_kelvin
from fenwear.results.sheet import shown
from fenwear.results.stored_history import by_cycles, read_history, resolves

FORMATS = (".png", ".pdf", ".svg")
COURSES = {
    "largest_pressure": "largest contact pressure (MPa)",
    "largest_depth": "largest worn depth of the punch (mm)",
    "largest_temperature": "largest temperature (K)",
    "friction_work_increment": "work of friction in a half-cycle (mJ)",
}
DRAWN = ("wear", "wear_strip", "pressure")  # along the contact, at the end
OF_EACH = ("x_mm", "wear_mm", "pressure_MPa", "temperature_punch_", "temperature_strip_")  # at other places in each run


@dataclass(frozen=True)
class Comparison:
    """Runs side by side: each row of the tables has a value for every run, None where it has none.

    Attributes:
        names: Of the runs, each different.
        histories: Of the runs.
        numbers: The numbers and the words of the summaries.
        cases: Keys of the cases that differ.
        versions: Versions of the stack that differ.
        bodies: Names of the bodies in the first run.
    """

    names: list[str]
    histories: list[xarray.Dataset]
    numbers: dict[str, list[Any]]
    cases: dict[str, list[Any]]
    versions: dict[str, list[Any]]
    bodies: Names = BY_ROLE

    def as_json(self) -> dict[str, Any]:
        """Return the tables; what is no finite number is null."""
        return {
            "runs": self.names,
            "numbers": finite(self.numbers),
            "cases": self.cases,
            "versions": self.versions,
        }

    def text(self) -> str:
        """Return the tables for people, a column per run: names and units of results, keys of cases."""
        parts = []
        differences = {"differences of the cases": self.cases, "differences of the versions": self.versions}
        for title, table in {"results": self.named(), **differences}.items():
            if table:
                parts.append(
                    _columns(title, self.names, {self.bodies.with_names(key): row for key, row in table.items()})
                )
        if not self.cases:
            parts.append("the cases are equal")
        return "\n\n".join(parts)

    def named(self) -> dict[str, list[Any]]:
        """Return the results by their names and units."""
        results, order = {}, {key: number for number, key in enumerate(ALL_LINES)}
        for path in sorted(self.numbers, key=lambda p: order.get(p, order.get(p.rpartition(".")[2], len(order)))):
            row, (of, _, key) = self.numbers[path], path.rpartition(".")
            if not key.startswith(OF_EACH):
                line = line_of(path)
                suffix = f", {of}" if key in ALL_LINES and of not in ("", "sliding") else ""
                heading = line._replace(label=line.label + suffix).heading
                results[heading] = [shown(value, line) if isinstance(value, float) else value for value in row]
        return results


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
            read.append((in_kelvin(read_history(directory)), read_summary(directory), read_case(directory)))
        except CaseError as error:
            problems += error.problems
    if problems:
        raise CaseError(problems)
    left_out = ("versions", "warnings", "title", "uncertainty")
    names = [directory.resolve().name for directory in directories]
    return Comparison(
        names=names if len(set(names)) == len(names) else [str(directory) for directory in directories],
        histories=[history for history, _, _ in read],
        numbers=_rows([flat({k: v for k, v in summary.items() if k not in left_out}) for _, summary, _ in read]),
        cases=_differing(_rows([flat(case) for _, _, case in read])),
        versions=_differing(_rows([summary.get("versions", {}) for _, summary, _ in read])),
        bodies=Names.of(read[0][2]),
    )


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


class Drawn(NamedTuple):
    """A line of a run: the title of its panel, the names of its axes, and where it goes."""

    title: str
    across: str
    up: str
    x: Array
    y: Array
    from_zero: bool = True
    ends: tuple[float, float] | None = None


def comparison_figure(comparison: Comparison) -> Figure:
    """Return the runs over each other, a panel for each quantity; along the contact where all are of one model.

    Solids are drawn on cuts along and across the sliding.
    """
    histories = comparison.histories
    alike = len({model_of(history) for history in histories}) == 1
    runs = [[*(_shapes(history) if alike else ()), *_courses(history)] for history in histories]
    titles = list(dict.fromkeys(line.title for run in runs for line in run))
    figure, axes = panels(len(titles), 2.5, share_x=False)
    for number, (name, run) in enumerate(zip(comparison.names, runs, strict=True)):
        # Thinner from run to run: where two agree, both are seen.
        style: dict[str, Any] = {**run_style(number), "linewidth": max(1.2, 3.0 - 0.7 * number)}
        for line in run:
            ax = axes[titles.index(line.title)]
            ax.plot(line.x, line.y, label=name, **style, **mark_few(line.x))
            ax.set_title(line.title, loc="left")
            ax.set_xlabel(line.across)
            ax.set_ylabel(line.up)
            if line.across == "half-cycle n":
                ax.set_xscale("log")
            if line.from_zero:
                from_zero(ax)
            if line.ends is not None:
                ax.set_xlim(line.ends)
    for ax in axes:
        legend_beside(ax, "run")
    part_lines([figure], np.concatenate([gaps_of(history) for history in histories]))
    return figure


def _courses(history: xarray.Dataset) -> Iterator[Drawn]:
    """Yield what a run comes to over its half-cycles."""
    directions = len(directions_present(history))
    for name, label in COURSES.items():
        if name in history:
            # The larger of the directions: the line shall not jump between them.
            values = history[name].rolling(half_cycle=directions, min_periods=1).max().values
            title = label[0].upper() + label[1:].partition(" (")[0]
            yield Drawn(title, "half-cycle n", label, history.half_cycle.values, values, from_zero=False)


def _shapes(history: xarray.Dataset) -> Iterator[Drawn]:
    """Yield what there is along the contact at the end of a run, with stick the loop of the last cycle besides."""
    if resolves(history):
        cycles = by_cycles(history)
        way, force, moved, pulled = loop_of(cycles, cycles.sizes["cycle"] - 1)
        yield Drawn("Loop of the last cycle", moved, pulled, way, force, from_zero=False)
    solid, words = model_of(history) == "solid", direction_words(history)
    known = fields_of(history)
    for name, field in ((name, known[name]) for name in DRAWN if name in known):
        title = f"{field.title[0].upper()}{field.title[1:]} at the end"
        by_direction = name == "pressure" and not solid
        for d in directions_present(history) if by_direction else (0,):
            rows = history[name].values if d == 0 else history[name].values[history.direction.values == d]
            shape_title = f"{title}, {strip_moves(history)} {words[d]}" if d else title
            for along in (True, False) if solid else (True,):
                track = tracks_of(history, along=along)[0]
                cut = f", {'along' if along else 'across'} the sliding" if solid else ""
                label = track.label.partition(",")[0]
                x, y = track.line(field.factor * rows[-1], field.body)
                ends = worn_range(history) if field.body == "strip" and not solid else None
                yield Drawn(shape_title + cut, label, field.label, x, y, ends=ends)


def _rows(tables: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    keys = {key: None for table in tables for key in table}  # in order, each once
    return {key: [table.get(key) for table in tables] for key in keys}


def _differing(rows: dict[str, list[Any]]) -> dict[str, list[Any]]:
    return {key: row for key, row in rows.items() if any(value != row[0] for value in row)}


def _columns(title: str, names: Sequence[str], table: dict[str, list[Any]]) -> str:
    lines = [[title, *names], *([key, *(_short(number_text(value)) for value in row)] for key, row in table.items())]
    widths = [max(len(line[k]) for line in lines) for k in range(len(names) + 1)]
    return "\n".join(
        "  ".join([line[0].ljust(widths[0]), *(text.rjust(w) for text, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    )


def _short(text: str, length: int = 32) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"
