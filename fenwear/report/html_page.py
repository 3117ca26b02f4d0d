"""Pages that need nothing else, neither network nor scripts: their style, parts and frame."""

from __future__ import annotations

import base64
import html

STYLE = """
:root { color-scheme: light; }
body { font: 1rem/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 0 auto; max-width: 56rem;
  padding: 0 1rem 3rem; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.25; margin-bottom: .25rem; }
h2 { font-size: 1.2rem; margin-top: 2.5rem; border-bottom: 1px solid #bbb; }
h3 { font-size: 1rem; margin-top: 1.5rem; }
figure { margin: 1.5rem 0; break-inside: avoid; }
img { max-width: 100%; height: auto; display: block; }
figcaption, .note { color: #555; }
table { border-collapse: collapse; width: 100%; }
caption { text-align: left; font-weight: 600; padding: .8rem 0 .3rem; }
th, td { text-align: left; vertical-align: top; padding: .2rem .6rem .2rem 0;
  border-bottom: 1px solid #ddd; font-weight: 400; }
thead th { font-weight: 600; }
thead th:nth-child(2) { text-align: right; }
.places thead th:nth-child(2) { text-align: left; }
.comparison thead th:not(:first-child):not(:last-child) { text-align: right; white-space: nowrap; }
.comparison th[scope=row] { min-width: 18rem; }
.variants.comparison thead th:not(:first-child) { white-space: normal; overflow-wrap: normal; text-align: right; }
.variants.comparison th[scope=row] { min-width: 14rem; }
.stacked thead th:nth-child(2) { text-align: left; }
.stacked td { overflow-wrap: break-word; min-width: 5rem; }
.verdict { white-space: nowrap; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.unit { width: 3.5rem; }
.wide { overflow-x: auto; }
.warning { border-left: .3rem solid #d55e00; padding: .3rem .8rem; background: #fdf1ea; }
pre { white-space: pre-wrap; background: #f5f5f5; padding: .8rem; font-size: .85rem; }
summary { cursor: pointer; }
@media (max-width: 45rem) {
  .comparison th[scope=row], .variants.comparison th[scope=row] { min-width: 9rem; }
  .stacked thead { display: none; }
  .stacked tr { display: block; padding: .6rem 0; border-bottom: 1px solid #bbb; }
  .stacked td { display: block; border: 0; padding: 0; }
  .stacked td:first-child { font-weight: 600; }
  .stacked td:not(:first-child)::before { content: attr(data-column) ": "; color: #555; }
}
@media print { body { max-width: none; padding: 0; font-size: 10pt; } .animation { display: none; } }
"""


def escape(text: object) -> str:
    """Return a text as HTML shows it."""
    return html.escape(str(text), quote=True)


def section(title: str, content: str) -> str:
    """Return a section with its heading; nothing where it is empty."""
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>" if content else ""


def figure(image: bytes, suffix: str, alt: str, caption: str, kind: str = "") -> str:
    """Return an image inside the page.

    Args:
        image: The file's content.
        suffix: Of its type: "png", "gif".
        alt: What it shows, for those who do not see it.
        caption: Below it.
        kind: Attributes of the figure.
    """
    source = f"data:image/{suffix};base64,{base64.b64encode(image).decode('ascii')}"
    return (
        f'<figure{kind}>\n<img src="{source}" alt="{escape(alt)}">\n<figcaption>{escape(caption)}</figcaption>\n'
        "</figure>\n"
    )


def document(title: str, body: str) -> str:
    """Return the page; whatever stands in it, it loads nothing and runs nothing."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n"
        f'<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n'
        f"{body}\n</body>\n</html>\n"
    )
