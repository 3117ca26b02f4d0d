"""Bodies with names of their own: the same problem, told in their names."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import tomli_w
import xarray

from fenwear.bodies.ready_geometries import meshes_folder
from fenwear.case import Case, changed_case, load_case
from fenwear.case.body_names import Names, by_names
from fenwear.common.errors import CaseError
from fenwear.report.body_figures import field_figures
from fenwear.report.key_numbers import read_case
from fenwear.report.page import page
from fenwear.results.sheet import sheet_text
from fenwear.studies.numeric_keys import with_values
from fenwear.studies.quantities import parse_quantity
from fenwear.studies.run import run_case
from fenwear.system import assemble

PAD, SHAFT = Names("pad", "disc"), Names("bush", "shaft")
NAMED = "contact.between=['pad', 'disc']"
SMALL = [
    "geometry.parameters.elements_along_contact=6",
    "geometry.degree=2",
    "run.half_cycles=2",
    "run.integration=explicit",
    "wear.strip={coefficient = 1e-9}",
    "motion.positions=3",
]


def named(folder: Path) -> Path:
    """Write the first example with names of the bodies, in its geometry and in the case."""
    geometry = (meshes_folder() / "punch_on_strip.geo").read_text("utf-8")
    own = re.sub(r'"(punch|strip)_', lambda m: f'"{PAD.by_roles[m[1]]}_', geometry)
    (folder / "own.geo").write_text(own, "utf-8")
    case = load_case("example1-heat", ["output.report=false", "output.uncertainty=false", *SMALL, NAMED])
    text = case.to_toml().replace("punch_on_strip.geo", "own.geo")
    (folder / "own.toml").write_text(text, "utf-8")
    return folder / "own.toml"


def test_the_case_says_its_groups_by_name(tmp_path: Path) -> None:
    text = named(tmp_path).read_text("utf-8")
    assert all(words in text for words in ("[bodies.pad", "[wear.pad]", "pad_lower", "disc_bottom"))
    assert not any(word in text for word in ("punch_lower", "[punch", "[wear.punch"))
    case = load_case(tmp_path / "own.toml")
    assert case.names == PAD
    again = case.to_toml()
    assert all(words in again for words in ("pad_lower", "disc_bottom"))
    assert not re.search(r"\"(punch|strip)_", again)
    (tmp_path / "again.toml").write_text(again, "utf-8")
    assert load_case(tmp_path / "again.toml").to_toml() == again
    assert changed_case(case, "contact.friction=0.2").punch == case.punch


def test_names_change_no_number_and_all_that_is_told(tmp_path: Path) -> None:
    said: list[str] = []
    short = load_case("example1-heat", ["output.report=false", "output.uncertainty=false", *SMALL])
    one, first = run_case(short, output=tmp_path / "short", log=said.append, progress="none")
    told: list[str] = []
    two, second = run_case(load_case(named(tmp_path)), output=tmp_path / "own", log=told.append, progress="none")
    for key in ("punch", "strip", "sliding", "heat_mJ"):
        assert one[key] == two[key]
    assert "names" not in one
    assert two["names"] == {"punch": "pad", "strip": "disc"}
    assert told == [PAD.with_names(text).replace("punch_on_strip.geo", "own.geo") for text in said]
    with xarray.open_dataset(second / "history.nc") as history:
        assert history.wear.attrs["long_name"] == "worn depth of the pad at the end of the half-cycle"
        texts = [str(history[name].attrs.get("long_name")) for name in history.variables]
    assert not any(re.search(r"\b(punch|strip)\b", text) for text in texts)
    head = sheet_text(two).splitlines()
    assert any(re.search(r" pad +disc", line) for line in head)
    assert not any(re.search(r"\b(punch|strip)\b", line) for line in head)
    drawn = [field_figures(folder, read_case(folder))["geometry"] for folder in (first, second)]
    count = [sum(len(ax.lines) + len(ax.collections) for ax in figure.axes) for figure in drawn]
    assert count[0] == count[1]
    seen = re.sub(r"<pre.*?</pre>|data-[\w-]+=\"[^\"]*\"", "", page(second), flags=re.DOTALL)
    assert "pad" in seen
    assert re.findall(r"(?<![\w.\[])(?:punch|strip)(?![\w.\]])", seen, flags=re.IGNORECASE) == []
    assert json.loads((second / "summary.json").read_text("utf-8"))["names"]["punch"] == "pad"


def test_figures_have_the_names() -> None:
    from matplotlib.figure import Figure

    from fenwear.report.style import name_bodies

    figure = Figure()
    ax = figure.subplots()
    ax.plot([0, 1], [0, 1], label="punch")
    ax.set_title("Worn depth of the strip")
    ax.legend()
    name_bodies([figure], PAD)
    assert ax.get_title() == "Worn depth of the disc"
    legend = ax.get_legend()
    assert legend is not None
    assert legend.get_texts()[0].get_text() == "pad"


def test_ready_geometries_go_with_names() -> None:
    """Groups by role and by name are the same ones."""
    settings = [NAMED, *SMALL[:3]]
    case = load_case("example1", settings)
    assert case.strip.supports[0].on is not None
    assert case.strip.supports[0].on.startswith("strip_")
    again = changed_case(case, f"bodies.disc.supports.0.on={PAD.by_name(case.strip.supports[0].on)}")
    assert again.strip == case.strip
    assert assemble(case).pair.weights.sum() > 0


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (["contact.between=['strip', 'disc']"], "contact.between: .*'strip', 'disc'"),
        (["contact.between=['pad', 'pad']"], "contact.between: .*'pad', 'pad'"),
        (["contact.between=['pad', 'pad_2']"], "contact.between: .*'pad', 'pad_2'"),
        (["contact.between=['2nd', 'disc']"], "contact.between: .*'2nd'"),
        (["contact.between=['pad', 'disc', 'ring']"], "contact.between: .*3"),
        (["contact.between=pad"], "contact.between: .*'pad'"),
        ([NAMED, "contact.slides=shoe"], "contact.slides: .*'pad' or 'disc', got 'shoe'"),
        (["bodies.pad.pivot=['0 mm', '0 mm']"], "contact.between: missing"),
        ([NAMED, "bodies.dsic.supports=[]"], "bodies.dsic: .*'pad' or 'disc'.*did you mean 'disc'"),
        ([NAMED, "wear.pda.coefficient=1e-9"], "wear.pda: unknown key.*'?pad"),
        ([NAMED, "bodies.pad.loads.0.forc=1"], "bodies.pad.loads.0.forc: unknown key"),
        ([NAMED, "wear.pad.coefficient=-1"], "wear.pad.coefficient: "),
        ([NAMED, "unset=bodies.pad", "unset=bodies.disc"], "(?s)bodies.pad: missing.*bodies.disc: missing"),
        (["bodies=1"], "bodies: expected a table of each body, got 1"),
    ],
)
def test_names_that_are_none(settings: list[str], text: str) -> None:
    with pytest.raises(CaseError, match=text):
        load_case("example1", settings)


def test_tables_by_names_are_those_by_roles(tmp_path: Path) -> None:
    """A whole file; laid over as a base, changed by a key of either kind; and older files."""
    text = tomli_w.dumps(by_names(load_case("bushing").tables_by_roles(), SHAFT))
    text = text.replace('slides = ""', "between = ['shaft', 'bush']\nslides = 'shaft'")
    (tmp_path / "named.toml").write_text(text, "utf-8")
    assert not re.search(r"\bstrip\b|\bpunch\b", text)
    case = load_case(tmp_path / "named.toml")
    assert case.names == SHAFT
    assert case.resolved()["bodies"].keys() == {"bush", "shaft"}
    assert (
        load_case("bushing", ["contact.between=['shaft', 'bush']", "contact.slides=shaft"]).resolved()
        == case.resolved()
    )
    (tmp_path / "over.toml").write_text('base = "named.toml"\nunset = "wear.shaft"\n[wear.bush]\npressure_exponent = 2')
    over = load_case(tmp_path / "over.toml", ["bodies.bush.no_turning_about=[]", "wear.punch.coefficient=1e-9"])
    assert over.wear.strip is None
    assert over.wear.punch is not None
    assert (over.wear.punch.pressure_exponent, over.wear.punch.coefficient) == (2, 1e-9)
    assert over.punch.no_turning_about == ()
    assert with_values(over, {"wear.bush.coefficient": 2e-9}).wear.punch.coefficient == 2e-9
    older = load_case("bushing", ["punch.name=bush", "strip.name=shaft"])
    assert older.resolved()["bodies"] == case.resolved()["bodies"]
    (tmp_path / "both.toml").write_text(text + "\n[strip]\npivot = [0, 0]", "utf-8")
    with pytest.raises(CaseError, match=r"strip: expected in bodies\.shaft alone"):
        load_case(tmp_path / "both.toml")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (["contact.between=['shoe', 'disc']"], r"geometry\.groups\.shoe_body.*pad_lower"),
        (
            ["bodies.disc.supports.0.on=disc_botom"],
            r"bodies\.disc\.supports\.0\.on: .*'disc_botom' on the disc",
        ),
        (["punch.regions={pad_lower = 'steel', pad_top = 'steel'}"], r"bodies\.pad\.regions\.pad_top: .*pad_upper"),
    ],
)
def test_what_the_geometry_does_not_have(tmp_path: Path, settings: list[str], text: str) -> None:
    with pytest.raises(CaseError, match=text):
        assemble(load_case(named(tmp_path), settings))


def test_groups_of_both_names(tmp_path: Path) -> None:
    file = named(tmp_path)
    geometry = tmp_path / "own.geo"
    text = geometry.read_text("utf-8").replace('"pad_free"', '"punch_contact"')
    geometry.write_text(text, "utf-8")
    with pytest.raises(CaseError, match=r"geometry\.groups\.pad_contact: several sets"):
        assemble(load_case(file))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("the punch lifts off the strip's end", "the pad lifts off the disc's end"),
        ("Punch and strip", "Pad and disc"),
        ("punch.supports: the punch; wear.strip too", "bodies.pad.supports: the pad; wear.disc too"),
        ("punch_contact spans, no 'strip_bottom' in punch_on_strip.geo", None),
        (
            "/data/punch/strip-1.toml, [punch], temperature_punch",
            "/data/punch/strip-1.toml, [punch], temperature_punch",
        ),
        ("strips and punches", "strips and punches"),
        ("geometry.parameters.punch_width: no such one", "geometry.parameters.punch_width: no such one"),
    ],
)
def test_what_is_told(text: str, told: str | None) -> None:
    assert PAD.with_names(text) == (told or "pad_contact spans, no 'disc_bottom' in punch_on_strip.geo")
    assert Names().with_names(text) == text


def test_quantities_by_name() -> None:
    by_name = parse_quantity("depth of disc at 3 mm", names=PAD)
    assert by_name.body == "strip"
    with pytest.raises(CaseError, match="expected 'of pad', or 'of disc' or 'of both'"):
        parse_quantity("depth of drum", names=PAD)


def test_a_case_made_in_python() -> None:
    """Parts and tables name groups alike."""
    case = load_case("example1", ["contact.between=['pad', 'strip']"])
    data: dict[str, Any] = {name: getattr(case, name) for name in Case.model_fields}
    assert Case(**data) == case
