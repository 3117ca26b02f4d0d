"""The law of contact that a case leaves open: stick where the bodies take up much of the stroke elastically.

The estimate needs the bodies condensed as gross sliding needs them: what is made for it is what then slides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from mpi4py import MPI

from fenwear.case import Case
from fenwear.case.wear_table import Stick
from fenwear.checks.elastic_limits import TAKEN_UP, elastic_share
from fenwear.common.errors import CaseError, InputError
from fenwear.system import Preparation, Tribosystem, assemble, law_named, with_exchange, with_reduced_heat
from fenwear.system.contact_laws import GROSS

Law = Literal["gross-sliding", "coulomb"]
Log = Callable[[str], None]


@dataclass(frozen=True)
class LawChoice:
    """The law that contact.law = "auto" takes.

    Attributes:
        law: Which.
        text: It, and why, in a line.
        share: Of the amplitude that the bodies take up elastically, by an estimate; None where that plays no part.
    """

    law: Law
    text: str
    share: float | None = None


@dataclass(frozen=True)
class ResolvedCase:
    """A case whose law is decided.

    Attributes:
        system: Ready to slide or stick; its case has the law.
        share: Of the stroke that the bodies take up elastically; None where it was not asked for.
    """

    system: Tribosystem
    share: float | None = None

    @property
    def numbers(self) -> dict[str, Any]:
        """The entries of the summary of a run."""
        share = elastic_share(self.system) if self.share is None else self.share
        return {"contact_law": self.system.case.contact.law, "elastic_share_of_stroke": share}


def choose_law(system: Tribosystem) -> LawChoice:
    """Return the law that the stroke of a system calls for; collective.

    Stick where the bodies take up more than `watch.TAKEN_UP` of the amplitude elastically and nothing in the case
    rules it out; gross sliding elsewhere.

    Args:
        system: Both bodies condensed, from a case.
    """
    share = system.team.lead(lambda: elastic_share(system))
    if share is None:
        why = "the cycle is a table" if system.motion.steps else "the strip slides one way"
        return LawChoice("gross-sliding", f"contact.law: 'gross-sliding' is taken: {why}")
    size = f"{100 * share:.2g} % of the stroke" if share < 1 else f"{share:,.0f} times the stroke"
    by_text = f"the bodies take up about {size} elastically"
    if share <= TAKEN_UP:
        return LawChoice("gross-sliding", f"contact.law: 'gross-sliding' is taken: {by_text}", share)
    against = system.case.against_stick
    if against:
        return LawChoice(
            "gross-sliding", f"contact.law: 'gross-sliding' is taken, though {by_text}: {against[0]}", share
        )
    return LawChoice("coulomb", f"contact.law: 'coulomb' is taken: {by_text}", share)


def resolve_law(
    case: Case, log: Log, comm: MPI.Comm = MPI.COMM_WORLD, *, heat: Preparation = "as set", fresh: bool = False
) -> ResolvedCase:
    """Return a case with its law, and its system where it slides; collective.

    Args:
        case: The problem.
        log: Told which law is taken of "auto", and why.
        comm: The ranks.
        heat: Preparation of a system's heat: see `system.assemble`.
        fresh: Condense the bodies again, even where they are kept on disk.

    Raises:
        CaseError: a property of the geometry is wrong.
    """
    if case.contact.law == "auto" and case.stick != Stick():
        log("contact.law: 'coulomb' is taken, as the table stick is given")
        case = with_law(case, "coulomb")
    if case.contact.law != "auto":
        return ResolvedCase(assemble(case, comm, heat=heat, fresh=fresh))
    system = assemble(case, comm, heat="none", fresh=fresh)
    choice = choose_law(system)
    log(choice.text)
    taken = with_law(case, choice.law)
    if choice.law == "coulomb":
        system = law_named(choice.law).of_bodies(taken, system.bodies, heat=heat, fresh=fresh)
        return ResolvedCase(system, choice.share)
    system = replace(system, case=taken)
    if heat != "none":
        prepare = with_reduced_heat if heat == "reduced" else with_exchange
        system = prepare(system, keep=True, fresh=fresh)
    return ResolvedCase(system, choice.share)


def with_law(case: Case, law: Law) -> Case:
    """Return the case with a law that fits it."""
    return case.model_copy(update={"contact": case.contact.model_copy(update={"law": law})})


def check_decided(system: Tribosystem) -> None:
    """Make sure that a case that leaves its law open is one of gross sliding, which it has been taken for; collective.

    Raises:
        CaseError: stick is what it calls for.
    """
    if system.case.contact.law != "auto":
        return
    if system.case.stick != Stick():
        text = "'coulomb' is taken, as the table stick is given"
    else:
        choice = choose_law(system)
        if choice.law == GROSS:
            return
        text = choice.text.removeprefix("contact.law: ")
    message = f"{text}. A study follows one law for all values. Set 'coulomb', or 'gross-sliding' to leave stick out"
    raise CaseError(InputError("contact.law", message))
