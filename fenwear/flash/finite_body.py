"""What a finite body adds at its contact to the half-space that the kernels are of: smooth, one solution of a mesh.

A half-space of the contact's conductivity K_1 under a unit of power that enters at points y_i with shares P_i has

    U = sum of P_i / (2 pi K_1 |x - y_i|),

and the body has U + w in the steady state that its means come to. What U does not know of leaves heat on the other
boundaries and in other materials K:

    a(w, v) = integral of K grad w . grad v, and of h w v over what convects,
            = - integral of K_1 dU/dn v over the boundary, of (K - K_1) grad U . grad v, and of h U v where it convects,
    w = -U where temperatures are held,

so that w is smooth at the contact, as in `fenwear.bodies.correction`. The points, three along each axis, have the
moments of the heat up to the third order. Nearer to them than heat is wide the surface is that of the half-space.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc
from scipy.interpolate import RegularGridInterpolator

from fenwear.arrays import Array
from fenwear.bodies.assembly import assembled_vector, compiled
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid import RegularGrid
from fenwear.flash.partition import Bulk
from fenwear.heat.conduction import CONTACT as TOUCHING
from fenwear.heat.conduction import CONVECTING, HELD, INSULATED, HeatBody

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
    """Return what a finite body adds to a half-space at the middle of its heat; None where it has no steady state.

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
    own, load = _half_space(body, conductivity, grid, spots)
    lifted = np.zeros(body.owned)
    lifted[body.held] = -own[body.held]
    change = load - step.apply(lifted[:, None])[0][:, 0]
    besides = lifted + step.respond(change[:, None])[:, 0]
    base = step.advance(np.zeros(body.owned))
    step.free()
    there = _at_spots(body, elastic, spots, np.stack([base, besides], axis=1))
    return Bulk(float(there[0]) - body.heat.ambient, float(there[1]))


def _half_space(body: HeatBody, conductivity: float, grid: RegularGrid, spots: Spots) -> tuple[Array, Array]:
    """Return U at the own nodes (owned,), and what it leaves on the body as loads (owned,); collective."""
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
    own, load = np.zeros(body.owned), np.zeros(body.owned)
    for place, share in zip(np.insert(spots.places, grid.normal, grid.level, axis=1), spots.shares, strict=True):
        source.value[:] = place
        load += share * assembled_vector(form)
        with np.errstate(divide="ignore"):  # at the points themselves, where nothing is held
            own += share / (2 * np.pi * conductivity * np.linalg.norm(places - place, axis=1))
    return own, load


def _at_spots(body: HeatBody, elastic: ElasticBody, spots: Spots, fields: Array) -> Array:
    """Return means over the heat of smooth fields (owned, k), as (k,); collective."""
    grid = elastic.surface.grid
    assert grid is not None
    values = elastic.on_surface(body.trace.pick(fields)[:, 0]).reshape(*grid.counts, -1)
    along = [
        low + side * np.arange(count) for low, side, count in zip(grid.corner, grid.spacing, grid.counts, strict=True)
    ]
    read = RegularGridInterpolator(along, values)
    inside = np.clip(spots.places, [one[0] for one in along], [one[-1] for one in along])
    return np.asarray(spots.shares @ read(inside))
