"""The law of contact where a case leaves it open: stick where the bodies take up much of the stroke elastically."""

from __future__ import annotations

import tomllib
from collections.abc import Callable

from mpi4py import MPI

from fenwear.assembly import assemble
from fenwear.case import Case, make_case
from fenwear.case.laws import Stick
from fenwear.errors import CaseError
from fenwear.watch import TAKEN_UP, elastic_and_amplitude

Log = Callable[[str], None]


def with_law(case: Case, log: Log, comm: MPI.Comm = MPI.COMM_WORLD) -> Case:
    """Return the case with the law that its stroke calls for, where contact.law = "auto"; collective.

    Both bodies are condensed for it as gross sliding needs them, and kept on disk where it is what is taken.

    Args:
        case: The problem.
        log: Told which law is taken, and why.
        comm: The ranks.

    Raises:
        CaseError: the table stick is given in a case that does not go with stick; or what only the geometry can
            tell is wrong.
    """
    if case.contact.law != "auto":
        return case
    if case.stick != Stick():
        log("contact.law: 'coulomb' is taken, as the table stick is given")
        return _set(case, "coulomb")
    sliding = _set(case, "gross-sliding")
    system = assemble(sliding, comm, heat="none")
    if len(set(system.motion.directions)) == 1:
        log("contact.law: 'gross-sliding' is taken: the strip slides one way")
        return sliding
    way, amplitude = elastic_and_amplitude(system)
    share = (
        f"the bodies follow friction elastically by an estimate {1e3 * way:.3g} µm each way, "
        f"{100 * way / amplitude:.3g} % of the amplitude"
    )
    if way <= TAKEN_UP * amplitude:
        log(f"contact.law: 'gross-sliding' is taken: {share}")
        return sliding
    try:
        sticking = _set(case, "coulomb")
    except CaseError as error:
        log(f"contact.law: 'gross-sliding' is taken, as the case does not go with stick ({error.problems[0].key})")
        return sliding
    log(f"contact.law: 'coulomb' is taken: {share}")
    return sticking


def _set(case: Case, law: str) -> Case:
    """Return the case with a law.

    Raises:
        CaseError: they do not go together.
    """
    tables = tomllib.loads(case.to_toml())
    tables.setdefault("contact", {})["law"] = law
    return make_case(tables, case.folder)
