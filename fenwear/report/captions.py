"""What stands below each figure: in figures/captions.txt and in the report."""

from __future__ import annotations

import xarray

from fenwear.report.style import Look, direction_words, strip_moves
from fenwear.report.surface import model_of, surface_of
from fenwear.results.sheet import BODIES

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
    "peaks": "Largest contact pressure and width in contact{hot}, for each sliding direction, over the {axis}; "
    "grey: the largest of the mean pressure over the last tenth of what is done.",
    "place": "The shaft in its bore: (a) the way from the middle of the unworn bore to that of the unworn shaft, (b) "
    "its size and (c) its angle from the way in which the load presses the shaft, as the strip turns, over the {axis}.",
    "volume": "(a) Worn volume and (b) specific wear rate, of the half-cycle (current) and from the start (mean), over "
    "the sliding distance.",
    "scar": "(a) Largest worn depth and (b) width of the scar at 1 % and 5 % of it, over the {axis}.",
    "friction": "(a) Normal force and friction force of each half-cycle and (b) work of friction from the start, over "
    "the {axis}.",
    "convergence": "(a) Largest change of pressure against one cycle ago and (b) largest difference to the optimal "
    "pressure, both over the pressure scale (integral of p² over integral of p), over the {axis}.",
    "temperature": "Temperature along the contact surfaces of (a) the punch and (b) the strip at {chosen}.",
    "heat_balance": "Heat of each half-cycle over the {axis}: what friction makes is the sum of the others.",
    "boundary_temperature": "Temperature (a) round the punch from the middle of its contact on, corners by (x, z) in "
    "mm, and (b) along the strip's upper surface, grey under the punch, at half-cycle {last}.",
    "surface_stress": "Stress along the contact surface of (a) the punch and (b) the strip at half-cycle {last}: its "
    "components and von Mises' stress.",
    "program": "What acted over the run: load, sliding speed and ambient temperature, where they change.",
}

OF_SURFACES = {  # of solids and rings
    "shape": "Worn depth of the punch, and of the strip where it wears, in micrometres along the "
    "contact, a line for each chosen half-cycle.",
    "pressure": "Contact pressure in megapascals along the contact, a panel for each sliding direction, a "
    "line for each chosen half-cycle. First states far beyond all later ones have the last panel.",
    "mean_pressure": "Mean contact pressure of all sliding directions in the last tenth of what is done, along the "
    "contact, a line for each of these half-cycles.",
    "peaks": "Largest pressure, area in contact, largest worn depth, size of the scar along and across the sliding "
    "and, with heat, largest temperature of the contact surfaces at the end of a half-cycle, over the run.",
    "program": "Load, sliding speed and ambient temperature over the run, where they change.",
    "convergence": "Change of pressure against one cycle ago, and distance to the optimal pressure, over the "
    "half-cycles.",
    "temperature": "Temperature of the contact surfaces of punch and strip along the contact, a line for each "
    "chosen half-cycle.",
    "boundary_temperature": "Temperature round the punch from the middle of its contact on, and along the strip's "
    "upper surface, at the last half-cycle with fields.",
    "pressure_map": "Maps of the contact pressure in megapascals, one for each chosen half-cycle, with the way of the "
    "strip, the border of contact and the largest value. Colours end where late states do.",
    "wear_map": "Maps of the worn depth of the punch over its largest, one for each chosen half-cycle.",
    "wear_strip_map": "Maps of the worn depth of the strip over its largest, one for each chosen half-cycle.",
    "temperature_map": "Maps of the temperature of the punch's contact surface, one for each chosen half-cycle.",
    "temperature_strip_map": "Maps of the temperature of the strip's surface below the punch, one for each chosen "
    "half-cycle.",
    "cuts_along": "Pressure, worn depths and temperatures along the sliding, a line for each chosen half-cycle. "
    "First pressures far beyond all later ones have the last panel.",
    "cuts_across": "Pressure, worn depths and temperatures across the sliding, a line for each chosen half-cycle. "
    "First pressures far beyond all later ones have the last panel.",
    "heat_balance": "Heat of each half-cycle: made by friction, lost, and gained by the bodies, over the half-cycles.",
}


OF_SURFACES["place"] = TEXTS["place"].format(axis="run")


def _first_part(history: xarray.Dataset) -> str:
    """Say which contact of a solid the cuts are of, where its parts lie behind each other."""
    surface = surface_of(history) if model_of(history) == "solid" else None
    if surface is None or not surface.overlaps:
        return ""
    return "Of the first part." if surface.contact is None else f"Of the contact {surface.contact[0]}."


def caption(name: str, history: xarray.Dataset, look: Look) -> str:
    """Return the caption of a figure of a run."""
    if name not in TEXTS or model_of(history) != "plane":
        text = OF_SURFACES.get(name, name.replace("_", " "))
        return f"{text} {_first_part(history)}".strip() if name.startswith("cuts") else text
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
    return TEXTS[name].format(
        bodies=" and ".join(f"the {body}" for body in bodies),
        chosen=chosen[look.axis],
        panels=panels,
        axis=axis,
        hot=" and largest temperature of the contact surfaces" if "max_temperature" in history else "",
        back=f"{moves.removeprefix('strip ')} {words[-1]}",
        last=f"{int(history.half_cycle[-1]):,}",
    )
