"""Figures of the worn surfaces: profiles of both bodies, initial and worn, and wear over place and time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.report.gaps import gaps_of, parted
from fenwear.report.style import (
    STANDARD,
    Style,
    colour_bar,
    contact_axis,
    from_zero,
    legend_beside,
    panels,
    shades,
)
from fenwear.report.surface import along_contact
from fenwear.results.sheet import BODIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MAP_ROWS = 600  # of a map over the run: as many as its picture has
DRAWN = 0.2  # of a round contact's size: its largest depth as it is drawn


def surfaces_of(history: xarray.Dataset) -> dict[str, tuple[Any, Any, Any]]:
    """Return abscissae, worn depths and unworn heights (mm) of the surfaces that wear, by the body."""
    found = {}
    for body, end in BODIES.items():
        if f"wear{end}" in history:
            x = along_contact(history, body)[0]
            height = history[f"height{end}"].values if f"height{end}" in history else np.zeros_like(x)
            found[body] = (x, history[f"wear{end}"], height)
    return found


def profile_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw the surfaces as a profilometer sees them, the height over x: unworn, and worn at the chosen half-cycles.

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
    left, right = worn_range(history)
    axes[-1].set_xlim(left, right)
    contact_axis(axes[-1])
    return figure


def _outline_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style) -> Figure:
    """Draw round contacts as a tester of roundness sees them: their outlines, depths magnified."""
    worn = [end for body, end in BODIES.items() if f"wear{end}" in history and f"place{end}" in history]
    figure, axes = panels(len(worn), 5.0, look=look)
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
        ax.set_ylabel(f"z (mm), depths {magnified:,.3g} times as large")
        legend_beside(ax, look.of_one)
    axes[-1].set_xlabel("x (mm)")
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


def shape_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw what is worn off the bodies at the chosen half-cycles; the strip's depth downwards."""
    surfaces = _that_wear(history)
    figure, axes = panels(len(surfaces), 3.0, look=look)
    for ax, (body, (x, depth, _)) in zip(axes, surfaces.items(), strict=True):
        for colour, n in shades(half_cycles):
            values = 1e3 * depth.sel(half_cycle=n).values
            ax.plot(x, values, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(f"worn depth of the {body} (µm)")
        from_zero(ax)
        if body == "strip":
            ax.invert_yaxis()
        legend_beside(ax, look.of_one)
    axes[-1].set_xlim(*worn_range(history))
    contact_axis(axes[-1], along_contact(history)[1])
    return figure


def wear_map_figure(history: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the worn depth over place and run, a panel for each body that wears."""
    surfaces = _that_wear(history)
    figure, axes = panels(len(surfaces), 3.0, look=look)
    course = look.course(history)
    for ax, (body, (x, depth, _)) in zip(axes, surfaces.items(), strict=True):
        shown = _told_apart(course)
        rows, values = np.append(0.0, course[shown]), np.vstack([np.zeros(len(x)), 1e3 * depth.values[shown]])
        at, values = parted(x, values, gaps_of(history))
        drawn = ax.pcolormesh(at, rows, values, shading="gouraud", cmap="Blues", vmin=0, rasterized=True)
        colour_bar(figure, drawn, ax, f"worn depth of\nthe {body} (µm)")
        ax.set_ylabel(look.label)
    left, right = worn_range(history)
    axes[-1].set_xlim(left, right)
    contact_axis(axes[-1])
    return figure


def _that_wear(history: xarray.Dataset) -> dict[str, tuple[Any, Any, Any]]:
    """Return the surfaces that something is worn off; all where nothing is."""
    surfaces = surfaces_of(history)
    return {body: one for body, one in surfaces.items() if float(one[1].max()) > 0} or surfaces


def _told_apart(course: Array) -> NDArray[np.int64]:
    """Return the rows of a run that a map can tell apart, the first and the last among them."""
    wanted = np.linspace(course[0], course[-1], MAP_ROWS)
    return np.unique(np.searchsorted(course, wanted).clip(max=len(course) - 1))
