"""The contact surface of a body: its trace as a small mesh, the same on every rank.

Displacements and temperatures live on the trace nodes, pressures and heat fluxes on the pressure
nodes. Both are the same nodes where the shape functions of the trace have positive integrals at
Gauss-Lobatto nodes: on lines and quadrilaterals of any degree. Quadratic triangles have integrals of
zero at their vertices; there the pressure lives on the vertices alone, in the dual piecewise linear
basis psi_i = 4 lambda_i - 1. On the axis of rings a node of degree 2 or more has no weight, as 2 pi r
is zero there: no pressure lives on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from fenwear.algebra.assembled import assembled_vector
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.round_surfaces import Round, rounds_of
from fenwear.case.body_tables import Profile
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError

CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}
NO_WEIGHT = 1e-9  # of the largest: what rounding leaves
BETWEEN = 0.1  # of the mean length of several curves: the gap between two of them
REACH = 1e-6  # of the surface's size: how far it may reach beyond the points of its profile
WRAPS = 1e-3  # component of the normal along its mean, with the sign turned: from there on a surface is no graph
CLOSING = 1.5  # of the longest distance of two points: the one over the seam of a closed curve
NEAREST = 12  # points of a profile in space between which it is read on a surface that wraps around


FLAT: Array = np.zeros(1)  # a profile of a surface that has none


@dataclass(frozen=True)
class ContactSurface:
    """The contact surface of a body in d dimensions, with N trace nodes and n pressure nodes.

    Attributes:
        body: Name of the body.
        trace: Coordinates of the trace nodes (N, d), mm, in ascending order of x, then y, then z; on curves that are
            no graphs over x along the curve.
        facets: Trace nodes of each facet (f, k), in the order of the Lagrange element on `cell`.
        cell: "interval", "triangle" or "quadrilateral".
        degree: Polynomial degree of the trace.
        nodes: Trace nodes that carry a pressure (n,).
        weights: Integrals of the pressure nodes' functions over the surface (n,), all positive; mm in
            the plane, mm² in a solid and in an axisymmetric body.
        outward: Unit normals out of the body at the pressure nodes (n, d).
        spread: Forces at the trace nodes from a unit force at each pressure node (N, n).
        profile: By how much the surface lies deeper in the body than its mesh at the pressure nodes (n,), mm; one zero
            where they are the same.
        names: Of the contacts that the surface is of; none where it is one.
        contact: Which of them each pressure node belongs to (n,); None where it is one.
        arc: Of a curve that is no graph over x the arc length at the trace nodes (N,), mm, see `arc_length`; else None.
        grid: Of a surface that is a regular grid and no trace of a mesh; else None.
        sag: Depth of the mesh below a grid at its nodes (n,), mm, a part of the profile; one zero without a grid.
        made: The same as its mesh was made, where that has followed the wear since; else None.
        heights: Of a topography on it (n,), mm; one zero without.
    """

    body: str
    trace: Array
    facets: NDArray[np.int64]
    cell: str
    degree: int
    nodes: NDArray[np.int64]
    weights: Array
    outward: Array
    spread: csr_array
    profile: Array = field(default_factory=lambda: FLAT)
    arc: Array | None = None
    names: tuple[str, ...] = ()
    contact: NDArray[np.int64] | None = None
    grid: RegularGrid | None = None
    sag: Array = field(default_factory=lambda: FLAT)
    made: ContactSurface | None = None
    heights: Array = field(default_factory=lambda: FLAT)

    @cached_property
    def part(self) -> NDArray[np.int64]:
        """The number of the connected part of the surface that each pressure node belongs to (n,)."""
        ring = np.roll(self.facets, -1, axis=1)
        graph = csr_array((np.ones(ring.size), (self.facets.ravel(), ring.ravel())), shape=(len(self.trace),) * 2)
        _, part = connected_components(graph, directed=False)
        return np.asarray(np.unique(part[self.nodes], return_inverse=True)[1], dtype=np.int64)

    @cached_property
    def number(self) -> NDArray[np.int64]:
        """Number of each trace node among the contact's nodes (N,); -1 of one that carries no pressure."""
        numbers = np.full(len(self.trace), -1)
        numbers[self.nodes] = np.arange(len(self.nodes))
        return numbers

    @cached_property
    def rounds(self) -> tuple[list[Round], NDArray[np.int64]]:
        """Round parts of the surface as meshed, and the part of each trace node, -1 for none (N,)."""
        if self.made is not None:
            return self.made.rounds
        number = np.full(len(self.trace), -1)
        number[self.nodes] = self.part
        outward = np.zeros_like(self.trace)
        outward[self.nodes] = self.outward
        return rounds_of(self.trace, self.facets, number[self.facets].max(axis=1), outward)

    @cached_property
    def abscissa(self) -> Array:
        """Places of the pressure nodes along a curve (n,), ascending, mm: x, or the arc length; in a solid x."""
        return self.x[:, 0] if self.arc is None else self.arc[self.nodes]

    @cached_property
    def places(self) -> Array:
        """Places of the pressure nodes in profiles, mm: in the plane x or the arc length (n, 1).

        In a solid the coordinates across its mean normal (n, 2); all of them (n, 3) where it is no graph over these.
        """
        if self.arc is not None:
            return self.abscissa[:, None]
        mean = self.weights @ self.outward
        axis = int(np.abs(mean).argmax())
        turned = self.dim == 3 and (self.outward[:, axis] * np.sign(mean[axis])).min() < -WRAPS
        return self.x if turned else np.delete(self.x, axis, axis=1)

    @cached_property
    def length_around(self) -> float:
        """Length of a closed curve, mm; 0 of all else."""
        ends = self.facets[:, :2]
        if self.arc is None or self.part.max() > 0 or (np.bincount(ends.ravel())[ends] != 2).any():
            return 0.0
        first, last = self.arc.argmin(), self.arc.argmax()
        return float(np.ptp(self.arc) + np.linalg.norm(self.trace[last] - self.trace[first]))

    @cached_property
    def x(self) -> Array:
        """Coordinates of the pressure nodes (n, d), mm."""
        return self.trace[self.nodes]

    def nodes_of(self, name: str) -> Mask:
        """Return which pressure nodes belong to a named contact (n,)."""
        assert self.contact is not None
        return self.contact == self.names.index(name)

    @property
    def unworn(self) -> Array:
        """Places of the unworn surface at the pressure nodes (n, d), mm: that of the mesh, and its profile."""
        return np.asarray(self.x - self.profile[:, None] * self.outward)

    @property
    def deeper(self) -> Array:
        """The profile at each pressure node (n,), mm."""
        return np.broadcast_to(self.profile, self.weights.shape)

    @property
    def below_mesh(self) -> Array:
        """By how much the unworn surface lies deeper in the body than its mesh at the pressure nodes (n,), mm."""
        return np.asarray(self.deeper - self.sag)

    @cached_property
    def extension(self) -> csr_array:
        """Interpolation from the pressure nodes to the trace nodes (N, n): linear on triangles.

        Elsewhere only a node on the axis of rings has no pressure: it takes its neighbour's value.
        """
        if self.cell != "triangle":
            column = np.full(len(self.trace), -1)
            column[self.nodes] = np.arange(len(self.nodes))
            for lone in np.flatnonzero(column < 0):  # one at most
                column[lone] = np.linalg.norm(self.x - self.trace[lone], axis=1).argmin()
            shape = (len(self.trace), len(self.nodes))
            return csr_array((np.ones(shape[0]), (np.arange(shape[0]), column)), shape=shape)
        corners = np.searchsorted(self.nodes, self.facets[:, :3])
        _, first = np.unique(self.facets, return_index=True)  # any facet of a node does: they agree where they meet
        facet, place = np.divmod(first, self.facets.shape[1])
        values = corner_functions("triangle", _lagrange("triangle", self.degree).points)[place]
        rows = np.broadcast_to(np.arange(len(first))[:, None], values.shape)
        return csr_array((values.ravel(), (rows.ravel(), corners[facet].ravel())))

    @property
    def dim(self) -> int:
        """Number of space dimensions d."""
        return self.trace.shape[1]

    def extent(self) -> float:
        """Return the largest extent of the surface along an axis, mm."""
        return float(np.ptp(self.trace, axis=0).max())

    def spacing(self) -> float:
        """Return the spacing of contact nodes, mm: the median."""
        if self.dim == 3:
            return float(np.sqrt(np.median(self.weights)))
        return float(np.median(np.diff(self.abscissa)))


