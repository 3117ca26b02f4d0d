"""Pictures of the deformed bodies of solids and rings in space, from the files in DIR/fields.

Solids are cut through the middle of the contact along the sliding, and one half is shown: as a whole, and near the
contact straight on. Rings are turned about their axis, with a quarter left open. Displacement and wear are magnified
together, as in `fenwear.report.pictures`, by the factor that the picture tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.arrays import Array, Mask
from fenwear.case.names import BY_ROLE, Names
from fenwear.report.course import shown_unit
from fenwear.report.magnification import magnification
from fenwear.report.style import GREY, further, name_bodies, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BODIES = ("punch", "strip")
AXES = ("x", "y", "z")
COLOURS = 16
FLAT = 1e-4  # of the contact's length: how far a surface that counts as flat may be from a plane
FADES = 0.1  # of the contact's length: over which wear, as it is drawn, fades into the bodies
NEAR = (0.72, 0.5, 0.75)  # of the length: half of the section that is shown, and most of it below and above the contact
PIXELS = 900
MARGIN, ASPECTS = 0.04, (0.2, 0.62)  # of a picture of whole bodies: left free around them; height over width
OPEN, AROUND = 1.5 * np.pi, 54  # of rings: how far they are turned, and in how many parts
NEIGHBOURS = 4
HEXAHEDRON, TETRAHEDRON = 12, 10  # VTK's numbers
FLIP = [0, 2, 1, 3]


@dataclass(frozen=True)
class SolidView:
    """What all pictures of a run share.

    Attributes:
        centre: Of the contact (3,), mm.
        along, normal: The strip's way there, and the normal into the punch (3,).
        length: Of the contact along the sliding, mm.
        factor: Magnification of displacement and wear.
        ranges: Least and largest value of each field's colours.
        heights: Of what is shown of the section below and above the contact, mm.
    """

    centre: Array
    along: Array
    normal: Array
    length: float
    factor: float
    ranges: dict[str, tuple[float, float]]
    heights: tuple[float, float]

    @property
    def across(self) -> Array:
        """The normal of the section (3,), towards the half that is cut off."""
        return np.asarray(np.cross(self.along, self.normal), dtype=np.float64)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """What the section shows: along the sliding and along the normal, mm."""
        wide, (below, above) = NEAR[0] * self.length, self.heights
        return -wide, wide, -below, above

    def near(self, x: Array) -> Mask:
        """Return which points are near the contact (n,)."""
        arm = np.linalg.norm(x - self.centre, axis=1)
        return np.asarray(arm < self.length)


def draw_solids(
    datasets: Sequence[xarray.Dataset],
    folder: Path,
    shown: dict[str, tuple[str, str, str]],
    formats: Sequence[str] = (),
    names: Names = BY_ROLE,
) -> list[Path]:
    """Draw the bodies in space at each half-cycle with fields; return the files.

    Args:
        datasets: Fields, by half-cycle.
        folder: For the pictures.
        shown: Name, unit and colours of each field.
        formats: In which the pictures are drawn beside PNG.
        names: Of the bodies.
    """
    view = solid_view(datasets, shown)
    paths = []
    for field in view.ranges:
        for data in datasets:
            name = "solid" if data.attrs["model"] == "solid" else "turned"
            png = folder / f"{name}_{field}_{int(data.attrs['half_cycle']):06d}.png"
            figure = solid_figure(data, field, view, shown[field])
            name_bodies([figure], names)
            save(figure, png, dpi=150)
            paths += [png, *further(figure, png, formats)]
    return paths


def points(data: xarray.Dataset, body: str, kind: str = "") -> Array:
    """Return coordinates of a body's nodes, or of its contact nodes (n, 3), mm; rings lie at y = 0."""
    columns = [data[f"{body}{kind}_{a}"].values if f"{body}{kind}_{a}" in data else None for a in AXES]
    size = next(len(c) for c in columns if c is not None)
    return np.column_stack([np.zeros(size) if c is None else c for c in columns])


def displacement(data: xarray.Dataset, body: str) -> Array:
    """Return the displacement of a body's nodes (n, 3), mm."""
    names = [f"{body}_displacement_{a}" for a in AXES]
    around = f"{body}_displacement_out_of_plane"
    columns = [data[n].values if n in data else data[around].values if around in data else None for n in names]
    size = next(len(c) for c in columns if c is not None)
    return np.column_stack([np.zeros(size) if c is None else c for c in columns])


