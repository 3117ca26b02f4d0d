"""What lies between the surfaces along a contact: debris, plastic depth, coatings, states that laws remember."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import xarray

from fenwear.report.style import STANDARD, Style, contact_axis, from_zero, legend_beside, panels, shades
from fenwear.report.surface import along_contact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEPTHS = {"debris_thickness": "thickness of the debris (µm)", "plastic_depth": "plastic depth (µm)"}
DEPTHS |= {"coating": "coating left on the punch (µm)", "coating_strip": "coating left on the strip (µm)"}
STATE, ON_STRIP = "state_", "_strip"


def lies_between(history: xarray.Dataset) -> dict[str, str]:
    """Return what lies between, by the names of its variables, with the words of its axis."""
    found = {name: words for name, words in DEPTHS.items() if name in history}
    for name in map(str, history.data_vars):
        if name.startswith(STATE):
            unit = history[name].attrs["units"]
            words = name.removeprefix(STATE).replace("_", " ")
            found[name] = words if unit == "1" else f"{words} ({unit})"
    return found


def between_figure(history: xarray.Dataset, half_cycles: Sequence[int], look: Style = STANDARD) -> Figure:
    """Draw what lies between along the contact at the chosen half-cycles."""
    shown = lies_between(history)
    figure, axes = panels(len(shown), 2.4, look=look)
    for ax, (name, words) in zip(axes, shown.items(), strict=True):
        place, label = along_contact(history, "strip" if str(history[name].dims[-1]).endswith(ON_STRIP) else "punch")
        for colour, n in shades(half_cycles):
            values = history[name].sel(half_cycle=n) * (1e3 if name in DEPTHS else 1.0)
            ax.plot(place, values, color=colour, label=look.name(history, n), gid=str(n))
        ax.set_ylabel(words)
        if float(history[name].min()) >= 0:
            from_zero(ax)
        legend_beside(ax, look.of_one)
        contact_axis(ax, label if ax is axes[-1] else "")
    return figure
