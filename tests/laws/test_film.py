"""Films that grow on a body: closed forms of thickness, wear and gap, on either body, in every way of going forward."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from combinations import SMALL, STICK
from test_law_states import PLAIN, end

from fenwear import CaseError, assemble, load_case, steady
from fenwear.studies.run import run_case

GROWN, FULL, SWELLS, WEAR = 4e-9, 2e-6, 2.0, 1e-13  # mm/s, mm, Pilling-Bedworth ratio, 1/MPa
GROWTH = f"growth={{expression='{GROWN} * (1 - film / {FULL})'}}, pilling_bedworth={SWELLS}"
FILM = f"wear={{punch={{coefficient={WEAR}, film={{{GROWTH}}}}}}}"


def closed(pressure: float, seconds: float) -> float:
    """Return the thickness, mm, of growth g (1 - h / L) less R k p v."""
    rest = FULL * (1 - SWELLS * WEAR * pressure * 100 / GROWN)
    return rest * float(-np.expm1(-seconds * GROWN / FULL))


def test_a_film_under_an_even_pressure() -> None:
    """Marches have its closed form to rounding, jumps to their tolerance, the end its rest; wear is of the metal."""
    system = assemble(load_case("example2", [*PLAIN, FILM, "run.half_cycles=1000"]))
    pressure = system.rigid.mean_pressure
    marched = end(assemble(load_case("example2", [*PLAIN, FILM, "run.half_cycles=20"])), "explicit")
    even = float(system.pair.weights @ marched.between[-1, 0] / system.pair.weights.sum())  # linear in the pressure
    assert even == pytest.approx(closed(pressure, 20), rel=1e-12)
    errors = []
    for tolerance in (1e-1, 1e-2, 1e-3):
        last = end(system, "jump", tolerance)
        mean = float(system.pair.weights @ last.between[-1, 0] / system.pair.weights.sum())
        errors.append(abs(mean / closed(pressure, 1000) - 1))
        assert last.totals.of("volume_punch")[-1] == pytest.approx(WEAR * 1e4 * 100 * 1000, rel=1e-9)
    assert errors[2] < 1e-3
    assert errors[2] <= errors[0] < 3e-2
    assert steady(system).states["film"] == pytest.approx(closed(pressure, np.inf), rel=1e-9)


@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
@pytest.mark.parametrize("body", ["punch", "strip"])
def test_a_film_swells_into_the_gap(body: str, law: str) -> None:
    """With no wear but of the other body the gap closes by h (1 - 1/R); a film from the lubricant by all of h."""
    stick = STICK if law == "coulomb" else ("stick={}",)
    gaps = {}
    for ratio in ("1", "2", ""):
        bedworth = f", pilling_bedworth={ratio}" if ratio else ""
        film = f"film={{growth='1e-5 mm/s', initial='1e-4 mm'{bedworth}}}"
        wear = f"wear={{{body}={{coefficient=0, {film}}}}}"
        system = assemble(load_case("fretting-partial-slip", [*SMALL, f"contact.law='{law}'", *stick, wear]))
        worn = end(system, "explicit").end.worn
        film_on = system.layers.held(worn).at_contact(system.pair)[0]
        grown = 1e-4 + 1e-5 * 2 * system.motion.period
        assert film_on == pytest.approx(grown, rel=1e-9)
        gaps[ratio] = -np.asarray(system.layers.opening(system.pair, worn)) / film_on
    assert np.abs(gaps["1"]).max() == 0
    assert gaps["2"] == pytest.approx(0.5, rel=1e-9)
    assert gaps[""] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("body", ["punch", "strip"])
@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_a_film_that_protects_in_marches_and_jumps(body: str, law: str) -> None:
    """Both agree where wear takes off the film that it goes through, on either body."""
    stick = STICK if law == "coulomb" else ("stick={}", "motion.positions=2")
    grown = 6e-5 if law == "gross-sliding" else 6e-6
    wear = (
        f"wear={{{body}={{coefficient={{expression='1e-6 * (1 - 0.8 * min(film / 4e-5, 1))', unit='1/MPa'}}, "
        f"film={{growth={{expression='{grown} * (1 - film / 4e-5)'}}, initial='3e-5 mm', pilling_bedworth=2.1}}}}}}"
    )
    more = (*SMALL, f"contact.law='{law}'", *stick, wear, "motion.period='1 s'", "run.half_cycles=8")
    system = assemble(load_case("fretting-partial-slip", list(more)))
    marched, jumped = (end(system, how, 1e-3).end.worn for how in ("explicit", "jump"))
    depths = (np.hstack([worn.punch, worn.strip]) for worn in (jumped, marched))
    films = (system.layers.held(worn).at_contact(system.pair)[0] for worn in (jumped, marched))
    for jump, march in (tuple(depths), tuple(films)):
        assert np.abs(jump - march).max() < 1e-2 * np.abs(march).max()
    assert np.ptp(system.layers.held(marched).at_contact(system.pair)[0]) > 1e-7


def test_a_run_with_a_film_and_its_restart(tmp_path: Path) -> None:
    """The sheet, the history and the report have it; a resumed run is the run."""
    settings = [*PLAIN, FILM, "output.uncertainty=false"]
    case = load_case("example2", [*settings, "run.half_cycles=8"])
    whole, folder = run_case(case, output=tmp_path / "whole", progress="none")
    run_case(load_case("example2", [*settings, "run.half_cycles=4"]), output=tmp_path / "parts", log=lambda _: None)
    parts, _ = run_case(case, output=tmp_path / "parts", resume=True, log=lambda _: None)
    assert whole["states"]["film"]["unit"] == "mm"
    assert parts["states"] == whole["states"]
    assert "film" in (folder / "report.html").read_text()


@pytest.mark.parametrize(
    ("wear", "key"),
    [
        ("{coefficient=1e-8, film={growth=-1}}", "wear.punch.film.growth"),
        ("{coefficient=1e-8, film={growth=1, pilling_bedworth=0}}", "wear.punch.film.pilling_bedworth"),
        ("{coefficient=1e-8, film={growth=1}, coating={thickness=1, coefficient=1e-9}}", "wear.punch"),
        ("{coefficient={expression='1e-8*film'}}", "wear.punch.coefficient"),
    ],
)
def test_films_that_make_no_sense(wear: str, key: str) -> None:
    """They are rejected by key."""
    with pytest.raises(CaseError, match=key):
        load_case("example2", [f"wear={{punch={wear}}}"])
