"""Set-up of a large plane case on one rank and on two, and its second start from what is kept on disk.

python3 tests/benchmarks/setup.py           ratios of time and memory; on a busy machine times on two ranks say little
python3 tests/benchmarks/setup.py 64 0.1    of a smaller mesh
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time


def measure(elements: str, growth: str) -> None:
    """Set up once and print the time since the imports, and the memory of each rank."""
    from mpi4py import MPI

    from fenwear import assemble, load_case

    comm = MPI.COMM_WORLD
    begin = time.perf_counter()
    parameters = [f"geometry.parameters.elements_along_contact={elements}", f"geometry.parameters.growth={growth}"]
    system = assemble(load_case("example1", parameters))
    comm.Barrier()
    memory = comm.gather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
    if comm.rank == 0:
        seconds = time.perf_counter() - begin
        print(json.dumps({"unknowns": system.bodies.unknowns, "seconds": seconds, "memory": memory}))


def table(elements: str, growth: str) -> None:
    """Measure in processes of their own, with an empty folder of what is kept."""
    found = {}
    forms = {**os.environ, "OMP_NUM_THREADS": "1", "HWLOC_HIDE_ERRORS": "2"}
    for name, ranks, limit in (("forms", 1, "0"), ("one rank", 1, "0"), ("two ranks", 2, "0"), ("first", 1, "4")):
        found[name] = run(ranks, elements, growth, {**forms, "FENWEAR_KEPT_GIB": limit})
    found["kept"] = run(1, elements, growth, {**forms, "FENWEAR_KEPT_GIB": "4"})
    one, two, kept = found["one rank"], found["two ranks"], found["kept"]
    print(f"{one['unknowns']:,} unknowns: {one['seconds']:.1f} s, {sum(one['memory']):.2f} GiB on one rank")
    print(f"two ranks: {two['seconds'] / one['seconds']:.2f} of its time, ", end="")
    print(f"{sum(two['memory']) / sum(one['memory']):.2f} of its memory, both together")
    print(f"second start: {kept['seconds']:.1f} s after the imports")


def run(ranks: int, elements: str, growth: str, environment: dict[str, str]) -> dict[str, float | list[float]]:
    """Return what a process, or several, measured."""
    command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable, __file__, "--measure", elements, growth]
    done = subprocess.run(command, check=True, env=environment, stdout=subprocess.PIPE, text=True)
    return dict(json.loads(done.stdout))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        measure(*sys.argv[2:])
    else:
        with tempfile.TemporaryDirectory() as folder:
            os.environ["XDG_CACHE_HOME"] = folder
            table(*(sys.argv[1:] or ["124", "0.05"]))
