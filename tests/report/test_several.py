"""Maps and cuts of several contacts: bores all the way round, each cut through its own, parts with their own axes."""

from __future__ import annotations

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure

from fenwear.common.arrays import Array
from fenwear.report.drawn_surface import Surface, cut_places

ROUND, RADIUS = 24, 10.0


def bores() -> tuple[Array, Array, Array, Array]:
    """Return nodes (n, 3), cells, places along and across the sliding, and numbers of two bores behind each other."""
    angle = -np.pi + 2 * np.pi / ROUND * np.arange(ROUND)
    x, cells, sliding, number = [], [], [], []
    for k, low in enumerate((-38.0, 22.0)):
        at = len(x) * ROUND
        for y in np.linspace(low, low + 16, 5):
            x.append(np.column_stack([RADIUS * np.sin(angle), np.full(ROUND, y), RADIUS * np.cos(angle)]))
            sliding.append(np.column_stack([RADIUS * angle, np.full(ROUND, y)]))
            number += [k] * ROUND
        rows = at + ROUND * np.arange(4)[:, None] + np.arange(ROUND)
        right = at + ROUND * np.arange(4)[:, None] + (np.arange(ROUND) + 1) % ROUND
        cells.append(np.stack([rows, right, right + ROUND, rows + ROUND], axis=-1).reshape(-1, 4))
    return np.concatenate(x), np.concatenate(cells), np.concatenate(sliding), np.array(number)


def test_a_bore_is_drawn_all_the_way_round() -> None:
    """Where it was cut to be unrolled no column is missing; its border is that of two rectangles."""
    x, cells, sliding, number = bores()
    surface = Surface("punch", x, cells, sliding, (0, 2), np.array(["left", "right"])[number])
    drawn, values = surface.drawn(np.cos(sliding[:, 0] / RADIUS))
    a, b, c = (np.column_stack([drawn.x, drawn.y])[corner] for corner in drawn.triangles.T)
    (ax, ay), (bx, by) = (b - a).T, (c - a).T
    area = np.abs(ax * by - ay * bx).sum() / 2
    chord = 2 * RADIUS * np.sin(np.pi / ROUND) - 2 * np.pi * RADIUS / ROUND  # the last cell by its way in space
    assert area == pytest.approx(2 * 16 * (2 * np.pi * RADIUS + chord), rel=1e-12)
    np.testing.assert_allclose(values[: len(x)], np.cos(drawn.x[: len(x)] / RADIUS))
    around = np.linalg.norm(surface.border[:, 1] - surface.border[:, 0], axis=1).sum()
    assert around == pytest.approx(4 * (2 * np.pi * RADIUS + chord + 16))


def test_each_contact_is_cut_through_its_own() -> None:
    """Through the middle of what is worn there, on its nodes alone; on the strip on those of the same name."""
    x, cells, sliding, number = bores()
    worn = np.maximum(np.cos(sliding[:, 0] / RADIUS - 0.1 * (1 + number)), 0)
    node, strip = "node", "node_strip"
    columns = dict(zip(("x", "y", "z", "along", "across"), [*x.T, *sliding.T], strict=True))
    variables = {f"{name}{end}": (dim, column) for end, dim in (("", node), ("_strip", strip))
                 for name, column in columns.items()}  # fmt: skip
    names = {"flag_meanings": "left right"}
    history = xarray.Dataset(
        {
            **variables,
            "facets": (("cell", "corner"), cells), "facets_strip": (("cell", "corner"), cells),
            "contact": (node, number, names), "contact_strip": (strip, number, names),
            "wear": (("half_cycle", node), worn[None]), "weight": (node, np.ones(len(x))),
        }
    )  # fmt: skip
    left, right = cut_places(history)
    assert (left.name, right.name) == ("left", "right")
    assert left.at[0] < right.at[0]
    np.testing.assert_allclose([left.at[1], right.at[1]], [-30, 30])
    np.testing.assert_array_equal(right.nodes["strip"], number == 1)
    surface = Surface("punch", x, cells, sliding, (0, 2))
    for place in (left, right):
        across, values = surface.cut(sliding[:, 1], place.at, along=False, nodes=place.nodes["punch"])
        np.testing.assert_allclose(values, across, atol=1e-9)
        assert np.ptp(across) == pytest.approx(16)


def test_parts_behind_each_other_have_their_own_axes() -> None:
    """Two faces of a disc: ticks of both tell where the nodes are."""
    place, up = np.meshgrid(np.linspace(60, 100, 5), np.linspace(-30, 30, 4), indexing="ij")
    nodes = np.arange(place.size).reshape(place.shape)
    cell = np.stack([nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]], -1).reshape(-1, 4)
    flat = np.column_stack([place.ravel(), up.ravel()])
    x = np.vstack([np.column_stack([flat, np.full(len(flat), z)]) for z in (0.0, -20.0)])
    surface = Surface("punch", x, np.vstack([cell, cell + len(flat)]), np.vstack([flat, flat]), (0, 1))
    ax = Figure().subplots()
    surface.set_ticks(ax)
    told = [float(text.get_text()) for text in ax.get_xticklabels()]
    assert told[: len(told) // 2] == told[len(told) // 2 :]
    shift = surface.map[len(flat) :, 0].min() - surface.map[: len(flat), 0].min()
    np.testing.assert_allclose(ax.get_xticks() - told, np.repeat([0, shift], len(told) // 2))
