"""The limit of explicit wear steps: how far a run is from it."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import LinearOperator, eigs

from fenwear.inequality import Array
from fenwear.system import System


def stability_number(system: System) -> float:
    """Return the wear step over its explicit limit: above 1 an explicit run oscillates and diverges; collective.

    On closed contact a worn depth lowers the pressure by P = (I - H-part) S^-1, the leading block of
    the inverse of [[S, H], [E, 0]]. An explicit half-cycle multiplies an error of the shape by
    I - K P with K = beta~ S b p^(b-1) at the mean pressure: stable while K times the largest
    eigenvalue of P is below 2.
    """
    statics, friction = system.statics, system.case.contact.friction
    n, r = statics.rigid_normal.shape
    law, mean = system.case.wear.punch, statics.mean_pressure
    stiffness = system.wear.per_power * law.pressure_exponent * mean ** (law.pressure_exponent - 1)
    scale = system.interface.elastic_length
    largest = 0.0
    for d in system.motion.directions:
        matrix = np.zeros((n + r, n + r))
        matrix[:n, :n] = system.interface.compliance(d, friction) / scale
        matrix[:n, n:] = statics.rigid_normal
        matrix[n:, :n] = statics.equilibrium(d, friction)
        factor = scipy.linalg.lu_factor(matrix)

        def respond(shape: Array, factor: tuple[Array, Array] = factor) -> Array:
            return scipy.linalg.lu_solve(factor, np.concatenate([shape.ravel(), np.zeros(r)]))[:n]

        operator = LinearOperator((n, n), matvec=respond, dtype=float)
        start = np.where(np.arange(n) % 2, 1.0, -1.0)  # the fastest mode alternates from node to node
        values = eigs(operator, k=1, v0=start, return_eigenvectors=False, tol=1e-4)
        largest = max(largest, float(np.abs(values).max()) / scale)
    return stiffness * largest / 2
