"""What `check` and `steady` say of a case with stick."""

from __future__ import annotations

import pytest

from fenwear import CaseError, ConvergenceError, assemble, load_case
from fenwear.stick.command import check_text, final_of, final_text

COARSE = ("geometry.parameters.elements_along_contact=20", "stick.steps=6")


@pytest.mark.parametrize(
    ("amplitude", "regime"), [("0.01 um", "full stick"), ("3 um", "partial slip"), ("20 um", "gross sliding")]
)
def test_check_names_the_regime(amplitude: str, regime: str) -> None:
    """Of the first cycle."""
    settings = [*COARSE, f"motion.amplitude='{amplitude}'", "motion.positions=1"]
    assert f"first cycle: {regime}," in check_text(load_case("fretting-partial-slip", settings))


def test_the_end_carries_the_load_where_it_sticks() -> None:
    """The pressures of the stick zone add up to the load; where nothing sticks there is no end."""
    found, numbers = final_of(load_case("fretting-partial-slip", list(COARSE)))
    assert not found.pressure[~found.stick].any()
    assert not found.depth[found.stick].any()
    assert numbers["largest_depth_mm"] > 0
    assert "carries all of the load" in final_text(numbers)
    with pytest.raises(ConvergenceError, match="no final shape exists"):
        final_of(load_case("fretting-partial-slip", [*COARSE, "motion.amplitude='40 um'", "motion.positions=1"]))


def test_what_follows_gross_sliding_refuses_the_case() -> None:
    """No command takes it for gross sliding without a word."""
    with pytest.raises(CaseError, match=r"contact\.law: expected 'gross-sliding' here"):
        assemble(load_case("fretting-partial-slip", list(COARSE)))
