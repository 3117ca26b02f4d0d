"""report.html: one page per run that needs nothing else, neither network nor scripts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import xarray

from fenwear.errors import CaseError, OutputError
from fenwear.report.figures import FOLDER, draw_figures, read_history
from fenwear.report.html_page import document, escape, figure, section
from fenwear.report.key_numbers import flat, label_of, number_text, read_case, read_summary, unit_of
from fenwear.report.pictures import DrawingError, draw_pictures
from fenwear.results.disk import write_text, writing
from fenwear.results.history import CASE, HISTORY

REPORT = "report.html"
SECTIONS = {"shape": "Worn shape", "pressure": "Pressure", "mean_pressure": "Mean pressure of both directions",
            "peaks": "Peaks over the half-cycles", "temperature": "Temperature along the contact",
            "boundary_temperature": "Temperature along the boundaries"}  # fmt: skip
ALT = {
    "shape": "Worn depth of the punch, and of the strip where it wears, in micrometres along the contact, "
    "a line for each chosen half-cycle.",
    "pressure": "Contact pressure in megapascals along the contact, a panel for each sliding direction, "
    "a line for each chosen half-cycle.",
    "mean_pressure": "Mean of the pressures of both sliding directions along the contact, a line for each cycle.",
    "peaks": "Largest pressure, width in contact and, with heat, largest temperature over the half-cycles.",
    "convergence": "Change of pressure against one cycle ago, and distance to the optimal pressure, over the "
    "half-cycles.",
    "temperature": "Temperature of the contact surfaces of punch and strip along the contact, a line for each chosen "
    "half-cycle.",
    "boundary_temperature": "Temperature round the punch from the middle of its contact on, and along the strip's "
    "upper surface, at the last half-cycle with fields.",
    "heat_balance": "Heat of each half-cycle: made by friction, lost, and gained by the bodies, over the half-cycles.",
}


def write_report(
    directory: Path, log: Callable[[str], None] = lambda message: None, *, complete: bool = False
) -> list[Path]:
    """Draw a run's figures and write its report.html; return the files.

    Args:
        directory: The folder of the run.
        log: Called with a message where pictures of the bodies cannot be drawn.
        complete: Draw the animation and the pictures of the bodies, too, which takes longer.

    Raises:
        CaseError: the folder holds no run.
        OutputError: a figure or the page cannot be written.
    """
    with writing(directory):
        return _write_report(directory, log, complete)


def _write_report(directory: Path, log: Callable[[str], None], complete: bool) -> list[Path]:
    case = read_case(directory)
    paths = draw_figures(directory, case.get("output", {}).get("figures_at", ()))
    if complete:
        from fenwear.report.animation import draw_animation

        paths.append(draw_animation(directory))
        try:
            paths += draw_pictures(directory)
        except DrawingError as error:
            log(f"warning: {error}")
    report = directory / REPORT
    write_text(report, page(directory))
    return [*paths, report]


def try_report(directory: Path, log: Callable[[str], None]) -> None:
    """Write the report of a run whose results are safe already: what fails here is a warning."""
    try:
        write_report(directory, log)
    except (CaseError, OutputError, ImportError, OSError, RuntimeError, ValueError) as error:
        log(f"warning: no report of the run: {error}; to try again: python -m fenwear plot {directory}")


def page(directory: Path) -> str:
    """Return report.html of a run whose figures are drawn."""
    history, summary = read_history(directory), read_summary(directory)
    images = _images(directory)
    title = str(history.attrs.get("title", "")) or "fenwear run"
    parts = [
        _head(title, directory, summary, history),
        _warnings(summary),
        section("Key numbers", _key_numbers(summary, history)),
        section("Figures", "".join(_figure(images, name, text) for name, text in SECTIONS.items())),
        section("Bodies", _bodies(images)),
        section("Convergence", _convergence(summary) + _figure(images, "convergence", "Periodicity and optimum")),
        section("Energy balance", _energy(summary, history) + _figure(images, "heat_balance", "Heat balance")),
        section("Stability", _stability(summary, history)),
        section("Case", _details("the resolved case file, which runs again as it is",
                                  (directory / CASE).read_text("utf-8"))),
        section("Versions", _versions(summary)),
    ]  # fmt: skip
    return document(title, "\n".join(part for part in parts if part) + "\n</main>")


def _head(title: str, directory: Path, summary: dict[str, Any], history: xarray.Dataset) -> str:
    last = int(history.half_cycle[-1])
    stop = summary.get("stop", "no summary yet: the run still goes on, or it was killed")
    written = datetime.fromtimestamp((directory / HISTORY).stat().st_mtime).astimezone()
    stamp = f'<time datetime="{written.isoformat(timespec="seconds")}">{written:%d %B %Y, %H:%M %Z}</time>'
    return (
        f"<header>\n<h1>{escape(title)}</h1>\n<p>Run <strong>{escape(directory.resolve().name)}</strong>: "
        f"{last:,} half-cycles; {escape(stop)}. Results of {stamp}.</p>\n</header>\n<main>"
    )


def _warnings(summary: dict[str, Any]) -> str:
    found = [f'<p class="warning"><strong>Warning:</strong> {escape(text)}</p>' for text in summary.get("warnings", ())]
    return section("Warnings", "\n".join(found)) or "<p>No warnings.</p>"


def _data(path: str, value: Any) -> str:
    return f'<data value="{escape(value)}" id="{escape(path)}">{escape(number_text(value))}</data>'


def _rows(values: dict[str, Any], *, cut: int = 0) -> str:
    return "\n".join(
        f'<tr><th scope="row">{escape(label_of(path[cut:]))}</th><td class="number">{_data(path, value)}</td>'
        f'<td class="unit">{escape(unit_of(path))}</td></tr>'
        for path, value in values.items()
    )


def _table(caption: str, rows: str, columns: Sequence[str] = ("quantity", "value", "unit"), kind: str = "wide") -> str:
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in columns)
    return (
        f'<div class="{kind}" role="region" aria-label="{escape(caption)}" tabindex="0">'
        f"<table>\n<caption>{escape(caption)}</caption>\n<thead><tr>{head}</tr></thead>\n"
        f"<tbody>\n{rows}\n</tbody>\n</table></div>"
    )


def numbers_of(summary: dict[str, Any]) -> dict[str, int | float]:
    """Return every number of a summary by its path."""
    values = flat({key: value for key, value in summary.items() if key not in ("versions", "warnings", "retries")})
    return {k: v for k, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}


def _key_numbers(summary: dict[str, Any], history: xarray.Dataset) -> str:
    if not summary:
        last = {name: float(history[name][-1]) for name in ("max_pressure", "contact_width", "periodicity")}
        units = {"max_pressure": "_MPa", "contact_width": "_mm"}
        return _table("At the last recorded half-cycle", _rows({n + units.get(n, ""): v for n, v in last.items()}))
    numbers = numbers_of(summary)
    places = summary.get("x_mm", [])
    single = {path: value for path, value in numbers.items() if "[" not in path and "." not in path}
    directions = [d for d in ("rightward", "leftward") if d in summary]
    listed = [p.removesuffix("[0]") for p in numbers if p.endswith("[0]") and p != "x_mm[0]"]
    tables = [_table("The run", _rows(single))]
    for d in directions:
        inside = {p: v for p, v in numbers.items() if p.startswith(f"{d}.") and "[" not in p}
        tables.append(_table(f"Last half-cycle with the strip moving {d}", _rows(inside, cut=len(d) + 1)))
    if listed and places:
        rows = "\n".join(
            f'<tr><th scope="row">{escape(label_of(path))}</th><td>{escape(unit_of(path))}</td>'
            + "".join(f'<td class="number">{_data(p, numbers[p])}</td>' for p in _indexed(path, numbers))
            + "</tr>"
            for path in listed
        )
        at = "".join(f'<td class="number">{_data(p, numbers[p])}</td>' for p in _indexed("x_mm", numbers))
        rows = f'<tr><th scope="row">position x</th><td>mm</td>{at}</tr>\n{rows}'
        tables.append(_table("At places along the contact, end of the run", rows,
                             ("quantity", "unit", *("" for _ in places)), "wide places"))  # fmt: skip
    return "\n".join(tables)


def _indexed(path: str, numbers: dict[str, Any]) -> list[str]:
    return [p for p in numbers if p.startswith(f"{path}[")]


def _convergence(summary: dict[str, Any]) -> str:
    change = summary.get("periodicity")
    retries = "".join(
        f"<p>Where the usual way did not converge: {escape(name)}, {count} times.</p>"
        for name, count in summary.get("retries", {}).items()
    )
    if change is None or math.isnan(change):
        return retries
    word = "repeats from cycle to cycle" if change < 1e-3 else "still changes from cycle to cycle"
    return (
        f"<p>At the end the pressure {word}: its largest change against one cycle ago is {100 * change:.3g} % of the "
        f"mean pressure.</p>{retries}"
    )


def _energy(summary: dict[str, Any], history: xarray.Dataset) -> str:
    error = summary.get("largest_equilibrium_error")
    force = "" if error is None else f"<p>Force and moment balance: error at most {error:.1e} of the load.</p>"
    if "heat_friction" not in history:
        return force + "<p>This case has no heat.</p>"
    heat = {path: v for path, v in numbers_of(summary).items() if path.startswith("heat_mJ.")}
    missing = summary.get("largest_heat_balance_error", float(history.heat_balance_error.max()))
    return (
        force
        + f"<p>Heat balance: over all half-cycles at most {missing:.1e} of the largest term is missing.</p>"
        + (_table("Heat of the last half-cycle", _rows(heat, cut=len("heat_mJ."))) if heat else "")
    ).replace(">friction<", ">made by friction<")


def _stability(summary: dict[str, Any], history: xarray.Dataset) -> str:
    rate = summary.get("growth_rate_per_s")
    if rate is None or not math.isfinite(rate):
        known = "max_temperature" in history
        reason = escape(str(summary.get("no_growth_rate", "")))
        why = f"<p>No growth rate: {reason}.</p>" if reason else "<p>Not computed for this run.</p>"
        return why if known else "<p>Computed with heat only.</p>"
    if rate > 0:
        text = f"Unstable: small disturbances of the final contact grow, e-fold in {1 / rate:.3g} s"
    else:
        text = (
            f"Stable: small disturbances of the final contact decay, to 1/e in {-1 / rate:.3g} s" if rate else "Neutral"
        )
    return f"<p>{text} (growth rate {number_text(rate)} 1/s).</p>"


def _versions(summary: dict[str, Any]) -> str:
    versions = summary.get("versions", {})
    return _details("fenwear and the stack below it", "\n".join(f"{n} {v}" for n, v in versions.items()))


def _details(title: str, text: str) -> str:
    return f"<details><summary>{escape(title)}</summary>\n<pre>{escape(text)}</pre>\n</details>" if text else ""


def _images(directory: Path) -> dict[str, Path]:
    """Return the images of a run by their names, without those older than its results."""
    since = (directory / HISTORY).stat().st_mtime
    found = sorted((directory / FOLDER).glob("*.png")) + sorted((directory / FOLDER).glob("*.gif"))
    return {path.name.removesuffix(".png"): path for path in found if path.stat().st_mtime >= since}


def _figure(images: dict[str, Path], name: str, caption: str, alt: str = "", kind: str = "") -> str:
    if name not in images:
        return ""
    path = images[name]
    return figure(path.read_bytes(), path.suffix[1:], alt or ALT[name], caption, kind)


def _bodies(images: dict[str, Path]) -> str:
    """Return pictures of the bodies at the last half-cycle that has them, and the animations behind a click."""
    words = {"von_mises": "von Mises stress", "temperature": "temperature"}
    parts = []
    for field, text in words.items():
        names = [n for n in images if n.startswith(f"bodies_{field}_")]
        if names:
            number = int(names[-1].rpartition("_")[2])
            alt = f"Deformed punch and strip near the contact, coloured by {text}, at half-cycle {number:,}."
            parts.append(_figure(images, names[-1], f"{text[0].upper()}{text[1:]} at half-cycle {number:,}", alt))
    for name, text in (
        ("history.gif", "pressure and worn shape over the run"),
        *((f"bodies_{field}.gif", f"the bodies over the run: {word}") for field, word in words.items()),
    ):
        picture = _figure(images, name, text, f"Animation: {text}.")
        if picture:
            parts.append(
                f'<details class="animation"><summary>Animation: {escape(text)}</summary>\n{picture}</details>'
            )
    return "\n".join(parts)
