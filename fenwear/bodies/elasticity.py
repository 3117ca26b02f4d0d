"""Linear elasticity of one body in UFL: stiffness, supports, loads, rigid modes, factorisation."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array
from ufl.algorithms.check_arities import ArityMismatch

from fenwear.algebra.assembled import assembled, assembled_vector, compiled
from fenwear.algebra.factor import Factor, Iterative, fits, make_together, solve_together
from fenwear.bodies.contact_surface import ContactSurface, contact_surface
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.elastic_material import ElasticLaw, measure, strain_of
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.guides import GuideAnswer, Guides, Loose, make_guides
from fenwear.bodies.substructure import Boundary, Substructures
from fenwear.bodies.supports import Supports
from fenwear.case import AUTO, CONDENSED, Body, Load, Setup
from fenwear.common import compat
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import total

PREFIX = "fenwear_elasticity_"
BY_SIZE = Setup()


@dataclass(frozen=True)
class Reach:
    """Largest extent of the grid of a contact surface.

    Attributes:
        grid: The largest, of any spacing.
        reading: Interpolation from the trace nodes of the mesh to its nodes (n, N_mesh).
    """

    grid: RegularGrid
    reading: csr_array


class ElasticBody:
    """One body: K u = f + C p, with rigid modes R where the supports leave some.

    K is made regular by a few further supports; they carry nothing as long as the equilibrium
    R^T (f + C p) = 0 holds, and the displacement is u + R a. Where guides hold the body against turning their couples
    hold that rotation in equilibrium (`guides`), and the displacement is what `held` makes of it.

    Attributes:
        space: Vector Lagrange space on Gauss-Lobatto nodes, mm.
        supported: The owned degrees of freedom that are held at zero.
        load: f of this rank's own degrees of freedom (owned,), per thickness, N/mm, zero where supported.
        rigid_modes: Columns of R; the displacement of each for a unit velocity.
        rigid_resultant: R^T f, shape (modes,): N/mm, and N for the rotation.
        mode_names: "lambda_F" (translation along z at the pivot) and "lambda_M" (rotation about it).
        guides: Rotations that guides hold and free modes, and the couples and means that fix them.
        guided_resultant: The loads' moments about them (g,).
        imposed: The displacements that supports prescribe, mm; zero elsewhere.
        given: Resultant of the loads (d,), N.
        acting: Sum of the loads' sizes, N: of a moment, whose resultant is none, too.
        swallowed: Part of it that acts where supports hold that component (d,), N: it reaches nothing else.
        operator: Name of how its contact surface answers to forces.
        creep: Growth of its compliance under load; None where it does not.
        surface: The contact surface: the trace of the mesh, or a grid of its own (see `lay_grid`).
        meshed: The trace of the mesh.
        reading: Of a grid, what takes values at the trace nodes of the mesh to its nodes (N, N_mesh); else None.
        reach: Largest extent of that grid; None where it stays.
        setup: Way of its condensation.
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
            body: Mesh and groups of the body.
            description: Supports, loads and pivot of the body.
            law: Law of the material.
            degree: Of the displacement.
            thickness: Of a plane model, mm; 1 for whole rings and solids.
            setup: Way of its condensation; by default as its size says.

        Raises:
            CaseError: an unknown group, a support off the body, a body free to slide, a stress that is not linear.
        """
        self.body, self.law, self.thickness, self.setup = body, law, thickness, setup
        self.operator = CONDENSED if description.operator == AUTO else description.operator
        self.decides, self.taken = description.operator == AUTO, ""  # on a grid; what is to be said of the decision
        self.mortar: Callable[[], csr_array] | None = None
        self.creep = description.creep
        mesh = body.mesh
        dim = mesh.geometry.dim
        self.dim = dim
        element = basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(dim,))
        self.space = fem.functionspace(mesh, element)
        self.surface, self.trace = contact_surface(body, self.space, measure(mesh, law.kind))
        self.meshed = self.surface
        self.reading: csr_array | None = None
        self.reach: Reach | None = None
        self._held = held = Supports(body, self.space, description, law.kind, self.trace)
        self.pivot, self.rigid_modes, self.mode_names = held.pivot, held.modes, held.names
        self.mirrors = held.mirrors
        self._bcs, self.supported, self.imposed = held.conditions, held.held, held.imposed

        u, v = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        dx = ufl.dx(metadata=_quadrature(mesh, degree))
        a = ufl.inner(law.stress(u), strain_of(v, law.kind)) * measure(mesh, law.kind) * dx
        try:
            self._ufl, self._form = a, compiled(a)
        except (ArityMismatch, ValueError):  # UFL stumbles over some of its own messages
            raise CaseError(InputError(f"{body.name}.stress", "expected a stress that is linear in grad u")) from None
        self.guides = self._fixed_by_means(held.loose, description.loads)
        self._set_loads(description.loads)
        # None or one of each, of all bodies that differ by their loads.
        self._answers: list[GuideAnswer] = []
        self.known: dict[bytes, Any] = {}  # what an operator has solved for that does not depend on the grid
        self._factors: list[Factor] = []

    def _fixed_by_means(self, loose: Sequence[Loose], loads: Sequence[Load]) -> Guides:
        """Return the guides, and the places where free motions are measured; collective."""
        mesh = self.body.mesh
        tags = [self.body.curve(load.on, f"{load.key(self.body.name, k)}.on") for k, load in enumerate(loads)]
        ds = ufl.Measure("ds", domain=mesh, subdomain_data=self.body.facet_tags)
        loaded = ds(tuple(sorted(set(tags)))) if tags else None
        return make_guides(self.space, measure(mesh, self.law.kind), loaded, loose)

    def _set_loads(self, loads: Sequence[Load]) -> None:
        comm, load = self.body.mesh.comm, self._assemble_load(loads)
        resultant = np.array([mode @ load for mode in self.rigid_modes])
        self.rigid_resultant = total(comm, resultant)
        self.guided_resultant = self.couple_of(load[:, None])[:, 0]
        onto = [load.reshape(-1, self.dim).sum(axis=0), np.zeros(self.dim)]
        np.add.at(onto[1], self.supported % self.dim, load[self.supported])
        self.given, self.swallowed = (self.thickness * total(comm, part) for part in onto)
        self.acting = float(self.thickness * total(comm, np.array([np.abs(load).sum()]))[0])
        load += self._moved_supports
        load[self.supported] = 0.0
        self.load = load

    @cached_property
    def _moved_supports(self) -> Array:
        """-K u of the displacements u that supports prescribe, at the owned degrees of freedom, N/mm; collective."""
        if not self.moved:
            return np.zeros(self.dim * self.space.dofmap.index_map.size_local)
        return -assembled_vector(ufl.action(self._ufl, self.imposed))

    @cached_property
    def moved(self) -> bool:
        """Whether supports prescribe a displacement; collective at first use."""
        return bool(total(self.body.mesh.comm, np.array([np.abs(self.imposed.x.array).max(initial=0.0)]))[0] > 0)

    def with_loads(self, loads: Sequence[Load]) -> ElasticBody:
        """Return the body under other loads, with the same stiffness and factor; collective."""
        body = copy.copy(self)
        body._set_loads(loads)
        return body

    @cached_property
    def rigid_motion(self) -> Array:
        """Displacement of the contact surface's trace nodes by each rigid mode (N, d, modes); collective."""
        if not self.rigid_modes:
            return np.zeros((*self.surface.trace.shape, 0))
        return self.on_surface(self.trace.pick(np.array(self.rigid_modes).T))

    def lay_grid(
        self,
        surface: ContactSurface,
        reading: csr_array,
        reach: RegularGrid | None = None,
        mortar: Callable[[], csr_array] | None = None,
    ) -> None:
        """Let its contact surface be a grid of its own.

        Args:
            surface: The grid.
            reading: Interpolation from the trace nodes of the mesh (N, N_mesh).
            reach: Its largest extent, which this reads, too; None where it stays.
            mortar: Makes the same by integrals, for a body that is condensed in the end, where its contact decides.
        """
        self.surface, self.reading, self.mortar = surface, reading, mortar
        self.reach = None if reach is None else Reach(reach, reading)

    def on_grid(self, surface: ContactSurface, reading: csr_array) -> ElasticBody:
        """Return the body on another grid, as `lay_grid`, with the same stiffness and factor."""
        body = copy.copy(self)
        body.__dict__.pop("rigid_motion", None)
        body.surface, body.reading = surface, reading
        return body

    def on_surface(self, values: Array) -> Array:
        """Return values at the trace nodes of the mesh (N_mesh, ...) at those of the contact surface (N, ...)."""
        if self.reading is None:
            return values
        flat = np.asarray(self.reading @ values.reshape(len(values), -1))
        return flat.reshape(len(flat), *values.shape[1:])

    def on_trace(self, forces: Array) -> Array:
        """Return forces at the trace nodes of the contact surface (N, ...) at those of the mesh (N_mesh, ...)."""
        if self.reading is None:
            return forces
        flat = np.asarray(self.reading.T @ forces.reshape(len(forces), -1))
        return flat.reshape(len(flat), *forces.shape[1:])

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

    def free_stiffness(self) -> PETSc.Mat:
        """Return K without any supports, per thickness, MPa; collective."""
        return assembled(self._form)

    @cached_property
    def stiffness(self) -> PETSc.Mat:
        """K with all supports eliminated, per thickness, MPa; collective at first use."""
        matrix = assembled(self._form, self._bcs)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        return matrix

    def identity(self) -> list[object]:
        """Return the data behind this rank's part of K and f: the form, its values, the mesh, the supports."""
        mesh, form = self.body.mesh, self._ufl
        values = [constant.value for constant in form.constants()]
        values += [function.x.array for function in form.coefficients()]
        nodes = [mesh.geometry.x, compat.geometry_dofmap(mesh), self.space.dofmap.list]
        guided = [self.guides.couples, self.guided_resultant]
        return [form.signature(), *values, *nodes, self.supported, self.load, self.surface_dofs, *guided]

    def solve(self, right: Array) -> Array:
        """Return K^-1 times right-hand sides on the owned degrees of freedom, (owned,) or (owned, k); collective."""
        return solve_together([self.factor], [right])[0]

    def couple_of(self, forces: Array) -> Array:
        """Return the guides' moments (g, k) of forces (owned, k), of forces on supports, too; collective."""
        return total(self.body.mesh.comm, self.guides.rotations.T @ forces)

    @property
    def guide_answer(self) -> GuideAnswer:
        """Response of the body to its guides, solved for once; collective at first use."""
        if not self._answers:
            guides, comm = self.guides, self.body.mesh.comm
            right = guides.couples.copy()
            right[self.supported] = 0.0
            moved = self.solve(right) if right.shape[1] else right
            there = [self.trace.pick(fields) for fields in (guides.rotations, moved)]
            self._answers.append(GuideAnswer(guides, moved, total(comm, right.T @ moved), *there))
        return self._answers[0]

    def held(self, displacement: Array, forces: Array, couple: Array) -> Array:
        """Return displacements (owned, k), K^-1 of forces (owned, k), as guides hold them; collective.

        Args:
            displacement: Without guides.
            forces: Zero where supported.
            couple: Their moments about what guides hold (g, k), with those on supports.
        """
        answer = self.guide_answer
        work = total(self.body.mesh.comm, answer.moved.T @ forces)
        return displacement + answer.change(answer.guides.rotations, answer.moved, couple, work)

    @property
    def is_factored(self) -> bool:
        """Whether the solver of its columns is made."""
        return any(factor.is_made for factor in self._factors)

    @cached_property
    def boundary(self) -> Boundary:
        """Unknowns that this rank's cells share with others and with the contact surface; collective at first use."""
        return Boundary(self.space, self.surface_dofs)

    @property
    def factor(self) -> Factor:
        """The Cholesky factor of K, made once; collective at first use."""
        factor = self.begin_factor()
        if not factor.is_made:
            make_together([factor])
        return factor

    def begin_factor(
        self, owner: int = 0, copies: int = 1, *, with_surface: bool = False, together: bool = False
    ) -> Factor:
        """Return the factor of K, made or yet to be made; collective at first use.

        Args:
            owner: The rank that gets it at first use.
            copies: Number of ranks from that one on that get it, too, where they solve for columns.
            with_surface: Whether it keeps the Schur complement of the surface's degrees of freedom.
            together: Whether every rank eliminates its own cells (see `substructure`).
        """
        if not self._factors:
            comm, surface = self.body.mesh.comm, self.surface_dofs
            if together:
                parts = (self._form, self._bcs, self.boundary, surface)
                self._factors.append(Substructures(*parts, prefix=PREFIX, comm=comm, owner=owner % comm.size))
                return self._factors[0]
            kept, matrix = "stiffness" in self.__dict__, self.stiffness
            known = surface if with_surface else None
            if self.operator == CONDENSED or fits(self.size, self.dim, comm):
                factor = Factor(
                    matrix, PREFIX, "cholesky", comm=comm, dim=self.dim, owner=owner, copies=copies, surface=known
                )
            else:
                nodes = self.space.tabulate_dof_coordinates()[: self.space.dofmap.index_map.size_local, : self.dim]
                factor = Iterative(matrix, PREFIX, comm=comm, x=nodes)
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
            tag = self.body.curve(load.on, f"{load.key(self.body.name, number)}.on")
            ds = ufl.Measure("ds", domain=mesh, subdomain_data=self.body.facet_tags)
            facets = compiled(measure(mesh, self.law.kind) * ds(tag))
            area = self.thickness * mesh.comm.allreduce(fem.assemble_scalar(facets))
            even = load.traction or np.array(load.force or np.zeros(self.dim)) / area
            traction: Any = fem.Constant(mesh, np.asarray(even, dtype=PETSc.ScalarType))
            if load.through is not None or any(load.moment or ()):
                traction += self._turning_traction(load, ds(tag), area)
            total += self.surface_integral(traction, tag)
        return total

    def _turning_traction(self, load: Load, ds: Any, area: float) -> Any:
        """Return w x (x - c), whose moment about the centroid c of the facets is that of the load; collective.

        The force acts through a point p: J w = M + (p - c) x F, J the facets' second moments of area about c.

        Args:
            load: Resultant of the load, the point and the moment.
            ds: The facets' measure.
            area: Theirs, mm².
        """
        mesh, x = self.body.mesh, ufl.SpatialCoordinate(self.body.mesh)

        def integral(integrand: Any) -> float:
            form = compiled(integrand * measure(mesh, self.law.kind) * ds)
            return float(self.thickness * mesh.comm.allreduce(fem.assemble_scalar(form)))

        centre = np.array([integral(x[i]) for i in range(self.dim)]) / area
        arm = x - fem.Constant(mesh, centre.astype(PETSc.ScalarType))
        turns = [ufl.as_vector(turn) for turn in _turned(arm, self.dim)]
        second = np.array([[integral(ufl.inner(a, b)) for b in turns] for a in turns])
        moment = np.array(load.moment or np.zeros(len(turns)))
        if load.through is not None and load.force is not None:
            lever = _turned(np.array(load.through) - centre, self.dim)
            moment += np.array(lever, dtype=float) @ np.array(load.force)
        spin = fem.Constant(mesh, np.linalg.solve(second, moment).astype(PETSc.ScalarType))
        return sum((spin[k] * turn for k, turn in enumerate(turns)), start=0 * arm)


def _turned(r: Any, dim: int) -> list[list[Any]]:
    """Return e x r for each axis e about which bodies of `dim` dimensions turn, y in the plane.

    Its product with a force F is e . (r x F), the moment of F at r about that axis.
    """
    if dim == 2:
        return [[r[1], -r[0]]]
    return [[0 * r[0], -r[2], r[1]], [r[2], 0 * r[0], -r[0]], [-r[1], r[0], 0 * r[0]]]


def _quadrature(mesh: Mesh, degree: int) -> dict[str, int]:
    """Return the degree along each axis that the patch test needs in hexahedra: of grad v, p, and J^-T det J, 2 g.

    UFL adds up the degrees of all factors, which are of all three axes: 10 in place of 6, 216 points for 64.
    """
    if mesh.basix_cell().name != "hexahedron":
        return {}
    return {"quadrature_degree": max(2 * degree, degree + 2 * mesh.geometry.cmap.degree)}
