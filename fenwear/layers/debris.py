"""The third body: debris that stays between the surfaces at the place where it was worn, until it is ejected.

With the depth w worn off both bodies, the thickness t of what lies at a place follows its sliding distance s:

    dt/ds = share dw/ds - t / life,        gap = geometry + w - t

(M. Godet, Wear 100, 1984, 437, for the flows; J. Ding et al., Wear 263, 2007, 481, and P. Arnaud and S. Fouvry, Wear
412-413, 2018, 92, for layers that act by their thickness). Over a phase of the motion, in which a node slides by d and
wears W at a constant rate, that is exactly

    t -> e t + share W (1 - e) / x,        x = d / life,   e = exp(-x),

and one phase after the other makes a cycle t -> E t + G, linear in t. At a constant G that is the solution after whole
cycles n of dt/dn = X (G / (1 - E) - t), X = -ln E, so that jumps take this as its rate. What is ejected in a march is
metered by its own integral: there worn = stored + ejected is a check.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array


@dataclass(frozen=True)
class Debris:
    """The law of the third body at the nodes.

    Attributes:
        share: Of what is worn, that stays.
        life: Sliding distance over which 1 - 1/e is lost (n,), mm.
        initial: Thickness at the start, mm.
    """

    share: float
    life: Array
    initial: float = 0.0

    def over(self, slid: Array) -> DebrisCycle:
        """Return what a cycle does whose phases, one after the other, slide by these distances (m, n), mm."""
        x = slid / self.life
        kept = np.divide(-np.expm1(-x), x, out=np.ones_like(x), where=x > 0)
        after = np.cumsum(np.vstack([x[1:], np.zeros_like(x[:1])])[::-1], axis=0)[::-1]
        return DebrisCycle(self.share, kept * np.exp(-after), x.sum(axis=0))


@dataclass(frozen=True)
class DebrisCycle:
    """A cycle of m phases at n nodes.

    Attributes:
        share: Of what is worn, that stays.
        kept: Of what stays in each phase, what is left at the end of the cycle (m, n).
        loss: X, the sliding distance over the life (n,).
    """

    share: float
    kept: Array
    loss: Array

    def change(self, thickness: Array, worn: Array) -> tuple[Array, Array]:
        """Return what one cycle adds to the thickness and what it ejects (n,) each, mm.

        Args:
            thickness: At its start (n,), mm.
            worn: Depth worn off both bodies in each phase (m, n), mm.
        """
        lost = -np.expm1(-self.loss) * thickness
        stays = self.share * self.kept
        return (stays * worn).sum(axis=0) - lost, ((1 - stays) * worn).sum(axis=0) + lost

    def rate(self, thickness: Array, worn: Array, cycles: float) -> tuple[Array, Array]:
        """Return the same for each cycle of an implicit step of so many; with none its rate at the start."""
        fed = (self.fed * worn).sum(axis=0)
        added = (fed - self.loss * thickness) / (1 + cycles * self.loss)
        return added, worn.sum(axis=0) - added

    def slope(self, cycles: float | None) -> Array:
        """Return how much thicker a step ends by what its phases wear in a cycle (m, n); None for one cycle."""
        return self.share * self.kept if cycles is None else cycles * self.fed / (1 + cycles * self.loss)

    @property
    def fed(self) -> Array:
        """X G / (1 - E) of a unit worn in each phase (m, n)."""
        lost = -np.expm1(-self.loss)
        return self.share * self.kept * np.divide(self.loss, lost, out=np.ones_like(lost), where=lost > 0)
