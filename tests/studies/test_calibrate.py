"""Calibration: exact standard errors, coverage, what data cannot tell, and measured scars (rows 31 and 38)."""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fenwear import Case, CaseError, load_case, make_case
from fenwear.case.templates import fill_in, find_template
from fenwear.studies import (
    DataSet,
    LeastSquares,
    Model,
    Series,
    Unknown,
    between,
    calibrate,
    measured_folder,
    read_data,
)
from fenwear.studies.measured_data import NONE
from fenwear.studies.numeric_keys import nearest_possible
from tests.benchmarks.calibration import repeated

BETA, LOAD, AMPLITUDE = 3.926990816987242e-8, 1e4, 1.5
K, B = "wear.punch.coefficient", "wear.punch.pressure_exponent"
RING = measured_folder()


def volumes(after: Sequence[float], values: Sequence[float], sigma: Sequence[float], *settings: str) -> DataSet:
    """Return worn volumes after numbers of cycles."""
    series = Series("worn_volume", "punch", NONE, np.array(after), "cycles", np.array(values), np.array(sigma),
                    tuple(range(1, 1 + len(after))))  # fmt: skip
    return DataSet("volumes", settings, (series,))


@pytest.mark.mpi
def test_standard_error_of_archards_coefficient_is_exact(small: Callable[..., Case]) -> None:
    """V = k F s: k = sum V_i F s_i / sum (F s_i)^2 and its error sigma / sqrt(sum (F s_i)^2), from any start."""
    after, sigma = np.array([100.0, 200.0, 300.0]), 0.01
    work = LOAD * 4 * AMPLITUDE * after
    measured = BETA * work + np.array([0.012, -0.007, 0.004])
    case = small("example2", f"{K}=9e-8")
    found = calibrate(case, [volumes(after, measured, [sigma] * 3)], [K])
    fitted = found.fitted[0]
    assert fitted.value == pytest.approx(measured @ work / (work @ work), rel=1e-7)
    assert fitted.standard_error == pytest.approx(sigma / np.sqrt(work @ work), rel=1e-6)
    ratio = np.exp(stats.norm.ppf(0.975) * fitted.standard_error / fitted.value)
    assert (fitted.low, fitted.high) == pytest.approx((fitted.value / ratio, fitted.value * ratio), rel=1e-6)
    assert (found.not_known, found.at_bound, found.degrees_of_freedom) == ((), (), 2)
    unweighted = volumes(after, measured, [1.0] * 3)
    series = (DataSet("volumes", (), (Series(**{**vars(unweighted.series[0]), "sigma": NONE}),)),)
    rest = measured - fitted.value * work
    expected = np.sqrt(rest @ rest / 2 / (work @ work))
    assert calibrate(case, series, [K]).fitted[0].standard_error == pytest.approx(expected, rel=1e-5)


def test_volumes_of_a_ring_give_the_coefficient_that_made_them(small: Callable[..., Case]) -> None:
    """V = k F s of the counter-body: all round it, of which an arc is meshed."""
    case, key, made = small("block-on-ring", "wear.strip.coefficient=1.5e-9"), "wear.strip.coefficient", 1e-9
    motion, after = case.motion, np.array([1.0, 1.0, 2.0])
    slid = case.geometry.parameters["radius"] * motion.angular_speed * Model(case).cycle_measures()[1]
    exact = made * Model(case).system().normal_force * slid * after
    data = volumes(list(after), list(exact), list(0.01 * exact))
    data = DataSet("ring", (), (Series(**{**vars(data.series[0]), "body": "strip"}),))
    assert calibrate(case, [data], [key]).values[key] == pytest.approx(made, rel=1e-3)  # the facets are chords


@pytest.mark.slow
def test_scar_widths_give_the_coefficient() -> None:
    """Of a cylinder on a ring, rigid: w^3 / (12 R) is worn off, a chord's segment, and sqrt(0.99) w wide scars show."""
    tables = tomllib.loads((RING / "block_on_ring.toml").read_text("utf-8"))
    tables["run"] |= {"jump_tolerance": 0.05}
    case, made, after = make_case(tables), 2.4e-9, np.array([1800.0, 3600.0, 7200.0])
    area = made * 65.0 / 6.0 * 500.0 * after  # k F s / b
    widths = np.sqrt(0.99) * np.cbrt(12 * 20.0 * area)
    series = Series("scar_width", "punch", NONE, after, "cycles", widths, np.full(3, 0.01), (1, 2, 3))
    found = calibrate(case, [DataSet("widths", (), (series,))], [K])
    element = 3.6 / 60  # mm, of which the mesh leaves the edge of a scar open by a half; w goes as the cube root of k
    assert found.values[K] == pytest.approx(made, rel=3 * element / 2 / float(widths.mean()))


