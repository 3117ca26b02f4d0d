"""The comparison with the paper: its numbers, how verdicts follow from them, and what a page shows of it."""

from __future__ import annotations

import dataclasses
import json
import re
import shlex
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from markupsafe import escape

from fenwear import assemble, load_case, march, steady, vary
from fenwear_verify import registered
from fenwear_verify.command import verify
from fenwear_verify.paper import (
    READINGS,
    Reading,
    Row,
    Scope,
    Verdict,
    paper_figures,
    paper_rows,
    sensitivity_rows,
    write_section,
)
from fenwear_verify.paper.published import OPEN, VELOCITIES, last_digit
from fenwear_verify.paper.relaxed import run_relaxed
from fenwear_verify.paper.rows import _is_bell
from fenwear_verify.paper.section import (
    COLUMNS,
    READING,
    as_json,
    convergence_text,
    map_text,
    markdown,
    readings_markdown,
    summary,
)
from fenwear_verify.paper.states import StabilityMap
from fenwear_verify.paper.study import central_runs, heat_runs, no_heat, stability_maps, steady_heat

COARSE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
ROUND, LITERAL = (reading for reading in READINGS if reading.name in ("round values", "text literal"))
SCOPE = Scope(
    COARSE,
    readings=(ROUND, LITERAL),
    central=110,
    cycles=2_000,
    variants=110,
    meshes=((8, 1), (8, 2)),
    steps=(5, 10),
    conductances=(0, 80),
    shares=(0.1, 0.3, 0.5),
)


# One-way and periodic temperature, that of the run at n = 2,200 (K), pressure at the centre of Example 2 (MPa).
FULL_NUMBERS = {
    "round values": (45.45, 47.90, 49.65, 51.9),
    "fitted with debris": (47.16, 48.25, 50.06, 52.2),
    "fitted without debris": (47.16, 50.45, 50.38, 51.9),
}


def by_quantity(rows: list[Row], words: str) -> Row:
    (row,) = (row for row in rows if words in row.quantity)
    return row


def numbers(text: str) -> list[float]:
    return [float(found) for found in re.findall(r"-?\d+\.\d+", text)]


@pytest.mark.parametrize(("printed", "digit"), [("33.33", 0.01), ("0.0166", 1e-4), ("-0.001111", 1e-6), ("5", 1.0)])
def test_last_digit(printed: str, digit: float) -> None:
    assert last_digit(printed) == pytest.approx(digit, rel=1e-12)


def test_bell() -> None:
    x = np.linspace(-1, 1, 41)
    assert _is_bell(np.exp(-9 * x**2), 20)
    assert _is_bell(np.exp(-9 * x**2) + 0.005 * np.cos(40 * x), 20)
    assert not _is_bell(-np.exp(-9 * x**2), 20)
    assert not _is_bell(np.exp(-30 * (np.abs(x) - 0.5) ** 2), 20)
    assert not _is_bell(np.exp(-9 * (x - 0.4) ** 2), 20)


def test_runs_too_short_for_the_paper_are_refused() -> None:
    with pytest.raises(ValueError, match="2200"):
        Scope(half_cycles=2200)


@pytest.mark.mpi
def test_rows() -> None:
    """Every quantity of the paper, each with a verdict and a reason; values for each reading."""
    rows = paper_rows(SCOPE)
    assert len(rows) == 15
    assert len({row.quantity for row in rows}) == 15
    assert all(row.verdict in get_args(Verdict) for row in rows)
    assert all(all((row.quantity, row.paper, row.ours, row.why)) for row in rows)
    for row, printed in zip(rows, VELOCITIES, strict=False):
        at_pin, rotation = numbers(row.ours)
        assert at_pin == pytest.approx(float(printed.at_pin), abs=1e-4)
        assert rotation == pytest.approx(float(printed.rotation), abs=1e-6)
        assert row.verdict == "reproduced under an assumption"
    assert by_quantity(rows, "no heat").verdict == "reproduced"
    assert by_quantity(rows, "mean flux").verdict == "reproduced"
    one_way = by_quantity(rows, "one-way motions")
    assert one_way.ours == "round values 45.46, text literal 47.16"
    assert one_way.verdict == "reproduced under an assumption"
    assert "met by text literal (fitted);" in one_way.why
    assert by_quantity(rows, "falls again").verdict == "not reproduced"
    assert "splits" in by_quantity(rows, "falls again").ours.partition("text literal")[2]


