"""The laws of contact by their names: each sets up bodies, steps over half-cycles and cycles, and finds their end.

A law is registered here by its name in a case, `contact.law`, and the module that has it as `LAW`; nothing else in this
package names one. What they share is the loop (`cycle.driver`), the state (`cycle.state`), blocks, runs and results.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.sliding.wear import Worn

if TYPE_CHECKING:
    from fenwear.assembly.bodies import Bodies
    from fenwear.assembly.tribosystem import Preparation, Tribosystem

GROSS = "gross-sliding"
LAWS = {GROSS: "fenwear.cycle.gross_sliding", "coulomb": "fenwear.stick.coulomb"}


class ContactLaw(Protocol):
    """What a law of contact answers.

    Attributes:
        memory: The data class of what it remembers from half-cycle to half-cycle besides depths and temperatures, with
            temperatures as `warm`; None for nothing.
    """

    memory: type | None

    def assemble(
        self,
        case: Case,
        comm: MPI.Comm,
        followed: Worn | None,
        *,
        heat: Preparation,
        fresh: bool,
        warmed: tuple[Array, Array] | None,
    ) -> Tribosystem:
        """Return the system of a case; see `assembly.assemble`; collective."""

    def of_bodies(self, case: Case, bodies: Bodies, *, heat: Preparation, fresh: bool) -> Tribosystem:
        """Return the system of a case whose bodies are built; collective."""

    def at_temperatures(self, system: Tribosystem, bodies: Bodies) -> Tribosystem:
        """Return the system of the same case and meshes with the properties that these bodies have; collective."""

    def varied(self, system: Tribosystem, case: Case) -> Tribosystem:
        """Return the system of another case that shares all operators which the change leaves; collective."""

    def renewed(self, system: Tribosystem, followed: Worn | None, warmed: tuple[Array, Array] | None) -> Tribosystem:
        """Return the system of the same case on meshes and with properties of now; collective."""

    def end(self, system: Tribosystem) -> Any:
        """Return the state to which wear leads in the end; collective."""

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


def law_named(name: str) -> ContactLaw:
    """Return a law of contact by its name in cases."""
    law: ContactLaw = import_module(LAWS[name]).LAW
    return law
