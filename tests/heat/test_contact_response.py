"""What steps do at the contact, by ways that save work, against the plain ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fenwear import Tribosystem, assemble, load_case
from fenwear.bodies import condensation
from fenwear.common.parallel import total
from fenwear.heat.fitted import _by_columns, contact_responses
from fenwear.heat.prepare import contact_rows, inflows

COARSE = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2", "heat.convecting_faces=true")


@pytest.mark.mpi
def test_the_surface_alone_answers_as_the_whole_field(assembled: Callable[..., Tribosystem]) -> None:
    """By a Schur complement, and by a solution for each flux: at rest, moving either way, and in the long run."""
    system = assembled("example1-heat", *COARSE)
    for body, inflow in zip(system.bodies.heat, inflows(system.bodies.heat, system.pair), strict=True):
        rows = contact_rows(body, system.pair)
        steps = [body.step(*one) for one in ((0.0, 0.05), (9.0, 0.05), (-9.0, 0.05), (0.0, np.inf))]
        found = contact_responses(steps, inflow, rows)
        for step, one in zip(steps, found, strict=True):
            expected = _by_columns(step, inflow, rows)
            np.testing.assert_allclose(one, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.mpi
def test_a_step_at_rest_is_one_of_hardly_moving_material(assembled: Callable[..., Tribosystem]) -> None:
    """Matrices that are added up, and those that are assembled: the same step, at one time scale and at another."""
    system = assembled("example1-heat", *COARSE)
    body = system.bodies.heat[1]
    comm, load = body.body.mesh.comm, body.load(np.ones(len(body.surface.weights)))[:, None]
    theta = body.initial() + np.sin(np.arange(body.owned))
    for duration in (0.05, 20.0, np.inf):
        resting, moving = (body.step(speed, duration) for speed in (0.0, 1e-200))
        for one, other in (
            (resting.respond(load)[:, 0], moving.respond(load)[:, 0]),
            (resting.advance(theta), moving.advance(theta)),
        ):
            size = total(comm, np.array([np.abs(other).sum()]))[0]
            assert total(comm, np.array([np.abs(one - other).sum()]))[0] <= 1e-11 * size


def test_large_factors_are_freed_beside_heat(monkeypatch: pytest.MonkeyPatch) -> None:
    """And made again where they are asked for: the loads' displacement is the same."""
    monkeypatch.setenv("FENWEAR_KEPT_GIB", "0")
    case = load_case("example1-heat", COARSE)
    before = assemble(case)
    monkeypatch.setattr(condensation, "LARGE", 0)
    after = assemble(case)
    for one, other in ((before.bodies.punch, after.bodies.punch), (before.bodies.strip, after.bodies.strip)):
        assert one._factors
        assert not other._factors
        np.testing.assert_allclose(other.solve(other.load), one.solve(one.load), rtol=0, atol=1e-15)
        assert other._factors
