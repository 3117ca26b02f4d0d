"""How set-up time and memory grow with the mesh, on 1 and on 2 ranks.

python3 tests/benchmarks/growth.py                  the whole table
python3 tests/benchmarks/growth.py --steady         what the cyclic steady state costs, and how it grows
mpirun -n 2 python3 tests/benchmarks/growth.py 124 0.05     one row
"""

from __future__ import annotations

import json
import math
import os
import resource
import subprocess
import sys
import time

# elements along the contact (of degree 4), growth of the element size: 10 thousand to a million unknowns
STEADY = (64, 124, 250, 600)
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


def steady_row(elements: str, growth: str, positions: str) -> None:
    """Print nodes, phases, processor time and iterations of a steady state, and the largest memory, as JSON."""
    from fenwear import assemble, load_case, steady

    parameters = [f"geometry.parameters.elements_along_contact={elements}", f"geometry.parameters.growth={growth}"]
    if positions != "1":
        parameters += [f"motion.positions={positions}", "geometry.parameters.overlap=3"]
    system = assemble(load_case("example1", parameters))
    begin = time.process_time()
    state = steady(system)
    spent = time.process_time() - begin
    error = float(abs(state.pressure.max() / system.rigid.mean_pressure - 2))  # twice the mean
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    print(json.dumps([len(system.pair.x), len(system.motion.phases), spent, state.iterations, error, memory]))


def steady_table() -> None:
    """Print what steady states of more and more nodes cost, and the exponent of nodes between two rows."""
    print("| contact nodes | phases | CPU s | grows like n to the | Newton | largest pressure off 2 p_m | GiB |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for positions in ("1", "5"):
        before: tuple[float, float] | None = None
        for elements in STEADY if positions == "1" else STEADY[:3]:
            command = [sys.executable, __file__, str(elements), "0.5", positions]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            n, m, spent, iterations, off, memory = json.loads(done.stdout.splitlines()[-1])
            error = f"{off:.0e}" if m == 2 else ""  # where the strip moves, edges differ
            exponent = "" if before is None else f"{math.log(spent / before[1]) / math.log(n / before[0]):.1f}"
            print(f"| {n:,} | {m} | {spent:.2f} | {exponent} | {iterations} | {error:.0e} | {memory:.2f} |", flush=True)
            before = n, spent


def table() -> None:
    """Print all rows, each measured in a process of its own."""
    print("| unknowns | contact nodes | ranks | mesh, assembly | factor, condense | set-up | peak memory | steady |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |", flush=True)
    for elements, growth in SIZES:
        for ranks in (1, 2):
            command = ["mpirun", "-n", str(ranks), sys.executable, __file__, str(elements), str(growth)]
            subprocess.run(command, check=True, env={**os.environ, "HWLOC_HIDE_ERRORS": "2"})


if __name__ == "__main__":
    if sys.argv[1:] == ["--steady"]:
        steady_table()
    elif len(sys.argv) == 4:
        steady_row(*sys.argv[1:])
    else:
        row(*sys.argv[1:]) if len(sys.argv) > 1 else table()
