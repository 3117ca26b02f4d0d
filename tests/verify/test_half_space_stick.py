"""The exact half-space that contact with stick is verified on: known displacements, reciprocity, folded symmetries."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.bodies.half_space import influence
from fenwear_verify.half_space_stick import Elastic, half_spaces

SOFT = Elastic(1.0, 0.3)


def point_force(x: np.ndarray, body: Elastic) -> np.ndarray:
    """Return the surface displacement of unit forces at 0 along x, y and into the body (k, 3, 3)."""
    r, nu = np.linalg.norm(x, axis=1), body.poisson
    found = np.zeros((len(x), 3, 3))
    for i in (0, 1):
        for j in (0, 1):
            found[:, i, j] = (1 - nu) * (i == j) / r + nu * x[:, i] * x[:, j] / r**3
        found[:, 2, i], found[:, i, 2] = (0.5 - nu) * x[:, i] / r**2, -(0.5 - nu) * x[:, i] / r**2
    found[:, 2, 2] = (1 - nu) / r
    return found / (2 * np.pi * body.shear)


def test_uniform_pressure_on_a_square() -> None:
    """Love's numbers in its middle and at its corner, E* = 1."""
    one = Elastic(0.5, 0.0)
    found = influence(np.array([[1e-9, 1e-9], [0.5 + 1e-9, 0.5 + 1e-9]]), (1.0, 1.0), one.shear, one.poisson)[:, 2, 2]
    assert found == pytest.approx([1.1221997, 0.5610999], abs=1e-7)


def test_squares_are_sums_of_point_forces() -> None:
    """All nine components, by Gauss points; beside the square and far away."""
    x = np.array([[0.9, 0.4], [-1.2, 0.7], [0.1, -3.0], [40.0, 30.0]])
    points, weights = np.polynomial.legendre.leggauss(24)
    square = np.stack(np.meshgrid(points, points, indexing="ij"), axis=-1).reshape(-1, 2) / 2
    shares = np.outer(weights, weights).ravel() / 4
    summed = sum(w * point_force(x - y, SOFT) for w, y in zip(shares, square, strict=True))
    assert influence(x, (1.0, 1.0), SOFT.shear, SOFT.poisson) == pytest.approx(summed, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("symmetry", ["pulled", "pressed"])
def test_folded_onto_a_quadrant(symmetry: str) -> None:
    """The same displacements as of all four quadrants, from forces of the symmetry; reciprocity holds."""
    bodies = half_spaces(SOFT, Elastic(2.0, 0.1), 1.0, 2.6, 1.0, np.inf, symmetry)
    x, n = bodies.middle.pair.punch.x[:, :2], len(bodies.middle.pair.weights)
    for body, elastic, side in ((bodies.punch, SOFT, 1.0), (bodies.strip, Elastic(2.0, 0.1), -1.0)):
        flat = body.response.reshape(3 * n, 3 * n)
        assert flat == pytest.approx(flat.T, abs=1e-12 * np.abs(flat).max())
        force = np.random.default_rng(1).normal(size=(n, 3))
        mirror_x = np.array([1, -1, 1]) if symmetry == "pulled" else np.array([-1, 1, 1])
        images = [(np.array([i, j]), (mirror_x if i < 0 else 1) * (np.array([1, -1, 1]) if j < 0 else 1))
                  for i in (1, -1) for j in (1, -1)]  # fmt: skip
        into = np.array([1.0, 1.0, side])
        whole = np.zeros((n, 3))
        for place, sign in images:
            apart = (x[:, None] - x * place).reshape(-1, 2)
            local = influence(apart, (1.0, 1.0), elastic.shear, elastic.poisson).reshape(n, n, 3, 3)
            if symmetry == "pulled":  # for like bodies, in which normal and tangential displacements do not couple
                local[:, :, 2, :2] = local[:, :, :2, 2] = 0.0
            whole += np.einsum("ijcb,jb->ic", local, into * sign * force / 4) * into
        assert np.einsum("icjb,jb->ic", body.response, force) == pytest.approx(whole, abs=1e-12)
