"""Lines of a contact whose parts lie apart."""

from __future__ import annotations

import numpy as np
import xarray
from matplotlib.figure import Figure

from fenwear.report.gaps import gaps_of, part_lines, parted


def test_no_line_over_a_gap() -> None:
    """Lines along the surface that has the gap are broken in it; others, such as the strip's, are as before."""
    x = np.array([0.0, 1.0, 2.0, 6.0, 7.0])
    history = xarray.Dataset({"part": ("x", [0, 0, 0, 1, 1]), "x_strip": ("x_strip", np.arange(9.0))}, {"x": x})
    gaps = gaps_of(history)
    np.testing.assert_array_equal(gaps, [[2, 6]])
    places, values = parted(x, np.vstack([x, 2 * x]), gaps)
    np.testing.assert_array_equal(places, [0, 1, 2, 4, 6, 7])
    np.testing.assert_array_equal(np.isnan(values), np.tile(places == 4, (2, 1)))
    np.testing.assert_array_equal(values[1, places != 4], 2 * x)
    figure = Figure()
    ax = figure.subplots()
    ax.plot(x, x)
    ax.plot(history.x_strip, history.x_strip)
    ax.axhline(1.0)
    part_lines([figure], gaps)
    assert [int(np.isnan(line.get_ydata()).sum()) for line in ax.get_lines()] == [1, 0, 0]


def test_one_part_has_no_gap() -> None:
    """Nothing changes."""
    x = np.arange(4.0)
    gaps = gaps_of(xarray.Dataset(coords={"x": x}))
    assert gaps.shape == (0, 2)
    np.testing.assert_array_equal(parted(x, 2 * x, gaps)[1], 2 * x)
