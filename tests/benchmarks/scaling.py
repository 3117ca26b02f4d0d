"""Set-up on several ranks: the same case on more of them (strong), and cases that grow with them (weak).

python3 tests/benchmarks/scaling.py             the whole table
python3 tests/benchmarks/scaling.py --quick     small cases, seconds

The same in the plane, whose bodies all ranks eliminate together, and in a solid, whose columns they share. Four ranks
on two cores show that the numbers agree, no speed. CPU times are of the rank that works most and of all together: on
idle cores the first is the time by the clock, whatever else the machine does meanwhile. Where a C compiler is found,
ranks sleep while they wait for one another; else waiting counts, too.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
import time

import setup

RANKS = (1, 2, 3, 4)
STRONG = (("plane", "64", "0.1"), ("solid", "16", ""))  # elements along the contact, growth of the element size
WEAK = {1: ("plane", "32", "0.2"), 2: ("plane", "48", "0.15"), 4: ("plane", "64", "0.1")}
QUICK = (("plane", "16", "1.0"), ("solid", "6", ""))


def measure(kind: str, elements: str, growth: str) -> None:
    """Set up once, solve for the steady state, and print what it took as JSON."""
    from mpi4py import MPI

    from fenwear import assemble, steady

    comm = MPI.COMM_WORLD
    assemble(setup.case_of(kind, "4" if kind == "solid" else "8", "1.0"))
    comm.Barrier()
    begin, cpu = time.perf_counter(), time.process_time()
    system = assemble(setup.case_of(kind, elements, growth))
    spent = comm.allgather(time.process_time() - cpu)
    seconds = time.perf_counter() - begin
    memory = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    state = steady(system)
    found = {
        "unknowns": system.bodies.unknowns,
        "nodes": len(system.pair.weights),
        "seconds": seconds,
        "most": max(spent),
        "all": sum(spent),
        "memory": sum(memory),
        "pressure": state.pressure.ravel().tolist(),
    }
    if comm.rank == 0:
        print(json.dumps(found))


def row(name: str, ranks: int, size: tuple[str, str, str], alone: list[float] | None) -> list[float]:
    """Print a row of the table, and return its pressures."""
    environment = {**os.environ, "HWLOC_HIDE_ERRORS": "2", "OMP_NUM_THREADS": "1", "FENWEAR_KEPT_GIB": "0"}
    found = setup.run(ranks, *size, environment, __file__)
    p: list[float] = found["pressure"]
    largest = max(alone or p)
    difference = "" if alone is None else f"{max(abs(a - b) for a, b in zip(p, alone, strict=True)) / largest:.0e}"
    print(
        f"| {name}, {size[0]} | {ranks} | {found['unknowns']:,} | {found['nodes']:,} | {found['seconds']:.1f} "
        f"| {found['most']:.1f} | {found['all']:.1f} | {found['memory']:,.0f} | {difference} |",
        flush=True,
    )
    return p


def main() -> None:
    """Print the table."""
    quick = "--quick" in sys.argv[1:]
    print("| scaling | ranks | unknowns | nodes | s | CPU s of one rank | of all | MiB of all | largest difference |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        setup.sleeping(folder)
        for size in QUICK if quick else STRONG:
            alone = None
            for ranks in RANKS:
                p = row("strong", ranks, size, alone)
                alone = alone or p
        for ranks, size in {} if quick else WEAK.items():
            row("weak", ranks, size, None)


if __name__ == "__main__":
    measure(*sys.argv[2:]) if sys.argv[1:2] == ["--measure"] else main()
