"""Every refusal of things that are fine by themselves stands in the list that the docs print, with its reason."""

from __future__ import annotations

from refusals import OTHERS, REFUSALS, messages


def test_every_refusal_is_listed() -> None:
    """Each message of the source has an entry, and each entry a message: enter new ones in refusals.py."""
    seen = set[tuple[str, str]]()
    for where, text in messages():
        known = [part for part in (*REFUSALS.get(where, {}), *OTHERS.get(where, ())) if part in text]
        assert known, f"{where}: {text!r} is not in tests/refusals.py"
        seen |= {(where, part) for part in known}
    listed = {(where, part) for parts in (REFUSALS, OTHERS) for where, of in parts.items() for part in of}
    assert listed == seen
