"""The comparison as a piece of HTML that a page includes, as lines of text, and as numbers for programs."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, get_args

from fenwear.paper.figures import paper_figures
from fenwear.paper.published import OPEN
from fenwear.paper.rows import NEUTRAL, Row, Verdict, needed_shares, paper_rows, sensitivity_rows
from fenwear.paper.study import FULL, Scope, Variant
from fenwear.report.html_page import escape, figure

COLUMNS = ("quantity", "paper", "fenwear", "verdict", "why")
NUMBERS = ("kappa", "one-way (K)", "periodic (K)", "growth (1/s)", "narrowest (mm)", "middle (MPa)", "centre (MPa)")
LEGEND = (
    "One-way and periodic: temperature at x = 0 of the two one-way motions together and of the state that repeats. "
    "Growth: of the least stable disturbance of that state. Narrowest: least width in contact of a run. Middle, "
    "centre: its largest pressure on the middle third, and at x = 0 as mean of both directions, after the flat punch's "
    "edges have worn off."
)


def write_section(scope: Scope = FULL) -> str:
    """Return the comparison as HTML without head or style: tables and figures with their images inline; collective."""
    rows, pictures = paper_rows(scope), paper_figures(scope)
    choices, discretisations = sensitivity_rows(scope)
    drawn = [figure(_png(p.figure), "png", f"{p.title}. {p.caption}", f"{p.title}. {p.caption}") for p in pictures]
    return "\n".join(
        [
            f"<p>The paper leaves open: {escape('; '.join(OPEN))}. Nothing is fitted to its numbers. A number is "
            "reproduced where ours agrees to one unit of the last digit printed, and under an assumption where that "
            "needs a value that the paper does not give.</p>",
            f"<p>{escape(summary(rows))}</p>",
            table(rows),
            f"<p>{escape(needed_text(needed_shares(scope)))}</p>",
            *drawn[:-2],
            "<h3>What the paper leaves open</h3>",
            f"<p>{escape(LEGEND)}</p>",
            drawn[-2],
            variants_table("choice", choices),
            "<h3>Mesh and time step</h3>",
            f"<p>{escape(convergence_text(discretisations))}</p>",
            drawn[-1],
            variants_table("mesh or time step", discretisations),
        ]
    )


def summary(rows: Sequence[Row]) -> str:
    """Return how many rows have which verdict, in a sentence."""
    counts = [f"{sum(row.verdict == verdict for row in rows)} are {verdict}" for verdict in get_args(Verdict)]
    return f"Of {len(rows)} rows {', '.join(counts)}."


def needed_text(needed: dict[str, float | None]) -> str:
    """Return which kappa each number needs, in a sentence."""
    parts = [
        f"{name} {'no kappa of ours' if s is None else f'{s:.3f}'}" for name, s in needed.items() if name != NEUTRAL
    ]
    neutral = needed[NEUTRAL]
    beyond = "" if neutral is None else f" Above {neutral:.3f} the periodic state of Example 1 is unstable."
    return f"The kappa that each number needs: {', '.join(parts)}.{beyond}"


def convergence_text(variants: Sequence[Variant]) -> str:
    """Return how far the finest of each group is from the one before it, in a sentence."""
    parts = []
    for group in dict.fromkeys(v.group for v in variants):
        names = list(dict.fromkeys(v.name for v in variants if v.group == group))
        before, last = ([v for v in variants if v.name == name] for name in names[-2:])
        kelvin = max(abs(b.steady.periodic / a.steady.periodic - 1) for a, b in zip(before, last, strict=True))
        growth = max(abs(b.steady.growth - a.steady.growth) for a, b in zip(before, last, strict=True))
        parts.append(
            f"From {names[-2]} to {names[-1]} the periodic temperatures change by at most {kelvin:.1g} of their value, "
            f"the growth rates by {growth:.1g} 1/s."
        )
    return " ".join(parts)


def as_json(scope: Scope = FULL) -> dict[str, Any]:
    """Return rows, the kappa that each number needs, and the variants, as JSON takes them; collective."""
    choices, discretisations = sensitivity_rows(scope)
    return {
        "rows": [asdict(row) for row in paper_rows(scope)],
        "needed_partition": needed_shares(scope),
        "convergence": [_variant_json(variant) for variant in discretisations],
        "open_choices": [_variant_json(variant) for variant in choices],
    }


def lines(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines of a terminal."""
    found = []
    for row in rows:
        found += [f"{row.quantity}: {row.verdict}", f"    paper {row.paper}; fenwear {row.ours}", f"    {row.why}"]
    return found


def table(rows: Sequence[Row]) -> str:
    """Return the rows as an HTML table whose cells name their column where the page is narrow."""
    head = "".join(f'<th scope="col">{name}</th>' for name in COLUMNS)
    body = "\n".join(
        "<tr>"
        + "".join(
            f'<td data-column="{name}">{escape(text)}</td>' for name, text in zip(COLUMNS, _cells(row), strict=True)
        )
        + "</tr>"
        for row in rows
    )
    return f'<table class="stacked">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>'


def variants_table(what: str, variants: Sequence[Variant]) -> str:
    """Return the numbers of variants as an HTML table."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in (what, *NUMBERS))
    body = "\n".join(
        f'<tr><th scope="row">{escape(v.name)}</th>'
        + "".join(f'<td class="number">{text}</td>' for text in _numbers(v))
        + "</tr>"
        for v in variants
    )
    return (
        f'<div class="wide" role="region" aria-label="{escape(what)}" tabindex="0">'
        f'<table class="comparison variants">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>"
    )


def markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    found = [COLUMNS, ("---",) * len(COLUMNS), *(_cells(row) for row in rows)]
    return "\n".join("| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in found)


def _png(canvas: Any) -> bytes:
    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()


def _cells(row: Row) -> tuple[str, ...]:
    return (row.quantity, row.paper, row.ours, row.verdict, row.why)


def _numbers(v: Variant) -> tuple[str, ...]:
    return (
        f"{v.share:g}",
        f"{v.steady.monotonic:.2f}",
        f"{v.steady.periodic:.2f}",
        f"{v.steady.growth:+.4f}",
        f"{v.narrowest:.1f}",
        f"{v.peak:.1f}",
        f"{v.central:.1f}",
    )


def _variant_json(v: Variant) -> dict[str, Any]:
    return {
        "group": v.group,
        "name": v.name,
        "partition": v.share,
        "one_way_temperature": v.steady.monotonic,
        "periodic_temperature": v.steady.periodic,
        "growth_rate": v.steady.growth,
        "narrowest_contact": v.narrowest,
        "middle_pressure": v.peak,
        "central_pressure": v.central,
    }
