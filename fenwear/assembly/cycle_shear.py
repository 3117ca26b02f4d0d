"""Sliding as a vector over a cycle on the materials of placed bodies: tensors, cross-shear, mean pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Dependence
from fenwear.sliding.cross_shear import CycleShear, SlidingTensor

if TYPE_CHECKING:
    from fenwear.assembly.contact_setup import ContactSetup


def squares(along: Array) -> Array:
    """Return the products of all components of directions (..., 3) with each other (..., 9)."""
    return np.reshape(along[..., :, None] * along[..., None, :], (*along.shape[:-1], 9))


def sliding_tensor(placed: ContactSetup, pressure: Array | None = None) -> SlidingTensor:
    """Return the tensor of a cycle's sliding at the punch's contact nodes.

    Args:
        placed: The bodies.
        pressure: Of all phases (m, n), MPa; None for the ways alone.
    """
    weights = placed.path if pressure is None else placed.path * pressure
    return SlidingTensor(np.einsum("mi,mic->ic", weights, placed.sliding_squares).reshape(-1, 3, 3))


def sliding_tensor_of_strip(placed: ContactSetup, pressure: Array | None = None) -> SlidingTensor:
    """Return the same at the strip's contact nodes, of its own material that moves under the punch."""
    weights = placed.path if pressure is None else placed.path * pressure
    values = np.zeros((len(placed.pair.strip.weights), 9))
    for k, facing in enumerate(placed.pairs):
        along = facing.material_place.back(placed.sliding_directions[k])
        values += facing.wear_projection @ (weights[k][:, None] * squares(along))
    return SlidingTensor(values.reshape(-1, 3, 3))


def cycle_shear(placed: ContactSetup, pressure: Array | None) -> CycleShear | None:
    """Return what coefficients know of a whole cycle; None where none asks for it.

    Where nothing presses in the whole cycle the ways alone count, as where no pressures are known yet.

    Args:
        placed: The bodies.
        pressure: Of all phases (m, n), MPa; None where they are not known.
    """
    if not asks_for_cycle(placed):
        return None
    ways, slid = sliding_tensor(placed), placed.path.sum(axis=0)
    strip: Array = np.zeros(len(slid))
    if placed.strip_wears:
        strip = placed.pair.wear_interpolation @ sliding_tensor_of_strip(placed, pressure).ratio
    if pressure is None:
        return CycleShear((ways.ratio, strip), np.full(len(slid), placed.rigid.mean_pressure))
    found = sliding_tensor(placed, pressure)
    ratio = np.where(found.work > 0, found.ratio, ways.ratio)
    return CycleShear((ratio, strip), found.work / np.where(slid > 0, slid, 1.0))


def asks_for_cycle(placed: ContactSetup) -> bool:
    """Return whether a coefficient depends on the cross-shear or the mean pressure of a cycle."""
    laws = [law.given_coefficient for law in placed.sliding.wear if law is not None]
    given = [placed.friction.contact.friction, *laws]
    return any(isinstance(one, Dependence) and (one.depends_on("cs") or one.depends_on("pm")) for one in given)
