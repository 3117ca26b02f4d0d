"""Supports of a body: the components that its supports take, and the rigid modes that they leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear.bodies.connected_parts import connected_parts, part_boxes
from fenwear.bodies.contact_surface import ContactSurface, Trace
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.guides import Loose
from fenwear.case import Body, Kind, Support
from fenwear.common import compat
from fenwear.common.arrays import Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.files.mesh_file import ENTITIES

# For each model the columns of the rigid basis (translations, then rotations), first those that pressure balances
# with their names, then those in which friction would carry the body away.
SLIDE, SPIN = "slide along {0}", "spin about {0}"
FLAT = 1e-6  # of the body: what lies in a plane
WRAPPED = 0.5  # component of normals, both ways, from which on a contact holds a body along that axis
STEEP = 0.02  # component of normals along z, below which all pressure acts across it: a cone of a degree
PLANE = {1: "lambda_F", 2: "lambda_M"}, {0: SLIDE.format("x")}
RIGID_MODES: dict[Kind, tuple[dict[int, str], dict[int, str]]] = {
    "stress": PLANE,
    "strain": PLANE,
    "axisymmetric": ({1: "lambda_F"}, {}),
    "solid": (
        {2: "lambda_F", 3: "lambda_Mx", 4: "lambda_My"},
        {0: SLIDE.format("x"), 1: SLIDE.format("y"), 5: SPIN.format("z")},
    ),
}


def axes(dim: int) -> dict[str, int]:
    """Return the component of each axis in a model of `dim` dimensions; a plane one has no y."""
    return {"x": 0, "z": 1} if dim == 2 else {"x": 0, "y": 1, "z": 2}


class Supports:
    """The supports of one body, and one more for each rigid mode R that they leave, which makes K regular.

    Attributes:
        conditions: All of them, as u = 0 on the degrees of freedom of a component.
        held: The owned degrees of freedom that they hold.
        imposed: The displacements that supports prescribe, mm; zero elsewhere.
        pivot: The point about which rotations are taken, mm; of the first part where it has several.
        modes: Columns of R on the owned degrees of freedom; the displacement of each for a unit velocity.
        names: "lambda_F" (translation along z at the pivot) and "lambda_M" (rotation about it); "lambda_Fx" and
            "lambda_Fy" where the contact wraps around the body or is wrapped by it; of a body of several parts that
            share no node with the name of the part's contact, as "lambda_F_left", or its number, as "lambda_F_2".
        loose: The motions that supports leave each part that has any, and those of them that guides hold.
        mirrors: Planes of which supports hold the motion across them and no other, as planes of symmetry are held: the
            number of the axis that they are square to, and where on it they are, mm.
    """

    def __init__(self, body: BodyMesh, space: fem.FunctionSpace, description: Body, kind: Kind, contact: Trace) -> None:
        """Find what is held; collective.

        Args:
            body: The mesh.
            space: Vector space of the displacement, mm.
            description: The supports and the pivot.
            kind: The model.
            contact: The contact surface, from which the further supports keep away.

        Raises:
            CaseError: an unknown group, a support off the body, a body free to slide, or free and not facing z.
        """
        self.body, self.space, self.kind, self.contact, self._trace = body, space, kind, contact.local, contact
        self.dim = body.mesh.geometry.dim
        self._part, self._count = self._parts()
        self._pivots = self._pivots_of(description)
        self.pivot = self._pivots[0]
        self.imposed = fem.Function(space)
        held = [*self._described(description.supports), *self._on_axis()]
        self.loose: list[Loose] = []
        self.modes, self.names, self._loose = self._free_modes(self._owned(held), description.no_turning_about)
        self.conditions = held + self._regularise()
        self.held = self._owned(self.conditions)
        self.mirrors = self._mirrors(description.supports)

    def _mirrors(self, supports: Sequence[Support]) -> list[tuple[int, float]]:
        """Return the planes that supports hold as those of symmetry; collective."""
        planes, mesh = [], self.body.mesh
        for support in supports:
            if support.on not in self.body.curves or len(support.fix) != 1 or any(support.by or ()):
                continue
            axis = self._component(support.fix[0], self.body.name)
            facets = self.body.facet_tags.find(self.body.curves[support.on])
            along = mesh.geometry.x[compat.facet_nodes(mesh, facets).ravel(), axis]
            low = mesh.comm.allreduce(float(along.min(initial=np.inf)), MPI.MIN)
            high = mesh.comm.allreduce(float(along.max(initial=-np.inf)), MPI.MAX)
            if high - low < FLAT * self._size():
                planes.append((axis, (low + high) / 2))
        return planes

    def _described(self, supports: Sequence[Support]) -> list[fem.DirichletBC]:
        key, conditions = f"{self.body.name}.supports", []
        for number, support in enumerate(supports):
            for axis, moved in zip(support.fix, support.by or (0.0,) * len(support.fix), strict=True):
                component = self._component(axis, f"{key}.{number}.fix")
                dofs = self._support_dofs(support, component, f"{key}.{number}")
                conditions.append(self._condition(component, dofs))
                if moved:
                    self.imposed.x.array[dofs] = moved
        self.imposed.x.scatter_forward()
        return conditions

    def _on_axis(self) -> list[fem.DirichletBC]:
        """Return the support u_r = 0 at r = 0 of an axisymmetric body, without which u_r / r is not finite."""
        if self.kind != "axisymmetric":
            return []
        collapsed, to_parent = compat.collapse(self.space.sub(0))
        on_axis = collapsed.tabulate_dof_coordinates()[:, 0] < 1e-9 * self._size()
        return [self._condition(0, to_parent[on_axis])]

    def _component(self, axis: str, key: str) -> int:
        known = axes(self.dim)
        if axis not in known:
            raise CaseError(InputError(key, f"expected {', '.join(known)}, got {axis!r}"))
        return known[axis]

    def _condition(self, component: int, dofs: NDArray[np.int32]) -> fem.DirichletBC:
        return fem.dirichletbc(PETSc.ScalarType(0), dofs, self.space.sub(component))

    def _support_dofs(self, support: Support, component: int, key: str) -> NDArray[np.int32]:
        body, sub = self.body, self.space.sub(component)
        if support.on in body.curves:
            facets = body.facet_tags.find(body.curves[support.on])
            return fem.locate_dofs_topological(sub, body.mesh.topology.dim - 1, facets)
        points = _support_points(body, support, key)
        collapsed, to_parent = compat.collapse(sub)
        x = collapsed.tabulate_dof_coordinates()[:, : points.shape[1]]
        distance = np.linalg.norm(x[:, None] - points[None], axis=2)
        tolerance = 1e-6 * self._size()
        counts = body.mesh.comm.allreduce((distance < tolerance).any(axis=0).astype(int))
        missing = points[counts == 0]
        if len(missing):
            place = ", ".join("(" + ", ".join(f"{c:g}" for c in p) + ")" for p in missing)
            raise CaseError(InputError(f"{key}.at", f"the {body.name} has no node at {place} mm. Name a node"))
        return to_parent[(distance < tolerance).any(axis=1)]

    def _size(self) -> float:
        """Return the largest extent of the body, mm; collective."""
        comm, x = self.body.mesh.comm, self.body.mesh.geometry.x
        low = np.array([comm.allreduce(x[:, i].min(initial=np.inf), MPI.MIN) for i in range(3)])
        high = np.array([comm.allreduce(x[:, i].max(initial=-np.inf), MPI.MAX) for i in range(3)])
        return float((high - low).max())

    def rigid_basis(self, pivot: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the translations and the rotations omega x (x - x_O) on the owned dofs (owned, modes).

        About a pivot x_O. A positive rotation about y lowers what lies at larger x:
        u = (z - z_O, -(x - x_O)). These are the paper's signs of lambda_M.
        """
        owned = self.space.dofmap.index_map.size_local
        x = self.space.tabulate_dof_coordinates()[:owned]
        dim = self.dim
        arm = x[:, :dim] - pivot
        if dim == 2:
            turns = np.stack([arm[:, 1], -arm[:, 0]], axis=1)[:, :, None]
        else:
            turns = np.stack([np.cross(axis, arm) for axis in np.eye(3)], axis=2)
        shifts = np.broadcast_to(np.eye(dim), (owned, dim, dim))
        return np.concatenate([shifts, turns], axis=2).reshape(owned * dim, dim + turns.shape[2])

    def _free_modes(
        self, held: NDArray[np.int32], guided: Sequence[str]
    ) -> tuple[list[NDArray[np.float64]], list[str], list[NDArray[np.float64]]]:
        """Return the rigid modes that supports and guides leave, their names, and those that supports alone leave.

        Parts of the body that share no node have modes of their own.

        Args:
            held: Owned degrees of freedom that supports hold.
            guided: Axes about which guides hold the body against turning, by a couple.

        Raises:
            CaseError: a part is free to slide along the contact, or to spin about its normal; or it is free, and its
                contact looks another way than z, or it has none.
        """
        part, count = self._part, self._count
        modes, names, loose = [], [], []
        surface = self._trace.surface
        owned = np.repeat(part, self.dim)
        of_nodes = np.rint(self._trace.pick(owned[:, None].astype(float))[surface.nodes, 0, 0]).astype(np.int64)
        for k in range(count):
            free = self._modes_of(k, owned == k, surface.outward[of_nodes == k], held, guided)
            modes += free[0]
            names += [name if count == 1 else f"{name}_{self._part_name(of_nodes, k)}" for name in free[1]]
            loose += free[2]
            if free[0] and not (of_nodes == k).any():
                raise CaseError(InputError(f"{self.body.name}.supports", self._untouched(k)))
        return modes, names, loose

    def _part_name(self, part: NDArray[np.int64], k: int) -> str:
        """Return the name of the one contact that part k of the contact nodes (n,) has for itself, else its number."""
        surface = self._trace.surface
        if surface.contact is not None:
            named = np.unique(surface.contact[part == k])
            if len(named) == 1 and (part[surface.contact == named[0]] == k).all():
                return surface.names[named[0]]
        return str(k + 1)

    def _parts(self) -> tuple[NDArray[np.int64], int]:
        """Return the part of each owned node (owned,), and how many there are; collective."""
        mesh, index_map = self.body.mesh, self.space.dofmap.index_map
        part = connected_parts(mesh)
        node = np.zeros(index_map.size_local + index_map.num_ghosts, dtype=np.int64)
        node[self.space.dofmap.list[: len(part)]] = part[:, None]
        return node[: index_map.size_local], mesh.comm.allreduce(int(part.max(initial=0)), MPI.MAX) + 1

    def _pivots_of(self, description: Body) -> list[NDArray[np.float64]]:
        """Return the point about which rotations of each part are taken; collective.

        By default the middle of the points at which the first support of points holds it, as a hinge does.
        """
        if description.pivot is not None:
            return [np.array(description.pivot)] * self._count
        body, comm, tolerance = self.body, self.body.mesh.comm, 1e-6 * self._size()
        nodes = self.space.tabulate_dof_coordinates()[: len(self._part), : self.dim]
        pivots = np.full((self._count, self.dim), np.nan)
        for number, support in enumerate(description.supports):
            if support.on is not None and support.on not in body.points:
                continue
            points = _support_points(body, support, f"{body.name}.supports.{number}")
            distance = np.linalg.norm(nodes[:, None] - points[None], axis=2)
            parts = np.where(distance < tolerance, self._part[:, None], -1).max(axis=0, initial=-1)
            parts = np.max(comm.allgather(parts), axis=0)
            for k in range(self._count):
                if np.isnan(pivots[k]).any() and (parts == k).any():
                    pivots[k] = points[parts == k].mean(axis=0)
        return list(np.nan_to_num(pivots))

    def _untouched(self, k: int) -> str:
        """Say which part neither touches nor is held; collective."""
        part = connected_parts(self.body.mesh)
        count = self.body.mesh.comm.allreduce(int(part.max(initial=0)), MPI.MAX) + 1
        return _parts_text(self.body.name, part_boxes(self.body.mesh, part, count), k)

    def _modes_of(
        self, number: int, in_part: Mask, normal: NDArray[np.float64], held: NDArray[np.int32], guided: Sequence[str]
    ) -> tuple[list[NDArray[np.float64]], list[str], list[NDArray[np.float64]]]:
        """Return the free modes of a part with these degrees of freedom (owned,) and contact normals (k, d)."""
        names, forbidden = _balanced(self.kind, normal)
        columns = [*names, *forbidden]
        turns = [self._turn(axis) for axis in guided]
        basis, comm = self.rigid_basis(self._pivots[number])[:, columns] * in_part[:, None], self.body.mesh.comm
        rows = basis[held]
        gram = comm.allreduce(rows.T @ rows)
        scale = np.where(np.array(columns) < self.dim, 1.0, 1.0 / self._size())
        loose = _null_space(gram * np.outer(scale, scale))
        by_guides = np.diag(np.isin(columns, turns).astype(float))
        free = _null_space(gram * np.outer(scale, scale) + by_guides)
        taken = loose @ _null_space((loose.T @ free) @ (free.T @ loose))
        loose, free = scale[:, None] * loose, scale[:, None] * free
        if free.shape[1] and len(names) == len(RIGID_MODES[self.kind][0]):
            _check_facing(self._trace.surface, normal)
        # A basis in which lambda_F is the velocity along z at the pivot and each lambda_M a rotation.
        echelon, pivots = _column_echelon(free)
        if loose.shape[1]:
            self.loose.append(Loose(basis, [columns.index(t) for t in turns], scale[:, None] * taken, echelon))
        away = [forbidden[columns[p]] for p in pivots if columns[p] in forbidden]
        if away:
            name = self.body.name
            message = f"the {name} is free to {' and to '.join(away)}, where friction pulls it. Add a support"
            raise CaseError(InputError(f"{name}.supports", message))
        return (
            list((basis @ echelon).T.copy()),
            [names[columns[p]] for p in pivots],
            list((basis @ _column_echelon(loose)[0]).T.copy()),
        )

    def _turn(self, axis: str) -> int:
        """Return the column of the rigid basis of the rotation about an axis.

        Raises:
            CaseError: the model has none.
        """
        known = {"y": 2} if self.dim == 2 and self.kind != "axisymmetric" else {"x": 3, "y": 4, "z": 5}
        if axis not in known or self.kind == "axisymmetric":
            message = f"expected {'none' if self.kind == 'axisymmetric' else ' or '.join(known)}, got {axis!r}"
            raise CaseError(InputError(f"{self.body.name}.no_turning_about", message))
        return known[axis]

    def _owned(self, supports: list[fem.DirichletBC]) -> NDArray[np.int32]:
        parts = [bc.dof_indices()[0][: bc.dof_indices()[1]] for bc in supports]
        return np.unique(np.concatenate(parts)) if parts else np.zeros(0, dtype=np.int32)

    def _remoteness(self) -> NDArray[np.float64]:
        """Return the distance of each owned node from the contact's middle (owned,); collective.

        No two are as far, even in a symmetric body: a millionth of it depends on the side.
        """
        owned, comm = self.space.dofmap.index_map.size_local, self.body.mesh.comm
        x, contact = self.space.tabulate_dof_coordinates()[:owned], self.contact
        middle = comm.allreduce(x[contact].sum(axis=0)) / comm.allreduce(len(contact))
        away = (x - middle) / self._size()
        return np.asarray(np.linalg.norm(away, axis=1) * (1 + 1e-6 * away @ (1.0, 0.7, 0.4)))

    def _regularise(self) -> list[fem.DirichletBC]:
        """Return a further support for each rigid mode, at the nodes farthest from the contact; collective.

        The displacements under pressure are relative to these nodes: the same on any number of ranks.
        """
        if not self._loose:
            return []
        comm, count = self.body.mesh.comm, len(self._loose)
        scale = np.array([comm.allreduce(np.abs(m).max(initial=0), MPI.MAX) for m in self._loose])
        modes = np.array(self._loose).T / scale
        modes *= np.repeat(self._remoteness(), self.dim)[:, None]
        modes.reshape(-1, self.dim, count)[self.contact] = 0.0
        mine = np.array(_best_rows(modes, count, comm), dtype=np.int32)
        index_map = self.space.dofmap.index_map
        # Ghosts of the chosen dofs are held too: mark them by a scattered function.
        mark = fem.Function(self.space)
        mark.x.array[mine] = 1.0
        mark.x.scatter_forward()
        known = self.dim * (index_map.size_local + index_map.num_ghosts)
        held = np.flatnonzero(mark.x.array[:known]).astype(np.int32)
        return [self._condition(component, held[held % self.dim == component]) for component in range(self.dim)]


