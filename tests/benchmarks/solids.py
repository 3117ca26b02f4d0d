"""Time and memory of a solid pin on a solid strip: set-up, half-cycles, jumps, steady state, heat, full-space contact.

    docker/fenwear python3 tests/benchmarks/solids.py               8 elements over the contact, seconds
    docker/fenwear python3 tests/benchmarks/solids.py --elements 24 2,401 nodes, 151,000 and 165,000 unknowns

    docker/fenwear mpirun -n 2 python3 tests/benchmarks/solids.py   the same on two ranks

Each line has the processor time of the rank that took most, the time on the clock, and the largest memory of all ranks
together so far. What --only leaves out is not done, so that one part can be looked at alone.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI

from fenwear import Tribosystem
from fenwear.case import Case, make_case
from fenwear.contact import SlidingContact
from fenwear.steps import steady
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.system import elastic, place_case, with_exchange
from fenwear_verify.full_space import FullContact

PARTS = ("warm", "jumps", "steady", "full", "heat")
COMM = MPI.COMM_WORLD


def describe(elements: int, *, heat: bool = False) -> Case:
    """Return a steel pin of 1 mm with a worn face on a strip, to and fro."""
    margin, layers = max(1, elements // 6), max(2, round(elements / 2.4))
    steel = {"young": "210 GPa", "poisson": 0.3, "conductivity": 50.0, "heat_capacity": "460 J/(kg K)",
             "density": "7800 kg/m^3", "expansion": "1.1e-5 1/K"}  # fmt: skip
    sizes = {"margin_x": 1, "margin_y": 1, "margin_elements": margin, "spread": 1.6, "across_x": elements,
             "across_y": elements, "punch_height": 2, "strip_height": 1.5, "punch_layers": layers,
             "strip_layers": max(2, elements // 4), "growth": 1.3}  # fmt: skip
    tables: dict[str, Any] = {
        "geometry": {"file": "solid_blocks.geo", "degree": 2, "parameters": sizes, "follow_wear": "never"},
        "model": {"kind": "solid"},
        "materials": {"steel": steel},
        "punch": {"regions": {"punch_body": "steel"}, "supports": [{"on": "punch_far", "fix": ["x", "y"]}],
                  "loads": [{"on": "punch_far", "force": [0, 0, -50]}]},
        "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}],
                  "temperatures": [{"on": "strip_far"}]},
        "contact": {"friction": 0.1},
        "wear": {"punch": {"coefficient": 1e-8}},
        "motion": {"kind": "reciprocating", "amplitude": 0.5, "period": 0.1},
        "run": {"half_cycles": 2},
    }  # fmt: skip
    if heat:
        tables["heat"] = {"convection": "50 W/(m^2*K)", "conductance": "perfect"}
    return make_case(tables)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print how long a block took; collective."""
    cpu, clock = time.process_time(), time.perf_counter()
    yield
    cpu, clock = time.process_time() - cpu, time.perf_counter() - clock
    memory = COMM.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
    cpu = COMM.allreduce(cpu, MPI.MAX)
    say(f"{what:52} {cpu:9.3f} s  {clock:9.3f} s  {memory:6.2f} GiB")


def say(text: str) -> None:
    """Print on the first rank."""
    if COMM.rank == 0:
        print(text, flush=True)


def warm(system: Tribosystem, half_cycles: int = 20) -> float:
    """Print and return the processor time of a half-cycle of a march that has begun."""
    blocks = march_within(system, RunLimits(half_cycles + 4, block=1), implicit=True)
    for _ in range(4):
        next(blocks)
    begin = time.process_time()
    count = sum(len(block) for block in blocks)
    each = (time.process_time() - begin) / count
    say(f"{'a warm half-cycle':52} {each:9.4f} s")
    return each


def full_space(system: Tribosystem, each: float) -> None:
    """Solve one contact with all displacements as unknowns, and compare."""
    ratio = system.phases.middle_ratio(1)
    gap = system.gap(0, system.unworn()) + 1e-5 * np.hypot(*system.pair.punch.x[:, :2].T) ** 2
    condensed = system.phase_contact((0,)).solve(gap).pressure[0]
    full = FullContact(
        [SlidingContact(system.elastic.interfaces[0], ratio)], [(system.bodies.punch, system.bodies.strip)]
    )
    begin = time.process_time()
    pressure = full.solve(gap).pressure[0]
    spent = time.process_time() - begin
    apart = np.abs(pressure - condensed).max() / condensed.max()
    say(f"{'one full-space contact':52} {spent:9.3f} s, {spent / each:.0f} warm half-cycles")
    say(f"{'':52} pressures within {apart:.1e}")


def without_heat(asked: argparse.Namespace) -> None:
    """Set up, and take the parts that are asked for."""
    with timed("meshes, stiffness, pairs"):
        placed = place_case(describe(asked.elements))
    sizes = [body.stiffness.size[0] for body in (placed.bodies.punch, placed.bodies.strip)]
    say(f"{len(placed.pair.weights):,} contact nodes, {sizes[0]:,} and {sizes[1]:,} unknowns")
    with timed("factors and condensation"):
        system = elastic(placed, fresh=asked.fresh)
    with timed("the first contact, from cold"):
        contact = system.phase_contact((0,)).solve(system.gap(0, system.unworn()))
    say(f"{'':52} {contact.iterations} Newton iterations, {(contact.pressure > 0).sum():,} nodes in contact")
    each = warm(system)
    if "jumps" in asked.only:
        with timed(f"{asked.half_cycles:,} half-cycles by jumps"):
            blocks = list(jump_within(system, RunLimits(asked.half_cycles, block=1), tolerance=3e-3))
        say(f"{'':52} {len(blocks)} jumps")
    if "steady" in asked.only:
        with timed("cyclic steady state"):
            state = steady(system)
        say(f"{'':52} {state.iterations} Newton iterations")
    if "full" in asked.only:
        full_space(system, each)


def with_heat(asked: argparse.Namespace) -> None:
    """The same with heat, as one run would do it."""
    with timed("with heat: bodies and condensation"):
        hot = elastic(place_case(describe(asked.elements, heat=True)), fresh=asked.fresh)
    with timed("with heat: steps on a reduced basis"):
        hot = with_exchange(hot, reduced=True)
    first, second = (len(basis) for basis in hot.exchange.bases)
    say(f"{'':52} {first} and {second} temperatures")
    with timed("with heat: 2,000 half-cycles by jumps"):
        blocks = list(jump_within(hot, RunLimits(2000, block=1), tolerance=3e-3))
    say(f"{'':52} {len(blocks)} jumps")


def main() -> None:
    """Run the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--elements", type=int, default=8, help="over the width of the contact")
    parser.add_argument("--half-cycles", type=int, default=20_000)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--fresh", action="store_true", help="set up anew, whatever is kept")
    asked = parser.parse_args()
    if set(asked.only) - {"heat"}:
        without_heat(asked)
    if "heat" in asked.only:
        with_heat(asked)


if __name__ == "__main__":
    main()
