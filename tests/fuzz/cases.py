"""Fuzzing of case files and meshes: whatever they hold, fenwear computes or refuses with words.

python3 tests/fuzz/cases.py              10,000 mutated cases
python3 tests/fuzz/cases.py --meshes     200 mutated meshes
python3 tests/fuzz/cases.py --seed 4711  shows one case and what becomes of it

Every case is made from its seed alone. It goes through validation, the assembly of a tiny geometry
and two half-cycles. What must not happen: an exception other than fenwear's own, a crash, a hang, a
result that is not finite or not in equilibrium, a unit that is converted wrongly, or a message in Python's words.
"""

from __future__ import annotations

import argparse
import copy
import math
import random
import re
import sys
import tempfile
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import bases
import numpy as np
import tomli_w
from bases import base
from pool import Verdict, verdicts

from fenwear import Case, assemble, load_case, make_case
from fenwear.bodies.distributed_mesh import write_msh
from fenwear.case import plausibility_warnings
from fenwear.checks import uncertainty
from fenwear.common.errors import FenwearError, MeshQualityError
from fenwear.steps import evolve, steady

SECONDS = 60.0  # of processor time
NAMES = tuple(bases.BASES)

# Sizes of units in fenwear's own, written down here and not taken from the library that fenwear uses.
UNITS: dict[str, dict[str, float]] = {
    "mm": {"mm": 1, "cm": 10, "m": 1e3, "µm": 1e-3, "um": 1e-3, "inch": 25.4, "dm": 100, "m^2/m": 1e3, "nm": 1e-6},
    "N": {"N": 1, "kN": 1e3, "MN": 1e6, "kg*m/s^2": 1, "kgf": 9.80665, "mN": 1e-3},
    "MPa": {"MPa": 1, "GPa": 1e3, "Pa": 1e-6, "N/mm^2": 1, "kN/cm^2": 10, "bar": 0.1, "N/m^2": 1e-6},
    "rad/s": {"rad/s": 1, "1/s": 1, "deg/s": math.pi / 180, "rad/min": 1 / 60, "rpm": math.pi / 30},
    "s": {"s": 1, "ms": 1e-3, "min": 60, "h": 3600, "µs": 1e-6},
    "mm/s": {"mm/s": 1, "m/s": 1e3, "km/h": 1e6 / 3600, "cm/min": 10 / 60},
    "N/(s*K)": {"W/(m K)": 1, "W/m/K": 1, "N/(s*K)": 1, "kW/(m K)": 1e3},
    "K": {"K": 1, "kelvin": 1, "mK": 1e-3},
    "1/K": {"1/K": 1, "1/mK": 1e3, "ppm/K": 1e-6},
    "N/(mm*s*K)": {"W/(m^2 K)": 1e-3, "N/(mm*s*K)": 1, "W/(cm^2 K)": 10},
    "mm^2/(s^2*K)": {"J/(kg K)": 1e6, "kJ/(kg K)": 1e9, "mm^2/(s^2*K)": 1},
    "N*s^2/mm^4": {"kg/m^3": 1e-12, "g/cm^3": 1e-9, "N*s^2/mm^4": 1},
    "N/(mm*s*K*MPa)": {"W/(m^2 K MPa)": 1e-3, "N/(mm*s*K*MPa)": 1, "kW/(m^2 K GPa)": 1e-3},
    "MPa^-1": {"1/MPa": 1, "mm^2/N": 1, "1/GPa": 1e-3, "m^2/N": 1e6, "Pa^-1": 1e6, "mm^3/J": 1e-3},
    "mm^3/(N*mm)": {"mm^3/(N*mm)": 1, "mm^3/J": 1e-3, "m^3/J": 1e6, "mm^3/(N m)": 1e-3, "1/MPa": 1},
    "MPa^-1.5": {"MPa^-1.5": 1, "Pa^-1.5": 1e9, "kPa^-1.5": 10**4.5, "bar^-1.5": 10**1.5},
    "MPa^-1*mm^-1*s^1": {"s/(MPa mm)": 1, "s/(Pa m)": 1e3, "min/(GPa mm)": 0.06, "mm s/N": 1},
}
ONE_KIND = ({"MPa^-1", "mm^3/(N*mm)"},)  # of the same dimension

