"""What the set-up of a system will take, known before it is spent: memory and time from the sizes of the meshes.

The sizes of sparse factors follow those of nested dissection, with factors measured on the ready geometries: of N
unknowns about 5 N log2 N entries in a plane and 22 N^(4/3) in a solid. Each pattern of force is one solution for each
of its directions; what comes of them is dense, n by n contact nodes. Times were fitted to set-ups of solids from 14,000
unknowns and 169 contact nodes (1.3 s) to 310,000 and 2,401 (118 s), which they meet within a third. Heat answers
to each contact node over ten time scales, from which its basis is picked: fitted from 117 to 247 contact nodes, within
a half. Of many nodes as many fluxes last on any mesh, so that the time grows with the temperatures alone: fitted to
14,000 temperatures and 625 nodes (20 s), and to 105,000 and 2,401 (190 s).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fenwear.assembly.bodies import Bodies
from fenwear.assembly.contact_setup import ContactSetup
from fenwear.bodies.elasticity import ElasticBody, Solver
from fenwear.bodies.response import BLOCK, SURFACE_SHARE, Request
from fenwear.case import CONDENSED
from fenwear.heat.passing_strip import MANY
from fenwear.memory import GIB, memory_size

NUMBER = 8  # bytes
FACTORING = {2: 1e-8, 3: 8e-10}  # s over N^1.5 in a plane and N² in a solid
ASSEMBLING = {2: 5e-6, 3: 8e-5}  # s over N
SOLVING = 6.5e10  # operations a second of many sparse solutions at once, four for each entry of a factor
HEATING = 1e-5  # s over temperatures and contact nodes
LASTING = 160  # contact nodes whose answers take as long as those of all where they are many
WORKING = 1.3  # of a factor: what it is made in
LOW_RANK = 0.98  # of a factor's entries: measured with 76,000 unknowns of a solid; larger ones may shrink to less
LEVELS, FIELDS = 1.5, 8  # of a multigrid: entries of its levels over those of the matrix; fields of a block of columns
ITERATING = 4e-5  # s over unknowns and columns: measured with 33,000 unknowns
SMALL = GIB  # below which no estimate refuses anything
COARSEST = 20.0  # times larger elements


@dataclass(frozen=True)
class BodyResources:
    """What one body asks for.

    Attributes:
        dim: d.
        unknowns: Degrees of freedom of the displacement.
        matrix: Entries of its stiffness.
        columns: Solutions: patterns of force times the directions of each.
        patterns: Of force.
        temperatures: Degrees of freedom of the temperature; 0 without heat.
        surface: Degrees of freedom of the contact surface's displacement.
        solver: What solves for the columns.
        holders: Ranks that each have the factor and solve a share of the columns.
        way: What `setup.way` says.
        together: Whether all ranks eliminate it down to its surface, each its own cells.
        made: Whether its factor, or what stands for it, is there already.
    """

    dim: int
    unknowns: float
    matrix: float
    columns: float
    patterns: float
    temperatures: float
    surface: float
    solver: Solver = "factor"
    holders: int = 1
    way: str = "automatic"
    together: bool = False
    made: bool = False

    def coarser(self, times: float) -> BodyResources:
        """Return the same of elements so many times as large."""
        volume, surface = times**-self.dim, times ** (1 - self.dim)
        return replace(
            self,
            unknowns=self.unknowns * volume,
            matrix=self.matrix * volume,
            columns=self.columns * surface,
            patterns=self.patterns * surface,
            temperatures=self.temperatures * volume,
            surface=self.surface * surface,
        )

    @property
    def factor(self) -> float:
        """Entries of the factor."""
        n = max(self.unknowns, 2.0)
        return float(5 * n * np.log2(n) if self.dim == 2 else 22 * n ** (4 / 3))

    @property
    def memory(self) -> float:
        """Bytes of stiffness, factor and answers."""
        answers = self.patterns * self.dim * self.columns + self.patterns * self.temperatures
        complement = 2 * self.surface**2 if self.by_surface else 0.0
        if self.made:
            return NUMBER * (answers + complement)
        each = self.matrix + self.solving
        return NUMBER * (0.5 * self.matrix + self.holders * each + answers + complement)

    @property
    def solving(self) -> float:
        """Numbers that what solves for the columns has, at its making."""
        if self.solver == "multigrid":
            return LEVELS * self.matrix + FIELDS * BLOCK * self.unknowns
        return WORKING * self.factor * (LOW_RANK if self.solver == "low-rank" else 1.0)

    @property
    def by_surface(self) -> bool:
        """Whether the body is eliminated down to its surface, and no column is solved for."""
        if self.solver != "factor" or self.temperatures or self.way == "columns":
            return False
        return self.way != "automatic" or SURFACE_SHARE * self.surface**2 <= self.factor

    @property
    def seconds(self) -> float:
        """Time of one core."""
        if self.solver == "multigrid":
            return (ASSEMBLING[self.dim] + ITERATING * self.columns) * self.unknowns
        if self.made:
            return self.by_columns
        return ASSEMBLING[self.dim] * self.unknowns + self.factoring + self.by_columns

    @property
    def factoring(self) -> float:
        """Time of one core for the factor."""
        return float(FACTORING[self.dim] * self.unknowns ** (1.5 if self.dim == 2 else 2.0))

    @property
    def by_columns(self) -> float:
        """Time of one core for the columns, by a factor."""
        return 0.0 if self.by_surface else 4 * self.factor * self.columns / SOLVING

    @property
    def on_holder(self) -> float:
        """Time of each rank that has the factor, for the factor and its share of the columns."""
        return self.factoring + self.by_columns / self.holders

    @property
    def heating(self) -> float:
        """Time of one core for the steps of the heat."""
        nodes = self.patterns if self.patterns <= MANY else LASTING
        return HEATING * self.temperatures * nodes

    @property
    def alone(self) -> tuple[float, float]:
        """Time of one core and bytes of its stiffness and factor, without columns and the surface."""
        part = replace(self, columns=0.0, patterns=0.0, surface=0.0)
        return part.seconds, part.memory


@dataclass(frozen=True)
class Resources:
    """What the set-up of both bodies, of their contact and of their heat asks for: an estimate.

    Attributes:
        punch, strip: The bodies.
        nodes: Contact nodes.
        interfaces: Positions of the strip, and loads, that differ.
        phases: Of the motion.
        copies: Of the contact: one on each rank, unless ranks share it.
        numbers: Whether the contact is matrices of numbers.
    """

    punch: BodyResources
    strip: BodyResources
    nodes: float
    interfaces: int
    phases: int
    copies: int = 1
    numbers: bool = True

    def coarser(self, times: float) -> Resources:
        """Return the same of elements so many times as large."""
        nodes = self.nodes * times ** (1 - self.punch.dim)
        parts = (self.punch.coarser(times), self.strip.coarser(times))
        return replace(self, punch=parts[0], strip=parts[1], nodes=nodes)

    @property
    def memory(self) -> float:
        """Bytes at the end of the set-up, and in the first half-cycles."""
        return self.punch.memory + self.strip.memory + self.contact * self.copies

    @property
    def contact(self) -> float:
        """Bytes of the whole contact, once."""
        return _contact(self.nodes, self.interfaces, self.punch.dim, self.phases) if self.numbers else 0.0

    @property
    def seconds(self) -> float:
        """Time of one core, heat's steps included."""
        return self.punch.seconds + self.strip.seconds + self.heating

    @property
    def heating(self) -> float:
        """Time of one core for the steps of the heat."""
        return self.punch.heating + self.strip.heating

    def text(self) -> str:
        """Say it in a line."""
        heat = f", {duration(self.heating)} of it for heat," if self.heating else ""
        unknowns = " and ".join(f"{body.unknowns:,.0f}" for body in (self.punch, self.strip))
        return (
            f"{unknowns} unknowns, {self.nodes:,.0f} contact nodes: the set-up takes about {duration(self.seconds)} "
            f"of one core{heat} and {memory_size(self.memory)}, by an estimate"
        )

    def fitting(self, memory: float) -> tuple[float, Resources] | None:
        """Return how many times as large elements fit into so much memory, and what they need; None where none do."""
        for times in np.geomspace(1.0, COARSEST, 121):
            less = self.coarser(float(times))
            if less.memory <= memory:
                return float(times), less
        return None


