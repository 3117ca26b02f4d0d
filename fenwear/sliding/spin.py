"""What nodes slide around an axis that passes through the contact of a solid.

At the axis nothing slides, and a node there would never wear. It stands for its area, though. Where wear is even,
k p^b v^a is the same all over it, so that its mean pressure is that of a node that slides

    v_m = (mean of v^-m over its area)^(-1/m),    m = a / b,

which also gives the heat of friction, with m = 1. An even pressure would take the mean of v^a; the two differ
by the third order of the node's size in the worn volume. In a plane piece of the surface v = omega_n r, with r the
distance from where the axis of its motion meets it. Its corners a, b, ... and this point x_0 span triangles, over each
of which

    integral of r^-m dA = A / (1 - m / 2) (integral of r^-m along the edge) / (length of the edge).

For m >= 2 it has no limit: all of the load ends at the axis, and nodes slide what their places do.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.interface import ContactPair
from fenwear.interface.overlap import ChartedSurface, node_triangles
from fenwear.interface.placement import ZERO
from fenwear.sliding.field import SlidingField

AROUND = 1.2  # sizes of a node, within which the axis passes through its area; beside the surface nothing is singular
UPRIGHT = 0.1  # cosine between a node's normal and the mean one, below which a rigid motion hardly wears it
NEAR = 4.0  # sizes of a triangle from the axis, beyond which v is smooth over it
POINTS, SHARES = np.polynomial.legendre.leggauss(16)


def node_rates(field: SlidingField, pair: ContactPair, power: float = 1.0) -> Array:
    """Return what each node slides for a unit of the stroke's law (n,): 1, or mm/rad.

    Args:
        field: Of the sliding.
        pair: The surfaces opposite each other.
        power: m.
    """
    rates, turn = field.rate(pair.opposite, pair.normal), np.array(field.turn)
    if pair.punch.dim < 3 or field.turn == ZERO or power >= 2:
        return rates
    away = rates / np.maximum(np.abs(pair.normal @ turn) * np.sqrt(pair.weights), 1e-300)  # from the axis, in sizes
    nearest = int(away.argmin())
    facing = pair.normal[nearest] @ (pair.weights @ pair.normal) / pair.weights.sum()
    if away[nearest] > AROUND or facing < UPRIGHT:  # where the rim stands upright it hardly wears
        return rates
    punch = pair.punch
    triangles, node = node_triangles(ChartedSurface(punch.trace, punch.facets, punch.cell, punch.degree, punch.nodes))
    middle = triangles.mean(axis=1)
    square = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    twice = np.linalg.norm(square, axis=1)
    normal = square / twice[:, None]
    speed, spin = field.velocity(middle), normal @ turn
    speed -= np.einsum("md,md->m", speed, normal)[:, None] * normal
    halves = (triangles + np.roll(triangles, -1, axis=1)) / 2 - middle[:, None]
    at_halves = speed[:, None] + spin[:, None, None] * np.cross(normal[:, None], halves)
    size = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1)
    near = np.linalg.norm(speed, axis=1) < NEAR * size * np.abs(spin)
    found = np.zeros(len(triangles))
    found[~near] = (np.linalg.norm(at_halves[~near], axis=2) ** -power).mean(axis=1)
    still = middle[near] + np.cross(normal[near], speed[near]) / spin[near, None]
    integrals = _integrals(triangles[near] - still[:, None], normal[near], power)
    found[near] = integrals / (twice[near] / 2) * np.abs(spin[near]) ** -power
    count = len(rates)
    means = np.bincount(node, twice * found, count) / np.bincount(node, twice, count)
    return np.asarray(means ** (-1 / power))


def _integrals(triangles: Array, normal: Array, power: float) -> Array:
    """Return the integrals of r^-m over triangles (m, 3, 3) in planes through the origin, r the distance from it."""
    after = np.roll(triangles, -1, axis=1)
    edge = after - triangles
    length = np.linalg.norm(edge, axis=2)
    along = edge / length[:, :, None]
    twice = np.einsum("md,med->me", normal, np.cross(triangles, after))  # areas with sign
    away = np.maximum(np.abs(twice) / length, 1e-12 * length)
    # Along the edge by s = d sinh(u): what is integrated is smooth, and constant for m = 1.
    begin, end = (np.arcsinh(np.einsum("med,med->me", one, along) / away) for one in (triangles, after))
    u = (begin + end)[:, :, None] / 2 + (end - begin)[:, :, None] / 2 * POINTS
    on_edge = ((away[:, :, None] * np.cosh(u)) ** (1 - power) @ SHARES) * (end - begin) / 2
    return np.asarray((twice / (2 - power) * on_edge / length).sum(axis=1))
