"""All figures of a run into its folder, whatever its model is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray

from fenwear.report.boundary import boundary_figure
from fenwear.report.figures import FOLDER, all_figures, read_history
from fenwear.report.surface import model_of
from fenwear.report.surface_figures import surface_figures


def draw_figures(directory: Path, half_cycles: Sequence[int] = ()) -> list[Path]:
    """Draw all figures of a run into its folder `figures`; return their paths."""
    folder = directory / FOLDER
    history = read_history(directory)
    plane = model_of(history) == "plane"
    drawn = (all_figures if plane else surface_figures)(history, half_cycles)
    files = sorted((directory / "fields").glob("half_cycle_*.nc"))
    if files and plane and "temperature" in drawn:
        with xarray.open_dataset(files[-1], engine="h5netcdf") as fields:
            drawn["boundary_temperature"] = boundary_figure(fields)
    folder.mkdir(exist_ok=True)
    paths = [folder / f"{name}.png" for name in drawn]
    for path, figure in zip(paths, drawn.values(), strict=True):
        figure.savefig(path, dpi=150)
    return paths
