"""The difference of a finite body's compliance at its contact from a half-space's: smooth, on a few points.

Under a force F_i at a point y_i of the contact a body moves by U_i + u_i: by what a half-space of the contact's
material does (Boussinesq, Cerruti; in the plane Flamant), and a correction. As the first leaves tractions T_i on the
other boundaries Gamma, moves supports, and does not know other materials C behind the contact's C_1,

    a(u_i, v) = r_i(v) = - integral over Gamma of T_i . v - integral of (C - C_1) eps(U_i) : eps(v),
    u_i = g_i = -U_i where supports hold:

no load on the contact itself, so that u_i is smooth there as long as other boundaries are away, and a coarse mesh is
enough. The displacement of another point of the contact follows from Betti's theorem on u_i and U_j, without values
at the contact: with K for the mesh without supports,

    F_j . u_i(y_j) = r_j . u_i + r_i . U_j - (K u_i - r_i) . g_j,

which is symmetric in i and j but for the second term, where the half-space's own field is taken by its nodal values.
The error falls with twice the order of the elements. On a curved surface the half-space leaves tractions near the
contact, too, of the order of its width over the radius, as Hertz's theory leaves them out: facets below the grid bear
none, and surfaces beside it nearly in its plane bear them more and more up to twice the grid. Loads f move the contact
likewise, F_j . u(y_j) = f . (U_j + u_j).

Points are Chebyshev's of the first kind over the contact grid, and polynomials through them take the correction in
between: L C L^T for forces on the grid. The decay of the polynomials' coefficients shows whether they may.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import exterior_facet_indices, meshtags
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.algebra.assembled import assembled_vector, compiled, interpolate, times
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.elastic_material import Isotropic, measure, strain_of
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.guides import GuideAnswer
from fenwear.common import compat
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import total

IN_PLANE, DEEP = 0.9, 0.25  # normal's component and depth over distance up to which a surface goes on in the plane
EVERY = slice(None)
SAME = 1e-9  # of a material's constants: one material
POINTS = 4  # quadrature's degree above twice that of the elements: the half-space's field is no polynomial


@dataclass(frozen=True)
class Ground:
    """The half-space that a body is at its contact.

    Attributes:
        grid: The contact.
        outward: 1.0 where the normal out of the body points along its axis, else -1.0.
        shear: G, MPa.
        poisson: nu; in plane stress nu / (1 + nu).
        depth: From which displacements count in the plane, mm.
    """

    grid: RegularGrid
    outward: float
    shear: float
    poisson: float
    depth: float

    @property
    def _order(self) -> list[int]:
        return [*self.grid.axes, self.grid.normal]

    def field(self, x: Any, source: Sequence[Any], force: Sequence[Any], by: Any = np) -> list[Any]:
        """Return the displacement at x, a component for each of the model's axes, mm.

        Args:
            x: Coordinates, one for each of the model's axes.
            source: Where the force acts, along the grid.
            force: Components of the force along the model's axes, N, in the plane N/mm.
            by: numpy, or what has `sqrt`, `log` and `arctan2` of UFL.
        """
        order, into = self._order, -self.outward
        along = [x[axis] - at for axis, at in zip(self.grid.axes, source, strict=True)]
        down = into * (x[self.grid.normal] - self.grid.level)
        pushed = [*(force[axis] for axis in self.grid.axes), into * force[self.grid.normal]]
        components = (_in_plane if len(order) == 2 else _in_space)(along, down, pushed, self.poisson, self.depth, by)
        displacement: list[Any] = [None] * len(order)
        for axis, value in zip(order, components, strict=True):
            displacement[axis] = value / (4 * np.pi * self.shear)
        displacement[self.grid.normal] = into * displacement[self.grid.normal]
        return displacement


def _in_plane(along: list[Any], z: Any, force: list[Any], nu: float, depth: float, by: Any) -> list[Any]:
    """Return 4 pi G times Flamant's displacements (Johnson, Contact Mechanics, 1985, sections 2.2 and 2.3)."""
    (x,), (across, down) = along, force
    square, turn = x**2 + z**2, by.arctan2(x, z)
    log = (1 - nu) * by.log(depth**2 / square)  # 2 (1 - nu) ln(D / r)
    u = across * (x**2 / square + log) + down * (x * z / square - (1 - 2 * nu) * turn)
    w = across * (x * z / square + (1 - 2 * nu) * turn) + down * (z**2 / square + log - 1)
    return [2 * u, 2 * w]


