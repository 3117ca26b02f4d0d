"""Figures over a run, from one table: which variables stand in which panel; a shaft's path, loads and heat besides."""

from __future__ import annotations

from collections.abc import Sized
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.report.style import (
    BLUE,
    BODY_COLOURS,
    DIRECTIONS,
    RED,
    STANDARD,
    Style,
    direction_style,
    from_zero,
    legend_beside,
    level_line,
    panels,
    run_style,
    strip_moves,
)
from fenwear.results.quantity import BODIES

BEYOND = 0.05  # of an axis: what is left free beyond its lines
MANY = 100.0  # last over first of a logarithmic axis, at least
SHORT = 0.01  # of cycles, m or s: an end whose labels are long, so that few of them go beside each other
TINY = 1e-9  # in the unit of the history: what is no more is nothing
GROSS = 0.2  # energy ratio above which sliding is called gross (Fouvry)
ENDS = {**BODIES, "layer": "_layer"}


class Line(NamedTuple):
    """Lines of a variable: of each body where its name has a place for it, of each direction where the label has one.

    Else one line, where it has any value beyond zero.

    Attributes:
        variable: Its name; `{}` stands for the end that a body gives it.
        label: In the legend; `{}` stands for the body or the direction.
        dashes: Of bodies.
    """

    variable: str
    label: str = "{}"
    dashes: str = "-"

    @property
    def of_bodies(self) -> bool:
        """Whether each body has a line."""
        return "{}" in self.variable

    @property
    def is_alone(self) -> bool:
        """Whether one line is drawn of all half-cycles."""
        return "{}" not in self.label

    def ends(self, history: xarray.Dataset) -> dict[str, str]:
        """Return the names of the variables that a history has, by the body."""
        names = {body: self.variable.format(end) for body, end in ENDS.items()}
        return {body: name for body, name in names.items() if name in history and history[name].notnull().any()}


class Panel(NamedTuple):
    """A panel of a figure over the run.

    Attributes:
        label: Of the upward axis; `{}` stands for the unit of temperatures.
        lines: Variables of the figure.
        factor: From the unit of the history.
        begins: At zero, anywhere, or on a logarithmic axis.
    """

    label: str
    lines: tuple[Line, ...]
    factor: float = 1.0
    begins: Literal["zero", "free", "powers"] = "zero"


class Course(NamedTuple):
    """A figure over the run.

    Attributes:
        of: Prefix of the variables that the figure needs.
        panels: Below each other; those without any value are left out.
        axis: Its horizontal axis; "" for what the user has chosen.
        logarithmic: Whether the axis of a long run is.
    """

    of: str
    panels: tuple[Panel, ...]
    axis: str = ""
    logarithmic: bool = True


def _size(name: str) -> Panel:
    """Return the panel of a size of the scar."""
    shares = (Line(f"scar_{name}{{}}", "{}, at 1 %"), Line(f"scar_{name}_5_percent{{}}", "{}, at 5 %", "--"))
    return Panel(f"scar {name} (mm)", shares)


