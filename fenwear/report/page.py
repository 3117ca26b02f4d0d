"""report.html: one page per run that needs nothing else, neither network nor scripts.

The first screen answers what was asked: warnings, how much is worn and where, largest pressure and temperature with
their uncertainty, whether the run has become stationary, and a picture. Figures follow, then tables, folded.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import jinja2
import xarray
from markupsafe import Markup

from fenwear.case.body_names import BY_ROLE, Names
from fenwear.common.errors import CaseError, OutputError
from fenwear.report.body_figures import DrawingError, draw_pictures
from fenwear.report.figures import FOLDER, TEXTS, caption, draw_figures
from fenwear.report.key_numbers import Number, answers, flat, names_in, read_case, read_summary, states
from fenwear.report.style import STANDARD, Style
from fenwear.results.disk import write_text, writing
from fenwear.results.history import CASE, HISTORY
from fenwear.results.quantity import BODIES
from fenwear.results.registry import known
from fenwear.results.sheet import UNCERTAINTY
from fenwear.results.stored_history import read_history

REPORT = "report.html"
WAYS = ("rightward", "leftward", "forward", "backward", "counterclockwise", "clockwise", "cyclically")
# The first of these that there is stands on the first screen.
FIRST = ("bodies_temperature", "bodies_von_mises", "wear_map", "profiles", "shape")
BODY_FIELDS = {"bodies_von_mises": "Von Mises stress", "bodies_temperature": "Temperature"}
BALANCES = {
    "largest_equilibrium_error": "Force and moment balance: error at most {:.1e} of the load.",
    "largest_complementarity_error": "No pull, overlap or pressure over a gap: error at most {:.1e} of their scales.",
    "largest_heat_balance_error": "Heat balance: at most {:.1e} of the largest term is missing in any half-cycle.",
}
AT_LAST = ("largest_pressure", "contact_width", "contact_area", "periodicity")


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
        complete: Draw all pictures of the bodies, which takes longer.
        look: Width and axis of the figures.
        formats: Of the files, "png", "pdf" and "svg".

    Raises:
        CaseError: the folder holds no run.
        OutputError: a figure or the page cannot be written.
    """
    with writing(directory):
        wanted = read_case(directory).get("output", {}).get("figures_at", ())
        paths = draw_figures(directory, wanted, look, formats)
        try:
            paths += draw_pictures(directory, formats, complete=complete)
        except DrawingError as error:
            log(f"warning: {error}")
        report = directory / REPORT
        write_text(report, page(directory, look))
        return [*paths, report]


def try_report(directory: Path, log: Callable[[str], None]) -> None:
    """Write the report of a run whose results are safe already: what fails here is a warning."""
    try:
        write_report(directory, log)
    except (CaseError, OutputError, ImportError, OSError, RuntimeError, ValueError) as error:
        log(f"warning: no report of the run: {error}; to try again: python -m fenwear plot {directory}")


def page(directory: Path, look: Style = STANDARD) -> str:
    """Return report.html of a run whose figures are drawn."""
    history, summary = read_history(directory), read_summary(directory)
    written = (directory / HISTORY).stat().st_mtime
    figures = _figures(directory, written, history, look)
    first = next((name for start in FIRST for name in figures if name.startswith(start)), "")
    return render(
        "report.html",
        names_in(directory),
        title=str(history.attrs.get("title", "")) or "fenwear run",
        name=directory.resolve().name,
        half_cycles=int(history.half_cycle[-1]),
        stop=summary.get("stop", "no summary yet: the run has not ended, or it was killed"),
        written=datetime.fromtimestamp(written).astimezone(),
        warnings=summary.get("warnings", ()),
        answers=answers(summary),
        states=[*states(summary), *_retries(summary)],
        first=figures.get(first),
        figures=[figure for name, figure in figures.items() if name != first],
        tables=_tables(summary, history),
        balances=_balances(summary, history),
        uncertainty={"remedies": {}, "untold": {}} | summary.get(UNCERTAINTY, {}),
        case=(directory / CASE).read_text("utf-8"),
        versions="\n".join(f"{name} {version}" for name, version in summary.get("versions", {}).items()),
    )


def numbers_of(summary: Mapping[str, Any]) -> dict[str, float]:
    """Return every number of a summary by its path."""
    left_out = ("versions", "warnings", "retries", UNCERTAINTY)
    values = flat({key: value for key, value in summary.items() if key not in left_out})
    return {k: v for k, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}