@pytest.mark.slow
def test_volumes_of_a_worn_bushing_give_the_coefficient() -> None:
    """Of a stiff bushing, worn in to psi to each side of the load: k P s / (R D) = psi / cos psi - sin psi.

    The worn area is 2 (tan psi - psi) R D, 1.03 to 1.06 k P s.
    """
    data = tomllib.loads(fill_in(find_template("bushing"), ["clearance=0.1 mm", "load=1000 N", "revolutions=6000"]))
    data["contact"]["friction"], data["wear"]["punch"]["coefficient"] = 0.0, 2e-8
    data["geometry"]["parameters"]["elements_along_contact"] = 30
    for material in data["materials"].values():
        material["young"] = 2e8
    radius, clearance, load, length, made = 10.0, 0.05, 50.0, 20.0, 1e-8
    psi = np.radians([30.0, 37.0, 44.0])
    slid = (psi / np.cos(psi) - np.sin(psi)) * radius * clearance / (made * load)
    exact = 2 * (np.tan(psi) - psi) * radius * clearance * length
    found = calibrate(make_case(data), [volumes(slid / (2 * np.pi * radius), exact, 0.01 * exact)], [K])
    assert found.values[K] == pytest.approx(made, rel=5e-4)


@pytest.mark.slow
def test_the_exponent_from_two_loads_has_the_error_of_two_logarithms(small: Callable[..., Case]) -> None:
    """Var b = 2 sigma^2 / ln^2(p2 / p1), sigma of ln w of each load, where the pressure is uniform (row 38)."""
    case = small("example2", "contact.friction=0.0", f"{K}=4e-7")
    after, share, ratio = [99_900.0, 100_000.0, 100_100.0], 0.01, 4.0
    data = []
    for factor in (1.0, ratio):
        setting = f"punch.loads.0.force=[0.0, {-LOAD * factor!r}]"
        exact = 4e-7 * LOAD * factor * 4 * AMPLITUDE * np.array(after)
        data.append(volumes(after, exact, share * exact, setting))
    found = calibrate(case, data, [K, B])
    assert found.values[B] == pytest.approx(1.0, abs=1e-5)
    expected = np.sqrt(2 * share**2 / 3) / np.log(ratio)  # three measurements at each load
    assert found.fitted[1].standard_error == pytest.approx(expected, rel=5e-3)
    assert found.not_known == ()


@pytest.mark.parametrize("kind", ["volumes", "profile"])
def test_coefficient_and_exponent_from_one_load_are_not_known(
    small: Callable[..., Case], profile: Callable[..., Path], kind: str
) -> None:
    case = small("example2")
    if kind == "volumes":
        after = [1000.0, 1100.0, 1200.0]
        exact = BETA * LOAD * 4 * AMPLITUDE * np.array(after)
        data = volumes(after, exact, 0.02 * exact)
    else:
        data = read_data(profile(case, 1300, 2e-4, lines=["# sigma = 0.2 um"]), case)
    assert LeastSquares(case, [data], [Unknown(K), Unknown(B)]).cannot_tell()
    found = calibrate(case, [data], [K, B])
    assert found.not_known
    assert all(K in line and B in line and "another load" in line for line in found.not_known)
    with pytest.raises(CaseError, match="gives no distribution"):
        found.scatter()


def test_offset_and_tilt_of_a_trace_are_found(small: Callable[..., Case], profile: Callable[..., Path]) -> None:
    case = small("example2")

    def trace(x: Any, depth: Any) -> Any:
        return depth + 5e-3 + 1e-4 * x

    path = profile(case, 600, 1e-5, change=trace, lines=["# sigma = 0.01 um"])
    found = calibrate(case, [read_data(path, case)], [K], baseline=["offset", "tilt"])
    fitted = found.fitted[0]
    assert abs(fitted.value - BETA) < 4 * fitted.standard_error
    assert found.traces[0].offset == pytest.approx(5e-3, abs=2e-3)
    x = found.traces[0].series.x
    assert found.traces[0].tilt == pytest.approx(1e-4, abs=4 * 1e-5 / np.sqrt(x @ x))  # its standard error, four times


def coverage(problem: LeastSquares, repetitions: int) -> None:
    """Check that 95 % intervals hold the truth so often, within what chance allows; and that errors are as wide."""
    m = len(problem.unknowns)
    deviations, errors = repeated(problem, repetitions)
    held = (np.abs(deviations) <= stats.norm.ppf(0.975) * errors).sum(axis=0)
    chance = stats.binom(repetitions, 0.95)
    outside = 1e-3 / m  # probability that a right program fails
    for count in held:
        assert chance.ppf(outside) <= count <= chance.ppf(1 - outside) or count == repetitions
    spread = (deviations / errors).std(axis=0)
    assert spread == pytest.approx(1.0, abs=4 / np.sqrt(2 * repetitions))


