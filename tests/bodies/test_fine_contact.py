"""Bodies whose contact is finer than their mesh: against exact kernels, Hertz, and the condensed body."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.special import j0
from ufl.algorithms import extract_coefficients

from fenwear import Case, CaseError, assemble, load_case, march, vary
from fenwear.bodies import fine_contact as fine_bodies
from fenwear.bodies import surface_operators
from fenwear.bodies.convolution import Convolution
from fenwear.bodies.elastic_material import Isotropic
from fenwear.bodies.fine_contact import RESOLVED, FineBody, fine
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.half_space import HalfSpace, influence
from fenwear.bodies.half_space import half_space as as_half_space
from fenwear.bodies.half_space_correction import Ground
from fenwear.bodies.response import Request, identity
from fenwear.bodies.surface_operators import OPERATORS
from fenwear.common.arrays import Array
from fenwear.system import build_bodies, elastic, make_sliding, place, relaid

NU = 0.3
Pressed = tuple[Array, float]  # pressures (n,) and how far the bodies come
BALL = (
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "contact.friction=0", "wear.punch.coefficient=0", "wear.strip.coefficient=0", "motion.positions=2",
    "punch.operator='fine'", "strip.operator='fine'", "grid.size=['0.36 mm', '0.36 mm']",
)  # fmt: skip


def layer(across: int, layers: int, **more: Any) -> Case:
    """Return a layer of thickness 1, bonded to a rigid base, 8 x 8 wide, E = 1; above it a stiff block."""
    sizes = {"width": 4, "depth": 4, "margin_x": 2, "margin_y": 2, "punch_height": 1, "strip_height": 1}
    counts = {"across_x": across // 2, "across_y": across // 2, "margin_elements": across // 4}
    data: dict[str, Any] = {
        "geometry": {
            "file": "solid_blocks.geo",
            "degree": 2,
            "parameters": {**sizes, **counts, "punch_layers": 1, "strip_layers": layers},
        },
        "model": {"kind": "solid"},
        "materials": {"layer": {"young": 1.0, "poisson": NU}, "hard": {"young": 1e8, "poisson": NU}},
        "punch": {
            "regions": {"punch_body": "hard"},
            "supports": [{"on": "punch_far", "fix": ["x", "y"]}],
            "no_turning_about": ["x", "y", "z"],
            "loads": [{"on": "punch_far", "force": [0, 0, -1]}],
            "operator": "half-space",
        },
        "strip": {
            "regions": {"strip_body": "layer"},
            "supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}],
            "operator": "fine",
        },
        "grid": {"nodes": 33, "size": [1.8, 1.8]},
        "contact": {"friction": 0.0},
        "wear": {"punch": {"coefficient": 0.0}},
        "motion": {"kind": "reciprocating", "amplitude": 0.1, "period": 1.0},
        "run": {"half_cycles": 2},
    }
    return Case.model_validate({**data, **more})


@cache
def otherwise(r: float) -> float:
    """Return what a unit force moves the layer by at a distance, beyond a half-space: row 55, Hankel's integral."""
    k = 3 - 4 * NU

    def rest(s: float) -> float:
        kernel = (2 * k * np.sinh(2 * s) - 4 * s) / (2 * k * np.cosh(2 * s) + 1 + k * k + 4 * s * s)
        return float((kernel - 1) * 2 * (1 - NU**2) * j0(s * r) / (2 * np.pi))

    return float(quad(rest, 0, 40, limit=400)[0])


