"""Commands that look at the folders of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from fenwear.cli.application import JsonOption, app, log, show, show_results
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root


@app.command("sheet")
def sheet_command(directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]) -> None:
    """Print all numbers of a run: of the sliding, the wear, the heat, and each contact."""
    from fenwear.report.key_numbers import read_summary
    from fenwear.results.sheet import sheet_text
    from fenwear.results.summary import contact_text

    summary = on_root(MPI.COMM_WORLD, lambda: read_summary(directory))
    if not summary:
        raise CaseError(InputError(str(directory), "no summary.json: expected the folder of a run that has ended"))
    show("\n\n".join(text for text in (sheet_text(summary), contact_text(summary)) if text))


@app.command("plot")
def plot_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")],
    formats: Annotated[
        str, typer.Option("--format", help="Formats of the figures: png, pdf, svg, with commas.")
    ] = "png",
    width: Annotated[
        str, typer.Option(help='Width of the figures, such as "85 mm" for a column of a paper.')
    ] = "178 mm",
    axis: Annotated[str, typer.Option(help="Horizontal axis of the figures: cycles, distance or time.")] = "cycles",
) -> None:
    """Draw a run: figures with captions, pictures of the bodies and report.html, into its folder."""
    from fenwear.report.page import write_report
    from fenwear.report.style import chosen_formats, chosen_look

    look, endings = chosen_look(width, axis), chosen_formats(formats)
    paths = on_root(MPI.COMM_WORLD, lambda: write_report(directory, log, complete=True, look=look, formats=endings))
    for path in paths:
        show(str(path))


@app.command("export")
def export_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The folder of the CSV files; by default DIR/export.")
    ] = None,
    at: Annotated[
        str,
        typer.Option(
            metavar="NUMBERS", help="Kept half-cycles of the profiles, with commas; first and last are allowed."
        ),
    ] = "first,last",
    worn: Annotated[
        bool, typer.Option("--worn", help="Write the worn surfaces at one half-cycle instead: profile, STL and VTK.")
    ] = False,
) -> None:
    """Write a run as CSV: a line for each kept half-cycle, and the profiles of both bodies."""
    from fenwear.results.export import export, export_worn

    if worn:
        paths = export_worn(directory, output, "last" if at == "first,last" else at)
    else:
        paths = on_root(MPI.COMM_WORLD, lambda: export(directory, output, at))
    for path in paths:
        show(str(path))


@app.command("flash")
def flash_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run on a contact grid.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The folder of maps and pictures; by default DIR/flash.")
    ] = None,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help='A key of heat, of a material or of a body\'s temperatures: --set heat.convection="20 W/(m^2 K)"',
        ),
    ] = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Compute flash temperatures of a run on a contact grid, by moving sources."""
    from fenwear.report.figures import DPI
    from fenwear.report.maps import flash_figures
    from fenwear.report.style import name_bodies, save
    from fenwear.results.disk import writing
    from fenwear.results.flash_temperatures import dataset, flash_temperatures, numbers, text
    from fenwear.results.hdf5 import write

    temperatures = flash_temperatures(directory, settings)
    folder, names = output or directory / "flash", temperatures.heating.placed.case.names

    def keep() -> None:
        maps = dataset(temperatures)
        drawn = flash_figures(maps)
        name_bodies(drawn.values(), names)
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            write(folder / "flash.nc", maps)
            for name, figure in drawn.items():
                save(figure, folder / f"{name}.png", DPI)

    on_root(MPI.COMM_WORLD, keep)
    result = numbers(temperatures) if as_json else names.with_names(text(temperatures, str(directory)))
    show_results(result, f"maps and pictures in {folder}")


@app.command("compare")
def compare_command(
    directories: Annotated[list[Path], typer.Argument(metavar="DIR...", help="The folders of several runs.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The figure to write: .png, .pdf or .svg.")] = Path(
        "compare.png"
    ),
    as_json: JsonOption = False,
) -> None:
    """Compare several runs in one figure and one table, with the differences of their cases."""
    from fenwear.report.compare import compare, draw_comparison

    comparison = on_root(MPI.COMM_WORLD, lambda: compare(directories))
    on_root(MPI.COMM_WORLD, lambda: draw_comparison(comparison, output))
    show_results(comparison.as_json() if as_json else comparison.text(), f"figure in {output}")
