"""The same run again in another discretisation: on elements of another degree, in other steps, with other positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import Case
from fenwear.checks.uncertain_values import Values, values_of
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError
from fenwear.steps import Block, follow_program
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.run_state import RunState
from fenwear.surfaces import ContactPair
from fenwear.system import Tribosystem, answers_anywhere, relaid, renewed, with_case, with_reduced_heat

LONGEST = 100  # phases that are marched again one by one; longer runs go by jumps
LARGER, LESS = 8.0, 0.25  # by which the tolerance of jumps is raised where they are dear, and their error then falls
DEAR = 40  # phases in all jumps of a run that are
TOLERANCE = 1e-2  # of these jumps, whose errors are known
FEWEST = 9  # nodes of a contact grid that is coarsened
LEAST = 8  # nodes across a contact whose grid grows
PLENTY = 12  # nodes across a contact on a grid that is a quarter as fine


@dataclass(frozen=True)
class Again:
    """A run in another discretisation.

    Attributes:
        system: Of the run's case with other elements or steps.
        until: The half-cycle it ends with.
    """

    system: Tribosystem
    until: int

    @property
    def case(self) -> Case:
        """Its case."""
        return self.system.case

    def otherwise(self, **tables: Mapping[str, Any]) -> Again:
        """Return the discretisation with other values in some tables of its case; collective.

        Raises:
            CaseError: they do not go.
        """
        case = changed(self.case, **tables)
        of_run = tables.keys() == {"run"}
        return replace(self, system=replace(self.system, case=case) if of_run else with_case(self.system, case))

    def values(self) -> Values:
        """Return the numbers of its end; collective.

        Raises:
            ConvergenceError: a half-cycle did not converge.
        """
        return values_of(self.ends()[1])

    def ends(self) -> tuple[Block, Block, Block]:
        """Return its first half-cycles, its last ones, and of jumps those that end a cycle before; collective.

        Raises:
            ConvergenceError: a half-cycle did not converge.
        """
        blocks = follow_program(self.system, self._integrate, RunLimits(self.until))
        first = last = before = next(blocks)
        while last.end.half_cycle < self.until and (block := next(blocks, None)) is not None:
            before, last = last, block
        return first, last, before

    def _integrate(self, system: Tribosystem, limits: RunLimits, start: RunState | None) -> Iterator[Block]:
        run = self.case.run
        if run.integration != "jump":
            yield from march_within(system, limits, start, implicit=run.integration == "implicit")
            return
        state, left = start, False
        reduced, tolerance = with_reduced_heat(system), run.jump_tolerance
        stops = frozenset({self.until - system.motion.half_cycles})
        jumped = jump_within(reduced, replace(limits, stops=stops), start, tolerance=tolerance, finer=True)
        for block in jumped:
            yield block
            state, left = block.end, limits.leave(block.end)
        if not left and (0 if state is None else state.half_cycle) < limits.half_cycles:  # a cycle that is not whole
            yield from march_within(system, limits, state, implicit=True)


@dataclass(frozen=True)
class Coarser:
    """A case on coarser elements, or on a coarser grid.

    Attributes:
        case: Itself.
        ratio: Ratio of its node spacing to that of the run; 1 where there is nothing coarser.
        grid: Its grid, where it has one that stays.
    """

    case: Case
    ratio: float = 1.0
    grid: RegularGrid | None = None

    @property
    def differs(self) -> bool:
        """Whether it is coarser at all."""
        return self.ratio > 1


def coarser(case: Case, pair: ContactPair, across: int = 0) -> Coarser:
    """Return the case on elements of the next lower degree, on a grid half or a quarter as fine.

    Args:
        case: The problem.
        pair: Its surfaces.
        across: Nodes across the contact.
    """
    degree, grid, wanted = case.geometry.degree, pair.punch.grid, case.grid
    if wanted is None or grid is None:
        lower = changed(case, geometry={"degree": max(degree - 1, 1)})
        return Coarser(lower, degree / max(degree - 1, 1))
    rough = any(body.topography is not None for body in case.bodies.values())  # which is another one on other nodes
    every = 4 if (wanted.across or across) >= 4 * PLENTY and not rough else 2
    if wanted.across is not None:
        few = wanted.across < every * LEAST
        return Coarser(case) if few else Coarser(changed(case, grid={"across": wanted.across // every}), every)
    if max(grid.counts) < FEWEST:
        return Coarser(case)
    fewer = grid.thinned(every, less=int(wanted.size is None))  # by default a spacing is left at each end
    numbers = {"nodes": max(fewer.counts), "size": tuple(fewer.sides), "middle": tuple(fewer.middle)}
    return Coarser(changed(case, grid=numbers), every, fewer)


def nodes_across(pair: ContactPair, pressure: Array) -> int:
    """Return how many nodes of a grid there are across the contact by pressures (..., n); 0 without a grid."""
    grid, touched = pair.punch.grid, (pressure > 0).any(axis=tuple(range(pressure.ndim - 1)))
    if grid is None or not touched.any():
        return 0
    return int(np.ptp(grid.places[touched], axis=0).max()) + 1


def changed(case: Case, **tables: Mapping[str, Any]) -> Case:
    """Return the case with other values in some of its tables."""
    return case.model_copy(
        update={name: getattr(case, name).model_copy(update=dict(values)) for name, values in tables.items()}
    )


def in_few_steps(case: Case, system: Tribosystem, until: int) -> Case:
    """Return the case to be run again: to its end, by jumps where it has many phases.

    Args:
        case: The problem.
        system: Of the run itself, whose positions of the strip are kept where other nodes would ask for others.
        until: The half-cycle it ends with.
    """
    run: dict[str, Any] = {"periodic_within": None}
    if case.run.integration != "jump" and until * system.motion.positions > LONGEST:
        run |= {"integration": "jump", "jump_tolerance": TOLERANCE}
    if not system.law.sticks and case.leaves_positions and case.strip_varies and system.sliding.to_and_fro:
        return changed(case, run=run, motion={"positions": system.motion.positions})
    return changed(case, run=run)


def are_dear(last: Block) -> bool:
    """Return whether the jumps of a run, by its last half-cycles, take more than its set-up, more or less.

    Bodies that answer on any grid are not set up again.
    """
    phases = len(last) * last.system.motion.positions
    return last.system.law.sticks or phases > DEAR or answers_anywhere(last.system)


def in_longer_jumps(case: Case) -> Case:
    """Return the case with a larger tolerance of its jumps."""
    return changed(case, run={"jump_tolerance": min(1.0, LARGER * case.run.jump_tolerance)})


def set_up(case: Case, system: Tribosystem, by: Coarser) -> Tribosystem:
    """Return the bodies of a case; where its curved elements are too coarse, those with straight ones; collective.

    Operators that answer on any grid are shared with a coarser one.

    Args:
        case: The run's on other elements.
        system: Of the run, whose steps of slip it takes.
        by: The coarser case and its ratio.

    Raises:
        CaseError: neither goes.
    """
    if by.differs and answers_anywhere(system):
        return relaid(system, case, by.grid)
    try:
        return renewed(replace(system, case=case))
    except CaseError as error:
        if case.geometry.order == 1:
            raise
        try:
            return renewed(replace(system, case=changed(case, geometry={"order": 1})))
        except CaseError:
            raise error from None