def _in_space(along: list[Any], z: Any, force: list[Any], nu: float, _depth: float, by: Any) -> list[Any]:
    """Return 4 pi G times Boussinesq's and Cerruti's displacements (Johnson, sections 3.2 and 3.6)."""
    x, y, *across, down = *along, *force
    square = x**2 + y**2 + z**2
    r, rest = by.sqrt(square), 1 - 2 * nu
    cube, sum_ = square * r, r + z
    outwards = across[0] * x + across[1] * y
    spread = outwards * (1 / cube - rest / (r * sum_**2)) + down * (z / cube - rest / (r * sum_))
    u = [force_k * (1 / r + rest / sum_) + at * spread for force_k, at in zip(across, along, strict=True)]
    return [*u, outwards * (z / cube + rest / (r * sum_)) + down * (z**2 / cube + 2 * (1 - nu) / r)]


class _InUfl:
    """The functions of the fields, in UFL."""

    sqrt, log, arctan2 = staticmethod(ufl.sqrt), staticmethod(ufl.ln), staticmethod(ufl.atan2)


@dataclass(frozen=True)
class Correction:
    """The correction between m points of the contact, along a directions.

    Attributes:
        counts: Points along the axes of the grid.
        response: Displacement at each point along each direction, from unit forces at each (m, a, m, d), mm.
        fields: Displacement of this rank's own degrees of freedom from unit forces at each point along each direction
            (owned, m, a), mm: what loads do on them they do to the contact.
        uneven: Largest asymmetry of the response, mm/N, in the plane mm/(N/mm).
        guided: Response of the body to its guides; the moments about what they hold of the tractions that unit forces
            at the points leave on the body (m, d, g), those of the forces themselves but for quadrature; and what their
            couples move at the points (m, d, g).
    """

    counts: tuple[int, ...]
    response: Array
    fields: Array
    uneven: float
    guided: tuple[GuideAnswer, Array, Array]


def chebyshev_points(count: int, low: float, high: float) -> Array:
    """Return Chebyshev's points of the first kind (count,) of an interval, ascending."""
    return np.asarray((low + high) / 2 + (high - low) / 2 * chebyshev.chebpts1(count))


def interpolation(count: int, low: float, high: float, x: Array) -> Array:
    """Return the matrix from values at Chebyshev's points of an interval to their polynomial at x (k, count)."""
    at = chebyshev.chebvander((2 * x - low - high) / (high - low), count - 1)
    return np.asarray(at @ coefficients(count))


def coefficients(count: int) -> Array:
    """Return the matrix from values at Chebyshev's points to the coefficients of their polynomial (count, count)."""
    return np.asarray(np.linalg.inv(chebyshev.chebvander(chebyshev.chebpts1(count), count - 1)))