def as_fine(case: Case, *, upright: bool = True) -> tuple[FineBody, Array]:
    """Return the strip of a case and its nodes."""
    body = build_bodies(case).strip
    x = body.surface.x
    up = np.broadcast_to(np.eye(x.shape[1])[-1], x.shape) if upright else None
    return fine(Request(body, identity(len(x)), up)), x


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_of_the_half_space(dim: int) -> None:
    """Equilibrium inside, no traction on the surface, and there the displacements that products are made of."""
    shear, nu = 8e4, 0.3
    grid = RegularGrid((0.0,) * (dim - 1), (1.0,) * (dim - 1), (2,) * (dim - 1), dim - 1, 0.0)
    ground = Ground(grid, 1.0, shear, nu, 5.0)

    def u(x: Array, force: Array) -> Array:
        return np.array(ground.field(x, [0.0] * (dim - 1), force))

    h, eye = 1e-3, np.eye(dim)
    inner, edge = np.array([0.7, 0.4, -0.5][3 - dim :]), np.array([0.3, 0.8, 0.0][3 - dim :])
    for force in eye:
        second = np.array(
            [
                [
                    (
                        u(inner + h * (a + b), force)
                        - u(inner + h * (a - b), force)
                        - u(inner - h * (a - b), force)
                        + u(inner - h * (a + b), force)
                    )
                    / (4 * h * h)
                    for b in eye
                ]
                for a in eye
            ]
        )  # fmt: skip  (a, b, component)
        grad_div = np.einsum("abb->a", second)
        navier = np.einsum("aac->c", second) + grad_div / (1 - 2 * nu)
        assert np.abs(navier).max() < 1e-4 * np.abs(second).max()
        below = edge - 2 * h * eye[-1]
        slopes = np.array([(u(below + h * a, force) - u(below - h * a, force)) / (2 * h) for a in eye])
        strain = (slopes + slopes.T) / 2
        traction = 2 * (strain[-1] + nu / (1 - 2 * nu) * np.trace(strain) * eye[-1])
        assert np.abs(traction).max() < 0.02 * np.abs(strain).max()
        side = 1e-3
        sides = (side,) * (dim - 1)
        exact = influence(edge[None, :-1], sides, shear, nu, 5.0)[0] / side ** (dim - 1)
        turned = np.array([*[1.0] * (dim - 1), -1.0])  # into the body is against z
        np.testing.assert_allclose(u(edge, force), turned * (exact @ (turned * force)), rtol=1e-4, atol=1e-12)


@pytest.mark.mpi
def test_layer_on_a_rigid_base() -> None:
    """Row 55: the displacement of every node from forces in the middle and at a corner, falling with the mesh."""
    errors = []
    for across, layers in ((8, 2), (12, 3)):
        body, x = as_fine(layer(across, layers))
        at = [int(np.argmin(((x[:, :2] - place) ** 2).sum(axis=1))) for place in ((0, 0), (0.45, 0.9))]
        smooth = body.weights.to_nodes(body.correction.response[:, 0, :, 2] @ body.weights.rows(np.array(at)).T)
        seen = np.arange(0, len(x), 7)
        r = np.linalg.norm(x[seen, None, :2] - x[at][:, :2], axis=2)
        exact = np.vectorize(otherwise)(r.round(12))
        errors.append(np.abs(smooth[seen] - exact).max() / abs(otherwise(0.0)))
        assert body.correction.uneven < 0.01
        assert body.unresolved < 1e-3
    assert errors[0] < 0.02
    assert errors[1] < 0.003


def test_products_are_of_the_entries() -> None:
    """Products, numbers and the diagonal are of one operator, which is symmetric, along all axes and along one."""
    case = layer(8, 2, grid={"nodes": 7, "size": [1.0, 0.8]})
    whole, x = as_fine(case, upright=False)
    upright, _ = as_fine(case)
    forces = np.random.default_rng(1).standard_normal((len(x), 3, 2))
    for body in (whole, upright):
        every = body.entries(slice(None), slice(None))
        found = np.einsum("iajd,jdk->iak", every, forces)
        np.testing.assert_allclose(body.apply(forces), found, rtol=0, atol=1e-11 * np.abs(found).max())
        here = every[np.arange(len(x)), :, np.arange(len(x))]
        np.testing.assert_allclose(body.diagonal(), here, rtol=0, atol=1e-13 * np.abs(every).max())
    full = whole.entries(slice(None), slice(None))
    np.testing.assert_allclose(every[..., 2], full[:, -1:, :, 2], rtol=0, atol=1e-12 * np.abs(full).max())
    mesh = whole.correction.uneven * np.abs(whole.correction.response).max()  # along one axis it is not made symmetric
    np.testing.assert_allclose(every, full[:, -1:], rtol=0, atol=2 * mesh)
    np.testing.assert_allclose(full, full.transpose(2, 3, 0, 1), rtol=0, atol=1e-12 * np.abs(full).max())