def _balanced(kind: Kind, outward: NDArray[np.float64]) -> tuple[dict[int, str], dict[int, str]]:
    """Return the columns of the rigid basis that pressure balances, with names, and those that carry the body away.

    Along an axis to both sides of which the contact looks it holds the body, as a bore its shaft.

    Args:
        kind: Of the model.
        outward: Normals at the contact nodes (n, d).
    """
    names, forbidden = (dict(columns) for columns in RIGID_MODES[kind])
    if kind == "axisymmetric":
        return names, forbidden
    for axis, column in axes(outward.shape[1]).items():
        normal = outward[:, column]
        if column in forbidden and normal.min(initial=0.0) < -WRAPPED and normal.max(initial=0.0) > WRAPPED:
            names[column] = f"lambda_F{axis}"
            del forbidden[column]
    if kind == "solid":
        _turn_around(outward, names, forbidden)
    return names, forbidden


def _turn_around(outward: NDArray[np.float64], names: dict[int, str], forbidden: dict[int, str]) -> None:
    """Have a bore along x or y hold its shaft against tilting about z, and not against turning about its own axis."""
    both = (outward.min(axis=0, initial=0.0) < -WRAPPED) & (outward.max(axis=0, initial=0.0) > WRAPPED)
    for axis in (0, 1):
        if both[[1 - axis, 2]].all() and np.abs(outward[:, axis]).max() < WRAPPED:
            del names[3 + axis]
            forbidden[3 + axis] = SPIN.format("xy"[axis])
            names[5] = "lambda_Mz"
            del forbidden[5]


