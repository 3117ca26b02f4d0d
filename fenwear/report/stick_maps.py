"""Pictures of contact with stick in a solid: maps of stick, slip and traction, cuts, and what slips and wears where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.stick_course import first_and_last, shown_steps, title, touched
from fenwear.report.style import BLUE, RED, STANDARD, Style, colour_bar, name_panel, panels_of_maps
from fenwear.report.surface import Surface, surface_of
from fenwear.results.cycles import cycle_at

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARGIN = 0.15  # of the contact's extent: what a map shows beside it
ARROWS = 11  # over the width of the contact, at most
WEAK = 0.05  # of the largest traction: no arrow
OPEN, SLIP, STICK = 0, 1, 2
COLOURS = {SLIP: RED, STICK: BLUE}


def node_cells(surface: Surface) -> tuple[Array, NDArray[np.int64]]:
    """Return polygons on the map (p, 4, 2), mm, and the node that each belongs to (p,).

    Each linear facet is cut between the middles of its edges and its own middle: a part for each of its nodes.
    """
    corners = surface.map[surface.cells]
    middle = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    after = (corners + np.roll(corners, -1, axis=1)) / 2
    parts = np.stack([corners, after, middle, np.roll(after, 1, axis=1)], axis=2)
    return parts.reshape(-1, 4, 2), surface.cells.ravel()


def zones(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw where the surfaces stick and slip at four times of a half-cycle, in the first and the last cycle."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    surface, chosen = surface_of(history), _shown(history)
    figure, axes = _maps(history, surface, chosen, look)
    polygons, owner = node_cells(surface)
    for row, cycle in enumerate(chosen):
        for column, ax in enumerate(axes[row]):
            now = cycle.isel(step=column)
            state = np.where(now.stick.values == 1, STICK, np.where(now.pressure.values > 0, SLIP, OPEN))[owner]
            for kind, colour in COLOURS.items():
                ax.add_collection(PolyCollection(polygons[state == kind], facecolors=colour, edgecolors=colour, lw=0.2))
    figure.legend(
        handles=[Patch(color=BLUE, label="stick"), Patch(color=RED, label="slip"), Patch(color="0.93", label="open")],
        loc="outside lower center",
        ncols=3,
        frameon=False,
    )
    return figure


def tractions(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw size and direction of the tangential traction at the same times."""
    surface, chosen = surface_of(history), _shown(history)
    figure, axes = _maps(history, surface, chosen, look)
    size = np.array([np.hypot(cycle.traction, cycle.traction_across).values for cycle in chosen])
    top = float(size.max()) or 1.0
    shown = _few(surface, history)
    along, across = (history[f"sliding_{name}"].values[:, list(surface.seen)] for name in ("along", "across"))
    drawn: Any = None
    for row, cycle in enumerate(chosen):
        for column, ax in enumerate(axes[row]):
            triangles, values = surface.drawn(size[row, column])
            drawn = ax.tripcolor(triangles, values, shading="gouraud", cmap="YlGnBu", vmin=0, vmax=top, rasterized=True)
            now = cycle.isel(step=column)
            arrows = now.traction.values[:, None] * along + now.traction_across.values[:, None] * across
            strong = shown[np.linalg.norm(arrows[shown], axis=1) > WEAK * top]
            length = 1.6 * _extent(surface, history).max() / ARROWS
            ax.quiver(*surface.map[strong].T, *arrows[strong].T, angles="xy", scale_units="xy", scale=top / length,
                      width=0.009, headwidth=4, headlength=4, minlength=0.5, pivot="mid", color="black")  # fmt: skip
    colour_bar(figure, drawn, axes, "tangential traction on the punch (MPa)", location="bottom", aspect=35)
    return figure


