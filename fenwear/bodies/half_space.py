"""A body that is large against its contact, as an elastic half-space, in the plane a half-plane; without a mesh.

Each node of a regular grid has a rectangle, in the plane a strip, over which its force is spread evenly. The
displacements are known in closed form, and depend on the distance of two nodes alone: products go by fast Fourier
transforms, numbers are looked up. With r the distance, q the tractions, u_z into the body, G and nu of the material,

    2 pi G u = ((1 - nu) / r + nu x x / r^3) q,    (1 - nu) / r q_z,    -+ (1/2 - nu) x / r^2 between both

(Boussinesq, Cerruti; K. L. Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6), over rectangles after A. E. H. Love
(Phil. Trans. R. Soc. A 228, 1929); in the plane, with x the distance and D the depth from which displacements count,

    pi G u_x = ((1 - nu) ln(D / |x|) + 1/2) q_x,    pi G u_z = ((1 - nu) ln(D / |x|) - 1/2) q_z

(Flamant, Johnson sections 2.2, 2.3 and 5.6), and -+ pi (1/2 - nu) / 2 sign x between both.

The half-space leaves out all far from the contact: supports and other boundaries, the curvature of the surface,
and what loads displace. That is of the order of the contact's width over the distance of the next boundary, and over
the radius. The difference of the finite body is smooth at the contact: another operator could add it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.convolution import EVERY, Convolution, GridOperator
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.half_space_correction import constants_of
from fenwear.bodies.response import Request
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError

UNEVEN = 0.01  # of the spacing: how far a node may be off the grid
WIDE = 1.25  # of a cell: what a node has at most; 1.5 between cells of one spacing and of two


@dataclass(frozen=True)
class HalfSpace(GridOperator):
    """An elastic half-space, or half-plane, under forces that are even over the cells of a regular grid.

    Vectors have the grid's axes first and the outward normal last; `axes` says which of the model's they are.

    Attributes:
        places: Whole numbers of each node along the axes of the grid (q, d - 1).
        spacing: Of the grid (d - 1,), mm.
        shear: G, MPa.
        poisson: nu; in plane stress nu / (1 + nu).
        axes: The model's axis of each of the grid's and of the normal (d,).
        outward: 1.0 where the normal out of the body points along its axis, else -1.0.
        depth: From which displacements count, mm: in the plane alone, in space they count from far away.
        along: Directions that displacements are asked for along, the same at all nodes (a, d); None for all axes.
    """

    places: NDArray[np.int64]
    spacing: tuple[float, ...]
    shear: float
    poisson: float
    axes: tuple[int, ...]
    outward: float
    depth: float = np.inf
    along: Array | None = None
    by_temperature: Array | None = None

    @property
    def dim(self) -> int:
        """Number of the model's axes."""
        return len(self.axes)

    @cached_property
    def _directions(self) -> Array:
        return np.eye(self.dim) if self.along is None else self.along

    @property
    def directions(self) -> Array:
        """Unit vectors (q, d, a)."""
        return np.broadcast_to(self._directions.T, (len(self.places), *self._directions.T.shape))

    @property
    def by_load(self) -> Array:
        """Displacement by loads (q, d): none."""
        return np.zeros((len(self.places), self.dim))

    @cached_property
    def convolution(self) -> Convolution:
        """C along its directions, by forces along the model's axes."""
        places = self.places - self.places.min(axis=0)
        shape = tuple(int(count) for count in places.max(axis=0) + 1)
        influences = _influences(shape, self.spacing, self.shear, self.poisson, self.depth)
        into = np.eye(self.dim)[list(self.axes)]  # the model's vectors along the grid, then into the body
        into[-1] *= -self.outward
        table = np.tensordot(self._directions @ into.T, np.tensordot(into.T, influences, (1, 1)), (1, 1))
        return Convolution(places, np.asarray(table))

    def at(self, x: Array) -> HalfSpace:
        """Return the half-space itself, which is alike at all places (q, d), mm."""
        flat = x[:, list(self.axes[:-1])]
        return replace(self, places=np.rint((flat - flat.min(axis=0)) / self.spacing).astype(np.int64))

    def under(self, elastic: ElasticBody) -> HalfSpace:
        """Return the half-space itself, which loads do not displace."""
        del elastic
        return self


