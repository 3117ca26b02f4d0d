"""What a tribometer measures, against sums by hand: volumes, masses, rates, distances, forces, work."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear import Tribosystem, assemble, jump, load_case, march
from fenwear.case.templates import write_case_of
from fenwear.results.history_surfaces import without_noise
from fenwear.results.quantity import computed
from fenwear.results.registry import quantities_of
from fenwear.results.sheet import sheet_rows, sheet_text
from fenwear.results.stored_history import load_history
from fenwear.results.summary import sheet_of
from fenwear.steps import Block, follow
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.studies.run import run_case
from fenwear.surfaces.placement import in_model

Assemble = Callable[..., Tribosystem]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
K, FORCE, STROKE, MU = 4e-7, 1e4, 3.0, 0.25
FRETTING = (
    *("geometry.parameters.elements_along_contact=16", "geometry.parameters.contact_width=1.6", "geometry.degree=2"),
    *("geometry.follow_wear=0.1", "wear.punch.coefficient=2e-5", "wear.strip.coefficient=3e-5", "contact.friction=0"),
    *("motion.positions=3",),
)


def values(block: Block) -> dict[str, Any]:
    return computed(block, [one for one in quantities_of(block.system).values() if one.dims])


def last(blocks: Any) -> dict[str, Any]:
    """Return the sheet of the last half-cycle, with the block as "block"."""
    block: Block = list(blocks)[-1]
    return {
        "block": block,
        **{name: value[-1] for name, value in values(block).items()},
    }


@pytest.mark.parametrize("every", ["explicit", "implicit", "jump"])
@pytest.mark.mpi("jump")
def test_volume_is_k_f_s(assembled: Assemble, every: str) -> None:
    """Each number of the sheet of Example 1 by hand, to rounding, of marches and of jumps."""
    system = assembled("example1", *SMALL, f"wear.punch.coefficient={K}", "materials.composite.density='846 kg/m^3'")
    count = 240
    if every == "jump":
        blocks = list(jump(system, count, tolerance=0.05))
        assert sum(map(len, blocks)) < count / 2
    else:
        blocks = list(march_within(system, RunLimits(count, block=50), implicit=every == "implicit"))
    found, s = last(blocks), count * STROKE
    assert found["cycles"] == count / 2
    assert found["sliding_distance"] == pytest.approx(s, rel=1e-12)
    assert found["normal_force"] == pytest.approx(FORCE, rel=1e-10)
    assert found["friction_force"] == pytest.approx(MU * FORCE, rel=1e-10)
    assert found["friction_work"] == pytest.approx(MU * FORCE * s, rel=1e-10)
    assert found["worn_volume"] == pytest.approx(K * FORCE * s, rel=1e-10)
    assert found["worn_area"] == pytest.approx(K * FORCE * s / 10, rel=1e-10)
    assert found["worn_mass"] == pytest.approx(0.846 * K * FORCE * s, rel=1e-10)  # 846 kg/m³ = 0.846 mg/mm³
    for name in ("wear_rate", "mean_wear_rate"):
        assert found[name] == pytest.approx(1e3 * K, rel=1e-10)  # mm³/(N mm) in mm³/(N m)
    weights, block = system.pair.weights, found["block"]
    assert weights @ block.wear[-1] == pytest.approx(found["worn_area"], rel=1e-10)
    assert 10 * weights @ found["dissipated_energy"] == pytest.approx(found["friction_work"], rel=1e-10)
    # beta~ p ds is worn where mu p ds is dissipated.
    np.testing.assert_allclose(found["dissipated_energy"], MU / K * block.wear[-1], rtol=1e-9)
    deepest = int(np.argmax(block.wear[-1]))
    assert found["largest_depth"] == block.wear[-1].max()
    assert found["largest_depth_at_x"] == pytest.approx(system.pair.x[deepest], abs=1e-9)
    assert found["scar_width"] == pytest.approx(60, rel=1e-12)


def test_half_cycles_of_changing_load_and_square_law(assembled: Assemble) -> None:
    """b = 2 and a load that swings: sums over all half-cycles of what their pressures do."""
    loads = "punch.loads=[{on='punch_load', traction=[0, -16.666], over_cycle=[[0, 1.2], [0.4, 0.3], [1, 1.2]]}]"
    system = assembled("example1", *SMALL, "wear.punch.coefficient=1e-9", "wear.punch.pressure_exponent=2", loads)
    blocks = list(march_within(system, RunLimits(30, block=7)))
    pressure = np.concatenate([block.pressure for block in blocks])
    found, weights = last(blocks), 10 * system.pair.weights
    volume = 1e-9 * STROKE * (pressure**2 @ weights)
    path = STROKE * (pressure @ weights)
    assert np.ptp(path) > 0.1 * path.mean()
    assert found["worn_volume"] == pytest.approx(volume.sum(), rel=1e-12)
    assert found["mean_wear_rate"] == pytest.approx(1e3 * volume.sum() / path.sum(), rel=1e-12)
    assert found["wear_rate"] == pytest.approx(1e3 * volume[-1] / path[-1], rel=1e-12)
    assert found["friction_work"] == pytest.approx(MU * path.sum(), rel=1e-12)
    np.testing.assert_allclose(found["dissipated_energy"], MU * STROKE * pressure.sum(axis=0), rtol=1e-12)


def test_work_is_the_heat_that_friction_makes(assembled: Assemble) -> None:
    """Both are computed apart, from the same pressures."""
    system = assembled("example1-heat", *SMALL)
    (block,) = march(system, 12)
    assert block.heat is not None
    np.testing.assert_allclose(values(block)["friction_work"], np.cumsum(block.heat.terms[:, 0]), rtol=1e-9)


@pytest.mark.parametrize("how", ["march", "jump"])
def test_both_bodies_after_their_meshes_have_followed(assembled: Assemble, how: str) -> None:
    """k F s of punch and strip to rounding, where depths times the weights of any one mesh are off."""
    system = assembled("fretting", *FRETTING)
    count = 400 if how == "march" else 800

    way = partial(march_within, implicit=True) if how == "march" else partial(jump_within, tolerance=0.2)
    blocks = list(follow(system, way, RunLimits(count)))
    assert blocks[-1].system is not system
    found, block = last(blocks), blocks[-1]
    path = float(block.totals.of("load_path")[-1])
    for end, k in (("", 2e-5), ("_strip", 3e-5)):
        assert found[f"worn_volume{end}"] == pytest.approx(k * path, rel=1e-12)
        assert found[f"mean_wear_rate{end}"] == pytest.approx(1e3 * k, rel=1e-12)
    assert path == pytest.approx(18.5 * 0.05 * count, rel=1e-9)  # the load, as it has no friction
    assert found["normal_force"] == pytest.approx(18.5, rel=1e-9)
    assert found["sliding_distance"] == pytest.approx(0.05 * count, rel=1e-12)
    by_depth = block.system.pair.strip.weights @ block.wear_strip[-1]
    assert by_depth == pytest.approx(found["worn_area_strip"], rel=0.02)
    if how == "march":
        pressures = np.concatenate([b.adds.of("load_path") for b in blocks])
        assert path == pytest.approx(pressures.sum(), rel=1e-12)


def test_what_is_jumped_over_is_counted(assembled: Assemble) -> None:
    """The energy of each place after jumps nears that of a march as their tolerance falls."""
    settings = (*SMALL, f"wear.punch.coefficient={K}")
    system, count = assembled("example1", *settings), 400
    exact = last(march(system, count, implicit=True))["dissipated_energy"]
    errors = []
    for tolerance in (0.1, 1e-3):
        found = last(jump(system, count, tolerance=tolerance))["dissipated_energy"]
        errors.append(np.abs(found - exact).max() / exact.max())
    assert errors[1] < min(0.01, errors[0])


def test_forces_of_a_curved_contact_are_those_of_a_rig(tmp_path: Path) -> None:
    """A bushing on its shaft: the load is what is applied; the torque that of friction; volume k times the law's path.

    The integral of the pressure over the arc is more than the load, 4 / pi times at most; and so is the specific wear
    rate of a rig more than that of the law.
    """
    path = tmp_path / "bushing.toml"
    write_case_of("bushing", path)
    system = assemble(load_case(path, ["geometry.parameters.elements_along_contact=20", "geometry.degree=2"]))
    (block,) = march(system, 3)
    found, pair, thickness = values(block), system.pair, system.bodies.punch.thickness
    mu, law = system.case.contact.friction, system.case.wear.punch
    assert law is not None
    force = thickness * block.pressure[:, :, None] * pair.weights[:, None] * pair.normal
    # Tractions of friction are along the normals turned by 90 degrees, to the side that the shaft goes.
    turned = mu * np.stack([pair.normal[:, 1], -pair.normal[:, 0]], axis=1)
    turned *= np.sign(in_model(system.sliding.field.velocity(pair.opposite), 2)[:, :1] * turned[:, :1]).max()
    drag = thickness * np.einsum("kn,n,nd->kd", block.pressure, pair.weights, turned)
    load = 800.0
    np.testing.assert_allclose(force.sum(axis=1)[:, 1] + drag[:, 1], load, rtol=1e-9)
    np.testing.assert_allclose(found["normal_force"], load, rtol=1e-9)
    np.testing.assert_allclose(found["friction_force"], np.linalg.norm(drag, axis=1), rtol=1e-9)
    integral = thickness * block.pressure @ pair.weights
    np.testing.assert_allclose(found["pressure_integral"], integral, rtol=1e-12)
    assert (load * 1.005 < integral).all()
    assert (integral < load * 4 / np.pi).all()
    radius = system.case.geometry.parameters["radius"]
    np.testing.assert_allclose(found["friction_torque"], mu * integral * radius, rtol=1e-3)  # the facets are chords
    np.testing.assert_allclose(found["law_wear_rate"], 1e3 * law.coefficient, rtol=1e-9)
    by_rig = 1e3 * np.diff(found["worn_volume"], prepend=0.0) / load / np.diff(found["sliding_distance"], prepend=0.0)
    np.testing.assert_allclose(found["wear_rate"], by_rig, rtol=1e-9)
    np.testing.assert_allclose(found["wear_rate"], 1e3 * law.coefficient * integral / load, rtol=1e-6)
    sliding = sheet_of(block)["sliding"]
    assert sliding["friction_coefficient"] == pytest.approx(mu, rel=1e-9)
    assert sliding["friction_over_load"] == pytest.approx(mu * integral.mean() / load, rel=1e-6)


def test_turning_strip(assembled: Assemble) -> None:
    """A disc under a pin: the arc at the load's mean radius is slid, and k F s worn, to rounding."""
    system = assembled("pin-on-disc", "geometry.degree=1", "geometry.order=1")
    (block,) = march(system, 3)
    found, case, pair = values(block), system.case, system.pair
    radius = np.linalg.norm(pair.punch.x[:, :2], axis=1)
    angle = sum(phase.distance for phase in system.motion.phases) * 3 / len(system.motion.phases)
    force = block.pressure * pair.weights
    slid = angle / 3 * (force @ radius) / force.sum(axis=1)
    np.testing.assert_allclose(found["sliding_distance"], np.cumsum(slid), rtol=1e-12)
    path = angle / 3 * (block.pressure @ (pair.weights * radius)).sum()
    law, mu = case.wear.punch, case.contact.friction
    assert law is not None
    assert isinstance(law.coefficient, float)
    assert found["worn_volume"][-1] == pytest.approx(law.coefficient * path, rel=1e-12)
    by_hand = law.coefficient * found["normal_force"][-1] * found["sliding_distance"][-1]
    assert found["worn_volume"][-1] == pytest.approx(by_hand, rel=1e-12)
    # The pin is as wide as the directions of sliding differ over it: friction has a resultant of less than mu F.
    arms = pair.punch.x[:, :2] / radius[:, None]
    np.testing.assert_allclose(found["friction_force"], mu * np.linalg.norm(force @ arms, axis=1), rtol=1e-9)
    np.testing.assert_allclose(found["friction_torque"], mu * force @ radius, rtol=1e-9)
    assert found["friction_work"][-1] == pytest.approx(mu * path, rel=1e-12)
    assert "worn_area" not in quantities_of(system)
    assert {"scar_width", "scar_length_5_percent", "largest_depth_at_y"} <= set(quantities_of(system))


