"""Set-up of a large case on one rank and on two by phases, and its second start from what is kept on disk.

python3 tests/benchmarks/setup.py               932,292 unknowns in the plane
python3 tests/benchmarks/setup.py 64 0.1        of a smaller mesh
python3 tests/benchmarks/setup.py --solid 24    a solid pin on a strip, 2,401 contact nodes, minutes; 12 takes seconds

On a busy machine the clock says little. So the processor time of each phase is measured on every rank, and the
largest of the ranks are added up: that is what the set-up takes where every rank has a core of its own. Where a C
compiler is found, ranks sleep while they wait for one another; else waiting counts, too.
"""

from __future__ import annotations

import cProfile
import json
import os
import pstats
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fenwear import Case

SLEEP = """
#include <time.h>
int sched_yield(void) { struct timespec t = {0, 50000}; nanosleep(&t, 0); return 0; }
"""
PHASES = {  # what is looked at, by modules and functions that do not call one another
    "gmsh": [("mesh.py", "_load")],
    "meshes": [("mesh.py", "_distribute")],
    "spaces, supports, loads": [("bodies.py", "elastic_body")],
    "stiffness": [("assembly.py", "assembled_here"), ("assembly.py", "assembled")],
    "moving it to an owner": [("factor.py", "moved")],
    "elimination": [("factor.py", "_factored")],
    "joining ranks": [("substructure.py", "join")],
    "columns": [("response.py", "respond_together")],
    "loads": [("condensation.py", "_under_loads")],
}


def measure(kind: str, elements: str, growth: str) -> None:
    """Set up once and print the time since the imports, the processor time of each phase and the memory of ranks."""
    import gmsh  # noqa: F401  (half a second on the first rank)
    from mpi4py import MPI

    from fenwear import assemble

    case = case_of(kind, elements, growth)
    comm, profile = MPI.COMM_WORLD, cProfile.Profile(time.process_time)
    comm.Barrier()
    begin, spent_before = time.perf_counter(), time.process_time()
    system = profile.runcall(assemble, case)
    whole = time.process_time() - spent_before
    comm.Barrier()
    seconds = time.perf_counter() - begin
    found = comm.gather((phases(profile, whole), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20))
    if found is not None:
        names = found[0][0]
        spent = {name: [of_rank[name] for of_rank, _ in found] for name in names}
        result = {"unknowns": system.bodies.unknowns, "nodes": len(system.pair.weights), "seconds": seconds}
        print(json.dumps({**result, "phases": spent, "memory": [memory for _, memory in found]}))


def case_of(kind: str, elements: str, growth: str) -> Case:
    """Return Example 1 with so many elements along the contact, or a solid pin with so many over its width."""
    from solids import describe

    from fenwear import load_case

    if kind == "solid":
        return describe(int(elements))
    changes = {"elements_along_contact": elements, "growth": growth}
    return load_case("example1", [f"geometry.parameters.{name}={value}" for name, value in changes.items()])


def phases(profile: cProfile.Profile, whole: float) -> dict[str, float]:
    """Return the processor time of each phase on this rank, and of the rest, s."""
    stats: Any = pstats.Stats(profile)
    times = {(Path(file).name, function): entry[3] for (file, _, function), entry in stats.stats.items()}
    found = {name: sum(times.get(place, 0.0) for place in places) for name, places in PHASES.items()}
    found["the rest"] = whole - sum(found.values())
    return found


def table(kind: str, elements: str, growth: str) -> None:
    """Measure in processes of their own, with an empty folder of what is kept."""
    found = {}
    common = {**os.environ, "OMP_NUM_THREADS": "1", "HWLOC_HIDE_ERRORS": "2"}
    run(
        1, kind, "4" if kind == "solid" else elements, growth, {**common, "FENWEAR_KEPT_GIB": "0"}
    )  # compiles the forms
    for name, ranks, limit in (("one rank", 1, "0"), ("two ranks", 2, "0"), ("first", 1, "4"), ("kept", 1, "4")):
        found[name] = run(ranks, kind, elements, growth, {**common, "FENWEAR_KEPT_GIB": limit})
    one, two, kept = found["one rank"], found["two ranks"], found["kept"]
    print(f"{one['unknowns']:,} unknowns, {one['nodes']:,} contact nodes")
    print(f"{'processor time, s':26} {'one rank':>9} {'two ranks':>16}")
    for name, (alone,) in one["phases"].items():
        print(f"{name:26} {alone:9.2f} {two['phases'][name][0]:8.2f} {two['phases'][name][1]:7.2f}")
    whole, path = (sum(max(spent) for spent in way["phases"].values()) for way in (one, two))
    print(f"{'largest of each, in all':26} {whole:9.2f} {path:16.2f}, {path / whole:.2f} of it")
    clock, memory = ([way[name] for way in (one, two)] for name in ("seconds", "memory"))
    print(f"{'on the clock':26} {clock[0]:9.2f} {clock[1]:16.2f}, {clock[1] / clock[0]:.2f} of it")
    print(
        f"{'memory, GiB':26} {sum(memory[0]):9.2f} {sum(memory[1]):16.2f}, {sum(memory[1]) / sum(memory[0]):.2f} of it"
    )
    print(f"second start: {sum(map(sum, kept['phases'].values())):.2f} s after the imports")


def run(
    ranks: int, kind: str, elements: str, growth: str, environment: dict[str, str], script: str = __file__
) -> dict[str, Any]:
    """Return what a process, or several, measured."""
    start = ["mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n", str(ranks)]
    if "SLEEP" in environment:
        start += ["-x", f"LD_PRELOAD={environment['SLEEP']}"]
    command = [*start, sys.executable, script, "--measure", kind, elements, growth]
    done = subprocess.run(command, check=True, env=environment, stdout=subprocess.PIPE, text=True)
    return dict(json.loads(done.stdout))


def sleeping(folder: str) -> None:
    """Have ranks sleep while they wait, by a library in this folder, where there is a compiler."""
    library, compiler = Path(folder, "sleep.so"), shutil.which("cc")
    if compiler is not None:
        command = [compiler, "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
        subprocess.run(command, input=SLEEP, text=True, check=True)
        os.environ["SLEEP"] = str(library)


def main() -> None:
    """Read the command line."""
    if sys.argv[1:2] == ["--measure"]:
        return measure(*sys.argv[2:])
    solid = sys.argv[1:2] == ["--solid"]
    given = sys.argv[2:] if solid else sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        sleeping(folder)
        return table("solid", (given or ["24"])[0], "") if solid else table("plane", *(given or ["124", "0.05"]))


if __name__ == "__main__":
    main()
