"""What a set-up takes, told before it is spent."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import Case, CaseError, assemble, load_case
from fenwear.assembly import (
    elastic,
    place_case,
    resources_of,
    resources_text,
    solver_choice,
    tribosystem,
    warmed_system,
)
from fenwear.assembly.resources import BodyResources, Resources, needs
from fenwear.bodies.condensation import condense, deal
from fenwear.heat.field import HeatState
from fenwear.memory import GIB, free_memory
from fenwear.stick.interface import meshed
from fenwear.stick.setup import partial_slip_problem

COARSE = ("geometry.degree=1", "geometry.order=1")


def solid(unknowns: float, nodes: float) -> Resources:
    """Return the needs of two equal solids."""
    body = BodyResources(3, unknowns, 150 * unknowns, nodes, nodes, 0.0, 3 * nodes)
    return Resources(body, body, nodes, 1, 2)


def test_a_large_solid() -> None:
    """155,000 unknowns and 2,401 nodes in each body were measured with 4.9 GiB, 118 s: within a third."""
    found = solid(155_000, 2401)
    assert 4.9 / 1.5 < found.memory / GIB < 1.5 * 4.9
    assert 118 / 1.35 < found.seconds < 118 * 1.35
    assert 4.7 / 1.35 < solid(22_000, 80).seconds < 4.7 * 1.35  # eliminated down to the surface
    assert "155,000 and 155,000 unknowns, 2,401 contact nodes" in found.text()


def test_heat_of_many_nodes() -> None:
    """Fluxes that last are as few on any mesh: 151,000 and 165,000 unknowns, 2,401 nodes, and less, were measured."""
    for sizes, nodes, seconds in (((151_000.0, 165_000.0), 2401, 190), ((20_600.0, 22_900.0), 625, 20)):
        bodies = [BodyResources(3, size, 150 * size, nodes, nodes, size / 3, 3 * nodes) for size in sizes]
        assert seconds / 1.5 < Resources(bodies[0], bodies[1], nodes, 1, 2).heating < 1.5 * seconds


def test_heat_is_in_it() -> None:
    """9,261 and 4,563 unknowns, 169 nodes: 1.3 s, and 5.5 s for heat's steps, were measured on another day."""
    bodies = [BodyResources(3, size, 100 * size, 169, 169, size / 3, 507) for size in (4563.0, 9261.0)]
    found = Resources(bodies[0], bodies[1], 169, 1, 1)
    assert 5.5 / 1.5 < found.heating < 5.5 * 1.5
    assert 6.8 / 1.5 < found.seconds < 6.8 * 1.5
    assert re.search(r"takes about \d s of one core, \d s of it for heat, and \d+ MiB, by an estimate", found.text())


def test_coarser_elements() -> None:
    """Twice as large: an eighth of the unknowns of a solid, a quarter of its nodes; the answer just fits."""
    found = solid(80_000, 400).coarser(2.0)
    assert (found.punch.unknowns, found.punch.columns, found.nodes) == (10_000, 100, 100)
    plane = BodyResources(2, 400.0, 4e3, 20.0, 20.0, 0.0, 40.0).coarser(2.0)
    assert (plane.unknowns, plane.columns) == (100, 10)
    large = solid(1e6, 1e4)
    fits = large.fitting(8 * GIB)
    assert fits is not None
    assert 0.9 * 8 * GIB < fits[1].memory <= 8 * GIB < large.memory
    assert large.fitting(1.0) is None


def test_columns_of_frames() -> None:
    """One direction each where the frame stays; a strip that moves as a whole is asked for all nodes of its trace."""
    ball = place_case(load_case("ball-on-flat", COARSE))
    found = resources_of(ball)
    assert found.punch.columns == len(ball.pair.weights)
    assert found.strip.columns == len(ball.pair.strip.trace)
    assert (found.interfaces, found.phases) == (7, 14)
    curved = needs(ball, (True, False, False))
    assert curved.strip.columns == 3 * found.strip.columns
    assert curved.memory > found.memory
    flat = resources_of(place_case(load_case("example1")))
    assert flat.punch.columns == flat.strip.columns == 65
    assert flat.interfaces == 1


