"""Twin experiments in full: how often 95 % intervals hold the truth, and how long that takes.

python3 tests/benchmarks/calibration.py [REPETITIONS]        (200; mpirun -n 2 shares out the first two)

Data are made by the model itself, of a punch that translates, and fitted anew in every repetition:

- with normal noise of 0.2 um that is known: the wear coefficient from one profile, then coefficient, exponent and
  friction from profiles at two loads;
- with errors whose size the calibration has to find, and whose kind the series names: the wear coefficient from
  volumes and from a profile, with independent readings, with scatter that adds up from one volume to the next, and with
  roughness, whose neighbours have a correlation of 0.9.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from mpi4py import MPI
from scipy import stats

from fenwear import load_case
from fenwear.common.arrays import Array
from fenwear.studies import DataSet, LeastSquares, Noise, Series, Unknown, calibrate

SMALL = ["geometry.degree=2", "geometry.parameters.elements_along_contact=8"]
KEYS = ("wear.punch.coefficient", "wear.punch.pressure_exponent", "contact.friction")
CYCLES, SIGMA, PLACES, VOLUMES = 200, 2e-4, 61, 20


def repeated(problem: LeastSquares, repetitions: int) -> tuple[Array, Array]:
    """Return deviations from the truth and standard errors (repetitions, m) of fits to data with known noise.

    The truth is where the unknowns are now; each fit starts there and keeps the Jacobian there, whose change is of
    second order in the noise.
    """
    generator, m = np.random.default_rng(0), len(problem.unknowns)
    truth = [0.0] * m
    problem.keep_jumps(truth)
    exact, jacobian = problem.predicted(truth), problem.jacobian(truth)
    colour = np.linalg.inv(problem.whitened(np.eye(len(exact))))
    noise = generator.standard_normal((repetitions, len(exact))) @ colour.T

    def one(k: int) -> tuple[Array, Array]:
        problem.observed = exact + noise[k]
        result = problem.fit(truth)
        return result.x[:m], np.sqrt(np.diag(np.linalg.inv(result.jac.T @ result.jac))[:m])

    with patch.object(problem, "jacobian", return_value=jacobian):
        found = [one(k) for k in range(repetitions)]
    return np.array([value for value, _ in found]), np.array([error for _, error in found])


def plan(load: float) -> DataSet:
    """Return a profile to be measured under a load, N."""
    x = np.linspace(-30, 30, PLACES)
    series = Series("depth", "punch", x, np.full(PLACES, float(CYCLES)), "cycles", np.zeros(PLACES),
                    np.full(PLACES, SIGMA), tuple(range(PLACES)))  # fmt: skip
    return DataSet(f"{load:g} N", (f"punch.loads.0.force=[0.0, {-load!r}]",), (series,))


def independent(draw: np.random.Generator, count: int) -> Array:
    """Return errors of reading (count,)."""
    return draw.standard_normal(count)


def added_up(draw: np.random.Generator, count: int) -> Array:
    """Return errors that add up from one measurement to the next (count,)."""
    return draw.standard_normal(count).cumsum()


def rough(draw: np.random.Generator, count: int) -> Array:
    """Return a first-order autoregressive sequence (count,) with a correlation of 0.9 of neighbours."""
    found = draw.standard_normal(count)
    for k in range(1, count):
        found[k] = 0.9 * found[k - 1] + np.sqrt(1 - 0.9**2) * found[k]
    return found


def profile() -> Series:
    """Return the profile of `plan`, of errors that are not known."""
    return replace(plan(10e3).series[0], sigma=None)


def volumes() -> Series:
    """Return volumes after equal numbers of cycles."""
    after = np.linspace(0, CYCLES, VOLUMES + 1)[1:]
    return Series("volume", "punch", None, after, "cycles", np.zeros(VOLUMES), None, tuple(range(VOLUMES)))


def told(repetitions: int) -> None:
    """Print how often intervals hold where the calibration finds the errors' size itself."""
    kinds: tuple[tuple[str, Callable[[], Series], Callable[[np.random.Generator, int], Array], float, Noise], ...] = (
        ("volumes, independent readings", volumes, independent, 1e-2, Noise("independent")),
        ("volumes, scatter that adds up", volumes, added_up, 1e-3, Noise("adds up")),
        ("profile, independent readings", profile, independent, 1e-2, Noise("independent")),
        ("profile, rough", profile, rough, 1e-2, Noise("alike", -1 / np.log(0.9))),
    )
    case = load_case("example2", SMALL)
    chance = stats.binom(repetitions, 0.95)
    rank, truth = MPI.COMM_WORLD.rank, case.wear.punch.coefficient
    if not rank:
        print(
            f"errors found, {repetitions} repetitions; chance allows {chance.ppf(0.005):.0f} to {chance.ppf(0.995):.0f}"
        )
    for name, make, errors, size, noise in kinds:
        series, settings = replace(make(), noise=noise), plan(10e3).settings
        exact = LeastSquares(case, [DataSet(name, settings, (series,))], [Unknown(KEYS[0])]).predicted([0.0])
        draw, begin = np.random.default_rng(5), time.perf_counter()
        held, deviations, widths = 0, [], []
        for _ in range(repetitions):
            values = exact + size * np.abs(exact).max() * errors(draw, len(exact))
            (found,) = calibrate(case, [DataSet(name, settings, (replace(series, values=values),))], KEYS[:1]).fitted
            held += found.low <= truth <= found.high
            deviations.append((found.value - truth) / truth)
            widths.append(found.standard_error / truth)
        if not rank:
            print(f"  {name:32} held {held:4}, spread {100 * np.std(deviations):.2f} %, stated error "
              f"{100 * np.mean(widths):.2f} %, {time.perf_counter() - begin:.0f} s")  # fmt: skip


def main() -> None:
    """Print coverage and time for one and for three unknowns of known errors, and of errors to be found."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    chance = stats.binom(repetitions, 0.95)
    for keys, loads in ((KEYS[:1], (10e3,)), (KEYS, (10e3, 40e3))):
        begin = time.perf_counter()
        problem = LeastSquares(load_case("example2", SMALL), [plan(load) for load in loads], [Unknown(k) for k in keys])
        deviations, errors = repeated(problem, repetitions)
        seconds = time.perf_counter() - begin
        if MPI.COMM_WORLD.rank:
            continue
        held = (np.abs(deviations) <= stats.norm.ppf(0.975) * errors).sum(axis=0)
        print(f"{len(keys)} unknown(s), {repetitions} repetitions, {seconds:.0f} s; chance allows "
              f"{chance.ppf(0.005):.0f} to {chance.ppf(0.995):.0f}")  # fmt: skip
        for k, key in enumerate(keys):
            print(f"  {key:32} held {held[k]:4}, spread over stated error {(deviations / errors)[:, k].std():.3f}, "
                  f"stated error {100 * errors[:, k].mean():.2f} %")  # fmt: skip
    told(repetitions)


if __name__ == "__main__":
    main()
