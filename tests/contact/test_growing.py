"""Contact grids that grow with the scar and coarsen: volumes and depths as they were, runs as on grids that stay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from half_space_ball import ball

from fenwear import Case, assemble, evolve, load_case, run_case, steady
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.common.arrays import Array
from fenwear.steps.block import Block
from fenwear.steps.run_state import carried_by, on_other_grid
from fenwear.system import Tribosystem, node_maps, outgrown, regridded


def growing(grid: dict[str, Any], **more: Any) -> Case:
    """Return the ball under a force by which its scar outgrows its first contact, on a grid."""
    tables: dict[str, Any] = {
        "grid": grid,
        "run": {"half_cycles": 60, "integration": "jump", "jump_tolerance": 0.01},
        "output": {"report": False, "uncertainty": False, "fields_at": []},
    }
    return ball(60.0, **{**tables, **more})


def across(system: Tribosystem, touched: Array) -> int:
    """Return the nodes along the longer side of what touches."""
    grid = system.pair.punch.grid
    assert grid is not None
    return int(np.ptp(grid.places[touched], axis=0).max() + 1)


def profile(block: Block, body: str, at: Array) -> Array:
    """Return the worn depths of a body along the line y = 0."""
    return along(block, getattr(block.end.worn, body), at, body)


def along(block: Block, depth: Array, at: Array, body: str = "punch") -> Array:
    """Return depths (n,) along the line y = 0."""
    surface = getattr(block.system.pair, body)
    middle = np.abs(surface.x[:, 1]) < 1e-9
    return np.interp(at, surface.x[middle, 0], depth[middle])


@pytest.fixture(scope="module")
def grown() -> list[Block]:
    """Return the blocks of a run whose contact becomes more than twice as wide."""
    return list(evolve(assemble(growing({"across": 10}))))


def test_grid_begins_around_the_first_contact() -> None:
    """As many nodes across it as asked for, and room beside it."""
    system = assemble(growing({"across": 14}))
    grid = system.pair.punch.grid
    pressure = system.phase_contact((0,)).solve(system.gap(0, system.unworn())).pressure[0]
    assert grid is not None
    assert abs(across(system, pressure > 0) - 14) <= 1
    whole = pressure.reshape(grid.counts)
    assert whole[[0, -1]].max() == whole[:, [0, -1]].max() == 0
    assert max(grid.counts) < 26


def test_volumes_are_kept_and_grids_grow_and_coarsen(grown: list[Block]) -> None:
    """To rounding, whatever happened to the grid; the contact has never too few or many nodes."""
    grids = [block.system.pair.punch.grid for block in grown]
    assert len({grid.spacing for grid in grids if grid}) > 1
    assert len({grid.counts for grid in grids if grid}) > 2
    for block in grown:
        worn, pair, totals = block.end.worn, block.system.pair, block.end.totals
        assert worn.punch @ pair.weights == pytest.approx(totals.of("volume_punch"), rel=1e-12)
        assert worn.strip @ pair.strip.weights == pytest.approx(totals.of("volume_strip"), rel=1e-12)
        assert 9 <= across(block.system, carried_by(block.end)) <= 32


@pytest.mark.slow
def test_depths_are_those_of_a_grid_that_stays(grown: list[Block]) -> None:
    """Along the middle line, and nearer to them with twice the nodes across."""
    fixed = list(evolve(assemble(growing({"nodes": 73}))))[-1]
    finer = list(evolve(assemble(growing({"across": 20}))))[-1]
    at = np.linspace(-0.5, 0.5, 41)
    for body in ("punch", "strip"):
        wanted = profile(fixed, body, at)
        errors = [np.abs(profile(one, body, at) - wanted).max() / wanted.max() for one in (grown[-1], finer)]
        assert errors[1] < 0.6 * errors[0]
        assert errors[1] < 0.02


def test_states_stay_where_they_are(grown: list[Block]) -> None:
    """A node that both grids have keeps its depth, but for what keeps the volume, and its pressure."""
    before = next(block for block in grown if outgrown(block.system, carried_by(block.end)) is not None)
    grid = outgrown(before.system, carried_by(before.end))
    assert grid is not None
    after = regridded(before.system, grid)
    moved, (nodes, _) = on_other_grid(before.end, before.system, after), node_maps(before.system, after)
    known = (nodes >= 0) & (moved.worn.punch > 0)
    ratio = moved.worn.punch[known] / before.end.worn.punch[nodes[known]]
    assert np.ptp(ratio) < 1e-12
    assert ratio[0] == pytest.approx(1.0, abs=1e-2)
    old, new = before.end.contacts[0], moved.contacts[0]
    assert old is not None
    assert new is not None
    assert np.array_equal(new.pressure[0, nodes >= 0], old.pressure[0, nodes[nodes >= 0]])
    assert new.pressure[0, nodes < 0].max(initial=0.0) == 0


@pytest.mark.slow
def test_run_goes_on_from_a_grid_that_has_grown(tmp_path: Path) -> None:
    """It ends as one that was not interrupted; its history stands on the last grid, with the volumes of its sums."""
    output = {"report": False, "uncertainty": False}
    whole = growing({"across": 10}, output={**output, "fields_at": [20]})
    first = growing(
        {"across": 10}, run={"half_cycles": 20, "integration": "jump", "jump_tolerance": 0.01}, output=output
    )
    straight, _ = run_case(whole, output=tmp_path / "whole", log=lambda _: None)
    run_case(first, output=tmp_path / "parts", log=lambda _: None)
    resumed, _ = run_case(whole, output=tmp_path / "parts", log=lambda _: None, resume=True)
    for table in ("sliding", "punch", "strip", "forward"):
        assert resumed[table] == pytest.approx(straight[table], rel=1e-9), table
    with h5py.File(tmp_path / "parts" / "history.nc") as file, h5py.File(tmp_path / "whole" / "history.nc") as other:
        assert len(file["x"]) == file["wear"].shape[1]
        assert file["wear"][:] == pytest.approx(other["wear"][:], rel=1e-9, abs=1e-15)
        volume = (file["wear"][:] * file["weight"][:]).sum(axis=1)
        assert (np.diff(volume) > 0).all()


STEPS = [
    {"cycles": 3, "load_factor": 0.3},
    {"cycles": 4, "load_factor": [1.0, 1.5]},
    {"cycles": 3, "load_factor": 0.5, "amplitude": 0.3},
]


def ends_on_rim(block: Block) -> float:
    """Return the largest pressure on the rim of the grid of a block."""
    grid = block.system.pair.punch.grid
    assert grid is not None
    whole = block.pressure[-1].reshape(grid.counts)
    return float(max(whole[[0, -1]].max(), whole[:, [0, -1]].max()))


@pytest.mark.parametrize("how", ["explicit", "jump"])
def test_programs_go_on_with_the_grid_and_find_room_for_their_loads(how: str) -> None:
    """No step up presses on the rim of the grid; volumes and depths are those of a wide grid that stays."""
    run = {"half_cycles": 20, "integration": how, "jump_tolerance": 0.01}
    more = {"program": {"steps": STEPS}, "run": run}
    blocks = list(evolve(assemble(growing({"across": 12}, **more))))
    wide = list(evolve(assemble(growing({"nodes": 73}, **more))))[-1]
    counts = [block.system.pair.punch.grid.counts for block in blocks if block.system.pair.punch.grid]
    assert len(set(counts)) > 2
    assert {block.load_factor[-1] for block in blocks} >= {0.3, 0.5}
    for block in blocks:
        assert ends_on_rim(block) == 0
        for body in ("punch", "strip"):
            depth, weights = getattr(block.end.worn, body), getattr(block.system.pair, body).weights
            assert depth @ weights == pytest.approx(block.end.totals.of(f"volume_{body}"), rel=1e-12)
    last, at = blocks[-1], np.linspace(-0.6, 0.6, 49)
    for body in ("punch", "strip"):
        one, other = profile(last, body, at), profile(wide, body, at)
        assert one == pytest.approx(other, abs=0.03 * other.max())
        volume = wide.end.totals.of(f"volume_{body}")
        assert last.end.totals.of(f"volume_{body}") == pytest.approx(volume, rel=2e-3)


def test_last_bits_of_what_comes_in_stay_last_bits() -> None:
    """Of rough jumps, too: they are other ones on every number of ranks, each of which adds up its own cells."""
    ends = []
    for force in (60.0, 60.0 * (1 + 1e-14)):
        run = {"half_cycles": 20, "integration": "jump"}
        case = ball(force, grid={"across": 10}, run=run, program={"steps": STEPS})
        ends.append(list(evolve(assemble(case)))[-1])
    for of in (lambda block: block.pressure, lambda block: block.end.worn.punch, lambda block: block.end.worn.strip):
        one, other = (of(end) for end in ends)
        assert one == pytest.approx(other, abs=1e-11 * other.max())


def test_what_a_layer_has_crept_stays_where_it_is() -> None:
    """Node by node as on a grid that was as wide at first; where nothing pressed nothing has crept."""
    layer = {"kind": "linear", "stiffness": "2e5 MPa/mm", "creep": {"terms": [{"compliance": 0.5, "time": "10 s"}]}}
    contact = {"friction": 0.3, "layer": layer}
    wear = {body: {"coefficient": "1e-5 1/MPa"} for body in ("punch", "strip")}
    system = assemble(growing({"across": 10}, contact=contact, wear=wear, run={"half_cycles": 12}))
    grown = list(evolve(system))
    last = grown[-1]
    assert len({block.system.pair.punch.grid for block in grown}) > 1
    wide = list(evolve(regridded(system, last.system.pair.punch.grid)))[-1]
    one, other = last.end.worn.crept, wide.end.worn.crept
    assert other.max() > 0
    assert one == pytest.approx(other, abs=1e-6 * other.max())
    never = last.end.worn.punch == 0
    assert np.abs(one[never]).max() == 0


STILL = {"kind": "reciprocating", "amplitude": 0.02, "period": 1.0, "positions": 1}
STICKS: dict[str, Any] = {
    "contact": {"friction": 0.8, "law": "coulomb"},
    "stick": {"steps": 4, "step_tolerance": 1},
    "motion": STILL,
    "wear": {body: {"coefficient": "1e-4 1/MPa"} for body in ("punch", "strip")},
}


def test_with_stick_a_grid_that_grows_is_as_one_that_was_as_wide_at_first() -> None:
    """Tractions, slips and what sticks go on over the change, node by node, to what solvers leave; volumes stay."""
    system = assemble(growing({"across": 10}, **STICKS, run={"half_cycles": 8}))
    grown = list(evolve(system))
    assert len(grown) > 2
    last = grown[-1]
    for block in grown:
        pair, worn = block.system.pair, block.end.worn
        assert pair.weights @ worn.punch == pytest.approx(block.end.totals.of("volume_punch"), rel=1e-12)
    wide = list(evolve(regridded(system, last.system.pair.punch.grid)))
    assert len(wide) == 1
    for of in (
        lambda block: block.end.worn.punch,
        lambda block: block.pressure[-1],
        lambda block: block.steps[-1].records.traction[-1],
        lambda block: block.steps[-1].records.slip.sum(axis=0),
    ):
        wanted = of(wide[0])
        assert of(last) == pytest.approx(wanted, abs=1e-5 * np.abs(wanted).max())


TEN = {"across": 10}
CREEP = {"terms": [{"compliance": 0.5, "time": "3 s"}, {"compliance": 0.3, "time": "30 s"}]}


FINITE = (
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "punch.operator='fine'", "strip.operator='fine'", "grid.across=10", "motion.positions=2", "run.half_cycles=8",
    "run.integration='explicit'",
)  # fmt: skip


def creeping(grid: dict[str, Any], **more: Any) -> Case:
    """Return the case whose bodies creep."""
    resolved = growing(grid, **more).resolved()
    for body in ("punch", "strip"):
        resolved[body]["creep"] = CREEP
    return Case.model_validate(resolved)


def finite() -> Case:
    """Return a ball on a flat whose bodies creep and are finite, so that their loads dent the contact, too."""
    resolved = load_case("ball-on-flat", FINITE).resolved()
    for body in ("punch", "strip"):
        resolved[body]["creep"] = CREEP
        resolved["wear"][body]["coefficient"] = 4e-7
    return Case.model_validate(resolved)


def crept(block: Block) -> Array:
    """Return how far punch and strip have crept at the end of a block (2, n), mm."""
    return np.array(list(block.system.elastic.creep.depths(block.end.worn.crept).values()))


@pytest.mark.parametrize(
    "case",
    [creeping(TEN, run={"half_cycles": 8}), creeping(TEN, **STICKS, run={"half_cycles": 8}), finite()],
    ids=["passes", "sticks", "finite"],
)
def test_what_bodies_have_crept_goes_on_as_on_a_grid_that_was_as_wide_at_first(case: Case) -> None:
    """Below nodes that were there and those that came, as the forces of the past displace both."""
    system = assemble(case)
    grown = list(evolve(system))
    last = grown[-1]
    grid = last.system.pair.punch.grid
    assert grid is not None
    assert max(grid.counts) > max(system.pair.punch.grid.counts)
    wide = list(evolve(regridded(system, grid)))[-1]
    for of in (crept, lambda block: block.end.worn.punch, lambda block: block.pressure[-1]):
        wanted = of(wide)
        assert of(last) == pytest.approx(wanted, abs=1e-5 * np.abs(wanted).max())


def test_forces_on_a_coarser_grid_keep_sum_and_moment() -> None:
    """Of any forces within its reach."""
    fine = RegularGrid((0.1, -0.3), (0.02, 0.02), (17, 12), 2, 0.0)
    coarse = RegularGrid((0.06, -0.34), (0.04, 0.04), (11, 8), 2, 0.0)
    forces = np.random.default_rng(3).normal(size=(17 * 12, 3))
    shared = coarse.sharing(fine) @ forces
    for of in (np.ones_like, lambda flat: flat):
        assert of(coarse.flat).T @ shared == pytest.approx(of(fine.flat).T @ forces, rel=1e-12)


@pytest.mark.slow
def test_what_has_crept_is_that_of_a_wide_grid_that_stays() -> None:
    """Over a grid that has coarsened, and nearer to it with twice the nodes across."""
    more = {
        "run": {"half_cycles": 16, "integration": "implicit"},
        "wear": {body: {"coefficient": "6e-6 1/MPa"} for body in ("punch", "strip")},
    }
    fixed = list(evolve(assemble(creeping({"nodes": 73}, **more))))[-1]
    at, errors = np.linspace(-0.45, 0.45, 31), []
    for count in (10, 20):
        blocks = list(evolve(assemble(creeping({"across": count}, **more))))
        assert len({block.system.pair.punch.grid.spacing for block in blocks if block.system.pair.punch.grid}) > 1
        errors.append([])
        for body in (0, 1):
            one, wanted = (along(block, crept(block)[body], at) for block in (blocks[-1], fixed))
            errors[-1].append(np.abs(one - wanted).max() / np.abs(wanted).max())
    assert max(errors[1]) < 0.4 * max(errors[0])
    assert max(errors[1]) < 0.004


@pytest.mark.slow
def test_with_stick_jumps_go_with_the_march_and_runs_go_on(tmp_path: Path) -> None:
    """On grids of their own; a run in parts ends as one in one piece, on a grid that had grown between."""
    wear = {"punch": {"coefficient": "2e-6 1/MPa"}, "strip": {"coefficient": "2e-6 1/MPa"}}

    def case(count: int, how: str) -> Case:
        run = {"half_cycles": count, "integration": how, "jump_tolerance": 0.01}
        return growing({"across": 10}, **{**STICKS, "wear": wear}, run=run)

    marched, jumps = (list(evolve(assemble(case(24, how))))[-1] for how in ("explicit", "jump"))
    for body in ("punch", "strip"):
        wanted = marched.end.totals.of(f"volume_{body}")
        assert jumps.end.totals.of(f"volume_{body}") == pytest.approx(wanted, rel=0.01)
    run_case(case(16, "explicit"), output=tmp_path, log=lambda _: None)
    resumed, _ = run_case(case(24, "explicit"), output=tmp_path, log=lambda _: None, resume=True)
    assert resumed["punch"]["worn_volume_mm3"] == pytest.approx(marched.end.totals.of("volume_punch"), rel=1e-9)


@pytest.mark.slow
def test_a_program_goes_on_from_a_grid_that_has_grown(tmp_path: Path) -> None:
    """In parts it ends as in one piece, whether it was cut within a step or where its loads step up."""

    def case(count: int) -> Case:
        program = {"steps": [{**one, "amplitude": 0.02} for one in STEPS]}
        return growing({"across": 10}, program=program, run={"half_cycles": count, "integration": "explicit"})

    straight, _ = run_case(case(20), output=tmp_path / "whole", log=lambda _: None)
    for count in (6, 9, 20):
        resumed, _ = run_case(case(count), output=tmp_path / "parts", log=lambda _: None, resume=count > 6)
    for table in ("punch", "strip"):
        assert resumed[table] == pytest.approx(straight[table], rel=1e-9), table


@pytest.mark.parametrize("sticks", [False, True])
def test_the_end_is_that_of_a_grid_that_stays(sticks: bool) -> None:
    """The steady state, and the end of partial slip, on the grid that they have grown to."""
    wear = {"punch": {"coefficient": "1e-6 1/MPa"}}
    more = (
        {**STICKS, "wear": wear, "motion": {**STILL, "amplitude": 0.002}} if sticks else {"motion": STILL, "wear": wear}
    )
    system = assemble(growing({"across": 16}, **more))
    found = steady(system)
    grid = found.system.pair.punch.grid
    stays = steady(assemble(growing({"nodes": max(grid.counts), "size": list(grid.sides)}, **more)))
    if sticks:
        pressure, wanted = found.pressure, stays.pressure
        assert found.depth == pytest.approx(stays.depth, abs=1e-6 * stays.depth.max())
        assert found.depth.reshape(grid.counts)[[0, -1]].max() == 0
    else:
        assert grid != system.pair.punch.grid
        pressure, wanted = found.phase_pressure, stays.phase_pressure
    assert pressure == pytest.approx(wanted, abs=1e-6 * wanted.max())


@pytest.mark.parametrize(
    "more",
    [
        {"grid": {"across": 64, "nodes": 65}},
        {"strip": {"operator": "condensed"}},
        {"punch": {"topography": {"rms": "0.1 um", "longest": 1}}},
    ],
)
def test_what_does_not_go_with_a_grid_that_grows(more: dict[str, Any]) -> None:
    """Is told by the key."""
    good = growing({"across": 10}).resolved()
    for table, values in more.items():
        good[table] = {**good.get(table, {}), **values}
    with pytest.raises(ValueError, match=r"across"):
        Case.model_validate(good)