def _tables(summary: Mapping[str, Any], history: xarray.Dataset) -> dict[str, list[Number]]:
    """Return all numbers of a summary in tables, by their captions; of a run without one those of its history."""
    if not summary:
        quantities = [known(name) for name in AT_LAST if name in history]
        last = [Number.of(quantity.key, float(history[quantity.name][-1]), quantity.key) for quantity in quantities]
        return {"At the last recorded half-cycle": last}
    numbers, places = numbers_of(summary), summary.get("x_mm", [])
    starts = {"sliding": "Quantities that a tribometer measures", **{body: body.capitalize() for body in BODIES}}
    for way in WAYS:
        starts[way] = f"Last half-cycle with the strip {'turning' if 'clockwise' in way else 'moving'} {way}"
    starts |= {"heat_mJ": "Heat of the last half-cycle"}
    starts |= {f"contacts.{name}": f"Contact {name}" for name in summary.get("contacts", {})}
    tables: dict[str, list[Number]] = {text: [] for text in (*starts.values(), "Along the contact", "The run")}
    for path, value in numbers.items():
        bare, _, place = path.rstrip("]").partition("[")
        start = next((prefix for prefix in starts if path.startswith(f"{prefix}.")), "")
        if place:
            at = f" at x = {places[int(place)]:.4g} mm" if places else ""
            row = Number.of(path, value, bare)
            tables["Along the contact"].append(row._replace(label=row.label + at))
        else:
            tables[starts.get(start, "The run")].append(Number.of(path, value, path.removeprefix(f"{start}.")))
    return {text: rows for text, rows in tables.items() if rows}


def _retries(summary: Mapping[str, Any]) -> list[str]:
    retries = summary.get("retries", {})
    return [f"The first attempt did not converge, {count} times: {way}." for way, count in retries.items()]


def _balances(summary: Mapping[str, Any], history: xarray.Dataset) -> list[str]:
    """Return the largest errors of the balances in sentences."""
    given = dict(summary)
    if "heat_balance_error" in history:
        given.setdefault("largest_heat_balance_error", float(history.heat_balance_error.max()))
    return [text.format(given[key]) for key, text in BALANCES.items() if key in given]


def _figures(directory: Path, written: float, history: xarray.Dataset, look: Style) -> dict[str, Picture]:
    """Return the images of a run in the order of `TEXTS`, without those older than its results.

    Of pictures of the bodies those at the last half-cycle that has them.
    """
    images = {path.stem: path for path in sorted((directory / FOLDER).glob("*.png")) if path.stat().st_mtime >= written}
    captions = {}
    for start, words in BODY_FIELDS.items():
        names = [name for name in images if name.startswith(start)]
        for name in names[-1:]:
            captions[name] = f"{words} in the deformed bodies, half-cycle {int(name.rpartition('_')[2]):,}."
    rest = [name for name in images if not name.startswith(tuple(BODY_FIELDS)) and name not in TEXTS]
    captions |= {name: caption(name, history, look) for name in (*TEXTS, *rest) if name in images}
    figures = {}
    for name, text in captions.items():
        figures[name] = picture(images[name].read_bytes(), images[name].suffix[1:], text, text)
    return figures


@dataclass(frozen=True)
class Picture:
    """An image inside the page.

    Attributes:
        source: The image itself, as a data URL.
        caption: Below it.
        alt: Description for readers who do not see it.
    """

    source: str
    caption: str
    alt: str


def picture(image: bytes, suffix: str, caption: str, alt: str) -> Picture:
    """Return an image file's content, of the type of its suffix ("png", "gif"), as a part of a page."""
    return Picture(f"data:image/{suffix};base64,{base64.b64encode(image).decode('ascii')}", caption, alt)


def time(moment: datetime) -> Markup:
    """Return a time for readers and programs."""
    return Markup('<time datetime="{}">{}</time>').format(
        moment.isoformat(timespec="seconds"), f"{moment:%d %B %Y, %H:%M %Z}"
    )


_TEMPLATES = jinja2.Environment(
    loader=jinja2.PackageLoader("fenwear.report"),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_TEMPLATES.globals["time"] = time


def render(template: str, names: Names = BY_ROLE, **values: object) -> Markup:
    """Return a template with its values; every text among them that is no Markup is escaped, and names the bodies."""

    def with_names(value: object) -> object:
        plain = isinstance(value, str) and not isinstance(value, Markup) and not value.startswith("data:")
        return names.with_names(str(value)) if plain else value

    templates = _TEMPLATES.overlay(finalize=with_names) if names.given else _TEMPLATES
    return Markup(templates.get_template(template).render(values))
