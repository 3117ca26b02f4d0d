"""All figures of a run into its folder, whatever its model is, with their captions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fenwear.case.names import Names, renamed
from fenwear.report.boundary import boundary_figure
from fenwear.report.captions import caption
from fenwear.report.figures import FOLDER, all_figures, read_history
from fenwear.report.gaps import gaps_of, part_lines
from fenwear.report.key_numbers import names_in, read_case
from fenwear.report.sections import geometry_figure, stress_figure
from fenwear.report.style import STANDARD, Style, name_bodies, save, wrapped
from fenwear.report.surface import model_of
from fenwear.results.disk import write_text
from fenwear.results.netcdf import load

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

CAPTIONS = "captions.txt"
DPI = 200


def field_figures(directory: Path, case: Mapping[str, Any], look: Style = STANDARD) -> dict[str, Figure]:
    """Draw what the fields of the last half-cycle that has them show, by its name."""
    files = sorted((directory / "fields").glob("half_cycle_*.nc"))
    if not files:
        return {}
    fields = load(files[-1])
    own = renamed(case, Names.of(case).by_role)  # fields have the groups so
    drawn = {"geometry": geometry_figure(fields, own, look)}
    if "punch_stress_xx" in fields:
        drawn["surface_stress"] = stress_figure(fields, look)
    if "punch_temperature" in fields:
        drawn["boundary_temperature"] = boundary_figure(fields, look)
    return wrapped(drawn)


def draw_figures(
    directory: Path,
    half_cycles: Sequence[int] = (),
    look: Style = STANDARD,
    formats: Sequence[str] = ("png",),
    history: xarray.Dataset | None = None,
) -> list[Path]:
    """Draw all figures of a run, and their captions, into its folder `figures`; return the paths.

    Its history is read where it is not given.
    """
    folder = directory / FOLDER
    history = read_history(directory) if history is None else history
    drawn = all_figures(history, half_cycles, look)
    if model_of(history) == "plane":
        drawn |= field_figures(directory, read_case(directory), look)
    part_lines(drawn.values(), gaps_of(history))
    name_bodies(drawn.values(), names := names_in(directory))
    folder.mkdir(exist_ok=True)
    paths = []
    for name, figure in drawn.items():
        for ending in dict.fromkeys(("png", *formats)):  # the report shows the PNG
            paths.append(folder / f"{name}.{ending}")
            save(figure, paths[-1], DPI)
    captions = folder / CAPTIONS
    write_text(captions, names.told("".join(f"{name}: {caption(name, history, look)}\n\n" for name in drawn)))
    return [*paths, captions]
