"""Twin experiments in full: how often 95 % intervals hold the truth, and how long that takes.

python3 tests/benchmarks/calibration.py [REPETITIONS]        (200; mpirun -n 2 shares them out)

Data are made by the model itself with normal noise of 0.2 um, from profiles of a punch that translates, and
fitted anew in every repetition: the wear coefficient from one profile, then coefficient, exponent and
friction from profiles at two loads.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from mpi4py import MPI
from scipy import stats

from fenwear import load_case
from fenwear.life import DataSet, LeastSquares, Series, Unknown, repeated

SMALL = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8"]
KEYS = ("wear.punch.coefficient", "wear.punch.pressure_exponent", "contact.friction")
CYCLES, SIGMA, PLACES = 200, 2e-4, 61


def plan(load: float) -> DataSet:
    """Return a profile to be measured under a load, N."""
    x = np.linspace(-30, 30, PLACES)
    series = Series("depth", "punch", x, np.full(PLACES, float(CYCLES)), "cycles", np.zeros(PLACES),
                    np.full(PLACES, SIGMA), tuple(range(PLACES)))  # fmt: skip
    return DataSet(f"{load:g} N", (f"punch.loads.0.force=[0.0, {-load!r}]",), (series,))


def main() -> None:
    """Print coverage and time for one and for three unknowns."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    chance = stats.binom(repetitions, 0.95)
    for keys, loads in ((KEYS[:1], (10e3,)), (KEYS, (10e3, 40e3))):
        begin = time.perf_counter()
        problem = LeastSquares(load_case("example2", SMALL), [plan(load) for load in loads], [Unknown(k) for k in keys])
        deviations, errors = repeated(problem, [0.0] * len(keys), repetitions)
        seconds = time.perf_counter() - begin
        if MPI.COMM_WORLD.rank:
            continue
        held = (np.abs(deviations) <= stats.norm.ppf(0.975) * errors).sum(axis=0)
        print(f"{len(keys)} unknown(s), {repetitions} repetitions, {seconds:.0f} s; chance allows "
              f"{chance.ppf(0.005):.0f} to {chance.ppf(0.995):.0f}")  # fmt: skip
        for k, key in enumerate(keys):
            print(f"  {key:32} held {held[k]:4}, spread over stated error {(deviations / errors)[:, k].std():.3f}, "
                  f"stated error {100 * errors[:, k].mean():.2f} %")  # fmt: skip


if __name__ == "__main__":
    main()
