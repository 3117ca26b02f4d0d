"""How Sphinx makes the pages: docker/fenwear docs."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [
    str(HERE.parent),
    str(HERE / "extensions"),
    *(str(HERE.parent / "tests" / part) for part in ("", "verification")),
]

import fenwear  # noqa: E402

project = "fenwear"
author = "the fenwear authors"
copyright = author  # noqa: A001  (Sphinx's name)
version = release = fenwear.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "mathml",
    "from_code",
    "executed",
    "furo_files",
]
exclude_patterns = ["_build", "extensions", "joss", "pictures", "static"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
nitpicky = True
# Types in signatures: those of other libraries have no page here.
nitpick_ignore_regex = [("py:.*", ".*")]

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
# docs/extensions/executed.py does.
nb_execution_mode = "off"
nb_render_markdown_format = "gfm"  # tables in what cells show
copybutton_exclude = ".linenos, .gp, .go"

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True

smartquotes = False  # commands and TOML are copied from tables, too

html_theme = "furo"
pygments_dark_style = "monokai"
html_static_path = ["static"]
html_css_files = ["formulas.css"]
html_title = f"fenwear {version}"
html_show_sourcelink = False
html_copy_source = False
# All pages work without a network.
html_theme_options = {"top_of_page_buttons": []}
