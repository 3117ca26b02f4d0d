"""Memory that the set-up of a system needs, from the sizes of the meshes before it is used.

The sizes of sparse factors follow those of nested dissection (`fenwear.algebra.factor.entries`). Results of the
patterns of force are dense, n by n contact nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

from fenwear.algebra.factor import WORKING, entries
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.response import by_surface
from fenwear.case import AUTO, CONDENSED
from fenwear.common.parallel import check_memory, memory_size
from fenwear.system.both_bodies import Bodies

NUMBER = 8  # bytes
DECIDES = f"'fine' where its contact is far enough from edges, else '{CONDENSED}', one solution for each of its nodes"
NO_FACTOR = "nothing is factored"


@dataclass(frozen=True)
class Resources:
    """Memory for the set-up of both bodies and of their contact: an estimate.

    Attributes:
        bodies: The part that is set up.
        nodes: Contact nodes.
        memory: Of all ranks at the end of the set-up and in the first half-cycles, bytes.
    """

    bodies: Bodies
    nodes: int
    memory: float

    @property
    def sizes(self) -> str:
        """The numbers of unknowns and contact nodes in words."""
        both = " and ".join(f"{body.size:,}" for body in (self.bodies.punch, self.bodies.strip))
        return f"{both} unknowns, {self.nodes:,} contact nodes"

    def text(self) -> str:
        """Return a line for the set-up, and one for each body that has an operator of its own."""
        lines = [f"{self.sizes}: the set-up takes about {memory_size(self.memory)}, by an estimate"]
        for body in (self.bodies.punch, self.bodies.strip):
            if body.operator != CONDENSED:
                how = DECIDES if body.operator == AUTO else NO_FACTOR
                lines.append(f"{body.body.name}: operator '{body.operator}', {how}")
        return "\n".join(lines)

    def check(self) -> None:
        """Make sure that the set-up fits into the memory that is free; collective.

        Raises:
            CaseError: it does not.
        """
        subject, advice = f"the set-up of {self.sizes}", "Use larger elements, or more memory."
        check_memory(self.bodies.comm, self.memory, "geometry", subject, advice, spread=True)


def setup_resources(bodies: Bodies, nodes: int, asked: tuple[Asked, Asked], matrices: int) -> Resources:
    """Return the resources to condense and join both bodies; collective.

    Args:
        bodies: Both.
        nodes: Of the contact.
        asked: Patterns of force and their columns, of punch and strip.
        matrices: Of all contact nodes that the contact keeps on each rank.
    """
    heat = bool(bodies.heat)
    both = zip((bodies.punch, bodies.strip), asked, strict=True)
    numbers = sum(_numbers(body, patterns, columns, heat=heat) for body, (patterns, columns) in both)
    if CONDENSED in (bodies.punch.operator, bodies.strip.operator):
        numbers += bodies.comm.size * matrices * float(nodes) ** 2
    return Resources(bodies, nodes, NUMBER * numbers)


Asked = tuple[int, int]


def _numbers(elastic: ElasticBody, patterns: int, columns: int, *, heat: bool) -> float:
    """Return the count of numbers in a condensed body, its stiffness and its factor; collective."""
    if elastic.operator != CONDENSED:
        return 0.0
    count = float(patterns) * (elastic.dim * columns + (elastic.size / elastic.dim if heat else 0.0))
    if not elastic.is_factored:
        count += 1.5 * elastic.matrix_entries() + WORKING * entries(elastic.size, elastic.dim)
    return count + (2.0 * elastic.surface_dofs.size**2 if not heat and by_surface(elastic) else 0.0)
