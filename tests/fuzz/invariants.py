"""Random problems held against what holds for every one of them: balances, symmetries and other ways to the same.

python3 tests/fuzz/invariants.py                    1,000 problems, seeds that no run has had before
python3 tests/fuzz/invariants.py --count 10000      some hours
python3 tests/fuzz/invariants.py --seed 4711        shows one problem and what becomes of it

A problem is made from its seed alone. `SHARED` seeds in a row have the same bodies, which are meshed and condensed
once, and once more in other units: so a problem takes some tenths of a second. Every problem is asked for its
balances: load, force and moment, volume worn by what was metered and by depth over all material points, debris, work,
heat by source, by body and by sink, energy, complementarity. Most are asked, too, whether all quantities are those of
the same problem in other sizes of length, stress, time and temperature and, where bodies are symmetric, of its mirror
image. Some are asked whether they go on from their checkpoint to the same state, whether bodies made anew for them
alone lead to the same, whether a folder of results holds it, and whether jumps come to the depths of the march at every
node. A few are asked whether their error falls with the mesh, whether two ranks find what one does, whether a slice of
a solid is the plane, and a sector the ring. What holds with any feature is asked with up to four of them
(`features.py`). Bounds are those of rounding, but for jumps (their tolerance) and meshes (their own change).
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import tomli_w
import xarray
from features import OF_BODIES, OF_PHYSICS, Scales, drawn
from images import Sizes, apart, mirrored, number, scaled
from pool import verdicts

from fenwear import evolve, load_case, make_case, run_case, to_dataset
from fenwear.case import Case
from fenwear.case.templates import fill_in, find_template
from fenwear.checks.uncertainty_sources import FROM_COLD
from fenwear.common.errors import FenwearError
from fenwear.results import checkpoint
from fenwear.results.registry import quantities_of
from fenwear.results.stored_history import load_history
from fenwear.steps.jump_method import FINE
from fenwear.steps.jump_step import LOOSEST
from fenwear.steps.run_state import RunState, all_phases
from fenwear.steps.stability import heat_gain
from fenwear.studies.run import preparation_of
from fenwear.system import Tribosystem, assemble, set_up_by, with_case, with_reduced_heat

SECONDS = 600.0  # of processor time
EXACT = 1e-9
IMAGE = 1e-7  # of a mirror image
CURVED = 1e-4  # of the image of a ball: gmsh places its curved elements to 1e-5
REDUCED = 1e-6  # of the image where heat is on a basis, of a tolerance of 1e-7
SOLVED = 1e-7  # of the contact's conditions
SCALED = 5e-6  # of a problem in other sizes: gmsh places nodes to 6e-8 of the length, a basis of heat leaves 3e-6
Tables = dict[str, Any]


class Finding(NamedTuple):
    """One thing that was looked at: how far off it is, and how far it may be."""

    name: str
    error: float
    bound: float


@dataclass(frozen=True)
class Problem:
    """A random case.

    Attributes:
        kind: Of its bodies and motion, a name in `KINDS`.
        tables: The case's.
        asks: What it may be asked besides the balances.
        pressure: What is usual in it, MPa.
        length: Width of the contact, mm.
        symmetric: Whether its mirror image about x = 0 is the same bodies.
        features: What it has besides, names in `features.FEATURES`.
    """

    kind: str
    tables: Tables
    asks: tuple[str, ...]
    pressure: float
    length: float
    symmetric: bool = True
    features: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its kind and features."""
        return " with ".join((self.kind, *([", ".join(self.features)] if self.features else [])))


class Result(NamedTuple):
    """What a run leaves: its history, with the numbers of its last cycle, and its end."""

    history: xarray.Dataset
    end: RunState
    system: Tribosystem


def put(tables: Tables, changes: Mapping[str, Any]) -> Tables:
    """Return tables with values at paths, "motion.period": 1.0; copies what it changes."""
    found = tomllib.loads(tomli_w.dumps(tables))
    for path, value in changes.items():
        at: Any = found
        *way, last = path.split(".")
        for step in way:
            at = at[int(step)] if isinstance(at, list) else at.setdefault(step, {})
        at[int(last) if isinstance(at, list) else last] = value
    return found


@cache
def _base(name: str) -> str:
    """Return the text of a built-in case with every key, or of a template as it stands."""
    return (
        make_case(tomllib.loads(fill_in(find_template(name)))).to_toml()
        if name in TEMPLATES
        else load_case(name).to_toml()
    )


def base(name: str, changes: Mapping[str, Any]) -> Tables:
    """Return the tables of a built-in case or a template with values changed, and no pictures."""
    tables = tomllib.loads(_base(name))
    return put(
        tables,
        {
            "output.report": False,
            "output.uncertainty": False,
            "output.figures_at": [],
            "output.fields_at": [],
            "geometry.follow_wear": "never",
            **changes,
        },
    )


class Bench:
    """Runs cases one after the other; those of the same bodies share what they are made from."""

    def __init__(self) -> None:
        self._systems: list[tuple[Any, Tribosystem]] = []

    def system(self, case: Case) -> Tribosystem:
        """Return the system of a case, of bodies that were there before where they are the same."""
        for made, system in self._systems:
            if made == _key(case, system):
                return with_case(system, case)
        system = assemble(case, heat=preparation_of(case))
        system.law.check_touching(system)
        self._systems = [*self._systems[-SYSTEMS + 1 :], (_key(case, system), system)]
        return system


def _key(case: Case, system: Tribosystem) -> tuple[Any, ...]:
    return preparation_of(case), case.contact.law, set_up_by(case.graded_as(system.case))


