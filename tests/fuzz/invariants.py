"""Random problems held against what holds for every one of them: balances, symmetries and other ways to the same.

python3 tests/fuzz/invariants.py                    200 problems, seeds that no run has had before
python3 tests/fuzz/invariants.py --count 2000       a night
python3 tests/fuzz/invariants.py --seed 4711        shows one problem and what becomes of it

A problem is made from its seed alone, run like any user's case, and judged by what its folder holds. Every problem is
asked for its balances: forces, volume worn by what was metered and by depth over all material points, work, heat,
complementarity. In turn it is asked one thing more: whether it goes on from its checkpoint to the same state,
whether jumps come to the depths of the march at every node, whether its mirror image is its image, whether its error
falls with the mesh, whether two ranks find what one does, whether a slice of a solid is the plane, and a sector the
ring. Bounds are those of rounding, but for jumps (their tolerance) and meshes (their own change).
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
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import tomli_w
import xarray
from pool import verdicts

from fenwear import load_case, make_case, run_case
from fenwear.case.templates import fill_in, find_template
from fenwear.errors import FenwearError
from fenwear.results.reading import load_history

SECONDS = 600.0  # of processor time
EXACT = 1e-9
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
    """

    kind: str
    tables: Tables
    asks: tuple[str, ...] = field(default=())


class Result(NamedTuple):
    """What a run leaves."""

    history: xarray.Dataset
    summary: Tables


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
    return put(tables, {"output.report": False, "output.figures_at": [], "output.fields_at": [], **changes})


def run(tables: Tables, folder: Path, *, resume: bool = False) -> Result:
    """Run a case into a folder."""
    summary, _ = run_case(make_case(tables), "random", folder, lambda _: None, resume=resume, progress="none")
    return Result(load_history(folder), summary)


# --------------------------------------------------------------------------- problems


TEMPLATES = ("bushing",)
INTEGRATIONS = ("explicit", "implicit")


def _coefficient(dice: random.Random) -> str:
    return f"{10 ** dice.uniform(-9, -7):.4g} 1/MPa"


def plane(dice: random.Random) -> Problem:
    """A punch on a hinge, or that translates only; a law of wear that may be any power of the pressure."""
    name = dice.choice(["example1", "example2"])
    power = dice.choice([1.0, 1.0, 1.5, 2.0])
    unit = f"MPa^-{power:g}"
    changes = {
        "geometry.degree": dice.choice([1, 2, 3]),
        "geometry.parameters.elements_along_contact": dice.choice([4, 6]),
        "geometry.parameters.growth": 1.5,
        "contact.friction": dice.uniform(0.0, 0.3),
        "wear.punch": {"coefficient": f"{10 ** dice.uniform(-9, -7.5):.4g} {unit}", "pressure_exponent": power},
        "punch.loads.0.force": [0.0, -(10 ** dice.uniform(3, 4.3))],
        "motion.amplitude": dice.uniform(0.8, 3),
        "run.integration": dice.choice(INTEGRATIONS),
        "run.half_cycles": 8,
    }
    asks = ("restart", "jumps", "refinement", "ranks") + (("mirror",) if name == "example2" else ())
    return Problem("plane", base(name, changes), asks)


def both(dice: random.Random) -> Problem:
    """A cylinder on a flat: both wear, the flat on its own material under the moving cylinder."""
    amplitude = dice.uniform(0.02, 0.05)
    changes = {
        "geometry.degree": dice.choice([1, 2]),
        "geometry.parameters.elements_along_contact": 20,
        "geometry.parameters.growth": 1.0,
        "geometry.parameters.overlap": 0.06,
        "motion.amplitude": amplitude,
        "motion.positions": dice.choice([3, 5]),
        "contact.friction": dice.uniform(0.1, 0.8),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(10, 30)],
        "run.integration": "implicit",
        "run.half_cycles": 8,
    }
    return Problem("both", base("fretting", changes), ("restart", "jumps", "mirror", "ranks"))


def rings(dice: random.Random) -> Problem:
    """A ring that turns on another one: both wear."""
    inner = dice.uniform(8, 30)
    changes = {
        "geometry.degree": dice.choice([2, 3]),
        "geometry.parameters.across": 4,
        "geometry.parameters.inner_radius": inner,
        "geometry.parameters.outer_radius": inner + dice.uniform(5, 15),
        "geometry.parameters.margin_inside": dice.uniform(1, 5),
        "contact.friction": dice.uniform(0, 0.3),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(500, 5000)],
        "run.integration": "implicit",
        "run.half_cycles": 10,
    }
    return Problem("rings", base("ring-on-ring", changes), ("restart", "jumps", "ranks", "sector"))


