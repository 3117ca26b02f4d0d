"""Where FEniCSx keeps the forms that it compiles: without a folder for them nothing can be computed."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from pathlib import Path

from mpi4py import MPI

from fenwear.parallel import on_root

PLACE = "XDG_CACHE_HOME"


def ensure_folder(comm: MPI.Comm) -> str | None:
    """Make sure of a folder for compiled forms, a temporary one where the usual one cannot be had; collective.

    Before dolfinx is imported, which takes the folder from the environment.

    Returns:
        What is to be said of it; None where all is well.
    """
    text = on_root(comm, _problem)
    if text is None:
        return None
    folder = on_root(comm, lambda: tempfile.mkdtemp(prefix="fenwear-"))
    if comm.rank == 0:
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ[PLACE] = folder
    return f"{text}: forms are compiled in a temporary folder, and nothing is kept; {PLACE} chooses another one"


def _problem() -> str | None:
    folder = Path(os.environ.get(PLACE) or Path.home() / ".cache") / "fenics"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            return None
    except OSError as error:
        return f"{folder.parent} cannot be written ({error.strerror})"
