"""The look of every figure: panels, colours and names that hold in print and for the colour-blind."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
import xarray
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

from fenwear.case.body_names import Names
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.units import convert

FORMATS = ("png", "pdf", "svg")
LEAST, MOST = 50.0, 500.0  # mm
INCH = 25.4  # mm
WIDTH = 7.0  # inches
NARROW = 5.0  # inches: below it letters are smaller
HIGH_WIDE, HIGH_NARROW = 0.75, 0.5  # of the height of a panel that its axes have
UNIT = re.compile(r"\((?:[^()]|\([^()]*\))*\)")  # stays in one line
LETTER = 0.55  # width over height
SHORTEST = 14  # letters of a line of a label
ABOVE = 0.5  # inches: the names above the panels of a narrow figure
HIGHEST = 9.0  # inches: a page
ROW = 50  # letters that a row of names takes where the figure is narrow
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#595959"
# After Okabe and Ito, without what fades on white paper; the dashes tell them apart in black and white.
COLOURS = (BLUE, RED, GREEN, "#AA4499", "#000000", "#8C6D00", "#117A8B")
DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
DIRECTIONS = {1: ("rightward", "-", BLUE), -1: ("leftward", "--", RED)}  # of plane models whose strip does not turn
BODY_COLOURS = {"punch": BLUE, "strip": RED}
LIGHTEST = 0.76  # of plasma, whose hues differ from its dark end on: what is lighter fades on white
ALONG_CONTACT = "position along the contact x (mm)"
AXES = {"cycles": ("cycles", "cycle"), "distance": ("sliding distance (m)", "sliding distance (m)"),
        "time": ("time (s)", "time (s)")}  # fmt: skip


@dataclass(frozen=True)
class Style:
    """A user's choices for the figures.

    Attributes:
        width: Of a figure, inches.
        axis: Values that identify a run: "cycles", "distance" or "time".
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
        """Label of the axis."""
        return AXES[self.axis][0]

    @property
    def of_one(self) -> str:
        """Name of a single value."""
        return AXES[self.axis][1]

    @property
    def of_unit(self) -> str:
        """Unit of a single value of it."""
        return {"cycles": "", "distance": "m", "time": "s"}[self.axis]

    def at(self, history: xarray.Dataset, row: int) -> str:
        """Return where a record ends on the axis as text, such as its cycle."""
        value = float(self.course(history)[row])
        return f"{value:,.0f}" if value >= 1000 else f"{value:.4g}"

    def name(self, history: xarray.Dataset, half_cycle: int) -> str:
        """Return where a half-cycle ends on the axis as text."""
        return self.at(history, row_of(history, half_cycle))

    def in_words(self, history: xarray.Dataset, row: int) -> str:
        """Return a record as the title of a panel: cycle 20, or 3 m."""
        return f"{self.at(history, row)} {self.of_unit}" if self.of_unit else f"cycle {self.at(history, row)}"


STANDARD = Style()


def row_of(history: xarray.Dataset, half_cycle: int) -> int:
    """Return the row of a recorded half-cycle."""
    return int(np.flatnonzero(history.half_cycle.values == half_cycle)[0])


def chosen_formats(text: str) -> tuple[str, ...]:
    """Return the formats of figures that are named with commas between.

    Raises:
        CaseError: one is not known.
    """
    names = [name.strip().lower().removeprefix(".") for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in FORMATS]
    if unknown or not names:
        raise CaseError(InputError("--format", f"expected some of {', '.join(FORMATS)} with commas, got {text!r}"))
    return tuple(dict.fromkeys(names))


def chosen_look(width: str, axis: str) -> Style:
    """Return the look of figures of a width, such as "85 mm", over cycles, distance or time.

    Raises:
        CaseError: the width is no length or not between 50 and 500 mm, or the axis is not known.
    """
    try:
        size = convert(width, "mm")
    except ValueError as error:
        raise CaseError(InputError("--width", str(error))) from None
    if not LEAST <= size <= MOST:
        raise CaseError(InputError("--width", f"expected {LEAST:g} to {MOST:g} mm, got {width!r}"))
    if axis not in AXES:
        raise CaseError(InputError("--axis", f"expected one of {', '.join(AXES)}, got {axis!r}"))
    return Style(size / INCH, axis)


