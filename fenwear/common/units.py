"""Quantities with units: strings such as "55 W/(m K)" become numbers in mm, N, s, K.

Internal units, and so the unit of every number in the code: mm, N, s, K; hence MPa = N/mm² for
stress and W/(m K) = N/(s K) for conductivity.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

_TIMES_TEN = r"(?:\s*[x×*·]\s*10\^?(?P<ten>[+-]?\d{1,3}))?"  # as printed: 3.9 x 10^-8, 3.9·10⁻⁸
_NUMBER_AND_UNIT = re.compile(
    rf"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{{1,3}})?){_TIMES_TEN}\s*(?P<unit>.*?)\s*", re.DOTALL
)
_EXPONENT = re.compile(r"([A-Za-zµ])(-?\d)(?!\d)")  # of units as in history.nc: mm3, mm s-1
POWERS = {"": 0, "µ": -6, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}  # of ten, of the usual prefixes
ALIKE = {"mm^3/(N*mm)": "1/MPa", "mm^3/(N*m)": "1/GPa", "mm^3/(N m)": "1/GPa"}  # specific wear rates
_METRIC = re.compile(f"(1/)?({'|'.join(filter(None, POWERS))}|)(m|g|s|N|Pa|J|W|K)(\\^-1)?")
_HARMLESS_UNIT = re.compile(r"[A-Za-zÅµ°\d\s*/().^-]{1,64}")
_SIGNS = str.maketrans({"º": "°", "˚": "°", "−": "-", "–": "-", "·": "*", "⋅": "*", "∙": "*", "•": "*", "μ": "µ"})
_NAMES = {"%": "percent", "C": "degC", "mil": "thou", "U": "turn", "r": "turn", "tr": "turn"}
_TOGETHER = re.compile(r"(?<![A-Za-zµ])(?:([kMGmµ]?(?:N|Pa|J|W)|kg)([kcmµ]?m|s|K)|(m)(K))(?![A-Za-zµ])")
_HARDNESS = re.compile(r"\s*([\d.eE+-]+)\s*H(?:V|K|B[SW]?)[\d\s./]*")
_SCALES = re.compile(r"\bHR[A-Z]|\bHV|\bHB|\bHK|[Ss]hore")
PASCALS_OF_VICKERS = 9.80665  # MPa: one kgf/mm², by which HV, HB and HK are defined


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
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
joule = newton * meter = J
watt = joule / second = W
minute = 60 * second = min
"""
# Angles are no pure numbers here, so that frequencies are not speeds of rotation, nor turns numbers of cycles.
FIELD_UNITS = """
radian = [angle] = rad
turn = 6.283185307179586 * radian = _ = revolution = rev = cycle
revolutions_per_minute = turn / minute = rpm
revolutions_per_second = turn / second = rps
kilopond = 9.80665 * newton = kp = kgf
pond = 9.80665e-3 * newton
"""


@lru_cache(maxsize=2)
def registry(*, usual: bool) -> pint.UnitRegistry:
    """Return the usual units, or all that pint knows."""
    import pint

    known = pint.UnitRegistry(None, cache_folder=None, on_redefinition="ignore")
    known.load_definitions(USUAL_UNITS.splitlines() if usual else Path(pint.__file__).with_name("default_en.txt"))
    known.load_definitions(FIELD_UNITS.splitlines())
    return known


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
    match = _NUMBER_AND_UNIT.fullmatch(_plain(text))
    if match is None:
        comma = ": write the decimal point as '.'" if re.search(r"\d,\d", text) else ""
        raise ValueError(f"{expected}, got {text!r}{comma}")
    number, given = float(f"{match['number']}e{match['ten']}" if match["ten"] else match["number"]), match["unit"]
    if not given:
        return number
    given = f"1{given}" if given.startswith("/") else given
    power = _power_of_ten(given, unit)
    if power is not None:
        return number * 10.0**power if power >= 0 else number / 10.0**-power
    if not _HARMLESS_UNIT.fullmatch(given) or re.search(r"\d{3}|\^\s*\^", given):
        raise ValueError(f"{expected}, got {text!r}")
    units = list(_units(given))
    values = [value for value in (_in_unit(number, spelling, unit) for spelling in units) if value is not None]
    if any(not math.isclose(value, values[0], rel_tol=1e-12) for value in values):
        raise ValueError(f"{expected}, got {text!r}, which may be read in several ways: write parentheses")
    if not values:
        raise ValueError(f"{expected}, got {text!r}{_reason(given, units, unit)}")
    return values[0]


