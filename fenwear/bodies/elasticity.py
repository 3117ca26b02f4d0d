"""Linear elasticity of one body in UFL: stiffness, supports, loads, rigid modes, factorisation."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray
from petsc4py import PETSc
from ufl.algorithms.check_arities import ArityMismatch

from fenwear import compat
from fenwear.arrays import Array
from fenwear.bodies.assembly import assembled, assembled_vector
from fenwear.bodies.contact_surface import contact_surface
from fenwear.bodies.factor import Factor, make_together
from fenwear.bodies.low_rank import LowRank
from fenwear.bodies.material import ElasticLaw, measure, strain_of
from fenwear.bodies.mesh import ENTITIES, BodyMesh
from fenwear.bodies.multigrid import Multigrid
from fenwear.bodies.substructure import Boundary, Substructures
from fenwear.case import Body, Kind, Load, Setup, Support
from fenwear.errors import CaseError, InputError
from fenwear.parallel import total

PREFIX = "fenwear_elasticity_"
# A factor on one rank, or over all where it is large; over all in any case; compressed; conjugate gradients.
Solver = Literal["factor", "spread factor", "low-rank", "multigrid"]
BY_SIZE = Setup()
# For each model the columns of the rigid basis (translations, then rotations), first those that pressure balances
# with their names, then those in which friction would carry the body away.
SLIDE, SPIN = "slide along {0}: hold its {0} somewhere", "spin about z: hold it against turning"
PLANE = {1: "lambda_F", 2: "lambda_M"}, {0: SLIDE.format("x")}
RIGID_MODES: dict[Kind, tuple[dict[int, str], dict[int, str]]] = {
    "stress": PLANE,
    "strain": PLANE,
    "axisymmetric": ({1: "lambda_F"}, {}),
    "solid": (
        {2: "lambda_F", 3: "lambda_Mx", 4: "lambda_My"},
        {0: SLIDE.format("x"), 1: SLIDE.format("y"), 5: SPIN},
    ),
}


def axes(dim: int) -> dict[str, int]:
    """Return the component of each axis in a model of `dim` dimensions; a plane one has no y."""
    return {"x": 0, "z": 1} if dim == 2 else {"x": 0, "y": 1, "z": 2}


class ElasticBody:
    """One body: K u = f + C p, with rigid modes R where the supports leave some.

    K is made regular by a few further supports; they carry nothing as long as the equilibrium
    R^T (f + C p) = 0 holds, and the displacement is u + R a.

    Attributes:
        space: Vector Lagrange space on Gauss-Lobatto nodes, mm.
        supported: The owned degrees of freedom that are held at zero.
        load: f of this rank's own degrees of freedom (owned,), per thickness, N/mm, zero where supported.
        rigid_modes: Columns of R; the displacement of each for a unit velocity.
        rigid_resultant: R^T f, shape (modes,): N/mm, and N for the rotation.
        mode_names: "lambda_F" (translation along z at the pivot) and "lambda_M" (rotation about it).
        setup: How it is condensed.
        solver: What solves for its columns; set before the first solution, by the memory that there is.
    """

    def __init__(
        self,
        body: BodyMesh,
        description: Body,
        law: ElasticLaw,
        degree: int,
        thickness: float = 1.0,
        setup: Setup = BY_SIZE,
    ) -> None:
        """Assemble the stiffness of `body`; collective.

        Args:
            body: Its mesh.
            description: Its supports, loads and pivot.
            law: Its material.
            degree: Of the displacement.
            thickness: Of a plane model, mm; 1 for whole rings and solids.
            setup: How it is condensed; by default as its size says.

        Raises:
            CaseError: an unknown group, a support off the body, a body free to slide, a stress that is not linear.
        """
        self.body, self.law, self.thickness, self.setup = body, law, thickness, setup
        self.solver: Solver = "factor"
        if setup.way == "low-rank" or setup.way == "multigrid":  # noqa: PLR1714  (mypy does not narrow by "in")
            self.solver = setup.way
        mesh = body.mesh
        dim = mesh.geometry.dim
        self.dim = dim
        element = basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(dim,))
        self.space = fem.functionspace(mesh, element)
        self.surface, self.trace = contact_surface(body, self.space, measure(mesh, law.kind))
        self.pivot = _pivot(body, description)
        supports = [*self._supports(description.supports), *self._on_axis()]
        modes, self.mode_names = self._free_modes(supports)
        self.rigid_modes = modes

        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        dx = ufl.dx(metadata=_quadrature(mesh, degree))
        a = ufl.inner(law.stress(u), strain_of(v, law.kind)) * measure(mesh, law.kind) * dx
        self._bcs = supports + self._regularise()
        self.supported = self._owned_dofs(self._bcs)
        self._set_loads(description.loads)
        try:
            self._ufl, self._form = a, fem.form(a)
        except (ArityMismatch, ValueError):  # UFL stumbles over some of its own messages
            raise CaseError(InputError(f"{body.name}.stress", "expected a stress that is linear in grad u")) from None
        # None or one of each, of all bodies that differ by their loads.
        self._factors: list[Factor] = []
        self._substructures: list[Substructures] = []

    def _set_loads(self, loads: Sequence[Load]) -> None:
        load = self._assemble_load(loads)
        resultant = np.array([mode @ load for mode in self.rigid_modes])
        self.rigid_resultant = total(self.body.mesh.comm, resultant)
        load[self.supported] = 0.0
        self.load = load

    def with_loads(self, loads: Sequence[Load]) -> ElasticBody:
        """Return the same body under other loads, with the same stiffness and factor; collective."""
        body = copy.copy(self)
        body._set_loads(loads)
        return body

    @cached_property
    def rigid_motion(self) -> Array:
        """Displacement of the contact surface's trace nodes by each rigid mode (N, d, modes); collective."""
        if not self.rigid_modes:
            return np.zeros((*self.surface.trace.shape, 0))
        return self.trace.pick(np.array(self.rigid_modes).T)

    @property
    def size(self) -> int:
        """Number of degrees of freedom on all ranks."""
        return int(self.dim * self.space.dofmap.index_map.size_global)

    def matrix_entries(self) -> int:
        """Return about how many entries K has, without assembling it; collective.

        On a grid of quadrilaterals or hexahedra of degree p a cell adds (p² + 2 p)^d pairs of nodes: along an
        axis p - 1 inner nodes see p + 1 and the one at its end 2 p + 1.
        """
        topology, degree = self.body.mesh.topology, self.space.ufl_element().degree
        if self.body.mesh.basix_cell().name in ("quadrilateral", "hexahedron"):
            pairs = (degree**2 + 2 * degree) ** topology.dim
            return int(self.dim**2 * topology.index_map(topology.dim).size_global * pairs)
        pattern = fem.create_sparsity_pattern(self._form)
        pattern.finalize()
        return int(self.dim**2 * self.body.mesh.comm.allreduce(pattern.num_nonzeros))

    @cached_property
    def stiffness(self) -> PETSc.Mat:
        """K with all supports eliminated, per thickness, MPa; collective at first use."""
        matrix = assembled(self._form, self._bcs)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        return matrix

    def identity(self) -> list[object]:
        """Return all that this rank's part of K and f follows from: the form, its values, the mesh, the supports."""
        mesh, form = self.body.mesh, self._ufl
        values = [constant.value for constant in form.constants()]
        values += [function.x.array for function in form.coefficients()]
        nodes = [mesh.geometry.x, compat.geometry_dofmap(mesh), self.space.dofmap.list]
        return [form.signature(), *values, *nodes, self.supported, self.load, self.surface_dofs]

    def solve(self, right: Array) -> Array:
        """Return K^-1 times right-hand sides on the owned degrees of freedom, (owned,) or (owned, k); collective."""
        return (self.substructures or self.factor).solve(right)

    @property
    def substructures(self) -> Substructures | None:
        """K as substructures, where they are made."""
        return next((one for one in self._substructures if one.is_made), None)

    @cached_property
    def boundary(self) -> Boundary:
        """What this rank's cells share with others and with the contact surface; collective at first use."""
        return Boundary(self.space, self.surface_dofs)

    def begin_substructures(self, *, backwards: bool = False) -> Substructures:
        """Return K as substructures, made or yet to be made; collective at first use.

        Args:
            backwards: Whether the last rank is their owner, and not the first.
        """
        if not self._substructures:
            comm, surface = self.body.mesh.comm, self.surface_dofs
            parts = (self._form, self._bcs, self.boundary, surface)
            self._substructures.append(Substructures(*parts, prefix=PREFIX, comm=comm, backwards=backwards))
        return self._substructures[0]

    @property
    def factor(self) -> Factor:
        """The Cholesky factor of K, made once; collective at first use."""
        factor = self.begin_factor()
        if not factor.is_made:
            make_together([factor])
        return factor

    def begin_factor(self, owner: int = 0, *, with_surface: bool = False) -> Factor:
        """Return the factor of K, made or yet to be made; collective at first use.

        Args:
            owner: The rank that gets it at first use.
            with_surface: Whether it keeps the Schur complement of the surface's degrees of freedom.
        """
        if not self._factors:
            kept = "stiffness" in self.__dict__
            matrix = self.stiffness
            surface = self.surface_dofs if with_surface else None
            comm = self.body.mesh.comm
            if self.solver in ("multigrid", "low-rank"):
                del self.stiffness
                low = self.solver == "low-rank"
                rigid = self._rigid_basis()
                self._factors.append(LowRank(matrix, PREFIX, comm) if low else Multigrid(matrix, rigid, PREFIX, comm))
                return self._factors[0]
            spread = self.solver == "spread factor"
            factor = Factor(
                matrix, PREFIX, "cholesky", comm=comm, dim=self.dim, owner=owner, surface=surface, spread=spread
            )
            self._factors.append(factor)
            if not kept:  # all that needs it has it now
                del self.stiffness
                if factor.is_moved:
                    matrix.destroy()
        return self._factors[0]

    def free_factor(self) -> None:
        """Free its factor, of all bodies that differ by their loads; the next solution makes it again; collective."""
        for factor in self._factors:
            factor.free()
        self._factors.clear()

    @cached_property
    def surface_dofs(self) -> NDArray[np.int64]:
        """Global numbers of the degrees of freedom of the contact surface's trace nodes (N d,)."""
        return np.asarray((self.dim * self.trace.blocks[:, None] + np.arange(self.dim)).ravel())

    def _supports(self, supports: Sequence[Support]) -> list[fem.DirichletBC]:
        key = f"{self.body.name}.supports"
        return [
            self._held(component, self._support_dofs(support, component, f"{key}.{number}"))
            for number, support in enumerate(supports)
            for component in (self._component(axis, f"{key}.{number}.fix") for axis in support.fix)
        ]

    def _on_axis(self) -> list[fem.DirichletBC]:
        """Return the support u_r = 0 at r = 0 of an axisymmetric body, without which u_r / r is not finite."""
        if self.law.kind != "axisymmetric":
            return []
        collapsed, to_parent = compat.collapse(self.space.sub(0))
        on_axis = collapsed.tabulate_dof_coordinates()[:, 0] < 1e-9 * self._size()
        return [self._held(0, to_parent[on_axis])]

    def _component(self, axis: str, key: str) -> int:
        known = axes(self.dim)
        if axis not in known:
            raise CaseError(InputError(key, f"expected {', '.join(known)}, got {axis!r}"))
        return known[axis]

    def _held(self, component: int, dofs: NDArray[np.int32]) -> fem.DirichletBC:
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
        found = body.mesh.comm.allreduce((distance < tolerance).any(axis=0).astype(int))
        missing = points[found == 0]
        if len(missing):
            place = ", ".join("(" + ", ".join(f"{c:g}" for c in p) + ")" for p in missing)
            raise CaseError(InputError(f"{key}.at", f"a pin off the {body.name}: no node of its mesh at {place} mm"))
        return to_parent[(distance < tolerance).any(axis=1)]

    def _size(self) -> float:
        """Return the largest extent of the body, mm; collective."""
        from mpi4py import MPI

        comm, x = self.body.mesh.comm, self.body.mesh.geometry.x
        low = np.array([comm.allreduce(x[:, i].min(initial=np.inf), MPI.MIN) for i in range(3)])
        high = np.array([comm.allreduce(x[:, i].max(initial=-np.inf), MPI.MAX) for i in range(3)])
        return float((high - low).max())

    def _rigid_basis(self) -> NDArray[np.float64]:
        """Return the translations and the rotations omega x (x - x_O) on the owned dofs (owned, modes).

        A positive rotation about y lowers what lies at larger x:
        u = (z - z_O, -(x - x_O)). These are the paper's signs of lambda_M.
        """
        owned = self.space.dofmap.index_map.size_local
        x = self.space.tabulate_dof_coordinates()[:owned]
        dim = self.dim
        arm = x[:, :dim] - self.pivot
        if dim == 2:
            turns = np.stack([arm[:, 1], -arm[:, 0]], axis=1)[:, :, None]
        else:
            turns = np.stack([np.cross(axis, arm) for axis in np.eye(3)], axis=2)
        shifts = np.broadcast_to(np.eye(dim), (owned, dim, dim))
        return np.concatenate([shifts, turns], axis=2).reshape(owned * dim, dim + turns.shape[2])

    def _free_modes(self, supports: list[fem.DirichletBC]) -> tuple[list[NDArray[np.float64]], list[str]]:
        """Return the rigid modes that the supports leave, and their names.

        Raises:
            CaseError: the body is free to slide along the contact, or to spin about its normal.
        """
        names, forbidden = RIGID_MODES[self.law.kind]
        columns = [*names, *forbidden]
        basis, comm = self._rigid_basis()[:, columns], self.body.mesh.comm
        held = basis[self._owned_dofs(supports)]
        gram = comm.allreduce(held.T @ held)
        scale = np.where(np.array(columns) < self.dim, 1.0, 1.0 / self._size())
        eigenvalues, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
        free = vectors[:, eigenvalues <= 1e-12 * max(eigenvalues.max(), 1.0)] * scale[:, None]
        # A basis in which lambda_F is the velocity along z at the pivot and each lambda_M a rotation.
        echelon, pivots = _column_echelon(free)
        loose = [forbidden[columns[p]] for p in pivots if columns[p] in forbidden]
        if loose:
            name = self.body.name
            message = f"the {name} is free to {' and to '.join(loose)}, friction pulls it"
            raise CaseError(InputError(f"{name}.supports", message))
        return list((basis @ echelon).T.copy()), [names[columns[p]] for p in pivots]

    def _owned_dofs(self, supports: list[fem.DirichletBC]) -> NDArray[np.int32]:
        parts = [bc.dof_indices()[0][: bc.dof_indices()[1]] for bc in supports]
        return np.unique(np.concatenate(parts)) if parts else np.zeros(0, dtype=np.int32)

    def _regularise(self) -> list[fem.DirichletBC]:
        """Return one further support for each rigid mode, away from the contact; collective."""
        if not self.rigid_modes:
            return []
        comm, count = self.body.mesh.comm, len(self.rigid_modes)
        scale = np.array([comm.allreduce(np.abs(m).max(initial=0)) for m in self.rigid_modes])
        modes = np.array(self.rigid_modes).T / scale
        modes.reshape(-1, self.dim, count)[self.trace.local] = 0.0
        # Pivoted QR picks the rows that make R regular: here, then among all ranks' choices.
        local = _best_rows(modes, count)
        proposals = comm.allgather([(comm.rank, int(i), modes[i]) for i in local])
        candidates = [c for proposal in proposals for c in proposal]
        chosen = [candidates[i][:2] for i in _best_rows(np.array([c[2] for c in candidates]), count)]
        mine = np.array([dof for rank, dof in chosen if rank == comm.rank], dtype=np.int32)
        index_map = self.space.dofmap.index_map
        # Ghosts of the chosen dofs are held too: mark them by a scattered function.
        mark = fem.Function(self.space)
        mark.x.array[mine] = 1.0
        mark.x.scatter_forward()
        known = self.dim * (index_map.size_local + index_map.num_ghosts)
        held = np.flatnonzero(mark.x.array[:known]).astype(np.int32)
        return [self._held(component, held[held % self.dim == component]) for component in range(self.dim)]

    def thermal_coupling(self, temperature: fem.FunctionSpace) -> PETSc.Mat:
        """Return G: the nodal forces G theta of free thermal expansion, N/mm per K; collective.

        The integral of the thermal stress of theta times the strain of v. Supports take no force.
        """
        law, dim = self.law, self.dim
        # dolfinx assembles square blocks only: blocks of temperatures, numbered as single ones, of which one counts.
        element = basix.ufl.blocked_element(temperature.ufl_element(), shape=(dim,))
        theta, v = ufl.TrialFunction(fem.functionspace(self.body.mesh, element))[0], ufl.TestFunction(self.space)
        work = ufl.inner(law.thermal_stress(theta), strain_of(v, law.kind)) * measure(self.body.mesh, law.kind) * ufl.dx
        coupling = assembled(work, first_column=True)
        start = dim * self.space.dofmap.index_map.local_range[0]
        coupling.zeroRows((self.supported + start).astype(np.int32), diag=0.0)
        return coupling

    def surface_integral(self, traction: Any, tag: int) -> Array:
        """Return the integral of traction . v over the facets tagged `tag` (owned,); collective."""
        ds = ufl.Measure("ds", domain=self.body.mesh, subdomain_data=self.body.facet_tags)
        work = ufl.inner(traction, ufl.TestFunction(self.space)) * measure(self.body.mesh, self.law.kind)
        return assembled_vector(work * ds(tag))

    def _assemble_load(self, loads: Sequence[Load]) -> Array:
        mesh = self.body.mesh
        total = np.zeros(self.dim * self.space.dofmap.index_map.size_local)
        for number, load in enumerate(loads):
            tag = self.body.curve(load.on, f"{self.body.name}.loads.{number}.on")
            ds = ufl.Measure("ds", domain=mesh, subdomain_data=self.body.facet_tags)
            facets = fem.form(measure(mesh, self.law.kind) * ds(tag))
            area = self.thickness * mesh.comm.allreduce(fem.assemble_scalar(facets))
            resultant = load.force if load.traction is None else [area * component for component in load.traction]
            traction = np.array(resultant) / area
            total += self.surface_integral(fem.Constant(mesh, traction.astype(PETSc.ScalarType)), tag)
        return total


