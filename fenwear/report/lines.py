"""Figures along the contact at chosen half-cycles: lines in planes and rings, cuts in solids; profiles and wear maps.

`fields_of` says what a history has at the nodes of a contact; maps, cuts, lines and comparisons show it by that table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.common.errors import readable
from fenwear.report.drawn_surface import along_contact, cut_places, gaps_of, model_of, parted, surface_of
from fenwear.report.run_figures import cycle_ends, directions_present, levels, temperature_unit
from fenwear.report.style import (
    NARROW,
    STANDARD,
    Style,
    colour_bar,
    contact_axis,
    from_zero,
    legend_beside,
    level_line,
    panels,
    shades,
)
from fenwear.results.quantity import BODIES

LAST = 0.1  # of what is done, that a mean pressure is of
LATE = "late_pressure"  # the variable that has it
BESIDE = 3  # contacts whose cuts stand beside each other
ABOVE = 1.15  # of the largest pressure of later states: where an axis of pressure ends
MAP_ROWS = 600  # of a map over the run: as many as its picture has
DRAWN = 0.2  # of a round contact's size: its largest depth as it is drawn
STATE = "state_"  # how the names of states begin that laws remember
LIES_BETWEEN = {
    "debris_thickness": "thickness of the debris",
    "plastic_depth": "plastic depth",
    "coating": "coating left on the punch",
    "coating_strip": "coating left on the strip",
}


class Field(NamedTuple):
    """Fields of a history at the nodes of a contact: a variable, on which body's surface, and how it is shown.

    Attributes:
        variable: Its name.
        body: On whose nodes it is.
        title: In words.
        unit: In which it is shown.
        factor: That unit from the one of the history.
        colours: Of maps.
    """

    variable: str
    body: str
    title: str
    unit: str
    factor: float = 1.0
    colours: str = "PuBuGn"

    @property
    def label(self) -> str:
        """Its title with its unit."""
        return f"{self.title} ({self.unit})" if self.unit != "1" else self.title


# Of cycles with time steps: `fenwear.report.stick_figures.with_sums` adds them up.
OF_CYCLES = (
    Field("cycle_slip", "punch", "slip in a cycle", "µm", 1e3, "YlGnBu"),
    Field("cycle_work", "punch", "work of friction in a cycle", "µJ/mm²", 1e3, "YlOrRd"),
    Field("cycle_stress", "punch", "largest stress along the sliding in the strip's surface", "MPa", 1.0, "cividis"),
)


def fields_of(history: xarray.Dataset) -> dict[str, Field]:
    """Return the fields that a history has at the nodes of a contact, by the variable."""
    warm = temperature_unit(history)
    candidates = [
        Field("pressure", "punch", "contact pressure", "MPa", colours="YlGnBu"),
        Field(LATE, "punch", "mean pressure", "MPa", colours="YlGnBu"),
        *(Field(f"wear{end}", body, f"worn depth of the {body}", "µm", 1e3, "YlOrBr") for body, end in BODIES.items()),
        *(Field(f"temperature_{b}", "punch", f"temperature of the {b}", warm, colours="YlOrRd") for b in BODIES),
        *(Field(f"surface{end}", b, f"height of the {b}", "µm", 1e3, "cividis") for b, end in BODIES.items()),
        *OF_CYCLES,
        *between_of(history).values(),
    ]
    return {field.variable: field for field in candidates if field.variable in history}


def between_of(history: xarray.Dataset) -> dict[str, Field]:
    """Return the fields between the surfaces: debris, plastic depth, coatings, and states that laws remember."""
    fields = {}
    for name, values in history.data_vars.items():
        variable = str(name)
        body = "strip" if any(str(over).endswith("_strip") for over in values.dims) else "punch"
        if variable in LIES_BETWEEN:
            fields[variable] = Field(variable, body, LIES_BETWEEN[variable], "µm", 1e3)
        elif variable.startswith(STATE):
            title = variable.removeprefix(STATE).replace("_", " ")
            fields[variable] = Field(variable, body, title, str(values.attrs["units"]))
    return fields


def with_late_pressures(history: xarray.Dataset) -> xarray.Dataset:
    """Return the ends of cycles of a history with mean pressures over the last tenth of what is done, MPa.

    From the end of a cycle before that tenth on, however far it lies back. At an instant the nodes at an edge that
    moves are at any fraction of their coming; what they have borne since is what they have lost.
    """
    cycles = history.isel(half_cycle=cycle_ends(history))
    ends = np.concatenate([[0], cycles.half_cycle.values])
    borne = np.concatenate([np.zeros((1, *cycles.pressure.shape[1:])), cycles.pressure_sum.values])
    before = np.searchsorted(ends, (1 - LAST) * ends[1:], side="right") - 1
    late = (borne[1:] - borne[before]) / (ends[1:] - ends[before])[:, None]
    return cycles.assign({LATE: (cycles.pressure.dims, late)})


def chosen_half_cycles(history: xarray.Dataset, wanted: Sequence[int] = ()) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones, or six spread over the run."""
    recorded = history.half_cycle.values
    # Most of them beyond the end: they were chosen for a longer run.
    if 2 * sum(n <= recorded[-1] for n in wanted) <= len(wanted):
        wanted = [int(n) for n in np.unique(np.geomspace(1, recorded[-1], 6).round().astype(int))]
    return nearest_half_cycles(history, [*wanted, int(recorded[-1])])