SYSTEMS = 4  # that are kept
BENCH = Bench()


def run(tables: Tables, start: RunState | None = None, half_cycles: int | None = None, bench: Bench = BENCH) -> Result:
    """Run a case from a state to a half-cycle."""
    system = bench.system(make_case(tables))
    blocks = list(evolve(system, half_cycles, start=start))
    history = to_dataset(blocks)
    for name, one in quantities_of(blocks[-1].system).items():
        if not one.dims:
            history[name] = ((), float(one.of_cycle(blocks[-1])), {"units": one.unit})
    return Result(history, blocks[-1].end, blocks[-1].system)


# --------------------------------------------------------------------------- problems


TEMPLATES = ("bushing",)
UNIQUE = 0.9  # heat_gain below which a contact with heat has one answer
INTEGRATIONS = ("explicit", "implicit")
SHARED = 40  # seeds in a row of the same bodies
# How many of the problems are asked what, of those that may be: without features, and with features.
RARE = {"jumps": 0.1, "refinement": 0.02, "ranks": 0.002, "sector": 0.02, "slice_of_solid": 0.02}
OFTEN = {"scale": 1.0, "mirror": 0.5, "restart": 0.25, "afresh": 0.02, "written": 0.04}


def _coefficient(dice: random.Random) -> str:
    return f"{10 ** dice.uniform(-9, -7):.4g} 1/MPa"


def plane(bodies: random.Random, dice: random.Random) -> Problem:
    """A punch on a hinge, or that translates only; a law of wear that may be any power of the pressure."""
    name = bodies.choice(["example1", "example2"])
    power = dice.choice([1.0, 1.0, 1.5, 2.0])
    unit = f"MPa^-{power:g}"
    changes = {
        "geometry.degree": bodies.choice([1, 2, 3]),
        "geometry.follow_wear": bodies.choice(["never", 0.5]),
        "geometry.parameters.elements_along_contact": bodies.choice([4, 6]),
        "geometry.parameters.growth": 1.5,
        "contact.friction": dice.uniform(0.0, 0.3),
        "wear.punch": {"coefficient": f"{10 ** dice.uniform(-9, -7.5):.4g} {unit}", "pressure_exponent": power},
        "punch.loads.0.force": [0.0, -(10 ** dice.uniform(3, 4.3))],
        "motion.amplitude": dice.uniform(0.8, 3),
        "run.integration": dice.choice(INTEGRATIONS),
        "run.half_cycles": 8,
    }
    asks = ("restart", "jumps", "refinement", "ranks")
    return Problem(
        "plane", base(name, changes), asks, -changes["punch.loads.0.force"][1] / 600, 60.0, name == "example2"
    )


def both(bodies: random.Random, dice: random.Random) -> Problem:
    """A cylinder on a flat: both wear, the flat on its own material under the moving cylinder."""
    amplitude = dice.uniform(0.02, 0.05)
    changes = {
        "geometry.degree": bodies.choice([1, 2]),
        "geometry.parameters.elements_along_contact": 20,
        "geometry.parameters.growth": 1.0,
        "geometry.parameters.overlap": 0.055,
        "motion.amplitude": amplitude,
        "motion.positions": dice.choice([3, 5]),
        "contact.friction": dice.uniform(0.1, 0.8),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(10, 30)],
        "run.integration": "implicit",
        "run.half_cycles": 8,
    }
    return Problem("both", base("fretting", changes), ("restart", "jumps", "ranks"), 300.0, 0.08)


def rings(bodies: random.Random, dice: random.Random) -> Problem:
    """A ring that turns on another one: both wear."""
    inner = bodies.uniform(8, 30)
    changes = {
        "geometry.degree": bodies.choice([2, 3]),
        "geometry.parameters.across": 4,
        "geometry.parameters.inner_radius": inner,
        "geometry.parameters.outer_radius": inner + bodies.uniform(5, 15),
        "geometry.parameters.margin_inside": bodies.uniform(1, 5),
        "contact.friction": dice.uniform(0, 0.3),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(500, 5000)],
        "run.integration": "implicit",
        "run.half_cycles": 10,
    }
    return Problem("rings", base("ring-on-ring", changes), ("restart", "jumps", "ranks", "sector"), 3.0, 10.0)


def solid(bodies: random.Random, dice: random.Random) -> Problem:
    """A block that slides on a block, along any way in the plane of the contact; one or both wear."""
    angle = dice.uniform(0, 2 * np.pi)
    wide = {"width": bodies.uniform(2, 4), "depth": bodies.uniform(1, 3), "punch_height": 2.0, "strip_height": 2.0}
    mesh = {"across_x": 3, "across_y": 2, "punch_layers": 2, "strip_layers": 2, "growth": 1.5}
    sizes = {**wide, **mesh, "margin_x": 0.8, "margin_y": 0.8, "margin_elements": 2}
    changes = {
        "geometry": {"file": "solid_blocks.geo", "degree": bodies.choice([1, 2]), "parameters": sizes},
        "punch.supports.0.on": "punch_far",
        "punch.loads.0.on": "punch_far",
        "punch.loads.0.force": [0.0, 0.0, -dice.uniform(50, 500)],
        "strip.supports.0.on": "strip_far",
        "contact.friction": dice.uniform(0.0, 0.2),
        "wear.punch.coefficient": _coefficient(dice),
        "motion": {
            "kind": "reciprocating",
            "amplitude": dice.uniform(0.1, 0.4),
            "period": 0.5,
            "along": [float(np.cos(angle)), float(np.sin(angle)), 0.0],
            "positions": 3,
        },
        "run.integration": "implicit",
        "run.half_cycles": 6,
    }
    if dice.random() < 0.5:
        changes["wear.strip.coefficient"] = _coefficient(dice)
    asks = ("restart", "jumps", "ranks", "slice_of_solid")
    return Problem("solid", base("pin-on-disc", changes), asks, 50.0, 3.0)


