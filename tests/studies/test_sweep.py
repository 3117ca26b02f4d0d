"""Sweeps: the numbers of single computations, whatever computes them; faults, kept variants, what is written."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from mpi4py import MPI

import fenwear as package
from fenwear import CaseError, Tribosystem, load_case, march, steady
from fenwear.common.errors import InterruptedRunError
from fenwear.results.time_steps import REGIMES
from fenwear.steps import evolve
from fenwear.studies import study
from fenwear.studies.sweep import failures, text
from fenwear.studies.sweep_dataset import records
from fenwear.studies.sweep_picture import sweep_figure
from fenwear.studies.variant import VariantRunner

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
CASE = load_case("example1", SMALL)
OVER = {"contact.friction": "0.1:0.3:3", "geometry.parameters.pin_height_1": ["20 mm", "40 mm"]}


def single(*settings: str) -> Any:
    return steady(package.assemble(load_case("example1", [*SMALL, *settings]), MPI.COMM_SELF))


def test_steady_states_are_those_of_single_cases(tmp_path: Path) -> None:
    """Each variant, whatever it shares with others, is what its case gives alone; the files hold the same."""
    found = package.sweep(CASE, OVER, folder=tmp_path / "out")
    assert dict(found.sizes) == {
        "contact.friction": 3,
        "geometry.parameters.pin_height_1": 2,
        "half_cycle": 2,
        "node": 17,
    }
    assert found["geometry.parameters.pin_height_1"].values.tolist() == [20.0, 40.0]
    for mu, height in ((0.1, 40.0), (0.3, 20.0), (0.2, 40.0)):
        state = single(f"contact.friction={mu}", f"geometry.parameters.pin_height_1={height}")
        own = found.sel({"contact.friction": mu, "geometry.parameters.pin_height_1": height}, method="nearest")
        np.testing.assert_allclose(own["pressure"], state.pressure, rtol=0, atol=1e-9 * state.pressure.max())
        np.testing.assert_allclose(own["shape"], state.shape, rtol=0, atol=1e-9 * np.ptp(state.shape))
        np.testing.assert_allclose(float(own["lambda_F"]), state.velocity["lambda_F"], rtol=1e-9)
        assert own["direction"].values.tolist() == list(state.directions)
    assert (found["trouble"] == "").all()
    stored = xarray.open_dataset(tmp_path / "out" / "sweep.nc", engine="h5netcdf")
    np.testing.assert_array_equal(stored["pressure"], found["pressure"])
    assert stored["pressure"].attrs["units"] == "MPa"
    heading, *rows = (tmp_path / "out" / "sweep.csv").read_text().splitlines()
    assert heading.startswith("contact.friction,geometry.parameters.pin_height_1,largest_pressure_rightward (MPa),")
    assert len(rows) == 6


def test_runs_and_optima(assembled: Callable[..., Tribosystem]) -> None:
    """`run` ends where march ends; the optimum of l_z = 20 is the paper's."""
    over = {"wear.punch.coefficient": [1e-7, 2e-7], "run.half_cycles": [11]}
    found = package.sweep(CASE, over, of="run").squeeze()
    system = assembled("example1", *SMALL, "wear.punch.coefficient=2e-7")
    *_, last = march(system, 11)
    assert records(found).columns[0] == "wear.punch.coefficient (mm^3/(N*mm))"
    np.testing.assert_allclose(found["wear"][1], last.wear[-1], rtol=1e-9, atol=1e-12 * last.wear.max())
    # 11 half-cycles end in a progressive one: phases are in the order of the cycle
    np.testing.assert_allclose(found["pressure"][1, 0], last.pressure[-1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found["pressure"][1, 1], last.pressure[-2], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found["worn_volume"], np.array([1e-7, 2e-7]) * 1e4 * 2 * 1.5 * 11, rtol=1e-9)
    track = {"wear.strip.coefficient": [1e-8], "motion.track": ["20 m"], "run.half_cycles": [4]}
    spread = package.sweep("monotonic-lz20", track, of="run").squeeze()  # steps of 20 mm
    np.testing.assert_allclose(spread["worn_volume_strip"], 1e-8 * 1e4 * 20 * 4, rtol=1e-9)
    best = package.sweep("monotonic-lz20", {"motion.direction": ["rightward", "leftward"]}, of="optimum")
    np.testing.assert_allclose(best["lambda_F"].values.ravel(), [0.05 / 3, 0.05], rtol=1e-9)
    assert best["lambda_F"].attrs["units"] == "mm/s"


def test_a_program_is_run_and_its_end_is_what_lasts() -> None:
    """Volumes are k times all that the loads have slid; steady states and optima are those of the last load."""
    steps = "program.steps=[{cycles=2}, {cycles=2, load='20 kN'}]"
    over = {"wear.punch.coefficient": [1e-7, 2e-7]}
    for of in ("run", "steady", "optimum"):
        found = package.sweep(load_case("example1", [*SMALL, "run.half_cycles=8", steps]), over, of=of).squeeze()
        np.testing.assert_allclose(found["nominal_pressure"], 20e3 / 600, rtol=1e-9)
        if of == "run":
            slid = 4 * 1.5 * 2 * (10e3 + 20e3)
            np.testing.assert_allclose(found["worn_volume"], np.array([1e-7, 2e-7]) * slid, rtol=1e-9)


def test_meshes_of_other_nodes() -> None:
    """Where the nodes are not the same, each variant has its own, and arrays end with NaN."""
    found = package.sweep(CASE, {"geometry.parameters.elements_along_contact": [4, 8]})
    assert found["x"].dims == ("geometry.parameters.elements_along_contact", "node")
    assert int(np.isfinite(found["x"][0]).sum()) == 9
    assert int(np.isfinite(found["pressure"][0, 0]).sum()) == 9
    assert np.isfinite(found["x"][1]).all()


def test_failed_variants_are_told_and_not_fatal(tmp_path: Path) -> None:
    """A punch that tips over at one friction: NaN there, with the reason; the others are there."""
    found = package.sweep(CASE, {"contact.friction": [0.2, 1.9]}, folder=tmp_path / "out")
    assert np.isnan(found["pressure"][1]).all()
    assert np.isfinite(found["pressure"][0]).all()
    assert "balances the loads" in str(found["trouble"][1].item())
    assert failures(found)[0].startswith("failed: contact.friction = 1.9: punch.loads: no pressure")
    assert "2 variants, 1 of them failed" in text(found)


def test_partial_slip_is_swept_like_sliding() -> None:
    """Runs and ends of partial slip, and both laws side by side; each variant is what its own case gives."""
    small = ["geometry.parameters.elements_along_contact=12", "stick.steps=4", "stick.step_tolerance=1",
             "run.half_cycles=6", "run.integration=explicit"]  # fmt: skip
    friction = {"contact.friction": [0.8, 0.9]}
    case = load_case("fretting-partial-slip", small)
    found = package.sweep(case, friction, of="run")
    for k, mu in enumerate(friction["contact.friction"]):
        alone = list(evolve(package.assemble(load_case("fretting-partial-slip", [*small, f"contact.friction={mu}"]))))
        assert float(found["worn_volume"][k]) == pytest.approx(float(alone[-1].totals.of("volume_punch")[-1]), rel=1e-9)
    assert found["stick_width"][0] < found["stick_width"][1]
    ends = package.sweep(case, friction, of="steady")
    assert ends["largest_depth"][0] > ends["largest_depth"][1] > 0
    open_law = load_case("fretting-partial-slip", [small[0], *small[3:]])
    laws = package.sweep(open_law, {"contact.law": ["coulomb", "gross-sliding"]}, of="run")
    assert laws["worn_volume"][0] < 0.7 * laws["worn_volume"][1], "what sticks does not wear"


def test_an_error_that_was_not_foreseen(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    """One variant that raises anything costs no other one."""

    def broken(_self: object, case: package.Case) -> dict[str, Any]:
        if case.contact.friction > 0.15:
            raise ZeroDivisionError("nothing to divide by")
        return {"nominal_pressure": np.array(1.0)}

    monkeypatch.setattr(VariantRunner, "compute", broken)
    found = package.sweep(CASE, {"contact.friction": [0.1, 0.2]})
    assert found["nominal_pressure"].values.tolist()[0] == 1.0
    assert found["trouble"].values.tolist() == ["", "an error that was not foreseen: nothing to divide by"]
    assert "contact.friction=0.2" in capfd.readouterr().err


def test_goes_on_with_what_lacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted, or with values added, only what is not there is computed; a broken file is not there."""
    folder, computed, real = tmp_path / "out", [], VariantRunner.compute

    def counted(self: Any, case: package.Case) -> Any:
        if len(computed) == 2 and not (folder / "sweep.nc").exists():
            raise KeyboardInterrupt
        computed.append(case.contact.friction)
        return real(self, case)

    monkeypatch.setattr(VariantRunner, "compute", counted)
    with pytest.raises(InterruptedRunError, match=r"2 of 3 runs are in .*, to resume: --resume"):
        package.sweep(CASE, {"contact.friction": [0.1, 0.2, 0.3]}, folder=folder)
    (folder / "sweep.nc").touch()
    computed.clear()
    whole = package.sweep(CASE, {"contact.friction": [0.1, 0.2, 0.3]}, folder=folder, resume=True)
    assert computed == [0.3]
    package.sweep(CASE, {"contact.friction": [0.1, 0.2, 0.25, 0.3]}, folder=folder, resume=True)
    assert computed == [0.3, 0.25]
    for file in (folder / "runs").iterdir():
        file.write_bytes(file.read_bytes()[:100])
    again = package.sweep(CASE, {"contact.friction": [0.1, 0.2, 0.3]}, folder=folder, resume=True)
    assert computed == [0.3, 0.25, 0.1, 0.2, 0.3]
    np.testing.assert_allclose(again["pressure"], whole["pressure"], rtol=1e-9, atol=1e-9)
    with pytest.raises(CaseError, match=r"holds a study already.*--resume to continue"):
        package.sweep(CASE, {"contact.friction": [0.1]}, folder=folder)
    with pytest.raises(CaseError, match="holds no runs"):
        package.sweep(CASE, {"contact.friction": [0.1]}, folder=tmp_path / "none", resume=True)
    with pytest.raises(CaseError, match="--resume"):
        package.sweep(CASE, {"contact.friction": [0.1]}, resume=True)


def test_several_processes_start_where_that_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    """By default this process begins; what would take it long goes to as many as there are cores."""
    begun: list[int] = []

    class Here:
        def __init__(self, count: int) -> None:
            begun.append(count)

        def __enter__(self) -> Here:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def submit(self, function: Callable[..., Any], *arguments: Any) -> Any:
            future: Any = study.Future()
            future.set_result(function(*arguments))
            return future

    monkeypatch.setattr(study, "_local", Here)
    monkeypatch.setattr(study.os, "sched_getaffinity", lambda _: {0, 1})
    quick = package.sweep(CASE, {"contact.friction": "0.1:0.3:4"}, processes=None)
    assert begun == []
    monkeypatch.setattr(study, "WORTH", 0.0)
    slow = package.sweep(CASE, {"contact.friction": "0.1:0.3:4"}, processes=None)
    assert begun == [2]
    np.testing.assert_allclose(slow["pressure"], quick["pressure"], rtol=1e-9, atol=1e-9)


def test_pictures() -> None:
    """Lines for few values of a second key, a map for many; further keys stay at their first value, and it says so."""
    shape, dims = (9, 8, 2), ("contact.friction", "motion.amplitude", "model.plane")
    values = np.random.default_rng(0).random(shape)
    data = {
        "largest_pressure": (dims, values, {"units": "MPa", "long_name": "largest contact pressure"}),
        "trouble": (dims, np.full(shape, ""), {"units": ""}),
    }
    coordinates = {dims[0]: np.linspace(0.1, 0.3, 9), dims[1]: np.geomspace(1, 8, 8), dims[2]: ["stress", "strain"]}
    dataset = xarray.Dataset(data, coordinates)
    many = sweep_figure(dataset)
    assert many.get_suptitle() == "at model.plane = stress"
    drawn = many.axes[0].collections[0].get_array()
    np.testing.assert_array_equal(drawn, values[:, :, 0].T)
    assert many.axes[0].get_yscale() == "log"
    few = sweep_figure(dataset.isel({dims[1]: slice(3)}))
    assert len(few.axes[0].lines) == 3
    np.testing.assert_array_equal(few.axes[0].lines[1].get_ydata(), values[:, 1, 0])
    words = sweep_figure(dataset.isel({dims[0]: [0], dims[1]: [0]}))
    assert [label.get_text() for label in words.axes[0].get_xticklabels()] == ["stress", "strain"]


def test_command_on_processes_and_ranks(fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """The command writes the same numbers by local processes and on two ranks; 3 where a variant failed."""
    words = [word for setting in SMALL for word in ("--set", setting)]
    over = ["--over", "contact.friction=0.1,1.9", "--over", "geometry.parameters.pin_height_1=20,40"]
    tables = []
    for number, options in enumerate((["--processes", "2"], [])):
        folder = tmp_path / str(number)
        done = fenwear("sweep", "example1", *over, *words, *options, "-o", folder, "--json", ranks=2 if number else 1)
        assert done.returncode == 3, done.stderr
        assert "failed: contact.friction = 1.9" in done.stderr
        tables.append(json.loads(done.stdout))
        assert {p.name for p in folder.iterdir()} == {"case.toml", "sweep.nc", "sweep.csv", "sweep.png", "runs"}
    assert [table["failed"] for table in tables] == [2, 2]
    for one, other in zip(*(table["variants"] for table in tables), strict=True):
        for name in one:
            if not name.startswith("seconds"):
                assert one[name] == pytest.approx(other[name], rel=1e-9, abs=1e-12, nan_ok=True), name
    shutil.rmtree(tmp_path / "0")
    wrong = fenwear("sweep", "example1", "--over", "contact.fricton=0.1:0.2:3", "-o", tmp_path / "0")
    assert wrong.returncode == 2
    assert "did you mean 'friction'" in wrong.stderr
    assert not (tmp_path / "0").exists()


def test_a_map_of_fretting() -> None:
    """Over amplitude and load: the force that slides is mu F, at an amplitude that grows with the load.

    Gross sliding dissipates 4 mu F (u0 - u_e) in a cycle, u_e the elastic way: the energy ratio is 1 - u_e / u0, and
    partial slip has less than Fouvry's 0.2.
    """
    small = ("geometry.parameters.elements_along_contact=10", "geometry.degree=1", "run.half_cycles=2",
             "stick.steps=16", "run.integration=explicit", "contact.law=coulomb")  # fmt: skip
    case = load_case("fretting-partial-slip", small)
    force = case.punch.loads[0].force[1]
    over = {"motion.amplitude": [1e-4, 1e-3, 8e-3], "punch.loads.0.force.1": [force / 2, force]}
    found = package.sweep(case, over, of="run")
    regime, share, ratio = (found[name].values for name in ("regime", "stick_share", "energy_ratio"))
    assert (np.diff(regime, axis=0) >= 0).all()
    assert (np.diff(regime, axis=1) <= 0).all()
    assert {*regime[0]} <= {0, 1}
    assert {*regime[-1]} == {2}
    assert (np.diff(share, axis=0) <= 0).all()
    assert (np.diff(share, axis=1) >= 0).all()
    np.testing.assert_array_equal(share[regime == 2], 0)
    ratio = ratio.mean(axis=-1) if ratio.ndim > 2 else ratio
    assert ratio[regime == 2].min() > 0.2 > ratio[regime == 1].max()
    figure = sweep_figure(found)
    assert figure.axes[0].get_title(loc="left") == "Regime of fretting"
    assert [*REGIMES] in [[label.get_text() for label in ax.get_yticklabels()] for ax in figure.axes]
    np.testing.assert_array_equal(np.sort(figure.axes[0].collections[0].get_array().ravel()), np.sort(regime.ravel()))
