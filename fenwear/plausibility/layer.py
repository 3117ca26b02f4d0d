"""Elements of a strip that are thicker than the layer which heats up while its material passes under the contact.

Under a contact that material passes in the time t, a layer sqrt(a t) heats up, a being the diffusivity (J. C. Jaeger,
Moving sources of heat and the temperature at sliding contacts, 1942). Nodes further apart than that spread the heat
over too much material: the contact stays too cold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from basix import CellType

from fenwear.arrays import Array
from fenwear.assembly import ContactSetup
from fenwear.case.program import speeds_of
from fenwear.sliding.chart import sliding_chart


@dataclass(frozen=True)
class HeatedLayer:
    """Where elements below the contact are the coarsest for the layer that heats up.

    Attributes:
        thickness: Of the layer, mm.
        height: Of the element there, mm.
        needed: Height of one whose nodes are as far apart as the layer is thick, mm.
    """

    thickness: float
    height: float
    needed: float


def heated_layer(system: ContactSetup) -> HeatedLayer | None:
    """Return where the strip's elements are the coarsest for the layer that heats up at the fastest; collective.

    None without heat, to and fro, and where nothing passes.
    """
    case, motion, pair = system.case, system.motion, system.pair
    speed = max([phase.speed for phase in motion.phases] + [abs(v) for v in speeds_of(case)])
    if case.heat is None or not case.passes or len(set(motion.directions)) > 1 or speed == 0:
        return None
    surface = pair.strip
    below = surface.spread.T @ (pair.transfer.T @ pair.weights) > 0
    mesh = system.bodies.strip.body.mesh
    simplex = mesh.basix_cell() in (CellType.triangle, CellType.tetrahedron)
    # Of a simplex the height is what volume over area is times its dimension.
    heights = system.element_heights.strip[below] * (mesh.topology.dim if simplex else 1)
    layers = np.sqrt(_diffusivities(system)[below] * _passing(system, speed))
    worst = int(np.argmax(heights / layers))
    layer = float(layers[worst])
    return HeatedLayer(layer, float(heights[worst]), surface.degree * layer)


def _passing(system: ContactSetup, speed: float) -> float:
    """Return how long material is under the contact at a speed, mm/s or rad/s, in s."""
    field = system.sliding.field
    chart = sliding_chart(field, system.pair)
    if any(field.turn) and chart.axis is None:  # the axis goes through the contact
        return math.pi / speed
    length = float(np.ptp(chart.coordinates(system.pair.punch.x)[:, 0]))
    return length / (chart.radius or 1.0) / speed


def _diffusivities(system: ContactSetup) -> Array:
    """Return k / (rho c) at the strip's pressure nodes (n,), mm²/s: the smallest where regions meet."""
    regions, materials = system.case.strip.regions, system.case.initial_materials
    found: Array = np.full(len(system.pair.strip.weights), np.inf)
    for name, share in system.bodies.regions[1].items():
        m = materials[regions[name]]
        capacity = (m.density or 0.0) * (m.heat_capacity or 0.0)
        found = np.where(share > 0, np.minimum(found, (m.conductivity or 0.0) / capacity), found)
    return found


def layer_warnings(system: ContactSetup) -> list[str]:
    """Say where the strip's nodes are further apart than the layer that heats up is thick; collective."""
    layer = heated_layer(system)
    if layer is None or layer.height <= layer.needed:
        return []
    return [
        f"geometry: the strip's elements below the contact are up to {layer.height:.3g} mm high, and the layer that "
        f"heats up while its material passes is {layer.thickness:.3g} mm thick: the contact stays too cold; expected "
        f"at most {layer.needed:.3g} mm there"
    ]
