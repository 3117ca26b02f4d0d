"""Contacts of several patches: full bores, cups, both faces of a disc."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from fenwear import CaseError, Tribosystem, assemble, load_case, make_case, march
from fenwear.bodies.contact_surface import ContactSurface, vertex_surface
from fenwear.bodies.round_surfaces import rounds_of
from fenwear.surfaces import check_distance, pair
from fenwear.surfaces.patches import folds, patches
from fenwear.surfaces.placement import Placement

RADIUS, CLEARANCE, YOUNG, POISSON = 10.0, 0.05, 210e3, 0.3


def bore(load: float, elements: int, folder: Path, clearance: float = CLEARANCE) -> Tribosystem:
    """Return a shaft in the whole of a bore in a large plate of its material, loaded along z, mm and N/mm."""
    (folder / "bore.toml").write_text(f"""
title = "bore"
[geometry]
file = "bushing.geo"
degree = 2
order = 2
[geometry.parameters]
radius = {RADIUS}
clearance = {clearance}
wall = 790
shaft_wall = 9.9
contact_angle = 180
elements_along_contact = {elements}
[model]
plane = "strain"
thickness = "1 mm"
[materials.steel]
young = {YOUNG}
poisson = {POISSON}
[punch]
regions = {{punch_body = "steel"}}
[[punch.supports]]
on = "punch_top"
fix = ["x"]
[[punch.loads]]
on = "punch_top"
force = [0, {-load!r}]
[strip]
regions = {{strip_body = "steel"}}
[[strip.supports]]
on = "strip_bottom"
fix = ["x", "z"]
[contact]
friction = 0
[wear.punch]
coefficient = 1e-8
[motion]
kind = "rotation"
axis = [0, 1, 0]
angular_speed = 1
duration = 1
[run]
half_cycles = 1
""")
    return assemble(load_case(folder / "bore.toml"))


def test_transfer_around_a_bore(tmp_path: Path) -> None:
    """Constants to rounding, waves around the shaft pointwise to third order, also where patches meet; wear kept."""
    errors = []
    for elements in (40, 80):
        between = bore(50.0, elements, tmp_path).pair
        assert len(patches(between.punch, between.strip)) == 4
        on_shaft = np.arctan2(*between.strip.trace.T)
        way = (between.punch.x + np.array([0, CLEARANCE])) / (RADIUS + CLEARANCE)
        down = CLEARANCE * way[:, 1]
        opposite = (down + np.sqrt(down**2 + RADIUS**2 - CLEARANCE**2))[:, None] * way - np.array([0, CLEARANCE])
        errors.append(np.abs(between.transfer @ np.sin(3 * on_shaft) - np.sin(3 * np.arctan2(*opposite.T))).max())
        np.testing.assert_allclose(between.transfer.sum(axis=1), 1, rtol=1e-12)
        assert between.wear_projection.data.min() > 0
        depth = np.random.default_rng(1).uniform(size=len(between.weights))
        on_strip = between.wear_projection @ depth
        assert between.strip.weights @ on_strip == pytest.approx(between.weights @ depth, rel=1e-12)
        even = between.wear_projection @ np.ones(len(between.weights))
        np.testing.assert_allclose(even, between.weights.sum() / between.strip.weights.sum(), rtol=0.02)
    assert errors[1] < 0.3 * errors[0] < 2e-4


def sphere(name: str, radius: float, points: int, below: float, seed: int) -> ContactSurface:
    """Return the part of a sphere below a height, of points that lie anywhere; a cup's is seen from inside."""
    along = np.arccos(1 - 2 * (np.arange(points) + 0.5) / points)
    around = np.pi * (1 + 5**0.5) * np.arange(points)
    x = np.stack([np.sin(along) * np.cos(around), np.sin(along) * np.sin(around), np.cos(along)], axis=1)
    x = Rotation.random(random_state=seed).apply(x)
    facets = ConvexHull(x).simplices
    facets = facets[(x[facets][:, :, 2] < below).all(axis=1)]
    used, facets = np.unique(facets, return_inverse=True)
    inner = x[used][facets.reshape(-1, 3)].mean(axis=1) * (2 * radius if name == "punch" else 0.0)
    return vertex_surface(name, radius * x[used], facets.reshape(-1, 3), 1, inner)


