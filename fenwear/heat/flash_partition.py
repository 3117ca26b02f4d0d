"""The partition of friction heat between two bodies, node by node and at every instant.

    q_1 + q_2 = Q,    kappa Q - q_1 = h_c (theta_1 - theta_2),    theta_1 = theta_2 where h_c has no end,

theta_i = base_i + b_i P_i + T_i q_i by the half-spaces of `fenwear.heat.moving_sources` and what the finite bodies add
to them, in proportion to the mean power P_i that enters each. So

    (T_1 + T_2 + (b_1 + b_2) P + 1 / h_c) q_1 = base_2 - base_1 + T_2 Q + b_2 P Q + kappa Q / h_c

at the nodes in contact; elsewhere nothing enters. GMRES solves it, with the inverse of the symbols of both bodies at
rest before it, (K_1 and K_2) sqrt(k^2 + i n omega / kappa).

The addition of a finite body at its contact to the half-space of the kernels: smooth, one solution of a mesh.

A half-space of the contact's conductivity K_1 under a unit of power that enters at points y_i with shares P_i has

    U = sum of P_i / (2 pi K_1 |x - y_i|),

and the body has U + w in the steady state that its means come to. Effects that U leaves out put heat on the other
boundaries and in other materials K:

    a(w, v) = integral of K grad w . grad v, and of h w v over what convects,
            = - integral of K_1 dU/dn v over the boundary, of (K - K_1) grad U . grad v, and of h U v where it convects,
    w = -U where temperatures are held,

so that w is smooth at the contact, as in `fenwear.bodies.half_space_correction`. The points, three along each axis,
have the moments of the heat up to the third order. Nearer to them than heat is wide the surface is that of
the half-space.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy.fft
import ufl
from dolfinx import fem
from petsc4py import PETSc
from scipy.interpolate import RegularGridInterpolator

from fenwear.algebra.assembled import assembled_vector, compiled
from fenwear.algebra.krylov import flexible
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError
from fenwear.heat.conduction import CONTACT as TOUCHING
from fenwear.heat.conduction import CONVECTING, HELD, INSULATED, HeatBody
from fenwear.heat.moving_sources import Response

ACCURACY, ENOUGH = 1e-9, 1e-6  # residual over the right-hand side: aimed at, and taken
RESTART, RESTARTS = 40, 5


@dataclass(frozen=True)
class Bulk:
    """The addition of a finite body at the contact to the half-space.

    Attributes:
        base: Temperature of the body there without friction, over the surroundings, K.
        per_power: Rise for a unit of mean power into it, K/mW.
    """

    base: float = 0.0
    per_power: float = 0.0


NO_BULK = Bulk()


@dataclass(frozen=True)
class HeatedSide:
    """Either of the bodies.

    Attributes:
        response: The half-space.
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        bulk: Of the finite body.
    """

    response: Response
    conductivity: float
    diffusivity: float
    bulk: Bulk = NO_BULK

    def rise(self, heat: Array, cell: float) -> Array:
        """Return the temperatures over the surroundings (t, m, n), K, of heat into it (t, m, n), mW/mm²."""
        return self.response.apply(heat) + self.bulk.base + self.bulk.per_power * mean_power(heat, cell)


def mean_power(heat: Array, cell: float) -> float:
    """Return the mean heat flow over all instants, mW."""
    return cell * float(heat.sum()) / len(heat)


def shared(
    first: HeatedSide,
    second: HeatedSide,
    heat: Array,
    touching: Mask,
    sides: tuple[float, float],
    period: float,
    *,
    resistance: Array,
    given: float = 0.5,
) -> Array:
    """Return the friction heat that enters the first body (t, m, n), mW/mm².

    Args:
        first, second: The bodies.
        heat: Q (t, m, n), mW/mm².
        touching: Where they touch (t, m, n).
        sides: Of a cell, mm.
        period: Of the cycle, s; infinite where each instant is for itself.
        resistance: 1 / h_c (t, m, n), mm s K/N; zero for none.
        given: kappa, the first body's share of what enters by itself.

    Raises:
        ConvergenceError: it is not found.
    """
    cell = sides[0] * sides[1]
    both = first.bulk.per_power + second.bulk.per_power
    precondition = _Inverse(first, second, touching, sides, period, resistance)

    def inside(values: Array) -> Array:
        return np.where(touching, values, 0.0).ravel()

    def multiply(x: Array) -> Array:
        entering = x.reshape(heat.shape)
        rise = first.response.apply(entering) + second.response.apply(entering) + both * mean_power(entering, cell)
        return inside(rise + resistance * entering)

    right = second.rise(heat, cell) - first.bulk.base + given * resistance * heat
    x, rest, *_ = flexible(
        multiply, lambda x: inside(precondition(x.reshape(heat.shape))), inside(right), ACCURACY, RESTART, RESTARTS
    )
    if not rest <= ENOUGH:
        raise ConvergenceError(f"the share of the friction heat was not found: {rest:.2g} of it is left")
    return x.reshape(heat.shape)


class _Inverse:
    """The inverse of both bodies at rest and of the least resistance between them, on a grid without rims.

    Where the resistance R is larger what a node answers to itself, s, falls as (s + R_0) / (s + R).

    Args:
        first, second: The bodies.
        touching: Where they touch (t, m, n).
        sides: Of a cell, mm.
        period: s.
        resistance: (t, m, n), mm s K/N; zero for none.
    """

    def __init__(
        self,
        first: HeatedSide,
        second: HeatedSide,
        touching: Mask,
        sides: tuple[float, float],
        period: float,
        resistance: Array,
    ) -> None:
        shape = self.shape = touching.shape
        x, y = scipy.fft.fftfreq(shape[1], sides[0]), scipy.fft.rfftfreq(shape[2], sides[1])
        square = (2 * np.pi) ** 2 * (x[:, None] ** 2 + y**2)
        square[0, 0] = square[square > 0].min() / 4
        rate = 2 * np.pi * scipy.fft.fftfreq(shape[0], 1 / shape[0]) / period
        ease = sum(
            1 / (side.conductivity * np.sqrt(square + 1j * rate[:, None, None] / side.diffusivity))
            for side in (first, second)
        )
        least, itself = float(resistance[touching].min()), float(np.mean(ease.real))
        self.share = np.sqrt((itself + least) / (itself + resistance))
        self.symbol = 1 / (ease + least)

    def __call__(self, values: Array) -> Array:
        waves = scipy.fft.fft(scipy.fft.rfftn(self.share * values, axes=(1, 2)), axis=0)
        waves = scipy.fft.ifft(waves * self.symbol, axis=0)
        return np.asarray(self.share * scipy.fft.irfftn(waves, self.shape[1:], axes=(1, 2)))


POINTS = 4  # quadrature's degree above twice that of the elements: the half-space's field is no polynomial
APART = np.sqrt(3.0)  # standard deviations between points of Gauss and Hermite, whose outer ones have a sixth each
OUTER, INNER = 1 / 6, 2 / 3


@dataclass(frozen=True)
class Spots:
    """Points that stand for heat on a plane.

    Attributes:
        places: Along the plane (k, 2), mm.
        shares: Of the power (k,).
        width: Standard deviation of the heat, mm.
    """

    places: Array
    shares: Array
    width: float


def spots_of(x: Array, heat: Array) -> Spots:
    """Return points with the moments of heat up to the third order.

    Args:
        x: Places of nodes along the plane (n, 2), mm.
        heat: Of each (n,), mW.
    """
    weights = heat / heat.sum()
    middle = weights @ x
    spread, axes = np.linalg.eigh((weights[:, None] * (x - middle)).T @ (x - middle))
    deviation = np.sqrt(np.maximum(spread, 0.0))
    signs = np.array(list(product((-1, 0, 1), repeat=2)))
    shares = np.where(signs == 0, INNER, OUTER).prod(axis=1)
    return Spots(middle + APART * (signs * deviation) @ axes.T, shares, float(deviation.max()))


def bulk_of(body: HeatBody, elastic: ElasticBody, conductivity: float, spots: Spots) -> Bulk | None:
    """Return the difference of a finite body from a half-space at the middle of its heat; None without steady state.

    Collective.

    Args:
        body: Conduction in it.
        elastic: The same body, whose contact is a grid.
        conductivity: K_1, N/(s K).
        spots: Where heat enters, on the body's own material.
    """
    if not body.loses_heat():
        return None
    grid = elastic.surface.grid
    assert grid is not None
    step = body.step(0.0, np.inf)
    rises, load = _half_space(body, conductivity, grid, spots)
    lifted = np.zeros(body.owned)
    lifted[body.held] = -rises[body.held]
    change = load - step.apply(lifted[:, None])[0][:, 0]
    besides = lifted + step.respond(change[:, None])[:, 0]
    base = step.advance(np.zeros(body.owned))
    step.free()
    there = _at_spots(body, elastic, spots, np.stack([base, besides], axis=1))
    return Bulk(float(there[0]) - body.heat.ambient, float(there[1]))


def _half_space(body: HeatBody, conductivity: float, grid: RegularGrid, spots: Spots) -> tuple[Array, Array]:
    """Return U at the owned nodes (owned,), and its residual on the body as loads (owned,); collective."""
    mesh, dim = body.body.mesh, body.body.mesh.geometry.dim
    x, v, normal = ufl.SpatialCoordinate(mesh), ufl.TestFunction(body.space), ufl.FacetNormal(mesh)
    source = fem.Constant(mesh, np.zeros(dim, dtype=PETSc.ScalarType))
    away = x - source
    r = ufl.sqrt(ufl.dot(away, away))
    field = 1 / (2 * np.pi * conductivity * r)
    slope = -away / (2 * np.pi * conductivity * r**3)
    degree = {"quadrature_degree": 2 * body.space.ufl_element().degree + POINTS}
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=body.boundary, metadata=degree)
    every = ds((CONVECTING, INSULATED, TOUCHING, HELD))
    beyond = ufl.conditional(ufl.gt(r, max(spots.width, 1e-9)), 1.0, 0.0)
    work = -beyond * conductivity * ufl.dot(slope, normal) * v * every
    if body.heat.convection > 0:
        work -= body.heat.convection * field * v * ds(CONVECTING)
    conductivity_there = ufl.as_ufl(body.law.conductivity)
    differs = (conductivity_there - conductivity) * slope
    work -= ufl.dot(differs, ufl.grad(v)) * ufl.dx(mesh, metadata=degree)
    form = compiled(work)
    places = body.space.tabulate_dof_coordinates()[: body.owned, :dim]
    rises, load = np.zeros(body.owned), np.zeros(body.owned)
    for place, share in zip(np.insert(spots.places, grid.normal, grid.level, axis=1), spots.shares, strict=True):
        source.value[:] = place
        load += share * assembled_vector(form)
        with np.errstate(divide="ignore"):  # at the points themselves, where nothing is held
            rises += share / (2 * np.pi * conductivity * np.linalg.norm(places - place, axis=1))
    return rises, load


def _at_spots(body: HeatBody, elastic: ElasticBody, spots: Spots, fields: Array) -> Array:
    """Return means over the heat of smooth fields (owned, k), as (k,); collective."""
    grid = elastic.surface.grid
    assert grid is not None
    values = elastic.on_surface(body.trace.pick(fields)[:, 0]).reshape(*grid.counts, -1)
    along = [
        low + side * np.arange(count) for low, side, count in zip(grid.corner, grid.spacing, grid.counts, strict=True)
    ]
    read = RegularGridInterpolator(along, values)
    inside = np.clip(
        spots.places, [axis_places[0] for axis_places in along], [axis_places[-1] for axis_places in along]
    )
    return np.asarray(spots.shares @ read(inside))
