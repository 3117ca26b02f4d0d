"""Curved contact surfaces that are meshed as polygons, whose corners carry what the curve would share out.

Straight sides of length h that meet at an angle theta have their corners h theta / 8 above the middle of what they
stand for. Waves of that height and length take pi E* h theta / 8 / (2 h) = pi E* theta / 16 to be pressed flat
(H. M. Westergaard, Bearing pressures and cracks, 1939): that much the pressure goes up and down, whatever h.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.elasticity import ElasticBody
from fenwear.interface.frame import facet_normals
from fenwear.interface.overlap import RING
from fenwear.plausibility.ends import contact_modulus

SMALLEST, SHARP = 1e-5, 0.5  # rad: angles that are rounding, and those that are edges as they were drawn
SEEN = 0.05  # of the largest pressure: waves that are told of


def polygon_text(system: Tribosystem, pressure: Array, when: str) -> str:
    """Say that a curved surface is a polygon whose corners show in the pressures (n,), MPa; "" where they do not."""
    for body in (system.bodies.punch, system.bodies.strip):
        if body.meshed.degree == 1 and system.pair.punch.grid is None:
            continue  # nodes at the corners alone, which lie on the curve
        angle = _angle(body)
        waves = np.pi * contact_modulus(system.case) * angle / 16
        if waves > SEEN * pressure.max(initial=0.0):
            return (
                f"the curved contact surface of the {body.body.name} is meshed with straight sides that meet at "
                f"{np.degrees(angle):.2g} degrees: pressures {when} have waves of about {waves:,.3g} MPa for it; set "
                "geometry.order = 2, or give a .msh whose elements are of order 2"
            )
    return ""


def _angle(body: ElasticBody) -> float:
    """Return the angle between neighbouring sides of a curved surface of straight ones, rad; 0.0 of others."""
    if body.body.mesh.geometry.cmap.degree > 1:
        return 0.0
    angles = _angles(body.meshed)
    angles = angles[angles < SHARP]
    angle = float(np.median(angles)) if len(angles) else 0.0
    return angle if angle > SMALLEST else 0.0


def _angles(surface: ContactSurface) -> Array:
    """Return the angles at which neighbouring facets meet (m,), rad."""
    facets = surface.facets[:, RING[surface.cell]]
    count, normals = facets.shape[1], facet_normals(surface)
    sides = facets[:, :, None]
    if surface.dim == 3:
        sides = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2), axis=2)
    _, number = np.unique(sides.reshape(len(facets) * count, -1), axis=0, return_inverse=True)
    order = np.argsort(number.ravel(), kind="stable")
    facet, number = order // count, number.ravel()[order]
    both = np.flatnonzero(number[1:] == number[:-1])
    between = np.einsum("mi,mi->m", normals[facet[both]], normals[facet[both + 1]])
    return np.asarray(np.arccos(np.clip(between, -1.0, 1.0)))
