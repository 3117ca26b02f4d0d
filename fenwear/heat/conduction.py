"""Heat conduction in one body in UFL: steady, transient, with the strip's material moving.

    rho c (d theta/dt + v . grad theta) = div(k grad theta) - (2 h / t) (theta - theta_a)

with convection h (theta - theta_a) on free boundaries, held temperatures, and a heat flux q into
the contact surface. Where material that is new enters through a free boundary, v . n < 0, it brings
the heat of its temperature theta_in with it, and it leaves with its own:

    k d theta/dn = rho c (v . n) (theta - theta_in)   where v . n < 0,

which makes the form coercive: its boundary part is (1/2) rho c |v . n| theta². Implicit Euler in
time. Advection is stabilised by streamline upwinding with the whole residual (SUPG), so that the
order of the elements is kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import basix.ufl
import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear import compat
from fenwear.arrays import Array
from fenwear.bodies.assembly import assembled
from fenwear.bodies.factor import Factor
from fenwear.bodies.material import region_field
from fenwear.bodies.mesh import BodyMesh
from fenwear.case import Body, Heat, Material, Model
from fenwear.errors import CaseError, Problem

PREFIX = "fenwear_heat_"
FREE, CONTACT, HELD = 1, 2, 3
CHECK_EVERY = 100  # steps between two looks at the residual of a factor without pivoting
LARGEST_RESIDUAL = 1e-9  # over the right-hand side: above, the factor is made again with pivoting


@dataclass(frozen=True)
class Surroundings:
    """What a body meets beyond its mesh.

    Attributes:
        renewed: Whether material that enters is new, at theta_in; else what has left comes back as it was.
        exposed: Part of the contact surface that lies opposite nothing and convects, as loads of a
            unit flux there (owned,), mm; None for none.
    """

    renewed: bool = False
    exposed: Array | None = None


ALONE = Surroundings()


class HeatBody:
    """Conduction in one body, per thickness: A theta = B theta_before + f + C q.

    Attributes:
        space: Scalar Lagrange space on the nodes of the displacement, K.
        flow: Velocity of the material at unit speed, a vector field of UFL; by default along x.
        inflow: theta_in, K.
        nodes: Global numbers of the contact nodes (n,), in order along the contact.
        weights: Quadrature weights of these nodes (n,), mm.
    """

    def __init__(
        self,
        body: BodyMesh,
        description: Body,
        materials: dict[str, Material],
        model: Model,
        heat: Heat,
        degree: int,
        flow: Any = None,
    ) -> None:
        """Prepare the forms; collective.

        Raises:
            CaseError: an unknown group.
        """
        self.body, self.heat = body, heat
        along_x = np.eye(body.mesh.geometry.dim)[0]
        self.flow = fem.Constant(body.mesh, along_x.astype(PETSc.ScalarType)) if flow is None else flow
        self.inflow = heat.ambient if heat.inflow is None else heat.inflow
        self.space = fem.functionspace(body.mesh, basix.ufl.element("Lagrange", body.mesh.basix_cell(), degree))
        of_region = {region: materials[name] for region, name in description.regions.items()}
        self.conductivity = region_field(body, {r: m.conductivity or 0.0 for r, m in of_region.items()})
        capacity = {r: (m.density or 0.0) * (m.heat_capacity or 0.0) for r, m in of_region.items()}
        self.capacity = region_field(body, capacity)
        self.face_loss = 2 * heat.convection / model.thickness if heat.convecting_faces else 0.0
        self._tag_boundary(description)
        self._find_contact_nodes()

    def _tag_boundary(self, description: Body) -> None:
        """Mark every exterior facet as convecting, in contact, or held at a temperature."""
        body, domain = self.body, self.body.mesh
        dim = domain.topology.dim - 1
        domain.topology.create_connectivity(dim, dim + 1)
        facets = mesh.exterior_facet_indices(domain.topology)
        marker = np.zeros(domain.topology.index_map(dim).size_local + domain.topology.index_map(dim).num_ghosts)
        marker[facets] = FREE
        marker[body.facet_tags.find(body.curves[f"{body.name}_contact"])] = CONTACT
        held = fem.Function(self.space)
        held.x.array[:] = np.nan
        for number, prescribed in enumerate(description.temperatures):
            tag = body.curve(prescribed.on, f"{body.name}.temperatures.{number}.on")
            if prescribed.on == f"{body.name}_contact":
                key = f"{body.name}.temperatures.{number}.on"
                raise CaseError(Problem(key, "the contact surface takes friction heat: it cannot be held"))
            chosen = body.facet_tags.find(tag)
            marker[chosen] = HELD
            held.x.array[fem.locate_dofs_topological(self.space, dim, chosen)] = prescribed.temperature
        tagged = np.flatnonzero(marker).astype(np.int32)
        self.boundary = mesh.meshtags(domain, dim, tagged, marker[tagged].astype(np.int32))
        self.owned = self.space.dofmap.index_map.size_local
        self.held = np.flatnonzero(~np.isnan(held.x.array[: self.owned])).astype(np.int32)
        self.held_values = held.x.array[self.held]

    def _find_contact_nodes(self) -> None:
        body, index_map = self.body, self.space.dofmap.index_map
        tag = body.curves[f"{body.name}_contact"]
        own = fem.locate_dofs_topological(self.space, body.mesh.topology.dim - 1, body.facet_tags.find(tag))
        own = own[own < index_map.size_local]
        weights = self._vector(ufl.TestFunction(self.space) * self._ds(CONTACT)).array_r[own]
        part = (self.space.tabulate_dof_coordinates()[own, 0], index_map.local_to_global(own), weights)
        x, nodes, weights = (np.concatenate(a) for a in zip(*body.mesh.comm.allgather(part), strict=True))
        order = np.argsort(x, kind="stable")
        self.nodes, self.weights = nodes[order].astype(np.int64), weights[order]
        start = index_map.local_range[0]
        mine = (self.nodes >= start) & (self.nodes < start + self.owned)
        self._mine, self._mine_local = np.flatnonzero(mine), (self.nodes[mine] - start).astype(np.int64)

    def _ds(self, tag: int) -> Any:
        return ufl.Measure("ds", domain=self.body.mesh, subdomain_data=self.boundary)(tag)

    def _vector(self, form: Any) -> PETSc.Vec:
        vector = fem.petsc.assemble_vector(form if isinstance(form, fem.Form) else fem.form(form))
        vector.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        return vector

    @cached_property
    def _step_forms(self) -> _StepForms:
        domain = self.body.mesh
        theta, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        rate, speed, renewed = (fem.Constant(domain, PETSc.ScalarType(0)) for _ in range(3))
        v = speed * self.flow
        k, rho_c, h = self.conductivity, self.capacity, self.heat.convection
        degree = self.space.ufl_element().degree
        dx = ufl.dx(domain, metadata={"quadrature_degree": 2 * degree + 1})  # tau is constant in an element
        ambient = fem.Constant(domain, PETSc.ScalarType(self.heat.ambient))
        faces = fem.Constant(domain, PETSc.ScalarType(self.face_loss))
        edges = fem.Constant(domain, PETSc.ScalarType(h))
        tau = self._supg_time(rate, v)
        upwind = tau * ufl.dot(v, ufl.grad(w))
        advected = ufl.dot(v, ufl.grad(theta))
        entering = rho_c * renewed * ufl.max_value(-ufl.dot(v, ufl.FacetNormal(domain)), 0)  # heat capacity a second
        residual = rho_c * (rate * theta + advected) - ufl.div(k * ufl.grad(theta)) + faces * theta
        a = rho_c * (rate * theta + advected) * w * dx + ufl.inner(k * ufl.grad(theta), ufl.grad(w)) * dx
        a += faces * theta * w * dx + (edges + entering) * theta * w * self._ds(FREE) + upwind * residual * dx
        b = rho_c * rate * theta * (w + upwind) * dx
        f = faces * ambient * (w + upwind) * dx + (edges * ambient + entering * self.inflow) * w * self._ds(FREE)
        a_form, b_form, f_form, brought = (fem.form(form) for form in (a, b, f, entering * w * self._ds(FREE)))
        return _StepForms(a_form, b_form, f_form, brought, rate, speed, renewed)

    def _supg_time(self, rate: Any, v: Any) -> Any:
        """Return the stabilisation time tau: 1 / sqrt((2/dt)^2 + (2 |v| p / l)^2 + (4 p^2 a / l^2)^2).

        l is the element's length along v, p the degree, a = k / (rho c) the diffusivity
        (Shakib, Hughes and Johan 1991, with the node spacing l / p for the length).
        """
        length = self._lengths_along_flow() / self.space.ufl_element().degree
        diffusivity = self.conductivity / self.capacity
        squares = (2 * rate) ** 2 + 4 * ufl.dot(v, v) / length**2 + (4 * diffusivity / length**2) ** 2
        return 1 / ufl.sqrt(squares)

    def _lengths_along_flow(self) -> fem.Function:
        domain = self.body.mesh
        cells, dim = domain.topology.index_map(domain.topology.dim), domain.geometry.dim
        count = cells.size_local + cells.num_ghosts
        vectors = fem.functionspace(domain, ("DG", 0, (dim,)))
        flow = fem.Function(vectors)
        flow.interpolate(fem.Expression(self.flow, compat.interpolation_points(vectors)))
        along = flow.x.array.reshape(-1, dim)[:count]
        speeds = np.linalg.norm(along, axis=1, keepdims=True)
        along = np.where(speeds > 0, along, np.eye(dim)[0]) / np.where(speeds > 0, speeds, 1.0)  # on an axis: any
        x = np.einsum("kic,kc->ki", domain.geometry.x[compat.geometry_dofmap(domain)[:count], :dim], along)
        lengths = fem.Function(fem.functionspace(domain, ("DG", 0)))
        lengths.x.array[:count] = x.max(axis=1) - x.min(axis=1)
        return lengths

    def step(self, speed: float, duration: float, surroundings: Surroundings = ALONE) -> HeatStep:
        """Assemble and factor one implicit Euler step, or for an infinite duration the steady state; collective.

        Args:
            speed: Of the material, mm/s: its velocity is speed times `flow`.
            duration: Of the step, s.
            surroundings: What lies beyond the mesh.

        Raises:
            CaseError: a steady state of a body that loses heat nowhere.
        """
        if math.isinf(duration):
            self.check_heat_sink(speed, surroundings)
        forms = self._step_forms
        forms.rate.value = 0.0 if math.isinf(duration) else 1 / duration
        forms.speed.value, forms.renewed.value = speed, float(surroundings.renewed)
        a, b, f, entering = assembled(forms.a), assembled(forms.b), self._vector(forms.f), self._vector(forms.entering)
        if surroundings.exposed is not None:
            loss = a.createVecLeft()
            loss.array[:] = self.heat.convection * surroundings.exposed
            a.setDiagonal(loss, addv=PETSc.InsertMode.ADD)
            f.axpy(self.heat.ambient, loss)
        carried = speed * self.carried + entering.array_r
        brought = self.inflow * float(self.body.mesh.comm.allreduce(entering.array_r.sum()))
        return HeatStep(self, a, b, f, duration, carried, brought)

    def loses_heat(self, speed: float = 0.0, surroundings: Surroundings = ALONE) -> bool:
        """Return whether a heat sink exists: convection, a held temperature or new material; collective."""
        return (
            self.heat.convection > 0
            or self.body.mesh.comm.allreduce(len(self.held)) > 0
            or (surroundings.renewed and speed != 0 and self.is_open)
        )

    @cached_property
    def is_open(self) -> bool:
        """Whether the material moves through a free boundary, rounding apart; collective."""
        flow, normal = self.flow, ufl.FacetNormal(self.body.mesh)
        forms = (abs(ufl.dot(flow, normal)) * self._ds(FREE), ufl.sqrt(ufl.dot(flow, flow)) * self._ds(FREE))
        comm = self.body.mesh.comm
        through, along = (comm.allreduce(fem.assemble_scalar(fem.form(form))) for form in forms)
        return bool(through > 1e-9 * along)

    def extremes(self, surroundings: Surroundings) -> tuple[float, float]:
        """Return the coldest and the hottest that the body is at first, is held at, or meets, K; collective."""
        met = [self.heat.initial, self.heat.ambient] + ([self.inflow] if surroundings.renewed else [])
        met += [float(value) for value in self.held_values]
        comm = self.body.mesh.comm
        return comm.allreduce(min(met), MPI.MIN), comm.allreduce(max(met), MPI.MAX)

    def check_heat_sink(self, speed: float = 0.0, surroundings: Surroundings = ALONE) -> None:
        """Make sure that a steady temperature exists; collective.

        Raises:
            CaseError: the body loses heat nowhere.
        """
        if not self.loses_heat(speed, surroundings):
            message = f"the {self.body.name} loses heat nowhere: expected convection or a held temperature"
            raise CaseError(Problem("heat.convection", message))

    def function(self, theta: Array) -> fem.Function:
        """Return the temperature of the owned degrees of freedom as a function; collective."""
        function = fem.Function(self.space, name="temperature")
        function.x.array[: self.owned] = theta
        function.x.scatter_forward()
        return function

    def initial(self) -> Array:
        """Return the initial temperature of the owned degrees of freedom."""
        theta = np.full(self.owned, self.heat.initial)
        theta[self.held] = self.held_values
        return theta

    def place(self, load: Array) -> Array:
        """Return loads at the contact nodes (n,) or (n, k) on the owned degrees of freedom."""
        placed = np.zeros((self.owned, *load.shape[1:]))
        placed[self._mine_local] = load[self._mine]
        return placed

    @cached_property
    def contact_rows(self) -> csr_array:
        """The matrix that picks the temperatures at the contact nodes (n, owned): this rank's columns."""
        places = (self._mine, self._mine_local)
        return csr_array((np.ones(len(self._mine)), places), shape=(len(self.nodes), self.owned))

    @cached_property
    def _capacity_matrix(self) -> PETSc.Mat:
        theta, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        return assembled(self.capacity * theta * w * ufl.dx)

    def store(self, theta: Array) -> Array:
        """Return the heat capacity matrix times fields (owned,) or (owned, k); collective."""
        fields = theta.reshape(self.owned, -1)
        product = self._capacity_matrix.matMult(_dense(self._capacity_matrix, fields))
        return product.getDenseArray().reshape(theta.shape).copy()

    @cached_property
    def storage(self) -> Array:
        """Heat stored for each degree of freedom's kelvin, per thickness (owned,), mJ/(mm K)."""
        return self._vector(self.capacity * ufl.TestFunction(self.space) * ufl.dx(self.body.mesh)).array_r.copy()

    @cached_property
    def carried(self) -> Array:
        """Heat carried out by material moving at unit speed, for each kelvin (owned,), mJ/(mm² K)."""
        w = ufl.TestFunction(self.space)
        return self._vector(self.capacity * ufl.dot(self.flow, ufl.grad(w)) * ufl.dx(self.body.mesh)).array_r.copy()

    @cached_property
    def convected(self) -> Array:
        """Heat lost to the surroundings for each degree of freedom's kelvin (owned,), mW/(mm K)."""
        w = ufl.TestFunction(self.space)
        faces = fem.Constant(self.body.mesh, PETSc.ScalarType(self.face_loss))
        edges = fem.Constant(self.body.mesh, PETSc.ScalarType(self.heat.convection))
        return self._vector(faces * w * ufl.dx(self.body.mesh) + edges * w * self._ds(FREE)).array_r.copy()


