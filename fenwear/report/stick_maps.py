"""Pictures of contact with stick in a solid: maps of stick, slip and traction, cuts, and what slips and wears where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.stick_course import cycle_name, first_and_last, title, traction_panels
from fenwear.report.style import BLUE, NARROW, RED, STANDARD, Look, legend_beside, name_panel, panels, shades
from fenwear.report.surface import Surface, surface_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHARES = (0.25, 0.5, 0.75, 1.0)  # of a half-cycle: when maps are drawn
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


def zones(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw where the surfaces stick and slip at four times of a half-cycle, in the first and the last cycle."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    surface, steps = surface_of(history), _steps(history)
    places = first_and_last(history)
    figure, axes = _maps(history, surface, places, steps, look)
    polygons, owner = node_cells(surface)
    for row, place in enumerate(places):
        for ax, step in zip(axes[row], steps, strict=True):
            now = history.isel(cycle=place, step=step)
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


def tractions(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw size and direction of the tangential traction at the same times."""
    surface, steps = surface_of(history), _steps(history)
    places = first_and_last(history)
    figure, axes = _maps(history, surface, places, steps, look)
    chosen = history.isel(cycle=places, step=steps)
    size = np.hypot(chosen.traction, chosen.traction_across).values
    top = float(size.max()) or 1.0
    shown = _few(surface, history)
    along, across = (history[f"sliding_{name}"].values[:, list(surface.seen)] for name in ("along", "across"))
    drawn: Any = None
    for row in range(len(places)):
        for column, ax in enumerate(axes[row]):
            triangles, values = surface.drawn(size[row, column])
            drawn = ax.tripcolor(triangles, values, shading="gouraud", cmap="YlGnBu", vmin=0, vmax=top, rasterized=True)
            now = chosen.isel(cycle=row, step=column)
            arrows = now.traction.values[:, None] * along + now.traction_across.values[:, None] * across
            strong = shown[np.linalg.norm(arrows[shown], axis=1) > WEAK * top]
            length = 1.6 * _extent(surface, history).max() / ARROWS
            ax.quiver(*surface.map[strong].T, *arrows[strong].T, angles="xy", scale_units="xy", scale=top / length,
                      width=0.009, headwidth=4, headlength=4, minlength=0.5, pivot="mid", color="black")  # fmt: skip
    bar = figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.6, aspect=35)
    bar.set_label("tangential traction on the punch (MPa)")
    return figure