def solid(dice: random.Random) -> Problem:
    """A block that slides on a block, along any way in the plane of the contact; one or both wear."""
    angle = dice.uniform(0, 2 * np.pi)
    wide = {"width": dice.uniform(2, 4), "depth": dice.uniform(1, 3), "punch_height": 2.0, "strip_height": 2.0}
    mesh = {"across_x": 3, "across_y": 2, "punch_layers": 2, "strip_layers": 2, "growth": 1.5}
    sizes = {**wide, **mesh, "margin_x": 0.8, "margin_y": 0.8, "margin_elements": 2}
    changes = {
        "geometry": {"file": "solid_blocks.geo", "degree": dice.choice([1, 2]), "parameters": sizes},
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
    return Problem("solid", base("pin-on-disc", changes), ("restart", "jumps", "mirror", "ranks", "slice_of_solid"))


def curved(dice: random.Random) -> Problem:
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
    return Problem("curved", base("bushing", changes), ("restart", "jumps", "ranks"))


def stick(dice: random.Random) -> Problem:
    """A cylinder that sticks and slips on a flat: both wear."""
    changes = {
        "geometry.degree": 1,
        "geometry.parameters.elements_along_contact": 24,
        "geometry.parameters.growth": 1.0,
        "motion.amplitude": dice.uniform(0.001, 0.004),
        "contact.friction": dice.uniform(0.4, 0.9),
        "wear.punch.coefficient": _coefficient(dice),
        "wear.strip.coefficient": _coefficient(dice),
        "punch.loads.0.force": [0.0, -dice.uniform(80, 150)],
        "run.integration": "explicit",
        "run.half_cycles": 8,
    }
    return Problem("stick", base("fretting-partial-slip", changes), ("restart", "jumps"))


def program(dice: random.Random) -> Problem:
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
    return Problem("program", base("example2", changes), ("restart",))


def heat(dice: random.Random) -> Problem:
    """Friction that heats both, to and fro or around."""
    if dice.random() < 0.5:
        changes: Tables = {
            "geometry.degree": dice.choice([1, 2]),
            "geometry.parameters.elements_along_contact": 4,
            "geometry.parameters.growth": 1.5,
            "contact.friction": dice.uniform(0.05, 0.3),
            "heat.conductance": dice.choice(["perfect", f"{dice.uniform(50, 5000):.4g} W/(m^2 K)"]),
            "heat.debris": dice.choice([0.0, 0.1]),
            "wear.punch.coefficient": _coefficient(dice),
            "run.half_cycles": 6,
        }
        return Problem("heat", base("example2-heat", changes), ("restart", "ranks"))
    changes = {
        "geometry.degree": 2,
        "geometry.parameters.across": 4,
        "contact.friction": dice.uniform(0.02, 0.1),
        "wear.punch.coefficient": _coefficient(dice),
        "run.integration": "implicit",
        "run.half_cycles": 6,
    }
    return Problem("heat", base("ring-on-ring-heat", changes), ("restart", "jumps"))


KINDS: dict[str, Callable[[random.Random], Problem]] = {
    make.__name__: make for make in (plane, both, rings, solid, curved, stick, program, heat)
}


def problem(seed: int) -> tuple[Problem, str]:
    """Return the problem of a seed, its kinds in turn, and what it is asked besides the balances."""
    dice = random.Random(seed)
    found = list(KINDS.values())[seed % len(KINDS)](dice)
    return found, dice.choice(found.asks)


# --------------------------------------------------------------------------- balances


def balances(result: Result, tables: Tables) -> list[Finding]:
    """Return the errors of all that must add up in a run."""
    history = result.history
    scale = float(np.abs(history.pressure).max())
    found = [
        Finding("forces and moments", float(history.equilibrium_error.max()), EXACT),
        Finding("no tension", max(0.0, -float(history.pressure.min())) / scale, 0.0),
        Finding("complementarity", _overlap(history), 1e-7),
    ]
    found += [_volume(history, tables, end) for end in ("", "_strip") if f"wear{end}" in history]
    if (
        tables["motion"]["kind"] == "reciprocating"
        and tables["model"]["kind"] == "plane"
        and "step" not in history.dims
    ):
        load = history.normal_force.values  # of the middle of the half-cycle, and the same all through it where flat
        made = tables["contact"]["friction"] * load * np.diff(history.sliding_distance.values, prepend=0.0)
        told = np.diff(history.friction_work.values, prepend=0.0)
        found.append(Finding("work of friction", float(np.abs(told - made).max() / max(made.max(), 1e-300)), 1e-3))
    if "step" in history.dims:
        found += _balances_of_stick(result, tables)
    if "heat_balance_error" in history:
        found.append(Finding("heat", float(history.heat_balance_error.max()), EXACT))
        made = history.heat_friction.values
        told = np.diff(history.friction_work.values, prepend=0.0)
        if tables["run"]["integration"] != "jump":  # whose work is of all that it leaps over
            found.append(Finding("heat of friction", float(np.abs(made - told).max() / np.abs(told).max()), EXACT))
    return found


def _overlap(history: xarray.Dataset) -> float:
    """Return the largest of p gap and of the overlap, over the scales of pressure and of what bodies yield."""
    pressure, gap = history.pressure.values, history.gap.values
    p, g = np.abs(pressure).max(), max(np.abs(gap).max(), 1e-6)
    return max(float(np.abs(pressure * gap).max() / (p * g)), float(max(0.0, -gap.min()) / g))


def _volume(history: xarray.Dataset, tables: Tables, end: str) -> Finding:
    """Compare the volume that was metered with the depths over all material points."""
    depth, weight = history[f"wear{end}"].values[-1], history[f"weight{end}"].values[-1]
    thickness = make_case(tables).model.thickness if tables["model"]["kind"] == "plane" else 1.0
    metered = float(history[f"worn_volume{end}"].values[-1])
    error = abs(metered - thickness * float(depth @ weight)) / max(metered, 1e-300)
    return Finding(f"volume{end}", error, EXACT)


def _balances_of_stick(result: Result, tables: Tables) -> list[Finding]:
    history = result.history
    friction = float(history.attrs["friction"])
    traction, pressure = history.traction.values, history.step_pressure.values
    load = -float(tables["punch"]["loads"][0]["force"][-1])
    scale = float(np.nanmax(pressure))
    return [
        Finding("load", float(np.nanmax(np.abs(history.normal_force - load))) / load, EXACT),
        Finding("energy", float(history.energy_balance_error.max()), EXACT),
        Finding("no tension in a step", max(0.0, -float(np.nanmin(pressure))) / scale, 0.0),
        Finding("cone", float(np.nanmax(np.abs(traction) - friction * pressure)) / scale, EXACT),
    ]


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


def restart(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether a run that stops half-way and goes on comes to the same."""
    count = problem_.tables["run"]["half_cycles"]
    half = put(problem_.tables, {"run.half_cycles": count // 2})
    run(half, folder / "parts")
    return _compare("restart", whole, run(problem_.tables, folder / "parts", resume=True), EXACT)


def jumps(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether jumps come to the depths of a march, at every node."""
    how = ("explicit", 24) if problem_.kind == "stick" else ("implicit", 60)
    tables = put(problem_.tables, {"run.integration": how[0], "run.half_cycles": how[1]})
    marched = run(tables, folder / "march")
    jumping = put(tables, {"run.integration": "jump", "run.jump_tolerance": 1e-3})
    jumped = run(jumping, folder / "jumps")
    return _compare("jumps", marched, jumped, 0.02) + balances(jumped, jumping)


def refinement(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether depths away from the edges change less from a mesh to the next finer one."""
    count = problem_.tables["geometry"]["parameters"]["elements_along_contact"]
    runs = [whole]
    for k, factor in enumerate((2, 4)):
        finer = {
            "geometry.parameters.elements_along_contact": factor * count,
            "geometry.parameters.growth": 1.0 / factor,
        }
        runs.append(run(put(problem_.tables, finer), folder / f"finer{k}"))
    inside = np.linspace(-0.7, 0.7, 29)
    profiles = []
    for one in runs:
        x = one.history.x.values
        profiles.append(np.interp(inside * x.max(), x, one.history.wear.values[-1]))
    first, second = (_distance(profiles[2], p) for p in profiles[:2])
    return [Finding("refinement", second, max(0.75 * first, 1e-3))]


def mirror(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether what slides the other way first is the image of what slides this way first."""
    history = whole.history
    if problem_.kind == "solid":
        turned = put(problem_.tables, {"motion.along": [-v for v in problem_.tables["motion"]["along"]]})
        other = run(turned, folder / "mirror").history
        places = np.column_stack([history.x.values, history.y.values])
        images = np.column_stack([-other.x.values, -other.y.values])
        order = np.abs(places[:, None] - images[None]).sum(axis=2).argmin(axis=1)
        return [Finding("mirror", _distance(history.wear.values, other.wear.values[:, order]), 1e-7)]
    # A half-cycle one way, and the same to the other way on the unworn bodies, are each other's image.
    once = put(problem_.tables, {"run.half_cycles": 2, "run.integration": "explicit", "wear.punch.coefficient": 0.0})
    if "strip" in once["wear"]:
        once["wear"]["strip"]["coefficient"] = 0.0
    once["wear"]["punch"].pop("pressure_exponent", None)
    pressure = run(once, folder / "mirror").history.pressure.values
    return [Finding("mirror", _distance(pressure[0], pressure[1][::-1]), 1e-7)]


def ranks(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether two ranks find what one does."""
    (folder / "case.toml").write_text(tomli_w.dumps(problem_.tables), "utf-8")
    command = ["mpirun", "--oversubscribe", "-n", "2", sys.executable, "-m", "fenwear", "run", "case.toml", "-o", "two"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=3 * SECONDS, check=False)
    if done.returncode:
        return [Finding(f"ranks: {done.stderr[-300:]}", 1.0, 0.0)]
    return _compare("ranks", whole, Result(load_history(folder / "two"), {}), EXACT)


def sector(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
    """Whether a quarter of both rings, a solid between planes of symmetry, has the rings' depths without friction."""
    sizes = problem_.tables["geometry"]["parameters"]
    quarter = Path(__file__).with_name("quarter_of_rings.geo")
    load = problem_.tables["punch"]["loads"][0]["force"][1]
    own = {name: sizes[name] for name in ("inner_radius", "outer_radius", "margin_inside", "margin_outside", "across")}
    held = [{"on": f"{{}}_{plane}", "fix": [axis]} for plane, axis in (("plane_x", "y"), ("plane_y", "x"))]
    frictionless = put(problem_.tables, {"contact.friction": 0.0})
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
    ring = run(put(frictionless, {}), folder / "ring").history
    solid_ = run(put(frictionless, changes), folder / "sector").history
    radius = np.hypot(solid_.x.values, solid_.y.values)
    inside = np.abs(radius - (sizes["inner_radius"] + sizes["outer_radius"]) / 2) < 0.35 * (
        sizes["outer_radius"] - sizes["inner_radius"]
    )
    order = np.argsort(ring.r.values)
    expected = np.interp(radius, ring.r.values[order], ring.wear.values[-1][order])
    return [Finding("sector", _distance(expected[inside], solid_.wear.values[-1][inside]), 0.03)]


def slice_of_solid(problem_: Problem, whole: Result, folder: Path) -> list[Finding]:
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
    solid_depth, plane_depth = run(solid_, folder / "solid").history, run(flat, folder / "plane").history
    expected = np.interp(solid_depth.x.values, plane_depth.x.values, plane_depth.wear.values[-1])
    return [Finding("slice", _distance(expected, solid_depth.wear.values[-1]), EXACT)]


ASKS: dict[str, Callable[[Problem, Result, Path], list[Finding]]] = {
    ask.__name__: ask for ask in (restart, jumps, refinement, mirror, ranks, sector, slice_of_solid)
}


# --------------------------------------------------------------------------- one after the other


def try_problem(seed: int) -> tuple[str, str]:
    """Return ok, refused or wrong, and why."""
    made, ask = problem(seed)
    told = f"{made.kind}, {ask}"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            whole = run(made.tables, folder / "whole")
            found = balances(whole, made.tables) + ASKS[ask](made, whole, folder)
        except FenwearError as error:
            return "refused", f"{told}: {error}"
    bad = [f"{f.name} {f.error:.2e} (bound {f.bound:.0e})" for f in found if not f.error <= f.bound]
    return ("wrong", f"{told}: {'; '.join(bad)}") if bad else ("ok", told)


def main() -> None:
    """Try many, or show one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=None, help="seed of the first; by default one from the clock")
    parser.add_argument("--seed", type=int, default=None, help="of one problem to show")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    if given.seed is not None:
        made, ask = problem(given.seed)
        sys.stdout.write(f"# {made.kind}, {ask}\n{tomli_w.dumps(made.tables)}\n{try_problem(given.seed)}\n")
        return
    first = time.time_ns() // 10**9 * 1000 if given.first is None else given.first
    kinds: Counter[str] = Counter()
    for verdict in verdicts(try_problem, range(first, first + given.count), given.workers, SECONDS):
        kinds[verdict.kind] += 1
        if verdict.kind != "ok":
            sys.stdout.write(f"{verdict.seed} {verdict.kind}: {verdict.text}\n")
    sys.stdout.write(f"seeds {first} to {first + given.count - 1}: {dict(kinds)}\n")
    sys.exit(any(kinds[kind] for kind in ("wrong", "traceback", "crash", "hang")))


if __name__ == "__main__":
    main()
