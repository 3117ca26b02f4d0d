"""Contact as one variational inequality on both bodies' meshes, with unknown (u, p, a).

The reference that the condensed inequality is compared with: nothing is eliminated, so every
change of the active set factors the whole system again.

    K_1 u_1 - C_1 p = f_1,    K_2 u_2 + C_2 p = f_2,
    gap = N_1 u_1 - N_2 u_2 + H a + g >= 0,    p >= 0,    p gap = 0,
    sum of w_i p_i (e_n + tau)_i . m_i + F = 0.

Where guides hold a body against turning by couples B y (`bodies/guides`) these and the rotations s are unknowns, too:
K_1 u_1 + B_1 y - C_1 p = f_1, the gap opens by N_1 R_1 s, y = R_1^T (C_1 p + f_1) and s = -B_1^T u_1.
"""

from __future__ import annotations

import weakref

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.bodies.elasticity import ElasticBody
from fenwear.contact.condensed import ContactState, WearCompliance
from fenwear.contact.inequality import check, configure
from fenwear.interface import Interface, RigidEquilibrium
from fenwear.interface.equilibrium import guided_equilibrium
from fenwear.parallel import lasting

# Where a step is cut off at p = 0 the gap, a function of u alone, is still zero up to rounding of either sign: this
# much, over the scale of gaps, makes the node open.
OPEN = 1e-11


