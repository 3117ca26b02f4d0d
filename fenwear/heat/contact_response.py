"""How the temperature at the contact answers to the fluxes there, by the end of a step of the full field.

That is C A^-1 L, C the temperature at the contact nodes and L the loads of unit fluxes. Both touch the trace's degrees
of freedom s alone, so that the Schur complement S of these in A has all of it, (A^-1)_ss = S^-1: one elimination in
place of a solution for each contact node.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, hstack, vstack

from fenwear.arrays import Array
from fenwear.bodies.factor import Factor, entries, make_together
from fenwear.bodies.schur import available
from fenwear.heat.conduction import PREFIX, HeatStep
from fenwear.heat.field import CHUNK
from fenwear.parallel import total


def contact_responses(steps: Sequence[HeatStep], inflow: csc_array, contact_rows: csr_array) -> list[Array]:
    """Return the contact temperature from unit fluxes (n, n) at the end of each full step; collective.

    Args:
        steps: Of a body. Their factors are made and freed one after the other.
        inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        contact_rows: Temperature at the contact nodes (n, owned).
    """
    body = steps[0].body
    comm = body.body.mesh.comm
    free: Array = np.ones(body.owned)
    free[body.held] = 0.0
    loads = [csr_array(one) for one in comm.allgather(csr_array(inflow * free[:, None]))]
    rows = comm.allgather(csr_array(contact_rows))
    whole_loads, whole_rows = csr_array(vstack(loads)), csc_array(hstack(rows))
    surface = np.union1d(whole_loads.nonzero()[0], whole_rows.nonzero()[1])
    small = len(surface) ** 2 <= entries(whole_loads.shape[0], body.body.mesh.topology.dim)
    found = []
    for step in steps:
        factor = _surface_factor(step, surface) if small and available() else None
        if factor is None:
            found.append(_by_columns(step, inflow, contact_rows))
            continue
        response: Array = np.zeros((contact_rows.shape[0], inflow.shape[1]))
        if factor.schur is not None:
            answers = scipy.linalg.solve(factor.schur, whole_loads[surface].toarray(), overwrite_b=True)
            response = np.asarray(whole_rows[:, surface] @ answers)
        comm.Bcast(response, root=factor.owner)
        factor.free()
        found.append(response)
    return found


def _surface_factor(step: HeatStep, surface: NDArray[np.int64]) -> Factor | None:
    """Return the factor with the Schur complement of the surface; None where it would be spread; collective."""
    mesh = step.body.body.mesh
    factor = Factor(step.a, PREFIX, "lu", comm=mesh.comm, dim=mesh.topology.dim, surface=surface)
    if factor.is_spread:
        return None
    make_together([factor])
    return factor


def _by_columns(step: HeatStep, inflow: csc_array, contact_rows: csr_array) -> Array:
    """Return the response of one step by a solution for each flux; collective."""
    n = inflow.shape[1]
    response: Array = np.empty((n, n))
    for begin in range(0, n, CHUNK):
        some = slice(begin, begin + CHUNK)
        response[:, some] = contact_rows @ step.respond(inflow[:, some].toarray())
    step.free_factor()
    return total(step.body.body.mesh.comm, response)