def test_numbers_are_those_of_the_public_functions() -> None:
    """What a row shows is what Tribosystem, march and steady give by hand."""
    run = heat_runs(SCOPE)[1]
    system = assemble(load_case("example1-heat", [*COARSE, *LITERAL.settings]))
    block = next(march(system, 30))
    assert block.heat is not None
    np.testing.assert_allclose(run.pressure[:30], block.pressure, rtol=1e-6)
    np.testing.assert_allclose(run.temperature[:30], block.heat.temperature_punch, rtol=1e-6)
    np.testing.assert_allclose(run.wear[:30], block.wear, rtol=1e-6)
    assert run.peak[5] == block.largest_pressure[5]
    assert run.central_pressure[3] == pytest.approx(block.pressure[3:5, np.abs(run.x).argmin()].mean(), rel=1e-6)
    heat = steady(system).heat
    assert heat is not None
    assert run.steady.periodic == pytest.approx(heat.punch[:, run.centre].max(), rel=1e-9)
    assert run.steady.difference == pytest.approx(100 * (1 - run.steady.monotonic / run.steady.periodic))
    assert run.x[run.centre] == pytest.approx(0, abs=1e-9)


def test_a_published_number_that_differs_is_not_reproduced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdicts follow from the numbers: were the paper's others, so were they."""
    wrong = tuple(row._replace(at_pin="0.0177") for row in VELOCITIES)
    monkeypatch.setattr("fenwear_verify.paper.rows.VELOCITIES", wrong)
    monkeypatch.setattr("fenwear_verify.paper.rows.LARGEST_PRESSURE", "33.35")
    monkeypatch.setattr("fenwear_verify.paper.rows.MONOTONIC_TEMPERATURE", "60.00")
    monkeypatch.setattr("fenwear_verify.paper.rows.PERIODIC_TEMPERATURE", f"{heat_runs(SCOPE)[0].at_centre(2200):.2f}")
    rows = paper_rows(SCOPE)
    assert all(row.verdict == "not reproduced" for row in rows[:4])
    for words in ("no heat", "one-way motions"):
        assert by_quantity(rows, words).verdict == "not reproduced"
    assert "met by no reading" in by_quantity(rows, "one-way motions").why
    assert by_quantity(rows, "in the run, at n").verdict == "reproduced under an assumption"


def test_what_departs_from_the_paper_reproduces_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number that only a reading against the paper's data meets is not reproduced; one that all meet is."""
    runs = [dataclasses.replace(run, reading=dataclasses.replace(run.reading, against="x")) for run in heat_runs(SCOPE)]
    monkeypatch.setattr("fenwear_verify.paper.rows.heat_runs", lambda scope: runs)
    rows = paper_rows(SCOPE)
    assert by_quantity(rows, "one-way motions").verdict == "not reproduced"
    assert "against the paper's data" in by_quantity(rows, "one-way motions").why
    assert by_quantity(rows, "mean flux").verdict == "reproduced"


def test_readings() -> None:
    """The first is the built-in case; each is a valid case, and its command computes that case."""
    assert not ROUND.settings
    assert READINGS[0] is ROUND
    assert len({reading.name for reading in READINGS}) == len(READINGS)
    for reading in READINGS:
        case = load_case("example1-heat", [*reading.settings, *reading.alone])
        load_case("example2-heat", reading.settings)
        assert case.heat is not None
        if reading.point is not None:
            assert case.heat.convecting_faces == reading.faces
            assert reading.point[0] == pytest.approx(1000 * float(case.heat.conductance))
            assert reading.point[1] == pytest.approx(case.heat.partition * (1 - case.heat.debris))
            assert reading.debris == case.heat.debris
        words = shlex.split(reading.command)
        if reading.relaxed is None:
            assert words[:2] == ["run", "example1-heat"]
            assert load_case(words[1], [word for word in words[2:] if word != "--set"]) == case
    literal = load_case("example1-heat", LITERAL.settings).heat
    unstable = load_case("example1-heat-unstable").heat
    assert literal is not None
    assert unstable == literal.model_copy(update={"partition": 0.5})


def test_counting_and_summing() -> None:
    """n in steps of heat is five times the half-cycles; the sum of both directions is twice their mean."""
    run = heat_runs(SCOPE)[0]
    steps = dataclasses.replace(run, reading=Reading("steps", counted="steps of heat"))
    assert steps.at_centre(2200) == run.at_centre(440)
    assert steps.peak_half_cycle == 5 * run.peak_half_cycle
    assert dataclasses.replace(run, reading=Reading("sum", directions="sum")).one_way == 2 * run.one_way


