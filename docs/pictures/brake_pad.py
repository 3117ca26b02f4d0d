"""Draw the first picture of the pages, docs/static/brake-pad.png, from a run of the built-in case `brake-pad`.

    fenwear run brake-pad --set geometry.parameters.across=5 --set geometry.parameters.along=5 \
        --set geometry.parameters.pad_layers=2 --set geometry.parameters.disc_layers=2 \
        --set run.half_cycles=400 --set output.uncertainty=false -o results/brake-pad
    python3 docs/pictures/brake_pad.py results/brake-pad

The nodes of the lining lie in rows along its radii. Between them the fields are cubic splines that keep to the largest
and smallest values of the nodes around.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.interpolate import PchipInterpolator

from fenwear import read_history

FIELDS = {  # of history.nc: title, factor, colours
    "pressure": ("contact pressure (MPa)", 1.0, "YlGnBu"),
    "temperature_punch": ("temperature above the surroundings (K)", 1.0, "inferno"),
    "wear": ("worn depth (µm)", 1e3, "YlOrBr"),
}
PLACE = Path(__file__).parents[1] / "static" / "brake-pad.png"
FINE = 300  # points drawn along each axis


def main(folder: Path) -> None:
    """Write the picture."""
    last = read_history(folder).isel(half_cycle=-1)
    radius, angle = np.hypot(last.x, last.y).values, np.arctan2(last.y, last.x).values
    rows = len(np.unique(angle.round(6)))
    order = np.lexsort((radius, angle.round(6)))

    def smooth(values: np.ndarray) -> np.ndarray:
        found = values[order].reshape(rows, -1)
        for axis, count in enumerate(found.shape):
            found = PchipInterpolator(np.arange(count), found, axis)(np.linspace(0, count - 1, FINE))
        return found

    r, phi = smooth(radius), smooth(angle)
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    for ax, (name, (title, factor, colours)) in zip(figure.subplots(1, len(FIELDS)), FIELDS.items(), strict=True):
        values = smooth(factor * last[name].values)
        drawn = ax.contourf(r * np.cos(phi), r * np.sin(phi), values, 24, cmap=colours)
        figure.colorbar(drawn, ax=ax, label=title, shrink=0.85)
        ax.set(xlabel="x (mm)", ylabel="y (mm)" if name == "pressure" else "", aspect="equal")
        ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(PLACE, dpi=130)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