def hardness(value: object) -> float:
    """Return a hardness (MPa) from a number with a unit of pressure, or with HV, HB, HBW or HK (kgf/mm²).

    Raises:
        ValueError: without a unit, as a bare number may be either; or as `convert`.
    """
    if isinstance(value, str) and (match := _HARDNESS.fullmatch(value)):
        return convert(match[1], "") * PASCALS_OF_VICKERS
    number = convert(value, "MPa")
    if not isinstance(value, str) or _NUMBER_AND_UNIT.fullmatch(value)["unit"] == "":  # type: ignore[index]
        raise ValueError(f"expected a unit, as {value} may be HV or MPa: write '{value} HV' or '{value} MPa'")
    return number


def _plain(text: str) -> str:
    """Return a quantity in plain letters: exponents and signs as in case files, the field's short names as pint's."""
    quantity = unicodedata.normalize("NFKC", text.translate(_SIGNS)).translate(_SIGNS).replace("**", "^")
    quantity = re.sub(r"(?<=[A-Za-zµ°])[-.](?=[A-Za-zµ°])", "*", quantity)  # N-m, N.m
    return re.sub(r"(?<![A-Za-zµ°])(?:%|(?:C|mil|U|r|tr)(?![A-Za-zµ°]))", lambda match: _NAMES[match[0]], quantity)


def _units(given: str) -> Iterator[str]:
    """Yield the ways in which people mean a unit: W/mK as W/(m*K), where its kind lets only one of them be."""
    given = _EXPONENT.sub(r"\1^\2 ", given)
    for spelling in dict.fromkeys((given, _TOGETHER.sub(lambda match: " ".join(filter(None, match.groups())), given))):
        yield spelling
        above, slash, below = spelling.partition("/")
        if slash and not re.search(r"[/()]", below):
            yield f"{above}/({below})"


def _in_unit(number: float, given: str, unit: str) -> float | None:
    """Return the number in a unit; None where it is of another kind or not known."""
    parsed = _parsed(given)
    if parsed is None or not parsed.is_compatible_with(unit or "dimensionless"):
        return None
    known = parsed._REGISTRY
    return float(known.Quantity(number, parsed).to(unit or "dimensionless").magnitude)


def _parsed(given: str) -> pint.Unit | None:

    for usual in (True, False):
        with suppress(Exception):  # pint's parser raises many types on nonsense
            return registry(usual=usual).parse_units(given)
    return None


def _reason(given: str, units: Sequence[str], unit: str) -> str:
    """Return the reason why a unit is rejected, and how to write it."""
    if _SCALES.search(given):
        return ", a hardness: 1 HV is 9.81 MPa, other scales have tables (ASTM E140)"
    known = [parsed for spelling in units if (parsed := _parsed(spelling)) is not None]
    if not known:
        other = next((way for way in _other_capitals(units) if _in_unit(1.0, way, unit) is not None), "")
        return ", whose unit is not known" + (f": write {other!r} if you mean that" if other else "")
    hints = (
        ("rad", ": it may count turns or radians, 2 pi apart; write 'rpm', 'rev/s' or 'rad/s'"),
        ("1/rad" if unit == "" else "rad", ": a number of cycles has no unit, an angle is no pure number"),
        ("m/s^2", ": a mass is no force: write 'kgf', 'gf' or 'lbf' for its weight"),
    )
    for factor, hint in hints:
        if any(
            (parsed_unit * parsed_unit._REGISTRY.parse_units(factor)).is_compatible_with(unit or "dimensionless")
            for parsed_unit in known
        ):
            return f", which is of another kind{hint}"
    return ", which is of another kind"


def _other_capitals(units: Sequence[str]) -> Iterator[str]:
    """Yield a unit in other capitals: MPa for Mpa."""
    for spelling in units:
        for way in ("MPa", "GPa", "kPa", "Pa", "kN", "MN", "N", "mm", "m", "s", "h", "K", "W", "J"):
            yield re.sub(rf"(?<![A-Za-zµ°]){way}(?![A-Za-zµ°])", way, spelling, flags=re.IGNORECASE)


def _power_of_ten(given: str, unit: str) -> int | None:
    """Return which power of ten of `unit` the given one is; None unless both are multiples of one unit, or 1 over it.

    Most case files need no more, and to load pint takes a fifth of a second.
    """
    given, unit = ALIKE.get(given, given), ALIKE.get(unit, unit)
    if given == unit:
        return 0
    first, other = _METRIC.fullmatch(given), _METRIC.fullmatch(unit)
    if first is None or other is None or first[3] != other[3]:
        return None
    signs = [-1 if bool(match[1]) != bool(match[4]) else 1 for match in (first, other)]
    return signs[0] * (POWERS[first[2]] - POWERS[other[2]]) if signs[0] == signs[1] else None


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
