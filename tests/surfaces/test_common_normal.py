"""The common normal of surfaces that stick."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array
from fenwear.surfaces.common_normal import common_normal, contact_frame


def line(points: Array) -> ContactSurface:
    """Return the surface of straight lines through points (n, 2), the body above it."""
    step = np.diff(points, axis=0)
    area = np.column_stack([step[:, 1], -step[:, 0]])
    out = np.zeros_like(points)
    out[:-1] += area
    out[1:] += area
    size = np.linalg.norm(out, axis=1, keepdims=True)
    every = np.arange(len(points))
    facets = np.column_stack([every[:-1], every[1:]])
    identity = csr_array(np.eye(len(points)))
    return ContactSurface("punch", points, facets, "interval", 1, every, size[:, 0] / 2, out / size, identity)


def test_a_round_surface_is_met_half_way() -> None:
    """Over a flat one at half the angle, whatever facets it has."""
    angle = np.radians(np.linspace(-30, 30, 13))
    normal = common_normal(line(10 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])), np.tile([0.0, 1.0], (13, 1)))
    half = -angle / 2
    expected = np.column_stack([np.sin(half), np.cos(half)])
    np.testing.assert_allclose(normal[1:-1], expected[1:-1], atol=1e-12)


def test_the_face_beside_a_chamfer_counts() -> None:
    """At the edge of a flat face that lies on a flat one both look at each other."""
    x = np.arange(-4.0, 5.0)
    normal = common_normal(line(np.column_stack([x, np.maximum(np.abs(x) - 2, 0)])), np.tile([0.0, 1.0], (9, 1)))
    np.testing.assert_allclose(normal[2:7], np.tile([0.0, 1.0], (5, 1)), atol=1e-12)
    np.testing.assert_allclose(normal[[1, 7], 0], np.sin(np.radians([22.5, -22.5])), atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_frames_all_around(d: int) -> None:
    """Orthonormal, right-handed and with the normal first whichever way it looks; along x where the contact is flat."""
    normal = np.random.default_rng(1).standard_normal((200, d))
    normal[: 2 * d] = np.concatenate([np.eye(d), -np.eye(d)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    frame = contact_frame(normal)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.broadcast_to(np.eye(d), frame.shape), atol=1e-14)
    np.testing.assert_array_equal(frame[:, 0], normal)
    np.testing.assert_allclose(np.linalg.det(frame), -1.0 if d == 2 else 1.0, rtol=1e-13)
    np.testing.assert_allclose(frame[d - 1, 1], np.eye(d)[0], atol=1e-15)
