"""Inequalities over operators: against every set tried in turn, and factors against plain elimination."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fenwear import ConvergenceError, Tribosystem, jump, march, steady
from fenwear.algebra.submatrices import Blocks, Dense, Updating, dense_matrix, joined
from fenwear.common.arrays import Array
from fenwear.contact.inequality import Inequality

SEEDS = st.integers(0, 2**32 - 1)


def compliance(n: int, friction: float, seed: int) -> tuple[Array, Array]:
    """A compliance of nodes at random places, a log kernel with friction's odd part; and a gap of both signs."""
    random = np.random.default_rng(seed)
    x = np.cumsum(random.uniform(0.5, 1.5, n))
    distance = x[:, None] - x
    matrix = np.log(4 * n / np.maximum(np.abs(distance), 0.2)) + friction * np.pi / 4 * np.sign(distance)
    return matrix / n, random.uniform(-1, 1, n)


def inequality(operator: Dense, offset: Array, unbounded: int = 0) -> Inequality:
    """p >= 0, A p + g >= 0, p (A p + g) = 0; the last `unbounded` unknowns without a bound."""
    n = len(offset)
    lower = np.concatenate([np.zeros(n - unbounded), np.full(unbounded, -np.inf)])
    return Inequality(
        lower, np.full(n, np.inf), lambda x: operator.multiply(x) + offset, lambda _: operator, "test_", "the test"
    )


def by_all_sets(matrix: Array, offset: Array) -> Array:
    """The solution of the linear complementarity problem: the one set that fulfils all its conditions."""
    n, found = len(offset), []
    for closed in product([False, True], repeat=n):
        own, x = np.flatnonzero(closed), np.zeros(n)
        x[own] = np.linalg.solve(matrix[np.ix_(own, own)], -offset[own])
        if (x >= 0).all() and (np.delete(matrix @ x + offset, own) >= 0).all():
            found.append(x)
    assert len(found) == 1
    return found[0]


@given(SEEDS, st.integers(1, 8), st.floats(-0.6, 0.6))
def test_equals_every_set_tried(seed: int, n: int, friction: float) -> None:
    """From full contact, from none, from a wrong set and from the solution itself: to 1e-12."""
    matrix, offset = compliance(n, friction, seed)
    exact = by_all_sets(matrix, offset)
    solver = inequality(Dense(matrix), offset)
    wrong = np.where(exact > 0, 0.0, 1.0)
    starts = (np.ones(n), np.zeros(n), wrong, exact)
    for start, near in product(starts, (False, True)):
        x = solver.solve(start, near=near)
        np.testing.assert_allclose(x, exact, rtol=0, atol=1e-12 * max(1, exact.max()))
        np.testing.assert_allclose(solver.residual, matrix @ x + offset, rtol=0, atol=1e-13)


@given(SEEDS, st.integers(3, 40), st.floats(-0.6, 0.6))
def test_a_kept_set(seed: int, n: int, friction: float) -> None:
    """Gaps that drift, sets that stay and change: with a kept factor and a new one to the last bit, SNES to 1e-12."""
    matrix, offset = compliance(n, friction, seed)
    operator, gap = Dense(matrix), offset.copy()
    keeps = inequality(operator, gap)
    x = np.ones(n)
    for step in range(25):
        gap += 0.02 * np.sin(np.arange(n) + step) + 0.03 * x
        fresh, by_snes = inequality(operator, gap).solve(x, near=True), inequality(operator, gap).solve(x)
        x = keeps.solve(x, near=True)
        np.testing.assert_array_equal(x, fresh)
        np.testing.assert_allclose(x, by_snes, rtol=0, atol=1e-12 * max(1.0, x.max()))
        f = matrix @ x + gap
        assert (x >= 0).all()
        assert np.abs(f[x > 0]).max(initial=0) < 1e-11
        assert (f[x == 0] > -1e-11).all()
    keeps.solve(x, near=True)
    assert keeps.iterations == 0


def test_upper_bounds() -> None:
    """At an upper bound the residual must not be positive: by hand, from both sides and from a kept set."""
    solver = Inequality(
        np.zeros(2), np.array([1.0, 1.0]), lambda x: x - target, lambda _: operator, "test_", "the test"
    )
    operator, target = Dense(np.eye(2)), np.array([2.0, 0.5])
    for near, begin in product((False, True), (1.0, 1 + 1e-8)):  # what beyond the bound a start has is not kept
        np.testing.assert_allclose(solver.solve(np.array([begin, 0.4]), near=near), [1.0, 0.5], rtol=0, atol=1e-14)
    target[0] = 0.7  # now the bound must let go
    np.testing.assert_allclose(solver.solve(np.array([1.0, 0.4]), near=True), [0.7, 0.5], atol=1e-14)


