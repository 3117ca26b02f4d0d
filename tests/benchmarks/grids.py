"""Contacts on grids: a ball on a flat, cold and again, by the number of nodes; beside the time of one product.

With --steady the cyclic steady state of the ball that wears by itself, to and fro.

python3 tests/benchmarks/grids.py [--steady] [NODES...]
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from fenwear import assemble, load_case
from fenwear.steps import steady

BALL = (
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "contact.friction=0", "wear.punch.coefficient=0", "wear.strip.coefficient=0", "motion.positions=2",
    "punch.operator='fine'", "strip.operator='fine'", "grid.size=['0.36 mm', '0.36 mm']",
)  # fmt: skip


def seconds(do: Callable[[], object]) -> float:
    """Return the processor time that something takes, s."""
    begin = time.process_time()
    do()
    return time.process_time() - begin


def worn_for_ever(numbers: list[int]) -> None:
    """Print what the cyclic steady state takes, a row for each number of nodes."""
    print("nodes  steady state (s)  pressures of both directions over their mean - 1  memory (MiB)")
    for nodes in numbers:
        case = load_case(
            "ball-on-flat", [*BALL, "contact.friction=0.6", "wear.punch.coefficient=1e-8", f"grid.nodes={nodes}"]
        )
        wear, motion = case.wear.model_copy(update={"strip": None}), case.motion.model_copy(update={"positions": 1})
        system = assemble(case.model_copy(update={"wear": wear, "motion": motion}))
        begin = time.process_time()
        state = steady(system)
        taken = time.process_time() - begin
        even = state.phase_pressure.mean(axis=0) / state.phase_pressure.mean()  # what wears everywhere alike
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        print(f"{nodes:5}  {taken:16.2f}  {np.abs(even - 1).max():48.1e}  {memory:12}")


def main() -> None:
    """Print a row for each number of nodes."""
    numbers = [int(text) for text in sys.argv[1:] if text != "--steady"] or [65, 129, 257, 513]
    if "--steady" in sys.argv:
        worn_for_ever(numbers)
        return
    a = (3 * 20 * 5 / (4 * 210e3 / (2 * (1 - 0.3**2)))) ** (1 / 3)
    largest = 1.5 * 20 / (np.pi * a**2)
    print("nodes  tables (s)  contact (s)  over one product  largest pressure / Hertz - 1  memory (MiB)")
    for nodes in numbers:
        system = assemble(load_case("ball-on-flat", [*BALL, f"grid.nodes={nodes}"]))
        gap = system.gap(0, system.unworn())
        tables = seconds(partial(system.phase_contact, [0]))
        contact = system.phase_contact([0])
        found = contact.solve(gap)
        again = seconds(partial(contact.solve, gap))
        multiply = partial(system.elastic.interface.compliance(0.0).apply, found.pressure[0])
        multiply()
        product = np.median([seconds(multiply) for _ in range(9)])
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        error = found.pressure.max() / largest - 1
        print(f"{nodes:5}  {tables:10.2f}  {again:11.2f}  {again / product:16.0f}  {error:28.1e}  {memory:12}")


if __name__ == "__main__":
    main()
