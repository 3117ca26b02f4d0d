"""The temperature of a strip that passes under the punch to and fro or through a cycle, in its own frame.

Its mesh is fixed to its material, its ends move with it, and the source moves over it (see `fenwear.heat.passage`):
no velocity is in its equation, so that capacity M and conductivity K are symmetric. All of its contact surface
convects in K. Under the contact what convects is given back by the flux, with the temperature theta_c = C theta of the
same step: with C the transfer of a step's places, W the nodes' areas and A = M / dt + K,

    (A - h C^T W C) theta = B theta_before + f - h C^T W theta_a + C^T W q,

which Woodbury's formula solves with A alone, the same for all places. On its modes A is diagonal, see
`fenwear.heat.modal`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array, diags_array

from fenwear.arrays import Array
from fenwear.heat.field import FullField, Functional, Propagation, ReducedField


class ReciprocatingField:
    """The temperature of a strip in its own frame, over the steps of a motion.

    Attributes:
        contacts: Temperature at the interface nodes over the places of each step (n,), K.
        given_back: What of the convection is given back, for each kelvin of this rank's nodes in each step (k, owned).
    """

    def __init__(
        self,
        inner: FullField | ReducedField,
        nodes: csr_array,
        transfers: Sequence[csr_array],
        kinds: Sequence[int],
        weights: Array,
        convection: float,
        ambient: float,
    ) -> None:
        """Bring the contact to the places of each step; collective.

        Args:
            inner: The strip without the contact, its steps and its responses to unit loads at q trace nodes.
            nodes: Temperature at these trace nodes (q, owned).
            transfers: From them to the interface nodes in each step (n, q).
            kinds: Which step of the inner field each takes.
            weights: Areas of the interface nodes (n,).
            convection: h, mW/(mm² K).
            ambient: theta_a, K.
        """
        self.inner, self.basis, self._ambient, self._convection = inner, inner.basis, ambient, convection
        at_nodes = inner.observe(nodes)
        self._at_nodes, self._kinds = at_nodes, kinds
        self.contacts = [at_nodes.through(transfer) for transfer in transfers]
        self._loads = [csr_array(transfer.T @ diags_array(weights)) for transfer in transfers]
        self.responses: Sequence[Array] = []
        self._returns: list[Array] = []
        found, corrected = [], []
        for contact, load, transfer, kind in zip(self.contacts, self._loads, transfers, kinds, strict=True):
            response = np.asarray(inner.responses[kind] @ load)
            warms = contact.of_changes(response)
            back = np.linalg.inv(np.eye(len(weights)) - convection * warms)
            found.append(response @ back)
            self._returns.append(convection * found[-1])
            if inner.contact_responses is not None:
                exact = inner.contact_responses[kind]
                corrected.append(back @ warms + np.asarray(transfer @ (exact @ load)) - warms)
        self.responses = found
        self.contact_responses: Sequence[Array] | None = None if inner.contact_responses is None else corrected
        self.given_back = np.array([convection * (nodes.T @ load.sum(axis=1)) for load in self._loads])

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Return what a step without flux through the contact, but for what is given back, makes of coordinates."""
        free = self.inner.advance(self._kinds[step], coordinates, sources=sources)
        contact = self.contacts[step]
        above = contact(free) - self._ambient if sources else contact.of_changes(free)
        return np.asarray(free + self._returns[step] @ above)

    def propagation(self, step: int) -> Propagation | None:
        """Return the step over its places; None on the nodes of a mesh."""
        inner = self.inner.propagation(self._kinds[step])
        return inner and replace(inner, response=self.responses[step], given_back=self._convection)

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional; collective."""
        return self.inner.observe(rows)

    def reading(self, transfer: csr_array) -> Functional:
        """Return the temperature at the interface nodes at a place of the contact, given by its transfer (n, q)."""
        return self._at_nodes.through(transfer)

    def left_out(self, transfer: csr_array, step: int) -> Array | None:
        """Return what a unit flux of a step adds to such a reading beside the coordinates (n, n); None for nothing."""
        if self.inner.contact_responses is None:
            return None
        load, kind = self._loads[step], self._kinds[step]
        known = self.reading(transfer).of_changes(np.asarray(self.inner.responses[kind] @ load))
        return np.asarray(transfer @ (self.inner.contact_responses[kind] @ load)) - known