def profiled(surface: ContactSurface, profile: Profile) -> ContactSurface:
    """Return a surface with a profile, as it was meshed but for that.

    Raises:
        CaseError: the points do not reach over the surface, two are at one place, or they go along what it has not.
    """
    key, points = f"{surface.body}.profile", np.array(profile.points)
    if surface.arc is None and profile.along == "arc":
        raise CaseError(InputError(f"{key}.along", "the contact surface is a graph over x: expected [x, depth]"))
    if surface.arc is not None and profile.along != "arc":
        message = "several places of the contact surface have one x: expected along = 'arc' and [s, depth], s as in "
        raise CaseError(InputError(f"{key}.along", message + "the file that export --worn writes"))
    length, rows = surface.length_around, np.sort(points[:, 0])
    if length and length - np.ptp(rows) <= CLOSING * np.diff(rows).max():
        points = np.concatenate([points + np.array([turn * length, 0.0]) for turn in (-1, 0, 1)])
        points = points[np.unique(np.round(points[:, 0] / (REACH * length)), return_index=True)[1]]
    return replace(surface, profile=profile_at(surface.body, points, surface.places))


def profile_at(body: str, points: Array, x: Array) -> Array:
    """Return the depths of a profile at places (n,), mm: linear between its points, in space on Delaunay's triangles.

    On a solid's surface that is no graph they are the linear radial functions through the nearest points.

    Args:
        body: Whose it is.
        points: `ContactSurface.places` and depths (k, d), mm.
        x: The places of the nodes (n, d - 1), or of a solid's surface that is no graph (n, d), mm.

    Raises:
        CaseError: the points do not reach over all places, or two of them are at one place.
    """
    from scipy.interpolate import (  # which take long to load
        LinearNDInterpolator,
        NearestNDInterpolator,
        RBFInterpolator,
    )

    key = f"{body}.profile.points"
    places, depth = points[:, :-1], points[:, -1]
    if places.shape[1] != x.shape[1]:
        expected = {1: "[x, depth]", 2: "[x, y, depth]", 3: "[x, y, z, depth]"}[x.shape[1]]
        raise CaseError(InputError(key, f"expected rows {expected} for this model, got {points.shape[1]} numbers"))
    slack = REACH * float(np.ptp(x, axis=0).max())
    low, high = places.min(axis=0), places.max(axis=0)
    if len(np.unique(places, axis=0)) < len(places):
        raise CaseError(InputError(key, "two points are at the same place; expected each place once"))
    if (x.min(axis=0) < low - slack).any() or (x.max(axis=0) > high + slack).any():
        spans = [f"{a:g} to {b:g} mm" for a, b in ((low[0], high[0]), (x[:, 0].min(), x[:, 0].max()))]
        raise CaseError(
            InputError(key, f"spans x = {spans[0]}, but the contact surface {spans[1]}. Give values on all of it")
        )
    if x.shape[1] == 1:
        order = places[:, 0].argsort()
        return np.asarray(np.interp(x[:, 0], places[order, 0], depth[order]))
    if x.shape[1] == 3:
        near = RBFInterpolator(places, depth, neighbors=min(NEAREST, len(places)), kernel="linear")
        return np.asarray(near(x))
    values = LinearNDInterpolator(places, depth)(x)
    outside = np.isnan(values)  # by rounding, or in a corner that the points' hull leaves out
    values[outside] = NearestNDInterpolator(places, depth)(x[outside]) if outside.any() else 0.0
    return np.asarray(values)


