"""Keys that a case no longer has: the error says what takes their place."""

from __future__ import annotations

import pytest

from fenwear import CaseError, load_case
from fenwear.case.removed_keys import REMOVED


def test_a_removed_key_or_word_says_what_takes_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """A key, one beneath a name of the user's, and a word of a key that stays."""
    for pattern in ("run.former", "materials.*.former", "run.integration = former"):
        monkeypatch.setitem(REMOVED, pattern, "Set `run.other`.")
    for setting, key in (
        ("run.former=1", "run.former"),
        ("materials.steel.former=2", "materials.steel.former"),
        ("run.integration='former'", "run.integration"),
    ):
        with pytest.raises(CaseError) as refused:
            load_case("example1", [setting])
        assert str(refused.value).splitlines() == [f"{key}: removed. Set `run.other`."]


def test_removed_keys_of_the_set_up() -> None:
    """They were in case files once."""
    with pytest.raises(CaseError, match=r"^wear\.punch\.beta: removed\. .*energy.*coefficient"):
        load_case("example1", ["wear.punch={beta=1e-8}"])
    for setting in ("setup.way=multigrid", "contact.solver=full"):
        with pytest.raises(CaseError, match=rf"^{setting.split('=')[0]}: removed\. Leave it out"):
            load_case("example1", [setting])
