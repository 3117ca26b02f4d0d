"""Coulomb's cone: the tangential traction t of a node never exceeds mu p, in one or two tangential directions."""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array


def project(trial: Array, radius: Array) -> Array:
    """Return the points of the discs abs(t) <= radius that are nearest to `trial`.

    Args:
        trial: (n, m), m = d - 1 tangential directions, MPa.
        radius: mu p (n,), MPa; negative ones count as zero.
    """
    size = np.linalg.norm(trial, axis=1)
    limit = np.maximum(radius, 0.0)
    outside = size > limit
    return trial * np.where(outside, limit / np.where(outside, size, 1.0), 1.0)[:, None]


def derivative(trial: Array, radius: Array) -> tuple[Array, Array]:
    """Return the derivatives of the projection of points outside of their disc: to the trial, and to the radius.

    With the direction n of z: (r / |z|) (I - n n^T), of (n, m, m), and n, of (n, m).

    Args:
        trial: z (n, m), abs(z) > radius.
        radius: r (n,).
    """
    size = np.maximum(np.linalg.norm(trial, axis=1), 1e-300)
    direction = trial / size[:, None]
    across = np.eye(trial.shape[1]) - direction[:, :, None] * direction[:, None, :]
    return (np.maximum(radius, 0.0) / size)[:, None, None] * across, direction
