"""The same contact of a sphere on a half-space by fenwear and by Tamaas, from nothing, side by side in one run.

    python3 tests/benchmarks/beside_tamaas.py [NODES...]

With a Python that has Tamaas (`pip install tamaas`); fenwear is started in its container, in turns with it. Both have
constant pressures on squares, no periods and the same gaps. Processor times, the least of some: of the kernels, and of
solutions. Errors are the largest of a pressure over the largest pressure, against Tamaas' at a tolerance of 1e-13; its
time is that of the first of several tolerances with an error no larger than ours.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
FORCE, TURNS, SOLVES = 600.0, 3, 5
TOLERANCES = tuple(10.0**-k for k in range(4, 13))


def ours(nodes: int, folder: Path) -> None:
    """Leave what is solved, our pressure and our least times in a folder."""
    sys.path.insert(0, str(ROOT))
    from fenwear import assemble
    from tests.contact.half_space_ball import ball

    system = assemble(ball(FORCE, grid={"nodes": nodes, "size": [2.0, 2.0]}, contact={"friction": 0.0}))
    gap, grid, times = system.gap(0, system.unworn()), system.pair.punch.grid, []
    assert grid is not None
    for _ in range(SOLVES):
        begin = time.process_time()
        contact = system.phase_contact((0,))
        made = time.process_time()
        pressure = contact.solve(gap).pressure[0]
        times.append((made - begin, time.process_time() - made))
    modulus = 1 / sum((1 - nu**2) / young for young, nu in ((2.1e5, 0.3), (1.0e5, 0.34)))
    np.savez(
        folder / "ours.npz", gap=gap.reshape(grid.counts), pressure=pressure.reshape(grid.counts), modulus=modulus,
        sides=np.array(grid.spacing) * grid.counts, times=np.min(times, axis=0),
    )  # fmt: skip


def theirs(known: dict[str, np.ndarray], tolerance: float) -> tuple[float, float, np.ndarray]:
    """Return Tamaas' times of the kernel and of a solution, and its pressure."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    gap, sides = known["gap"], known["sides"]
    begin = time.process_time()
    model = tm.Model(tm.model_type.basic_2d, list(sides), list(gap.shape))
    model.E, model.nu = float(known["modulus"]), 0.0
    tm.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tm.PolonskyKeerRey(model, np.ascontiguousarray(-gap), tolerance)
    solver.setIntegralOperator("dcfft")
    solver.max_iter = 3000
    made = time.process_time()
    solver.solve(FORCE / float(sides.prod()))
    return made - begin, time.process_time() - made, np.array(model.traction)


def main() -> None:
    """Print a row for each number of nodes along a side."""
    print("nodes      touch  ours: kernel, solution (ms)  error    Tamaas: kernel, solution (ms)  error    ratio")
    for nodes in [int(text) for text in sys.argv[1:]] or [64, 128, 256]:
        mine, other = np.full(2, np.inf), np.full(2, np.inf)
        with tempfile.TemporaryDirectory() as folder:
            script = str(Path(__file__).resolve())
            for _ in range(TURNS):
                command = [str(ROOT / "docker/fenwear"), "env", "OMP_NUM_THREADS=1", "python3", script, "--ours"]
                subprocess.run([*command, str(nodes), folder], check=True)
                with np.load(Path(folder, "ours.npz")) as stored:
                    known = dict(stored)
                mine = np.minimum(mine, known["times"])
                exact = theirs(known, 1e-13)[2]
                error = np.abs(known["pressure"] - exact).max() / exact.max()
                for tolerance in TOLERANCES:
                    off = np.abs(theirs(known, tolerance)[2] - exact).max() / exact.max()
                    if off <= error:
                        break
                for _again in range(SOLVES):
                    other = np.minimum(other, theirs(known, tolerance)[:2])
        print(
            f"{nodes:3} x {nodes:3} {(exact > 0).sum():5}  {1e3 * mine[0]:12.1f}  {1e3 * mine[1]:12.1f}  {error:8.1e}  "
            f"{1e3 * other[0]:14.1f}  {1e3 * other[1]:12.1f}  {off:8.1e}  {mine[1] / other[1]:7.2f}",
            flush=True,
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--ours"]:
        ours(int(sys.argv[2]), Path(sys.argv[3]))
    else:
        main()