class Trace:
    """A contact surface among the degrees of freedom of one Lagrange space, scalar or vector, on its body.

    Attributes:
        surface: The contact surface.
        blocks: Global number of the block of degrees of freedom at each trace node (N,).
    """

    def __init__(self, surface: ContactSurface, space: fem.FunctionSpace, blocks: NDArray[np.int64]) -> None:
        self.surface, self.blocks = surface, blocks
        self._comm = space.mesh.comm
        index_map = space.dofmap.index_map
        start, stop = index_map.local_range
        self._size, self._block_size = stop - start, space.dofmap.index_map_bs
        self.owned = np.flatnonzero((blocks >= start) & (blocks < stop))
        self.local = blocks[self.owned] - start

    def pick(self, fields: Array) -> Array:
        """Return fields at the trace nodes (N, components, k), equal on every rank; collective.

        Args:
            fields: Owned degrees of freedom of k fields (owned, k).
        """
        components = self._block_size
        picked = np.zeros((len(self.blocks), components, fields.shape[1]))
        picked[self.owned] = fields.reshape(self._size, components, fields.shape[1])[self.local]
        self._comm.Allreduce(MPI.IN_PLACE, picked, op=MPI.SUM)  # each node has one owner: exact
        return picked

    def place(self, loads: Array) -> Array:
        """Return loads at the trace nodes (N, components, k) on the owned degrees of freedom (owned, k)."""
        placed = np.zeros((self._size, *loads.shape[1:]))
        placed[self.local] = loads[self.owned]
        return placed.reshape(self._size * self._block_size, loads.shape[2])

    @cached_property
    def rows(self) -> csr_array:
        """The matrix that picks this rank's part of a scalar field at the trace nodes (N, owned)."""
        shape = (len(self.blocks), self._size)
        return csr_array((np.ones(len(self.owned)), (self.owned, self.local)), shape=shape)


