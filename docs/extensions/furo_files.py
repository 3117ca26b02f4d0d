"""Lets the theme's own files work where Debian's do not.

Its script is a module, which browsers refuse to load from the disk, and which does not find the constructor in the
module that it imports: no button for dark pages, and no place shown in the table of contents. Its style sheet lacks
the colours of a reader whose system is dark. Both are made whole from the theme's own text, where they are not.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import furo

SCRIPT, STYLE = "scripts/page.js", "styles/dark.css"
DARK = re.compile(
    r'^ *body\[data-theme="dark"\] \{(?P<colours>[^{}]*--color-background-primary:[^{}]*)\}', re.MULTILINE
)


def _script(folder: Path) -> str:
    """Return the theme's script as one that needs no import."""
    names = ("gumshoe-patched.js", "furo.js")
    imported, text = ((folder / "scripts" / name).read_text("utf-8") for name in names)
    text = re.sub(r"^import .*\n|^ *console\.log\(.*\);?\n", "", text, flags=re.MULTILINE)
    return f"{imported}\n(() => {{\n{text}}})();\n"


def _style(folder: Path) -> str:
    """Return the dark colours for those who did not choose, where the theme has them only for those who did."""
    text = (folder / "styles" / "furo.css").read_text("utf-8")
    found = DARK.search(text)
    if found is None or re.search(r"prefers-color-scheme: *dark\)[^}]*--color-background-primary", text):
        return ""
    body = 'body[data-theme="auto"]'
    shown = (
        f"html {body} .only-light {{ display: none !important; }}\n{body} .only-dark {{ display: block !important; }}"
    )
    return (
        f"@media not print {{\n@media (prefers-color-scheme: dark) {{\n{body} {{{found['colours']}}}\n{shown}\n}}\n}}\n"
    )


def write(app: Any) -> None:
    """Put both files among the pages."""
    if app.builder.format != "html":
        return
    folder = Path(furo.__file__).parent / "theme" / "furo" / "static"
    if not (folder / "scripts" / "gumshoe-patched.js").is_file():
        return  # a build of the theme with one script, whole
    for name, text in ((SCRIPT, _script(folder)), (STYLE, _style(folder))):
        path = Path(app.outdir) / "_static" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    app.add_js_file(SCRIPT, priority=200, loading_method="defer")
    app.add_css_file(STYLE, priority=900)


def leave_out(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Leave out the theme's script, which the other one contains."""
    files = context.get("script_files", [])
    names = [str(getattr(file, "filename", file)) for file in files]
    if any(name.endswith(SCRIPT) for name in names):
        pairs = zip(files, names, strict=True)
        context["script_files"] = [file for file, name in pairs if not name.endswith("scripts/furo.js")]


def setup(app: Any) -> dict[str, bool]:
    """Sphinx asks for it."""
    app.connect("builder-inited", write, priority=900)
    app.connect("html-page-context", leave_out, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
