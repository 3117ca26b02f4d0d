"""Heat by local slip: its balance, the limit of gross sliding, expansion along the surface, jumps, a resumed run."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import xarray
from work import half_cycles_whose_work_is_heat

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march
from fenwear.cli.state_commands import final_of
from fenwear.results.stored_history import by_cycles, load_history
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.studies.run import run_case

WARM = (
    "materials.steel={young='200 GPa', poisson=0.3, conductivity='45 W/(m K)', heat_capacity='460 J/(kg K)', "
    "density='7800 kg/m^3', expansion='1.2e-5 1/K'}",
    "heat={convection='20 W/(m^2 K)', steps=5}",
    "strip.temperatures=[{on='strip_bottom', temperature='0 K'}]",
    "motion.period='0.001 s'",
    "geometry.follow_wear='never'",
)
SMALL = ("geometry.parameters.elements_along_contact=16", *WARM, "stick.steps=10", "stick.step_tolerance=1")
FAST = "wear.punch.coefficient='1e-6 1/MPa'"


@lru_cache
def assembled(*settings: str) -> Tribosystem:
    return assemble(load_case("fretting-partial-slip", [*SMALL, *settings]))


@pytest.mark.parametrize("settings", [(), ("stick.force='60 N'",), ("heat.partition=0.3", "heat.debris=0.1")])
def test_work_of_friction_is_the_heat(settings: tuple[str, ...]) -> None:
    """In each half-cycle, to rounding; and what rig and loads put in is stored or dissipated, expansion or not."""
    for part in half_cycles_whose_work_is_heat(assembled(*settings)):
        assert (part.temperature[-1] > 0).all()


def test_expansion_moves_the_surfaces_in_every_direction() -> None:
    """An even temperature of a free body: what expands by alpha T in every direction."""
    corner = "{at=[0, 0], fix=['x']}"
    supports = f"strip.supports=[{{on='strip_bottom', fix=['z']}}, {corner}]"
    warm = assembled("strip.temperatures=[]", supports).law_state.problem
    assert warm.heat is not None
    punch, strip = warm.heat.exchange.bases
    even = np.concatenate([basis.coordinates(np.full(basis.body.owned, 10.0)) for basis in (punch, strip)])
    _, moved = (e(s) for e, s in zip(warm.heat.expansions, np.split(even, [len(punch)]), strict=True))
    at = warm.interface.middle.pair.transfer @ warm.interface.middle.pair.strip.trace
    alpha = 1.2e-5 * 1.3  # plane strain
    bottom = 6.0
    assert np.ptp(moved[:, 0] - alpha * 10 * at[:, 0]) < 1e-4 * np.ptp(moved[:, 0])
    assert np.ptp(moved[:, 1]) < 1e-4 * np.abs(moved[:, 1]).max()
    assert moved[:, 1].mean() == pytest.approx(alpha * 10 * bottom, rel=1e-3)


def test_long_strokes_are_as_warm_as_in_gross_sliding() -> None:
    """What is missing of the warmth is less than what is missing of friction's work, which falls as the stroke grows.

    Bodies take up the same part of any stroke, by which heat comes later, too: at nodes temperatures are shifted.
    """
    missing: list[list[float]] = []
    for amplitude in (25, 100):
        settings = [*SMALL, f"motion.amplitude='{amplitude} um'", "motion.positions=1", "run.half_cycles=4",
                    "geometry.parameters.overlap=0.1", "run.integration='explicit'", "heat.steps=10",
                    "wear.strip.coefficient=0"]  # fmt: skip
        known = assemble(load_case("fretting-partial-slip", ["wear={punch={coefficient=1e-30}}", *settings[:-1],
                                                             "contact.law='gross-sliding'", "stick={}"]))  # fmt: skip
        end = list(march(known, 4))[-1].heat
        assert end is not None
        last = list(march(assemble(load_case("fretting-partial-slip", settings)), 4))[-1]
        assert last.heat is not None
        work = known.bodies.punch.thickness * last.steps[-1].records.energy(known.pair.weights)
        warmth = last.heat.temperature_punch[-1].mean() / end.temperature_punch[-1].mean()
        missing.append([1 - work / end.terms[-1, 0], 1 - warmth])
    (work_of_short, short), (work_of_long, long) = missing
    assert 0 < short < work_of_short < 0.2
    assert 0 < long < work_of_long
    assert work_of_long < 0.3 * work_of_short
    assert long < 0.4 * short


@pytest.mark.slow
def test_jumps_get_as_warm_as_the_march() -> None:
    """The error of the temperatures falls with the tolerance of the jumps, whose last cycle is the next of a march."""
    warm, cycles = assembled(FAST, "geometry.parameters.elements_along_contact=10", "stick.steps=4"), 16
    marched = list(march(warm, 2 * (cycles + 1)))[-1].heat.temperature_punch[-1].max()
    errors = []
    for tolerance in (0.1, 5e-4):
        last = list(jump(warm, 2 * cycles, tolerance=tolerance))[-1]
        assert last.half_cycle[-1] == 2 * cycles
        records = TimeStepRecords.joined([steps.records for steps in last.steps[-2:]])
        assert last.heat.balance_error.max() < 1e-10
        errors.append(abs(records.temperature[-1, 0].max() / marched - 1))
    assert errors[1] < 0.5 * errors[0] < 0.02


def run(folder: Path, count: int, *, resume: bool = False) -> xarray.Dataset:
    settings = [
        *SMALL,
        FAST,
        "output.report=false",
        "output.uncertainty=false",
        "run.integration='explicit'",
        f"run.half_cycles={count}",
    ]
    case = load_case("fretting-partial-slip", settings)
    summary, _ = run_case(case, "warm", folder, lambda _: None, resume=resume, progress="none")
    assert summary["largest_heat_balance_error"] < 1e-8
    assert summary["largest_temperature_K"] > 0
    return by_cycles(load_history(folder))


def test_a_resumed_run_goes_on_as_warm(tmp_path: Path) -> None:
    """Temperatures go through the checkpoint; history and summary have them."""
    run(tmp_path / "parts", 2)
    resumed, whole = run(tmp_path / "parts", 6, resume=True), run(tmp_path / "whole", 6)
    for variable in ("temperature_punch", "pressure", "wear", "heat_friction"):
        difference, expected = np.abs(resumed[variable] - whole[variable]), np.abs(whole[variable])
        assert float(difference.max()) < 1e-9 * float(expected.max())
    parts, at_once = (json.loads((tmp_path / name / "summary.json").read_text("utf-8")) for name in ("parts", "whole"))
    largest = [name for name in at_once if name.startswith("largest_")]
    assert "largest_temperature_of_run_K" in largest
    assert [parts[name] for name in largest] == pytest.approx([at_once[name] for name in largest], rel=1e-6, abs=1e-10)


def test_the_end_is_without_heat_of_friction() -> None:
    """As without the table heat where all is at the initial temperature; else as warm as held boundaries make it."""
    cold = [setting for setting in SMALL if not setting.startswith(("heat", "strip.temperatures"))]
    exact, _ = final_of(assemble(load_case("fretting-partial-slip", cold)))
    same, numbers = final_of(assemble(load_case("fretting-partial-slip", list(SMALL))))
    assert same.depth == pytest.approx(exact.depth, abs=1e-12 * exact.depth.max())
    assert max(numbers["temperature_punch_K"]) == pytest.approx(0.0, abs=1e-12)
    held = "strip.temperatures=[{on='strip_bottom', temperature='50 K'}]"
    end, _ = final_of(assemble(load_case("fretting-partial-slip", [*SMALL, held])))
    assert end.temperature is not None
    assert 40 < end.temperature.min() < end.temperature.max() < 50
    zone = (end.pressures > 0).any(axis=0)
    assert end.temperature[0, zone] == pytest.approx(end.temperature[1, zone], abs=1e-9), "where it touches"
    assert (end.temperature[0, ~zone] < end.temperature[1, ~zone]).all(), "beside it the colder punch stands apart"


def test_what_does_not_go_with_heat_is_told() -> None:
    """The end of bodies that lose no heat, a full operator, the split."""
    with pytest.raises(CaseError, match=r"^heat\.convection: "):
        final_of(assemble(load_case("fretting-partial-slip", [*SMALL, "strip.temperatures=[]", "heat.convection=0"])))
    for setting, message in (("operator='full'", "heat.operator"), ("coupling='split'", "heat.coupling")):
        with pytest.raises(CaseError, match=f"{message}: expected"):
            load_case("fretting-partial-slip", [*SMALL, f"heat.{setting}"])
