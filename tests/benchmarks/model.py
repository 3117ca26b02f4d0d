"""A model of the set-up on several ranks from counts, beside measured runs; and what it says of 64 ranks.

python3 tests/benchmarks/model.py

Counted: each rank's unknowns and boundary, as the meshes were really parted; the operations of its elimination and
of the joints; the bytes of the messages and of what each rank keeps. Rates come from one rank: of the sparse
elimination, of meshes and assembly from the smallest case, of dense algebra and of copies by themselves. All other
rows follow from counts. Solids, of whose columns each holder of a factor solves a share, follow from the estimates that
`check` tells, times how fast this core is. What is said of 64 ranks is computed, nothing of it was run.
"""

from __future__ import annotations

import json
import math
import os
import resource
import sys
import tempfile
import time
from dataclasses import asdict, dataclass

import numpy as np
import scipy.linalg
import setup

from fenwear.assembly.resources import ASSEMBLING, BodyResources, Resources
from fenwear.assembly.solver_choice import dealt
from fenwear.bodies.factor import entries, operations

SMALL, LARGE = ("plane", "32", "0.2"), ("plane", "64", "0.1")  # elements along the contact, growth of their size
SOLIDS = (12, 16)  # elements over the width of a solid contact; the first on one rank gives the rate
PRODUCTS = 60  # iterations of a wear step of 10,000 nodes that all touch, measured on two ranks
NETWORK, LATENCY = 10e9, 2e-6  # bytes a second and s a message between nodes, assumed
EDGE_ENTRIES, EDGE_WORK = 1 / (1 - math.sqrt(0.5)), 2.0  # over a dissection's levels: only fronts at the edge have it
INDEX, NUMBER, GIB = 4, 8, 2**30


@dataclass(frozen=True)
class Part:
    """What a rank eliminates of a body: unknowns, entries of its stiffness, degrees of freedom that stay."""

    unknowns: int
    matrix: int
    boundary: int

    @property
    def across(self) -> float:
        """Degrees of freedom on a separator of a square."""
        return math.sqrt(2 * self.unknowns)

    @property
    def work(self) -> float:
        """Operations: nested dissection, with the boundary at the edge of the fronts."""
        across, edge = self.across, self.boundary
        return operations(self.unknowns, 2) + EDGE_WORK * (across**2 * edge + across * edge**2)

    @property
    def entries(self) -> float:
        """Entries of the factor and of the Schur complement."""
        return entries(self.unknowns, 2) + EDGE_ENTRIES * self.across * self.boundary + self.boundary**2

    @property
    def memory(self) -> float:
        """Bytes."""
        return (NUMBER + INDEX) * self.matrix + NUMBER * (1.3 * self.entries + self.boundary**2)


@dataclass(frozen=True)
class Rates:
    """Of one core.

    Attributes:
        sparse: s for each entry of a sparse factor, of gathering and ordering it.
        dense: Operations a second, within fronts as well.
        copies: Bytes a second.
        meshing: s for each unknown of meshes, their parting, assembly and pairs.
        base: Bytes of a process with all its libraries.
    """

    sparse: float
    dense: float
    copies: float
    meshing: float
    base: float


def inside(parts: list[Part], rates: Rates) -> float:
    """Return the s of eliminating parts, one after the other."""
    return sum(part.entries * rates.sparse + part.work / rates.dense for part in parts)


def joints(parts: list[dict[str, list[int]]]) -> tuple[float, float]:
    """Return operations on the path of most of them, and bytes sent on it, of joining boundaries in pairs."""
    work = sent = 0.0
    step = 1
    alive = [dict(zip(one["numbers"], zip(one["having"], one["sharing"], strict=True), strict=True)) for one in parts]
    while step < len(alive):
        most = 0.0
        for k in range(0, len(alive) - step, 2 * step):
            one, other = alive[k], alive[k + step]
            both = {n: (one.get(n, (0, 0))[0] + other.get(n, (0, 0))[0], (one.get(n) or other[n])[1])
                    for n in one.keys() | other.keys()}  # fmt: skip
            left = {n: v for n, v in both.items() if v[0] < v[1]}
            g, stay = len(both) - len(left), len(left)
            most = max(most, g**3 / 3 + g**2 * stay + g * stay**2)
            sent = max(sent, NUMBER * float(len(other)) ** 2)
            alive[k] = left
        work += most
        step *= 2
    return work, sent * math.ceil(math.log2(max(len(alive), 1)))


