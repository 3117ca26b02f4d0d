"""The track of a counter-body: its border, and wear that spreads along all of a closed track.

The track is made of rings: circles about the axis of a rotation, or lines along a translation, identified by a
coordinate s across them. The ring between s and s + ds has an area, 2 pi r dr on a flat disc. The wear of a node on its
area w_i goes to the rings that this area crosses, by shares, and all along each of them:

    depth of ring k = sum over i of (share of node i's area in ring k) w_i d_i / area of ring k.

A node of the counter-body takes the mean of the rings that its own area crosses; the track ends where the contact
does, see `Border`. The volume of all rings is the volume worn, and no entry is negative. In the plane there is one.

Surfaces that turn beside each other without ever coming to the same place, as the two faces of a disc, are tracks
of their own: parts of the strip's surface share one where they lie at the same height, measured square to s.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask
from fenwear.surfaces.overlap import ChartedSurface, Indices, node_triangles
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.placement import ZERO, Placement, in_space
from fenwear.surfaces.sliding_field import SlidingField

RINGS = 2000  # at most
FINER = 2  # rings over the width of a node's area
WHOLE = 0.9  # of a node's area, beyond which it counts as swept
LEAST_SWEPT = 1e-9  # of a node's area: less is rounding of the place where a surface ends
THIN = 1e-12  # of a surface's width across the track
SAME = 1e-6  # of a surface's extent: heights that are one
LEVEL = 0.7  # cosine between a surface and the plane of rotation, above which s is the radius


@dataclass(frozen=True)
class Border:
    """The border of what the punch sweeps of the strip, where its depth ends upright: sides and ends of a track.

    It runs through the areas of nodes: such an area is worn on the part of it that is swept, and as deep as beside it;
    spread over the whole of it, the depth at the border would be the half, and what a punch feels there, too. Beyond it
    the punch reads the depth inside: shape functions overshoot at a step.

    Attributes:
        share: Of each strip node's area that is swept (n_strip,), 1 where nothing of it is.
        inward: Node whose depth stands for each one's (n_strip,): its own, but beyond the border the nearest inside's.
    """

    share: Array
    inward: Indices

    @classmethod
    def of_swept(cls, pairs: Sequence[ContactPair]) -> Border:
        """Find it of a strip that goes to and fro, or as a table says: of each area what is covered once, at most.

        Args:
            pairs: The surfaces opposite each other in all phases.
        """
        strip = pairs[0].strip
        if strip.grid is not None:  # which ends beside the contact
            return cls(np.ones(len(strip.weights)), np.arange(len(strip.weights)))
        covered = np.max([pair.wear_projection.sum(axis=1) for pair in pairs], axis=0)
        # Areas of curved surfaces opposite each other are not the same to the last percent.
        return cls._of(np.where(covered > WHOLE, 1.0, covered), strip)

    @classmethod
    def of_rings(cls, pair: ContactPair, field: SlidingField) -> Border:
        """Find it of a closed track: the sides of its rings.

        Args:
            pair: The surfaces opposite each other.
            field: The motion of the strip.
        """
        share = np.zeros(len(pair.strip.weights))
        if pair.strip.dim == 2:
            return cls(np.ones(len(share)), np.arange(len(share)))
        across = _across(field, pair.strip)
        punch, strip = (_Crossing.of(surface, across) for surface in (pair.punch, pair.strip))
        for on_strip, on_punch in _facing(pair, field):
            edges = punch.of_nodes(on_punch).reach()
            share += strip.of_nodes(on_strip).shares(edges)[:, ::2].sum(axis=1)
        return cls._of(np.minimum(share, 1.0), pair.strip)

    @classmethod
    def _of(cls, share: Array, strip: ContactSurface) -> Border:
        inward, swept, part = np.arange(len(share)), share > LEAST_SWEPT, strip.part
        for k in range(part.max() + 1):
            inside, beyond = (np.flatnonzero((part == k) & mask) for mask in (swept, ~swept))
            if len(inside) and len(beyond):
                inward[beyond] = inside[cKDTree(strip.x[inside]).query(strip.x[beyond])[1]]
        return cls(np.where(swept, share, 1.0), inward)

    @property
    def none(self) -> bool:
        """Whether all of the strip's surface is swept."""
        return bool((self.share == 1).all() and (self.inward == np.arange(len(self.inward))).all())

    def on_all(self, pairs: Mapping[Placement, ContactPair]) -> dict[Placement, ContactPair]:
        """Return pairs of the same surfaces whose strip is worn, and felt, where it is swept."""
        strip = self.on_strip(next(iter(pairs.values())).strip)
        return {place: self.on(pair, strip) for place, pair in pairs.items()}

    def on_strip(self, strip: ContactSurface) -> ContactSurface:
        """Return the strip's surface whose nodes stand for the swept parts of their areas."""
        if self.none:
            return strip
        return replace(strip, weights=self.share * strip.weights)

    def on(self, pair: ContactPair, strip: ContactSurface) -> ContactPair:
        """Return a pair of that surface of the strip, from one of the whole of it."""
        if self.none:
            return pair
        count = len(self.inward)
        read = csr_array((np.ones(count), (np.arange(count), self.inward)), shape=(count, count))
        return replace(
            pair,
            strip=strip,
            wear_interpolation=csr_array(pair.wear_interpolation @ read),
            wear_projection=csr_array(diags_array(1 / self.share) @ pair.wear_projection),
        )