class FullContact:
    """The inequality on the full system in one sliding direction, distributed over the ranks.

    The rows and unknowns of the displacements belong to the ranks of the meshes; pressure and
    rigid modes to rank 0, coupled through global numbers: no partition can lose a contact pair.
    """

    def __init__(self, punch: ElasticBody, strip: ElasticBody, interface: Interface, friction_ratio: Array) -> None:
        self.interface = interface
        self.comm = lasting(punch.body.mesh.comm)
        rigid, pair = interface.rigid, interface.pair
        self._pressure_scale = rigid.mean_pressure
        self._gap_scale = self._pressure_scale * interface.elastic_length
        self._force_scale = self._pressure_scale * float(pair.weights.sum())
        guided = guided_equilibrium(pair, punch, strip)
        n, modes, guides = len(pair.weights), len(rigid.resultant), len(guided.resultant)
        self._size = (n, modes)

        traction = (pair.normal + friction_ratio) * pair.weights[:, None]
        on_punch, on_strip = pair.punch.spread, csr_array(pair.transfer.T)
        back = pair.placement.back
        rows = [
            [punch.stiffness, None, -_forces(punch, on_punch, traction)],
            [None, strip.stiffness, _forces(strip, on_strip, back(traction))],
            [_normals(punch, on_punch, pair.normal), -_normals(strip, on_strip, pair.normal_on_strip), None],
        ]
        if modes:
            rows = [[*rows[0], None], [*rows[1], None], [*rows[2], self._rank0_matrix(rigid.rigid_normal)]]
            rows.append([None, None, self._rank0_matrix(rigid.equilibrium(friction_ratio)), None])
        if guides:
            rows = self._with_guides(rows, guided, friction_ratio, (punch, strip))
        nest = PETSc.Mat().createNest(rows, comm=self.comm)
        self._operator = nest.convert("aij" if self.comm.size == 1 else "mpiaij")
        self._offset = self._operator.createVecLeft()
        self._x = self._operator.createVecRight()
        sizes = [body.stiffness.getLocalSize()[0] for body in (punch, strip)]
        self._free = sum(sizes)
        self._scale_system()
        self._constant = self._offset.array.copy()
        self._constant[: sizes[0]] = -punch.load / self._force_scale
        self._constant[sizes[0] : self._free] = -strip.load / self._force_scale
        if self.comm.rank == 0:
            after = self._free + n
            self._constant[after : after + modes] = rigid.resultant / self._force_scale
            self._constant[after + modes : after + modes + guides] = guided.resultant / self._force_scale
        self._build_snes()

    def _with_guides(
        self,
        rows: list[list[PETSc.Mat | None]],
        guided: RigidEquilibrium,
        friction_ratio: Array,
        bodies: tuple[ElasticBody, ElasticBody],
    ) -> list[list[PETSc.Mat | None]]:
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
        n, modes = self._size
        left, right = self._operator.createVecLeft(), self._operator.createVecRight()
        right.array[: self._free] = self._gap_scale
        right.array[self._free :] = self._pressure_scale
        right.array[self._free + n :] = self._gap_scale
        left.array[: self._free] = 1 / self._force_scale
        left.array[self._free :] = 1 / self._gap_scale
        left.array[self._free + n :] = 1 / self._force_scale
        last = self._free + n + modes
        guides = (len(left.array) - last) // 2  # couples, then rotations
        right.array[last : last + guides] = self._force_scale
        left.array[last + guides :] = 1 / self._gap_scale
        self._right = right
        self._operator.diagonalScale(left, right)

    def _build_snes(self) -> None:
        n, _ = self._size
        lower, upper = self._x.duplicate(), self._x.duplicate()
        lower.set(PETSc.NINFINITY)
        upper.set(PETSc.INFINITY)
        if self.comm.rank == 0:
            lower.array[self._free : self._free + n] = 0.0
        self._bounds = (lower, upper)
        self.snes = PETSc.SNES().create(self.comm)
        own = weakref.proxy(self)  # Python does not see what PETSc holds: a circle through it would never be freed

        def residual(snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            own._residual(snes, x, f)

        self.snes.setFunction(residual, self._x.duplicate())
        self.snes.setJacobian(lambda snes, x, J, P: None, self._operator)
        configure(self.snes, "fenwear_full_contact_")
        self.snes.setTolerances(atol=1e-9)  # the rounding of a system with all displacements in it
        self.snes.ksp.pc.setFactorSolverType("mumps")
        self.snes.setVariableBounds(lower, upper)
        self.snes.setFromOptions()

    def _residual(self, _snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self._operator.mult(x, f)
        f.axpy(1.0, self._offset)

    def solve(
        self,
        gap: Array,
        start: ContactState | None = None,
        wearing: WearCompliance | None = None,
        coupling: Array | None = None,
    ) -> ContactState:
        """Return the contact for the undeformed gap (n,), mm; collective.

        Newton starts from the last solution of this object, whatever `start` is.

        Raises:
            ConvergenceError: SNES did not converge.
            NotImplementedError: wear of the step or a coupling is given; only the condensed inequality takes them.
        """
        if wearing is not None or coupling is not None:
            raise NotImplementedError("the full inequality has no wear of the step and no coupling")
        n, modes = self._size
        contact = slice(self._free, self._free + n)
        self._offset.array[:] = self._constant
        if self.comm.rank == 0:
            self._offset.array[contact] += gap / self._gap_scale + OPEN
            if start is None:
                self._x.array[contact] = 1.0
        self.snes.solve(None, self._x)
        check(self.snes, "the contact of punch and strip (full system)")
        self._residual(self.snes, self._x, self.snes.getFunction()[0])
        values = self._x.array_r[self._free :] * self._right.array_r[self._free :]
        gaps = self.snes.getFunction()[0].array_r[contact] * self._gap_scale
        values, gaps = self.comm.bcast((values, gaps))
        return ContactState(values[None, :n], gaps[None], values[None, n : n + modes], self.snes.getIterationNumber())

    def _rank0_matrix(self, values: Array) -> PETSc.Mat:
        """Return a sparse matrix whose rows and columns all belong to rank 0."""
        here = self.comm.rank == 0
        (rows, columns) = values.shape
        sizes = ((rows * here, rows), (columns * here, columns))
        matrix = PETSc.Mat().createAIJ(sizes, nnz=(columns, 0), comm=self.comm)
        if here:
            matrix.setValues(range(rows), range(columns), np.ascontiguousarray(values))  # read in C order
        matrix.assemble()
        return matrix


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
    place[elastic.trace.own] = elastic.trace.local
    own = place[nodes] >= 0
    rows = (dim * place[nodes[own], None] + np.arange(dim)).ravel()
    shape = (elastic.stiffness.getLocalSize()[0], len(traction))
    local = csr_array((values[own].ravel(), (rows, np.repeat(columns[own], dim))), shape=shape)
    free = np.ones(shape[0])
    free[elastic.supported] = 0.0
    local = csr_array(local.multiply(free[:, None]))
    comm = lasting(elastic.body.mesh.comm)
    sizes = (elastic.stiffness.getSizes()[0], (shape[1] if comm.rank == 0 else 0, shape[1]))
    csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
    matrix = PETSc.Mat().createAIJ(sizes, csr=csr, comm=comm)
    matrix.assemble()
    return matrix


def _couples(elastic: ElasticBody, guided: RigidEquilibrium, of_punch: bool) -> PETSc.Mat:
    """Return B (dofs, g) of one body among the guides of both, zero where supported; collective."""
    comm, count = lasting(elastic.body.mesh.comm), len(guided.resultant)
    size = elastic.stiffness.getSizes()[0]
    values = np.zeros((size[0], count))
    if elastic.guides is not None:
        values[:, slice(guided.of_punch) if of_punch else slice(guided.of_punch, None)] = elastic.guides.couples
    values[elastic.supported] = 0.0
    local = csr_array(values)
    csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
    matrix = PETSc.Mat().createAIJ((size, (count if comm.rank == 0 else 0, count)), csr=csr, comm=comm)
    matrix.assemble()
    return matrix


def _normals(elastic: ElasticBody, patterns: csr_array, normal: Array) -> PETSc.Mat:
    """Return N (n, dofs): the displacement along e_n that each contact node sees of this body; collective."""
    comm, count = lasting(elastic.body.mesh.comm), len(normal)
    part = csr_array(patterns.T).tocoo()
    rows, nodes = part.coords
    dim = elastic.dim
    columns = (dim * elastic.trace.blocks[nodes, None] + np.arange(dim)).ravel()
    values = (part.data[:, None] * normal[rows]).ravel()
    whole = csr_array((values, (np.repeat(rows, dim), columns)), shape=(count, elastic.stiffness.getSize()[0]))
    here = comm.rank == 0
    starts = whole.indptr if here else np.zeros(1)
    columns, values = (whole.indices, whole.data) if here else (np.zeros(0), np.zeros(0))
    sizes = ((count if here else 0, count), elastic.stiffness.getSizes()[1])
    csr = (starts.astype(PETSc.IntType), columns.astype(PETSc.IntType), values)
    matrix = PETSc.Mat().createAIJ(sizes, csr=csr, comm=comm)
    matrix.assemble()
    return matrix
