"""How every figure looks: panels, colours and names that hold in print and for the colour-blind."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.case.names import Names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.0  # inches
NARROW = 5.0  # inches: below it letters are smaller
ROW = 60  # letters that a row of names takes where the figure is narrow
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#595959"
# After Okabe and Ito, without what fades on white paper; the dashes tell them apart in black and white.
COLOURS = (BLUE, RED, GREEN, "#AA4499", "#000000", "#8C6D00", "#117A8B")
DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
DIRECTIONS = {1: ("rightward", "-", BLUE), -1: ("leftward", "--", RED)}  # of plane models whose strip does not turn
BODY_COLOURS = {"punch": BLUE, "strip": RED}
LIGHTEST = 0.72  # of viridis: what is lighter fades on white
ALONG_CONTACT = "position along the contact x (mm)"
AXES = {"cycles": ("cycles", "cycle"), "distance": ("sliding distance (m)", "sliding distance (m)"),
        "time": ("time (s)", "time (s)")}  # fmt: skip


@dataclass(frozen=True)
class Look:
    """What a user chooses of the figures.

    Attributes:
        width: Of a figure, inches.
        axis: What a run is told by: "cycles", "distance" or "time".
    """

    width: float = WIDTH
    axis: str = "cycles"

    def course(self, history: xarray.Dataset) -> Array:
        """Return where each recorded half-cycle ends on the axis (k,)."""
        if self.axis == "time":
            return history.time.values
        if self.axis == "distance" and "sliding_distance" in history:
            return 1e-3 * history.sliding_distance.values
        if "cycles" in history:
            return history.cycles.values
        return history.half_cycle.values / len(np.unique(history.direction.values))

    @property
    def label(self) -> str:
        """What stands below the axis."""
        return AXES[self.axis][0]

    @property
    def of_one(self) -> str:
        """What a single value of it is called."""
        return AXES[self.axis][1]

    @property
    def of_unit(self) -> str:
        """Unit of a single value of it."""
        return {"cycles": "", "distance": "m", "time": "s"}[self.axis]

    def name(self, history: xarray.Dataset, half_cycle: int) -> str:
        """Return a half-cycle in words of the axis, such as its cycle."""
        row = int(np.flatnonzero(history.half_cycle.values == half_cycle)[0])
        value = float(self.course(history)[row])
        return f"{value:,.0f}" if value >= 1000 else f"{value:.4g}"


STANDARD = Look()


def direction_style(history: xarray.Dataset, direction: int) -> tuple[str, str, str]:
    """Return name, dashes and colour of a sliding direction in a run."""
    _, dashes, colour = DIRECTIONS[direction]
    return direction_words(history)[direction], dashes, colour


def direction_words(data: xarray.Dataset) -> dict[int, str]:
    """Return the words for the two directions of the sliding, of a history or of fields."""
    usual = "rightward leftward" if data.attrs.get("model", "plane") == "plane" else "forward backward"
    first, second = str(data.attrs.get("directions", usual)).split()
    return {1: first, -1: second}


def strip_moves(data: xarray.Dataset) -> str:
    """Return what the strip does, of a history or of fields: it moves, or it turns."""
    return "strip turns" if "clockwise" in direction_words(data).values() else "strip moves"


def panels(
    count: int, height: float, *, share_x: bool = True, share_y: bool = False, look: Look = STANDARD
) -> tuple[Figure, list[Axes]]:
    """Return a figure of lettered panels below each other, each as high as given for the full width, inches."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    size = 10.0 if look.width >= NARROW else 8.0
    settings = {"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium", "font.size": size}
    with rc_context({**settings, "pdf.fonttype": 42, "svg.fonttype": "none"}):
        scale = min(1.0, 0.35 + 0.65 * look.width / WIDTH)
        figure = Figure(figsize=(look.width, scale * height * count), layout="constrained")
        axes = list(figure.subplots(count, 1, sharex=share_x, sharey=share_y, squeeze=False)[:, 0])
        if count > 1:
            for ax, letter in zip(axes, "abcdefgh", strict=False):
                ax.set_title(f"({letter})", loc="left")
        return figure, axes


def shades(values: Sequence[int]) -> list[tuple[Any, int]]:
    """Return a colour for each value, dark to light, even in grey."""
    from matplotlib import colormaps

    lightness = np.linspace(0.0, LIGHTEST, max(len(values), 2))
    return [(colormaps["viridis"](shade), n) for shade, n in zip(lightness, values, strict=False)]


def run_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of one of several lines to be told apart."""
    return {"color": COLOURS[number % len(COLOURS)], "linestyle": DASHES[number % len(DASHES)]}


def legend_beside(ax: Axes, title: str) -> None:
    """Name the lines beside a panel, or below it where it is narrow: none of them runs there."""
    figure: Any = ax.figure
    if figure.get_size_inches()[0] >= NARROW:
        ax.legend(title=title or None, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    else:
        longest = max((len(str(text)) for text in ax.get_legend_handles_labels()[1]), default=1)
        columns = min(3, max(1, ROW // (longest + 8)))  # a sample of the line takes the width of some letters, too
        ax.legend(title=title or None, loc="lower center", bbox_to_anchor=(0.5, 1.02), frameon=False, ncols=columns,
                  fontsize="small", title_fontsize="small", handlelength=1.5, columnspacing=1.0)  # fmt: skip


def name_panel(ax: Axes, text: str) -> None:
    """Write what a panel shows above its left end, in letters that fit the figure's width."""
    figure: Any = ax.figure
    ax.set_title(text, loc="left", fontsize=8.5 if figure.get_size_inches()[0] >= NARROW else 6.5)


def level_line(ax: Axes, height: float, name: str) -> None:
    """Draw a dotted level that the legend names."""
    ax.axhline(height, color=GREY, linewidth=1.0, linestyle=":", label=name)


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


def name_bodies(figures: Iterable[Figure], names: Names) -> None:
    """Let all that is written in figures have the names of the bodies."""
    from matplotlib.text import Text

    if names.given:
        for text in (text for figure in figures for text in figure.findobj(Text)):
            text.set_text(names.told(text.get_text()))


def further(figure: Figure, png: Path, formats: Sequence[str]) -> list[Path]:
    """Write a figure beside its PNG in further formats; return the files."""
    found = [png.with_suffix(f".{ending}") for ending in dict.fromkeys(formats) if ending != "png"]
    for path in found:
        figure.savefig(path, dpi=300)
    return found


def save_gif(images: Sequence[Any], path: Path, milliseconds: int = 150) -> None:
    """Write pictures as an endless GIF that rests on the last one."""
    durations = [milliseconds] * (len(images) - 1) + [2000]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=False)
