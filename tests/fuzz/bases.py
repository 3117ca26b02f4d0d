"""What the fuzzing starts from: tiny cases that use every key, and texts that want to be more than arithmetic."""

from __future__ import annotations

import tomllib
from functools import cache
from random import Random
from typing import Any

from fenwear import load_case, make_case

TINY = (
    "geometry.degree=1",
    "geometry.parameters.elements_along_contact=4",
    "geometry.parameters.growth=1.5",
    "run.half_cycles=2",
    "output.figures_at=[]",
)
WITH_HEAT = (*TINY, "heat.steps=2")
OVERLAP = ("geometry.parameters.overlap=3", "motion.positions=3")
ROUNDED = (
    *("geometry.degree=1", "geometry.parameters.elements_along_flat=4", "geometry.parameters.elements_along_edge=3"),
    *("run.half_cycles=2", "run.jump_tolerance=0.5"),
)
LAWS = """
contact.friction = {expression = "0.2 + 0.02 * tanh(T / 100) + 0 * max(p, 1)"}
wear.punch.coefficient = {table = [[0, 4e-8], [50, 5e-8], [300, 9e-8]], of = "p", unit = "MPa^-1"}
wear.strip.coefficient = {expression = "2e-8 * exp(-p / 1000) * (1 + v / 1e6)**2", unit = "MPa^-1"}
"""
EXPONENTS = """
wear.punch = {beta = "3e-9 MPa^-1.5", pressure_exponent = 1.5}
wear.strip = {coefficient = "1e-9 MPa^-1*mm^-1*s^1", speed_exponent = 2.0}
"""
HARDNESS = """
wear.punch = {archard = 1e-5, hardness = "2000 MPa"}
wear.strip = {energy = "1e-8 mm^3/(N*mm)"}
motion = {kind = "reciprocating", profile = "trapezoidal", ramp = 0.2, period = "0.5 s", amplitude = "1.5 mm", positions = 3}
"""  # noqa: E501
STROKES = """
motion = {kind = "table", times = ["0 s", "0.1 s", "0.15 s", "0.3 s"], displacements = ["0 mm", "0.02 mm", "0.02 mm", "0 mm"], positions = 2}
"""  # noqa: E501
TRACK = """
motion = {kind = "one-way", direction = "leftward", speed = "200 mm/s", duration = "0.1 s", track = "600 mm"}
wear.strip = {coefficient = "5e-6 MPa^-1"}
"""
STICK = (*TINY, "geometry.follow_wear=never", "stick.steps=2", "stick.step_tolerance=1", "run.integration=explicit")
BETWEEN = """
contact.third_body = {share = 0.5, life = "0.3 mm"}
contact.layer = {kind = "exponential", length = "1 um", pressure = "10 MPa"}
"""
PROGRAM = """
program = {steps = [{cycles = 1}, {cycles = 1, load_factor = 0.5}]}
"""
RINGS = ("geometry.degree=1", "geometry.parameters.across=2", "run.half_cycles=2", "geometry.follow_wear=never")
BORE = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.elements_along_contact=8", "run.half_cycles=2")
SOLID = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.across=4", "run.half_cycles=2")
CUP = ("geometry.parameters.across=2", "geometry.parameters.around=2", "geometry.parameters.cup_layers=1",
       "run.half_cycles=32", "run.integration=explicit")  # fmt: skip
CYCLE = """
motion.kind = "cycle"
motion.columns = ["time (s)", "shift_x (mm)"]
motion.rows = [[0, 0.001], [0.25, -0.001], [0.5, 0.0], [1, 0.001]]
"""
GRID = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.across=4", "geometry.parameters.core=0",
        "geometry.parameters.core_elements=0", "punch.operator=half-space", "strip.operator=half-space",
        "grid.nodes=17", "motion.positions=2", "run.half_cycles=2")  # fmt: skip
