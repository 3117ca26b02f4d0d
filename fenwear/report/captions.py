"""What stands below each figure: in figures/captions.txt and in the report."""

from __future__ import annotations

import xarray

from fenwear.report.gaps import sides_of
from fenwear.report.lies_between import lies_between
from fenwear.report.style import Style, direction_words, strip_moves
from fenwear.report.surface import cut_places, model_of
from fenwear.results.sheet import BODIES

ALONG = ("profiles", "shape", "pressure", "mean_pressure", "temperature")  # the contact, by lines
TEXTS = {
    "geometry": "Geometry: (a) whole, (b) near the contact, with elements, supports (red), loads (blue) and the "
    "contact (green); x along the contact, z upwards.",
    "profiles": "Surface profiles of {bodies}, unworn and worn, at {chosen}. Heights, or the depths of round "
    "contacts, are magnified; the punch lies above.",
    "shape": "Worn depth of {bodies} along the contact at {chosen}.",
    "wear_map": "Worn depth of {bodies} over the position along the contact and the {axis}.",
    "pressure": "Contact pressure along the contact at {chosen}: {panels}. First "
    "states far beyond all later ones have the last panel, dashed where the strip {back}.",
    "mean_pressure": "Mean contact pressure, of all directions, over the last tenth of what is done at "
    "{chosen}: by it material is lost, and it is well posed where the edge of the contact moves.",
    "peaks": "Largest contact pressure and {size} in contact{hot}, for each sliding direction, over the {axis}; "
    "grey: the largest of the mean pressure over the last tenth of what is done.",
    "place": "The shaft in its bore: (a) the way from the middle of the unworn bore to that of the unworn shaft, (b) "
    "its size and (c) its angle from the way in which the load presses the shaft (of several bores, what each of them "
    "carries), as the strip turns, over the {axis}.",
    "volume": "(a) Worn volume and (b) specific wear rate, of the half-cycle (current) and from the start (mean), over "
    "the sliding distance.",
    "creep": "What is worn off each body, and what it has crept: (a) largest depth and (b) volume, over the time.",
    "scar": "(a) Largest worn depth and (b) size of the scar at 1 % and 5 % of it, over the {axis}; of a surface, its "
    "length along the sliding, and (c) its width across.",
    "friction": "(a) Normal force and friction force of each half-cycle and (b) work of friction from the start, over "
    "the {axis}.",
    "convergence": "(a) Largest change of pressure against one cycle ago, over the pressure scale (integral of p² "
    "over integral of p), and (b) share of the load that is carried elsewhere than in the optimum, over the {axis}.",
    "temperature": "Temperature along the contact surfaces of (a) the punch and (b) the strip at {chosen}.",
    "between": "What lies between the surfaces along the contact at {chosen}: debris, plastic depth, what is left "
    "of coatings, and what laws remember there, where there are any.",
    "heat_balance": "Heat of each half-cycle over the {axis}: what friction makes is the sum of the others.",
    "boundary_temperature": "Temperature (a) round the punch from the middle of its contact on, corners by (x, z) in "
    "mm, and (b) along the strip's upper surface, grey under the punch, at half-cycle {last}.",
    "surface_stress": "Stress along the contact surface of (a) the punch and (b) the strip at half-cycle {last}: its "
    "components and von Mises' stress.",
    "program": "What acted over the run: load, sliding speed and ambient temperature, where they change.",
    "pressure_map": "Maps of the contact pressure at {chosen}, with the way of the strip, the border of contact and "
    "the largest value. Colours end where late states do.",
    "wear_strip_map": "Maps of the worn depth of the strip over its largest at {chosen}, which is told above each.",
    "surface_map": "Maps of the height of the punch over its smooth shape, worn depths taken off, at {chosen}. "
    "Within the convex hull of its scar its form is off, too, the nearest surface of second order (S-F, ISO 25178).",
    "surface_strip_map": "Maps of the height of the strip over its smooth shape, worn depths taken off, at {chosen}. "
    "Within the convex hull of its scar its form is off, too, the nearest surface of second order (S-F, ISO 25178).",
    "roughness": "Rough surfaces where they have worn, without their form: mean and root mean square of the heights "
    "over the {axis}.",
    "temperature_map": "Maps of the temperature of the punch's contact surface at {chosen}.",
    "temperature_strip_map": "Maps of the temperature of the strip's surface below the punch at {chosen}.",
    "tracks": "Sliding over the last cycle: (a) tracks of the strip's material, dots where it begins, and (b) the "
    "cross-shear ratio on the punch where it is rubbed, with the direction of most of the work of friction.",
    "cuts_along": "Pressure, worn depths and temperatures along the sliding at {chosen}. First pressures far beyond "
    "all later ones have a panel of their own.",
    "cuts_across": "Pressure, worn depths and temperatures across the sliding at {chosen}. First pressures far beyond "
    "all later ones have a panel of their own.",
    "loops": "Fretting loops: (a) tangential force over the displacement of the strip, a loop for each cycle named, "
    "and (b) over what of it is more than full stick's at the same force.",
    "zones": "Where the surfaces stick and slip over the time steps of the first and of the last cycle.",
    "tractions": "Tangential traction along the sliding at five times of (a) the first and (b) the last cycle, between "
    "plus and minus µ p (grey: of the cycle's largest pressure).",
    "traction_map": "Size and direction of the tangential traction at four times of the first and of the last cycle.",
    "sliding": "Slip of each place in a cycle, and its work of friction.",
    "energy": "(a) Work of friction in a cycle and (b) its ratio to the loop's box, with the border of gross sliding, "
    "over the {axis}.",
    "stress_range": "Stress along the sliding in the strip's surface: the largest in a cycle, dotted the smallest.",
}
WEAR_MAPS = "Maps of the worn depth of the punch over its largest at {chosen}, which is told above each."
BETWEEN_MAPS = "Maps of what lies between the surfaces at {chosen}: {between}."


