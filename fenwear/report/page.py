"""report.html: one page per run that needs nothing else, neither network nor scripts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import xarray

from fenwear.errors import CaseError, OutputError
from fenwear.report.captions import caption
from fenwear.report.draw import draw_figures
from fenwear.report.figures import FOLDER, read_history
from fenwear.report.html_page import Picture, picture, render
from fenwear.report.key_numbers import flat, label_of, names_in, number_text, read_case, read_summary, unit_of
from fenwear.report.pictures import DrawingError, draw_pictures
from fenwear.report.style import STANDARD, Style
from fenwear.report.uncertainty import uncertainty_rows
from fenwear.results.disk import write_text, writing
from fenwear.results.history import CASE, HISTORY
from fenwear.results.registry import known
from fenwear.results.sheet import BODIES, LINES, OF_CONTACT, UNCERTAINTY, shown

REPORT = "report.html"
SECTIONS = ("geometry", "loops", "zones", "tractions", "traction_map", "sliding", "energy", "stress_range",
            "profiles", "shape", "wear_map", "wear_strip_map", "surface_map", "surface_strip_map",
            "roughness", "pressure", "mean_pressure", "pressure_map", "tracks",
            "cuts_along", "cuts_across", "program", "peaks", "place", "volume", "creep", "scar", "friction",
            "surface_stress", "temperature", "boundary_temperature", "temperature_map",
            "temperature_strip_map")  # fmt: skip
WAYS = ("rightward", "leftward", "forward", "backward", "counterclockwise", "clockwise")
FIELDS = {"von_mises": "von Mises stress", "temperature": "temperature"}


def write_report(
    directory: Path,
    log: Callable[[str], None] = lambda message: None,
    *,
    complete: bool = False,
    look: Style = STANDARD,
    formats: Sequence[str] = ("png",),
) -> list[Path]:
    """Draw a run's figures and write its report.html; return the files.

    Args:
        directory: The folder of the run.
        log: Called with a message where pictures of the bodies cannot be drawn.
        complete: Draw the pictures of the bodies, too, which takes longer.
        look: Width and axis of the figures.
        formats: Of the files, "png", "pdf" and "svg".

    Raises:
        CaseError: the folder holds no run.
        OutputError: a figure or the page cannot be written.
    """
    with writing(directory):
        return _write_report(directory, log, complete, look, formats)


def _write_report(
    directory: Path, log: Callable[[str], None], complete: bool, look: Style, formats: Sequence[str]
) -> list[Path]:
    history, wanted = read_history(directory), read_case(directory).get("output", {}).get("figures_at", ())
    paths = draw_figures(directory, wanted, look, formats, history)
    if complete:
        try:
            paths += draw_pictures(directory, formats)
        except DrawingError as error:
            log(f"warning: {error}")
    report = directory / REPORT
    write_text(report, page(directory, look, history))
    return [*paths, report]


def try_report(directory: Path, log: Callable[[str], None]) -> None:
    """Write the report of a run whose results are safe already: what fails here is a warning."""
    try:
        write_report(directory, log)
    except (CaseError, OutputError, ImportError, OSError, RuntimeError, ValueError) as error:
        log(f"warning: no report of the run: {error}; to try again: python -m fenwear plot {directory}")


@dataclass(frozen=True)
class Number:
    """A number of the page: its path in summary.json, its exact value, and what is read of it."""

    path: str
    label: str
    value: int | float
    text: str
    unit: str


@dataclass(frozen=True)
class Table:
    """Numbers below a caption."""

    caption: str
    numbers: list[Number]


@dataclass(frozen=True)
class Row:
    """A quantity at several places."""

    label: str
    unit: str
    numbers: list[Number]


@dataclass(frozen=True)
class Places:
    """Quantities at several places below a caption."""

    caption: str
    columns: list[str]
    rows: list[Row]


def page(directory: Path, look: Style = STANDARD, history: xarray.Dataset | None = None) -> str:
    """Return report.html of a run whose figures are drawn; its history is read where it is not given."""
    history, summary = read_history(directory) if history is None else history, read_summary(directory)
    images = _images(directory)
    written = datetime.fromtimestamp((directory / HISTORY).stat().st_mtime).astimezone()
    return render(
        "report.html",
        names_in(directory),
        title=str(history.attrs.get("title", "")) or "fenwear run",
        name=directory.resolve().name,
        half_cycles=int(history.half_cycle[-1]),
        stop=summary.get("stop", "no summary yet: the run still goes on, or it was killed"),
        written=written,
        warnings=summary.get("warnings", ()),
        tables=_tables(summary, history),
        places=_places(summary),
        figures=[_figure(images, name, caption(name, history, look)) for name in SECTIONS if name in images],
        bodies=_bodies(images),
        change=_change(summary),
        scale="the pressure scale",
        retries=summary.get("retries", {}),
        convergence=_figure(images, "convergence", caption("convergence", history, look)),
        equilibrium_error=summary.get("largest_equilibrium_error"),
        complementarity_error=summary.get("largest_complementarity_error"),
        heat_error=_heat_error(summary, history),
        heat=_heat(summary),
        heat_balance=_figure(images, "heat_balance", caption("heat_balance", history, look)),
        stability=_stability(summary, history),
        uncertainty=summary.get(UNCERTAINTY),
        uncertainties=uncertainty_rows(summary),
        case=(directory / CASE).read_text("utf-8"),
        versions="\n".join(f"{name} {version}" for name, version in summary.get("versions", {}).items()),
    )


def _number(path: str, value: float, *, cut: int = 0) -> Number:
    """Return a number as it is read: as the sheet has it, where it is one of its lines."""
    line = (LINES | OF_CONTACT).get(path[cut:])
    if line is not None:
        return Number(path, line.label, value, number_text(shown(value, line)), line.unit)
    return Number(path, label_of(path[cut:]), value, number_text(value), unit_of(path))


def _table(caption: str, values: dict[str, int | float], *, cut: int = 0) -> Table:
    return Table(caption, [_number(path, value, cut=cut) for path, value in values.items()])


def numbers_of(summary: dict[str, Any]) -> dict[str, int | float]:
    """Return every number of a summary by its path."""
    left_out = ("versions", "warnings", "retries", UNCERTAINTY)
    values = flat({key: value for key, value in summary.items() if key not in left_out})
    return {k: v for k, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}


def _tables(summary: dict[str, Any], history: xarray.Dataset) -> list[Table]:
    if not summary:
        names = ("largest_pressure", "contact_width", "contact_area", "periodicity")
        shown_first = [one for name in names if name in history and (one := known(name)) is not None]
        last = {one.key: float(history[one.name][-1]) for one in shown_first}
        return [_table("At the last recorded half-cycle", last)]
    numbers = numbers_of(summary)
    single = {path: value for path, value in numbers.items() if "[" not in path and "." not in path}
    captions = {"sliding": "What a tribometer measures", **{body: body.capitalize() for body in BODIES}}
    ways = {d: "turning" if "clockwise" in d else "moving" for d in WAYS}
    captions |= {d: f"Last half-cycle with the strip {moving} {d}" for d, moving in ways.items()}
    captions |= {f"contacts.{name}": f"Contact {name}" for name in summary.get("contacts", {})}
    tables = []
    for name, above in captions.items():
        inside = {p: v for p, v in numbers.items() if p.startswith(f"{name}.") and "[" not in p}
        if inside:
            tables.append(_table(above, inside, cut=len(name) + 1))
    return [*tables, _table("The run", single)]


def _places(summary: dict[str, Any]) -> Places | None:
    """Return the quantities that summary.json gives at several places."""
    numbers = numbers_of(summary)
    listed = [p.removesuffix("[0]") for p in numbers if p.endswith("[0]") and p != "x_mm[0]"]
    if not (listed and summary.get("x_mm")):
        return None
    rows = [
        Row("position x" if path == "x_mm" else label_of(path), unit_of(path),
            [_number(p, numbers[p]) for p in numbers if p.startswith(f"{path}[")])
        for path in ("x_mm", *listed)
    ]  # fmt: skip
    columns = ["quantity", "unit", *("" for _ in summary["x_mm"])]
    return Places("At places along the contact, end of the run", columns, rows)


def _change(summary: dict[str, Any]) -> float | None:
    change = summary.get("periodicity")
    return None if change is None or math.isnan(change) else float(change)


def _heat_error(summary: dict[str, Any], history: xarray.Dataset) -> float | None:
    if "heat_friction" not in history:
        return None
    return float(summary.get("largest_heat_balance_error", history.heat_balance_error.max()))


def _heat(summary: dict[str, Any]) -> Table:
    heat = {path: value for path, value in numbers_of(summary).items() if path.startswith("heat_mJ.")}
    table = _table("Heat of the last half-cycle", heat, cut=len("heat_mJ."))
    made = [replace(n, label="made by friction") if n.label == "friction" else n for n in table.numbers]
    return replace(table, numbers=made)


def _stability(summary: dict[str, Any], history: xarray.Dataset) -> str:
    rate = summary.get("growth_rate_per_s")
    if rate is None or not math.isfinite(rate):
        if "largest_temperature" not in history:
            return "Computed with heat only."
        reason = summary.get("no_growth_rate")
        return f"No growth rate: {reason}." if reason else "Not computed for this run."
    if rate > 0:
        text = f"Unstable: small disturbances of the final contact grow, e-fold in {1 / rate:.3g} s"
    elif rate < 0:
        text = f"Stable: small disturbances of the final contact decay, to 1/e in {-1 / rate:.3g} s"
    else:
        text = "Neutral"
    return f"{text} (growth rate {number_text(rate)} 1/s)."


def _images(directory: Path) -> dict[str, Path]:
    """Return the images of a run by their names, without those older than its results."""
    since = (directory / HISTORY).stat().st_mtime
    found = sorted((directory / FOLDER).glob("*.png"))
    return {path.stem: path for path in found if path.stat().st_mtime >= since}


def _figure(images: dict[str, Path], name: str, text: str, alt: str = "") -> Picture | None:
    if name not in images:
        return None
    path = images[name]
    return picture(path.read_bytes(), path.suffix[1:], text, alt or text)


def _bodies(images: dict[str, Path]) -> list[Picture | None]:
    """Return pictures of the bodies at the last half-cycle that has them."""
    pictures = []
    for field, text in FIELDS.items():
        names = [n for n in images if n.startswith(f"bodies_{field}_")]
        if names:
            title = f"{text[0].upper()}{text[1:]} at half-cycle {int(names[-1].rpartition('_')[2]):,}"
            alt = f"Deformed bodies near the contact, coloured by {text}."
            pictures.append(_figure(images, names[-1], title, alt))
    return pictures
