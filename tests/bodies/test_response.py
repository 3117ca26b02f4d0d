"""The answer of a contact surface: the ways to it agree, on as many ranks as there are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem, assemble, load_case
from fenwear.bodies import factor, response
from fenwear.bodies.condensation import CondensedBody
from fenwear.errors import ConvergenceError

SMALL = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2")
WAYS: dict[str, tuple[int, int]] = {  # of the Schur complement's share and of the largest factor on one rank
    "surface": (0, factor.SPREAD),
    "columns": (10**9, factor.SPREAD),
    "spread": (0, 0),
}


def condensed(name: str, way: str, monkeypatch: pytest.MonkeyPatch) -> tuple[Tribosystem, list[CondensedBody]]:
    share, spread = WAYS[way]
    monkeypatch.setattr(response, "SURFACE_SHARE", share)
    monkeypatch.setattr(factor, "SPREAD", spread)
    settings = SMALL if name.startswith("example") else ()
    system = assemble(load_case(name, settings), heat="none")
    return system, [system.condensed.punch, system.condensed.strip]


@pytest.mark.parametrize("way", ["surface", "spread"])
@pytest.mark.parametrize("name", ["example1", "example1-heat", "ball-on-flat", "ring-on-ring"])
@pytest.mark.mpi
def test_all_ways_give_the_same(name: str, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eliminated down to the surface, by columns on one rank, or by columns on all of them."""
    for one, other in zip(
        condensed(name, way, monkeypatch)[1], condensed(name, "columns", monkeypatch)[1], strict=True
    ):
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


def test_one_factor_for_the_loads_of_all_phases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies that differ by their loads share it, whichever is asked first."""
    made: list[object] = []
    compute = factor.Factor.compute
    monkeypatch.setattr(factor.Factor, "compute", lambda self: (made.append(self), compute(self))[1])
    table = "[[0, 0.5], [0.5, 1], [1, 0.5]]"
    system = assemble(load_case("example1", [*SMALL, f"punch.loads.0.over_cycle={table}"]))
    assert len({id(body.punch.factor) for body in system.loaded}) == 1
    assert len({id(one) for one in made}) == 2


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
        one = factor.Factor(matrix, "fenwear_test_", "cholesky", comm=system.comm, dim=2, owner=owner)
        with pytest.raises(ConvergenceError, match="no factor"):
            factor.make_together([one])
