"""Start of the program, on one rank or many: exit statuses and errors.

0 success; 2 a wrong case or usage; 3 a solver that did not converge; 1 anything else.
What follows `--` on the command line goes to PETSc.
"""

from __future__ import annotations

import os
import sys
import traceback
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI


def main() -> int:
    """Run the command line and return the exit status; every rank calls it."""
    os.environ.setdefault("HWLOC_HIDE_ERRORS", "2")  # silent where a container hides the processor's topology
    arguments, petsc_options = _split(sys.argv[1:])
    import numpy as np
    import petsc4py
    from mpi4py import MPI  # before PETSc, which asks for no threads: a sweep on several ranks has one for its messages

    petsc4py.init([sys.argv[0], "-no_signal_handler", *petsc_options])  # signals are ours, or the system's
    from petsc4py import PETSc

    comm = MPI.COMM_WORLD
    if comm.rank != 0:  # what all ranks say, rank 0 says
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if np.dtype(PETSc.ScalarType).kind == "c":
        print("fenwear needs PETSc with real numbers: on Debian install python3-dolfinx-real", file=sys.stderr)
        return 1
    from fenwear.compiled import ensure_folder

    told = ensure_folder(comm)
    if told is not None:
        print(f"fenwear: {told}", file=sys.stderr)
    return _call(arguments, comm)


def _split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Return what stands before and behind `--`."""
    at = arguments.index("--") if "--" in arguments else len(arguments)
    return arguments[:at], arguments[at + 1 :]


def _call(arguments: list[str], comm: MPI.Comm) -> int:
    import click

    from fenwear.cli import app
    from fenwear.errors import CaseError, ConvergenceError, InterruptedRunError, OutputError
    from fenwear.signals import ignore_from_now_on

    try:
        result = app(args=arguments, prog_name="fenwear", standalone_mode=False)
        return int(result) if isinstance(result, int) else 0
    except click.ClickException as error:
        error.show(file=sys.stderr)
        return 2
    except CaseError as error:
        for problem in str(error).splitlines():
            print(f"fenwear: {problem}", file=sys.stderr)
        return 2
    except ConvergenceError as error:
        print(f"fenwear: {error}", file=sys.stderr)
        return 3
    except (InterruptedRunError, OutputError) as error:
        print(f"fenwear: {error}", file=sys.stderr)
        if isinstance(error, InterruptedRunError):
            ignore_from_now_on()
        return 1
    except (click.Abort, KeyboardInterrupt):
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
