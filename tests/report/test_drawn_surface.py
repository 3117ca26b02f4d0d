"""Figures, pages and pictures of solids and rings, from runs made here."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.text import Text

from fenwear import load_case
from fenwear.report.body_figures import common_view, deformed, displacement, draw_pictures
from fenwear.report.compare import compare, comparison_figure, draw_comparison
from fenwear.report.drawn_surface import Surface, along_contact, centre_of_wear, model_of, surface_of
from fenwear.report.figures import all_figures
from fenwear.report.lines import fields_of
from fenwear.report.maps import LEVELS, map_figure
from fenwear.report.page import numbers_of
from fenwear.report.run_figures import is_conforming
from fenwear.results.hdf5 import node_places
from fenwear.results.stored_history import read_history
from fenwear.studies.run import run_case

EVIL = '<script>alert("1")</script> & <img src=x onerror=alert(1)>'
SETTINGS = {
    "pin-on-disc": ("geometry.degree=1", "geometry.order=1", "run.half_cycles=30", "geometry.parameters.around=2"),
    "ball-on-flat": ("geometry.degree=1", "geometry.order=1", "run.half_cycles=4", "motion.positions=2",
                     "geometry.parameters.across=6", "geometry.parameters.core=0"),
    "ring-on-ring": ("geometry.degree=2", "run.half_cycles=30", "geometry.parameters.across=4"),
}  # fmt: skip


class Folders(dict[str, Path]):
    """The folder of a short run of each case, with its report: made when first asked for."""

    def __init__(self, parent: Path) -> None:
        super().__init__()
        self.parent = parent

    def __missing__(self, name: str) -> Path:
        case = load_case(name, [*SETTINGS[name], f"title={json.dumps(EVIL)}"])
        self[name] = run_case(case, "run", self.parent / name, lambda message: None)[1]
        return self[name]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Folders:
    return Folders(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module", params=sorted(SETTINGS))
def folder(request: pytest.FixtureRequest, folders: Folders) -> Path:
    return folders[request.param]


class Elements(HTMLParser):
    """Collects elements with their attributes, and what stands in scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.all: list[tuple[str, dict[str, str]]] = []
        self.texts: dict[str, str] = {}
        self._open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {name: value or "" for name, value in attrs}
        self.all.append((tag, attributes))
        self._open.append(attributes.get("id", tag))

    def handle_endtag(self, tag: str) -> None:
        del tag
        self._open.pop()

    def handle_data(self, data: str) -> None:
        if self._open:
            self.texts[self._open[-1]] = self.texts.get(self._open[-1], "") + data


def test_the_page_loads_nothing(folder: Path) -> None:
    """No network and no script; a text of the user is text."""
    text = (folder / "report.html").read_text("utf-8")
    parsed = Elements(re.sub(r"<(meta|link|img|br)\b([^>]*)>", r"<\1\2></\1>", text))
    sources = [a[key] for _, a in parsed.all for key in ("src", "href", "srcset") if key in a]
    assert len(sources) > 3
    assert all(source.startswith(("data:", "#")) for source in sources)
    (policy,) = (a["content"] for tag, a in parsed.all if tag == "meta" and "http-equiv" in a)
    assert not [tag for tag, _ in parsed.all if tag == "script"]
    assert "script-src" not in policy
    assert "default-src 'none'" in policy
    assert parsed.texts["title"] == EVIL
    values = {a["id"]: float(a["value"]) for tag, a in parsed.all if tag == "data"}
    expected = numbers_of(json.loads((folder / "summary.json").read_text()))
    assert values == pytest.approx(expected, rel=1e-15, nan_ok=True)
    assert "rightward" not in text


def _area(x: np.ndarray, triangles: np.ndarray) -> float:
    a, b = x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def test_every_figure(folder: Path) -> None:
    """Each has titles and labelled axes; none speaks of a mean pressure where the surfaces do not conform."""
    history = read_history(folder)
    drawn = all_figures(history)
    expected = {"peaks", "convergence"} | (
        {"pressure_map", "wear_map", "cuts_along", "cuts_across"}
        if model_of(history) == "solid" else {"shape", "pressure"}
    )  # fmt: skip
    assert expected <= set(drawn)
    assert ("wear_strip_map" in drawn) == (model_of(history) == "solid" and "wear_strip" in history)
    for name, figure in drawn.items():
        assert (folder / "figures" / f"{name}.png").stat().st_size > 5000
        for ax in figure.axes:
            assert ax.get_ylabel() or ax.get_xlabel() or not ax.get_visible() or name.endswith("_map"), name
        said = " ".join(str(text.get_text()) for text in figure.findobj(Text))
        assert "rightward" not in said
        assert ("mean 6" not in said) or is_conforming(history)


def test_titles_of_maps_do_not_meet(folders: dict[str, Path]) -> None:
    """In two sizes of case, and with large numbers of half-cycles, no text of a figure lies over another."""
    for name in ("pin-on-disc", "ball-on-flat"):
        history = read_history(folders[name])
        last = history.half_cycle.values
        late = history.assign_coords(half_cycle=last + 1_234_500)
        for one in (history, late.assign(pressure=10 * late.pressure)):
            chosen = [int(n) for n in one.half_cycle.values][-6:]
            for field in fields_of(one).values():
                figure = map_figure(one, field, chosen)
                figure.canvas.draw()
                boxes = [ax.title.get_window_extent() for ax in figure.axes] + [
                    ax._left_title.get_window_extent() for ax in figure.axes if ax.get_visible()
                ]
                boxes = [box for box in boxes if box.width > 0]
                overlapping = [a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :]]
                assert not any(overlapping), (name, field.variable)


