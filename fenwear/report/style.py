"""How every figure looks: panels, colours and names that hold in print and for the colour-blind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import Dataset

WIDTH = 7.0  # inches
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#595959"
# Okabe and Ito's colours, without the yellow that fades in print; the dashes tell them apart in black and white.
COLOURS = (BLUE, RED, GREEN, "#CC79A7", "#56B4E9", "#000000", "#E69F00")
DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
DIRECTIONS = {1: ("rightward", "-", BLUE), -1: ("leftward", "--", RED)}
FORWARD = {1: "forward", -1: "backward"}  # of solids and rings: along or around
ALONG_CONTACT = "position along the contact x (mm)"


def direction_style(history: Dataset, direction: int) -> tuple[str, str, str]:
    """Return name, dashes and colour of a sliding direction in a run."""
    name, dashes, colour = DIRECTIONS[direction]
    return (name if history.attrs.get("model", "plane") == "plane" else FORWARD[direction]), dashes, colour


def panels(count: int, height: float, *, share_x: bool = True, share_y: bool = False) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels below each other, each as high as given, inches."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium"}):
        figure = Figure(figsize=(WIDTH, height * count), layout="constrained")
        axes = figure.subplots(count, 1, sharex=share_x, sharey=share_y, squeeze=False)
        return figure, list(axes[:, 0])


def shades(values: Sequence[int]) -> list[tuple[Any, int]]:
    """Return a colour for each value, dark to light, even in grey."""
    from matplotlib import colormaps

    lightness = np.linspace(0.0, 0.85, max(len(values), 2))
    return [(colormaps["viridis"](shade), n) for shade, n in zip(lightness, values, strict=False)]


def run_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of one of several lines to be told apart."""
    return {"color": COLOURS[number % len(COLOURS)], "linestyle": DASHES[number % len(DASHES)]}


def legend_beside(ax: Axes, title: str) -> None:
    """Name the lines to the right of a panel, where none of them runs."""
    ax.legend(title=title, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def reference_line(ax: Axes, height: float, name: str, at: float = 0.0) -> None:
    """Draw a dotted level with its name above it, from a fraction of its width on."""
    ax.axhline(height, color="0.5", linewidth=0.8, linestyle=":", label="_reference")
    ax.annotate(name, (at, height), xycoords=("axes fraction", "data"), xytext=(4, 2), textcoords="offset points",
                color=GREY, fontsize="small")  # fmt: skip


def contact_axis(ax: Axes) -> None:
    """Label the axis along the contact."""
    ax.set_xlabel(ALONG_CONTACT)
    for shared in ax.get_shared_x_axes().get_siblings(ax):
        shared.margins(x=0.01)


def save_gif(images: Sequence[Any], path: Path, milliseconds: int = 150) -> None:
    """Write pictures as an endless GIF that rests on the last one."""
    durations = [milliseconds] * (len(images) - 1) + [2000]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=False)
