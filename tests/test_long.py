"""The list of long tests: what it names is there."""

from __future__ import annotations

from pathlib import Path

TESTS = Path(__file__).parent


def test_every_name_is_that_of_a_test() -> None:
    """A file, or a function in it; in order, once."""
    names = (TESTS / "long.txt").read_text("utf-8").split()
    assert names == sorted(set(names))
    for name in names:
        path, _, function = name.partition("::")
        assert f"\ndef {function}(" in (TESTS / path).read_text("utf-8") or not function, name