def solid_view(datasets: Sequence[xarray.Dataset], shown: dict[str, Any]) -> SolidView:
    """Return the view that fits all half-cycles."""
    first = datasets[0]
    x = points(first, "punch", "_contact")
    along, normal = (np.array(first.attrs[name]) for name in ("along", "normal"))
    length, centre = float(np.ptp(x @ along)), (x.max(axis=0) + x.min(axis=0)) / 2
    if first.attrs["model"] != "solid":  # the section of rings
        along, length = np.array([1.0, 0.0, 0.0]), float(np.ptp(x[:, 0]))
    centre = centre + ((x - centre) @ normal).min() * normal
    heights = [(points(first, body) - centre) @ normal for body in BODIES]
    room = MARGIN * length  # thin bodies do not fill the section
    below, above = min(NEAR[1] * length, room - heights[1].min()), min(NEAR[2] * length, room + heights[0].max())
    view = SolidView(centre, along, normal, length, 1.0, {}, (float(below), float(above)))
    inside = {body: view.near(points(first, body)) for body in BODIES}
    moved = [np.linalg.norm(displacement(d, b), axis=1)[inside[b]].max(initial=0.0) for d in datasets for b in BODIES]
    surfaces = [(points(d, b, "_contact") - centre) @ normal for d in datasets[:1] for b in BODIES]
    curved = any(np.abs(s).max() > FLAT * length for s in surfaces)
    ranges = {}
    for field in shown:
        if not all(f"{b}_{field}" in d for d in datasets for b in BODIES):
            continue
        values = np.concatenate([d[f"{b}_{field}"].values[inside[b]] for d in datasets for b in BODIES])
        low, high = float(values.min()), float(np.quantile(values, 0.995 if field == "von_mises" else 1.0))
        ranges[field] = (0.0 if 0 < low < high / 2 else low, high if high > low else low + 1.0)
    factor = 1.0 if curved else magnification(float(max(moved)), length)
    return replace(view, factor=factor, ranges=ranges)


def deformed(data: xarray.Dataset, body: str, view: SolidView) -> Array:
    """Return a body's nodes (n, 3) after displacement and wear, magnified; wear fades out away from the contact."""
    x, u, contact = points(data, body), displacement(data, body), points(data, body, "_contact")
    plane = np.eye(3) - np.outer(view.normal, view.normal)
    tree = cKDTree(contact @ plane)
    count = min(NEIGHBOURS, len(contact))
    distance, near = tree.query(x @ plane, k=count)
    distance, near = distance.reshape(len(x), count), near.reshape(len(x), count)
    share = 1 / np.maximum(distance, 1e-9 * view.length)
    depth = (share * data[f"{body}_contact_wear"].values[near]).sum(axis=1) / share.sum(axis=1)
    apart = float(np.median(tree.query(contact @ plane, k=2)[0][:, 1]))
    height = np.abs((x - contact[near[:, 0]]) @ view.normal)
    depth *= np.clip(1 - height / (FADES * view.length), 0, 1) * (distance[:, 0] < apart)
    sign = 1 if body == "punch" else -1
    moved: Array = x + view.factor * (u + sign * depth[:, None] * view.normal)
    return moved


def mesh(data: xarray.Dataset, body: str, x: Array, field: str) -> Any:
    """Return a body as pyvista has it, rings turned about their axis."""
    import pyvista

    cells, values = data[f"{body}_cells"].values, data[f"{body}_{field}"].values
    if data.attrs["model"] != "solid":
        x, cells = _around(x, cells)
        values = np.tile(values, AROUND + 1)
    kind = HEXAHEDRON if cells.shape[1] == 8 else TETRAHEDRON
    if kind == TETRAHEDRON:  # all with the same sense: else their faces seem to meet at an edge
        first, *sides = np.moveaxis(x[cells], 1, 0)
        cells = np.where((np.linalg.det(np.stack(sides, axis=1) - first[:, None]) < 0)[:, None], cells[:, FLIP], cells)
    listed = np.hstack([np.full((len(cells), 1), cells.shape[1]), cells]).ravel()
    grid = pyvista.UnstructuredGrid(listed, np.full(len(cells), kind, dtype=np.uint8), x)
    grid.point_data[field] = values
    return grid


