"""The comparison as a piece of HTML that a page includes, as lines of text, and as numbers for programs."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, get_args

import numpy as np
from markupsafe import Markup

from fenwear.common.arrays import Array
from fenwear.report.page import Picture, picture, render
from fenwear_verify.paper.figures import Picture as Drawing
from fenwear_verify.paper.figures import paper_figures
from fenwear_verify.paper.published import OPEN
from fenwear_verify.paper.readings import TRIED
from fenwear_verify.paper.rows import Row, Verdict, paper_rows, sensitivity_rows
from fenwear_verify.paper.states import FULL, HeatRun, Scope, StabilityMap, Variant
from fenwear_verify.paper.study import central_runs, heat_runs, stability_maps

COLUMNS = ("quantity", "paper", "fenwear", "verdict", "why")
NUMBERS = (
    "one-way (K)", "periodic (K)", "growth (1/s)", "at the end (K)", "narrowest (mm)", "middle (MPa)", "centre (MPa)",
)  # fmt: skip
LEGEND = (
    "One-way and periodic: temperature at x = 0 of the two one-way motions together and of the state that repeats. "
    "Growth: of the least stable disturbance of that state. At the end: temperature at x = 0 of the run. Narrowest: "
    "least width in contact of the run. Middle, centre: its largest pressure on the middle two thirds, and at x = 0 as "
    "mean of both directions, after the flat punch's edges have worn off."
)
COURSE = (200, 800, 1400, 2200)  # values of the paper's n
READING = (
    "reading", "fitted", "against the paper", "one-way (K)", "periodic (K)", "growth (1/s)",
    *(f"n = {n:,} (K)" for n in COURSE), "largest (MPa)", "at n", "splits at n", "width (mm)", "Example 2 (MPa)",
)  # fmt: skip
READING_LEGEND = (
    "One-way: what stands beside 47.16 K. Periodic, growth: of the state that repeats, beside 50.11 K. Then the run: "
    "temperature at x = 0, largest pressure on the middle two thirds and when, width in contact at its least and in "
    "the end. Example 2: largest pressure at the centre, mean of both directions, beside 33.33 MPa."
)


def write_section(scope: Scope = FULL) -> Markup:
    """Return the comparison as HTML without head or style: tables and figures with their images inline; collective."""
    rows, runs = paper_rows(scope), heat_runs(scope)
    choices, discretisations = sensitivity_rows(scope)
    return render(
        "paper.html",
        open=OPEN,
        tried=TRIED,
        summary=summary(rows),
        columns=COLUMNS,
        rows=[_cells(row) for row in rows],
        reading_legend=READING_LEGEND,
        map_text=map_text(stability_maps(scope)),
        reading_columns=READING,
        readings=[_reading_cells(run, two) for run, two in zip(runs, central_runs(scope), strict=True)],
        commands=[run.reading for run in runs],
        pictures=[_drawn(one) for one in paper_figures(scope)],
        legend=LEGEND,
        numbers=NUMBERS,
        choices=[(v.name, *_numbers(v)) for v in choices],
        convergence=convergence_text(discretisations),
        discretisations=[(v.name, *_numbers(v)) for v in discretisations],
    )


def summary(rows: Sequence[Row]) -> str:
    """Return how many rows have which verdict, in a sentence."""
    counts = [f"{sum(row.verdict == verdict for row in rows)} are {verdict}" for verdict in get_args(Verdict)]
    return f"Of {len(rows)} rows {', '.join(counts)}."


def map_text(maps: Sequence[StabilityMap]) -> str:
    """Return where the paper's two temperatures and neutral stability lie on each map, in sentences."""
    parts = []
    for one in maps:
        apart = one.periodic - one.one_way
        cross = next((k for k in range(len(apart) - 1) if apart[k] * apart[k + 1] <= 0), None)
        if cross is None:
            meets = "no conductance of the map gives both temperatures"
        else:
            weight = apart[cross] / (apart[cross] - apart[cross + 1])
            conductance, share, neutral = (
                float(values[cross] + weight * (values[cross + 1] - values[cross]))
                for values in (one.conductance, one.one_way, one.neutral)
            )
            beyond = "" if np.isnan(neutral) else f", where the state is stable up to {neutral:.2f}"
            meets = f"both temperatures ask for h_c = {conductance:.0f} and a share of {share:.2f}{beyond}"
        parts.append(f"With {one.name}, {meets}.")
    return " ".join(parts)


def readings_markdown(runs: Sequence[HeatRun], central: Sequence[HeatRun | None]) -> str:
    """Return what every reading gives as a Markdown table."""
    cells = [_reading_cells(run, two) for run, two in zip(runs, central, strict=True)]
    return _markdown([READING, ("---",) * len(READING), *cells])


