"""Fretting in gross sliding: scar, pressure and wall time, against spacing, jump length and positions.

python3 tests/benchmarks/fretting.py [--fine]

The built-in case `fretting`: a cylinder of 6 mm on a flat, both of steel, both worn in 18,000 cycles
of +-25 um. With --fine also nodes every 2.5 um.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from fenwear import assemble, load_case
from fenwear.common.arrays import Array
from fenwear.steps import Block
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within

CYCLES = (1_000, 5_000, 10_000, 18_000)
LOAD, RADIUS, YOUNG, POISSON = 18.5, 6.0, 200e3, 0.3  # N/mm, mm, MPa, 1
# What is varied: elements of degree 2 along 0.6 mm, jump tolerance, positions of the flat in a half-cycle.
RUNS = ((30, 0.05, 11), (60, 0.05, 11), (30, 0.02, 11), (30, 0.1, 11), (30, 0.05, 5), (30, 0.05, 21))
FINE = (120, 0.05, 11)


def hertz() -> tuple[float, float]:
    """Return half-width (mm) and peak pressure (MPa) of a line contact of two like bodies (Hertz)."""
    modulus = YOUNG / (1 - POISSON**2) / 2
    half_width = np.sqrt(4 * LOAD * RADIUS / (np.pi * modulus))
    return float(half_width), float(2 * LOAD / (np.pi * half_width))


def half_width(x: Array, depth: Array) -> float:
    """Return half the length over which a depth is beyond a hundredth of its largest, interpolated, mm."""
    level = 0.01 * depth.max()
    inside = np.flatnonzero(depth > level)
    left, right = inside[0], inside[-1]
    start = np.interp(level, depth[left - 1 : left + 1], x[left - 1 : left + 1])
    end = np.interp(-level, -depth[right : right + 2], x[right : right + 2])
    return float(end - start) / 2


def middle(block: Block) -> tuple[Array, float]:
    """Return the last pressure in the middle of the stroke, MPa, and half the width it acts on, mm."""
    pressure, weights = block.pressure[-1], block.system.pair.weights
    return pressure, float(weights @ (pressure > 0)) / 2


def run(elements: int, tolerance: float, positions: int) -> None:
    """Print the rows of one run."""
    settings = (f"geometry.parameters.elements_along_contact={elements}", f"motion.positions={positions}")
    system = assemble(load_case("fretting", settings))
    begin = time.perf_counter()
    setup = time.perf_counter() - begin
    first = system.contact((1,)).solve(system.gap(0, system.unworn())).pressure[0]
    width = float(system.pair.weights @ (first > 0)) / 2
    head = f"| {600 / (2 * elements):4.1f} | {tolerance:4.2f} | {positions:2}"
    print(
        f"{head} |      0 |        |        |       | {1e3 * width:5.1f} | {first.max():6.1f} | {setup:5.1f} s set-up |"
    )
    stops = frozenset(2 * cycles for cycles in CYCLES)
    x, centre = system.pair.strip.x[:, 0], None
    begin = time.perf_counter()
    for block in jump_within(system, RunLimits(2 * CYCLES[-1], stops=stops), tolerance=tolerance):
        if block.half_cycle[-1] not in stops:
            continue
        flat, cylinder = block.wear_strip[-1], block.wear[-1]
        centre = np.interp(0.0, x, flat)
        pressure, touching = middle(block)
        print(
            f"{head} | {block.half_cycle[-1] // 2:6,} | {1e3 * centre:6.4f} | {1e3 * cylinder.max():6.4f} | "
            f"{1e3 * half_width(x, flat):5.1f} | {1e3 * touching:5.1f} | {pressure.max():6.1f} | "
            f"{time.perf_counter() - begin:5.1f} s |",
            flush=True,
        )


def main() -> None:
    """Print the table."""
    width, peak = hertz()
    print(f"Hertz: half-width {1e3 * width:.1f} um, peak pressure {peak:.1f} MPa\n")
    print("| nodes um | tolerance | positions | cycles | flat um | cylinder um | scar um | contact um | p MPa | time |")
    print("| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for one in (*RUNS, *([FINE] if "--fine" in sys.argv[1:] else [])):
        run(*one)


if __name__ == "__main__":
    main()
