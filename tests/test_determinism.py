"""The same run again gives the same bits; other numbers of ranks the same numbers, to 1e-9."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray

Run = Callable[..., Any]
SMALL = ("output.report=false", "geometry.degree=2", "geometry.parameters.elements_along_contact=8")
CASES = {
    "explicit": ("example1", "run.half_cycles=100"),
    "implicit": ("example2", "run.half_cycles=40", "run.integration=implicit"),
    "jump": ("example1", "run.half_cycles=2000", "run.integration=jump"),
    "heat": ("example1-heat", "run.half_cycles=60"),
    "two worn bodies": ("fretting", "run.half_cycles=2000", "motion.positions=5"),
    "followed meshes": ("example1-heat", "run.half_cycles=30", "run.integration=implicit", "geometry.follow_wear=1e-5"),
    "full heat": ("example1-heat", "run.half_cycles=30", "heat.operator=full"),
}


# run(name, ranks, number): the history of a run, each of them made once.
MakeRun = Callable[[str, int, int], xarray.Dataset]


@pytest.fixture(scope="module")
def run(fenwear: Run, tmp_path_factory: pytest.TempPathFactory) -> MakeRun:
    @cache
    def run(name: str, ranks: int, number: int) -> xarray.Dataset:
        folder, (case, *settings) = tmp_path_factory.mktemp("run") / "run", CASES[name]
        words = [word for setting in (*SMALL, *settings, "output.fields_at=[]") for word in ("--set", setting)]
        done = fenwear("run", case, "-o", folder, *words, ranks=ranks)
        assert done.returncode == 0, done.stderr
        with xarray.open_dataset(folder / "history.nc", engine="h5netcdf") as history:
            return history.load()

    return run


def give_way(history: xarray.Dataset) -> float:
    """Return the load per thickness over Young's modulus: what steel bodies give way by, mm."""
    return float((history.pressure[-1] * history.weight[-1]).sum()) / 2e5


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("name", CASES)
def test_the_same_bits_again(run: MakeRun, name: str, ranks: int) -> None:
    """Every variable of history.nc, bit by bit."""
    one, again = (run(name, ranks, number) for number in (1, 2))
    assert set(one.variables) == set(again.variables)
    for variable in one.variables:
        assert one[variable].values.tobytes() == again[variable].values.tobytes(), variable


@pytest.mark.parametrize("name", CASES)
def test_other_ranks_give_the_same_numbers(run: MakeRun, name: str) -> None:
    """1, 2 and 3 ranks to 1e-9 of each largest value; gaps of what the bodies give way by, heats of friction."""
    one, *others = (run(name, ranks, 1) for ranks in (1, 2, 3))
    measures = ("equilibrium_error", "heat_balance_error", "coupling_iterations")  # of rounding itself
    for other in others:
        np.testing.assert_array_equal(other.half_cycle, one.half_cycle)
        if "coupling_iterations" in one:  # one more where a change is as large as the tolerance
            assert abs(other.coupling_iterations - one.coupling_iterations).max() <= 1
        for variable in sorted(set(one.data_vars) - set(measures)):
            # The heat that a sinusoidal motion carries away is a sum of rounding, and so is a gap closed everywhere.
            measure = "heat_friction" if str(variable).startswith("heat_") else str(variable)
            scale = float(np.abs(one[measure]).max()) if variable != "gap" else give_way(one)
            np.testing.assert_allclose(other[variable], one[variable], rtol=0, atol=1e-9 * scale, err_msg=str(variable))