def on_closed_track(pair: ContactPair, field: SlidingField, track: float) -> ContactPair:
    """Return the pair whose wear_projection spreads the strip's wear along a closed track.

    Args:
        pair: The surfaces opposite each other.
        field: The motion of the strip for a unit of the stroke.
        track: Closure of the track: its length, mm, or 2 pi rad.
    """
    length, projection = track * field.rate(pair.strip.x, pair.strip.outward), csr_array(pair.wear_projection.shape)
    spread = _along_one if pair.punch.dim == 2 else _along_rings
    for on_strip, on_punch in _facing(pair, field):
        projection = csr_array(projection + spread(pair, field, length, on_strip, on_punch))
    return replace(pair, wear_projection=projection)


def _facing(pair: ContactPair, field: SlidingField) -> Iterator[tuple[Mask, Mask]]:
    """Return the nodes of the strip on each of its tracks, and the punch's nodes opposite."""
    numbers = _tracks(pair.strip, field)
    tracks = range(numbers.max() + 1)
    opposite = np.array([pair.wear_projection[numbers == k].sum(axis=0) for k in tracks]).argmax(axis=0)
    for k in tracks:
        yield numbers == k, opposite == k


def _tracks(strip: ContactSurface, field: SlidingField) -> Indices:
    """Return which track each node of a strip's surface is on (n,): parts at the same height share one."""
    x = in_space(strip.x)
    if field.turn == ZERO:
        height = strip.x[:, -1] if strip.dim == 2 else x @ _mean_normal(strip)
    else:
        axis, arm = np.array(field.turn), x - field.centre
        along = arm @ axis
        around = np.linalg.norm(arm - along[:, None] * axis, axis=1)
        height = along if strip.dim == 3 and _is_flat(strip, axis) else around
    parts = strip.part
    spans = np.array([(height[parts == k].min(), height[parts == k].max()) for k in range(parts.max() + 1)])
    slack, track, reached = SAME * strip.extent(), np.zeros(len(spans), dtype=np.int64), np.inf
    number = -1
    for k in spans[:, 0].argsort():
        low, high = spans[k]
        if number < 0 or low > reached + slack:
            number, reached = number + 1, high
        track[k], reached = number, max(reached, high)
    return np.asarray(track[parts])


def _along_one(pair: ContactPair, _field: SlidingField, length: Array, on_strip: Mask, on_punch: Mask) -> csr_array:
    """Return the wear_projection of a track in the plane, which is one ring of this length (n_strip,), mm."""
    spread: Array = np.outer(on_strip, pair.weights * on_punch / length[on_strip].mean())
    return csr_array(spread)


def _along_rings(pair: ContactPair, field: SlidingField, length: Array, on_strip: Mask, on_punch: Mask) -> csr_array:
    """Return the wear_projection of a track of a solid, whose rings are so long at the strip's nodes (n_strip,), mm."""
    across = _across(field, pair.strip)
    punch, strip = _Crossing.of(pair.punch, across).of_nodes(on_punch), _Crossing.of(pair.strip, across)
    strip = strip.of_nodes(on_strip)
    count = int(np.clip(np.ceil(FINER * punch.span / punch.width), 1, RINGS))
    edges = np.linspace(punch.low.min(), punch.high.max(), count + 1)
    # A ring's area: as long as the motion is there, and as wide as the surface goes while s goes on by one.
    s, broad = across(pair.strip.x)[on_strip], (length / across.advance(pair.strip))[on_strip]
    order = np.argsort(s)
    along = np.interp(edges, s[order], broad[order])
    areas = np.diff(edges) * (along[1:] + along[:-1]) / 2
    depths = diags_array(1 / areas) @ punch.shares(edges).T @ diags_array(pair.weights)
    return csr_array(strip.shares(edges) @ depths)


@dataclass(frozen=True)
class _Across:
    """The coordinate s across the track: the radius from an axis, or the distance along a direction.

    Attributes:
        origin: A point (3,), mm.
        direction: Unit vector, the axis or the direction (3,).
        radial: Which of the two.
    """

    origin: Array
    direction: Array
    radial: bool

    def __call__(self, x: Array) -> Array:
        """Return s of points (..., 3), mm."""
        arm = x - self.origin
        along = arm @ self.direction
        if not self.radial:
            return np.asarray(along)
        return np.linalg.norm(arm - along[..., None] * self.direction, axis=-1)

    def advance(self, surface: ContactSurface) -> Array:
        """Return by how much s changes along a surface across the track, at its pressure nodes (n,)."""
        normal = surface.outward @ self.direction
        return np.abs(normal) if self.radial else np.sqrt(1 - np.minimum(normal**2, 1.0))


