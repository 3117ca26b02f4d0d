"""The limit of explicit steps of wear on full contact."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.contact import CondensedContact, SlidingContact
from fenwear.contact.operators import Solve

PRODUCTS = 200  # after which the fastest modes are what is left: of two brake shoes 1.3 % above the fastest


def stability_number(system: Tribosystem) -> float:
    """Return the wear step over its explicit limit: above 1 an explicit run oscillates and diverges; collective.

    On closed contact an opened gap lowers the pressure by P, the leading block of the inverse of
    [[S, H], [E, 0]], and the pressure of a phase opens the gap by its wear by W: beta~ S b p^(b-1) of both
    bodies at the mean pressure, the strip's put on its nodes and read there. An explicit step multiplies an
    error of the shape by I - W P: stable while the largest eigenvalue of W P is below 2, in each direction in
    the phase that wears most.
    """
    ratios, largest = system.friction_ratios(), 0.0
    for phase, opened in system.team.lead(partial(_most_worn, system)):
        interface = system.interfaces[phase]
        contact = CondensedContact([SlidingContact(interface, ratios[phase])], team=system.team)
        worn = csr_array(opened / interface.elastic_length)  # as the contact is scaled
        largest = max(largest, contact.on_closed_contact(partial(_worn_response, worn, contact.size)))
    return largest / 2


def _most_worn(system: Tribosystem) -> list[tuple[int, csr_array]]:
    """Return of each direction the phase that wears most, if any does, and its S b p^(b-1), on the strip's nodes."""
    n = len(system.rigid.rigid_normal)
    uniform = np.full((len(system.motion.phases), n), system.rigid.mean_pressure)
    wear = system.phases_wear
    slopes = sum((body.slope(uniform) for body in (wear.punch, wear.strip) if body is not None), np.zeros_like(uniform))
    directions, most = np.array(system.motion.directions), slopes.max(axis=1)
    phases = [int(np.argmax(np.where(directions == d, most, -1.0))) for d in np.unique(directions)]
    opened = [system.wear.phases([system.conditions(k)], [k]).slopes(uniform[k : k + 1])[0] for k in phases]
    return [(k, slope) for k, slope in zip(phases, opened, strict=True) if slope.data.any()]


def _worn_response(worn: csr_array, size: int, solve: Solve) -> float:
    """Return the largest eigenvalue of W P: the gap (n,) worn open by the pressure that a gap takes away."""
    n = worn.shape[0]

    def apply(gap: Array) -> Array:
        right = np.zeros(size)
        right[:n] = gap.ravel()
        return np.asarray(worn @ solve(right)[:n])

    start = np.where(np.arange(n) % 2, 1.0, -1.0)  # the fastest mode alternates from node to node
    operator = LinearOperator((n, n), matvec=apply, dtype=float)
    try:
        found = eigs(operator, k=1, v0=start, return_eigenvectors=False, tol=1e-4)
    except ArpackNoConvergence:  # modes that lie together, as those of two shoes that are alike, are not told apart
        return _growth(apply, start)
    return float(np.abs(found).max())


def _growth(apply: Callable[[Array], Array], vector: Array) -> float:
    """Return by how much a vector grows with each product in the end, of whichever modes it is made."""
    size = 0.0
    for _ in range(PRODUCTS):
        vector = apply(vector)
        size = float(np.linalg.norm(vector))
        vector = np.asarray(vector / size, dtype=float)
    return size
