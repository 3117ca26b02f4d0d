"""Keys and words that a case file no longer has, and what takes the place of each.

One table for the whole package: a key as a case file writes it, with `*` for a name or number that the user chose, or
`key = word` where the key stays and one of its words went.
"""

from __future__ import annotations

from fnmatch import fnmatchcase

REMOVED: dict[str, str] = {
    "contact.solver": "Leave it out: contacts are solved on the condensed bodies, which tests compare with "
    "all displacements.",
    "wear.*.beta": "Set `energy`, which is the same with exponents of 1, or `coefficient` to beta mu^b.",
    "setup.way": "Leave it out: each body is factored on a rank of its own, or over all ranks where its factor takes "
    "more than 4 GiB.",
}


def replacement(key: str, word: object = None) -> str | None:
    """Return the replacement of a removed key, or of one of its words; None where neither was removed.

    Args:
        key: Its path in the case file.
        word: The value that it was given.
    """
    for asked in (key, f"{key} = {word}"):
        for pattern, advice in REMOVED.items():
            if fnmatchcase(asked, pattern):
                return advice
    return None