@pytest.mark.slow
def test_as_the_condensed_body() -> None:
    """Normal and tangential: a smooth load moves both alike, also where another material lies below."""
    case = layer(8, 4, grid={"nodes": 21, "size": [3.0, 3.0]})
    case = case.model_copy(update={"geometry": case.geometry.model_copy(update={"degree": 3})})
    case.geometry.parameters["strip_height"] = 4.0
    body = build_bodies(case).strip
    assert isinstance(body.law, Isotropic)
    cells = body.body.mesh.topology.index_map(3).size_local
    middle = body.body.mesh.geometry.x[body.body.mesh.geometry.dofmap].mean(axis=1)[:cells]
    for field in extract_coefficients(body.law.lame[1]):
        if field.x.array[0] == 1.0:
            field.x.array[field.function_space.dofmap.list[:cells, 0][middle[:, 2] < -2]] = 3.0
    x = body.surface.x
    nodes = Request(body, identity(len(x)))
    found = fine(nodes)
    bump = np.maximum(1 - (x[:, 0] ** 2 + x[:, 1] ** 2) / 1.5**2, 0) ** 2 * body.surface.weights
    forces = bump[:, None, None] * np.eye(3)
    at = ufl.SpatialCoordinate(body.body.mesh)
    dome = ufl.max_value(1 - (at[0] ** 2 + at[1] ** 2) / 1.5**2, 0) ** 2
    tag = body.body.curves["strip_contact"]
    on_mesh = np.stack([body.surface_integral(dome * ufl.as_vector(e), tag) for e in np.eye(3)], axis=1)
    on_mesh[body.supported] = 0.0
    theirs = body.on_surface(body.trace.pick(body.solve(on_mesh)))
    error = np.abs(found.apply(forces) - theirs).max(axis=(0, 1)) / np.abs(theirs).max(axis=(0, 1))
    assert error.max() < 0.005, error


def test_a_guided_body() -> None:
    """A punch that guides hold against turning: by the same couples as its mesh, under forces that would tilt it."""
    case = layer(12, 1, grid={"nodes": 17, "size": [2.4, 2.4]})
    case.geometry.parameters["punch_height"] = 4.0
    case.geometry.parameters["punch_layers"] = 6
    body = build_bodies(case).punch
    found = fine(Request(body, identity(len(body.surface.x))))
    assert body.guides.couples.size
    x = body.surface.x
    bump = np.maximum(1 - ((x[:, 0] - 0.3) ** 2 + x[:, 1] ** 2) / 0.8, 0) ** 2 * body.surface.weights
    at = ufl.SpatialCoordinate(body.body.mesh)
    dome = ufl.max_value(1 - ((at[0] - 0.3) ** 2 + at[1] ** 2) / 0.8, 0) ** 2
    tag = body.body.curves["punch_contact"]
    on_mesh = np.stack([body.surface_integral(dome * ufl.as_vector(e), tag) for e in np.eye(3)], axis=1)
    couple = body.couple_of(on_mesh)
    on_mesh[body.supported] = 0.0
    theirs = body.on_surface(body.trace.pick(body.held(body.solve(on_mesh), on_mesh, couple)))
    ours = found.apply(bump[:, None, None] * np.eye(3))
    error = np.abs(ours - theirs).max(axis=(0, 1)) / np.abs(theirs).max(axis=(0, 1))
    assert error.max() < 0.04, error  # of its mesh: 0.5 % on one twice as fine


@pytest.mark.mpi
@pytest.mark.parametrize("settings", [(), ("geometry.degree=1",)])
def test_ball_on_flat_is_the_contact_of_hertz(settings: tuple[str, ...]) -> None:
    """Row 19's like: pressures node by node, falling with the spacing, on meshes with four elements at the contact.

    Elements of degree 1 whose shape is curved are as round.
    """
    errors = []
    for nodes in (33, 65):
        system = assemble(load_case("ball-on-flat", [*BALL, *settings, f"grid.nodes={nodes}"]))
        pressure = next(iter(march(system, 1))).pressure[-1]
        modulus, radius = 210e3 / (2 * (1 - NU**2)), 5.0
        a = (3 * 20 * radius / (4 * modulus)) ** (1 / 3)
        r = np.hypot(*system.pair.punch.x[:, :2].T)
        exact = np.sqrt(np.maximum(1 - (r / a) ** 2, 0))
        found = pressure / (1.5 * 20 / (np.pi * a**2))
        errors.append(np.abs(found - exact)[r < 0.8 * a].max())
        assert pressure @ system.pair.weights == pytest.approx(20, rel=1e-9)
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.003


