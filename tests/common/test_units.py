"""Quantities with units."""

import itertools
import math

import pytest

from fenwear.case import load_case
from fenwear.common.errors import CaseError
from fenwear.common.units import (
    FIELD_UNITS,
    POWERS,
    USUAL_UNITS,
    _power_of_ten,
    convert,
    hardness,
    quantity_text,
    registry,
)


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("1.5 mm", "mm", 1.5),
        ("0.06 m", "mm", 60.0),
        ("10 kN", "N", 1e4),
        ("-10 kN", "N", -1e4),
        ("200 GPa", "MPa", 2e5),
        ("1 N/mm^2", "MPa", 1.0),
        ("55 W/(m K)", "N/(s*K)", 55.0),
        ("80 W/(m^2 K)", "N/(mm*s*K)", 0.08),
        ("1 J/(m^3 K)", "N/(mm^2*K)", 1e-6),
        ("600 rpm", "rad/s", 20 * math.pi),
        ("3.9e-8 1/MPa", "MPa^-1", 3.9e-8),
        ("3.9e-14 1/Pa", "MPa^-1", 3.9e-8),
        *(
            (f"2 {one}", "mm^3/(N*mm)", 2e-3)
            for one in (
                "mm^3/Nm",
                "mm³/Nm",
                "mm³/(N·m)",
                "mm**3/(N*m)",
                "mm³/N·m",
                "mm3/N-m",
                "mm³ N⁻¹ m⁻¹",
                "mm^3/N/m",
                "µm²/mN",
            )
        ),
        *((f"2 {one}", "rad/s", 4 * math.pi) for one in ("rev/s", "turns/s", "rps", "cycles/s", "r/s")),
        *((f"60 {one}", "rad/s", 2 * math.pi) for one in ("rev/min", "U/min", "tr/min", "r/min", "rpm")),
        *((f"2 {one}", "N/(s*K)", 2.0) for one in ("W/mK", "W/m·K", "W/m K", "W/(m °C)", "W m⁻¹ K⁻¹")),
        *((f"2 {one}", "N/(mm*s*K)", 2e-3) for one in ("W/m2K", "W/m²K", "W/(m²·K)")),
        *((f"2 {one}", "N*mm", 2e3) for one in ("Nm", "N·m", "N-m", "N.m", "J")),
        ("2 mK", "K", 2e-3),
        ("2 mPas", "MPa*s", 2e-9),
        ("2 kp", "N", 19.6133),
        ("2 kp/mm²", "MPa", 19.6133),
        ("3.9·10⁻⁸ /MPa", "MPa^-1", 3.9e-8),
        ("−2 x 10^3 N", "N", -2e3),
        ("50 %", "", 0.5),
        (" 7 ", "mm", 7.0),
        (3, "mm", 3.0),
    ],
)
def test_conversion(text: object, unit: str, number: float) -> None:
    """Reference: the definitions of the units and shared/physics.md ("Units inside the code")."""
    assert convert(text, unit) == pytest.approx(number, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        ("1 kg", "mm"),
        ("1 mm", ""),
        ("1 furlongs_per_snail", "mm"),
        ("mm", "mm"),
        ("", "mm"),
        ("1 2 mm", "mm"),
        ("1 mm; import os", "mm"),
        ("1 mm**999999", "mm"),
        ("10 Hz", "rad/s"),
        ("5 cps", "rad/s"),
        ("300 1/min", "rad/s"),
        ("5 turns", ""),
        ("5 deg", ""),
        ("5 kg", "N"),
        ("25 kg/mm2", "MPa"),
        ("1 Mpa", "MPa"),
        ("250 HV", "MPa"),
        ("2 N/m deg", "N/m"),
        ("1,5 mm", "mm"),
        ("nan", "mm"),
        ("1e999", "mm"),
        (math.inf, "mm"),
        (math.nan, ""),
        (True, "mm"),
        (None, "mm"),
        ([1.0], "mm"),
    ],
)
def test_refusal_says_what_was_expected(value: object, unit: str) -> None:
    """Nothing but a finite number of the right kind passes, and the message shows the unit."""
    with pytest.raises(ValueError, match=r"expected a number") as refused:
        convert(value, unit)
    assert unit in str(refused.value)


