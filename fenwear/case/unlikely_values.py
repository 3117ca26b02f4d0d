"""Values of a case that are valid but hardly meant: far outside the range of their kind, or in another unit.

Nothing here is rejected: the case is computed as it is. Every range is wide enough for all materials in use; values
outside it are reported with the range.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

from pydantic import BaseModel

from fenwear.case.schema import OFFSET, Case, Written
from fenwear.case.table_parts import unit_of
from fenwear.case.wear_table import Dependence, WearLaw

HOT = 2000.0  # K: most metals have melted, and no friction couple is used there
NUMBER_AND_UNIT = re.compile(r"\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*(.*?)\s*", re.DOTALL)
COLD = 150.0  # K: below it a table over T beside absolute temperatures is one over degrees Celsius
ABSOLUTE = 200.0  # K: initial temperatures above it are absolute, not differences


class Range(NamedTuple):
    """Usual range of a physical kind.

    Attributes:
        keys: Of the case, with wildcards.
        kind: Its name.
        low, high: In `unit`; zero is always allowed.
        unit: As people write it.
        size: Of that unit in internal units.
        reason: Examples at the ends.
        bare_low: The same as `low` for a number that was written without a unit, where that may be another one.
    """

    keys: str
    kind: str
    low: float
    high: float
    unit: str
    size: float
    reason: str
    bare_low: float = 0.0


# Sources: ends of the materials' charts in Ashby, Materials Selection in Mechanical Design; heat transfer coefficients
# in Incropera, Fundamentals of Heat and Mass Transfer, table 1.1; wear in Rabinowicz, Friction and Wear of Materials.
RANGES = (
    Range("materials.*.young", "Young's modulus", 0.4, 1300, "GPa", 1e3,
          "PTFE 0.4, steel 210, diamond 1,200; rubber is not linear elastic", bare_low=1.5),
    Range("materials.*.poisson", "Poisson's ratio", 0.0, 0.5, "", 1, "cork 0, rubber 0.5"),
    Range("materials.*.conductivity", "conductivity", 0.02, 2500, "W/(m K)", 1, "foams 0.03, diamond 2,000"),
    Range("materials.*.heat_capacity", "heat capacity", 80, 5000, "J/(kg K)", 1e6, "tungsten 130, water 4,200"),
    Range("materials.*.density", "density", 50, 23000, "kg/m^3", 1e-12, "foams 100, osmium 22,600"),
    Range("materials.*.expansion", "thermal expansion", -1e-5, 5e-4, "1/K", 1, "invar 1e-6, rubber 3e-4"),
    Range("contact.friction", "friction coefficient", 0.0005, 2.0, "", 1,
          "superlubricity 0.001, clean metals and rubber 1 to 2"),
    Range("*.hardness", "hardness", 5e-3, 150, "GPa", 1e3, "polymers 0.02, diamond 100"),
    Range("wear.*.archard", "Archard's K", 1e-11, 0.2, "", 1, "boundary lubrication 1e-9, seizing metals 0.1"),
    Range("wear.*.energy", "energy wear coefficient", 1e-14, 1e-3, "1/MPa", 1, "diamond-like carbon 1e-11, as beta~"),
    Range("wear.*.coefficient", "wear coefficient", 1e-14, 1e-3, "1/MPa", 1,
          "diamond-like carbon 1e-11; K of 1 at a hardness of 1 GPa is 1e-3"),
    Range("wear.*.coating.thickness", "thickness of a coating", 1e-3, 2e3, "µm", 1e-3,
          "monolayers 1e-3, sprayed coatings 2,000"),
    Range("wear.*.coating.modulus", "modulus of a coating", 0.1, 1.5e6, "MPa", 1, "gels 0.1, diamond-like carbon 1e6"),
    Range("wear.*.coating.friction", "friction coefficient", 0.0005, 2.0, "", 1,
          "superlubricity 0.001, clean metals and rubber 1 to 2"),
    Range("materials.*.yield_stress", "yield stress", 1, 2e4, "MPa", 1, "lead 10, silicon carbide 10,000"),
    Range("contact.lubrication.film", "film thickness", 1e-3, 500, "µm", 1e-3, "boundary films 1e-3, bearings 100"),
    Range("contact.lubrication.roughness", "roughness", 1e-3, 100, "µm", 1e-3, "mirrors 1e-3, sand castings 25"),
    Range("contact.lubrication.fluid_friction", "friction coefficient", 1e-5, 0.3, "", 1, "films of oil 1e-3 to 0.1"),
    Range("heat.convection", "heat transfer coefficient", 0.5, 2e4, "W/(m^2 K)", 1e-3,
          "air at rest 2, liquids in forced flow 20,000"),
    Range("heat.conductance", "contact conductance", 1, 1e7, "W/(m^2 K)", 1e-3, "rough ceramics 100, soldered 1e6"),
    Range("motion.speed", "sliding speed", 0.0, 1e3, "m/s", 1e3, "rockets' sleds reach 1,000 m/s"),
    *(Range(keys, "temperature", -500, HOT, "K", 1, "most metals have melted above 2,000 K")
      for keys in ("heat.initial", "heat.ambient", "*.temperatures.*.temperature")),
)  # fmt: skip
TEMPERATURES = ("heat.initial", "heat.ambient", "*.temperatures.*.temperature")


def plausibility_warnings(case: Case) -> list[str]:
    """Return the warnings of unlikely values of a case, each with its key."""
    values = dict(_leaves(case, ""))
    far = dict(_out_of_range(case, values))
    return [
        *far.values(),
        *_mixed_units(case, far),
        *_laws_without_unit(case),
        *_mixed_temperatures(case, values),
        *_tables(case),
        *_without_effect(case),
    ]


def _without_effect(case: Case) -> list[str]:
    """Return the warnings of keys without effect."""
    heat = case.heat
    if heat is None or heat.conductance != "perfect" or "partition" not in heat.model_fields_set:
        return []
    return [
        'heat.partition: has no effect where heat.conductance = "perfect", as equal temperatures share the heat. '
        "Remove heat.conductance, or set it to 0, to prescribe the share"
    ]


def written(data: Mapping[str, Any], resolved: Mapping[str, Any]) -> Written:
    """Return how the quantities of a case were written.

    Args:
        data: Nested as in a case file.
        resolved: The same with all units, as `Case.resolved`.
    """
    quantities = {key for key, value in _leaves(resolved, "") if _unit_of(value)}
    given = {key: value for key, value in _leaves(data, "") if key in quantities}
    united = {key: str(value) for key, value in given.items() if _unit_of(value)}
    return Written(frozenset(given.keys() - united.keys()), united)


def _unit_of(value: object) -> str:
    """Return the unit in a quantity's text, "" where there is none."""
    match = NUMBER_AND_UNIT.fullmatch(value) if isinstance(value, str) else None
    return match[1] if match else ""


