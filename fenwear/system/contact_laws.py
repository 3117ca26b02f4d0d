"""The laws of contact by their names: each sets up bodies, steps over half-cycles and cycles, and finds their end.

A law is registered here by its name in a case, `contact.law`, as the module that has it as `LAW`, or as an object by
`register_contact_law`; nothing else in this package names one. Laws share the loop (`steps.driver`), the state
(`steps.run_state`), blocks, runs and results. Each law answers its differences beyond the steps: the questions are
those of `ContactLaw`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from fenwear.case.contact_table import CONTACT_LAWS
from fenwear.common.errors import CaseError, InputError

if TYPE_CHECKING:
    from fenwear.case import Case
    from fenwear.system.both_bodies import Bodies
    from fenwear.system.tribosystem import Preparation, Tribosystem

GROSS, AUTO = "gross-sliding", "auto"
LAWS: dict[str, Any] = {GROSS: "fenwear.steps.gross_sliding", "coulomb": "fenwear.steps.coulomb"}


def law_named(name: str) -> ContactLaw:
    """Return a law of contact by its name in cases; `auto` gives gross sliding."""
    law = LAWS[GROSS if name == AUTO else name]
    return import_module(law).LAW if isinstance(law, str) else law


def register_contact_law(name: str, law: Any) -> None:
    """Make a law of contact known under a name, for `contact.law` of cases.

    Args:
        name: A word; one that is registered already is replaced.
        law: Answers as `ContactLaw` says. Systems that it makes have its name as their `law`.

    Raises:
        CaseError: the name is no word, or that of a law of fenwear's own.
    """
    built_in = isinstance(LAWS.get(name), str) or name == AUTO
    if not name.replace("-", "_").isidentifier() or built_in:
        raise CaseError(InputError("contact.law", f"expected a name that no built-in law has, got {name!r}"))
    LAWS[name] = law
    CONTACT_LAWS.add(name)


class ContactLaw(Protocol):
    """The interface of a law of contact.

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
        """Return the system of another case of the same set-up and law, sharing all unchanged parts; collective."""

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
        """Return the memory of the steps on another contact grid of the same bodies; collective."""

    def half_cycles(
        self, system: Tribosystem, watch: Callable[[], bool], loading: Callable[[float], float], *, implicit: bool
    ) -> Any:
        """Return the `steps.driver.Step` that advances by a half-cycle."""

    def jumps(
        self,
        system: Tribosystem,
        tolerance: float,
        watch: Callable[[], bool],
        loading: Callable[[float], float],
    ) -> Any:
        """Return the `steps.driver.Step` that advances by as many cycles as the tolerance allows."""
