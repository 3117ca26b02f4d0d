"""The reduced temperatures of a body, kept on disk for the next start like its condensed elasticity."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from scipy.sparse import csc_array

from fenwear.bodies import kept
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.field import ReducedBasis

Make = partial[ReducedBasis]  # the function that makes it, after the body all that it follows from
Way = Callable[[Make, Sequence[HeatStep]], ReducedBasis]


def made(make: Make, _: Sequence[HeatStep]) -> ReducedBasis:
    """Return a basis that is made whatever is kept; collective."""
    return make()


def kept_basis(make: Make, steps: Sequence[HeatStep], *, fresh: bool) -> ReducedBasis:
    """Return a basis from disk where it is kept, else make and keep it; collective.

    Args:
        make: Makes it from the body and further arguments.
        steps: Of the body: their matrices have its mesh, materials, convection and held temperatures in them.
        fresh: Make it whatever is kept.

    Raises:
        CaseError: the limit of what is kept is no number.
    """
    body: HeatBody = steps[0].body
    comm = body.body.mesh.comm

    def parts() -> Iterator[object]:
        yield from ("reduced temperatures", body.body.mesh.geometry.x)
        for argument in (*make.args[1:], *make.keywords.values()):
            yield from _parts(argument)
        for step in steps:
            yield from (*step.a.getValuesCSR(), *step.b.getValuesCSR(), step.source, step.carried, step.entering)
        yield from (body.initial(), body.held, body.storage, body.convected)

    place = kept.known(comm, parts, fresh=fresh)
    if place.arrays is not None:
        return ReducedBasis(body, place.arrays["lift"], place.arrays["columns"])
    basis = make()
    place.save({"lift": basis.lift, "columns": basis.columns})
    return basis


def _parts(argument: object) -> Iterator[object]:
    """Yield what tells an argument: arrays, and what has a text that tells all of it."""
    if isinstance(argument, csc_array):
        yield from (argument.data, argument.indices, argument.indptr)
    elif isinstance(argument, Surroundings):
        yield from (argument.renewed, argument.sliding, argument.exposed)
    elif isinstance(argument, Sequence):
        yield np.asarray(argument)
    else:
        yield argument
