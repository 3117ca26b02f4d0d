"""Flash temperatures on contact grids: heat on half-spaces, by kernels over the grid's cells."""

from __future__ import annotations

import numpy as np

from fenwear.common.arrays import Array
from fenwear.heat.moving_sources import Instants, Periodic, cell_integrals
from fenwear_verify.moving_source import HALF, RHO_C, K, rise_in_source
from fenwear_verify.suite import Line, Plot, Result, Row, number, profile, verification

NODES = 33
DIFFUSIVITY = K / RHO_C
PECLET = (0.1, 1.0, 10.0, 50.0, 1000.0)


def _places(nodes: int) -> tuple[float, Array]:
    """Return the side of cells over the source, and their middles along an axis (nodes,), mm."""
    side = 2 * HALF / nodes
    return side, side * (np.arange(nodes) - (nodes - 1) / 2)


def _passing(heat: Array, side: float, peclet: float) -> Array:
    """Return k theta (m, n) of heat on material that passes to +x."""
    drift = peclet / HALF
    kernel = cell_integrals(heat.shape, (side, side), drift, (drift, 0.0))
    return K * Instants(K, kernel[None]).apply(heat[None])[0]


@verification(
    "flash",
    "Flash temperatures on a grid: a square source that passes, a Hertzian one, a disc whose heat turns",
    "J. C. Jaeger, Moving sources of heat, 1942; X. Tian, F. E. Kennedy, J. Tribology 116, 1994; "
    "H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids, 1959, 10.4",
)
def flash() -> Result:
    """At all nodes of a square source; the largest of a Hertzian pressure; the middle of a disc, in the complex plane.

    The square's reference is an integral by a rule of some points, the formula of Tian and Kennedy joins its limits at
    rest and fast to some per cent. A disc's heat cos(w t) has (1 - exp(-l a)) / (k l), l = sqrt(i w / kappa), in its
    middle; its rim goes through cells of the grid.
    """
    rows: list[Row] = []
    lines: list[Line] = []
    side, x = _places(NODES)
    at = np.meshgrid(x, x, indexing="ij")
    middle = NODES // 2
    for peclet in PECLET:
        found = _passing(np.ones((NODES, NODES)), side, peclet)
        exact = rise_in_source(at[0].ravel(), at[1].ravel(), 2 * peclet * DIFFUSIVITY / HALF).reshape(found.shape)
        rows.append(profile(f"square, Pe = {peclet:g}: k theta / q (mm)", exact, found, 1e-4, scale=exact.max()))
        lines.append(Line(f"fenwear, Pe = {peclet:g}", x, found[:, middle] / exact.max()))
        lines.append(Line(f"exact, Pe = {peclet:g}", x, exact[:, middle] / exact.max(), reference=True))
    hertz = np.sqrt(np.maximum(HALF**2 - at[0] ** 2 - at[1] ** 2, 0.0))
    hertz *= np.pi * HALF**2 / (hertz.sum() * side**2)  # a mean of 1
    for peclet in PECLET:
        fitted = 2.32 * HALF / np.sqrt(np.pi * (1.234 + peclet))
        largest = float(_passing(hertz, side, peclet).max())
        rows.append(
            number(f"Hertz, Pe = {peclet:g}: largest k theta / q (mm), fitted by others", fitted, largest, 0.03)
        )
    steps, fine = 16, 16
    _, within = _places(NODES * fine)
    disc = (within[:, None] ** 2 + within**2 < HALF**2).reshape(NODES, fine, NODES, fine).mean(axis=(1, 3))
    turns = 2 * np.pi * (np.arange(steps) + 0.5) / steps
    for fourier in (0.1, 10.0):  # kappa over a^2 and the frequency
        period = 2 * np.pi * fourier * HALF**2 / DIFFUSIVITY
        body = Periodic(K, DIFFUSIVITY, period, (side, side), disc.shape, np.zeros((steps, 2)))
        rise = body.apply(np.cos(turns)[:, None, None] * disc)[:, middle, middle]
        wave = 2 * (rise @ np.exp(-1j * turns)) / steps
        decay = np.sqrt(1j / fourier) / HALF
        exact_wave = (1 - np.exp(-decay * HALF)) / (K * decay)
        what = f"disc, kappa / w a^2 = {fourier:g}:"
        rows.append(number(f"{what} amplitude (K)", abs(exact_wave), abs(wave), 1e-3))
        rows.append(number(f"{what} phase (rad)", float(np.angle(exact_wave)), float(np.angle(wave)), 1e-3))
    title = "Square source that passes: rise along its middle over the largest, the material moves to +x"
    return Result(rows, [Plot(title, "x (mm)", "rise over the largest", lines)])