STRINGS = (
    *("", " ", "mm", "1", "-3 mm", "nan", "inf mm", "1e400", "-1e-400 mm", "1e308 km", "0x10 mm", "1_000", "1,5 mm"),
    *("1 50 mm", "2 2 mm", "60 mm 2", "60 2mm", "60 mmm", "60 MM", "3 mm mm", "1/0 mm", "10 Hz", "10 °", "5 degC"),
    *("1 m**99", "1 m^^2", "1 m^9999", "5 %", "٣ mm", "１２ mm", "½ mm", "∞", "µ", "мм", "ﬁ", "\u202e12 mm", "é" * 50),
    *("\x00", "a\nb", "💥", "__import__('os').system('true')", "p if p else 0", "lambda: 0", "eval('1')", "p**p**p"),
    *("1e-8*(1+p/10)", "exp(exp(exp(p)))", "p; import os", "[].__class__", "{0.__class__}", "%s%s%s", "$(true)"),
    *("../../../etc/passwd", "/dev/zero", "/dev/stdin", "con.geo", ".", "case.geo", "x" * 100_000, "(" * 5000),
    *("punch_contact", "strip_bottom", "punch_pin", "steel", "composite", "reciprocating", "one-way", "full", "jump"),
)
NUMBERS = (0, -0.0, -1, 1, 2, 3, 0.5, 1e-300, 5e-324, 1e300, -1e300, 1.8e308 * 10, -math.inf, math.nan, 2**31, 2**63)
MORE_NUMBERS = (2**64, -(2**63), 10**25, 10**400, 1e-9, 1e9, 1e15, 7, 100, 12345)
ODD = (True, False, [], {}, [[]], [1, 2], [0, 0, 0], ["x"], ["x", "x"], ["z", "x", "y"], [None], {"a": {"b": {}}})


class NoResultError(Exception):
    """Something was computed that is no result."""


def deep(random_: random.Random) -> Any:
    """Return lists or tables inside each other."""
    value: Any = 1
    table = random_.random() < 0.5
    for _ in range(random_.choice((3, 50, 200))):
        value = {"a": value} if table else [value]
    return value