COURSES = {
    "peaks": Course("largest_pressure", (
        Panel("largest pressure (MPa)", (Line("largest_pressure"),)),
        Panel("width in contact (mm)", (Line("contact_width"),)),
        Panel("area in contact (mm²)", (Line("contact_area"),)),
        Panel("largest temperature ({})", (Line("largest_temperature"),), begins="free"),
    )),
    "volume": Course("worn_volume", (
        Panel("worn volume (mm³)", (Line("worn_volume{}"),)),
        Panel("specific wear rate (mm³/(N m))", (Line("wear_rate{}", "{}, current"),
                                                 Line("mean_wear_rate{}", "{}, mean", "--"))),
    ), "distance", logarithmic=False),
    "creep": Course("creep_volume", (
        Panel("largest depth (µm)", (Line("largest_depth{}", "{}, worn off"),
                                     Line("largest_creep_depth{}", "{}, crept", "--")), 1e3),
        Panel("volume (mm³)", (Line("worn_volume{}", "{}, worn off"), Line("creep_volume{}", "{}, crept", "--"))),
    ), "time", logarithmic=False),
    "scar": Course("largest_depth", (
        Panel("largest worn depth (µm)", (Line("largest_depth{}"),), 1e3), _size("length"), _size("width"),
    )),
    "friction": Course("friction_work", (
        Panel("load: normal force (N)", (Line("normal_force"),)),
        Panel("friction force (N)", (Line("friction_force"),)),
        Panel("work of friction (J)", (Line("friction_work"),), 1e-3),
    ), logarithmic=False),
    "energy": Course("energy_ratio", (
        Panel("work of friction in a half-cycle (µJ)", (Line("friction_work_increment"),), 1e3),
        Panel("energy ratio (-)", (Line("energy_ratio"),)),
    )),
    "heat_balance": Course("heat_friction", (
        Panel("heat per half-cycle (J)", (
            Line("heat_friction", "made by friction"),
            Line("heat_convected", "lost to the surroundings"),
            Line("heat_held", "lost where temperature is held"),
            Line("heat_stored", "gained by both bodies"),
            Line("heat_debris", "carried off by debris"),
            Line("heat_carried", "carried out by the strip"),
        ), 1e-3, "free"),
    )),
    "coating": Course("worn_through_of_scar", (
        Panel("coating worn through (% of the scar)", (Line("worn_through_of_scar{}"),), 100.0),
        Panel("least coating left (µm)", (Line("least_coating{}"),), 1e3),
    )),
    "roughness": Course("roughness", (
        Panel("roughness (µm)", (Line("roughness_Sa{}", "mean, {}"),
                                 Line("roughness_Sq{}", "root mean square, {}", "--")), 1e3),
    )),
    "convergence": Course("periodicity", (
        Panel("change in a cycle, largest of a node (-)", (Line("periodicity"),), begins="powers"),
        Panel("load elsewhere than in the optimum (-)", (Line("optimum_distance"),)),
    )),
}  # fmt: skip


def course_figure(history: xarray.Dataset, name: str, look: Style = STANDARD) -> Figure:
    """Return a figure of the table `COURSES`."""
    course = COURSES[name]
    look = Style(look.width, course.axis or look.axis)
    twice = "contact_area" if "contact_width" in history else ""  # the width, times the thickness
    shown = [p for p in course.panels if any(line.ends(history) and line.variable != twice for line in p.lines)]
    figure, axes = panels(len(shown), 2.6, look=look)
    x, known = look.course(history), levels(history)
    for ax, panel in zip(axes, shown, strict=True):
        for number, line in enumerate(panel.lines):
            if line.is_alone and float(abs(history[line.variable]).max()) > TINY:
                ax.plot(x, panel.factor * history[line.variable], label=line.label, **run_style(number), **mark_few(x))
            elif not line.is_alone:
                (_of_bodies if line.of_bodies else _of_directions)(ax, history, line, panel.factor, x)
            if line.variable in known:
                level_line(ax, *known[line.variable])
        ax.set_ylabel(panel.label.format(temperature_unit(history)))
        if panel.begins == "powers":
            ax.set_yscale("log")
        elif panel.begins == "zero":
            from_zero(ax)
        of_directions = not (panel.lines[0].of_bodies or panel.lines[0].is_alone)
        legend_beside(ax, strip_moves(history) if of_directions else "")
    run_axis(axes[-1], history, look, logarithmic=course.logarithmic)
    return figure