def curved(bodies: random.Random, dice: random.Random) -> Problem:
    """A shell on a turning shaft."""
    changes = {
        "geometry.parameters.elements_along_contact": 20,
        "geometry.parameters.contact_angle": 45,
        "geometry.parameters.growth": 1.0,
        "geometry.parameters.margin_elements": 3,
        "contact.friction": dice.uniform(0, 0.2),
        "wear.punch.coefficient": f"{10 ** dice.uniform(-11, -9):.4g} mm^3/(N mm)",
        "punch.loads.0.force": [0.0, -dice.uniform(300, 1500)],
        "run.integration": "implicit",
        "run.half_cycles": 10,
    }
    return Problem("curved", base("bushing", changes), ("restart", "jumps", "ranks"), 5.0, 8.0)


def stick(bodies: random.Random, dice: random.Random) -> Problem:
    """A cylinder that sticks and slips on a flat: both wear."""
    changes = {
        "geometry.degree": 1,
        "geometry.parameters.elements_along_contact": 20,
        "geometry.parameters.growth": 1.0,
        "motion.amplitude": dice.uniform(0.001, 0.004),
        "contact.friction": dice.uniform(0.4, 0.9),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(80, 150)],
        "stick.steps": 6,
        "stick.step_tolerance": 1.0,
        "run.integration": "explicit",
        "run.half_cycles": 4,
    }
    return Problem("stick", base("fretting-partial-slip", changes), ("restart", "jumps"), 600.0, 0.18)


def warm_stick(bodies: random.Random, dice: random.Random) -> Problem:
    """A cylinder that sticks and slips on a flat, and heats both."""
    made = stick(bodies, dice)
    conducts = {"conductivity": "45 W/(m K)", "heat_capacity": "460 J/(kg K)", "density": "7800 kg/m^3"}
    changes: Tables = {
        **{f"materials.steel.{key}": value for key, value in {**conducts, "expansion": "1.2e-5 1/K"}.items()},
        "heat": {"convection": "20 W/(m^2 K)", "steps": 2, "debris": dice.choice([0.0, 0.2])},
        "strip.temperatures": [{"on": "strip_bottom", "temperature": "0 K"}],
        "motion.period": f"{10 ** dice.uniform(-4, -2):.3g} s",
        "stick.steps": 6,
        "stick.step_tolerance": 1.0,
        "run.half_cycles": 4,
    }
    return replace(made, kind="warm_stick", tables=put(made.tables, changes), asks=("restart",))


def sphere(bodies: random.Random, dice: random.Random) -> Problem:
    """A ball that sticks and slips on a flat, along any way; one or both wear."""
    angle = dice.choice([0.0, dice.uniform(0, 2 * np.pi)])
    sizes = {"radius": 10.0, "contact_width": 0.4, "stroke": 0.0, "across": 4, "margin_elements": 1}
    changes: Tables = {
        "geometry.parameters": {**sizes, "ball_layers": 3, "flat_layers": 3},
        "stick.steps": 5,
        "stick.step_tolerance": 1.0,
        "motion.along": [float(np.cos(angle)), float(np.sin(angle)), 0.0],
        "contact.friction": dice.uniform(0.3, 0.9),
        "wear.punch.coefficient": _coefficient(dice),
        "run.integration": "explicit",
        "run.half_cycles": 4,
    }
    return Problem("sphere", base("fretting-sphere", changes), ("restart", "jumps"), 800.0, 0.3)


def program(bodies: random.Random, dice: random.Random) -> Problem:
    """A punch under loads and strokes that change from step to step, and along ramps."""
    steps = []
    for _ in range(dice.choice([2, 3])):
        step: Tables = {"cycles": dice.choice([1, 2])}
        step["load_factor"] = dice.choice([[dice.uniform(0.5, 2)], [dice.uniform(0.5, 1), dice.uniform(1, 2)]])
        if dice.random() < 0.5:
            step["amplitude"] = [dice.uniform(0.8, 3)]
        steps.append(step)
    changes = {
        "geometry.degree": 2,
        "geometry.parameters.elements_along_contact": 4,
        "geometry.parameters.growth": 1.5,
        "contact.friction": dice.uniform(0, 0.3),
        "wear.punch.coefficient": _coefficient(dice),
        "program": {"steps": steps},
        "run.integration": dice.choice(INTEGRATIONS),
        "run.half_cycles": 2 * sum(step["cycles"] for step in steps),
    }
    return Problem("program", base("example2", changes), ("restart",), 16.7, 60.0, symmetric=False)


