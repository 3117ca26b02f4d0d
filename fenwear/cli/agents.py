"""A server of the Model Context Protocol: other programs check, run and look at cases by it.

Each tool is a command of fenwear in a process of its own with --json, so that its errors are those of the command line,
by key, and nothing that a solver prints comes between the messages. Only this machine is served: by standard input and
output, or by a port of the loopback device.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Awaitable, Callable, Sequence
from functools import wraps
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from fenwear.cli.application import app
from fenwear.common.errors import StackError

Tool = Callable[..., Awaitable[str]]
LOOPBACK = "127.0.0.1"
INSTRUCTIONS = (
    "fenwear computes thermo-mechanical sliding wear of two bodies. A case is a TOML file. Give its path, the name of "
    "a built-in case, or its text with absolute paths of files. The tool info without a subject lists built-in cases. "
    "Settings are overrides KEY=VALUE with units, such as motion.amplitude=2 mm. Check a case before you run it. "
    "Errors name the key of the case that is wrong; `info KEY` explains it."
)


@app.command("mcp")
def mcp_command(
    port: Annotated[
        int | None,
        typer.Option(
            min=1, max=65535, help="Serve this port of the loopback device; by default standard input and output."
        ),
    ] = None,
) -> None:
    """Serve check, run, steady, shape, life, info and figures to other programs by the Model Context Protocol."""
    server = make_server()
    if port is None:
        server.run("stdio")
    else:
        server.run("streamable-http", host=LOOPBACK, port=port)


def make_server() -> Any:
    """Return the server with its tools.

    Raises:
        StackError: the package mcp is missing.
    """
    try:
        from mcp.server import MCPServer
        from mcp.server.mcpserver.exceptions import ToolError
    except ImportError:
        raise StackError("needs the package mcp: pip install 'fenwear[agents]'") from None
    import fenwear

    server = MCPServer("fenwear", instructions=INSTRUCTIONS, version=fenwear.__version__)
    for tool in (check, run, steady, shape, life, info, figures):
        server.tool(structured_output=False)(_failing_by(ToolError, tool))
    return server


def _failing_by(kind: type[Exception], tool: Tool) -> Tool:
    """Return a tool whose error is of the kind that the server passes on in words."""

    @wraps(tool)
    async def called(*arguments: Any, **keys: Any) -> str:
        try:
            return await tool(*arguments, **keys)
        except ValueError as error:
            raise kind(str(error)) from None

    return called


async def check(case: str, settings: Sequence[str] = ()) -> str:
    """Validate a case with its geometry: warnings, size, and what moves freely; or errors by key."""
    return await _of_case(["check"], case, settings)


async def run(case: str, output: str, settings: Sequence[str] = (), overwrite: bool = False) -> str:
    """Run a case into a new folder: the summary with worn volume, largest depth, pressure and their uncertainty."""
    return await _of_case(["run", "-q", "-o", output, *(["--overwrite"] if overwrite else [])], case, settings)


async def steady(case: str, settings: Sequence[str] = ()) -> str:
    """Compute the cyclic steady state of a case directly, without the way there."""
    return await _of_case(["steady"], case, settings)


async def shape(case: str, output: str, settings: Sequence[str] = ()) -> str:
    """Compute the initial shape that needs no running in, into a new folder."""
    return await _of_case(["shape", "-o", output], case, settings)


async def life(case: str, until: str, output: str, scatter: Sequence[str] = (), settings: Sequence[str] = ()) -> str:
    """Compute the life until a level ("depth 0.2 mm"), with scattering keys ("contact.friction=normal(0.25, 8 %)")."""
    scatters = [word for text in scatter for word in ("--scatter", text)]
    return await _of_case(["life", "--until", until, "-o", output, *scatters], case, settings)


async def info(subject: str = "") -> str:
    """Explain a key of cases (wear.punch), list what a file has (part.step, data.csv), or list built-in cases."""
    return await _called(["info", *([subject] if subject else []), "--json"])


async def figures(folder: str) -> str:
    """Draw the figures and the report of a run into its folder, and return their paths."""
    return await _called(["plot", folder])


async def _of_case(command: Sequence[str], case: str, settings: Sequence[str]) -> str:
    """Return what a command prints of a case, which is a path, a name, or the text of a file."""
    options = [word for text in settings for word in ("--set", text)]
    if "\n" not in case and "=" not in case:
        return await _called([command[0], case, *command[1:], *options, "--json"])
    with TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(case, "utf-8")
        return await _called([command[0], str(path), *command[1:], *options, "--json"])


async def _called(arguments: Sequence[str]) -> str:
    """Return what a command prints.

    Raises:
        ValueError: it failed; says what it says, errors by key.
    """
    import asyncio  # which no other command needs

    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "fenwear", *arguments, stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    try:
        printed, said = await process.communicate()
    except asyncio.CancelledError:
        process.terminate()
        raise
    if process.returncode:
        lines = [line for line in said.decode("utf-8", "replace").splitlines() if line.startswith("fenwear: ")]
        errors = [line.removeprefix("fenwear: ") for line in lines] or said.decode("utf-8", "replace").splitlines()[-3:]
        raise ValueError(json.dumps({"status": process.returncode, "errors": errors}))
    return printed.decode("utf-8")