@lru_cache(maxsize=4)
def _influences(
    shape: tuple[int, ...], spacing: tuple[float, ...], shear: float, poisson: float, depth: float
) -> Array:
    """Return displacements by unit forces on cells at all distances of two nodes of a grid (d, d, 2 m - 1, ...)."""
    if len(shape) == 1:
        influences = _in_plane(np.asarray(spacing[0] * np.arange(shape[0])), spacing[0], shear, poisson, depth)
    else:
        influences = _in_space_on_grid(shape, spacing, shear, poisson)
    d = len(shape) + 1
    displacements = np.zeros((d, d, *(2 * count - 1 for count in shape)))
    every: list[Any] = [EVERY, EVERY]
    displacements[tuple(every + [slice(count - 1, None) for count in shape])] = np.moveaxis(
        influences, (-2, -1), (0, 1)
    )
    displacements /= np.prod(spacing)
    for axis, count in enumerate(shape):  # mirrored along an axis, components with one share in it change their sign
        turned = np.ones(d)
        turned[axis] = -1.0
        behind, ahead = ([*every, *every[: len(shape)]] for _ in range(2))
        behind[2 + axis], ahead[2 + axis] = slice(0, count - 1), slice(2 * count - 2, count - 1, -1)
        sign = np.outer(turned, turned).reshape(d, d, *(1,) * len(shape))
        displacements[tuple(behind)] = sign * displacements[tuple(ahead)]
    return displacements


def half_space(request: Request) -> HalfSpace:
    """Return a body as a half-space, at the places of its patterns; collective.

    Raises:
        CaseError: it is of rings, of several materials or not isotropic, a support moves it, or its contact nodes make
            no regular grid, each with as much of the surface as the others.
    """
    elastic, key = request.elastic, f"{request.elastic.body.name}.operator"
    if elastic.law.kind == "axisymmetric":
        raise CaseError(InputError(key, "expected 'condensed' for rings: 'half-space' is of plane models and solids"))
    if elastic.surface.degree != 1:
        message = f"expected 1 with {key} = 'half-space': all contact nodes then have equal areas"
        raise CaseError(InputError("geometry.degree", message))
    if elastic.moved:
        message = "expected a load: 'half-space' has no supports that could move it"
        raise CaseError(InputError(f"{elastic.body.name}.supports", message))
    surface = elastic.surface
    mean = surface.weights @ surface.outward
    normal = int(np.abs(mean).argmax())
    inner = [axis for axis in range(elastic.dim) if axis != normal]
    places, spacing = _grid(request.places[:, inner], surface.weights, key)
    low, high = extent_along(elastic, normal)
    return HalfSpace(
        places,
        spacing,
        *constants_of(elastic, key),
        axes=(*inner, normal),
        outward=float(np.sign(mean[normal])),
        depth=high - low if elastic.dim == 2 else np.inf,
        along=request.even_direction,
    )


def _grid(x: Array, weights: Array, key: str) -> tuple[NDArray[np.int64], tuple[float, ...]]:
    """Return the places of nodes (q, m) on a regular grid, and its spacing, mm; weights (n,) are of the surface.

    Raises:
        CaseError: they are not on one, or leave some of it out.
    """
    extent = np.ptp(x, axis=0)
    steps = np.diff(np.sort(x, axis=0), axis=0)
    least = np.where(steps > UNEVEN * np.sqrt(np.prod(extent) / len(x)), steps, np.inf).min(axis=0, initial=np.inf)
    counts = np.rint(extent / least)
    spacing = extent / np.maximum(counts, 1)
    off = (x - x.min(axis=0)) / spacing
    places = np.rint(off).astype(np.int64)
    regular = np.isfinite(least).all() and np.abs(off - places).max() <= UNEVEN
    if not regular or weights.max() > WIDE * np.prod(spacing):
        message = "expected contact nodes on a regular grid for 'half-space': even elements over all of the contact"
        raise CaseError(InputError(key, message))
    return places, tuple(float(step) for step in spacing)


def extent_along(elastic: ElasticBody, axis: int) -> tuple[float, float]:
    """Return the ends of a body along an axis, mm; collective."""
    comm, x = elastic.body.mesh.comm, elastic.body.mesh.geometry.x[:, axis]
    least = comm.allreduce(x.min(initial=np.inf), op=MPI.MIN)
    return float(least), float(comm.allreduce(x.max(initial=-np.inf), op=MPI.MAX))


