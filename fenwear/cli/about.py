"""Commands that tell about the program: its versions, cases and keys."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from fenwear.case import builtin_cases
from fenwear.cli import suggestions
from fenwear.cli.base import JsonOption, app, print_json, show
from fenwear.parallel import on_root


@app.command("info")
def info_command(
    key: Annotated[
        str,
        typer.Argument(
            metavar="KEY",
            help="Explain this key of the case file, this table, or this ready geometry: bushing.geo; or list what a "
            "file has: a mesh, a shape from CAD, a table, a height map.",
            autocompletion=suggestions.keys,
            show_default=False,
        ),
    ] = "",
    as_json: JsonOption = False,
) -> None:
    """Print the versions of the stack and the built-in cases; explain a key of cases; or list the content of a file."""
    from fenwear.bodies import kept
    from fenwear.bodies.ready import ready_geometries
    from fenwear.case.keys import find_keys
    from fenwear.stack import versions

    geometries = ready_geometries()
    if key in geometries:
        if as_json:
            print_json({"geometry": asdict(geometries[key])})
        else:
            show(geometries[key].text())
        return
    if key and (Path(key).is_file() or "/" in key):
        _list_file(Path(key), as_json=as_json)
        return
    if key:
        found = find_keys(key)
        if as_json:
            print_json({"keys": [asdict(k) for k in found]})
        else:
            show("\n".join(k.text() for k in found))
            if key == "geometry.file":
                ready = (f"  {name:22} {geometry.title}" for name, geometry in geometries.items())
                show("\n".join(("ready ones (fenwear info NAME lists their parameters):", *ready)))
        return
    if as_json:
        print_json({"versions": versions(), "cases": builtin_cases(), "kept": kept.summary()})
        return
    for name, version in versions().items():
        show(f"{name:14} {version}")
    state = kept.summary()
    show(f"\nkept set-ups: {state['files']} files, {state['MiB']:g} of {state['limit_MiB']:g} MiB in {state['folder']}")
    show("\nbuilt-in cases:")
    for name, title in builtin_cases().items():
        show(f"  {name:26} {title}")


def _list_file(path: Path, *, as_json: bool) -> None:
    """Print what a file of another program has."""
    from fenwear.files.formats import listed_file

    text, content = on_root(MPI.COMM_WORLD, lambda: listed_file(path))
    if as_json:
        print_json(content)
    else:
        show(text)


@app.command("schema")
def schema_command() -> None:
    """Print the JSON schema of case files, by which editors complete and check them."""
    from fenwear.case.keys import json_schema

    print_json(json_schema())
