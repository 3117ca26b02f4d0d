"""HTML from the templates beside this file: pages that need nothing else, neither network nor scripts."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from datetime import datetime

import jinja2
from markupsafe import Markup

from fenwear.case.names import BY_ROLE, Names

__all__ = ["Picture", "picture", "render", "time"]


@dataclass(frozen=True)
class Picture:
    """An image inside the page.

    Attributes:
        source: The image itself, as a data URL.
        caption: Below it.
        alt: What it shows, for those who do not see it.
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

    def told(value: object) -> object:
        plain = isinstance(value, str) and not isinstance(value, Markup) and not value.startswith("data:")
        return names.told(str(value)) if plain else value

    templates = _TEMPLATES.overlay(finalize=told) if names.given else _TEMPLATES
    return Markup(templates.get_template(template).render(values))
