"""Coefficients of a node between material regions: a part of its area in each, under the pressure of its side.

Where unlike coefficients k_i meet, the pressure jumps in the end: k_1 f(p_1) = k_2 f(p_2), with f the effect of the
pressure. A node there has one pressure p, the mean over its parts of shares s_i. The pressures of these are to each
other as those of the nearest nodes P_i within each region:

    p_i = p P_i / (sum of s_j P_j),    k f(p) = sum of s_i k_i f(p_i).

While the pressure is even k is the mean of the k_i; in the end, of f(p) = p^b, k^(-1/b) is that of the k_i^(-1/b).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.case import Dependence, WearLaw
from fenwear.interface import ContactPair

PURE = 1e-9  # share of other regions below which a node lies in one
SAME = 1e-6  # of the distance of the nearest node: others that are as near
FAINT = 1e-9  # of the largest pressure: where a node has none, its effect is that of so little


@dataclass(frozen=True)
class Regions:
    """The material regions of a body at the n contact nodes.

    Attributes:
        shares: Of the regions in the nodes (n,), by their names.
        mixed: Nodes that lie in several (k,).
        near: What takes pressures (n,) to the means of the nearest nodes of each region (k, n), by their names.
    """

    shares: Mapping[str, Array] = field(default_factory=dict)
    mixed: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    near: Mapping[str, csr_array] = field(default_factory=dict)

    @classmethod
    def at(cls, shares: Mapping[str, Array], x: Array) -> Regions:
        """Return the regions at nodes in places x (n, d), mm, from their shares (n,)."""
        if len(shares) < 2:
            return cls(shares)
        of_nodes = np.array(list(shares.values()))
        mixed = np.flatnonzero(of_nodes.max(axis=0) < 1 - PURE)
        near = {}
        for name, share in shares.items():
            pure = np.flatnonzero(share >= 1 - PURE)
            if len(pure):
                distance = np.linalg.norm(x[mixed][:, None] - x[pure], axis=2)
                nearest = distance <= (1 + SAME) * distance.min(axis=1, initial=np.inf)[:, None]
                row, column = np.nonzero(nearest)
                values = 1 / nearest.sum(axis=1)[row]
            else:  # it has the pressures of the nodes themselves
                row, column, values = np.arange(len(mixed)), np.arange(len(mixed)), np.ones(len(mixed))
                pure = mixed
            near[name] = csr_array((values, (row, pure[column])), shape=(len(mixed), len(x)))
        return cls(shares, mixed, near)

    def split(self, coefficient: object) -> bool:
        """Return whether nodes lie in several regions that differ in a coefficient: it then depends on the pressure."""
        return isinstance(coefficient, Dependence) and coefficient.unlike and len(self.mixed) > 0

    @property
    def variables(self) -> dict[str, Any]:
        """The variables of coefficients: shares and the regions themselves."""
        return {"regions": self, **{f"region {name}": share for name, share in self.shares.items()}}

    def effects(self, pressure: Array, effect: Callable[[Array], Array]) -> dict[str, Array]:
        """Return the effect of the pressures of the nodes' parts over that of the nodes (n,), by region.

        Args:
            pressure: Of the nodes (n,), MPa.
            effect: The function of the pressure that coefficients multiply.
        """
        if not len(self.mixed):
            return {}
        pressure = np.maximum(pressure, 0.0)
        here = np.maximum(pressure[self.mixed], FAINT * max(float(pressure.max()), 1e-300))
        sides = {name: near @ pressure for name, near in self.near.items()}
        mean = np.sum([self.shares[name][self.mixed] * side for name, side in sides.items()], axis=0)
        whole, found = effect(here), {}
        known = (mean > 0) & (whole > 0)
        for name, side in sides.items():
            of_part = effect(here * np.divide(side, mean, out=np.ones_like(side), where=mean > 0))
            found[name] = np.ones_like(pressure)
            found[name][self.mixed] = np.divide(of_part, whole, out=np.ones_like(whole), where=known)
        return found


def regions_opposite(
    shares: tuple[Mapping[str, Array], Mapping[str, Array]], pair: ContactPair
) -> tuple[Regions, Regions]:
    """Return the regions of punch and strip at the contact nodes, from their shares in each body's own nodes."""
    of_punch, of_strip = shares
    at_contact = {name: pair.wear_interpolation @ share for name, share in of_strip.items()}
    return Regions.at(of_punch, pair.punch.x), Regions.at(at_contact, pair.punch.x)


def any_split(regions: tuple[Regions, Regions], wear: tuple[WearLaw, WearLaw]) -> bool:
    """Return whether nodes between regions share their pressure among unlike coefficients of wear."""
    both = zip(regions, wear, strict=True)
    return any(own.split(law.given_coefficient) for own, law in both)
