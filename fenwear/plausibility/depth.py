"""Elements below a contact that are deeper than the contact is wide, whatever their length along it.

The stresses of a contact of half-width a decay over a depth of a, and over a distance of r from it over r. Elements
that reach deeper are too stiff: Hertz's largest pressure comes out 1.04, 1.10, 1.27, 1.77 times too high where elements
at the contact reach 0.9, 1.7, 3.4, 6.8 a into both bodies, of any degree, though they are fine along the contact.
Slivers are of this kind: long triangles on a fine line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx.cpp.mesh import cell_num_vertices
from scipy.spatial import cKDTree

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.bodies.elasticity import ElasticBody
from fenwear.compat import geometry_dofmap
from fenwear.results.zone import ContactNet

DEEPEST = 1.0  # half-widths of a contact that elements at it may reach into the body
ALIKE = 2.0  # elements as deep as that many are long are as coarse one way as the other
FARTHER = 2.0  # the same of elements off it, times the degree, from their distance and the half-width
NEAR = 2.0  # half-widths from the contact within which elements count


@dataclass(frozen=True)
class Deep:
    """The element that is the deepest for its place.

    Attributes:
        excess: Its depth over what is allowed there.
        depth: Below the surface, or off it from its nearest to its farthest point, as seen from the contact, mm.
        allowed: The same of an element that is fine enough, mm.
        distance: From the contact, mm; 0 at the contact.
        body: "punch" or "strip".
    """

    excess: float
    depth: float
    allowed: float
    distance: float
    body: str


def deepest(system: Tribosystem, net: ContactNet, pressure: Array, width: float = 0.0) -> Deep | None:
    """Return the element that is the deepest for its place below a contact; None where nothing touches; collective.

    Args:
        system: The problem.
        net: The nodes of its contact.
        pressure: At them (n,), MPa.
        width: Of the contact at least, mm: deep elements make it narrow.
    """
    zone = net.zone(pressure)
    if zone is None:
        return None
    ends = np.where(zone.free == 1, 1.0, 2.0)  # beyond an end that is not free the contact is as made, or symmetric
    degree = system.bodies.punch.space.ufl_element().degree
    # What is coarse along the contact, too, needs more elements there, which are then less deep: see `few`.
    half = max(float(((zone.nodes - 1) * zone.spacing / ends).min()), width / 2, ALIKE * degree * zone.spacing.min())
    places = net.surface.x[net.piece(pressure)]
    found = [
        deep
        for body in (system.bodies.punch, system.bodies.strip)
        if body.reading is None and (deep := _deepest(body, places, half)) is not None
    ]
    return max(found, key=lambda deep: deep.excess, default=None)


def _deepest(body: ElasticBody, places: Array, half: float) -> Deep | None:
    mesh = body.body.mesh
    corners = cell_num_vertices(mesh.topology.cell_type)  # which stand first
    cells = geometry_dofmap(mesh)[: mesh.topology.index_map(body.dim).size_local, :corners]
    away, below = (cKDTree(near).query(mesh.geometry.x[:, : body.dim])[0] for near in (places, body.meshed.trace))
    least = away[cells].min(axis=1)
    small = 1e-6 * half
    at = (least < half / 2) & ((below[cells] < small).sum(axis=1) >= body.dim)  # with a facet of the contact surface
    depth = np.where(at, below[cells].max(axis=1), away[cells].max(axis=1) - least)
    allowed = np.where(at, DEEPEST * half, FARTHER * body.space.ufl_element().degree * (half + least))
    excess = np.where(least < NEAR * half, depth / allowed, 0.0)
    own = (0.0, 0.0, 1.0, 0.0)
    if len(cells):
        k = int(excess.argmax())
        own = (float(excess[k]), float(depth[k]), float(allowed[k]), float(least[k]) if not at[k] else 0.0)
    worst = max(mesh.comm.allgather(own))
    return Deep(*worst, body.body.name)


def depth_text(system: Tribosystem, net: ContactNet, pressure: Array, when: str, width: float = 0.0) -> str:
    """Say that elements below a contact are deeper than it is wide; "" where they are not; collective."""
    deep = deepest(system, net, pressure, width)
    return "" if deep is None or deep.excess <= 1 else _text(deep, when)


def _text(deep: Deep, when: str) -> str:
    where = "at the contact" if deep.distance == 0 else f"{deep.distance:.2g} mm below the contact"
    return (
        f"geometry: elements of the {deep.body} {where} are {deep.depth:.2g} mm deep, too deep for the contact {when}: "
        "the body is too stiff there, and pressures are too high by tens of per cent. Make elements there at most "
        f"{deep.allowed:.2g} mm deep; more elements along the contact do not help"
    )
