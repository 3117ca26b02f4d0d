"""The figures of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.axes import Axes
from PIL import Image

from fenwear import CaseError, load_case
from fenwear.report.animation import draw_animation, frames_of
from fenwear.report.draw import draw_figures
from fenwear.report.figures import (
    all_figures,
    chosen_half_cycles,
    convergence_figure,
    heat_balance_figure,
    mean_pressure_figure,
    open_history,
    peak_figure,
    pressure_figure,
    read_history,
    shape_figure,
    temperature_figure,
)
from fenwear.run import run_case

SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "wear.punch.coefficient=4e-7")
SHOWN = {"shape", "pressure", "peaks", "convergence"}


@pytest.fixture(scope="module", params=["example1", "example1-heat", "monotonic-lz20"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    case = load_case(request.param, [*SMALL, "run.half_cycles=20"])
    return run_case(case, "run", tmp_path_factory.mktemp("figures") / "run", lambda message: None)[1]


@pytest.fixture
def history(folder: Path) -> xarray.Dataset:
    return read_history(folder)


def _lines(ax: Axes) -> dict[int, np.ndarray]:
    """Return the data of the lines that are labelled with a number."""
    named = {str(line.get_label()).replace(",", ""): line for line in ax.lines}
    return {int(label): np.asarray(line.get_ydata()) for label, line in named.items() if label.isdigit()}


def _expected(history: xarray.Dataset) -> set[str]:
    both = {"mean_pressure"} if (history.direction == -1).any() and (history.direction == 1).any() else set()
    return SHOWN | both | ({"temperature", "heat_balance"} if "max_temperature" in history else set())


def test_all_figures_are_images(folder: Path, history: xarray.Dataset) -> None:
    """A run ends with every figure that it has data for; drawn again from the folder alone they are the same."""
    assert {p.name for p in (folder / "figures").glob("*.png")} >= {f"{name}.png" for name in _expected(history)}
    before = {p.name: np.asarray(Image.open(p)) for p in (folder / "figures").glob("*.png")}
    figures_at = load_case(folder / "case.toml").output.figures_at
    for path in draw_figures(folder, figures_at):
        np.testing.assert_array_equal(np.asarray(Image.open(path)), before[path.name])


def test_curves_along_the_contact_are_the_history(history: xarray.Dataset) -> None:
    """What is drawn is what was computed: pressure of each direction, their mean in a cycle, depth in micrometres."""
    axes = pressure_figure(history, [10, 20]).axes
    directions = [d for d in (1, -1) if (history.direction == d).any()]
    assert len(axes) == len(directions)
    for ax, d in zip(axes, directions, strict=True):
        assert len(_lines(ax)) == 2
        for number, drawn in _lines(ax).items():
            row = history.sel(half_cycle=number)
            assert row.direction == d
            np.testing.assert_array_equal(drawn, row.pressure)
    (ax,) = shape_figure(history, [20]).axes
    np.testing.assert_allclose(_lines(ax)[20], 1e3 * history.wear[-1], rtol=1e-12)
    if len(directions) == 2:
        (ax,) = mean_pressure_figure(history, [9, 20]).axes
        means = _lines(ax)
        assert set(means) == {5, 10}
        for cycle, drawn in means.items():
            both = history.pressure.sel(half_cycle=[2 * cycle - 1, 2 * cycle]).values
            np.testing.assert_allclose(drawn, both.sum(axis=0) / 2, rtol=1e-12)


def test_curves_over_the_half_cycles_are_the_history(history: xarray.Dataset) -> None:
    """Each panel shows its variable, a line per direction."""
    hot = ("max_temperature",) if "max_temperature" in history else ()
    directions = [d for d in (1, -1) if (history.direction == d).any()]
    for figure, names in (
        (peak_figure(history), ("max_pressure", "contact_width", *hot)),
        (convergence_figure(history), ("periodicity", "optimum_distance")),
    ):
        assert len(figure.axes) == len(names)
        for ax, name in zip(figure.axes, names, strict=True):
            for line, d in zip(ax.lines, directions, strict=False):
                rows = history.direction.values == d
                np.testing.assert_array_equal(line.get_xdata(), history.half_cycle[rows])
                np.testing.assert_array_equal(line.get_ydata(), history[name][rows])


@pytest.mark.parametrize("folder", ["example1-heat"], indirect=True)
def test_curves_of_heat_are_the_history(history: xarray.Dataset) -> None:
    """Temperatures of both surfaces; in the balance the other terms add up to what friction makes."""
    for ax, body in zip(temperature_figure(history, [10, 20]).axes, ("punch", "strip"), strict=True):
        for number, drawn in _lines(ax).items():
            np.testing.assert_array_equal(drawn, history[f"temperature_{body}"].sel(half_cycle=number))
    (ax,) = heat_balance_figure(history).axes
    made, *others = [np.asarray(line.get_ydata()) for line in ax.lines if len(line.get_ydata())]
    np.testing.assert_allclose(made, np.sum(others, axis=0), rtol=1e-6)
    assert len(ax.get_legend().get_texts()) == 6


def test_axes_say_what_and_in_which_unit(history: xarray.Dataset) -> None:
    """Every panel has a title and a label with its unit; lines differ by more than colour over the half-cycles."""
    figures = all_figures(history)
    assert set(figures) == _expected(history)
    for name, figure in figures.items():
        for ax in figure.axes:
            assert ax.get_title(loc="left")
            assert "(" in ax.get_ylabel()
        assert figure.axes[-1].get_xlabel()
        if name in ("peaks", "convergence"):
            styles = [line.get_linestyle() for line in figure.axes[0].lines if line.get_label()[0] != "_"]
            assert len(set(styles)) == len(styles)


def test_animation(folder: Path, history: xarray.Dataset) -> None:
    """Whole cycles from early to the last, endless; the last frame stays longest."""
    with Image.open(draw_animation(folder)) as gif:
        count = gif.n_frames
        durations = []
        for k in range(count):
            gif.seek(k)
            durations.append(gif.info["duration"])
        assert gif.info["loop"] == 0
    shown = frames_of(history)
    assert shown[-1] == 20
    assert 5 <= count <= len(shown)  # equal frames become one
    assert max(durations) == durations[-1]


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
        open_history(tmp_path)
    (tmp_path / "history.nc").write_text("no NetCDF")
    with pytest.raises(CaseError, match=r"history.nc: no readable history"):
        open_history(tmp_path)
    xarray.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "history.nc", engine="h5netcdf")
    with pytest.raises(CaseError, match=r"history.nc: no history of a run"):
        read_history(tmp_path)


def test_history_without_half_cycles(history: xarray.Dataset, tmp_path: Path) -> None:
    """A run that has recorded nothing yet is refused."""
    history.isel(half_cycle=slice(0, 0)).to_netcdf(tmp_path / "history.nc", engine="h5netcdf")
    with pytest.raises(CaseError, match="holds no half-cycle yet"):
        read_history(tmp_path)
