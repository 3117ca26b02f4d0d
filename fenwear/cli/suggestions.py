"""What the shell suggests for the words of a command: built-in cases and keys of the case file."""

from __future__ import annotations

from collections.abc import Iterator


def cases(incomplete: str) -> list[str]:
    """Return the built-in cases that begin so; files are the shell's own to suggest."""
    from fenwear.case import builtin_cases

    return [name for name in builtin_cases() if name.startswith(incomplete)]


def keys(incomplete: str) -> list[str]:
    """Return the keys and tables of the case file that begin so."""
    return sorted({path for path, _ in _paths() if path.startswith(incomplete)})


def settings(incomplete: str) -> list[str]:
    """Return the keys that begin so, each ready for its value."""
    return sorted({f"{path}=" for path, table in _paths() if not table and path.startswith(incomplete)})


def _paths() -> Iterator[tuple[str, bool]]:
    """Yield every path, for both bodies, and whether it is a table."""
    from fenwear.case.keys import all_keys

    for key in all_keys():
        for body in ("punch", "strip"):
            yield key.path.replace("BODY", body), key.table
