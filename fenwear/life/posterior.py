"""The posterior distribution of a calibration by sampling (emcee): flat within the bounds, noise as it was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.life.calibrate import Calibration
from fenwear.life.least_squares import LeastSquares

WALKERS_EACH = 4  # walkers for each variable; emcee wants two at least


@dataclass(frozen=True)
class Posterior:
    """A sample of the posterior.

    Attributes:
        keys: The unknowns.
        values: In their internal units (n, m).
        acceptance: Mean share of accepted steps.
    """

    keys: tuple[str, ...]
    values: Array
    acceptance: float

    def text(self) -> str:
        """Return a table for people."""
        lines = [f"  posterior of {len(self.values)} samples, acceptance {self.acceptance:.2f}"]
        for key, column in zip(self.keys, self.values.T, strict=True):
            low, middle, high = np.quantile(column, [0.025, 0.5, 0.975])
            lines.append(f"  {key:36} {middle:13.6g} {column.std():11.3g} {low:13.5g} {high:13.5g}")
        return "\n".join(lines)


def posterior(problem: LeastSquares, found: Calibration, steps: int, seed: int = 0) -> Posterior:
    """Sample the posterior around a calibration's result; a run for each walker and step.

    The logarithm is sampled of what was fitted by its logarithm: its prior is flat in the logarithm.

    Args:
        problem: What was fitted.
        found: The result.
        steps: Of each walker; the first third is left out.
        seed: Of the walkers.

    Raises:
        CaseError: emcee is not installed, or too few steps.
    """
    if find_spec("emcee") is None:
        raise CaseError(InputError("--posterior", "needs the package emcee: on Debian, install python3-emcee"))
    if steps < 10:
        raise CaseError(InputError("--posterior", f"expected 10 steps or more, got {steps}"))
    z = [one.fitted(value) for one, value in zip(problem.unknowns, found.values.values(), strict=True)]
    problem.correlated = found.correlated
    problem.keep_jumps(z)
    minimizer = problem.minimizer(start=z)
    variables = len(minimizer.params) + (0 if problem.absolute else 1)
    walkers = max(2 * variables, WALKERS_EACH * variables)
    state = np.random.RandomState(seed)
    start = _start(problem, found, z, walkers, state)
    result = minimizer.emcee(
        steps=steps, burn=steps // 3, nwalkers=walkers, pos=start, seed=state, progress=False,
        is_weighted=problem.absolute, run_mcmc_kwargs={"skip_initial_state_check": True},
    )  # fmt: skip
    chain = np.array(result.flatchain)[:, : len(z)]
    values = np.array([[one.value(part) for one, part in zip(problem.unknowns, row, strict=True)] for row in chain])
    return Posterior(tuple(found.values), values, float(np.mean(result.acceptance_fraction)))


def _start(
    problem: LeastSquares,
    found: Calibration,
    z: Sequence[float],
    walkers: int,
    state: np.random.RandomState,
) -> Array:
    """Return where the walkers start: around the result, as wide as its errors."""
    m, baselines = len(z), len(problem.baseline_names)
    scales = np.array([1.0 if one.logarithmic else one.scale for one in problem.unknowns])
    errors = np.sqrt(np.diag(found.covariance)) / scales
    errors = np.where(np.isfinite(errors), errors, 0.01)
    middles = np.concatenate([z, [part for t in found.traces for part in (t.offset, t.tilt) if np.isfinite(part)]])
    widths = np.concatenate([errors, np.full(baselines, 0.1 * found.noise)])
    if not problem.absolute:
        middles, widths = np.append(middles, np.log(found.noise)), np.append(widths, 0.1)
    start = middles + widths * state.standard_normal((walkers, len(middles)))
    for k, one in enumerate(problem.unknowns):
        low, high = (one.fitted(b) if np.isfinite(b) else b for b in (one.unknown.low, one.unknown.high))
        start[:, k] = np.clip(start[:, k], low, high)
    return start[:, : m + baselines + (0 if problem.absolute else 1)]
