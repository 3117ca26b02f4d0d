"""Pictures of the deformed bodies near the contact, from the files in DIR/fields.

VTK ends the whole process where it finds no display: so it draws in a process of its own, under
xvfb-run where there is none. `python -m fenwear.report.pictures DIR` is that process; it needs no MPI.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fenwear.report.course import shown_unit
from fenwear.report.key_numbers import names_in
from fenwear.report.magnification import magnification
from fenwear.report.solid_pictures import draw_solids
from fenwear.report.style import direction_words, further, name_bodies, save, save_gif, strip_moves
from fenwear.results.netcdf import load

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FIELDS, FIGURES = "fields", "figures"
BODIES = ("punch", "strip")
# Pale to dark, so that outlines stay visible and grey prints keep the order.
SHOWN = {"von_mises": ("von Mises stress", "MPa", "YlGnBu"), "temperature": ("temperature", "K", "YlOrRd")}
COLOURS = 16
FLAT = 1e-4  # of the width: how far a contact surface that counts as flat may be from its lowest height
PIXELS = 1100
SECONDS = 300
MOST_FRAMES = 40


class DrawingError(Exception):
    """Pictures of the bodies could not be drawn; tells why and what may help."""


@dataclass(frozen=True)
class View:
    """What all pictures of a run share, so that they can be compared.

    Attributes:
        box: Smallest x, largest x, smallest z, largest z, mm.
        contact: Height of the contact, mm.
        factor: Magnification of the displacement.
        ranges: Least and largest value of each field's colours.
    """

    box: tuple[float, float, float, float]
    contact: float
    factor: float
    ranges: dict[str, tuple[float, float]]


def field_files(directory: Path) -> list[Path]:
    """Return the files of a run's fields by half-cycle."""
    return sorted((directory / FIELDS).glob("half_cycle_*.nc"))