def _null_space(gram: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vectors that a symmetric matrix takes to nothing (columns)."""
    eigenvalues, vectors = np.linalg.eigh(gram)
    return np.asarray(vectors[:, eigenvalues <= 1e-12 * eigenvalues.max(initial=1.0)])


def _check_facing(surface: ContactSurface, outward: NDArray[np.float64]) -> None:
    """Make sure that pressure on what is not held acts along z, the only direction in which it may be free.

    Args:
        surface: Of the body.
        outward: Normals at those of its nodes that are of the part.

    Raises:
        CaseError: none of its contact surface looks along z in part.
    """
    if len(outward) and (np.abs(outward[:, -1]) < STEEP).all():
        mean = np.abs(outward).sum(axis=0)
        name, axis = surface.body, next(a for a, c in axes(surface.dim).items() if c == mean.argmax())
        message = (
            f"{name}_contact looks along {axis}, and the {name} is not held. A body may be free along z alone, and "
            f"pressure along {axis} cannot carry its loads there. Turn geometry, supports, loads and motion, so that "
            f"the contact looks along z. Or hold the {name} in all directions, and press it by a displacement (`by`)"
        )
        raise CaseError(InputError("geometry", message))


def _support_points(body: BodyMesh, support: Support, key: str) -> NDArray[np.float64]:
    if support.at is not None:
        return np.array([support.at])
    if support.on not in body.points:
        known = ", ".join(sorted({*body.curves, *body.points}))
        entity = ENTITIES[body.mesh.topology.dim - 1]
        message = f"no physical {entity} or point {support.on!r} on the {body.name}; the geometry has {known}"
        raise CaseError(InputError(f"{key}.on", message))
    return body.points[support.on]


def _parts_text(name: str, boxes: NDArray[np.float64], part: int) -> str:
    """Say that a part of a body touches nothing, is joined to nothing and not held."""
    spans = [f"x = {box[0, 0]:.4g} to {box[1, 0]:.4g} mm" for box in boxes]
    return (
        f"the {name} has {len(boxes)} parts that share no node ({'; '.join(spans)}), and part {part + 1} neither "
        f"touches nor is held. Join the parts in the mesh (in gmsh Coherence, or BooleanFragments). Or give each a "
        f"share of {name}_contact or supports"
    )


def _column_echelon(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[int]]:
    """Return the reduced column echelon form of a matrix with few columns, and its pivot rows."""
    m = matrix.copy()
    pivots: list[int] = []
    for row in range(m.shape[0]):
        column = len(pivots)
        if column == m.shape[1]:
            break
        best = column + int(np.argmax(np.abs(m[row, column:])))
        if abs(m[row, best]) < 1e-9 * max(np.abs(m).max(), 1e-300):
            continue
        m[:, [column, best]] = m[:, [best, column]]
        m[:, column] /= m[row, column]
        others = [c for c in range(m.shape[1]) if c != column]
        m[:, others] -= np.outer(m[:, column], m[row, others])
        pivots.append(row)
    m[np.abs(m) < 1e-12 * np.abs(m).max(axis=0, initial=1e-300)] = 0.0
    return m, pivots


def _best_rows(matrix: NDArray[np.float64], count: int, comm: MPI.Comm) -> list[int]:
    """Return this rank's of the `count` rows of all ranks that span best (QR with pivoting); collective.

    Each time the largest of what those before have left.
    """
    rest, chosen = np.array(matrix), []
    for _ in range(count):
        sizes = np.einsum("ij,ij->i", rest, rest)
        best = int(np.argmax(sizes)) if len(sizes) else -1
        proposals = comm.allgather((sizes[best], rest[best]) if best >= 0 else (-1.0, None))
        owner = int(np.argmax([size for size, _ in proposals]))  # of the same proposals on every rank
        size, row = proposals[owner]
        if owner == comm.rank:
            chosen.append(best)
        if row is not None and size > 0:
            unit = row / np.sqrt(size)
            rest -= np.outer(rest @ unit, unit)
    return chosen
