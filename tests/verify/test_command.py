"""The command `verify` in a process of its own: table, page, numbers, exit statuses, ranks."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from fenwear import CaseError
from fenwear_verify import registered
from fenwear_verify.command import choose
from fenwear_verify.paper import BRIEF, FULL

Run = Callable[..., Any]
QUICK = ("--only", "wear-volume", "--only", "time-steps")


def test_table_page_and_numbers(fenwear: Run, tmp_path: Path) -> None:
    """The table as it goes on standard output; results/verification holds the page and the same numbers."""
    done = fenwear("verify", *QUICK, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^wear-volume: .* agrees +\d", done.stdout, re.MULTILINE)
    assert re.search(r"order in the time step.* order (1\.0|0\.9)\d", done.stdout)
    folder = tmp_path / "results" / "verification"
    assert {p.name for p in folder.iterdir()} == {"verification.html", "verification.json"}
    found = json.loads((folder / "verification.json").read_text())
    assert found["agree"]
    assert [case["name"] for case in found["cases"]] == ["wear-volume", "time-steps"]
    row = found["cases"][0]["rows"][0]
    assert {"what", "reference", "ours", "error", "tolerance", "order", "agrees"} == set(row)
    assert abs(row["ours"] / row["reference"] - 1) <= row["tolerance"]


class _Page(HTMLParser):
    """Counts what the page holds and notes what it would load."""

    def __init__(self) -> None:
        super().__init__()
        self.rows, self.images, self.loads = 0, 0, []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.rows += tag == "tr"
        self.images += tag == "img"
        source = values.get("src") or (values.get("href") if tag == "link" else None)
        if source is not None and not source.startswith("data:"):
            self.loads.append(source)
        if tag in ("script", "iframe"):
            self.loads.append(tag)


def test_page_needs_nothing_else(fenwear: Run, tmp_path: Path) -> None:
    """Every comparison is a row of a table, every plot an image in the page; nothing is loaded."""
    fenwear("verify", *QUICK, "-o", tmp_path / "v")
    cases = json.loads((tmp_path / "v" / "verification.json").read_text())["cases"]
    page = _Page()
    page.feed((tmp_path / "v" / "verification.html").read_text("utf-8"))
    # The heads of the overview and of each case's table, the cases, their comparisons.
    assert page.rows == 1 + 2 * len(cases) + sum(len(case["rows"]) for case in cases)
    assert page.images == 1
    assert page.loads == []


def test_json(fenwear: Run, tmp_path: Path) -> None:
    """One JSON object on standard output, the one in the file; the table goes to standard error."""
    done = fenwear("verify", "--only", "optimum-table", "--json", "-o", tmp_path / "v")
    assert json.loads(done.stdout) == json.loads((tmp_path / "v" / "verification.json").read_text())
    assert "optimum-table" in done.stderr


def test_list(fenwear: Run, tmp_path: Path) -> None:
    """The names that --only takes, without computing anything."""
    done = fenwear("verify", "--list", cwd=tmp_path)
    names = [line.split()[0] for line in done.stdout.splitlines()]
    assert names == [*(case.name for case in registered()), "paper"]
    some = fenwear("verify", "--list", "--only", "paper", "--only", "hertz", cwd=tmp_path)
    assert [line.split()[0] for line in some.stdout.splitlines()] == ["hertz", "paper"]
    assert not (tmp_path / "results").exists()


def test_choice() -> None:
    """Everything by default, with the main readings of the paper; the paper alone, a case alone, or both."""
    assert choose([]) == (registered(), BRIEF)
    assert choose(["paper"]) == ([], FULL)
    assert choose(["hertz"]) == (registered(["hertz"]), None)
    assert choose(["paper", "hertz"]) == (registered(["hertz"]), FULL)
    with pytest.raises(CaseError, match="did you mean 'paper'"):
        choose(["papr"])


def test_disagreement(fenwear: Run, tmp_path: Path) -> None:
    """Exit status 1 with the names of the cases; the others are computed all the same."""
    stopped = ("--", "-fenwear_contact_snes_max_it", "0")
    done = fenwear("verify", "-o", tmp_path / "v", "--only", "equilibrium", "--only", "optimum-table", *stopped)
    assert done.returncode == 1, done.stderr
    assert "does not agree: equilibrium\n" in done.stderr
    assert "Traceback" not in done.stderr
    found = json.loads((tmp_path / "v" / "verification.json").read_text())
    assert (found["agree"], found["differing"]) == (False, ["equilibrium"])
    assert "DIVERGED_MAX_IT" in found["cases"][0]["note"]
    assert "DIFFERS" in (tmp_path / "v" / "verification.html").read_text("utf-8")


def test_refusals(fenwear: Run, tmp_path: Path) -> None:
    """An unknown case, and a folder with something in it: status 2, and nothing is computed."""
    unknown = fenwear("verify", "--only", "herz", cwd=tmp_path)
    assert unknown.returncode == 2
    assert "did you mean 'hertz'" in unknown.stderr
    (tmp_path / "thesis.txt").write_text("mine")
    full = fenwear("verify", *QUICK, "-o", tmp_path)
    assert full.returncode == 2
    assert "exists already" in full.stderr
    assert full.stdout == ""


def test_ranks(fenwear: Run, tmp_path: Path) -> None:
    """Said and written once."""
    done = fenwear("verify", "--only", "optimum-table", "-o", tmp_path / "v", ranks=2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("optimum-table: ") == 1
    found = json.loads((tmp_path / "v" / "verification.json").read_text())
    assert found["ranks"] == 2
    assert [case["verdict"] for case in found["cases"]] == ["agrees"]
