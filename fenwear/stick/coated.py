"""The coatings of both bodies in partial slip: what of them and of their bases is worn, and how jumps count depths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fenwear.arrays import Array
from fenwear.sliding.coating import CoatedBody, Shares, left_of, shares
from fenwear.sliding.wear import WornDepths

BothShares = tuple[Shares | None, Shares | None]  # of punch and strip; None for a body without coating
PerLayer = tuple[tuple[Array, Array], tuple[Array, Array]]  # of punch and strip, of coating and base each


@dataclass(frozen=True)
class CoatedBodies:
    """The coatings of punch and strip; None for a body without."""

    punch: CoatedBody | None = None
    strip: CoatedBody | None = None

    @property
    def none(self) -> bool:
        """Whether neither body is coated."""
        return self.punch is None and self.strip is None

    @property
    def _named(self) -> tuple[tuple[str, CoatedBody | None], tuple[str, CoatedBody | None]]:
        return ("punch", self.punch), ("strip", self.strip)

    def parts(self, before: WornDepths, more: WornDepths | None = None, bases: WornDepths | None = None) -> BothShares:
        """Return what of coatings and bases is worn at the nodes of punch and strip; None for a body without coating.

        Args:
            before: Depths where it begins.
            more, bases: What would be worn of coatings that go on, and of bases; by default so little that no coating
                ends.
        """
        found: list[Shares | None] = []
        for name, coated in self._named:
            if coated is None:
                found.append(None)
                continue
            left = left_of(coated.thickness, getattr(before, name))
            of_coating, of_base = (
                np.zeros_like(left) if one is None else np.asarray(getattr(one, name)) for one in (more, bases)
            )
            found.append(shares(of_coating, of_base, left))
        return found[0], found[1]

    def by(self, worn: WornDepths, bases: WornDepths) -> CoatedBodies:
        """Return the same by the ratio of what would be worn of bases and of coatings, where something is."""
        found = [
            None if coated is None else coated.by(getattr(worn, name), getattr(bases, name))
            for name, coated in self._named
        ]
        return CoatedBodies(found[0], found[1])

    def measured_rate(self, rate: WornDepths, bases: WornDepths, worn: WornDepths) -> WornDepths:
        """Return rates of depths as those of `measured`, where these depths are worn.

        Args:
            rate, bases: Of coatings that go on, and of bases.
            worn: Depths.
        """
        found = {
            name: coated.measured_rate(getattr(worn, name), getattr(rate, name), getattr(bases, name))
            for name, coated in self._named
            if coated is not None
        }
        return replace(rate, **found)

    def measured(self, worn: WornDepths) -> WornDepths:
        """Return depths as what coatings would have lost if they went on: it grows evenly through their end."""
        own = ((name, coated) for name, coated in self._named if coated is not None)
        return replace(worn, **{name: coated.measure(getattr(worn, name)) for name, coated in own})

    def depths(self, measured: WornDepths) -> WornDepths:
        """Return the depths that `measured` made these of."""
        own = ((name, coated) for name, coated in self._named if coated is not None)
        return replace(measured, **{name: coated.depth(getattr(measured, name)) for name, coated in own})

    def slopes(self, worn: WornDepths) -> tuple[Array, Array]:
        """Return the derivative of depths to what coatings would have lost, at the nodes of punch and strip."""
        punch, strip = self.punch, self.strip
        return (
            np.ones_like(worn.punch) if punch is None else punch.slope(worn.punch),
            np.ones_like(worn.strip) if strip is None else strip.slope(worn.strip),
        )

    def layers_of_wear(self, worn: WornDepths) -> tuple[PerLayer, PerLayer]:
        """Return for punch and strip what of coating and base wears at their nodes, and over what `measured` counts it.

        Args:
            worn: Depths.
        """
        there: list[tuple[Array, Array]] = []
        counted: list[tuple[Array, Array]] = []
        for name, coated in self._named:
            depth = getattr(worn, name)
            lies = np.zeros(len(depth)) if coated is None else np.where(depth < coated.thickness, 1.0, 0.0)
            there.append((lies, 1 - lies))
            by_ratio = 1 - lies if coated is None else coated.measured_rate(depth, np.zeros_like(lies), 1 - lies)
            counted.append((lies, by_ratio))
        return (there[0], there[1]), (counted[0], counted[1])

    def ends_between(self, before: WornDepths, after: WornDepths) -> bool:
        """Return whether a coating ends somewhere between these depths."""
        return any(
            coated is not None
            and bool(((getattr(before, name) < coated.thickness) & (getattr(after, name) >= coated.thickness)).any())
            for name, coated in self._named
        )


NOT_COATED = CoatedBodies()
