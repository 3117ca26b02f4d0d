"""Contact and stick on all displacements of both bodies, to compare the package's condensed solvers with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar
from unittest.mock import patch

from fenwear.contact import SlidingContact
from fenwear.steps import driver, stick_increment
from fenwear.system import Bodies, Tribosystem
from fenwear_verify.full_space.contact import FullContact
from fenwear_verify.full_space.step import FullStep

T = TypeVar("T")

__all__ = ["FullContact", "FullStep", "nothing_condensed"]


@contextmanager
def nothing_condensed() -> Iterator[None]:
    """Solve contacts and time steps on all displacements meanwhile."""

    def whole(phases: Sequence[SlidingContact], bodies: Sequence[Bodies]) -> FullContact:
        return FullContact(phases, [(own.punch, own.strip) for own in bodies])

    def middle(system: Tribosystem, directions: Sequence[int]) -> FullContact:
        phases = [SlidingContact(system.elastic.interface, system.phases.middle_ratio(d)) for d in directions]
        return whole(phases, [system.bodies] * len(phases))

    def phases_of(system: Tribosystem, phases: Sequence[int]) -> FullContact:
        ratios = system.phases.ratios()
        sliding = [SlidingContact(system.elastic.interfaces[k], ratios[k]) for k in phases]
        return whole(sliding, [system.loaded[k] for k in phases])

    def passed(system: Tribosystem, phase: int, **_how: Any) -> FullContact:
        interface, factors = system.elastic.creep.grown[phase], system.elastic.creep.factors(phase)
        softer = [(factors[0], factors[1])]
        both = [(system.loaded[phase].punch, system.loaded[phase].strip)]
        return FullContact([SlidingContact(interface, system.phases.ratios()[phase])], both, softer)

    def on_every_rank(_system: Tribosystem, function: Callable[[], T]) -> T:
        return function()

    with ExitStack() as patches:
        for owner, name, new in (
            (Tribosystem, "contact", middle),
            (Tribosystem, "phase_contact", phases_of),
            (Tribosystem, "passed_contact", passed),
            (driver, "led", on_every_rank),
            (stick_increment, "_step", FullStep),
        ):
            patches.enter_context(patch.object(owner, name, new))
        yield
