"""Options and commands that were removed are named, with what takes their place."""

import pytest

from fenwear import CaseError
from fenwear.cli.application import REMOVED, check_removed


@pytest.mark.parametrize("word", sorted(REMOVED))
def test_what_was_removed_is_named(word: str) -> None:
    arguments = [word] if not word.startswith("-") else ["calibrate", "example1", f"{word}=3"]
    with pytest.raises(CaseError, match=f"^{word}: removed"):
        check_removed(arguments)
    check_removed(["run", "serve"])  # a file of that name is none
