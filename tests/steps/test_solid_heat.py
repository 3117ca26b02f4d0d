"""Heat by local slip in solids: its balance, the limit of gross sliding, expansion, jumps, a resumed run, ranks."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import xarray
from mpi4py import MPI
from work import half_cycles_whose_work_is_heat

from fenwear import Tribosystem, assemble, load_case, march
from fenwear.report.figures import all_figures
from fenwear.results.stored_history import by_cycles, load_history
from fenwear.steps.stick_heat import read_at
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.studies.run import run_case

WARM = (
    "geometry.parameters={radius='10 mm', contact_width='0.4 mm', stroke='0.1 mm', stroke_elements=1, across=2,"
    " margin_elements=1, ball_layers=2, flat_layers=2}",
    "materials.steel={young='210 GPa', poisson=0.3, conductivity='45 W/(m K)', heat_capacity='460 J/(kg K)', "
    "density='7800 kg/m^3', expansion='1.2e-5 1/K'}",
    "heat={convection='20 W/(m^2 K)', steps=5}",
    "strip.temperatures=[{on='strip_bottom', temperature='0 K'}]",
    "motion.period='0.001 s'",
    "stick.steps=6",
    "stick.step_tolerance=1",
)


@lru_cache
def assembled(*settings: str) -> Tribosystem:
    return assemble(load_case("fretting-sphere", [*WARM, *settings]))


@pytest.mark.parametrize(
    "settings",
    [
        ("heat.partition=0.3", "heat.debris=0.1"),
        ("motion.amplitude='20 um'", "motion.positions=6"),
    ],
)
def test_work_of_friction_is_the_heat(settings: tuple[str, ...]) -> None:
    """In each half-cycle, to rounding, whether the strip stays or passes under the sphere."""
    for part in half_cycles_whose_work_is_heat(assembled(*settings)):
        assert part.temperature.max() > 0


def test_long_strokes_are_as_warm_as_in_gross_sliding() -> None:
    """What is missing is the elastic share of the stroke; hardly any expansion, as gross sliding is pressed otherwise.

    Gross sliding keeps one pressure over a half-cycle, in which the bodies bulge.
    """
    shared = [*WARM, WARM[1].replace("1.2e-5", "1.2e-8"), "wear={punch={coefficient=1e-30}}", "heat.steps=6",
              "motion.positions=1", "run.half_cycles=4", "run.integration='explicit'"]  # fmt: skip
    missing = []
    for amplitude in (25, 100):
        settings = [*shared, f"motion.amplitude='{amplitude} um'"]
        known = assemble(load_case("fretting-sphere", [*settings, "contact.law='gross-sliding'", "stick={}"]))
        end = list(march(known, 4))[-1].heat
        assert end is not None
        found = list(march(assemble(load_case("fretting-sphere", settings)), 4))[-1].heat
        assert found is not None
        difference = np.abs(found.temperature_punch[-1] - end.temperature_punch[-1])
        missing.append(difference.max() / end.temperature_punch[-1].max())
    assert missing[0] < 0.1
    assert missing[1] < 0.25 * missing[0]


def test_expansion_moves_the_surfaces_in_every_direction() -> None:
    """An even temperature of a free body: what expands by alpha T along all axes."""
    bottom = -1.6
    free = (
        f"{{on='strip_bottom', fix=['z']}}, {{at=[0, 0, {bottom}], fix=['x', 'y']}}, {{at=[2, 0, {bottom}], fix=['y']}}"
    )
    warm = assembled("strip.temperatures=[]", f"strip.supports=[{free}]").law_state.problem
    assert warm.heat is not None
    punch, strip = warm.heat.exchange.bases
    even = np.concatenate([basis.coordinates(np.full(basis.body.owned, 10.0)) for basis in (punch, strip)])
    _, moved = (e(s) for e, s in zip(warm.heat.expansions, np.split(even, [len(punch)]), strict=True))
    at = warm.interface.middle.pair.transfer @ warm.interface.middle.pair.strip.trace
    expected = 1.2e-4 * (at - np.array([0.0, 0.0, bottom]))
    assert np.abs(moved - expected).max() < 1e-4 * np.abs(expected).max()


def run(folder: Path, count: int, *, resume: bool = False) -> xarray.Dataset:
    settings = [*WARM, "wear.punch.coefficient='1e-6 1/MPa'", "output.report=false", "output.uncertainty=false",
                "run.integration='explicit'", f"run.half_cycles={count}"]  # fmt: skip
    summary, _ = run_case(load_case("fretting-sphere", settings), "warm", folder, lambda _: None, resume=resume,
                          progress="none")  # fmt: skip
    if MPI.COMM_WORLD.rank == 0:
        assert summary["largest_heat_balance_error"] < 1e-8
        assert summary["largest_temperature_K"] > 0
    return by_cycles(load_history(folder))


@pytest.mark.mpi
def test_a_resumed_run_goes_on_as_warm(tmp_path: Path) -> None:
    """On any number of ranks; history and figures have the temperatures of the nodes."""
    run(tmp_path / "parts", 2)
    resumed, whole = run(tmp_path / "parts", 4, resume=True), run(tmp_path / "whole", 4)
    assert whole.temperature_punch.dims == ("cycle", "step", "node")
    for variable in ("temperature_punch", "pressure", "wear", "heat_friction"):
        difference, expected = np.abs(resumed[variable] - whole[variable]), np.abs(whole[variable])
        assert float(difference.max()) < 1e-9 * float(expected.max())
    if MPI.COMM_WORLD.rank == 0:
        assert {"temperature_punch_map", "heat_balance", "zones"} <= set(all_figures(load_history(tmp_path / "whole")))


@pytest.mark.mpi
def test_ranks_agree() -> None:
    """Tractions, slip and temperatures of every time step to 1e-9 of the largest."""
    case = load_case("fretting-sphere", WARM)
    together, alone = (
        TimeStepRecords.joined([steps.records for steps in next(march(assemble(case, comm), 2)).steps])
        for comm in (MPI.COMM_WORLD, MPI.COMM_SELF)
    )
    for name in ("pressure", "traction", "slip", "temperature", "heat", "force"):
        found, expected = getattr(together, name), getattr(alone, name)
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_values_are_read_beside_their_nodes() -> None:
    """Linear fields are exact within the surface, and beside it stay as at its rim."""
    surface = assembled("heat.partition=0.3", "heat.debris=0.1").law_state.problem.interface.middle.pair.strip
    x = surface.trace
    moved = x + np.array([0.02, -0.01, 0.0])
    inside = (np.abs(moved[:, :2]) <= np.abs(x[:, :2]).max(axis=0)).all(axis=1)
    found = read_at(surface, moved) @ (2 * x[:, 0] - 3 * x[:, 1])
    assert found[inside] == pytest.approx((2 * moved[:, 0] - 3 * moved[:, 1])[inside], abs=1e-9)
    assert inside.sum() > 0.5 * len(x)
    assert found.max() <= (2 * x[:, 0] - 3 * x[:, 1]).max() + 1e-12
