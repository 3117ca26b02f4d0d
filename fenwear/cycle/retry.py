"""Half-cycles that do not converge, tried again from where they began in smaller steps.

Each phase is cut into parts of equal time at the same position of the strip. Each part has a contact
of its own, wears its share, and heats for its share of the time.
"""

from __future__ import annotations

from functools import reduce

from fenwear.assembly import Tribosystem, in_parts
from fenwear.contact import ContactState
from fenwear.cycle.block import PhaseRecord, heat_of_phases
from fenwear.cycle.phase import PhaseEnd, PhaseStep
from fenwear.cycle.state import RunState
from fenwear.cycle.totals import Totals
from fenwear.errors import SMALLER_STEPS, ConvergenceError
from fenwear.heat.field import HeatState
from fenwear.sliding.wear import WornDepths

PARTS = (5, 25)  # of each phase; odd, so that one is in the middle


class SmallerSteps:
    """Half-cycles in parts of their phases; what they need is made at the first one and kept.

    Args:
        system: The assembled problem.
        implicit: Whether the wear of a part is implicit.
    """

    def __init__(self, system: Tribosystem, *, implicit: bool) -> None:
        self.system, self.implicit = system, implicit
        self._steps: dict[int, list[PhaseStep]] = {}
        system.team.serve(self)

    def half_cycle(self, state: RunState, phases: range, error: ConvergenceError, load: float = 1.0) -> list[PhaseEnd]:
        """Return the ends of the phases of a half-cycle.

        Args:
            state: At its start.
            phases: Their numbers in the cycle.
            error: Why it is not solved as a whole.
            load: Factor of all loads.

        Raises:
            ConvergenceError: it does not converge in the smallest parts either; `error` as it was.
        """
        for parts in PARTS:
            try:
                ends = self._in_parts(state, phases, parts, load)
            except ConvergenceError:
                continue
            self.system.remedies.note(SMALLER_STEPS.format(parts * len(phases)))
            return ends
        raise error

    def _in_parts(self, state: RunState, phases: range, parts: int, load: float) -> list[PhaseEnd]:
        steps = self._prepared(parts)
        temperature, worn, ends = state.temperature, state.worn, []
        for phase in phases:
            before, place = state.contacts[phase], phase - phases.start
            contact, own = before, []
            for part, step in enumerate(steps[phase * parts : (phase + 1) * parts]):
                done = state.half_cycle + (place + (part + 0.5) / parts) / len(phases)
                end = step.solve(temperature, worn, contact, load, done)
                contact, temperature, worn = end.record.contact, end.temperature, worn + end.worn
                own.append(end)
            ends.append(_joined(own, phase, before, temperature))
        return ends

    def _prepared(self, parts: int) -> list[PhaseStep]:
        if parts not in self._steps:
            self.system.team.each(self, "prepare", parts)
        return self._steps[parts]

    def prepare(self, parts: int) -> None:
        """Make the steps; collective."""
        system = in_parts(self.system, parts)
        phases = range(len(system.motion.phases))
        self._steps[parts] = [PhaseStep(system, phase, implicit=self.implicit) for phase in phases]


def _joined(ends: list[PhaseEnd], phase: int, before: ContactState | None, temperature: HeatState | None) -> PhaseEnd:
    """Return the parts of a phase as one: the contact in its middle, and all that it wears and heats."""
    middle = ends[len(ends) // 2].record
    adds = reduce(Totals.__add__, [end.record.adds for end in ends])
    previous = None if before is None else before.pressure[0]
    return PhaseEnd(
        PhaseRecord(phase, middle.contact, previous, adds, middle.friction_ratio),
        temperature,
        heat_of_phases(end.heat for end in ends),
        reduce(WornDepths.__add__, [end.worn for end in ends]),
    )
