"""Maps of the contact surface of solids at chosen half-cycles, and cuts along and across the sliding."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.report.course import temperature_unit
from fenwear.report.lies_between import DEPTHS, lies_between
from fenwear.report.shown import early_half_cycles, pressure_top
from fenwear.report.style import (
    GREY,
    NARROW,
    STANDARD,
    Style,
    bar_place,
    colour_bar,
    from_zero,
    legend_beside,
    name_panel,
    one_way,
    panels,
    panels_of_maps,
    shades,
)
from fenwear.report.surface import Surface, cut_places, surface_of
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = 16
LONG = 2.2  # length over height of a map from which on fewer stand beside each other
BESIDE = 3  # contacts whose cuts stand beside each other
EDGE_OF_CONTACT = 1e-2  # of the largest pressure


class Quantity(NamedTuple):
    """What a map shows: a variable of the history, on which body's surface, and how."""

    variable: str
    body: str
    title: str
    unit: str
    factor: float
    colours: str
    short: str


def quantities(history: xarray.Dataset) -> dict[str, Quantity]:
    """Return what there are maps of, by the figure's name."""
    warm = temperature_unit(history)
    found = {
        "pressure_map": Quantity("pressure", "punch", "Contact pressure", "MPa", 1.0, "YlGnBu", "pressure"),
        "wear_map": Quantity("wear", "punch", "Worn depth of the punch", "µm", 1e3, "YlOrBr", "punch:\nworn depth"),
        "wear_strip_map": Quantity(
            "wear_strip", "strip", "Worn depth of the strip", "µm", 1e3, "YlOrBr", "strip:\nworn depth"
        ),
        "temperature_map": Quantity(
            "temperature_punch",
            "punch",
            "Temperature of the punch's contact surface",
            warm,
            1.0,
            "YlOrRd",
            "punch:\ntemperature",
        ),
        "temperature_strip_map": Quantity(
            "temperature_strip",
            "punch",
            "Temperature of the strip's surface below the punch",
            warm,
            1.0,
            "YlOrRd",
            "strip:\ntemperature",
        ),
    }
    for body, end in BODIES.items():
        title = f"Height of the {body}, without the form of its scar"
        found[f"surface{end}_map"] = Quantity(f"surface{end}", body, title, "µm", 1e3, "cividis", f"{body}:\nheight")
    return {name: q for name, q in found.items() if q.variable in history}


def quantities_between(history: xarray.Dataset) -> dict[str, Quantity]:
    """Return the same of what lies between the surfaces."""
    found: dict[str, Quantity] = {}
    for name, words in lies_between(history).items():
        title, _, unit = words.rstrip(")").partition(" (")
        body = "strip" if str(history[name].dims[-1]).endswith("_strip") else "punch"
        factor = 1e3 if name in DEPTHS else 1.0
        title = title[0].upper() + title[1:]
        found[f"{name}_map"] = Quantity(name, body, title, unit, factor, "PuBuGn", title.lower())
    return found


def map_figure(
    history: xarray.Dataset, quantity: Quantity, half_cycles: Sequence[int], look: Style = STANDARD
) -> Figure:
    """Draw a quantity on its surface at each chosen half-cycle.

    All have the same colours, but worn depths, which are shown over the largest one of each half-cycle.
    """
    from matplotlib import colormaps

    surface = surface_of(history, quantity.body)
    values = quantity.factor * history[quantity.variable].sel(half_cycle=list(half_cycles)).values
    relative = quantity.variable.startswith("wear")
    largest = values.max(axis=1)
    if relative:
        values = values / np.where(largest > 0, largest, 1.0)[:, None]
        levels, extend = np.linspace(0, 1, 11), "neither"
    else:
        levels, extend = _levels(history, quantity, values, half_cycles)
    figure, axes = _map_panels(surface, len(half_cycles), look)
    drawn: Any = None
    for number, (n, ax) in enumerate(zip(half_cycles, axes, strict=True)):
        found, most = values[number], float(largest[number])
        how: Any = {"levels": levels, "cmap": colormaps[quantity.colours], "extend": extend}
        drawn = surface.contours(ax, np.clip(found, levels[0], None), **how)
        title = f"{look.of_one if look.axis == 'cycles' else ''} {look.name(history, n)} {look.of_unit}".strip()
        if quantity.variable == "pressure":
            _contact_edge(ax, surface, found)
            if one_way(history):
                title += f" {surface.arrow(int(history.direction.sel(half_cycle=n)))}"
        size = f"≤ {most:,.0f}" if most >= 1000 else f"≤ {most:.3g}"
        if quantity.variable.startswith("surface"):
            size = f"{found.min():.3g} to {most:.3g}"
        name_panel(ax, f"{title}\n{size} {quantity.unit}")
    name = f"{quantity.title[0].lower()}{quantity.title[1:]}"
    label = f"{name} over the largest one" if relative else f"{name} ({quantity.unit})" if quantity.unit else name
    colour_bar(figure, drawn, axes, label, **bar_place(look))
    return figure


