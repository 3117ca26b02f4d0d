"""Where bodies find their place: how far each free motion has gone, and a shaft's eccentricity in its bore.

A body that supports leave free moves until pressure and friction balance its loads. What it has moved by, against where
it was meshed, is told of its side away from the contact. Of a shaft in a bore, along y, it is the way e from the middle
of the bore to that of the shaft: of circles that fit their surfaces as they are deformed, without their wear, in least
squares. Its size is the eccentricity; the attitude angle is that from the way in which the load presses the shaft to e,
positive as the strip turns. Where rigid bodies wear a bore by an arc of psi0 to each side the eccentricity is
D / cos psi0, D the radial clearance; friction has the middle of the contact at atan mu against the turning: a dry shaft
climbs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Placed
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.cycle import Block
from fenwear.interface.equilibrium import is_translation
from fenwear.results.sheet import Variable
from fenwear.sliding.wear import Worn

TRUE = 1e-3  # of the radius: how far the points of a round surface may be from a circle
ARC = 2.5  # radius over the chord of the contact, up to which it is round
MOVED = {"lambda_F": "moved_z", "lambda_Fx": "moved_x", "lambda_Fy": "moved_y", "lambda_M": "turned_y",
         "lambda_Mx": "turned_x", "lambda_My": "turned_y", "lambda_Mz": "turned_z"}  # fmt: skip
ECCENTRICITY: dict[str, Variable] = {
    "eccentricity": (("half_cycle",), "mm", "way from the bore's middle to the shaft's"),
    "eccentricity_x": (("half_cycle",), "mm", "x component of the way from the bore's middle to the shaft's"),
    "eccentricity_z": (("half_cycle",), "mm", "z component of the way from the bore's middle to the shaft's"),
    "attitude_angle": (
        ("half_cycle",),
        "degree",
        "angle from the way in which the load presses the shaft to that of its eccentricity, as the strip turns",
    ),
}


class Circle(NamedTuple):
    """A circle about an axis along y: its middle (x, z) and radius, mm."""

    middle: Array
    radius: float


class Bore(NamedTuple):
    """A shaft in a bore.

    Attributes:
        bore, shaft: Of the unworn surfaces.
        sign: 1 where the punch has the bore, -1 where it is the shaft.
    """

    bore: Circle
    shaft: Circle
    sign: int


def motions(placed: Placed) -> list[str]:
    """Return the names of the free motions of both bodies: moved_z, turned_y_left, moved_x_strip."""
    found = []
    for k, mode in enumerate(placed.rigid.mode_names):
        kind, part = "_".join(mode.split("_")[:2]), mode.split("_")[2:]
        end = [] if k < placed.rigid.of_punch else ["strip"]
        found.append("_".join([MOVED[kind], *part, *end]))
    return found


def variables(placed: Placed) -> dict[str, Variable]:
    """Return the variables of a history that tell the bodies' place."""
    found: dict[str, Variable] = {}
    for name, mode in zip(motions(placed), placed.rigid.mode_names, strict=True):
        body = "strip" if name.endswith("_strip") else "punch"
        axis = name.split("_")[1]
        unit, text = ("mm", f"moved along {axis}") if is_translation(mode) else ("rad", f"turned about {axis}")
        part = "" if len(mode.split("_")) < 3 else f" ({'_'.join(mode.split('_')[2:])})"
        found[name] = (("half_cycle",), unit, f"how far the {body}{part} has {text}, from where it was meshed")
    return found | (ECCENTRICITY if bore_of(placed) is not None else {})


def values(block: Block) -> dict[str, Array]:
    """Return them of each half-cycle of a block (k,)."""
    system = block.system
    found: dict[str, Array] = dict(zip(motions(system), block.rigid.T, strict=True))
    bore = bore_of(system)
    if bore is None:
        return found
    away = bore.shaft.middle - bore.bore.middle - bore.sign * _apart(block)
    loads = system.bodies.punch.given - system.bodies.strip.given
    pressed = -bore.sign * loads[[0, -1]]
    cross, along = away[:, 0] * pressed[1] - away[:, 1] * pressed[0], away @ pressed
    turn = np.sign(system.sliding.field.turn[1]) or 1.0
    return found | {
        "eccentricity": np.asarray(np.linalg.norm(away, axis=1)),
        "eccentricity_x": away[:, 0],
        "eccentricity_z": away[:, 1],
        "attitude_angle": np.degrees(turn * np.arctan2(cross, along)),
    }


def numbers(last: Block) -> dict[str, float]:
    """Return the eccentricity at the end of a run for summary.json, or nothing."""
    if bore_of(last.system) is None:
        return {}
    found = values(last)
    names = {"eccentricity_mm": "eccentricity", "attitude_angle_deg": "attitude_angle"}
    return {key: float(found[name][-1]) for key, name in names.items()}


def bore_of(placed: Placed) -> Bore | None:
    """Return the shaft and the bore where one body is in the other, and free to move across the axis; else None."""
    pair = placed.pair
    across = {"lambda_F", "lambda_Fx"} & set(placed.rigid.mode_names)
    if not across or placed.bodies.punch.law.kind == "axisymmetric":
        return None
    punch, strip = (_circle(surface) for surface in (pair.punch, pair.strip))
    if punch is None or strip is None or (pair.punch.outward[:, 0] ** 2 > 0.5).sum() == 0:
        return None
    outwards = np.einsum("ic,ic->i", pair.punch.x[:, [0, -1]] - punch.middle, pair.punch.outward[:, [0, -1]])
    return Bore(punch, strip, 1) if (outwards < 0).all() else Bore(strip, punch, -1)


def _circle(surface: ContactSurface) -> Circle | None:
    """Return the circle about an axis along y that a surface lies on; None where it lies on none."""
    x = surface.unworn[:, [0, -1]]
    system = np.column_stack([2 * x, np.ones(len(x))])
    found, *_ = np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)
    middle = found[:2]
    ways = np.linalg.norm(x - middle, axis=1)
    radius = float(ways.mean())
    true = np.ptp(ways) < TRUE * radius and radius < ARC * float(np.ptp(x, axis=0).max())
    return Circle(middle, radius) if true else None


def _apart(block: Block) -> Array:
    """Return how far the punch's surface has moved from the strip's, x and z in the middle along y (k, 2), mm.

    The translation, and in a solid the tilt, that fits what gaps have opened by best, over the whole surface.
    """
    system, pair = block.system, block.system.pair
    depths = zip(block.wear, block.wear_strip, strict=True)
    undeformed = np.array([system.gap(0, Worn(np.asarray(one), np.asarray(other))) for one, other in depths])
    fields = pair.normal[:, [0, -1]]
    if pair.punch.dim == 3:
        y = pair.punch.x[:, 1]
        fields = np.column_stack([fields, (y - (y.min() + y.max()) / 2)[:, None] * fields])
    root = np.sqrt(pair.weights)
    fit, *_ = np.linalg.lstsq(root[:, None] * fields, root[:, None] * (block.gap - undeformed).T, rcond=None)
    return np.asarray(fit[:2].T)
