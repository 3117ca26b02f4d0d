"""Files of measurements: units, conditions, and every fault named by file, column or row."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fenwear import Case, CaseError, load_case
from fenwear.studies import read_data


@pytest.fixture
def case() -> Case:
    return load_case("example2")


@pytest.fixture
def file(tmp_path: Path) -> Callable[[str], Path]:
    def file(text: str) -> Path:
        path = tmp_path / "data.csv"
        path.write_text(text)
        return path

    return file


def test_profiles_at_two_times_with_their_condition(case: Case, file: Callable[[str], Path]) -> None:
    rows = "\n".join(f"{after}, {x}, {-1.5 - x}, 0.2" for after in (1, 2) for x in (-1, 0, 1))
    text = '# set punch.loads.0.force = ["0 N", "-5 kN"]\n# words\nafter (km), x (cm), height (um), sigma [um]\n' + rows
    found = read_data(file(text), case)
    assert found.settings == ('punch.loads.0.force=["0 N", "-5 kN"]',)
    first, second = found.series
    assert first.quantity == "wear"
    np.testing.assert_allclose(first.x, [-10, 0, 10])
    np.testing.assert_allclose(first.values, [0.5e-3, 1.5e-3, 2.5e-3])
    np.testing.assert_allclose(first.sigma, 0.2e-3)
    np.testing.assert_allclose(second.after, 2e6)
    assert (second.counted, second.rows) == ("distance", (7, 8, 9))


def test_a_lost_mass_becomes_a_volume(case: Case, file: Callable[[str], Path]) -> None:
    text = "# density = 7800 kg/m^3\n# sigma = 0.1 mg\nafter (h), mass (mg)\n1, 7.8\n2, 15.6\n3, 23.4\n"
    series = read_data(file(text), case).series[0]
    assert (series.quantity, series.counted) == ("worn_volume", "time")
    np.testing.assert_allclose(series.values, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(series.after, [3600, 7200, 10800])
    np.testing.assert_allclose(series.sigma, 0.1 / 7.8)


ROWS = "1, 1\n2, 2\n3, 3\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "holds nothing"),
        ("after (m), waer (mm)\n" + ROWS, r"column 'waer': not known.*such as"),
        ("after (m), volume\n" + ROWS, "column 'volume': has no unit"),
        ("after (m), volume (kg)\n" + ROWS, "column 'volume': unit: .*another kind"),
        ("after (m), volume (mmm)\n" + ROWS, "column 'volume': unit: .*, got 'mmm', whose unit is not known"),
        ("after (cycles), volume (mm^3)\n1, 0,3\n2, 0.7\n", r"row 3: .0.7. has a decimal point"),
        ("after (m), volume (1)\n" + ROWS, "column 'volume': unit: expected a unit such as mm"),
        ("after (m), volume (mm^3), volume (mm^3)\n1,1,1\n", "column 'volume': given twice"),
        ("after (m), x (mm)\n" + ROWS, "no measured column"),
        (
            "after (m), volume (mm^3)\n1, 1\n2, nan\n3, 3\n",
            "row 3, column 'volume': expected a finite number, got 'nan'",
        ),
        ("after (m), volume (mm^3)\n1, 1\n2, x\n3, 3\n", "row 3, column 'volume': expected a finite number, got 'x'"),
        ("after (m), volume (mm^3)\n1, 1\n2\n3, 3\n", "row 3: expected 2 columns, got 1"),
        (
            "after (m), volume (mm^3)\n1, 1\n2, 2\n",
            "at least 3 rows of numbers, or `# sigma`, their standard deviation, got 2",
        ),
        ("# sigma = 1 mm^3\nafter (m), volume (mm^3)\n", "at least 1 row of numbers, got 0"),
        ("after (m), volume (mm^3)\n1, 1\n3, 2\n2, 3\n", "row 4, column 'after': expected amounts that rise"),
        ("after (m), volume (mm^3)\n0, 1\n1, 2\n2, 3\n", "row 2, column 'after': expected more than zero"),
        ("after (kg), volume (mm^3)\n" + ROWS, "column 'after': expected cycles, a distance or a time"),
        ("volume (mm^3)\n1\n2\n3\n", "does not say after how much sliding"),
        ("after (m), mass (mg)\n" + ROWS, "needs the density"),
        ("# sigma = 0 mm^3\nafter (m), volume (mm^3)\n" + ROWS, "# sigma: expected more than zero"),
        ("after (m), friction (1)\n1, 0.2\n2, -0.2\n3, 0.2\n", "row 3, column 'friction': expected zero or more"),
        ("after (m), temperature (K)\n" + ROWS, "needs the table heat"),
        ("# body = strip\nafter (m), volume (mm^3)\n" + ROWS, "no wear.strip"),
        ("# body = ring\nafter (m), volume (mm^3)\n" + ROWS, "# body: expected punch or strip"),
        ("# set contact.frict = 3\nafter (m), volume (mm^3)\n" + ROWS, "contact.frict"),
        ("# after = 3 m\nx (mm), depth (um), volume (mm^3)\n1,1,1\n", "with one column depth or height"),
    ],
)
def test_faults_are_named(case: Case, file: Callable[[str], Path], text: str, expected: str) -> None:
    with pytest.raises(CaseError, match=expected):
        read_data(file(text), case)


def test_a_file_that_is_not_there_or_no_text(case: Case, tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="cannot be read"):
        read_data(tmp_path / "none.csv", case)
    (tmp_path / "binary.csv").write_bytes(b"PK\x00\x01\x02")
    with pytest.raises(CaseError, match="is no text"):
        read_data(tmp_path / "binary.csv", case)