def course_figures(history: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return all figures over the run that a history has data for, by their names."""
    names = [str(name) for name in history.data_vars]
    shown = [name for name, course in COURSES.items() if any(variable.startswith(course.of) for variable in names)]
    figures = {name: course_figure(history, name, look) for name in shown}
    if bores_of(history):
        figures["place"] = place_figure(history, look)
    if "load_factor" in history:
        figures["program"] = program_figure(history, look)
    return figures


def levels(history: xarray.Dataset) -> dict[str, tuple[float, str]]:
    """Return levels that lines of variables are held against, with their words, by the variable."""
    by_variable = {"energy_ratio": (GROSS, "gross sliding above,\npartial slip below")}
    if is_conforming(history):
        mean, width = mean_pressure(history), nominal_width(history)
        by_variable |= dict.fromkeys(("largest_pressure", "pressure"), (mean, f"mean {mean:.4g} MPa"))
        by_variable |= {
            "contact_width": (width, f"nominal {width:.4g} mm"),
            "contact_area": (width, f"nominal {width:.4g} mm²"),
        }
    return by_variable


def _of_bodies(ax: Axes, history: xarray.Dataset, line: Line, factor: float, x: Array) -> None:
    """Draw a line of each body that has one."""
    for body, name in line.ends(history).items():
        style: dict[str, Any] = {"color": BODY_COLOURS.get(body, "0.4"), "linestyle": line.dashes, **mark_few(x)}
        ax.plot(x, factor * history[name], label=line.label.format(body), **style)


def _of_directions(ax: Axes, history: xarray.Dataset, line: Line, factor: float, x: Array) -> None:
    """Draw a line of each sliding direction."""
    for d in directions_present(history):
        text, dashes, colour = direction_style(history, d)
        rows = np.flatnonzero(history.direction.values == d)
        values = factor * history[line.variable].values[rows]
        ax.plot(x[rows], values, dashes, color=colour, label=line.label.format(text), **mark_few(rows))


def place_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return a shaft's place in its bores over a run: the path of its middle, eccentricity and attitude angle."""
    figure, axes = panels(3, 2.7, share_x=False, look=look)
    path, eccentricity, angle = axes
    x, bores = look.course(history), bores_of(history)
    path.plot(0, 0, "+", color="0", label="middle of the bore")
    for number, (name, end) in enumerate(bores.items()):
        style = run_style(number) if name else {"color": "0"}
        words = f", {name}" if name else ""
        e_x, e_z = (1e3 * history[f"eccentricity_{axis}{end}"].values for axis in "xz")
        path.plot(e_x, e_z, **style, **mark_few(x))
        for row, mark, colour, when in ((0, "o", BLUE, "at first"), (-1, "s", RED, "at the end")):
            shown = style["color"] if name else colour
            path.plot(e_x[row], e_z[row], mark, color=shown, markersize=4, label=f"shaft, {when}{words}")
        label = name or "_"  # no entry of a legend
        eccentricity.plot(x, 1e3 * history[f"eccentricity{end}"], label=label, **style, **mark_few(x))
        angle.plot(x, history[f"attitude_angle{end}"], label=label, **style, **mark_few(x))
    path.set_aspect("equal", adjustable="datalim")
    path.margins(0.15)
    path.set_xlabel("x (µm)")
    path.set_ylabel("z (µm)")
    eccentricity.set_ylabel("eccentricity (µm)")
    from_zero(eccentricity)
    angle.set_ylabel("attitude angle (degrees)")
    low, high = angle.get_ylim()
    low, high = min(low, -1.0), max(high, 1.0)
    angle.set_ylim(low - BEYOND * (high - low), high + BEYOND * (high - low))
    for ax in axes if len(bores) > 1 else axes[:1]:
        legend_beside(ax, "")
    for ax in axes[1:]:
        run_axis(ax, history, look)
    return figure


def bores_of(history: xarray.Dataset) -> dict[str, str]:
    """Return how the names of variables of a shaft's place end, by the name of the bore; "" of the only one."""
    start = "attitude_angle"
    return {name[len(start) + 1 :]: name[len(start) :] for name in map(str, history) if name.startswith(start)}


ACTED = {
    "load": "normal force (N)",
    "load_factor": "loads over the case's",
    "speed": "mean speed",
    "ambient": "ambient",
}
UNITS_ACTED = {"mm s-1": " (mm/s)", "rad s-1": " (rad/s)", "K": " (K)", "degC": " (°C)"}


def program_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return the figure of load, speed and ambient temperature over the run, where they change."""
    shown = [name for name in ACTED if name in history and _changes(history[name])]
    if "load" in shown and "load_factor" in shown:  # the same twice
        shown.remove("load_factor")
    figure, axes = panels(max(1, len(shown)), 2.4, look=look)
    for ax, name in zip(axes, shown or ["load_factor"], strict=True):
        of_loads = name in ("load", "load_factor")
        x, y = look.course(history), history[name].values
        line = _by_stages(history, x, y) if of_loads and "stage_ends" in history else (x, y)
        held = "default" if of_loads else "steps-pre"  # constant since the record before
        ax.plot(*line, color="0", linewidth=1, drawstyle=held)
        ax.plot(x, y, color="0", marker=".", markersize=3, linestyle="")
        ax.set_ylabel(ACTED[name] + ("" if of_loads else UNITS_ACTED.get(str(history[name].attrs.get("units")), "")))
        low, high = float(y.min()), float(y.max())
        ax.set_ylim(min(0.0, 1.1 * low), 1.1 * max(high, 1e-300))
    axes[-1].set_xlabel(look.label)
    return figure


def _by_stages(history: xarray.Dataset, x: Array, loads: Array) -> tuple[Array, Array]:
    """Return the course of loads that leap from stage to stage and are linear within, through what is recorded of each.

    Args:
        history: With the stages of its program.
        x: Where recorded half-cycles end on the axis (k,).
        loads: In them (k,).
    """
    done, places, course = history.half_cycle.values, [], []
    for (begin, end), ends in zip(history.stage_ends.values, history.stage_loads.values, strict=True):
        rows = np.flatnonzero((done > begin) & (done <= end))
        if len(rows):
            shown = np.array([begin, min(end, done[-1])])
            of_end, there = (np.interp(at, (begin, end), ends) for at in (done[rows[-1]], shown))
            places.append(np.interp(shown, [0, *done], [0, *x]))
            course.append(loads[rows[-1]] * there / of_end)
    return np.concatenate(places), np.concatenate(course)


def _changes(values: xarray.DataArray) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low > 1e-9 * max(abs(low), abs(high))


def cycle_ends(history: xarray.Dataset) -> NDArray[np.int64]:
    """Return the rows of the recorded half-cycles that end a cycle (k,)."""
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    return np.flatnonzero(history.half_cycle.values.astype(int) % strokes == 0)


def mean_pressure(history: xarray.Dataset) -> float:
    """Return the load over the nominal contact, MPa."""
    last = history.isel(half_cycle=-1)
    return float((last.pressure * last.weight).sum() / last.weight.sum())


def nominal_width(history: xarray.Dataset) -> float:
    """Return the width of the nominal contact at the end, mm."""
    return float(history.weight.isel(half_cycle=-1, missing_dims="ignore").sum())


def is_conforming(history: xarray.Dataset) -> bool:
    """Return whether the unworn surfaces lie on each other: only then is load over nominal contact a pressure."""
    return bool(history.attrs.get("conforming", 0))


def directions_present(history: xarray.Dataset) -> list[int]:
    """Return the sliding directions of a run, rightward first."""
    return [d for d in DIRECTIONS if bool((history.direction == d).any())]


def shown_unit(unit: str) -> str:
    """Return a unit as figures show it."""
    return {"degC": "°C"}.get(unit, unit)


def temperature_unit(history: xarray.Dataset) -> str:
    """Return the unit of the temperatures of a history as figures show it."""
    hot = "largest_temperature" in history
    return shown_unit(str(history.largest_temperature.attrs.get("units", "K"))) if hot else "K"


def mark_few(points: Sized) -> dict[str, Any]:
    """Return the style of a line of so few points that without marks nothing may be seen."""
    return {"marker": "o", "markersize": 3} if len(points) < 3 else {}


def run_axis(ax: Axes, history: xarray.Dataset, look: Style, *, logarithmic: bool = True) -> None:
    """Label the axis of the run: logarithmic where wear alone slows down, linear with heat's own pace."""
    x = look.course(history)
    first, last = float(x[0]), float(x[-1])
    slows_down = int(history.half_cycle[-1]) > 10_000 or "largest_temperature" not in history
    if logarithmic and slows_down and first > 0 and last > MANY * first:
        ax.set_xscale("log")
        ax.set_xlim(first, last)
    elif last > first:
        ax.set_xlim(0 if not logarithmic else first, last)
        if last < SHORT:
            ax.xaxis.set_major_locator(MaxNLocator(4))
    ax.set_xlabel(look.label)
