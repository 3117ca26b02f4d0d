"""Figures of the time steps of a run with stick: loops, zones, tractions, slip, stresses; lines, or maps of solids."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fenwear.common.arrays import Array, Mask
from fenwear.report.drawn_surface import Surface, along_contact, gaps_of, model_of, parted, surface_of
from fenwear.report.lines import OF_CYCLES, Track
from fenwear.report.maps import map_panels
from fenwear.report.style import (
    BLUE,
    RED,
    STANDARD,
    Style,
    colour_bar,
    contact_axis,
    legend_beside,
    panels,
    shades,
)
from fenwear.results.stored_history import cycle_at

SHARES = (0.25, 0.5, 0.75, 1.0)  # of a half-cycle: what is drawn of it
THROUGH_MIDDLE = "place along the sliding, through the middle (mm)"
ARROWS = 11  # over the width of the contact, at most
WEAK = 0.05  # of the largest traction: no arrow
OPEN, SLIP, STICK = 0, 1, 2
COLOURS = {SLIP: RED, STICK: BLUE}


def stick_figures(history: xarray.Dataset, look: Style = STANDARD) -> dict[str, Figure]:
    """Return the figures of the time steps, by their names.

    Args:
        history: By cycles, as `fenwear.results.stored_history.by_cycles` gives it.
        look: Width and axis.
    """
    figures = {"loops": loops(history, look), "tractions": tractions(history, look)}
    if model_of(history) == "solid":
        return figures | {"zones": zone_maps(history, look), "traction_map": traction_maps(history, look)}
    return figures | {"zones": zones(history, look)}


def chosen(history: xarray.Dataset, count: int = 5) -> list[int]:
    """Return the places of recorded cycles at even shares of the wear, the first and the last among them."""
    worn = [history[name] for name in ("wear", "wear_strip") if name in history]
    depth = np.sum([depths.max(depths.dims[1:]).values for depths in worn], axis=0)
    course = depth if depth[-1] > depth[0] else np.arange(len(depth), dtype=float)
    return sorted({int(np.abs(course - target).argmin()) for target in np.linspace(course[0], course[-1], count)})


def first_and_last(history: xarray.Dataset) -> list[int]:
    """Return the places of the first and the last recorded cycle."""
    return sorted({0, history.sizes["cycle"] - 1})


def shown_steps(cycle: xarray.Dataset) -> list[int]:
    """Return the time steps of a cycle that end at the quarters of its first half-cycle."""
    half = int((cycle.half_cycle_of_step == 1).sum())
    return [max(round(share * half) - 1, 0) for share in SHARES]


def touched(history: xarray.Dataset) -> Mask:
    """Return which nodes ever touch (n,), all where none does."""
    ever = (history.pressure.values > 0).any(axis=(0, 1))
    return ever if ever.any() else np.ones_like(ever)


def through_middle(history: xarray.Dataset) -> Track:
    """Return the line along the contact; of a solid a cut through the middle of the contact."""
    if model_of(history) != "solid":
        x, label = along_contact(history)
        return Track("", label, lambda values, body: (x, values))
    surface, weight = surface_of(history), history.weight.values * touched(history)
    at = np.array([np.average(history[name].values, weights=weight) for name in ("along", "across")])
    return Track("", THROUGH_MIDDLE, lambda values, body: surface.cut(values, at, along=True))


def _to_contact(ax: Axes, history: xarray.Dataset, label: str) -> None:
    """Label the axis along the contact and leave out what lies far beside it."""
    x = history.along.values if model_of(history) == "solid" else along_contact(history)[0]
    ends, beside = x[touched(history)], 0.2 * float(np.ptp(x[touched(history)])) + 1e-9
    contact_axis(ax, label)
    ax.set_xlim(max(ends.min() - beside, x.min()), min(ends.max() + beside, x.max()))


def loop_of(history: xarray.Dataset, place: int) -> tuple[Array, Array, str, str]:
    """Return the loop of a cycle, closed: displacement and force of its time steps, and the labels of both axes."""
    cycle, turns = cycle_at(history, place), history.displacement.units == "rad"
    closed = np.arange(cycle.sizes["step"] + 1) % cycle.sizes["step"]
    way = (1.0 if turns else 1e3) * cycle.displacement.values[closed]
    moved = "turn of the strip (rad)" if turns else "displacement of the strip (µm)"
    pulled = f"{'torque' if turns else 'tangential force'} ({history.tangential_force.units})"
    return way, cycle.tangential_force.values[closed], moved, pulled


def loops(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return the fretting loops: tangential force over displacement, and over what is more than full stick's."""
    figure, (loop, beyond) = panels(2, 3.0, share_x=False, look=look)
    way, force, moved, pulled = loop_of(history, 0)
    ways, forces = np.diff(way[:-1]), np.diff(force[:-1])
    stiffness = float((forces / np.where(ways == 0, np.inf, ways)).max(initial=0.0)) or np.inf
    for colour, place in shades(chosen(history)):
        x, y, _, _ = loop_of(history, place)
        loop.plot(x, y, color=colour, label=look.at(history, place))
        beyond.plot(x - y / stiffness, y, color=colour)
    loop.set_xlabel(moved)
    of, _, unit = moved.partition(" of the strip ")
    beyond.set_xlabel(f"{of} less that of full stick\nat the same force {unit}")
    for ax in (loop, beyond):
        ax.set_ylabel(pulled)
    legend_beside(loop, look.of_one)
    return figure