def test_not_enough_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused before anything is factored, with the mesh that would fit."""
    placed = place_case(load_case("ball-on-flat", COARSE))
    monkeypatch.setattr(solver_choice, "SMALL", 0.0)
    monkeypatch.setattr(tribosystem, "operators_for", lambda *_, **__: pytest.fail("condensed all the same"))
    expected = (
        r"geometry: .* unknowns, .* are free, and no setup\.way would fit: .*; elements \d\.\d times as large would"
    )
    with pytest.raises(CaseError, match=expected):
        elastic(placed, free=resources_of(placed, 1e15).memory / 3)


def test_the_way_by_the_memory() -> None:
    """A factor while it fits, one of low rank in the larger body, then in both, then conjugate gradients."""
    small, large = (solid(size, 1000).punch for size in (1.5e6, 2e6))
    whole, found = Resources(small, large, 1000, 1, 2), []
    for memory in np.geomspace(1.1 * whole.memory, 0.3 * whole.memory, 200):
        one = solver_choice.first_fitting(whole, memory)
        found.append((one.punch.solver, one.strip.solver))
        assert one.memory <= memory or not solver_choice.fits(one, memory)
    assert list(dict.fromkeys(found)) == [
        ("factor", "factor"),
        ("factor", "low-rank"),
        ("low-rank", "low-rank"),
        ("low-rank", "multigrid"),
        ("multigrid", "multigrid"),
    ]
    assert solver_choice.first_fitting(whole, 2 * GIB) == whole  # nothing fits
    assert solver_choice.first_fitting(whole, None) == whole


def test_further_ranks_share_columns() -> None:
    """Each goes to the body that takes longer, while it saves a tenth and its factor fits."""
    body = solid(155_000, 2401).punch
    for ranks, holders in ((1, (1, 1)), (2, (1, 1)), (3, (2, 1)), (4, (2, 2)), (6, (3, 3))):
        found = solver_choice.dealt(Resources(body, body, 2401, 1, 2), ranks, None)
        assert (found.punch.holders, found.strip.holders) == holders
    small = replace(body, columns=300.0, patterns=300.0)
    found = solver_choice.dealt(Resources(small, body, 2401, 1, 2), 64, None)
    assert found.punch.holders == 1  # its columns take less than the other's factor
    few = found.strip
    assert few.on_holder <= 0.9 * replace(few, holders=few.holders - 1).on_holder
    assert replace(few, holders=few.holders + 1).on_holder > 0.9 * few.on_holder
    whole = Resources(body, body, 2401, 1, 2)
    most = replace(whole, strip=replace(body, holders=2)).memory
    counts = [solver_choice.dealt(whole, 64, times * most) for times in (0.99, 1.01)]
    assert [one.punch.holders + one.strip.holders for one in counts] == [2, 3]
    for solver in ("spread factor", "low-rank", "multigrid"):
        other = replace(body, solver=solver)
        assert solver_choice.dealt(Resources(other, other, 2401, 1, 2), 4, None).strip.holders == 1


def test_an_owner_for_each_body_and_then_the_rest() -> None:
    """No rank holds two factors while there are ranks without one."""
    assert deal([1, 1], 1) == [[0], [0]]
    assert deal([1, 1], 2) == [[0], [1]]
    assert deal([2, 3], 4) == [[0, 2], [1, 3]]
    assert deal([2, 3], 8) == [[0, 2], [1, 3, 4]]
    assert deal([3], 2) == [[0, 1]]


@pytest.mark.mpi
def test_all_ranks_are_told_of() -> None:
    """Of many columns, on as many ranks as there are."""
    placed = place_case(load_case("example1", [*COARSE, "setup.way=columns"]))
    wanted = resources_of(placed)
    ranks = placed.comm.size
    many = replace(wanted, punch=replace(wanted.punch, columns=1e6), strip=replace(wanted.strip, columns=1e6))
    lines = resources_text(placed, solver_choice.dealt(many, ranks, None))[:2]
    told = [
        int(rank) for line in lines for rank in re.findall(r"\d+", re.split("factor", line.partition("rank")[2])[0])
    ]
    assert sorted(told) == (list(range(ranks)) if ranks > 1 else [0, 0])


def test_another_way_would_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The refusal names it, with its memory; left to itself the set-up takes it, and check tells."""
    wanted = solid(2e6, 1000)
    monkeypatch.setattr(tribosystem, "needs", lambda *_arguments, **_options: wanted)
    punch, strip = (replace(body, solver="multigrid") for body in (wanted.punch, wanted.strip))
    least = replace(wanted, punch=punch, strip=strip)
    free = 1.01 * least.memory
    by_columns, automatic = (
        place_case(load_case("ball-on-flat", [*COARSE, f"setup.way={way}"])) for way in ("columns", "automatic")
    )
    with pytest.raises(CaseError, match=r"are free; setup\.way = 'multigrid' would take .* GiB; elements"):
        solver_choice.check_memory(resources_of(by_columns, free), by_columns.bodies.punch.setup, free)
    found = resources_of(automatic, free)
    assert found == least
    assert all("conjugate gradients on all ranks" in line for line in resources_text(automatic, found)[:2])
    solver_choice.choose_solvers([automatic.bodies], wanted, free)
    assert automatic.bodies.punch.solver == "multigrid"


