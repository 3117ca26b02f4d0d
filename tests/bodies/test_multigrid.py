"""Ways of condensing a body: each finds the same response, on any number of ranks."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear import CaseError, ConvergenceError, load_case
from fenwear.assembly import place_case
from fenwear.assembly.tribosystem import condense_bodies
from fenwear.bodies import multigrid

SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=4", "geometry.parameters.growth=2")
COARSE = ("geometry.degree=1", "geometry.order=1", "geometry.parameters.across=4", "geometry.parameters.core=0")
CASES = {"example1": SMALL, "ball-on-flat": COARSE}


@pytest.mark.mpi
@pytest.mark.parametrize("name", CASES)
def test_all_ways_agree(name: str) -> None:
    """Response to forces and loads against columns by a factor on the same ranks, which hold the same nodes."""
    expected = condense_bodies(place_case(load_case(name, [*CASES[name], "setup.way=columns"])), fresh=True)
    for way in ("automatic", "substructures", "elimination", "low-rank", "multigrid"):
        found = condense_bodies(place_case(load_case(name, [*CASES[name], f"setup.way={way}"])), fresh=True)
        for one, other in ((found.punch, expected.punch), (found.strip, expected.strip)):
            scale = np.abs(other.response).max()
            np.testing.assert_allclose(one.response, other.response, rtol=0, atol=1e-11 * scale, err_msg=way)
            scale = np.abs(other.by_load).max() + 1e-300
            np.testing.assert_allclose(one.by_load, other.by_load, rtol=0, atol=1e-11 * scale, err_msg=way)


def test_the_response_to_temperature_by_multigrid() -> None:
    """Columns that reach into the body: G^T K^-1 B against a factor."""
    one, other = (
        condense_bodies(place_case(load_case("example1-heat", [*SMALL, f"setup.way={way}"])), fresh=True).punch
        for way in ("multigrid", "columns")
    )
    assert one.by_temperature is not None
    assert other.by_temperature is not None
    scale = np.abs(other.by_temperature).max()
    np.testing.assert_allclose(one.by_temperature, other.by_temperature, rtol=0, atol=1e-11 * scale)


def test_iterations_that_do_not_end_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the key that helps."""
    monkeypatch.setattr(multigrid, "ITERATIONS", 3)
    placed = place_case(load_case("example1", [*SMALL, "setup.way=multigrid"]))
    with pytest.raises(ConvergenceError, match=r"did not converge in 3 iterations.*setup\.way"):
        condense_bodies(placed, fresh=True)


def test_ways_that_do_not_go_with_the_case() -> None:
    """Sums over the ranks, or over both bodies, are not the same to the last bit."""
    for setting in ("contact.solver=full", "setup.way=substructures"):
        with pytest.raises(CaseError, match=r"setup\.reproducible"):
            load_case("example1", ["setup.reproducible=true", setting])
