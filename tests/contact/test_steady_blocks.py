"""The linear system of the cyclic steady state: in blocks, as one matrix, and by plain elimination."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from fenwear.algebra.submatrices import Dense, Indices
from fenwear.common.arrays import Array
from fenwear.contact import steady_blocks
from fenwear.contact.steady_blocks import ByShape, ShapeEquations

SEEDS = st.integers(0, 2**32 - 1)


def equations(m: int, n: int, random: np.random.Generator, *, heat: bool) -> ShapeEquations:
    """Compliances of a log kernel with friction to either side, in places that move; a translation and a tilt."""
    compliances, balances = [], []
    x = np.linspace(-1, 1, n)
    modes = np.stack([np.ones(n), x], axis=1)
    for k in range(m):
        place = x + 0.2 / n * k
        distance = np.subtract.outer(place, place)
        friction = 0.3 * np.sign(distance) * (-1) ** k
        compliances.append((np.log(8 / np.maximum(np.abs(distance), 0.5 / n)) + friction) / n)
        balances.append(modes.T / n + 0.1 * (-1) ** k / n)
    coupling = -0.2 * random.uniform(0, 1, (m * n, m * n)) / (m * n) if heat else None
    return ShapeEquations(compliances, modes, np.array(balances), coupling)


def free(of: ShapeEquations, random: np.random.Generator) -> tuple[Indices, Array]:
    """Which unknowns are free: most; and what holds the shape where none of the pressures is."""
    m, n, r = of.shape
    touching = random.uniform(size=(m, n)) < 0.8
    touching[:, n // 3 : n // 2] = True
    touching[:, :2] = False
    shaped = touching.any(axis=0)
    shaped[0] = True  # no phase touches
    shaped[3] = touching[0, 3] = False  # at its bound
    every = np.concatenate([touching.ravel(), shaped, np.ones(m * r, dtype=bool)])
    return np.flatnonzero(every).astype(np.int32), np.where(touching.any(axis=0), 0.0, 1e-3)


@given(SEEDS, st.sampled_from([1, 2, 3, 7]), st.booleans(), st.booleans())
def test_blocks_are_the_matrix(seed: int, m: int, heat: bool, local: bool) -> None:
    """Product and solution of the blocks are those of the matrix, whichever unknowns are free."""
    random = np.random.default_rng(seed)
    n = 30
    system = equations(m, n, random, heat=heat)
    wear = [
        np.diag(random.uniform(0.5, 1.5, n)) + (0 if local else random.uniform(0, 0.3, (n, n)) / n) for _ in range(m)
    ]
    kept, held = free(system, random)
    sparse = [csr_array(own) for own in wear]
    blocks, whole = ByShape(system, sparse, held), system.whole(sparse, held)
    matrix = whole.matrix
    x = random.uniform(-1, 1, system.size)
    np.testing.assert_allclose(blocks.multiply(x), matrix @ x, rtol=0, atol=1e-13 * np.abs(matrix).sum(axis=1).max())
    b = random.uniform(-1, 1, len(kept))
    own = matrix[np.ix_(kept, kept)]
    exact = np.linalg.solve(own, b)
    for operator in (blocks, whole):
        found = operator.factor(kept)(b)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


def test_iterations_do_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """The preconditioner is as near with 400 nodes as with 50, and for 2 phases as for 12."""
    random = np.random.default_rng(2)
    counts, products = list[int](), list[int]()
    multiply = steady_blocks._Reduced.multiply
    monkeypatch.setattr(steady_blocks._Reduced, "multiply", lambda self, y: (products.append(1), multiply(self, y))[1])
    for m, n in ((2, 50), (2, 400), (12, 50)):
        system = equations(m, n, random, heat=False)
        kept, held = free(system, random)
        blocks = ByShape(system, [csr_array(np.eye(n))] * m, held)
        products.clear()
        blocks.factor(kept)(random.uniform(-1, 1, len(kept)))
        counts.append(len(products))
    assert max(counts) < 27


def test_where_iterations_fail_the_matrix_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """GMRES of one iteration cannot do it; and a singular phase is told either way."""
    random = np.random.default_rng(4)
    system = equations(3, 20, random, heat=False)
    kept, held = free(system, random)
    wear = [csr_array(np.eye(20))] * 3
    b = random.uniform(-1, 1, len(kept))
    exact = system.whole(wear, held).factor(kept)(b)
    monkeypatch.setattr("fenwear.algebra.krylov.RESTART", 1)
    monkeypatch.setattr("fenwear.algebra.krylov.RESTARTS", 1)
    np.testing.assert_allclose(ByShape(system, wear, held).factor(kept)(b), exact, rtol=1e-9)
    nothing = ShapeEquations([np.zeros((20, 20))] * 3, system.modes, system.balances)
    with pytest.raises(np.linalg.LinAlgError):
        ByShape(nothing, wear, held).factor(kept)(b)


def test_heat_keeps_the_factors() -> None:
    """Another coupling by heat changes no phase by itself; and how many unknowns there are decides the way."""
    random = np.random.default_rng(6)
    system = equations(2, 20, random, heat=False)
    phases = system.phases
    assert system.with_heat(np.zeros((40, 40))).phases is phases
    wear = [csr_array(np.eye(20))] * 2
    assert isinstance(system.derivative(wear, np.zeros(20)), Dense)
    many = equations(2, steady_blocks.WHOLE // 3 + 1, random, heat=False)
    assert isinstance(many.derivative(wear, np.zeros(20)), ByShape)