def heat(bodies: random.Random, dice: random.Random) -> Problem:
    """Friction that heats both, to and fro or around."""
    if bodies.random() < 0.5:
        changes: Tables = {
            "geometry.degree": bodies.choice([1, 2]),
            "geometry.parameters.elements_along_contact": 4,
            "geometry.parameters.growth": 1.5,
            "contact.friction": dice.uniform(0.05, 0.3),
            "motion.amplitude": dice.choice([0.8, 2.3]),  # the strip stays in its place for the heat, or passes
            "heat.conductance": dice.choice(["perfect", f"{dice.uniform(50, 5000):.4g} W/(m^2 K)"]),
            "heat.debris": dice.choice([0.0, 0.1]),
            "wear.punch.coefficient": _coefficient(dice),
            "run.half_cycles": 6,
        }
        return Problem("heat", base("example2-heat", changes), ("restart", "ranks"), 16.7, 60.0)
    changes = {
        "geometry.degree": 2,
        "geometry.parameters.across": 4,
        "contact.friction": dice.uniform(0.02, 0.1),
        "wear.punch.coefficient": _coefficient(dice),
        "run.integration": "implicit",
        "run.half_cycles": 6,
    }
    return Problem("heat", base("ring-on-ring-heat", changes), ("restart", "jumps"), 3.0, 10.0)


def passing(bodies: random.Random, dice: random.Random) -> Problem:
    """A punch under which a strip passes, warm or cold, endless or a closed track."""
    warm = bodies.random() < 0.6
    motion: Tables = {
        "kind": "one-way",
        "direction": dice.choice(["rightward", "leftward"]),
        "speed": f"{dice.choice([20, 100, 400])} mm/s",
        "duration": "0.2 s",
    }
    changes: Tables = {
        "geometry.degree": bodies.choice([1, 2]),
        "geometry.parameters.elements_along_contact": 6,
        "geometry.parameters.growth": 1.5,
        "contact.friction": dice.uniform(0.02, 0.2),
        "wear.punch.coefficient": _coefficient(dice),
        "motion": motion,
        "run.integration": dice.choice(INTEGRATIONS),
        "run.half_cycles": 6,
    }
    if warm and dice.random() < 0.5:
        motion["track"] = "2 m"
        changes |= {"heat.track": {"heat_capacity": "300 J/K", "loss": "1 W/K"}, "strip.temperatures": []}
    name = "example2-heat" if warm else "example2"
    return Problem("passing", base(name, changes), ("restart", "jumps", "ranks"), 16.7, 60.0)


def block(bodies: random.Random, dice: random.Random) -> Problem:
    """A block on a turning ring, which wears or not."""
    changes: Tables = {
        "geometry.degree": bodies.choice([1, 2]),
        "geometry.parameters.elements_along_contact": 24,
        "contact.friction": dice.uniform(0.0, 0.6),
        "wear.punch.coefficient": f"{10 ** dice.uniform(-10, -8):.4g} 1/MPa",
        "motion.direction": dice.choice(["clockwise", "counterclockwise"]),
        "run.integration": "implicit",
        "run.half_cycles": 6,
    }
    if dice.random() < 0.5:
        changes["wear.strip.coefficient"] = f"{10 ** dice.uniform(-10, -9):.4g} 1/MPa"
    return Problem("block", base("block-on-ring", changes), ("restart", "jumps", "ranks"), 80.0, 1.0)


def oval(bodies: random.Random, dice: random.Random) -> Problem:
    """A punch that goes round on the strip, and whose load changes on the way."""
    x, y = dice.uniform(0.5, 3), dice.uniform(0, 1)
    rows = [[250.0 * k, x * np.cos(k * np.pi / 2), y * np.sin(k * np.pi / 2), -dice.uniform(4, 10)] for k in range(4)]
    motion = {
        "kind": "cycle",
        "columns": ["time (ms)", "shift_x (mm)", "shift_y (mm)", "force_z (kN)"],
        "rows": [[float(value) for value in row] for row in [*rows, [1000.0, *rows[0][1:]]]],
        "load": {"on": "punch_load"},
    }
    changes: Tables = {
        "geometry.degree": bodies.choice([1, 2]),
        "geometry.parameters.elements_along_contact": 6,
        "geometry.parameters.growth": 1.5,
        "contact.friction": dice.uniform(0.0, 0.3),
        "wear.punch.coefficient": _coefficient(dice),
        "punch.loads": [],
        "motion": motion,
        "run.integration": "explicit",
        "run.half_cycles": 12,
    }
    return Problem("oval", base("example1", changes), ("restart", "jumps"), 12.0, 60.0, symmetric=False)


def ball(bodies: random.Random, dice: random.Random) -> Problem:
    """A ball on a flat, on its mesh or on a grid; both wear or one."""
    changes: Tables = {
        "geometry.degree": 1,
        "geometry.order": bodies.choice([1, 2]),
        "geometry.parameters.across": 6,
        "contact.friction": dice.uniform(0.0, 0.6),
        "wear.punch.coefficient": _coefficient(dice),
        "motion.positions": 3,
        "run.integration": "explicit",
        "run.half_cycles": 4,
    }
    if dice.random() < 0.5:
        changes |= {"wear.strip.coefficient": _coefficient(dice)}
    if bodies.random() < 0.4:
        changes |= {"punch.operator": "half-space", "strip.operator": "half-space", "grid": {"nodes": 17}}
    tables = base("ball-on-flat", changes)
    if "wear.strip.coefficient" not in changes:
        del tables["wear"]["strip"]
    return Problem("ball", tables, ("restart", "jumps"), 800.0, 0.2)


KINDS: dict[str, Callable[[random.Random], Problem]] = {
    make.__name__: make
    for make in (
        *(plane, both, rings, solid, curved, stick, program),
        *(heat, passing, block, oval, ball, warm_stick, sphere),
    )
}


