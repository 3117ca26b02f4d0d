"""Two surfaces opposite each other, their equilibrium and their compliance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fenwear import Tribosystem, load_case
from fenwear.surfaces import pair as paired
from fenwear.system import place_case


def test_transfer_between_unmatched_nodes(unmatched: Tribosystem) -> None:
    """Taking values from the strip's nodes to the punch's is exact for polynomials of the elements' degree."""
    pair = unmatched.pair
    strip, punch = pair.strip.trace[:, 0], pair.x
    assert len(strip) > len(punch)
    for power in range(pair.strip.degree + 1):
        np.testing.assert_allclose(pair.transfer @ (strip / 30) ** power, (punch / 30) ** power, atol=1e-12)


def test_wear_never_makes_a_surface_grow(unmatched: Tribosystem) -> None:
    """Depths put on the strip are nowhere negative, keep their area, and an even depth stays even below the punch."""
    pair = unmatched.pair
    for node in range(len(pair.weights)):
        depth = np.zeros(len(pair.weights))
        depth[node] = 1.0
        on_strip = pair.wear_projection @ depth
        assert on_strip.min() >= 0
        assert pair.strip.weights @ on_strip == pytest.approx(pair.weights[node], rel=1e-13)
    np.testing.assert_allclose(pair.wear_projection @ np.ones(len(pair.weights)), 1.0, rtol=1e-12)


@pytest.mark.parametrize("name", ["ball-on-flat", "ring-on-ring"])
def test_rounding_moves_nothing(name: str) -> None:
    """Where facets are cut is decided by rounding; what is integrated over the cuts must not be, bent facets or not."""
    bodies = place_case(
        load_case(name, [f"geometry.parameters.{k}" for k in ("core=0", "across=4") if name == "ball-on-flat"])
    ).bodies
    punch, strip = bodies.punch.surface, bodies.strip.surface
    rings = bodies.punch.law.kind == "axisymmetric"
    noise = 1e-15 * np.random.default_rng(1).standard_normal(punch.trace.shape)
    one, other = (paired(replace(punch, trace=punch.trace + by), strip, axisymmetric=rings) for by in (0.0, noise))
    np.testing.assert_allclose(other.transfer.toarray(), one.transfer.toarray(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(other.weights, one.weights, rtol=1e-12)


@pytest.mark.mpi
def test_equilibrium_of_example_1(assembled: Callable[..., Tribosystem]) -> None:
    """H and the moments by hand: the motion by lambda_F and lambda_M about O = (30, 120)."""
    rigid = assembled("example1").rigid
    x, weights = rigid.pair.x, rigid.pair.weights
    assert rigid.mode_names == ("lambda_F", "lambda_M")
    np.testing.assert_allclose(rigid.rigid_normal, np.stack([0 * x + 1, 30 - x], axis=1), atol=1e-10)
    friction = np.stack([np.full_like(x, 0.25), np.zeros_like(x)], axis=1)
    np.testing.assert_allclose(
        rigid.equilibrium(friction), np.stack([0 * x + 1, 30 - x - 0.25 * 20]) * weights, atol=1e-10
    )
    # 1 kN/mm at x = 0, 30 mm to the left of O.
    np.testing.assert_allclose(rigid.resultant, [-1000, -1000 * 30], rtol=1e-12)


@pytest.mark.mpi
def test_compliance_of_mirrored_directions(assembled: Callable[..., Tribosystem]) -> None:
    """Example 2 is its own mirror image: without the rigid part the gap by e_z is even and by e_x odd under x -> -x."""
    interface = assembled("example2").elastic.interface
    weights = interface.pair.weights
    balanced = np.eye(len(weights)) - 1 / len(weights)  # forces without resultant, gaps without mean
    for axis, sign in ((1, 1), (0, -1)):
        per_force = balanced @ interface.dense()[:, 0, :, axis] @ balanced
        np.testing.assert_allclose(per_force[::-1, ::-1], sign * per_force, atol=1e-9 * np.abs(per_force).max())
