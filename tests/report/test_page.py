"""report.html: complete, self-contained, safe."""

from __future__ import annotations

import base64
import json
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from fenwear import load_case
from fenwear.report.page import numbers_of, page, write_report
from fenwear.studies.run import run_case

SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "run.half_cycles=6")
VOID = {"meta", "link", "img", "br"}


class Page(HTMLParser):
    """Collects elements, their attributes and their text; notes what is not closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: dict[str, list[str]] = {}
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.texts.setdefault(self.open[-1], []).append(data)

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture
def parsed(folder: Path) -> Page:
    return Page((folder / "report.html").read_text("utf-8"))


def _summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text("utf-8"))


def test_needs_nothing_else(parsed: Page) -> None:
    """All that a browser would load is inside the page, and every image is one and has words for who cannot see it."""
    assert parsed.open == []
    sources = [a[key] for _, a in parsed.elements for key in ("src", "href", "data", "srcset", "poster") if key in a]
    assert len(sources) > 4
    assert all(source.startswith(("data:", "#")) for source in sources)
    assert not {"script", "iframe", "object", "embed", "base", "form"} & {tag for tag, _ in parsed.elements}
    assert not any(name.startswith("on") or name == "style" for _, a in parsed.elements for name in a)
    assert not any("url(" in text or "@import" in text for text in parsed.texts["style"])
    for image in parsed.all("img"):
        assert len(image["alt"]) > 20
        assert base64.b64decode(image["src"].partition(",")[2])[:4] in (b"\x89PNG", b"GIF8")


def test_text_of_the_user_is_text(parsed: Page, evil: str) -> None:
    """A title with tags is shown as it is, in the page's title, its heading and the case."""
    assert "".join(parsed.texts["title"]) == evil
    assert evil in "".join(parsed.texts["h1"])
    assert "<script>" in "".join(parsed.texts["pre"])


def test_numbers_are_the_summary(folder: Path, parsed: Page) -> None:
    """Every number of summary.json stands in a table, once, with its exact value; and no other."""
    shown = parsed.all("data")
    values = {a["id"]: float(a["value"]) for a in shown}
    assert len(values) == len(shown)
    expected = numbers_of(_summary(folder))
    assert expected["nominal_pressure_MPa"] == pytest.approx(16.667, abs=1e-3)
    assert values == pytest.approx(expected, rel=1e-15, nan_ok=True)


def test_tells_case_stop_versions_and_date(folder: Path, parsed: Page) -> None:
    """The whole case file, every version, how the run stopped and when; headings in order."""
    shown = "".join(parsed.texts["pre"])
    assert (folder / "case.toml").read_text("utf-8") in shown
    for name, version in _summary(folder)["versions"].items():
        assert f"{name} {version}" in shown
    assert "all half-cycles done" in "".join(parsed.texts["p"])
    assert parsed.all("time")[0]["datetime"].startswith("20")
    tags = [tag for tag, _ in parsed.elements]
    assert tags.count("h1") == tags.count("main") == 1
    assert parsed.texts["h2"] == ["Key numbers", "Figures", "Tables", "Case and versions"]


def test_warnings_and_a_run_without_end(folder: Path, evil: str, tmp_path: Path) -> None:
    """Warnings are shown and escaped; a killed run has a page that says so."""
    copy = shutil.copytree(folder, tmp_path / "copy")
    summary = {**_summary(folder), "warnings": [evil], "stop": "a & b"}
    (copy / "summary.json").write_text(json.dumps(summary))
    parsed = Page(page(copy))
    assert evil in "".join(parsed.texts["p"])
    assert "a & b" in "".join(parsed.texts["p"])
    (copy / "summary.json").unlink()
    parsed = Page(page(copy))
    assert "no summary yet" in "".join(parsed.texts["p"])
    assert "Figures" in parsed.texts["h2"]


@pytest.mark.parametrize("folder", ["example1"], indirect=True)
def test_images_of_an_earlier_run_are_left_out(folder: Path, tmp_path: Path) -> None:
    """A picture older than the results shows something else."""
    copy = shutil.copytree(folder, tmp_path / "copy")
    before = len(Page(page(copy)).all("img"))
    (copy / "history.nc").touch()
    assert before > 3
    assert Page(page(copy)).all("img") == []
    drawn = [path for path in write_report(copy) if path.suffix == ".png"]
    assert len(Page((copy / "report.html").read_text("utf-8")).all("img")) == len(drawn)


def test_a_run_outlives_its_drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where drawing fails, the run ends well with a warning that tells how to try again."""

    def fail(*arguments: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("fenwear.report.page.draw_figures", fail)
    messages: list[str] = []
    summary, directory = run_case(load_case("example1", SMALL), "run", tmp_path / "run", messages.append)
    assert summary["half_cycles"] == 6
    assert (directory / "summary.json").is_file()
    assert any("disk full" in m and "fenwear plot" in m for m in messages)


@pytest.mark.parametrize("folder", ["example1-heat"], indirect=True)
def test_plot_command(folder: Path, fenwear: Callable[..., Any], tmp_path: Path) -> None:
    """plot draws everything anew and prints the files; a folder that is no run ends with status 2."""
    (folder / "report.html").unlink()
    done = fenwear("plot", folder)
    assert done.returncode == 0, done.stderr
    files = [Path(line) for line in done.stdout.splitlines()]
    assert {"report.html", "shape.png"} <= {path.name for path in files}
    assert all(path.is_file() for path in files)
    for wrong in (tmp_path, tmp_path / "missing"):
        done = fenwear("plot", wrong)
        assert done.returncode == 2
        assert str(wrong) in done.stderr
        assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
