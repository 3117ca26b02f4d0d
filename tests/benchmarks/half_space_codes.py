"""Contact and wear of 64 x 64 nodes beside half-space codes that may be installed: Tamaas and ASPHER.

    docker/fenwear python3 tests/benchmarks/half_space_codes.py    fenwear, and what else is installed there
    python3 tests/benchmarks/half_space_codes.py                   elsewhere: what is installed there

A sphere on an elastic half-space: the contact from cold, warm with a load 2 % larger, and 100 wear steps at
constant load, with the nodes in contact at the end and the largest pressure. What cannot be imported is said
to be missing. Tamaas' half-space is periodic, fenwear's and ASPHER's here are not. Times are of the process, the least
of three.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

SIDE, STEPS, WEAR, LOAD, RADIUS = 64, 100, 5e-4, 6.6e-4, 8.0  # as in large_contact.py
Found = tuple[float, float, float, int, float]  # three times, nodes in contact, largest pressure


def sphere() -> np.ndarray:
    """Return the gap of the sphere on the square from -1 to 1."""
    x = (2 * (np.arange(SIDE) + 0.5) / SIDE - 1) ** 2 / (2 * RADIUS)
    return x[:, None] + x


def fenwear() -> Found:
    """Return the times of our contact inequality, with the influence of constant pressures on squares."""
    import large_contact

    cold, *_ = large_contact.wear(SIDE, 1, [1.0], "factors")
    two, *_ = large_contact.wear(SIDE, 2, [1.0, 1.02], "factors")
    every, _, touching, p = large_contact.wear(SIDE, STEPS, [1.0], "factors")
    return cold[0], two[1], sum(every), touching[-1], float(p.max())


def tamaas() -> Found:
    """Return the times of Polonsky and Keer's conjugate gradients with Fourier transforms."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    model = tm.Model(tm.model_type.basic_2d, [2.0, 2.0], [SIDE, SIDE])
    model.E, model.nu = 1 / np.pi, 0.0  # E* of the influence numbers in large_contact.py
    surface = np.ascontiguousarray(-sphere())

    def solve(load: float) -> float:
        begin = time.process_time()
        tm.PolonskyKeerRey(model, surface, 1e-9).solve(load)
        return time.process_time() - begin

    cold, warm, begin = solve(LOAD), solve(1.02 * LOAD), time.process_time()
    for _ in range(STEPS):
        solve(LOAD)
        surface -= WEAR * model.traction
    spent = time.process_time() - begin
    return cold, warm, spent, int((model.traction > 0).sum()), float(model.traction.max())


def aspher() -> Found:
    """Return the times of conjugate gradients with Fourier transforms, preconditioned, from the last pressure on."""
    import aspher as code

    solver = code.ContactSolver(grid_size=SIDE, domain_size=2.0, E_star=1 / np.pi, backend="fft")
    gap = sphere().ravel()

    def solve(load: float, start: np.ndarray | None = None) -> tuple[float, np.ndarray]:
        begin = time.process_time()
        found = solver.solve(gap, p_nominal=load, tol=1e-8, precond="fourier", p_init=start)
        return time.process_time() - begin, np.asarray(found.pressure)

    cold, pressure = solve(LOAD)
    warm, _ = solve(1.02 * LOAD, 1.02 * pressure)
    begin = time.process_time()
    for _ in range(STEPS):
        _, pressure = solve(LOAD, pressure)
        gap = gap + WEAR * pressure.ravel()
    spent = time.process_time() - begin
    return cold, warm, spent, int((pressure > 0).sum()), float(pressure.max())


def main() -> None:
    """Print a line for each."""
    codes: dict[str, Callable[[], Found]] = {"fenwear": fenwear, "Tamaas": tamaas, "ASPHER": aspher}
    for name, run in codes.items():
        try:
            times = np.min([run() for _ in range(3)], axis=0)
        except ImportError as error:
            print(f"{name:8} missing: {error}")
            continue
        print(f"{name:8} cold {1e3 * times[0]:8.1f} ms  warm {1e3 * times[1]:8.1f} ms  "
              f"{STEPS} wear steps {times[2]:6.2f} s  {times[3]:.0f} nodes, {times[4]:.4f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
