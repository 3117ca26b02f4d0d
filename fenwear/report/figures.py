"""All figures of a run and their captions, drawn from its folder alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray
from matplotlib.figure import Figure

from fenwear.report.body_figures import field_figures
from fenwear.report.drawn_surface import cut_places, gaps_of, model_of, part_lines, sides_of
from fenwear.report.key_numbers import names_in, read_case
from fenwear.report.lines import (
    LATE,
    OF_CYCLES,
    between_of,
    chosen_half_cycles,
    fields_of,
    lines_figure,
    nearest_half_cycles,
    profile_figure,
    that_wear,
    wear_map_figure,
    with_late_pressures,
)
from fenwear.report.maps import has_tracks, map_figure, tracks_figure, with_surfaces
from fenwear.report.run_figures import course_figures
from fenwear.report.stick_figures import stick_figures, with_sums
from fenwear.report.style import STANDARD, Style, direction_words, name_bodies, save, strip_moves, wrapped
from fenwear.results.disk import write_text
from fenwear.results.quantity import BODIES
from fenwear.results.stored_history import by_cycles, read_history, resolves

FOLDER = "figures"
CAPTIONS = "captions.txt"
DPI = 200
MAPS = 6  # at most
ALONG = ("profiles", "shape", "pressure", "mean_pressure", "temperature")  # the contact, by lines
# In the order in which the report shows them.
TEXTS = {
    "geometry": "Geometry: (a) whole, (b) near the contact, with elements, supports (red), loads (blue) and the "
    "contact (green); x along the contact, z upwards.",
    "loops": "Fretting loops, one for each cycle named. (a) Tangential force over the displacement of the strip. "
    "(b) The same over the displacement beyond full stick's.",
    "zones": "Where the surfaces stick and slip over the time steps of the first and of the last cycle.",
    "tractions": "Tangential traction along the sliding at five times of the first and the last cycle, between "
    "plus and minus µ p. Grey: µ times the cycle's largest pressure.",
    "traction_map": "Size and direction of the tangential traction at four times of the first and of the last cycle.",
    "sliding": "Slip of each place in a cycle, its work of friction, and the largest stress in the strip's surface.",
    "energy": "(a) Work of friction in a half-cycle and (b) its ratio to the loop's box, with the border of gross "
    "sliding, over the {axis}.",
    "profiles": "Surface profiles of {bodies}, unworn and worn, at {chosen}. Heights, or the depths of round "
    "contacts, are magnified; the punch lies above.",
    "shape": "Worn depth of {bodies} along the contact at {chosen}.",
    "wear_map": "Worn depth of {bodies} over the position along the contact and the {axis}.",
    "roughness": "Rough surfaces where they have worn, without their form: mean and root mean square of the heights "
    "over the {axis}.",
    "pressure": "Contact pressure along the contact at {chosen}: {panels}. The axis ends above the later states; "
    "the legend has the largest pressure of those beyond it.",
    "mean_pressure": "Mean contact pressure of all directions over the last tenth of the half-cycles at {chosen}. Wear "
    "follows it, and it is smooth where the edge of the contact moves.",
    "tracks": "Sliding over the last cycle. (a) Tracks of the strip's material; dots mark their start. (b) Cross-shear "
    "ratio on the punch where it is rubbed, with the direction of most of the work of friction.",
    "cuts_along": "Pressure and worn depths{warm} along the sliding at {chosen}.",
    "cuts_across": "Pressure and worn depths{warm} across the sliding at {chosen}.",
    "between": "State between the surfaces along the contact at {chosen}: debris, plastic depth, remaining coatings, "
    "and what laws remember there, where there are any.",
    "program": "Load, sliding speed and ambient temperature over the run, where they change.",
    "peaks": "Largest contact pressure and {size} in contact{hot}, for each sliding direction, over the {axis}.",
    "place": "The shaft in its bore over the {axis}. Size and angle are of the vector from the middle of the unworn "
    "bore to that of the unworn shaft. The angle counts from the load (of several bores, from the load of "
    "each), as the strip turns.",
    "volume": "(a) Worn volume and (b) specific wear rate, of the half-cycle (current) and from the start (mean), over "
    "the sliding distance.",
    "creep": "Wear and creep of each body: (a) largest depth and (b) volume, over the time.",
    "coating": "(a) Share of the scar in which the coating is worn through and (b) least coating left over the {axis}.",
    "scar": "Largest worn depth, and size of the scar at 1 % and 5 % of it, over the {axis}. Of a surface: length "
    "along the sliding and width across.",
    "friction": "(a) Normal force and (b) friction force of each half-cycle and (c) work of friction from the start, "
    "over the {axis}.",
    "surface_stress": "Stress along the contact surface of (a) the punch and (b) the strip at half-cycle {last}: its "
    "components and von Mises' stress.",
    "temperature": "Temperature along the contact surfaces of (a) the punch and (b) the strip at {chosen}.",
    "convergence": "(a) Largest change of pressure against one cycle ago, over the pressure scale (integral of p² "
    "over integral of p). (b) Share of the load that is carried elsewhere than in the optimum.",
    "heat_balance": "Heat of each half-cycle over the {axis}: friction heat is the sum of the others.",
}
AXES = {
    "cycles": ("cycles", "the cycles named"),
    "distance": ("sliding distance", "the sliding distances named"),
    "time": ("time", "the times named"),
}


def all_figures(history: xarray.Dataset, wanted: Sequence[int] = (), look: Style = STANDARD) -> dict[str, Figure]:
    """Return every figure that the history has data for, by its name."""
    chosen = chosen_half_cycles(history, wanted)
    draw = _on_surfaces if model_of(history) == "solid" else _along_lines
    drawn = draw(history, chosen, look) | course_figures(history, look)
    if resolves(history):
        drawn |= _of_cycles(history, chosen, look)
    return wrapped(drawn)


def _of_cycles(history: xarray.Dataset, chosen: Sequence[int], look: Style) -> dict[str, Figure]:
    """Return the figures of time steps, and slip, work and stress of whole cycles."""
    cycles = by_cycles(history)
    sums, drawn = with_sums(history, cycles), stick_figures(cycles, look)
    fields = [field for field in OF_CYCLES if field.variable in sums]
    ends = nearest_half_cycles(sums, chosen)
    if model_of(history) == "solid":
        return drawn | {f"{field.variable}_map": map_figure(sums, field, [ends[0], ends[-1]], look) for field in fields}
    return drawn | {"sliding": lines_figure(sums, fields, ends, look)}


def _on_surfaces(history: xarray.Dataset, chosen: Sequence[int], look: Style) -> dict[str, Figure]:
    """Return maps of a solid, and cuts along and across the sliding."""
    surfaces, between = with_surfaces(history, chosen[-MAPS:]), between_of(history)
    drawn = {f"{n}_map": map_figure(surfaces, field, chosen[-MAPS:], look) for n, field in fields_of(surfaces).items()}
    if has_tracks(history):
        drawn["tracks"] = tracks_figure(history, look)
    cut = [field for name, field in fields_of(history).items() if name not in between]
    for way in ("along", "across"):
        drawn[f"cuts_{way}"] = lines_figure(history, cut, chosen, look, along=way == "along")
    return drawn


def _along_lines(history: xarray.Dataset, chosen: Sequence[int], look: Style) -> dict[str, Figure]:
    """Return the figures along the contact of planes and rings, and in planes their profiles."""
    drawn: dict[str, Figure] = {}
    if model_of(history) == "plane":
        drawn["profiles"] = profile_figure(history, chosen, look)
        drawn["wear_map"] = wear_map_figure(history, look)
    fields, between = fields_of(history), between_of(history)
    groups = {
        "shape": [fields[f"wear{BODIES[body]}"] for body in that_wear(history)],
        "pressure": [fields["pressure"]],
        "temperature": [field for name, field in fields.items() if name.startswith("temperature_")],
        "between": [*between.values()],
    }
    drawn |= {name: lines_figure(history, group, chosen, look) for name, group in groups.items() if group}
    if "pressure_sum" in history and (late := with_late_pressures(history)).sizes["half_cycle"]:
        drawn["mean_pressure"] = lines_figure(late, [fields_of(late)[LATE]], chosen_half_cycles(late, chosen), look)
    return drawn


def draw_figures(
    directory: Path,
    half_cycles: Sequence[int] = (),
    look: Style = STANDARD,
    formats: Sequence[str] = ("png",),
) -> list[Path]:
    """Draw all figures of a run, and their captions, into its folder `figures`; return the paths."""
    folder, history = directory / FOLDER, read_history(directory)
    drawn = all_figures(history, half_cycles, look)
    if model_of(history) == "plane":
        drawn |= field_figures(directory, read_case(directory), look)
    part_lines(drawn.values(), gaps_of(history))
    name_bodies(drawn.values(), names := names_in(directory))
    folder.mkdir(exist_ok=True)
    paths = []
    for name, figure in drawn.items():
        for ending in dict.fromkeys(("png", *formats)):  # the report shows the PNG
            paths.append(folder / f"{name}.{ending}")
            save(figure, paths[-1], DPI)
    captions = folder / CAPTIONS
    write_text(captions, names.with_names("".join(f"{name}: {caption(name, history, look)}\n\n" for name in drawn)))
    return [*paths, captions]


def caption(name: str, history: xarray.Dataset, look: Style) -> str:
    """Return the caption of a figure of a run."""
    bodies = [body for body, end in BODIES.items() if f"wear{end}" in history]
    words, moves, solid = direction_words(history), strip_moves(history), model_of(history) == "solid"
    moving = "turning" if "turns" in moves else "moving"
    ways = [f"the strip {moving} {word}" for d, word in words.items() if bool((history.direction == d).any())]
    panels = ways[0] if len(ways) == 1 else ", ".join(f"({letter}) {w}" for letter, w in zip("ab", ways, strict=True))
    axis, chosen = AXES[look.axis]
    text = TEXTS.get(name, "")
    if name.endswith("_map") and (solid or not text) and name.removesuffix("_map") in (fields := _mapped(history)):
        text = f"Maps of the {fields[name.removesuffix('_map')]} at {{chosen}}, the largest value above each."
    sentences = text.format(
        bodies=" and ".join(f"the {body}" for body in bodies),
        chosen=chosen,
        panels=panels,
        size="width" if "contact_width" in history else "area",
        axis=axis,
        hot=" and largest temperature of the contact surfaces" if "largest_temperature" in history else "",
        warm=" and temperatures" if "largest_temperature" in history else "",
        last=f"{int(history.half_cycle[-1]):,}",
    )
    if name in ALONG and (sides := sides_of(history)):
        sentences += f" Solid: the contact {sides[0]}; dotted: {sides[1]}."
    if name.startswith("cuts") and len(cut_places(history)) > 1:
        sentences += " Each contact through the middle of its own wear."
    return sentences


def _mapped(history: xarray.Dataset) -> dict[str, str]:
    """Return the titles of what there are maps of, by the variable."""
    text = "height of the {} over its smooth shape, without the form of its scar (S-F, ISO 25178),"
    rough = {f"surface{end}": text.format(body) for body, end in BODIES.items()}
    of_cycles = {field.variable: field.title for field in OF_CYCLES}
    return {name: field.title for name, field in fields_of(history).items()} | rough | of_cycles
