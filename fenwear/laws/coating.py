"""A coating above the base of a body: what is worn while it lasts, in the step in which it ends, and behind that.

With coefficients k_c of the coating and k_b of the base, a place would lose A = k_c E and B = k_b E in a step, with E
what all its pressures and paths come to. Of a coating of which c is left there it loses

    w = min(A, c) + B max(1 - c / A, 0):

the base begins to wear in the share 1 - c / A of the step, with nothing stepped over. That is exact for a pressure that
stays, and two such steps one after the other are the same as one of their length, however jumps are cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.case import WearLaw
from fenwear.case.wear_table import place_values
from fenwear.common.arrays import Array
from fenwear.surfaces import ContactPair
from fenwear.surfaces.placement import in_space

Covered = tuple[Array | float, Array | float]  # of punch and strip
BARE: Covered = (0.0, 0.0)
FADES = 0.1  # of the thickness, over which the friction of a coating goes over to that of the base


@dataclass(frozen=True)
class Shares:
    """Worn parts of A and B at nodes (n,), w = coating A + base B, and the derivatives of w to A and B."""

    coating: Array
    base: Array
    by_coating: Array
    by_base: Array

    def of(self, coating: Array, base: Array) -> Array:
        """Return w of A and B (..., n), mm."""
        return self.coating * coating + self.base * base

    def at(self, interpolation: Array) -> Shares:
        """Return the shares at other nodes, by a matrix that interpolates there."""
        return Shares(*(interpolation @ shares for shares in (self.coating, self.base, self.by_coating, self.by_base)))


def shares(coating: Array, base: Array, left: Array) -> Shares:
    """Return the shares of the depths that a coating and the base below it lose.

    Args:
        coating, base: A and B (n,), mm.
        left: c (n,), mm.
    """
    through = (coating > left) | (left <= 0)
    used = np.where(through, left / np.where(coating > 0, coating, 1.0), 1.0)
    by_coating = np.where(through, used * base / np.where(coating > 0, coating, 1.0), 1.0)
    return Shares(used, 1 - used, by_coating, 1 - used)


def left_of(thickness: Array, depth: Array) -> Array:
    """Return the remaining thickness of a coating (..., n), mm, from the initial one (n,) and depths (..., n)."""
    return np.asarray(np.maximum(thickness - depth, 0.0))


def covered(thickness: Array, depth: Array) -> Array:
    """Return the share of a coating's friction that remains (n,): 1 until its last tenth, 0 where it is bare."""
    thick = thickness > 0
    return np.where(thick, np.minimum(left_of(thickness, depth) / np.where(thick, FADES * thickness, 1.0), 1.0), 0.0)


def coating_thickness(law: WearLaw, x: Array, key: str) -> Array:
    """Return the thickness of a body's coating at its contact nodes (n,), mm; 0 without.

    Args:
        law: The wear law of the body.
        x: The nodes (n, d), mm.
        key: The body's name in the table wear.

    Raises:
        CaseError: it is negative somewhere.
    """
    if law.coating is None:
        return np.zeros(len(x))
    place = dict(zip("xyz", in_space(x).T, strict=True))
    name = f"wear.{key}.coating.thickness"
    return np.asarray(place_values(law.coating.thickness, place, len(x), "mm", name, 0.0))


def coatings_of(pair: ContactPair, laws: tuple[WearLaw, WearLaw]) -> tuple[Array, Array]:
    """Return the thickness of the coatings of punch and strip at their own contact nodes, mm; 0 without.

    Raises:
        CaseError: it is negative somewhere.
    """
    punch, strip = laws
    return coating_thickness(punch, pair.punch.unworn, "punch"), coating_thickness(strip, pair.strip.unworn, "strip")


@dataclass(frozen=True)
class SoftCoating:
    """A coating with a compliance beside its base, uniform over its remaining thickness, as if it were held sideways.

    So it goes over to the base by itself: its compliance falls to zero where it is worn through. Its law is
    in `fenwear.laws.compliant_layer`.

    Attributes:
        thickness: At the body's own contact nodes (n,), mm.
        modulus: Small pressures over the share by which they compress it, MPa; infinite where it is as stiff as its
            base.
    """

    thickness: Array
    modulus: float

    def left(self, depth: Array) -> Array:
        """Return the remaining thickness at a depth (n,), mm."""
        return left_of(self.thickness, depth)


def soft_coatings(pair: ContactPair, laws: tuple[WearLaw, WearLaw]) -> tuple[SoftCoating, SoftCoating]:
    """Return the coatings of punch and strip, which may have a compliance beside their base.

    Raises:
        CaseError: the thickness of one is negative somewhere.
    """
    moduli = [getattr(law.coating, "modulus", None) or np.inf for law in laws]
    punch, strip = map(SoftCoating, coatings_of(pair, laws), moduli)
    return punch, strip


def covering(coatings: tuple[Array, Array], pair: ContactPair, depths: tuple[Array, Array] | None) -> Covered:
    """Return the shares of the friction of both bodies' coatings that remain at the contact's nodes (n,), from 1 to 0.

    Args:
        coatings: Thickness at the bodies' own nodes, mm.
        pair: The surfaces opposite each other.
        depths: Worn off both bodies at their own nodes, mm; None where all is worn through.
    """
    if depths is None or not any(thickness.any() for thickness in coatings):
        return BARE
    punch, strip = map(covered, coatings, depths)
    return punch, pair.wear_interpolation @ strip


@dataclass(frozen=True)
class CoatedBody:
    """A coated body whose coefficients go by a ratio: its depth by A, which grows evenly through the coating's end.

    Attributes:
        thickness: Of the coating at the body's own contact nodes (n,), mm; 0 without.
        ratio: k_b / k_c (n,).
    """

    thickness: Array
    ratio: Array

    def depth(self, measure: Array) -> Array:
        """Return the depth (n,), mm, of what the coating's coefficient would have worn in all, A (n,), mm."""
        return np.asarray(measure + (self.ratio - 1) * np.maximum(measure - self.thickness, 0.0))

    def at(self, interpolation: Array) -> CoatedBody:
        """Return the coated body at other nodes, by a matrix that interpolates there."""
        return CoatedBody(interpolation @ self.thickness, interpolation @ self.ratio)
