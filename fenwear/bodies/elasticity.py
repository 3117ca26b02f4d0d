"""Linear elasticity of one body in UFL: stiffness, supports, loads, rigid modes, factorisation."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any, Literal

import basix.ufl
import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import scipy.linalg
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from fenwear import compat
from fenwear.bodies.assembly import assembled
from fenwear.bodies.factor import Factor
from fenwear.bodies.mesh import BodyMesh
from fenwear.case import Body, Load, Material, Model, Support
from fenwear.errors import CaseError, Problem
from fenwear.parallel import total

AXES = {"x": 0, "z": 1}
PREFIX = "fenwear_elasticity_"


def strain(u: Any) -> Any:
    """Return eps(u) = (grad u + grad u^T) / 2."""
    return ufl.sym(ufl.grad(u))


def lame(young: Any, poisson: Any, plane: Literal["stress", "strain"]) -> tuple[Any, Any]:
    """Return Lame's lambda and mu of the plane model, MPa.

    In plane stress lambda is 2 lambda mu / (lambda + 2 mu), so that sigma_yy = 0.
    """
    mu = young / (2 * (1 + poisson))
    if plane == "stress":
        return young * poisson / (1 - poisson**2), mu
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu


def stress(u: Any, lmbda: Any, mu: Any) -> Any:
    """Return sigma = lambda tr(eps) I + 2 mu eps, MPa."""
    eps = strain(u)
    return lmbda * ufl.tr(eps) * ufl.Identity(len(u)) + 2 * mu * eps


def region_field(body: BodyMesh, values: dict[str, float]) -> fem.Function:
    """Return the field that is constant on each material region.

    Args:
        values: The value on each region, by its name.
    """
    field = fem.Function(fem.functionspace(body.mesh, ("DG", 0)))
    for region, value in values.items():
        field.x.array[body.cell_tags.find(body.regions[region])] = value
    field.x.scatter_forward()
    return field


class ElasticBody:
    """One body: K u = f + C p, with rigid modes R where the supports leave some.

    K is made regular by a few further supports; they carry nothing as long as the equilibrium
    R^T (f + C p) = 0 holds, and the displacement is u + R a.

    Attributes:
        space: Vector Lagrange space on Gauss-Lobatto nodes, mm.
        stiffness: K with all supports eliminated, per thickness, MPa.
        supported: The owned degrees of freedom that are held at zero.
        load: f, per thickness, N/mm, zero where supported.
        rigid_modes: Columns of R; the displacement of each for a unit velocity.
        rigid_resultant: R^T f, shape (modes,): N/mm, and N for the rotation.
        mode_names: "lambda_F" (translation along z at the pivot) and "lambda_M" (rotation about it).
    """

    def __init__(
        self,
        body: BodyMesh,
        description: Body,
        materials: dict[str, Material],
        model: Model,
        degree: int,
    ) -> None:
        """Assemble and factor the stiffness of `body`; collective.

        Raises:
            CaseError: an unknown group or region, a support off the body, a body free to slide.
        """
        self.body = body
        mesh = body.mesh
        _check_regions(body, description)
        cell = mesh.basix_cell()
        element = basix.ufl.element("Lagrange", cell, degree, shape=(mesh.geometry.dim,))
        self.space = fem.functionspace(mesh, element)
        self.pivot = _pivot(body, description)
        supports = self._supports(description.supports)
        modes, self.mode_names = self._free_modes(supports)
        self.rigid_modes = modes

        self._regions, self._plane = description.regions, model.plane
        of_region = {region: materials[name] for region, name in description.regions.items()}
        young = region_field(body, {r: m.young for r, m in of_region.items()})
        poisson = region_field(body, {r: m.poisson for r, m in of_region.items()})
        self.lame = lame(young, poisson, model.plane)
        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        a = ufl.inner(stress(u, *self.lame), strain(v)) * ufl.dx

        bcs = supports + self._regularise()
        self.supported = self._owned_dofs(bcs)
        self._set_loads(description.loads, model.thickness)
        self.stiffness = assembled(a, bcs)
        self.stiffness.setOption(PETSc.Mat.Option.SPD, True)
        self._factor: Factor | None = None

    def _set_loads(self, loads: Sequence[Load], thickness: float) -> None:
        load = self._assemble_load(loads, thickness)
        resultant = np.array([mode @ load.array_r for mode in self.rigid_modes])
        self.rigid_resultant = total(self.body.mesh.comm, resultant)
        load.array[self.supported] = 0.0
        self.load = load

    def with_loads(self, loads: Sequence[Load], thickness: float) -> ElasticBody:
        """Return the same body under other loads, with the same stiffness and factor; collective."""
        body = copy.copy(self)
        body._set_loads(loads, thickness)
        return body

    @property
    def factor(self) -> Factor:
        """The Cholesky factor of K, made once; collective at first use."""
        if self._factor is None:
            self._factor = Factor(self.stiffness, PREFIX, "cholesky")
        return self._factor

    def _supports(self, supports: Sequence[Support]) -> list[fem.DirichletBC]:
        key = f"{self.body.name}.supports"
        return [
            self._held(component, self._support_dofs(support, component, f"{key}.{number}"))
            for number, support in enumerate(supports)
            for component in (AXES[axis] for axis in support.fix)
        ]

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
            place = ", ".join(f"({p[0]:g}, {p[1]:g})" for p in missing)
            raise CaseError(Problem(f"{key}.at", f"a pin off the {body.name}: no node of its mesh at {place} mm"))
        return to_parent[(distance < tolerance).any(axis=1)]

    def _size(self) -> float:
        """Return the largest extent of the body, mm; collective."""
        from mpi4py import MPI

        comm, x = self.body.mesh.comm, self.body.mesh.geometry.x
        low = np.array([comm.allreduce(x[:, i].min(initial=np.inf), MPI.MIN) for i in range(3)])
        high = np.array([comm.allreduce(x[:, i].max(initial=-np.inf), MPI.MAX) for i in range(3)])
        return float((high - low).max())

    def _rigid_basis(self) -> NDArray[np.float64]:
        """Return translations along x and z and the rotation about y at the pivot, on the owned dofs.

        The rotation vector points along y = z cross x, so a positive one lowers what lies at
        larger x: u = (z - z_O, -(x - x_O)). These are the paper's signs of lambda_M.
        """
        owned = self.space.dofmap.index_map.size_local
        x = self.space.tabulate_dof_coordinates()[:owned]
        basis = np.zeros((owned, 2, 3))
        basis[:, 0, 0] = basis[:, 1, 1] = 1.0
        basis[:, 0, 2], basis[:, 1, 2] = x[:, 1] - self.pivot[1], -(x[:, 0] - self.pivot[0])
        return basis.reshape(-1, 3)

    def _free_modes(self, supports: list[fem.DirichletBC]) -> tuple[list[NDArray[np.float64]], list[str]]:
        """Return the rigid modes that the supports leave, and their names.

        Raises:
            CaseError: the body is free to slide along x.
        """
        basis, comm = self._rigid_basis(), self.body.mesh.comm
        held = basis[self._owned_dofs(supports)]
        gram = comm.allreduce(held.T @ held)
        scale = np.array([1.0, 1.0, 1.0 / self._size()])
        eigenvalues, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
        free = vectors[:, eigenvalues <= 1e-12 * max(eigenvalues.max(), 1.0)] * scale[:, None]
        # A basis in which lambda_F is the velocity along z at the pivot and lambda_M the rotation.
        order = [1, 2, 0]
        echelon, pivots = _column_echelon(free[order])
        if any(order[p] == 0 for p in pivots):
            name = self.body.name
            message = f"the {name} is free to slide along x: hold its x somewhere, friction pulls it"
            raise CaseError(Problem(f"{name}.supports", message))
        combined = np.zeros_like(echelon)
        combined[order] = echelon
        names = ["lambda_F" if order[p] == 1 else "lambda_M" for p in pivots]
        return list((basis @ combined).T.copy()), names

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
        surface = self.contact_nodes()
        modes[np.concatenate([2 * surface, 2 * surface + 1])] = 0.0
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
        held = np.flatnonzero(mark.x.array[: 2 * (index_map.size_local + index_map.num_ghosts)]).astype(np.int32)
        return [self._held(component, held[held % 2 == component]) for component in (0, 1)]

    def thermal_modulus(self, materials: dict[str, Material]) -> fem.Function:
        """Return gamma, the in-plane stress that holds back each kelvin of expansion, MPa/K.

        E alpha / (1 - nu) in plane stress, E alpha / (1 - 2 nu) in plane strain.
        """
        held = 1 if self._plane == "stress" else 2
        used = {region: materials[name] for region, name in self._regions.items()}
        values = {r: m.young * (m.expansion or 0.0) / (1 - held * m.poisson) for r, m in used.items()}
        return region_field(self.body, values)

    def thermal_coupling(self, temperature: fem.FunctionSpace, materials: dict[str, Material]) -> PETSc.Mat:
        """Return G: the nodal forces G theta of free thermal expansion, N/mm per K; collective.

        The integral of gamma theta div v, gamma the `thermal_modulus`. Supports take no force.
        """
        gamma = self.thermal_modulus(materials)
        # dolfinx assembles square blocks only: pairs of temperatures, numbered as the single ones, of which one counts.
        element = basix.ufl.blocked_element(temperature.ufl_element(), shape=(self.body.mesh.geometry.dim,))
        theta, v = ufl.TrialFunction(fem.functionspace(self.body.mesh, element))[0], ufl.TestFunction(self.space)
        coupling = assembled(gamma * theta * ufl.div(v) * ufl.dx, first_column=True)
        start = 2 * self.space.dofmap.index_map.local_range[0]
        coupling.zeroRows((self.supported + start).astype(np.int32), diag=0.0)
        return coupling

    def contact_nodes(self) -> NDArray[np.int32]:
        """Return this rank's own nodes (blocks of dofs) on the contact surface; collective."""
        tag = self.body.curves[f"{self.body.name}_contact"]
        dim = self.body.mesh.topology.dim - 1
        nodes = fem.locate_dofs_topological(self.space, dim, self.body.facet_tags.find(tag))
        return nodes[nodes < self.space.dofmap.index_map.size_local]

    def surface_integral(self, traction: Any, tag: int) -> PETSc.Vec:
        """Return the vector of the integral of traction . v over the facets tagged `tag`; collective."""
        ds = ufl.Measure("ds", domain=self.body.mesh, subdomain_data=self.body.facet_tags)
        vector = fem.petsc.assemble_vector(fem.form(ufl.inner(traction, ufl.TestFunction(self.space)) * ds(tag)))
        vector.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        return vector

    def _assemble_load(self, loads: Sequence[Load], thickness: float) -> PETSc.Vec:
        mesh = self.body.mesh
        zero = fem.Function(self.space)  # owns the memory of its petsc_vec
        total = zero.x.petsc_vec.copy()
        for number, load in enumerate(loads):
            tag = self.body.curve(load.on, f"{self.body.name}.loads.{number}.on")
            ds = ufl.Measure("ds", domain=mesh, subdomain_data=self.body.facet_tags)
            one = fem.Constant(mesh, PETSc.ScalarType(1))
            area = thickness * mesh.comm.allreduce(fem.assemble_scalar(fem.form(one * ds(tag))))
            resultant = load.force if load.traction is None else [area * component for component in load.traction]
            traction = np.array(resultant) / area
            total.axpy(1.0, self.surface_integral(fem.Constant(mesh, traction.astype(PETSc.ScalarType)), tag))
        return total


