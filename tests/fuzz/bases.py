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
wear.punch = {coefficient = "3e-9 MPa^-1.5", pressure_exponent = 1.5}
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
GROWING = (*GRID[:-3], "grid={across=8, size=['0.4 mm', '0.4 mm']}", "motion.positions=2", "run.half_cycles=2")
CREEP = """
punch.creep = {terms = [{compliance = 0.2, time = "0.2 s"}, {compliance = 0.1, time = "5 s"}]}
strip.creep = {per_decade = 0.1, onset = "0.01 s"}
"""
LINEAR = """
contact.layer.kind = "linear"
contact.layer.stiffness = {expression = "1e5 * (1 + x**2)", unit = "MPa/mm"}
contact.layer.creep = {terms = [{compliance = 0.5, time = "0.3 s"}]}
"""
POWER = """
contact.layer = {kind = "power", reference = "1 um", pressure = "10 MPa", exponent = 0.5}
contact.third_body = {share = 0.8, life = {expression = "3 / (1 + 1e3 * debris)", unit = "mm"}, edge_life = "0.3 mm", edge_length = "2 mm"}
wear.punch.coefficient = {expression = "1e-8 * (0.2 + 0.8 * exp(-debris / 1e-3))", unit = "MPa^-1"}
"""  # noqa: E501
ASPERITIES = """
contact.layer = {kind = "rough", roughness = "0.5 um", asperity_radius = "50 um", asperity_density = "3000 1/mm^2"}
heat.conductance = "layer"
heat.partition = 0.5
heat.convection = "20 W/(m^2 K)"
heat.steps = 2
"""
LUBRICATED = """
contact.hardness = "2 GPa"
contact.lubrication = {film = {expression = "1e-5 * v**0.7", unit = "mm"}, roughness = "0.3 um", share_over_lambda = [[0, 1], [1, 0.5], [3, 0.05]], fluid_friction = 0.01}
[wear.punch]
coefficient = "1e-8 MPa^-1"
pressure_threshold = "5 MPa"
pressure_cap = "500 MPa"
coating = {thickness = "1 nm", coefficient = "1e-8 MPa^-1", friction = 0.1, modulus = "500 MPa"}
"""  # noqa: E501
CARRIED = """
contact.third_body = {share = 0.6, life = "0.3 mm", carried_by = "strip", initial = "0.1 um"}
wear.strip = {coefficient = "1e-8 MPa^-1"}
"""
BY_TEMPERATURE = """
motion = {kind = "one-way", direction = "leftward", speed = "200 mm/s", duration = "0.1 s"}
heat.property_tolerance = 0.001
materials.steel.conductivity = {table = [[0, 50], [100, 30]], of = "T"}
materials.steel.young = {expression = "2e5 - 100 * T", unit = "MPa"}
"""
CLOSED_TRACK = """
motion = {kind = "one-way", direction = "rightward", speed = "200 mm/s", duration = "0.1 s"}
heat.track = {heat_capacity = "1 J/K", loss = "0.1 W/K"}
strip.temperatures = []
"""
PROFILE = """
punch.profile.points = [[-0.3, 1e-4], [0, 0], [0.3, 1e-4]]
strip.profile.points = [[-0.4, 0], [0.4, 1e-5]]
"""
FRETTING_CYCLE = """
punch.loads = []
motion = {kind = "cycle", columns = ["time (s)", "shift_x (um)", "force_z (N)"], load = {on = "punch_top"}, rows = [[0, -3, -120], [2e-4, 3, -118], [1e-3, -3, -120]]}
contact.friction = {expression = "0.7 + 1e-4 * pm + cs"}
wear.punch = {per_area = "1e-9"}
"""  # noqa: E501
BLOCKS = """
program = {steps = [{cycles = 1, load_factor = [0.5, 1], ambient = [0, 5]}, {distance = "4 mm", amplitude = [1, 2]}, {time = "0.5 s", load = ["100 N"]}]}
"""  # noqa: E501
PAD = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.across=2", "geometry.parameters.along=2",
       "geometry.parameters.pad_layers=1", "geometry.parameters.disc_layers=1", "run.half_cycles=2",
       "run.integration=explicit")  # fmt: skip