@pytest.mark.slow
def test_twin_experiments_of_three_unknowns(small: Callable[..., Case], profile: Callable[..., Path]) -> None:
    """Coefficient, exponent and friction from profiles at two loads; the full number is in tests/benchmarks."""
    case = small("example2")
    data = []
    for name, load in (("one.csv", 10), ("two.csv", 40)):
        lines = [f'# set punch.loads.0.force = ["0 N", "-{load} kN"]', "# sigma = 0.03 um"]
        data.append(read_data(profile(case, 50, 0.0, name=name, lines=lines), case))
    coverage(LeastSquares(case, data, [Unknown(K), Unknown(B), Unknown("contact.friction")]), 15)


def test_a_rough_profile_says_over_which_length_its_scatter_is_alike(
    small: Callable[..., Case], profile: Callable[..., Path]
) -> None:
    """The remark gives the line for the file; with it the standard error is that of generalised least squares."""
    case = small("example2", "geometry.parameters.elements_along_contact=16")

    def wave(x: Any, depth: Any) -> Any:
        return depth + 1e-4 * np.cos(x / 8)

    plain = calibrate(case, [read_data(profile(case, 400, 1e-6, change=wave), case)], [K])
    (remark,) = plain.remarks
    line = re.search(r"# scatter = alike over ([\d.]+) mm", remark)
    assert line is not None
    data = [read_data(profile(case, 400, 1e-6, change=wave, lines=[line[0]]), case)]
    told = calibrate(case, data, [K])
    assert told.remarks == ()
    x, r = told.traces[0].series.x, told.traces[0].residual
    assert x is not None
    s = np.exp(-np.abs(np.subtract.outer(x, x)) / float(line[1]))
    column = LeastSquares(case, data, [Unknown(K, start=told.values[K])]).jacobian([0.0])[:, 0] / told.values[K]
    information = column @ np.linalg.solve(s, column)
    expected = np.sqrt(r @ np.linalg.solve(s, r) / (len(x) - 1) / information)
    assert told.fitted[0].standard_error == pytest.approx(expected, rel=1e-2)
    assert told.fitted[0].standard_error > 1.5 * plain.fitted[0].standard_error


def test_a_given_sigma_is_kept_whatever_the_residuals_look_like(small: Callable[..., Case]) -> None:
    """Residuals that drift do not change the error that sigma gives (issue 51, line 20)."""
    after, sigma = np.arange(1.0, 25.0) * 20, 0.01
    work = LOAD * 4 * AMPLITUDE * after
    drift = 0.01 * np.random.default_rng(7).standard_normal(24).cumsum()
    found = calibrate(small("example2"), [volumes(after, BETA * work + drift, [sigma] * 24)], [K])
    assert found.fitted[0].standard_error == pytest.approx(sigma / np.sqrt(work @ work), rel=1e-5)
    assert any("# scatter = adds up" in line for line in found.remarks)


def test_an_interval_ends_at_the_bounds_of_its_key(small: Callable[..., Case]) -> None:
    """The share of friction heat that goes to the punch is at most 1, whatever the scatter."""
    work = LOAD * 4 * AMPLITUDE * np.array([100.0, 200.0, 300.0])
    data = [volumes([100.0, 200.0, 300.0], BETA * work, 1.5 * BETA * work)]
    free = calibrate(small("example2"), data, [K]).fitted[0]
    held = calibrate(small("example2"), data, [Unknown(K, BETA / 2, 1.5 * BETA)]).fitted[0]
    assert free.high > 3 * BETA
    assert (held.low, held.high) == (BETA / 2, 1.5 * BETA)
    case = small("example2")
    assert nearest_possible(case, "contact.friction", 0.25, -3.0) == pytest.approx(0.0, abs=1e-9)
    assert nearest_possible(case, "contact.friction", 0.25, 0.5) == 0.5


