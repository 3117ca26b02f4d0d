"""The run as an animation, from its history alone: pressure in both directions and the worn shape."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.course import directions_present, is_conforming, mean_pressure
from fenwear.report.figures import FOLDER, read_history
from fenwear.report.gaps import gaps_of, parted
from fenwear.report.key_numbers import names_in
from fenwear.report.shapes import surfaces_of, worn_range
from fenwear.report.style import (
    BODY_COLOURS,
    contact_axis,
    direction_style,
    legend_beside,
    level_line,
    name_bodies,
    panels,
    save_gif,
    strip_moves,
)
from fenwear.report.surface import along_contact, model_of
from fenwear.report.surface_animation import MapFrames

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAMES = 40


def frames_of(history: xarray.Dataset, count: int = FRAMES) -> list[int]:
    """Return the recorded half-cycles to show: whole cycles, half of them spread over the logarithm of the run."""
    recorded = history.half_cycle.values
    last = int(recorded[-1])
    wanted = np.union1d(np.geomspace(1, last, count // 2), np.linspace(1, last, count - count // 2))
    phases = len(directions_present(history))
    ends = recorded[phases - 1 :: phases] if len(recorded) >= phases else recorded[-1:]
    return sorted({int(ends[np.abs(ends - n).argmin()]) for n in wanted})


class HistoryFrames:
    """One figure whose lines are moved from frame to frame: pressure, and worn depth of each body that wears."""

    def __init__(self, history: xarray.Dataset, half_cycles: Sequence[int]) -> None:
        self.history = history
        self.figure: Figure
        self._surfaces, self._gaps = surfaces_of(history), gaps_of(history)
        self.figure, (self._above, *below) = panels(1 + len(self._surfaces), 2.4)
        self._pressure = {}
        for d in directions_present(history):
            name, dashes, colour = direction_style(history, d)
            (self._pressure[d],) = self._above.plot([], [], dashes, color=colour, label=name)
        self._above.set_ylabel("contact pressure (MPa)")
        # Late states fill the axis; it grows for the peaks of the first ones.
        self._late = float(history.pressure.sel(half_cycle=list(half_cycles[len(half_cycles) // 2 :])).max())
        if is_conforming(history):
            level_line(self._above, mean_pressure(history), "mean")
        legend_beside(self._above, strip_moves(history))
        self._depths = {}
        for ax, (body, (_, depth, _)) in zip(below, self._surfaces.items(), strict=True):
            (self._depths[body],) = ax.plot([], [], color=BODY_COLOURS[body])
            ax.set_ylabel(f"worn depth of\nthe {body} (µm)")
            top = 1.05e3 * max(float(depth.max()), 1e-12)
            ax.set_ylim((0, top) if body == "punch" else (top, 0))
        contact_axis(below[-1], along_contact(history)[1])
        below[-1].set_xlim(*worn_range(history))
        self._title = self.figure.suptitle(" ", x=0.02, ha="left", fontsize="medium")

    def show(self, half_cycle: int) -> None:
        """Move the lines to a half-cycle; the other direction shows its latest one before."""
        until = self.history.sel(half_cycle=slice(None, half_cycle))
        highest = self._late
        for d, line in self._pressure.items():
            rows = np.flatnonzero(until.direction.values == d)
            if len(rows):
                values = until.pressure.values[rows[-1]]
                highest = max(highest, float(values.max()))
                line.set_data(*parted(along_contact(self.history)[0], values, self._gaps))
        self._above.set_ylim(0, 1.1 * highest)
        for body, (x, depth, _) in self._surfaces.items():
            worn = 1e3 * depth.sel(half_cycle=slice(None, half_cycle)).values[-1]
            self._depths[body].set_data(*parted(x, worn, self._gaps))
        self._title.set_text(f"after half-cycle {half_cycle:,} of {int(self.history.half_cycle[-1]):,}")


def image_of(figure: Figure) -> Any:
    """Return a figure as a picture of few colours."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    figure.set_layout_engine("none")  # arranged once: frames must not jiggle, and it is slow
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    return picture.quantize(64, method=Image.Quantize.FASTOCTREE)


def draw_animation(directory: Path) -> Path:
    """Draw figures/history.gif of a run; return its path."""
    history = read_history(directory)
    half_cycles = frames_of(history)
    solid = model_of(history) == "solid"
    frames = MapFrames(history, half_cycles) if solid else HistoryFrames(history, half_cycles)
    frames.figure.set_dpi(90)
    name_bodies([frames.figure], names_in(directory))
    images = []
    for n in half_cycles:
        frames.show(n)
        images.append(image_of(frames.figure))
    path = directory / FOLDER / "history.gif"
    path.parent.mkdir(exist_ok=True)
    save_gif(images, path)
    return path