ROUGH = """
punch.topography = {rms = "0.05 um", longest = "0.2 mm", seed = 1}
"""
# By name: a built-in case, settings, and tables laid over it.
BASES: dict[str, tuple[str, tuple[str, ...], str]] = {
    "example1": ("example1", TINY, ""),
    "example1-heat": ("example1-heat", WITH_HEAT, ""),
    "example1-lz40-heat": ("example1-lz40-heat", WITH_HEAT, ""),
    "example2": ("example2", TINY, ""),
    "example2-heat": ("example2-heat", WITH_HEAT, ""),
    "monotonic-lz20": ("monotonic-lz20", TINY, ""),
    "fretting": ("fretting", (*TINY, "motion.positions=3"), ""),
    "laws": ("example1-heat", (*WITH_HEAT, *OVERLAP), LAWS),
    "implicit laws": ("example2-heat", (*WITH_HEAT, *OVERLAP, "run.integration=implicit"), LAWS),
    "exponents": ("fretting", (*TINY, "motion.positions=3"), EXPONENTS),
    "hardness": ("rounded-punch", (*ROUNDED, "geometry.parameters.overlap=2"), HARDNESS),
    "strokes": ("fretting", (*TINY, "punch.loads.0.over_cycle=[[0, 0.5], [0.4, 1.5], [1, 0.5]]"), STROKES),
    "track": ("monotonic-lz20", TINY, TRACK),
    "followed": ("example1-heat", (*WITH_HEAT, "geometry.follow_wear=1e-7", "run.integration=implicit"), ""),
    "across": ("example1", (*TINY, "motion.axis=y", "contact.transverse_friction=0.1"), ""),
    "program": ("example1", (*TINY, "run.half_cycles=4"), PROGRAM),
    "stick": ("fretting-partial-slip", STICK, ""),
    "stick between": ("fretting-partial-slip", STICK, BETWEEN),
    "auto": ("fretting", (*TINY, "contact.law=auto"), ""),
    "between": ("example1", TINY, BETWEEN),
    "cap": ("rounded-punch", (*ROUNDED, "contact.hardness='2 GPa'"), ""),
    "rings": ("ring-on-ring", RINGS, ""),
    "warm rings": ("ring-on-ring-heat", (*RINGS, "heat.steps=2"), ""),
    "block on ring": ("block-on-ring", BORE, ""),
    "bushing": ("bushing", (*BORE[2:], "geometry.parameters.elements_along_contact=16"), ""),
    "drum": ("drum-brake", ("geometry.parameters.elements_along_lining=6", "run.half_cycles=2"), ""),
    "solid": ("ball-on-flat", SOLID, ""),
    "pin": ("pin-on-disc", SOLID, ""),
    "stick of a sphere": ("fretting-sphere", (*SOLID, "stick.steps=2", "stick.step_tolerance=1"), ""),
    "cup": ("ball-in-cup", CUP, ""),
    "table": ("ball-on-flat", SOLID, CYCLE),
    "grid": ("ball-on-flat", GRID, ""),
    "rough": ("ball-on-flat", GRID, ROUGH),
}

# What would leave a trace in the current folder if an expression could do more than compute.
TRACE = "fuzz-was-here"
HOSTILE = (
    *("__import__('os')", f"__import__('os').mkdir('{TRACE}')", f"open('{TRACE}', 'w')", f"exec('open({TRACE!r})')"),
    *("eval('1')", "().__class__.__base__.__subclasses__()", "p.__class__", "T.tofile('x')", "exp.__globals__"),
    *("(lambda: 1)()", "[1 for _ in (1,)]", "{1: 2}", "{p}", "(p, T)", "[p]", "p[0]", "p if p else T", "p or T"),
    *("p := 1", "(q := 1)", "await p", "yield p", "*p", "**p", "p; T", "p\nT", "p = 1", "import os", "f'{p}'", "'1'"),
    *("b'1'", "1j", "True", "None", "...", "p @ T", "p // 2", "p % 2", "p << 99999", "~p", "not p", "p < T", "p is T"),
    *("9**9**9", "9**9**9**9**9**9", "1e308**9", "(-1)**0.5", "0**-1", "1/0", "log(0)", "log(-1)", "sqrt(-1)"),
    *("9" * 400, "-" + "9" * 450, "1" + "0" * 320 + "/7", "1e400", "1_0", "0x10", "٣", "1 2", "²", "p²", "ｐ", "µ"),
    *("exp(exp(exp(exp(p))))", "exp(p)**exp(p)**exp(p)", "max(p)", "min(p, T, v)", "exp()", "exp(p, T)", "exp(x=p)"),
    *("max(*p)", "exp(**p)", "EXP(p)", "math.exp(p)", "np.exp(p)", "exp", "x", "P", "t", "e", "pi", "inf", "nan"),
    *("", " ", "\t", "\n", "\x00", "#", "p #", "\\", "p \\", "(", ")", "()", "((((p))))", "'", '"', '"""', "p'", "é"),
    *("(" * 100 + "p" + ")" * 100, "(" * 249 + ")" * 249, "[" * 199 + "]" * 199, "-" * 499 + "p", "p" + "+p" * 249),
    *("p" + "**p" * 160, "exp(" * 99 + "p" + ")" * 99, "p" + ".p" * 249, "p" + "()" * 249, "not " * 120 + "p"),
    *("lambda:" * 70 + "p", "p if " * 60 + "p", "p<" * 249 + "p", "{" * 100 + "}" * 100, "p" + "[p]" * 160, "1" * 501),
    *("'\\d'", "1()", "1is 1", "0or 1", "p" * 500, "p+" * 100_000, "max(p,-p)", "abs(-p)", "1e-8", "0 * T + 1e-9 * v"),
)
GOOD = ("0.2", "1e-8", "1e-9 * (1 + p / 10)", "max(0, min(0.5, T / 100))", "abs(v) / 1e9", "tanh(p) * 1e-9 + 0")
DEPENDENCE_UNITS = (
    "",
    "1/MPa",
    "1/GPa",
    "mm^2/N",
    "MPa",
    "mm",
    "K",
    "1/MPa^2",
    "percent",
    "nonsense",
    "1e3/MPa",
    "0",
    1,
)
TABLES = (
    *([], [[]], [[0, 1e-8]], [[0, 1e-8], [0, 2e-8]], [[1, 1e-8], [0, 2e-8]], [[0, 1e-8], [1, -1e-8]], [0, 1, 2]),
    *([["0 K", 1e-8], ["1 K", 1e-8]], [[0, "1e-8 1/MPa"], [1, "2e-8 1/MPa"]], [[0, float("nan")], [1, 1]], "p"),
    *([[float("nan"), 1e-8], [1, 1e-8]], [[0, float("inf")], [1, 1]], [[-1e300, 1e-8], [1e300, 1e-8]], {"a": 1}),
    *([[0, 1e-8], [1, 2e-8]], [[0, 0], [1e3, 1e-7]], [[0, 10**400], [1, 1]], [[0, 1, 2], [1, 2, 3]], [[0, True]]),
    *([[0, 1e-8], [1e-320, 1e300]], [[k, 1e-8] for k in range(2000)]),
)
STROKE_TABLES = (
    *((["0 s", "1 s", "2 s"], ["0 mm", "1 mm", "0 mm"]), ([0, 1, 2], [0, 1, 1]), ([0, 1, 2], [1, 1, 1])),
    *(([0, 1, 1], [0, 1, 0]), ([1, 2, 3], [0, 1, 0]), ([0, 2, 1], [0, 1, 0]), ([0, 1], [0, 0]), ([], [])),
    *(([0, 1, 2], [0, float("nan"), 0]), ([0, 1e-300, 1], [0, 1e-3, 0]), ([0, 1, 2, 3], [0, 1, 0])),
    *(([0, 1, 2], [0, 1e9, 0]), ([0, 1, 2], [0, 1e-300, 0]), (list(range(41)), [k % 2 * 0.01 for k in range(41)])),
    *((["0 s", "1 mm", "2 s"], ["0 mm", "1 s", "0 mm"]), (["0 s", "1 s", "1e400 s"], [0, 0.01, 0])),
)


