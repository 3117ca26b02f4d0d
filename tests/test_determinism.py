"""The same run again gives the same bits; other numbers of ranks the same numbers, to 1e-9."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from fenwear.results.stored_history import load_history

Run = Callable[..., Any]
SMALL = (
    "output.report=false",
    "output.uncertainty=false",
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
)
CASES = {
    "explicit": ("example1", "run.half_cycles=60"),
    "implicit": ("example2", "run.half_cycles=20", "run.integration=implicit"),
    "jump": ("example1", "run.half_cycles=2000", "run.integration=jump"),
    "two worn bodies": ("fretting", "run.half_cycles=2000", "motion.positions=5"),
    # Several ranks talk a hundred times in each of their steps: few half-cycles; after the first the meshes are moved.
    "followed meshes": ("example1-heat", "run.half_cycles=2", "run.integration=implicit", "geometry.follow_wear=5e-6"),
    "full heat": ("example1-heat", "run.half_cycles=2", "heat.operator=full"),
}
# A third rank shares set-ups; half-cycles rank 0 computes on any number of them.
ON_THREE = ("plane with heat", "columns")
# Where ranks talk within the steps, and where they share nothing but the set-up: as for whatever else rank 0 computes.
AGAIN_ON_TWO = ("jump", "full heat")
ON_TWO = (*AGAIN_ON_TWO, "followed meshes", "solid")
AGAIN_ON_ONE = tuple(name for name in CASES if name not in (*AGAIN_ON_TWO, "followed meshes"))
# Results equal to the last bit on any number of ranks.
EVERYWHERE = {
    "plane with heat": ("example1-heat", "run.half_cycles=30", *SMALL, "setup.reproducible=true"),
    "columns": ("example2", "run.half_cycles=30", *SMALL, "setup.reproducible=true"),
    "solid": (
        "ball-on-flat",
        "run.half_cycles=2",
        "output.report=false",
        "output.uncertainty=false",
        "geometry.parameters.across=4",
        "geometry.parameters.core=0",
        "setup.reproducible=true",
    ),
}


# All cases one after the other, in one process: what starts anew is its hash seed, memory and ranks.
ALL = """
import json, sys
from pathlib import Path
from fenwear import load_case
from fenwear.studies.run import run_case

for name, (case, *settings) in json.loads(sys.argv[2]).items():
    run_case(load_case(case, settings), name, Path(sys.argv[1]) / name, lambda message: None, progress="none")
"""
Histories = dict[str, xarray.Dataset]


@pytest.fixture
def run(run_python: Run, tmp_path: Path) -> Callable[[int, Iterable[str]], Histories]:
    """Return run(ranks, names): histories of cases, of one process that begins anew."""

    def run(ranks: int, names: Iterable[str]) -> Histories:
        cases = {name: [CASES[name][0], *SMALL, "output.fields_at=[]", *CASES[name][1:]] for name in CASES}
        cases |= {name: list(settings) for name, settings in EVERYWHERE.items()}
        folder = tmp_path / f"{ranks} {len(list(tmp_path.iterdir()))}"
        asked = json.dumps({name: cases[name] for name in names})
        done = run_python("-m", "mpi4py", "-c", ALL, folder, asked, ranks=ranks)
        assert done.returncode == 0, done.stderr
        return {name: load_history(folder / name) for name in names}

    return run


def give_way(history: xarray.Dataset) -> float:
    """Return the load per thickness over Young's modulus: what steel bodies give way by, mm."""
    return float((history.pressure[-1] * history.weight[-1]).sum()) / 2e5


def check_same_bits(one: xarray.Dataset, again: xarray.Dataset) -> None:
    """Every variable of history.nc, bit by bit."""
    assert set(one.variables) == set(again.variables)
    for variable in one.variables:
        assert one[variable].values.tobytes() == again[variable].values.tobytes(), variable


def check_same_numbers(one: xarray.Dataset, other: xarray.Dataset) -> None:
    """To 1e-9 of each largest value; gaps of what the bodies give way by, heats of friction."""
    measures = (
        "equilibrium_error",
        "complementarity_error",
        "heat_balance_error",
        "coupling_iterations",
    )  # of rounding itself
    np.testing.assert_array_equal(other.half_cycle, one.half_cycle)
    if "coupling_iterations" in one:  # one more where a change is as large as the tolerance
        assert abs(other.coupling_iterations - one.coupling_iterations).max() <= 1
    for variable in sorted(set(one.data_vars) - set(measures)):
        # The heat that a sinusoidal motion carries away is a sum of rounding, and so is a gap closed everywhere.
        measure = "heat_friction" if str(variable).startswith("heat_") else str(variable)
        scale = float(np.abs(one[measure]).max()) if variable != "gap" else give_way(one)
        np.testing.assert_allclose(other[variable], one[variable], rtol=0, atol=1e-9 * scale, err_msg=str(variable))


@pytest.mark.slow
def test_the_same_again_and_on_other_ranks(run: Callable[[int, Iterable[str]], Histories]) -> None:
    """Each case: the same bits again on one rank or on two, and the same numbers on both, some on three.

    Where they are asked for, the same bits on one rank and on two or three.
    """
    one, two, three = run(1, [*CASES, *EVERYWHERE]), run(2, ON_TWO), run(3, ON_THREE)
    for first, again in ((one, run(1, AGAIN_ON_ONE)), (two, run(2, AGAIN_ON_TWO))):
        for name in again:
            check_same_bits(first[name], again[name])
    for other in (two, three):
        for name in other:
            (check_same_bits if name in EVERYWHERE else check_same_numbers)(one[name], other[name])
