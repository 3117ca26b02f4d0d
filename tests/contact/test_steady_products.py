"""The cyclic steady state on a grid by products: as matrices have it, node by node."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear import assemble, load_case
from fenwear.contact.steady_products import GridShape
from fenwear.steps import steady, steady_inequality
from fenwear.steps.steady_inequality import SteadyInequality
from fenwear.system import Tribosystem

BALL = (
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "punch.operator='fine'", "strip.operator='fine'", "grid.size=['0.3 mm', '0.2 mm']",
)  # fmt: skip


def ball(nodes: int, positions: int, *settings: str) -> Tribosystem:
    """Return a ball that wears on a flat that does not."""
    case = load_case("ball-on-flat", [*BALL, f"grid.nodes={nodes}", *settings])
    wear = case.wear.model_copy(update={"strip": None})
    motion = case.motion.model_copy(update={"positions": positions})
    return assemble(case.model_copy(update={"wear": wear, "motion": motion}))


@pytest.mark.parametrize(
    ("positions", "settings"),
    [
        (3, ()),
        (2, ("wear.punch={coefficient='1e-9 MPa^-1.7', pressure_exponent=1.7}",)),
        (1, ("contact.friction=3",)),  # by which nodes open in one direction
    ],
)
def test_as_by_matrices(positions: int, settings: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Several positions of the strip, wear by a power of the pressure, nodes that touch in some phases only."""
    system = ball(25, positions, *settings)
    found = []
    for least, kind in ((0, GridShape), (10**6, object)):
        monkeypatch.setattr(steady_inequality, "GRIDDED", least)
        assert isinstance(SteadyInequality(system).equations, kind)
        found.append(steady(system))
    ours, other = found
    assert (other.phase_pressure == 0).any() == (positions == 1)
    top = other.phase_pressure.max()
    np.testing.assert_allclose(ours.phase_pressure, other.phase_pressure, rtol=0, atol=1e-9 * top)
    np.testing.assert_allclose(ours.shape, other.shape, rtol=0, atol=1e-9 * np.nanmax(np.abs(other.shape)))
    assert ours.velocity["lambda_F"] == pytest.approx(other.velocity["lambda_F"], rel=1e-12)
