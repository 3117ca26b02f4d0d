"""The cyclic steady state of thousands of contact nodes: a square punch that slides to and fro on a half-space.

python3 tests/benchmarks/large_steady.py [--sides N N ...] [--ranks N N ...] [--dense N N ...]

Grids of 2,500, 4,900 and 10,000 nodes, Love's formula for normal forces, those along x open x / r² of the gap of the
same force along the normal (nu = 0.3), friction 0.3, a punch that comes down and tilts about a pin above it. By
products and runs of nodes on one rank and on several; --dense gives the same with matrices of all nodes. Each row
is in processes of its own: time of rank 0, memory of the rank that had most, set-up of the numbers not in the time.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from large_contact import love
from mpi4py import MPI
from scipy.sparse import csr_array, diags_array

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.contact import row_blocks
from fenwear.cycle import steady_inequality
from fenwear.cycle.steady_inequality import SteadyInequality
from fenwear.interface import Interface, RigidEquilibrium
from fenwear.parallel import Rows

COMM = MPI.COMM_WORLD
FRICTION, PIN, ASIDE = 0.3, 0.5, 0.286  # mu; height of the pin over half the side; (1 - 2 nu) / (2 - 2 nu)


@dataclass(frozen=True)
class WornDepths:
    """Wear of unit coefficient in two phases, as `fenwear.sliding.wear.PhasesWear` has it."""

    cap: float = np.inf

    def opening(self, pressure: Array) -> Array:
        """Return the gap that all phases wear (m, n)."""
        return np.broadcast_to(pressure.sum(axis=0), pressure.shape)

    def slopes(self, pressure: Array) -> list[csr_array]:
        """Return its derivative by the pressures of each phase."""
        return [csr_array(diags_array(np.ones(len(p)))) for p in pressure]


def system(side: int) -> Any:
    """Return what the inequality asks of a system; several ranks share the rows."""
    n, far = side * side, 2 / side * np.arange(side)
    x, y = (part.ravel() for part in np.meshgrid(*2 * [2 * (np.arange(side) + 0.5) / side - 1], indexing="ij"))
    table, at = n * love(far[:, None], far[None, :], 1 / side), np.divmod(np.arange(n), side)
    rows = Rows.equal(COMM, n) if COMM.size > 1 else None
    own = slice(0, n) if rows is None else rows.own
    by_force: Array = np.empty((own.stop - own.start, n, 2))
    for k, i in enumerate(range(own.start, own.stop)):
        by_force[k, :, 1] = table[np.abs(at[0] - at[0][i]), np.abs(at[1] - at[1][i])]
        across = x[i] - x
        by_force[k, :, 0] = ASIDE * 4 * across / (across**2 + (y[i] - y) ** 2 + 0.25 / n)
    pair = SimpleNamespace(
        normal=np.stack([np.zeros(n), np.ones(n)], axis=1), weights=np.full(n, 1.0 / n), initial_gap=np.zeros(n)
    )
    motion = np.zeros((n, 2, 2))
    motion[:, 1] = np.stack([np.ones(n), x], axis=1)
    motion[:, 0, 1] = PIN
    rigid = RigidEquilibrium(cast(Any, pair), motion, np.array([-1.0, 0.0]), ("lambda_F", "lambda_M"), 2)
    even = by_force[:, :, 1].mean(axis=1)
    even = even if rows is None else rows.gathered(even)
    interface = Interface(rigid, None, None, False, rows)  # type: ignore[arg-type]  # its answers are known
    known = {"gap_by_force": by_force, "load_gap": np.zeros(n), "own_by_force": np.zeros((n, 2)), "by_even": even}
    vars(interface).update(known)
    ratio = FRICTION * np.stack([np.ones(n), np.zeros(n)], axis=1)
    return SimpleNamespace(
        rigid=rigid,
        interface=interface,
        interfaces=(interface, interface),
        pair=pair,
        motion=SimpleNamespace(phases=(0, 1)),
        friction=SimpleNamespace(constant=True),
        friction_ratios=lambda: [ratio, -ratio],
        phases_wear=WornDepths(),
        mode_lengths=np.ones(2),
        heat=None,
    )


def row(side: int, way: str) -> None:
    """Solve and print the row of the table, and the pressures."""
    steady_inequality.LARGE = side * side + 1 if way == "dense" else 0
    iterations: list[int] = []
    solution = row_blocks.gmres_solution
    row_blocks.gmres_solution = lambda *a: solution(*a[:3], lambda i: (iterations.append(i), a[3](i))[1], *a[4:])
    made = system(side)
    _ = made.interface.elastic_length
    begin = time.process_time()
    problem = SteadyInequality(cast(Tribosystem, made))
    state = problem.solve()
    spent = time.process_time() - begin
    peak = max(COMM.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2))
    if COMM.rank:
        return
    both = int((state.pressure > 0).all(axis=0).sum())
    krylov = f"{np.mean(iterations):.0f}" if iterations else ""
    text = (
        f"| {side * side:6,} | {way:7} | {both:,} | {spent:.1f} s | {state.iterations} | {krylov} | {peak:.1f} GiB "
        f"| {state.pressure.max():.4f} |"
    )
    print(json.dumps([text, state.pressure.tolist()]))


def measured(side: int, way: str) -> Array:
    """Print a row from processes of its own; return the pressures."""
    ranks = [] if way in ("1 rank", "dense") else ["mpirun", "--oversubscribe", "-n", way.removesuffix(" ranks")]
    command = [*ranks, sys.executable, "-m", "mpi4py", __file__, "--way", way, "--sides", str(side)]
    environment = {**os.environ, "HWLOC_HIDE_ERRORS": "2"}
    done = subprocess.run(command, check=True, env=environment, capture_output=True, text=True)
    text, pressures = json.loads(done.stdout.splitlines()[-1])
    print(text, flush=True)
    return np.array(pressures)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Steady states of thousands of nodes.")
    parser.add_argument("--sides", type=int, nargs="*", default=[50, 70, 100])
    parser.add_argument("--ranks", type=int, nargs="*", default=[2])
    parser.add_argument("--dense", type=int, nargs="*", default=[])
    parser.add_argument("--way", default=None)
    asked = parser.parse_args()
    if asked.way:
        row(asked.sides[0], asked.way)
        return
    print("| nodes | way | touch both ways | time | Newton | Krylov each | memory | largest pressure over mean |")
    print("| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for side in asked.sides:
        ways = ["1 rank", *(f"{ranks} ranks" for ranks in asked.ranks), *(["dense"] if side in asked.dense else [])]
        found = [measured(side, way) for way in ways]
        print(f"largest difference of pressure: {max(np.abs(p - found[0]).max() for p in found) / found[0].max():.0e}")


if __name__ == "__main__":
    main()
