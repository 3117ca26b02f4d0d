"""Contact that reaches the end of a plane's or ring's meshed surface where the bodies go on: clipped.

Beyond its ends a contact surface has an edge, as a flat punch at its corner, or the bodies go on smoothly, as a
cylinder whose tagged arc ends somewhere. At a smooth end pressure or wear of the outermost node says that contact
would go on. strip_contact reaches at least as far as punch_contact in all positions, so its end is met there, too.

How wide it should be is estimated by areas: the worn cross-section A fills the space below a level D,

    integral of max(D - g, 0) dx = A,    g the gap of the unworn bodies with its least value taken off,

and D is at least what Hertz's line contact closes, 2 F / (pi E*), F the load over the thickness, or of a ring over its
mean circumference. Of solids: `fenwear.plausibility.rim`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from dolfinx.mesh import exterior_facet_indices
from numpy.typing import NDArray
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from fenwear import compat
from fenwear.arrays import Array, Mask
from fenwear.assembly import Tribosystem
from fenwear.bodies.mesh import BodyMesh
from fenwear.case import Case
from fenwear.sliding.wear import WornDepths

SMOOTH = np.cos(np.radians(20))  # cosine of the angle between two facets up to which the boundary goes on
FINE = 4001  # abscissae of the gap between the bodies
WIDER = 1.1  # over the present width: least that is asked for


class _Outline(NamedTuple):
    """The boundary along the contact surface and on to its next edges by ascending x, and the contact's ends, mm."""

    x: Array
    z: Array
    ends: tuple[float, float]


@dataclass(frozen=True)
class ContactEnds:
    """The two ends of the contact surface, of the meshes as they were made.

    Attributes:
        goes_on: Whether both bodies go on smoothly beyond the left and the right end.
        ends: Abscissae of the ends, mm.
        x: Abscissae as far as both bodies go on (k,), mm.
        gap: Gap of the unworn bodies there, its least value taken off (k,), mm.
        closed_by_load: D of Hertz over the load, mm per N/mm.
        around: Of a ring its mean circumference, mm; 1 in a plane, whose forces are those over the thickness.
        of_grid: Whether an end is that of a contact grid within the surface.
    """

    goes_on: tuple[bool, bool]
    ends: tuple[float, float]
    x: Array
    gap: Array
    closed_by_load: float
    around: float = 1.0
    of_grid: bool = False

    @property
    def width(self) -> float:
        """How wide the contact surface is, mm."""
        return self.ends[1] - self.ends[0]

    def touched(self, carried: Mask) -> Mask:
        """Return where the contact is clipped (k,) bool, of nodes that carry pressure or wear (k, n)."""
        return np.asarray((carried[:, [0, -1]] & self.goes_on).any(axis=1))

    def where(self, carried: Mask) -> str:
        """Return in words where the contact is clipped, of nodes that carry pressure or wear (n,); "" for nowhere."""
        places = self.reached((bool(carried[0]), bool(carried[-1])))
        return f"at x = {' and '.join(f'{x:.4g}' for x in places)} mm" if places else ""

    def reached(self, at_ends: tuple[bool, bool]) -> list[float]:
        """Return the abscissae of the ends where the contact is clipped, mm.

        Args:
            at_ends: Whether the outermost nodes carry pressure or wear.
        """
        return [x for x, on, held in zip(self.ends, self.goes_on, at_ends, strict=True) if on and held]

    def width_needed(self, worn_area: float, load: float) -> float:
        """Return about how wide the contact surface should be, mm; at most as far as the bodies go on.

        Args:
            worn_area: Cross-section worn off both bodies, mm²; of a ring the volume, mm³.
            load: On the contact over the thickness, N/mm; of a ring all of it, N.
        """
        level = max(self._level(worn_area / self.around), self.closed_by_load * load / self.around)
        lowest = int(np.argmin(self.gap))
        above = np.flatnonzero(self.gap > level)
        left = max((k for k in above if k < lowest), default=0)
        right = min((k for k in above if k > lowest), default=len(self.x) - 1)
        wide = float(self.x[right] - self.x[left])
        return min(max(wide, WIDER * self.width), self.reach)

    def hertzian(self, load: float) -> float:
        """Return about how wide the contact of unworn cylinders is, mm, under a load as `width_needed` has it.

        That of the parabola through the ends of the contact surface: facets may be longer than the contact is wide.
        """
        level, open_by = self.closed_by_load * load / self.around, np.interp(self.ends, self.x, self.gap).mean()
        return self.width * float(np.sqrt(min(level / max(open_by, 1e-300), 1.0)))

    @property
    def reach(self) -> float:
        """How wide a contact surface could be: from edge to edge, mm."""
        return float(self.x[-1] - self.x[0])

    def _level(self, area: float) -> float:
        highest = float(self.gap.max())

        def missing(level: float) -> float:
            return float(trapezoid(np.maximum(level - self.gap, 0.0), self.x)) - area

        if area <= 0:
            return 0.0
        return highest if missing(highest) <= 0 else float(brentq(missing, 0.0, highest))


