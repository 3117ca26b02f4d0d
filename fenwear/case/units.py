"""Quantities with units: strings such as "55 W/(m K)" become numbers in mm, N, s, K.

Internal units, and so the unit of every number in the code: mm, N, s, K; hence MPa = N/mm² for
stress and W/(m K) = N/(s K) for conductivity.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*", re.DOTALL)
EXPONENT = re.compile(r"([A-Za-zµμ])(-?\d)(?!\d)")  # of units as in history.nc: mm3, mm s-1
POWERS = {"": 0, "µ": -6, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}  # of ten, of the usual prefixes
_METRIC = re.compile(f"(1/)?({'|'.join(filter(None, POWERS))}|)(m|g|s|N|Pa|J|W|K)(\\^-1)?")
_HARMLESS_UNIT = re.compile(r"[A-Za-zµμ°²³\d\s*/().^-]{1,64}")


# Those that most case files keep to: pint's whole list takes a fifth of a second to read.
USUAL_UNITS = """
micro- = 1e-6 = µ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m
gram = [mass] = g
second = [time] = s
kelvin = [temperature]; offset: 0 = K
degree_Celsius = kelvin; offset: 273.15 = °C = degC = degreeC
radian = [] = rad
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
joule = newton * meter = J
watt = joule / second = W
"""


@lru_cache(maxsize=2)
def registry(*, usual: bool) -> pint.UnitRegistry:
    """Return the usual units, or all that pint knows."""
    import pint

    found = pint.UnitRegistry(None if usual else "", cache_folder=None)
    if usual:
        found.load_definitions(USUAL_UNITS.splitlines())
    return found


def convert(value: object, unit: str) -> float:
    """Return `value` as a finite number in `unit`.

    Args:
        value: A number, already in `unit`, or a string of a number and a unit.
        unit: The unit of the result as pint writes it; "" for a pure number.

    Raises:
        ValueError: not a number, not finite, or a unit of another kind; says what was expected.
    """
    expected = f"expected a number or a string with a unit such as '1 {unit}'" if unit else "expected a number"
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"{expected}, got {shown(value)}")
    try:
        number = _convert_text(value, unit, expected) if isinstance(value, str) else float(value)
    except OverflowError:  # an integer of more than 308 digits
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{expected} that is finite, got {shown(value)}")
    return number


@lru_cache(maxsize=500)
def _convert_text(text: str, unit: str, expected: str) -> float:
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None:
        raise ValueError(f"{expected}, got {text!r}")
    number, given = float(match[1]), EXPONENT.sub(r"\1^\2", match[2])
    if not given:
        return number
    power = _power_of_ten(given, unit)
    if power is not None:
        return number * 10.0**power if power >= 0 else number / 10.0**-power
    import pint

    if not _HARMLESS_UNIT.fullmatch(given) or re.search(r"\d{3}|\*\*|\^\s*\^", given):
        raise ValueError(f"{expected}, got {text!r}")
    if "rad" in unit and re.search(r"[Hh](?:z|ertz)", given):
        raise ValueError(f"{expected}, got {text!r}: multiply the frequency by 2 pi")
    try:
        try:
            return _in_unit(number, given, unit, registry(usual=True))
        except pint.UndefinedUnitError:
            return _in_unit(number, given, unit, registry(usual=False))
    except pint.DimensionalityError as error:
        raise ValueError(f"{expected}, got {text!r}, which is of another kind") from error
    except Exception as error:  # pint's parser raises many types on nonsense
        raise ValueError(f"{expected}, got {text!r}, whose unit is not known") from error


def _power_of_ten(given: str, unit: str) -> int | None:
    """Return which power of ten of `unit` the given one is; None unless both are multiples of one unit, or 1 over it.

    Most case files need no more, and to load pint takes a fifth of a second.
    """
    if given == unit:
        return 0
    one, other = _METRIC.fullmatch(given), _METRIC.fullmatch(unit)
    if one is None or other is None or one[3] != other[3]:
        return None
    signs = [-1 if bool(match[1]) != bool(match[4]) else 1 for match in (one, other)]
    return signs[0] * (POWERS[one[2]] - POWERS[other[2]]) if signs[0] == signs[1] else None


def _in_unit(number: float, given: str, unit: str, known: pint.UnitRegistry) -> float:
    return float(known.Quantity(number, known.parse_units(given)).to(unit or "dimensionless").magnitude)


def shown(value: object) -> str:  # noqa: PLR0911
    """Return a value as a message shows it, in the words of case files."""
    match value:
        case bool():
            return str(value).lower()
        case str():
            return repr(str(value))
        case int():
            return str(int(value)) if abs(value) < 10**300 else "a number of more than 300 digits"
        case float():
            return repr(float(value))
        case Mapping():
            return "a table"
        case list() | tuple():
            return "a list"
        case None:
            return "nothing"
    return "something else"


def quantity_text(value: float, unit: str) -> str | float:
    """Return `value` as a case file shows it: with its unit, or bare where it has none."""
    return f"{value!r} {unit}" if unit else value
