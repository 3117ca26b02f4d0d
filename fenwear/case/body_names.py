"""The names of the two bodies of a problem: translated where a case is read and where words are written.

Punch (above) and strip (below, which slides) are their roles in code, in variables of results, and in the short form of
a case. `contact.between = ["bushing", "shaft"]` and `contact.slides = "shaft"` give them names. Then the tables of a
case are `bodies.shaft` and `wear.shaft`, and groups of the geometry may start with the name or with the role.
`by_roles` translates tables at the door, `by_names` back; `Names.with_names` translates keys and words of messages and
results.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

from pydantic import BaseModel

from fenwear.case.body_tables import Body
from fenwear.common.errors import CaseError, FenwearError, InputError, did_you_mean

P = ParamSpec("P")
T = TypeVar("T")
ROLES = ("punch", "strip")
NAME = re.compile(r"[^\W\d_][\w-]*")
# A group such as punch_contact, but no file or parameter; and the role as a word, but not in a key or a path.
_TOLD = re.compile(
    r"(?<![\w/\\-])(?<!parameters\.)(?P<group>[Pp]unch|[Ss]trip)(?=_\w+(?!\w|\.\w)|_\.\.\.)|"
    r"(?<![\w./\\\[-])(?P<word>[Pp]unch|[Ss]trip)(?![\w/\\-]|\.\w|\])"
)


BODY_KEYS = "|".join(Body.model_fields)
_KEY = re.compile(
    rf"(?<![\w./\\\[])(?:(?P<wear>wear\.)(?P<law>punch|strip)\b|(?P<role>punch|strip)(?=\.(?:{BODY_KEYS})\b))"
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
        """Return the names in the tables of a case.

        Raises:
            CaseError: they are no names, or do not keep the bodies apart.
        """
        contact = _table(tables.get("contact"))
        between, slides = contact.get("between"), contact.get("slides")
        if not isinstance(between, list | tuple) or [type(name) for name in between] != [str, str]:
            return cls()  # that a list of another form is wrong, the schema says
        above, below = between
        if slides not in (None, "", *between):
            known = " or ".join(map(repr, between))
            raise CaseError(InputError("contact.slides", f"expected {known}, got {slides!r}"))
        names = cls(below, above) if slides == above else cls(above, below)
        wrong = next((name for name in between if not NAME.fullmatch(name)), None)
        if wrong is not None:
            message = f"expected words of letters, digits, - and _, such as 'pad', got {wrong!r}"
        elif any(f"{first}_".startswith(f"{other}_") for first, other in names.to_keep_apart):
            message = f"expected names that keep the bodies' groups apart, got {above!r}, {below!r}"
        else:
            return names
        raise CaseError(InputError("contact.between", message))

    @property
    def to_keep_apart(self) -> tuple[tuple[str, str], ...]:
        """Pairs of words of which the first must not begin as the second does: of each other's name and role."""
        first, second = self.punch, self.strip
        return (first, second), (second, first), (first, "strip"), (second, "punch")

    @property
    def by_roles(self) -> dict[str, str]:
        """The names by the roles."""
        return dict(zip(ROLES, (self.punch, self.strip), strict=True))

    @property
    def given(self) -> bool:
        """Whether a body has another name than its role."""
        return (self.punch, self.strip) != ROLES

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

    def key_by_roles(self, path: str) -> str:
        """Return the path of a key, of the case's names or of roles, with the roles."""
        table, *rest = path.split(".")
        if table in ("bodies", "wear") and rest and (role := self.role_of(rest[0])) in ROLES:
            return ".".join([*(["wear"] if table == "wear" else []), role, *rest[1:]])
        return path

    def with_names(self, text: str) -> str:
        """Return a text in which keys and words have the bodies' names in place of their roles; paths are left."""
        return _TOLD.sub(self._name, _KEY.sub(self._key, text)) if self.given else text

    def meant(self, attributes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the attributes of a variable whose long name names the bodies."""
        return {key: self.with_names(value) if key == "long_name" else value for key, value in attributes.items()}

    def telling(self, log: Callable[[str], None]) -> Callable[[str], None]:
        """Return a log whose messages have the bodies' names."""
        return (lambda message: log(self.with_names(message))) if self.given else log

    @contextmanager
    def names_in_errors(self) -> Iterator[None]:
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
            tables = {role: f"bodies.{name}" for role, name in self.by_roles.items()}
            named = CaseError(
                [
                    InputError(tables.get(p.key, self.with_names(p.key)), self.with_names(p.message))
                    for p in error.problems
                ]
            )
            error.problems, error.args = named.problems, named.args
        error.args = tuple(self.with_names(value) if isinstance(value, str) else value for value in error.args)

    def _key(self, match: re.Match[str]) -> str:
        return f"wear.{self.by_roles[match['law']]}" if match["wear"] else f"bodies.{self.by_roles[match['role']]}"

    def _name(self, match: re.Match[str]) -> str:
        role = match["group"] or match["word"]
        name = self.by_roles[role.lower()]
        return name if role.islower() else f"{name[:1].upper()}{name[1:]}"


BY_ROLE = Names()


def with_body_names(function: Callable[P, T]) -> Callable[P, T]:
    """Let the errors of a function have the names of the bodies of the case, or of the system, that it is given."""

    @wraps(function)
    def named(*args: P.args, **kwargs: P.kwargs) -> T:
        given = (getattr(getattr(argument, "case", argument), "names", None) for argument in (*args, *kwargs.values()))
        names = next((candidate for candidate in given if isinstance(candidate, Names)), BY_ROLE)
        with names.names_in_errors():
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
    tables: dict[Any, Any] = {}
    for key, value in data.items():
        if key == "on" and isinstance(value, str):
            tables[key] = change(value)
        elif key == "regions" and isinstance(value, Mapping):
            tables[key] = {change(name) if isinstance(name, str) else name: entry for name, entry in value.items()}
        else:
            tables[key] = renamed(value, change)
    return tables


def by_roles(data: Mapping[str, Any], base: Mapping[str, Any] = MappingProxyType({})) -> dict[str, Any]:
    """Return the tables of a case, or of a part of it, by the bodies' roles.

    Args:
        data: In the names of the bodies, or in their roles. A name in the table of a body, as older cases have it, is
            read, too.
        base: Tables of the case that they are laid over, whose names hold where they give none.

    Raises:
        CaseError: the names are none, or there is a table of a body that has none of them.
    """
    data = dict(data)
    older = {role: _table(data.get(role)).get("name", role) for role in ROLES}
    if tuple(older.values()) != ROLES:
        for role in ROLES:
            data[role] = {key: value for key, value in _table(data.get(role)).items() if key != "name"}
        data["contact"] = {"between": [*older.values()], "slides": older["strip"], **_table(data.get("contact"))}
    names = Names.of({"contact": {**_table(base.get("contact")), **_table(data.get("contact"))}})
    bodies = data.pop("bodies", {})
    if not isinstance(bodies, Mapping):
        raise CaseError(InputError("bodies", f"expected a table of each body, got {bodies!r}"))
    for name, body in bodies.items():
        role = names.role_of(name)
        if role not in ROLES:
            known = [*names.by_roles.values()] if names.given else []
            message = f"expected one of contact.between, {' or '.join(map(repr, known))}{did_you_mean(name, known)}"
            missing = InputError("contact.between", "missing; expected both names, such as ['bushing', 'shaft']")
            raise CaseError(InputError(f"bodies.{name}", message) if known else missing)
        if role in data:
            raise CaseError(InputError(role, f"expected in bodies.{name} alone"))
        data[role] = body
    if isinstance(data.get("wear"), Mapping):
        data["wear"] = {names.role_of(name): law for name, law in data["wear"].items()}
    return dict(renamed(data, names.by_role)) if names.given else data


def by_names(data: dict[str, Any], names: Names) -> dict[str, Any]:
    """Return the tables of a case, which are by roles, in the names of its bodies."""
    if not names.given:
        return data
    bodies = {name: data[role] for role, name in names.by_roles.items()}
    wear = {names.by_roles[role]: law for role, law in data["wear"].items()}
    rest = {key: value for key, value in data.items() if key not in ROLES}
    return dict(renamed({**rest, "bodies": bodies, "wear": wear}, names.by_name))


def _table(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}
