"""Assembled matrices and vectors, the same to the last bit in every run on as many ranks.

PETSc adds what the ranks give to a row in the order in which it arrives; dolfinx's own matrices add it
in the order of the ranks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
from dolfinx import fem, jit, la
from petsc4py import PETSc
from scipy.sparse import bsr_array

from fenwear.common import compat
from fenwear.common.arrays import Array, Mask
from fenwear.common.parallel import lasting
from fenwear.common.stack import compiling

PATIENCE = 120  # s: on a busy machine a form takes longer to compile than the ten that dolfinx waits


def compiled(form: Any) -> fem.Form:
    """Return a form of UFL, compiled; collective.

    Kept forms lie in many small folders: Python lists the one that it loads from at every look-up, which took longer
    than to assemble where there were a thousand.
    """
    options = _options()
    with compiling():
        return fem.form(form, jit_options={**options, "cache_dir": options["cache_dir"] / form.signature()[:2]})


def _options() -> dict[str, Any]:
    """Return the options to compile forms: with more patience for another process that compiles the same one."""
    options = jit.get_options()
    return {"cache_dir": options["cache_dir"], "timeout": max(PATIENCE, options["timeout"])}


def interpolate(expression: Any, function: fem.Function) -> None:
    """Give a function the values of an expression of UFL at its space's points; collective."""
    with compiling():
        points = compat.interpolation_points(function.function_space)
        compiled_at = fem.Expression(expression, points, jit_options=_options())
    function.interpolate(compiled_at)


def assembled(form: Any, bcs: Sequence[fem.DirichletBC] = (), *, first_column: bool = False) -> PETSc.Mat:
    """Return the matrix of a bilinear form; collective.

    Args:
        form: Of UFL.
        bcs: Their rows and columns get ones on the diagonal.
        first_column: Keep the first column of each block alone.
    """
    form = form if isinstance(form, fem.Form) else compiled(form)
    if form.mesh.comm.size == 1 and not first_column:
        matrix = fem.petsc.assemble_matrix(form, bcs=list(bcs))
        matrix.assemble()
        return matrix
    of_ranks = fem.assemble_matrix(form, bcs=list(bcs))
    of_ranks.scatter_reverse()
    maps, blocks = [of_ranks.index_map(k) for k in (0, 1)], of_ranks.block_size
    owned = maps[0].size_local
    starts = np.asarray(of_ranks.indptr)[: owned + 1]
    columns = maps[1].local_to_global(np.asarray(of_ranks.indices)[: starts[-1]].astype(np.int32))
    values = np.asarray(of_ranks.data)[: starts[-1] * blocks[0] * blocks[1]].reshape(-1, *blocks)
    if first_column:
        values, blocks = values[:, :, :1], [blocks[0], 1]
    shape = (owned * blocks[0], maps[1].size_global * blocks[1])
    part = bsr_array((values, columns, starts), shape=shape, blocksize=tuple(blocks)).tocsr()
    part.sort_indices()
    sizes = ((shape[0], maps[0].size_global * blocks[0]), (maps[1].size_local * blocks[1], shape[1]))
    csr = (part.indptr.astype(PETSc.IntType), part.indices.astype(PETSc.IntType), part.data)
    matrix = PETSc.Mat().createAIJ(sizes, bsize=tuple(blocks), csr=csr, comm=lasting(form.mesh.comm))
    matrix.assemble()
    return matrix


def assembled_here(form: fem.Form, bcs: Sequence[fem.DirichletBC], present: Mask) -> PETSc.Mat:
    """Return the contribution of this rank's own cells to a symmetric matrix, on this rank alone; collective.

    Rows are this rank's own blocks and then its ghosts; only the upper triangle is stored. The sum over the
    ranks is the matrix.

    Args:
        form: Compiled, of one space.
        bcs: Their rows and columns get ones on the diagonal, once among all ranks.
        present: Which local blocks the cells have (n,); others get ones on the diagonal.
    """
    block, count = form.function_spaces[0].dofmap.index_map_bs, len(present)
    pattern = fem.create_sparsity_pattern(form)
    pattern.finalize()
    columns, starts = compat.pattern_rows(pattern)
    rows = np.repeat(np.arange(count, dtype=np.int32), np.diff(starts[: count + 1]))
    columns = columns[: len(rows)]
    upper = np.bincount(rows[(columns >= rows) & (columns < count)], minlength=count)
    matrix = PETSc.Mat().create(PETSc.COMM_SELF)
    matrix.setType("seqsbaij")
    matrix.setSizes((block * count, block * count))
    matrix.setBlockSize(block)
    matrix.setOption(PETSc.Mat.Option.IGNORE_LOWER_TRIANGULAR, True)
    matrix.setPreallocationNNZ(np.maximum(upper, 1).astype(PETSc.IntType))
    every = np.arange(count, dtype=PETSc.IntType)
    matrix.setLGMap(PETSc.LGMap().create(every, bsize=block, comm=PETSc.COMM_SELF))
    fem.petsc.assemble_matrix(matrix, form, bcs=list(bcs))
    absent = (block * np.flatnonzero(~present)[:, None] + np.arange(block)).ravel().astype(PETSc.IntType)
    ones = np.arange(len(absent) + 1, dtype=PETSc.IntType)
    matrix.setValuesIJV(ones, absent, np.ones(len(absent)), addv=PETSc.InsertMode.INSERT, rowmap=absent)
    matrix.assemble()
    return matrix


def assembled_vector(form: Any) -> Array:
    """Return the vector of a linear form on this rank's own degrees of freedom (owned,); collective.

    Args:
        form: Of UFL, or compiled.
    """
    vector = fem.assemble_vector(form if isinstance(form, fem.Form) else compiled(form))
    vector.scatter_reverse(la.InsertMode.add)
    owned = vector.index_map.size_local * vector.block_size
    return np.array(vector.array[:owned])


def times(matrix: PETSc.Mat, fields: Array) -> Array:
    """Return a matrix times this rank's part of fields (owned,) or (owned, k); collective."""
    if fields.ndim == 1:
        before, after = matrix.createVecRight(), matrix.createVecLeft()
        before.array[:] = fields
        matrix.mult(before, after)
        result = np.array(after.array_r)
        destroy(before, after)
        return result
    right = dense(matrix.getSizes()[1], fields, matrix.comm)
    product = matrix.matMult(right)
    result = np.array(product.getDenseArray())
    destroy(right, product)
    return result


def transposed_times(matrix: PETSc.Mat, field: Array) -> Array:
    """Return the transpose of a matrix times this rank's part of a field (owned,); collective."""
    before, after = matrix.createVecLeft(), matrix.createVecRight()
    before.array[:] = field
    matrix.multTranspose(before, after)
    result = np.array(after.array_r)
    destroy(before, after)
    return result


def dense(sizes: tuple[int, int], fields: Array, comm: PETSc.Comm) -> PETSc.Mat:
    """Return fields (owned, k) as a dense matrix; collective.

    Args:
        sizes: Of its rows, on this rank and in all.
        fields: This rank's rows.
        comm: The ranks.
    """
    matrix = PETSc.Mat().createDense((sizes, (PETSc.DECIDE, fields.shape[1])), comm=comm)
    matrix.setUp()
    matrix.getDenseArray()[:] = fields
    matrix.assemble()
    return matrix


def destroy(*objects: PETSc.Object) -> None:
    """Destroy objects of PETSc; collective where they are."""
    for petsc_object in objects:
        petsc_object.destroy()
