"""The temperature of a body at rest on its modes.

Of material at rest capacity M and conductivity K are symmetric, so that on a small basis both are diagonal at once:
theta_k' = -lambda_k theta_k + b_k, and steps of any length need a factor for each mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array

from fenwear.arrays import Array
from fenwear.heat.conduction import HeatStep
from fenwear.heat.field import Propagation, ReducedBasis, ReducedField
from fenwear.parallel import total


def modal_basis(basis: ReducedBasis, step: HeatStep, duration: float) -> tuple[ReducedBasis, Array]:
    """Return the basis on which a step of material at rest is diagonal, and the rates lambda (dim,), 1/s; collective.

    Args:
        basis: Orthonormal in the heat capacity.
        step: A step of the body, not moving.
        duration: Its duration, s.
    """
    projected = total(basis.body.body.mesh.comm, basis.columns.T @ step.apply(basis.columns)[0])
    values, vectors = np.linalg.eigh((projected + projected.T) / 2)
    modes = ReducedBasis(basis.body, basis.lift, np.asarray(basis.columns @ vectors))
    return modes, np.maximum(values - 1 / duration, 0.0)


class ModalField(ReducedField):
    """The reduced temperature of a body at rest on its modes: each step is a factor for each of them."""

    def __init__(
        self,
        steps: Sequence[HeatStep],
        inflow: csc_array,
        basis: ReducedBasis,
        contact_responses: Sequence[Array] | None = None,
    ) -> None:
        """Project the steps; collective.

        Args:
            steps: Of the body, of different durations.
            inflow: Loads of unit fluxes (owned, n), mm.
            basis: Of `modal_basis`.
            contact_responses: See `ReducedField`.
        """
        super().__init__(steps, inflow, basis, contact_responses)
        self._decays = [np.diag(one).copy() for one in self._propagators]

    def propagation(self, step: int) -> Propagation:
        """Return the step that lets each mode decay."""
        return replace(super().propagation(step), decay=self._decays[step])
