"""Assembled matrices, the same to the last bit in every run on as many ranks.

PETSc adds what the ranks give to a row in the order in which it arrives; dolfinx's own matrices add it
in the order of the ranks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import bsr_array


def assembled(form: Any, bcs: Sequence[fem.DirichletBC] = (), *, first_column: bool = False) -> PETSc.Mat:
    """Return the matrix of a bilinear form; collective.

    Args:
        form: Of UFL.
        bcs: Their rows and columns get ones on the diagonal.
        first_column: Keep the first column of each block alone.
    """
    form = form if isinstance(form, fem.Form) else fem.form(form)
    if form.mesh.comm.size == 1 and not first_column:
        matrix = fem.petsc.assemble_matrix(form, bcs=list(bcs))
        matrix.assemble()
        return matrix
    of_ranks = fem.assemble_matrix(form, bcs=list(bcs))
    of_ranks.scatter_reverse()
    maps, blocks = [of_ranks.index_map(k) for k in (0, 1)], of_ranks.block_size
    own = maps[0].size_local
    starts = np.asarray(of_ranks.indptr)[: own + 1]
    columns = maps[1].local_to_global(np.asarray(of_ranks.indices)[: starts[-1]].astype(np.int32))
    values = np.asarray(of_ranks.data)[: starts[-1] * blocks[0] * blocks[1]].reshape(-1, *blocks)
    if first_column:
        values, blocks = values[:, :, :1], [blocks[0], 1]
    shape = (own * blocks[0], maps[1].size_global * blocks[1])
    part = bsr_array((values, columns, starts), shape=shape, blocksize=tuple(blocks)).tocsr()
    part.sort_indices()
    sizes = ((shape[0], maps[0].size_global * blocks[0]), (maps[1].size_local * blocks[1], shape[1]))
    csr = (part.indptr.astype(PETSc.IntType), part.indices.astype(PETSc.IntType), part.data)
    matrix = PETSc.Mat().createAIJ(sizes, csr=csr, comm=form.mesh.comm)
    matrix.assemble()
    return matrix