def surface_work(m: int, n: int) -> float:
    """Return the operations of what a surface's owner does: its factor, and n columns."""
    return m**3 / 3 + 2 * m**2 * n


def interface_bytes(n: int, dim: int, phases: int) -> float:
    """Return what every rank keeps of the contact: influence of the joined bodies and of each, and of the phases."""
    return NUMBER * (3 * dim + 2 * phases + 1) * float(n) ** 2


def predicted(counts: dict, rates: Rates, *, within: bool = True) -> tuple[float, float]:
    """Return the s of the rank that works most and the bytes of all, for counted parts of both bodies."""
    ranks, n = counts["ranks"], counts["nodes"]
    bodies = counts["bodies"]
    own = [inside([Part(**body["parts"][r]) for body in bodies], rates) for r in range(ranks)]
    seconds = max(own) + counts["unknowns"] * rates.meshing / ranks
    memory = ranks * (rates.base + interface_bytes(n, 2, 2))
    for body in bodies:
        work, sent = joints(body["boundaries"])
        shared = work + surface_work(body["surface"], n) / (1 if ranks == 1 else 2)  # owners are two ranks
        seconds += shared / rates.dense + sent / (rates.copies if within else NETWORK)
        memory += sum(Part(**part).memory for part in body["parts"])
    seconds += interface_bytes(n, 2, 2) * (1 + math.log2(ranks)) / rates.copies
    return seconds, memory


def measure_solid(elements: str) -> None:
    """Set a solid up once, and print what it took and what was estimated, as JSON."""
    from mpi4py import MPI
    from solids import describe

    from fenwear import assemble
    from fenwear.assembly import elastic, place_case, resources_of

    comm = MPI.COMM_WORLD
    assemble(describe(4))
    base = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    begin = time.process_time()
    placed = place_case(describe(int(elements)))
    wanted = resources_of(placed)
    elastic(placed)
    spent = comm.allgather(time.process_time() - begin)
    memory = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    if comm.rank == 0:
        found = {"needs": asdict(wanted), "seconds": max(spent), "memory": sum(memory), "base": sum(base)}
        print(json.dumps(found))


def needs_in(found: dict) -> Resources:
    """Return the needs that a run of its own has printed."""
    own = found["needs"]
    return Resources(**{**own, "punch": BodyResources(**own["punch"]), "strip": BodyResources(**own["strip"])})


def estimated(wanted: Resources, ranks: int) -> float:
    """Return the s of the rank that works most: its share of meshes and assembly, its factor, its columns."""
    bodies = (wanted.punch, wanted.strip)
    own = [body.on_holder for body in bodies]
    shared = sum(ASSEMBLING[body.dim] * body.unknowns for body in bodies) / ranks
    return shared + (max(own) if ranks > 1 else sum(own))


