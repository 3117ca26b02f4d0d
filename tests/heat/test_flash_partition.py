"""How friction heat is shared: what must hold of any two bodies, and their published largest temperature."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.common.arrays import Array
from fenwear.heat.flash_partition import Bulk, HeatedSide, shared
from fenwear.heat.moving_sources import Instants, Periodic, cell_integrals

A, FOREVER = 0.1, np.inf


def _hertz(nodes: int) -> tuple[tuple[float, float], Array]:
    h = 2 * A / nodes
    x = h * (np.arange(nodes) - (nodes - 1) / 2)
    return (h, h), np.sqrt(np.maximum(1 - (x[:, None] ** 2 + x**2) / A**2, 0.0))


def _side(shape: tuple[int, ...], sides: tuple[float, float], k: float, kappa: float, speed: float = 0.0) -> HeatedSide:
    drift = speed / (2 * kappa)
    return HeatedSide(Instants(k, cell_integrals(shape, sides, drift, (drift, 0.0))[None]), k, kappa)


@pytest.mark.parametrize("other", [46.0, 4.6, 0.46])
def test_at_rest_as_conductivities(other: float) -> None:
    """Bodies at rest share as their conductivities everywhere, like ones half and half."""
    sides, heat = _hertz(33)
    first, second = (_side(heat.shape, sides, k, 10.0) for k in (46.0, other))
    own = shared(first, second, heat[None], heat[None] > 0, sides, FOREVER, resistance=np.zeros((1, *heat.shape)))
    assert np.allclose(own, 46.0 / (46.0 + other) * heat, atol=1e-7)


def test_to_and_fro_shares_meet() -> None:
    """Of unlike bodies, one to and fro under the other, with what finite bodies add: temperatures are equal in contact.

    Also where heat passes from one to the other by itself, as they are held at temperatures of their own.
    """
    steps, period, (sides, spot) = 24, 0.02, _hertz(17)
    turns = 2 * np.pi * (np.arange(steps) + 0.5) / steps
    heat = np.abs(np.cos(turns))[:, None, None] * spot
    shifts = np.stack([0.15 * np.sin(turns), 0.05 * np.sin(turns)], axis=1)
    bulks = Bulk(1e-3, 2e-3), Bulk(-2e-3, 1e-4)
    first, second = (
        HeatedSide(Periodic(k, kappa, period, sides, spot.shape, place), k, kappa, bulk)
        for k, kappa, place, bulk in zip((46.0, 20.0), (12.8, 3.0), (0 * shifts, shifts), bulks, strict=True)
    )
    cell, touching = sides[0] * sides[1], np.broadcast_to(spot > 0, heat.shape)
    own = shared(first, second, heat, touching, sides, period, resistance=np.zeros_like(heat))
    one, two = first.rise(own, cell), second.rise(heat - own, cell)
    assert np.abs(one - two)[touching].max() < 1e-7 * one.max()
    assert not own[~touching].any()
    even, as_pressures = np.full(heat.shape, 1.0), np.broadcast_to(1 / (spot + 1e-5), heat.shape)
    for resistance in (2e-4 * even, 2e-4 * as_pressures, 1e3 * even, 1e-9 * as_pressures):
        own = shared(first, second, heat, touching, sides, period, resistance=resistance, given=0.3)
        one, two = first.rise(own, cell), second.rise(heat - own, cell)
        jump = (resistance * (0.3 * heat - own) - (one - two))[touching]
        assert np.abs(jump).max() < 1e-7 * max(one.max(), 0.3 * (resistance * heat).max())


@pytest.mark.parametrize("peclet", [0.01, 1.0, 5.0, 20.0, 100.0])
def test_largest_temperature_of_tian_and_kennedy(peclet: float) -> None:
    """Heat of a Hertzian pressure on what passes: 2.32 q a / (K sqrt(pi (1.234 + Pe))) of the mean q, within 3 %.

    X. Tian, F. E. Kennedy, J. Tribology 116 (1994) 167, fitted between the limits at rest and fast.
    """
    sides, heat = _hertz(65)
    kappa, k = 10.0, 46.0
    side = _side(heat.shape, sides, k, kappa, 2 * kappa * peclet / A)
    found = float(side.rise(heat[None], 1.0).max())
    fitted = 2.32 * (2 / 3) * A / (k * np.sqrt(np.pi * (1.234 + peclet)))
    assert found == pytest.approx(fitted, rel=0.03)
