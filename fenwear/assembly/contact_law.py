"""What a law of contact answers: the questions that `laws` asks by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from fenwear.assembly.bodies import Bodies
from fenwear.assembly.tribosystem import Preparation, Tribosystem
from fenwear.case import Case


class ContactLaw(Protocol):
    """What a law of contact answers.

    Attributes:
        name: By which cases have it; systems have it as their `law`.
        sticks: Whether nodes stick or slip by themselves, resolved in time steps; else all slide with the motion.
        memory: The data class of what it remembers from half-cycle to half-cycle besides depths and temperatures, with
            temperatures as `warm`; None for nothing.
    """

    name: str
    sticks: bool
    memory: type | None

    def of_bodies(self, case: Case, bodies: Bodies, *, heat: Preparation, fresh: bool) -> Tribosystem:
        """Return the system of a case whose bodies are built; collective."""

    def renewed(self, system: Tribosystem, bodies: Bodies) -> Tribosystem:
        """Return the system of the same case with the meshes or properties that these bodies have; collective."""

    def varied(self, system: Tribosystem, case: Case) -> Tribosystem:
        """Return the system of another case of the same set-up and law, sharing what the change leaves; collective."""

    def replicated(self, system: Tribosystem) -> bool:
        """Return whether every rank could go on alone: no temperatures, no contact on all displacements."""

    def elastic_length(self, system: Tribosystem) -> float:
        """Return the gap that unit pressures open on average, mm/MPa: the scale of gaps."""

    def check_touching(self, system: Tribosystem) -> None:
        """Make sure that the surfaces touch; collective.

        Raises:
            CaseError: they never do, or supports carry all of the load.
        """

    def end(self, system: Tribosystem, properties_within: float | None = None) -> Any:
        """Return the state to which wear leads in the end; collective."""

    def on_other_grid(self, memory: Any, before: Tribosystem, after: Tribosystem) -> Any:
        """Return what steps remember, on another contact grid of the same bodies; collective."""

    def half_cycles(
        self, system: Tribosystem, watch: Callable[[], bool], loading: Callable[[float], float], *, implicit: bool
    ) -> Any:
        """Return the `cycle.driver.Step` that goes on by a half-cycle."""

    def jumps(
        self,
        system: Tribosystem,
        tolerance: float,
        watch: Callable[[], bool],
        loading: Callable[[float], float],
    ) -> Any:
        """Return the `cycle.driver.Step` that goes on by as many cycles as the tolerance allows."""
