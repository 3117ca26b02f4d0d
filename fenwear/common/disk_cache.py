"""Results that take long to compute, kept on disk for the next start under a key of all their inputs.

Files are written under another name and then renamed, so that no other process sees a part of one. A file that cannot
be read is computed again. A file that cannot be written is mentioned once: it saves time and decides nothing.
"""

from __future__ import annotations

import hashlib
import os
import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from types import MappingProxyType
from typing import Any

import numpy as np
from mpi4py import MPI

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError

LIMIT = "FENWEAR_KEPT_GIB"  # environment variable: GiB of all files together; 0 keeps nothing
DEFAULT = 4.0
Arrays = Mapping[str, Array]
NONE: Arrays = MappingProxyType({})

_reported: list[str] = []


def folder() -> Path:
    """Return the folder of what is kept."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fenwear" / "kept"


def limit() -> int:
    """Return the number of bytes that all files together may have.

    Raises:
        CaseError: the environment variable is not a number of GiB.
    """
    text = os.environ.get(LIMIT, "")
    try:
        size = float(text or DEFAULT)
    except ValueError:
        size = -1.0
    if not 0 <= size < 1e9:
        raise CaseError(InputError(LIMIT, f"expected a number of GiB, 0 to keep nothing, got {text!r}"))
    return int(size * 2**30)


def files() -> list[tuple[Path, int]]:
    """Return the kept files and their sizes (bytes), the longest unused first."""
    dated = []
    for path in folder().glob("*.*"):
        with suppress(OSError):  # removed meanwhile
            dated.append((path.stat().st_mtime, path, path.stat().st_size))
    return [(path, size) for _, path, size in sorted(dated)]


def summary() -> dict[str, Any]:
    """Return the numbers of the cache for `fenwear info`.

    Raises:
        CaseError: the limit is no number.
    """
    sizes = [size for _, size in files()]
    numbers = {"folder": str(folder()), "files": len(sizes), "MiB": round(sum(sizes) / 2**20, 1)}
    return {**numbers, "limit_MiB": limit() / 2**20}


@cache
def _surroundings() -> str:
    """Return the surroundings that decide the last bits of results: versions of all parts, number of threads."""
    from fenwear.common.stack import versions

    sources = hashlib.blake2b(digest_size=20)
    package = Path(__file__).parents[1]
    for path in sorted(path for room in ("bodies", "heat") for path in (package / room).glob("*.py")):
        sources.update(path.read_bytes())
    threads = (os.environ.get("OMP_NUM_THREADS"), len(os.sched_getaffinity(0)))
    return f"{sorted(versions().items())} {sources.hexdigest()} {threads}"


def known(comm: MPI.Comm, parts: Callable[[], Iterable[object]], *, fresh: bool = False) -> Kept:
    """Return the kept results of these parts on these ranks; collective.

    Args:
        comm: The ranks.
        parts: Returns all of this rank that it follows from: arrays, or objects whose text is complete.
        fresh: Whether to take nothing that is kept.

    Raises:
        CaseError: the limit is no number.
    """
    if comm.bcast(limit()) == 0:
        return Kept(comm)
    digest = hashlib.blake2b(_surroundings().encode(), digest_size=20)
    for part in parts():
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode() + np.ascontiguousarray(part).tobytes())
        else:
            digest.update(f"|{part}|".encode())
    key = hashlib.blake2b("".join(comm.allgather(digest.hexdigest())).encode(), digest_size=20).hexdigest()
    path, arrays = folder() / f"{key}-{comm.rank}of{comm.size}.npz", dict[str, Array]()
    if not fresh:
        with suppress(OSError, ValueError, EOFError, zipfile.BadZipFile), np.load(path) as stored:  # absent, or broken
            arrays = dict(stored.items())
            os.utime(path)
    return Kept(comm, path, arrays if comm.allreduce(bool(arrays), op=MPI.LAND) else NONE)


@dataclass(frozen=True)
class Kept:
    """A place for this rank's arrays.

    Attributes:
        comm: The ranks.
        path: Of the file; None where nothing is kept.
        arrays: The kept results; none unless every rank has its own.
    """

    comm: MPI.Comm
    path: Path | None = None
    arrays: Arrays = NONE

    def save(self, arrays: Arrays) -> None:
        """Keep this rank's arrays, and let go what was unused longest; collective."""
        if self.path is None or self.comm.allreduce(sum(array.nbytes for array in arrays.values())) > limit():
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with NamedTemporaryFile(dir=self.path.parent, suffix=".tmp") as file:
                np.savez(file, **{name: np.asarray(array) for name, array in arrays.items()})  # type: ignore[arg-type]
                file.flush()
                os.link(file.name, part := self.path.with_suffix(f".{os.getpid()}"))
                part.replace(self.path)
        except OSError as error:
            if not _reported:
                _reported.append(str(error))
                text = f"set-ups are not kept in {folder()}: {error.strerror}; {LIMIT}=0 keeps none"
                print(f"fenwear: {text}", file=sys.stderr)
        kept = files()
        rest = sum(size for _, size in kept) - limit()
        for path, size in kept:
            if rest > 0:
                rest -= size
                path.unlink(missing_ok=True)


NOWHERE = Kept(MPI.COMM_SELF)
