"""The comparison as a piece of HTML that a page includes: its table and its pictures, inline."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence

from fenwear.paper.figures import Picture, paper_figures
from fenwear.paper.published import OPEN
from fenwear.paper.rows import Row, paper_rows
from fenwear.paper.study import FULL, Scope

COLUMNS = ("quantity", "paper", "fenwear", "verdict", "why")


def write_section(scope: Scope = FULL) -> str:
    """Return the comparison as HTML without head or style: a table and figures with their images inline; collective."""
    left_open = "; ".join(OPEN)
    return "\n".join(
        [
            f"<p>The paper leaves open: {html.escape(left_open)}. Nothing is fitted to its numbers.</p>",
            table(paper_rows(scope)),
            *(figure(picture) for picture in paper_figures(scope)),
        ]
    )


def table(rows: Sequence[Row]) -> str:
    """Return the rows as an HTML table."""
    head = "".join(f'<th scope="col">{name}</th>' for name in COLUMNS)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in _cells(row)) + "</tr>" for row in rows
    )
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def markdown(rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = [COLUMNS, ("---",) * len(COLUMNS), *(_cells(row) for row in rows)]
    return "\n".join("| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in lines)


def figure(picture: Picture) -> str:
    """Return a picture as an HTML figure with its image inline."""
    buffer = io.BytesIO()
    picture.figure.savefig(buffer, format="png", dpi=120)
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    title, caption = html.escape(picture.title), html.escape(picture.caption)
    return (
        f'<h3>{title}</h3>\n<figure><img alt="{title}" src="data:image/png;base64,{data}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _cells(row: Row) -> tuple[str, ...]:
    return (row.quantity, row.paper, row.ours, row.verdict, row.why)
