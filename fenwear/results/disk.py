"""Writing files so that no fault of the disk costs more than the file at hand, and every fault is told.

HDF5 and ADIOS2 do not survive a write that fails: what they have open then crashes the process.
So room is claimed before they begin, and a file that is replaced stays whole until its successor is.
"""

from __future__ import annotations

import errno
import math
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI

from fenwear.errors import OutputError


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say of an error inside which file it is about.

    Raises:
        OutputError: an OSError, or a RuntimeError of HDF5 or ADIOS2, in these words.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise OutputError(path, _reason(error)) from error


@contextmanager
def writing_together(comm: MPI.Comm, path: Path) -> Iterator[None]:
    """As `writing`, where all ranks write by a library: one that fails ends all, as they may wait for it."""
    try:
        with writing(path):
            yield
    except OutputError as error:
        if comm.size > 1:
            print(f"fenwear: {error}", file=sys.__stderr__, flush=True)
            comm.Abort(1)
        raise


def _reason(error: OSError | RuntimeError) -> str:
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return "it or its folder has been removed"
    if number:  # h5py puts a page of its own into the text
        return os.strerror(number)
    return next(iter(str(error).splitlines()), type(error).__name__)


def finite(data: Any) -> Any:
    """Return tables and lists for JSON: numbers that are not finite are None."""
    if isinstance(data, Mapping):
        return {key: finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def write_text(path: Path, text: str) -> None:
    """Write a text file that takes the place of an older one as a whole.

    Raises:
        OutputError: it cannot be written; the older one stays.
    """
    part = path.with_name(f"{path.name}.part")
    with writing(path):
        try:
            part.write_text(text, "utf-8")
            part.replace(path)
        except OSError:
            part.unlink(missing_ok=True)
            raise


def check_room(folder: Path, size: int) -> None:
    """Check that a folder can take `size` bytes more.

    Raises:
        OutputError: it cannot.
    """
    with writing(folder), tempfile.TemporaryFile(dir=folder) as file:
        os.posix_fallocate(file.fileno(), 0, size)


def claim(path: Path, size: int) -> None:
    """Make a file that many bytes longer, on the disk: writing there cannot fail for lack of room.

    Raises:
        OSError: there is no room.
    """
    with path.open("ab") as file:
        os.posix_fallocate(file.fileno(), file.tell(), size)
