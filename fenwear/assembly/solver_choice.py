"""What solves for the columns of each body, by the memory that there is.

A factor on one rank where it fits its share of the memory, else over all ranks, else with blocks of low rank, else
no factor but conjugate gradients with a multigrid: the first that fits, for the larger body before the smaller one.
`setup.way` takes the place of the choice. Ranks that would have nothing to do hold a factor of their own and solve a
share of its columns, while the memory lasts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from mpi4py import MPI

from fenwear.assembly.bodies import Bodies
from fenwear.assembly.resources import NUMBER, SMALL, WORKING, BodyResources, Resources
from fenwear.bodies.elasticity import Solver
from fenwear.bodies.factor import SPREAD
from fenwear.case import Setup
from fenwear.errors import CaseError, InputError
from fenwear.memory import free_memory, memory_size
from fenwear.parallel import agreed

GAIN = 0.1  # of a body's time that a further rank has to save to be worth a factor of its own
SOLVERS: tuple[Solver, ...] = ("factor", "low-rank", "multigrid")  # by what they take, the most first


def free_on_ranks(comm: MPI.Comm) -> float | None:
    """Return the bytes that all ranks together may still take; None where a system does not tell; collective."""
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    own = free_memory() if node.rank == 0 else 0.0
    node.Free()
    found = comm.allgather(own)
    return None if any(one is None for one in found) else float(sum(one or 0.0 for one in found))


def choose_solvers(bodies: Sequence[Bodies], wanted: Resources, free: float | None = None) -> Resources:
    """Choose what solves for the columns of each body, and have the bodies do it; return what they need; collective.

    Args:
        bodies: The same under all their loads.
        wanted: What they need as they are.
        free: Bytes that all ranks together may take; by default those that are free.

    Raises:
        CaseError: there is not memory enough.
    """
    comm, setup = bodies[0].comm, bodies[0].punch.setup
    free = free_on_ranks(comm) if free is None else free
    wanted = chosen(wanted, setup, comm, free)
    check_memory(wanted, setup, free)
    for each in bodies:
        for body, own in ((each.punch, wanted.punch), (each.strip, wanted.strip)):
            if not own.made:
                body.solver, body.holders = own.solver, own.holders
    return wanted


def chosen(wanted: Resources, setup: Setup, comm: MPI.Comm, free: float | None) -> Resources:
    """Return what the set-up needs with what solves for the columns of each body; collective.

    Args:
        wanted: The same as the bodies are.
        setup: What the case says of it.
        comm: The ranks.
        free: Bytes that all ranks together may take; None where that is not known.
    """
    if setup.way == "automatic" and not setup.reproducible:
        wanted = first_fitting(wanted, free)
    ranks = comm.size
    if setup.way in ("automatic", "columns") and not setup.reproducible and ranks > 1:
        most = math.inf if free is None else max(free / ranks, SMALL)
        punch, strip = (_spread(body, most) for body in (wanted.punch, wanted.strip))
        wanted = replace(wanted, punch=punch, strip=strip)
    return agreed(comm, dealt(wanted, ranks, free))


def _spread(body: BodyResources, most: float) -> BodyResources:
    """Return the same with its factor over all ranks where one rank cannot have it in so many bytes, or it is large."""
    large = NUMBER * body.factor > SPREAD or NUMBER * WORKING * body.factor > most
    free = body.solver == "factor" and not (body.together or body.made)
    return replace(body, solver="spread factor") if large and free else body


def dealt(wanted: Resources, ranks: int, free: float | None) -> Resources:
    """Return the same with the ranks beyond the two owners dealt out, each to the body that takes longer.

    A factor more has to fit into the memory, and to take away a part of that body's time.

    Args:
        wanted: What solves for the columns of each body.
        ranks: Number of ranks.
        free: Bytes that all ranks together may take.
    """
    for _ in range(ranks - 2):
        name, longer = max((("punch", wanted.punch), ("strip", wanted.strip)), key=lambda one: one[1].on_holder)
        more = replace(longer, holders=longer.holders + 1)
        after = replace(wanted, punch=more) if name == "punch" else replace(wanted, strip=more)
        fixed = longer.made or longer.solver != "factor"
        if fixed or more.on_holder > (1 - GAIN) * longer.on_holder or not fits(after, free):
            break
        wanted = after
    return wanted


def fits(wanted: Resources, free: float | None) -> bool:
    """Return whether it fits into the memory."""
    return free is None or wanted.memory <= max(free, SMALL)


def first_fitting(wanted: Resources, free: float | None) -> Resources:
    """Return the same with what fits into the memory; as it was where nothing does."""
    return next((one for one in (wanted, *_less_and_less(wanted)) if fits(one, free)), wanted)


def _less_and_less(wanted: Resources) -> Iterator[Resources]:
    """Yield the same with what takes less memory, first in the larger body, then in both."""
    for solver in SOLVERS[1:]:
        punch, strip = (one if one.made else replace(one, solver=solver) for one in (wanted.punch, wanted.strip))
        larger = wanted.punch.factor > wanted.strip.factor
        yield replace(wanted, punch=punch) if larger else replace(wanted, strip=strip)
        wanted = replace(wanted, punch=punch, strip=strip)
        yield wanted


def check_memory(wanted: Resources, setup: Setup, free: float | None) -> None:
    """Make sure that the set-up fits into the memory that is free.

    Raises:
        CaseError: it does not; says which way, and which mesh would.
    """
    if free is None or fits(wanted, free):
        return
    message = f"{wanted.text()}, but {memory_size(free)} are free"
    least = wanted
    for least in _less_and_less(wanted):
        if fits(least, free):
            break
    if fits(least, free) and not setup.reproducible:
        way = least.strip.solver if least.strip.solver != "factor" else least.punch.solver
        message += f"; setup.way = '{way}' would take {memory_size(least.memory)}"
    elif setup.way == "automatic":
        message += f", and no setup.way would fit: 'multigrid' takes {memory_size(least.memory)}"
    found = wanted.fitting(0.9 * free)
    if found is not None:
        times, less = found
        message += f"; elements {times:.2g} times as large would fit: {less.text()}"
    raise CaseError(InputError("geometry", message))
