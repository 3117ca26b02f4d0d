"""Commands about the program: its versions, cases and keys."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from mpi4py import MPI

from fenwear.case import builtin_cases
from fenwear.cli.application import JsonOption, answer, app, print_json, suggested_keys
from fenwear.common.parallel import on_root


@app.command("info")
def info_command(
    key: Annotated[
        str,
        typer.Argument(
            metavar="KEY",
            help="Explain this key or table of the case file, this built-in case, or this ready geometry: "
            "bushing.geo; or list what a file has: a mesh, a shape from CAD, a table, a height map.",
            autocompletion=suggested_keys,
            show_default=False,
        ),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Print the versions of the stack and the built-in cases; explain a key of cases; or list the content of a file."""
    from fenwear.bodies.ready_geometries import ready_geometries
    from fenwear.case.keys import find_keys
    from fenwear.common import disk_cache
    from fenwear.common.stack import versions

    geometries = ready_geometries()
    if key in geometries:
        answer({"geometry": asdict(geometries[key])}, geometries[key].text, as_json=as_json)
    elif key in builtin_cases():
        title = builtin_cases()[key]
        hint = f"fenwear check {key} --full prints its keys; `base = {key!r}` in a file starts from them"
        answer({"case": key, "title": title}, lambda: f"{key}: {title}\n    built-in case; {hint}", as_json=as_json)
    elif Path(key).is_file() or "/" in key:
        from fenwear.files.formats import listed_file

        text, content = on_root(MPI.COMM_WORLD, lambda: listed_file(Path(key)))
        answer(content, lambda: text, as_json=as_json)
    elif key:
        keys = find_keys(key)
        texts = [k.text() for k in keys]
        if key == "geometry.file":
            texts.append("ready ones (fenwear info NAME lists their parameters):")
            texts += [f"  {name:22} {geometry.title}" for name, geometry in geometries.items()]
        answer({"keys": [asdict(k) for k in keys]}, lambda: "\n".join(texts), as_json=as_json)
    else:
        stack = {"versions": versions(), "cases": builtin_cases(), "kept": disk_cache.summary()}
        answer(stack, lambda: _stack_text(**stack), as_json=as_json)


def _stack_text(versions: dict[str, str], cases: dict[str, str], kept: dict[str, Any]) -> str:
    """Return the versions of the stack, the kept set-ups and the built-in cases for people."""
    return "\n".join(
        (
            *(f"{name:14} {version}" for name, version in versions.items()),
            f"\nkept set-ups: {kept['files']} files, {kept['MiB']:g} of {kept['limit_MiB']:g} MiB in {kept['folder']}",
            "\nbuilt-in cases:",
            *(f"  {name:26} {title}" for name, title in cases.items()),
        )
    )


@app.command("schema")
def schema_command() -> None:
    """Print the JSON schema of case files, by which editors complete and check them."""
    from fenwear.case.keys import json_schema

    print_json(json_schema())
