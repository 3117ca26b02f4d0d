"""What a user chooses of the figures, checked."""

from __future__ import annotations

from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError
from fenwear.report.style import AXES, Style

FORMATS = ("png", "pdf", "svg")
LEAST, MOST = 50.0, 500.0  # mm
INCH = 25.4  # mm


def chosen_formats(text: str) -> tuple[str, ...]:
    """Return the formats of figures that are named with commas between.

    Raises:
        CaseError: one is not known.
    """
    names = [name.strip().lower().removeprefix(".") for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in FORMATS]
    if unknown or not names:
        raise CaseError(InputError("--format", f"expected some of {', '.join(FORMATS)} with commas, got {text!r}"))
    return tuple(dict.fromkeys(names))


def chosen_look(width: str, axis: str) -> Style:
    """Return the look of figures of a width, such as "85 mm", over cycles, distance or time.

    Raises:
        CaseError: the width is no length or not between 50 and 500 mm, or the axis is not known.
    """
    try:
        size = convert(width, "mm")
    except ValueError as error:
        raise CaseError(InputError("--width", str(error))) from None
    if not LEAST <= size <= MOST:
        raise CaseError(InputError("--width", f"expected {LEAST:g} to {MOST:g} mm, got {width!r}"))
    if axis not in AXES:
        raise CaseError(InputError("--axis", f"expected one of {', '.join(AXES)}, got {axis!r}"))
    return Style(size / INCH, axis)
