"""A body at rest on its modes: the same temperatures as on any other basis of the same fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fenwear.heat.temperature import ReducedBasis, ReducedField, modal_basis

DURATION = 0.05


def test_modes_are_the_dense_steps(assembled: Callable[..., Any]) -> None:
    """A few steps with sources and fluxes end at the temperatures of Galerkin's projection, mode by mode decayed."""
    body = assembled("example1-heat", "geometry.degree=2", "heat.steps=3", "heat.ambient=35").bodies.heat[0]
    step = body.step(0.0, DURATION)
    random = np.random.default_rng(1)
    loads = csc_array(np.maximum(random.normal(size=(body.owned, 3)), 0.0))
    fields, _ = np.linalg.qr(step.respond(random.normal(size=(body.owned, 12))))
    basis = ReducedBasis(body, body.initial(), np.asarray(fields))
    modes, rates = modal_basis(orthonormal(basis), step, DURATION)
    dense, modal = ReducedField([step], loads, orthonormal(basis)), ReducedField([step], loads, modes, modal=True)
    assert (rates >= 0).all()
    ends = []
    for field in (dense, modal):
        at = field.basis.coordinates(body.initial() + fields.sum(axis=1))
        for _ in range(3):
            at = field.advance(0, at) + field.responses[0] @ np.ones(3)
        ends.append(field.basis.temperature(at))
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-10 * np.abs(ends[0]).max())


def orthonormal(basis: ReducedBasis) -> ReducedBasis:
    """Return the basis orthonormal in the heat capacity."""
    gram = basis.columns.T @ np.column_stack([basis.body.store(one) for one in basis.columns.T])
    columns = np.linalg.solve(np.linalg.cholesky(gram), basis.columns.T).T
    return ReducedBasis(basis.body, basis.lift, columns)