def test_other_positions_and_coarser_grids_share_what_bodies_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is solved again where another motion or grid reaches no further, and contacts are those of new bodies."""
    settings = [*BALL, "grid.nodes=33", "motion.positions=6"]
    system = assemble(load_case("ball-on-flat", settings))
    grid = system.pair.punch.grid
    assert grid is not None
    fresh = assemble(load_case("ball-on-flat", [*settings, "motion.positions=2"]))
    with monkeypatch.context() as patch:
        patch.setattr("fenwear.bodies.fine_contact.correct", None)
        found = vary(system, "motion.positions=2")
        rough = relaid(system, system.case, grid.thinned(2))
    ours, theirs = (one.phase_contact([0]).solve(one.gap(0, one.unworn())).pressure[0] for one in (found, fresh))
    assert ours == pytest.approx(theirs, abs=RESOLVED * theirs.max())
    every = rough.pair.punch.grid
    assert every is not None
    assert every.counts == (17, 17)
    assert grid.flat[every.of_other(grid)] == pytest.approx(every.flat, abs=1e-12)  # its nodes are some of those before
    few = rough.phase_contact([0]).solve(rough.gap(0, rough.unworn()))
    assert few.pressure[0] @ rough.pair.weights == pytest.approx(20, rel=1e-9)


def test_a_contact_decides() -> None:
    """On a grid, of itself: fine far from edges, else condensed, each body for itself; the run says which, and why."""
    ball = [one for one in BALL if "operator" not in one]
    fine_of = assemble(load_case("ball-on-flat", [*ball, "grid.nodes=17"]))
    asked = assemble(load_case("ball-on-flat", [*BALL, "grid.nodes=17"]))
    pressures = [one.phase_contact([0]).solve(one.gap(0, one.unworn())).pressure[0] for one in (fine_of, asked)]
    assert np.array_equal(*pressures)
    assert [line.split(":")[:2] for line in fine_of.bodies.solved_by] == [
        [f"{name}.operator", " 'fine' is used"] for name in ("punch", "strip")
    ]
    assert not asked.bodies.solved_by
    edges = assemble(load_case("example1-lz40", ["grid.nodes=81"]))
    said = edges.bodies.solved_by
    assert [edges.bodies.punch.operator, edges.bodies.strip.operator] == ["condensed", "fine"]
    assert "'condensed' is used" in said[0]
    assert "polynomials" in said[0]
    by_hand = assemble(
        load_case("example1-lz40", ["grid.nodes=81", "punch.operator='condensed'", "strip.operator='fine'"])
    )
    pressures = [one.phase_contact([0]).solve(one.gap(0, one.unworn())).pressure[0] for one in (edges, by_hand)]
    assert pressures[0] == pytest.approx(pressures[1], rel=1e-9)
    assert assemble(load_case("example1")).bodies.punch.operator == "condensed"


@pytest.mark.slow
def test_each_body_for_itself() -> None:
    """One body fine, the other condensed on the same grid: on meshes as fine as the grid pressures are near."""
    found = []
    for punch, strip in (("fine", "fine"), ("condensed", "fine")):
        each = (f"punch.operator='{punch}'", f"strip.operator='{strip}'", "geometry.parameters.across=6")
        wide = ("grid.nodes=13", "geometry.parameters.stroke_elements=4", "grid.size=['0.3 mm', '0.3 mm']")
        system = assemble(load_case("ball-on-flat", [*BALL, *each, *wide]))
        contact = system.phase_contact([0]).solve(system.gap(0, system.unworn()))
        assert contact.pressure[0] @ system.pair.weights == pytest.approx(20, rel=1e-9)
        found.append(contact.pressure[0])
    for other in found[1:]:
        assert np.abs(other - found[0]).max() < 0.15 * found[0].max()


class ExactLayer(HalfSpace):
    """The layer by its kernel, of normal forces alone."""

    @cached_property
    def convolution(self) -> Convolution:
        """Displacements at all distances."""
        found = super().convolution
        counts = [np.arange(1 - count, count) for count in found.counts]
        far = np.hypot(*np.meshgrid(*(c * h for c, h in zip(counts, self.spacing, strict=True)), indexing="ij"))
        at = np.linspace(0, 2.6, 400)
        table = found.table.copy()
        table[0, 2] += CubicSpline(at, [otherwise(r) for r in at])(far)
        return replace(found, table=table)


def as_exact_layer(request: Request) -> HalfSpace:
    """Return the layer by its kernel."""
    half = as_half_space(request)
    return ExactLayer(**{field.name: getattr(half, field.name) for field in fields(half)})


def on_layer(
    radius: float, larger: float, nodes: int, wide: float, mesh: tuple[int, int] = (12, 3)
) -> tuple[Pressed, Pressed, Array]:
    """Return a rigid sphere of 20 H on the layer, fine and by the exact kernel: pressures and approach; and the nodes.

    Args:
        radius: Of the contact over the thickness H.
        larger: The load over that of a half-space, whose contact is larger.
        nodes: Along the sides of the grid.
        wide: Its sides, H.
        mesh: Elements of the layer across each way, and through its thickness.
    """
    load, found = larger * 4 / 3 * (1 / (1 - NU**2)) * radius**3 / 20, []
    case = layer(*mesh, grid={"nodes": nodes, "size": [wide, wide]})
    for make in (fine, as_exact_layer):
        loads = [one.model_copy(update={"force": (0.0, 0.0, -load)}) for one in case.punch.loads]
        case = case.model_copy(update={"punch": case.punch.model_copy(update={"loads": tuple(loads)})})
        bodies = build_bodies(case)
        x = bodies.punch.surface.x
        sphere = (x[:, 0] ** 2 + x[:, 1] ** 2) / 40
        bodies.punch.surface = replace(bodies.punch.surface, profile=sphere)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(surface_operators, "OPERATORS", {**OPERATORS, "fine": make})
            system = elastic(place(bodies, make_sliding(case), case))
        contact = system.phase_contact([0]).solve(system.gap(0, system.unworn()))
        found.append((contact.pressure[0], float(contact.rigid[0, 0])))
    return found[0], found[1], x


@pytest.mark.parametrize(("radius", "larger"), [(0.3, 1.0), (0.6, 1.1), (0.85, 1.2)])
def test_sphere_on_a_layer(radius: float, larger: float) -> None:
    """Row 55: a rigid sphere of 20 H pressed on the layer, pressures node by node and the approach."""
    (ours, approach), (exact, exact_approach), x = on_layer(radius, larger, 65, 1.9)
    r = np.hypot(x[:, 0], x[:, 1])
    assert r[exact > 0].max() == pytest.approx(radius, abs=0.06)
    assert np.abs(ours - exact).max() < 0.01 * exact.max()
    assert ours.max() == pytest.approx(exact.max(), rel=2e-3)
    assert approach == pytest.approx(exact_approach, rel=1e-3)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        (["grid.size=['0.5 mm', '0.5 mm']"], "grid.size"),
        (["grid.middle=['1 mm', '0 mm']"], "grid.size"),
        (["motion.amplitude='1000 km'"], "grid.size"),  # before there are nodes
        (["grid.size=['0.3 mm']"], "grid.size"),
    ],
)
def test_what_a_grid_cannot_lie_on(settings: list[str], key: str) -> None:
    """A grid beyond the surface, of another number of sides, or with what is of meshes alone, is refused by key."""
    with pytest.raises(CaseError, match=key):
        assemble(load_case("ball-on-flat", [*BALL, "grid.nodes=9", *settings]))


def test_pressures_that_no_mesh_feels() -> None:
    """A grid finer than the elements of both condensed bodies is refused where it is; one fine body feels them all."""
    condensed = ["grid.nodes=31", "punch.operator='condensed'", "strip.operator='condensed'"]
    with pytest.raises(
        CaseError, match=r"grid.nodes: finer than the elements of both condensed bodies, as at x = -?\d"
    ):
        assemble(load_case("rounded-punch", condensed))
    system = assemble(load_case("rounded-punch", [*condensed, "strip.operator='fine'"]))
    stiffness = np.linalg.eigvalsh(system.elastic.interface.dense()[:, 0, :, 1])
    assert stiffness.min() > 1e-3 * stiffness.max()


def test_more_nodes_than_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are refused before they are made, with what they take in all positions of the strip."""
    monkeypatch.setattr("fenwear.common.parallel.free_memory", lambda: 1e6)
    monkeypatch.setattr("fenwear.common.parallel.SMALL", 0)
    monkeypatch.setattr("fenwear.bodies.distributed_mesh.check_memory", lambda *_: None)
    settings = [*BALL, "grid.nodes=33", "wear.strip.coefficient='1e-8 1/MPa'", "motion.positions=5"]
    with pytest.raises(CaseError, match=r"grid.nodes: .*33.*33.*5.*2"):
        assemble(load_case("ball-on-flat", settings))


