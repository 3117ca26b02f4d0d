"""Things that are fine by themselves are rejected together by key, for the reasons that the docs print."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import CUP, ELSEWHERE, HEAT, LOADED, PLACED, PLANE, STICK, Refusal, program

from fenwear import CaseError, ConvergenceError, load_case, steady
from fenwear.results import checkpoint
from fenwear.results.flash_source import heating_of
from fenwear.studies.model import Model
from fenwear.system import assemble, place_case

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


@pytest.mark.parametrize("refusal", PLACED, ids=lambda r: f"{r.key}-{r.case}")
def test_rejected_at_set_up(refusal: Refusal) -> None:
    """When the bodies are brought opposite each other, by the key."""
    with pytest.raises(CaseError) as error:
        place_case(load_case(refusal.case, refusal.settings))
    assert refusal.key in {problem.key for problem in error.value.problems}


def test_no_end_of_held_bodies() -> None:
    """Supports that press by an approach: wear goes on until nothing presses."""
    held = "punch.supports=[{on='punch_load', fix=['x', 'z'], by=[0, -0.001]}]"
    small = ("geometry.parameters.elements_along_contact=8", "geometry.degree=1")
    with pytest.raises(ConvergenceError, match=r"`run`"):
        steady(assemble(load_case(PLANE, [*small, held, "punch.loads=[]"])))


def test_flash_of_cycles_without_a_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables, and programs with stick."""
    monkeypatch.setattr(checkpoint, "reached", lambda _: 1)
    for case, settings, key in ((CUP, (), "motion.kind"), (STICK, program("cycles=1"), "program")):
        with pytest.raises(CaseError) as error:
            heating_of(load_case(case, settings), tmp_path)
        assert error.value.problems[0].key == key


def test_no_rates_with_properties_of_the_temperature() -> None:
    """The key of the property is named."""
    table = "materials.steel.conductivity={table=[[0, 50], [500, 40]]}"
    with pytest.raises(CaseError) as error:
        Model(load_case(HEAT, [table])).critical_speed({})
    assert error.value.problems[0].key == "materials.steel.conductivity"


def test_a_share_that_changes_with_a_layer_and_stick() -> None:
    """A share of the speed."""
    share = "contact.lubrication={asperity_share={expression='min(1, 0.3 + v / 1e4)'}}"
    layer = "contact.layer={kind='power', reference='1 um', pressure='100 MPa'}"
    with pytest.raises(CaseError) as error:
        assemble(load_case(STICK, [share, layer]))
    assert error.value.problems[0].key == "contact.layer"


def test_others_are_rejected_by_tests_of_their_own() -> None:
    """Each test that is named exists."""
    for _, _, test in ELSEWHERE:
        file, _, name = test.partition("::")
        assert not test or f"def {name}" in (TESTS / file).read_text("utf-8")