def correct(elastic: ElasticBody, ground: Ground, counts: tuple[int, ...], along: Array) -> Correction:
    """Solve for the correction of a body; collective.

    Args:
        elastic: The body.
        ground: The half-space that it is at the contact.
        counts: Points along the axes of the grid.
        along: Directions that displacements are asked for along (a, d).

    Raises:
        ConvergenceError: its stiffness has no factor.
    """
    grid, comm = ground.grid, elastic.body.mesh.comm
    ends = list(zip(counts, grid.corner, np.array(grid.corner) + grid.sides, strict=True))
    points = np.stack(
        np.meshgrid(*(chebyshev_points(k, low, high) for k, low, high in ends), indexing="ij"), axis=-1
    ).reshape(-1, len(ends))
    loads = _loads(elastic, ground, points)  # (owned, m, d)
    size, m, d = loads.shape
    held = elastic.supported
    nodal = _nodal(elastic, ground, points)
    loaded = (np.abs(loads).max(axis=(1, 2)) > 0) | np.isin(np.arange(size), held)
    nodal[~loaded & (elastic.load == 0)] = 0.0  # beside the contact, where it is not finite
    asked = np.einsum("smd,ad->sma", loads, along).reshape(size, -1)
    lifted = np.zeros_like(asked)
    lifted[held] = -np.einsum("smd,ad->sma", nodal[held], along).reshape(len(held), -1)
    stiffness = elastic.free_stiffness()
    right = asked - times(stiffness, lifted)
    right[held] = 0.0
    moved = lifted + elastic.solve(right)
    reaction = times(stiffness, moved) - asked
    stiffness.destroy()
    every, flat_nodal = loads.reshape(size, -1), nodal.reshape(size, -1)
    response = moved.T @ every + asked.T @ flat_nodal
    response += reaction[held].T @ flat_nodal[held]  # -g_j there
    response = total(comm, response).reshape(m, along.shape[0], m, d)
    part = np.einsum("iajd,bd->iajb", response, along).reshape(m * len(along), -1)
    rest = (part.T - part) / 2
    change = rest.reshape(m, len(along), m, len(along))
    response = response + np.einsum("iajb,bd->iajd", change, along)
    fields = moved.reshape(size, m, -1) + np.einsum("smd,ad->sma", nodal, along)
    uneven = float(2 * np.abs(rest).max())
    moments = np.moveaxis(elastic.couple_of(every).reshape(-1, m, d), 0, 2)
    return Correction(counts, response, fields, uneven, (elastic.guide_answer, moments, np.zeros_like(moments)))


def _loads(elastic: ElasticBody, ground: Ground, points: Array) -> Array:
    """Return r of unit forces at points (m, d - 1) along every axis, at the own degrees of freedom (owned, m, d)."""
    mesh, d = elastic.body.mesh, elastic.dim
    x, v = ufl.SpatialCoordinate(mesh), ufl.TestFunction(elastic.space)
    source, force = (fem.Constant(mesh, np.zeros(k, dtype=PETSc.ScalarType)) for k in (d - 1, d))
    field = ufl.as_vector(ground.field(x, source, force, _InUfl))
    law, kind = elastic.law, elastic.law.kind
    first = 2 * ground.shear * ground.poisson / (1 - 2 * ground.poisson)
    alike = Isotropic(kind, (first, ground.shear))
    degree = 2 * elastic.space.ufl_element().degree + POINTS
    outer = meshtags(mesh, d - 1, *_outer(elastic, ground.grid))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=outer, metadata={"quadrature_degree": degree})
    normal = ufl.FacetNormal(mesh)
    work = -_borne(ground.grid, x, normal) * ufl.inner(alike.stress(field) * normal, v) * measure(mesh, kind) * ds(1)
    cells = _others(elastic, ground)
    if mesh.comm.allreduce(len(cells)):
        tags = meshtags(mesh, d, cells, np.ones(len(cells), dtype=np.int32))
        dx = ufl.Measure("dx", domain=mesh, subdomain_data=tags, metadata={"quadrature_degree": degree})
        differs = law.stress(field) - alike.stress(field)
        work -= ufl.inner(differs, strain_of(v, kind)) * measure(mesh, kind) * dx(1)
    form = compiled(work)
    loads = np.empty((d * elastic.space.dofmap.index_map.size_local, len(points), d))
    for k, place in enumerate(points):
        source.value[:] = place
        for axis in range(d):
            force.value[:] = np.eye(d)[axis]
            loads[:, k, axis] = assembled_vector(form)
    return loads


def _borne(grid: RegularGrid, x: Any, normal: Any) -> Any:
    """Return the share of the tractions that the boundary bears: all, but less where it continues beside the grid."""
    beside = ufl.as_ufl(1.0)
    distance = ufl.as_ufl(0.0)
    for axis, middle, side in zip(grid.axes, grid.middle, grid.sides, strict=True):
        away = abs(x[axis] - float(middle))
        beside = ufl.max_value(beside, 2 * away / float(side))
        distance = ufl.max_value(distance, away)
    near_plane = ufl.And(
        ufl.gt(normal[grid.normal] ** 2, IN_PLANE**2), ufl.lt(abs(x[grid.normal] - grid.level), DEEP * distance)
    )
    return ufl.conditional(near_plane, ufl.min_value(beside - 1, 1.0), 1.0)