def _across(field: SlidingField, strip: ContactSurface) -> _Across:
    if field.turn != ZERO:
        axis = np.array(field.turn)
        return _Across(np.array(field.centre), axis, _is_flat(strip, axis))
    side = np.cross(_mean_normal(strip), field.shift)
    return _Across(np.zeros(3), side / np.linalg.norm(side), radial=False)


def _mean_normal(strip: ContactSurface) -> Array:
    normal = strip.weights @ strip.outward
    return np.asarray(normal / np.linalg.norm(normal))


def _is_flat(strip: ContactSurface, axis: Array) -> bool:
    """Return whether a surface is more of a disc about an axis than a shaft, by its mean over all it looks to."""
    return bool(strip.weights @ np.abs(strip.outward @ axis) > LEVEL * strip.weights.sum())


@dataclass(frozen=True)
class _Crossing:
    """The areas of a surface's pressure nodes across the track, in triangles.

    Attributes:
        s: Of the triangles' corners (m, 3), ascending, mm.
        size: Share of each in the area of its node (m,).
        node: That node (m,).
        nodes: Number of nodes.
    """

    s: Array
    size: Array
    node: Indices
    nodes: int

    @classmethod
    def of(cls, surface: ContactSurface, across: _Across) -> _Crossing:
        """Take the areas of a surface's nodes."""
        charted = ChartedSurface(surface.trace, surface.facets, surface.cell, surface.degree, surface.nodes)
        triangles, node = node_triangles(charted)
        edges = triangles[:, 1:] - triangles[:, :1]
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        nodes = len(surface.nodes)
        s = np.sort(across(triangles), axis=1)
        s[:, [0, 2]] += THIN * np.ptp(s) * np.array([-1, 1])  # none lies on one ring's edge as a whole
        return cls(s, area / np.bincount(node, area, nodes)[node], node, nodes)

    def of_nodes(self, nodes: Mask) -> _Crossing:
        """Return the areas of some of the nodes (n,) alone, the others having none."""
        chosen = nodes[self.node]
        return _Crossing(self.s[chosen], self.size[chosen], self.node[chosen], self.nodes)

    @property
    def low(self) -> Array:
        """Least s of each triangle (m,), mm."""
        return np.asarray(self.s[:, 0])

    @property
    def high(self) -> Array:
        """Largest s of each triangle (m,), mm."""
        return np.asarray(self.s[:, 2])

    def reach(self) -> Array:
        """Return the begin and the end of each stretch of the areas (2 k,), ascending, mm; stretches do not meet."""
        order = np.argsort(self.low)
        low, high = self.low[order], np.maximum.accumulate(self.high[order])
        apart = np.flatnonzero(low[1:] > high[:-1])
        begin, end = np.append(0, apart + 1), np.append(apart, len(low) - 1)
        return np.asarray(np.stack([low[begin], high[end]], axis=1).ravel())

    @property
    def span(self) -> float:
        """Width of the whole surface across the track, mm."""
        return float(self.high.max() - self.low.min())

    @property
    def width(self) -> float:
        """Width of a node's part in the middle of all, mm."""
        return float(np.median(self.high - self.low))

    def shares(self, edges: Array) -> csr_array:
        """Return the share of each node's area in each ring (n, rings), s being linear in each triangle.

        Args:
            edges: Of the rings (rings + 1,), ascending, mm.
        """
        rings = len(edges) - 1
        first = np.clip(np.searchsorted(edges, self.low, side="right") - 1, 0, rings - 1)
        last = np.clip(np.searchsorted(edges, self.high, side="left"), first + 1, rings)
        count = last - first
        triangle = np.repeat(np.arange(len(count)), count)
        ring = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count - first, count)
        below, above = (_part_below(self.s[triangle], edges[ring + k]) for k in (0, 1))
        share = (above - below) * self.size[triangle]
        crosses = share > 0
        return csr_array((share[crosses], (self.node[triangle][crosses], ring[crosses])), shape=(self.nodes, rings))


def _part_below(s: Array, edge: Array) -> Array:
    """Return the part of triangles that lies below s = edge (m,), s linear between its corners' (m, 3), ascending."""
    low, middle, high = s.T
    at = np.clip(edge, low, high)
    rising = (at - low) ** 2 / ((high - low) * np.maximum(middle - low, 1e-300))
    falling = 1 - (high - at) ** 2 / ((high - low) * np.maximum(high - middle, 1e-300))
    return np.where(at < middle, rising, falling)
