"""Figures and page of a run with stick, drawn from its folder alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from fenwear.report import stick_heat, stick_maps
from fenwear.report.figures import FOLDER
from fenwear.report.gaps import gaps_of, part_lines, parted
from fenwear.report.html_page import picture, render
from fenwear.report.key_numbers import names_in, read_summary
from fenwear.report.stick_course import course_axis, cycle_name, first_and_last, title, traction_panels
from fenwear.report.style import (
    BLUE,
    RED,
    STANDARD,
    Look,
    contact_axis,
    further,
    legend_beside,
    level_line,
    name_bodies,
    panels,
    shades,
)
from fenwear.report.surface import model_of
from fenwear.report.uncertainty import uncertainty_rows
from fenwear.results.cycles import by_cycles
from fenwear.results.disk import write_text, writing
from fenwear.results.history import CASE, HISTORY
from fenwear.results.reading import load_history
from fenwear.results.sheet import UNCERTAINTY, sheet_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPORT = "report.html"
CAPTIONS = "captions.txt"
Drawing = Callable[[xarray.Dataset, Look], "Figure"]
GROSS = 0.2  # energy ratio above which sliding is called gross (Fouvry)


def chosen(history: xarray.Dataset, count: int = 5) -> list[int]:
    """Return the places of recorded cycles at even shares of the wear, the first and the last among them."""
    depth = (history.wear.max(history.wear.dims[1:]) + history.wear_strip.max(history.wear_strip.dims[1:])).values
    course = depth if depth[-1] > depth[0] else np.arange(len(depth), dtype=float)
    return sorted({int(np.abs(course - target).argmin()) for target in np.linspace(course[0], course[-1], count)})


def loops(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the fretting loops: tangential force over displacement, and over what is more than full stick's."""
    figure, (whole, beyond) = panels(2, 3.0, share_x=False, look=look)
    first = history.isel(cycle=0)
    slopes = np.diff(first.tangential_force) / np.where(
        np.diff(first.displacement) == 0, np.inf, np.diff(first.displacement)
    )
    stiffness = float(slopes.max(initial=0.0)) or np.inf
    for colour, place in shades(chosen(history)):
        cycle = history.isel(cycle=place)
        closed = np.arange(cycle.sizes["step"] + 1) % cycle.sizes["step"]
        x, y = 1e3 * cycle.displacement.values[closed], cycle.tangential_force.values[closed]
        whole.plot(x, y, color=colour, label=cycle_name(history, place, look))
        beyond.plot(x - 1e3 * y / stiffness, y, color=colour)
    whole.set_xlabel("displacement of the strip (µm)")
    beyond.set_xlabel("displacement less that of full stick\nat the same force (µm)")
    for ax in (whole, beyond):
        ax.set_ylabel(f"tangential force ({history.tangential_force.units.replace(' ', ' ')})")
    legend_beside(whole, look.of_one)
    return figure