@pytest.mark.parametrize("text", ["250 HV", "250 HV0.1", "250 HBW 10/3000", "250 kgf/mm²", "2.4516625 GPa"])
def test_hardness(text: str) -> None:
    """Vickers', Brinell's and Knoop's numbers are kgf/mm² (ISO 6507-1, 6506-1, 4545-1)."""
    assert hardness(text) == pytest.approx(250 * 9.80665, rel=1e-14)
    assert load_case("example1", [f"contact.hardness='{text}'"]).contact.hardness == hardness(text)


@pytest.mark.parametrize("value", [250, 250.0, "250", "60 HRC"])
def test_hardness_needs_a_unit(value: object) -> None:
    """Bare numbers may be HV or MPa, ten times apart; other scales have no factor."""
    with pytest.raises(ValueError, match="HV"):
        hardness(value)
    with pytest.raises(CaseError, match=r"contact\.hardness"):
        load_case("example1", [f"contact.hardness={value!r}"])


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, -2.5e17, 3.926990816987242e-8])
def test_text_reads_back_to_the_last_bit(value: float) -> None:
    """What a resolved case shows is what it was."""
    assert convert(quantity_text(value, "MPa"), "MPa") == value
    assert convert(quantity_text(value, ""), "") == value


@pytest.mark.parametrize(
    ("written", "unit", "value"),
    [
        ("2 mm3/(N m)", "mm^3/(N*mm)", 2e-3),
        ("2 mm3", "mm^3", 2.0),
        ("2 mJ/mm2", "N/mm", 2.0),
        ("2 mm s-1", "mm/s", 2.0),
        ("2 rad s-1", "rad/s", 2.0),
        ("2 mW/mm2", "N/(mm*s)", 2.0),
        ("2 1/K", "1/K", 2.0),
    ],
)
def test_units_as_results_have_them(written: str, unit: str, value: float) -> None:
    """The units that history.nc and exports write are read as they stand."""
    assert convert(written, unit) == pytest.approx(value, rel=1e-12)


def test_usual_units_are_those_of_the_whole_list() -> None:
    """Every prefix with every unit, so that none means another one there."""
    lines = [line.split("=") for line in (USUAL_UNITS + FIELD_UNITS).splitlines() if line]
    names = [[part.strip() for part in (line[0], *line[2:]) if part.strip() != "_"] for line in lines]
    prefixes = [name.removesuffix("-") for group in names for name in group if name.endswith("-")]
    known = [name for group in names for name in group if not name.endswith("-")]
    usual, whole = registry(usual=True), registry(usual=False)
    for name in [*known, *(f"{prefix}{unit}" for prefix in prefixes for unit in known if "C" not in unit)]:
        there = [one.Quantity(3.0, one.parse_units(name)).to_root_units() for one in (usual, whole)]
        assert f"{there[0].units:C}" == f"{there[1].units:C}", name
        assert there[0].magnitude == pytest.approx(there[1].magnitude, rel=1e-14), name


def test_powers_of_ten_are_those_of_pint() -> None:
    """Of every two multiples of one unit, or of 1 over it; others are left to pint."""
    known, units = registry(usual=True), ("m", "g", "s", "N", "Pa", "J", "W", "K")
    for unit, one, other in itertools.product(units, POWERS, POWERS):
        for given, wanted in ((f"{one}{unit}", f"{other}{unit}"), (f"1/{one}{unit}", f"{other}{unit}^-1")):
            ratio = known.Quantity(1.0, known.parse_units(given)).to(wanted).magnitude
            assert 10.0 ** _power_of_ten(given, wanted) == pytest.approx(ratio, rel=1e-14), (given, wanted)
        assert _power_of_ten(f"{one}{unit}", f"{other}{unit}^-1") is None
    assert not any(_power_of_ten(*pair) for pair in itertools.permutations(units, 2))
    assert _power_of_ten("m", "mN") is _power_of_ten("m", "N") is _power_of_ten("mm^2", "mm") is None
