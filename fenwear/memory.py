"""The memory that a process may still take."""

from __future__ import annotations

from pathlib import Path

GIB = 2**30  # bytes


def free_memory() -> float | None:
    """Return the bytes that this process may still take; None where the system does not tell."""
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
    """Say so many bytes."""
    return f"{memory / GIB:.1f} GiB" if memory > 0.1 * GIB else f"{memory / 2**20:.0f} MiB"