@pytest.mark.mpi
def test_density_of_what_is_worn(assembled: Assemble) -> None:
    """That of the region at the contact, not of the body's other ones."""
    punch, strip = assembled("example1-heat", *SMALL).bodies.densities
    assert punch is not None
    assert strip is not None
    np.testing.assert_allclose(punch, 846e-12, rtol=1e-14)
    np.testing.assert_allclose(strip, 7800e-12, rtol=1e-14)
    assert assembled("example1", *SMALL).bodies.densities == (None, None)


def run(folder: Path, *settings: str, name: str = "example1", resume: bool = False) -> tuple[xarray.Dataset, Any]:
    case = load_case(
        name,
        [
            *SMALL,
            f"wear.punch.coefficient={K}",
            "output.report=false",
            "output.uncertainty=false",
            "output.fields_at=[]",
            *settings,
        ],
    )
    summary, _ = run_case(case, "test", folder, lambda message: None, resume=resume)
    return load_history(folder), summary


def test_half_cycles_that_are_not_kept_and_a_restart(tmp_path: Path) -> None:
    """The sums of all, whichever are in the file; a run in two parts ends with those of one."""
    all_kept, _ = run(tmp_path / "all", "run.half_cycles=60")
    few, _ = run(tmp_path / "few", "run.half_cycles=60", "output.every=7")
    run(tmp_path / "parts", "run.half_cycles=24")
    parts, summary = run(tmp_path / "parts", "run.half_cycles=60", resume=True)
    names = [name for name in all_kept.data_vars if str(name).startswith(("worn", "friction", "dissip", "mean_wear"))]
    assert len(names) > 5
    for name in names:
        kept = all_kept[name].sel(half_cycle=few.half_cycle)
        np.testing.assert_array_equal(few[name], kept)
        np.testing.assert_allclose(parts[name], all_kept[name], rtol=1e-13)
    assert summary["punch"]["worn_volume_mm3"] == float(parts.worn_volume[-1])
    assert np.trapezoid(np.gradient(all_kept.worn_volume)) > 0
    assert json.loads((tmp_path / "parts" / "summary.json").read_text())["sliding"] == summary["sliding"]


