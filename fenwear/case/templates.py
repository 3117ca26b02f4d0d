"""Commented cases of the usual tests: their text with the dimensions that the user gives in place of the usual ones.

A template is a file of two parts. The first names its dimensions, each with its usual value, its unit and its source;
the second, below a line +++, is the case file, in which jinja2 fills them in.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from fenwear.case.reading import builtin_cases, make_case
from fenwear.common.errors import CaseError, InputError, did_you_mean
from fenwear.common.units import convert

if TYPE_CHECKING:
    import jinja2

BETWEEN = "\n+++\n"
REMARK = re.compile(r"^([^#\n]*\S) {2,}(# .*)$", re.MULTILINE)  # behind a key, put in line with the others
COLUMN = 32


@dataclass(frozen=True)
class Dimension:
    """A number that a template asks for.

    Attributes:
        value: The usual one, as a case file has it; or how it follows from those above it, for jinja2.
        unit: It is converted to, and read in where it has none; "" for a pure number.
        about: Its description, and the key of its value.
    """

    value: str | float
    unit: str
    about: str


@dataclass(frozen=True)
class Template:
    """A commented case of a usual test.

    Attributes:
        name: Of the test, as after `fenwear new`.
        title: In a line.
        dimensions: By their names.
        text: Of the case file, with the dimensions to be filled in.
    """

    name: str
    title: str
    dimensions: Mapping[str, Dimension]
    text: str


def template_names() -> list[str]:
    """Return the names of the templates."""
    return sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml"))


def _folder() -> resources.abc.Traversable:
    return resources.files("fenwear") / "templates"


def find_template(name: str) -> Template:
    """Return the template of a name.

    Raises:
        CaseError: there is none; names the nearest.
    """
    names = template_names()
    if name in builtin_cases() and name not in names:
        start = f"{name!r} is a built-in case. Write a file with `base = {name!r}` and the keys to change"
        raise CaseError(InputError("new", f"{start}. Templates: {', '.join(names)}"))
    if name not in names:
        hint = did_you_mean(name, names, 0.5) or did_you_mean(name, [n for n in names if name and name in n], 0.0)
        raise CaseError(InputError("new", f"no template {name!r}. There are {', '.join(names)}{hint}"))
    head, _, text = (_folder() / f"{name}.toml").read_text("utf-8").partition(BETWEEN)
    table = tomllib.loads(head)
    template = {
        key: Dimension(entry["value"], entry.get("unit", "mm"), entry["about"])
        for key, entry in table["dimensions"].items()
    }
    return Template(name, table["title"], template, text.lstrip("\n"))


def fill_in(template: Template, settings: Sequence[str] = ()) -> str:
    """Return the text of the case file.

    Args:
        template: Of the test.
        settings: `dimension=value`, the value as in a case file.

    Raises:
        CaseError: a dimension that it does not have, or a value that is none; lists all.
    """
    given: dict[str, str | float] = {}
    problems = []
    for setting in settings:
        name, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or name not in template.dimensions:
            problems.append(InputError("--set", _unknown(template, setting)))
            continue
        try:
            given[name] = _checked(text.strip("\"'"), template.dimensions[name].unit)
        except ValueError as error:
            problems.append(InputError(f"--set {name}", str(error)))
    if problems:
        raise CaseError(problems)
    text = _environment().from_string(template.text).render(values(template, given))
    return REMARK.sub(lambda match: f"{match[1]:<{COLUMN - 2}}  {match[2]}", text)


def values(template: Template, given: Mapping[str, str | float] = MappingProxyType({})) -> dict[str, str | float]:
    """Return the values of all dimensions of a template: the given ones, and the usual ones of the rest."""
    filled: dict[str, str | float] = {}
    for name, dimension in template.dimensions.items():
        usual = (
            _environment().from_string(dimension.value).render(filled)
            if isinstance(dimension.value, str)
            else dimension.value
        )
        filled[name] = given.get(name, usual)
    return filled


@cache
def _environment() -> jinja2.Environment:
    import jinja2

    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False, keep_trailing_newline=True)
    environment.globals.update(
        pi=math.pi,
        number=convert,
        mm=lambda value: convert(value, "mm"),
        whole=lambda value: max(1, round(value)),
        g=lambda value: f"{value:.10g}",
    )
    return environment


def _checked(text: str, unit: str) -> str | float:
    """Return a value with its unit, or a pure number.

    Raises:
        ValueError: it is of another kind, or not positive; says what was expected.
    """
    number = convert(text, unit)
    if number <= 0:
        raise ValueError(f"expected more than zero, got {text!r}")
    if not unit:
        return round(number) if number == round(number) else number
    bare = text.replace("+", "").replace("-", "").replace(".", "").replace("e", "").replace("E", "").isdigit()
    return f"{text} {unit}" if bare else text


def _unknown(template: Template, setting: str) -> str:
    name, equals, _ = setting.partition("=")
    if not equals:
        return f"expected dimension=value, got {setting!r}"
    names = list(template.dimensions)
    hint = did_you_mean(name.strip(), names, 0.5)
    return f"{template.name} has no dimension {name.strip()!r}. It has {', '.join(names)}{hint}"


def all_text() -> str:
    """Return all templates with their titles, in lines."""
    return "\n".join(f"{name:18} {find_template(name).title}" for name in template_names())


def dimensions_text(name: str) -> str:
    """Return the dimensions of a template, their usual values and what they are, in lines.

    Raises:
        CaseError: there is no such template.
    """
    template = find_template(name)
    return "\n".join(f"{k:18} {v!s:>10}  {template.dimensions[k].about}" for k, v in values(template).items())


def write_case_of(name: str, path: Path, settings: Sequence[str] = ()) -> None:
    """Write the case file of a template.

    Args:
        name: Of the template.
        path: Of the new file.
        settings: `dimension=value`.

    Raises:
        CaseError: as `find_template` and `fill_in`; or the file exists, is no .toml or cannot be written.
    """
    if path.suffix != ".toml":
        raise CaseError(InputError("-o", f"expected a file ending in .toml, got {str(path)!r}"))
    text = fill_in(find_template(name), settings)
    make_case(tomllib.loads(text))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CaseError(InputError("-o", f"{path} exists. Name another file, or remove this one")) from None
    except OSError as error:
        raise CaseError(InputError("-o", f"{path} cannot be written: {error.strerror}")) from None
