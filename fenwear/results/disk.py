"""Writing files so that no fault of the disk costs more than the file at hand, and every fault is reported.

HDF5 and ADIOS2 do not survive a write that fails: what they have open then crashes the process.
So room is claimed before they begin, and a file that is replaced stays whole until its successor is.
"""

from __future__ import annotations

import errno
import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

from fenwear.common.errors import OutputError


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
def replacing(path: Path, *, shared: bool = False) -> Iterator[Path]:
    """Give the path of a new file, which takes the place of an older one as a whole.

    Args:
        path: Of the file.
        shared: Whether other processes may write it at the same time.

    Raises:
        OutputError: it cannot be written; the older one stays.
    """
    part = path.with_name(f"{path.name}.{uuid4().hex}.part" if shared else f"{path.name}.part")
    with writing(path):
        try:
            part.unlink(missing_ok=True)  # a killed run may have left half of one
            yield part
            part.replace(path)
        except (OSError, RuntimeError):
            part.unlink(missing_ok=True)
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
    with replacing(path, shared=True) as part:
        part.write_text(text, "utf-8")


def check_room(folder: Path, size: int) -> None:
    """Check that a folder can take `size` bytes more.

    Raises:
        OutputError: it cannot.
    """
    with writing(folder), tempfile.TemporaryFile(dir=folder) as file:
        os.posix_fallocate(file.fileno(), 0, size)
