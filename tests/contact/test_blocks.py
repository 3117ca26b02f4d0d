"""Contacts of many nodes: operators of which only what is asked for is made, against whole matrices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fenwear import Tribosystem, jump, march
from fenwear.arrays import Array
from fenwear.contact.blocks import Columns, ManyNodes, PhaseBlock
from fenwear.contact.operators import Phases

SEEDS = st.integers(0, 2**32 - 1)
OPENING = ("contact.friction=0.4", "geometry.parameters.pin_height_1=40", "geometry.degree=2")


def blocks(m: int, n: int, random: np.random.Generator) -> tuple[list[PhaseBlock], Array]:
    """Log kernels with friction to either side and two rigid modes; and the same as matrices."""
    x = np.linspace(-1, 1, n)
    modes, distance = np.stack([np.ones(n), x], axis=1), np.subtract.outer(x, x)
    made, whole = [], np.zeros((m, n + 2, n + 2))
    for k in range(m):
        friction = 0.3 * np.sign(distance) * (-1) ** k
        own = (np.log(8 / np.maximum(np.abs(distance), 0.5 / n)) + friction) / n * random.uniform(0.9, 1.1, n)
        balance = modes.T / n
        whole[k, :n, :n], whole[k, :n, n:], whole[k, n:, :n] = own, modes, balance
        columns = Columns(n, lambda nodes, own=own: own[:, nodes])  # type: ignore[misc]
        made.append(PhaseBlock(columns, own.diagonal(), modes, balance, iterated=m == 1))
    return made, whole


@given(SEEDS, st.integers(5, 60))
def test_columns_are_made_when_they_are_asked_for(seed: int, n: int) -> None:
    """Products and entries are those of the matrix; what nothing asks for is not made, nothing is made twice."""
    random = np.random.default_rng(seed)
    matrix, asked = random.uniform(-1, 1, (n, n)), []

    def make(nodes: NDArray[np.int64]) -> Array:
        asked.extend(nodes.tolist())
        return matrix[:, nodes]

    columns = Columns(n, make)
    for _ in range(4):
        x = np.where(random.uniform(size=n) < 0.2, random.uniform(-1, 1, n), 0.0)
        np.testing.assert_allclose(columns.apply(x), matrix @ x, atol=1e-14 * n)
        rows, some = (np.flatnonzero(random.uniform(size=n) < 0.1).astype(np.int32) for _ in range(2))
        np.testing.assert_array_equal(columns.entries(rows, some), matrix[np.ix_(rows, some)])
    assert len(asked) == len(set(asked)) == columns.made
    few = Columns(n, lambda nodes: matrix[:, nodes])
    few.apply(np.eye(n)[n // 2])
    assert few.made == 1


@pytest.mark.parametrize("m", [1, 2, 5])
@pytest.mark.parametrize("worn", [False, True])
def test_many_nodes_are_the_matrix(m: int, worn: bool) -> None:
    """Product and solution, with steps that wear from next to nothing to a hundred times the elastic gap."""
    random = np.random.default_rng(m)
    n, operator = 40, None
    (made, whole), pattern = blocks(m, n, random), random.uniform(0.8, 1.2, (m, n))
    for length in (1e-4, 1e-2, 1.3e-2, 1.0, 0.7, 100.0):
        wear = length * pattern if worn else None
        before = operator
        operator = ManyNodes(made, wear, before)
        border = None if wear is None else (np.array([np.eye(n)] * m), np.array([np.diag(one) for one in wear]))
        exact = Phases(whole, None, border)
        x = random.uniform(-1, 1, m * (n + 2))
        np.testing.assert_allclose(operator.multiply(x), exact.multiply(x), atol=1e-12 * max(1.0, length))
        free = random.uniform(size=(m, n + 2)) < 0.7
        free[:, n:] = True
        kept = np.flatnonzero(free).astype(np.int32)
        expected = exact.factor(kept)(x[kept])
        np.testing.assert_allclose(operator.factor(kept)(x[kept]), expected, atol=1e-9 * np.abs(expected).max())
        kept_before = worn and m > 1 and before is not None
        if kept_before and length in (1.3e-2, 0.7):
            assert operator.near[0] in before.near  # a step of nearly the same length takes its preconditioner
    assert len(operator.near) <= 3


def test_where_iterations_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """GMRES that may take one iteration cannot do it: then the matrix is eliminated."""
    random = np.random.default_rng(1)
    made, whole = blocks(2, 30, random)
    wear = random.uniform(0.5, 1, (2, 30))
    kept, b = np.arange(64, dtype=np.int32), random.uniform(-1, 1, 64)
    monkeypatch.setattr("fenwear.contact.krylov.RESTART", 1)
    monkeypatch.setattr("fenwear.contact.krylov.RESTARTS", 1)
    found = ManyNodes(made, wear).factor(kept)(b)
    exact = Phases(whole, None, (np.array([np.eye(30)] * 2), np.array([np.diag(one) for one in wear])))
    np.testing.assert_allclose(found, exact.factor(kept)(b), rtol=1e-9)


@pytest.mark.parametrize(
    "settings",
    [OPENING, ("geometry.degree=2", "contact.friction={expression='0.2 + 0.05*exp(-p/20)'}"), ("geometry.degree=2",)],
)
def test_runs_are_the_same(
    assembled: Callable[..., Tribosystem], settings: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Explicit and implicit marches and jumps, of few nodes taken as if they were many: to 1e-9 of the mean."""
    system = assembled("example1", *settings)

    def ends() -> list[Array]:
        runs = march(system, 12), march(system, 12, implicit=True), jump(system, 4000, tolerance=1e-2)
        return [list(run)[-1].pressure[-2:] for run in runs]

    usual = ends()
    monkeypatch.setattr("fenwear.contact.condensed.MANY", 0)
    for one, other in zip(usual, ends(), strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * one.mean())