def _quadrature(mesh: Mesh, degree: int) -> dict[str, int]:
    """Return the degree along each axis that the patch test needs in hexahedra: of grad v, p, and J^-T det J, 2 g.

    UFL adds up the degrees of all factors, which are of all three axes: 10 in place of 6, 216 points for 64.
    """
    if mesh.basix_cell().name != "hexahedron":
        return {}
    return {"quadrature_degree": max(2 * degree, degree + 2 * mesh.geometry.cmap.degree)}


def _support_points(body: BodyMesh, support: Support, key: str) -> NDArray[np.float64]:
    if support.at is not None:
        return np.array([support.at])
    if support.on not in body.points:
        known = ", ".join(sorted({*body.curves, *body.points}))
        entity = ENTITIES[body.mesh.topology.dim - 1]
        message = f"no physical {entity} or point {support.on!r} on the {body.name}; the geometry has {known}"
        raise CaseError(InputError(f"{key}.on", message))
    return body.points[support.on]


def _pivot(body: BodyMesh, description: Body) -> NDArray[np.float64]:
    """Return the point O about which rotations are taken; by default the first support's centre."""
    if description.pivot is not None:
        return np.array(description.pivot)
    for number, support in enumerate(description.supports):
        if support.on is None or support.on in body.points:
            return _support_points(body, support, f"{body.name}.supports.{number}").mean(axis=0)
    return np.zeros(body.mesh.geometry.dim)


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


def _best_rows(matrix: NDArray[np.float64], count: int) -> list[int]:
    """Return the rows that span best: each time the largest of what those before have left (QR with pivoting)."""
    rest, chosen = np.array(matrix), []
    for _ in range(min(count, len(rest))):
        best = int(np.argmax(np.einsum("ij,ij->i", rest, rest)))
        chosen.append(best)
        length = float(np.linalg.norm(rest[best]))
        if length > 0:
            unit = rest[best] / length
            rest -= np.outer(rest @ unit, unit)
    return chosen