@dataclass(frozen=True)
class _StepForms:
    """The forms of A, B, f and of the heat capacity that enters a second, with the constants that they contain."""

    a: fem.Form
    b: fem.Form
    f: fem.Form
    entering: fem.Form
    rate: fem.Constant
    speed: fem.Constant
    renewed: fem.Constant


class HeatStep:
    """One factored step of a body: A theta = B theta_before + f + C q.

    Attributes:
        body: Whose step it is.
        carried: Heat that the material carries out a second, for each kelvin (owned,), mW/(mm K).
        brought: Heat that new material brings in a second, mW/mm.
        held_by_end, held_by_start, held_source: Sums of the rows of A, B and f that held
            temperatures replace: with them the heat that enters through these boundaries.
    """

    def __init__(
        self,
        body: HeatBody,
        a: PETSc.Mat,
        b: PETSc.Mat,
        f: PETSc.Vec,
        duration: float,
        carried: Array,
        brought: float,
    ) -> None:
        self.body, self.carried, self.brought = body, carried, brought
        start = body.space.dofmap.index_map.local_range[0]
        rows = (body.held + start).astype(np.int32)
        indicator = a.createVecLeft()
        indicator.array[body.held] = 1.0
        self.held_by_end, self.held_by_start = (_transposed(m, indicator) for m in (a, b))
        self.held_source = float(body.body.mesh.comm.allreduce(f.array_r[body.held].sum()))
        a.zeroRows(rows, diag=1.0)
        b.zeroRows(rows, diag=0.0)
        self.source = f.array_r.copy()
        self.source[body.held] = body.held_values
        self.a, self.b = a, b
        self._is_held = np.zeros(body.owned, dtype=bool)
        self._is_held[body.held] = True
        self._rhs, self._solution = a.createVecLeft(), a.createVecRight()
        self._factor = Factor(a, PREFIX, "lu", repeated=duration < np.inf)
        self._pivoted, self._solved = duration == np.inf, 0

    def advance(self, theta: Array) -> Array:
        """Return the temperature at the end without any flux through the contact (owned,); collective."""
        self._solution.array[:] = theta
        self.b.mult(self._solution, self._rhs)
        self._rhs.array[:] += self.source
        self._factor.solve(self._rhs, self._solution)
        self._solved += 1
        if self._solved % CHECK_EVERY == 1 and not self._is_exact(self._rhs, self._solution):
            self._pivot()
            self._factor.solve(self._rhs, self._solution)
        return self._solution.array_r.copy()

    def _is_exact(self, rhs: PETSc.Vec, solution: PETSc.Vec) -> bool:
        """Return whether a solution of the factor is one of the matrix, or no factor can be better; collective."""
        if self._pivoted:
            return True
        residual = rhs.duplicate()
        self.a.mult(solution, residual)
        residual.axpy(-1.0, rhs)
        return bool(residual.norm() <= LARGEST_RESIDUAL * rhs.norm())

    def _pivot(self) -> None:
        """Factor again, with pivoting; collective."""
        self._factor, self._pivoted = Factor(self.a, PREFIX, "lu"), True

    def advance_linear(self, thetas: Array) -> Array:
        """Return A^-1 B of several fields (owned, k), without the sources; collective."""
        return self._solve_many(thetas, self.b.matMult)

    def respond(self, load: Array) -> Array:
        """Return A^-1 of several loads (owned, k), mW/mm; collective."""
        return self._solve_many(np.where(self._is_held[:, None], 0.0, load), lambda loads: loads)

    def apply(self, fields: Array) -> tuple[Array, Array]:
        """Return A and B times several fields (owned, k); collective."""
        dense = _dense(self.a, fields)
        by_a, by_b = self.a.matMult(dense), self.b.matMult(dense)  # named: their arrays live no longer than they
        return by_a.getDenseArray().copy(), by_b.getDenseArray().copy()

    def _solve_many(self, fields: Array, prepare: Callable[[PETSc.Mat], PETSc.Mat]) -> Array:
        rhs = prepare(_dense(self.a, fields))
        solution = rhs.duplicate()
        solution.setUp()
        self._factor.matSolve(rhs, solution)
        if not self._pivoted and not self._are_exact(rhs, solution):
            self._pivot()
            self._factor.matSolve(rhs, solution)
        return solution.getDenseArray().copy()

    def _are_exact(self, rhs: PETSc.Mat, solution: PETSc.Mat) -> bool:
        residual = self.a.matMult(solution)
        residual.axpy(-1.0, rhs)
        return bool(residual.norm() <= LARGEST_RESIDUAL * rhs.norm())


def _dense(like: PETSc.Mat, fields: Array) -> PETSc.Mat:
    """Return fields (owned, k) as a dense matrix with the rows of `like`; collective."""
    dense = PETSc.Mat().createDense((like.getSizes()[0], (PETSc.DECIDE, fields.shape[1])), comm=like.comm)
    dense.setUp()
    dense.getDenseArray()[:] = fields
    dense.assemble()
    return dense


def _transposed(matrix: PETSc.Mat, vector: PETSc.Vec) -> Array:
    result = matrix.createVecRight()
    matrix.multTranspose(vector, result)
    return result.array_r.copy()
