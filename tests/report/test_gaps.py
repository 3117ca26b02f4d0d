"""Lines of a contact whose parts lie apart."""

from __future__ import annotations

import numpy as np
import xarray
from matplotlib.figure import Figure

from fenwear.report.drawn_surface import gaps_of, part_lines, parted, sides_of


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


def test_sides_of_a_groove_are_two_lines() -> None:
    """The second, at the radii of the first, is dotted in its colour; captions tell which is which."""
    r, side = np.tile([31.0, 33.0, 38.0], 2), np.repeat([0, 1], 3)
    names = {"flag_meanings": "lower upper"}
    history = xarray.Dataset({"contact": ("node", side, names), "wear": ("node", side)}, {"r": ("node", r)})
    assert sides_of(history) == ["lower", "upper"]
    figure = Figure()
    ax = figure.subplots()
    ax.plot(r, side + 1.0)
    ax.plot(r[:3], r[:3])
    part_lines([figure], gaps_of(history))
    lower, alone, upper = ax.get_lines()
    for line, value in ((lower, 1.0), (upper, 2.0)):
        np.testing.assert_array_equal(line.get_data(), [r[:3], np.full(3, value)])
    assert (upper.get_linestyle(), upper.get_color()) == (":", lower.get_color())
    assert alone.get_linestyle() == "-"
