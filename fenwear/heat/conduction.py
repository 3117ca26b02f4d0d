"""Heat conduction in one body in UFL, of any dimension: steady, transient, with the strip's material moving.

    rho c (d theta/dt + v . grad theta) = div(k grad theta) - (2 h / t) (theta - theta_a)

with convection h (theta - theta_a) on free boundaries that are not insulated, held temperatures, and a
heat flux q into the contact surface. Where material that is new enters through a free boundary, v . n < 0, it brings
the heat of its temperature theta_in with it, and it leaves with its own:

    k d theta/dn = rho c (v . n) (theta - theta_in)   where v . n < 0,

which makes the form coercive: its boundary part is (1/2) rho c |v . n| theta². Steps are implicit
Euler's, of which `fenwear.heat.heat_exchange` makes a rule of second order. Advection is stabilised by
streamline upwinding with the whole residual (SUPG), so that the order of the elements is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc

from fenwear.algebra.assembled import (
    assembled,
    assembled_vector,
    compiled,
    destroy,
    interpolate,
    times,
    transposed_times,
)
from fenwear.algebra.factor import Factor, factored
from fenwear.bodies.contact_surface import contact_tag, trace_of
from fenwear.bodies.elastic_material import measure
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Body, Heat, Kind
from fenwear.case.heat_table import Track
from fenwear.common import compat
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import total
from fenwear.heat.fourier_law import ConductionLaw
from fenwear.surfaces.placement import ZERO
from fenwear.surfaces.sliding_field import ALONG_X, SlidingField

PREFIX = "fenwear_heat_"
CONVECTING, CONTACT, HELD, INSULATED = 1, 2, 3, 4
FREE = (CONVECTING, INSULATED)  # boundaries that material may move through
END = 0.1  # mean cosine of the angle between v and n: below, an element's boundary turns in its place and is no end
CROSSED = 1e-6  # of the speed, above which v crosses a boundary
WARMER = 100.0  # K: the mean rise that a convection is proposed for


@dataclass(frozen=True)
class Surroundings:
    """Boundary of a body beyond its mesh, and motion of its material through the mesh.

    Attributes:
        renewed: Whether material that enters is new, at theta_in; else what has left comes back as it was.
        exposed: Part of the contact surface that lies opposite nothing and convects, as loads of a
            unit flux there (owned,), mm; None for none.
        sliding: The motion of the material for a unit speed; what of it lies out of the model moves nothing.
    """

    renewed: bool = False
    exposed: Array | None = None
    sliding: SlidingField = ALONG_X


ALONE = Surroundings()


def no_heat_sink(name: str, enough: float | None = None) -> InputError:
    """Return the error of a body of this name that has no steady temperature.

    Args:
        name: Of the body.
        enough: Convection that would do, see `HeatBody.enough_convection`; None where it is not known.
    """
    message = f"the {name} loses no heat, so that no temperature is steady. Set convection, or hold a temperature"
    if enough is not None:
        message += f". With {enough:.3g} N/(mm*s*K) it would be about {WARMER:g} K warmer than the surroundings"
    return InputError("heat.convection", message)


class HeatBody:
    """Conduction in one body, per thickness (of a whole ring or solid): A theta = B theta_before + f + C q.

    Attributes:
        space: Scalar Lagrange space on the nodes of the displacement, K.
        surface: The contact surface, which the body shares with its elasticity.
        trace: That surface among the degrees of freedom of `space`.
        inflow: theta_in, K.
    """

    def __init__(self, elastic: ElasticBody, description: Body, law: ConductionLaw, heat: Heat) -> None:
        """Prepare the forms on the mesh of an elastic body; collective.

        Args:
            elastic: Elastic body with the mesh, the model, the nodes and the contact surface.
            description: Description of the body with its held temperatures.
            law: Law of the material.
            heat: Convection, and the temperatures of the surroundings and of the start.

        Raises:
            CaseError: an unknown group.
        """
        body = self.body = elastic.body
        self.law, self.heat, self.kind = law, heat, elastic.law.kind
        self.inflow = heat.ambient if heat.inflow is None else heat.inflow
        if heat.track is not None:  # what comes back is counted from the initial temperature on
            self.inflow = heat.initial
        degree = elastic.space.ufl_element().degree
        self.space = fem.functionspace(body.mesh, basix.ufl.element("Lagrange", body.mesh.basix_cell(), degree))
        self.surface, self.trace = elastic.surface, trace_of(elastic.trace, elastic.space, self.space)
        faces = heat.convecting_faces and self.kind in ("stress", "strain")  # rings and solids have none
        self._faces = 2 / elastic.thickness if faces else 0.0
        self.face_loss = heat.convection * self._faces
        self._measure = measure(body.mesh, self.kind)
        self._flows: dict[SlidingField, _Flow] = {}
        self.shared_bases: dict[Any, Any] = {}  # of the stages of a program
        self.certified: dict[Any, float] = {}  # how far they are from the whole mesh
        self.fineness: dict[Any, Any] = {}  # of the steps of one-way motions
        self._conductivity_matrix: PETSc.Mat | None = None  # of material at rest
        self._tag_boundary(description)

    def _tag_boundary(self, description: Body) -> None:
        """Mark every exterior facet as convecting, insulated, in contact, or held at a temperature."""
        body, domain = self.body, self.body.mesh
        dim = domain.topology.dim - 1
        domain.topology.create_connectivity(dim, dim + 1)
        facets = mesh.exterior_facet_indices(domain.topology)
        marker = np.zeros(domain.topology.index_map(dim).size_local + domain.topology.index_map(dim).num_ghosts)
        marker[facets] = CONVECTING
        for number, group in enumerate(description.insulated):
            tag = self._group_tag(group, f"{body.name}.insulated.{number}", "it cannot be insulated")
            marker[body.facet_tags.find(tag)] = INSULATED
        marker[body.facet_tags.find(contact_tag(body))] = CONTACT
        held = fem.Function(self.space)
        held.x.array[:] = np.nan
        for number, prescribed in enumerate(description.temperatures):
            tag = self._group_tag(prescribed.on, f"{body.name}.temperatures.{number}.on", "it cannot be held")
            chosen = body.facet_tags.find(tag)
            marker[chosen] = HELD
            held.x.array[fem.locate_dofs_topological(self.space, dim, chosen)] = prescribed.temperature
        tagged = np.flatnonzero(marker).astype(np.int32)
        self.boundary = mesh.meshtags(domain, dim, tagged, marker[tagged].astype(np.int32))
        convecting = domain.comm.allreduce(int((marker == CONVECTING).sum()))
        self._convects = self.heat.convection > 0 and bool(convecting or self._faces)
        self.owned = self.space.dofmap.index_map.size_local
        self.held = np.flatnonzero(~np.isnan(held.x.array[: self.owned])).astype(np.int32)
        self.held_values = held.x.array[self.held]

    def _group_tag(self, group: str, key: str, cannot: str) -> int:
        """Return the tag of a group of the boundary.

        Raises:
            CaseError: it is unknown, or the contact surface.
        """
        if group == f"{self.body.name}_contact":
            raise CaseError(InputError(key, f"the contact surface takes friction heat: {cannot}"))
        return self.body.curve(group, key)

    def _ds(self, integrand: Any, tag: int | tuple[int, ...]) -> Any:
        ds = ufl.Measure("ds", domain=self.body.mesh, subdomain_data=self.boundary, metadata=self._quadrature)
        return self._measure * integrand * ds(tag)

    def on_free_boundary(self, integrand: Any) -> Any:
        """Return the form of an integral over the free boundary, per thickness."""
        return self._ds(integrand, FREE)

    def bulk(self, track: Track) -> tuple[float, float]:
        """Return the heat capacity (mJ/K) and the loss (mW/K) of a closed track beyond the mesh; collective."""
        capacity = track.heat_capacity
        if track.volume:
            parts = [fem.assemble_scalar(fem.form(self._dx(value))) for value in (self.law.capacity, 1.0)]
            stored, volume = total(self.body.mesh.comm, np.array(parts, dtype=float))
            capacity = track.volume * float(stored / volume)
        return capacity, track.loss + track.area * self.heat.convection

    def _dx(self, integrand: Any) -> Any:
        return self._measure * integrand * ufl.dx(self.body.mesh, metadata=self._quadrature)

    @property
    def _quadrature(self) -> dict[str, int]:
        """One for all integrals, so that balances hold on curved elements, too; the stabilisation has kinks."""
        return {"quadrature_degree": 2 * self.space.ufl_element().degree + 1}

    def flow(self, sliding: SlidingField) -> _Flow:
        """Return the terms that depend on the material's motion, which are kept for each motion; collective."""
        if sliding not in self._flows:
            self._flows[sliding] = _Flow(self, sliding)
        return self._flows[sliding]

    def step(self, speed: float, duration: float, surroundings: Surroundings = ALONE) -> HeatStep:
        """Assemble and factor one implicit Euler step, or for an infinite duration the steady state; collective.

        Args:
            speed: Of the material, mm/s, or rad/s where it turns.
            duration: Of the step, s.
            surroundings: Boundary beyond the mesh.

        Raises:
            CaseError: a steady state of a body that loses heat nowhere.
        """
        if math.isinf(duration) and not self.loses_heat(speed, surroundings):
            raise CaseError(no_heat_sink(self.body.name))
        flow = self.flow(surroundings.sliding)
        forms = flow.forms
        forms.rate.value = 0.0 if math.isinf(duration) else 1 / duration
        forms.speed.value, forms.renewed.value = speed, float(surroundings.renewed)
        a, b = self._resting(forms) if speed == 0 else (assembled(forms.a), assembled(forms.b))
        f, entering = assembled_vector(forms.f), assembled_vector(forms.entering)
        if surroundings.exposed is not None:
            loss = a.createVecLeft()
            loss.array[:] = self.heat.convection * surroundings.exposed
            a.setDiagonal(loss, addv=PETSc.InsertMode.ADD)
            f += self.heat.ambient * loss.array_r
            loss.destroy()
        carried = speed * flow.carried + entering
        brought = self.inflow * float(self.body.mesh.comm.allreduce(entering.sum()))
        return HeatStep(self, a, b, f, carried, brought, entering, moves=speed != 0)

    def _resting(self, forms: _StepForms) -> tuple[PETSc.Mat, PETSc.Mat]:
        """Return A and B of material at rest, M / dt + K and M / dt, without assembling them again; collective."""
        rate = float(forms.rate.value)
        if self._conductivity_matrix is None:
            forms.rate.value = 0.0
            self._conductivity_matrix = assembled(forms.a)
            forms.rate.value = rate
        a, b = self._conductivity_matrix.copy(), self._capacity_matrix.copy()
        b.scale(rate)
        a.axpy(1.0, b, structure=PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        return a, b

    def loses_heat(self, speed: float = 0.0, surroundings: Surroundings = ALONE) -> bool:
        """Return whether a heat sink exists: convection, a held temperature or new material; collective."""
        return (
            self._convects
            or self.body.mesh.comm.allreduce(len(self.held)) > 0
            or (surroundings.renewed and speed != 0 and self.flow(surroundings.sliding).is_open)
        )

    def enough_convection(self, power: float) -> float:
        """Return the convection by which all that convects loses a power at a rise of `WARMER`; collective.

        Args:
            power: Heat that enters a second, per thickness, mW/mm.

        Returns:
            h, N/(mm s K).
        """
        unit = fem.Constant(self.body.mesh, PETSc.ScalarType(1))
        area = fem.assemble_scalar(compiled(self._ds(unit, CONVECTING) + self._dx(self._faces * unit)))
        return power / (WARMER * self.body.mesh.comm.allreduce(float(area)))

    def extremes(self, surroundings: Surroundings) -> tuple[float, float]:
        """Return the coldest and the hottest that the body is at first, is held at, or meets, K; collective."""
        met = [self.heat.initial, self.heat.ambient] + ([self.inflow] if surroundings.renewed else [])
        met += [float(value) for value in self.held_values]
        comm = self.body.mesh.comm
        return comm.allreduce(min(met), MPI.MIN), comm.allreduce(max(met), MPI.MAX)

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

    def load(self, flux: Array) -> Array:
        """Return the loads of fluxes at the contact's pressure nodes (n,) or (n, k), as (owned,) or (owned, k)."""
        return self.place(self.surface.spread @ (self.surface.weights * flux.T).T)

    def place(self, loads: Array) -> Array:
        """Return loads at the contact's trace nodes (N,) or (N, k) on the owned degrees of freedom."""
        return self.trace.place(loads.reshape(len(loads), 1, -1)).reshape(self.owned, *loads.shape[1:])

    def contact(self, theta: Array) -> Array:
        """Return the temperature at the contact's pressure nodes (n,), equal on every rank; collective."""
        return self.surface.spread.T @ self.trace.pick(theta[:, None])[:, 0, 0]

    @cached_property
    def _capacity_matrix(self) -> PETSc.Mat:
        theta, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        return assembled(self._dx(self.law.capacity * theta * w))

    def store(self, theta: Array) -> Array:
        """Return the heat capacity matrix times fields (owned,) or (owned, k); collective."""
        return times(self._capacity_matrix, theta)

    @cached_property
    def capacities(self) -> Array:
        """The diagonal of the heat capacity matrix (owned,), mJ/(mm K): above zero whatever the elements."""
        diagonal = self._capacity_matrix.getDiagonal()
        capacities: Array = diagonal.array.copy()
        diagonal.destroy()
        return capacities

    @cached_property
    def storage(self) -> Array:
        """Heat stored for each degree of freedom's kelvin, per thickness (owned,), mJ/(mm K)."""
        return assembled_vector(self._dx(self.law.capacity * ufl.TestFunction(self.space)))

    @cached_property
    def convected(self) -> Array:
        """Heat lost to the surroundings for each degree of freedom's kelvin (owned,), mW/(mm K)."""
        w = ufl.TestFunction(self.space)
        faces = fem.Constant(self.body.mesh, PETSc.ScalarType(self.face_loss))
        edges = fem.Constant(self.body.mesh, PETSc.ScalarType(self.heat.convection))
        return assembled_vector(self._dx(faces * w) + self._ds(edges * w, CONVECTING))


class _Flow:
    """Part of a body's conduction that depends on the motion of its material, v for a unit speed.

    Attributes:
        velocity: v, a vector of UFL with the components of the model.
        turns: Whether it is a rotation.
    """

    def __init__(self, body: HeatBody, sliding: SlidingField) -> None:
        self.body = body
        self.turns = sliding.turn != ZERO
        self.velocity = _velocity(sliding, body.body.mesh)

    @cached_property
    def is_open(self) -> bool:
        """Whether the material moves through a free boundary, rounding apart; collective.

        A turning body keeps its place: what enters and leaves through one facet of a round boundary, whose
        facets are chords, is no flow.
        """
        body, v = self.body, self.velocity
        flows = self.entering(v), self.entering(-v), ufl.sqrt(ufl.dot(v, v))
        into, out, along = (fem.assemble_scalar(compiled(body._ds(flow, FREE))) for flow in flows)
        return bool(body.body.mesh.comm.allreduce(into + out - 1e-9 * along) > 0)

    @cached_property
    def _slant(self) -> fem.Function:
        """Cosine of the angle between v and n, the mean over the free boundary of each element that v crosses."""
        body, v, w = self.body, self.velocity, ufl.TestFunction(self._constants)
        through, slant = ufl.dot(v, ufl.FacetNormal(body.body.mesh)), fem.Function(self._constants)
        size = ufl.sqrt(ufl.dot(v, v))
        crossed = ufl.conditional(ufl.gt(abs(through), CROSSED * size), size, 0.0)
        flow, along = (assembled_vector(body._ds(crossing * w, FREE)) for crossing in (through, crossed))
        slant.x.array[: len(flow)] = np.divide(flow, along, out=np.zeros_like(flow), where=along > 0)
        slant.x.scatter_forward()
        return slant

    @cached_property
    def _constants(self) -> fem.FunctionSpace:
        return fem.functionspace(self.body.body.mesh, ("DG", 0))

    @cached_property
    def carried(self) -> Array:
        """Heat carried out by material moving at unit speed, for each kelvin (owned,), mJ/(mm² K); collective."""
        body, w = self.body, ufl.TestFunction(self.body.space)
        return assembled_vector(body._dx(body.law.capacity * ufl.dot(self.velocity, ufl.grad(w))))

    def entering(self, v: Any) -> Any:
        """Return -v . n where material enters by an end of the mesh, else 0: of UFL, for v along `velocity`.

        A round side turns in its place, though one half of each of its chords takes in what the other lets out.
        """
        through = ufl.dot(v, ufl.FacetNormal(self.body.body.mesh))
        entering = ufl.max_value(-through, 0.0)
        return ufl.conditional(ufl.gt(abs(self._slant), END), entering, 0.0) if self.turns else entering

    @cached_property
    def forms(self) -> _StepForms:
        """The forms of a step."""
        body, law = self.body, self.body.law
        domain, h = body.body.mesh, self.body.heat.convection
        theta, w = ufl.TrialFunction(body.space), ufl.TestFunction(body.space)
        rate, speed, renewed = (fem.Constant(domain, PETSc.ScalarType(0)) for _ in range(3))
        v = speed * self.velocity
        rho_c, r = law.capacity, body._measure
        dx = ufl.dx(domain, metadata=body._quadrature)  # tau is constant in an element
        ambient = fem.Constant(domain, PETSc.ScalarType(body.heat.ambient))
        faces = fem.Constant(domain, PETSc.ScalarType(body.face_loss))
        edges = fem.Constant(domain, PETSc.ScalarType(h))
        tau = self._supg_time(v)
        upwind = tau * ufl.dot(v, ufl.grad(w))
        advected = ufl.dot(v, ufl.grad(theta))
        entering = rho_c * renewed * self.entering(v)  # heat capacity a second
        conducted = law.flux(theta)
        residual = rho_c * (rate * theta + advected) + _divergence(conducted, body.kind) + faces * theta
        a = r * (rho_c * (rate * theta + advected) * w - ufl.inner(conducted, ufl.grad(w))) * dx
        a += r * (faces * theta * w + upwind * residual) * dx
        a += body._ds(edges * theta * w, CONVECTING) + body._ds(entering * theta * w, FREE)
        b = r * rho_c * rate * theta * (w + upwind) * dx
        f = r * faces * ambient * (w + upwind) * dx
        f += body._ds(edges * ambient * w, CONVECTING) + body._ds(entering * body.inflow * w, FREE)
        a_form, b_form, f_form, brought = (compiled(form) for form in (a, b, f, body._ds(entering * w, FREE)))
        return _StepForms(a_form, b_form, f_form, brought, rate, speed, renewed)

    def _supg_time(self, v: Any) -> Any:
        """Return the stabilisation time tau: 1 / sqrt((2 |v| p / l)^2 + (4 p^2 a / l^2)^2).

        l is the element's length along v, p the degree, a = k / (rho c) the diffusivity
        (Shakib, Hughes and Johan 1991, with the node spacing l / p for the length). The time step is not in it: M and K
        are those of a velocity, whatever the step, which then has its order, and the steady state is the same by any.
        """
        length = self._lengths() / self.body.space.ufl_element().degree
        squares = 4 * ufl.dot(v, v) / length**2 + (4 * self.body.law.diffusivity / length**2) ** 2
        return 1 / ufl.sqrt(squares)

    def _lengths(self) -> fem.Function:
        """Return the lengths of the elements along v."""
        domain = self.body.body.mesh
        cells, dim = domain.topology.index_map(domain.topology.dim), domain.geometry.dim
        count = cells.size_local + cells.num_ghosts
        vectors = fem.functionspace(domain, ("DG", 0, (dim,)))
        flow = fem.Function(vectors)
        interpolate(self.velocity, flow)
        along = flow.x.array.reshape(-1, dim)[:count]
        speeds = np.linalg.norm(along, axis=1, keepdims=True)
        along = np.where(speeds > 0, along, np.eye(dim)[0]) / np.where(speeds > 0, speeds, 1.0)  # on an axis: any
        x = np.einsum("kic,kc->ki", domain.geometry.x[compat.geometry_dofmap(domain)[:count], :dim], along)
        lengths = fem.Function(self._constants)
        lengths.x.array[:count] = x.max(axis=1) - x.min(axis=1)
        return lengths


def _velocity(sliding: SlidingField, domain: mesh.Mesh) -> Any:
    """Return V + omega x (x - c) in the components of a model, of UFL: around an axis of symmetry it is zero."""
    dim = domain.geometry.dim
    components = [0, 1, 2] if dim == 3 else [0, 2]
    if sliding.turn == ZERO:
        return fem.Constant(domain, np.array(sliding.shift)[components].astype(PETSc.ScalarType))
    x = ufl.SpatialCoordinate(domain)
    place = x if dim == 3 else ufl.as_vector((x[0], 0.0, x[1]))
    v = ufl.as_vector(sliding.shift) + ufl.cross(ufl.as_vector(sliding.turn), place - ufl.as_vector(sliding.centre))
    return ufl.as_vector([v[c] for c in components])


def _divergence(flux: Any, kind: Kind) -> Any:
    """Return div q, in an axisymmetric model with q_r / r."""
    if kind != "axisymmetric":
        return ufl.div(flux)
    r = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(flux))[0]
    return ufl.div(flux) + flux[0] / r


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
    """One step of a body: A theta = B theta_before + f + C q.

    Attributes:
        body: Whose step it is.
        carried: Heat that the material carries out a second, for each kelvin (owned,), mW/(mm K).
        brought: Heat that new material brings in a second, mW/mm.
        entering: Heat capacity of what enters in a second (owned,), mW/(mm K).
        moves: Whether the material moves.
        is_held: Where temperatures are held (owned,).
        held_by_end, held_by_start, held_source: Sums of the rows of A, B and f that held
            temperatures replace: with them the heat that enters through these boundaries.
    """

    def __init__(
        self,
        body: HeatBody,
        a: PETSc.Mat,
        b: PETSc.Mat,
        f: Array,
        carried: Array,
        brought: float,
        entering: Array,
        *,
        moves: bool,
    ) -> None:
        self.moves = moves
        self.body, self.carried, self.brought, self.entering = body, carried, brought, entering
        start = body.space.dofmap.index_map.local_range[0]
        rows = (body.held + start).astype(np.int32)
        indicator = np.zeros(body.owned)
        indicator[body.held] = 1.0
        self.held_by_end, self.held_by_start = (transposed_times(m, indicator) for m in (a, b))
        self.held_source = float(body.body.mesh.comm.allreduce(f[body.held].sum()))
        for matrix, diagonal in ((a, 1.0), (b, 0.0)):
            matrix.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)  # on one rank it would not, else it would
            matrix.zeroRows(rows, diag=diagonal)
        self.source = f
        self.source[body.held] = body.held_values
        self.a, self.b = a, b
        self.is_held = np.zeros(body.owned, dtype=bool)
        self.is_held[body.held] = True

    @cached_property
    def _factor(self) -> Factor:
        """Made at the first solution, as reduced steps need none; collective."""
        domain = self.body.body.mesh
        return factored(self.a, PREFIX, "lu", comm=domain.comm, dim=domain.topology.dim)

    def advance(self, theta: Array, *, sources: bool = True) -> Array:
        """Return the temperature at the end without any flux through the contact; collective.

        Args:
            theta: At its start (owned,), or without sources several fields (owned, k).
            sources: False for what becomes of changes of temperature, A^-1 B.
        """
        rhs = times(self.b, theta)
        if sources:
            rhs += self.source
        return self._factor.solve(rhs)

    def respond(self, load: Array) -> Array:
        """Return A^-1 of several loads (owned, k), mW/mm; collective."""
        return self._factor.solve(np.where(self.is_held[:, None], 0.0, load))

    def apply(self, fields: Array) -> tuple[Array, Array]:
        """Return A and B times several fields (owned, k); collective."""
        return times(self.a, fields), times(self.b, fields)

    def free_factor(self) -> None:
        """Free its factor, which the next solution makes again; collective."""
        made = self.__dict__.pop("_factor", None)
        if made is not None:
            made.free()

    def free(self) -> None:
        """Free its matrices and its factor, after which it advances nothing; collective."""
        self.free_factor()
        destroy(self.a, self.b)
