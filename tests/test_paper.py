"""The comparison with the paper: its numbers, how verdicts follow from them, and what a page shows of it."""

from __future__ import annotations

import json
import re
from typing import get_args

import numpy as np
import pytest

from fenwear import assemble, load_case, march, steady
from fenwear.paper import (
    FULL,
    Row,
    Scope,
    Verdict,
    needed_shares,
    paper_figures,
    paper_rows,
    sensitivity_rows,
    write_section,
)
from fenwear.paper.published import OPEN, VELOCITIES, last_digit
from fenwear.paper.rows import NEUTRAL, _is_bell, _share_at
from fenwear.paper.section import COLUMNS, as_json, convergence_text, markdown, needed_text, summary, table
from fenwear.paper.study import heat_runs, neutral_share, no_heat, steady_heat

COARSE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
SCOPE = Scope(COARSE, shares=(0.2, 0.5), cycles=2_000, variants=110, meshes=((8, 1), (8, 2)), steps=(5, 10))


def by_quantity(rows: list[Row], words: str) -> Row:
    (row,) = (row for row in rows if words in row.quantity)
    return row


def numbers(text: str) -> list[float]:
    return [float(found) for found in re.findall(r"-?\d+\.\d+", text)]


@pytest.mark.parametrize(("printed", "digit"), [("33.33", 0.01), ("0.0166", 1e-4), ("-0.001111", 1e-6), ("5", 1.0)])
def test_last_digit(printed: str, digit: float) -> None:
    assert last_digit(printed) == pytest.approx(digit, rel=1e-12)


def test_share_at() -> None:
    """Where values first meet a target, linear between the shares; None where they never do."""
    shares = (0.1, 0.2, 0.4)
    assert _share_at(shares, (10, 20, 40), 15) == pytest.approx(0.15)
    assert _share_at(shares, (10, 20, 40), 30) == pytest.approx(0.3)
    assert _share_at(shares, (10, 20, 5), 10) == pytest.approx(0.1)
    assert _share_at(shares, (10, 20, 5), 21) is None
    assert _share_at(shares, (7, 7, 7), 8) is None


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
    """Every quantity of the paper, each with a verdict and a reason; values in their columns for each kappa."""
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
    assert by_quantity(rows, "one-way motions").ours == "20.9, 50.3 for kappa = 0.2, 0.5"


def test_numbers_are_those_of_the_public_functions() -> None:
    """What a row shows is what Tribosystem, march and steady give by hand."""
    run = heat_runs("example1-heat", SCOPE)[1]
    system = assemble(load_case("example1-heat", [*COARSE, "heat.partition=0.5"]))
    block = next(march(system, 30))
    assert block.heat is not None
    np.testing.assert_allclose(run.pressure[:30], block.pressure, rtol=1e-6)
    np.testing.assert_allclose(run.temperature[:30], block.heat.temperature_punch, rtol=1e-6)
    np.testing.assert_allclose(run.wear[:30], block.wear, rtol=1e-6)
    assert run.peak[5] == block.max_pressure[5]
    assert run.central_pressure[3] == pytest.approx(block.pressure[3:5, np.abs(run.x).argmin()].mean(), rel=1e-6)
    heat = steady(system).heat
    assert heat is not None
    assert run.steady.periodic == pytest.approx(heat.punch[:, run.centre].max(), rel=1e-9)
    assert run.steady.difference == pytest.approx(100 * (1 - run.steady.monotonic / run.steady.periodic))
    assert run.x[run.centre] == pytest.approx(0, abs=1e-9)


def test_a_published_number_that_differs_is_not_reproduced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdicts follow from the numbers: were the paper's others, so were they."""
    wrong = tuple(row._replace(at_pin="0.0177") for row in VELOCITIES)
    monkeypatch.setattr("fenwear.paper.rows.VELOCITIES", wrong)
    monkeypatch.setattr("fenwear.paper.rows.LARGEST_PRESSURE", "33.35")
    monkeypatch.setattr("fenwear.paper.rows.MONOTONIC_TEMPERATURE", "60.00")
    monkeypatch.setattr("fenwear.paper.rows.DIFFERENCE", "2.00")
    rows = paper_rows(SCOPE)
    assert all(row.verdict == "not reproduced" for row in rows[:4])
    for words in ("no heat", "one-way motions", "how far"):
        assert by_quantity(rows, words).verdict == "not reproduced"
    assert "no kappa" in by_quantity(rows, "one-way motions").why


def test_no_heat_by_a_run() -> None:
    """The state that repeats comes from one solve; the run from the flat punch tends to it."""
    example = no_heat("example2", SCOPE)
    assert example.mean == pytest.approx(1e4 / 600)
    assert example.state.pressure.max() == pytest.approx(2 * example.mean, rel=1e-9)
    np.testing.assert_allclose(example.marched, example.state.pressure, rtol=0, atol=0.2 * example.mean)


def test_neutral_share() -> None:
    """Between the shares where disturbances decay and grow; None where all of them do the same."""
    neutral = neutral_share(SCOPE)
    assert neutral is not None
    assert 0.2 < neutral < 0.3
    assert needed_shares(SCOPE)["neutral stability"] == neutral
    assert neutral_share(Scope(COARSE, shares=(0.3, 0.5))) is None