def energy(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw friction's work and the energy ratio over the cycles."""
    figure, (upper, lower) = panels(2, 2.2, look=look)
    x = course_axis(lower, history, look)
    upper.plot(x, 1e3 * history.dissipated_energy, color=BLUE, marker=".", markersize=3)
    upper.set_ylabel("work of friction\nin a cycle (µJ)")
    upper.set_ylim(bottom=0)
    lower.plot(x, history.energy_ratio, color=RED, marker=".", markersize=3, label="energy ratio")
    level_line(lower, GROSS, "gross sliding above,\npartial slip below")
    lower.set_ylabel("energy ratio")
    lower.set_ylim(0, max(0.3, 1.1 * float(history.energy_ratio.max())))
    legend_beside(lower, "")
    return figure


def zones(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw where the surfaces stick, slip and are open over the first and the last cycle."""
    from matplotlib.colors import ListedColormap

    places = first_and_last(history)
    figure, axes = panels(len(places), 2.4, look=look)
    colours = ("white", RED, BLUE)
    x = history.x.values
    for ax, place in zip(axes, places, strict=True):
        cycle = history.isel(cycle=place)
        state = np.where(cycle.stick.values == 1, 2, np.where(cycle.pressure.values > 0, 1, 0))
        steps = np.arange(1, cycle.sizes["step"] + 1)
        shades_of = ListedColormap(colours)
        at, states = parted(x, state, gaps_of(history))
        ax.pcolormesh(at, steps, states, cmap=shades_of, vmin=0, vmax=2, shading="nearest", rasterized=True)
        ax.set_ylabel(f"{title(history, place, look)}:\ntime step")
        for colour, name in ((BLUE, "stick"), (RED, "slip")):
            ax.plot([], [], marker="s", linestyle="", color=colour, label=name)
        legend_beside(ax, "")
    touched = x[(history.pressure.values > 0).any(axis=(0, 1))]
    if len(touched):
        margin = 0.15 * float(np.ptp(touched)) + 1e-9
        axes[-1].set_xlim(touched.min() - margin, touched.max() + margin)
    axes[-1].set_xlabel("position along the contact x (mm)")
    return figure


def tractions(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the tangential traction between its bounds in the first and the last cycle."""
    half = int((history.half_cycle_of_step == 1).sum())
    steps = [half // 4 - 1, half // 2 - 1, 3 * half // 4 - 1, half - 1, history.sizes["step"] - 1]
    x = history.x.values
    return traction_panels(
        history,
        [max(step, 0) for step in steps],
        lambda values: (x, values),
        lambda ax: _to_contact(ax, history),
        look,
    )


def stresses(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the stress along x in the strip's surface, its range over the cycle."""
    figure, (ax,) = panels(1, 3.0, look=look)
    for colour, place in shades(chosen(history, 3)):
        cycle = history.isel(cycle=place)
        low, high = cycle.surface_stress.min("step"), cycle.surface_stress.max("step")
        ax.plot(history.x, high, color=colour, label=cycle_name(history, place, look))
        ax.plot(history.x, low, color=colour, linestyle=":")
    ax.set_ylabel("stress σ xx in the\nstrip's surface (MPa):\nlargest, dotted smallest")
    legend_beside(ax, look.of_one)
    _to_contact(ax, history)
    return figure


def shapes(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw the worn depths and the pressure of chosen cycles."""
    figure, (depth, pressure) = panels(2, 2.4, look=look)
    for colour, place in shades(chosen(history)):
        cycle = history.isel(cycle=place)
        depth.plot(history.x, -1e3 * cycle.wear, color=colour, label=cycle_name(history, place, look))
        depth.plot(history.x_strip, -1e3 * cycle.wear_strip, color=colour, linestyle=":")
        pressure.plot(history.x, cycle.pressure.isel(step=-1), color=colour, label=cycle_name(history, place, look))
    depth.set_ylabel("worn depth (µm):\npunch, dotted strip")
    pressure.set_ylabel("pressure at the end\nof the cycle (MPa)")
    legend_beside(depth, look.of_one)
    _to_contact(pressure, history)
    return figure


def sliding_map(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    """Draw where each node slips: its slip in a cycle and its share of friction's work."""
    figure, (slip, work) = panels(2, 2.2, look=look)
    for colour, place in shades(chosen(history, 3)):
        cycle = history.isel(cycle=place)
        slid, label = np.abs(cycle.slip), cycle_name(history, place, look)
        slip.plot(history.x, 1e3 * slid.where(cycle.pressure > 0, 0).sum("step"), color=colour, label=label)
        work.plot(history.x, 1e3 * (np.abs(cycle.traction) * slid).sum("step"), color=colour, label=label)
    slip.set_ylabel("slip in a cycle (µm)")
    work.set_ylabel("work of friction\nin a cycle (µJ/mm²)")
    legend_beside(slip, look.of_one)
    _to_contact(work, history)
    return figure


def _temperatures(history: xarray.Dataset, look: Look = STANDARD) -> Figure:
    return stick_heat.temperatures(history, chosen(history), look)


def figures_of(history: xarray.Dataset) -> dict[str, tuple[Drawing, str, str]]:
    """Return the drawings of a run, with captions and what they show."""
    solid = model_of(history) == "solid"
    found = IN_SOLIDS if solid else FIGURES
    if "temperature_punch" not in history:
        return found
    drawing: Drawing = stick_heat.temperature_maps
    alt = "Of both surfaces at the end of the first and the last cycle."
    if not solid:
        drawing = _temperatures
        alt = "Of both surfaces along x, a line a cycle."
    course = "Largest temperature of the contact, and where the heat of a cycle goes, over the cycles."
    return {
        **found,
        "temperatures": (drawing, "Temperatures of the contact", alt),
        "heat": (stick_heat.heat_course, "Heat over the cycles", course),
    }


def _to_contact(ax: Any, history: xarray.Dataset) -> None:
    x = history.x.values
    touched = x[(history.pressure.values > 0).any(axis=(0, 1))]
    contact_axis(ax)
    if len(touched):
        margin = 0.2 * float(np.ptp(touched)) + 1e-9
        ax.set_xlim(max(touched.min() - margin, x[0]), min(touched.max() + margin, x[-1]))


# name: (drawing, caption, what it shows)
FIGURES: dict[str, tuple[Drawing, str, str]] = {
    "loops": (loops, "Fretting loops", "Tangential force over the displacement of the strip, a loop for each cycle."),
    "zones": (zones, "Stick and slip over the cycle", "Where nodes stick and slip, along x and over the time steps."),
    "tractions": (tractions, "Tangential traction", "Traction along x at five times, between plus and minus mu p."),
    "sliding": (sliding_map, "Slip and work of friction", "Slip and work of friction of a cycle along x."),
    "energy": (energy, "Work of friction and energy ratio", "Both over the cycles, with the border of gross sliding."),
    "surface_stress": (stresses, "Stress in the strip's surface", "Its largest and smallest value along x."),
    "shape": (shapes, "Worn depth and pressure", "Worn depths of both bodies and pressure along x, a line a cycle."),
}

IN_SOLIDS: dict[str, tuple[Drawing, str, str]] = {
    "loops": FIGURES["loops"],
    "zones": (stick_maps.zones, "Stick and slip over the cycle", "Where nodes stick and slip at four times."),
    "tractions": (stick_maps.tractions, "Tangential traction", "Its size and direction at four times."),
    "cuts": (
        stick_maps.cuts,
        "Traction along the sliding",
        "On a cut through the middle, between plus and minus mu p.",
    ),
    "sliding": (stick_maps.sliding_map, "Slip and work of friction", "Slip and work of friction in a cycle."),
    "energy": FIGURES["energy"],
    "surface_stress": (stick_maps.stresses, "Stress in the strip's surface", "Its largest value in a cycle."),
    "scar": (stick_maps.scar, "Worn depth", "Worn depth of both bodies at the end."),
    "shape": (
        lambda history, look: stick_maps.shapes(history, chosen(history), look),
        "Worn depth and pressure along the sliding",
        "Worn depths of both bodies and pressure on a cut through the middle, a line a cycle.",
    ),
}


def write_stick_report(directory: Path, formats: Sequence[str] = ("png",), look: Look = STANDARD) -> list[Path]:
    """Draw the figures of a run with stick, with captions, and write its report.html; return the files.

    Args:
        directory: The folder of the run.
        formats: Of the figures.
        look: Their width and axis.

    Raises:
        CaseError: the folder holds no run, or the run has no such axis.
        OutputError: a figure or the page cannot be written.
    """
    history, names = by_cycles(load_history(directory)), names_in(directory)
    folder = directory / FOLDER
    paths, pictures, captions = [], [], []
    with writing(directory):
        folder.mkdir(exist_ok=True)
        for name, (draw, caption, alt) in figures_of(history).items():
            path = folder / f"{name}.png"
            figure = draw(history, look)
            part_lines([figure], gaps_of(history))
            name_bodies([figure], names)
            figure.savefig(path, dpi=150)
            paths += [path, *further(figure, path, formats)]
            pictures.append(picture(path.read_bytes(), "png", caption, alt))
            captions.append(names.told(f"{name}: {caption}. {alt}\n\n"))
    write_text(folder / CAPTIONS, "".join(captions))
    report = directory / REPORT
    write_text(report, _page(directory, history, pictures))
    return [*paths, folder / CAPTIONS, report]


def _page(directory: Path, history: xarray.Dataset, pictures: list[Any]) -> str:
    summary = read_summary(directory)
    numbers = [
        (label, " and ".join("-" if value is None else f"{value:,.5g}" for value in row), unit)
        for label, unit, row in sheet_rows(summary)
    ]
    return render(
        "stick.html",
        names_in(directory),
        title=str(history.attrs.get("title", "")) or "fenwear run",
        name=directory.resolve().name,
        cycles=int(history.cycle[-1]),
        written=datetime.fromtimestamp((directory / HISTORY).stat().st_mtime).astimezone(),
        stop=summary.get("stop", "no summary yet"),
        warnings=summary.get("warnings", ()),
        numbers=numbers,
        uncertainty=summary.get(UNCERTAINTY),
        uncertainties=uncertainty_rows(summary),
        figures=pictures,
        case=(directory / CASE).read_text("utf-8"),
        versions="\n".join(f"{name} {version}" for name, version in summary.get("versions", {}).items()),
    )