def _each(history: xarray.Dataset) -> str:
    """Say where cuts are of several contacts of a solid."""
    places = cut_places(history) if model_of(history) == "solid" else []
    return "Each contact through the middle of its own wear." if len(places) > 1 else ""


def caption(name: str, history: xarray.Dataset, look: Style) -> str:
    """Return the caption of a figure of a run."""
    bodies = [body for body, end in BODIES.items() if f"wear{end}" in history]
    words, moves = direction_words(history), strip_moves(history)
    moving = "turning" if "turns" in moves else "moving"
    ways = {d: f"the strip {moving} {word}" for d, word in words.items()}
    present = [text for d, text in ways.items() if bool((history.direction == d).any())]
    panels = ", ".join(f"({letter}) {text}" for letter, text in zip("ab", present, strict=False))
    if len(present) == 1:
        panels = present[0]
    axis = {"cycles": "cycles", "distance": "sliding distance", "time": "time"}[look.axis]
    chosen = {"cycles": "the cycles named", "distance": "the sliding distances named", "time": "the times named"}
    text = WEAR_MAPS if name == "wear_map" and model_of(history) == "solid" else TEXTS.get(name, BETWEEN_MAPS)
    told = text.format(
        bodies=" and ".join(f"the {body}" for body in bodies),
        chosen=chosen[look.axis],
        panels=panels,
        size="width" if "contact_width" in history else "area",
        axis=axis,
        hot=" and largest temperature of the contact surfaces" if "largest_temperature" in history else "",
        back=f"{moves.removeprefix('strip ')} {words[-1]}",
        last=f"{int(history.half_cycle[-1]):,}",
        between=lies_between(history).get(name.removesuffix("_map"), "").partition(" (")[0],
    )
    if name in ALONG and (sides := sides_of(history)) is not None:
        told += f" Solid: the contact {sides[0]}; dotted: {sides[1]}."
    return f"{told} {_each(history)}".strip() if name.startswith("cuts") else told