def sliding_map(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the slip of each node in a cycle and its work of friction, in the first and the last cycle."""
    surface, places = surface_of(history), first_and_last(history)
    figure, axes = _contact_maps(history, surface, 2, len(places), look)
    cycles = history.isel(cycle=places)
    slid = np.hypot(cycles.slip, cycles.slip_across).where(cycles.pressure > 0, 0)
    work = -(cycles.traction * cycles.slip + cycles.traction_across * cycles.slip_across)
    kinds = (("slip in a cycle (µm)", "YlGnBu", slid), ("work of friction in a cycle (µJ/mm²)", "YlOrRd", work))
    for row, (text, colours, values) in enumerate(kinds):
        shown = 1e3 * values.sum("step").values
        drawn = [
            ax.tripcolor(*surface.drawn(found), shading="gouraud", cmap=colours, vmin=0,
                         vmax=float(shown.max()) or 1.0, rasterized=True)
            for ax, found in zip(axes[row], shown, strict=True)
        ]  # fmt: skip
        colour_bar(figure, drawn[-1], list(axes[row]), text, aspect=15)
    for ax, place in zip(axes[0], places, strict=True):
        name_panel(ax, title(history, place, look))
    return figure


def stresses(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the largest stress along the sliding in the strip's surface over the first and the last cycle."""
    surface, places = surface_of(history), first_and_last(history)
    figure, axes = _contact_maps(history, surface, 1, len(places), look)
    most = history.surface_stress.isel(cycle=places).max("step").values
    size = float(np.abs(most).max()) or 1.0
    for ax, found, place in zip(axes[0], most, places, strict=True):
        drawn = ax.tripcolor(*surface.drawn(found), shading="gouraud", cmap="RdBu_r", vmin=-size, vmax=size,
                             rasterized=True)  # fmt: skip
        name_panel(ax, title(history, place, look))
    label = "largest stress along the sliding in the strip's surface (MPa)"
    colour_bar(figure, drawn, axes, label, location="bottom", aspect=35)
    return figure


def _extent(surface: Surface, history: xarray.Dataset) -> Array:
    return np.ptp(surface.map[touched(history)], axis=0)


def _few(surface: Surface, history: xarray.Dataset) -> Array:
    """Return nodes that stand for equal parts of the contact (k,): the one nearest to the middle of each."""
    nodes = np.flatnonzero(touched(history))
    size = max(float(_extent(surface, history).max()) / ARROWS, 1e-300)
    places = surface.map[nodes] / size
    grid, which = np.unique(np.round(places), axis=0, return_inverse=True)
    away = np.linalg.norm(places - grid[which.ravel()], axis=1)
    order = np.lexsort((away, which.ravel()))
    return nodes[order[np.unique(which.ravel()[order], return_index=True)[1]]]


def _shown(history: xarray.Dataset) -> list[xarray.Dataset]:
    """Return the time steps of the first and the last cycle of which maps are drawn."""
    cycles = [cycle_at(history, place) for place in first_and_last(history)]
    return [cycle.isel(step=shown_steps(cycle)) for cycle in cycles]


def _maps(
    history: xarray.Dataset, surface: Surface, chosen: Sequence[xarray.Dataset], look: Style
) -> tuple[Figure, Any]:
    """Return a figure with a row of maps for each of both cycles, one for each time step."""
    figure, axes = _contact_maps(history, surface, len(chosen), chosen[0].sizes["step"], look)
    for row, (place, cycle) in enumerate(zip(first_and_last(history), chosen, strict=True)):
        for ax, fraction in zip(axes[row], cycle.fraction.values, strict=True):
            name_panel(ax, f"{title(history, place, look)}\npart {fraction:.3g}")
    return figure, axes


def _contact_maps(
    history: xarray.Dataset, surface: Surface, rows: int, columns: int, look: Style
) -> tuple[Figure, Any]:
    """Return a figure of equal maps of the contact and a little more."""
    seen = surface.map[touched(history)]
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = MARGIN * float((high - low).max()) + 1e-9
    figure, axes = panels_of_maps(rows, columns, high - low + 2 * room, look)
    for ax in axes.ravel():
        ax.set_facecolor("0.93")
        ax.set_xlim(low[0] - room, high[0] + room)
        ax.set_ylim(low[1] - room, high[1] + room)
    for ax in axes[-1]:
        surface.set_ticks(ax)
        ax.set_xlabel(surface.axis_labels[0])
    for ax in axes[:, 0]:
        ax.set_ylabel(surface.axis_labels[1])
    return figure, axes