def grid(degree: int = 1) -> Surface:
    """Return a square of 6 mm x 4 mm in the plane z = 0, along x."""
    del degree
    x, y = np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-2, 2, 9), indexing="ij")
    nodes = np.arange(x.size).reshape(x.shape)
    corners = [nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]]
    places = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    return Surface("punch", places, np.stack(corners, -1).reshape(-1, 4), places[:, :2], (0, 1))


def test_cuts_of_a_linear_function() -> None:
    """On straight lines through a point, exactly; nothing beside the surface."""
    surface = grid()
    x, y = surface.map.T
    places, values = surface.cut(2 * x - y + 1, np.array([0.3, 1.1]), along=True)
    np.testing.assert_allclose(values, 2 * places - 1.1 + 1, atol=1e-12)
    places, values = surface.cut(2 * x - y + 1, np.array([0.3, 1.1]), along=False)
    np.testing.assert_allclose(values, 0.6 - places + 1, atol=1e-12)
    assert np.isnan(surface.cut(x, np.array([0.0, 2.5]), along=True)[1]).all()


def test_border_and_arrows() -> None:
    """The border is the square's, and the arrow points along the sliding, or against it."""
    surface = grid()
    segments = surface.border
    assert np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() == pytest.approx(20)
    assert (surface.arrow(1), surface.arrow(-1)) == ("→", "←")
    turned = Surface("punch", surface.x, surface.cells, surface.x[:, [1, 0]], (0, 1))
    assert (turned.arrow(1), turned.arrow(-1)) == ("↑", "↓")


def test_drawn_values_keep_their_integral() -> None:
    """Around the middle of each quadrilateral a map has four triangles, symmetric, with the bilinear mean there."""
    surface = grid()
    triangles, values = surface.drawn(surface.map[:, 0] ** 2)
    assert len(values) == len(surface.x) + len(surface.cells)
    x = np.column_stack([triangles.x, triangles.y])
    assert _area(x, triangles.triangles) == pytest.approx(24)
    assert LEVELS > 8


def test_centre_of_wear(folders: dict[str, Path]) -> None:
    """A ball's scar lies at its lowest point; a pin is worn most where it leads."""
    np.testing.assert_allclose(centre_of_wear(read_history(folders["ball-on-flat"])), 0, atol=2e-3)
    along, across = centre_of_wear(read_history(folders["pin-on-disc"]))
    assert along < -0.2
    assert across == pytest.approx(15.1, abs=0.5)


def test_rings_over_the_radius(folders: dict[str, Path]) -> None:
    """The contact of rings is drawn over the radius."""
    x, label = along_contact(read_history(folders["ring-on-ring"]))
    assert (x[0], x[-1]) == pytest.approx((20, 30))
    assert label == "radius r (mm)"


def test_deformed_bodies_touch(folders: dict[str, Path]) -> None:
    """Magnified displacement and wear together: the pin's worn face lies on the disc's, as the gap is closed."""
    folder = folders["pin-on-disc"]
    (path,) = (folder / "fields").glob("*.nc")
    with xarray.open_dataset(path, engine="h5netcdf") as opened:
        data = opened.load()
    view = common_view([data])
    assert view.factor > 1
    np.testing.assert_allclose(view.along, [0, 1, 0], atol=1e-9)
    heights = {}
    for body in ("punch", "strip"):
        x = node_places(data, body)
        assert displacement(data, body).shape == x.shape
        face = np.flatnonzero((np.abs(x[:, 2]) < 1e-9) & (np.hypot(x[:, 0] - 15, x[:, 1]) < 3.01))
        order = np.lexsort(x[face, :2].T.round(6))
        heights[body] = deformed(data, body, view)[face[order], 2]
    gap = (heights["punch"] - heights["strip"]) / view.factor
    last = read_history(folder).isel(half_cycle=-1)
    order = np.lexsort(np.array([last.x.values, last.y.values]).round(6))
    np.testing.assert_allclose(gap, last.gap.values[order], atol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pin-on-disc", "ring-on-ring"])
def test_pictures(folders: dict[str, Path], name: str) -> None:
    """Solids in a section along the sliding, rings in their own."""
    pytest.importorskip("pyvista")
    drawn = draw_pictures(folders[name])
    assert {path.name.partition("_")[0] for path in drawn} == {"bodies"}
    assert all(path.stat().st_size > 10_000 for path in drawn)


def test_strip_below_its_own_track(folders: dict[str, Path]) -> None:
    """The strip's surface is its own, longer by the stroke."""
    history = read_history(folders["ball-on-flat"])
    punch, strip = surface_of(history), surface_of(history, "strip")
    assert np.ptp(strip.map[:, 0]) == pytest.approx(np.ptp(punch.map[:, 0]) + 0.2, rel=1e-6)


@pytest.mark.parametrize(("names", "lines"), [(["pin-on-disc", "ball-on-flat"], 6), (["ring-on-ring"] * 2, 3),
                                              (["ring-on-ring", "pin-on-disc"], 0)])  # fmt: skip
def test_compared(folders: dict[str, Path], tmp_path: Path, names: list[str], lines: int) -> None:
    """Runs of one model have their cuts, or lines over the radius, on common axes; others their series."""
    found = compare([folders[name] for name in names])
    figure = comparison_figure(found)
    assert len(figure.axes) == lines + 2
    assert all(len(ax.get_lines()) == 2 for ax in figure.axes if "strip" not in ax.get_title("left"))
    assert draw_comparison(found, tmp_path / "both.png").stat().st_size > 10_000
    assert "counterclockwise.largest_pressure_MPa" in found.numbers
