"""The temperature along both bodies' boundaries, from the fields of a half-cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray
from numpy.typing import NDArray

from fenwear.report.course import shown_unit
from fenwear.report.style import BLUE, GREY, RED, STANDARD, Style, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def outline(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the points round the body, in order, from the edges that belong to one cell only.

    Args:
        cells: Corners of the cells (count, 4), around each.
    """
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    single, counts = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    neighbours: dict[int, list[int]] = {}
    for a, b in single[counts == 1].tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    path = [next(iter(neighbours))]
    before = -1
    while True:
        following = next(p for p in neighbours[path[-1]] if p != before)
        if following == path[0]:
            return np.array(path)
        before = path[-1]
        path.append(following)


def boundary_figure(fields: xarray.Dataset, look: Style = STANDARD) -> Figure:
    """Draw the temperature round the punch from the middle of its contact on, and along the strip's upper surface."""
    figure, (around, along) = panels(2, 3.2, share_x=False, look=look)
    points = outline(fields.punch_cells.values)
    x, z = fields.punch_x.values[points], fields.punch_z.values[points]
    middle = int(np.argmin(np.abs(x - (x.max() + x.min()) / 2) + 1e3 * (z - z.min())))
    points, x, z = (np.roll(a, -middle) for a in (points, x, z))
    if x[1] < x[0]:  # go round with the right edge first
        points, x, z = (np.roll(a[::-1], 1) for a in (points, x, z))
    closed = [np.append(a, a[0]) for a in (x, z, fields.punch_temperature.values[points])]
    steps = np.hypot(np.diff(closed[0]), np.diff(closed[1]))
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    around.plot(distance, closed[2], color=RED)
    turns = np.column_stack([np.diff(closed[0]), np.diff(closed[1])]) / steps[:, None]
    corners = 1 + np.flatnonzero(np.einsum("ij,ij->i", turns[:-1], turns[1:]) < 0.7)
    for corner in corners:
        around.axvline(distance[corner], color="0.5", linewidth=0.8, linestyle=":")
        name = f"({closed[0][corner]:g}, {closed[1][corner]:g})"
        around.annotate(name, (distance[corner], 1), xycoords=("data", "axes fraction"), xytext=(2, -2), va="top",
                        textcoords="offset points", color=GREY, fontsize="small", rotation=90)  # fmt: skip
    around.set_xlabel("distance along the boundary from the middle\nof the contact, to the right and round (mm)")
    x, z = fields.strip_x.values, fields.strip_z.values
    top = np.flatnonzero(z > z.max() - 1e-6 * np.ptp(z))
    top = top[np.argsort(x[top])]
    along.plot(x[top], fields.strip_temperature.values[top], color=BLUE)
    along.axvspan(closed[0].min(), closed[0].max(), color="0.92", zorder=0)
    along.set_xlabel("x (mm)")
    for ax in (around, along):
        ax.set_ylabel(f"temperature ({shown_unit(str(fields.punch_temperature.attrs.get('units', 'K')))})")
    return figure