def contact_memory(placed: ContactSetup) -> float:
    """Return the bytes of the whole contact, once."""
    return _contact(len(placed.pair.weights), _interfaces(placed), placed.pair.punch.dim, len(placed.pairs))


def _interfaces(placed: ContactSetup) -> int:
    """Return how many interfaces the phases and the middle position have."""
    return len({id(rigid) for rigid in (*placed.rigids, placed.rigid)})


def _contact(nodes: float, interfaces: int, dim: int, phases: int) -> float:
    return NUMBER * (interfaces * dim + 2 * phases + 1) * nodes**2


def needs(placed: ContactSetup, frames: tuple[bool, bool, bool]) -> Resources:
    """Return what condensing the bodies and joining them will need; collective.

    Args:
        placed: The bodies opposite each other.
        frames: Whether the strip moves as a whole, whether the contact frame stays, and whether the strip is flat.
    """
    moves, fixed, flat = frames
    bodies, pair = placed.bodies, placed.pair
    n, dim = len(pair.weights), pair.punch.dim
    on_strip = len(pair.strip.trace) if moves else n
    of_punch = body_resources(bodies.punch, n, n if fixed else n * dim, heat=bodies.heat is not None)
    one = not moves or (fixed and flat)
    of_strip = body_resources(bodies.strip, on_strip, on_strip if one else on_strip * dim, heat=bodies.heat is not None)
    copies, numbers = placed.comm.size, condensed(bodies)
    return Resources(of_punch, of_strip, n, _interfaces(placed), len(placed.pairs), copies, numbers)


def condensed(bodies: Bodies) -> bool:
    """Return whether a body is condensed, so that the contact is matrices of numbers."""
    return CONDENSED in (bodies.punch.operator, bodies.strip.operator)


def body_resources(elastic: ElasticBody, patterns: int, columns: int, *, heat: bool = False) -> BodyResources:
    """Return what condensing a body will need; collective.

    Args:
        elastic: The body.
        patterns: Of force.
        columns: Solutions.
        heat: Whether its answer to temperatures is asked for, too.
    """
    if elastic.operator != CONDENSED:
        return BodyResources(elastic.dim, elastic.size, 0, 0, 0, 0, 0, way=elastic.setup.way, made=True)
    size, surface = elastic.size, elastic.surface_dofs.size
    temperatures = size / elastic.dim if heat else 0.0
    entries, solver = elastic.matrix_entries(), elastic.solver
    way, together = elastic.setup.way, not heat and Request(elastic, elastic.surface.spread).in_substructures
    known = (elastic.dim, size, entries, columns, patterns, temperatures, surface, solver)
    return BodyResources(*known, way=way, together=together, made=elastic.is_factored)


def duration(seconds: float) -> str:
    """Say how long, roughly."""
    if seconds < 90:
        return f"{seconds:.1g} s" if seconds < 10 else f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} minutes" if seconds < 5400 else f"{seconds / 3600:.1f} hours"
