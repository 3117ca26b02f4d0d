"""Displacement out of the plane."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fenwear.common.arrays import Array
from fenwear.results.fields import Fields, body_fields
from fenwear_verify.bodies import two_blocks

MATERIAL = {"young": 2e5, "poisson": 0.25}  # shear modulus 8e4 MPa
SIZES = {"width": 2.0, "strip_height": 3.0, "across": 4, "strip_across": 6, "strip_layers": 2}


def strip_fields(friction: float, transverse: float, axis: str, degree: int) -> tuple[Fields, Array]:
    """Return the strip's fields under a uniform pressure of 2 MPa, and heights above its far side."""
    system = two_blocks(
        MATERIAL,
        MATERIAL,
        SIZES,
        degree=degree,
        strip={"supports": [{"on": "strip_far", "fix": ["x", "z"]}]},
        contact={"friction": friction, "transverse_friction": transverse},
        motion={"kind": "reciprocating", "amplitude": 0.01, "period": 1.0, "axis": axis},
    )
    uniform = np.full(len(system.pair.x), 2.0)
    _, strip = body_fields(system, uniform, np.zeros(len(system.rigid.resultant)), 0, None)
    return strip, strip["displacement_out_of_plane"].function_space.tabulate_dof_coordinates()[:, 1]


@pytest.mark.mpi("x-0.6-2")
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(("axis", "traction"), [("x", 0.3 * 2), ("y", -0.2 * 2)])
def test_uniform_shear(axis: str, traction: float, degree: int) -> None:
    """A strip under a uniform traction along y shears by t / G, exactly; the reaction of (5) is on the strip."""
    strip, z = strip_fields(0.2, 0.3, axis, degree)
    values = strip["displacement_out_of_plane"].x.array
    bottom = MPI.COMM_WORLD.allreduce(float(z.min(initial=np.inf)), MPI.MIN)
    np.testing.assert_allclose(values, traction / 8e4 * (z - bottom), rtol=0, atol=1e-9 * 3 * abs(traction) / 8e4)


def test_shear_adds_to_the_stress() -> None:
    """Von Mises: 3 t^2 more under its square than without the traction along y, at every node."""
    with_shear, _ = strip_fields(0.2, 0.3, "x", 2)
    less, _ = strip_fields(0.2, 1e-9, "x", 2)
    squares = with_shear["von_mises"].x.array ** 2 - less["von_mises"].x.array ** 2
    np.testing.assert_allclose(squares, 3 * 0.6**2, rtol=0.02)  # roots of averages are not averages of roots