def problem(seed: int) -> tuple[Problem, tuple[str, ...]]:
    """Return the problem of a seed, and what it is asked besides the balances."""
    bodies, dice = random.Random(f"bodies {seed // SHARED}"), random.Random(seed)
    made = list(KINDS.values())[seed // SHARED % len(KINDS)](bodies, dice)
    rare = [ask for ask in made.asks if ask in RARE and dice.random() < RARE[ask]]
    if rare:
        return made, (rare[0],)
    asks = tuple(ask for ask in OFTEN if dice.random() < OFTEN[ask] and (ask != "mirror" or made.symmetric))
    if "mirror" in asks and made.tables["motion"]["kind"] == "reciprocating" and made.kind not in SOLIDS:
        made = replace(made, tables=put(made.tables, {"motion": mirrored(made.tables)[0]["motion"]}))
    of_bodies = drawn(bodies, _scales(made), OF_BODIES, (0, 0, 1))
    others = drawn(dice, _scales(made), OF_PHYSICS, (0, 1, 2, 3))
    features, changes = of_bodies[0] + others[0], of_bodies[1] | others[1]
    if made.kind in ("program", "rings") and "contact.hardness" in changes:  # whose loads are up to twice as large
        changes["contact.hardness"] = f"{4 * made.pressure} MPa"
    if "heat" in made.tables:  # a reduced operator is as near as its tolerance
        on_basis = "track" in made.tables["heat"] or made.kind == "warm_stick"
        changes |= {"heat.reduction_tolerance": 1e-7} if on_basis else {"heat.operator": "full"}
    return replace(made, tables=put(made.tables, changes), features=features), asks


def _scales(made: Problem) -> Scales:
    """Return what is usual in a problem."""
    case = make_case(made.tables)
    wear = number(made.tables["wear"]["punch"]["coefficient"])
    power = made.tables["wear"]["punch"].get("pressure_exponent", 1.0)
    wear *= made.pressure ** (power - 1)
    return Scales(
        pressure=made.pressure,
        length=made.length,
        slide=SLIDE.get(made.kind, 5.0),
        time={"oval": 0.25, "block": 1.0, "curved": 1.0, "rings": 1.0}.get(made.kind, 0.2),
        wear=wear,
        strip=case.wear.strip is not None,
        heat=case.heat is not None,
        one_way=made.kind in ("rings", "curved", "passing", "block"),
        solid=made.kind in SOLIDS,
        power=power,
        friction=made.tables["contact"]["friction"],
    )


SOLIDS = ("solid", "ball", "sphere")
SLIDE = {  # mm
    "block": 500.0,
    "curved": 60.0,
    "rings": 100.0,
    "both": 0.07,
    "ball": 0.2,
    "stick": 0.01,
    "warm_stick": 0.01,
    "sphere": 0.01,
}


# --------------------------------------------------------------------------- balances


def balances(result: Result, tables: Tables) -> list[Finding]:
    """Return the errors of all that must add up in a run."""
    history = result.history
    scale = float(np.abs(history.pressure).max())
    contact = tables["contact"]
    loose = SOLVED
    if tables["run"]["integration"] == "jump" and "grid" in tables:  # whose solutions cost by their digits
        loose = FINE * min(tables["run"]["jump_tolerance"], LOOSEST)
    found = [
        Finding("forces and moments", float(history.equilibrium_error.max()), EXACT),
        Finding("no tension", max(0.0, -float(history.pressure.min())) / scale, 0.0),
        Finding("complementarity error", float(history.complementarity_error.max()), loose),
    ]
    if "layer" not in contact:
        found.append(Finding("complementarity", _overlap(history, tables), loose))
    closed = tables["motion"]["kind"] == "rotation" and tables["model"]["kind"] == "plane"  # meshed in part
    ends = ("",) if closed or "track" in tables["motion"] else ("", "_strip")
    found += [_volume(history, tables, end) for end in ends if f"wear{end}" in history]
    found += _load(history, tables)
    if "debris_balance_error" in history:
        found.append(Finding("debris", float(history.debris_balance_error.max()), EXACT))
    constant = isinstance(contact["friction"], float) and not {"lubrication"} & set(contact)
    constant = constant and "friction" not in tables["wear"]["punch"].get("coating", {})
    if (
        tables["motion"]["kind"] in ("reciprocating", "one-way")
        and tables["model"]["kind"] == "plane"
        and constant
        and "step" not in history.dims
    ):
        load = history.normal_force.values  # of the middle of the half-cycle, and the same all through it where flat
        made = contact["friction"] * load * np.diff(history.sliding_distance.values, prepend=0.0)
        told = np.diff(history.friction_work.values, prepend=0.0)
        found.append(Finding("work of friction", float(np.abs(told - made).max() / max(made.max(), 1e-300)), 1e-3))
    if "step" in history.dims:
        found += _balances_of_stick(result, tables, constant)
    if "heat_balance_error" in history:
        found.append(Finding("heat", float(history.heat_balance_error.max()), EXACT))
        heat = {name: history[f"heat_{name}"].values for name in HEAT}
        most = np.abs(heat["friction"]).max()
        crossing = heat["into_punch"] + heat["into_strip"]
        lost = heat["convected"] + heat["held"] + heat["carried"]
        found.append(Finding("heat of both bodies", _most(heat["friction"] - heat["debris"] - crossing, most), EXACT))
        found.append(Finding("heat kept and lost", _most(crossing - heat["stored"] - lost, most), EXACT))
        told = np.diff(history.friction_work.values, prepend=0.0)
        if tables["run"]["integration"] != "jump":  # whose work is of all that it leaps over
            found.append(Finding("heat of friction", _most(heat["friction"] - told, np.abs(told).max()), EXACT))
    return found


HEAT = ("friction", "debris", "stored", "convected", "held", "carried", "into_punch", "into_strip")


def _most(values: np.ndarray, scale: float) -> float:
    return float(np.abs(values).max()) / scale


def _load(history: xarray.Dataset, tables: Tables) -> list[Finding]:
    """Compare the force of the pressures with the load, and their moment about a hinge with that of the load."""
    loads = tables["punch"].get("loads", [])
    if len(loads) != 1 or "over_cycle" in loads[0] or "step" in history.dims:
        return []
    given = -number(loads[0]["force"][-1])
    load = given * history.load_factor.values if "load_factor" in history else given
    ramps = any(len(step.get("load_factor", ())) > 1 for step in tables.get("program", {}).get("steps", []))
    found = [] if ramps else [Finding("load", _most(history.normal_force.values - load, given), EXACT)]
    sizes = tables["geometry"].get("parameters", {})
    supports = tables["punch"]["supports"]
    if "pin_height_1" in sizes and "pin_height_2" not in sizes and isinstance(tables["contact"]["friction"], float):
        if set(tables["contact"]) & {"lubrication"} or "coating" in tables["wear"]["punch"] or len(supports) != 1:
            return found
        x, side = history.x.values, sizes["punch_width"] / 2
        arm = number(sizes["pin_height_1"])
        forces = history.pressure.values * history.weight.values * 10.0
        friction = tables["contact"]["friction"] * history.direction.values * forces.sum(axis=1) * arm
        found.append(Finding("moment", _most(forces @ (x - side) + given * side + friction, given * side), 1e-8))
    return found


def _overlap(history: xarray.Dataset, tables: Tables) -> float:
    """Return the largest of p gap and of the overlap, over the scales of pressure and of what bodies yield."""
    pressure, gap = history.pressure.values, history.gap.values
    across = np.ptp(history["r" if "r" in history else "x"].values)
    softest = min(number(material["young"]) for material in tables["materials"].values())
    p = np.abs(pressure).max()
    g = max(np.abs(gap).max(), p / softest * across)
    return max(float(np.abs(pressure * gap).max() / (p * g)), float(max(0.0, -gap.min()) / g))


def _volume(history: xarray.Dataset, tables: Tables, end: str) -> Finding:
    """Compare the volume that was metered with the depths over all material points."""
    depth, weight = history[f"wear{end}"].values[-1], history[f"weight{end}"].values[-1]
    thickness = make_case(tables).model.thickness if tables["model"]["kind"] == "plane" else 1.0
    metered = float(history[f"worn_volume{end}"].values[-1])
    error = abs(metered - thickness * float(depth @ weight)) / max(metered, 1e-300)
    return Finding(f"volume{end}", error, EXACT)


def _balances_of_stick(result: Result, tables: Tables, constant: bool) -> list[Finding]:
    history = result.history
    traction, pressure = history.traction.values, history.step_pressure.values
    load = -number(tables["punch"]["loads"][0]["force"][-1])
    scale = float(np.nanmax(pressure))
    found = [
        Finding("load", float(np.nanmax(np.abs(history.normal_force - load))) / load, EXACT),
        Finding("energy", float(history.energy_balance_error.max()), EXACT),
        Finding("no tension in a step", max(0.0, -float(np.nanmin(pressure))) / scale, 0.0),
    ]
    if constant:
        beyond = np.abs(traction) - tables["contact"]["friction"] * pressure
        found.append(Finding("cone", float(np.nanmax(beyond)) / scale, EXACT))
    return found


# --------------------------------------------------------------------------- other ways


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return the largest difference at any node over the largest value."""
    return float(np.abs(first - second).max() / max(float(np.abs(first).max()), 1e-300))


def _depths(result: Result) -> dict[str, np.ndarray]:
    history = result.history
    return {name: history[name].values[-1] for name in ("wear", "wear_strip") if name in history}


def _compare(what: str, one: Result, other: Result, bound: float) -> list[Finding]:
    second = _depths(other)
    return [Finding(f"{what}: {name}", _distance(v, second[name]), bound) for name, v in _depths(one).items()]


def restart(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether a run that stops half-way and goes on from its checkpoint comes to the same."""
    half = run(problem_.tables, half_cycles=problem_.tables["run"]["half_cycles"] // 2)
    with tempfile.TemporaryDirectory() as folder:
        checkpoint.save(Path(folder), half.system, half.end, {})
        _, state, _ = checkpoint.load(Path(folder), BENCH.system(make_case(problem_.tables)))
    return _compare("restart", whole, run(problem_.tables, state), EXACT)


def afresh(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether bodies that are made for this problem alone lead to the same."""
    return _compare("afresh", whole, run(problem_.tables, bench=Bench()), EXACT)


def written(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether a run into a folder has the same history there, and warns of no balance."""
    with tempfile.TemporaryDirectory() as folder:
        summary, path = run_case(make_case(problem_.tables), "x", Path(folder) / "x", lambda _: None, progress="none")
        found = _compare("written", whole, whole._replace(history=load_history(path)), EXACT)
    return found + [Finding(f"warned: {text}", 1.0, 0.0) for text in summary["warnings"] if "balance" in text]


def jumps(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether jumps come to the depths of a march, at every node."""
    how = ("explicit", 24) if problem_.kind in ("stick", "sphere") else ("implicit", 60)
    tables = put(problem_.tables, {"run.integration": how[0], "run.half_cycles": how[1]})
    marched = run(tables)
    jumping = put(tables, {"run.integration": "jump", "run.jump_tolerance": 1e-3})
    jumped = run(jumping)
    bound = 0.02
    if problem_.kind == "passing" and "heat" in tables:  # whose half-cycles are time steps of the warm-up
        half = {"run.half_cycles": 2 * how[1], "motion.duration": f"{number(tables['motion']['duration']) / 2} s"}
        bound = max(bound, *(FROM_COLD * one.error for one in _compare("", marched, run(put(tables, half)), bound)))
    return _compare("jumps", marched, jumped, bound) + balances(jumped, jumping)


def refinement(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether depths away from the edges change less from a mesh to the next finer one."""
    count = problem_.tables["geometry"]["parameters"]["elements_along_contact"]
    runs = [whole]
    for factor in (2, 4):
        finer = {
            "geometry.parameters.elements_along_contact": factor * count,
            "geometry.parameters.growth": 1.0 / factor,
        }
        runs.append(run(put(problem_.tables, finer)))
    inside = np.linspace(-0.7, 0.7, 29)
    profiles = []
    for one in runs:
        x = one.history.x.values
        profiles.append(np.interp(inside * x.max(), x, one.history.wear.values[-1]))
    first, second = (_distance(profiles[2], p) for p in profiles[:2])
    return [Finding("refinement", second, max(0.75 * first, 1e-3))]


def scale(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether the same problem in other sizes has the same numbers."""
    dice = random.Random(str(problem_.tables["geometry"]))  # so that bodies are shared, too
    sizes = Sizes(*(10 ** dice.uniform(-most, most) for most in (3, 3, 3, 0.5)))
    tables = scaled(tomllib.loads(make_case(problem_.tables).to_toml()), sizes)
    other = run(tables).history
    name, error = apart(whole.history, other, sizes, _images(whole.history, other, 1 / sizes.of("mm")))
    return [Finding(f"scale: {name}", error, 1e-3 if problem_.kind in SOLIDS else SCALED)]  # as gmsh's nodes


def mirror(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether what slides the other way first is the image of what slides this way first."""
    if problem_.kind in SOLIDS:
        along = problem_.tables["motion"].get("along", [1.0, 0.0, 0.0])
        tables = put(problem_.tables, {"motion.along": [-v for v in along]})
    else:
        tables = mirrored(tomllib.loads(make_case(problem_.tables).to_toml()))[1]
    one, other = whole.history, run(tables).history
    name, error = apart(one, other, Sizes(1.0, 1.0, 1.0, 1.0), _images(one, other, 1.0, -1.0), (1.0, -1.0))
    reduced = "track" in problem_.tables.get("heat", {}) or problem_.kind == "warm_stick"
    bound = CURVED if problem_.kind in ("ball", "sphere") else REDUCED if reduced else IMAGE
    return [Finding(f"mirror: {name}", error, bound)]


def _images(one: xarray.Dataset, other: xarray.Dataset, factor: float, sign: float = 1.0) -> dict[str, np.ndarray]:
    """Return where the images of nodes lie in the other history, by dimension.

    Args:
        one: A history.
        other: That of its image.
        factor: By which lengths of the other are multiplied.
        sign: Of x and y of the other.
    """
    found = {}
    for dim, end in (("x", ""), ("x_strip", "_strip"), ("node", ""), ("node_strip", "_strip")):
        if dim not in one.dims:
            continue
        names = [f"{name}{end}" for name in ("x", "y", "r", "z", "height") if f"{name}{end}" in one]
        signs = [sign if name[0] in "xy" else 1.0 for name in names]
        here = np.column_stack([one[name].values for name in names])
        there = np.column_stack([factor * s * other[name].values for name, s in zip(names, signs, strict=True)])
        away = np.abs(here[:, None] - there[None]).sum(axis=2)
        found[dim] = away.argmin(axis=1)
        if not away.min(axis=1).max() < 1e-4 * np.ptp(here):
            raise ValueError(f"{dim} has no image")
    return found


def ranks(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether two ranks find what one does."""
    command = ["mpirun", "--oversubscribe", "-n", "2", sys.executable, "-m", "fenwear", "run", "case.toml", "-o", "two"]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.toml").write_text(tomli_w.dumps(problem_.tables), "utf-8")
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=3 * SECONDS, check=False)
        if done.returncode:
            return [Finding(f"ranks: {done.stderr[-300:]}", 1.0, 0.0)]
        return _compare("ranks", whole, whole._replace(history=load_history(Path(folder) / "two")), EXACT)


def sector(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether a quarter of both rings, a solid between planes of symmetry, has the rings' depths without friction.

    They come nearer with the mesh: 0.026, 0.020 and 0.014 for 4, 6 and 8 elements across the worst of ten.
    """
    sizes = {**problem_.tables["geometry"]["parameters"], "across": 6}
    quarter = Path(__file__).with_name("quarter_of_rings.geo")
    load = problem_.tables["punch"]["loads"][0]["force"][1]
    own = {name: sizes[name] for name in ("inner_radius", "outer_radius", "margin_inside", "margin_outside", "across")}
    held = [{"on": f"{{}}_{plane}", "fix": [axis]} for plane, axis in (("plane_x", "y"), ("plane_y", "x"))]
    frictionless = put(problem_.tables, {"contact.friction": 0.0, "geometry.parameters": sizes})
    changes = {
        "geometry": {"file": str(quarter), "degree": 2, "order": 2, "parameters": own},
        "model": {"kind": "solid"},
        "punch.supports": [{**s, "on": s["on"].format("punch")} for s in held],
        "punch.loads.0.force": [0.0, 0.0, load / 4],
        "strip.supports": [
            {"on": "strip_far", "fix": ["x", "y", "z"]},
            *({**s, "on": s["on"].format("strip")} for s in held),
        ],
    }
    frictionless["geometry"]["degree"] = 2
    ring = run(frictionless).history
    solid_ = run(put(frictionless, changes)).history
    radius = np.hypot(solid_.x.values, solid_.y.values)
    inside = np.abs(radius - (sizes["inner_radius"] + sizes["outer_radius"]) / 2) < 0.35 * (
        sizes["outer_radius"] - sizes["inner_radius"]
    )
    order = np.argsort(ring.r.values)
    expected = np.interp(radius, ring.r.values[order], ring.wear.values[-1][order])
    return [Finding("sector", _distance(expected[inside], solid_.wear.values[-1][inside]), 0.03)]


def slice_of_solid(problem_: Problem, whole: Result) -> list[Finding]:
    """Whether a solid whose sides are held has the depths of plane strain, at every node of each of its rows."""
    sizes = problem_.tables["geometry"]["parameters"]
    same = {
        name: sizes[name]
        for name in ("width", "punch_height", "strip_height", "punch_layers", "strip_layers", "growth")
    }
    motion = {"kind": "reciprocating", "amplitude": problem_.tables["motion"]["amplitude"], "period": 0.5}
    load = problem_.tables["punch"]["loads"][0]["force"][2]
    one_worn = {"wear": {"punch": problem_.tables["wear"]["punch"]}, "geometry.degree": 2, "run.half_cycles": 4}
    held = {"fix": ["y"]}
    solid_ = put(problem_.tables, {
        **one_worn,
        "geometry.parameters": {**same, "depth": sizes["depth"], "across_x": 4, "across_y": 1},
        "punch.supports": [{"on": "punch_far", "fix": ["x"]}, {**held, "on": "punch_ends"}],
        "strip.supports": [
            {"on": "strip_far", "fix": ["x", "y", "z"]}, {**held, "on": "strip_ends"},
        ],
        "motion": {**motion, "along": [1.0, 0.0, 0.0]},
    })  # fmt: skip
    flat = put(problem_.tables, {
        **one_worn,
        "geometry": {"file": "blocks.geo", "degree": 2, "parameters": {**same, "across": 4}},
        "model": {"plane": "strain", "thickness": sizes["depth"]},
        "punch.supports": [{"on": "punch_far", "fix": ["x"]}],
        "punch.loads.0.force": [0.0, load],
        "strip.supports": [{"on": "strip_far", "fix": ["x", "z"]}],
        "motion": motion,
    })  # fmt: skip
    solid_depth, plane_depth = run(solid_).history, run(flat).history
    expected = np.interp(solid_depth.x.values, plane_depth.x.values, plane_depth.wear.values[-1])
    return [Finding("slice", _distance(expected, solid_depth.wear.values[-1]), EXACT)]


ASKS: dict[str, Callable[[Problem, Result], list[Finding]]] = {
    ask.__name__: ask
    for ask in (scale, mirror, restart, afresh, written, jumps, refinement, ranks, sector, slice_of_solid)
}


# --------------------------------------------------------------------------- one after the other


def try_problem(seed: int) -> tuple[str, str]:
    """Return ok, several, refused or wrong, and why."""
    made, asks = problem(seed)
    told = f"{made.name}; {', '.join(asks)}"
    try:
        whole = run(made.tables)
        found = [*balances(whole, made.tables), *(one for ask in asks for one in ASKS[ask](made, whole))]
    except FenwearError as error:
        return "refused", f"{told}: {error}"
    bad = [f"{f.name} {f.error:.2e} (bound {f.bound:.0e})" for f in found if not f.error <= f.bound]
    if not bad:
        return "ok", told
    several = {"jumps", "scale", "mirror"} & set(asks) and _gain(whole) > UNIQUE
    return "several" if several else "wrong", f"{told}: {'; '.join(bad)}"


def _gain(whole: Result) -> float:
    """Return how much of a pressure the heat of its friction gives back: above 1 rounding decides among the answers."""
    if whole.system.case.heat is None:
        return 0.0
    system, pressure = with_reduced_heat(whole.system), all_phases(whole.end.contacts).pressure
    return max(heat_gain(system, at) or 0.0 for at in ([None, pressure] if len(pressure) else [None]))


def main() -> None:
    """Try many, or show one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=None, help="seed of the first; by default one from the clock")
    parser.add_argument("--seed", type=int, default=None, help="of one problem to show")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    if given.seed is not None:
        made, asks = problem(given.seed)
        sys.stdout.write(f"# {made.name}; {', '.join(asks)}\n{tomli_w.dumps(made.tables)}\n{try_problem(given.seed)}\n")
        return
    first = time.time_ns() // 10**9 * 1000 if given.first is None else given.first
    kinds, asked = Counter[str](), Counter[str]()
    for verdict in verdicts(try_problem, range(first, first + given.count), given.workers, SECONDS):
        kinds[verdict.kind] += 1
        made, asks = problem(verdict.seed)
        asked.update((made.kind, *made.features, *asks))
        if verdict.kind not in ("ok", "several"):
            sys.stdout.write(f"{verdict.seed} {verdict.kind}: {verdict.text}\n")
        if sum(kinds.values()) % SHARED == 0:
            sys.stdout.write(f"of seeds from {first} on: {dict(kinds)}\n")
        sys.stdout.flush()
    sys.stdout.write(f"seeds {first} to {first + given.count - 1}: {dict(kinds)}\n{dict(asked)}\n")
    sys.exit(any(kinds[kind] for kind in ("wrong", "traceback", "crash", "hang")))


if __name__ == "__main__":
    main()
