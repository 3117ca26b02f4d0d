"""Elasticity alone: manufactured solutions, and the patch test of two bodies in contact."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy import cos, pi, sin

from fenwear.common.arrays import Array
from fenwear.results.fields import body_fields
from fenwear_verify.bodies import bodies_of_blocks, clamped, two_blocks
from fenwear_verify.manufactured import (
    DEGREES,
    body_force,
    convergence_plot,
    displacement,
    errors,
    stacked,
    unit_square,
)
from fenwear_verify.suite import Plot, Result, Row, order, profile, verification

YOUNG, POISSON = 130.0, 0.23


def waves(x: Array, z: Array) -> Array:
    """Return u = (sin pi X sin 2 pi z, sin 2 pi X sin pi z), X = x + 1/2: zero all round the unit square, mm."""
    x = x + 0.5
    return stacked(sin(pi * x) * sin(2 * pi * z), sin(2 * pi * x) * sin(pi * z))


def force_of_waves(x: Array, z: Array, plane: str) -> Array:
    """Return -div sigma of the waves by hand, N/mm³.

    With div sigma_x = E/(1 - nu²) u_xx + E/(2 (1 + nu)) u_zz + E/(2 (1 - nu)) w_xz, and x <-> z;
    plane strain is plane stress with E/(1 - nu²) and nu/(1 - nu).
    """
    young, nu = (YOUNG, POISSON) if plane == "stress" else (YOUNG / (1 - POISSON**2), POISSON / (1 - POISSON))
    direct, shear, cross = young / (1 - nu**2), young / (2 * (1 + nu)), young / (2 * (1 - nu))
    u, w = waves(x, z)
    x = x + 0.5
    w_xz, u_xz = 2 * pi**2 * cos(2 * pi * x) * cos(pi * z), 2 * pi**2 * cos(pi * x) * cos(2 * pi * z)
    own = pi**2 * (direct + 4 * shear)
    return stacked(own * u - cross * w_xz, own * w - cross * u_xz)


@verification(
    "elasticity",
    "Elasticity: order of convergence of a manufactured solution",
    "force differentiated by hand; orders of Strang and Fix, An Analysis of the Finite Element Method, 1973",
)
def elasticity() -> Result:
    """A clamped square under the body force of known waves: L2 order degree + 1, H1 order degree."""
    material = {"young": YOUNG, "poisson": POISSON}
    rows: list[Row] = []
    plots: list[Plot] = []
    for plane in ("stress", "strain"):
        sizes, found = [], []
        for degree in DEGREES:
            counts = (8, 16, 32) if degree < 3 else (4, 8, 16)
            pairs = []
            for count in counts:
                square = unit_square(count)
                strip = bodies_of_blocks(
                    material, material, square, degree=degree, plane=plane, strip=clamped("strip")
                ).strip
                force = body_force(strip, partial(force_of_waves, plane=plane))
                pairs.append(errors(displacement(strip, force), waves))
            in_l2, in_h1 = np.array(pairs).T
            rows.append(order(f"plane {plane}, degree {degree}: order in L2", degree + 1, in_l2, 0.15))
            rows.append(order(f"plane {plane}, degree {degree}: order in H1", degree, in_h1, 0.15))
            sizes.append(1 / np.array(counts))
            found.append(in_l2 / np.sqrt(0.5))
        if plane == "stress":
            names = [f"degree {k}" for k in DEGREES]
            title = "Elasticity: L2 error of the displacement"
            plots.append(convergence_plot(title, sizes, found, names, [k + 1 for k in DEGREES]))
    return Result(rows, plots)


CONFINED = {"supports": [{"on": "strip_far", "fix": ["z"]}, {"on": "strip_sides", "fix": ["x"]}]}


@verification(
    "patch",
    "Contact patch test: a uniform pressure through two materials",
    "uniaxial strain by hand; Taylor and Papadopoulos, On a patch test for contact problems, 1991",
)
def patch() -> Result:
    """Two confined blocks under 1 MPa: pressure uniform, displacement linear, with facing nodes or without.

    The blocks' nodes face each other, or the strip has 6 or 22 elements opposite the punch's 4.
    """
    upper, lower, heights = {"young": 1e5, "poisson": 0.2}, {"young": 2e5, "poisson": 0.3}, (2.0, 3.0)
    strains = [-(1 + m["poisson"]) * (1 - 2 * m["poisson"]) / ((1 - m["poisson"]) * m["young"]) for m in (upper, lower)]
    rows = []
    for degree in (1, 2, 4):
        for strip_across in (4, 6, 22):
            sizes = {
                "width": 4.0,
                **dict(zip(("punch_height", "strip_height"), heights, strict=True)),
                "across": 4,
                "strip_across": strip_across,
                "strip_layers": 3,
            }
            system = two_blocks(upper, lower, sizes, degree=degree, strip=CONFINED)
            state = system.contact((1,)).solve(system.pair.initial_gap)
            case = f"degree {degree}, 4 elements on {strip_across}"
            pressure = state.pressure[0]
            rows.append(profile(f"{case}: pressure (MPa)", np.ones_like(pressure), pressure, 1e-9))
            fields = body_fields(system, pressure, state.rigid[0], 0, None)
            ours, exact = [], []
            for body, field, strain in zip((system.bodies.punch, system.bodies.strip), fields, strains, strict=True):
                owned = body.space.dofmap.index_map.size_local
                z = body.space.tabulate_dof_coordinates()[:owned, 1]
                ours.append(field["displacement"].x.array[: 2 * owned].reshape(-1, 2))
                exact.append(np.stack([0 * z, strains[1] * heights[1] + strain * z], axis=1))
            expected, found = (
                np.concatenate(system.bodies.comm.allgather(np.concatenate(part))) for part in (exact, ours)
            )
            scale = np.abs(expected).max()
            rows.append(profile(f"{case}: displacement (mm)", expected, found, 1e-9, scale=scale))
    return Result(rows)
