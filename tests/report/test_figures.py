"""The figures of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from fenwear import CaseError, load_case
from fenwear.common.errors import readable
from fenwear.report.body_figures import element_edges
from fenwear.report.figures import all_figures, draw_figures
from fenwear.report.lines import (
    LATE,
    chosen_half_cycles,
    fields_of,
    lines_figure,
    pressure_top,
    profile_figure,
    wear_map_figure,
    with_late_pressures,
)
from fenwear.report.run_figures import course_figure
from fenwear.report.style import COLOURS, Style, chosen_formats, chosen_look, shades
from fenwear.results.stored_history import load_history, read_history

SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "wear.punch.coefficient=4e-7")
SHOWN = {"shape", "profiles", "wear_map", "pressure", "peaks", "volume", "scar", "friction", "convergence"}


@pytest.fixture
def history(folder: Path) -> xarray.Dataset:
    return read_history(folder)


def _lines(ax: Axes) -> dict[int, np.ndarray]:
    """Return the data of the lines of half-cycles by their numbers."""
    return {int(line.get_gid()): np.asarray(line.get_ydata()) for line in ax.lines if line.get_gid()}


def _expected(history: xarray.Dataset) -> set[str]:
    hot = {"temperature", "heat_balance"} if "largest_temperature" in history else set()
    return SHOWN | {"mean_pressure"} | hot


def test_all_figures_are_images(folder: Path, history: xarray.Dataset) -> None:
    """A run ends with every figure that it has data for; drawn again from the folder alone they are the same."""
    assert {p.name for p in (folder / "figures").glob("*.png")} >= {f"{name}.png" for name in _expected(history)}
    before = {p.name: np.asarray(Image.open(p)) for p in (folder / "figures").glob("*.png")}
    figures_at = load_case(folder / "case.toml").output.figures_at
    for path in draw_figures(folder, figures_at):
        if path.suffix != ".png":
            continue
        np.testing.assert_array_equal(np.asarray(Image.open(path)), before[path.name])


def test_curves_along_the_contact_are_the_history(history: xarray.Dataset) -> None:
    """What is drawn is what was computed: pressure of each direction, their mean in a cycle, depth in micrometres."""
    fields = fields_of(history)
    axes = lines_figure(history, [fields["pressure"]], [10, 20]).axes
    directions = [d for d in (1, -1) if (history.direction == d).any()]
    assert len(axes) == len(directions)
    assert sum(len(_lines(ax)) for ax in axes) == 2 * len(directions)
    for ax, d in zip(axes, directions, strict=True):
        for number, drawn in _lines(ax).items():
            row = history.sel(half_cycle=number)
            assert row.direction == d
            np.testing.assert_array_equal(drawn, row.pressure)
    (ax,) = lines_figure(history, [fields["wear"]], [20]).axes
    np.testing.assert_allclose(_lines(ax)[20], 1e3 * history.wear[-1], rtol=1e-12)
    if len(directions) == 2:
        late = with_late_pressures(history)
        (ax,) = lines_figure(late, [fields_of(late)[LATE]], [9, 20]).axes
        means = _lines(ax)
        assert set(means) == {8, 20}
        for last, first in ((8, 7), (20, 19)):  # the last tenth, from the end of a cycle on
            since = history.pressure.sel(half_cycle=slice(first, last)).values
            np.testing.assert_allclose(means[last], since.mean(axis=0), rtol=1e-12)


def test_curves_over_the_half_cycles_are_the_history(history: xarray.Dataset) -> None:
    """Each panel shows its variable, a line per direction."""
    hot = ("largest_temperature",) if "largest_temperature" in history else ()
    directions = [d for d in (1, -1) if (history.direction == d).any()]
    for figure, names in (
        (course_figure(history, "peaks"), ("largest_pressure", "contact_width", *hot)),
        (course_figure(history, "convergence"), ("periodicity", "optimum_distance")),
    ):
        assert len(figure.axes) == len(names)
        for ax, name in zip(figure.axes, names, strict=True):
            for line, d in zip(ax.lines, directions, strict=False):
                rows = history.direction.values == d
                np.testing.assert_array_equal(line.get_xdata(), history.cycles[rows])
                np.testing.assert_array_equal(line.get_ydata(), history[name][rows])


@pytest.mark.parametrize("folder", ["example1-heat"], indirect=True)
def test_curves_of_heat_are_the_history(history: xarray.Dataset) -> None:
    """Temperatures of both surfaces; in the balance the other terms add up to what friction makes."""
    bodies = ("punch", "strip")
    fields = [fields_of(history)[f"temperature_{body}"] for body in bodies]
    for ax, body in zip(lines_figure(history, fields, [10, 20]).axes, bodies, strict=True):
        for number, drawn in _lines(ax).items():
            np.testing.assert_array_equal(drawn, history[f"temperature_{body}"].sel(half_cycle=number))
    (ax,) = course_figure(history, "heat_balance").axes
    made, *others = [np.asarray(line.get_ydata()) for line in ax.lines]
    np.testing.assert_allclose(made, np.sum(others, axis=0), rtol=1e-6)
    named = [text.get_text() for text in ax.get_legend().get_texts()]
    assert named == [line.get_label() for line in ax.lines]  # what no heat goes to has no line, and no name
    assert "carried out by the strip" not in named


def test_axes_say_what_and_in_which_unit(history: xarray.Dataset) -> None:
    """Every panel has a label with its unit and no sentence in it; panels have letters, lines dashes."""
    figures = all_figures(history)
    assert set(figures) == _expected(history)
    for name, figure in figures.items():
        panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
        for ax, letter in zip(panels, "abc", strict=False):
            assert ax.get_title(loc="left") == (f"({letter})" if len(panels) > 1 else "")
            assert "(" in ax.get_ylabel() or ax.get_ylabel() == "cycles"
        assert panels[-1].get_xlabel()
        if name in ("peaks", "convergence"):
            styles = [line.get_linestyle() for line in figure.axes[0].lines if line.get_label()[0] != "_"]
            assert len(set(styles)) == len(styles)


@pytest.mark.parametrize("folder", ["example1-heat"], indirect=True)
@pytest.mark.parametrize(("width", "axis"), [("85 mm", "cycles"), ("178 mm", "distance")])
def test_nothing_collides(history: xarray.Dataset, axis: str, width: str) -> None:
    """At any width no text of a figure overlaps another one, and none is cut off."""
    look = chosen_look(width, axis)
    for name, figure in all_figures(history, look=look).items():
        assert figure.get_size_inches()[0] == pytest.approx(float(width.split(maxsplit=1)[0]) / 25.4)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        inside = figure.bbox.padded(1)
        texts = [ax.yaxis.label for ax in figure.axes] + [ax.xaxis.label for ax in figure.axes]
        texts += [ax._left_title for ax in figure.axes]  # type: ignore[attr-defined]
        texts += [text for ax in figure.axes if ax.get_legend() for text in ax.get_legend().get_texts()]
        boxes = [t.get_window_extent(renderer) for t in texts if t.get_text() and t.get_visible()]
        for k, box in enumerate(boxes):
            assert inside.containsx(box.x0), (name, k)
            assert inside.containsx(box.x1), (name, k)
            assert not any(box.overlaps(other) for other in boxes[k + 1 :]), (name, k)


def test_first_peaks_have_their_size(history: xarray.Dataset) -> None:
    """An axis of pressure ends above the later states: of one far beyond them the legend has the largest pressure."""
    flat = history.copy(deep=True)
    flat.pressure.values[:2, 0] *= 50
    chosen = chosen_half_cycles(flat)
    assert chosen[-1] == flat.half_cycle.values[-1]
    for data, beyond in ((history, 0), (flat, 1)):
        top = pressure_top(data, chosen)
        for ax in lines_figure(data, [fields_of(data)["pressure"]], chosen).axes:
            assert ax.get_ylim()[1] <= top
            told = [
                line
                for line in ax.lines
                if f"(to {readable(np.max(line.get_ydata()), 3)} MPa)" in str(line.get_label())
            ]
            assert len(told) >= beyond
            assert all(np.max(line.get_ydata()) <= top for line in ax.lines if line not in told)


def test_no_colour_fades_on_white() -> None:
    """Each has a contrast of 2 to white at least, and lines of bodies and directions of 3 (WCAG for graphics)."""
    from matplotlib.colors import to_rgb

    def contrast(colour: object) -> float:
        rgb = np.array(to_rgb(colour))  # type: ignore[arg-type]
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(1.05 / (linear @ [0.2126, 0.7152, 0.0722] + 0.05))

    assert min(contrast(colour) for colour in COLOURS) > 3
    assert min(contrast(colour) for colour, _ in shades(range(6))) > 2


def test_profiles_and_maps(history: xarray.Dataset) -> None:
    """Heights are the unworn ones and the depth; the map begins at zero; volumes over the distance."""
    (ax,) = profile_figure(history, [20]).axes
    np.testing.assert_allclose(_lines(ax)[20], 1e3 * history.wear[-1], rtol=1e-9, atol=1e-9)  # of a flat punch
    map_of = wear_map_figure(history, Style(axis="distance")).axes[0].collections[0]
    values = np.asarray(map_of.get_array())
    assert not values[0].any()
    np.testing.assert_allclose(values[1:], 1e3 * history.wear, rtol=1e-12)
    line = course_figure(history, "volume").axes[0].lines[0]
    np.testing.assert_allclose(line.get_xdata(), 1e-3 * history.sliding_distance, rtol=1e-12)
    np.testing.assert_array_equal(line.get_ydata(), history.worn_volume)
    np.testing.assert_array_equal(course_figure(history, "scar").axes[1].lines[0].get_ydata(), history.scar_width)


@pytest.mark.parametrize("folder", ["monotonic-lz20"], indirect=True)
def test_formats_and_looks(folder: Path) -> None:
    """PDF and SVG beside PNG, with captions for all; what cannot be is said."""
    paths = draw_figures(folder, (), Style(85 / 25.4, "time"), chosen_formats("pdf,svg"))
    names = {path.stem for path in paths if path.suffix == ".pdf"}
    assert {"geometry", "surface_stress", "profiles"} <= names
    assert names == {path.stem for path in paths if path.suffix == ".svg"}
    assert all(path.read_bytes().startswith(b"%PDF") for path in paths if path.suffix == ".pdf")
    captions = (folder / "figures" / "captions.txt").read_text("utf-8")
    assert all(f"{name}: " in captions for name in names)
    assert "over the time" in captions
    for wrong in ("gif", "", "png;pdf"):
        with pytest.raises(CaseError, match="--format"):
            chosen_formats(wrong)
    for width, axis, option in (("5 K", "time", "--width"), ("1 m", "time", "--width"), ("85 mm", "x", "--axis")):
        with pytest.raises(CaseError, match=option):
            chosen_look(width, axis)


def test_edges_of_elements() -> None:
    """Of two elements of degree 2, each four squares, the outlines alone."""
    grid = np.arange(15).reshape(3, 5)
    cells = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1)
    ordered = np.concatenate([cells[:, :2].reshape(-1, 4), cells[:, 2:].reshape(-1, 4)])
    edges = {tuple(edge) for edge in element_edges(ordered, 4).tolist()}
    assert len(edges) == 14
    assert (2, 7) in edges
    assert (1, 6) not in edges


def test_chosen_half_cycles(history: xarray.Dataset) -> None:
    """The recorded ones nearest to the wanted; by default from the first to the last."""
    assert chosen_half_cycles(history, (1, 19, 1000)) == [1, 19, 20]
    default = chosen_half_cycles(history)
    assert chosen_half_cycles(history, (1, 1000, 2000)) == default
    assert (default[0], default[-1]) == (1, 20)
    assert len(default) <= 6


def test_one_half_cycle(history: xarray.Dataset) -> None:
    """Figures of a run that was ended at once are drawn as well."""
    for figure in all_figures(history.isel(half_cycle=[0])).values():
        figure.canvas.draw()


def test_no_history(tmp_path: Path) -> None:
    """A folder without results, with a broken file or no half-cycle yet, is refused by its path."""
    with pytest.raises(CaseError, match=r"history.nc: no readable history"):
        load_history(tmp_path)
    (tmp_path / "history.nc").write_text("no NetCDF")
    with pytest.raises(CaseError, match=r"history.nc: no readable history"):
        load_history(tmp_path)
    xarray.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "history.nc", engine="h5netcdf")
    with pytest.raises(CaseError, match=r"history.nc: no history of a run"):
        read_history(tmp_path)


def test_history_without_half_cycles(history: xarray.Dataset, tmp_path: Path) -> None:
    """A run that has recorded nothing yet is refused."""
    history.isel(half_cycle=slice(0, 0)).to_netcdf(tmp_path / "history.nc", engine="h5netcdf")
    with pytest.raises(CaseError, match="holds no half-cycle yet"):
        read_history(tmp_path)
