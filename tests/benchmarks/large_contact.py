"""Contacts of thousands of nodes: a sphere on a half-space that wears, by an operator and by a dense matrix.

python3 tests/benchmarks/large_contact.py [--beside] [--steps N] [--loads F F ...] [--radius R]

Square grids of 2,025, 4,900 and 10,000 nodes, constant pressure on each square (Love 1929), friction
none, the load given. Each implicit wear step is one inequality in p and the approach.

"run" is the contact of every run, whose compliance is a matrix, and whose factor follows the nodes that touch.
"factors" has this half-space's own products by fast Fourier transform. --beside gives the same steps with the matrix of
all nodes. --loads changes the load from step to step, so that hundreds of nodes come and go; --radius 1000 lets all
nodes touch. Times and memory are of the process, each row in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import cast

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import scipy.fft
from mpi4py import MPI

from fenwear.algebra.submatrices import Dense, Indices, Solve, Updating
from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, ContactState, SlidingContact
from fenwear.contact.inequality import Inequality
from fenwear.surfaces import Interface, RigidEquilibrium

COMM = MPI.COMM_WORLD
WEAR, LOAD, RADIUS = 5e-4, 6.6e-4, 8.0  # gap worn by unit pressure in a step; mean pressure over all; of the sphere


class HalfSpace:
    """Influence of pressures on a square grid on the gap, with wear, the approach and the balance of forces."""

    def __init__(self, side: int) -> None:
        self.side, n = side, side * side
        h = 2 / side
        far = h * np.arange(side)
        self.table = love(far[:, None], far[None, :], h / 2)
        self.table[0, 0] += WEAR
        wrapped = np.abs(np.fft.fftfreq(2 * side, 1 / (2 * side))).astype(int) % side
        padded = np.where(np.arange(2 * side) == side, 0, 1)
        self.kernel = scipy.fft.rfft2(self.table[np.ix_(wrapped, wrapped)] * np.outer(padded, padded))
        self.at = np.divmod(np.arange(n), side)
        self.updating = Updating(self.entries)

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


@dataclass(frozen=True)
class Rigid:
    """A punch that can only come down, as `fenwear.surfaces.RigidEquilibrium` has it."""

    weights: Array
    mean_pressure: float = LOAD
    mode_names: tuple[str, ...] = ("lambda_F",)

    @property
    def pair(self) -> Rigid:
        """Where the weights are."""
        return self

    @property
    def normal(self) -> Array:
        """Of one component: nothing else acts."""
        return np.ones((len(self.weights), 1))

    @property
    def resultant(self) -> Array:
        """The load."""
        return np.array([-LOAD * self.weights.sum()])

    @property
    def rigid_normal(self) -> Array:
        """The gap opened by its motion up."""
        return np.ones((len(self.weights), 1))

    def equilibrium(self, _ratio: Array) -> Array:
        """The force of unit pressures."""
        return self.weights[None]


def grid(side: int) -> Interface:
    """Return the interface of sphere and half-space by Love's formula."""
    far, n = 2 / side * np.arange(side), side * side
    table, at = n * love(far[:, None], far[None, :], 1 / side), np.divmod(np.arange(n), side)
    by_force: Array = np.empty((n, n, 1))
    for i in range(n):
        by_force[i, :, 0] = table[np.abs(at[0] - at[0][i]), np.abs(at[1] - at[1][i])]
    rigid = cast(RigidEquilibrium, Rigid(np.full(n, 1.0 / n)))
    even = by_force[:, :, 0].mean(axis=1)
    interface = Interface(rigid, None, None, False)  # type: ignore[arg-type]  # its answers are known
    own = np.full((n, 1), table[0, 0])
    vars(interface).update(gap_by_force=by_force, load_gap=np.zeros(n), own_by_force=own, by_even=even)
    return interface


@dataclass(frozen=True)
class Wearing:
    """What a step wears, as `fenwear.laws.LayerStep` has it."""

    def opening(self, pressure: Array) -> Array:
        """Return the depth."""
        return WEAR * pressure

    def local(self, pressure: Array) -> Array:
        """Return its derivative at each node."""
        return np.full_like(pressure, WEAR)

    def border(self, pressure: Array) -> tuple[Array, Array]:
        """Not asked for of many nodes."""
        raise NotImplementedError

    @property
    def curved(self) -> bool:
        """Nothing gives way beside it."""
        return False

    def layer(self, _pressure: Array) -> Array | None:
        """Nothing gives way beside it."""
        return None


