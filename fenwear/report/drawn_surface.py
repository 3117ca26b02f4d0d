"""Contact surfaces read back from history.nc: triangles to draw on, cuts of solids, places and gaps along curves.

A history of a contact whose parts lie apart has the part of each node (`part`, `part_strip`). Parts of rings follow
from their radii: both sides of a groove begin at the same one. No line is drawn over the gap between two parts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import LinearTriInterpolator, Triangulation
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from fenwear.common.arrays import Array, Mask
from fenwear.report.style import ALONG_CONTACT
from fenwear.results.quantity import BODIES

POINTS = 301  # along a cut
TICKS = 2  # intervals between those of each of several parts on a map
CLOSE = 0.1  # of a map: ticks of two parts whose texts would run into each other
BESIDE = 1.1  # of the parts' size: how far apart they are laid
AXES = ("x", "y", "z")
EDGEWISE = 0.3  # of a surface's area: what is seen of it along an axis, less of what is seen edge-on
OVER = 1.1  # of the area around it: more of what is seen lies over itself
ASIDE = 0.12  # of the way along an unrolled part: where its name stands, beside what touches
HALF = 0.5  # of the way around: longer facets go over the cut
ARROWS = "→↗↑↖←↙↓↘"
NEAR = 1e-9  # of the contact's length: places are the same
BACK = 0.5  # of it: where radii begin anew


def model_of(history: xarray.Dataset) -> str:
    """Return "plane", "axisymmetric" or "solid"."""
    return str(history.attrs.get("model", "plane"))


@dataclass(frozen=True)
class Surface:
    """The contact surface of a body of a solid model, n nodes.

    Attributes:
        body: "punch" or "strip".
        x: Coordinates (n, 3), mm.
        cells: Nodes around each part of the surface (f, 3 or 4).
        sliding: Places along and across the sliding (n, 2), mm.
        seen: The two axes that are left when it is seen along its normal.
        contact: Name of the contact that each node belongs to (n,); empty where contacts have no names.

    Parts that would lie over each other, as both faces of a disc, are laid beside each other on maps; what would lie
    over itself, as a bore, is unrolled along the sliding.
    """

    body: str
    x: Array
    cells: NDArray[np.int64]
    sliding: Array
    seen: tuple[int, int]
    contact: NDArray[np.str_] = field(default_factory=lambda: np.array([], dtype=str))

    @cached_property
    def part(self) -> NDArray[np.int64]:
        """Number of the connected part that each node belongs to (n,)."""
        first, n = np.repeat(self.cells[:, 0], self.cells.shape[1]), len(self.x)
        graph = csr_array((np.ones(self.cells.size), (first, self.cells.ravel())), shape=(n, n))
        return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)

    @cached_property
    def unrolled(self) -> bool:
        """Whether a part of it would lie over itself where it is seen along one axis."""
        return any(self._folds(self.triangles[self.part[self.triangles[:, 0]] == k]) for k in np.unique(self.part))

    def _folds(self, triangles: NDArray[np.int64]) -> bool:
        """Return whether triangles (t, 3) cover more than what is around them, or little of themselves, as seen."""
        from scipy.spatial import ConvexHull, QhullError

        sides = self.x[triangles[:, 1:]] - self.x[triangles[:, :1]]
        areas = np.cross(sides[:, 0], sides[:, 1])
        seen = np.abs(areas[:, 3 - sum(self.seen)]).sum()
        if seen < EDGEWISE * np.linalg.norm(areas, axis=1).sum():
            return True
        try:
            around = 2 * ConvexHull(self.x[np.unique(triangles)][:, list(self.seen)]).volume
        except QhullError:
            return True
        return bool(seen > OVER * around)

    @cached_property
    def _flat(self) -> Array:
        """Coordinates of its nodes as seen, or unrolled (n, 2), mm."""
        return self.sliding if self.unrolled else self.x[:, list(self.seen)]

    @cached_property
    def overlaps(self) -> bool:
        """Whether two of its parts would lie over each other on a map."""
        seen = self._flat
        boxes = [
            (seen[self.part == k].min(axis=0), seen[self.part == k].max(axis=0)) for k in range(self.part.max() + 1)
        ]
        return any(
            (np.minimum(box[1], other[1]) > np.maximum(box[0], other[0])).all() for box, other in combinations(boxes, 2)
        )

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """Nodes of triangles (t, 3)."""
        return np.concatenate([self.cells[:, [0, k, k + 1]] for k in range(1, self.cells.shape[1] - 1)])

    @cached_property
    def map(self) -> Array:
        """Coordinates on a map (n, 2), mm."""
        seen = self._flat.copy()
        if self.overlaps:
            seen[:, self._beside] += self._apart * self.part
        return seen

    @property
    def _apart(self) -> float:
        """Distance of parts, mm."""
        return BESIDE * float(np.ptp(self._flat[:, self._beside]))

    @cached_property
    def _beside(self) -> int:
        """The axis of the map along which parts are laid beside each other: the shorter one."""
        return int(np.ptp(self._flat, axis=0).argmin())

    @property
    def axis_labels(self) -> tuple[str, str]:
        """Names of the map's axes."""
        axes = ("along the sliding", "across it") if self.unrolled else [AXES[axis] for axis in self.seen]
        return f"{axes[0]} (mm)", f"{axes[1]} (mm)"

    def set_ticks(self, ax: Axes) -> None:
        """Label the axes of a map with the places of parts that are laid beside each other."""
        if not self.overlaps:
            return
        places, texts = list[float](), list[str]()
        width = float(np.ptp(self.map[:, self._beside]))
        for k in range(self.part.max() + 1):
            beside = self._flat[self.part == k, self._beside]
            values = MaxNLocator(TICKS).tick_values(beside.min(), beside.max())
            values = values[(values >= beside.min()) & (values <= beside.max())]
            if len(values) > 1 and values[0] + self._apart - values[-1] < CLOSE * width:
                values = values[1:]  # its text would run into the last one of the part before
            places += [float(value + k * self._apart) for value in values]
            texts += [f"{value:g}" for value in values]
        (ax.xaxis, ax.yaxis)[self._beside].set_ticks(places, labels=texts)

    @cached_property
    def labels(self) -> list[tuple[str, Array]]:
        """Names of contacts and where they stand on the map (2,), mm: in the middle of their parts; unrolled aside."""
        placed = []
        for name in np.unique(self.contact):
            places = self.map[self.contact == name]
            at = places.mean(axis=0)
            if self.unrolled:
                at[0] = places[:, 0].min() + ASIDE * np.ptp(places[:, 0])
            placed.append((name, at))
        return placed

    @cached_property
    def border(self) -> Array:
        """Segments around the map (m, 2, 2), mm."""
        points, _, cells = self._closed
        edges = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
        single, counts = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
        return np.asarray(points[single[counts == 1]])

    def _across_the_cut(self, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which of some facets or edges (f, k) go over the line at which an unrolled surface is cut (f,)."""
        along = self.sliding[:, 0]
        return np.asarray(self.unrolled & (np.ptp(along[nodes], axis=1) > HALF * np.ptp(along)))

    @cached_property
    def _closed(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
        """Points of the map, the node that each is, and the points of each cell.

        Where the surface was cut to be unrolled the nodes after the cut stand once more at its far end.
        """
        across = self._across_the_cut(self.cells)
        every = np.arange(len(self.x))
        if not across.any():
            return self.map, every, self.cells
        cells, along = self.cells.copy(), self.sliding[:, 0]
        middle = (along.min() + along.max()) / 2
        behind = across[:, None] & (along[self.cells] < middle)
        again = np.unique(self.cells[behind])
        cells[behind] = len(every) + np.searchsorted(again, self.cells[behind])
        # Once around is the way between both ends of such a cell on the map, and that in space along the sliding.
        ends = np.take_along_axis(self.cells[across], np.stack([along[self.cells[across]].argmax(axis=1),
                                  along[self.cells[across]].argmin(axis=1)], axis=1), axis=1)  # fmt: skip
        apart = self.x[ends[:, 0]] - self.x[ends[:, 1]]
        beside = self.sliding[ends[:, 0], 1] - self.sliding[ends[:, 1], 1]
        ways = np.sqrt(np.maximum((apart**2).sum(axis=1) - beside**2, 0.0))
        around = np.median(along[ends[:, 0]] - along[ends[:, 1]] + ways)
        return np.vstack([self.map, self.map[again] + np.array([around, 0.0])]), np.append(every, again), cells

    def contours(self, ax: Axes, values: Array, *, filled: bool = True, **how: Any) -> Any:
        """Draw lines of equal values at the nodes (n,), or the areas between them, and return them."""
        triangles, shown = self.drawn(values)
        return (ax.tricontourf if filled else ax.tricontour)(triangles, shown, **how)

    def drawn(self, values: Array) -> tuple[Triangulation, Array]:
        """Return triangles of the map and values at their corners: four around the middle of each quadrilateral.

        Args:
            values: At the nodes (n,).
        """
        points, nodes, cells = self._closed
        values = values[nodes]
        triangles = np.concatenate([cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)])
        if cells.shape[1] == 4:
            middle = len(points) + np.arange(len(cells))
            points = np.concatenate([points, points[cells].mean(axis=1)])
            values = np.concatenate([values, values[cells].mean(axis=1)])
            around = [(cells[:, k], cells[:, (k + 1) % 4], middle) for k in range(4)]
            triangles = np.concatenate([np.stack(corners, axis=1) for corners in around])
        return Triangulation(points[:, 0], points[:, 1], triangles), values

    def arrow(self, direction: int) -> str:
        """Return the arrow that is nearest to the strip's way on the map."""
        arm = self.map - self.map.mean(axis=0)
        slope, *_ = np.linalg.lstsq(arm, self.sliding[:, 0] - self.sliding[:, 0].mean(), rcond=None)
        return ARROWS[round(np.arctan2(direction * slope[1], direction * slope[0]) / (np.pi / 4)) % 8]

    def cut(self, values: Array, at: Array, *, along: bool, nodes: Mask | None = None) -> tuple[Array, Array]:
        """Return places along or across the sliding and the values there, NaN beside the surface.

        Args:
            values: At the nodes (n,).
            at: The point that the cut goes through: its places along and across the sliding, mm.
            along: Along the sliding, or across it.
            nodes: Facets that are cut (n,); by default all, of parts behind each other the first.
        """
        free, fixed = (0, 1) if along else (1, 0)
        # Where a track is closed, triangles between its two ends lie all over it.
        size = np.ptp(self.sliding[self.triangles, 0], axis=1)
        small = size < 0.5 * max(float(np.ptp(self.sliding[:, 0])), 1e-300)
        kept = self.triangles[small] if small.any() else self.triangles
        if nodes is None:
            nodes = self.part == 0 if self.overlaps else np.ones(len(self.x), dtype=bool)
        kept = kept[nodes[kept].all(axis=1)]
        places = np.linspace(self.sliding[nodes, free].min(), self.sliding[nodes, free].max(), POINTS)
        over = self.sliding[kept, fixed]
        kept = kept[(over.min(axis=1) <= at[fixed]) & (over.max(axis=1) >= at[fixed])]  # to search all takes seconds
        if not len(kept):
            return places, np.full(POINTS, np.nan)
        corners, kept = np.unique(kept, return_inverse=True)
        plane = Triangulation(self.sliding[corners, free], self.sliding[corners, fixed], kept.reshape(-1, 3))
        interpolated: Any = LinearTriInterpolator(plane, values[corners])(places, np.full(POINTS, at[fixed]))
        return places, np.asarray(interpolated.filled(np.nan))


def surface_of(history: xarray.Dataset, body: str = "punch") -> Surface:
    """Return the contact surface of a body that the history of a solid has."""
    end = "" if body == "punch" else "_strip"
    x = np.column_stack([history[f"{axis}{end}"].values for axis in AXES])
    sliding = np.column_stack([history[f"{name}{end}"].values for name in ("along", "across")])
    of_punch = np.column_stack([history[axis].values for axis in AXES])
    seen_along = int(np.argmin(np.ptp(of_punch, axis=0)))
    first, second = (k for k in range(3) if k != seen_along)
    surface = Surface(body, x, history[f"facets{end}"].values, sliding, (first, second))
    if f"contact{end}" not in history:
        return surface
    known = history[f"contact{end}"]
    return replace(surface, contact=np.array(known.attrs["flag_meanings"].split())[known.values])


class CutPlace(NamedTuple):
    """Where one of several contacts is cut.

    Attributes:
        name: Of the contact, or of the part; "" of the only one.
        at: The middle of its wear along and across the sliding (2,), mm.
        nodes: That belong to it, by the body (n,).
    """

    name: str
    at: Array
    nodes: dict[str, Mask]


def cut_places(history: xarray.Dataset) -> list[CutPlace]:
    """Return where contacts are cut: each that has a name, or of parts that lie behind each other each."""
    punch = surface_of(history)
    opposite = {"strip": surface_of(history, "strip")} if "x_strip" in history else {}
    if len(punch.contact):
        owns = {name: punch.contact == name for name in history.contact.attrs["flag_meanings"].split()}
    elif punch.overlaps:
        owns = {f"part {k + 1}": punch.part == k for k in range(punch.part.max() + 1)}
    else:
        owns = {"": np.ones(len(punch.x), dtype=bool)}
    cuts = []
    for name, contact_nodes in owns.items():
        there = {body: _opposite(surface, name, punch.x[contact_nodes]) for body, surface in opposite.items()}
        nodes = {"punch": contact_nodes, **there}
        cuts.append(CutPlace(name, centre_of_wear(history, nodes), nodes))
    return cuts


def _opposite(strip: Surface, name: str, x: Array) -> Mask:
    """Return the nodes of the strip (n,) that are of a contact: those of its name, or of the part nearest to it."""
    if name in strip.contact:
        return np.asarray(strip.contact == name)
    middle = x[np.linalg.norm(x - x.mean(axis=0), axis=1).argmin()]
    return np.asarray(strip.part == strip.part[np.linalg.norm(strip.x - middle, axis=1).argmin()])


ALL: Mapping[str, Mask | slice] = {body: slice(None) for body in BODIES}  # nodes


def centre_of_wear(history: xarray.Dataset, nodes: Mapping[str, Mask | slice] = ALL) -> Array:
    """Return the places along and across the sliding of the centre of what is worn off at the end (2,), mm.

    Of the punch, or of the strip where it alone wears; of the contact where nothing is worn yet.

    Args:
        history: Of a solid.
        nodes: That count of each body (n,); by default all.
    """
    last = history.isel(half_cycle=-1)

    def centre(weights: Array, body: str) -> Array:
        end = BODIES[body]
        ways = [last[f"{name}{end}"].values[nodes[body]] for name in ("along", "across")]
        return np.array([np.average(way, weights=weights[nodes[body]]) for way in ways])

    for body, end in BODIES.items():
        if f"wear{end}" in last:
            volume = (last[f"wear{end}"] * last[f"weight{end}"]).values
            if volume[nodes[body]].sum() > 0:
                return centre(volume, body)
    return centre(last.weight.values, "punch")


def along_contact(history: xarray.Dataset, body: str = "punch") -> tuple[Array, str]:
    """Return where the nodes of a contact that is a line lie along it, mm, and what the axis of a figure says of it."""
    end = "" if body == "punch" else "_strip"
    if model_of(history) == "plane":
        return history[f"x{end}"].values, ALONG_CONTACT
    r, z = history[f"r{end}"].values, history[f"z{end}"].values
    return (r, "radius r (mm)") if np.ptp(r) >= np.ptp(z) else (z, "height z (mm)")


def gaps_of(history: xarray.Dataset) -> Array:
    """Return the last place before and the first place after each gap of both surfaces (g, 2), mm."""
    last_place: list[Array] = [np.zeros((0, 2))]
    for end in ("", "_strip"):
        if f"part{end}" in history and f"x{end}" in history:
            x: Array = history[f"x{end}"].values
            at = np.flatnonzero(np.diff(history[f"part{end}"].values))
        elif f"r{end}" in history:
            x = history[f"r{end}"].values
            at = np.flatnonzero(np.diff(x) < -BACK * max(float(np.ptp(x)), 1e-300))
        else:
            continue
        last_place.append(np.stack([x[at], x[at + 1]], axis=1))
    return np.unique(np.concatenate(last_place), axis=0)


def sides_of(history: xarray.Dataset) -> list[str]:
    """Return the names of two contacts at the same places, such as the sides of a groove; none of others."""
    gaps = gaps_of(history)
    names = history["contact"].attrs.get("flag_meanings", "").split() if "contact" in history else []
    return names if len(names) == 2 and (gaps[:, 1] < gaps[:, 0]).any() else []


def parted(x: Array, values: Array, gaps: Array) -> tuple[Array, Array]:
    """Return places (n,) and values (..., n) with a place of no value in the middle of each gap (g, 2)."""
    at = _behind(x, gaps)
    middles = (x[at - 1] + x[at]) / 2
    return np.insert(x, at, middles), np.insert(np.asarray(values, dtype=float), at, np.nan, axis=-1)


def _behind(x: Array, gaps: Array) -> NDArray[np.int64]:
    """Return the numbers of the first places behind gaps (g, 2), of places (n,)."""
    if not len(gaps) or len(x) < 2:
        return np.zeros(0, dtype=np.int64)
    ends = np.stack([x[:-1], x[1:]], axis=1)
    same = np.abs(ends[:, None] - gaps).max(axis=2) <= NEAR * np.ptp(x)
    return 1 + np.flatnonzero(same.any(axis=1))


def part_lines(figures: Iterable[Figure], gaps: Array) -> None:
    """Break the lines of figures along the contact at gaps (g, 2); behind one that leads back they are dotted."""
    if not len(gaps):
        return
    back = gaps[gaps[:, 1] < gaps[:, 0]]
    lines = [(ax, line) for figure in figures for ax in figure.axes for line in ax.get_lines()]
    for ax, line in lines:
        x, y = (np.asarray(values) for values in line.get_data())
        if x.shape != y.shape or not np.issubdtype(x.dtype, np.number):
            continue
        first = next(iter(_behind(x, back)), len(x))
        line.set_data(*parted(x[:first], y[:first], gaps))
        if first < len(x):
            (other,) = ax.plot(*parted(x[first:], y[first:], gaps), ":", color=line.get_color())
            other.set(linewidth=line.get_linewidth(), zorder=line.get_zorder())
