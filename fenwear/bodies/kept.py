"""What takes long to compute, kept on disk under a key of all that it follows from, for the next start.

Files are written under another name and then renamed, so that no other process sees a part of one; each
is read as a whole and checked by its checksums. What cannot be read is computed again, and what cannot be
written is told once: a kept file saves time and decides nothing.
"""

from __future__ import annotations

import hashlib
import math
import mmap
import os
import struct
import sys
import time
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError

LIMIT = "FENWEAR_KEPT_GIB"  # environment variable: GiB of all files together; 0 keeps nothing
DEFAULT = 4.0
ABANDONED = 3600.0  # s, after which a file that was never renamed belongs to a process that is gone

_told: list[str] = []


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


def files() -> list[Path]:
    """Return what is kept, the longest unused first."""
    dated = []
    for path in folder().glob("*.npz"):
        with suppress(OSError):  # removed meanwhile
            dated.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(dated)]


def size() -> int:
    """Return the number of bytes of all that is kept."""
    return sum(_bytes(path) for path in folder().glob("*.npz"))


def summary() -> dict[str, Any]:
    """Return what `fenwear info` says of it.

    Raises:
        CaseError: the limit is no number.
    """
    found = files()
    occupied = sum(_bytes(path) for path in found)
    return {
        "folder": str(folder()),
        "files": len(found),
        "MiB": round(occupied / 2**20, 1),
        "limit_MiB": limit() / 2**20,
    }


def common_key(comm: MPI.Comm, parts: Iterable[object]) -> str:
    """Return the key of what follows from these parts on these ranks, the same on all of them; collective.

    Args:
        comm: The ranks.
        parts: Of this rank: arrays, or what has a text that tells all of it.
    """
    digest = hashlib.blake2b(digest_size=20)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        else:
            digest.update(f"|{part}|".encode())
    return hashlib.blake2b("".join(comm.allgather(digest.hexdigest())).encode(), digest_size=20).hexdigest()


@cache
def surroundings() -> str:
    """Return what else decides the last bits of results: the versions of all parts, and the number of threads."""
    from fenwear.versions import versions

    sources = hashlib.blake2b(digest_size=20)
    package = Path(__file__).parents[1]
    for path in sorted(path for room in ("bodies", "heat") for path in (package / room).glob("*.py")):
        sources.update(path.read_bytes())
    threads = (os.environ.get("OMP_NUM_THREADS"), len(os.sched_getaffinity(0)))
    return f"{sorted(versions().items())} {sources.hexdigest()} {threads}"


def load(comm: MPI.Comm, key: str) -> dict[str, Array] | None:
    """Return this rank's arrays under a key; None unless every rank has its own; collective."""
    path = _path(comm, key)
    found: dict[str, Array] | None = None
    try:
        found = _mapped(path)
        os.utime(path)
    except FileNotFoundError:
        pass
    except (OSError, ValueError, EOFError, struct.error, zipfile.BadZipFile):  # broken, or not to be read
        with suppress(OSError):
            path.unlink()
    return found if comm.allreduce(found is not None, op=MPI.LAND) else None


def save(comm: MPI.Comm, key: str, arrays: Mapping[str, Array]) -> None:
    """Keep this rank's arrays under a key, and let go what was unused longest; collective."""
    needed = comm.allreduce(sum(array.nbytes for array in arrays.values()))
    if needed > limit():
        return
    failed = comm.gather(_write(_path(comm, key), arrays))
    if failed is None:  # not rank 0
        return
    error = next((text for text in failed if text), None)
    if error and not _told:
        _told.append(error)
        print(f"fenwear: set-ups are not kept in {folder()}: {error}; {LIMIT}=0 keeps none", file=sys.stderr)
    _prune()


def _path(comm: MPI.Comm, key: str) -> Path:
    return folder() / f"{key}-{comm.rank}of{comm.size}.npz"


def _mapped(path: Path) -> dict[str, Array]:
    """Return the arrays of a file as it lies on the disk, which is not copied into memory before they are changed.

    Raises:
        OSError, ValueError, BadZipFile: the file is broken or cannot be read.
    """
    found = {}
    with zipfile.ZipFile(path) as archive, path.open("rb") as file:
        whole = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY))
        for member in archive.infolist():
            file.seek(member.header_offset + 26)  # lengths of its name and of what follows that, then both
            begin = file.tell() + 4 + sum(struct.unpack("<HH", file.read(4)))
            stored = whole[begin : begin + member.file_size]
            if member.compress_type != zipfile.ZIP_STORED or zlib.crc32(stored) != member.CRC:
                raise zipfile.BadZipFile(member.filename)
            file.seek(begin)
            if np.lib.format.read_magic(file) != (1, 0):  # type: ignore[no-untyped-call]
                raise ValueError(member.filename)
            shape, in_columns, kind = np.lib.format.read_array_header_1_0(file)  # type: ignore[no-untyped-call]
            values = np.frombuffer(stored, kind, math.prod(shape), file.tell() - begin)
            found[member.filename.removesuffix(".npy")] = values.reshape(shape, order="F" if in_columns else "C")
    return found


def _write(path: Path, arrays: Mapping[str, Array]) -> str | None:
    """Write a file; return what went wrong, in words."""
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
            temporary = Path(file.name)
            np.savez(file, **{name: np.asarray(array) for name, array in arrays.items()})  # type: ignore[arg-type]
        temporary.replace(path)
    except OSError as error:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()
        return error.strerror or "cannot be written"
    return None


def _prune() -> None:
    """Remove the longest unused files above the limit, and what killed processes have left."""
    now, rest = time.time(), size() - limit()
    for path in files() if rest > 0 else ():  # which looks at each once more, to sort them
        if rest <= 0:
            break
        rest -= _bytes(path)
        with suppress(OSError):
            path.unlink()
    for path in folder().glob("*.tmp"):
        with suppress(OSError):
            if now - path.stat().st_mtime > ABANDONED:
                path.unlink()


def _bytes(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0
