"""Contacts of thousands of nodes: a sphere on a half-space that wears, by an operator and by a dense matrix.

python3 tests/benchmarks/large_contact.py [--beside] [--steps N] [--loads F F ...]

Square grids of 2,025, 4,900 and 10,000 nodes, constant pressure on each square (Love 1929), friction
none, the load given. Each implicit wear step is one inequality in p and the approach; products go
by fast Fourier transform, the factor is that of the nodes in contact and follows them; a large set that comes at once
is iterated. --beside gives the same steps with factors alone, and with the matrix of all nodes. --loads changes
the load from step to step, so that hundreds of nodes come and go. Times are of the process, memory the most it had.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable, Sequence

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import scipy.fft

from fenwear.arrays import Array
from fenwear.contact.inequality import Inequality
from fenwear.contact.operators import Dense, Indices, Solve, Updating

WEAR, LOAD, RADIUS = 5e-4, 6.6e-4, 8.0  # gap worn by unit pressure in a step; mean pressure over all; of the sphere


class HalfSpace:
    """Influence of pressures on a square grid on the gap, with wear, the approach and the balance of forces."""

    def __init__(self, side: int, *, iterated: bool = True) -> None:
        self.side, n = side, side * side
        h = 2 / side
        far = h * np.arange(side)
        self.table = love(far[:, None], far[None, :], h / 2)
        self.table[0, 0] += WEAR
        wrapped = np.abs(np.fft.fftfreq(2 * side, 1 / (2 * side))).astype(int) % side
        padded = np.where(np.arange(2 * side) == side, 0, 1)
        self.kernel = scipy.fft.rfft2(self.table[np.ix_(wrapped, wrapped)] * np.outer(padded, padded))
        self.at = np.divmod(np.arange(n), side)
        diagonal = np.append(np.full(n, self.table[0, 0]), 0.0)
        self.updating = Updating(self.entries, diagonal if iterated else None, self.multiply, 170.0 * n)

    def multiply(self, x: Array) -> Array:
        """Return S p - a and the mean of p."""
        side = self.side
        p = x[:-1].reshape(side, side)
        whole = scipy.fft.irfft2(scipy.fft.rfft2(p, (2 * side, 2 * side)) * self.kernel, (2 * side, 2 * side))
        return np.append(whole[:side, :side].ravel() - x[-1], p.mean())

    def entries(self, rows: Indices, columns: Indices) -> Array:
        """Return the numbers of some rows and columns."""
        n = self.side**2
        result = np.empty((len(rows), len(columns)))
        own, others = rows[rows < n], columns[columns < n]
        i, j = (np.abs(place[own][:, None] - place[others][None, :]) for place in self.at)
        result[: len(own), : len(others)] = self.table[i, j]
        result[: len(own), len(others) :] = -1.0
        result[len(own) :, : len(others)] = 1.0 / n
        result[len(own) :, len(others) :] = 0.0
        return result

    def factor(self, kept: Indices) -> Solve:
        """Return the solution operator of the rows and columns `kept`."""
        return self.updating.factor(kept)


def love(x: Array, y: Array, half: float) -> Array:
    """Return the displacement at (x, y) by unit pressure on a square of half-width `half`, E* = 1 / pi."""
    a, b, c, d = x + half, x - half, y + half, y - half
    return (
        a * np.log((c + np.hypot(c, a)) / (d + np.hypot(d, a)))
        + c * np.log((a + np.hypot(c, a)) / (b + np.hypot(c, b)))
        + b * np.log((d + np.hypot(d, b)) / (c + np.hypot(c, b)))
        + d * np.log((b + np.hypot(d, b)) / (a + np.hypot(d, a)))
    )


def wear(side: int, steps: int, way: str, loads: Sequence[float]) -> tuple[list[float], list[int], list[int], Array]:
    """Return time, Newton iterations and nodes in contact of each step, and the last pressures.

    Args:
        side: Nodes along a side of the square.
        steps: How many.
        way: "iterated", "factors" or "dense".
        loads: Of one step after the other, over and over.
    """
    n = side * side
    space = HalfSpace(side, iterated=way == "iterated")
    every = np.arange(n + 1, dtype=np.int32)
    operator = Dense(space.entries(every, every)) if way == "dense" else space
    middle = (2 * (np.arange(side) + 0.5) / side - 1) ** 2 / (2 * RADIUS)
    gap = np.append((middle[:, None] + middle).ravel(), 0.0)
    solver = Inequality(
        np.append(np.zeros(n), -np.inf),
        np.full(n + 1, np.inf),
        lambda x: operator.multiply(x) + gap,
        lambda _: operator,
        "large_",
        "the contact of sphere and half-space",
    )
    x = np.append(np.where(gap[:-1] < 0.1 * gap[:-1].max(), 1.0, 0.0), 0.0)
    times, iterations, touching = [], [], []
    for step in range(steps):
        begin = time.process_time()
        gap[-1] = -LOAD * loads[step % len(loads)]
        x = solver.solve(x, near=step > 0)
        gap[:-1] += WEAR * x[:-1]
        times.append(time.process_time() - begin)
        iterations.append(solver.iterations)
        touching.append(int((x[:-1] > 0).sum()))
    return times, iterations, touching, x[:-1]


def report(name: str, side: int, run: Callable[[], tuple[list[float], list[int], list[int], Array]]) -> Array:
    """Print the row of one run."""
    times, iterations, touching, pressure = run()
    later = np.array(times[1:])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"| {side * side:6,} | {name:8} | {touching[0]:,} to {touching[-1]:,} | {times[0]:.2f} s in {iterations[0]} "
        f"| {1e3 * np.median(later):.1f} | {1e3 * later.mean():.1f} | {later.max():.2f} "
        f"| {np.mean(iterations[1:]):.1f} | {sum(times):.1f} s | {peak:.0f} |",
        flush=True,
    )
    return pressure


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Contacts of thousands of nodes.")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--loads", type=float, nargs="*", default=[1.0])
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--sides", type=int, nargs="*", default=[45, 70, 100])
    arguments = parser.parse_args()
    print("| nodes | way | in contact | first step | median ms | mean ms | longest s | Newton | all steps | MiB |")
    print("| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for side in arguments.sides:
        few = min(arguments.steps, 50)
        ways = [("iterated", arguments.steps), *([("factors", few), ("dense", few)] if arguments.beside else [])]
        last = [report(way, side, lambda: wear(side, steps, way, arguments.loads)) for way, steps in ways]  # noqa: B023
        if arguments.beside and few == arguments.steps:
            print(f"largest difference of pressure: {max(np.abs(p - last[0]).max() for p in last) / last[0].max():.0e}")


if __name__ == "__main__":
    main()
