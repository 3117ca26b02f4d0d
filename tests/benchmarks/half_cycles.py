"""What a half-cycle costs: fenwear beside a loop by hand in NumPy on the same condensed operators, on one core.

python3 tests/benchmarks/half_cycles.py [--profile]

Example 1 explicitly, in full contact and with friction that lifts off an edge. Times are of the process,
the least of some runs in turn; both must end at the same pressures and depths.
"""

from __future__ import annotations

import cProfile
import pstats
import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from fenwear import Tribosystem, assemble, load_case, march
from fenwear.common.arrays import Array

HALF_CYCLES, RUNS = 2600, 5
CASES = {
    "full contact": (),
    "an edge that opens and closes": ("contact.friction=0.4", "geometry.parameters.pin_height_1=40"),
}


def by_hand(system: Tribosystem, half_cycles: int) -> tuple[Array, Array]:
    """Return the pressures and depths of all half-cycles: the same algebra, and nothing but it."""
    n, phases = len(system.pair.weights), range(len(system.motion.phases))
    rigid, ratios = system.rigid, system.phases.ratios()
    modes = len(rigid.resultant)
    matrices = [
        np.block(
            [[own.compliance(tau).matrix(), rigid.rigid_normal], [rigid.equilibrium(tau), np.zeros((modes, modes))]]
        )
        for own, tau in zip(system.elastic.interfaces, ratios, strict=True)
    ]
    rates = [system.phases.mean_wear.depth(np.ones((len(phases), n)))[k] for k in phases]
    offset, worn = np.concatenate([np.zeros(n), rigid.resultant]), np.zeros(n)
    first = [system.elastic.interfaces[k].load_gap + system.sliding.pairs[k].initial_gap for k in phases]
    closed, factors = [np.ones(n, dtype=bool) for _ in phases], [factor(m, np.ones(n, dtype=bool)) for m in matrices]
    pressures, depths, x = [], [], np.zeros(n + modes)
    for half_cycle in range(half_cycles):
        k = half_cycle % len(phases)
        offset[:n] = first[k] + worn
        while True:
            kept, lu, pivots = factors[k]
            x[:] = 0
            x[kept] = dgetrs(lu, pivots, -offset[kept])[0]
            gap = (matrices[k] @ x + offset)[:n]
            wrong = (x[:n] < 0) | (~closed[k] & (gap < 0))
            if not wrong.any():
                break
            closed[k] = closed[k] ^ wrong
            factors[k] = factor(matrices[k], closed[k])
        pressure = x[:n].copy()
        worn = worn + rates[k] * pressure
        pressures.append(pressure)
        depths.append(worn)
    return np.array(pressures), np.array(depths)


def factor(matrix: Array, closed: Array) -> tuple[Array, Array, Array]:
    """Return the unknowns of a set in contact and their factor."""
    kept = np.flatnonzero(np.concatenate([closed, np.ones(len(matrix) - len(closed), dtype=bool)]))
    lu, pivots, _ = dgetrf(matrix[np.ix_(kept, kept)])
    return kept, lu, pivots


def marched(system: Tribosystem, half_cycles: int) -> tuple[Array, Array]:
    """Return the same by fenwear, with all its records."""
    blocks = list(march(system, half_cycles))
    return np.concatenate([b.pressure for b in blocks]), np.concatenate([b.wear for b in blocks])


def least(function: Callable[[], object]) -> float:
    """Return the least time of some calls, s."""
    begin = time.process_time()
    function()
    return time.process_time() - begin


def main() -> None:
    """Print the table."""
    print(f"| {HALF_CYCLES:,} half-cycles | fenwear s | ms each | by hand s | ms each | ratio | sets | difference |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, settings in CASES.items():
        system = assemble(load_case("example1", settings))
        one, other = marched(system, HALF_CYCLES), by_hand(system, HALF_CYCLES)
        difference = max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(one, other, strict=True))
        touching = one[0] > 0
        changes = int((touching[2:] != touching[:-2]).any(axis=1).sum())
        times = np.array(
            [
                [least(lambda: marched(system, HALF_CYCLES)), least(lambda: by_hand(system, HALF_CYCLES))]  # noqa: B023
                for _ in range(RUNS)
            ]
        ).min(axis=0)
        each = 1e3 * times / HALF_CYCLES
        print(
            f"| {name}, {len(system.pair.x)} nodes | {times[0]:.3f} | {each[0]:.4f} | {times[1]:.3f} | {each[1]:.4f} "
            f"| {times[0] / times[1]:.2f} | {changes} | {difference:.0e} |",
            flush=True,
        )
        if "--profile" in sys.argv[1:]:
            profile = cProfile.Profile()
            profile.runcall(marched, system, HALF_CYCLES)
            pstats.Stats(profile).sort_stats("tottime").print_stats(20)


if __name__ == "__main__":
    main()