def test_relaxed_run() -> None:
    """Relaxed by 1 until the gap rests it is the march; a small factor leaves the pressure at its start."""
    system = assemble(load_case("example1-heat", [*COARSE, "heat.split_tolerance=1e-12", "heat.conducting=nominal"]))
    block = next(march(system, 20))
    assert block.heat is not None
    full = run_relaxed(system, 20, 1.0)
    np.testing.assert_allclose(full.pressure, block.pressure, rtol=0, atol=1e-4 * block.pressure.max())
    np.testing.assert_allclose(full.temperature, block.heat.temperature_punch, rtol=0, atol=1e-3)
    np.testing.assert_allclose(full.wear, block.wear, rtol=0, atol=1e-4 * block.wear.max())
    np.testing.assert_allclose(full.friction, block.heat.terms[:, 0], rtol=1e-9)
    small = run_relaxed(vary(system, "heat.split_tolerance=0.9"), 20, 1e-4)
    np.testing.assert_allclose(small.pressure[-1], small.pressure[0], rtol=0, atol=0.02 * small.pressure.max())
    assert np.abs(block.pressure[-1] - block.pressure[0]).max() > 0.1 * block.pressure.max()


def test_no_heat_by_a_run() -> None:
    """The state that repeats comes from one solve; the run from the flat punch tends to it."""
    example = no_heat("example2", SCOPE)
    assert example.mean == pytest.approx(1e4 / 600)
    assert example.state.pressure.max() == pytest.approx(2 * example.mean, rel=1e-9)
    np.testing.assert_allclose(example.marched, example.state.pressure, rtol=0, atol=0.2 * example.mean)


def test_stability_map() -> None:
    """Lines and growth are those of single systems; where the lines cross, both temperatures are met."""
    insulated, debris, faces = stability_maps(SCOPE)
    base = assemble(load_case("example1-heat", [*COARSE, "heat.debris=0"]))
    one = steady_heat(vary(base, "heat.conductance=0.08", f"heat.partition={insulated.one_way[1]}"))
    assert one.monotonic == pytest.approx(47.16, abs=1e-6)
    one = steady_heat(vary(base, "heat.conductance=0.08", f"heat.partition={insulated.periodic[1]}"))
    assert one.periodic == pytest.approx(50.11, abs=1e-3)  # all but linear: nodes at the edge of the contact
    assert steady_heat(vary(base, "heat.conductance=0", "heat.partition=0.3")).growth == pytest.approx(
        insulated.growth[0, 1], rel=1e-9
    )
    assert (faces.one_way > 1.5 * insulated.one_way).all()  # faces that lose heat ask for much more of it
    assert ((insulated.neutral > 0.1) & (insulated.neutral < 0.3)).all()
    assert ((debris.growth[:, 0] < 0) & (debris.growth[:, 2] > 0)).all()
    cross = StabilityMap("p", False, 0.0, np.array([0.0, 10]), np.array([0.1, 0.2]), np.array([[-1.0, 1], [-1, 3]]),
                         np.array([0.1, 0.2]), np.array([0.12, 0.16]))  # fmt: skip
    assert map_text([cross]) == (
        "With p, both temperatures ask for h_c = 3 and a share of 0.13, where the state is stable up to 0.14."
    )
    none = dataclasses.replace(cross, periodic=cross.one_way + 1)
    assert map_text([none]) == "With p, no conductance of the map gives both temperatures."


def test_sensitivity() -> None:
    """Choices that carry heat off cool, and each choice stands once."""
    choices, discretisations = sensitivity_rows(SCOPE)
    named = {v.name: v.steady for v in choices}
    assert len(named) == len(choices)
    assert {v.group for v in discretisations} == {"mesh", "steps", "coupling"}
    base = named["Example 1 as it is"]
    assert named["gamma_d = 0.6"].monotonic < base.monotonic < named["kappa = 0.6"].monotonic
    assert named["plane strain"].growth > base.growth
    assert named["strip fixed at the bottom only"].monotonic == pytest.approx(base.monotonic, rel=1e-6)
    built_in = [v for v in discretisations if v.name in ("5 time steps in a half-cycle", "heat and contact together")]
    assert [v.steady.periodic for v in built_in] == [base.periodic] * 2