def convergence_text(variants: Sequence[Variant]) -> str:
    """Return how far the last of each group is from the one before it, in sentences."""
    parts = []
    for group in dict.fromkeys(v.group for v in variants):
        before, last = [v for v in variants if v.group == group][-2:]
        parts.append(
            f"From {before.name} to {last.name} the temperature at the end changes by "
            f"{abs(last.late - before.late):.2g} K, the periodic one by "
            f"{abs(last.steady.periodic - before.steady.periodic):.2g} K, the largest pressure in the middle by "
            f"{abs(last.peak - before.peak):.2g} MPa, the growth rate by "
            f"{abs(last.steady.growth - before.steady.growth):.1g} 1/s."
        )
    return " ".join(parts)


def as_json(scope: Scope = FULL) -> dict[str, Any]:
    """Return rows, readings, the map of stability and the variants, as JSON takes them; collective."""
    choices, discretisations = sensitivity_rows(scope)
    return {
        "rows": [asdict(row) for row in paper_rows(scope)],
        "readings": [_reading_json(run, two) for run, two in zip(heat_runs(scope), central_runs(scope), strict=True)],
        "stability": [_map_json(one) for one in stability_maps(scope)],
        "convergence": [_variant_json(variant) for variant in discretisations],
        "open_choices": [_variant_json(variant) for variant in choices],
    }


def lines(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines of a terminal."""
    found = []
    for row in rows:
        found += [f"{row.quantity}: {row.verdict}", f"    paper {row.paper}; fenwear {row.ours}", f"    {row.why}"]
    return found


def markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    return _markdown([COLUMNS, ("---",) * len(COLUMNS), *(_cells(row) for row in rows)])


def _markdown(lines: Sequence[Sequence[str]]) -> str:
    return "\n".join("| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in lines)


def _drawn(one: Drawing) -> Picture:
    buffer = io.BytesIO()
    one.figure.savefig(buffer, format="png", dpi=120)
    words = f"{one.title}. {one.caption}"
    return picture(buffer.getvalue(), "png", words, words)


def _cells(row: Row) -> tuple[str, ...]:
    return (row.quantity, row.paper, row.ours, row.verdict, row.why)


def _numbers(v: Variant) -> tuple[str, ...]:
    return (
        f"{v.steady.monotonic:.2f}",
        f"{v.steady.periodic:.2f}",
        f"{v.steady.growth:+.4f}",
        f"{v.late:.2f}",
        f"{v.narrowest:.1f}",
        f"{v.peak:.1f}",
        f"{v.central:.1f}",
    )


def _reading_cells(run: HeatRun, two: HeatRun | None) -> tuple[str, ...]:
    reading = run.reading
    return (
        reading.name,
        reading.fitted or "nothing",
        reading.against or "nothing",
        f"{run.one_way:.2f}",
        f"{run.steady.periodic:.2f}",
        f"{run.steady.growth:+.4f}",
        *(f"{run.at_centre(n):.2f}" for n in COURSE),
        f"{run.middle_pressure[run.bulged].max():.1f}",
        f"{run.peak_half_cycle:,}",
        "never" if run.opened is None else f"{run.opened:,}",
        f"{run.width.min():.0f}, {run.width[-1]:.0f}",
        "" if two is None else f"{two.central_pressure[two.bulged].max():.1f}",
    )


def _reading_json(run: HeatRun, two: HeatRun | None) -> dict[str, Any]:
    reading = run.reading
    return {
        **{name: list(value) if isinstance(value, tuple) else value for name, value in asdict(reading).items()},
        "command": reading.command,
        "one_way_temperature": run.one_way,
        "periodic_temperature": run.steady.periodic,
        "growth_rate": run.steady.growth,
        "temperature": {str(n): run.at_centre(n) for n in COURSE},
        "middle_pressure": float(run.middle_pressure[run.bulged].max()),
        "peak_half_cycle": run.peak_half_cycle,
        "splits_at": run.opened,
        "narrowest_contact": float(run.width.min()),
        "contact_at_end": float(run.width[-1]),
        "central_pressure": None if two is None else float(two.central_pressure[two.bulged].max()),
    }


def _map_json(one: StabilityMap) -> dict[str, Any]:
    def numbers(values: Array) -> Any:
        found = values.astype(object)
        found[np.isnan(values)] = None  # JSON knows no NaN
        return found.tolist()

    return {
        "name": one.name,
        "conductance": one.conductance.tolist(),
        "share": one.share.tolist(),
        "growth_rate": numbers(one.growth),
        "one_way_share": one.one_way.tolist(),
        "periodic_share": one.periodic.tolist(),
        "neutral_share": numbers(one.neutral),
    }


def _variant_json(v: Variant) -> dict[str, Any]:
    return {
        "group": v.group,
        "name": v.name,
        "one_way_temperature": v.steady.monotonic,
        "periodic_temperature": v.steady.periodic,
        "growth_rate": v.steady.growth,
        "late_temperature": v.late,
        "narrowest_contact": v.narrowest,
        "middle_pressure": v.peak,
        "central_pressure": v.central,
    }
