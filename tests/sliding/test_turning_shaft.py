"""Wear on a shaft that turns in its bore: it belongs to the shaft's material, through any turn."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear import assemble, load_case, march

FEW = ("geometry.parameters.elements_along_contact=80", "wear.punch.coefficient=1e-7", "wear.strip.coefficient=2e-7")


def test_a_shaft_that_turns_round_wears_evenly() -> None:
    """All the way round, by what is metered."""
    system = assemble(load_case("bushing", FEW))
    (block,) = march(system, 3)
    depth, volume = block.wear_strip[-1], float(block.totals.of("volume_strip")[-1])
    np.testing.assert_allclose(depth, volume / 20 / (2 * np.pi * 10), rtol=1e-5)
    np.testing.assert_allclose(volume, 2 * block.totals.of("volume_punch")[-1], rtol=1e-12)


@pytest.mark.parametrize(("amplitude", "positions", "arc"), [(0.5, 12, 90.0), (2 * np.pi, 36, 360.0)])
def test_a_shaft_that_goes_to_and_fro(amplitude: float, positions: int, arc: float) -> None:
    """What passes under the load wears, there and back, also more than once round; volumes are those metered."""
    motion = f"motion={{kind='oscillation', axis=[0, 1, 0], amplitude={amplitude}, period=1, positions={positions}}}"
    system = assemble(load_case("bushing", (*FEW, motion)))
    *_, block = march(system, 4)
    for pair, depth, body in (
        (system.pair.weights, block.wear[-1], "punch"),
        (system.pair.strip.weights, block.wear_strip[-1], "strip"),
    ):
        assert depth.min() >= 0
        np.testing.assert_allclose(20 * pair @ depth, block.totals.of(f"volume_{body}")[-1], rtol=1e-9)
    x, worn = system.pair.strip.x, block.wear_strip[-1] > 1e-3 * block.wear_strip[-1].max()
    around = np.degrees(np.arctan2(x[:, 0], x[:, 1]))
    assert np.ptp(around[worn]) == pytest.approx(arc, abs=8)
