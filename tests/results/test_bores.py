"""A shaft in two bushings: the force and the shaft's place in each of them, by its name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

from fenwear import assemble, load_case, march, vary
from fenwear.results.forces_and_place import quantities
from fenwear.results.quantity import computed
from fenwear.results.summary import contact_sheets
from fenwear.steps import evolve
from fenwear.studies.run import run_case

MU, CLEARANCE = 0.1, 0.02
COARSE = [
    "geometry.parameters.fine_elements=8", "geometry.parameters.beyond_elements=8", "geometry.parameters.along=2",
    "geometry.parameters.between_elements=2", "geometry.parameters.overhang_elements=1",
    "geometry.parameters.wall_layers=1", "geometry.parameters.shaft_layers=1",
]  # fmt: skip


@pytest.mark.mpi
def test_each_bushing_has_its_own() -> None:
    """Loads between the bushings and beyond them: each carries its share, and the shaft climbs in each by atan mu.

    Beyond the bushings the shaft lies on the lower side of the one that is farther away.
    """
    system = assemble(load_case("two-bushings", COARSE))
    between, beyond = (next(march(vary(system, f"strip.loads.0.through=[0, {at}, 0]"), 1)) for at in (10.0, 45.0))
    # Beyond, it is so far from being in line that each bushing touches at an end, where its middle has some play.
    for block, signs, play in ((between, (1, 1), 0.1), (beyond, (-1, 1), 0.4)):
        sheets, found = contact_sheets(block), computed(block, quantities(block.system))
        assert list(sheets) == ["left", "right"]
        assert sum(one["force_z_N"] for one in sheets.values()) == pytest.approx(2000, rel=1e-9)
        assert sum(one["force_x_N"] for one in sheets.values()) == pytest.approx(0, abs=1e-6)
        for (name, one), sign in zip(sheets.items(), signs, strict=True):
            assert one["force_z_N"] * sign > 0
            assert one["attitude_angle_deg"] == pytest.approx(-np.degrees(np.arctan(MU)), abs=1)
            assert found[f"eccentricity_z_{name}"][-1] * sign == pytest.approx(CLEARANCE, rel=play)
            assert one["eccentricity_mm"] == found[f"eccentricity_{name}"][-1]
    # Under a light load, which bends nothing, the shaft's places differ by its tilt.
    light = vary(system, "strip.loads.0.through=[0, 45, 0]", "strip.loads.0.force=[0, 0, 20]")
    found = computed(next(march(light, 1)), quantities(light))
    moved = (found["eccentricity_z_right"] - found["eccentricity_z_left"])[-1]
    assert 60 * found["turned_x_strip"][-1] == pytest.approx(moved, rel=5e-3)


def test_in_the_results(tmp_path: Path) -> None:
    """Places and angles of each in the history; the summary has them in the contacts' sheets, and not for both."""
    case = load_case("two-bushings", [*COARSE, "run.half_cycles=1", "output.report=false", "output.uncertainty=false"])
    summary, directory = run_case(case, "shaft", tmp_path / "run", lambda _message: None, progress="none")
    assert "eccentricity_mm" not in summary
    right = summary["contacts"]["right"]
    with xarray.open_dataset(directory / "history.nc", engine="h5netcdf") as history:
        assert float(history.eccentricity_right[-1]) == right["eccentricity_mm"]
        assert "(right)" in history.attitude_angle_right.attrs["long_name"]
        assert "eccentricity" not in history


@pytest.mark.parametrize("integration", ["explicit", "jump"])
def test_on_meshes_that_follow(integration: str) -> None:
    """The shaft's place does not depend on whether the depths move the mesh or open the gap."""
    small = ["geometry.degree=1", "geometry.parameters.elements_along_contact=40", "run.half_cycles=4"]
    fast = "wear.punch.coefficient=1e-6"
    found = []
    for follow in ("0.001", "never"):
        case = load_case("bushing", [*small, fast, f"geometry.follow_wear={follow}", f"run.integration={integration}"])
        last = list(evolve(assemble(case)))[-1]
        found.append({name: value[-1] for name, value in computed(last, quantities(last.system)).items()})
    one, other = found
    assert one["eccentricity"] == pytest.approx(other["eccentricity"], rel=2e-3)
    assert one["attitude_angle"] == pytest.approx(other["attitude_angle"], abs=0.1)
