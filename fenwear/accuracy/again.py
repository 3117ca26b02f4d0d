"""The same run again in another discretisation: on elements of another degree, in other steps, with other positions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from fenwear.accuracy.values import Values, values_of
from fenwear.assembly import Tribosystem, renewed, with_case, with_reduced_heat
from fenwear.case import Case
from fenwear.cycle import Block, Span, follow_program, jump, march
from fenwear.cycle.driver import Watch, unwatched
from fenwear.cycle.state import RunState
from fenwear.errors import CaseError

LONGEST = 400  # phases that are marched again one by one; longer runs go by jumps
TOLERANCE = 1e-3  # of these jumps
FEWEST = 9  # nodes of a contact grid that is coarsened
LEAST = 8  # nodes across a contact whose grid grows


@dataclass(frozen=True)
class Again:
    """A run in another discretisation.

    Attributes:
        system: Of the run's case with other elements or steps.
        until: The half-cycle it ends with.
        watch: Asked between solves.
    """

    system: Tribosystem
    until: int
    watch: Watch = unwatched

    @property
    def case(self) -> Case:
        """Its case."""
        return self.system.case

    def otherwise(self, **tables: Mapping[str, Any]) -> Again:
        """Return the same with other values in some tables of its case; collective.

        Raises:
            CaseError: they do not go.
        """
        case = changed(self.case, **tables)
        of_run = tables.keys() == {"run"}
        return replace(self, system=replace(self.system, made_from=case) if of_run else with_case(self.system, case))

    def values(self) -> Values:
        """Return the numbers of its end; collective.

        Raises:
            ConvergenceError: a half-cycle did not converge.
        """
        return values_of(self.ends()[1])

    def ends(self) -> tuple[Block, Block]:
        """Return its first half-cycles and its last ones; collective.

        Raises:
            ConvergenceError: a half-cycle did not converge.
        """
        blocks = follow_program(self.system, self._integrate, self.until)
        first = last = next(blocks)
        while last.end.half_cycle < self.until and (block := next(blocks, None)) is not None:
            last = block
        return first, last

    def _integrate(
        self, system: Tribosystem, start: RunState | None, leave: Callable[[RunState], bool], span: Span
    ) -> Iterator[Block]:
        run = self.case.run
        shared: dict[str, Any] = {"leave": leave, "watch": self.watch, "loading": span.loading}
        if run.integration != "jump":
            yield from march(system, span.until, implicit=run.integration == "implicit", start=start, **shared)
            return
        state, left = start, False
        for block in jump(with_reduced_heat(system), span.until, tolerance=run.jump_tolerance, start=start, **shared):
            yield block
            state, left = block.end, leave(block.end)
        if not left and (0 if state is None else state.half_cycle) < span.until:  # a cycle that is not whole
            yield from march(system, span.until, implicit=True, start=state, **shared)


def coarser(case: Case) -> Case | None:
    """Return the case on elements of the next lower degree, on a grid with half the nodes; None where there is none."""
    grid = case.grid
    if grid is not None and grid.across is not None:
        return changed(case, grid={"across": grid.across // 2}) if grid.across >= 2 * LEAST else None
    if grid is not None and grid.nodes is not None:
        return changed(case, grid={"nodes": (grid.nodes - 1) // 2 + 1}) if grid.nodes >= FEWEST else None
    degree = case.geometry.degree
    return None if degree == 1 else changed(case, geometry={"degree": degree - 1})


def changed(case: Case, **tables: Mapping[str, Any]) -> Case:
    """Return the case with other values in some of its tables."""
    return case.model_copy(
        update={name: getattr(case, name).model_copy(update=dict(values)) for name, values in tables.items()}
    )


def in_few_steps(case: Case, phases: int) -> Case:
    """Return the case to be run again: to its end, by jumps where it has many phases."""
    run: dict[str, Any] = {"periodic_within": None}
    if case.run.integration != "jump" and phases > LONGEST and case.contact.solver == "condensed":
        run |= {"integration": "jump", "jump_tolerance": TOLERANCE}
    return changed(case, run=run)


def set_up(case: Case, system: Tribosystem) -> Tribosystem:
    """Return the bodies of a case; where its curved elements are too coarse, those with straight ones; collective.

    Args:
        case: The run's on other elements.
        system: Of the run, whose steps of slip it takes.

    Raises:
        CaseError: neither goes.
    """
    try:
        return renewed(replace(system, made_from=case))
    except CaseError as error:
        if case.geometry.order == 1:
            raise
        try:
            return renewed(replace(system, made_from=changed(case, geometry={"order": 1})))
        except CaseError:
            raise error from None