TWO_PADS = (*PAD, "geometry.parameters.disc_layers=2", "geometry.parameters.around=24")
SHAFT = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.fine_elements=8", "geometry.parameters.along=2",
         "run.half_cycles=2", "run.integration=explicit")  # fmt: skip
GROOVE = ("geometry.degree=1", "geometry.parameters.across=3", "run.half_cycles=32", "run.integration=explicit")
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
    "growing": ("ball-on-flat", GROWING, ""),
    "growing creep": ("ball-on-flat", GROWING, CREEP),
    "growing stick": ("fretting-sphere", (*GROWING, "motion.positions=1", *STICK[-3:]), ""),
    "creep": ("example1", TINY, CREEP),
    "stick creep": ("fretting-partial-slip", STICK, CREEP),
    "linear layer": ("example1", TINY, LINEAR),
    "power layer": ("example1", TINY, POWER),
    "asperities": ("example1-heat", WITH_HEAT, ASPERITIES),
    "lubricated": ("rounded-punch", ROUNDED, LUBRICATED),
    "carried": ("fretting", (*TINY, "motion.positions=3"), CARRIED),
    "stick carried": ("fretting-partial-slip", (*STICK, "motion.positions=3"), CARRIED),
    "by temperature": ("example1-heat", WITH_HEAT, BY_TEMPERATURE),
    "closed track": ("example1-heat", WITH_HEAT, CLOSED_TRACK),
    "profile": ("fretting", (*TINY, "motion.positions=3"), PROFILE),
    "stick cycle": ("fretting-partial-slip", STICK, FRETTING_CYCLE),
    "blocks": ("example2-heat", (*WITH_HEAT, "run.half_cycles=4"), BLOCKS),
    "warm pad": ("brake-pad", (*PAD, "heat.steps=2"), ""),
    "two pads": ("disc-brake-two-pads", TWO_PADS, ""),
    "two bushings": ("two-bushings", SHAFT, ""),
    "misaligned": ("bushing-misaligned", (*SHAFT, "geometry.parameters.along=6"), ""),
    "groove": ("ring-in-groove", GROOVE, ""),
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
    *({"energy": "1e-5 mm^3/J"}, {"energy": "1 J"}, {"energy": -1}, {"energy": 1e-8, "coefficient": 1e-8}, {}, None, 1),
    *({"beta": "1e-8 1/MPa"}, {"coefficient": "1e-8 MPa^-2", "pressure_exponent": 2}, {"energy": {"expression": "1"}}),
    *({"coefficient": 1e-8, "pressure_exponent": 0.5}, {"coefficient": 1e-8, "pressure_exponent": 1e-300}),
    *({"coefficient": 1e-8, "pressure_exponent": 99}, {"coefficient": 1e-8, "speed_exponent": 1e3}),
    *({"coefficient": "1e-8 MPa^-2", "pressure_exponent": "2"}, {"coefficient": "1e-8 1/MPa", "speed_exponent": 3}),
    *({"coefficient": True}, {"coefficient": "1e-8"}, {"coefficient": [1e-8]}, {"energy": 1e-8, "speed_exponent": 2}),
    *({"coefficient": "1e-8 MPa^-1", "pressure_exponent": "1"}, {"coefficient": 1e300}, {"coefficient": 0}),
)


def laid_over(tables: dict[str, Any], others: dict[str, Any]) -> dict[str, Any]:
    """Return tables with the keys of others, of tables of materials too."""
    return {**tables, **{key: {**tables[key], **value} if key == "steel" else value for key, value in others.items()}}