def nearest_half_cycles(history: xarray.Dataset, wanted: Sequence[int]) -> list[int]:
    """Return the recorded half-cycles nearest to the wanted ones."""
    recorded = history.half_cycle.values
    return sorted({int(recorded[np.abs(recorded - n).argmin()]) for n in wanted})


def pressure_top(history: xarray.Dataset, half_cycles: Sequence[int]) -> float:
    """Return the upper end of an axis of pressure: the edges of a fresh flat punch peak far beyond all that follows."""
    late = float(history.pressure.sel(half_cycle=list(half_cycles[len(half_cycles) // 2 :])).max())
    return ABOVE * max(late, float(history.pressure.median("half_cycle").max()))


class Track(NamedTuple):
    """A line along a contact.

    Attributes:
        name: Of the contact; "" of the only one.
        label: Of its axis.
        line: From values at the nodes of a body's surface (n,) and the body to places, mm, and values there.
    """

    name: str
    label: str
    line: Callable[[Array, str], tuple[Array, Array]]


def tracks_of(history: xarray.Dataset, *, along: bool = True) -> list[Track]:
    """Return the lines along a contact; of a solid a cut of each contact, along or across the sliding."""
    if model_of(history) != "solid":
        label = along_contact(history)[1]
        return [Track("", label, lambda values, body: (along_contact(history, body)[0], values))]
    surfaces = {body: surface_of(history, body) for body in BODIES if body == "punch" or "x_strip" in history}
    grain = 1e-4 * float(np.ptp(surfaces["punch"].sliding, axis=0).max())
    tracks = []
    for place in cut_places(history):
        at, other = (float(place.at[1]), "across") if along else (float(place.at[0]), "along")
        at = round(at / grain) * grain
        label = f"place {'along' if along else 'across'} the sliding (mm),\nat {at:.4g} mm {other} it"

        def line(values: Array, body: str, place: Any = place) -> tuple[Array, Array]:
            return surfaces[body].cut(values, place.at, along=along, nodes=place.nodes[body])

        tracks.append(Track(place.name, label, line))
    return tracks


def lines_figure(
    history: xarray.Dataset,
    fields: Iterable[Field],
    half_cycles: Sequence[int],
    look: Style = STANDARD,
    *,
    along: bool = True,
) -> Figure:
    """Return fields along the contact at the chosen half-cycles, in solids on cuts along or across the sliding.

    Pressures along a line have a panel for each sliding direction. Contacts with names stand beside each other, below
    each other where the figure is narrow. An axis of pressure ends above the later states: of what lies beyond it the
    legend has the largest.
    """
    tracks, solid = tracks_of(history, along=along), model_of(history) == "solid"
    rows = [(field, d) for field in fields for d in _ways(history, field, solid=solid)]
    columns = len(tracks) if len(tracks) <= BESIDE and look.width >= NARROW else 1
    order = [(row, track) for row in rows for track in tracks]
    if columns == 1:
        order = [(row, track) for track in tracks for row in rows]
    figure, axes = panels(len(order), 2.3 if solid else 3.0, columns=columns, share_x=not solid, look=look)
    for number, (ax, ((field, direction), track)) in enumerate(zip(axes, order, strict=True)):
        _draw(ax, history, field, direction, half_cycles, track, look)
        if number % columns == 0:
            ax.set_ylabel(field.label)
        if number % columns == columns - 1:
            legend_beside(ax, look.of_one)
        if track.name and (columns == 1 or number < columns):
            ax.set_title(track.name, loc="center", fontsize="medium")
        if (field, direction) == rows[-1]:
            contact_axis(ax, track.label)
    if not solid and any(field.body == "strip" for field, _ in rows):
        axes[-1].set_xlim(*worn_range(history))
    return figure


def _ways(history: xarray.Dataset, field: Field, *, solid: bool) -> list[int]:
    """Return the sliding directions that a field has panels for; 0 for all together."""
    return directions_present(history) if field.variable == "pressure" and not solid else [0]


def _draw(
    ax: Axes,
    history: xarray.Dataset,
    field: Field,
    direction: int,
    half_cycles: Sequence[int],
    track: Track,
    look: Style,
) -> None:
    """Draw a field along a track at the half-cycles of a direction that are nearest to the chosen ones."""
    direction_history = history if direction == 0 else history.isel(half_cycle=history.direction.values == direction)
    top = pressure_top(history, half_cycles) if field.variable == "pressure" else np.inf
    for colour, n in shades(nearest_half_cycles(direction_history, half_cycles)):
        values = field.factor * direction_history[field.variable].sel(half_cycle=n).values
        beyond = f" (to {readable(values.max(), 3)} MPa)" if values.max() > top else ""
        style: dict[str, Any] = {"color": colour, "linestyle": "--" if direction < 0 else "-"}
        ax.plot(*track.line(values, field.body), label=look.name(history, n) + beyond, gid=str(n), **style)
    if field.variable in (known := levels(history)):
        level_line(ax, *known[field.variable])
    if (
        not field.variable.startswith(("temperature", "surface"))
        and float(direction_history[field.variable].min()) >= 0
    ):
        from_zero(ax)
    ax.set_ylim(top=min(top, ax.get_ylim()[1]))
    ax.margins(x=0.01)


def surfaces_of(history: xarray.Dataset) -> dict[str, tuple[Any, Any, Any]]:
    """Return abscissae, worn depths and unworn heights (mm) of the surfaces that wear, by the body."""
    abscissae = {}
    for body, end in BODIES.items():
        if f"wear{end}" in history:
            x = along_contact(history, body)[0]
            height = history[f"height{end}"].values if f"height{end}" in history else np.zeros_like(x)
            abscissae[body] = (x, history[f"wear{end}"], height)
    return abscissae


def that_wear(history: xarray.Dataset) -> dict[str, tuple[Any, Any, Any]]:
    """Return the surfaces that something is worn off; all where nothing is."""
    surfaces = surfaces_of(history)
    return {body: surface for body, surface in surfaces.items() if float(surface[1].max()) > 0} or surfaces


def profile_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Return the surfaces as a profilometer sees them, the height over x: unworn, and worn at the chosen half-cycles.

    Depths are drawn along z: right where slopes are small, as those of worn surfaces are.
    """
    if "place" in history:
        return _outline_figure(history, half_cycles, look)
    surfaces = surfaces_of(history)
    figure, axes = panels(len(surfaces), 3.0, look=look)
    for ax, (body, (x, depth, height)) in zip(axes, surfaces.items(), strict=True):
        zero = height.min() if body == "punch" else height.max()
        ax.plot(x, 1e3 * (height - zero), color="0", linestyle="--", linewidth=1.2, label="unworn")
        sign = 1 if body == "punch" else -1
        for colour, n in shades(half_cycles):
            z = height - zero + sign * depth.sel(half_cycle=n).values
            ax.plot(x, 1e3 * z, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"height of the {body} (µm)")
        legend_beside(ax, look.of_one)
    axes[-1].set_xlim(*worn_range(history))
    contact_axis(axes[-1])
    return figure


def _outline_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style) -> Figure:
    """Return round contacts as a tester of roundness sees them: their outlines, depths magnified."""
    worn = [end for end in BODIES.values() if f"wear{end}" in history and f"place{end}" in history]
    figure, axes = panels(len(worn), 5.0, share_x=False, look=look)
    for ax, end in zip(axes, worn, strict=True):
        outline, normal = (
            np.column_stack([history[f"{name}{end}"].values for name in names])
            for names in (("place", "height"), ("inwards_x", "inwards_z"))
        )
        depth, size = history[f"wear{end}"], float(np.ptp(outline, axis=0).max())
        deepest = float(depth.sel(half_cycle=list(half_cycles)).max())
        magnified = DRAWN * size / deepest if deepest > 0 else 1.0
        part = history[f"part{end}"].values if f"part{end}" in history else np.zeros(len(outline))
        cuts = np.flatnonzero(np.diff(part)) + 1
        _trace(ax, outline, cuts, color="0", linestyle="--", linewidth=1.2, label="unworn")
        for colour, n in shades(half_cycles):
            worn_away = outline + magnified * depth.sel(half_cycle=n).values[:, None] * normal
            _trace(ax, worn_away, cuts, color=colour, label=look.name(history, n), gid=str(n))
        ax.plot(*((outline.min(axis=0) + outline.max(axis=0)) / 2), "+", color="0")
        ax.set_aspect("equal")
        ax.set_xlabel("x (mm)")
        ax.set_ylabel(f"z (mm), depths {readable(magnified, 3)} times as large")
        legend_beside(ax, look.of_one)
    return figure


def _trace(ax: Axes, outline: Array, cuts: NDArray[np.int64], **style: Any) -> None:
    """Draw an outline (n, 2) with gaps before these nodes; closed where it is one curve that ends where it began."""
    steps = np.linalg.norm(np.diff(outline, axis=0), axis=1)
    if not len(cuts) and np.linalg.norm(outline[-1] - outline[0]) < 2 * steps.max():
        outline = np.vstack([outline, outline[:1]])
    ax.plot(*np.insert(outline, cuts, np.nan, axis=0).T, **style)


def worn_range(history: xarray.Dataset) -> tuple[float, float]:
    """Return the ends of the punch's contact and of the strip's scar, mm."""
    ends = [along_contact(history)[0]]
    if "wear_strip" in history:
        ends.append(along_contact(history, "strip")[0][history.wear_strip.values.max(axis=0) > 0])
    x = np.concatenate(ends)
    return float(x.min()), float(x.max())


def wear_map_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return the worn depth over place and run, a panel for each body that wears."""
    surfaces = that_wear(history)
    figure, axes = panels(len(surfaces), 3.0, look=look)
    course = look.course(history)
    wanted = np.linspace(course[0], course[-1], MAP_ROWS)
    shown = np.unique(np.searchsorted(course, wanted).clip(max=len(course) - 1))
    for ax, (body, (x, depth, _)) in zip(axes, surfaces.items(), strict=True):
        rows, values = np.append(0.0, course[shown]), np.vstack([np.zeros(len(x)), 1e3 * depth.values[shown]])
        at, values = parted(x, values, gaps_of(history))
        drawn = ax.pcolormesh(at, rows, values, shading="gouraud", cmap="Blues", vmin=0, rasterized=True)
        colour_bar(figure, drawn, ax, f"worn depth of\nthe {body} (µm)")
        ax.set_ylabel(look.label)
    axes[-1].set_xlim(*worn_range(history))
    contact_axis(axes[-1])
    return figure
