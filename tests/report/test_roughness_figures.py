"""Pictures of rough surfaces: what they draw is what the numbers of the history are of."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray

from fenwear.case.reading import load_case
from fenwear.report.lines import fields_of
from fenwear.report.maps import with_surfaces
from fenwear.report.run_figures import course_figure, course_figures
from fenwear.results.stored_history import load_history
from fenwear.studies.run import run_case

SETTINGS = (
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "punch.operator='fine'", "strip.operator='fine'", "grid.nodes=25", "grid.size=['0.36 mm', '0.36 mm']",
    "motion.positions=2", "run.half_cycles=2", "output.uncertainty=false", "output.report=false",
    "punch.topography.rms='0.05 um'", "punch.topography.longest='0.2 mm'", "strip.topography.amplitude='0.2 um'",
    "strip.topography.wavelength=['0.12 mm', '0.18 mm']",
)  # fmt: skip


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> xarray.Dataset:
    """Return the history of a rough ball on a wavy flat."""
    folder: Path = tmp_path_factory.mktemp("rough") / "run"
    run_case(load_case("ball-on-flat", SETTINGS), output=folder, log=lambda _: None)
    return load_history(folder)


def test_the_figure_has_the_numbers_of_the_history(history: xarray.Dataset) -> None:
    """Sa and Sq of both bodies over the run, µm."""
    (ax,) = course_figure(history, "roughness").axes
    names = [f"roughness_{kind}{end}" for kind in ("Sa", "Sq") for end in ("", "_strip")]
    for line, name in zip(ax.lines, names, strict=True):
        np.testing.assert_allclose(line.get_ydata(), 1e3 * history[name])


def test_heights_are_less_what_has_worn_and_its_form(history: xarray.Dataset) -> None:
    """Maps show the topography less the worn depth, within the scar less a surface of second order: its Sq is Sq."""
    last = int(history.half_cycle[-1])
    found = with_surfaces(history, [last])
    for end in ("", "_strip"):
        assert found[f"surface{end}"].dims == history[f"wear{end}"].dims
        assert np.isnan(found[f"surface{end}"].values[:-1]).all()
        here = found.sel(half_cycle=last)
        form = (here[f"topography{end}"] - here[f"wear{end}"] - here[f"surface{end}"]).values
        within = np.abs(form) > 1e-12
        x, y = (here[f"{axis}{end}"].values[within] for axis in "xy")
        assert within[here[f"wear{end}"].values > 0].all()
        assert within.mean() < 0.9
        powers = np.column_stack([x**i * y**j for i in range(3) for j in range(3 - i)])
        nearest = powers @ np.linalg.lstsq(powers, form[within], rcond=None)[0]
        np.testing.assert_allclose(form[within], nearest, rtol=0, atol=1e-12)
        heights = here[f"surface{end}"].values[within]
        assert abs(heights.mean()) < 1e-15
        rms = float(here[f"roughness_Sq{end}"])
        assert np.sqrt((heights**2).mean()) == pytest.approx(rms, rel=1e-9)
    assert {"surface", "surface_strip"} <= fields_of(found).keys()
    smooth = history.drop_vars([name for name in map(str, history.variables) if re.match("topography|roughness", name)])
    assert with_surfaces(smooth, [last]).equals(smooth)
    assert "roughness" not in course_figures(smooth)
