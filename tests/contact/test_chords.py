"""Steps by earlier factors against Newton's own: the same solutions, with fewer of them."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.arrays import Array
from fenwear.contact.inequality import Inequality
from fenwear.contact.operators import Shifted
from tests.contact.test_inequality import compliance

ONSET = 1e-9  # of the pressure whose logarithm the layer gives way by


class Layer:
    """Nodes that give way by a matrix, and each by the logarithm of its own pressure."""

    def __init__(self, n: int, slope: float, *, told: bool) -> None:
        self.matrix, self.slope = compliance(n, 0.3, 1)[0] + 0.1 * np.eye(n), slope
        self.gap, self.factors = np.linspace(-1, 0.5, n), 0
        self.inequality = Inequality(np.zeros(n), np.full(n, np.inf), self.residual, self.jacobian, "test_", "the test")
        self.inequality.curved = True
        if told:
            self.inequality.diagonal = lambda p: (self.matrix.diagonal(), self.bends(p))

    def residual(self, p: Array) -> Array:
        """Return the gaps."""
        return self.matrix @ p + self.slope * np.log1p(np.maximum(p, 0) / ONSET) + self.gap

    def bends(self, p: Array) -> Array:
        """Return what the layer adds to the diagonal."""
        return self.slope / (ONSET + np.maximum(p, 0))

    def jacobian(self, p: Array) -> Shifted:
        """Return the derivative, and count it."""
        self.factors += 1
        return Shifted(self.matrix, self.bends(p))


@pytest.mark.parametrize("told", [(False,), (True,), (True, True, False)])
@pytest.mark.parametrize("slope", [1e-4, 1e-2])
def test_solutions_along_a_way(slope: float, told: tuple[bool, ...]) -> None:
    """Gaps that rise and fall, by which nodes come and go: each solution is that of SNES, to 1e-10.

    Whether slopes are told always, never or now and then.
    """
    n = 40
    way, apart = Layer(n, slope, told=True), Layer(n, slope, told=False)
    diagonal, p = way.inequality.diagonal, way.inequality.solve(np.ones(n))
    for step in range(40):
        way.inequality.diagonal = diagonal if told[step % len(told)] else None
        way.gap = apart.gap = np.linspace(-1, 0.5 + 0.2 * np.sin(step / 6), n)
        p = way.inequality.solve(p, near=True)
        assert (p >= 0).all()
        gap = way.residual(p)
        np.testing.assert_allclose(gap[p > 0], 0, atol=1e-11)
        assert gap.min() > -1e-11
        np.testing.assert_allclose(p, apart.inequality.solve(np.ones(n)), atol=1e-10, rtol=1e-9)


def test_nodes_that_bend_by_themselves_ask_for_no_factor() -> None:
    """Where each node's own slope is known, half the factors serve, and two thirds of the steps."""
    n, made, steps = 40, {}, {}
    for told in (False, True):
        way = Layer(n, 1e-2, told=told)
        p = way.inequality.solve(np.ones(n))
        way.factors, steps[told] = 0, 0
        for step in range(40):
            way.gap = np.linspace(-1, 0.5 + 0.05 * np.sin(step / 6), n)
            p = way.inequality.solve(p, near=True)
            steps[told] += way.inequality.iterations
        made[told] = way.factors
    assert 2 * made[True] <= made[False]
    assert 3 * steps[True] <= 2 * steps[False]