def test_nonlinear() -> None:
    """Wear by a power of the pressure: A x + c x^1.7 + g, against scipy."""
    from scipy.optimize import root

    matrix, offset = compliance(6, 0.2, 3)
    offset -= 2.0

    def residual(x: Array) -> Array:
        return np.asarray(matrix @ x + 0.3 * np.maximum(x, 0) ** 1.7 + offset)

    solver = Inequality(
        np.zeros(6),
        np.full(6, np.inf),
        residual,
        lambda x: Dense(matrix + np.diag(0.51 * np.maximum(x, 0) ** 0.7)),
        "test_",
        "the test",
    )
    x = solver.solve(np.ones(6))
    np.testing.assert_allclose(solver.solve(1.1 * x, near=True), x, atol=1e-11)
    closed = np.flatnonzero(x > 0)

    def on_closed(y: Array) -> Array:
        whole = np.zeros(6)
        whole[closed] = y
        return residual(whole)[closed]

    np.testing.assert_allclose(x[closed], root(on_closed, np.ones(len(closed)), tol=1e-13).x, atol=1e-10)
    assert (residual(x)[x == 0] >= 0).all()


@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("kept_first", [False, True])
def test_a_singular_set_is_told(kept_first: bool, near: bool) -> None:
    """Two nodes that are one and the same: no factor, whether nothing or a regular set was kept before."""
    matrix = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    offset = np.array([1.0, 1.0, -1.0])
    solver = inequality(Dense(matrix), offset)
    if kept_first:
        np.testing.assert_allclose(solver.solve(np.array([0.0, 0.0, 0.5])), [0, 0, 1], atol=1e-14)
        offset[:2] = -1.0
    with pytest.raises(ConvergenceError, match="the test did not converge: its Jacobian is singular"):
        solver.solve(np.ones(3), near=near)
    offset[:2] = 1.0  # and what has a solution afterwards is solved
    np.testing.assert_allclose(solver.solve(np.array([0.0, 0.0, 0.5])), [0, 0, 1], atol=1e-14)


def test_large_parts_leave_rounding() -> None:
    """A balance beside nodes that wear ten million times what they give way: solved, and not taken for singular."""
    wear, n = 1e10, 4
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n] = compliance(n, 0.0, 1)[0] + wear * np.eye(n)
    matrix[:n, n], matrix[n, :n] = 1.0, 1e-6
    offset = np.append(0.3 * wear * np.arange(n), -1e-6)
    operator, bounds = Dense(matrix), np.append(np.zeros(n), -np.inf)
    parts = (lambda x: operator.multiply(x) + offset, lambda _: operator, "test_", "the test")
    solver = Inequality(bounds, np.full(n + 1, np.inf), *parts, lambda: wear)
    x = solver.solve(np.append(np.ones(n), 0.0))
    np.testing.assert_allclose(x[:n], np.array([19, 10, 1, 0]) / 30, atol=1e-6)  # 1 in all, up to one level


@given(SEEDS, st.integers(30, 90))
def test_factors_that_follow_a_set(seed: int, n: int) -> None:
    """Nodes come and go, one by one, back again and all at once: as by one elimination of each set, to 1e-12."""
    random = np.random.default_rng(seed)
    matrix, b = compliance(n, 0.3, seed)[0] + 0.1 * np.eye(n), random.uniform(-1, 1, n)
    factors = Updating(lambda rows, columns: matrix[np.ix_(rows, columns)])
    free, fresh = random.uniform(size=n) < 0.7, 0
    for step in range(30):
        turned = random.integers(0, n, 1 if step % 10 else n)
        free[turned] = ~free[turned]
        kept = np.flatnonzero(free).astype(np.int32)
        base = factors.base
        x = factors.factor(kept)(b[kept])
        fresh += factors.base is not base
        exact = np.linalg.solve(matrix[np.ix_(kept, kept)], b[kept])
        np.testing.assert_allclose(x, exact, rtol=0, atol=1e-12 * max(1.0, np.abs(exact).max()))
    assert 3 <= fresh < 20


def test_a_set_that_becomes_singular() -> None:
    """An update finds that out as well as an elimination."""
    matrix = np.eye(30)
    matrix[0, 1] = matrix[1, 0] = 1.0
    factors = Updating(lambda rows, columns: matrix[np.ix_(rows, columns)])
    factors.factor(np.arange(1, 30, dtype=np.int32))
    with pytest.raises(np.linalg.LinAlgError):
        factors.factor(np.arange(30, dtype=np.int32))


