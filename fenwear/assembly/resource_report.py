"""Which rank does what as bodies are condensed, and what it takes: told by `check` before it is spent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fenwear.assembly.bodies import Bodies
from fenwear.assembly.contact_setup import ContactSetup
from fenwear.assembly.resources import BodyResources, Resources, duration
from fenwear.bodies.condensation import deal
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.schur import available
from fenwear.case import AUTO, CONDENSED
from fenwear.memory import memory_size

DECIDES = f"'fine' where its contact is far enough from edges, else '{CONDENSED}', one solution for each of its nodes"
NO_FACTOR = "nothing is factored"
DENSE = 4e9  # operations a second of joining ranks: Cholesky and triangular solutions of dense matrices


def resources_text(placed: ContactSetup, wanted: Resources) -> list[str]:
    """Return a line for each body: how it is condensed, which ranks do it, and what each takes; collective.

    One more says how ranks share a large contact.

    Args:
        placed: The bodies.
        wanted: What they need in all.
    """
    return body_lines(placed.bodies, wanted)


def body_lines(bodies: Bodies, wanted: Resources) -> list[str]:
    """Return a line for each body, as `resources_text`; collective."""
    own = (wanted.punch, wanted.strip)
    dealt = reversed(deal([need.holders for need in reversed(own)], bodies.comm.size))
    return [
        _text(body, need, ranks)
        if body.operator == CONDENSED
        else f"{body.body.name}: operator '{body.operator}', {DECIDES if body.operator == AUTO else NO_FACTOR}"
        for body, need, ranks in zip((bodies.punch, bodies.strip), own, dealt, strict=True)
    ]


def _text(elastic: ElasticBody, need: BodyResources, holders: list[int]) -> str:
    comm, name = elastic.body.mesh.comm, elastic.body.name
    topology = elastic.body.mesh.topology
    cells: Sequence[int] = comm.allgather(topology.index_map(topology.dim).size_local)
    columns = f"{need.columns:,.0f} columns"
    if need.solver == "factor" and need.together:
        boundary = comm.allgather(len(elastic.boundary.numbers))
        shared = []
        for rank, (n, edge) in enumerate(zip(cells, boundary, strict=True)):
            share = n / sum(cells)
            part = replace(need, unknowns=need.unknowns * share, matrix=need.matrix * share)
            shared.append(f"rank {rank}: {n:,} cells, {edge:,} unknowns at their edge, {_taken(part, edge)}")
        return f"{name}: every rank eliminates its own cells down to the surface ({columns}); {'; '.join(shared)}"
    taken = f"{duration(need.seconds)} and {memory_size(need.memory)}"
    if need.solver == "multigrid":
        return f"{name}: conjugate gradients on all ranks, {columns} in blocks; no factor: {taken} in all"
    if need.solver == "low-rank":
        return f"{name}: a factor with blocks of low rank over all ranks, {columns}, refined: {taken} in all"
    if need.solver == "spread factor":
        return f"{name}: a factor over {comm.size} ranks, {columns} solved by all: {taken} in all"
    if need.by_surface and available():
        return f"{name}: rank {holders[0]} eliminates all {sum(cells):,} cells down to the surface, {columns}: {taken}"
    return f"{name}: {_by_columns(need, holders, columns, taken)}"


def _by_columns(need: BodyResources, holders: list[int], columns: str, taken: str) -> str:
    """Say who solves for columns with a factor of its own."""
    if len(holders) == 1:
        return f"rank {holders[0]} factors it and solves {columns}: {taken}"
    ranks = f"{', '.join(map(str, holders[:-1]))} and {holders[-1]}"
    each, memory = duration(need.on_holder), memory_size(need.memory)
    return f"ranks {ranks} factor it, each by itself, and share its {columns}: {each} each, {memory} in all"


def _taken(part: BodyResources, edge: int) -> str:
    """Return what a rank's own cells take, with an edge that is joined."""
    seconds, memory = part.alone
    return f"{duration(seconds + edge**3 / DENSE)}, {memory_size(memory + 8.0 * edge**2)}"