def _nodal(elastic: ElasticBody, ground: Ground, points: Array) -> Array:
    """Return the half-space's displacement at the own nodes from unit forces at points (owned, m, d)."""
    owned, d = elastic.space.dofmap.index_map.size_local, elastic.dim
    x = elastic.space.tabulate_dof_coordinates()[:owned, :d].T[:, :, None]
    displacements = np.empty((owned, d, len(points), d))
    with np.errstate(divide="ignore", invalid="ignore"):  # at the points themselves
        for axis in range(d):
            field = ground.field(x, list(points.T), list(np.eye(d)[axis]))
            displacements[..., axis] = np.stack(np.broadcast_arrays(*field), axis=1)
    return displacements.reshape(owned * d, len(points), d)


def _outer(elastic: ElasticBody, grid: RegularGrid) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the facets of the boundary but those below the grid, and ones."""
    mesh = elastic.body.mesh
    mesh.topology.create_connectivity(elastic.dim - 1, elastic.dim)
    facets = exterior_facet_indices(mesh.topology)
    touching = below(elastic, grid, elastic.body.facet_tags.find(contact_tag(elastic.body)))
    facets = np.sort(np.setdiff1d(facets, touching)).astype(np.int32)
    return facets, np.ones(len(facets), dtype=np.int32)


def below(elastic: ElasticBody, grid: RegularGrid, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the facets that lie below a grid at least in part."""
    x = elastic.body.mesh.geometry.x[compat.facet_nodes(elastic.body.mesh, facets)][:, :, grid.axes]
    low, high = np.array(grid.corner), np.array(grid.corner) + grid.sides
    grain = 1e-9 * grid.sides
    meets = (x.min(axis=1) < high - grain) & (x.max(axis=1) > low + grain)
    return np.asarray(facets[meets.all(axis=1)])


def _others(elastic: ElasticBody, ground: Ground) -> NDArray[np.int32]:
    """Return this rank's cells whose material is not that of the contact."""
    constants = cell_constants(elastic)
    of_contact = 2 * ground.shear * ground.poisson / (1 - 2 * ground.poisson), ground.shear
    differs = np.abs(constants - of_contact).max(axis=1) > 1e-9 * max(of_contact)
    return np.flatnonzero(differs).astype(np.int32)


def cell_constants(elastic: ElasticBody) -> Array:
    """Return Lame's lambda and mu in the middle of this rank's cells (cells, 2), MPa."""
    assert isinstance(elastic.law, Isotropic)
    mesh = elastic.body.mesh
    topology = mesh.topology
    count = topology.index_map(topology.dim).size_local + topology.index_map(topology.dim).num_ghosts
    cells = fem.functionspace(mesh, ("DG", 0))
    constants = []
    for parameter in elastic.law.lame:
        function = fem.Function(cells)
        interpolate(ufl.as_ufl(parameter), function)
        constants.append(function.x.array[cells.dofmap.list[:count, 0]])
    return np.stack(constants, axis=1)


def constants_of(elastic: ElasticBody, key: str, cells: NDArray[np.int64] | slice = EVERY) -> tuple[float, float]:
    """Return G, MPa, and nu of the one material of this rank's cells, or of some of them; collective.

    Raises:
        CaseError: there are several materials, or the body is not isotropic.
    """
    if not isinstance(elastic.law, Isotropic):
        raise CaseError(InputError(key, "expected 'condensed' for a stress of one's own: half-spaces are isotropic"))
    constants = np.concatenate(elastic.body.mesh.comm.allgather(cell_constants(elastic)[cells]))
    if (np.ptp(constants, axis=0) > SAME * constants.max()).any():
        message = "expected one material at the contact, got several: take 'condensed', or a smaller grid.size"
        raise CaseError(InputError(key, message))
    first, second = constants[0]
    return float(second), float(first / (2 * (first + second)))
