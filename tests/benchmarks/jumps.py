"""Jumps of both laws of contact on every row of `combinations.py`, held against marches at single nodes.

python3 tests/benchmarks/jumps.py [ROW...]

Of each tolerance: cycles solved (with stick whole cycles, in gross sliding stages, each one inequality of all phases),
and the largest error of depth and of pressure at a node, over the largest ones: against a march, and against jumps at
the finest tolerance. Marches take wear off at the end of a half-cycle: what explicit and implicit ones differ by,
halved, is what a march is off itself; with stick it is not known.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from combinations import FEATURES, LAWS, STICK, closed

from fenwear import FenwearError, State, assemble, load_case, register_law
from fenwear.common.arrays import Array
from fenwear.steps import evolve
from fenwear.steps.jump_step import Stepper
from fenwear.steps.stick_cycle import PartialSlipProblem

TOLERANCES = (1e-2, 3e-3, 1e-3)
FINEST = 1e-4
HALF_CYCLES = 80

solved = {"steps": 0}


def counted(owner: Any, name: str) -> None:
    """Count the calls of a method."""
    original = getattr(owner, name)

    def call(*arguments: Any, **named: Any) -> Any:
        solved["steps"] += 1
        return original(*arguments, **named)

    setattr(owner, name, call)


def growth(now: Any) -> Any:
    return 20 * (1 - now["oxide"]) - now["p"] * now["v"] * now["oxide"] / 5


def ends(feature: str, law: str, **how: Any) -> tuple[Array, Array, int]:
    """Return the depths (n,) and the pressures (half_cycles, n) of the end of a run, and what it has solved."""
    base, settings = FEATURES[feature]
    stick = STICK if LAWS[law] == "coulomb" else ("stick={}",)
    system = assemble(load_case(base, [*settings, f"contact.law='{LAWS[law]}'", *stick]))
    strokes, before = system.motion.half_cycles, solved["steps"]
    blocks = list(evolve(system, HALF_CYCLES // strokes * strokes, **how))
    cycles = (solved["steps"] - before) / (strokes if system.law.sticks else 1)
    pressure = np.concatenate([block.pressure for block in blocks[-strokes:]])  # meshes that follow end a block
    return blocks[-1].end.worn.punch, pressure[-strokes:], round(cycles)


def apart(one: Array, other: Array) -> float:
    """Return the largest difference at a node, over the largest value."""
    return float(np.abs(one - other).max() / np.abs(one).max())


def row(feature: str, law: str) -> str:
    """Return the row of a table."""
    depth, pressure, _ = ends(feature, law, integration="explicit")
    off = (0.0, 0.0)
    if LAWS[law] == "gross-sliding":  # the mean of both is of second order
        implicit = ends(feature, law, integration="implicit")
        off = apart(depth, (depth + implicit[0]) / 2), apart(pressure, (pressure + implicit[1]) / 2)
        depth, pressure = (depth + implicit[0]) / 2, (pressure + implicit[1]) / 2
    cells, fine = [], ends(feature, law, integration="jump", tolerance=FINEST)
    for tolerance in TOLERANCES:
        own_depth, own_pressure, cycles = ends(feature, law, integration="jump", tolerance=tolerance)
        errors = (
            apart(depth, own_depth),
            apart(pressure, own_pressure),
            apart(fine[0], own_depth),
            apart(fine[1], own_pressure),
        )
        cells.append(f"{cycles}: {', '.join(f'{error:.1e}' for error in errors)}")
    return f"| {feature}, {law} | {off[0]:.1e}, {off[1]:.1e} | {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    register_law(
        "filmed", lambda now: 5e-8 * (1.5 - now["oxide"]), states={"oxide": State(growth, of=["p", "v"], initial=1.0)}
    )
    register_law("slippery", lambda now: 0.75 - 0.1 * now["oxide"], of=["oxide"])
    counted(Stepper, "stage")
    counted(PartialSlipProblem, "_half_cycle")
    of = " | ".join(f"{tolerance:g}: solved: depth, pressure, depth to finest, pressure" for tolerance in TOLERANCES)
    print(f"| row, law | march off itself: depth, pressure | {of} |")
    print("| --- | --- | --- | --- | --- |")
    for feature in FEATURES:
        for law in LAWS:
            if closed(feature, law, "jump") or not feature.startswith(tuple(sys.argv[1:] or [""])):
                continue
            begin = time.process_time()
            try:
                text = row(feature, law)
            except FenwearError as error:
                text = f"| {feature}, {law} | {error} |"
            print(text, f"{time.process_time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
