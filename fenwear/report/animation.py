"""The run as an animation, from its history alone: pressure in both directions and the worn shape."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report.figures import FOLDER, directions_present, mean_pressure, pressure_top, read_history
from fenwear.report.style import DIRECTIONS, contact_axis, panels, reference_line, save_gif
from fenwear.report.surface import model_of
from fenwear.report.surface_animation import SurfaceFrames

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
    """One figure whose lines are moved from frame to frame."""

    def __init__(self, history: xarray.Dataset, half_cycles: Sequence[int]) -> None:
        self.history = history
        self.figure: Figure
        self.figure, (above, below) = panels(2, 2.6)
        self._pressure = {}
        for d in directions_present(history):
            name, dashes, colour = DIRECTIONS[d]
            (self._pressure[d],) = above.plot([], [], dashes, color=colour, label=name)
        above.set_ylabel("contact pressure (MPa)")
        above.set_ylim(0, pressure_top(history, half_cycles))
        above.legend(title="strip moves", loc="upper right", frameon=False)
        mean = mean_pressure(history)
        reference_line(above, mean, f"mean {mean:.2f}")
        (self._shape,) = below.plot([], [], color="0")
        below.set_ylabel("worn depth (µm)")
        below.set_ylim(0, 1.05e3 * max(float(history.wear.max()), 1e-12))
        contact_axis(below)
        below.set_xlim(float(history.x[0]), float(history.x[-1]))
        self._title = above.set_title(" ", loc="left")

    def show(self, half_cycle: int) -> None:
        """Move the lines to a half-cycle; the other direction shows its latest one before."""
        until = self.history.sel(half_cycle=slice(None, half_cycle))
        for d, line in self._pressure.items():
            rows = np.flatnonzero(until.direction.values == d)
            if len(rows):
                line.set_data(until.x.values, until.pressure.values[rows[-1]])
        self._shape.set_data(until.x.values, 1e3 * until.wear.values[-1])
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
    plane = model_of(history) == "plane"
    frames = HistoryFrames(history, half_cycles) if plane else SurfaceFrames(history, half_cycles)
    frames.figure.set_dpi(90)
    images = []
    for n in half_cycles:
        frames.show(n)
        images.append(image_of(frames.figure))
    path = directory / FOLDER / "history.gif"
    path.parent.mkdir(exist_ok=True)
    save_gif(images, path)
    return path
