"""The memory that a process may still take, and the one check of what a step asks for against it."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

from fenwear.errors import CaseError, InputError
from fenwear.parallel import agreed

GIB = 2**30  # bytes
SMALL = GIB  # below which nothing is rejected


def free_memory() -> float | None:
    """Return the memory that this process may still take, bytes; None where the system does not say."""
    found: list[float] = []
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        found += [1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable")]
    except (OSError, ValueError, IndexError):
        pass
    try:  # the limit of a container
        limit, used = (Path(f"/sys/fs/cgroup/memory.{name}").read_text("ascii").strip() for name in ("max", "current"))
        found += [] if limit == "max" else [float(limit) - float(used)]
    except (OSError, ValueError):
        pass
    return min(found) if found else None


def memory_size(memory: float) -> str:
    """Return a memory (bytes) in words."""
    return f"{memory / GIB:.1f} GiB" if memory > 0.1 * GIB else f"{memory / 2**20:.0f} MiB"


def check_memory(comm: MPI.Comm, taken: float, key: str, what: str, advice: str, *, spread: bool = False) -> None:
    """Make sure that a step fits into the memory that is free; collective.

    Args:
        comm: The ranks.
        taken: What the step asks for, bytes.
        key: Of the case, which decides over it.
        what: Asks for the memory.
        advice: What to do where it is too much.
        spread: Whether the ranks share what is taken; else rank 0 has it.

    Raises:
        CaseError: it does not fit.
    """
    free = free_on_ranks(comm) if spread else agreed(comm, free_memory())
    if free is not None and taken > max(free, SMALL):
        sizes = f"{memory_size(taken)}, but {memory_size(free)} are free"
        raise CaseError(InputError(key, f"{what} takes about {sizes}. {advice}"))


def free_on_ranks(comm: MPI.Comm) -> float | None:
    """Return the memory that all ranks together may still take, bytes; None where a system does not say; collective."""
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    found = comm.allgather(free_memory() if node.rank == 0 else 0.0)
    node.Free()
    return None if None in found else float(sum(one or 0.0 for one in found))