def test_a_contact_that_reaches_edges() -> None:
    """A flat end, whose edges belong to the contact, is refused with the number that says so."""
    case = layer(8, 2, grid={"nodes": 9, "size": [4.0, 4.0]})
    body = build_bodies(case).punch
    x = body.surface.x
    with pytest.raises(CaseError, match=r"punch.operator:"):
        fine(Request(body, identity(len(x)), np.broadcast_to([0, 0, 1.0], x.shape)))


def test_a_mesh_alone_is_no_grid() -> None:
    """Without a grid there are no nodes of its own."""
    with pytest.raises(CaseError, match="grid: missing"):
        assemble(load_case("ball-on-flat", ["punch.operator='fine'", "strip.operator='half-space'"]))


def test_loads_that_vary() -> None:
    """Loads of each phase act in equilibrium, at every place of a strip that passes under the punch."""
    over = "punch.loads=[{on='punch_top', force=['0 N', '0 N', '-20 N'], over_cycle=[[0, 1], [0.5, 2], [1, 1]]}]"
    case = load_case("ball-on-flat", [*BALL, "motion.positions=3", "grid.nodes=17", over])
    block = next(iter(march(assemble(case), 1)))
    assert block.equilibrium_error.max() < 1e-9
    assert 25 < (block.pressure[-1] @ block.system.pair.weights) < 40


