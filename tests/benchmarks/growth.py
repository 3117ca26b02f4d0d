"""How set-up time and memory grow with the mesh, on 1 and on 2 ranks.

python3 tests/benchmarks/growth.py                  the whole table
mpirun -n 2 python3 tests/benchmarks/growth.py 124 0.05     one row
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time

# elements along the contact (of degree 4), growth of the element size: 10 thousand to a million unknowns
SIZES = ((16, 1.0), (16, 0.5), (32, 0.2), (64, 0.1), (124, 0.05), (250, 0.2))


def row(elements: str, growth: str) -> None:
    """Set up once and print the row of the table."""
    from mpi4py import MPI

    from fenwear import assemble, load_case, steady

    comm = MPI.COMM_WORLD
    parameters = [f"geometry.parameters.elements_along_contact={elements}", f"geometry.parameters.growth={growth}"]
    assemble(load_case("example1"))
    comm.Barrier()
    begin = time.perf_counter()
    system = assemble(load_case("example1", parameters))
    assembled = time.perf_counter()
    comm.Barrier()
    done = time.perf_counter()
    state = steady(system)
    memory = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024**2
    unknowns = system.bodies.unknowns
    if comm.rank == 0:
        print(
            f"| {unknowns:9,} | {len(system.pair.x):5,} | {comm.size} | {assembled - begin:6.1f} s "
            f"| {done - assembled:6.1f} s | {done - begin:6.1f} s | {memory:5.1f} GiB | {state.seconds:.2f} s |",
            flush=True,
        )


def table() -> None:
    """Print all rows, each measured in a process of its own."""
    print("| unknowns | contact nodes | ranks | mesh, assembly | factor, condense | set-up | peak memory | steady |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |", flush=True)
    for elements, growth in SIZES:
        for ranks in (1, 2):
            command = ["mpirun", "-n", str(ranks), sys.executable, __file__, str(elements), str(growth)]
            subprocess.run(command, check=True, env={**os.environ, "HWLOC_HIDE_ERRORS": "2"})


if __name__ == "__main__":
    row(*sys.argv[1:]) if len(sys.argv) > 1 else table()
