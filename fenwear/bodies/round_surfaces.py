"""Round surfaces: the circles, cylinders and spheres that a mesh follows by polynomials.

Facets leave a circle by a power of their size: quadratic ones of a tenth of the radius by 1e-6 of it, more than what a
stiff contact is pressed together by. A surface whose nodes all lie on one circle, cylinder or sphere is taken for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array

TRUE = 1e-8  # of the surface's size: how far its nodes may be from the circle
FLAT = 100.0  # radius over the surface's size, beyond which it counts as flat
COARSE = 1.0  # size of a facet over the radius: polygons, whose corners lie on a circle by chance
LEAST = {2: 7, 3: 16}  # nodes in so many dimensions
STEPS, STILL = 30, 1e-15  # of Gauss and Newton, and what of the radius they may end with


@dataclass(frozen=True)
class Round:
    """A circle, a cylinder or a sphere.

    Attributes:
        middle: Of it, or a point on its axis (d,), mm.
        axis: Of a cylinder in space, a unit vector; else zero (d,).
        radius: mm.
        sign: 1 where the body is inside, as of a shaft or a ball; -1 where it is around, as of a bore.
    """

    middle: Array
    axis: Array
    radius: float
    sign: float

    def ways(self, x: Array) -> Array:
        """Return the ways from the middle or the axis to points (n, d), mm."""
        arm = np.asarray(x - self.middle)
        return np.asarray(arm - (arm @ self.axis)[:, None] * self.axis)

    def onto(self, x: Array) -> Array:
        """Return the points of it that lie where points (n, d) are seen from its middle, mm."""
        ways = self.ways(x)
        return np.asarray(x + (self.radius / np.linalg.norm(ways, axis=1, keepdims=True) - 1) * ways)


def rounds_of(
    trace: Array, facets: NDArray[np.int64], part: NDArray[np.int64], outward: Array
) -> tuple[list[Round], NDArray[np.int64]]:
    """Return the round parts of a surface, and the number of the part of each trace node, -1 for none (N,).

    Args:
        trace: Coordinates of the nodes (N, d), mm.
        facets: Nodes of each facet (f, k).
        part: The connected part that each facet belongs to (f,).
        outward: Unit normals out of the body at the nodes (N, d), zero where they are not known.
    """
    rounds: list[Round] = []
    which = np.full(len(trace), -1)
    for k in np.unique(part):
        part_facets = facets[part == k]
        nodes = np.unique(part_facets)
        x, normal = trace[nodes], outward[nodes]
        round_part = _fitted(x, normal)
        if round_part is None:
            continue
        sizes = np.linalg.norm(np.ptp(trace[part_facets], axis=1), axis=1)
        if sizes.max() > COARSE * round_part.radius:
            continue
        which[nodes] = len(rounds)
        rounds.append(round_part)
    return rounds, which


def _fitted(x: Array, normal: Array) -> Round | None:
    """Return the round surface through all points (n, d) with normals (n, d) out of the body; None without one."""
    dim, size = x.shape[1], float(np.ptp(x, axis=0).max())
    if len(x) < LEAST[dim]:
        return None
    for middle, axis, radius in _candidates(x, normal):
        if not radius < FLAT * size:
            continue
        fitted = Round(middle, axis, radius, 1.0)
        ways = fitted.ways(x)
        if np.abs(np.linalg.norm(ways, axis=1) - radius).max() > TRUE * size:
            continue
        inside = float(np.einsum("nc,nc->", ways, normal)) > 0
        return fitted if inside else Round(middle, axis, radius, -1.0)
    return None


def _candidates(x: Array, normal: Array) -> list[tuple[Array, Array, float]]:
    """Return the circle or sphere that points (n, d) are next to, and in space the cylinder: middle, axis, radius."""
    origin = x.mean(axis=0)
    arm = x - origin
    # |x|^2 = 2 c x + (R^2 - |c|^2), in least squares; of a plane there is none.
    solution, _, rank, _ = np.linalg.lstsq(
        np.column_stack([2 * arm, np.ones(len(x))]), (arm**2).sum(axis=1), rcond=1e-12
    )
    candidates: list[tuple[Array, Array, float]] = []
    if rank == x.shape[1] + 1:
        centre = solution[:-1]
        candidates.append((origin + centre, np.zeros_like(centre), float(np.sqrt(solution[-1] + centre @ centre))))
    if x.shape[1] == 3:
        candidates.append(_cylinder(x, normal))
    return candidates


def _cylinder(x: Array, normal: Array) -> tuple[Array, Array, float]:
    """Return middle, axis and radius of the cylinder next to points (n, 3), by Gauss and Newton."""
    axes = np.linalg.eigh(normal.T @ normal)[1]
    axis, across = axes[:, 0], axes[:, 1:]
    seen = (x - x.mean(axis=0)) @ across
    circle, *_ = np.linalg.lstsq(np.column_stack([2 * seen, np.ones(len(x))]), (seen**2).sum(axis=1), rcond=1e-12)
    middle, radius = x.mean(axis=0) + across @ circle[:2], float(np.sqrt(max(circle[2] + circle[:2] @ circle[:2], 0.0)))
    for _ in range(STEPS):
        arm = x - middle
        height = arm @ axis
        ways = arm - height[:, None] * axis
        length = np.linalg.norm(ways, axis=1)
        out = ways / np.where(length > 0, length, 1.0)[:, None] @ across
        slopes = np.column_stack([-out, -height[:, None] * out, -np.ones(len(x))])
        step, *_ = np.linalg.lstsq(slopes, radius - length, rcond=1e-12)
        middle, radius = middle + across @ step[:2], radius + float(step[4])
        axis = axis + across @ step[2:4]
        axis /= np.linalg.norm(axis)
        across = np.linalg.svd(axis[None])[2][1:].T
        if np.abs(step[[0, 1, 4]]).max() < STILL * radius:
            break
    return middle, axis, radius
