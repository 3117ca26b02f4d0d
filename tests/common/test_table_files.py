"""Measured tables: each way of writing gives the same numbers, or an error with the line and what to write."""

from __future__ import annotations

import random
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from fenwear import Case, CaseError, load_case
from fenwear.common.csv_table import read_profile
from fenwear.common.table_files import TableError, read_table
from fenwear.studies import read_data

HEAD = "after (cycles), volume (mm^3)"
BASE = f"# sigma = 0.01 mm^3\n{HEAD}\n100, 0.25\n200, 0.49\n300, 0.74\n"
EURO = BASE.replace("(cycles),", "(cycles);").replace("00, 0.", "00; 0,")
SAME = {
    "utf-16": BASE.encode("utf-16"),
    "utf-16 without a mark": BASE.encode("utf-16-le"),
    "byte order mark, CRLF": b"\xef\xbb\xbf" + BASE.replace("\n", "\r\n").encode(),
    "Latin-1": BASE.replace("mm^3", "mm\u00b3").encode("latin-1"),
    "tabs": BASE.replace(", ", "\t").encode(),
    "spaces": BASE.replace(",", "").encode(),
    "semicolons and decimal commas": EURO.encode(),
    "commas and decimal commas": BASE.replace("00, 0.", "00, 0,").encode(),
    "capitals": BASE.replace("after", "After").replace("volume", "VOLUME").replace("# sigma", "# Sigma").encode(),
    "square brackets": BASE.replace("(", "[").replace(")", "]").encode(),
    "units behind a slash": BASE.replace(" (cycles)", " / cycles").replace(" (mm^3)", " / mm3").encode(),
    "a row of units": BASE.replace(HEAD, "after, volume\ncycles, mm^3").encode(),
    "units in cells": BASE.replace("0.49", "490e6 um^3").encode(),
    "trailing commas": BASE.replace("\n1", ",\n1").replace("25", "25,").replace("74", "74,").encode(),
    "lines of an instrument": BASE.replace(HEAD, f"Tribometer v3\nDate;2024-01-01\n\n{HEAD}").encode(),
    "half-cycles": BASE.replace("(cycles)", "(half-cycles)").replace("00,", "00,").replace("100,", "200,").replace(
        "200, 0.49", "400, 0.49").replace("300,", "600,").encode(),
    "directives below, words": (BASE.partition("\n")[2] + "# a note: by hand\n# Sigma = 0.01 mm^3\n").encode(),
    "nothing worn at the start": BASE.replace("100,", "0, 0\n100,").encode(),
    "missing rows left out": ("# missing = skip\n" + BASE.replace("200,", "150, \n200,")).encode(),
    "empty lines and rows": BASE.replace("\n200", "\n\n,\n200").encode(),
}  # fmt: skip
WRONG = {
    "# set contact.friction: 0.2\n" + BASE: r"line 1: .*'# set contact.friction = 0.2'",
    "# contact.friction = 0.2\n" + BASE: r"line 1: .*'# set contact.friction = 0.2'",
    "# SET contact.friction\n" + BASE: r"line 1: .*# set = VALUE",
    "# sigmas = 0.1 mm^3\n" + BASE: r"line 1: .*'# sigma = ",
    BASE.replace("200, 0.49", "200,"): r"row 4, column 'volume'.*missing = skip",
    BASE.replace("0.49", "n/a"): r"row 4, column 'volume'.*'n/a'",
    BASE.replace("0.49", "0.49, 7"): r"row 4: expected 2 columns, got 3",
    BASE.replace("volume", "volum"): r"'volum'.*did you mean 'volume'",
    BASE.replace("volume (mm^3)", "volume"): r"'volume': has no unit",
    BASE.replace("100", '"1,000"').replace("0.", "0"): r"row 3: '1,000' may be 1000 or 1.000",
    EURO.replace("0,25", "1.000").replace("0,49", "2").replace("0,74", "3"): r"row 3: '1.000' may be 1000 or 1.0000",
    BASE.replace("cycles)", "revolutions)"): r"does not turn",
    BASE.replace("cycles)", "rad)"): r"column 'after'",
    BASE.replace("cycles)", "ppm)"): r"column 'after'",
    BASE.replace("100, 0.25", "0, 0.1\n100, 0.25"): r"row 3, column 'after'",
    "": "holds nothing",
}


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case("example2")


