"""How fast a half-cycle is, and what is equal to what: ratios within one run, on one core.

python3 tests/benchmarks/speed.py [--heat]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fenwear import Tribosystem, assemble, load_case, march, steady
from fenwear.contact import SlidingContact
from fenwear.steps import jump
from fenwear_verify.full_space import FullContact


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the wall time of a call, s, and its result."""
    begin = time.perf_counter()
    result = function()
    return time.perf_counter() - begin, result


def full_against_condensed(system: Tribosystem, half_cycles: int = 100) -> None:
    """Both inequalities on the same gaps, half-cycle by half-cycle."""
    solvers = [
        (
            system.contact((d,)),
            FullContact(
                [SlidingContact(system.elastic.interface, system.phases.middle_ratio(d))],
                [(system.bodies.punch, system.bodies.strip)],
            ),
        )
        for d in (1, -1)
    ]
    wear = system.pair.initial_gap.copy()
    states: list[list[Any]] = [[None, None], [None, None]]
    times: list[list[float]] = [[], []]
    difference = 0.0
    for number in range(half_cycles):
        phase = number % 2
        for kind in (0, 1):
            seconds, states[phase][kind] = timed(
                lambda phase=phase, kind=kind, gap=wear: solvers[phase][kind].solve(gap, states[phase][kind])
            )
            if number >= 2:
                times[kind].append(seconds)
        condensed, full = (state.pressure[0] for state in states[phase])
        difference = max(difference, float(np.abs(condensed - full).max() / condensed.max()))
        wear = wear + system.phases.mean_wear.depth(np.tile(condensed, (2, 1)))[0]
    medians = [1e3 * statistics.median(t) for t in times]
    print(f"a contact, condensed | {medians[0]:.3f} ms (median of {len(times[0])})")
    print(f"a contact, full      | {medians[1]:.1f} ms, {medians[1] / medians[0]:.0f} times as long")
    print(f"largest difference of pressure, relative | {difference:.1e}")


def without_heat() -> None:
    """Marches, jumps and the steady state of Example 1."""
    timed(lambda: assemble(load_case("example1")))  # compiles the forms
    seconds, system = timed(lambda: _prepared("example1"))
    mean = system.rigid.mean_pressure
    print(f"set-up, {len(system.pair.x)} contact nodes | {seconds:.2f} s")
    full_against_condensed(system)
    seconds, blocks = timed(lambda: list(march(system, 20_000)))
    marched = blocks[-1].pressure[-2:]
    print(f"20,000 half-cycles, explicit | {seconds:.2f} s")
    jumped_in, jumps = timed(lambda: list(jump(system, 20_000, tolerance=system.case.run.jump_tolerance)))
    error = np.abs(jumps[-1].pressure[-2:] - marched).max() / mean
    print(f"20,000 half-cycles, jumps | {jumped_in:.2f} s, {seconds / jumped_in:.0f} times as fast; "
          f"pressures within {100 * error:.2f} % of the mean pressure")  # fmt: skip
    steady(system)
    seconds, state = timed(lambda: steady(system))
    *_, last = march(system, 40_000)
    error = np.abs(last.pressure[-2:] - state.pressure).max()
    print(f"steady state, direct | {seconds:.3f} s; max {state.pressure.max():.3f} MPa; "
          f"within {error:.3f} MPa of 40,000 marched half-cycles")  # fmt: skip


def with_heat() -> None:
    """Example 1 with heat, with the full and the reduced heat operator."""
    ends = {}
    for operator in ("full", "reduced"):
        setup, system = timed(lambda operator=operator: _prepared("example1-heat", f"heat.operator={operator}"))
        seconds, blocks = timed(lambda system=system: list(march(system, 2620)))
        ends[operator] = np.concatenate([block.heat.temperature_punch for block in blocks])
        balance = max(block.heat.balance_error.max() for block in blocks)
        print(f"2,620 half-cycles with heat, {operator} | {seconds:.1f} s after {setup:.1f} s of set-up; "
              f"heat balance {balance:.0e}")  # fmt: skip
    for until in (200, 1000, 1600, 2620):
        difference = np.abs(ends["full"][:until] - ends["reduced"][:until]).max()
        print(f"largest difference of temperature up to half-cycle {until} | {difference:.3f} K")


def _prepared(case: str, *settings: str) -> Tribosystem:
    return assemble(load_case(case, settings))


if __name__ == "__main__":
    with_heat() if "--heat" in sys.argv else without_heat()