def _around(x: Array, cells: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return points and hexahedra of a section turned about z, open towards the viewer."""
    turn = np.linspace(0, OPEN, AROUND + 1)[:, None]
    r, sideways = x[:, 0], x[:, 1]
    moved = [r * np.cos(turn) - sideways * np.sin(turn), r * np.sin(turn) + sideways * np.cos(turn), x[:, 2] + 0 * turn]
    here = cells[None] + len(x) * np.arange(AROUND)[:, None, None]
    return np.stack(moved, axis=-1).reshape(-1, 3), np.concatenate([here, here + len(x)], axis=-1).reshape(-1, 8)


def solid_figure(data: xarray.Dataset, field: str, view: SolidView, named: tuple[str, str, str]) -> Figure:
    """Set the pictures of the bodies beside each other, with a bar of colours and what is to be known."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    solid = data.attrs["model"] == "solid"
    name, unit, colours = named
    unit = shown_unit(str(data[f"punch_{field}"].attrs.get("units", unit)))
    low, high = view.ranges[field]
    bodies = [mesh(data, b, deformed(data, b, view), field) for b in BODIES]
    images = [_image(bodies, field, view, colours, whole=True, solid=solid)]
    if solid:
        images.append(_image(bodies, field, view, colours, whole=False, solid=True))
    shares = [images[0].shape[0] / images[0].shape[1] / ASPECTS[1]]
    if solid:
        shares.append(images[1].shape[0] / images[1].shape[1] / (sum(NEAR[1:]) / NEAR[0] / 2))
    heights = (1.2 + 3.4 * shares[0] + 4.0 * shares[1]) if solid else 1.6 + 4.0 * shares[0]
    figure = Figure(figsize=(7.0, heights), layout="constrained")
    axes = figure.subplots(len(images), 1, squeeze=False, height_ratios=shares)[:, 0]
    axes[0].imshow(images[0])
    axes[0].set_axis_off()
    half_cycle = int(data.attrs["half_cycle"])
    title = f"{name[:1].upper()}{name[1:]}, half-cycle {half_cycle:,}: displacement and wear × {view.factor:,g}"
    axes[0].set_title(title, loc="left", fontsize="medium")
    if solid:
        axes[1].imshow(images[1], extent=view.box)
        axes[1].set_xlabel("place along the sliding, from the middle of the contact (mm)")
        axes[1].set_ylabel("height (mm)")
        way = "strip moves →" if data.attrs["direction"] > 0 else "← strip moves"
        axes[1].set_title(f"Section along the sliding through the middle of the contact; {way}", loc="left",
                          fontsize="medium")  # fmt: skip
    values = np.concatenate([data[f"{b}_{field}"].values[view.near(points(data, b))] for b in BODIES])
    most = float(values.max())
    mappable = ScalarMappable(Normalize(low, high), colormaps[colours].resampled(COLOURS))
    every: Any = list(axes)
    bar = figure.colorbar(mappable, ax=every, location="bottom", shrink=0.7, aspect=35,
                          extend="max" if most > high else "neither")  # fmt: skip
    bar.set_label(f"{name} ({unit})" + (f", at single points up to {most:,.4g} {unit}" if most > high else ""))
    return figure


def _image(bodies: Sequence[Any], field: str, view: SolidView, colours: str, *, whole: bool, solid: bool) -> Any:
    """Return the picture of both bodies: the half behind the section, from aside or straight on."""
    import pyvista

    cut: dict[str, Any] = {"normal": view.across, "origin": view.centre}
    halves = [grid.clip(**cut, invert=True) if solid else grid for grid in bodies]
    x0, x1, z0, z1 = view.box
    way, centre = view.across, view.centre + (z0 + z1) / 2 * view.normal
    aspect, scale = (z1 - z0) / (x1 - x0), (z1 - z0) / 2
    if whole:
        way = view.across + 0.45 * view.along if solid else np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
        way = way + 0.45 * view.normal
        centre, aspect, scale = filling_view(np.vstack([half.points for half in halves]), way, view.normal)
    plotter = pyvista.Plotter(off_screen=True, window_size=[PIXELS, round(PIXELS * aspect)])
    plotter.set_background("white")
    for grid, half in zip(bodies, halves, strict=True):
        plotter.add_mesh(half.extract_surface(), scalars=field, cmap=colours, clim=view.ranges[field], n_colors=COLOURS,
                         lighting=whole, ambient=0.8, diffuse=0.3, show_scalar_bar=False)  # fmt: skip
        surface = grid.extract_surface()
        edges = surface.extract_feature_edges(
            boundary_edges=True, feature_edges=True, feature_angle=40, manifold_edges=False, non_manifold_edges=False
        )
        # Not those of the half: where tetrahedra are cut there are slivers, whose faces point anywhere.
        lines = [edges.clip(**cut, invert=True), surface.slice(**cut)] if solid and edges.n_points else [edges]
        for line in lines:
            if line.n_points:
                plotter.add_mesh(line, color="black" if not whole else GREY, line_width=1.5)
    plotter.enable_parallel_projection()
    plotter.camera_position = [centre + 100 * view.length * way, centre, view.normal]
    plotter.camera.parallel_scale = scale
    if whole:
        plotter.reset_camera_clipping_range()
    else:
        plotter.camera.clipping_range = (view.length, 300 * view.length)
    image = np.asarray(plotter.screenshot(None, return_img=True))
    plotter.close()
    return image


def filling_view(x: Array, way: Array, normal: Array) -> tuple[Array, float, float]:
    """Return centre, height over width and half the height (mm) of the picture that points (n, 3) fill.

    Args:
        x: The points.
        way: To the viewer.
        normal: What is up.
    """
    way = way / np.linalg.norm(way)
    up = normal - (normal @ way) * way
    axes = np.array([np.cross(up, way), up]) / np.linalg.norm(up)
    seen = x @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    wide, high_half = (1 + MARGIN) * (high - low) / 2
    aspect = float(np.clip(high_half / wide, *ASPECTS))
    centre: Array = (low + high) / 2 @ axes + x.mean(axis=0) @ way * way
    return centre, aspect, float(max(high_half, wide * aspect))
