"""The temperature of a strip that passes under the punch to and fro, in its own frame.

Its mesh is fixed to its material, its ends move with it, and the source moves over it (see `fenwear.heat.passage`):
no velocity is in its equation, so that capacity M and conductivity K are symmetric. All of its contact surface
convects in K. Under the contact what convects is given back by the flux, with the temperature theta_c = C theta of the
same step: with C the transfer of a step's places, W the nodes' areas and A = M / dt + K,

    (A - h C^T W C) theta = B theta_before + f - h C^T W theta_a + C^T W q,

which Woodbury's formula solves with A alone, the same for all places. On a small basis A is diagonal, as M and K are
symmetric: theta_k' = -lambda_k theta_k + b_k, and steps of any length need a division for each mode.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from fenwear.arrays import Array
from fenwear.heat.conduction import HeatStep
from fenwear.heat.field import FullField, Functional, ReducedBasis, ReducedField
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
    """The reduced temperature of a body at rest on its modes: one step, which is a factor for each."""

    def __init__(
        self,
        step: HeatStep,
        inflow: csc_array,
        basis: ReducedBasis,
        contact_responses: Sequence[Array] | None = None,
    ) -> None:
        """Project the step; collective.

        Args:
            step: Of the body.
            inflow: Loads of unit fluxes (owned, n), mm.
            basis: Of `modal_basis`.
            contact_responses: See `ReducedField`.
        """
        super().__init__([step], inflow, basis, contact_responses)
        self._decay = np.diag(self._propagators[0]).copy()

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Let each mode decay."""
        moved: Array = (self._decay * coordinates.T).T
        return moved + self._sources[step] if sources else moved


class PassingField:
    """The temperature of a strip in its own frame, over the steps of a motion to and fro.

    Attributes:
        contacts: Temperature at the interface nodes over the places of each step (n,), K.
        given_back: What of the convection is given back, for each kelvin of this rank's nodes in each step (k, owned).
    """

    def __init__(
        self,
        inner: FullField | ReducedField,
        nodes: csr_array,
        transfers: Sequence[csr_array],
        weights: Array,
        convection: float,
        ambient: float,
    ) -> None:
        """Bring the contact to the places of each step; collective.

        Args:
            inner: The strip without the contact, its only step and its responses to unit loads at q trace nodes.
            nodes: Temperature at these trace nodes (q, owned).
            transfers: From them to the interface nodes in each step (n, q).
            weights: Areas of the interface nodes (n,).
            convection: h, mW/(mm² K).
            ambient: theta_a, K.
        """
        self.inner, self.basis, self._ambient = inner, inner.basis, ambient
        at_nodes = inner.observe(nodes)
        exact = None if inner.contact_responses is None else inner.contact_responses[0]
        self._at_nodes, self._exact = at_nodes, exact
        self.contacts = [at_nodes.through(transfer) for transfer in transfers]
        self._loads = [csr_array(transfer.T @ diags_array(weights)) for transfer in transfers]
        self.responses: Sequence[Array] = []
        self.contact_responses: Sequence[Array] | None = None if exact is None else []
        self._returns: list[Array] = []
        found, corrected = [], []
        for contact, load, transfer in zip(self.contacts, self._loads, transfers, strict=True):
            response = np.asarray(inner.responses[0] @ load)
            warms = contact.of_changes(response)
            back = np.linalg.inv(np.eye(len(weights)) - convection * warms)
            found.append(response @ back)
            self._returns.append(convection * found[-1])
            if exact is not None:
                corrected.append(back @ warms + np.asarray(transfer @ (exact @ load)) - warms)
        self.responses = found
        if exact is not None:
            self.contact_responses = corrected
        self.given_back = np.array([convection * (nodes.T @ load.sum(axis=1)) for load in self._loads])

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Return what a step without flux through the contact, but for what is given back, makes of coordinates."""
        free = self.inner.advance(0, coordinates, sources=sources)
        contact = self.contacts[step]
        above = contact(free) - self._ambient if sources else contact.of_changes(free)
        return np.asarray(free + self._returns[step] @ above)

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional; collective."""
        return self.inner.observe(rows)

    def reading(self, transfer: csr_array) -> Functional:
        """Return the temperature at the interface nodes at a place of the contact, given by its transfer (n, q)."""
        return self._at_nodes.through(transfer)

    def left_out(self, transfer: csr_array, step: int) -> Array | None:
        """Return what a unit flux of a step adds to such a reading beside the coordinates (n, n); None for nothing."""
        if self._exact is None:
            return None
        load = self._loads[step]
        known = self.reading(transfer).of_changes(np.asarray(self.inner.responses[0] @ load))
        return np.asarray(transfer @ (self._exact @ load)) - known
