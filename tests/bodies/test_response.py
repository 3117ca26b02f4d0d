"""The answer of a contact surface: the ways to it agree, on as many ranks as there are."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
from petsc4py import PETSc

from fenwear import Tribosystem, assemble, load_case
from fenwear.algebra import factor
from fenwear.algebra.assembled import times
from fenwear.bodies import condensation, response, substructure
from fenwear.bodies.condensation import CondensedBody
from fenwear.common.errors import ConvergenceError

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
    monkeypatch.setattr(condensation, "BOUNDARY_SHARE", boundary)
    monkeypatch.setattr(factor, "SPREAD", spread)
    settings = SMALL if name.startswith("example") else BALL if name.startswith("ball") else ()
    system = assemble(load_case(name, (*settings, *changes)), heat="none")
    return system, [system.elastic.condensed.punch, system.elastic.condensed.strip]


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
        unit = np.abs(other.response).max()  # displacement by a unit force: loads of free bodies leave rounding alone
        for found, expected in (
            (one.response, other.response),
            (one.by_load, other.by_load),
            (one.by_temperature, other.by_temperature),
        ):
            assert (found is None) == (expected is None)
            if found is not None and expected is not None:
                np.testing.assert_allclose(
                    found, expected, rtol=0, atol=1e-10 * max(np.abs(expected).max(initial=0), unit)
                )


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.mpi
def test_each_rank_has_the_same_bits(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what is the same on every rank."""
    system, bodies = condensed("example1", way, monkeypatch)
    for body in bodies:
        for values in (body.response, body.by_load):
            assert len(set(system.bodies.comm.allgather(values.tobytes()))) == 1


@pytest.mark.parametrize("way", ["substructures", "columns"])
def test_one_factor_for_the_loads_of_all_phases(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that differ by their loads share it, whichever is asked first."""
    made: list[object] = []
    for kind, name in ((factor.Factor, "compute"), (substructure.Substructures, "compute")):
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
        assert isinstance(body.factor, substructure.Substructures) == (system.bodies.comm.size > 1)
        first, last = body.stiffness.getOwnershipRange()
        forces = np.sin(np.outer(np.arange(first, last), (1.0, 2.0)))
        forces[body.supported] = 0.0
        both, one = body.solve(forces), body.solve(forces[:, 0])
        rest = np.abs(times(body.stiffness, both) - forces)
        found = [np.abs(both), rest, np.abs(one - both[:, 0]), np.abs(both[body.supported])]
        largest, *errors = np.max(system.bodies.comm.allgather([array.max(initial=0.0) for array in found]), axis=0)
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
        if self.answers:
            raise ConvergenceError("no factor")

    monkeypatch.setattr(factor.Factor, "compute", fails)
    for owner in range(system.bodies.comm.size):
        matrix = system.bodies.punch.stiffness
        one = factor.Factor(matrix, "fenwear_test_", "cholesky", comm=system.bodies.comm, dim=2, owner=owner)
        with pytest.raises(ConvergenceError, match="no factor"):
            factor.make_together([one])
