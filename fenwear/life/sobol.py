"""Sobol indices by OpenTURNS: which input the scatter of a result comes from.

S_i = Var E[y | x_i] / Var y is what of the variance x_i makes alone, ST_i = 1 - Var E[y | all but x_i] / Var y
with all its interactions (I. M. Sobol; A. Saltelli). The design of n (d + 2) points holds two independent
samples of n points first, which serve as a plain sample too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError

if TYPE_CHECKING:
    import openturns as ot

LEVEL = 0.95


@dataclass(frozen=True)
class SobolIndices:
    """Sobol indices of d inputs.

    Attributes:
        names: Of the inputs.
        first: S_i (d,).
        total: ST_i (d,).
        first_interval: Their 95 % intervals (d, 2).
        total_interval: The same of ST_i (d, 2).
    """

    names: tuple[str, ...]
    first: Array
    total: Array
    first_interval: Array
    total_interval: Array

    def rows(self) -> list[tuple[str, float, float, tuple[float, float], tuple[float, float]]]:
        """Return name, S_i, ST_i and both intervals of each input."""
        ends = [
            [(float(interval[k, 0]), float(interval[k, 1])) for k in range(len(self.names))]
            for interval in (self.first_interval, self.total_interval)
        ]
        return [
            (name, float(self.first[k]), float(self.total[k]), ends[0][k], ends[1][k])
            for k, name in enumerate(self.names)
        ]

    def as_json(self) -> list[dict[str, Any]]:
        """Return what --json prints."""
        return [
            {"name": name, "first": first, "first_interval_95": list(a), "total": total, "total_interval_95": list(b)}
            for name, first, total, a, b in self.rows()
        ]


def sobol_design(distribution: ot.Distribution, size: int, seed: int) -> Array:
    """Return the inputs (size (d + 2), d) of independent variables; for one variable a plain sample (size, 1).

    Raises:
        CaseError: the inputs are not independent.
    """
    import openturns as ot

    ot.RandomGenerator.SetSeed(seed)
    if distribution.getDimension() == 1:
        return np.array(distribution.getSample(size))
    if not distribution.hasIndependentCopula():
        raise CaseError(InputError("--sobol", "Sobol indices need inputs that are independent of each other"))
    return np.array(ot.SobolIndicesExperiment(distribution, size, False).generate())


def sobol_indices(names: tuple[str, ...], design: Array, outputs: Array, size: int, seed: int = 0) -> SobolIndices:
    """Return the indices of the outputs (size (d + 2),) at a design made by `sobol_design`.

    Raises:
        CaseError: the outputs do not vary, or are not finite.
    """
    import openturns as ot

    if not np.isfinite(outputs).all():
        raise CaseError(InputError("--sobol", "some results are not finite: Sobol indices need all of them"))
    if np.ptp(outputs) == 0:
        raise CaseError(InputError("--sobol", "all results are the same: nothing to share out"))
    ot.RandomGenerator.SetSeed(seed)
    centred = outputs - outputs.mean()
    found = ot.MartinezSensitivityAlgorithm(ot.Sample(design), ot.Sample(centred[:, None]), size)
    found.setUseAsymptoticDistribution(True)
    found.setConfidenceLevel(LEVEL)
    intervals = [found.getFirstOrderIndicesInterval(), found.getTotalOrderIndicesInterval()]
    ends = [np.array([list(i.getLowerBound()), list(i.getUpperBound())]).T for i in intervals]
    return SobolIndices(
        names, np.array(found.getFirstOrderIndices()), np.array(found.getTotalOrderIndices()), ends[0], ends[1]
    )
