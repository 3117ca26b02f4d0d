"""Contact grids of their own: the same regular grid on both bodies, along the stroke longer on the strip.

Both stand in the tangent plane where the surfaces are closest; how deep each surface lies below it is read from the
mesh, whose elements of order 2 follow a curved surface to the fourth power of their size. A topography lies on top of
that, its highest peak at the plane.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import basix.ufl
import numpy as np
from dolfinx import fem
from mpi4py import MPI
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import eigsh

from fenwear.bodies.contact_surface import FLAT, ContactSurface, contact_surface, profile_at
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.topography import heights_on
from fenwear.case import AUTO, CONDENSED, Case, Grid
from fenwear.case.program import stages_of
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import check_memory
from fenwear.surfaces.overlap import ChartedSurface, Patch, reading_at
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.patches import facet_side
from fenwear.surfaces.transfer import dual_transfer
from fenwear.system.strokes import Sliding, make_sliding

MARGIN = 1e-9  # of the grid's sides: rounding of the strip's surface at its ends
PER_NODE = 300.0  # bytes that a node takes in each position of the strip (measured, 129 and 257 nodes in 3 and 21)
UNFELT = 1e-10  # of the forces that a grid puts on meshes at most: less is rounding
SHIFT = 1e-13  # of these forces, beside which those that are felt least are looked for
REACH = 65  # nodes along the longer side of the largest grid, from which the first contact is looked for

Both = tuple[ElasticBody, ElasticBody]  # punch and strip


def lay_grids(case: Case, sliding: Sliding, punch: ElasticBody, strip: ElasticBody) -> None:
    """Let the contact surfaces of both bodies be grids, where the case has one.

    Collective.

    Raises:
        CaseError: the surfaces look along no common axis, a grid reaches beyond the surface, or its nodes do not fit
            into the memory.
    """
    if case.grid is None:
        return
    if punch.law.kind == "axisymmetric":
        raise CaseError(InputError("grid", "expected none in rings: their contact nodes are those of the mesh"))
    surfaces = punch.surface, strip.surface
    (axis, side), (other, opposite) = (facet_side(surface) for surface in surfaces)
    if axis != other or side == opposite:
        raise CaseError(InputError("grid", "expected contact surfaces that face each other along one axis"))
    level = float(opposite * (surfaces[1].trace[:, axis] * opposite).max())
    punch_grid = _grid(case.grid, punch.surface, axis, level)
    _check_memory(punch.body.mesh.comm, punch_grid, sliding)
    for body, grid in ((punch, punch_grid), (strip, _reached(case, punch_grid, sliding))):
        if body.decides:
            body.operator = AUTO
        surface, reading = _laid(case, body, grid)
        body.lay_grid(surface, reading, None if case.grid.across is None else grid, partial(_mortar, body, grid))


def on_grid(case: Case, sliding: Sliding, punch: ElasticBody, strip: ElasticBody, grid: RegularGrid) -> Both:
    """Return both bodies on another grid of the punch, that of the strip as much longer as the punch reaches.

    Collective.

    Raises:
        CaseError: a grid reaches beyond the surface, or its nodes do not fit into the memory.
    """
    _check_memory(punch.body.mesh.comm, grid, sliding)
    on_punch, on_strip = _laid(case, punch, grid), _laid(case, strip, _reached(case, grid, sliding))
    return punch.on_grid(*on_punch), strip.on_grid(*on_strip)


def _check_memory(comm: MPI.Comm, grid: RegularGrid, sliding: Sliding) -> None:
    """Make sure that what takes values between the surfaces in all positions fits into the memory; collective.

    Raises:
        CaseError: it does not.
    """
    nodes, positions = math.prod(grid.counts), len({phase.offset for phase in sliding.motion.phases})
    counts = " by ".join(f"{count:,}" for count in grid.counts)
    subject = f"a contact of {counts} nodes in {positions} positions of the strip"
    check_memory(comm, PER_NODE * nodes * positions, "grid.nodes", subject, "Use fewer, or fewer `motion.positions`.")


def check_felt(pair: ContactPair, punch: ElasticBody, strip: ElasticBody) -> None:
    """Make sure that condensed bodies feel all pressures of a contact grid.

    Forces go to a condensed body by integrals over its elements. Where the grid is finer than the elements of both
    there are pressures, turning from node to node, that neither feels: they add nothing to the gaps and are arbitrary.
    A body that is fine or a half-space feels all of them.

    Args:
        pair: The surfaces opposite each other.
        punch, strip: The bodies, whose operators are chosen.

    Raises:
        CaseError: they do not; it says where.
    """
    grid = pair.punch.grid
    if grid is None or punch.reading is None or strip.reading is None:
        return
    if punch.operator != CONDENSED or strip.operator != CONDENSED:
        return
    forces = [csr_array(punch.reading.T @ pair.punch.spread), csr_array(strip.reading.T @ pair.transfer.T)]
    felt = csc_array(sum(matrix.T @ matrix for matrix in forces))
    shift = SHIFT * float(felt.diagonal().max())
    (felt_least,), least = eigsh(felt, 1, sigma=-shift, v0=np.random.default_rng(0).standard_normal(len(pair.weights)))
    if felt_least > UNFELT * shift / SHIFT:
        return
    place = grid.flat[int(np.abs(least[:, 0]).argmax())]
    there = " and ".join(f"{'xyz'[axis]} = {at:.3g} mm" for axis, at in zip(grid.axes, place, strict=True))
    message = (
        f"finer than the elements of both condensed bodies, as at {there}: pressures oscillating from node to node "
        "would not be resolved. Use fewer grid nodes, a smaller grid.size, smaller elements there, or "
        "punch.operator or strip.operator = 'fine'"
    )
    reasons = [body.taken for body in (punch, strip) if body.taken]
    raise CaseError(InputError("grid.nodes", message + (f" ({'; '.join(reasons)})" if reasons else "")))


def _laid(case: Case, body: ElasticBody, grid: RegularGrid) -> tuple[ContactSurface, csr_array]:
    """Return the contact surface of a body on a grid, and what takes values at the trace nodes of its mesh to it.

    Collective.

    Raises:
        CaseError: the grid reaches beyond the surface.
    """
    meshed, (axis, outward) = _curved(body), facet_side(body.meshed)
    reading = _reading(body, body.meshed, grid)
    shape = reading if meshed is body.meshed else _reading(body, meshed, grid)
    depth = sag = outward * (grid.level - shape @ meshed.trace[:, axis])
    description, heights = case.bodies[body.body.name], FLAT
    if description.profile is not None:
        depth = depth + profile_at(body.body.name, np.array(description.profile.points), grid.flat)
    if description.topography is not None:
        heights = heights_on(grid, description.topography, f"{body.body.name}.topography", case.folder)
    deeper = depth + heights.max() - heights
    surface = replace(surface_on(body.body.name, grid, outward, deeper), heights=heights, sag=sag)
    return surface, _mortar(body, grid) if body.operator == CONDENSED else reading


def surface_on(name: str, grid: RegularGrid, outward: float, depth: Array) -> ContactSurface:
    """Return the contact surface of a body on a grid.

    Args:
        name: Of the body.
        grid: Nodes of the grid.
        outward: 1.0 where the normal out of the body points along its axis, else -1.0.
        depth: Depth of the body's surface below the grid (n,), mm.
    """
    x, every = grid.points, np.arange(len(grid.points))
    normals = np.zeros_like(x)
    normals[:, grid.normal] = outward
    spread = csr_array((np.ones(len(x)), (every, every)), shape=(len(x), len(x)))
    cell = "interval" if x.shape[1] == 2 else "quadrilateral"
    surface = ContactSurface(name, x, grid.facets, cell, 1, every, grid.weights, normals, spread)
    return replace(surface, profile=depth, grid=grid)


def _grid(wanted: Grid, surface: ContactSurface, axis: int, level: float) -> RegularGrid:
    """Return the punch's grid.

    Raises:
        CaseError: sides or middle have another number of components than the surface.
    """
    x = np.delete(surface.trace, axis, axis=1)
    low, high = x.min(axis=0), x.max(axis=0)
    for key, value in (("size", wanted.size), ("middle", wanted.middle)):
        if value is not None and len(value) != len(low):
            raise CaseError(InputError(f"grid.{key}", f"expected {len(low)} length(s), got {len(value)}"))
    nodes = REACH if wanted.nodes is None else wanted.nodes
    length = (high - low) * (nodes - 1) / (nodes + 1)  # the strip's goes on by whole spacings
    sides = length if wanted.size is None else np.array(wanted.size)
    middle = (low + high) / 2 if wanted.middle is None else np.array(wanted.middle)
    spacing = sides.max() / (nodes - 1)
    counts = np.maximum(np.floor(sides / spacing + MARGIN * nodes), 1).astype(np.int64) + 1
    steps = sides / (counts - 1)
    corner = middle - steps * (counts - 1) / 2
    return RegularGrid(tuple(corner), tuple(steps), tuple(int(k) for k in counts), axis, level)


def _reached(case: Case, grid: RegularGrid, sliding: Sliding) -> RegularGrid:
    """Return the grid, longer by the punch's reach on the strip during the motion, or during a whole program."""
    along, corners = grid.axes, grid.points[:: max(len(grid.points) - 1, 1)]
    steps = np.array(grid.spacing)
    before = after = np.zeros(len(steps))
    slides, motions = [sliding], {stage.case.motion for stage in stages_of(case)}
    if motions:
        motions.add(case.motion)
        slides = [make_sliding(case.model_copy(update={"motion": motion})) for motion in motions]
    for there in {slide.field.placement(phase.offset) for slide in slides for phase in slide.motion.phases}:
        moved = (there.points_back(corners) - corners)[:, along]
        before, after = np.maximum(before, -moved.min(axis=0)), np.maximum(after, moved.max(axis=0))
    extra = np.array([np.ceil(reach / steps - 1e-6).astype(np.int64) for reach in (before, after)])
    corner = np.array(grid.corner) - extra[0] * steps
    return replace(grid, corner=tuple(corner), counts=tuple(int(k) for k in grid.counts + extra.sum(axis=0)))


