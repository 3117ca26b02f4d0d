"""Meshes that are too coarse for a contact, or in another unit, as small functions of a state.

The largest pressure of a Hertzian contact is 1.03, 1.05, 1.26 and 1.46 times Hertz's with 45, 21, 9 and 5 nodes of a
solid in contact, which are 7.6, 5.2, 3.4 and 2.5 across it. Only ends of the contact within the surface count: what
ends with the surface, as a flat punch, or at a plane of symmetry, is as wide there as it was made.

The stresses of a contact of half-width a decay over a depth of a, and over a distance of r from it over r. Elements
that reach deeper are too stiff: Hertz's largest pressure comes out 1.04, 1.10, 1.27, 1.77 times too high where elements
at the contact reach 0.9, 1.7, 3.4, 6.8 a into both bodies, of any degree. Slivers are of this kind.

Straight sides of length h that meet at an angle theta have their corners h theta / 8 above the middle of what they
stand for. Waves of that height and length take pi E* h theta / 8 / (2 h) = pi E* theta / 16 to be pressed flat
(H. M. Westergaard, Bearing pressures and cracks, 1939): that much the pressure goes up and down, whatever h.

Under a contact that material passes in the time t, a layer sqrt(a t) heats up, a being the diffusivity (J. C. Jaeger,
Moving sources of heat and the temperature at sliding contacts, 1942). Nodes further apart than that spread the heat
over too much material: the contact stays too cold.

Pressures and depths are counted along the common normals of the surfaces as they were made. A shaft that has moved by
delta into its bore touches it along other normals, turned by delta sin psi / R.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TypeAlias

import numpy as np
from basix import CellType
from dolfinx.cpp.mesh import cell_num_vertices
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.distributed_mesh import find_geometry
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.ready_geometries import constants
from fenwear.case import Case, Reciprocating, Tabulated
from fenwear.case.program import cycle_of, speeds_of
from fenwear.checks.surface_ends import contact_modulus
from fenwear.common.arrays import Array
from fenwear.common.compat import geometry_dofmap
from fenwear.common.errors import CaseError, readable
from fenwear.results.history_surfaces import ContactNet, Zone
from fenwear.surfaces import ContactPair, RigidEquilibrium
from fenwear.surfaces.common_normal import facet_normals
from fenwear.surfaces.overlap import RING
from fenwear.surfaces.sliding_chart import sliding_chart
from fenwear.system import Bodies, ContactSetup, Tribosystem

ENOUGH = 4  # nodes from the middle of a contact to each of its ends: eight across it
# Of the ready geometries, and of others that name them so: numbers of elements along the contact.
COUNTS = ("elements_along_contact", "elements_along_flat", "across", "core_elements", "along", "around",
          "across_x", "across_y")  # fmt: skip
LAYERS = ("drum_layers",)  # numbers of even elements over the strip's wall
DEEPEST = 1.0  # half-widths of a contact that elements at it may reach into the body
ALIKE = 2.0  # elements as deep as that many are long are as coarse one way as the other
FARTHER = 2.0  # the same of elements off it, times the degree, from their distance and the half-width
NEAR = 2.0  # half-widths from the contact within which elements count
SMALLEST, SHARP = 1e-5, 0.5  # rad: angles that are rounding, and those that are edges as they were drawn
SEEN = 0.05  # of the largest pressure: waves that are told of
WORN = 0.01  # of the largest depth: nodes that count
UNITS = {"m": 1e3, "µm": 1e-3}
CLEARLY = 1.0  # decades outside what is usual, and by which another unit makes it better

Fields: TypeAlias = Mapping[str, object]  # of a rule's message; none where all is well


def few(case: Case, net: ContactNet, pressure: Array, width: float = 0.0) -> Fields:
    """Return how few nodes lie across a contact, and what to set; nothing where they are enough.

    Args:
        case: The problem.
        net: The nodes of its contact.
        pressure: At them (n,), MPa.
        width: About how wide the contact is, where that is known otherwise than by the nodes, mm; else 0.
    """
    zone = net.zone(pressure)
    if zone is None:
        return {}
    wanted = ENOUGH * zone.free
    scarce = np.flatnonzero(np.round(zone.nodes, 6) < wanted)
    if not len(scarce):
        return {}
    finer = max((wanted[k] + 1) * zone.spacing[k] / _width(zone, k, width) for k in scarce)  # w / h - 1 nodes at least
    worst = scarce[np.argmin(zone.nodes[scarce] / wanted[scarce])]
    number = round(zone.nodes[worst])
    return {"nodes": f"{number} node{'s lie' if number > 1 else ' lies'}", "remedy": _remedy(case, net, zone, finer)}


def _width(zone: Zone, k: int, width: float) -> float:
    """Return how wide the contact is along a coordinate, mm: from its outermost nodes on up to those beside them."""
    least = max((zone.nodes[k] - 1) * zone.spacing[k], zone.spacing[k] / 4)
    return float(np.clip(width, least, least + 2 * zone.spacing[k])) if width else least


def _remedy(case: Case, net: ContactNet, zone: Zone, finer: float) -> str:
    """Return how to have enough nodes across the contact, with elements `finer` times smaller."""
    counts = {name: count for name, count in _counts(case, COUNTS).items() if count > 0}
    if not counts:
        each = net.surface.degree if net.surface.cell != "triangle" else 1
        return f"Make the elements at the contact {each * zone.spacing.min() / finer:.2g} mm long"
    steps = {name: 2 if count % 2 == 0 else 1 for name, count in counts.items()}
    keys = (f"`geometry.parameters.{k} = {steps[k] * math.ceil(n * finer / steps[k])}`" for k, n in counts.items())
    return f"Set {' and '.join(keys)}"


def _counts(case: Case, names: Sequence[str]) -> dict[str, float]:
    """Return those numbers of elements that the geometry has as parameters, by their names."""
    geometry = case.geometry
    try:
        path = find_geometry(geometry, case.folder)
        known = constants(path) if path.suffix == ".geo" else {}
        return {name: float(geometry.parameters.get(name, known[name])) for name in names if name in known}
    except (CaseError, OSError, ValueError):  # the file is gone, or what it gives is no number
        return {}


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


NONE_DEEP = Deep(0.0, 0.0, 1.0, 0.0, "")  # no element


def deepest(system: Tribosystem, net: ContactNet, pressure: Array, width: float = 0.0) -> Deep:
    """Return the element that is the deepest for its place below a contact; `NONE_DEEP` where none is; collective.

    Args:
        system: The problem.
        net: The nodes of its contact.
        pressure: At them (n,), MPa.
        width: Of the contact at least, mm: deep elements make it narrow.
    """
    zone = net.zone(pressure)
    if zone is None:
        return NONE_DEEP
    ends = np.where(zone.free == 1, 1.0, 2.0)  # beyond an end that is not free the contact is as made, or symmetric
    degree = system.bodies.punch.space.ufl_element().degree
    # What is coarse along the contact, too, needs more elements there, which are then less deep: see `few`.
    half = max(float(((zone.nodes - 1) * zone.spacing / ends).min()), width / 2, ALIKE * degree * zone.spacing.min())
    places = net.surface.x[net.piece(pressure)]
    bodies = [body for body in (system.bodies.punch, system.bodies.strip) if body.reading is None]
    return max((_deepest(body, places, half) for body in bodies), key=attrgetter("excess"), default=NONE_DEEP)


def _deepest(body: ElasticBody, places: Array, half: float) -> Deep:
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
    local_worst = (0.0, 0.0, 1.0, 0.0)
    if len(cells):
        k = int(excess.argmax())
        local_worst = (float(excess[k]), float(depth[k]), float(allowed[k]), float(least[k]) if not at[k] else 0.0)
    worst = max(mesh.comm.allgather(local_worst))
    return Deep(worst[0], worst[1], worst[2], worst[3], body.body.name)


def polygon(system: Tribosystem, pressure: Array) -> Fields:
    """Return the curved surface that is a polygon whose corners show in the pressures (n,), MPa; nothing else."""
    for body in (system.bodies.punch, system.bodies.strip):
        if body.meshed.degree == 1 and system.pair.punch.grid is None:
            continue  # nodes at the corners alone, which lie on the curve
        angle = _angle(body)
        waves = np.pi * contact_modulus(system.case) * angle / 16
        if waves > SEEN * pressure.max(initial=0.0):
            return {"body": body.body.name, "degrees": float(np.degrees(angle)), "waves": waves}
    return {}


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


@dataclass(frozen=True)
class HeatedLayer:
    """Where elements below the contact are the coarsest for the layer that heats up.

    Attributes:
        thickness: Of the layer, mm.
        height: Of the element there, mm.
        remedy: The advice for elements whose nodes are as far apart as the layer is thick; "" where they are.
    """

    thickness: float
    height: float
    remedy: str


def heated_layer(system: ContactSetup) -> HeatedLayer:
    """Return where the strip's elements are the coarsest for the layer that heats up at the fastest; collective.

    Its thickness is infinite without heat, to and fro, and where nothing passes.
    """
    case, motion, pair = system.case, system.motion, system.pair
    speed = max([phase.speed for phase in motion.phases] + [abs(v) for v in speeds_of(case)])
    if case.heat is None or not case.passes or len(set(motion.directions)) > 1 or speed == 0:
        return HeatedLayer(np.inf, 0.0, "")
    surface = pair.strip
    below = surface.spread.T @ (pair.transfer.T @ pair.weights) > 0
    mesh = system.bodies.strip.body.mesh
    simplex = mesh.basix_cell() in (CellType.triangle, CellType.tetrahedron)
    # Of a simplex the height is what volume over area is times its dimension.
    heights = system.bodies.element_heights.strip[below] * (mesh.topology.dim if simplex else 1)
    layers = np.sqrt(_diffusivities(system)[below] * _passing(system, speed))
    worst = int(np.argmax(heights / layers))
    layer, height = float(layers[worst]), float(heights[worst])
    finer = height / (surface.degree * layer)
    keys = [f"Set `geometry.parameters.{name} = {math.ceil(n * finer)}`" for name, n in _counts(case, LAYERS).items()]
    remedy = (keys or [f"Make them at most {height / finer:.3g} mm high"])[0]
    return HeatedLayer(layer, height, remedy if finer > 1 else "")


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
    diffusivities: Array = np.full(len(system.pair.strip.weights), np.inf)
    for name, share in system.bodies.regions[1].items():
        m = materials[regions[name]]
        capacity = (m.density or 0.0) * (m.heat_capacity or 0.0)
        diffusivities = np.where(
            share > 0, np.minimum(diffusivities, (m.conductivity or 0.0) / capacity), diffusivities
        )
    return diffusivities


@dataclass(frozen=True)
class Measure:
    """A number that a change of the mesh's unit changes.

    Attributes:
        value: With the mesh in mm.
        power: The unit of length that it belongs to.
        low, high: Ends of what is usual, wide.
        text: Its description.
    """

    value: float
    power: int
    low: float
    high: float
    text: str

    def outside(self, factor: float = 1.0) -> float:
        """Return by how many decades it is outside what is usual, with a mesh times a factor."""
        value = max(self.value * factor**self.power, 1e-300)
        return max(0.0, float(np.log10(self.low / value)), float(np.log10(value / self.high)))


def other_unit(case: Case, bodies: Bodies, rigid: RigidEquilibrium) -> Fields:
    """Return the unit that the mesh is probably in; nothing where that is mm; collective.

    Size, load, stroke and thickness are held against each other: the mesh is doubted where they are far from what is
    usual, and in another unit are not.
    """
    measures = _measures(case, bodies, rigid)
    as_read = sum(measure.outside() for measure in measures)
    others = {unit: sum(m.outside(factor) for m in measures) for unit, factor in UNITS.items()}
    unit = min(others, key=lambda name: others[name])
    if as_read - others[unit] < CLEARLY:
        return {}
    odd = ", ".join(measure.text for measure in measures if measure.outside() > 0)
    return {"unit": unit, "factor": UNITS[unit], "odd": odd}


def _measures(case: Case, bodies: Bodies, rigid: RigidEquilibrium) -> list[Measure]:
    """Return the estimates from the smaller body, and from the load on the whole contact surface."""
    sizes = {"punch": _size(bodies.punch), "strip": _size(bodies.strip)}
    body = min(sizes, key=lambda name: sizes[name])
    size = sizes[body]
    estimates = [Measure(size, 1, 0.3, 5e3, f"the {body} is {size:.3g} mm in all")]
    if case.model.kind == "plane":
        thickness = case.model.thickness
        estimates.append(Measure(size / thickness, 1, 0.05, 500, f"model.thickness is {thickness:.3g} mm"))
    if isinstance(case.motion, Reciprocating | Tabulated):
        _, distance, half_cycles = cycle_of(case)
        stroke = distance / half_cycles
        estimates.append(Measure(size / stroke, 1, 0.05, 1e4, f"the stroke is {stroke:.3g} mm"))
    if rigid.translations:
        used = case.used_materials
        strain = rigid.mean_pressure / min(case.initial_materials[name].young for name in used)
        text = f"the load presses with {readable(rigid.mean_pressure, 3)} MPa on the whole surface"
        estimates.append(Measure(strain, -1 if case.model.kind == "plane" else -2, 1e-9, 0.05, text))
    return estimates


def _size(elastic: ElasticBody) -> float:
    """Return the longest side of the box around a body, mm; collective."""
    mesh = elastic.body.mesh
    x = mesh.geometry.x
    low, high = (x.min(axis=0), x.max(axis=0)) if len(x) else (np.full(3, np.inf), np.full(3, -np.inf))
    ends = np.array(mesh.comm.allgather((low, high)))
    return float((ends[:, 1].max(axis=0) - ends[:, 0].min(axis=0)).max())


def turned(pair: ContactPair, depth: Array) -> float:
    """Return by how much worn depths of both bodies together (n,), mm, turn the normals of round contacts, rad."""
    rounds, number = pair.punch.rounds
    number = number[pair.punch.nodes]
    angle = 0.0
    for k, round_contact in enumerate(rounds):
        nodes = (number == k) & (depth > WORN * depth.max(initial=0.0))
        if not nodes.any():
            continue
        deepest = pair.normal[nodes][depth[nodes].argmax()]
        across = np.sqrt(np.maximum(1 - (pair.normal[nodes] @ deepest) ** 2, 0.0))
        angle = max(angle, float(depth[nodes].max() * across.max() / round_contact.radius))
    return angle
