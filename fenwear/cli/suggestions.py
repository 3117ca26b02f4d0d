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
    return sorted({f"{path}=" for path, value in _paths() if value and path.startswith(incomplete)})


def tests(incomplete: str) -> list[str]:
    """Return the usual tests that begin so."""
    from fenwear.case.templates import template_names

    return [name for name in template_names() if name.startswith(incomplete)]


def _paths() -> Iterator[tuple[str, bool]]:
    """Yield every path, for both bodies, and whether it takes a value, as some tables do in place of their keys."""
    from fenwear.case.keys import all_keys

    for key in all_keys():
        for body in ("punch", "strip"):
            yield key.path.replace("BODY", body), not key.table or key.values.startswith("number")