def _leaves(value: object, path: str) -> Iterator[tuple[str, object]]:
    """Yield every value inside parts, tables and lists by its key."""
    if isinstance(value, BaseModel):
        items: Any = [(name, getattr(value, name)) for name in type(value).model_fields]
    elif isinstance(value, Mapping):
        items = value.items()
    elif isinstance(value, list | tuple):
        items = enumerate(value)
    else:
        yield path, value
        return
    for name, inner in items:
        yield from _leaves(inner, f"{path}.{name}" if path else str(name))


def _out_of_range(case: Case, values: Mapping[str, object]) -> Iterator[tuple[str, str]]:
    """Yield the keys of values outside their range, and what is to be said."""
    for key, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or value == 0:
            continue
        for usual in RANGES:
            if fnmatchcase(key, usual.keys) and not _other_exponents(case, key):
                low = max(usual.low, usual.bare_low) if key in case.written.bare else usual.low
                if not low * usual.size * (1 - 1e-9) <= value <= usual.high * usual.size * (1 + 1e-9):
                    unit = f" {usual.unit}" if usual.unit else ""
                    as_read = " as it is read without a unit" if key in case.written.bare else ""
                    article = "an" if usual.kind[0] in "aeiou" else "a"
                    yield (
                        key,
                        (
                            f"{key}: {value / usual.size:.4g}{unit}{as_read} is far outside the usual range of "
                            f"{article} {usual.kind}, {low:g} to {usual.high:g}{unit} ({usual.reason}). "
                            "Check the value and its unit"
                        ),
                    )


