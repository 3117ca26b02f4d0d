"""Common parts of all commands: the application, its common options, reading a case, printing, and what was removed."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ClassVar, TextIO

import typer
from mpi4py import MPI

from fenwear.case import Case, load_case
from fenwear.case.body_names import BY_ROLE
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root

app = typer.Typer(
    help="Thermo-mechanical sliding wear with FEniCSx. Without a command: runs the built-in Example 1.",
    pretty_exceptions_enable=False,
    no_args_is_help=False,
    rich_markup_mode=None,
)

# Base of the errors that print themselves: of click, which newer versions of typer have within themselves.
UsageError: type[Any] = next(kind for kind in reversed(typer.BadParameter.__mro__) if hasattr(kind, "show"))

DEFAULT_CASE = "example1-heat"

# What the shell suggests for the words of a command.


def suggested_cases(incomplete: str) -> list[str]:
    """Return the built-in cases that begin so; files are the shell's own to suggest."""
    from fenwear.case import builtin_cases

    return [name for name in builtin_cases() if name.startswith(incomplete)]


def suggested_keys(incomplete: str) -> list[str]:
    """Return the keys and tables of the case file that begin so."""
    return sorted({path for path, _ in _paths() if path.startswith(incomplete)})


def suggested_settings(incomplete: str) -> list[str]:
    """Return the keys that begin so, each ready for its value."""
    return sorted({f"{path}=" for path, value in _paths() if value and path.startswith(incomplete)})


def suggested_tests(incomplete: str) -> list[str]:
    """Return the usual tests that begin so."""
    from fenwear.case.templates import template_names

    return [name for name in template_names() if name.startswith(incomplete)]


def _paths() -> Iterator[tuple[str, bool]]:
    """Yield every path, for both bodies, and whether it takes a value, as some tables do in place of their keys."""
    from fenwear.case.keys import all_keys

    for key in all_keys():
        for body in ("punch", "strip"):
            yield key.path.replace("BODY", body), not key.table or key.values.startswith("number")


CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE",
        help="A case file (TOML) or the name of a built-in case.",
        autocompletion=suggested_cases,
    ),
]
SetOption = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Override a key: --set motion.amplitude="2 mm"; remove a key: --set unset=heat.inflow',
        autocompletion=suggested_settings,
    ),
]
FreshOption = Annotated[bool, typer.Option("--fresh", help="Ignore the set-ups that earlier runs have kept on disk.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Remove the results in the folder of -o first.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]


class _Spoken:
    """Names of the bodies in the case that a command has read: all that it prints for people has these names."""

    names = BY_ROLE
    record: ClassVar[list[str] | None] = None  # what is logged, where a command gives it as JSON


@contextmanager
def recorded() -> Iterator[list[str]]:
    """Keep what is logged within a block."""
    _Spoken.record = []
    try:
        yield _Spoken.record
    finally:
        _Spoken.record = None


def with_names(text: str) -> str:
    """Return a text with the names of the bodies."""
    return _Spoken.names.with_names(text)


def log(message: str) -> None:
    """Print to standard error; every rank but 0 has it closed."""
    if _Spoken.record is not None:
        _Spoken.record.append(with_names(message))
    _write(sys.stderr, with_names(message))


def show(text: str) -> None:
    """Print what was asked for to standard output."""
    _write(sys.stdout, with_names(text))


def _write(stream: TextIO, text: str) -> None:
    """Write text and the end of its line at once: mpirun may exchange what it gets one after the other."""
    stream.write(f"{text}\n")
    stream.flush()


def load(case: str, settings: list[str]) -> Case:
    """Return a case that rank 0 has read, on every rank."""
    loaded = on_root(MPI.COMM_WORLD, lambda: (c := load_case(case, settings), c.folder))
    _Spoken.names = loaded[0].names
    return loaded[0].at(loaded[1])


def clear(output: Path | None, *, resume: bool) -> None:
    """Remove the results in a folder; collective.

    Raises:
        CaseError: no folder is named, it is to be resumed, or it holds other files.
    """
    from fenwear.results.history import clear_directory

    if output is None or resume:
        raise CaseError(InputError("--overwrite", "expected the folder to overwrite, as -o DIR, and no --resume"))
    on_root(MPI.COMM_WORLD, lambda: clear_directory(output))


def show_results(results: str | dict[str, Any], where: str) -> None:
    """Print what was asked for, a text or a JSON object, and say to standard error where the rest is.

    On several ranks that comes first: mpirun takes the begin of a long line, of which it has not had the end when
    something else is said, for that one's, and puts it there.
    """
    first = MPI.COMM_WORLD.size > 1
    if first:
        log(where)
    if isinstance(results, str):
        show(results)
    else:
        print_json(results)
    if not first:
        log(where)


def answer(data: dict[str, Any], text: Callable[[], str], *, as_json: bool) -> None:
    """Print what was asked for: as one JSON object, or its text."""
    if as_json:
        print_json(data)
    else:
        show(text())


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object in a line; numbers that are not finite are null."""
    from fenwear.results.disk import finite

    _write(sys.stdout, json.dumps(finite(data)))


def print_case(case: Case) -> None:
    """Print a case with all defaults, as a case file."""
    _write(sys.stdout, case.to_toml())


REMOVED = {
    "--posterior": "removed. Sample the posterior with emcee: docs/how-to/calibrate.md has the recipe",
    "--sobol": "removed. Compute Sobol indices with SALib: docs/how-to/calibrate.md has the recipe",
    "--jumped": "removed. Run the case twice, with --set run.integration=implicit and =jump, then compare both folders",
    "serve": "removed. Offer the model with the package umbridge: docs/how-to/other-programs.md has the script",
}


def check_removed(arguments: Sequence[str]) -> None:
    """Check that a command line has nothing that was removed.

    Raises:
        CaseError: names it, and what takes its place.
    """
    words = [word.partition("=")[0] for word in arguments]
    removed = [word for at, word in enumerate(words) if word in REMOVED and (at == 0 or word.startswith("-"))]
    if removed:
        raise CaseError([InputError(word, REMOVED[word]) for word in removed])