def test_factors_wait_for_the_fields_of_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of large bodies are freed beside the contact, and made again: what loads move is the same."""
    case = load_case("ball-on-flat", [*BALL, "grid.nodes=25"])
    kept = assemble(case).bodies.strip
    monkeypatch.setattr(fine_bodies, "LARGE", 0)
    freed = assemble(case).bodies.strip
    assert kept._factors
    assert not freed._factors
    right = np.random.default_rng(0).standard_normal(kept.load.size)
    right[kept.supported] = 0.0
    np.testing.assert_allclose(freed.solve(right), kept.solve(right), rtol=1e-12, atol=0)


APPROACH = "punch.supports=[{on='punch_top', fix=['x', 'y', 'z'], by=['0 mm', '0 mm', '-5 um']}]"


def test_a_prescribed_approach_presses_as_its_force() -> None:
    """Without any load on a contact grid: the pressures are those of the force that supports then carry.

    But for how an even load bends the top of the ball, 0.3 % of the pressures and 0.6 % of the approach.
    """
    coarse = [*BALL, "grid.nodes=33"]
    by = assemble(load_case("ball-on-flat", [*coarse, "punch.loads=[]", APPROACH]))
    (held,) = march(by, 1)
    weights, pressure = by.pair.weights, held.pressure[0]
    force = float(weights @ pressure)
    load = f"punch.loads=[{{on='punch_top', force=['0 N', '0 N', '{-force} N']}}]"
    free = assemble(load_case("ball-on-flat", [*coarse, load]))
    (pressed,) = march(free, 1)
    assert weights @ np.abs(pressed.pressure[0] - pressure) < 5e-3 * force
    assert pressed.rigid[0, 0] == pytest.approx(-5e-3, rel=1e-2)


@pytest.mark.parametrize("held", [[], ["punch.loads=[]", APPROACH]], ids=["load", "approach"])
def test_what_is_not_symmetric_does_not_depend_on_supports(held: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a ball in one mesh, under a load and by an approach: some 5e-4 of the half-space's compliance."""
    case = load_case("ball-on-flat", [*BALL, "grid.nodes=17", *held])
    monkeypatch.setattr(fine_bodies, "UNEVEN", 1e-3)
    assemble(case)
    monkeypatch.setattr(fine_bodies, "UNEVEN", 2e-4)
    with pytest.raises(CaseError, match=r"punch\.operator: .* Betti"):
        assemble(case)
