"""What lies between the surfaces: a Winkler layer under a wearing punch, rough surfaces, debris."""

from __future__ import annotations

import numpy as np
from scipy.integrate import quad

from fenwear.laws import LayerStep
from fenwear.steps import growth_rate
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.system import Tribosystem
from fenwear_verify.bodies import rigid_punch, two_blocks
from fenwear_verify.suite import Result, Row, number, verification
from fenwear_verify.wear import HALF_WIDTH, MEAN, STROKE, half_plane_rates, stiffness_rates

MODES = (0.90973, 0.47394)  # mu_n of the symmetric modes of the half-plane alone: rate (pi/2) / mu_n


@verification(
    "galin-layer",
    "A flat punch with a Winkler layer on a half-plane that wears at constant load: decay of the pressure",
    "rates (pi/2) / (mu_n + B), B = pi E* / (2 a kap), for B = 1: 0.82252 and 1.06571 (symmetric)",
)
def galin_layer() -> Result:
    """Each mode of the half-plane with the layer's own compliance beside it; eigenvalues, growth rate and a march."""
    rows: list[Row] = []
    fine = ("geometry.parameters.elements_along_contact=32", "geometry.degree=2", "geometry.parameters.edge_grading=8")
    step, effective, alone = 0.02, 2e5, half_plane_rates()
    for ratio in (0.2, 1.0, 5.0):
        stiffness = np.pi * effective / (2 * HALF_WIDTH * ratio)
        layer = f"contact.layer={{kind='linear', stiffness={stiffness!r}}}"
        wear = f"wear.punch.coefficient={step * HALF_WIDTH / effective / STROKE!r}"
        system = rigid_punch(1e4, *fine, layer, wear)
        exact = 1 / (1 / alone + 2 * ratio / np.pi)
        rates = stiffness_rates(system, effective)
        if ratio == 1:
            rows += [
                number(
                    f"B = 1: even mode {k}, the row's number (E* k V/a)", np.pi / 2 / (mu + 1), exact[2 * k - 1], 1e-4
                )
                for k, mu in enumerate(MODES, 1)
            ]
        rows += [
            number(f"B = {ratio:g}, eigenvalue, mode {k + 1} (E* k V/a)", exact[k], rates[k], 2e-3) for k in range(4)
        ]
        growth = growth_rate(system, np.full((2, len(system.pair.x)), MEAN))
        slowest = np.expm1(-growth * system.motion.period / 2) / step
        rows.append(number(f"B = {ratio:g}, growth rate of the slowest mode (E* k V/a)", exact[0], slowest, 2e-3))
        if ratio == 1:
            block = next(march_within(system, RunLimits(100, block=100), implicit=True))
            late = (block.pressure - MEAN)[[50, 60, 70, 80]] * np.sqrt(system.pair.weights)
            recurrence, *_ = np.linalg.lstsq(late[2::-1].T, late[3], rcond=None)
            factors = np.sort(np.roots([1, *-recurrence]).real)[::-1] ** (1 / 10)
            found = (1 / factors[0] - 1) / step
            rows.append(number("B = 1, march, even mode 1 (E* k V/a)", exact[1], found, 5e-3))
    return Result(rows)


@verification(
    "greenwood-williamson",
    "Rough surfaces pressed on each other",
    "Greenwood and Williamson's integrals over the heights of the asperities, by quadrature",
)
def rough() -> Result:
    """Two flat blocks under 1 MPa: how far their mean planes come together beside the elasticity of the blocks."""
    rows: list[Row] = []
    stiff, sizes = {"young": 2e5, "poisson": 0.0}, {"width": 10.0}
    smooth = _approach(two_blocks(stiff, stiff, sizes))
    for roughness, radius, density in ((1e-3, 0.02, 300.0), (3e-4, 0.1, 1000.0)):
        table = {"kind": "rough", "roughness": roughness, "asperity_radius": radius, "asperity_density": density}
        came = _approach(two_blocks(stiff, stiff, sizes, contact={"layer": table})) - smooth
        height = np.sqrt(np.pi / 2) * roughness
        distance = 6.0 - came / height

        def of_height(z: float, d: float = distance) -> float:
            return float((z - d) ** 1.5 * np.exp(-z * z / 2) / np.sqrt(2 * np.pi))

        modulus = 2e5 / 2
        carried, _ = quad(of_height, distance, max(distance, 0) + 9, epsabs=0, epsrel=1e-12, limit=200)
        pressure = 4 / 3 * modulus * density * np.sqrt(radius) * height**1.5 * carried
        rows.append(
            number(f"Sa = {1e3 * roughness:g} um: mean planes at {distance:.3f} sigma: p (MPa)", 1.0, pressure, 1e-6)
        )
    return Result(rows)


def _approach(system: Tribosystem) -> float:
    """Return how far the punch comes down, mm."""
    found = system.phase_contact((0,)).solve(system.gap(0, system.unworn()), None, _giving(system))
    return -float((system.rigid.rigid_normal @ found.rigid[0]).mean())


def _giving(system: Tribosystem) -> LayerStep | None:
    return system.phases.passing(system.phases.mean_wear).step(system.unworn(), implicit=False)
