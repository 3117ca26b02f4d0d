"""What `check` and `steady` say of a case with stick."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fenwear import ConvergenceError, assemble, load_case
from fenwear.checks import Seen
from fenwear.cli.case_commands import check_text
from fenwear.cli.state_commands import final_of, final_text

COARSE = ("geometry.parameters.elements_along_contact=20", "stick.steps=6")


@pytest.mark.parametrize(
    ("amplitude", "regime"), [("0.01 um", "stick"), ("3 um", "partial slip"), ("20 um", "gross sliding")]
)
def test_check_names_the_regime(amplitude: str, regime: str) -> None:
    """Of the first cycle."""
    settings = [*COARSE, f"motion.amplitude='{amplitude}'", "motion.positions=1"]
    assert f"first cycle: {regime}," in check_text(assemble(load_case("fretting-partial-slip", settings)))[0]


@pytest.mark.parametrize("grid", [(), ("grid.nodes=39", "grid.size=['0.19 mm']")])
def test_a_scar_that_reaches_the_end_is_told(grid: tuple[str, ...]) -> None:
    """Of the meshed surface or of a grid: how wide it should be; nothing where it is as wide."""
    coarse = ["geometry.degree=1", "geometry.parameters.elements_along_contact=40", "stick.steps=6"]
    width = [] if grid else ["geometry.parameters.contact_width='0.19 mm'"]
    found, _ = final_of(assemble(load_case("fretting-partial-slip", [*coarse, *width, *grid])))
    assert found.depth[[0, -1]].all()
    (warning,) = Seen.of_final(found).warnings()
    needed = float(re.findall(r"a width of about ([0-9.]+) mm", warning)[0])
    assert 0.19 < needed < 0.3
    assert Seen.of_final(final_of(assemble(load_case("fretting-partial-slip", coarse)))[0]).warnings() == []


def test_the_end_carries_the_load_where_it_sticks() -> None:
    """The pressures of the stick zone add up to the load; where nothing sticks there is no end."""
    found, numbers = final_of(assemble(load_case("fretting-partial-slip", list(COARSE))))
    assert numbers["largest_depth_between_mm"][0] < numbers["largest_depth_mm"] < numbers["largest_depth_between_mm"][1]
    assert numbers["worn_area_between_mm2"][0] < numbers["worn_area_mm2"] < numbers["worn_area_between_mm2"][1]
    x = np.array(numbers["x"])
    away = np.abs(np.abs(x) - numbers["stick_width_mm"] / 2) > x[1] - x[0]
    assert not found.pressure[away & ~found.stick].any()
    assert not found.depth[away & found.stick].any()
    (row,) = re.findall(r"largest worn depth \(µm\) +(\S+) +(\S+) +(\S+)", final_text(numbers))
    depth = numbers["largest_depth_mm"], *numbers["largest_depth_between_mm"]
    assert [float(number) for number in row] == pytest.approx([1e3 * one for one in depth], rel=1e-4)
    with pytest.raises(ConvergenceError, match="no final shape exists"):
        final_of(
            assemble(load_case("fretting-partial-slip", [*COARSE, "motion.amplitude='40 um'", "motion.positions=1"]))
        )