def influence(x: Array, sides: Sequence[float], shear: float, poisson: float, depth: float = np.inf) -> Array:
    """Return the displacement at places from uniform unit tractions on a rectangle about 0 (k, d, d), mm/MPa.

    Components along the surface, then into the body; sources last.

    Args:
        x: The places (k, d - 1), mm.
        sides: Of the rectangle, in the plane of a strip (d - 1,), mm.
        shear, poisson: G, MPa, and nu.
        depth: From which displacements count in the plane, mm.
    """
    return (
        _in_plane(x[:, 0], sides[0], shear, poisson, depth) if len(sides) == 1 else _in_space(x, sides, shear, poisson)
    )


def _in_plane(x: Array, side: float, shear: float, poisson: float, depth: float) -> Array:
    log, sign = np.zeros(len(x)), np.zeros(len(x))  # integrals of ln(D / |x|) and of sign x over the strip
    for i in (1, -1):
        end = x + i * side / 2
        log -= i * end * (np.log(np.abs(end) / depth) - 1)
        sign += i * np.abs(end)
    displacements = np.zeros((len(x), 2, 2))
    for k, moved in enumerate((side / 2, -side / 2)):
        displacements[:, k, k] = (1 - poisson) * log + moved
    displacements[:, 1, 0] = np.pi / 2 * (0.5 - poisson) * sign
    displacements[:, 0, 1] = -displacements[:, 1, 0]
    return np.asarray(displacements / (np.pi * shear))


def _in_space(x: Array, sides: Sequence[float], shear: float, poisson: float) -> Array:
    far, sign = np.abs(x), np.sign(x)  # logarithms of X + r, X < 0, would lose digits
    square = sum(
        i * j * _at_corners(far[:, 0] + i * sides[0] / 2, far[:, 1] + j * sides[1] / 2)
        for i in (1, -1)
        for j in (1, -1)
    )
    return _from_squares(np.asarray(square), sign, shear, poisson)


def _in_space_on_grid(shape: Sequence[int], sides: Sequence[float], shear: float, poisson: float) -> Array:
    """Return the compliances at all nodes of a grid from 0 on (m, n, d, d): a corner of its cells serves four nodes."""
    across, along = (side * (np.arange(count + 1) - 0.5) for side, count in zip(sides, shape, strict=True))
    at = _at_corners(*np.broadcast_arrays(across[:, None], along))
    square = at[:, 1:, 1:] - at[:, 1:, :-1] - at[:, :-1, 1:] + at[:, :-1, :-1]
    sign = np.ones((*shape, 2))
    sign[0, :, 0] = sign[:, 0, 1] = 0.0
    return _from_squares(square, sign, shear, poisson)


def _at_corners(X: Array, Y: Array) -> Array:
    """Return the antiderivatives of x²/r³, y²/r³, x y/r³, x/r² and y/r² at a rectangle's corners (5, ...)."""
    r = np.hypot(X, Y)
    half = np.log(r)
    parts = (Y * np.log(X + r), X * np.log(Y + r), -r, Y * half + X * np.arctan(Y / X), X * half + Y * np.arctan(X / Y))
    return np.array(parts)


def _from_squares(square: Array, sign: Array, shear: float, poisson: float) -> Array:
    """Return displacements (..., d, d) from these integrals (5, ...), and the signs of the coordinates (..., 2)."""
    xx, yy, xy, fx, fy = square
    xy, fx, fy = xy * sign.prod(axis=-1), fx * sign[..., 0], fy * sign[..., 1]
    displacements = np.zeros((*xx.shape, 3, 3))
    over_r = xx + yy
    displacements[..., 0, 0], displacements[..., 1, 1] = (
        (1 - poisson) * over_r + poisson * xx,
        (1 - poisson) * over_r + poisson * yy,
    )
    displacements[..., 0, 1] = displacements[..., 1, 0] = poisson * xy
    displacements[..., 2, 2] = (1 - poisson) * over_r
    for k, f in enumerate((fx, fy)):
        displacements[..., 2, k], displacements[..., k, 2] = (0.5 - poisson) * f, -(0.5 - poisson) * f
    return np.asarray(displacements / (2 * np.pi * shear))
