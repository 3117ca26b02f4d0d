"""What pages take from the code as they are made, so that they say what it does: keys, commands, results, cases."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from docutils import nodes
from executed import code_key
from pydantic import BaseModel
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from fenwear.bodies.ready_geometries import ready_geometries
from fenwear.case import builtin_cases
from fenwear.case.keys import Key, all_keys
from fenwear.cli import app as command_line
from fenwear.results import layer_results, registry, roughness, sheet, time_steps
from fenwear_verify.suite import registered
from fenwear_verify.validation import Experiment, experiments
from fenwear_verify.validation.command import draw, markdown


class Written(SphinxDirective):
    """A directive whose content is written here, as Markdown; what the page has in it tells where else to find that."""

    has_content = True
    required_arguments = 0
    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return what the Markdown makes."""
        made = self.parse_text_to_nodes("\n".join(self.lines()))
        for table in (table for node in made for table in node.findall(nodes.table)):
            table["classes"].append("from-code")
        return made

    def lines(self) -> Iterable[str]:
        """Return the lines of Markdown."""
        raise NotImplementedError


def _code(text: str) -> str:
    return f"`{text}`" if text else ""


def _plain(text: str) -> str:
    """Return a text as Markdown shows it."""
    return re.sub(r"([\\`*_\[\]<>|~$])", r"\\\1", text)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return ["", *("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)), ""]


class Keys(Written):
    """The keys below a table of the case file; without a table those at its top."""

    def lines(self) -> Iterable[str]:
        """Return a table for each kind."""
        table = self.arguments[0] if self.arguments else ""
        below = [key for key in all_keys() if not key.table and self._inside(key.path, table)]
        for kind in dict.fromkeys(key.kind for key in below):
            if kind:
                yield f'\n**kind = "{kind}"**\n'
            yield from _table(
                ("key", "takes", "default", "meaning"),
                (self._cells(key, table) for key in below if key.kind == kind),
            )

    @staticmethod
    def _inside(path: str, table: str) -> bool:
        return path.startswith(f"{table}.") if table else "." not in path

    @staticmethod
    def _cells(key: Key, table: str) -> tuple[str, ...]:
        default = key.default if key.default in ("", "required") else _code(key.default)
        name = key.path.removeprefix(f"{table}.")
        takes = f"{key.values} ({key.unit})" if key.unit else key.values
        return (_code(name), _plain(takes), default, _plain(key.meaning))


def _value(option: Any) -> str:
    """Return what an option of the command line takes, in a word."""
    return "" if option.is_flag else str(option.metavar or option.type.name.upper())


class Commands(Written):
    """Every command with its arguments and options."""

    def lines(self) -> Iterable[str]:
        """Return a section's worth for each command."""
        group: Any = typer.main.get_command(command_line)
        for name, command in sorted(group.commands.items()):
            usage = " ".join(p.make_metavar() for p in command.params if p.param_type_name == "argument")
            yield f"\n**`fenwear {name} {usage}`**".replace(" `**", "`**") + f"\n\n{_plain(command.help or '')}\n"
            rows = [
                (
                    ", ".join(_code(f"{o} {_value(p)}".strip()) for o in (*p.opts, *p.secondary_opts)),
                    _plain(p.help or ""),
                )
                for p in command.params
                if p.param_type_name == "option" and p.name != "help"
            ]
            if rows:
                yield from _table(("option", "does"), rows)


class Results(Written):
    """The variables of history.nc."""

    def lines(self) -> Iterable[str]:
        """Return a table of each group."""
        plane = registry.on_surfaces([*registry.IN_RUN, *registry.OF_STRIP])
        others = [one for one in plane if one.name in registry.ON_SURFACES]
        groups: dict[str, Any] = {
            "In every run": registry.IN_RUN,
            "The sheet; names of the strip's variables end in _strip": (
                *sheet.SLIDING,
                *sheet.TURNING,
                *sheet.of_a_plane_body("punch"),
                *sheet.of_a_body("punch"),
                *sheet.of_the_scar("punch", ("x",), ("length", "width")),
            ),
            "With wear of the strip": registry.OF_STRIP,
            "With a program": registry.OF_PROGRAM,
            "With heat": registry.OF_HEAT,
            "With heat.track": registry.OF_TRACK,
            "Solids and rings, in place of the plane variables": others,
            "Coatings; names of the strip's variables end in _strip": layer_results.of_coated("punch"),
            "Creep; names of the strip's variables end in _strip": layer_results.of_creeping("punch"),
            "Cycles as tables, in solids": time_steps.OF_TABLE,
            "Rough surfaces; names of the strip's variables end in _strip": roughness.of_body("punch"),
            "With contact.law = coulomb": time_steps.IN_STEPS,
            "With contact.law = coulomb and heat": time_steps.OF_HEAT,
            "With contact.law = coulomb in solids, further or in place of these": time_steps.of_solids(),
        }
        for title, variables in groups.items():
            yield f"\n**{title}**\n"
            yield from _table(
                ("variable", "over", "unit", "meaning"),
                ((_code(one.name), ", ".join(one.dims), one.unit, _plain(one.long_name)) for one in variables),
            )


class Cases(Written):
    """The built-in cases."""

    def lines(self) -> Iterable[str]:
        """Return one table."""
        return _table(("name", "title"), ((_code(n), _plain(t)) for n, t in builtin_cases().items()))


class Geometries(Written):
    """The ready geometries with their parameters."""

    def lines(self) -> Iterable[str]:
        """Return a table for each geometry."""
        for geometry in ready_geometries().values():
            yield f"\n**`{geometry.name}`**: {_plain(geometry.about)}\n"
            if geometry.parameters:
                rows = ((_code(name), value, _plain(meaning)) for name, value, meaning in geometry.parameters)
                yield from _table(("parameter", "default", "meaning"), rows)


class Combinations(Written):
    """What goes with what, from the list that a test walks."""

    def lines(self) -> Iterable[str]:
        """Return one table, and the reasons of its closed cells below it."""
        listed = import_module("combinations")
        reasons: list[str] = []

        def cell(feature: str, law: str, way: str) -> str:
            reason = listed.closed(feature, law, way)
            if reason and reason not in reasons:
                reasons.append(reason)
            return f"{reasons.index(reason) + 1}" if reason else "✓"

        rows = [
            [f"{_plain(feature)}; {law}", *(cell(feature, law, way) for way in listed.WAYS)]
            for feature in listed.FEATURES
            for law in listed.LAWS
        ]
        yield from _table(("", *listed.WAYS), rows)
        yield from (f"{number}. {_plain(reason)}" for number, reason in enumerate(reasons, 1))


class Refusals(Written):
    """Combinations that are rejected, from the list of inputs that a test gives to the program."""

    def lines(self) -> Iterable[str]:
        """Return a list for each kind of reason."""
        listed = import_module("refusals")
        for kind, reasons in listed.reasons().items():
            yield f"\n**{listed.KINDS[kind]}**\n"
            yield from (f"- {reason}" for reason in reasons)


class Verification(Written):
    """The problems that `fenwear verify` solves."""

    def lines(self) -> Iterable[str]:
        """Return one table."""
        rows = ((_code(c.name), _plain(c.title), _plain(c.source)) for c in registered())
        return _table(("name", "problem", "reference"), rows)


class Experiments(Written):
    """The measured experiments, with their one number each."""

    def lines(self) -> Iterable[str]:
        """Return one table."""
        rows = ((f"[{one.title}]({one.name}.md)", _finding(one, self.env)["number"]) for one in experiments())
        return _table(("experiment", "how far fenwear is from it"), rows)


class Measured(Written):
    """A measured experiment beside its prediction, whose error (%) the page states to 1 %."""

    required_arguments = 2
    optional_arguments = 0

    def lines(self) -> Iterable[str]:
        """Return its text, figure and tables.

        Raises:
            ExtensionError: the error is not what the page states.
        """
        name, stated = self.arguments
        (one,) = experiments([name])
        finding = _finding(one, self.env)
        if abs(abs(finding["percent"]) - float(stated)) > 1:
            raise ExtensionError(f"{name}: the error is {finding['percent']:.1f} %, the page states {stated} %")
        return finding["lines"]


def _finding(one: Experiment, env: Any) -> dict[str, Any]:
    """Return what an experiment comes to on coarse meshes: kept beside its figure until the code changes."""
    folder = Path(env.srcdir) / "validation" / "made"
    kept, key = folder / f"{one.name}.json", code_key()
    if kept.is_file() and (found := json.loads(kept.read_text("utf-8")))["key"] == key:
        return dict(found)
    finding = one.compute("short")
    folder.mkdir(exist_ok=True)
    (folder / f"{one.name}.png").write_bytes(draw(finding))
    lines = [*markdown(one, finding, f"made/{one.name}.png")]
    made = {"key": key, "number": finding.number, "percent": finding.percent, "lines": lines}
    kept.write_text(json.dumps(made), "utf-8")
    return made


def _as_written(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Make a docstring, which is plain text, the reStructuredText that shows it as it is written."""
    found: list[str] = []
    formula = 0  # indentation of a block that stands by itself
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if formula and line.strip() and indent < formula:
            formula = 0
        if not formula and line.strip() and indent > _indentation(found) and found and not found[-1].strip():
            formula = indent
            found += [" " * _indentation(found) + "::", ""]
        if formula:
            found.append(line)
            continue
        text = re.sub(r"``?([^`]+)``?", r"``\1``", line)
        parts = re.split(r"(``[^`]+``)", text)
        parts[::2] = [re.sub(r"([*|\\]|_(?![A-Za-z0-9]))", r"\\\1", part) for part in parts[::2]]
        found.append("".join(parts))
    lines[:] = found


def _is_case(thing: object) -> bool:
    return isinstance(thing, type) and issubclass(thing, BaseModel)


def _short(app: Any, what: str, name: str, thing: object, options: object, signature: str, result: str) -> Any:
    """Leave out the signatures of the tables of a case: the page of its keys has them."""
    return ("", None) if _is_case(thing) else None


def _leave_out(app: Any, what: str, name: str, thing: object, skip: bool, options: object) -> bool | None:
    """Leave out what pydantic adds."""
    return True if name.startswith("model_") else None


def _indentation(lines: list[str]) -> int:
    last = next((line for line in reversed(lines) if line.strip()), "")
    return len(last) - len(last.lstrip())


def setup(app: Any) -> dict[str, bool]:
    """Name the directives."""
    for name, directive in (
        ("keys", Keys),
        ("commands", Commands),
        ("results", Results),
        ("cases", Cases),
        ("combinations", Combinations),
        ("refusals", Refusals),
        ("geometries", Geometries),
        ("verification", Verification),
        ("experiment", Measured),
        ("experiments", Experiments),
    ):
        app.add_directive(name, directive)
    app.connect("autodoc-process-docstring", _as_written, priority=400)
    app.connect("autodoc-process-signature", _short)
    app.connect("autodoc-skip-member", _leave_out)
    return {"parallel_read_safe": True}
