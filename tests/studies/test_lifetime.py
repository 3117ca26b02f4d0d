"""Life with scatter: exact distributions, intervals that hold what they say, resuming, ranks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from scipy import stats

from fenwear import Case, CaseError, make_case
from fenwear.studies import (
    Lifetime,
    Model,
    Scatter,
    lifetime,
    load_scatter,
    parse_quantity,
    parse_scatter,
)
from fenwear.studies.lifetime import quantile, reliability
from tests.results.test_contacts import two_pads

K = "wear.punch.coefficient"
UNTIL = "volume 3 mm^3"


@pytest.mark.parametrize("level", [0.05, 0.5])
def test_intervals_of_quantiles_hold_them_as_often_as_they_say(level: float) -> None:
    """Whatever the distribution: at least 95 %, and not far more."""
    generator = np.random.default_rng(3)
    estimates = [quantile(generator.exponential(size=100), level) for _ in range(2000)]
    held = np.mean([one.low <= -np.log1p(-level) <= one.high for one in estimates])
    assert 0.94 < held < 0.985


def test_a_sample_too_small_for_a_quantile_says_so() -> None:
    one = quantile(np.arange(1.0, 11.0), 0.01)
    assert (one.low, one.value) == (0.0, 1.0)
    assert quantile(np.arange(1.0, 11.0), 0.99).high == np.inf


def test_reliability_is_of_clopper_and_pearson() -> None:
    """None of 59 has failed: the reliability is above 0.9394 with 97.5 % (0.025^(1/59))."""
    one = reliability(np.full(59, 2.0), 1.0)
    assert (one.value, one.high) == (1.0, 1.0)
    assert one.low == pytest.approx(0.025 ** (1 / 59))


def test_life_of_a_lognormal_coefficient_is_lognormal(small: Callable[..., Case]) -> None:
    """N = V / (k F s): each life is that of its sample exactly, and the median in its interval."""
    case = small("example2")
    scatter = parse_scatter(case, f"{K}=lognormal(4e-8 1/MPa, 50 %)")
    found = lifetime(case, UNTIL, scatter, samples=60, wanted=1000.0, comm=MPI.COMM_SELF)
    assert found.lives == pytest.approx(3.0 / (found.samples[:, 0] * 1e4 * 6.0), rel=1e-8)
    width = np.sqrt(np.log1p(0.25))
    middle = next(one for one in found.quantiles if one.level == 0.5)
    assert middle.low <= 3.0 / (4e-8 * 6e4) <= middle.high
    assert found.reliability is not None
    exact = stats.norm.cdf(np.log(3.0 / (4e-8 * 6e4) / 1000.0) / width)
    assert found.reliability.low <= exact <= found.reliability.high


def test_an_interrupted_sampling_goes_on(small: Callable[..., Case], tmp_path: Path) -> None:
    case = small("example2")
    scatter = parse_scatter(case, f"{K}=lognormal(4e-8 1/MPa, 50 %)")
    whole = lifetime(case, UNTIL, scatter, samples=8, folder=tmp_path, comm=MPI.COMM_SELF)
    files, table = sorted((tmp_path / "runs").iterdir()), tmp_path / "samples.csv"
    rows = table.read_text()
    for number, file in enumerate(files[3:]):  # cut short, or not there
        file.unlink() if number else file.write_bytes(file.read_bytes()[:100])
    told: list[int] = []
    again = lifetime(case, UNTIL, scatter, samples=8, folder=tmp_path, resume=True, comm=MPI.COMM_SELF,
                     progress=lambda done, _: told.append(done))  # fmt: skip
    np.testing.assert_array_equal(again.lives, whole.lives)
    assert told[0] == 3
    assert table.read_text() == rows
    for change in ({"seed": 1}, {"until": "volume 2 mm^3"}):
        arguments = {"until": UNTIL, "samples": 8, **change}
        with pytest.raises(CaseError, match=r"--resume: .*another study"):
            lifetime(case, scatter=scatter, folder=tmp_path, resume=True, comm=MPI.COMM_SELF, **arguments)
    with pytest.raises(CaseError, match="holds a study already"):
        lifetime(case, UNTIL, scatter, samples=8, folder=tmp_path, comm=MPI.COMM_SELF)


@pytest.mark.mpi
def test_every_number_of_ranks_gives_the_same_lives(small: Callable[..., Case]) -> None:
    case = small("example2")
    scatter = parse_scatter(case, f"{K}=lognormal(4e-8 1/MPa, 50 %)")
    shared = lifetime(case, UNTIL, scatter, samples=5)
    alone = lifetime(case, UNTIL, scatter, samples=5, comm=MPI.COMM_SELF)
    np.testing.assert_array_equal(shared.lives, alone.lives)


def test_what_makes_no_sense_is_refused(small: Callable[..., Case], tmp_path: Path) -> None:
    case = small("example2")
    for text, expected in (
        (f"{K}=normal(4e-8, 50 %)", "probability of 2.3 %"),
        (f"{K}=uniform(-1e-8 1/MPa, 1e-8 1/MPa)", "expected a finite number, zero or larger"),
        (f"{K}=weibull(1, 2)", "normal, lognormal, uniform"),
        (f"{K}=normal(4e-8 kg, 5 %)", "coefficient"),
        (f"{K}=normal(4e-8, 0 %)", "spread above zero"),
        (f"{K}=uniform(2e-8, 1e-8)", "ends that rise"),
        ("wear.strip.coefficient=normal(1, 2)", "no such key"),
    ):
        with pytest.raises(CaseError, match=expected):
            parse_scatter(case, text).check(case)
    scatter = parse_scatter(case, f"{K}=lognormal(4e-8, 50 %)")
    with pytest.raises(CaseError, match="has a distribution already"):
        scatter.and_also(scatter)
    for until, expected in (("steady pressure", "--until"), ("depth of strip 1 mm", "no wear.strip")):
        with pytest.raises(CaseError, match=expected):
            lifetime(case, until, scatter)
    (tmp_path / "calibration.json").write_text('{"unknowns": 3}')
    with pytest.raises(CaseError, match="is not what"):
        load_scatter(tmp_path, case)


def test_a_joint_distribution_has_the_correlation_of_its_calibration() -> None:
    covariance = np.array([[0.04, 0.015], [0.015, 0.01]])
    scatter = Scatter.joint([K, "contact.friction"], [4e-8, 0.25], covariance, [True, False])
    sample = scatter.sample(20_000, 1)
    sample[:, 0] = np.log(sample[:, 0] / 4e-8)
    assert np.cov(sample.T) == pytest.approx(covariance, abs=1e-3)
    whole = scatter.and_also(Scatter.joint(["motion.amplitude"], [1.5], np.array([[0.01]]), [False]))
    assert np.corrcoef(whole.sample(20_000, 2).T)[2, :2] == pytest.approx([0, 0], abs=0.03)


def test_each_contact_has_a_life(tmp_path: Path) -> None:
    """Two pads of 300 and 900 N: N = V / (k F s) of each and of both, the first of those asked for; names are told."""
    case = make_case(two_pads(tmp_path, named=1.0))
    scatter = parse_scatter(case, f"{K}=lognormal({case.wear.punch.coefficient!r} 1/MPa, 50 %)")  # type: ignore[union-attr]
    (distance, _), volume = Model(case).cycle_measures(), 1e-4

    def exact(found: Lifetime, force: float) -> list[float]:
        return list(volume / (found.samples[:, 0] * force * distance))

    found = lifetime(case, f"volume {volume} mm^3", scatter, samples=3, comm=MPI.COMM_SELF)
    assert found.lives == pytest.approx(exact(found, 1200.0), rel=1e-6)
    assert [one.quantity for one in found.each] == [f"volume in {name} {volume} mm^3" for name in ("left", "right")]
    for one, force in zip(found.each, (300.0, 900.0), strict=True):
        assert one.lives == pytest.approx(exact(found, force), rel=1e-6)
    assert found.first_share == [0.0, 1.0]
    own = [f"volume in left {volume} mm^3", f"volume of punch in right {5 * volume} mm^3"]
    several = lifetime(case, own, scatter, samples=3, comm=MPI.COMM_SELF, folder=tmp_path / "life")
    assert several.lives == pytest.approx(exact(several, 300.0), rel=1e-6)
    assert several.each[1].lives == pytest.approx(exact(several, 180.0), rel=1e-6)
    assert several.first_share == [1.0, 0.0]
    again = lifetime(case, own, scatter, samples=3, comm=MPI.COMM_SELF, folder=tmp_path / "life", resume=True)
    np.testing.assert_array_equal(again.each[1].lives, several.each[1].lives)
    assert "volume in left 0.0001 mm^3" in several.text()
    assert several.as_json()["each"][0]["first"] == 1
    depths = lifetime(case, "depth 0.1 um", scatter, samples=2, comm=MPI.COMM_SELF)
    np.testing.assert_array_equal(depths.lives, np.min([one.lives for one in depths.each], axis=0))
    with pytest.raises(CaseError, match="no contact is called 'middle'; known are left, right"):
        lifetime(case, "depth in middle 1 um", scatter, comm=MPI.COMM_SELF)
    with pytest.raises(CaseError, match="of all contacts together"):
        parse_quantity("friction in left")
    with pytest.raises(CaseError, match="all counted in cycles"):
        lifetime(case, ["depth 1 um", "time until depth 1 um"], scatter, comm=MPI.COMM_SELF)