@pytest.mark.mpi
def test_a_factor_over_the_ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a rank's share of the memory is less than the factor: made over all ranks, with the same answer.

    What all ranks eliminate together needs no such factor, and one rank alone has nobody to share it with.
    """
    monkeypatch.setattr(solver_choice, "SMALL", 0.0)
    monkeypatch.setattr(
        solver_choice, "first_fitting", lambda wanted, _free: wanted
    )  # so small a contact outweighs the factors
    ready = [place_case(load_case("example1", [*COARSE, f"setup.way={way}"])) for way in ("columns", "automatic")]
    placed, together = ready
    ranks = placed.comm.size
    wanted = resources_of(placed)
    share = 0.5 * (wanted.punch.factor + wanted.strip.factor) * 8 * 1.3  # between the two of them
    found = resources_of(placed, ranks * share)
    assert found.strip.factor > found.punch.factor
    assert (found.punch.solver, found.strip.solver) == ("factor", "spread factor" if ranks > 1 else "factor")
    other = resources_of(together, ranks * share).strip
    assert other.solver == "factor" or not other.together
    lines = resources_text(placed, found)
    assert (f"a factor over {ranks} ranks" in lines[1]) == (ranks > 1)
    strip = placed.bodies.strip
    normals = np.broadcast_to([0.0, 1.0], strip.surface.x.shape)
    expected = condense(strip, strip.surface.spread, normals)
    strip.free_factor()
    strip.solver = found.strip.solver
    spread = condense(strip, strip.surface.spread, normals)
    assert strip.factor.is_spread == (ranks > 1)
    for one, other in ((spread.response, expected.response), (spread.by_load, expected.by_load)):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * np.abs(expected.response).max())


def test_bodies_made_anew_and_stick_take_the_same_choice(
    edited: Callable[..., Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With properties of other temperatures, and condensed along all axes: what fits then, or a refusal."""

    def soften(tables: dict[str, Any]) -> None:
        tables["materials"][tables["strip"]["regions"]["strip_body"]]["young"] = {"expression": "1e5 - 10 * T"}

    cold = assemble(edited("example1-heat", soften, *COARSE), heat="none")
    assert cold.bodies.heat is not None
    at = HeatState.nodal(cold.bodies.heat, [np.full(body.owned, 60.0) for body in cold.bodies.heat])
    sticking = load_case("fretting-partial-slip", ["geometry.parameters.elements_along_contact=20"])
    expected = [
        warmed_system(cold, at).condensed.strip.response,
        partial_slip_problem(sticking).interface.strip.response,
    ]

    def low(wanted: Resources, _free: float | None) -> Resources:
        return replace(wanted, strip=replace(wanted.strip, solver="low-rank"))

    with monkeypatch.context() as patch:
        patch.setattr(solver_choice, "first_fitting", low)
        warm, problem = warmed_system(cold, at), partial_slip_problem(sticking)
    assert [warm.bodies.strip.solver, meshed(problem.interface).bodies.strip.solver] == ["low-rank", "low-rank"]
    for found, other in zip((warm.condensed.strip, problem.interface.strip), expected, strict=True):
        np.testing.assert_allclose(found.response, other, rtol=0, atol=1e-10 * np.abs(other).max())
    monkeypatch.setattr(solver_choice, "SMALL", 0.0)
    monkeypatch.setattr(solver_choice, "free_on_ranks", lambda _comm: 1e5)
    with pytest.raises(CaseError, match="are free"):
        warmed_system(cold, at)
    with pytest.raises(CaseError, match="are free"):
        partial_slip_problem(sticking)


def test_free_memory() -> None:
    """The system tells, here."""
    free = free_memory()
    assert free is not None
    assert free > 0


@pytest.mark.process
def test_check_tells(fenwear: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    """The sizes come first, and linear tetrahedra are a last resort."""
    done = fenwear("check", "example1")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("4,810 and 12,506 unknowns, 65 contact nodes: the set-up takes about")


@pytest.mark.parametrize(
    ("way", "told"),
    [
        (
            "substructures",
            r"every rank eliminates its own cells .*\(17 columns\); rank 0: \d+ cells, ",
        ),
        ("elimination", r"rank 0 eliminates all \d+ cells down to the surface, 17 columns: "),
        ("columns", r"rank 0 factors it and solves 17 columns: "),
        ("low-rank", r"a factor with blocks of low rank over all ranks, 17 columns, refined"),
        ("multigrid", r"conjugate gradients on all ranks, 17 columns in blocks; no factor"),
    ],
)
def test_what_each_rank_does(way: str, told: str) -> None:
    """A line for each body, in the way that is chosen."""
    small = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")
    placed = place_case(load_case("example1", [*small, f"setup.way={way}"]), MPI.COMM_SELF)
    lines = resources_text(placed, resources_of(placed))
    assert [line.partition(":")[0] for line in lines] == ["punch", "strip"]
    assert all(re.search(told, line) for line in lines)


def test_a_contact_too_large_is_refused_before_the_bodies_are_meshed() -> None:
    """160,000 contact nodes: hundreds of GiB, told within seconds, where meshing alone takes minutes and gigabytes."""
    case = load_case("ball-on-flat", ["geometry.parameters.across=200", "geometry.parameters.core=0"])
    with pytest.raises(CaseError, match=r"geometry: about 160,000 contact nodes take [56]\d\d\.\d GiB at least, but"):
        assemble(case)


def test_a_line_too_fine_is_refused_before_the_bodies_are_meshed() -> None:
    """The nodes of the strip, too: elements of 0.15 nm under an overlap of 50 µm had used up the memory."""
    case = load_case(
        "fretting", ["geometry.parameters.contact_width='0.6 nm'", "geometry.parameters.elements_along_contact=4"]
    )
    with pytest.raises(CaseError, match=r"geometry: about [\d,]{7,} contact nodes take .* GiB at least, but"):
        assemble(case)
