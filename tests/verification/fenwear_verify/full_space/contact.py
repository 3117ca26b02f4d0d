"""Contact as one variational inequality on both bodies' meshes, with unknown (u, p, a) in each phase.

The reference that the condensed inequality is compared with: nothing is eliminated, so every
change of the active set factors the whole system again.

    K_1 u_1 - C_1 p = f_1,    K_2 u_2 + C_2 p = f_2,
    gap = N_1 u_1 - N_2 u_2 + H a + g + h(p) >= 0,    p >= 0,    p gap = 0,
    sum of w_i p_i (e_n + tau)_i . m_i + F = 0,

with h(p) what a layer, the wear of an implicit step and the heat of a half-cycle open: phases meet in it alone. A body
whose creep makes it c times as soft over a phase has K / c, and what moves its supports is left as it is.

Where guides hold a body against turning by couples B y (`bodies/guides`) these and the rotations s are unknowns, too:
K_1 u_1 + B_1 y - C_1 p = f_1, the gap opens by N_1 R_1 s, y = R_1^T (C_1 p + f_1) and s = -B_1^T u_1.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.algebra.submatrices import dense_matrix
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear.common.parallel import lasting
from fenwear.contact.condensed import ContactState, SlidingContact, WearCompliance
from fenwear.contact.inequality import check, configure
from fenwear.surfaces import ContactPair, RigidEquilibrium
from fenwear.surfaces.equilibrium import relative_motion

# Where a step is cut off at p = 0 the gap, a function of u alone, is still zero up to rounding of either sign: this
# much, over the scale of gaps, makes the node open.
OPEN = 1e-11
SETS = 30  # of nodes that touch, at most
TOLERANCE = 1e-9  # the rounding of a system with all displacements in it
DIFFERENT = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN
Bodies = tuple[ElasticBody, ElasticBody]
Rows = list[list[PETSc.Mat | None]]


class FullContact:
    """The inequality on the full system, distributed over the ranks.

    The rows and unknowns of the displacements belong to the ranks of the meshes; pressure and
    rigid modes to rank 0, coupled through global numbers: no partition can lose a contact pair.

    Args:
        phases: What slides in each phase.
        bodies: Punch and strip in each, under its loads.
        softer: Times as soft as at once that they are in each; by default they do not creep.
    """

    can_follow, most = False, np.inf  # friction and flow come in rounds

    def __init__(
        self,
        phases: Sequence[SlidingContact],
        bodies: Sequence[Bodies],
        softer: Sequence[tuple[float, float]] | None = None,
    ) -> None:
        self.phases, self._bodies = list(phases), list(bodies)
        self._softer = [(1.0, 1.0)] * len(self.phases) if softer is None else list(softer)
        interface, punch = self.phases[0].interface, self._bodies[0][0]
        self.comm = lasting(punch.body.mesh.comm)
        rigid, pair = interface.rigid, interface.pair
        self._pressure_scale = interface.pressure_scale
        self._gap_scale = self._pressure_scale * interface.elastic_length
        self._force_scale = self._pressure_scale * float(pair.weights.sum())
        guided = guided_equilibrium(pair, *self._bodies[0])
        self._size = (len(pair.weights), len(rigid.resultant), len(guided.resultant))
        self._sizes = [body.stiffness.getLocalSize()[0] for body in self._bodies[0]]
        self._free = sum(self._sizes)
        n, modes, guides = self._size
        self._length = self._free + (n + modes + 2 * guides if self.comm.rank == 0 else 0)  # of a phase, on this rank
        self._ratios = [phase.friction_ratio for phase in self.phases]
        self._factor, self._solved, self._changed = 1.0, False, True
        self._wearing: WearCompliance | None = None
        self._coupling: Array | None = None
        self._assemble()
        self._offset, self._x = self._operator.createVecLeft(), self._operator.createVecRight()
        self._constant = self._loads()
        self._build_snes()

    def press(self, factor: float) -> None:
        """Take all loads times a factor."""
        self._factor = factor

    def slide(self, ratios: Sequence[Array]) -> None:
        """Set tau of each phase, (n, d) each; collective."""
        pairs = zip(ratios, self._ratios, strict=True)
        if any(one is not other and not np.array_equal(one, other) for one, other in pairs):
            self._ratios, self._changed = list(ratios), True
            self._operator.destroy()
            self._assemble()

    def _assemble(self) -> None:
        """Make the linear part of the system at the friction of now, scaled; collective."""
        rows: Rows = []
        for k in range(len(self.phases)):
            own = self._phase(k)
            before, after = [[None] * (count * len(own)) for count in (k, len(self.phases) - 1 - k)]
            rows += [[*before, *row, *after] for row in own]
        nest = PETSc.Mat().createNest(rows, comm=self.comm)
        self._operator = nest.convert("aij" if self.comm.size == 1 else "mpiaij")
        self._scale_system()

    def _phase(self, k: int) -> Rows:
        """Return the rows and columns of a phase; collective."""
        (punch, strip), interface, friction_ratio = self._bodies[k], self.phases[k].interface, self._ratios[k]
        rigid, pair = interface.rigid, interface.pair
        traction = (pair.normal + friction_ratio) * pair.weights[:, None]
        on_punch, on_strip, back = pair.punch.spread, csr_array(pair.transfer.T), pair.placement.back
        layer = self._on_rank0(csr_array(np.diag(interface.layer))) if np.any(interface.layer) else None
        stiffness = [
            _softened(body.stiffness, times) for body, times in zip((punch, strip), self._softer[k], strict=True)
        ]
        rows: Rows = [
            [stiffness[0], None, -_forces(punch, on_punch, traction)],
            [None, stiffness[1], _forces(strip, on_strip, back(traction))],
            [_normals(punch, on_punch, pair.normal), -_normals(strip, on_strip, pair.normal_on_strip), layer],
        ]
        if len(rigid.resultant):
            rows = [[*rows[0], None], [*rows[1], None], [*rows[2], self._rank0_matrix(rigid.rigid_normal)]]
            rows.append([None, None, self._rank0_matrix(rigid.equilibrium(friction_ratio)), None])
        guided = guided_equilibrium(pair, punch, strip)
        return self._with_guides(rows, guided, friction_ratio, (punch, strip)) if len(guided.resultant) else rows

    def _with_guides(self, rows: Rows, guided: RigidEquilibrium, friction_ratio: Array, bodies: Bodies) -> Rows:
        """Return the rows with those of couples and rotations of guides, and their columns; collective."""
        count, blocks = len(guided.resultant), len(rows)
        unit = np.eye(count)
        couples = [_couples(body, guided, k == 0) for k, body in enumerate(bodies)]
        opened = self._rank0_matrix(guided.rigid_normal)
        beside = [[couples[0], None], [couples[1], None], [None, opened], [None, None]]
        rows = [[*row, *more] for row, more in zip(rows, beside, strict=False)]
        moment = self._rank0_matrix(guided.equilibrium(friction_ratio))
        rows.append([None, None, moment, *[None] * (blocks - 3), self._rank0_matrix(-unit), None])
        turned = [one.copy().transpose() for one in couples]
        rows.append([*turned, *[None] * (blocks - 1), self._rank0_matrix(unit)])
        return rows

    def _scale_system(self) -> None:
        """Divide rows and unknowns by their scales, so that PETSc's tolerances fit every case."""
        n, modes, guides = self._size
        left, right = self._operator.createVecLeft(), self._operator.createVecRight()
        for own, other in self._parts(left.array, right.array):
            other[: self._free] = self._gap_scale
            other[self._free :] = self._pressure_scale
            other[self._free + n :] = self._gap_scale
            own[: self._free] = 1 / self._force_scale
            own[self._free :] = 1 / self._gap_scale
            own[self._free + n :] = 1 / self._force_scale
            last = self._free + n + modes  # couples, then rotations
            other[last : last + guides] = self._force_scale
            own[last + guides :] = 1 / self._gap_scale
        self._right = right
        self._operator.diagonalScale(left, right)

    def _parts(self, *vectors: Array) -> list[tuple[Array, ...]]:
        """Return the parts of this rank's vectors that belong to each phase."""
        cuts = [slice(k * self._length, (k + 1) * self._length) for k in range(len(self.phases))]
        return [tuple(vector[cut] for vector in vectors) for cut in cuts]

    def _loads(self) -> Array:
        """Return what loads add to this rank's rows; collective."""
        n, modes, guides = self._size
        found: Array = np.zeros(len(self.phases) * self._length)
        for k, (own,) in enumerate(self._parts(found)):
            both, rigid = self._bodies[k], self.phases[k].interface.rigid
            forces = [_pushed(body, times) for body, times in zip(both, self._softer[k], strict=True)]
            guided = guided_equilibrium(self.phases[k].interface.pair, *both)
            own[: self._free] = -np.concatenate(forces) / self._force_scale
            if self.comm.rank == 0:
                after = self._free + n
                own[after : after + modes] = rigid.resultant / self._force_scale
                own[after + modes : after + modes + guides] = guided.resultant / self._force_scale
        return found

    def _build_snes(self) -> None:
        n, _, _ = self._size
        lower, upper = self._x.duplicate(), self._x.duplicate()
        lower.set(PETSc.NINFINITY)
        upper.set(PETSc.INFINITY)
        for (part,) in self._parts(lower.array):
            part[self._free : self._free + n] = 0.0
        self._bounds = (lower, upper)
        self.snes = PETSc.SNES().create(self.comm)
        own = weakref.proxy(self)  # Python does not see what PETSc holds: a circle through it would never be freed

        def residual(snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            own._residual(snes, x, f)

        def jacobian(_snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, _P: PETSc.Mat) -> None:
            own._jacobian(x, J)

        self.snes.setFunction(residual, self._x.duplicate())
        self.snes.setJacobian(jacobian, self._operator.copy())
        configure(self.snes, "fenwear_full_contact_")
        self.snes.setTolerances(atol=TOLERANCE)
        self.snes.ksp.pc.setFactorSolverType("mumps")
        self.snes.setVariableBounds(lower, upper)
        self.snes.setFromOptions()

    def _pressures(self, x: Array) -> Array:
        """Return the pressures of all phases (m, n), MPa, of this rank's unknowns; of rank 0."""
        n, _, _ = self._size
        return np.array([own[self._free : self._free + n] for (own,) in self._parts(x)]) * self._pressure_scale

    def _residual(self, _snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self._operator.mult(x, f)
        f.axpy(1.0, self._offset)
        if self.comm.rank or (self._wearing is None and self._coupling is None):
            return
        pressure = self._pressures(x.array_r)
        opened = np.zeros_like(pressure)
        if self._wearing is not None:
            opened += self._wearing.opening(pressure)
        if self._coupling is not None:
            opened += np.tensordot(self._coupling, pressure, 2)
        for (own,), added in zip(self._parts(f.array), opened, strict=True):
            own[self._free : self._free + self._size[0]] += added / self._gap_scale

    def _jacobian(self, x: PETSc.Vec, J: PETSc.Mat) -> None:
        """Set the derivative at x; collective."""
        if self._wearing is None and self._coupling is None and not self._changed:
            return
        self._operator.copy(J, DIFFERENT)
        self._changed = self._wearing is not None or self._coupling is not None
        if self._changed:
            added = self._opened(x)
            J.axpy(1.0, added, DIFFERENT)
            added.destroy()

    def _opened(self, x: PETSc.Vec) -> PETSc.Mat:
        """Return what unit pressures open beside the bodies, scaled, in the whole matrix; collective."""
        m, n = len(self.phases), self._size[0]
        local, size = self._operator.getSizes()[0]
        values = csr_array((local, size))
        if self.comm.rank == 0:
            slopes = self._slopes(self._pressures(x.array_r)) * (self._pressure_scale / self._gap_scale)
            places = (np.arange(m)[:, None] * self._length + self._free + np.arange(n)).ravel()
            rows, columns = slopes.nonzero()
            values = csr_array((slopes[rows, columns], (places[rows], places[columns])), shape=(local, size))
        return _matrix(values, self._operator.getSizes(), self.comm)

    def _slopes(self, pressure: Array) -> Array:
        """Return the gaps of all phases that unit pressures open beside the bodies (m n, m n), mm/MPa."""
        m, n = pressure.shape
        blocks, wearing, border, local = np.zeros((m, n, n)), self._wearing, None, None
        if wearing is not None:
            layer, local = wearing.layer(pressure), wearing.local(pressure)
            border = wearing.border(pressure) if local is None else None
            if layer is not None:
                blocks[:, np.arange(n), np.arange(n)] = layer
        return dense_matrix(blocks, self._coupling, border, local)

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        wearing: WearCompliance | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact for the undeformed gap (n,) or (m, n), mm; collective.

        Newton starts from the last solution of this object, or else from the pressures of `start`. Where it does not
        converge, as pressures that are cut off at zero may keep it at a node, sets of nodes that touch follow each
        other. Arguments as of `CondensedContact.solve`.

        Raises:
            ConvergenceError: SNES did not converge.
        """
        m, (n, modes, _) = len(self.phases), self._size
        contact = slice(self._free, self._free + n)
        self._changed = self._changed or self._wearing is not None or self._coupling is not None
        self._wearing, self._coupling = wearing, coupling
        self._offset.array[:] = self._factor * self._constant
        known: Array | None = None
        if start is not None and not self._solved:
            known = np.asarray(start.pressure / self._pressure_scale, dtype=np.float64)
        gaps = np.broadcast_to(gap, (m, n))
        for k, (offset,) in enumerate(self._parts(self._offset.array)):
            if self.comm.rank == 0:
                offset[contact] += gaps[k] / self._gap_scale + OPEN
        if start is None or known is not None:
            self._begin(np.ones((m, n)) if known is None else known)
        self._set_tolerance()
        self._solved = True
        self.snes.solve(None, self._x)
        iterations, f = self.snes.getIterationNumber(), self.snes.getFunction()[0]
        if self.snes.getConvergedReason() <= 0:
            iterations += self._by_sets(f)
        self._residual(self.snes, self._x, f)
        found = [
            (own[self._free :] * scales[self._free :], rest[contact] * self._gap_scale)
            for own, scales, rest in self._parts(self._x.array_r, self._right.array_r, f.array_r)
        ]
        found = self.comm.bcast(found)
        values = np.array([own for own, _ in found])
        opened = np.array([rest for _, rest in found])
        return ContactState(values[:, :n], opened, values[:, n : n + modes], iterations)

    def _set_tolerance(self) -> None:
        """Let the residual have the rounding of what a step wears, thousands of elastic gaps where bodies are stiff."""
        parts = 1.0
        if self._wearing is not None:
            mean = np.full((len(self.phases), self._size[0]), self._pressure_scale)
            parts = max(parts, float(np.abs(self._wearing.opening(mean)).max()) / self._gap_scale)
        self.snes.setTolerances(atol=TOLERANCE * parts)

    def _begin(self, pressure: Array) -> None:
        """Let Newton start from pressures (m, n), scaled."""
        if self.comm.rank == 0:
            for (own,), values in zip(self._parts(self._x.array), pressure, strict=True):
                own[self._free : self._free + self._size[0]] = values

    def _by_sets(self, f: PETSc.Vec) -> int:
        """Solve by sets of nodes that touch, p > g by their scales, none cut off; return how many; collective.

        Source: M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13, 2002, the primal-dual active set method.

        Args:
            f: The residual where SNES has ended, then that of the solution.

        Raises:
            ConvergenceError: they go round; that of SNES.
        """
        x, J, before = self._x, self.snes.getJacobian()[0], None
        first, (_, enough, _, most) = self._operator.getOwnershipRange()[0], self.snes.getTolerances()
        solver = PETSc.KSP().create(self.comm)
        solver.setType("preonly")
        solver.pc.setType("lu")
        solver.pc.setFactorSolverType("mumps")
        for iteration in range(1, min(SETS, most) + 1):
            free = np.ones(x.getLocalSize(), dtype=bool)
            for own, rest, kept in self._parts(x.array, f.array, free):
                contact = slice(self._free, self._free + (self._size[0] if self.comm.rank == 0 else 0))
                kept[contact] = own[contact] > rest[contact]
                own[contact] *= kept[contact]
            self._residual(self.snes, x, f)
            left = self.comm.allreduce(float((f.array_r[free] ** 2).sum())) ** 0.5
            changed = self.comm.allreduce(bool(before is None or (before != free).any()), op=MPI.LOR)
            if left < enough and not changed:
                return iteration
            before = free
            self._jacobian(x, J)
            rows = PETSc.IS().createGeneral((first + np.flatnonzero(free)).astype(PETSc.IntType), comm=self.comm)
            part = J.createSubMatrix(rows, rows)
            step, right = part.createVecs()
            right.array[:] = f.array_r[free]
            solver.reset()
            solver.setOperators(part)
            solver.solve(right, step)
            x.array[free] -= step.array_r
            self._residual(self.snes, x, f)
            part.destroy()
        check(self.snes, "the contact of punch and strip (full system)")
        return SETS

    def _rank0_matrix(self, values: Array) -> PETSc.Mat:
        """Return numbers as a matrix whose rows and columns all belong to rank 0."""
        return self._on_rank0(csr_array(np.asarray(values)))

    def _on_rank0(self, values: csr_array) -> PETSc.Mat:
        """Return a sparse matrix whose rows and columns all belong to rank 0."""
        here = self.comm.rank == 0
        sizes = tuple((count * here, count) for count in values.shape)
        return _matrix(values if here else csr_array((0, values.shape[1])), sizes, self.comm)


def _matrix(values: csr_array, sizes: tuple[tuple[int, int], ...], comm: object) -> PETSc.Mat:
    """Return a matrix of this rank's rows (local, global); collective."""
    csr = (values.indptr.astype(PETSc.IntType), values.indices.astype(PETSc.IntType), values.data)
    matrix = PETSc.Mat().createAIJ(sizes, csr=csr, comm=comm)
    matrix.assemble()
    return matrix


def _softened(stiffness: PETSc.Mat, times: float) -> PETSc.Mat:
    """Return a stiffness over how much softer it is."""
    if times == 1.0:
        return stiffness
    found = stiffness.copy()
    found.scale(1 / times)
    return found


def _pushed(elastic: ElasticBody, times: float) -> Array:
    """Return this rank's nodal forces of loads and of moved supports on a body as many times softer; collective."""
    if times == 1.0 or not elastic.moved:
        return elastic.load
    moving = elastic.with_loads(()).load
    return elastic.load - moving * (1 - 1 / times)


def _forces(elastic: ElasticBody, patterns: csr_array, traction: Array) -> PETSc.Mat:
    """Return C (dofs, n): the nodal forces of each contact node's traction, zero where supported; collective.

    Args:
        elastic: The body.
        patterns: Share of each of its trace nodes in the force of each contact node (N, n).
        traction: Force of each contact node under unit pressure (n, d).
    """
    part = patterns.tocoo()
    nodes, columns = part.coords
    values = part.data[:, None] * traction[columns]
    dim = elastic.dim
    place = np.full(len(elastic.trace.blocks), -1)
    place[elastic.trace.owned] = elastic.trace.local
    own = place[nodes] >= 0
    rows = (dim * place[nodes[own], None] + np.arange(dim)).ravel()
    shape = (elastic.stiffness.getLocalSize()[0], len(traction))
    local = csr_array((values[own].ravel(), (rows, np.repeat(columns[own], dim))), shape=shape)
    free = np.ones(shape[0])
    free[elastic.supported] = 0.0
    local = csr_array(local.multiply(free[:, None]))
    comm = lasting(elastic.body.mesh.comm)
    return _matrix(local, (elastic.stiffness.getSizes()[0], (shape[1] if comm.rank == 0 else 0, shape[1])), comm)


def _couples(elastic: ElasticBody, guided: RigidEquilibrium, of_punch: bool) -> PETSc.Mat:
    """Return B (dofs, g) of one body among the guides of both, zero where supported; collective."""
    comm, count = lasting(elastic.body.mesh.comm), len(guided.resultant)
    size = elastic.stiffness.getSizes()[0]
    values = np.zeros((size[0], count))
    values[:, slice(guided.of_punch) if of_punch else slice(guided.of_punch, None)] = elastic.guides.couples
    values[elastic.supported] = 0.0
    return _matrix(csr_array(values), (size, (count if comm.rank == 0 else 0, count)), comm)


def _normals(elastic: ElasticBody, patterns: csr_array, normal: Array) -> PETSc.Mat:
    """Return N (n, dofs): the displacement along e_n that each contact node sees of this body; collective."""
    comm, count = lasting(elastic.body.mesh.comm), len(normal)
    part = csr_array(patterns.T).tocoo()
    rows, nodes = part.coords
    dim = elastic.dim
    columns = (dim * elastic.trace.blocks[nodes, None] + np.arange(dim)).ravel()
    values = (part.data[:, None] * normal[rows]).ravel()
    every = csr_array((values, (np.repeat(rows, dim), columns)), shape=(count, elastic.stiffness.getSize()[0]))
    here = comm.rank == 0
    sizes = ((count if here else 0, count), elastic.stiffness.getSizes()[1])
    return _matrix(every if here else csr_array((0, every.shape[1])), sizes, comm)


def guided_equilibrium(pair: ContactPair, punch: ElasticBody, strip: ElasticBody) -> RigidEquilibrium:
    """Return the rotations that guides hold, whose couples balance what contact and loads do; collective."""
    motions = [body.on_surface(body.trace.pick(body.guides.rotations)) for body in (punch, strip)]
    resultants = np.concatenate([punch.guided_resultant, strip.guided_resultant])
    return RigidEquilibrium(
        pair, relative_motion(pair, *motions), resultants, ("guided",) * len(resultants), motions[0].shape[2]
    )
