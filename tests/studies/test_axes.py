"""Keys and values of sweeps: ranges, lists, units, tables, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import CaseError, load_case
from fenwear.studies import make_axis, parse_axis, read_table
from fenwear.studies.study import in_pieces
from fenwear.studies.sweep_plan import make_plan, run_of

CASE = load_case("example1")


def test_ranges() -> None:
    """Ends of a range have the unit that stands with them, else that of the key; ratios or differences are equal."""
    np.testing.assert_allclose(parse_axis(CASE, "contact.friction=0.1:0.3:5").values, [0.1, 0.15, 0.2, 0.25, 0.3])
    np.testing.assert_allclose(parse_axis(CASE, "motion.amplitude=1 mm:0.3 cm:3").values, [1, 2, 3])
    np.testing.assert_allclose(parse_axis(CASE, "motion.amplitude=1:3:3").values, [1, 2, 3])
    logs = parse_axis(CASE, "wear.punch.coefficient=1e-9:1e-7:3:log").values
    np.testing.assert_allclose(logs, [1e-9, 1e-8, 1e-7])
    whole = parse_axis(CASE, "geometry.degree=1:3:3").values
    assert whole == (1, 2, 3)
    assert all(isinstance(value, int) for value in whole)
    mixed = parse_axis(CASE, "contact.friction=0.1, 0.2:0.3:2").values
    assert mixed == ("0.1", 0.2, 0.3)


def test_texts_and_lists() -> None:
    """Commas inside brackets and quotations belong to a value."""
    assert parse_axis(CASE, "model.plane=stress,strain").values == ("stress", "strain")
    two = parse_axis(CASE, 'punch.loads.0.force=["0 N", "-5 kN"],[0, -1e4]')
    assert two.values == ('["0 N", "-5 kN"]', "[0, -1e4]")
    assert make_axis(CASE, "punch.loads.0.force", [["0 N", "-5 kN"]]).values == ('["0 N", "-5 kN"]',)
    plan = make_plan(CASE, [two], "steady")
    assert plan.coordinates[0] == (('["0 N", "-5 kN"]', "[0, -1e4]"), "")
    assert plan.variants[0].case is not None
    np.testing.assert_allclose(plan.variants[0].case.punch.loads[0].force, (0, -5e3))


def test_coordinates_are_those_of_the_cases() -> None:
    """10 mm, 12 and 1.5 cm are 10, 12 and 15 mm; an exponent leaves the number of its coefficient alone."""
    plan = make_plan(CASE, [parse_axis(CASE, "motion.amplitude=10 mm,12,1.5 cm")], "steady")
    assert plan.coordinates == (((10.0, 12.0, 15.0), "mm"),)
    plan = make_plan(CASE, [parse_axis(CASE, "wear.punch.pressure_exponent=1,2")], "steady")
    assert [v.case is not None and v.case.wear.punch.coefficient for v in plan.variants] == [
        CASE.wear.punch.coefficient
    ] * 2


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("contact.friction", "expected KEY=VALUES"),
        ("contact.friction=", "expected values"),
        ("contact.friction=0.1,,0.2", "expected values"),
        ("contact.friction=0.1:0.3:0", "1 to 100,000 values, got 0"),
        ("contact.friction=0.1:0.1:5", "not empty"),
        ("contact.friction=0.1:0.3:1", "not empty"),
        ("contact.friction=0.1:0.3", "FIRST:LAST:NUMBER"),
        ("contact.friction=0.1:0.3:5:lin", "FIRST:LAST:NUMBER"),
        ("contact.friction=0:0.3:5:log", "above 0"),
        ("motion.amplitude=1 s:2 s:3", "another kind"),
        ("geometry.degree=1:4:3", "whole numbers"),
    ],
)
def test_refused_texts(text: str, what: str) -> None:
    """What is no key with values says what was expected."""
    with pytest.raises(CaseError, match=what):
        parse_axis(CASE, text)


@pytest.mark.parametrize(
    ("axes", "what"),
    [
        (["contact.fricton=0.1,0.2"], "contact.fricton: unknown key; did you mean 'friction'"),
        (["contact.friction=0.1,-0.2"], "contact.friction: expected greater than or equal to 0, got -0.2"),
        (["contact.friction=0.1", "contact.friction=0.2"], "given twice"),
        (["contact.friction=0.1,0.10"], "has the value 0.1 twice"),
        (["punch.loads.0.force=[0, -1]", "punch.loads.0.force.1=-1e4"], "one inside the other"),
        (["contact.friction=0.1:0.2:200", "motion.amplitude=1:2:200"], "10,000 variants, got 200 x 200 = 40,000"),
        ([], "one key or more"),
    ],
)
def test_refused_plans(axes: list[str], what: str) -> None:
    """A value that no variant can have is refused before anything is computed."""
    with pytest.raises(CaseError, match=what):
        make_plan(CASE, [parse_axis(CASE, text) for text in axes], "steady")


def test_zip_and_tables(tmp_path: Path) -> None:
    """Rows of a table go together; rows of another length and values that do not fit name their row."""
    path = tmp_path / "variants.csv"
    path.write_text("contact.friction, motion.amplitude\n0.1, 10 mm\n0.1, 12 mm\n0.2, 12 mm\n", "utf-8")
    plan = make_plan(CASE, read_table(path), "steady", zipped=True)
    assert plan.dimensions == {"variant": 3}
    assert [v.case.motion.amplitude for v in plan.variants if v.case] == [10, 12, 12]
    path.write_text("contact.friction,wear.punch.energy (mm^3/(N*m)),motion.amplitude [cm]\n0.1,1e-6,1\n", "utf-8")
    assert [(axis.key, axis.values) for axis in read_table(path)] == [
        ("contact.friction", ("0.1",)),
        ("wear.punch.energy", ("1e-6 mm^3/(N*m)",)),
        ("motion.amplitude", ("1 cm",)),
    ]
    path.write_text("contact.friction,motion.amplitude\n0.1,10 mm\n0.1\n", "utf-8")
    with pytest.raises(CaseError, match="row 3: expected 2"):
        read_table(path)
    path.write_text("contact.friction\n0.1\n-3\n", "utf-8")
    with pytest.raises(CaseError, match="variant 2: expected greater"):
        make_plan(CASE, read_table(path), "steady", zipped=True)
    axes = [make_axis(CASE, "contact.friction", [0.1, 0.2]), make_axis(CASE, "motion.amplitude", [1.0])]
    with pytest.raises(CaseError, match="as many values"):
        make_plan(CASE, axes, "steady", zipped=True)
    with pytest.raises(CaseError, match="cannot be read"):
        read_table(tmp_path / "none.csv")


def test_values_that_do_not_go_together_fail_alone() -> None:
    """A unit of one exponent does not fit the other: those variants fail, the sweep goes on."""
    axes = [
        make_axis(CASE, "wear.punch.coefficient", ["4e-8 1/MPa", "4e-9 1/MPa^2"]),
        make_axis(CASE, "wear.punch.pressure_exponent", [1.0, 2.0]),
    ]
    plan = make_plan(CASE, axes, "steady")
    assert [variant.error is None for variant in plan.variants] == [True, False, False, True]


def test_pieces_share_their_set_up() -> None:
    """One piece for each geometry where there are enough; one geometry is cut so that all workers have something."""
    axes = [
        parse_axis(CASE, "contact.friction=0.1:0.3:5"),
        parse_axis(CASE, "geometry.parameters.pin_height_1=10:40:9"),
    ]
    plan = make_plan(CASE, axes, "steady")
    runs = {run_of(variant, plan.of).name: variant.place for variant in plan.variants}
    listed = [run_of(variant, plan.of) for variant in plan.variants]
    pieces = in_pieces(listed, 2)
    assert len(pieces) == 9
    for piece in pieces:
        assert len({runs[run.name][1] for run in piece}) == 1
    assert sorted(runs[run.name] for piece in pieces for run in piece) == list(runs.values())
    few = in_pieces([run for run in listed if runs[run.name][1] == 0], 2)
    assert [len(piece) for piece in few] == [1] * 5
    assert len(in_pieces(listed, 1)) == 9