def contact_tag(body: BodyMesh) -> int:
    """Return the tag of the facets of the contact."""
    return body.curves[f"{body.name}_contact"]


def contact_surface(body: BodyMesh, space: fem.FunctionSpace, measure: Any = 1.0) -> tuple[ContactSurface, Trace]:
    """Gather the contact surface of a body and its trace of a space; collective.

    Args:
        body: The body.
        space: Vector Lagrange space of the displacement.
        measure: Of the surface by that of the mesh, in UFL: 2 pi r for axisymmetric bodies.

    Raises:
        CaseError: two named contacts meet, or an element has next to no area.
    """
    mesh, fdim = body.mesh, body.mesh.topology.dim - 1
    degree, dim = space.ufl_element().degree, mesh.geometry.dim
    cell = basix.cell.subentity_types(space.element.basix_element.cell_type)[fdim][0].name
    points = space.tabulate_dof_coordinates()[:, :dim]
    local, cells = facet_dofs(body, space)
    local = np.take_along_axis(local, _in_reference_order(local, points, cell, degree), axis=1)
    numbers = space.dofmap.index_map.local_to_global(local.ravel()).astype(np.int64).reshape(local.shape)
    inner = points[space.dofmap.list[cells]].mean(axis=1)
    gathered = mesh.comm.allgather((numbers, points[local], inner, _contact_numbers(body)))
    facets, coordinates, inner, contact = (np.concatenate(parts) for parts in zip(*gathered, strict=True))
    blocks, first, inverse = np.unique(facets, return_index=True, return_inverse=True)
    trace = coordinates.reshape(-1, dim)[first]
    arc = arc_length(trace, inverse.reshape(facets.shape), inner, body.name == "strip") if dim == 2 else None
    order = _ascending(trace if arc is None else arc[:, None])
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    facets = rank[inverse.reshape(facets.shape)]
    by_nodes = np.lexsort(facets.T[::-1])  # the same on any number of ranks
    facets, inner, contact = facets[by_nodes], inner[by_nodes], contact[by_nodes]
    trace, blocks = trace[order], blocks[order]
    if cell == "triangle":
        surface = vertex_surface(body.name, trace, facets, degree, inner)
    else:
        weights, outward = _integrals(body, space, measure, blocks)
        nodes = np.flatnonzero(weights > NO_WEIGHT * weights.max(initial=0.0))
        _check_sizes(body, np.asarray(np.isin(facets, nodes).any(axis=1)))
        spread = csr_array((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(len(trace), len(nodes)))
        surface = ContactSurface(body.name, trace, facets, cell, degree, nodes, weights[nodes], outward[nodes], spread)
        surface = replace(surface, arc=None if arc is None else arc[order])
    if body.contacts:
        _check_apart(body, [np.unique(facets[contact == k]) for k in range(len(body.contacts))])
        of_trace = np.zeros(len(trace), dtype=np.int64)
        of_trace[facets] = contact[:, None]
        surface = replace(surface, names=tuple(body.contacts), contact=of_trace[surface.nodes])
    return surface, Trace(surface, space, blocks)


def trace_of(surface: Trace, vector: fem.FunctionSpace, space: fem.FunctionSpace) -> Trace:
    """Return the trace of another space of the same degree on the same mesh; collective.

    Args:
        surface: The trace of `vector`.
        vector: Function space of `surface`.
        space: The other space, which may number its nodes in another way.
    """
    index_map = vector.dofmap.index_map
    other = np.empty(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    other[vector.dofmap.list.ravel()] = space.dofmap.list.ravel()
    blocks = np.zeros(len(surface.blocks), dtype=np.int64)
    blocks[surface.owned] = space.dofmap.index_map.local_to_global(other[surface.local])
    space.mesh.comm.Allreduce(MPI.IN_PLACE, blocks, op=MPI.SUM)
    return Trace(surface.surface, space, blocks)


def facet_dofs(body: BodyMesh, space: fem.FunctionSpace) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the local blocks of this rank's own contact facets (f, k), corners first, and their cells (f,)."""
    topology, fdim = body.mesh.topology, body.mesh.topology.dim - 1
    topology.create_connectivity(fdim, fdim + 1)
    topology.create_connectivity(fdim + 1, fdim)
    facets = _owned_facets(body)
    to_cell, to_facet = topology.connectivity(fdim, fdim + 1), topology.connectivity(fdim + 1, fdim)
    closures = space.element.basix_element.entity_closure_dofs[fdim]
    cells = np.array([to_cell.links(facet)[0] for facet in facets], dtype=np.int32)
    numbers = [int(np.flatnonzero(to_facet.links(c) == f)[0]) for c, f in zip(cells, facets, strict=True)]
    local_blocks = [space.dofmap.cell_dofs(c)[sorted(closures[k])] for c, k in zip(cells, numbers, strict=True)]
    return np.array(local_blocks, dtype=np.int32).reshape(-1, len(closures[0])), cells


def _owned_facets(body: BodyMesh) -> NDArray[np.int32]:
    """Return the contact facets that this rank owns (f,)."""
    facets = body.facet_tags.find(contact_tag(body))
    topology = body.mesh.topology
    return np.asarray(facets[facets < topology.index_map(topology.dim - 1).size_local])


def _contact_numbers(body: BodyMesh) -> NDArray[np.int64]:
    """Return the number of the named contact that each of this rank's own contact facets belongs to (f,)."""
    facets = _owned_facets(body)
    number = np.zeros(len(facets), dtype=np.int64)
    for k, named in enumerate(body.contacts.values()):
        number[np.isin(facets, named)] = k
    return number


def _check_sizes(body: BodyMesh, carries: Mask) -> None:
    """Raise where a facet, of those that carry pressure or not (f,), has none of the contact's area."""
    if not carries.all():
        name, count = f"{body.name}_contact", int(np.count_nonzero(~carries))
        text = f"{name} has {count} elements so much smaller than others that they carry nothing"
        raise CaseError(InputError("geometry", text))


def _check_apart(body: BodyMesh, nodes: Sequence[NDArray[np.int64]]) -> None:
    """Raise where two named contacts, with these trace nodes, meet: a node has to belong to one of them."""
    for (first, first_nodes), (second, other) in combinations(zip(body.contacts, nodes, strict=True), 2):
        if len(both := np.intersect1d(first_nodes, other)):
            text = f"shares {len(both)} nodes with {body.name}_contact_{second}; expected named contacts that lie apart"
            raise CaseError(InputError(f"{body.name}_contact_{first}", text))


def _in_reference_order(local: NDArray[np.int32], points: Array, cell: str, degree: int) -> NDArray[np.int64]:
    """Return the order (f, k) that brings the nodes of each facet to those of the reference element.

    Edges that elements share may run either way in the numbering: nodes are identified by their place.
    """
    reference = _lagrange(cell, degree).points
    x = points[local]
    corners = x[:, : CORNERS[cell]]
    expected = np.einsum("kc,fcd->fkd", corner_functions(cell, reference), corners)
    distance = np.linalg.norm(expected[:, :, None] - x[:, None], axis=3)
    return np.argmin(distance, axis=2)


def _lagrange(cell: str, degree: int) -> Any:
    return basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree, basix.LagrangeVariant.gll_warped)


def corner_functions(cell: str, points: Array) -> Array:
    """Return the linear shape functions of a facet's corners at reference points (q, corners)."""
    linear = basix.create_element(basix.ElementFamily.P, basix.CellType[cell], 1)
    return linear.tabulate(0, points)[0, :, :, 0]


def arc_length(trace: Array, facets: NDArray[np.int64], inner: Array, looks_up: bool) -> Array | None:
    """Return the arc length of the nodes of curves (N,), mm; None of graphs over x beside each other, and of branches.

    It grows with x in the middle of a curve, where it is x. A closed curve is cut where it looks away from the other
    body most, the punch being above the strip. Several curves follow each other by the x of their middles, with gaps
    between them and 0 in the middle of all.

    Args:
        trace: Coordinates of the trace nodes (N, 2), mm.
        facets: Trace nodes of each facet (f, k), ends first.
        inner: A point on the body's side of each facet (f, 2).
        looks_up: Whether the curve touches with its upper side, as the strip's does.
    """
    ends = trace[facets[:, :2], 0]
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.argsort(low, kind="stable")
    grain = 1e-9 * float(np.ptp(trace, axis=0).max())
    if (high[order][:-1] <= low[order][1:] + grain).all() and (high - low > grain).all():
        return None
    graph = csr_array((np.ones(len(facets)), facets[:, :2].T), shape=(len(trace), len(trace)))
    _, curve = connected_components(graph, directed=False)
    arc, curves = np.zeros(len(trace)), []
    for k in np.unique(curve[facets[:, 0]]):
        of_curve = np.flatnonzero(curve[facets[:, 0]] == k)
        along = _along(trace, facets[of_curve], inner[of_curve], looks_up)
        if along is None:
            return None
        nodes = np.unique(facets[of_curve])
        arc[nodes] = along[nodes]
        curves.append(nodes)
    if len(curves) == 1:
        return arc
    curves.sort(key=lambda nodes: tuple(np.round(trace[nodes].mean(axis=0) / grain)))
    lengths = [float(np.ptp(arc[nodes])) for nodes in curves]
    gap = BETWEEN * sum(lengths) / len(lengths)
    begin = -(sum(lengths) + gap * (len(lengths) - 1)) / 2
    for nodes, length in zip(curves, lengths, strict=True):
        arc[nodes] += begin - arc[nodes].min()
        begin += length + gap
    return arc


def _along(trace: Array, facets: NDArray[np.int64], inner: Array, looks_up: bool) -> Array | None:
    """Return the arc length of the nodes of one curve (N,), 0 at all others; None where it branches."""
    grain = 1e-9 * float(np.ptp(trace, axis=0).max())
    at: dict[int, list[int]] = {}  # the facets of each end
    for facet in range(len(facets)):
        for end in facets[facet, :2]:
            at.setdefault(int(end), []).append(facet)
    single = [node for node, beside in at.items() if len(beside) == 1]
    if max(map(len, at.values())) > 2 or len(single) > 2:
        return None
    rounded = np.round(trace / grain)
    lowest, highest = (min(at, key=lambda end: (sign * rounded[end, 1], rounded[end, 0])) for sign in (1, -1))
    hollow = inner[at[lowest][0], 1] < trace[lowest, 1]  # a bore, with its body around it
    cut = lowest if hollow != looks_up else highest
    start = node = min(single, key=lambda end: tuple(rounded[end])) if single else cut
    local = np.argsort(_lagrange("interval", facets.shape[1] - 1).points[:, 0])
    arc, done, length, nodes = np.zeros(len(trace)), set[int](), 0.0, [start]
    while ways := [facet for facet in at[node] if facet not in done]:
        facet = min(ways, key=lambda way: trace[facets[way, :2], 0].sum())  # from a cut on towards smaller x
        done.add(facet)
        chain = facets[facet][local] if facets[facet, 0] == node else facets[facet][local[::-1]]
        sizes = np.linalg.norm(np.diff(trace[chain], axis=0), axis=1)
        arc[chain[1:]] = length + np.cumsum(sizes)
        nodes += chain[1:].tolist()
        length, node = length + float(sizes.sum()), int(chain[-1])
    arc[start] = 0.0
    middle = min(nodes, key=lambda node: abs(arc[node] - length / 2))
    arc[nodes] += trace[middle, 0] - arc[middle]
    return arc


def _ascending(x: Array) -> NDArray[np.int64]:
    """Return the order of points by x, then by y, then by z; equal up to rounding counts as equal."""
    grain = 1e-9 * max(float(np.ptp(x, axis=0).max(initial=0.0)), 1e-300)
    keys = np.round(x / grain)
    return np.lexsort(keys.T[::-1])


def _integrals(
    body: BodyMesh, space: fem.FunctionSpace, measure: Any, blocks: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return the integrals of the trace's shape functions (N,) and the mean normals there (N, d); collective."""
    dim = body.mesh.geometry.dim
    ds = ufl.Measure("ds", domain=body.mesh, subdomain_data=body.facet_tags)(contact_tag(body))
    v = ufl.TestFunction(space)
    start, stop = space.dofmap.index_map.local_range
    local = np.flatnonzero((blocks >= start) & (blocks < stop))
    integrals = np.zeros((2, len(blocks), dim))
    for k, traction in enumerate((ufl.as_vector((1.0,) * dim), ufl.FacetNormal(body.mesh))):
        vector = assembled_vector(measure * ufl.inner(traction, v) * ds)
        integrals[k, local] = vector.reshape(-1, dim)[blocks[local] - start]
    body.mesh.comm.Allreduce(MPI.IN_PLACE, integrals, op=MPI.SUM)
    weights, normals = integrals[0, :, 0], integrals[1]
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return weights, normals / np.where(size > 0, size, 1.0)


def vertex_surface(name: str, trace: Array, facets: NDArray[np.int64], degree: int, inner: Array) -> ContactSurface:
    """Return the surface of triangles, with the pressure on the vertices in the dual linear basis.

    Args:
        name: Of the body.
        trace: Coordinates of the trace nodes (N, 3), mm.
        facets: Trace nodes of each triangle (f, k), corners first.
        degree: Of the trace.
        inner: A point on the body's side of each facet (f, 3).
    """
    corners = facets[:, :3]
    cross = np.cross(trace[corners[:, 1]] - trace[corners[:, 0]], trace[corners[:, 2]] - trace[corners[:, 0]]) / 2
    cross *= np.sign(np.einsum("fd,fd->f", cross, trace[corners].mean(axis=1) - inner))[:, None]
    area = np.linalg.norm(cross, axis=1)
    nodes, place = np.unique(corners, return_inverse=True)
    place = place.reshape(corners.shape)
    weights, normals = np.zeros(len(nodes)), np.zeros((len(nodes), 3))
    for k in range(3):
        np.add.at(weights, place[:, k], area / 3)
        np.add.at(normals, place[:, k], cross / 3)
    # Force at trace node a from the pressure function psi_i: the integral of psi_i phi_a over each facet.
    points, gauss = basix.make_quadrature(basix.CellType.triangle, degree + 1)
    shape = _lagrange("triangle", degree).tabulate(0, points)[0, :, :, 0]
    dual = 4 * corner_functions("triangle", points) - 1
    local = 2 * np.einsum("q,qa,qi->ai", gauss, shape, dual)  # over the facet's area
    values = area[:, None, None] * local / weights[place][:, None, :]
    rows = np.broadcast_to(facets[:, :, None], values.shape)
    columns = np.broadcast_to(place[:, None, :], values.shape)
    spread = csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(len(trace), len(nodes)))
    outward = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return ContactSurface(name, trace, facets, "triangle", degree, nodes, weights, outward, spread)
