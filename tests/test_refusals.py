"""Things that are fine by themselves are rejected together by key, for the reasons that the docs print."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import ELSEWHERE, LOADED, Refusal

from fenwear import CaseError, load_case

TESTS = Path(__file__).parent


@pytest.mark.parametrize("refusal", LOADED, ids=lambda r: f"{r.key}-{r.case}")
def test_rejected_by_key(refusal: Refusal) -> None:
    """When the case is read, whatever the words."""
    load_case(refusal.case)
    with pytest.raises(CaseError) as error:
        load_case(refusal.case, refusal.settings)
    found = {problem.key: problem.message for problem in error.value.problems}
    assert refusal.key in found
    assert refusal.number in found[refusal.key]


def test_others_are_rejected_by_tests_of_their_own() -> None:
    """Each test that is named exists."""
    for _, _, test in ELSEWHERE:
        file, _, name = test.partition("::")
        assert not test or f"def {name}" in (TESTS / file).read_text("utf-8")
