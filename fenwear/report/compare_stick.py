"""Several runs with stick in one figure: loops, shapes and pressures of their last cycles, work and heat over all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.report.stick_maps import middle_of_contact
from fenwear.report.style import ALONG_CONTACT, legend_beside, panels, run_style
from fenwear.report.surface import model_of, surface_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawn = tuple[str, str, str, Array, Array]  # title, labels of the axes, and the line
COURSES = {
    "dissipated_energy": ("Work of friction in a cycle", "work (mJ)"),
    "max_temperature": ("Largest temperature in a cycle", "temperature (K)"),
}


def has_stick(history: xarray.Dataset) -> bool:
    """Return whether a history is that of a run with stick: its records are cycles."""
    return "cycle" in history.sizes and "step" in history.sizes


def stick_comparison(names: Sequence[str], histories: Sequence[xarray.Dataset]) -> Figure:
    """Draw the last cycle of each run, and what its cycles come to.

    Shapes are drawn along the contact, of solids on a cut along the sliding through its middle; of runs whose models
    differ they are left out.
    """
    alike = len({model_of(history) for history in histories}) == 1
    lines = [list(_lines(history, shapes=alike)) for history in histories]
    titles = list(dict.fromkeys(line[0] for run in lines for line in run))
    figure, axes = panels(len(titles), 2.5, share_x=False)
    for number, (name, run) in enumerate(zip(names, lines, strict=True)):
        # Thinner from run to run: where two agree, both are seen.
        style: dict[str, Any] = {**run_style(number), "linewidth": max(1.2, 3.0 - 0.7 * number)}
        for title, across, up, x, y in run:
            ax = axes[titles.index(title)]
            ax.plot(x, y, label=name, **style)
            ax.set_title(title, loc="left")
            ax.set_xlabel(across)
            ax.set_ylabel(up)
    for ax in axes:
        legend_beside(ax, "run")
    return figure


def _lines(history: xarray.Dataset, *, shapes: bool) -> Iterator[Drawn]:
    """Yield what there is to draw of a run."""
    last = history.isel(cycle=-1)
    closed = np.arange(history.sizes["step"] + 1) % history.sizes["step"]
    turns = history.displacement.units == "rad"
    moved = "turn of the strip (rad)" if turns else "displacement of the strip (µm)"
    pulled = f"{'torque' if turns else 'tangential force'} ({history.tangential_force.units})"
    way = (1.0 if turns else 1e3) * last.displacement.values[closed]
    yield "Loop of the last cycle", moved, pulled, way, last.tangential_force.values[closed]
    if shapes:
        solid = model_of(history) == "solid"
        place = "place along the sliding (mm), through the middle" if solid else ALONG_CONTACT
        for title, up, values in (
            ("Worn depth of the punch before the last cycle", "depth (µm)", 1e3 * last.wear.values),
            ("Pressure at the end", "pressure (MPa)", last.pressure.isel(step=-1).values),
        ):
            x, y = history.x.values, values
            if solid:
                x, y = surface_of(history).cut(values, middle_of_contact(history), along=True)
            yield title, place, up, x, y
    for name, (title, up) in COURSES.items():
        if name in history:
            yield title, "cycle", up, history.cycle.values, history[name].values