def solids() -> None:
    """Print measured solids beside what is estimated, and what the estimate says of more ranks."""
    first = run(("solid", str(SOLIDS[0]), ""), 1)
    speed = first["seconds"] / estimated(needs_in(first), 1)
    print(f"\nSolids; this core takes {speed:.2f} times the time of the estimates")
    print("| unknowns | nodes | ranks | holders | CPU s, measured | told | ratio | GiB, measured | told | ratio |")
    print("| ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for size in SOLIDS:
        for ranks in (1, 2, 3, 4):
            found = run(("solid", str(size), ""), ranks)
            wanted = needs_in(found)
            seconds, memory = speed * estimated(wanted, ranks), found["base"] + wanted.memory
            both = f"{wanted.punch.holders} and {wanted.strip.holders}"
            print(f"| {wanted.punch.unknowns + wanted.strip.unknowns:,} | {wanted.nodes:,} | {ranks} | {both} "
                  f"| {found['seconds']:.2f} | {seconds:.2f} | {found['seconds'] / seconds:.2f} "
                  f"| {found['memory'] / GIB:.2f} | {memory / GIB:.2f} | {found['memory'] / memory:.2f} |",
                  flush=True)  # fmt: skip
    bodies = [BodyResources(3, n, 150 * n, 2401, 2401, 0.0, 7203) for n in (151_000.0, 165_000.0)]
    print("\nComputed, not run: 316,000 unknowns and 2,401 contact nodes of a solid")
    print("| ranks | holders | s | GiB of all |")
    print("| ---: | --- | ---: | ---: |")
    for ranks in (1, 2, 4, 8, 16, 64):
        wanted = dealt(Resources(*bodies, 2401, 1, 2, ranks), ranks, None)
        seconds = speed * estimated(wanted, ranks)
        print(f"| {ranks} | {wanted.punch.holders} and {wanted.strip.holders} | {seconds:,.0f} "
              f"| {wanted.memory / GIB:,.1f} |")  # fmt: skip


def measure(elements: str, growth: str) -> None:
    """Set up once, and print what it took and what was counted, as JSON."""
    from mpi4py import MPI

    from fenwear import assemble, load_case
    from fenwear.assembly import elastic, place_case

    comm = MPI.COMM_WORLD
    parameters = [f"geometry.parameters.elements_along_contact={elements}", f"geometry.parameters.growth={growth}"]
    assemble(load_case("example1"), fresh=True)
    base = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    comm.Barrier()
    begin = time.process_time()
    placed = place_case(load_case("example1", parameters))
    comm.Barrier()
    middle = time.process_time()
    elastic(placed, fresh=True)
    comm.Barrier()
    spent = comm.allgather((middle - begin, time.process_time() - middle))
    memory = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    bodies = []
    for body in (placed.bodies.punch, placed.bodies.strip):
        boundary = body.boundary
        own = {"numbers": boundary.numbers.tolist(), "sharing": boundary.sharing.tolist()}
        own["having"] = [1] * len(boundary.numbers)
        size = int(body.dim * boundary.present.sum())
        part = {"unknowns": size, "matrix": int(body.matrix_entries() * size / body.size)}
        part["boundary"] = len(boundary.numbers)
        parts, boundaries = comm.allgather(part), comm.allgather(own)
        bodies.append({"parts": parts, "boundaries": boundaries, "surface": int(body.surface_dofs.size)})
    counts = {"ranks": comm.size, "nodes": len(placed.pair.x), "unknowns": placed.bodies.unknowns, "bodies": bodies}
    if comm.rank == 0:
        seconds = [max(one[k] for one in spent) for k in (0, 1)]
        print(json.dumps({"counts": counts, "seconds": seconds, "memory": sum(memory), "base": sum(base)}))


def run(size: tuple[str, str, str], ranks: int) -> dict:
    """Return what a run of its own measured."""
    environment = {**os.environ, "HWLOC_HIDE_ERRORS": "2", "OMP_NUM_THREADS": "1", "FENWEAR_KEPT_GIB": "0"}
    return setup.run(ranks, *size, environment, __file__)


def rates() -> Rates:
    """Measure one core."""
    size = 2000
    matrix = np.random.default_rng(1).normal(size=(size, size))
    matrix = matrix @ matrix.T + size * np.eye(size)
    begin = time.process_time()
    factor = scipy.linalg.cholesky(matrix, lower=True)
    scipy.linalg.solve_triangular(factor, matrix, lower=True)
    dense = (size**3 / 3 + size**3) / (time.process_time() - begin)
    begin = time.process_time()
    for _ in range(10):
        matrix.copy()
    copies = 10 * matrix.nbytes / (time.process_time() - begin)
    found = run(SMALL, 1)
    counts = found["counts"]
    parts = [Part(**part) for body in counts["bodies"] for part in body["parts"]]
    surface = sum(surface_work(body["surface"], counts["nodes"]) for body in counts["bodies"]) / dense
    left = found["seconds"][1] - surface - sum(part.work for part in parts) / dense
    sparse = left / sum(part.entries for part in parts)
    return Rates(sparse, dense, copies, found["seconds"][0] / counts["unknowns"], found["base"])


def square(unknowns: int, nodes: int, ranks: int) -> dict:
    """Return the counts of two bodies that are squares, parted into equal squares, with their contact on one side."""
    own = unknowns // (2 * ranks)
    side = round(math.sqrt(2 * own))  # degrees of freedom along a side of a part
    grid = round(math.sqrt(ranks))
    on_surface = 2 * nodes // grid
    bodies = []
    for _ in range(2):
        parts = [{"unknowns": own, "matrix": 60 * own, "boundary": 4 * side + (on_surface if k < grid else 0)}
                 for k in range(ranks)]  # fmt: skip
        bodies.append({"parts": parts, "surface": 2 * nodes, "side": side})
    return {"ranks": ranks, "nodes": nodes, "unknowns": unknowns, "bodies": bodies}


def square_joints(counts: dict) -> tuple[float, float]:
    """Return operations and bytes on the path of joining a square's parts in pairs, one way and the other in turn."""
    ranks, side, work, sent = counts["ranks"], counts["bodies"][0]["side"], 0.0, 0.0
    surface = counts["bodies"][0]["surface"]
    wide, high = 1, 1
    while wide * high < ranks:
        across = (high if wide <= high else wide) * side  # of the joint
        wide, high = (2 * wide, high) if wide <= high else (wide, 2 * high)
        left = 2 * (wide + high) * side + surface * wide / math.sqrt(ranks)
        work += across**3 / 3 + across**2 * left + across * left**2
        sent += NUMBER * (left / 1.4) ** 2
    return work, sent


def computed(rate: Rates) -> None:
    """Print what the model says of 64 ranks in the plane."""
    unknowns, nodes = 10_000_000, 20_000
    for ranks in (1, 4, 16, 64):
        counts = square(unknowns, nodes, ranks)
        most = max(inside([Part(**body["parts"][k]) for body in counts["bodies"]], rate) for k in range(ranks))
        work, sent = square_joints(counts)
        own = most + unknowns * rate.meshing / ranks
        joined = 2 * work / rate.dense + 2 * (sent / NETWORK)
        surface = surface_work(2 * nodes, nodes) * (2 if ranks == 1 else 1) / rate.dense
        whole = interface_bytes(nodes, 2, 2)
        each = whole / ranks  # by rows
        given = whole / NETWORK if ranks > 1 else 0.0  # an owner sends each row to one rank
        memory = sum(Part(**part).memory for body in counts["bodies"] for part in body["parts"]) / ranks
        print(f"| {ranks} | {own:,.0f} | {joined:,.0f} | {surface:,.0f} | {given:,.0f} "
              f"| {own + joined + surface + given:,.0f} | {memory / GIB:,.1f} | {each / GIB:,.1f} "
              f"| {wear_step(nodes, ranks, rate):.2f} |")  # fmt: skip


def wear_step(nodes: int, ranks: int, rate: Rates) -> float:
    """Return the s of a wear step in which all nodes touch: products read own rows, vectors go out and come back."""
    sent = 2 * NUMBER * nodes / NETWORK + 2 * LATENCY * math.log2(ranks) if ranks > 1 else 0.0
    return PRODUCTS * (NUMBER * float(nodes) ** 2 / ranks / rate.copies + 2 * sent)  # and those of the preconditioner


def solid(rate: Rates) -> None:
    """Print what 64 ranks would need in a solid, whose surface is large: every column is solved for."""
    size, nodes, ranks = 5_000_000, 20_000, 64
    kept, columns = 2 * entries(size, 3), 2 * 4.0 * entries(size, 3) * nodes
    print(
        f"\nComputed, not run: the same in a solid, factors spread over {ranks} ranks, at best: "
        f"{NUMBER * kept / GIB:,.0f} GiB of factors in all, "
        f"{2 * operations(size, 3) / rate.dense / ranks:,.0f} s for them, "
        f"{columns / rate.dense / ranks:,.0f} s for {nodes:,} columns of each body, "
        f"{interface_bytes(nodes, 3, 2) / ranks / GIB:,.1f} GiB of the contact on each rank"
    )


def main() -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as folder:
        setup.sleeping(folder)
        tables()


def tables() -> None:
    """Print the tables."""
    rate = rates()
    print(f"one core: {rate.dense / 1e9:.1f} thousand million operations a second, {1e9 * rate.sparse:.0f} ns for each "
          f"entry of a factor, {1e6 * rate.meshing:.1f} µs of meshes for each unknown, copies of "
          f"{rate.copies / 1e9:.1f} GB/s")  # fmt: skip
    print("| unknowns | ranks | CPU s, measured | counted | ratio | GiB of all, measured | counted | ratio |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for size in (SMALL, LARGE):
        for ranks in (1, 2, 4):
            found = run(size, ranks)
            seconds, memory = predicted(found["counts"], rate)
            taken = sum(found["seconds"])
            print(f"| {found['counts']['unknowns']:,} | {ranks} | {taken:.2f} | {seconds:.2f} "
                  f"| {taken / seconds:.2f} | {found['memory'] / GIB:.2f} | {memory / GIB:.2f} "
                  f"| {found['memory'] / memory:.2f} |", flush=True)  # fmt: skip
    print("\nComputed, not run: 10,000,000 unknowns and 20,000 contact nodes in the plane, s and GiB of each rank")
    print(
        "| ranks | own cells | joining | surface | sent | together | GiB of bodies | GiB of the contact | wear step |"
    )
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    computed(rate)
    solid(rate)
    solids()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        measure_solid(sys.argv[3]) if sys.argv[2] == "solid" else measure(*sys.argv[3:])
    else:
        main()
