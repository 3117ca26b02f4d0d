"""Values that are valid but hardly meant."""

from __future__ import annotations

import pytest

from fenwear.case import builtin_cases, load_case, make_case, plausibility_warnings
from fenwear.case.unlikely_values import RANGES

TABLE = "contact.friction={table = [[%s, 0.2], [%s, 0.3]]}"


@pytest.mark.parametrize("name", builtin_cases())
def test_builtin_cases_are_beyond_doubt(name: str) -> None:
    """Nothing is said of them."""
    assert plausibility_warnings(load_case(name)) == []


@pytest.mark.parametrize(
    ("settings", "key", "expected"),
    [
        (["materials.steel.young=210"], "materials.steel.young", "0.21 GPa as it is read without a unit is far"),
        (["materials.steel.young=210e9"], "materials.steel.young", "0.4|1.5 to 1300 GPa"),
        (["materials.steel.young='3 MPa'"], "materials.steel.young", "0.4 to 1300 GPa"),
        (["materials.steel.density=7800"], "materials.steel.density", "7.8e+15 kg/m^3 as it is read without a unit"),
        (["materials.steel.heat_capacity=460"], "materials.steel.heat_capacity", "0.00046 J/(kg K)"),
        (["materials.steel.expansion=12"], "materials.steel.expansion", "12 1/K"),
        (
            ["materials.steel.conductivity=55"],
            "materials.steel.conductivity",
            "beside materials.steel.young = '200 GPa'",
        ),
        (["heat.convection=80"], "heat.convection", "8e+04 W/(m^2 K)"),
        (["heat.initial='3000 K'"], "heat.initial", "3000 K is far outside"),
        (["wear.punch.coefficient=4e-2"], "wear.punch.coefficient", "0.04 1/MPa"),
        (
            ["wear.punch.coating={thickness=5, coefficient=1e-9}"],
            "wear.punch.coating.thickness",
            "5000 µm as it is read without a unit",
        ),
        (["materials.steel.yield_stress=0.3"], "materials.steel.yield_stress", "0.3 MPa as it is read without a unit"),
        (
            ["wear.punch.coefficient={expression='4e-8 * (1 + p / 50)'}"],
            "wear.punch.coefficient",
            'an expression without a unit, read in mm^3/(N*mm). Give it as {expression = ..., unit = "mm^3/(N*mm)"}',
        ),
        (
            ["wear.punch.coefficient={table=[[0, 1e-9], [9, 2e-9]], of='s'}", "wear.punch.pressure_exponent=1.5"],
            "wear.punch.coefficient",
            "a table without a unit, read in MPa^-1.5",
        ),
        (["materials.steel.young={expression='2e5 - T'}"], "materials.steel.young", "read in MPa."),
        (
            ["contact.third_body={share=0.5, life={expression='3 + p'}}"],
            "contact.third_body.life",
            "read in mm.",
        ),
        (["motion.amplitude=2"], "motion.amplitude", "read as 2.0 mm, beside motion.angular_frequency = '10 rad/s'"),
        (["heat.initial='20 degC'", "heat.ambient=20"], "heat.ambient", "20 K without a unit, which is -253.15 degC"),
        (["heat.initial='20 degC'"], "strip.temperatures.0.temperature", "0 K, which is -273.15 degC"),
        (["heat.ambient=20"], "heat.ambient", "read as 20 K, beside"),
        ([TABLE % (20, 400)], "contact.friction", "spans 20 to 400 K, which does not contain heat.initial, 0 K"),
        (
            ["heat.initial='20 degC'", TABLE % (20, 400)],
            "contact.friction",
            "begins at 20 K, beside heat.initial of 293.15 K",
        ),
    ],
)
def test_doubts(settings: list[str], key: str, expected: str) -> None:
    """Told with the key and what is usual; the case is valid all the same."""
    said = [
        text.removeprefix(f"{key}: ")
        for text in plausibility_warnings(load_case("example1-heat", settings))
        if f"{key}: " in text
    ]
    assert len(said) == 1
    assert any(part in said[0] for part in expected.split("|"))


@pytest.mark.parametrize(
    "settings",
    [
        ["materials.steel.young='700 MPa'"],  # as of polyethylene: with its unit it is meant so
        ["materials.steel.young='210000 MPa'", "materials.steel.density='7.8 g/cm^3'"],
        ["heat.initial='20 degC'", "heat.ambient='20 degC'", "strip.temperatures=[]", TABLE % (273, 600)],
        ["contact.friction=0", "materials.steel.expansion=0", "wear.punch.coefficient=0"],
        ["wear.punch={coefficient='1e-9 MPa^-2', pressure_exponent=2}"],  # of another kind
        [TABLE % (0, 400)],
    ],
)
def test_no_doubts(settings: list[str]) -> None:
    """What may well be meant."""
    assert plausibility_warnings(load_case("example1-heat", settings)) == []


def test_how_a_case_was_written_is_no_part_of_it() -> None:
    """The same values in other words make the same case."""
    one, other = (load_case("example1", [f"motion.amplitude={text}"]) for text in ("2", "'0.2 cm'"))
    assert one == other
    assert (len(plausibility_warnings(one)), len(plausibility_warnings(other))) == (1, 0)
    assert one.at(None).written.bare == {"motion.amplitude"}
    assert plausibility_warnings(make_case(one.resolved())) == []


def test_every_range_is_one() -> None:
    """From low to high, with a reason."""
    assert all(r.low < r.high and r.reason and r.size > 0 for r in RANGES)


@pytest.mark.parametrize(
    "setting",
    [
        "contact.friction={expression='0.2 + 0 * p'}",  # a pure number
        "wear.punch={per_area={expression='2e-9 + 0 * p'}}",
        "wear.punch.coefficient={expression='4e-8 + 0 * p', unit='1/MPa'}",
        "wear.punch.coefficient=4e-8",  # bare numbers are in the unit of the key, as the reference says
    ],
)
def test_nothing_is_said_of_laws_whose_unit_is_clear(setting: str) -> None:
    assert plausibility_warnings(load_case("example1", [setting])) == []
