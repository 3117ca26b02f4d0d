"""The answer of a contact surface: the ways to it agree, on as many ranks as there are."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from fenwear import Tribosystem, assemble, load_case
from fenwear.assembly import place_case
from fenwear.bodies import factor, response, substructure
from fenwear.bodies.assembly import times
from fenwear.bodies.condensation import CondensedBody, condense_together
from fenwear.bodies.response import Request
from fenwear.errors import ConvergenceError

SMALL = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2")
BALL = ("geometry.order=1", "geometry.parameters.across=4", "geometry.parameters.core=0")
WAYS: dict[str, tuple[int, float, int]] = {  # shares of the surface, of boundaries; the largest factor on one rank
    "substructures": (0, np.inf, factor.SPREAD),
    "surface": (0, 0, factor.SPREAD),
    "columns": (10**9, 0, factor.SPREAD),
    "spread": (0, 0, 0),
}


def condensed(
    name: str, way: str, monkeypatch: pytest.MonkeyPatch, *changes: str
) -> tuple[Tribosystem, list[CondensedBody]]:
    share, boundary, spread = WAYS[way]
    monkeypatch.setattr(response, "SURFACE_SHARE", share)
    monkeypatch.setattr(response, "BOUNDARY_SHARE", boundary)
    monkeypatch.setattr(factor, "SPREAD", spread)
    settings = SMALL if name.startswith("example") else BALL if name.startswith("ball") else ()
    system = assemble(load_case(name, (*settings, *changes)), heat="none")
    return system, [system.condensed.punch, system.condensed.strip]


@pytest.fixture(scope="module")
def by_columns() -> Callable[[str], list[CondensedBody]]:
    """Return by_columns(name): the bodies of a case as solved column by column, each case once."""

    @lru_cache
    def by_columns(name: str) -> list[CondensedBody]:
        with pytest.MonkeyPatch.context() as patch:
            return condensed(name, "columns", patch)[1]

    return by_columns


@pytest.mark.parametrize("way", ["substructures", "surface", "spread"])
@pytest.mark.parametrize("name", ["example1", "example1-heat", "ball-on-flat", "ring-on-ring"])
@pytest.mark.mpi(
    "example1-heat-substructures",
    "example1-heat-surface",
    "example1-heat-spread",
    "ball-on-flat-substructures",
    "ball-on-flat-surface",
    "ball-on-flat-spread",
)
def test_all_ways_give_the_same(
    by_columns: Callable[[str], list[CondensedBody]], name: str, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eliminated down to the surface by all ranks or by one, by columns on one rank, or by columns on all of them."""
    for one, other in zip(condensed(name, way, monkeypatch)[1], by_columns(name), strict=True):
        for found, expected in (
            (one.response, other.response),
            (one.by_load, other.by_load),
            (one.by_temperature, other.by_temperature),
        ):
            assert (found is None) == (expected is None)
            if found is not None and expected is not None:
                np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max(initial=1e-300))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.mpi
def test_each_rank_has_the_same_bits(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what is the same on every rank."""
    system, bodies = condensed("example1", way, monkeypatch)
    for body in bodies:
        for values in (body.response, body.by_load):
            assert len(set(system.comm.allgather(values.tobytes()))) == 1


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
@pytest.mark.parametrize("name", ["example1-heat", "ball-on-flat"])
@pytest.mark.mpi
def test_who_solves_for_a_column_does_not_matter(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All ranks hold the factor of one body, or one does: the same to the last bit, in as many solutions."""
    monkeypatch.setattr(response, "BLOCK", 5)
    settings = SMALL if name.startswith("example") else BALL
    solved: list[int] = []
    solve = factor.Factor.solve_sparse
    monkeypatch.setattr(factor.Factor, "solve_sparse", lambda self, rows: (solved.append(1), solve(self, rows))[1])
    found = []
    for holders in (1, MPI.COMM_WORLD.size):
        placed = place_case(load_case(name, (*settings, "setup.way=columns")))
        strip, heat = placed.bodies.strip, placed.bodies.heat
        strip.holders = holders
        coupling = None if heat is None else strip.thermal_coupling(heat[1].space)
        normals = np.broadcast_to(np.eye(strip.dim)[-1], strip.surface.x.shape)
        mine = None if heat else np.arange(placed.comm.rank, len(normals), placed.comm.size)  # ranks share the response
        solved.clear()
        (one,) = condense_together([Request(strip, strip.surface.spread, normals, coupling, mine)])
        shares = placed.comm.allgather(len(solved))
        assert sum(shares) == -(-len(strip.surface.x) // 5)
        assert sum(share > 0 for share in shares) == holders
        assert max(shares) - min(shares) <= 1 or holders == 1
        found.append((one, strip.solve(strip.load)))
    (one, displacement), (other, same) = found
    for name_of, values in one.arrays().items():
        np.testing.assert_array_equal(values, other.arrays()[name_of])
    np.testing.assert_array_equal(displacement, same)


@pytest.mark.parametrize("way", ["substructures", "columns"])
def test_one_factor_for_the_loads_of_all_phases(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that differ by their loads share it, whichever is asked first."""
    made: list[object] = []
    for kind, name in ((factor.Factor, "compute"), (substructure.Substructures, "eliminate")):
        compute = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda self, compute=compute: (made.append(self), compute(self))[1])
    table = "[[0, 0.5], [0.5, 1], [1, 0.5]]"
    condensed("example1", way, monkeypatch, f"punch.loads.0.over_cycle={table}")
    assert len({id(one) for one in made}) == 2


@pytest.mark.parametrize("name", ["example1", "ball-on-flat", "ring-on-ring"])
@pytest.mark.mpi("ball-on-flat")
def test_substructures_solve_for_any_forces(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Inside, on the boundaries between ranks and on supports: K times the solution is the forces again."""
    system, _ = condensed(name, "substructures", monkeypatch)
    for body in (system.bodies.punch, system.bodies.strip):
        assert body.substructures is not None
        first, last = body.stiffness.getOwnershipRange()
        forces = np.sin(np.outer(np.arange(first, last), (1.0, 2.0)))
        forces[body.supported] = 0.0
        both, one = body.solve(forces), body.solve(forces[:, 0])
        rest = np.abs(times(body.stiffness, both) - forces)
        found = [np.abs(both), rest, np.abs(one - both[:, 0]), np.abs(both[body.supported])]
        largest, *errors = np.max(system.comm.allgather([array.max(initial=0.0) for array in found]), axis=0)
        # Elimination by blocks leaves |K| |u| times rounding and the root of K's condition, 1e3 in rings (Higham).
        bounds = (1e-10 * body.stiffness.norm(PETSc.NormType.INFINITY) * largest, 1e-9 * largest, 0.0)
        assert (np.array(errors) <= bounds).all(), (errors, bounds)


@pytest.mark.mpi
def test_a_body_without_a_factor_is_told_on_every_rank(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where another rank has found it out."""
    system = assembled("example1", *SMALL)

    def fails(self: factor.Factor) -> None:
        self.is_made = True
        if self.is_here:
            raise ConvergenceError("no factor")

    monkeypatch.setattr(factor.Factor, "compute", fails)
    for owner in range(system.comm.size):
        matrix = system.bodies.punch.stiffness
        one = factor.Factor(matrix, "fenwear_test_", "cholesky", comm=system.comm, dim=2, holders=(owner,))
        with pytest.raises(ConvergenceError, match="no factor"):
            factor.make_together([one])
