"""One registry of quantities: runs, steady states and studies compute each by one definition, under one name."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, assemble, load_case, steady
from fenwear.report.key_numbers import flat, read_summary
from fenwear.results import layer_results
from fenwear.results.history_surfaces import at_places
from fenwear.results.quantity import RECORD, Quantity, computed
from fenwear.results.registry import known, quantities_of
from fenwear.results.stored_history import current_names, load_history
from fenwear.results.summary import nominal_pressure
from fenwear.steps import evolve
from fenwear.steps.run_state import beginning
from fenwear.steps.steady_cycle import cycle_of_state
from fenwear.studies import Model, evaluate, parse_quantity, read_data
from fenwear.studies.run import run_case

JUMPS = ["run.integration=jump", "geometry.degree=1"]
FINE = "geometry.parameters.elements_along_contact"
CASES: dict[str, list[str]] = {
    "ball-on-flat": ["geometry.parameters.across=4", "geometry.parameters.core=0", "run.half_cycles=8",
                     "geometry.parameters.core_elements=0", "geometry.order=1", "motion.positions=2"],
    "ring-in-groove": ["run.half_cycles=4"],
    "bushing": [f"{FINE}=40", "run.half_cycles=40"],
    "fretting": [f"{FINE}=20", "run.half_cycles=8"],
    "fretting-partial-slip": [f"{FINE}=12", "stick.steps=4", "stick.step_tolerance=1", "run.half_cycles=8"],
}  # fmt: skip
BOOKS = {"half_cycle", "time", "direction", "retries", "coupling_iterations"}  # of the way a run has taken


def asked(one: Quantity) -> str:
    """Return how a study asks for a quantity."""
    return f"{one.name.removesuffix('_strip')} of strip" if one.name.endswith("_strip") else one.name


@pytest.mark.parametrize("name", CASES)
def test_a_study_computes_what_the_run_does(name: str) -> None:
    """A solid, rings with two contacts, a closed bore, positions of the strip, and stick: all single numbers agree.

    Once widths of scars were chained along x, gaps between contacts counted as scar, and pressures were the largest of
    all positions.
    """
    case = load_case(name, [*JUMPS, *CASES[name]])
    *_, last = evolve(assemble(case))
    model, compared = Model(case), 0
    for one in quantities_of(last.system).values():
        if one.dims in (RECORD, ()) and one.name not in BOOKS and np.isfinite(value := float(one.of_cycle(last))):
            found = evaluate(model, parse_quantity(asked(one)), {})[0]
            assert found == pytest.approx(value, rel=1e-7, abs=1e-12), one.name
            compared += 1
    assert compared > 20
    if name == "ring-in-groove":  # flanks of 7 mm on either side of the groove
        assert evaluate(model, parse_quantity("scar_width"), {})[0] == pytest.approx(7.0)
        with pytest.raises(CaseError, match="contact_area"):  # of rings it is an area
            evaluate(model, parse_quantity("contact_width"), {})
    if name == "ball-on-flat":
        deepest = last.system.pair.punch.x[last.wear[-1].argmax()]
        at = ", ".join(f"{float(c)!r} mm" for c in deepest[:2])
        depth = evaluate(model, parse_quantity(f"wear at {at}"), {})[0]
        assert depth == pytest.approx(last.wear[-1].max(), rel=1e-9)


def test_places_on_surfaces() -> None:
    """Linear functions are exact between a solid's nodes; a closed curve has no gap at its seam; NaN beside them."""
    solid = assemble(load_case("ball-on-flat", [*JUMPS, *CASES["ball-on-flat"]])).pair.punch
    places = np.array([[0.11, 0.07], [-0.2, 0.13], [9.0, 0.0]])
    found = at_places(solid, 2 + 3 * solid.x[:, 0] - solid.x[:, 1], places)
    np.testing.assert_allclose(found[:2], 2 + 3 * places[:2, 0] - places[:2, 1], rtol=1e-12)
    assert np.isnan(found[2])
    bore = assemble(load_case("bushing", [*JUMPS, *CASES["bushing"]])).pair.punch
    ends = np.sort(bore.abscissa)
    step = np.diff(ends).max()
    along = np.linspace(ends[0], ends[-1] + 0.9 * step, 301)
    np.testing.assert_allclose(at_places(bore, np.ones(len(ends)), along), 1.0, rtol=1e-12)
    np.testing.assert_allclose(at_places(bore, bore.abscissa, along[along <= ends[-1]]), along[along <= ends[-1]])


def test_nominal_and_mean_pressure() -> None:
    """F / (D L) of a bushing; a cylinder has none, and pi / 4 of the largest pressure over the area in contact."""
    bushing = assemble(load_case("bushing", [*JUMPS, f"{FINE}=160"]))
    radius = float(np.linalg.norm(bushing.pair.strip.x, axis=1).mean())  # of the shaft
    area = 2 * radius * bushing.bodies.punch.thickness
    found = nominal_pressure(bushing, bushing.normal_force)["nominal_pressure"]
    assert found == pytest.approx(bushing.normal_force / area, rel=2e-3)  # of the bore, wider by a thousandth
    case = load_case(
        "fretting",
        [
            *JUMPS,
            f"{FINE}=60",
            "geometry.parameters.contact_width=0.3",
            "run.half_cycles=2",
            "wear.punch.coefficient=1e-14",
        ],
    )
    *_, last = evolve(assemble(case))
    mean, largest = (
        float(quantities_of(last.system)[f"{name}_pressure"].of_cycle(last)) for name in ("mean", "largest")
    )
    assert mean == pytest.approx(np.pi / 4 * largest, rel=0.08)
    assert nominal_pressure(last.system, 1.0) == {}