def motion_by_table(random: Random) -> dict[str, Any]:
    """Return the table of a motion, good or bad."""
    times, displacements = random.choice(STROKE_TABLES)
    return {"kind": "table", "times": times, "displacements": displacements}


CYCLES = (
    *(
        [[0, 1], [1, 1]],
        [[0, 1], [1, 2]],
        [[0, 1], [0.5, -1], [1, 1]],
        [[0, 0], [1, 0]],
        [[0, 1], [0.5, 1e300], [1, 1]],
    ),
    *([[0, 1]], [[1, 1], [0, 1]], [[0, 1], [0.5, 1], [0.5, 2], [1, 1]], [[0, 1], [2, 1]], [[0, "1 N"], [1, 1]], []),
    *([[0, float("nan")], [1, 1]], [[-0.0, 1], [1, 1]], [[0, 1e-300], [1, 1e-300]]),
)
LAW_TABLES: tuple[Any, ...] = (
    *({"archard": 1e-4, "hardness": "3 GPa"}, {"archard": 1e-4}, {"hardness": "3 GPa"}, {"archard": 1, "hardness": 0}),
    *({"energy": "1e-5 mm^3/J"}, {"energy": "1 J"}, {"energy": -1}, {"beta": 1e-8, "coefficient": 1e-8}, {}, None, 1),
    *({"beta": "1e-8 1/MPa"}, {"beta": "1e-8 MPa^-2", "pressure_exponent": 2}, {"beta": {"expression": "1"}}),
    *({"coefficient": 1e-8, "pressure_exponent": 0.5}, {"coefficient": 1e-8, "pressure_exponent": 1e-300}),
    *({"coefficient": 1e-8, "pressure_exponent": 99}, {"coefficient": 1e-8, "speed_exponent": 1e3}),
    *({"coefficient": "1e-8 MPa^-2", "pressure_exponent": "2"}, {"coefficient": "1e-8 1/MPa", "speed_exponent": 3}),
    *({"coefficient": True}, {"coefficient": "1e-8"}, {"coefficient": [1e-8]}, {"energy": 1e-8, "speed_exponent": 2}),
    *({"coefficient": "1e-8 MPa^-1", "pressure_exponent": "1"}, {"coefficient": 1e300}, {"coefficient": 0}),
)


@cache
def base(name: str) -> dict[str, Any]:
    """Return the tables of one of the bases, with every key that has a default."""
    case, settings, text = BASES[name]
    tables = tomllib.loads(load_case(case, settings).to_toml())
    for key, table in tomllib.loads(text).items():
        tables[key] = {**tables.get(key, {}), **table} if key in ("contact", "wear", "punch") else table
    return tomllib.loads(make_case(tables).to_toml())
