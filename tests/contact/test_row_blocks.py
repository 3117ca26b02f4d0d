"""Phases of many nodes by products and iterations: against their matrix."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.contact import phase_rows
from fenwear.contact.phase_rows import SomeNodes
from fenwear.contact.row_blocks import SpreadPhases
from fenwear.contact.spread_shape import SpreadShape
from fenwear.contact.worn_shape import ShapeEquations
from fenwear.interface import Interface

SEEDS = st.integers(0, 2**32 - 1)


def equations(m: int, n: int) -> tuple[SpreadShape, ShapeEquations]:
    """A log kernel with friction to either side, in two places of the strip: by products, and as matrices."""
    x = np.linspace(-1, 1, n)
    modes, weights = np.stack([np.ones(n), x], axis=1), np.full(n, 2 / n)
    pair = SimpleNamespace(normal=np.stack([np.zeros(n), np.ones(n)], axis=1), weights=weights)
    places = []
    for shift in (0.0, 0.3 / n):
        distance = np.subtract.outer(x * (1 + shift), x * (1 + shift))
        normal = np.log(8 / np.maximum(np.abs(distance), 0.5 / n))
        numbers = SomeNodes(np.stack([np.sign(distance), normal], axis=2)[:, None])
        places.append(SimpleNamespace(apply=numbers.apply, entries=numbers.entries, pair=pair, rows=None))
    interfaces = [cast(Interface, places[k % 2]) for k in range(m)]
    ratios = [np.stack([np.full(n, 0.3 * (-1) ** (k // 2)), np.zeros(n)], axis=1) for k in range(m)]
    balances = np.array([modes.T / n + 0.1 * (-1) ** k / n for k in range(m)])
    traction = [(pair.normal + ratio) * weights[:, None] for ratio in ratios]
    every = slice(None)
    whole = [
        np.einsum("ijd,jd->ij", own.entries(every, every)[:, 0], t) for own, t in zip(interfaces, traction, strict=True)
    ]
    return SpreadShape(SpreadPhases(interfaces, ratios, 1.0), modes, balances), ShapeEquations(whole, modes, balances)


@given(SEEDS, st.sampled_from([1, 2, 5]), st.booleans())
def test_is_the_matrix(seed: int, m: int, local: bool) -> None:
    """Product and solution, whichever nodes touch, with runs of some nodes."""
    random = np.random.default_rng(seed)
    n = 40
    spread, dense = equations(m, n)
    wear = [
        csr_array(np.diag(random.uniform(0.5, 1.5, n)) + (0 if local else random.uniform(0, 0.3, (n, n)) / n))
        for _ in range(m)
    ]
    touching = random.uniform(size=(m, n)) < random.uniform(0, 1)
    touching[:, n // 3 : n // 2] = True
    shaped = touching.any(axis=0)
    shaped[0] = True
    kept = np.flatnonzero(np.concatenate([touching.ravel(), shaped, np.ones(2 * m, dtype=bool)])).astype(np.int32)
    held = np.where(touching.any(axis=0), 0.0, 1e-3)
    matrix = dense.whole(wear, held).matrix
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(phase_rows, "RUN", 7 * (m + 1))
        operator = spread.derivative(wear, held)
        x, b = random.uniform(-1, 1, spread.size), random.uniform(-1, 1, len(kept))

        def led() -> tuple[Array, Array]:
            return operator.multiply(x), operator.factor(kept)(b)

        product, found = spread.phases.team.lead(led)
    np.testing.assert_allclose(product, matrix @ x, rtol=0, atol=1e-13 * np.abs(matrix).sum(axis=1).max())
    exact = np.linalg.solve(matrix[np.ix_(kept, kept)], b)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert 0 < operator.iterations < len(kept)


def test_iterations_hardly_grow() -> None:
    """Four times the nodes in as many runs take about as many iterations."""
    counts = []
    for n in (200, 800):
        spread, _ = equations(2, n)
        operator = spread.derivative([csr_array(np.eye(n))] * 2, np.zeros(n))
        every = np.arange(spread.size, dtype=np.int32)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(phase_rows, "RUN", 3 * n // 4)
            spread.phases.team.lead(lambda: operator.factor(every)(np.ones(spread.size)))  # noqa: B023
        counts.append(operator.iterations)
    assert counts[1] < 1.5 * counts[0] < 50


def test_what_is_singular_is_told() -> None:
    """Shapes that no wear holds; and iterations that may not go on."""
    spread, _ = equations(2, 40)
    every, b = np.arange(spread.size, dtype=np.int32), np.ones(spread.size)
    unworn = spread.derivative([csr_array((40, 40))] * 2, np.zeros(40))
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        spread.phases.team.lead(lambda: unworn.factor(every))
    worn = spread.derivative([csr_array(np.eye(40))] * 2, np.zeros(40))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(phase_rows, "RUN", 9)
        patch.setattr("fenwear.contact.krylov.RESTART", 1)
        patch.setattr("fenwear.contact.krylov.RESTARTS", 1)
        with pytest.raises(np.linalg.LinAlgError, match="did not converge"):
            spread.phases.team.lead(lambda: worn.factor(every)(b))