@pytest.mark.parametrize("m", [1, 2, 9])
@pytest.mark.parametrize("bordered", [False, True])
@pytest.mark.parametrize("coupled", [False, True])
def test_phases(m: int, bordered: bool, coupled: bool) -> None:
    """The product and the factor of blocks, as one matrix or block by block, are those of the whole."""
    random = np.random.default_rng(m)
    n, size, q = 60, 62, 31
    blocks = random.uniform(-1, 1, (m, size, size)) / size + np.eye(size)
    border = (random.uniform(-1, 1, (m, n, q)) / n, random.uniform(-1, 1, (m, q, n)) / n) if bordered else None
    coupling = random.uniform(-1, 1, (m, n, m, n)) / (n * m) if coupled else None
    whole = np.zeros((m, size, m, size))
    for k in range(m):
        whole[k, :, k] += blocks[k]
    if border is not None:
        whole[:, :n, :, :n] += np.einsum("kaq,jqb->kajb", *border)
    if coupling is not None:
        whole[:, :n, :, :n] += coupling
    matrix = whole.reshape(m * size, m * size)
    operator = joined(Blocks(blocks, n), coupling, border)
    x = random.uniform(-1, 1, m * size)
    np.testing.assert_allclose(operator.multiply(x), matrix @ x, atol=1e-12)
    for share in (1.0, 0.6):
        kept = np.flatnonzero(random.uniform(size=m * size) < share).astype(np.int32)
        solution = operator.factor(kept)(x[kept])
        np.testing.assert_allclose(solution, np.linalg.solve(matrix[np.ix_(kept, kept)], x[kept]), atol=1e-11)


@pytest.fixture
def many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take few nodes as if they were many."""
    for name in ("DENSE", "DIRECT", "LARGE"):
        monkeypatch.setattr(f"fenwear.algebra.submatrices.{name}", 0)


@pytest.mark.usefixtures("many")
@pytest.mark.parametrize("most", [1, 30])
@pytest.mark.parametrize("m", [1, 2, 5])
def test_wear_that_opens_all_phases(m: int, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that wear next to nothing to a hundred times the elastic gap: by GMRES, and where that may not iterate."""
    monkeypatch.setattr("fenwear.algebra.krylov.MOST", most)
    random, n = np.random.default_rng(m), 40
    matrices = np.zeros((m, n + 2, n + 2))
    modes = np.stack([np.ones(n), np.linspace(-1, 1, n)], axis=1)
    for k in range(m):
        matrices[k, :n, :n] = compliance(n, 0.3 * (-1) ** k, k)[0]
        matrices[k, :n, n:], matrices[k, n:, :n] = modes, modes.T / n
    blocks, pattern = Blocks(matrices, n), random.uniform(0.8, 1.2, (m, n))
    for length in (1e-4, 1e-2, 1.3e-2, 1.0, 0.7, 100.0):
        border = np.array([np.eye(n)] * m), np.array([np.diag(length * own) for own in pattern])
        exact = dense_matrix(matrices, None, border, None)
        operator, x = joined(blocks, local=length * pattern), random.uniform(-1, 1, m * (n + 2))
        np.testing.assert_allclose(operator.multiply(x), exact @ x, atol=1e-12 * max(1.0, length))
        free = random.uniform(size=(m, n + 2)) < 0.7
        free[:, n:] = True
        kept = np.flatnonzero(free).astype(np.int32)
        expected = np.linalg.solve(exact[np.ix_(kept, kept)], x[kept])
        np.testing.assert_allclose(operator.factor(kept)(x[kept]), expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.usefixtures("many")
@pytest.mark.parametrize(
    "settings",
    [
        ("contact.friction=0.4", "geometry.parameters.pin_height_1=40", "geometry.degree=2"),
        ("geometry.degree=2", "contact.friction={expression='0.2 + 0.05*exp(-p/20)'}"),
    ],
)
def test_runs_are_the_same(
    assembled: Callable[..., Tribosystem], settings: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Explicit and implicit marches and jumps, of few nodes taken as if they were many: to 1e-9 of the mean."""
    system = assembled("example1", *settings)

    def ends() -> list[Array]:
        runs = march(system, 12), march(system, 12, implicit=True), jump(system, 4000, tolerance=1e-2)
        return [list(run)[-1].pressure[-2:] for run in runs]

    found = ends()
    monkeypatch.undo()
    for one, other in zip(found, ends(), strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * one.mean())


def test_nothing_holds_a_solver_that_is_done(assembled: Callable[..., Tribosystem]) -> None:
    """SNES holds callbacks, out of sight of Python's garbage collection: 38 MiB a steady state once stayed for ever."""
    system = replace(assembled("example1", "geometry.degree=2", "geometry.parameters.elements_along_contact=8"))
    seen = weakref.ref(system)
    steady(system)
    contact = system.phase_contact((0,))
    contact.solve(system.gap(0, system.unworn()))
    del system, contact
    gc.collect()
    assert seen() is None