def _mortar(body: ElasticBody, grid: RegularGrid) -> csr_array:
    """Return the interpolation by integrals, as forces of a condensed body need it: even forces stay even."""
    every = np.arange(len(grid.flat))
    cell = "interval" if grid.flat.shape[1] == 1 else "quadrilateral"
    first = ChartedSurface(grid.flat, grid.facets, cell, 1, every)
    return dual_transfer([Patch.of(first, _charted(body.meshed, grid))])


def _curved(body: ElasticBody) -> ContactSurface:
    """Return the surface of a body's mesh with all nodes that its shape has, though its displacement has fewer."""
    mesh = body.body.mesh
    degree = mesh.geometry.cmap.degree
    if body.meshed.degree >= degree:
        return body.meshed
    element = basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(mesh.geometry.dim,))
    return contact_surface(body.body, fem.functionspace(mesh, element))[0]


def _charted(surface: ContactSurface, grid: RegularGrid) -> ChartedSurface:
    """Return the contact surface of a mesh in the plane of a grid."""
    s = np.delete(surface.trace, grid.normal, axis=1)
    return ChartedSurface(s, surface.facets, surface.cell, surface.degree, surface.nodes)


def _reading(body: ElasticBody, surface: ContactSurface, grid: RegularGrid) -> csr_array:
    """Return the matrix from the trace nodes of a surface of a body's mesh to its grid (n, N).

    Raises:
        CaseError: the grid reaches beyond the surface.
    """
    charted = _charted(surface, grid)
    first, last, spacing = np.array(grid.corner), np.array(grid.corner) + grid.sides, np.array(grid.spacing)
    low, high = charted.s.min(axis=0), charted.s.max(axis=0)
    far = (first < low - spacing).any() or (last > high + spacing).any()  # where its nodes might not fit the memory
    reading = None if far else reading_at(charted, grid.flat)
    if reading is None:
        spans: Sequence[str] = [
            " by ".join(f"{at:.4g} to {end:.4g}" for at, end in zip(*ends, strict=True))
            for ends in ((first, last), (low, high))
        ]
        text = f"spans {spans[0]} mm on the {body.body.name}, whose contact surface spans {spans[1]}"
        beyond = bool((first < low).any() or (last > high).any())
        text += " only" if beyond else ", but is no rectangle: corners of the grid lie off it"
        raise CaseError(InputError("grid.size", f"{text}: expected a grid within it"))
    return reading
