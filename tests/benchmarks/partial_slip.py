"""Time of contact with stick: a cycle of 40 steps, and 18,000 cycles by jumps, in CPU seconds and in products of C.

docker/fenwear python3 tests/benchmarks/partial_slip.py
"""

from __future__ import annotations

import time

import numpy as np

from fenwear import assemble, load_case
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.steps.stick_setup import partial_slip_problem


def main() -> None:
    """Print times and their ratio to a dense product and a dense factorisation of the same size."""
    for elements in (50, 100, 200):
        case = load_case("fretting-partial-slip", [f"geometry.parameters.elements_along_contact={elements}"])
        begin = time.process_time()
        problem = partial_slip_problem(case)
        setup = time.process_time() - begin
        at = problem.beginning()
        at, _ = problem.cycle(at)
        begin = time.process_time()
        at, parts = problem.cycle(at)
        cycle = time.process_time() - begin
        n = len(problem.weights)
        C = problem.interface.middle.compliance.entries(np.arange(n), np.arange(n))
        begin = time.process_time()
        for _ in range(10):
            np.linalg.solve(C + np.eye(n), np.ones(n))
        factor = (time.process_time() - begin) / 10
        newton = int(sum(part.iterations.sum() for part in parts))
        touched = int((parts[0].pressure[-1] > 0).sum())
        print(f"{n} contact nodes, {touched} in contact: set-up {setup:.1f} s")
        print(f"  cycle of {2 * len(parts[0])} steps {cycle:.3f} s")
        print(f"  {newton} Newton steps, {cycle / newton / factor:.1f} factorisations of n x n each")
    system = assemble(load_case("fretting-partial-slip", ["stick.step_tolerance=1"]))
    for tolerance in (0.05, 0.01, 3e-3):
        begin = time.process_time()
        jumps = list(jump_within(system, RunLimits(36_000, block=1), tolerance=tolerance))
        end = jumps[-1].wear[-1]
        seconds = time.process_time() - begin
        print(f"18,000 cycles by {len(jumps)} jumps, tolerance {tolerance:g}: {seconds:.1f} s")
        print(f"  largest depth {1e3 * end.max():.5f} um, area {system.pair.weights @ end:.6g} mm2")


if __name__ == "__main__":
    main()
