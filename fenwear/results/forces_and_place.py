"""Forces of the contact, and where bodies find their place: how far they have moved, a shaft's eccentricity.

The force on the punch at node i is A_i p_i (e_n + tau)_i, A_i its area and tau the traction of friction over the
pressure, both of the middle position of a half-cycle, as all of its records are.

A body that supports leave free moves until pressure and friction balance its loads. Its motion is that of the surfaces
on which its loads act, in the mean, against where it was meshed (of its whole volume where none acts). Of a shaft in a
bore, along y, it is the way e from the middle of the bore to that of the shaft: of circles that fit their surfaces as
they are deformed, without their wear, in least squares. Its size is the eccentricity; the attitude angle is that from
the way in which the load presses the shaft to e, positive as the strip turns. Where rigid bodies wear a bore by an arc
of psi0 to each side the eccentricity is D / cos psi0, D the radial clearance; friction has the middle of the contact at
atan mu against the turning: a dry shaft climbs. A shaft in several bores, each a contact with a name, has a place in
each of them, in the middle along y; there the angle is from the force that the bore carries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask
from fenwear.laws.wear import WornDepths
from fenwear.results.quantity import RECORD, InTable, Quantity
from fenwear.steps import Block
from fenwear.surfaces import RigidEquilibrium
from fenwear.surfaces.equilibrium import is_translation
from fenwear.surfaces.placement import in_model
from fenwear.system import ContactSetup


def node_forces(block: Block) -> Array:
    """Return the forces on the punch at the contact nodes in each half-cycle of a block (k, n, d), N."""
    system = block.system
    area = system.bodies.punch.thickness * system.pair.weights
    traction = system.pair.normal + in_model(np.array(block.friction_ratio), system.pair.punch.dim)
    return np.asarray((area * block.pressure)[:, :, None] * traction)


TRUE = 1e-3  # of the radius: how far the points of a round surface may be from a circle
ARC = 2.5  # radius over the chord of the contact, up to which it is round
MOVED = {"lambda_F": "moved_z", "lambda_Fx": "moved_x", "lambda_Fy": "moved_y", "lambda_M": "turned_y",
         "lambda_Mx": "turned_x", "lambda_My": "turned_y", "lambda_Mz": "turned_z"}  # fmt: skip
ECCENTRICITY = {
    "eccentricity": ("mm", "way from the bore's middle to the shaft's"),
    "eccentricity_x": ("mm", "x component of the way from the bore's middle to the shaft's"),
    "eccentricity_z": ("mm", "z component of the way from the bore's middle to the shaft's"),
    "attitude_angle": (
        "degree",
        "angle from the way in which the load presses the shaft to that of its eccentricity, as the strip turns",
    ),
}
AT_END = ("eccentricity", "attitude_angle")  # of a single bore, in summary.json


def of_bore(name: str, values: Callable[[Any], Mapping[str, Array]]) -> list[Quantity]:
    """Return the quantities of the shaft's place in a bore.

    Args:
        name: Of the bore; "" of the only one.
        values: Their values for each half-cycle, by `ECCENTRICITY`.
    """
    end, words = (f"_{name}", f" ({name})") if name else ("", "")
    return [
        Quantity(key + end, RECORD, unit, text + words, InTable(values, key), of="end" if key + end in AT_END else "")
        for key, (unit, text) in ECCENTRICITY.items()
    ]


class Circle(NamedTuple):
    """A circle about an axis along y: its middle (x, z) and radius, mm."""

    middle: Array
    radius: float


class Bore(NamedTuple):
    """A shaft in a bore.

    Attributes:
        bore, shaft: Of the unworn surfaces.
        sign: 1 where the punch has the bore, -1 where it is the shaft.
        nodes: Contact nodes of it (n,).
    """

    bore: Circle
    shaft: Circle
    sign: int
    nodes: Mask


def motions(rigid: RigidEquilibrium) -> list[str]:
    """Return the names of the free motions of both bodies: moved_z, turned_y_left, moved_x_strip."""
    names = []
    for k, mode in enumerate(rigid.mode_names):
        kind, part = "_".join(mode.split("_")[:2]), mode.split("_")[2:]
        end = [] if k < rigid.of_punch else ["strip"]
        names.append("_".join([MOVED[kind], *part, *end]))
    return names


def quantities(placed: ContactSetup) -> list[Quantity]:
    """Return the quantities of the bodies' place: their free motions, and that of a shaft in its bores."""
    place_quantities: list[Quantity] = []
    for number, (name, mode) in enumerate(zip(motions(placed.rigid), placed.rigid.mode_names, strict=True)):
        body = "strip" if name.endswith("_strip") else "punch"
        axis = name.split("_")[1]
        unit, text = ("mm", f"moved along {axis}") if is_translation(mode) else ("rad", f"turned about {axis}")
        part = "" if len(mode.split("_")) < 3 else f" ({'_'.join(mode.split('_')[2:])})"
        words = f"how far the {body}{part} has {text}, from where it was meshed"
        place_quantities.append(Quantity(name, RECORD, unit, words, partial(_motion, number=number)))
    for name, bore in bores_of(placed).items():
        place_quantities += of_bore(name, partial(_eccentricity, bore=bore, named=bool(name)))
    return place_quantities


