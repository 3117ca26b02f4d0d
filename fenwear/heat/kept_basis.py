"""The reduced temperatures of a body, kept on disk for the next start like its condensed elasticity."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fenwear.bodies import kept
from fenwear.heat.conduction import HeatStep, Surroundings
from fenwear.heat.field import ReducedBasis


def kept_basis(
    make: Callable[[], ReducedBasis],
    steps: Sequence[HeatStep],
    settings: Sequence[object],
    surroundings: Surroundings,
    *,
    fresh: bool,
) -> ReducedBasis:
    """Return a basis from disk where it is kept, else make and keep it; collective.

    Args:
        make: Makes it.
        steps: Of the body: their matrices have its mesh, materials, convection and held temperatures in them.
        settings: What else the basis follows from.
        surroundings: What the body meets beyond its mesh.
        fresh: Make it whatever is kept.

    Raises:
        CaseError: the limit of what is kept is no number.
    """
    body = steps[0].body
    comm = body.body.mesh.comm
    if comm.bcast(kept.limit()) == 0:
        return make()
    exposed = "none" if surroundings.exposed is None else surroundings.exposed
    around = [surroundings.renewed, surroundings.sliding, exposed]
    parts = ["reduced temperatures", kept.surroundings(), body.body.mesh.geometry.x, *settings, *around]
    for step in steps:
        parts += [*step.a.getValuesCSR(), *step.b.getValuesCSR(), step.source, step.carried, step.entering]
    parts += [body.initial(), body.held, body.storage, body.convected]
    key = kept.common_key(comm, parts)
    found = None if fresh else kept.load(comm, key)
    if found is not None and {"lift", "columns"} <= found.keys():
        return ReducedBasis(body, found["lift"], found["columns"])
    basis = make()
    kept.save(comm, key, {"lift": basis.lift, "columns": basis.columns})
    return basis
