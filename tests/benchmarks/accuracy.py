"""How good the told uncertainty is: small cases, each again on fine meshes in small steps; the others chose no order.

    docker/fenwear python3 tests/benchmarks/accuracy.py [NAME...]

For each number of a run's end: its true error against the fine reference, the uncertainty that was told, their ratio,
and the source that makes most of it; then in how many the true error lies within it, the median ratio, and what the
estimate cost against the set-up. Numbers that the reference gives to rounding are told apart: a ratio of roundings
says nothing. References are solutions, too: they are two to four times as fine.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fenwear import Block, assemble, evolve, load_case
from fenwear.case import Case
from fenwear.checks import uncertainty, values_of

EXACT = 1e-9  # of a number: an error that is rounding
ELEMENTS = "geometry.parameters.elements_along_contact"
JUMPS = 'run.integration="jump"'
SMALL = "run.jump_tolerance=3e-4"


@dataclass(frozen=True)
class Trial:
    """A small case, and what makes a reference of it.

    Attributes:
        base: The built-in case.
        settings: Of the small one.
        fine: Beside them, of the reference.
    """

    base: str
    settings: Sequence[str]
    fine: Sequence[str]


def rounded(half_cycles: int, degree: int) -> Trial:
    """Return a punch with rounded edges."""
    counts = ("geometry.parameters.elements_along_flat", "geometry.parameters.elements_along_edge")
    settings = (f"run.half_cycles={half_cycles}", f"geometry.degree={degree}", *(f"{key}=8" for key in counts))
    return Trial("rounded-punch", settings, (*(f"{key}=24" for key in counts), "geometry.degree=3", SMALL))


def ring(half_cycles: int, base: str = "ring-on-ring") -> Trial:
    """Return a ring on a ring."""
    settings = (f"run.half_cycles={half_cycles}", "geometry.parameters.across=6", "geometry.degree=3")
    fine = ("geometry.parameters.across=20", "geometry.degree=4", SMALL)
    return Trial(base, settings, fine if base == "ring-on-ring" else (*fine, "heat.step_tolerance=5e-4"))


def along(base: str, elements: int, finer: int, *settings: str, fine: Sequence[str] = ()) -> Trial:
    """Return a case whose mesh has a number of elements along its contact."""
    return Trial(base, (f"{ELEMENTS}={elements}", *settings), (f"{ELEMENTS}={finer}", *fine))


def solid(base: str, counts: dict[str, tuple[int, int]], *settings: str, fine: Sequence[str] = ()) -> Trial:
    """Return a solid with numbers of elements, and those of its reference."""
    few, many = ([f"geometry.parameters.{key}={pair[k]}" for key, pair in counts.items()] for k in (0, 1))
    return Trial(base, (*few, *settings), (*many, *fine))


PUNCH_ONLY = ("unset=wear.strip", "motion.positions=1", "run.jump_tolerance=3e-3")
BALL = {"core_elements": (2, 4), "across": (4, 8), "ball_layers": (3, 5), "flat_layers": (4, 6)}
PAD = {"across": (3, 6), "along": (3, 6), "pad_layers": (2, 3), "disc_layers": (2, 3)}
FINE = ("punch.operator='fine'", "strip.operator='fine'")
ON_GRID = (
    *FINE,
    "geometry.parameters.core=0",
    "geometry.parameters.core_elements=0",
    "grid.size=['0.36 mm', '0.36 mm']",
)
TRIALS = {
    "flat punch, 40 half-cycles": along("example1", 8, 32, "run.half_cycles=40"),
    "flat punch, 2000": along("example1", 8, 32, "run.half_cycles=2000", JUMPS, fine=(SMALL,)),
    "hinged punch, 400": along("example2", 10, 32, "run.half_cycles=400", JUMPS, "geometry.degree=3", fine=(SMALL,)),
    "rounded punch, 2000": rounded(2000, 2),
    "rounded punch, 20000": rounded(20000, 3),
    "block on ring, 100": along("block-on-ring", 60, 180, "run.half_cycles=100", fine=("geometry.degree=3", SMALL)),
    "block on ring, 1600": along("block-on-ring", 60, 180, "run.half_cycles=1600", fine=("geometry.degree=3", SMALL)),
    "cylinder, 2": along("fretting", 30, 120, "run.half_cycles=2", *PUNCH_ONLY, fine=("geometry.degree=3",)),
    "cylinder, 200": along("fretting", 30, 120, "run.half_cycles=200", *PUNCH_ONLY, fine=("geometry.degree=3", SMALL)),
    "both worn, 400": along("fretting", 24, 72, "run.half_cycles=400", "motion.positions=7", "run.jump_tolerance=0.01",
                            fine=("motion.positions=21", "run.jump_tolerance=1e-3")),
    "rings, 200": ring(200),
    "rings, 5000": ring(5000),
    "rings, heat, 200": ring(200, "ring-on-ring-heat"),
    "punch, heat, 60": along("example1-heat", 8, 24, "run.half_cycles=60", "geometry.degree=3",
                             fine=("heat.step_tolerance=5e-4",)),
    "punch, heat, 400": along("example1-heat", 8, 20, "run.half_cycles=400", JUMPS, "geometry.degree=3",
                              fine=("heat.step_tolerance=5e-4", SMALL)),
    "partial slip, 4": along("fretting-partial-slip", 24, 60, "run.half_cycles=4", fine=("stick.step_tolerance=2e-3",)),
    "partial slip, 1000": along("fretting-partial-slip", 24, 60, "run.half_cycles=1000", fine=(SMALL,)),
    "ball, 20": solid("ball-on-flat", BALL, "run.half_cycles=20", "motion.positions=3", fine=("motion.positions=7",)),
    "pin, 100": solid("pin-on-disc", {}, "run.half_cycles=100", fine=("geometry.degree=3",)),
    "ball on a grid, 200": Trial(
        "ball-on-flat", (*ON_GRID, "grid.nodes=65", "run.half_cycles=200", "motion.positions=3"),
        ("grid.nodes=129", "motion.positions=7", "run.jump_tolerance=1e-3")),
    "stick on a grid, 20": Trial(
        "fretting-sphere", (*FINE, "geometry.parameters.across=4", "grid.nodes=33", "run.half_cycles=20"),
        ("grid.nodes=65",)),
    "pad, 200": solid("brake-pad", PAD, "run.half_cycles=200", "unset=heat"),
}  # fmt: skip

GROOVE = ("geometry.parameters.across=6", "geometry.parameters.clearance=0.1")
# No choice in `fenwear.checks` was made on these: other kinds, shapes, loads, friction and degrees.
OTHERS = {
    "low punch, mu 0.4, 150": along(
        "example1", 12, 36, "run.half_cycles=150", "geometry.degree=2", "contact.friction=0.4",
        "geometry.parameters.punch_height=60", JUMPS, fine=("geometry.degree=4", SMALL)),
    "one way, 300": along("monotonic-lz40", 8, 24, "run.half_cycles=300", "geometry.degree=3", JUMPS, fine=(SMALL,)),
    "punch that translates, heat, 100": along(
        "example2-heat", 8, 24, "run.half_cycles=100", "geometry.degree=3", JUMPS, "contact.friction=0.1",
        fine=("heat.step_tolerance=5e-4", SMALL)),
    "bushing, 3000": along("bushing", 60, 180, "run.half_cycles=3000", "geometry.follow_wear=never",
                           fine=("geometry.degree=3", SMALL)),
    "drum brake, 500": Trial(
        "drum-brake",
        ("geometry.parameters.elements_along_lining=16", "geometry.parameters.elements_along_drum=88",
         "run.half_cycles=500"),
        ("geometry.parameters.elements_along_lining=48", "geometry.parameters.elements_along_drum=180",
         "geometry.degree=3", SMALL)),
    "soft cylinder, 300": along(
        "fretting", 24, 96, "run.half_cycles=300", "unset=wear.strip", "motion.positions=1", "geometry.degree=3",
        "materials.steel.young=7e4", "punch.loads.0.force=[0, -30]", "contact.friction=0.3",
        fine=("run.jump_tolerance=1e-3",)),
    "partial slip, mu 0.5, 100": along(
        "fretting-partial-slip", 30, 90, "run.half_cycles=100", "contact.friction=0.5", "motion.amplitude=0.002",
        "geometry.parameters.radius=10", "unset=wear.strip", fine=("stick.step_tolerance=2e-3", SMALL)),
    "ring in a groove, 300": Trial(
        "ring-in-groove", (*GROOVE, "run.half_cycles=300"),
        ("geometry.parameters.across=18", "geometry.degree=3", SMALL)),
    "warm rings, 1000": Trial(
        "ring-on-ring-heat",
        ("run.half_cycles=1000", "geometry.parameters.across=8", "geometry.degree=2", "contact.friction=0.05",
         "geometry.parameters.inner_radius=10"),
        ("geometry.parameters.across=24", "geometry.degree=3", SMALL, "heat.step_tolerance=5e-4")),
    "block on ring, degree 3, 400": along(
        "block-on-ring", 40, 120, "run.half_cycles=400", "geometry.degree=3", "geometry.parameters.radius=14",
        fine=(SMALL,)),
    "rounded punch, mu 0.05, 800": Trial(
        "rounded-punch",
        ("run.half_cycles=800", "geometry.degree=3", "contact.friction=0.05", "geometry.parameters.edge_radius=40",
         "geometry.parameters.elements_along_flat=12", "geometry.parameters.elements_along_edge=10"),
        ("geometry.parameters.elements_along_flat=36", "geometry.parameters.elements_along_edge=30", SMALL)),
    "cylinder on a grid, 200": Trial(
        "fretting",
        ("punch.operator='half-space'", "strip.operator='half-space'", "grid.nodes=129", "unset=wear.strip",
         "motion.positions=1", "run.half_cycles=200", "punch.loads.0.force=[0, -25]", "run.jump_tolerance=3e-3"),
        ("grid.nodes=513", SMALL)),
    "sphere in partial slip, 20": solid(
        "fretting-sphere", {"across": (6, 12)}, "run.half_cycles=20", "contact.friction=0.6",
        "motion.amplitude=0.0008"),
    "ball of 10 mm, 50": solid(
        "ball-on-flat", BALL, "run.half_cycles=50", "geometry.parameters.radius=10", "motion.along=[0, 1, 0]",
        "unset=wear.strip", "motion.positions=1", "geometry.parameters.stroke=0.1"),
}  # fmt: skip


def ended(case: Case) -> tuple[Block, float, float]:
    """Return the last half-cycles of a run, and the seconds of one core of its set-up and of itself."""
    begin = time.process_time()
    system = assemble(case, heat="reduced" if case.run.integration == "jump" else "as set", fresh=True)
    ready = time.process_time()
    *_, last = evolve(system)
    return last, ready - begin, time.process_time() - ready


def told_over_true(trials: dict[str, Trial]) -> None:
    """Print the numbers of trials, and how good what is told of them is."""
    ratios: list[float] = []
    costs: list[float] = []
    exact = 0
    for name, trial in trials.items():
        case = load_case(trial.base, trial.settings)
        last, setup, run = ended(case)
        begin = time.process_time()
        found = uncertainty(last.system.case, last)
        cost = time.process_time() - begin
        costs.append(cost / setup)
        reference = values_of(ended(load_case(trial.base, [*trial.settings, *trial.fine]))[0])
        print(
            f"{name}: set-up {setup:.2f} s, run {run:.2f} s, estimate {cost:.2f} s of one core", *found.untold.values()
        )
        total = found.total
        for quantity, value in found.values.items():
            error = abs(value.number - reference[quantity].number)
            told = f"    {' '.join(quantity):22} {value.number:12.5g}  error {error:8.1e}  told {total[quantity]:8.1e}"
            if error < EXACT * abs(value.number):
                exact += error <= total[quantity] < EXACT * 1e3 * abs(value.number)
                print(f"{told}  to rounding", flush=True)
                continue
            ratios.append(total[quantity] / error)
            print(f"{told}  ratio {ratios[-1]:7.2f}  {found.largest(quantity)}", flush=True)
    within = np.array(ratios) >= 1
    print(
        f"{within.sum()} of {len(within)} errors within what is told; told over true: median {np.median(ratios):.2g}, "
        f"{np.percentile(ratios, 10):.2g} to {np.percentile(ratios, 90):.2g} in eight of ten; {exact} are exact and "
        f"told so; estimate over set-up: median {np.median(costs):.2g}"
    )


def main(names: Sequence[str]) -> None:
    """Print the tables of those that choices were made on, and of the others; or of the trials named."""
    for trials in ({name: (TRIALS | OTHERS)[name] for name in names},) if names else (TRIALS, OTHERS):
        told_over_true(trials)


if __name__ == "__main__":
    main(sys.argv[1:])