GRIDS = ({"nodes": 9}, {"across": 8}, {"across": 3}, {"nodes": 17, "size": ["0.1 mm"]}, {"across": 8, "nodes": 9}, {})
CREEPS: tuple[Any, ...] = (
    *({"terms": [{"compliance": 1, "time": "1 s"}]}, {"terms": [{"compliance": 0, "time": 1e-300}]}, {}),
    *({"terms": [{"compliance": 1e300, "time": 1}]}, {"per_decade": 0.1}, {"per_decade": 0.1, "onset": "1 ms"}),
    *({"per_decade": 1e300, "onset": 1e-300}, {"terms": [{"compliance": 0.1, "time": 10.0**k} for k in range(-9, 9)]}),
)
LAYERS: tuple[Any, ...] = (
    *({"kind": "linear", "stiffness": "1 MPa/mm"}, {"kind": "linear", "stiffness": 1e-300}, {"kind": "linear"}, {}),
    *({"kind": "linear", "stiffness": 1e12}, {"kind": "linear", "stiffness": 1e3, "creep": CREEPS[0]}),
    *({"kind": "power", "reference": 1e-3, "pressure": 10, "exponent": e} for e in (1, 0.5, 1e-3, 0, 2)),
    *({"kind": "exponential", "length": d, "pressure": 10} for d in ("1 um", 1e-12, 1e300, 0)),
    *({"kind": "rough", "roughness": 1e-4, "asperity_radius": 0.05, "asperity_density": n} for n in (1e3, 1e-300, 0)),
    {"kind": "rough", "roughness": "1 nm", "asperity_radius": "1 m", "asperity_density": "1 1/mm^2", "modulus": 1e-9},
)
DEBRIS: tuple[Any, ...] = (
    *({"share": s, "life": d} for s, d in ((1, 1), (0.5, 1e-9), (1, 1e300), (0, 1), (2, 1), (0.5, 0))),
    *({"share": 1, "life": 1, "carried_by": body} for body in ("punch", "strip", "x")),
    *({"share": 1, "life": 1, "initial": t} for t in (1e-3, 1, 1e300, -1)),
    *({"share": 1, "life": 1, "edge_life": 0.1}, {"share": 1, "life": 1, "edge_life": 1e-9, "edge_length": 1e9}),
)
COATINGS: tuple[Any, ...] = (
    *({"thickness": t, "coefficient": 1e-8} for t in ("1 um", 1e-12, 1e300, 0, -1)),
    *({"thickness": 1e-6, "coefficient": 1e-8, "friction": mu} for mu in (0, 0.1, 10, -1)),
    *({"thickness": 1e-4, "coefficient": 1e-9, "modulus": m} for m in (1, 1e9, 1e-9, 0)),
    *({"thickness": 1e-6, "per_area": 1e-9}, {"thickness": 1e-6, "archard": 1e-4}, {"thickness": 1e-6}),
    {"thickness": {"expression": "1e-6 * (1 + x)", "unit": "mm"}, "coefficient": 1e-8},
)
TOPOGRAPHIES: tuple[Any, ...] = (
    *({"rms": h, "longest": "0.1 mm"} for h in ("0.1 um", 0, 1, -1, 1e300)),
    *({"rms": 1e-4, "longest": w, "shortest": s} for w, s in ((0.1, 0.2), (0.1, 1e-9), (1e300, 1), (0.1, 0.1))),
    *({"rms": 1e-4, "longest": 0.1, "hurst": h} for h in (0.1, 0, 1, 5)),
    *({"amplitude": 1e-4, "wavelength": w} for w in ([0.1], [0.1, 0.1], [0], [1e-9, 1e9], [])),
    *({"file": "none.npz"}, {"file": "/dev/zero"}, {}, {"amplitude": 1e-4}, {"rms": 1e-4, "amplitude": 1e-4}),
)
PROFILES: tuple[Any, ...] = (
    *([[-30, 0.001], [30, 0]], [[-1e3, 0], [1e3, 0]], [[-1e3, 1], [0, 0], [1e3, 1]], [[0, 0]], [], [[0, 0], [0, 1]]),
    *([[-1e300, 1e300], [1e300, 0]], [[-1, -1, 0], [1, -1, 0], [0, 1, 0.1]], [[30, 0], [-30, 0]]),
    [[x, y, 1e-6 * x * y] for x in (-99, 0, 99) for y in (-99, 0, 99)],
)


@cache
def base(name: str) -> dict[str, Any]:
    """Return the tables of one of the bases, with every key that has a default."""
    case, settings, text = BASES[name]
    tables = tomllib.loads(load_case(case, settings).to_toml())
    for key, table in tomllib.loads(text).items():
        tables[key] = table if key in ("motion", "program") else laid_over(tables.get(key, {}), table)
    return tomllib.loads(make_case(tables).to_toml())