def test_sensitivity() -> None:
    """Choices that carry heat off cool, and each choice stands once for each kappa."""
    choices, discretisations = sensitivity_rows(SCOPE)
    assert len({(v.name, v.share) for v in choices}) == len(choices)
    assert {v.group for v in discretisations} == {"mesh", "steps"}
    named = {(v.name, v.share): v.steady for v in choices}
    for share in SCOPE.variant_shares:
        base = named["Example 1 as it is", share]
        assert named["gamma_d = 0.1", share].monotonic == pytest.approx(0.9 * base.monotonic, rel=1e-9)
        assert named["plane strain", share].growth > base.growth
        assert named["strip fixed at the bottom only", share].monotonic == pytest.approx(base.monotonic, rel=1e-6)
    built_in = [v for v in discretisations if v.name.startswith("5 time steps")]
    assert [v.steady.periodic for v in built_in] == [named["Example 1 as it is", v.share].periodic for v in built_in]


def test_page() -> None:
    """A section without head or style: the table, then every picture inline with its caption; text escaped."""
    text = write_section(SCOPE)
    choices, discretisations = sensitivity_rows(SCOPE)
    assert text.count("data:image/png;base64,") == text.count("<figcaption>") == len(paper_figures(SCOPE)) == 8
    assert text.count("<tr>") == 15 + len(choices) + len(discretisations) + 3  # three heads
    assert all(choice.partition(",")[0].replace("'", "&#x27;") in text for choice in OPEN)
    assert "<html" not in text
    assert summary(paper_rows(SCOPE)) in text
    for variant in (*choices, *discretisations):
        assert f"{variant.steady.periodic:.2f}</td>" in text
    hostile = Row("<b>", "a & b", "x", "not reproduced", "p|q")
    assert '<td data-column="quantity">&lt;b&gt;</td><td data-column="paper">a &amp; b</td>' in table([hostile])
    lines = markdown([hostile]).splitlines()
    assert lines[0].count("|") == lines[1].count("|") == len(COLUMNS) + 1
    assert lines[2].endswith("| p\\|q |")


def test_what_programs_get() -> None:
    """JSON of the same rows and variants; a kappa that no number of ours meets is null, and said in words."""
    found = json.loads(json.dumps(as_json(SCOPE)))
    choices, discretisations = sensitivity_rows(SCOPE)
    assert [row["quantity"] for row in found["rows"]] == [row.quantity for row in paper_rows(SCOPE)]
    assert [v["periodic_temperature"] for v in found["open_choices"]] == [v.steady.periodic for v in choices]
    assert {v["group"] for v in found["convergence"]} == {v.group for v in discretisations}
    assert found["needed_partition"] == needed_shares(SCOPE)
    said = needed_text({"first": 0.4321, "second": None, NEUTRAL: 0.25})
    assert said.startswith("The kappa that each number needs: first 0.432, second no kappa of ours. Above 0.250")


def test_convergence_in_words() -> None:
    """The largest change between the last two of each group, over all values of kappa."""
    _, variants = sensitivity_rows(SCOPE)
    steps = {v.name: v.steady.periodic for v in variants if v.group == "steps" and v.share == 0.5}
    change = abs(steps["10 time steps in a half-cycle"] / steps["5 time steps in a half-cycle"] - 1)
    other = {v.name: v.steady.periodic for v in variants if v.group == "steps" and v.share == 0.2}
    change = max(change, abs(other["10 time steps in a half-cycle"] / other["5 time steps in a half-cycle"] - 1))
    assert f"temperatures change by at most {change:.1g} of their value" in convergence_text(variants).split(". ")[-1]


@pytest.mark.slow
def test_the_full_comparison() -> None:
    """The numbers that the README prints, on the built-in cases' own meshes."""
    scope = Scope(shares=(0.1, 0.5))  # runs with one stable and one unstable kappa, on the full mesh
    rows = paper_rows(scope)
    verdicts = [row.verdict for row in rows]
    assert [verdicts.count(v) for v in get_args(Verdict)] == [3, 9, 3]
    hot = assemble(load_case("example1-heat"))
    states = [steady_heat(hot.vary(f"heat.partition={share}")) for share in FULL.shares]
    expected = {
        "monotonic": [11.1, 20.9, 30.7, 40.5, 50.3, 60.1],
        "periodic": [13.8, 23.2, 32.7, 42.1, 51.5, 61.0],
        "difference": [19.7, 10.1, 6.1, 3.8, 2.4, 1.4],
    }
    for name, values in expected.items():
        assert [round(getattr(state, name), 1) for state in states] == values
    for words, name in (("one-way", "monotonic"), ("repeats from cycle to cycle (K)", "periodic")):
        printed = numbers(by_quantity(rows, words).ours.partition(" for")[0])
        assert printed == [expected[name][FULL.shares.index(share)] for share in scope.shares]
    assert neutral_share(scope) == pytest.approx(0.256, abs=1e-3)
    needed = needed_shares(scope)
    assert needed["monotonic temperature"] == pytest.approx(0.468, abs=2e-3)
    assert needed["periodic temperature"] == pytest.approx(0.485, abs=2e-3)