def _map_panels(surface: Surface, count: int, look: Style) -> tuple[Figure, list[Axes]]:
    """Return a figure of equal maps with the surface's border on each."""
    from matplotlib.collections import LineCollection

    size = np.ptp(surface.map, axis=0)
    columns = 1 if size[0] > LONG**2 * size[1] else 2 if size[0] > LONG * size[1] else 3
    columns = min(count, columns, 2 if look.width < NARROW else columns)
    rows = -(-count // columns)
    figure, axes = panels_of_maps(rows, columns, size, look)
    shown = list(axes.ravel()[:count])
    for ax in axes.ravel()[count:]:
        ax.set_visible(False)
    for ax in shown:
        ax.add_collection(LineCollection(list(surface.border), colors=GREY, linewidths=0.8))
        for name, (across, up) in surface.labels:
            ax.text(across, up, name, ha="center", va="center", fontsize="small", color=GREY)
        ax.margins(0.03)
        surface.set_ticks(ax)
    for lowest in shown[-columns:]:  # the last row may be shorter
        lowest.set_xlabel(surface.axis_labels[0])
        lowest.tick_params(labelbottom=True)
    for ax in axes[:, 0]:
        ax.set_ylabel(surface.axis_labels[1])
    return figure, shown


def _levels(
    history: xarray.Dataset, quantity: Quantity, values: Array, half_cycles: Sequence[int]
) -> tuple[Array, Any]:
    """Return the steps of the colours, and whether what is above them is cut off."""
    from matplotlib.ticker import MaxNLocator

    low, high = float(values.min()), float(values.max())
    cut = False
    if quantity.variable == "pressure":
        low, top = 0.0, pressure_top(history, half_cycles)
        cut, high = high > top, min(high, top)
    low = 0.0 if 0 < low < high / 2 else low
    levels = MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high if high > low else low + 1.0)
    return np.asarray(levels), "max" if cut else "neither"


def _contact_edge(ax: Any, surface: Surface, pressure: Array) -> None:
    """Draw where contact ends."""
    level = EDGE_OF_CONTACT * float(pressure.max())
    if pressure.min() < level < pressure.max():
        surface.contours(ax, pressure, filled=False, levels=[level], colors="black", linewidths=1.0)


def cuts_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD, *, along: bool) -> Figure:
    """Draw pressure, worn depths and temperatures along or across the sliding through the middle of the wear.

    Contacts with names stand beside each other, each cut through the middle of its own; below each other where the
    figure is narrow.
    """
    drawn = list(quantities(history).values())
    early = early_half_cycles(history, half_cycles)
    # What lies far beyond all later pressures has a panel of its own, so that nothing is cut off.
    late = [n for n in half_cycles if n not in early]
    rows = []
    for quantity in drawn:
        rows += [(quantity, part) for part in ((late, early) if quantity.variable == "pressure" else (half_cycles,))]
    rows = [row for row in rows if row[1]]
    places = cut_places(history)
    columns = len(places) if len(places) <= BESIDE and look.width >= NARROW else 1
    order = [(row, place) for row in rows for place in places]
    if columns == 1:
        order = [(row, place) for place in places for row in rows]
    figure, axes = panels(len(order), 2.3, columns=columns, share_x=False, look=look)
    for number, (ax, ((quantity, shown), place)) in enumerate(zip(axes, order, strict=True)):
        surface, own = surface_of(history, quantity.body), place.nodes[quantity.body]
        for colour, n in shades(half_cycles):
            if n in shown:
                values = quantity.factor * history[quantity.variable].sel(half_cycle=n).values
                cut = surface.cut(values, place.at, along=along, nodes=own)
                ax.plot(*cut, color=colour, label=look.name(history, n))
        if not quantity.variable.startswith("temperature"):
            from_zero(ax)
        ax.margins(x=0.01)
        first, last = number % columns == 0, number % columns == columns - 1
        if first:
            ax.set_ylabel(f"{quantity.short} ({quantity.unit})")
        if last:
            legend_beside(ax, look.of_one)
        if place.name and (columns == 1 or number < columns):
            ax.set_title(place.name, loc="center", fontsize="medium")
        if (quantity, shown) == rows[-1]:
            ax.set_xlabel(_cut_text(history, place.at, along=along))
    return figure


def _cut_text(history: xarray.Dataset, at: Array, *, along: bool) -> str:
    """Return what stands below a cut through a point (2,)."""
    place, other = (float(at[1]), "across") if along else (float(at[0]), "along")
    grain = 1e-4 * float(np.ptp(surface_of(history).sliding, axis=0).max())
    place = round(place / grain) * grain
    return f"place {'along' if along else 'across'} the sliding (mm),\nat {place:.4g} mm {other} it"