def love(x: Array, y: Array, half: float) -> Array:
    """Return the displacement at (x, y) by unit pressure on a square of half-width `half`, E* = 1 / pi."""
    a, b, c, d = x + half, x - half, y + half, y - half
    return (
        a * np.log((c + np.hypot(c, a)) / (d + np.hypot(d, a)))
        + c * np.log((a + np.hypot(c, a)) / (b + np.hypot(c, b)))
        + b * np.log((d + np.hypot(d, b)) / (c + np.hypot(c, b)))
        + d * np.log((b + np.hypot(d, b)) / (a + np.hypot(d, a)))
    )


Found = tuple[list[float], list[int], list[int], Array]


def wear(side: int, steps: int, loads: Sequence[float], radius: float, way: str) -> Found:
    """Return time, Newton iterations and nodes in contact of each step, and the last pressures.

    Args:
        side: Nodes along a side of the square.
        steps: How many.
        loads: Of one step after the other, over and over.
        radius: Of the sphere.
        way: "factors" or "dense".
    """
    n = side * side
    space = HalfSpace(side)
    every = np.arange(n + 1, dtype=np.int32)
    operator = Dense(space.entries(every, every)) if way == "dense" else space
    middle = (2 * (np.arange(side) + 0.5) / side - 1) ** 2 / (2 * radius)
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


def run(side: int, steps: int, loads: Sequence[float], radius: float) -> Found:
    """Return the same by the contact of every run, on one rank or on several."""
    x = 2 * (np.arange(side) + 0.5) / side - 1
    gap = ((x**2)[:, None] + x**2).ravel() / (2 * radius)
    contact = CondensedContact([SlidingContact(grid(side), np.zeros((len(gap), 1)))])
    start = np.where(gap < 0.1 * gap.max(), LOAD, 0.0)[None]
    state = ContactState(start, np.zeros_like(start), np.zeros((1, 1)), 0)
    times, iterations, touching = [], [], []
    for step in range(steps):
        begin = time.process_time()
        contact.press(loads[step % len(loads)])
        state = contact.solve(gap, state, Wearing())
        gap = gap + WEAR * state.pressure[0]
        times.append(time.process_time() - begin)
        iterations.append(state.iterations)
        touching.append(int((state.pressure > 0).sum()))
    return times, iterations, touching, state.pressure[0]


def report(name: str, side: int, run: Callable[[], Found]) -> None:
    """Print the row of one run, and its pressures."""
    times, iterations, touching, pressure = run()
    later = np.array(times[1:])
    peak = max(COMM.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024))
    if COMM.rank:
        return
    row = (
        f"| {side * side:6,} | {name:8} | {touching[0]:,} to {touching[-1]:,} | {times[0]:.2f} s in {iterations[0]} "
        f"| {1e3 * np.median(later):.1f} | {1e3 * later.mean():.1f} | {later.max():.2f} "
        f"| {np.mean(iterations[1:]):.1f} | {sum(times):.1f} s | {peak:.0f} |"
    )
    print(json.dumps([row, pressure.tolist()]))


def row(way: str, side: int, steps: int, asked: argparse.Namespace) -> Array:
    """Print the row of a run in a process of its own, or in several; return its pressures."""
    words = ["--way", way, "--sides", side, "--steps", steps, "--radius", asked.radius, "--loads", *asked.loads]
    command = [sys.executable, "-m", "mpi4py", __file__, *map(str, words)]
    environment = {**os.environ, "HWLOC_HIDE_ERRORS": "2"}
    done = subprocess.run(command, check=True, env=environment, capture_output=True, text=True)
    text, pressures = json.loads(done.stdout.splitlines()[-1])
    print(text, flush=True)
    return np.array(pressures)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Contacts of thousands of nodes.")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--loads", type=float, nargs="*", default=[1.0])
    parser.add_argument("--radius", type=float, default=RADIUS)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--sides", type=int, nargs="*", default=[45, 70, 100])
    parser.add_argument("--way", default=None)
    asked = parser.parse_args()
    if asked.way:
        way, side = asked.way, asked.sides[0]
        found = run if way == "run" else partial(wear, way=way)
        report(way, side, lambda: found(side, asked.steps, loads=asked.loads, radius=asked.radius))
        return
    print("| nodes | way | in contact | first step | median ms | mean ms | longest s | Newton | all | MiB |")
    print("| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for side in asked.sides:
        few = min(asked.steps, 50)
        ways = [("run", asked.steps), ("factors", asked.steps)]
        ways += [("dense", few)] if asked.beside else []
        last = {way: row(way, side, steps, asked) for way, steps in ways}
        same = [last[way] for way, steps in ways if steps == asked.steps]
        print(f"largest difference of pressure: {max(np.abs(p - same[0]).max() for p in same) / same[0].max():.0e}")


if __name__ == "__main__":
    main()