def cuts(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the traction along the sliding between its bounds, on a cut along it through the middle of the contact."""
    surface, at = surface_of(history), middle_of_contact(history)
    return traction_panels(
        history,
        [*_steps(history), history.sizes["step"] - 1],
        lambda values: surface.cut(values, at, along=True),
        lambda ax: _to_contact(ax, history),
        look,
    )


def sliding_map(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the slip of each node in a cycle and its work of friction, in the first and the last cycle."""
    surface, places = surface_of(history), first_and_last(history)
    figure, axes = panels_of_maps(history, surface, 2, len(places), look)
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
        figure.colorbar(drawn[-1], ax=list(axes[row]), aspect=15).set_label(text)
    for ax, place in zip(axes[0], places, strict=True):
        name_panel(ax, title(history, place, look))
    return figure


def shapes(history: xarray.Dataset, chosen: Sequence[int], look: Look = STANDARD) -> Figure:
    """Draw worn depths and pressure on a cut along the sliding through the middle, for the chosen records."""
    figure, (depth, pressure) = panels(2, 2.4, look=look)
    punch, strip, at = surface_of(history), surface_of(history, "strip"), middle_of_contact(history)
    for colour, place in shades(chosen):
        cycle = history.isel(cycle=place)
        x, worn = punch.cut(cycle.wear.values, at, along=True)
        depth.plot(x, -1e3 * worn, color=colour, label=cycle_name(history, place, look))
        x, worn = strip.cut(cycle.wear_strip.values, at, along=True)
        depth.plot(x, -1e3 * worn, color=colour, linestyle=":")
        x, p = punch.cut(cycle.pressure.isel(step=-1).values, at, along=True)
        pressure.plot(x, p, color=colour, label=cycle_name(history, place, look))
    depth.set_ylabel("worn depth (µm):\npunch, dotted strip")
    pressure.set_ylabel("pressure at the end\nof the cycle (MPa)")
    legend_beside(depth, look.of_one)
    _to_contact(pressure, history)
    return figure


def scar(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the worn depth of both bodies before the last cycle."""
    bodies = ("punch", "strip")
    surfaces = [surface_of(history, body) for body in bodies]
    figure, axes = panels_of_maps(history, surfaces[0], 1, 2, look)
    for ax, body, surface, name in zip(axes[0], bodies, surfaces, ("wear", "wear_strip"), strict=True):
        values = 1e3 * history[name].isel(cycle=-1).values
        drawn = ax.tripcolor(*surface.drawn(values), shading="gouraud", cmap="YlOrBr", vmin=0,
                             vmax=float(values.max()) or 1.0, rasterized=True)  # fmt: skip
        name_panel(ax, f"{body}, {title(history, -1, look)}")
        figure.colorbar(drawn, ax=ax, location="bottom", shrink=0.8, aspect=25).set_label("worn depth (µm)")
    return figure


def stresses(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the largest stress along the sliding in the strip's surface over the first and the last cycle."""
    surface, places = surface_of(history), first_and_last(history)
    figure, axes = panels_of_maps(history, surface, 1, len(places), look)
    most = history.surface_stress.isel(cycle=places).max("step").values
    size = float(np.abs(most).max()) or 1.0
    for ax, found, place in zip(axes[0], most, places, strict=True):
        drawn = ax.tripcolor(*surface.drawn(found), shading="gouraud", cmap="RdBu_r", vmin=-size, vmax=size,
                             rasterized=True)  # fmt: skip
        name_panel(ax, title(history, place, look))
    bar = figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.6, aspect=35)
    bar.set_label("largest stress along the sliding in the strip's surface (MPa)")
    return figure


def _steps(history: xarray.Dataset) -> list[int]:
    """Return the time steps that end at the shares of the first half-cycle."""
    half = int((history.half_cycle_of_step == 1).sum())
    return [max(round(share * half) - 1, 0) for share in SHARES]


def _touched(history: xarray.Dataset) -> Array:
    touched = (history.pressure.values > 0).any(axis=(0, 1))
    return touched if touched.any() else np.ones_like(touched)


def middle_of_contact(history: xarray.Dataset) -> Array:
    """Return the places along and across the sliding of the middle of what touches (2,), mm."""
    touched = _touched(history)
    return np.array([np.average(history[name].values[touched], weights=history.weight.values[touched])
                     for name in ("along", "across")])  # fmt: skip


def _extent(surface: Surface, history: xarray.Dataset) -> Array:
    return np.ptp(surface.map[_touched(history)], axis=0)


def _few(surface: Surface, history: xarray.Dataset) -> Array:
    """Return nodes that stand for equal parts of the contact (k,): the one nearest to the middle of each."""
    touched = np.flatnonzero(_touched(history))
    size = max(float(_extent(surface, history).max()) / ARROWS, 1e-300)
    places = surface.map[touched] / size
    grid, which = np.unique(np.round(places), axis=0, return_inverse=True)
    away = np.linalg.norm(places - grid[which.ravel()], axis=1)
    order = np.lexsort((away, which.ravel()))
    return touched[order[np.unique(which.ravel()[order], return_index=True)[1]]]


def _maps(
    history: xarray.Dataset, surface: Surface, places: Sequence[int], steps: Sequence[int], look: Look
) -> tuple[Figure, Any]:
    """Return a figure with a row of maps for each cycle, one for each time step."""
    figure, axes = panels_of_maps(history, surface, len(places), len(steps), look)
    for row, place in enumerate(places):
        for ax, step in zip(axes[row], steps, strict=True):
            name_panel(ax, f"{title(history, place, look)}\npart {float(history.fraction[step]):.3g}")
    return figure, axes


def panels_of_maps(
    history: xarray.Dataset, surface: Surface, rows: int, columns: int, look: Look
) -> tuple[Figure, Any]:
    """Return a figure of equal maps of the contact and a little more."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    touched = surface.map[_touched(history)]
    low, high = touched.min(axis=0), touched.max(axis=0)
    room = MARGIN * float((high - low).max()) + 1e-9
    wide, tall = high - low + 2 * room
    height = rows * (min((look.width - 1.0) / columns * tall / wide, 3.5) + 0.5) + 1.4
    with rc_context({"axes.titlesize": "small", "font.size": 9.0 if look.width >= NARROW else 7.0}):
        figure = Figure(figsize=(look.width, height), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.ravel():
        ax.set_facecolor("0.93")
        ax.set_aspect("equal")
        ax.set_xlim(low[0] - room, high[0] + room)
        ax.set_ylim(low[1] - room, high[1] + room)
        ax.xaxis.set_major_locator(MaxNLocator(3))
        ax.yaxis.set_major_locator(MaxNLocator(3))
    for ax in axes[-1]:
        ax.set_xlabel(f"{surface.names[0]} (mm)")
    for ax in axes[:, 0]:
        ax.set_ylabel(f"{surface.names[1]} (mm)")
    return figure, axes


def _to_contact(ax: Axes, history: xarray.Dataset) -> None:
    places = history.along.values[_touched(history)]
    margin = 0.2 * float(np.ptp(places)) + 1e-9
    ax.set_xlim(places.min() - margin, places.max() + margin)
    ax.set_xlabel("place along the sliding (mm), through the middle of the contact")
