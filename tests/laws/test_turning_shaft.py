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


def test_every_place_of_the_shaft_has_what_met_it() -> None:
    """A shaft that turns by whole elements: each of its nodes has lost what the bore's nodes opposite tell, exactly."""
    places, friction = [-9, 9, 27, 45, 27, 9, -9], "contact.friction=0.2"  # degrees; in the middles of steps:
    middles = np.radians([0, 18, 36, 36, 18, 0])  # four, and eight elements on
    rows = ", ".join(f"[{k}, {place}, {-500 - 100 * k}]" for k, place in enumerate(places[:-1]))
    columns = ["time (s)", "angle_y (deg)", "force_z (N)"]
    motion = (
        f"motion={{kind='cycle', columns={columns}, rows=[{rows}, [6, -9, -500]], load={{on='punch_top'}}, "
        "positions='steps'}"
    )
    system = assemble(
        load_case("bushing", (*FEW, "geometry.parameters.clearance=0", "punch.loads=[]", friction, motion))
    )
    pair, wanted = system.pair, np.zeros(len(system.pair.strip.weights))
    bore, shaft = (np.arctan2(x[:, 0], x[:, 1]) for x in (pair.opposite, pair.strip.x))
    end = None
    for cycle in range(2):
        *_, last = march(system, cycle + 1, start=end)
        end = last.end
        for contact, middle in zip(end.contacts, middles, strict=True):
            assert contact is not None
            apart = np.angle(np.exp(1j * (bore[:, None] - middle - shaft)))  # place on the shaft, turned back
            met = np.abs(apart).argmin(axis=1)
            assert np.abs(apart[np.arange(len(met)), met]).max() < 1e-3
            dose = 2e-7 * contact.pressure[0] * 10 * np.radians(18) * pair.weights / pair.strip.weights[met]
            np.add.at(wanted, met, dose)
    np.testing.assert_allclose(end.worn.strip, wanted, rtol=0, atol=1e-6 * wanted.max())
    assert (end.worn.strip > 0.01 * wanted.max()).sum() > 20
