"""Two bodies in contact with stick: relative displacements by tractions in every direction.

In the contact frame of each node, its normal e_n first and then the d - 1 tangents, tractions f = (p, t) on
the punch and their reactions on the strip move the punch's surface against the strip's by

    j = C f + H a + l - V delta,

C the compliance of both bodies, H the rigid modes, l the loads and the bulk strain, and V delta what the rig
moves the strip by. The first component opens the gap, the others are the slip.

Arrays of all components have d n entries, one component after the other: p of all nodes, then t of all.

Strains of the strip's surface at the contact nodes: what displacement changes along the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import basix
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.response import identity
from fenwear.bodies.subcells import linear_cells
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Added, Array
from fenwear.surfaces import Compliance, ContactPair, Interface, RigidEquilibrium
from fenwear.surfaces.common_normal import contact_frame
from fenwear.surfaces.placement import in_model, in_space
from fenwear.surfaces.sliding_field import SlidingField


@dataclass(frozen=True)
class LoadEffect(Added):
    """Effect of the loads at one time of the cycle.

    Attributes:
        resultant: F of the rigid modes (r,), N/mm and N; in a solid N and N mm.
        on_punch: Displacement of the punch's contact nodes (n, d), mm.
        on_strip: Of the strip at the nodes of its operator (q, d), mm.
        forced_punch, forced_strip: Of both of these what forces do, and so creeps.
    """

    resultant: Array
    on_punch: Array
    on_strip: Array
    forced_punch: Array
    forced_strip: Array


@dataclass(frozen=True)
class Position:
    """Both bodies opposite each other in one place of the strip.

    Attributes:
        interface: Relative motion of their surfaces along e_n and the tangents of each node.
        drive: V (d n,), for a unit of the motion; along the tangents alone where the strip goes far.
        far: Whether it goes so far: what it is moved by along e_n its place has in the gap.
    """

    interface: Interface
    drive: Array
    far: bool = False

    @property
    def rigid(self) -> RigidEquilibrium:
        """The rigid modes and the pair of surfaces there."""
        return self.interface.rigid

    @property
    def pair(self) -> ContactPair:
        """The surfaces."""
        return self.rigid.pair

    @property
    def frame(self) -> Array:
        """e_n and the tangents of each node (n, d, d), by rows."""
        return self.interface.axes

    @cached_property
    def reading(self) -> csr_array:
        """Takes displacements of the strip at the nodes of its operator to the contact nodes (n, q)."""
        return self.pair.transfer if self.interface.strip_moves else identity(len(self.pair.weights))

    def reaction(self, force: Array) -> Array:
        """Return the reaction on the strip at the nodes of its operator (q, d) to forces on the punch (n, d)."""
        return np.asarray(self.reading.T @ self.pair.placement.back(force))

    def forces(self, f: Array) -> tuple[Array, Array]:
        """Return the forces of tractions (d n,) on the punch (n, d), and against those on the strip (q, d)."""
        force = self.in_space(f * self.weights)
        return force, self.reaction(force)

    @cached_property
    def compliance(self) -> Compliance:
        """C, mm/MPa."""
        return self.interface.along_axes

    @cached_property
    def modes(self) -> Array:
        """H (d n, r)."""
        n, d, _ = self.frame.shape
        motion = in_model(np.moveaxis(self.rigid.motion, 2, 0), d)
        return np.einsum("iac,mic->aim", self.frame, motion).reshape(d * n, -1)

    @cached_property
    def weights(self) -> Array:
        """Areas of the nodes for each component (d n,)."""
        return np.tile(self.pair.weights, self.frame.shape[2])

    @cached_property
    def balance(self) -> Array:
        """Part of each traction in the load of each rigid mode (r, d n)."""
        return self.modes.T * self.weights

    @cached_property
    def pull(self) -> Array:
        """Part of each traction in the force along the motion, positive where the strip is pulled to +x (d n,)."""
        return self.drive * self.weights

    @cached_property
    def elastic_length(self) -> float:
        """Gap that unit pressures open on average, mm/MPa: the scale of gaps."""
        n, even = len(self.pair.weights), np.zeros(len(self.weights))
        even[:n] = 1.0
        return float(np.abs(self.compliance.apply(even)[:n]).mean())

    def in_frame(self, vectors: Array) -> Array:
        """Return the components (d n,) of vectors (n, d)."""
        return np.einsum("nac,nc->an", self.frame, vectors).ravel()

    def slid(self, slip: Array) -> Array:
        """Return slips along the tangents (n, d - 1) as vectors in space (n, 3)."""
        return in_space(np.einsum("nac,na->nc", self.frame[:, 1:], slip))

    def beside(self, moved: Array) -> Array:
        """Return the strip's displacement beside its motion (n, d), of all nodes or alike, in the frame (d n,)."""
        displacements = self.in_frame(moved)
        if self.far:
            displacements[: len(self.pair.weights)] = 0.0
        return displacements

    def in_space(self, components: Array) -> Array:
        """Return vectors (n, d) of components (d n,)."""
        return np.einsum("nac,an->nc", self.frame, components.reshape(self.frame.shape[2], -1))