def test_page() -> None:
    """A section without head or style: the table, then every picture inline with its caption; text escaped."""
    text = write_section(SCOPE)
    choices, discretisations = sensitivity_rows(SCOPE)
    assert text.count("data:image/png;base64,") == text.count("<figcaption>") == len(paper_figures(SCOPE)) == 7
    assert text.count("<tr>") == 15 + 2 + len(choices) + len(discretisations) + 4  # four heads
    for reading in SCOPE.readings:
        assert f"{escape(reading.command)}    # {reading.name}" in text
    assert all(escape(choice.partition(",")[0]) in text for choice in OPEN)
    assert "<html" not in text
    assert summary(paper_rows(SCOPE)) in text
    for variant in (*choices, *discretisations):
        assert f"{variant.steady.periodic:.2f}</td>" in text
    for row in paper_rows(SCOPE):
        assert f'<td data-column="quantity">{escape(row.quantity)}</td>' in text
        assert f'<td data-column="why">{escape(row.why)}</td>' in text
    hostile = Row("<b>", "a & b", "x", "not reproduced", "p|q")
    lines = markdown([hostile]).splitlines()
    assert lines[0].count("|") == lines[1].count("|") == len(COLUMNS) + 1
    assert lines[2].endswith("| p\\|q |")


def test_it_stands_on_the_page_of_the_verification(tmp_path: Path) -> None:
    """And in its numbers; rows that are not reproduced are no disagreement."""
    said: list[str] = []
    found, directory = verify(registered(["time-steps"]), SCOPE, tmp_path / "v", said.append)
    assert found["agree"]
    assert found["paper"]["seconds"] > 0
    assert {row["verdict"] for row in found["paper"]["rows"]} >= {"reproduced", "not reproduced"}
    text = "\n".join(said)
    assert all(f"{row['quantity']}: {row['verdict']}\n" in text for row in found["paper"]["rows"])
    assert json.loads((directory / "verification.json").read_text()) == found
    content = (directory / "verification.html").read_text("utf-8")
    assert content.count("<img ") == 1 + 7
    assert set(re.findall(r"<(?:img|script|iframe|link)\b[^>]*?(?:src|href)=\"(data|)", content)) == {"data"}
    assert '<section id="paper">' in content
    assert '<section id="time-steps">' in content


def test_what_programs_get() -> None:
    """JSON of the same rows, readings, maps and variants; what is not there is null."""
    found = json.loads(json.dumps(as_json(SCOPE), allow_nan=False))
    choices, discretisations = sensitivity_rows(SCOPE)
    assert [row["quantity"] for row in found["rows"]] == [row.quantity for row in paper_rows(SCOPE)]
    assert [v["periodic_temperature"] for v in found["open_choices"]] == [v.steady.periodic for v in choices]
    assert {v["group"] for v in found["convergence"]} == {v.group for v in discretisations}
    for shown, run, two in zip(found["readings"], heat_runs(SCOPE), central_runs(SCOPE), strict=True):
        assert shown["one_way_temperature"] == run.one_way
        assert shown["temperature"]["2200"] == run.at_centre(2200)
        assert two is not None
        assert shown["central_pressure"] == two.central_pressure[100:].max()
    assert len(found["stability"]) == 3
    lines = readings_markdown(heat_runs(SCOPE), central_runs(SCOPE)).splitlines()
    assert len(lines) == 2 + 2
    assert all(line.count("|") == len(READING) + 1 for line in lines)


def test_convergence_in_words() -> None:
    """The change between the last two of each group."""
    _, variants = sensitivity_rows(SCOPE)
    five, ten = (v for v in variants if v.group == "steps")
    said = next(text for text in convergence_text(variants).split("From ") if "10 time steps" in text)
    assert f"the temperature at the end changes by {abs(ten.late - five.late):.2g} K" in said
    assert f"the growth rate by {abs(ten.steady.growth - five.steady.growth):.1g} 1/s" in said


@pytest.mark.slow
def test_the_full_comparison() -> None:
    """The numbers that docs/paper.md prints, on the built-in cases' own meshes."""
    scope = Scope(readings=tuple(r for r in READINGS if r.name in FULL_NUMBERS), central=300)
    for run, two in zip(heat_runs(scope), central_runs(scope), strict=True):
        one_way, periodic, late, central = FULL_NUMBERS[run.reading.name]
        assert run.one_way == pytest.approx(one_way, abs=0.006)
        assert run.steady.periodic == pytest.approx(periodic, abs=0.006)
        assert run.at_centre(2200) == pytest.approx(late, abs=0.006)
        assert run.opened is None
        assert two is not None
        assert two.central_pressure[two.bulged].max() == pytest.approx(central, abs=0.06)
