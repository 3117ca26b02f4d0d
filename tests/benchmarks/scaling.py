"""Set-up on several ranks: the same case on more of them (strong), and cases that grow with them (weak).

python3 tests/benchmarks/scaling.py [--quick]       the whole table
mpirun -n 2 python3 tests/benchmarks/scaling.py 32 0.2      one row

Four ranks on two cores show that the numbers agree, no speed. CPU times are of the rank that works most and of all
together: on idle cores the first is the time by the clock, whatever else the machine does meanwhile.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time

RANKS = (1, 2, 4)
STRONG = (64, 0.1)  # elements along the contact (of degree 4), growth of the element size
WEAK = {1: (32, 0.2), 2: (48, 0.15), 4: (64, 0.1)}
QUICK = (16, 1.0)


def measure(elements: str, growth: str) -> None:
    """Set up once, solve for the steady state, and print what it took as JSON."""
    from mpi4py import MPI

    from fenwear import assemble, load_case, steady

    comm = MPI.COMM_WORLD
    parameters = [f"geometry.parameters.elements_along_contact={elements}", f"geometry.parameters.growth={growth}"]
    assemble(load_case("example1"))
    comm.Barrier()
    begin, cpu = time.perf_counter(), time.process_time()
    system = assemble(load_case("example1", parameters), fresh=True)
    spent = comm.allgather(time.process_time() - cpu)
    seconds = time.perf_counter() - begin
    memory = comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    state = steady(system)
    found = {
        "unknowns": system.bodies.unknowns,
        "nodes": len(system.pair.x),
        "seconds": seconds,
        "most": max(spent),
        "all": sum(spent),
        "memory": sum(memory),
        "pressure": state.pressure.ravel().tolist(),
    }
    if comm.rank == 0:
        print(json.dumps(found))


def row(name: str, ranks: int, size: tuple[int, float], alone: list[float] | None) -> list[float]:
    """Print a row of the table, and return its pressures."""
    command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, __file__, *map(str, size)]
    environment = {**os.environ, "HWLOC_HIDE_ERRORS": "2"}
    done = subprocess.run(command, check=True, env=environment, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    p, first = found["pressure"], alone or found["pressure"]
    difference = max(abs(a - b) for a, b in zip(p, first, strict=True)) / max(first)
    print(
        f"| {name} | {ranks} | {found['unknowns']:,} | {found['nodes']} | {found['seconds']:.1f} | {found['most']:.1f} "
        f"| {found['all']:.1f} | {found['memory']:.0f} | {difference:.0e} |",
        flush=True,
    )
    return p


def main() -> None:
    """Print the table."""
    quick = "--quick" in sys.argv[1:]
    print("| scaling | ranks | unknowns | nodes | s | CPU s of one rank | of all | MiB of all | largest difference |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    alone = None
    for ranks in RANKS:
        p = row("strong", ranks, QUICK if quick else STRONG, alone)
        alone = alone or p
    for ranks in () if quick else RANKS:
        row("weak", ranks, WEAK[ranks], None)


if __name__ == "__main__":
    measure(*sys.argv[1:]) if len(sys.argv) == 3 else main()