def test_sheet_for_people(assembled: Assemble) -> None:
    """Labels, units, a column for each body; no mass without a density."""
    (block,) = march(assembled("fretting", *SMALL), 4)
    text = sheet_text(sheet_of(block))
    lines = {line.partition("  ")[0]: line.split()[-2:] for line in text.splitlines()}
    assert lines["sliding distance (m)"][1] == "0.0002"
    assert [float(v) for v in lines["specific wear rate, mean (mm³/(N m))"]] == pytest.approx([1.9e-5, 2.9e-5])
    assert "mass" not in text
    assert "punch" in text
    assert "strip" in text


def test_a_ring_slides_its_own_circumference(assembled: Assemble) -> None:
    """Under a flat block, however much of it is meshed: omega R t, which the ends of the block are beyond."""
    for width in (1, 4):
        settings = (f"geometry.parameters.contact_width={width}", "geometry.parameters.elements_along_contact=24")
        system = assembled("block-on-ring", *settings)
        (block,) = march(system, 2)
        angle = sum(phase.distance for phase in system.motion.phases) * 2 / len(system.motion.phases)
        radius = float(np.linalg.norm(system.pair.strip.x, axis=1).min())
        assert values(block)["sliding_distance"][-1] == pytest.approx(angle * radius, rel=1e-5)


def test_rounding_of_a_mesh_is_no_place() -> None:
    """The middle is 0; a place that a node may have stays as it is, of a contact of any size."""
    for size in (1e-3, 1.0, 1e3):
        places = size * np.array([[4e-9, -20.0, 1e-3], [-4e-9, 1.23456789, 0.0]])
        np.testing.assert_array_equal(without_noise(places, 40 * size), places * (np.abs(places) > 1e-6 * size))


def test_where_the_heat_went() -> None:
    """The heat of the last half-cycle, in J; what there is none of is not told."""
    terms = {"friction": 7500.0, "debris": 3750.0, "stored": 3593.0, "convected": 157.0, "held": 0.0, "carried": 0.0}
    rows = {label: values for label, unit, values in sheet_rows({"heat_mJ": terms}) if unit == "J"}
    assert len(rows) == 4
    made, *gone = (value for (value,) in rows.values())
    assert made == 7.5
    assert sum(gone) == pytest.approx(made, rel=1e-12)
