"""What a finite body adds to a half-space against images of its sources."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.special import k0

from fenwear import load_case
from fenwear.case import Heat
from fenwear.heat.flash_partition import Spots, bulk_of, spots_of
from fenwear.system import build_conduction, place_case

CONDUCTIVITY = 46.0
SETTINGS = (
    "grid.nodes=9",
    "geometry.parameters.flat_length=4",
    "geometry.parameters.flat_width=3",
    "geometry.parameters.flat_height=1.6",
    'materials.steel.conductivity="46 W/(m K)"',
    'materials.steel.heat_capacity="460 J/(kg K)"',
    'materials.steel.density="7800 kg/m^3"',
    'strip.temperatures=[{on="strip_bottom",temperature="12 K"}]',
)


def _images(length: float, width: float, height: float) -> float:
    """Return what images add in the middle of the top of a block with insulated sides, held below, for a unit power.

    Those of one line downwards turn their sign, 1 / r to +-2 height k: by Poisson's sum, (2 / height) times Bessel's
    K_0(pi m rho / 2 height) over odd m.
    """
    total = -np.log(2) / height
    for i, j in product(range(-9, 10), repeat=2):
        if (i, j) != (0, 0):
            rho = np.hypot(length * i, width * j)
            total += 2 / height * k0(np.pi * np.arange(1, 12, 2) * rho / (2 * height)).sum()
    return float(total / (2 * np.pi * CONDUCTIVITY))


def test_block_by_images() -> None:
    """A source on a block that is held below and insulated at its sides: its images, and the temperature below."""
    case = load_case("ball-on-flat", SETTINGS)
    placed = place_case(case)
    warm = case.model_copy(update={"heat": Heat(ambient=2.0)})
    bodies = build_conduction(warm, placed.bodies.punch, placed.bodies.strip)
    found = bulk_of(bodies[1], placed.bodies.strip, CONDUCTIVITY, Spots(np.zeros((1, 2)), np.ones(1), 0.05))
    assert found is not None
    assert found.base == pytest.approx(10.0, rel=1e-6)
    assert found.per_power == pytest.approx(_images(4, 3, 1.6), rel=2e-3)
    assert bulk_of(bodies[0], placed.bodies.punch, CONDUCTIVITY, Spots(np.zeros((1, 2)), np.ones(1), 0.05)) is None


def test_all_heat_leaves_by_convection() -> None:
    """Of a ball that hardly convects: everywhere as warm as its heat needs to leave through all of its surface."""
    case = load_case("ball-on-flat", SETTINGS)
    placed = place_case(case)
    warm = case.model_copy(update={"heat": Heat(convection=1e-7)})
    bodies = build_conduction(warm, placed.bodies.punch, placed.bodies.strip)
    found = bulk_of(bodies[0], placed.bodies.punch, CONDUCTIVITY, Spots(np.zeros((1, 2)), np.ones(1), 0.05))
    assert found is not None
    area = 1 / (100 * bodies[0].enough_convection(1.0))
    assert found.per_power == pytest.approx(1 / (1e-7 * area), rel=1e-2)  # what is left nearer than heat is wide


def test_spots_have_the_moments_of_heat() -> None:
    """Up to the third order of what is symmetric, in any direction."""
    x = np.stack(np.meshgrid(np.linspace(-1, 2, 21), np.linspace(0, 1, 11), indexing="ij"), axis=-1).reshape(-1, 2)
    heat = np.maximum(1 - (x[:, 0] - 0.5) ** 2 - 0.7 * (x[:, 0] - 0.5) * (x[:, 1] - 0.5), 0.0)
    spots = spots_of(x, heat)
    assert spots.shares.sum() == pytest.approx(1.0)
    weights = heat / heat.sum()
    middle = weights @ x
    own, other = x - middle, spots.places - middle
    assert np.allclose((weights[:, None] * own).T @ own, (spots.shares[:, None] * other).T @ other)
    assert np.allclose(spots.shares @ spots.places, middle)
