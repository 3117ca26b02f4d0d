"""Start of the program, on one rank or many: exit statuses and errors.

0 success; 2 a wrong case or usage; 3 a solver that did not converge; 1 anything else.
PETSc gets the arguments after `--`.
"""

from __future__ import annotations

import os
import sys
import traceback
from typing import TYPE_CHECKING, Any, TextIO

from fenwear.common.errors import (
    CaseError,
    ConvergenceError,
    InterruptedRunError,
    OutputError,
    PartDoneError,
    StackError,
)
from fenwear.common.stack import check_numbers, importing

if TYPE_CHECKING:
    from mpi4py import MPI


def main() -> int:
    """Run the command line and return the exit status; every rank calls it."""
    os.environ.setdefault("HWLOC_HIDE_ERRORS", "2")  # silent where a container hides the processor's topology
    try:
        return _start(*_split(sys.argv[1:]))
    except StackError as error:
        print(f"fenwear: {error}", file=sys.stderr)
        return 1


class _Patient:
    """A stream whose reader may go away (head, less): what is written from then on is lost, and nothing ends by it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._lose()
            return len(text)

    def flush(self) -> None:
        """Write what is held back."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._lose()

    def _lose(self) -> None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _start(arguments: list[str], petsc_options: list[str]) -> int:
    with importing():
        import petsc4py
        from mpi4py import MPI  # before PETSc, which asks for no threads: a sweep on several ranks has one for messages

        petsc4py.init([sys.argv[0], "-no_signal_handler", *petsc_options])  # signals are ours, or the system's
    check_numbers()
    comm = MPI.COMM_WORLD
    if comm.rank != 0:  # what all ranks say, rank 0 says
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    else:
        sys.stdout, sys.stderr = _Patient(sys.stdout), _Patient(sys.stderr)  # type: ignore[assignment]
    from fenwear.common.stack import ensure_folder

    problem = ensure_folder(comm)
    if problem is not None:
        print(f"fenwear: {problem}", file=sys.stderr)
    status = _call(arguments, comm)
    # What mpirun returns is rank 0's: a rank that ended before it with another status than 0 would have all others
    # killed, what rank 0 has written among what is lost.
    return status if comm.rank == 0 else 0


def _split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Return the arguments before and behind `--`."""
    at = arguments.index("--") if "--" in arguments else len(arguments)
    return arguments[:at], arguments[at + 1 :]


def _call(arguments: list[str], comm: MPI.Comm) -> int:
    from fenwear.cli import UsageError, app, typer, with_names
    from fenwear.cli.application import check_removed
    from fenwear.common.signals import ignore_from_now_on

    try:
        check_removed(arguments)
        with importing():  # commands import what they need
            result = app(args=arguments, prog_name="fenwear", standalone_mode=False)
        return int(result) if isinstance(result, int) else 0
    except UsageError as error:
        error.show(file=sys.stderr)
        return 2
    except CaseError as error:
        for problem in with_names(str(error)).splitlines():
            print(f"fenwear: {problem}", file=sys.stderr)
        return 2
    except ConvergenceError as error:
        print(f"fenwear: {with_names(str(error))}", file=sys.stderr)
        return 3
    except (InterruptedRunError, OutputError, PartDoneError, StackError) as error:
        print(f"fenwear: {error}", file=sys.stderr)
        if isinstance(error, InterruptedRunError):
            ignore_from_now_on()
        return 0 if isinstance(error, PartDoneError) else 1
    except (typer.Abort, KeyboardInterrupt):
        print("fenwear: interrupted", file=sys.stderr)
    except Exception:
        traceback.print_exc(file=sys.__stderr__)
    # Another rank may wait in a collective call for this one: end them all.
    if comm.size > 1:
        sys.stderr.flush()
        comm.Abort(1)
    return 1


if __name__ == "__main__":
    sys.exit(main())