def _motion(block: Block, number: int) -> Array:
    return np.asarray(block.rigid[:, number])


def _eccentricity(block: Block, bore: Bore, *, named: bool) -> dict[str, Array]:
    """Return the eccentricity of a shaft in one bore in each half-cycle (k,), by `ECCENTRICITY`.

    Of one of several bores the angle is from the force that it carries, of the only one from the load.
    """
    system = block.system
    away = bore.shaft.middle - bore.bore.middle - bore.sign * _apart(block, bore.nodes)
    if named:  # by pressure and friction, on the punch: the load on it is the other way
        loads = -np.asarray(node_forces(block)[:, bore.nodes].sum(axis=1))
    else:
        loads = (system.bodies.punch.given - system.bodies.strip.given)[None]
    pressed = -bore.sign * loads[:, [0, -1]]
    cross = away[:, 0] * pressed[:, 1] - away[:, 1] * pressed[:, 0]
    turn = np.sign(system.sliding.field.turn[1]) or 1.0
    return {
        "eccentricity": np.asarray(np.linalg.norm(away, axis=1)),
        "eccentricity_x": away[:, 0],
        "eccentricity_z": away[:, 1],
        "attitude_angle": np.degrees(turn * np.arctan2(cross, (away * pressed).sum(axis=1))),
    }


def bores_of(placed: ContactSetup) -> dict[str, Bore]:
    """Return the shaft and the bore of each contact, by its name or "" where it is one.

    Of those alone in which one body is around the other, where a body is free to move across the axis.
    """
    pair = placed.pair
    free = {mode.split("_")[1] for mode in placed.rigid.mode_names} & {"F", "Fx"}
    if not free or placed.bodies.punch.law.kind == "axisymmetric":
        return {}
    followed = placed.bodies.followed
    depths = (0.0, 0.0) if followed is None else (followed.punch[:, None], followed.strip[:, None])
    shaft = {}
    for name in pair.punch.names or ("",):
        nodes, opposite = (
            surface.nodes_of(name) if name in surface.names else np.ones(len(surface.weights), dtype=bool)
            for surface in (pair.punch, pair.strip)
        )
        punch, strip = _circle(pair.punch, nodes, depths[0]), _circle(pair.strip, opposite, depths[1])
        outward = pair.punch.outward[nodes]
        if punch is None or strip is None or (outward[:, 0] ** 2 > 0.5).sum() == 0:
            continue
        outwards = np.einsum("ic,ic->i", pair.punch.x[nodes][:, [0, -1]] - punch.middle, outward[:, [0, -1]])
        within = (outwards < 0).all()
        shaft[name] = Bore(punch, strip, 1, nodes) if within else Bore(strip, punch, -1, nodes)
    return shaft


def _circle(surface: ContactSurface, nodes: Mask, followed: Array | float) -> Circle | None:
    """Return the circle about an axis along y that nodes (n,) of a surface lie on; None where it lies on none.

    Before its mesh has followed wear, by depths (n, 1).
    """
    x = (surface.unworn + followed * surface.outward)[nodes][:, [0, -1]]
    system = np.column_stack([2 * x, np.ones(len(x))])
    coefficients, *_ = np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)
    middle = coefficients[:2]
    ways = np.linalg.norm(x - middle, axis=1)
    radius = float(ways.mean())
    true = np.ptp(ways) < TRUE * radius and radius < ARC * float(np.ptp(x, axis=0).max())
    return Circle(middle, radius) if true else None


def _apart(block: Block, nodes: Mask) -> Array:
    """Return how far the punch's surface has moved from the strip's, x and z in the middle along y (k, 2), mm.

    The translation, and in a solid the tilt, that fits what gaps at some nodes have opened by best.
    """
    system, pair = block.system, block.system.pair
    depths = zip(block.wear, block.wear_strip, block.between, strict=True)
    undeformed = np.array([system.gap(0, WornDepths(*map(np.asarray, worn))) for worn in depths])
    fields = pair.normal[nodes][:, [0, -1]]
    if pair.punch.dim == 3:
        y = pair.punch.x[nodes, 1]
        fields = np.column_stack([fields, (y - (y.min() + y.max()) / 2)[:, None] * fields])
    root = np.sqrt(pair.weights[nodes])
    opened = (block.gap - undeformed)[:, nodes]
    fit, *_ = np.linalg.lstsq(root[:, None] * fields, root[:, None] * opened.T, rcond=None)
    return np.asarray(fit[:2].T)