def position_of(
    rigid: RigidEquilibrium,
    punch: SurfaceOperator,
    strip: SurfaceOperator,
    field: SlidingField,
    *,
    strip_moves: bool = False,
    layer: Array | float = 0.0,
) -> Position:
    """Return both bodies opposite each other.

    Args:
        rigid: The rigid modes and the pair of surfaces.
        punch, strip: Response of the bodies, along all axes.
        field: The motion of the strip.
        strip_moves: Whether the strip answers at its own trace nodes, not at the contact nodes opposite.
        layer: Closure by unit pressures of what lies between (n,), mm/MPa; 0 of nothing.
    """
    dim = punch.directions.shape[1]
    frame = contact_frame(in_model(rigid.pair.normal, dim))
    drive = np.einsum("nac,nc->an", frame, in_model(field.velocity(rigid.pair.punch.x), dim))
    return Position(Interface(rigid, punch, strip, strip_moves, frame=frame, layer=layer), drive.ravel())


def along_tangents(position: Position) -> Position:
    """Return the position for a strip that goes far: its place has the motion along e_n, the drive none."""
    drive = position.drive.copy()
    drive[: len(position.pair.weights)] = 0.0
    return replace(position, drive=drive, far=True)


def along_sliding(position: Position) -> Array:
    """Return the rotations of tangential components at each node to those along and across the sliding (n, m, m).

    In the plane along x; where a turning strip does not move, on its axis, along the first tangent.
    """
    n, d, _ = position.frame.shape
    if d == 2:
        return np.ones((n, 1, 1))
    moved = position.drive[n:].reshape(2, n).T
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    still = size <= 1e-12 * size.max(initial=1e-300)
    along = np.where(still, [1.0, 0.0], moved / np.where(still, 1.0, size))
    return np.stack([along, np.column_stack([-along[:, 1], along[:, 0]])], axis=1)


def directions(position: Position) -> Array:
    """Return the unit vectors along and across the sliding at each node (n, m, d)."""
    return np.einsum("nam,nmc->nac", along_sliding(position), position.frame[:, 1:])


def surface_gradient(surface: ContactSurface) -> list[csr_array]:
    """Return the derivatives along each axis, within the surface, of values at its pressure nodes, d of (n, n).

    The values go straight from node to node: at the edge of a stick zone, where the strain has a vertical tangent, a
    parabola through nodes that stick and one that has slipped turns round and sets strains of the wrong sign beside it.
    At a node the mean of the linear cells about it, each weighted by one over its size: no larger than the largest of
    them, and of second order, which the mean by size is not where cells differ in size.
    """
    straight = surface.cell == "triangle"  # values live on the vertices
    cells = linear_cells(surface.cell, 1 if straight else surface.degree)
    if surface.cell == "quadrilateral":
        cells = cells[:, [0, 1, 3, 2]]  # basix' order of corners
    corners = cells.shape[1]
    facets: NDArray[np.int64] = surface.facets[:, cells].reshape(-1, corners)
    facets = facets[(surface.number[facets] >= 0).all(axis=1)]  # a node on the axis of rings carries nothing
    element = basix.create_element(basix.ElementFamily.P, basix.CellType[surface.cell], 1)
    table = element.tabulate(1, element.points)[1:, :, :, 0]
    jacobian = np.einsum("dqk,fkc->fqcd", table, surface.trace[facets])
    values = np.einsum("fqdc,dqk->cfqk", np.linalg.pinv(jacobian), table)
    weight = 1 / np.sqrt(np.linalg.det(np.swapaxes(jacobian, -1, -2) @ jacobian)).mean(axis=1)
    places, n = surface.number[facets], len(surface.nodes)
    rows = np.broadcast_to(places[:, :, None], values.shape[1:]).ravel()
    columns = np.broadcast_to(places[:, None, :], values.shape[1:]).ravel()
    share = np.bincount(places.ravel(), np.repeat(weight, corners), n)
    scaled = values * weight[:, None, None]
    return [csr_array(coo_array((v.ravel() / share[rows], (rows, columns)), shape=(n, n))) for v in scaled]


def surface_strain(position: Position, gradient: list[csr_array], on_strip: Array) -> Array:
    """Return the strip's strains along and across the sliding opposite each contact node (n, m).

    Args:
        position: The place of the strip.
        gradient: Of the punch's contact surface.
        on_strip: Displacement of what the strip was condensed onto (q, d), mm.
    """
    u = position.pair.placement.vectors(position.reading @ on_strip)
    slopes = np.stack([derivative @ u for derivative in gradient], axis=2)  # (n, d of u, d)
    if slopes.shape[1] > slopes.shape[2]:  # rings: what changes around the axis are the directions of u_r and u_y
        turned = np.stack([-u[:, 1], u[:, 0], np.zeros(len(u))], axis=1) / position.pair.punch.x[:, :1]
        slopes = np.insert(slopes, 1, turned, axis=2)
    ways = directions(position)
    return np.einsum("nac,ncb,nab->na", ways, slopes, ways)