@pytest.mark.parametrize("way", SAME)
def test_a_table_in_every_way_of_writing(tmp_path: Path, case: Case, way: str) -> None:
    """Amounts, values and their standard deviation are the same."""
    (tmp_path / "d.csv").write_bytes(SAME[way])
    found = read_data(tmp_path / "d.csv", case)
    series = found.series[0]
    assert (series.counted, len(series.values)) == ("cycles", 3)
    np.testing.assert_allclose(series.after, [100, 200, 300])
    np.testing.assert_allclose(series.values, [0.25, 0.49, 0.74])
    assert series.sigma == pytest.approx(0.01)
    assert "3 rows of after" in found.listing


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_table_is_named_by_its_line(tmp_path: Path, case: Case, text: str) -> None:
    """Nothing is taken for a comment in silence."""
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(CaseError, match=WRONG[text]):
        read_data(tmp_path / "d.csv", case)


def test_revolutions_count_turns_of_the_strip(tmp_path: Path) -> None:
    """Of a step of a quarter turn, 25 revolutions are 100 cycles; never 2 pi each."""
    case = load_case("bushing", ["motion.angular_speed=10 rad/s", f"motion.duration={np.pi / 20!r} s"])
    (tmp_path / "d.csv").write_text("# sigma = 1 mm^3\nafter (revolutions), volume (mm^3)\n25, 1\n")
    assert read_data(tmp_path / "d.csv", case).series[0].after == pytest.approx(100)


def test_what_was_read_is_listed(tmp_path: Path) -> None:
    """Directives, lines of the instrument, comments and rows that are left out."""
    text = "# missing = skip\n# polished by hand\nTalysurf\nx (mm);depth (µm)\n0;1,5\n1;\n2;2,5\n"
    (tmp_path / "p.csv").write_bytes(text.encode("cp1252"))
    table = read_table(tmp_path / "p.csv", ("x", "depth"))
    assert (table.lines, table.left_out, table.encoding) == ((5, 7), (6,), "Latin-1")
    assert (table.separator, table.decimal) == ("semicolons", "decimal commas")
    np.testing.assert_allclose(table.numbers(1, "mm"), [1.5e-3, 2.5e-3])
    for told in ("missing = skip", "Talysurf", "lines 6", "polished"):
        assert told in table.listing()


def test_heights_of_a_profile_are_depths(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("X [mm]; Height [nm]\n0; 1500\n1; -250,5\n")
    assert np.allclose(read_profile(tmp_path / "p.csv", "k")["points"], [[0, -1.5e-3], [1, 250.5e-6]])


def test_spoiled_tables_never_end_in_a_traceback(tmp_path: Path, case: Case) -> None:
    """Bytes changed at random: numbers, or an error of the table."""
    choose = random.Random(3)
    path = tmp_path / "d.csv"
    for _ in range(300):
        content = bytearray(choose.choice([*SAME.values(), EURO.encode()]))
        for _ in range(choose.choice((1, 2, 4))):
            at = choose.randrange(len(content))
            junk = choose.choice(
                (b"#", b",", b";", b'"', b"\n", b"\t", b"(", b"=", b"9" * 400, b"\x00", b"\xff", b"e", b"-")
            )
            content[at : at + choose.randrange(3)] = junk
        path.write_bytes(bytes(content))
        with suppress(CaseError):
            read_data(path, case)
        with suppress(TableError):
            read_table(path, ())
