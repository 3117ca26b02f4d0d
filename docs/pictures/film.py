"""Draw docs/static/film.png from runs of `film.toml` (docs/how-to/layers.md) with its film and without.

fenwear run film.toml -o results/film
fenwear run film.toml --set unset=wear.punch.film --set wear.punch.coefficient=1e-8 -o results/bare
python3 docs/pictures/film.py results/film results/bare
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fenwear import read_history

PLACE = Path(__file__).parents[1] / "static" / "film.png"
AFTER = (10, 30, 60)  # half-cycles


def main(film: Path, bare: Path) -> None:
    """Write the picture."""
    figure = Figure(figsize=(8, 3), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    history = read_history(film)
    for shade, number in zip(np.linspace(0.35, 0.9, len(AFTER)), AFTER, strict=True):
        row = history.sel(half_cycle=number, method="nearest")
        left.plot(row.x, 1e6 * row.state_film, color=(0.1, 0.3, 0.5, shade), label=f"{int(row.half_cycle)} half-cycles")
    left.set(xlabel="x (mm)", ylabel="thickness of the oxide (nm)", ylim=(0, None))
    for folder, name, colour in ((film, "with oxide", "C0"), (bare, "bare metal", "C3")):
        row = read_history(folder).isel(half_cycle=-1)
        right.plot(row.x, 1e3 * row.wear, color=colour, label=name)
    right.set(xlabel="x (mm)", ylabel="worn depth (µm)", ylim=(0, None))
    for ax in (left, right):
        ax.legend(frameon=False, fontsize=8, loc="center", bbox_to_anchor=(0.5, 0.75))
        ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(PLACE, dpi=130)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
