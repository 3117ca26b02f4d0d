"""The third body: debris that stays between the surfaces at its place until it is ejected.

With the depth w worn off both bodies, the thickness t of what lies at a place follows its sliding distance s:

    dt/ds = share dw/ds - q t,        gap = geometry + w - t

with q = 1 / life, and at the distance d from an edge of the contact exp(-d / edge_length) / edge_life more: debris
leaves there. Where q changes with the state of a place, or with t itself, it is that of each phase: of the pressure in
it and of the thickness at its start; in the implicit step of jumps and in the steady state of the thickness there.

(M. Godet, Wear 100, 1984, 437, for the flows; J. Ding et al., Wear 263, 2007, 481, and P. Arnaud and S. Fouvry, Wear
412-413, 2018, 92, for layers that act by their thickness). Over a phase of the motion, in which a node slides by d and
wears W at a constant rate, that is exactly

    t -> e t + share W (1 - e) / x,        x = d q,   e = exp(-x),

and one phase after the other makes a cycle t -> E t + G, linear in t. At a constant G that is the solution after whole
cycles n of dt/dn = X (G / (1 - E) - t), X = -ln E, so that jumps take this as its rate. The debris ejected in a march
has its own integral: there worn = stored + ejected is a check.

Debris that the strip carries lies on its material: a place of it loses and gets in a phase what is its share of the
contact then, as of wear, and takes it along. There it is the same cycle, of the strip's nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fenwear.case import Dependence
from fenwear.common.arrays import Array
from fenwear.laws.friction import ContactConditions

LIFE, LEAST = "contact.third_body.life", 1e-300


@dataclass(frozen=True)
class DebrisCycle:
    """A cycle of m phases at n nodes.

    Attributes:
        share: Of what is worn, that stays.
        kept: Of what stays in each phase, what is left at the end of the cycle (m, n).
        loss: X, the sum of x over the phases (n,).
        lost: 1 - E, of what was there at the start of the cycle (n,).
    """

    share: float
    kept: Array
    loss: Array
    lost: Array

    def change(self, thickness: Array, worn: Array) -> tuple[Array, Array]:
        """Return the change of the thickness in a cycle, and the ejected debris (n,) each, mm.

        Args:
            thickness: At its start (n,), mm.
            worn: Depth worn off both bodies in each phase (m, n), mm.
        """
        lost = self.lost * thickness
        return (self._stays * worn).sum(axis=0) - lost, (self._leaves * worn).sum(axis=0) + lost

    def rate(self, thickness: Array, worn: Array, cycles: float) -> tuple[Array, Array]:
        """Return thickness added and depth ejected (n,) in each cycle of an implicit step; of 0 cycles at its start."""
        fed = (self.fed * worn).sum(axis=0)
        added = (fed - self.loss * thickness) / (1 + cycles * self.loss)
        return added, worn.sum(axis=0) - added

    def slope(self, cycles: float | None) -> Array:
        """Return the thickness added by a unit of wear in each phase of a cycle (m, n); None for one cycle."""
        return self.share * self.kept if cycles is None else cycles * self.fed / (1 + cycles * self.loss)

    def by_loss(self, thickness: Array, worn: Array) -> Array:
        """Return the derivative of `change` to x in a cycle of one phase (n,), mm; arguments as of `change`."""
        left = np.exp(-self.loss)
        return np.asarray(self.share * worn[0] * (left - self.kept[0]) / self.loss - left * thickness)

    @cached_property
    def _stays(self) -> Array:
        """Share at the end of a unit worn in each phase (m, n)."""
        return self.share * self.kept

    @cached_property
    def _leaves(self) -> Array:
        """Debris ejected by then."""
        return 1 - self._stays

    @cached_property
    def fed(self) -> Array:
        """X G / (1 - E) of a unit worn in each phase (m, n)."""
        lost = self.lost
        return self._stays * np.divide(self.loss, lost, out=np.ones_like(lost), where=lost > 0)


NO_CYCLE = DebrisCycle(0.0, *np.zeros((3, 1)))


@dataclass(frozen=True)
class Debris:
    """The law of the third body at the nodes.

    Attributes:
        share: Of what is worn, that stays.
        life: Sliding distance over which 1 - 1/e is lost (n,), mm; or what it depends on.
        initial: Thickness at the start, mm.
        edge_life, edge_length: Life at an edge of the contact besides, and over which distance it grows, mm.
        present: Whether there is a third body.
    """

    share: float
    life: Array | Dependence
    initial: float = 0.0
    edge_life: float = np.inf
    edge_length: float = 1.0
    present: bool = True

    @property
    def varies(self) -> bool:
        """Whether the loss changes with more than the place."""
        return isinstance(self.life, Dependence) or self.edge_life < np.inf

    def lost(self, conditions: ContactConditions) -> Array:
        """Return the share of the debris that is lost over the sliding distance (n,), 1/mm.

        Raises:
            CaseError: a life is not positive.
        """
        life, shape = self.life, conditions.shape
        if isinstance(life, Dependence):
            life = life.values(conditions.of("punch"), shape, life.scale("mm"), LIFE, LEAST)
        loss = 1 / life
        if self.edge_life < np.inf and conditions.edge is not None:
            loss = loss + np.exp(-conditions.edge / self.edge_length) / self.edge_life
        return loss if loss.shape == shape else np.broadcast_to(loss, shape)

    def over(
        self, slid: Array, conditions: Sequence[ContactConditions] = (), onto: Sequence[csr_array] = ()
    ) -> DebrisCycle:
        """Return the debris of a cycle whose phases, one after the other, slide by these distances (m, n), mm.

        Args:
            slid: The distances.
            conditions: Of the phases, for a loss that changes with them.
            onto: Weights that put it on the material of the body that carries it in each phase, as wear; none
                where it lies at the contact's nodes.
        """
        if not self.present:
            return NO_CYCLE
        x: Array
        if isinstance(self.life, Dependence) or self.edge_life < np.inf:
            x = slid * np.array([self.lost(phase_conditions) for phase_conditions in conditions])
        else:
            x = slid / self.life
        if onto:
            x = np.array([place @ row for place, row in zip(onto, x, strict=True)])
        x = np.maximum(x, LEAST)  # where nothing slides all is kept
        kept = -np.expm1(-x) / x
        after = np.cumsum(np.vstack([x[1:], np.zeros_like(x[:1])])[::-1], axis=0)[::-1]
        loss = x.sum(axis=0)
        return DebrisCycle(self.share, kept * np.exp(-after), loss, -np.expm1(-loss))


NO_DEBRIS = Debris(0.0, np.array(np.inf), present=False)