def tractions(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return the tangential traction along the sliding between its bounds in the first and the last cycle."""
    places, track = first_and_last(history), through_middle(history)
    figure, axes = panels(len(places), 2.8, look=look)
    mu = float(history.attrs["friction"])
    for ax, place in zip(axes, places, strict=True):
        cycle = cycle_at(history, place)
        for colour, step in shades([*shown_steps(cycle), cycle.sizes["step"] - 1]):
            now = cycle.isel(step=step)
            ax.plot(*track.line(now.traction.values, "punch"), color=colour, label=f"{float(now.fraction):.3g}")
        x, bound = track.line(mu * cycle.pressure.max("step").values, "punch")
        ax.fill_between(x, -bound, bound, color="0.85", linewidth=0, zorder=0, label="µ p")
        ax.set_ylabel(f"{look.in_words(history, place)}:\ntraction (MPa)")
        legend_beside(ax, "part of the cycle")
    _to_contact(axes[-1], history, track.label)
    return figure


def _states(cycle: xarray.Dataset) -> NDArray[np.int64]:
    """Return which nodes stick, slip and are open (..., n)."""
    return np.where(cycle.stick.values == 1, STICK, np.where(cycle.pressure.values > 0, SLIP, OPEN))


def zones(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return where the surfaces stick, slip and are open over the first and the last cycle."""
    places = first_and_last(history)
    figure, axes = panels(len(places), 2.4, look=look)
    for ax, place in zip(axes, places, strict=True):
        cycle = cycle_at(history, place)
        at, states = parted(history.x.values, _states(cycle).astype(float), gaps_of(history))
        steps = np.arange(1, cycle.sizes["step"] + 1)
        colours = ListedColormap(("white", COLOURS[SLIP], COLOURS[STICK]))
        ax.pcolormesh(at, steps, states, cmap=colours, vmin=OPEN, vmax=STICK, shading="nearest", rasterized=True)
        ax.set_ylabel(f"{look.in_words(history, place)}:\ntime step")
        for kind, name in ((STICK, "stick"), (SLIP, "slip")):
            ax.plot([], [], marker="s", linestyle="", color=COLOURS[kind], label=name)
        legend_beside(ax, "")
    _to_contact(axes[-1], history, along_contact(history)[1])
    return figure


def with_sums(history: xarray.Dataset, cycles: xarray.Dataset) -> xarray.Dataset:
    """Return the ends of cycles of a history with slip (mm), friction work (mJ/mm²) and largest stress (MPa) of each.

    Args:
        history: Of half-cycles.
        cycles: The same by cycles.
    """
    pairs = [(cycles[f"traction{end}"], cycles[f"slip{end}"]) for end in ("", "_across") if f"slip{end}" in cycles]
    work: Any = sum(traction * slip for traction, slip in pairs)
    squares: Any = sum(slip**2 for _, slip in pairs)
    slid = (squares**0.5).where(cycles.pressure > 0, 0)
    sums = (slid.sum("step").values, -work.sum("step").values, cycles.surface_stress.max("step").values)
    strokes = round(float(history.half_cycle[-1] / history.cycles[-1]))
    ends = history.sel(half_cycle=strokes * cycles.cycle.values)
    known = {field.variable: (history.pressure.dims, values) for field, values in zip(OF_CYCLES, sums, strict=True)}
    return ends.assign({name: variable for name, variable in known.items() if np.isfinite(variable[1]).all()})


def zone_maps(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return where the surfaces stick and slip at four times of a half-cycle, in the first and the last cycle."""
    surface, (steps, titles) = surface_of(history), _shown(history, look)
    figure, axes = map_panels(surface, titles, look, columns=len(SHARES), within=touched(history))
    polygons, owner = node_cells(surface)
    for ax, now in zip(axes, steps, strict=True):
        ax.set_facecolor("0.93")
        state = _states(now)[owner]
        for kind, colour in COLOURS.items():
            ax.add_collection(PolyCollection(polygons[state == kind], facecolors=colour, edgecolors=colour, lw=0.2))
    names = {"stick": COLOURS[STICK], "slip": COLOURS[SLIP], "open": "0.93"}
    handles = [Patch(color=colour, label=name) for name, colour in names.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    return figure


def traction_maps(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Return size and direction of the tangential traction at the same times."""
    surface, (steps, titles) = surface_of(history), _shown(history, look)
    figure, axes = map_panels(surface, titles, look, columns=len(SHARES), within=touched(history))
    ways = [history[f"sliding_{name}"].values[:, list(surface.seen)] for name in ("along", "across")]
    vectors = [[now[name].values for name in ("traction", "traction_across")] for now in steps]
    top = float(max(np.hypot(*pair).max() for pair in vectors)) or 1.0
    extent = float(np.ptp(surface.map[touched(history)], axis=0).max())
    few, length, drawn = _few(surface, history, extent / ARROWS), 1.6 * extent / ARROWS, None
    for ax, pair in zip(axes, vectors, strict=True):
        triangles, values = surface.drawn(np.hypot(*pair))
        how: dict[str, Any] = {"shading": "gouraud", "cmap": "YlGnBu", "vmin": 0, "vmax": top, "rasterized": True}
        drawn = ax.tripcolor(triangles, values, **how)
        arrows = pair[0][:, None] * ways[0] + pair[1][:, None] * ways[1]
        strong = few[np.linalg.norm(arrows[few], axis=1) > WEAK * top]
        ax.quiver(*surface.map[strong].T, *arrows[strong].T, angles="xy", scale_units="xy", scale=top / length,
                  width=0.009, headwidth=4, headlength=4, minlength=0.5, pivot="mid", color="black")  # fmt: skip
    colour_bar(figure, drawn, axes, "tangential traction on the punch (MPa)", location="bottom", aspect=35)
    return figure


def _shown(history: xarray.Dataset, look: Style) -> tuple[list[xarray.Dataset], list[str]]:
    """Return the time steps of the first and the last cycle of which maps are drawn, and their titles."""
    steps, titles = [], []
    for place in first_and_last(history):
        cycle = cycle_at(history, place)
        for step in shown_steps(cycle):
            steps.append(cycle.isel(step=step))
            titles.append(f"{look.in_words(history, place)}\npart {float(cycle.fraction[step]):.3g}")
    return steps, titles


def node_cells(surface: Surface) -> tuple[Array, NDArray[np.int64]]:
    """Return polygons on the map (p, 4, 2), mm, and the node that each belongs to (p,).

    Each linear facet is cut between the middles of its edges and its own middle: a part for each of its nodes.
    """
    corners = surface.map[surface.cells]
    middle = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    after = (corners + np.roll(corners, -1, axis=1)) / 2
    parts = np.stack([corners, after, middle, np.roll(after, 1, axis=1)], axis=2)
    return parts.reshape(-1, 4, 2), surface.cells.ravel()


def _few(surface: Surface, history: xarray.Dataset, size: float) -> NDArray[np.int64]:
    """Return nodes that stand for equal parts of the contact of a size (k,): the one nearest to the middle of each."""
    nodes = np.flatnonzero(touched(history))
    places = surface.map[nodes] / max(size, 1e-300)
    grid, which = np.unique(np.round(places), axis=0, return_inverse=True)
    away = np.linalg.norm(places - grid[which.ravel()], axis=1)
    order = np.lexsort((away, which.ravel()))
    return nodes[order[np.unique(which.ravel()[order], return_index=True)[1]]]
