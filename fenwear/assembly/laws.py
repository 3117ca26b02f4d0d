"""The laws of contact by their names: each sets up bodies, steps over half-cycles and cycles, and finds their end.

A law is registered here by its name in a case, `contact.law`, as the module that has it as `LAW`, or as an object by
`register_contact_law`; nothing else in this package names one. What they share is the loop (`cycle.driver`), the state
(`cycle.state`), blocks, runs and results. What differs beyond their steps they answer themselves: the questions are
those of `contact_law.ContactLaw`.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from fenwear.case.contact import CONTACT_LAWS
from fenwear.errors import CaseError, InputError

GROSS, AUTO = "gross-sliding", "auto"
LAWS: dict[str, Any] = {GROSS: "fenwear.cycle.gross_sliding", "coulomb": "fenwear.stick.coulomb"}


def law_named(name: str) -> Any:
    """Return a law of contact, a `ContactLaw`, by its name in cases; what a case leaves open slides as a whole."""
    found = LAWS[GROSS if name == AUTO else name]
    return _own(found) if isinstance(found, str) else found


@cache
def _own(module: str) -> Any:
    return import_module(module).LAW


def register_contact_law(name: str, law: Any) -> None:
    """Make a law of contact known under a name, for `contact.law` of cases.

    Args:
        name: A word; one that is registered already is replaced.
        law: Answers as `contact_law.ContactLaw` says. Systems that it makes have its name as their `law`.

    Raises:
        CaseError: the name is no word, or that of a law of fenwear's own.
    """
    own = isinstance(LAWS.get(name), str) or name == AUTO
    if not name.replace("-", "_").isidentifier() or own:
        raise CaseError(InputError("contact.law", f"expected a word that no law of fenwear has, got {name!r}"))
    LAWS[name] = law
    CONTACT_LAWS.add(name)