def test_ball_in_a_cup() -> None:
    """A cup and a ball that has turned any way: nodes have the ball's surface opposite, to second order."""
    errors = []
    for points in (500, 2000):
        cup, ball = sphere("punch", 10.02, points, 0.0, 1), sphere("strip", 10.0, 2 * points, 2.0, 2)
        turned = Placement(turn=(0.5, -0.9, 0.3))
        assert {len(patches(cup, ball)), len(patches(cup, ball, turned))} == {5}
        between = pair(cup, ball, turned)
        there = turned.points(ball.trace)
        np.testing.assert_allclose(between.transfer.sum(axis=1), 1, rtol=1e-12)
        way = (between.transfer @ there) / 10.0
        errors.append(np.linalg.norm(way - cup.x / 10.02, axis=1).max())
        np.testing.assert_allclose(between.initial_gap, 0.02, atol=1e-12)  # of the spheres, not of their facets
        np.testing.assert_allclose(between.normal, cup.x / 10.02, atol=1e-12)
        assert between.wear_projection.data.min() >= 0
    assert errors[1] < 0.35 * errors[0] < 0.02


def test_spheres_that_lie_beside_each_other() -> None:
    """The gap is that of the spheres, to second order in what the clearance changes; one that is dented has facets."""
    errors, shift = [], np.array([0.003, -0.002, -0.004])
    for points in (500, 2000):
        cup, ball = sphere("punch", 10.02, points, 0.0, 1), sphere("strip", 10.0, 2 * points, 2.0, 2)
        between = pair(cup, ball, Placement(shift=tuple(shift), turn=(0.5, -0.9, 0.3)))
        exact = np.linalg.norm(cup.x - shift, axis=1) - 10.0
        inside = cup.x[:, 2] < -2.0  # at the rim the mean of a node's facets is beside it
        errors.append(float(np.abs(between.initial_gap - exact)[inside].max()))
    assert errors[1] < 0.4 * errors[0] < 4e-5
    dent = replace(ball, trace=ball.trace * (1 + 1e-6 * np.cos(ball.trace[:, :1])))
    assert ball.rounds[1].min() == 0
    assert (dent.rounds[1] == -1).all()
    assert np.ptp(pair(cup, dent).initial_gap) > 1e-3


def test_a_cylinder_in_any_place() -> None:
    """Its axis and radius to rounding, from the nodes of a part of it; a slab is none."""
    rng, turn = np.random.default_rng(3), Rotation.from_rotvec([0.4, -1.1, 0.2])
    around, along = (np.repeat(rng.uniform(*ends, 20), 3) + rng.uniform(0, 0.1, 60) for ends in ((-1.2, 1.2), (0, 8)))
    outward = np.column_stack([np.sin(around), np.zeros(60), np.cos(around)])
    x = turn.apply(7.5 * outward + np.outer(along, [0, 1, 0])) + np.array([3.0, -2.0, 30.0])
    facets = np.arange(60).reshape(-1, 3)
    (found,), _ = rounds_of(x, facets, np.zeros(20, dtype=int), turn.apply(-outward + 1e-3 * rng.normal(size=(60, 3))))
    assert found.radius == pytest.approx(7.5, rel=1e-12)
    assert found.sign == -1
    np.testing.assert_allclose(np.abs(turn.inv().apply(found.axis)), [0, 1, 0], atol=1e-12)
    slab = turn.apply(np.column_stack([rng.uniform(-4, 4, (60, 2)), np.zeros(60)]))
    assert not rounds_of(slab, facets, np.zeros(20, dtype=int), turn.apply(np.tile([0.0, 0, 1], (60, 1))))[0]


def test_a_ball_larger_than_its_cup() -> None:
    """And surfaces that touch nowhere: refused by name."""
    cup, ball = sphere("punch", 10.0, 500, 0.0, 1), sphere("strip", 10.5, 1000, 2.0, 2)
    with pytest.raises(CaseError, match=r"strip_contact, of radius 10.5 mm, is larger than punch_contact around it"):
        check_distance(pair(cup, ball))
    away = replace(ball, trace=ball.trace + np.array([60.0, 0.0, 0.0]))
    with pytest.raises(CaseError, match=r"they touch nowhere: no part of strip_contact looks at a part of punch_co"):
        pair(cup, away)


def faces(name: str, heights: tuple[float, float], count: int, inwards: float) -> ContactSurface:
    """Return two square faces at these heights, which look away from each other, or at each other (-1)."""
    line = np.linspace(0, 1, count + 1)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    corner = i * (count + 1) + j
    one = np.concatenate([np.stack(c, 1) for c in ((corner, corner + 1, corner + count + 1),
                                                   (corner + 1, corner + count + 1, corner + count + 2))])  # fmt: skip
    trace = np.concatenate([np.column_stack([grid, np.full(len(grid), z)]) for z in heights])
    facets = np.concatenate([one, one + len(grid)])
    inner = trace[facets].mean(axis=1)
    inner[:, 2] += inwards * np.sign(np.mean(heights) - inner[:, 2]) * 0.1
    order = np.lexsort(trace.T[::-1])
    rank = np.argsort(order)
    return vertex_surface(name, trace[order], rank[facets], 1, inner)