def direction_style(history: xarray.Dataset, direction: int) -> tuple[str, str, str]:
    """Return name, dashes and colour of a sliding direction in a run."""
    _, dashes, colour = DIRECTIONS[direction]
    return direction_words(history)[direction], dashes, colour


def direction_words(data: xarray.Dataset) -> dict[int, str]:
    """Return the words for the two directions of the sliding, of a history or of fields."""
    usual = "rightward leftward" if data.attrs.get("model", "plane") == "plane" else "forward backward"
    first, second = str(data.attrs.get("directions", usual)).split()
    return {1: first, -1: second}


def one_way(data: xarray.Dataset) -> bool:
    """Return whether the strip moves one way at a time, not in all directions of a cycle that is a table."""
    return "cyclically" not in direction_words(data).values()


def strip_moves(data: xarray.Dataset) -> str:
    """Return "strip moves" or "strip turns", of a history or of fields."""
    return "strip turns" if "clockwise" in direction_words(data).values() else "strip moves"


def panels(
    count: int, height: float, *, columns: int = 1, share_x: bool = True, look: Style = STANDARD
) -> tuple[Figure, list[Axes]]:
    """Return a figure of lettered panels below each other, each as high as given for the full width, inches.

    In several columns they follow each other row by row, and those of a row share the upward axis.
    """
    size = 10.0 if look.width >= NARROW else 8.0
    settings = {"axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": "medium", "font.size": size}
    with rc_context({**settings, "pdf.fonttype": 42, "svg.fonttype": "none"}):
        scale = min(1.0, 0.35 + 0.65 * look.width / WIDTH)
        above = ABOVE if look.width < NARROW else 0.0
        rows = -(-count // columns)
        figure = Figure(figsize=(look.width, scale * height * rows + above), layout="constrained")
        shared: Any = "row" if columns > 1 else False
        axes = list(figure.subplots(rows, columns, sharex=share_x, sharey=shared, squeeze=False).ravel())
        if count > 1:
            for ax, letter in zip(axes, ascii_lowercase, strict=False):
                ax.set_title(f"({letter})", loc="left")
        return figure, axes


def shades(values: Sequence[int]) -> list[tuple[Any, int]]:
    """Return a colour for each value, dark to light, even in grey."""
    lightness = np.linspace(0.0, LIGHTEST, max(len(values), 2))
    return [(colormaps["plasma"](shade), n) for shade, n in zip(lightness, values, strict=False)]


def run_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of one of several lines that must differ."""
    return {"color": COLOURS[number % len(COLOURS)], "linestyle": DASHES[number % len(DASHES)]}


def legend_beside(ax: Axes, title: str) -> None:
    """Name the lines beside a panel, or above it where it is narrow, once for all panels with the same names there."""
    figure: Any = ax.figure
    names = [str(text) for text in ax.get_legend_handles_labels()[1]]
    if figure.get_size_inches()[0] >= NARROW:
        ax.legend(title=title or None, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    elif names not in [_named(other) for other in figure.axes if other is not ax]:
        longest = max(map(len, names), default=1)
        columns = min(3, max(1, ROW // (longest + 8)))  # a sample of the line takes the width of some letters, too
        ax.legend(title=title or None, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=columns,
                  fontsize="small", title_fontsize="small", handlelength=1.5, columnspacing=1.0)  # fmt: skip


def _named(ax: Axes) -> list[str]:
    """Return the names in the legend of a panel."""
    legend = ax.get_legend()
    return [text.get_text() for text in legend.get_texts()] if legend else []


def from_zero(ax: Axes) -> None:
    """Let the upward axis begin at zero, and leave room above what is drawn, were it a level line alone.

    Also above what other panels with the same axis have.
    """
    lines = [line for sibling in ax.get_shared_y_axes().get_siblings(ax) for line in sibling.get_lines()]
    tops = [np.nanmax(y) for line in lines if len(y := np.asarray(line.get_ydata())) and np.isfinite(y).any()]
    ax.set_ylim(0, 1.08 * max(tops, default=0.0) or None)


def colour_bar(figure: Figure | SubFigure, drawn: Any, axes: Any, label: str, **where: Any) -> Any:
    """Return a bar of colours with its label, in letters of the size of the panels' labels."""
    bar = figure.colorbar(drawn, ax=axes, **where)
    size = np.ravel(axes)[0].yaxis.label.get_fontsize()
    bar.set_label(label, size=size)
    bar.ax.tick_params(labelsize=size)
    return bar


def panels_of_maps(rows: int, columns: int, size: Array, look: Style = STANDARD) -> tuple[Figure, Any]:
    """Return a figure of equal maps (rows, columns), each of an extent (2,) in mm, and room for a bar of colours.

    The bar stands beside the maps; below them where the figure is narrow.
    """
    narrow = look.width < NARROW
    each = (look.width - (0.7 if narrow else 1.8)) / columns - 0.1
    height = rows * (each * size[1] / size[0] + 0.45) + (1.1 if narrow else 0.5)
    with rc_context({"axes.titlesize": "small", "font.size": 7.0 if narrow else 9.0}):
        figure = Figure(figsize=(look.width, min(height, HIGHEST)), layout="compressed")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.ravel():
        ax.set_aspect("equal")
        ax.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
        ax.yaxis.set_major_locator(MaxNLocator(3))
    return figure, axes


def bar_place(look: Style) -> dict[str, Any]:
    """Return where the bar of colours of maps stands, and its shape."""
    return {"location": "bottom", "aspect": 30} if look.width < NARROW else {"location": "right", "aspect": 30}


def wrapped(drawn: dict[str, Figure]) -> dict[str, Figure]:
    """Break the labels of upward axes where they are longer than their panels are high; return the figures."""
    for figure in drawn.values():
        used = HIGH_WIDE if figure.get_figwidth() >= NARROW else HIGH_NARROW
        for ax in figure.axes:
            place = ax.get_subplotspec()  # none of a bar of colours, beside all panels
            high = used * 72 * figure.get_figheight() / (place.get_gridspec().nrows if place else 1)
            letters = max(SHORTEST, int(high / (LETTER * float(ax.yaxis.label.get_fontsize()))))
            if max(map(len, ax.get_ylabel().split("\n"))) > letters:
                text = UNIT.sub(lambda unit: unit[0].replace(" ", "\u00a0"), ax.get_ylabel())
                ax.set_ylabel(textwrap.fill(text, letters, break_long_words=False))
    return drawn


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


def contact_axis(ax: Axes, label: str = ALONG_CONTACT) -> None:
    """Label the axis along the contact."""
    ax.set_xlabel(label)
    for shared in ax.get_shared_x_axes().get_siblings(ax):
        shared.margins(x=0.01)


def name_bodies(figures: Iterable[Figure], names: Names) -> None:
    """Let all that is written in figures have the names of the bodies."""
    if names.given:
        for text in (text for figure in figures for text in figure.findobj(Text)):
            text.set_text(names.with_names(text.get_text()))


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a figure; a PNG is laid out and drawn once, where `savefig` does both twice.

    Panels of a fixed aspect are laid out twice: only then are their labels where they will be.
    """
    if path.suffix == ".png":
        figure.set_dpi(dpi)
        canvas: Any = FigureCanvasAgg(figure)
        if any(ax.get_aspect() != "auto" for ax in figure.axes):
            figure.draw_without_rendering()
        canvas.print_png(path)
    else:
        figure.savefig(path, dpi=dpi)


def further(figure: Figure, png: Path, formats: Sequence[str]) -> list[Path]:
    """Write a figure beside its PNG in further formats; return the files."""
    paths = [png.with_suffix(f".{ending}") for ending in dict.fromkeys(formats) if ending != "png"]
    for path in paths:
        save(figure, path, dpi=300)
    return paths
