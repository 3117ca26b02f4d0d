"""Distances from the edge of a contact."""

from __future__ import annotations

import numpy as np
import pytest
from combinations import SMALL

from fenwear import assemble, load_case, march
from fenwear.surfaces.contact_edges import Edges, rim_points

HELD = (
    "punch.supports=[{on='punch_sides', fix=['x', 'y']}]",
    "punch.loads=[{on='punch_far', force=['0 N', '0 N', '-1 kN']}]",
    "strip.supports=[{on='strip_far', fix=['x', 'y', 'z']}]",
    "wear={punch={coefficient='1e-8 1/MPa'}}",
    "motion.positions=1",
)


def test_in_the_plane_the_edge_is_half_way_to_the_next_node() -> None:
    """And where the surface ends, for nodes that touch up to there."""
    surface = assemble(
        load_case("fretting-partial-slip", [*SMALL, "contact.law='gross-sliding'", "stick={}"])
    ).pair.punch
    x, edges = surface.abscissa, Edges(surface)
    touching = (x > -0.08) & (x < 0.05)
    first, last = np.flatnonzero(touching)[[0, -1]]
    left, right = (x[first - 1] + x[first]) / 2, (x[last] + x[last + 1]) / 2
    found = edges.distance(touching)
    wanted = np.where(touching, np.minimum(x - left, right - x), 0.0)
    assert found == pytest.approx(wanted, abs=1e-4 * np.ptp(x))  # chords of the circle
    everywhere = edges.distance(np.full(len(x), True))
    assert everywhere == pytest.approx(np.minimum(x - x[0], x[-1] - x), abs=1e-4 * np.ptp(x))
    assert not edges.distance(np.full(len(x), False)).any()


def test_of_solids_it_is_their_rim() -> None:
    """A block pressed all over: the distance from the nearest side of its face."""
    surface = assemble(load_case("ball-on-flat", ["geometry={file='solid_blocks.geo', degree=1}", *HELD])).pair.punch
    x = surface.x[:, :2]
    low, high = x.min(axis=0), x.max(axis=0)
    found = Edges(surface).distance(np.full(len(x), True))
    assert found == pytest.approx(np.minimum(x - low, high - x).min(axis=1), abs=1e-9)
    assert len(rim_points(surface)) == 2 * (len(np.unique(x[:, 0].round(9))) + len(np.unique(x[:, 1].round(9)))) - 4


def test_nothing_ends_at_planes_of_symmetry() -> None:
    """A quarter of a block has the distances, and the debris that edges lose, of the whole one, at every node."""
    found = []
    for quarter, across in ((0, 4), (1, 2)):
        parameters = f"{{quarter={quarter}, across_x={across}, across_y={across}, margin_x=0.5, margin_y=0.5}}"
        geometry = f"file='solid_blocks.geo', degree=1, follow_wear='never', parameters={parameters}"
        settings = (f"geometry={{{geometry}}}", *HELD)
        if quarter:
            for body in ("punch", "strip"):
                planes = [f"{{on='{body}_middle_{axis}', fix=['{axis}']}}" for axis in "xy"]
                planes += ["{on='strip_far', fix=['x', 'y', 'z']}"] if body == "strip" else []
                settings = (*settings, f"{body}.supports=[{', '.join(planes)}]")
            settings = (*settings, "punch.loads=[{on='punch_far', force=['0 N', '0 N', '-0.25 kN']}]")
        else:
            held = "punch.supports=[{at=[0, 0, 1], fix=['x', 'y']}]"
            settings = (*settings, held, "punch.no_turning_about=['x', 'y', 'z']")
        third = "contact={friction=0, third_body={share=0.5, life='3 mm', edge_life='0.1 mm', edge_length='0.1 mm'}}"
        system = assemble(load_case("ball-on-flat", [*settings, third]))
        *_, last = march(system, 20)
        x, edges = system.pair.punch.x, system.laws.edges
        assert edges is not None
        own = (x[:, :2] >= -1e-9).all(axis=1)
        order = np.lexsort(x[own, :2].round(6).T)
        distance = edges.distance(np.full(len(x), True))
        found.append([row[own][order] for row in (distance, last.end.worn.punch, last.end.worn.between[0])])
    for whole, quarter in zip(*found, strict=True):
        assert quarter == pytest.approx(whole, rel=1e-8)
