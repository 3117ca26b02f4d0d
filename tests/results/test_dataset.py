"""A run from Python as a dataset: what the folder of the same run holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import CaseError, assemble, evolve, load_case, read_history, run_case, to_dataset

COARSE = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4")
CASES = {
    "warm": ("example1-heat", *COARSE, "run.half_cycles=6", "heat.initial='20 degC'", "heat.ambient='20 degC'"),
    "moving": (  # the meshes follow the wear
        "fretting", "geometry.degree=1", "geometry.parameters.elements_along_contact=16", "geometry.follow_wear=0.002",
        "run.half_cycles=600", "motion.positions=3",
    ),
    "program": (
        "example1", *COARSE, "run.half_cycles=8",
        "program={steps=[{cycles=2, load_factor=1}, {cycles=2, load_factor=[1, 2]}]}",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_as_on_the_command_line(name: str, tmp_path: Path) -> None:
    """Evolved in Python, a case gives the history of its run: every variable, its units and its words."""
    source, *settings = CASES[name]
    case = load_case(source, [*settings, "output.report=false", "output.uncertainty=false", "output.fields_at=[]"])
    told: list[str] = []
    run_case(case, name, tmp_path / name, told.append, progress="none")
    written = read_history(tmp_path / name)
    blocks = list(evolve(assemble(case)))
    data = to_dataset(blocks)
    assert (blocks[-1].system.bodies.followed is not None) == (name == "moving")
    assert set(data.variables) == set(written.variables)
    for variable in written.variables:
        np.testing.assert_allclose(data[variable], written[variable], rtol=1e-8, atol=1e-12, err_msg=variable)
        assert data[variable].attrs["units"] == written[variable].attrs["units"]
        assert data[variable].attrs["long_name"] == written[variable].attrs["long_name"]
    assert data.pressure.sel(x=0, method="nearest").sizes == {"half_cycle": written.sizes["half_cycle"]}
    assert to_dataset(blocks[-1]).sizes["half_cycle"] == len(blocks[-1])
    with pytest.raises(CaseError, match="blocks: expected at least one"):
        to_dataset([])
