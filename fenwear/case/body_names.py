"""The names of the two bodies of a problem.

Punch (above) and strip (below, which slides) are their roles: tables and keys of a case, groups of the ready
geometries, variables of results. A body may have a name besides, `punch.name = "pad"`. Its groups may then start with
the name or with the role, pad_contact or punch_contact, which mean the same, and whatever is said of it has its name.
So names are read where a case and where the groups of a geometry are read, and written in messages and results.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from pydantic import BaseModel

from fenwear.common.errors import CaseError, FenwearError, InputError

P = ParamSpec("P")
T = TypeVar("T")
ROLES = ("punch", "strip")
NAME = re.compile(r"[^\W\d_][\w-]*")
# A group such as punch_contact, but no file or parameter; and the role as a word, but not in a key or a path.
_TOLD = re.compile(
    r"(?<![\w/\\-])(?<!parameters\.)(?P<group>[Pp]unch|[Ss]trip)(?=_\w+(?!\w|\.\w)|_\.\.\.)|"
    r"(?<![\w./\\\[-])(?P<word>[Pp]unch|[Ss]trip)(?![\w/\\-]|\.\w|\])"
)


@dataclass(frozen=True)
class Names:
    """The names of the bodies.

    Attributes:
        punch, strip: By default their roles.
    """

    punch: str = "punch"
    strip: str = "strip"

    @classmethod
    def of(cls, tables: Mapping[str, Any]) -> Names:
        """Return the names in the tables of a case, as they are in a file or as models."""
        own = [_get(tables.get(role), "name") for role in ROLES]
        return cls(*(name if isinstance(name, str) else role for name, role in zip(own, ROLES, strict=True)))

    @property
    def by_roles(self) -> dict[str, str]:
        """The names by the roles."""
        return dict(zip(ROLES, (self.punch, self.strip), strict=True))

    @property
    def given(self) -> bool:
        """Whether a body has another name than its role."""
        return (self.punch, self.strip) != ROLES

    @property
    def problems(self) -> list[str]:
        """The problems of the names: a key and the expected value, each."""
        found = []
        for role, name, other in (("punch", self.punch, "strip"), ("strip", self.strip, "punch")):
            if not NAME.fullmatch(name):
                found.append(f"{role}.name: expected a word of letters, digits, - and _, such as 'pad', got {name!r}")
            elif f"{name}_".startswith(f"{other}_"):
                found.append(f"{role}.name: expected another name than that of the {other}, got {name!r}")
        first, second = f"{self.punch}_", f"{self.strip}_"
        if not found and (first.startswith(second) or second.startswith(first)):
            found.append(
                f"strip.name: expected a name that keeps the bodies' groups apart, got {self.punch!r}, {self.strip!r}"
            )
        return found

    def role_of(self, name: str) -> str:
        """Return the role of the body of a name; a name that is none as it is."""
        return {self.punch: "punch", self.strip: "strip"}.get(name, name)

    def by_role(self, group: str) -> str:
        """Return the name of a group with the body's role in front, as it is known inside."""
        for role, name in self.by_roles.items():
            if group.startswith(f"{name}_"):
                return f"{role}{group.removeprefix(name)}"
        return group

    def by_name(self, group: str) -> str:
        """Return the name of a group with the body's name in front."""
        for role, name in self.by_roles.items():
            if group.startswith(f"{role}_"):
                return f"{name}{group.removeprefix(role)}"
        return group

    def with_names(self, text: str) -> str:
        """Return a text in which the bodies have their names in place of their roles; keys and paths are left."""
        return _TOLD.sub(self._name, text) if self.given else text

    def meant(self, attributes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the attributes of a variable whose long name names the bodies."""
        return {key: self.with_names(value) if key == "long_name" else value for key, value in attributes.items()}

    def telling(self, log: Callable[[str], None]) -> Callable[[str], None]:
        """Return a log whose messages have the bodies' names."""
        return (lambda message: log(self.with_names(message))) if self.given else log

    @contextmanager
    def told_in_errors(self) -> Iterator[None]:
        """Let the errors of a block have the bodies' names."""
        try:
            yield
        except FenwearError as error:
            self.tell(error)
            raise

    def tell(self, error: FenwearError) -> None:
        """Let an error have the bodies' names."""
        if not self.given:
            return
        if isinstance(error, CaseError):
            error.problems = [InputError(self.with_names(p.key), self.with_names(p.message)) for p in error.problems]
        error.args = tuple(self.with_names(value) if isinstance(value, str) else value for value in error.args)

    def _name(self, match: re.Match[str]) -> str:
        role = match["group"] or match["word"]
        name = self.by_roles[role.lower()]
        return name if role.islower() else f"{name[:1].upper()}{name[1:]}"


BY_ROLE = Names()


def told_by_name(function: Callable[P, T]) -> Callable[P, T]:
    """Let the errors of a function have the names of the bodies of the case, or of the system, that it is given."""

    @wraps(function)
    def named(*args: P.args, **kwargs: P.kwargs) -> T:
        given = (getattr(one, "names", None) for one in (*args, *kwargs.values()))
        names = next((one for one in given if isinstance(one, Names)), BY_ROLE)
        with names.told_in_errors():
            return function(*args, **kwargs)

    return named


def renamed(data: Any, change: Callable[[str], str]) -> Any:
    """Return tables of a case with the groups of the geometry changed that they name: `on`, and keys of `regions`."""
    if isinstance(data, BaseModel):
        data = data.model_dump(exclude_unset=True)
    if isinstance(data, list | tuple):
        return [renamed(value, change) for value in data]
    if not isinstance(data, Mapping):
        return data
    found: dict[Any, Any] = {}
    for key, value in data.items():
        if key == "on" and isinstance(value, str):
            found[key] = change(value)
        elif key == "regions" and isinstance(value, Mapping):
            found[key] = {change(name) if isinstance(name, str) else name: one for name, one in value.items()}
        else:
            found[key] = renamed(value, change)
    return found


def _get(table: Any, key: str) -> Any:
    return table.get(key) if isinstance(table, Mapping) else getattr(table, key, None)