def test_what_makes_no_sense_is_refused(small: Callable[..., Case]) -> None:
    case = small("example2")
    data = [volumes([100.0, 200.0, 300.0], [1.0, 2.0, 3.0], [0.1] * 3)]
    for unknowns, expected in (
        ([], "at least one key"),
        (["wear.punch.coeficient"], "did you mean wear.punch.coefficient"),
        ([K, K], "given twice"),
        ([K, "output.checkpoint"], "output.checkpoint: has no influence"),
        ([Unknown(K, 2e-8, 1e-8)], "bounds that rise"),
        ([K, B, "contact.friction"], "3 measurements for 3 unknowns"),
        ([Unknown(K, 5e-8, 6e-8, start=1e-8)], "outside of its bounds"),
    ):
        with pytest.raises(CaseError, match=expected):
            calibrate(case, data, unknowns)
    for sets, baseline, expected in (
        ([], (), "at least one file"),
        (data, ("slope",), "expected offset or tilt"),
        (data, ("offset",), "profiles only"),
        ([volumes([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [0.1] * 3, f"{K}=3e-8")], (), "is an unknown of the calibration"),
    ):
        with pytest.raises(CaseError, match=expected):
            calibrate(case, sets, [K], baseline=baseline)


def test_bounds_that_exclude_the_data_are_told(small: Callable[..., Case]) -> None:
    work = LOAD * 4 * AMPLITUDE * np.array([100.0, 200.0, 300.0])
    data = [volumes([100.0, 200.0, 300.0], BETA * work, 0.01 * BETA * work)]
    found = calibrate(small("example2"), data, [Unknown(K, 5e-8, 6e-8)])
    assert found.at_bound == (K,)
    assert found.values[K] == pytest.approx(5e-8, rel=1e-4)
    assert "beyond it" in found.text()


def test_block_on_ring_depths_are_those_published() -> None:
    """Cruzado 2010: 16.155 um after 800 m, 25.709 um after 1,600 m, of a level-set model (row 31)."""
    case = load_case(RING / "block_on_ring.toml")
    ends = {int(s.cycle): s.end for s in Model(case).run({}, 3200, stops=[1600])}
    for cycles, published in ((1600, 16.155e-3), (3200, 25.709e-3)):
        depth, weights = ends[cycles].wear[-1], ends[cycles].system.pair.weights
        area = 2e-9 * (65 / 6) * cycles * 500.0
        assert weights @ depth == pytest.approx(area, rel=1e-9)
        assert depth.max() == pytest.approx(published, rel=3e-3)
        assert depth.max() == pytest.approx((1.5 * 20 * area) ** (2 / 3) / 40, rel=3e-3)  # two rigid bodies


@pytest.mark.slow
def test_three_measured_scars() -> None:
    """K of each scar is that of its area, which needs no model; the three scatter by more than their errors."""
    case = load_case(RING / "block_on_ring.toml", ["geometry.parameters.elements_along_contact=12"])
    found = []
    for number in (1, 2, 3):
        data = read_data(RING / f"block_on_ring_{number}.csv", case)
        one = calibrate(case, [data], [K], baseline=["offset"])
        x, depth = data.series[0].x, data.series[0].values - one.traces[0].offset
        assert x is not None
        area = float(((depth[1:] + depth[:-1]) / 2) @ np.diff(x))
        assert one.values[K] == pytest.approx(area / (65 / 6 * 3.6e6), rel=1e-2)
        found.append(one)
    values = np.array([one.values[K] for one in found])
    assert values.mean() == pytest.approx(2e-9, rel=0.05)  # what the published model takes
    scatter = between(found)
    assert scatter.marginals[0].median() == pytest.approx(stats.gmean(values), rel=1e-9)
    assert np.log(values).std(ddof=1) > 3 * found[2].fitted[0].standard_error / values[2]


def test_an_interrupted_fit_resumes_at_any_run(small: Callable[..., Case], tmp_path: Path) -> None:
    """Trials on the disk take the place of runs: the same numbers, and fewer runs the more there are."""
    after = np.array([100.0, 200.0, 300.0])
    case, data = small("example2", f"{K}=9e-8"), [volumes(after, [0.25, 0.49, 0.74], [0.01] * 3)]
    whole = calibrate(case, data, [K], folder=tmp_path / "fit")
    files = sorted((tmp_path / "fit" / "runs").iterdir(), key=lambda file: file.stat().st_mtime_ns)
    runs = []
    for kept in (0, len(files) // 2, len(files)):
        folder = tmp_path / str(kept)
        shutil.copytree(tmp_path / "fit", folder)
        for file in files[kept:]:
            (folder / "runs" / file.name).unlink()
        resumed = calibrate(case, data, [K], folder=folder, resume=True)
        assert resumed.as_json() | {"evaluations": 0} == whole.as_json() | {"evaluations": 0}
        runs.append(resumed.evaluations)
    assert whole.evaluations >= runs[0] > runs[1] > runs[2]
    with pytest.raises(CaseError, match="--resume"):
        calibrate(case, data, [f"{K}"], baseline=[], folder=tmp_path / "other", resume=True)
    with pytest.raises(CaseError, match="--resume"):
        calibrate(small("example2", f"{K}=8e-8"), data, [K], folder=tmp_path / "fit", resume=True)
