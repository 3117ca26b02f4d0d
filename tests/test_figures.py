"""The pictures of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

from fenwear import CaseError, load_case
from fenwear.figures import chosen_half_cycles, draw_figures, open_history, peak_figure, pressure_figure, shape_figure
from fenwear.run import run_case

SMALL = ("geometry.degree=1", "geometry.parameters.elements_along_contact=4", "wear.punch.coefficient=4e-7")


@pytest.fixture(scope="module", params=["example1", "monotonic-lz20"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    case = load_case(request.param, [*SMALL, "run.half_cycles=20"])
    return run_case(case, "run", tmp_path_factory.mktemp("figures") / "run", lambda message: None)[1]


@pytest.fixture
def history(folder: Path) -> xarray.Dataset:
    with open_history(folder) as history:
        return history.load()


def test_all_figures_are_images(folder: Path) -> None:
    """Each run draws three figures; drawn again from the folder alone they are the same files."""
    names = {"pressure.png", "shape.png", "peak_pressure.png"}
    assert {p.name for p in (folder / "figures").iterdir()} >= names
    for path in draw_figures(folder):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_curves_are_the_history(history: xarray.Dataset) -> None:
    """What is drawn is what was computed: pressure of each direction, depth in micrometres, peak over half-cycles."""
    axes = pressure_figure(history, [10, 20]).axes
    directions = [d for d in (1, -1) if (history.direction == d).any()]
    assert len(axes) == len(directions)
    for ax, d in zip(axes, directions, strict=True):
        assert len(ax.lines) == 2
        for line in ax.lines:
            number = int(str(line.get_label()).replace(",", ""))
            row = history.sel(half_cycle=number)
            assert row.direction == d
            np.testing.assert_array_equal(line.get_ydata(), row.pressure)
    (ax,) = shape_figure(history, [20]).axes
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 1e3 * history.wear[-1], rtol=1e-12)
    (ax,) = peak_figure(history).axes
    for line, d in zip(ax.lines, directions, strict=False):
        np.testing.assert_array_equal(line.get_ydata(), history.max_pressure[history.direction.values == d])


def test_axes_say_what_and_in_which_unit(history: xarray.Dataset) -> None:
    """Every axis has a label, those of quantities their unit."""
    for figure in (pressure_figure(history, [20]), shape_figure(history, [20]), peak_figure(history)):
        for ax in figure.axes:
            assert "(" in ax.get_ylabel()
        assert figure.axes[-1].get_xlabel()


def test_chosen_half_cycles(history: xarray.Dataset) -> None:
    """The recorded ones nearest to the wanted; by default from the first to the last."""
    assert chosen_half_cycles(history, (1, 19, 1000)) == [1, 19, 20]
    default = chosen_half_cycles(history)
    assert (default[0], default[-1]) == (1, 20)
    assert len(default) <= 6


def test_no_history(tmp_path: Path) -> None:
    """A folder without results, or with a broken file, is refused by its path."""
    with pytest.raises(CaseError, match=r"history.nc: no readable history"):
        open_history(tmp_path)
    (tmp_path / "history.nc").write_text("no NetCDF")
    with pytest.raises(CaseError, match=r"history.nc: no readable history"):
        open_history(tmp_path)