def contact_ends(system: Tribosystem) -> ContactEnds | None:
    """Return how the contact surface of a system ends; collective. None where it has no two ends.

    Args:
        system: On meshes as they were made, not moved by wear.
    """
    outlines = [_outline(elastic.body) for elastic in (system.bodies.punch, system.bodies.strip)]
    if outlines[0] is None or outlines[1] is None:
        return None
    punch, strip = outlines[0], outlines[1]
    low, high = max(punch.x[0], strip.x[0]), min(punch.x[-1], strip.x[-1])
    slack = 1e-6 * (punch.ends[1] - punch.ends[0])
    x = np.linspace(low, high, FINE)
    gap = np.interp(x, punch.x, punch.z) - np.interp(x, strip.x, strip.z)
    goes_on = (bool(low < punch.ends[0] - slack), bool(high > punch.ends[1] + slack))
    closed, around = 2 / (np.pi * contact_modulus(system.case)), 1.0
    if system.case.model.kind == "axisymmetric":
        weights = system.pair.weights  # of whole circles
        around = float(2 * np.pi * (weights @ system.pair.punch.x[:, 0]) / weights.sum())
    return ContactEnds(goes_on, punch.ends, x, gap - gap.min(), closed, around)


def opened(system: Tribosystem, worn: WornDepths) -> float:
    """Return what depths worn off both bodies open in the middle position: mm² in a plane, mm³ of rings and solids."""
    return float(system.pair.weights @ system.pair.opening(worn.punch, worn.strip))


def contact_modulus(case: Case) -> float:
    """Return E* of the softest region of each body, MPa: 1 / E* = sum of (1 - nu²) / E, without nu in plane stress."""
    compliance = 0.0
    for body in (case.punch, case.strip):
        used = [case.initial_materials[name] for name in body.regions.values()]
        compliance += max((1 - (case.model.law != "stress") * m.poisson**2) / m.young for m in used)
    return 1 / compliance


def _outline(body: BodyMesh) -> _Outline | None:
    """Return the outline of a body; collective. None for a closed contact surface, and for one that is no curve."""
    mesh, dim = body.mesh, body.mesh.topology.dim
    if dim != 2:
        return None
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = exterior_facet_indices(mesh.topology)
    nodes = compat.facet_nodes(mesh, facets)[:, :2]  # corners come first
    touching = np.isin(facets, body.facet_tags.find(body.curves[f"{body.name}_contact"]))
    numbers = mesh.geometry.index_map().local_to_global(nodes.ravel().astype(np.int32)).reshape(-1, 2)
    own = (numbers, mesh.geometry.x[nodes][:, :, :2], touching)
    corners, x, contact = (np.concatenate(part) for part in zip(*mesh.comm.allgather(own), strict=True))
    places = dict(zip(corners.ravel().tolist(), x.reshape(-1, 2), strict=True))
    met, count = np.unique(corners[contact], return_counts=True)
    ends = sorted(met[count == 1].tolist(), key=lambda corner: float(places[corner][0]))
    if len(ends) != 2:
        return None
    beyond = [_walk(end, corners, contact, places) for end in ends]
    inside = sorted((places[corner] for corner in met.tolist()), key=lambda place: float(place[0]))
    line = np.array([*reversed(beyond[0]), *inside, *beyond[1]])
    return _Outline(line[:, 0], line[:, 1], (float(inside[0][0]), float(inside[-1][0])))


def _walk(end: int, corners: NDArray[np.int64], contact: NDArray[np.bool_], places: dict[int, Array]) -> list[Array]:
    """Return the places from an end of the contact surface on, as long as the boundary goes on smoothly along x."""
    (facet,) = np.flatnonzero(contact & (corners == end).any(axis=1))
    found: list[Array] = []
    corner, used = end, int(facet)
    first = heading = _step(int(corners[facet].sum()) - end, end, places)
    while True:
        nexts = [int(k) for k in np.flatnonzero((corners == corner).any(axis=1)) if k != used]
        if len(nexts) != 1 or contact[nexts[0]]:
            return found
        used = nexts[0]
        ahead = int(corners[used].sum()) - corner
        step = _step(corner, ahead, places)
        if step @ heading < SMOOTH or step[0] * first[0] <= 0:
            return found
        found.append(places[ahead])
        corner, heading = ahead, step


def _step(start: int, end: int, places: dict[int, Array]) -> Array:
    step = places[end] - places[start]
    return step / np.linalg.norm(step)