def test_a_coating_is_worn_through_in_a_share_of_its_scar() -> None:
    """Half of the scar, a tenth of the coated surface."""
    depth = np.array(
        [[0.0, 0.0, 0.0, 0.5, 1.2, 1.2, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    )
    weights = np.ones(depth.shape[1])
    pair = SimpleNamespace(weights=weights, strip=SimpleNamespace(weights=weights))
    system = SimpleNamespace(pair=pair, laws=SimpleNamespace(coatings=(np.ones(len(weights)), np.zeros(len(weights)))))
    block: Any = SimpleNamespace(system=system, wear=depth, wear_strip=0 * depth)
    found = computed(block, layer_results.of_coated("punch"))
    assert found["worn_through_of_scar"] == pytest.approx([0.5])
    assert found["worn_through_of_surface"] == pytest.approx([0.1])


@pytest.mark.parametrize("ratio", [10.0, 0.1])
def test_when_a_coating_is_worn_through(ratio: float) -> None:
    """Stiff bodies on an even layer: after 2.4 half-cycles everywhere, however fast the base wears in the third."""
    stiff = [f"materials.{name}.young='1e9 MPa'" for name in ("steel", "composite")]
    stiff.append("contact.layer={kind='linear', stiffness='1e3 N/mm^3'}")
    depth = 1e-8 * 1e4 / 600 * 3  # of a half-cycle of 3 mm, mm
    coating = f"wear.punch.coating={{thickness={2.4 * depth!r}, coefficient=1e-8}}"
    small = ["geometry.degree=1", "geometry.parameters.elements_along_contact=4", "run.half_cycles=4"]
    system = assemble(load_case("example2", [*small, *stiff, coating, f"wear.punch.coefficient={ratio * 1e-8!r}"]))
    (block,) = evolve(system)
    found = layer_results.worn_through(block, beginning(system), {})
    assert found["punch_coating_first_through_half_cycle"] == pytest.approx(2.4, rel=1e-3)
    assert found["punch_coating_last_through_half_cycle"] == pytest.approx(2.4, rel=1e-3)


def test_a_steady_state_has_forces_and_torque() -> None:
    """Torque of friction is the sum of mu p r dA, the load what is put on, the coefficient mu."""
    state = steady(assemble(load_case("pin-on-disc", ["geometry.degree=1", "geometry.order=1"])))
    system, cycle = state.system, cycle_of_state(state)
    numbers = {name: float(one.of_cycle(cycle)) for name, one in quantities_of(system).items() if one.dims == RECORD
               and one.steady}  # fmt: skip
    radius = np.linalg.norm(system.pair.punch.x[:, :2], axis=1)
    mu = system.case.contact.friction
    torque = mu * float((system.pair.weights * state.pressure[0]) @ radius)
    assert numbers["friction_torque"] == pytest.approx(torque, rel=1e-6)
    assert numbers["normal_force"] == pytest.approx(100.0, rel=1e-9)
    assert numbers["friction_coefficient"] == pytest.approx(mu, rel=1e-9)


def test_motion_and_creep_are_data(tmp_path: Path) -> None:
    """Columns of a measurement may have any number of the registry, in any unit of its kind."""
    path = tmp_path / "approach.csv"
    path.write_text("# sigma = 0.1 um\nafter (cycles), moved_z (um)\n10, -3.5\n20, -4.5\n")
    (series,) = read_data(path, load_case("example2")).series
    assert series.quantity == "moved_z"
    np.testing.assert_allclose(series.values, [-3.5e-3, -4.5e-3])
    for name, unit in (("moved_z", "mm"), ("largest_creep_depth", "mm"), ("creep_volume", "mm3"), ("turned_y", "rad")):
        found = known(name)
        assert found is not None
        assert found.unit == unit


def test_names_of_a_run_and_of_older_files(tmp_path: Path) -> None:
    """No key has a space; histories and summaries of older runs are read with the names of today."""
    small = ["run.half_cycles=2", "geometry.degree=2", f"{FINE}=4", "output.report=false"]
    case = load_case("example1-heat", [*small, "run.integration=explicit"])
    summary, folder = run_case(case, "names", tmp_path / "run", lambda _message: None, progress="none")
    assert not [path for path in flat({k: v for k, v in summary.items() if k != "warnings"}) if " " in path]
    history, told = load_history(folder), read_summary(folder)
    assert told["rightward"]["largest_pressure_MPa"] == history.largest_pressure.values[0]
    told.pop("uncertainty")
    older = json.loads(json.dumps(told))
    older["max_temperature_K"], older["largest_temperature_K"] = (
        older.pop("largest_temperature_K"), older.pop("largest_temperature_of_run_K"),
    )  # fmt: skip
    for way in ("rightward", "leftward"):
        older[way]["max_pressure_MPa"] = older[way].pop("largest_pressure_MPa")
    older["punch"]["at_x_mm"] = older["punch"].pop("largest_depth_at_x_mm")
    older["punch"]["scar_width_1_percent_mm"] = older["punch"].pop("scar_width_mm")
    older["sliding"]["friction_coefficient"] = older["sliding"].pop("mean_friction_coefficient")
    (folder / "summary.json").write_text(json.dumps(older))
    again = read_summary(folder)
    told["sliding"].pop("friction_coefficient")  # which older ones did not have
    assert json.dumps(again, sort_keys=True) == json.dumps(told, sort_keys=True)
    renamed = current_names(["max_wear", "max_wear_x_strip", "scar_width_5", "largest_temperature"])
    assert renamed == {
        "max_wear": "largest_depth", "max_wear_x_strip": "largest_depth_at_x_strip",
        "scar_width_5": "scar_width_5_percent", "largest_temperature": "largest_temperature_of_run",
    }  # fmt: skip
    assert not current_names(history.variables)