def draw_pictures(directory: Path, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Draw the bodies at every half-cycle with fields, and an animation of several; return the files.

    Raises:
        DrawingError: a part of the stack or a display is missing, or the drawing failed.
    """
    if not field_files(directory):
        return []
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    start = [] if display or not shutil.which("xvfb-run") else ["xvfb-run", "-a"]
    command = [*start, sys.executable, "-m", "fenwear.report.pictures", str(directory), *formats]
    # A process started from one of several ranks is none of them.
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("PMIX", "PRTE", "OMPI", "PMI_"))}
    package = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join([package, *filter(None, [inherited.get("PYTHONPATH")])])
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=SECONDS, check=False, env={**inherited, "PYTHONPATH": path}
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DrawingError(f"no pictures of the bodies: {error}") from None
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        if any("ModuleNotFoundError" in line for line in lines):
            reason = f"{lines[-1].split(': ')[-1]}: install pyvista"
        elif not start and not display:
            reason = "there is no display: install xvfb (it brings xvfb-run) or set DISPLAY"
        else:
            reason = lines[-1] if lines else f"the drawing process ended with status {done.returncode}"
        raise DrawingError(f"no pictures of the bodies: {reason}")
    return [Path(line) for line in done.stdout.splitlines() if line]


def draw_here(directory: Path, formats: Sequence[str] = ()) -> list[Path]:
    """Draw in this process, which needs a display, as PNG and in further formats; return the files."""
    from PIL import Image

    files = field_files(directory)
    if len(files) > MOST_FRAMES:
        files = [files[k] for k in np.unique(np.linspace(0, len(files) - 1, MOST_FRAMES).round().astype(int))]
    datasets = [load(path) for path in files]
    folder = directory / FIGURES
    folder.mkdir(exist_ok=True)
    paths = []
    model, names = datasets[0].attrs.get("model", "plane"), names_in(directory)
    if model != "plane":
        paths = draw_solids(datasets, folder, SHOWN, formats, names)
        if model == "solid":
            return paths
    view = common_view(datasets)
    for field in view.ranges:
        frames = []
        for data in datasets:
            paths.append(folder / f"bodies_{field}_{int(data.attrs['half_cycle']):06d}.png")
            figure = bodies_figure(data, field, view, bodies_image(data, field, view))
            png = paths[-1]
            name_bodies([figure], names)
            save(figure, png, dpi=150)
            paths += further(figure, png, formats)
            with Image.open(png) as picture:
                small = picture.convert("RGB").resize((picture.width * 2 // 3, picture.height * 2 // 3))
                frames.append(small.quantize(128, method=Image.Quantize.FASTOCTREE))
        if len(frames) > 1:
            paths.append(folder / f"bodies_{field}.gif")
            save_gif(frames, paths[-1], milliseconds=400)
    return paths


def common_view(datasets: Sequence[xarray.Dataset]) -> View:
    """Return the view that fits all half-cycles: the contact surface of the punch and what lies below and above it."""
    first = datasets[0]
    x, z = first.punch_contact_x.values, first.punch_contact_z.values
    contact, width = float(z.min()), float(np.ptp(x))
    box = (x.min() - 0.22 * width, x.max() + 0.22 * width, contact - 0.5 * width, contact + 0.75 * width)
    inside = {body: _inside(first, body, box) for body in BODIES}
    largest = max(
        float(np.hypot(*(data[f"{b}_displacement_{a}"].values[inside[b]] for a in "xz")).max(initial=0.0))
        for data in datasets
        for b in BODIES
    )
    ranges = {}
    for field in SHOWN:
        names = [f"{b}_{field}" for b in BODIES]
        if all(name in data for data in datasets for name in names):
            # Late states fill the scale: what early ones have beyond it the bar tells.
            late = datasets[len(datasets) // 2 :]
            values = np.concatenate([data[f"{b}_{field}"].values[inside[b]] for data in late for b in BODIES])
            # A corner's stress has no bound: the colours leave out the largest half per cent.
            low, high = float(values.min()), float(np.quantile(values, 0.995 if field == "von_mises" else 1.0))
            ranges[field] = (0.0 if 0 < low < high / 2 else low, high if high > low else low + 1.0)
    surfaces = [data[f"{body}_contact_z"].values for data in datasets for body in BODIES]
    # Displacement that is magnified fits surfaces which lie on each other, not the gap between curved ones.
    curved = any(np.abs(surface - contact).max() > FLAT * width for surface in surfaces)
    return View(box, contact, 1.0 if curved else magnification(largest, width), ranges)


def deformed(data: xarray.Dataset, body: str, view: View) -> NDArray[np.float64]:
    """Return a body's nodes (n, 3) after the magnified displacement, its surface as it is worn.

    The wear is as small as the displacement and is magnified with it: else the worn bodies would seem
    to sink into each other. It fades out over a tenth of the contact's width away from it.
    """
    x, z = data[f"{body}_x"].values, data[f"{body}_z"].values
    u, w = (data[f"{body}_displacement_{axis}"].values for axis in ("x", "z"))
    reach = 0.1 * np.ptp(data.punch_contact_x.values)
    depth = np.interp(x, data[f"{body}_contact_x"].values, data[f"{body}_contact_wear"].values)
    w = w + (1 if body == "punch" else -1) * depth * np.clip(1 - np.abs(z - view.contact) / reach, 0, 1)
    return np.column_stack([x + view.factor * u, np.zeros_like(x), z + view.factor * w])


def bodies_image(data: xarray.Dataset, field: str, view: View) -> NDArray[np.uint8]:
    """Return the view's box filled by both deformed bodies, coloured by a field."""
    import pyvista

    x0, x1, z0, z1 = view.box
    height = round(PIXELS * (z1 - z0) / (x1 - x0))
    plotter = pyvista.Plotter(off_screen=True, window_size=[PIXELS, height])
    plotter.set_background("white")
    for body in BODIES:
        seen = _inside(data, body, view.box, margin=0.3)
        cells = data[f"{body}_cells"].values
        cells = cells[seen[cells].all(axis=1)]
        faces = np.hstack([np.full((len(cells), 1), 4), cells]).ravel()
        values = data[f"{body}_{field}"].values
        before = pyvista.PolyData(np.column_stack([data[f"{body}_x"], 0 * values, data[f"{body}_z"]]), faces)
        after = pyvista.PolyData(deformed(data, body, view), faces)
        after.point_data[field] = values
        plotter.add_mesh(after, scalars=field, cmap=SHOWN[field][2], clim=view.ranges[field], n_colors=COLOURS,
                         lighting=False, show_scalar_bar=False)  # fmt: skip
        plotter.add_mesh(_outline(after), color="black", line_width=2.5)
        plotter.add_mesh(_outline(before), color="grey", line_width=1.5)
    plotter.enable_parallel_projection()
    centre = ((x0 + x1) / 2, 0, (z0 + z1) / 2)
    plotter.camera_position = [(centre[0], -10 * (x1 - x0), centre[2]), centre, (0, 0, 1)]
    plotter.camera.parallel_scale = (z1 - z0) / 2
    plotter.camera.clipping_range = (0.1 * (x1 - x0), 20 * (x1 - x0))
    image = plotter.screenshot(None, return_img=True)
    plotter.close()
    return np.asarray(image)


def bodies_figure(data: xarray.Dataset, field: str, view: View, image: NDArray[np.uint8]) -> Figure:
    """Set the picture of the bodies into axes in mm, with a bar of colours and what is to be known."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    direction, half_cycle = int(data.attrs["direction"]), int(data.attrs["half_cycle"])
    name, unit, colours = SHOWN[field]
    unit = shown_unit(str(data[f"punch_{field}"].attrs.get("units", unit)))
    low, high = view.ranges[field]
    values = np.concatenate([data[f"{b}_{field}"].values[_inside(data, b, view.box)] for b in BODIES])
    beyond = values.max() > high
    figure = Figure(figsize=(7.0, 6.6), layout="constrained")
    ax = figure.subplots()
    ax.imshow(image, extent=view.box, interpolation="antialiased")
    rings = data.attrs.get("model", "plane") == "axisymmetric"
    ax.set_xlabel("r (mm)" if rings else "x (mm)")
    ax.set_ylabel("z (mm)")
    ax.set_title(
        f"{name[:1].upper()}{name[1:]}, half-cycle {half_cycle:,}: displacement and wear × {view.factor:,g}", loc="left"
    )
    moves = f"{strip_moves(data)} {direction_words(data)[direction]}"
    if "turns" in moves:  # its axis points away from who looks at a plane
        moves += "" if rings else " (seen against its axis)"
    else:
        moves = f"{moves} →" if direction > 0 else f"← {moves}"
    middle = (view.box[0] + view.box[1]) / 2
    plate = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    ax.text(middle, view.box[2] + 0.06 * (view.box[3] - view.box[2]), moves, ha="center", bbox=plate)
    ax.text(0.99, 0.02, "black: deformed\ngrey: undeformed", transform=ax.transAxes, ha="right", va="bottom",
            fontsize="small", bbox=plate)  # fmt: skip
    mappable = ScalarMappable(Normalize(low, high), colormaps[colours].resampled(COLOURS))
    bar = figure.colorbar(
        mappable, ax=ax, location="bottom", shrink=0.7, aspect=30, extend="max" if beyond else "neither"
    )
    most = f"{values.max():.0f}" if values.max() >= 10 else f"{values.max():.3g}"
    bar.set_label(f"{name} ({unit})" + (f", at single points up to {most} {unit}" if beyond else ""))
    return figure


def _outline(surface: Any) -> Any:
    return surface.extract_feature_edges(
        boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
    )


def _inside(data: xarray.Dataset, body: str, box: tuple[float, ...], margin: float = 0.0) -> NDArray[np.bool_]:
    """Return which nodes of a body lie in the box, widened by a share of its size on each side."""
    x, z = data[f"{body}_x"].values, data[f"{body}_z"].values
    dx, dz = margin * (box[1] - box[0]), margin * (box[3] - box[2])
    return np.asarray((x >= box[0] - dx) & (x <= box[1] + dx) & (z >= box[2] - dz) & (z <= box[3] + dz))


if __name__ == "__main__":
    for drawn in draw_here(Path(sys.argv[1]), sys.argv[2:]):
        print(drawn)