def _check_regions(body: BodyMesh, description: Body) -> None:
    problems = [
        Problem(
            f"{body.name}.regions.{name}",
            f"no physical surface of that name; the geometry has {', '.join(body.regions)}",
        )
        for name in description.regions
        if name not in body.regions
    ] + [
        Problem(f"{body.name}.regions", f"no material for the physical surface {name!r}")
        for name in body.regions
        if name not in description.regions
    ]
    if problems:
        raise CaseError(problems)


def _support_points(body: BodyMesh, support: Support, key: str) -> NDArray[np.float64]:
    if support.at is not None:
        return np.array([support.at])
    if support.on not in body.points:
        known = ", ".join(sorted({*body.curves, *body.points}))
        message = f"no physical curve or point {support.on!r} on the {body.name}; the geometry has {known}"
        raise CaseError(Problem(f"{key}.on", message))
    return body.points[support.on]


def _pivot(body: BodyMesh, description: Body) -> tuple[float, float]:
    """Return the point O about which rotations are taken; by default the first support's centre."""
    if description.pivot is not None:
        return description.pivot
    for number, support in enumerate(description.supports):
        if support.on is None or support.on in body.points:
            x, z = _support_points(body, support, f"{body.name}.supports.{number}").mean(axis=0)
            return float(x), float(z)
    return 0.0, 0.0


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
    """Return the rows that span best, by QR with pivoting."""
    if not len(matrix):
        return []
    pivots = scipy.linalg.qr(matrix.T, mode="r", pivoting=True)[1]
    return [int(i) for i in pivots[:count]]