def test_both_faces_of_a_disc() -> None:
    """Pads on both sides look at the disc between them: two patches, each with its own face opposite."""
    pads, disc = faces("punch", (-0.5, 0.5), 4, -1.0), faces("strip", (-0.5, 0.5), 7, 1.0)
    assert len(patches(pads, disc)) == 2
    between = pair(pads, disc)
    np.testing.assert_allclose(between.transfer @ disc.trace, pads.x, atol=1e-12)
    np.testing.assert_allclose(between.normal[:, 2], 2 * pads.x[:, 2], atol=1e-12)
    np.testing.assert_allclose(between.initial_gap, 0, atol=1e-12)


def test_a_box_is_no_contact() -> None:
    """Its sides meet at edges, and lie on no round surface."""
    box = faces("strip", (-0.5, 0.5), 3, 1.0)
    sides = vertex_surface("strip", box.trace[:, [2, 0, 1]], box.facets, 1, np.full((len(box.facets), 3), 0.5) * 0)
    assert not folds(box)
    assert not folds(sides)
    both = np.concatenate([box.trace, box.trace[:, [2, 0, 1]] + (0.5, 0.5, -0.5)])
    facets = np.concatenate([box.facets, box.facets + len(box.trace)])
    whole = vertex_surface("strip", both, facets, 1, np.broadcast_to([0.5, 0.5, 0.0], (len(facets), 3)))
    assert folds(whole)
    with pytest.raises(CaseError, match="strip_contact folds back on itself"):
        pair(faces("punch", (-0.5, 0.5), 4, -1.0), whole)


CUP = """
DefineConstant[ size = 2.5 ];
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 15, 0, Pi/2};
Sphere(2) = {0, 0, 0, 10, 0, Pi/2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Sphere(4) = {0, 0, 0, 10, -0.3, Pi/2};
Sphere(5) = {0, 0, 0, 5};
BooleanDifference(6) = { Volume{4}; Delete; }{ Volume{5}; Delete; };
Mesh.MeshSizeMax = size; Mesh.MeshSizeMin = size;
Physical Volume("punch_body") = {3}; Physical Surface("punch_contact") = {3}; Physical Surface("punch_far") = {1};
Physical Volume("strip_body") = {6}; Physical Surface("strip_contact") = {4}; Physical Surface("strip_core") = {6};
"""


def test_worn_in_cup(tmp_path: Path) -> None:
    """A cup that wears on a ball turning about an axis square to the load: p = p0 cos psi, p0 = 4 F / (pi² R²).

    psi is the longitude about the axis; the cup sinks by 4 k omega F / (pi² R), of k F omega R 4 / pi in volume.
    """
    (tmp_path / "cup.geo").write_text(CUP)
    load, coefficient, errors = 1000.0, 1e-7, []
    for size in (2.5, 1.5):
        tables = {
            "title": "cup",
            "geometry": {"file": str(tmp_path / "cup.geo"), "degree": 1, "parameters": {"size": size}},
            "model": {"kind": "solid"},
            "materials": {"polymer": {"young": 1000, "poisson": 0.4}, "steel": {"young": 210e3, "poisson": 0.3}},
            "punch": {
                "regions": {"punch_body": "polymer"},
                "no_turning_about": ["x", "y", "z"],
                "loads": [{"on": "punch_far", "force": [0, 0, -load]}],
            },
            "strip": {
                "regions": {"strip_body": "steel"},
                "supports": [{"on": "strip_core", "fix": ["x", "y", "z"]}],
            },
            "contact": {"friction": 0.0},
            "wear": {"punch": {"coefficient": coefficient}},
            "motion": {"kind": "rotation", "axis": [0, 1, 0], "angular_speed": 1.0, "duration": 1.0},
            "run": {"half_cycles": 1},
        }
        system = assemble(make_case(tables))
        assert system.rigid.mode_names == ("lambda_F", "lambda_Fx", "lambda_Fy")
        x, weights = system.pair.punch.x, system.pair.weights
        best, largest = system.optimum(1), 4 * load / (np.pi**2 * 100)
        exact = largest * np.maximum(np.cos(np.arctan2(x[:, 0], x[:, 2])), 0)
        rate = weights @ (coefficient * best.pressure * system.sliding.ratio[0])
        errors.append(
            (
                np.abs(best.pressure - exact).max() / largest,
                abs(best.velocity["lambda_F"] / (10 * coefficient * largest) - 1),
                abs(rate / (4 / np.pi * coefficient * load * 10) - 1),
            )
        )
        assert abs(best.velocity["lambda_Fx"]) < 2e-3 * best.velocity["lambda_F"]
        first = next(iter(march(system, 1))).pressure[0]
        np.testing.assert_allclose((weights * first) @ system.pair.normal, [0, 0, load], atol=1e-7)
    assert all(fine < 0.6 * coarse for coarse, fine in zip(*errors, strict=True))
    assert errors[1][0] < 0.05
    assert max(errors[1][1:]) < 5e-3
