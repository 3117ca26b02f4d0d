"""A shaft in two bushings: what each of them carries, and how it is worn in."""

from __future__ import annotations

import numpy as np

from fenwear import assemble, load_case, vary
from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.system import ContactSetup, Tribosystem, place_case
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

RADIUS, TIGHT, LENGTH, SPAN, LOAD, MU = 10.0, 1e-5, 16.0, 60.0, 2000.0, 0.1  # mm; N
SIDES = {"left": -1, "right": 1}


def shaft(elements: int, *more: str) -> Case:
    """Return the built-in case, whose bushings alone wear.

    Args:
        elements: Within 60 degrees of the top, and all other numbers in proportion.
        more: Further settings.
    """
    counts = {"fine_elements": elements, "beyond_elements": elements, "along": max(elements // 4, 2)}
    coarse = {"between_elements": 2, "overhang_elements": 1, "wall_layers": 1, "shaft_layers": 1}
    settings = [f"geometry.parameters.{name}={count}" for name, count in (counts | coarse).items()]
    settings += ["wear={punch={coefficient=1e-9}}", *more]
    return load_case("two-bushings", settings)


def through(place: float) -> str:
    """Return the setting that has the load act at y = place, mm."""
    return f"strip.loads.0.through=[0, {place!r}, 0]"


def under(system: Tribosystem, place: float) -> tuple[Array, Array, Array]:
    """Return the pressures of the first contact under the load at y = place, forces on the punch and moments there.

    Returns:
        p (n,); what the nodes of each bushing carry (2, 3), N; its moment about the origin (2, 3), N mm.
    """
    loaded = vary(system, through(place))
    pressure = loaded.contact((1,)).solve(loaded.pair.initial_gap).pressure[0]
    return (pressure, *carried(loaded, pressure))


def carried(system: ContactSetup, pressure: Array) -> tuple[Array, Array]:
    """Return what the nodes of each bushing carry (2, 3), N, and its moment about the origin (2, 3), N mm."""
    pair = system.pair
    forces = (pair.weights * pressure)[:, None] * (pair.normal + system.phases.middle_ratio(1))
    turning = np.cross(pair.opposite, forces)
    owns = [pair.punch.nodes_of(side) for side in SIDES]
    return np.array([forces[own].sum(axis=0) for own in owns]), np.array([turning[own].sum(axis=0) for own in owns])


def worn_in(system: ContactSetup, place: float) -> Array:
    """Return the pressures (n,) that wear tight rigid bores by a motion of the shaft, over half of each.

    (c0 + c1 y) cos(psi - psi0), psi0 = -atan mu, whose resultant and its moment about x are those of the load: the
    cosine and its friction give pi / 2 sqrt(1 + mu²) times R a length.
    """
    x, y, z = system.pair.punch.unworn.T
    share = np.maximum(np.cos(np.arctan2(x, z + TIGHT) + np.arctan(MU)), 0)
    second, bore = SPAN**2 / 4 + LENGTH**2 / 12, RADIUS + TIGHT
    return np.asarray(LOAD / (np.pi * LENGTH * bore * np.hypot(1, MU)) * (1 + place * y / second) * share)


@verification(
    "two-bushings",
    "A shaft in two bushings under a load off their middle: shares, symmetry, worn in",
    "statics of a beam on two supports; Archard's law of a rigid motion: p = (c0 + c1 y) cos(psi + atan mu)",
)
def two_bushings() -> Result:
    """Loads in the middle, between it and a bushing, and beyond: the lever rule by where each bushing is pressed."""
    rows: list[Row] = []
    lines: list[Line] = []
    errors = []
    for elements in (4, 8, 16):
        place, what = 10.0, f"worn in, {elements} elements"
        placed = place_case(shaft(elements, f"geometry.parameters.clearance={TIGHT}", through(place)))
        exact, best, x = worn_in(placed, place), placed.optimum(1).pressure, placed.pair.punch.x
        errors.append(float(np.abs(best - exact).max() / exact.max()))
        share = 0.5 + place / SPAN / (1 + LENGTH**2 / (3 * SPAN**2))
        rows += [
            profile(f"{what}: pressure (MPa)", exact, best, 1e-3, scale=exact.max()),
            number(f"{what}: share of the right one", share, carried(placed, best)[0][1, 2] / LOAD, 1e-9),
        ]
    for side in SIDES:
        own = placed.pair.punch.nodes_of(side) & (np.abs(np.abs(x[:, 1]) - SPAN / 2) < 1e-6)
        angle = np.degrees(np.arctan2(x[own, 0], x[own, 2]))
        at = np.argsort(angle)
        lines.append(Line(f"exact, {side}", angle[at], exact[own][at], reference=True))
        lines.append(Line(f"fenwear, {side}", angle[at], best[own][at]))
    system = assemble(shaft(8))
    for place in (0.0, 10.0, 45.0):
        pressure, forces, moments = under(system, place)
        centres = moments[:, 0] / forces[:, 2]
        lever = (place - centres[0]) / (centres[1] - centres[0])
        where = f"load at {place:g} mm"
        rows += [
            number(f"{where}: load (N)", LOAD, forces[:, 2].sum(), 1e-9),
            number(f"{where}: force across it (N)", 0, forces[:, 0].sum(), 1e-9, scale=LOAD),
            number(f"{where}: line of action (mm)", place, moments[:, 0].sum() / LOAD, 1e-9, scale=SPAN),
            number(f"{where}: moment about z (N mm)", 0, moments[:, 2].sum(), 1e-9, scale=LOAD * SPAN),
            number(f"{where}: share of the right one, by the lever rule", lever, forces[1, 2] / LOAD, 1e-9),
        ]
        if place == 0:
            mirror = mirrored(system.pair.punch.x)
            rows.append(
                profile(f"{where}: pressure, mirrored (MPa)", pressure[mirror], pressure, 1e-9, scale=pressure.max())
            )
    rows.append(order("worn in: order of the largest error", 2, errors, 0.7))
    return Result(rows, [Plot("Bushings worn in", "psi (degrees)", "pressure in the middle (MPa)", lines)])


def mirrored(x: Array) -> Array:
    """Return the node that is opposite each of the nodes (n, 3) at -y."""
    apart = np.linalg.norm(x[:, None] - x * [1, -1, 1], axis=2)
    return np.asarray(apart.argmin(axis=1))