def _other_exponents(case: Case, key: str) -> bool:
    """Return whether a wear coefficient is of another kind than 1/MPa."""
    parts = key.split(".")
    law = getattr(case.wear, parts[1], None) if parts[0] == "wear" else None
    return parts[-1] == "coefficient" and law is not None and (law.pressure_exponent, law.speed_exponent) != (1, 1)


def _table_of(key: str) -> str:
    """Return the table that a key stands in; entries of a list belong to the table of the list."""
    steps = key.split(".")
    while steps[-1].isdigit():
        steps.pop()
    return ".".join(steps[:-1])


def _mixed_units(case: Case, but: Container[str]) -> Iterator[str]:
    """Tell of numbers without a unit beside others with one in the same table."""
    values = dict(_leaves(case.tables_by_roles(), ""))
    for key in sorted(case.written.bare):
        if key in but or _is_temperature(key):
            continue
        beside = next((k for k in case.written.united if _table_of(k) == _table_of(key)), None)
        if beside is not None and not str(values[key]).startswith(("0.0 ", "-0.0 ")):
            yield (
                f"{key}: a number without a unit, read as {values[key]}, beside {beside} = "
                f"{case.written.united[beside]!r}. Give its unit"
            )


def _laws_without_unit(case: Case) -> Iterator[str]:
    """Tell of expressions, tables, regions and laws that say no unit, in which what they give is read."""
    for key, law, unit in _dependences(case, ""):
        if unit and not law.unit:
            named = {"expression": "an expression", "regions": "values of regions"}.get(law.form, f"a {law.form}")
            yield f'{key}: {named} without a unit, read in {unit}. Give it as {{{law.form} = ..., unit = "{unit}"}}'


def _dependences(part: BaseModel | Mapping[str, Any], path: str) -> Iterator[tuple[str, Dependence, str]]:
    """Yield what depends on the state inside a part: its key, itself, and the internal unit of its values."""
    fields = type(part).model_fields if isinstance(part, BaseModel) else {}
    items = [(name, getattr(part, name)) for name in fields] if isinstance(part, BaseModel) else list(part.items())
    for name, value in items:
        key = f"{path}.{name}" if path else name
        if isinstance(value, Dependence):
            unit = part.unit if isinstance(part, WearLaw) and name == "coefficient" else unit_of(fields[name])
            yield key, value, unit
        elif isinstance(value, BaseModel | Mapping):
            yield from _dependences(value, key)


def _is_temperature(key: str) -> bool:
    return any(fnmatchcase(key, pattern) for pattern in TEMPERATURES)


def _mixed_temperatures(case: Case, values: Mapping[str, object]) -> Iterator[str]:
    """Tell of kelvins beside degrees."""
    given = case.written.united
    degrees = next((k for k, text in given.items() if _is_temperature(k) and OFFSET.search(text)), None)
    kelvins = next((k for k in given if _is_temperature(k)), None)
    for key, value in values.items():
        if not _is_temperature(key) or case.heat is None or not isinstance(value, int | float):
            continue
        if degrees is not None and (key not in given or value < COLD):
            how = "" if key in given else " without a unit" if key in case.written.bare else " by default"
            yield (
                f"{key}: {value:g} K{how}, which is {value - 273.15:g} degC, beside {degrees} = {given[degrees]!r}. "
                f"Set {key} with a unit, such as {given[degrees]!r}"
            )
        elif kelvins is not None and key in case.written.bare and value != 0:
            yield (
                f"{key}: a number without a unit, read as {value:g} K, beside {kelvins} = {given[kelvins]!r}. "
                "Give its unit"
            )


def _tables(case: Case) -> Iterator[str]:
    """Tell of tables over T that miss the initial temperature, or look like degrees."""
    if case.heat is None:
        return
    initial = case.heat.initial
    for key, law in case.coefficients.items():
        if not isinstance(law, Dependence) or law.table is None or law.of != "T":
            continue
        first, last = law.table[0][0], law.table[-1][0]
        if not first <= initial <= last:
            yield (
                f"{key}: its table over T spans {first:g} to {last:g} K, which does not contain heat.initial, "
                f"{initial:g} K. T is in kelvin, as heat.initial, and beyond its ends a table stays constant"
            )
        elif initial >= ABSOLUTE and first < COLD:
            yield (
                f"{key}: its table over T begins at {first:g} K, beside heat.initial of {initial:g} K. T is in "
                "kelvin. Add 273.15 to degrees Celsius"
            )