def places(tables: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all keys and entries."""
    if isinstance(tables, dict):
        items: Any = list(tables.items())
    elif isinstance(tables, list):
        items = list(enumerate(tables))
    else:
        return []
    return [found for key, value in items for found in ((*path, key), *places(value, (*path, key)))]


def at(tables: Any, path: tuple[Any, ...]) -> Any:
    """Return what stands at a path."""
    for step in path:
        tables = tables[step]
    return tables


def any_value(random_: random.Random) -> Any:
    """Return a value that may stand nowhere."""
    kind = random_.randrange(6)
    if kind == 0:
        return deep(random_)
    pool: Any = (STRINGS, NUMBERS, MORE_NUMBERS, ODD, STRINGS)[kind - 1]
    value = random_.choice(pool)
    if isinstance(value, (int, float)) and not isinstance(value, bool) and random_.random() < 0.3:
        unit = random_.choice(sorted(UNITS))
        return f"{value} {random_.choice(sorted(UNITS[unit]))}" if abs(value) < 1e300 else f"{value} {unit}"
    return copy.deepcopy(value)


def mutate(random_: random.Random, tables: dict[str, Any]) -> None:
    """Change the tables in one place."""
    path = random_.choice(places(tables))
    parent, key = at(tables, path[:-1]), path[-1]
    kind = random_.randrange(10)
    if kind >= 8:
        law(random_, tables)
    elif kind == 0:
        del parent[key]
    elif kind == 1 and isinstance(parent, dict):  # misspelt, or another key's name
        names = sorted({str(step) for p in places(tables) for step in p})
        other = random_.choice((*names, f"{key}s", str(key).upper(), str(key)[:-1], "", "__class__", "model_config"))
        parent[other] = parent.pop(key)
    elif kind == 2:  # what stands elsewhere
        parent[key] = copy.deepcopy(at(tables, random_.choice(places(tables))))
    elif kind == 3 and isinstance(parent, list):
        parent.extend(copy.deepcopy(parent[key]) for _ in range(random_.choice((1, 2, 50))))
    elif kind == 4 and isinstance(parent[key], (int, float, str)):
        parent[key] = scaled(random_, parent[key])
    else:
        parent[key] = any_value(random_)


def law(random_: random.Random, tables: dict[str, Any]) -> None:
    """Set one of the keys of laws, motions, loads and moving meshes."""
    path, value = random_.choice(KEYS)(random_)
    place: Any = tables
    for step in path[:-1]:
        if not isinstance(place, dict):
            return
        place = place.setdefault(step, {})
        if isinstance(place, list):
            place = place[0] if place else None
    if isinstance(place, dict):
        place[path[-1]] = copy.deepcopy(value)


def dependence(random_: random.Random) -> Any:
    """Return an expression or a table, most of them bad, at times with a unit."""
    kind = random_.randrange(8)
    if kind < 4:
        made: dict[str, Any] = {"expression": random_.choice(bases.HOSTILE)}
    elif kind < 6:
        made = {"expression": expression(random_, random_.choice((1, 2, 4, 12)))}
    else:
        made = {"table": random_.choice(bases.TABLES), "of": random_.choice(("T", "p", "v", "p", "x", ""))}
    if random_.random() < 0.5:
        made["unit"] = random_.choice(bases.DEPENDENCE_UNITS)
    if random_.random() < 0.05:
        made["table" if "expression" in made else "expression"] = random_.choice((*bases.GOOD, *bases.TABLES))
    return made


def expression(random_: random.Random, depth: int) -> str:
    """Return an expression of random operations, which may be of no kind that is allowed."""
    if depth == 0 or random_.random() < 0.15:
        return random_.choice((*"Tpv", *"Tpv", "1e-9", "2", "0", "1e-300", "1e300", "x", "9**9"))
    one, other = (expression(random_, depth - 1) if depth < 8 or n == 0 else "p" for n in range(2))
    name = random_.choice(("exp", "log", "sqrt", "tanh", "abs", "sin", "min", "max"))
    operation = random_.choice(("+", "-", "*", "/", "**", "*", "*", "//"))
    return random_.choice((f"({one} {operation} {other})", f"{name}({one})", f"{name}({one}, {other})", f"-{one}"))


KEYS: tuple[Any, ...] = (
    lambda r: (("contact", "friction"), dependence(r)),
    lambda r: (("contact", "friction"), {"expression": r.choice(bases.GOOD), "unit": r.choice(bases.DEPENDENCE_UNITS)}),
    lambda r: (("contact", "transverse_friction"), r.choice((0.1, -0.1, 5, "0.1 mm", 1e300))),
    lambda r: (("wear", r.choice(("punch", "strip")), "coefficient"), dependence(r)),
    lambda r: (("wear", r.choice(("punch", "strip")), "energy"), r.choice((dependence(r), 1e-8, "1e-8 1/MPa"))),
    lambda r: (("wear", r.choice(("punch", "strip"))), r.choice(bases.LAW_TABLES)),
    lambda r: (("wear", r.choice(("punch", "strip")), "pressure_exponent"), r.choice((*NUMBERS, 0.5, 1.5, "2"))),
    lambda r: (("wear", r.choice(("punch", "strip")), "speed_exponent"), r.choice((*NUMBERS, 0.5, 1.5, "2"))),
    lambda r: (("motion", "positions"), r.choice((1, 2, 3, 4, 9, 0, -1, 200, 201, 2.0, "3", None))),
    lambda r: (("motion", "profile"), r.choice(("sinusoidal", "triangular", "trapezoidal", "square", 1))),
    lambda r: (("motion", "ramp"), r.choice((0.1, 0.5, 0.51, 0, 1e-300, 1e-12, "10 percent"))),
    lambda r: (("motion", "axis"), r.choice(("x", "y", "z"))),
    lambda r: (("motion", "track"), r.choice((600, "600 mm", 0, 1e-300, 1e300, "1 s"))),
    lambda r: (("motion", "amplitude"), r.choice(("1 um", "1 mm", "10 mm", "1 km", "1e-300 mm", "1e300 mm"))),
    lambda r: (("motion",), bases.motion_by_table(r)),
    lambda r: ((r.choice(("punch", "strip")), "loads", "over_cycle"), r.choice(bases.CYCLES)),
    lambda r: (("geometry", "order"), r.choice((1, 2, 3, 0, "2", True))),
    lambda r: (("geometry", "follow_wear"), r.choice(("never", 1e-9, 1e-6, 0.5, 0, -1, 1e300, "always", 1e-300))),
    lambda r: (("geometry", "parameters", "overlap"), r.choice((0, 0.05, 3, -3, 1e9, "3 s"))),
    lambda r: (("run", "integration"), r.choice(("explicit", "implicit", "jump"))),
    lambda r: (("punch", "pivot"), r.choice(([0, 0], [0], ["1 mm", "1 s"], [1e300, 0]))),
    lambda r: (
        ("grid",),
        r.choice(({"nodes": 9}, {"across": 8}, {"across": 3}, {"nodes": 17, "size": ["0.1 mm"]}, {})),
    ),
    lambda r: ((r.choice(("punch", "strip")), "operator"), r.choice(("auto", "condensed", "half-space", "fine", "x"))),
    lambda r: ((r.choice(("punch", "strip")), "creep"), r.choice(bases.CREEPS)),
    lambda r: (("contact", "layer"), r.choice(bases.LAYERS)),
    lambda r: (("contact", "layer", "stiffness"), dependence(r)),
    lambda r: (("contact", "third_body"), r.choice(bases.DEBRIS)),
    lambda r: (("contact", "third_body", "life"), dependence(r)),
    lambda r: (("contact", "lubrication"), {"asperity_share": dependence(r), "fluid_friction": r.choice((0, 0.1, -1))}),
    lambda r: (("contact", "hardness"), r.choice(("1 GPa", "1 Pa", 0, 1e300, dependence(r)))),
    lambda r: (("contact", "law"), r.choice(("gross-sliding", "coulomb", "auto"))),
    lambda r: (("wear", r.choice(("punch", "strip")), "coating"), r.choice(bases.COATINGS)),
    lambda r: (("wear", r.choice(("punch", "strip")), "pressure_threshold"), r.choice((1, 1e300, -1, "5 MPa"))),
    lambda r: ((r.choice(("punch", "strip")), "topography"), r.choice(bases.TOPOGRAPHIES)),
    lambda r: ((r.choice(("punch", "strip")), "profile"), {"points": r.choice(bases.PROFILES)}),
    lambda r: ((r.choice(("punch", "strip")), "no_turning_about"), r.choice((["y"], ["x", "z"], [], ["q"]))),
    lambda r: (("heat", "track"), r.choice(({"heat_capacity": "1 J/K"}, {"heat_capacity": 0}, {"loss": 1}))),
    lambda r: (("materials", "steel", r.choice(("young", "conductivity", "expansion"))), dependence(r)),
    lambda r: (("run", "periodic_within"), r.choice((1e-3, 0, 1, -1, 1e300))),
)


def scaled(random_: random.Random, value: Any) -> Any:
    """Return a number, or a quantity, times a factor."""
    factor = random_.choice((-1, 0, 0.5, 2, 10, 1e-3, 1e3, 1e-6, 1e6, 1e-12, 1e12))
    if isinstance(value, str):
        number, _, unit = value.partition(" ")
        try:
            return f"{float(number) * factor!r} {unit}"
        except ValueError:
            return value * 2
    try:
        return type(value)(value * factor)
    except OverflowError:  # a whole number beyond all others
        return value


def other_unit(random_: random.Random, tables: dict[str, Any]) -> tuple[tuple[Any, ...], float | None]:
    """Write one quantity in another unit; return its path and its value, None where the unit is of another kind."""
    found = [(p, quantity(at(tables, p))) for p in places(tables) if isinstance(at(tables, p), str)]
    found += [(p, (1.0, at(tables, p))) for p in places(tables) if p[-1] == "unit" and at(tables, p) in UNITS]
    path, (number, unit) = random_.choice([(path, given) for path, given in found if given])
    wrong = random_.random() < 0.4
    same = next((kinds for kinds in ONE_KIND if unit in kinds), {unit})
    kind = random_.choice(sorted({*UNITS} - same)) if wrong else unit
    name, size = random_.choice(sorted(UNITS[kind].items()))
    if path[-1] == "unit":  # of a law's expression or table: its values stay, and mean something else
        number, written = size, name
    else:
        written = f"{number / size:.15g} {name}"  # a quotient, whose last digit is rounding
    at(tables, path[:-1])[path[-1]] = written
    return path, None if wrong else number


def quantity(text: str) -> tuple[float, str] | None:
    """Return number and unit of a quantity as fenwear writes them."""
    number, _, unit = text.partition(" ")
    try:
        return (float(number), unit) if unit in UNITS else None
    except ValueError:
        return None


def compute(case: Case, end: bool = False) -> None:
    """Assemble and compute two half-cycles, of cycle jumps two cycles; the meshes follow the wear.

    Args:
        case: The problem.
        end: Whether it is asked for the uncertainty of its numbers and for its steady state, too.

    Raises:
        FenwearError: fenwear does not want to.
        NoResultError: what it computed is no result.
    """
    if make_case(tomllib.loads(case.to_toml()), case.folder).resolved() != case.resolved():
        raise NoResultError("the resolved case reads back as another one")
    for text in plausibility_warnings(case):
        if PYTHON.search(own_words(text)):
            raise NoResultError(f"a warning speaks Python: {text}")
    system, block = assemble(case), None
    for block in evolve(system, min(case.run.half_cycles, 2 if case.motion.kind != "cycle" else 32)):
        for values in (block.pressure, block.gap, block.wear, block.wear_strip, block.equilibrium_error):
            if not np.isfinite(values).all():
                raise NoResultError("not finite")
        if block.heat is not None and not np.isfinite(block.heat.largest_temperature).all():
            raise NoResultError("temperatures not finite")
        if min(block.pressure.min(), block.worn_area_increment.min(), block.worn_area_increment_strip.min()) < 0:
            raise NoResultError("negative pressure or wear")
        if block.equilibrium_error.max() > 1e-6:
            raise NoResultError(f"not in equilibrium: {block.equilibrium_error.max():g}")
    if end and block is not None:  # of a jump there is none before a whole cycle
        if not np.isfinite(list(uncertainty(block.system.case, block).total.values())).all():
            raise NoResultError("an uncertainty is not finite")
        state = steady(system)
        if not np.isfinite(state.pressure).all() or np.min(state.pressure) < 0:
            raise NoResultError("no pressure of a steady state")


# Words of Python and its libraries: nobody who writes a case file has to know them.
PYTHON = re.compile(
    r"Traceback|functools|<lambda>|\blambda \w*:|<class|NoneType|\bNone\b|\b(?:True|False)\b|object at 0x|np\.\w+\("
    r"|\barray\(|dtype|numpy|pydantic|validat(?:or|ion)|validate|instance of|\bdictionary\b|\b[tT]uple\b|\bstr\b"
    r"|\bfloat\b|\bdict\b"
    r"|function-|\w+Error\b|keyword|argument of type|__\w+__|discriminator|\btag\b"
)


def own_words(text: str) -> str:
    """Return a message without what it quotes of the case and of gmsh."""
    return re.sub(r"gmsh on .*|'(?:[^'\\]|\\.)*'|\"[^\"]*\"|'.*", "''", text)


def said(error: FenwearError) -> str:
    """Return what the error says, or a complaint if it says nothing or speaks Python."""
    text = str(error)
    if not text.strip() or any(len(line) >= 2000 for line in text.splitlines()):
        return f"BAD MESSAGE {text[:500]}"
    for line in text.splitlines():
        key, _, message = line.partition(": ")
        found = PYTHON.search(own_words(line if " " in key else message))
        if found:
            return f"BAD MESSAGE speaks Python ({found[0]}): {line}"
    return text


def mutated(seed: int) -> tuple[dict[str, Any], tuple[tuple[Any, ...], float | None] | None]:
    """Return the tables of a case, and where a unit was changed what must come of it."""
    random_ = random.Random(seed)
    tables = copy.deepcopy(base(random_.choice(NAMES)))
    if random_.random() < 0.15:
        return tables, other_unit(random_, tables)
    for _ in range(random_.choice((1, 1, 1, 2, 3, 8))):
        if places(tables):
            mutate(random_, tables)
    return tables, None


def try_case(seed: int) -> tuple[str, str]:
    """Return what becomes of a case."""
    kind, text = _try_case(seed)
    if Path(bases.TRACE).exists():
        Path(bases.TRACE).rmdir() if Path(bases.TRACE).is_dir() else Path(bases.TRACE).unlink()
        return "wrong", f"an expression ran code; {text}"
    return kind, text


def _try_case(seed: int) -> tuple[str, str]:
    tables, unit = mutated(seed)
    random_ = random.Random(-seed)
    try:
        case = _made(tables, random_) if unit is None else make_case(tables)
        if unit is not None:
            path, expected = unit
            if expected is None:
                return "wrong", f"{path} accepted a unit of another kind: {at(tables, path)}"
            if path[-1] == "unit":
                number = scale_of(case, path)
            else:
                number, _ = quantity(at(case.resolved(), path)) or (math.nan, "")
            if not math.isclose(number, expected, rel_tol=1e-12):
                return "wrong", f"{path}: {at(tables, path)} became {number!r}, expected {expected}"
        compute(case, end=unit is None and random_.random() < 0.25)
    except FenwearError as error:
        text = said(error)
        if unit is not None and unit[1] is not None and not isinstance(error, MeshQualityError):
            return "wrong", f"{unit[0]}: {at(tables, unit[0])} refused: {text}"
        return ("wrong" if text.startswith("BAD") else "refused"), text
    except NoResultError as error:
        return "wrong", str(error)
    return "ok", ""


def scale_of(case: Case, path: tuple[Any, ...]) -> float:
    """Return by how much the values of the law are taken whose unit stands at a path."""
    if path[0] == "wear":  # in a unit that its exponents make
        return float(getattr(case.wear, path[1]).scale)
    law: Any = case
    for step in path[:-1]:
        law = law[step] if isinstance(law, dict) else getattr(law, step)
    return float(law.scale(next(kind for kind in UNITS if law.unit in UNITS[kind])))


def _made(tables: dict[str, Any], random_: random.Random) -> Case:
    """Make the case from the tables or, where they are TOML, from a file, which may be damaged, too."""
    if random_.random() < 0.7:
        return make_case(tables)
    try:
        text = tomli_w.dumps(tables)
    except Exception:  # no TOML: nothing to write
        return make_case(tables)
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if random_.random() < 0.5:
        for _ in range(random_.choice((1, 3, 30))):
            place = random_.randrange(len(data))
            if random_.random() < 0.5:
                data[place] = random_.randrange(256)
            else:
                del data[place : place + random_.choice((1, 10, 100))]
            if not data:
                break
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_bytes(data)
        return load_case(path)


# -------------------------------------------------------------------------------- meshes


@cache
def mesh_lines() -> tuple[str, ...]:
    """Return the .msh file of a tiny Example 1 with heat."""
    case = load_case("example1-heat", bases.TINY)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tiny.msh"
        write_msh(case.geometry, None, path)
        return tuple(path.read_text().splitlines())


def section(lines: list[str], name: str) -> tuple[int, int]:
    """Return the first line inside a section and the one behind its last."""
    return lines.index(f"${name}") + 1, lines.index(f"$End{name}")


def node_rows(lines: list[str]) -> list[int]:
    """Return the numbers of the lines that hold coordinates."""
    start, stop = section(lines, "Nodes")
    return [n for n in range(start + 1, stop) if len(lines[n].split()) == 3]


def element_rows(lines: list[str]) -> list[int]:
    """Return the numbers of the lines that hold quadrilaterals."""
    start, stop = section(lines, "Elements")
    return [n for n in range(start + 1, stop) if len(lines[n].split()) == 5]


def damage(random_: random.Random, lines: list[str]) -> None:
    """Change a mesh in one way."""
    kind = random_.randrange(14)
    nodes, elements = node_rows(lines), element_rows(lines)
    if kind == 0:  # cut off
        del lines[random_.randrange(len(lines)) :]
    elif kind == 1:  # a group less, or by another name
        start, stop = section(lines, "PhysicalNames")
        row = random_.randrange(start + 1, stop)
        dim, tag, name = lines[row].split(" ", 2)
        lines[row] = f"{dim} {tag} " + random_.choice(('"other"', '"punch_contact"', '""', name.upper(), '"punch_ö"'))
    elif kind == 2:
        change_nodes(lines, [random_.choice(nodes)], lambda x: [random_.choice((math.nan, math.inf, 1e300)), *x[1:]])
    elif kind == 3:  # moved
        far = random_.choice((1e-6, 1.0, 30.0, 1e3))
        change_nodes(lines, random_.sample(nodes, random_.choice((1, 5, 50))), lambda x: [
            x[0] + far * random_.uniform(-1, 1), x[1] + far * random_.uniform(-1, 1), x[2]])  # fmt: skip
    elif kind == 4:  # turned inside out, or twisted
        for row in random_.sample(elements, random_.choice((1, 10, len(elements)))):
            tag, a, b, c, d = lines[row].split()
            lines[row] = " ".join((tag, *random_.choice(((d, c, b, a), (a, c, b, d), (a, a, c, d), (a, b, a, b)))))
    elif kind == 5:  # two nodes in one place
        one, other = random_.sample(nodes, 2)
        lines[one] = lines[other]
    elif kind == 6:  # no thickness
        part = random_.choice((lambda x: x[1] > 100, lambda x: x[1] < 100, lambda x: True))
        change_nodes(lines, nodes, lambda x: [x[0], 100.0, x[2]] if part(x) else x)
    elif kind == 7:  # another size, mirrored, turned, out of the plane
        a, b = random_.choice((1e-9, 1e9, -1, 0)), random_.choice((1, 1e-3, -1))
        change_nodes(lines, nodes, random_.choice((
            lambda x: [a * x[0], a * x[1], x[2]], lambda x: [b * x[0], x[1], x[2]], lambda x: [x[1], x[0], x[2]],
            lambda x: [x[0], x[1], x[0]], lambda x: [x[0], x[2], x[1]])))  # fmt: skip
    elif kind == 8:  # another type of element
        start, stop = section(lines, "Elements")
        rows = [n for n in range(start + 1, stop) if len(lines[n].split()) == 4 and lines[n].split()[2] in "13"]
        row = random_.choice(rows)
        words = lines[row].split()
        words[2] = random_.choice(("1", "2", "3", "4", "10", "15", "99"))
        lines[row] = " ".join(words)
    elif kind == 9:  # one element less or more
        row = random_.choice(elements)
        lines[row:row] = [lines[row]] * random_.choice((0, 1, 5))
        if random_.random() < 0.5:
            del lines[row]
    elif kind == 10:  # another number anywhere
        row = random_.randrange(len(lines))
        words = lines[row].split(" ")
        words[random_.randrange(len(words))] = random_.choice(("0", "-1", "999999", "nan", "x", "1e400", ""))
        lines[row] = " ".join(words)
    elif kind == 11:  # quadrilaterals that name other nodes
        row = random_.choice(elements)
        words = lines[row].split()
        words[random_.randrange(1, 5)] = random_.choice(("1", "2", "77777", "0", "-3"))
        lines[row] = " ".join(words)
    elif kind == 12:  # the bodies apart, or one in the other
        shift = random_.choice((-50.0, -0.1, 0.1, 5.0, 1e4))
        change_nodes(lines, nodes, lambda x: [x[0], x[1] + shift, x[2]] if x[1] > 100 else x)
    else:  # lines in another order
        a, b = sorted(random_.sample(range(len(lines)), 2))
        lines[a], lines[b] = lines[b], lines[a]


def change_nodes(lines: list[str], rows: list[int], change: Any) -> None:
    """Change coordinates."""
    for row in rows:
        lines[row] = " ".join(repr(float(value)) for value in change([float(word) for word in lines[row].split()]))


def mesh_tables() -> dict[str, Any]:
    """Return Example 1 with heat, on a mesh of its own."""
    tables = copy.deepcopy(base("example1-heat"))
    tables["geometry"] = {"file": "own.msh", "degree": 1}
    return tables


def damaged(seed: int) -> str:
    """Return a mesh file."""
    random_ = random.Random(seed)
    lines = list(mesh_lines())
    damage(random_, lines)
    return "\n".join(lines) + "\n"


def try_mesh(seed: int) -> tuple[str, str]:
    """Return what becomes of a mesh."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "own.msh").write_text(damaged(seed))
        try:
            compute(make_case(mesh_tables(), Path(folder)))
        except FenwearError as error:
            text = said(error)
            return ("wrong" if text.startswith("BAD") else "refused"), text
        except NoResultError as error:
            return "wrong", str(error)
    return "ok", ""


def fuzz(task: Any, count: int, first: int = 0, workers: int = 2) -> tuple[Counter[str], list[Verdict]]:
    """Try many; return how often what came of it, and what must not be."""
    kinds: Counter[str] = Counter()
    defects = []
    for verdict in verdicts(task, range(first, first + count), workers, SECONDS):
        kinds[verdict.kind] += 1
        if verdict.kind not in ("ok", "refused"):
            defects.append(verdict)
    return kinds, sorted(defects)


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Fuzzing of case files and meshes.")
    parser.add_argument("--meshes", action="store_true", help="meshes instead of cases")
    parser.add_argument("--count", type=int, help="how many; by default 10,000 cases or 200 meshes")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--seed", type=int, help="show this one alone")
    options = parser.parse_args()
    task = try_mesh if options.meshes else try_case
    if options.seed is not None:
        print(damaged(options.seed) if options.meshes else mutated(options.seed)[0])
        print(*task(options.seed), sep=": ")
        return 0
    count = options.count or (200 if options.meshes else 10_000)
    kinds, defects = fuzz(task, count, options.first, options.workers)
    for seed, kind, text in defects:
        print(f"--- seed {seed}: {kind}\n{text}")
    print(", ".join(f"{number} {kind}" for kind, number in kinds.most_common()))
    return 1 if defects else 0


if __name__ == "__main__":
    sys.exit(main())
