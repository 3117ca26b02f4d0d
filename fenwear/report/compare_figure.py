"""Several runs in one figure: what is drawn along the contact at their ends, and what they come to over the run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.report.course import directions_present, mark_few
from fenwear.report.gaps import gaps_of, part_lines
from fenwear.report.shapes import worn_range
from fenwear.report.stick_course import THROUGH_MIDDLE, line_along
from fenwear.report.style import by_powers, direction_words, from_zero, legend_beside, panels, run_style, strip_moves
from fenwear.report.surface import along_contact, centre_of_wear, model_of, surface_of
from fenwear.results.cycles import cycle_at
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COURSES = {
    "half_cycle": {
        "largest_pressure": ("Largest contact pressure", "pressure (MPa)"),
        "largest_depth": ("Largest worn depth of the punch", "depth (mm)"),
        "largest_temperature": ("Largest temperature", "temperature (K)"),
    },
    "cycle": {
        "friction_work_increment": ("Work of friction in a cycle", "work (mJ)"),
        "largest_temperature": ("Largest temperature in a cycle", "temperature (K)"),
    },
}


class Drawn(NamedTuple):
    """A line of a run: the title of its panel, the names of its axes, and where it goes."""

    title: str
    across: str
    up: str
    x: Array
    y: Array
    from_zero: bool = True
    ends: tuple[float, float] | None = None


def has_stick(history: xarray.Dataset) -> bool:
    """Return whether a history is by cycles, as those of runs with stick are compared."""
    return "cycle" in history.sizes and "step" in history.sizes


def runs_figure(names: Sequence[str], histories: Sequence[xarray.Dataset]) -> Figure:
    """Draw runs over each other, a panel for each quantity; along the contact where all are of one model.

    Solids are drawn on cuts along and across the sliding.
    """
    alike = len({model_of(history) for history in histories}) == 1
    runs = [[*(_shapes(history) if alike else ()), *_courses(history)] for history in histories]
    titles = list(dict.fromkeys(line.title for run in runs for line in run))
    figure, axes = panels(len(titles), 2.5, share_x=False)
    for number, (name, run) in enumerate(zip(names, runs, strict=True)):
        # Thinner from run to run: where two agree, both are seen.
        style: dict[str, Any] = {**run_style(number), "linewidth": max(1.2, 3.0 - 0.7 * number)}
        for line in run:
            ax = axes[titles.index(line.title)]
            ax.plot(line.x, line.y, label=name, **style, **mark_few(line.x))
            ax.set_title(line.title, loc="left")
            ax.set_xlabel(line.across)
            ax.set_ylabel(line.up)
            if line.across == "half-cycle n":
                by_powers(ax)
            if line.from_zero:
                from_zero(ax)
            if line.ends is not None:
                ax.set_xlim(line.ends)
    for ax in axes:
        legend_beside(ax, "run")
    part_lines([figure], np.concatenate([gaps_of(history) for history in histories]))
    return figure


def _courses(history: xarray.Dataset) -> Iterator[Drawn]:
    """Yield what a run comes to over its half-cycles, or its cycles."""
    along = "cycle" if has_stick(history) else "half_cycle"
    for name, (title, up) in COURSES[along].items():
        if name in history:
            values = history[name]
            if along == "half_cycle":  # the larger of the directions: the line shall not jump between them
                values = values.rolling(half_cycle=len(directions_present(history)), min_periods=1).max()
            across = "cycle" if along == "cycle" else "half-cycle n"
            yield Drawn(title, across, up, history[along].values, values.values, from_zero=False)


def _shapes(history: xarray.Dataset) -> Iterator[Drawn]:
    """Yield what there is along the contact at the end of a run."""
    if has_stick(history):
        yield from _cycle(history)
        return
    solid = model_of(history) == "solid"
    place = "" if solid else along_contact(history)[1]
    for body, end in BODIES.items():
        if f"wear{end}" not in history:
            continue
        values, title = 1e3 * history[f"wear{end}"].values[-1], f"Worn depth of the {body} at the end"
        if solid:
            yield from _cuts(history, body, values, title, "worn depth w (µm)")
        else:
            ends = worn_range(history) if body == "strip" else None
            yield Drawn(title, place, "worn depth w (µm)", along_contact(history, body)[0], values, ends=ends)
    if solid:
        yield from _cuts(history, "punch", history.pressure.values[-1], "Pressure at the end", "pressure p (MPa)")
        return
    for d in directions_present(history):
        title = f"Pressure at the end, {strip_moves(history)} {direction_words(history)[d]}"
        values = history.pressure.values[history.direction.values == d][-1]
        yield Drawn(title, place, "pressure p (MPa)", along_contact(history)[0], values)


def _cuts(history: xarray.Dataset, body: str, values: Array, title: str, up: str) -> Iterator[Drawn]:
    surface, at = surface_of(history, body), centre_of_wear(history)
    for way in ("along", "across"):
        x, y = surface.cut(values, at, along=way == "along")
        yield Drawn(f"{title}, {way} the sliding", f"place {way} the sliding (mm)", up, x, y)


def _cycle(history: xarray.Dataset) -> Iterator[Drawn]:
    """Yield the loop of the last cycle of a run with stick, and what there is along its contact."""
    last, line, solid = cycle_at(history, -1), line_along(history), model_of(history) == "solid"
    closed = np.arange(last.sizes["step"] + 1) % last.sizes["step"]
    turns = history.displacement.units == "rad"
    moved = "turn of the strip (rad)" if turns else "displacement of the strip (µm)"
    pulled = f"{'torque' if turns else 'tangential force'} ({history.tangential_force.units})"
    way = (1.0 if turns else 1e3) * last.displacement.values[closed]
    yield Drawn("Loop of the last cycle", moved, pulled, way, last.tangential_force.values[closed], from_zero=False)
    place = THROUGH_MIDDLE if solid else along_contact(history)[1]
    for title, up, values in (
        ("Worn depth of the punch before the last cycle", "depth (µm)", 1e3 * last.wear.values),
        ("Pressure at the end", "pressure (MPa)", last.pressure.isel(step=-1).values),
    ):
        yield Drawn(title, place, up, *line(values))
