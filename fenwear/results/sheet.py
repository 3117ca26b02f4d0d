"""What stands on a tribometer's sheet, of every half-cycle and of a whole run: volumes, rates, scars, forces, work.

Depths belong to the shape, all else to what has been added up, see `fenwear.cycle.totals`:

    normal force         F, the load: what the contact carries along the approach of the bodies, mean of the half-cycle;
    pressure integral    of p over the contact, mean of the half-cycle: more than F where the contact is curved;
    friction force       the resultant of friction, mean of the half-cycle;
    friction torque      of a turning strip about its axis: work of friction over the angle;
    specific wear rate   k = dV / (F ds), volume over load and sliding distance, of the half-cycle (current) or from
                         the start (mean), as tribometers' sheets have it;
    ... of the law       volume over the integral of p ds over the contact: beta~ where a = b = 1, on any surface.

In the plane worn area is volume over thickness.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Any, NamedTuple

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import ContactSetup
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case.names import Names
from fenwear.cycle import Block
from fenwear.results import coating, creep, roughness, table_cycle
from fenwear.results.scar import ScarGeometry, scar_geometry
from fenwear.results.zone import without_noise

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name
BODIES = {"punch": "", "strip": "_strip"}  # and how the names of their variables end
SHARES = {"": 0.01, "_5_percent": 0.05}  # of the largest depth, where widths are read, and how their names end
ROUND, NEARLY = "diameter", 1.1  # what a scar has that is round: its length and width differ by a tenth at most
PLACES = {**{axis: axis for axis in "rxyz"}, "across": "place across the sliding"}
WEAR_RATE = "mm3/(N m)"
UNCERTAINTY, WITHIN = "uncertainty", "... numerical uncertainty"
COLUMN = 12  # characters of a column of the printed sheet

SLIDING: dict[str, Variable] = {
    "cycles": (("half_cycle",), "1", "cycles done"),
    "sliding_distance": (("half_cycle",), "mm", "sliding distance from the start, mean over the load"),
    "normal_force": (("half_cycle",), "N", "load: normal force of the contact, mean over the half-cycle"),
    "pressure_integral": (
        ("half_cycle",),
        "N",
        "integral of the pressure over the contact, mean over the half-cycle; more than the load on curved contacts",
    ),
    "friction_force": (
        ("half_cycle",),
        "N",
        "friction force: resultant of friction, mean over what is slid in the half-cycle",
    ),
    "friction_work": (("half_cycle",), "mJ", "work of friction from the start"),
    "dissipated_energy": (("half_cycle", "x"), "mJ/mm2", "work of friction per area from the start"),
    "pressure_sum": (
        ("half_cycle", "x"),
        "MPa",
        "pressure added up over the half-cycles from the start: over their number the difference of two is the mean",
    ),
}
TURNING: dict[str, Variable] = {
    "friction_torque": (("half_cycle",), "N mm", "torque of friction about the axis, mean over the half-cycle"),
}
OF_A_BODY: dict[str, Variable] = {
    "worn_area": (("half_cycle",), "mm2", "cross-section worn off the {body} from the start"),
    "worn_volume": (("half_cycle",), "mm3", "volume worn off the {body} from the start"),
    "worn_mass": (("half_cycle",), "mg", "mass worn off the {body} from the start"),
    "wear_rate": (
        ("half_cycle",),
        WEAR_RATE,
        "specific wear rate of the {body} in the half-cycle, over load and sliding distance",
    ),
    "mean_wear_rate": (
        ("half_cycle",),
        WEAR_RATE,
        "specific wear rate of the {body} from the start, over load and sliding distance",
    ),
    "law_wear_rate": (
        ("half_cycle",),
        WEAR_RATE,
        "specific wear rate of the {body} in the half-cycle, over the sliding of the pressure: that of the law",
    ),
    "mean_law_wear_rate": (
        ("half_cycle",),
        WEAR_RATE,
        "specific wear rate of the {body} from the start, over the sliding of the pressure: that of the law",
    ),
    "largest_depth": (("half_cycle",), "mm", "largest worn depth of the {body} at the end of the half-cycle"),
}


def variables(placed: ContactSetup) -> dict[str, Variable]:
    """Return the variables of the sheet: of the bodies that wear, masses where a density is known."""
    found, plane = {**SLIDING, **(TURNING if turns(placed) else {})}, _is_plane(placed)
    surfaces = (placed.pair.punch, placed.pair.strip)
    for (body, end), surface, law, density in zip(
        BODIES.items(), surfaces, placed.sliding.wear, placed.bodies.densities, strict=True
    ):
        if law is None:
            continue
        missing = {"worn_area": not plane, "worn_mass": density is None}
        own = {name: variable for name, variable in OF_A_BODY.items() if not missing.get(name)}
        geometry = scar_geometry(placed, surface)
        own |= of_the_scar(tuple(places(placed, surface, geometry)), geometry.names)
        found |= {f"{name}{end}": (over, unit, text.format(body=body)) for name, (over, unit, text) in own.items()}
    return found


def of_the_scar(along: tuple[str, ...], extents: tuple[str, ...]) -> dict[str, Variable]:
    """Return the variables of a scar: where it is deepest, and its extents by their names."""
    found: dict[str, Variable] = {
        f"largest_depth_at_{axis}": (("half_cycle",), "mm", f"where the worn depth of the {{body}} is largest, {place}")
        for axis, place in PLACES.items()
        if axis in along
    }
    way = "along the contact" if along == ("x",) else "across the sliding"
    texts = {"length": "along the sliding", "width": way}
    for name in extents:
        for end, share in SHARES.items():
            text = f"{name} of the {{body}}'s scar {texts[name]} at {100 * share:g} % of its largest depth"
            found[f"scar_{name}{end}"] = (("half_cycle",), "mm", text)
    return found


def places(placed: ContactSetup, surface: ContactSurface, geometry: ScarGeometry) -> dict[str, Array]:
    """Return what tells where on a surface a scar is deepest, by its name: coordinates of the nodes (n,), mm.

    Of what is worn all the way round in a solid that across the sliding alone, in the plane none.
    """
    if surface.dim == 3 and "length" not in geometry.names:
        return {"across": geometry.coordinates[:, 0]}
    x = without_noise(surface.x, surface.extent())
    return {axis: x[:, k] for k, axis in enumerate(axes(placed))} if geometry.names else {}


def axes(placed: ContactSetup) -> tuple[str, ...]:
    """Return the names of coordinates on the contact surface: x in the plane, r of rings, x, y and z of solids."""
    if placed.pair.punch.dim == 3:
        return ("x", "y", "z")
    return ("x",) if _is_plane(placed) else ("r",)


def _is_plane(placed: ContactSetup) -> bool:
    return placed.bodies.punch.law.kind in ("stress", "strain")


def values(block: Block) -> dict[str, Array]:
    """Return the sheet of each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, totals, adds = block.system, block.totals, block.adds
    thickness = system.bodies.punch.thickness
    found = {
        "cycles": block.half_cycle / system.motion.half_cycles,
        "sliding_distance": totals.of("distance"),
        "normal_force": _over(adds.of("load_distance"), adds.of("distance"), block.load),  # at rest: what rests
        "pressure_integral": thickness * (block.pressure * system.pair.weights).sum(axis=1),
        "friction_force": _over(adds.of("drag_distance"), adds.of("distance"), np.zeros(len(block))),
        **({"friction_torque": _over(adds.of("work"), _angles(block), np.zeros(len(block)))} if turns(system) else {}),
        "friction_work": totals.of("work"),
        "dissipated_energy": totals.energy,
        "pressure_sum": totals.pressure,
    }
    depths = ((system.pair.punch, block.wear), (system.pair.strip, block.wear_strip))
    for (body, end), law, (surface, depth) in zip(BODIES.items(), system.sliding.wear, depths, strict=True):
        if law is None:
            continue
        volume = totals.of(f"volume_{body}")
        deepest, geometry = depth.argmax(axis=1), scar_geometry(system, surface)
        own = {
            "worn_area": volume / thickness,
            "worn_volume": volume,
            "worn_mass": totals.of(f"mass_{body}"),
            "wear_rate": 1e3 * _over(adds.of(f"volume_{body}"), adds.of("load_distance")),
            "mean_wear_rate": 1e3 * _over(volume, totals.of("load_distance")),
            "law_wear_rate": 1e3 * _over(adds.of(f"volume_{body}"), adds.of("load_path")),
            "mean_law_wear_rate": 1e3 * _over(volume, totals.of("load_path")),
            "largest_depth": depth.max(axis=1),
            **{f"largest_depth_at_{axis}": x[deepest] for axis, x in places(system, surface, geometry).items()},
            **{
                f"scar_{name}{at}": extent
                for at, share in SHARES.items()
                for name, extent in geometry.extents(depth, share).items()
            },
        }
        found |= {f"{name}{end}": value for name, value in own.items()}
    return found


def turns(placed: ContactSetup) -> bool:
    """Return whether the strip turns, so that friction has a torque."""
    return any(placed.sliding.field.turn) and not placed.motion.steps


def _angles(block: Block) -> Array:
    """Return the angle of each half-cycle (k,), rad."""
    motion = block.system.motion
    each = np.array([phase.distance for phase in motion.phases]).reshape(motion.half_cycles, -1).sum(axis=1)
    return np.asarray(each[(block.half_cycle - 1) % motion.half_cycles])


def _over(above: Array, below: Array, otherwise: Array | float = np.nan) -> Array:
    """Return the quotient, or another value where nothing slides or presses."""
    return np.where(below > 0, above, otherwise) / np.where(below > 0, below, 1.0)


class Line(NamedTuple):
    """A line of the sheet: its words, the unit it is read in, and that unit over the one of its value."""

    label: str
    unit: str
    factor: float = 1.0

    @property
    def heading(self) -> str:
        """Its words with the unit."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


LINES = {
    "half_cycles": Line("half-cycles", ""),
    "cycles": Line("cycles", ""),
    "time_s": Line("time", "s"),
    "sliding_distance_mm": Line("sliding distance", "m", 1e-3),
    "normal_force_N": Line("load (normal force)", "N"),
    "pressure_integral_N": Line("integral of the pressure", "N"),
    "friction_force_N": Line("friction force", "N"),
    "friction_torque_N_mm": Line("friction torque", "N m", 1e-3),
    "friction_coefficient": Line("friction coefficient, mean", ""),
    "friction_over_load": Line("work of friction over load and distance", ""),
    "friction_work_mJ": Line("work of friction", "J", 1e-3),
    "eccentricity_mm": Line("eccentricity of the shaft in the bore", "µm", 1e3),
    "attitude_angle_deg": Line("attitude angle, as the strip turns", "degrees"),
    "largest_energy_mJ_per_mm2": Line("dissipated energy per area, largest", "J/mm²", 1e-3),
    **{
        f"{name}_{unit}": Line(f"largest temperature {when}", shown)
        for unit, shown in (("K", "K"), ("degC", "°C"))
        for name, when in (("largest_temperature", "at the end"), ("largest_temperature_of_run", "over the run"))
    },
    "largest_temperature_of_run_half_cycle": Line("... in half-cycle", ""),
    "heat_mJ.friction": Line("heat of friction in the last half-cycle", "J", 1e-3),
    "heat_mJ.debris": Line("... carried off by debris", "J", 1e-3),
    "heat_mJ.stored": Line("... gained by the bodies", "J", 1e-3),
    "heat_mJ.convected": Line("... lost to the surroundings", "J", 1e-3),
    "heat_mJ.held": Line("... lost where temperature is held", "J", 1e-3),
    "heat_mJ.carried": Line("... carried out by the strip's material", "J", 1e-3),
    "heat_mJ.into_punch": Line("of it across the contact into the punch", "J", 1e-3),
    "heat_mJ.into_strip": Line("... into the strip", "J", 1e-3),
    "largest_force_N": Line("largest tangential force in the last cycle", "N"),
    "largest_torque_N_mm": Line("largest torque in the last cycle", "N m", 1e-3),
    "largest_pressure_in_cycle_MPa": Line("largest pressure in it", "MPa"),
    "largest_traction_MPa": Line("largest tangential traction in it", "MPa"),
    "largest_stick_traction_MPa": Line("... where it sticks", "MPa"),
    "largest_surface_stress_MPa": Line("largest stress along the sliding in the strip's surface", "MPa"),
    "friction_work_of_cycle_mJ": Line("work of friction in the last cycle", "mJ"),
    "energy_ratio": Line("energy ratio of the last cycle", ""),
    "stick_width_mm": Line("width that sticks all through it", "mm"),
    "stick_width_within_mm": Line("half the interval of that width", "mm"),
    "stick_area_mm2": Line("area that sticks all through it", "mm²"),
    "stick_area_within_mm2": Line("half the interval of that area", "mm²"),
    **{
        f"{body}_coating_{key}": Line(words.format(body), unit)
        for body in ("punch", "strip")
        for key, words, unit in (
            ("first_through_half_cycle", "coating of the {} worn through first in half-cycle", ""),
            ("first_through_at_x_mm", "... at x", "mm"),
            ("first_through_at_y_mm", "... at y", "mm"),
            ("first_through_at_z_mm", "... at z", "mm"),
            ("last_through_half_cycle", "... last so far in half-cycle", ""),
        )
    },
    "shakedown_limit_MPa": Line("shakedown limit of the largest pressure", "MPa"),
    "plastic_volume_mm3": Line("plastic volume, apart from wear", "mm³"),
    "largest_plastic_depth_mm": Line("... depth, largest", "µm", 1e3),
    "debris_volume_mm3": Line("debris between the surfaces", "mm³"),
    "ejected_volume_mm3": Line("... ejected from the start", "mm³"),
    "largest_debris_thickness_mm": Line("... thickness, largest", "µm", 1e3),
    "mean_way_of_cycle_mm": Line("way slid in a cycle, mean", "mm"),
    "largest_way_of_cycle_mm": Line("... largest", "mm"),
    "worn_area_mm2": Line("worn area", "mm²"),
    "worn_volume_mm3": Line("worn volume", "mm³"),
    "worn_mass_mg": Line("worn mass", "mg"),
    "mean_wear_rate_mm3_per_N_m": Line("specific wear rate, mean", "mm³/(N m)"),
    "wear_rate_mm3_per_N_m": Line("specific wear rate, last", "mm³/(N m)"),
    "mean_law_wear_rate_mm3_per_N_m": Line("... of the law, mean", "mm³/(N m)"),
    "law_wear_rate_mm3_per_N_m": Line("... of the law, last", "mm³/(N m)"),
    "worn_volume_per_million_cycles_mm3": Line("worn volume per million cycles, last", "mm³"),
    "depth_per_million_cycles_mm": Line("largest depth per million cycles, last", "µm", 1e3),
    "mean_cross_shear": Line("cross-shear ratio, mean over the work of friction", ""),
    "largest_cross_shear": Line("... largest", ""),
    "coating_worn_through": Line("coating worn through, share of it", "%", 100),
    "least_coating_mm": Line("... least that is left", "µm", 1e3),
    "creep_volume_mm3": Line("crept volume, apart from wear", "mm³"),
    "largest_creep_depth_mm": Line("... depth, largest", "µm", 1e3),
    "roughness_Sa_mm": Line("roughness Sa where it has worn, without its form", "µm", 1e3),
    "roughness_Sq_mm": Line("... Sq", "µm", 1e3),
    "layer_creep_volume_mm3": Line("crept volume of the layer", "mm³"),
    "largest_layer_creep_depth_mm": Line("... depth, largest", "µm", 1e3),
    "largest_depth_mm": Line("largest worn depth", "µm", 1e3),
    **{f"largest_depth_at_{axis}_mm": Line(f"at {words}", "mm") for axis, words in PLACES.items()},
    **{
        f"scar_{name}{end}_mm": Line(f"scar {words} at {100 * share:g} % of the depth", "mm")
        for name, words in (("length", "length (along the sliding)"), ("width", "width"), (ROUND, "diameter"))
        for end, share in SHARES.items()
    },
}
OF_CONTACT = {
    "largest_pressure_MPa": Line("largest pressure", "MPa"),
    **{f"largest_pressure_at_{axis}_mm": Line(f"at {axis}", "mm") for axis in "rxyz"},
    "pressure_beside_largest_MPa": Line("mean of the nodes beside it", "MPa"),
    "contact_width_mm": Line("width in contact", "mm"),
    "contact_area_mm2": Line("area in contact", "mm²"),
    "nodes_across_contact": Line("nodes across the contact", ""),
    "nodes_along_sliding": Line("nodes across it, along the sliding", ""),
    "nodes_across_sliding": Line("... across the sliding", ""),
}
OF_SUMMARY = {
    "worn_area_mm2": "worn_area",
    "worn_volume_mm3": "worn_volume",
    "worn_mass_mg": "worn_mass",
    "mean_wear_rate_mm3_per_N_m": "mean_wear_rate",
    "wear_rate_mm3_per_N_m": "wear_rate",
    "mean_law_wear_rate_mm3_per_N_m": "mean_law_wear_rate",
    "law_wear_rate_mm3_per_N_m": "law_wear_rate",
    "largest_depth_mm": "largest_depth",
    **{f"largest_depth_at_{axis}_mm": f"largest_depth_at_{axis}" for axis in PLACES},
    **{f"scar_{name}{end}_mm": f"scar_{name}{end}" for name in ("length", "width") for end in SHARES},
}


def sheet(last: Block) -> dict[str, Any]:
    """Return the sheet at the end of a run, for summary.json: of the sliding, and of each body that wears."""
    known, row = variables(last.system), {name: value[-1] for name, value in values(last).items()}
    path, carried = (float(last.totals.of(name)[-1]) or np.nan for name in ("load_path", "load_distance"))
    found: dict[str, Any] = {
        "sliding": {
            "half_cycles": int(last.half_cycle[-1]),
            "cycles": float(row["cycles"]),
            "time_s": float(last.time[-1]),
            "sliding_distance_mm": float(row["sliding_distance"]),
            "normal_force_N": float(row["normal_force"]),
            "pressure_integral_N": float(row["pressure_integral"]),
            "friction_force_N": float(row["friction_force"]),
            **({"friction_torque_N_mm": float(row["friction_torque"])} if turns(last.system) else {}),
            "friction_coefficient": float(row["friction_work"]) / path,
            "friction_over_load": float(row["friction_work"]) / carried,
            "friction_work_mJ": float(row["friction_work"]),
            "largest_energy_mJ_per_mm2": float(row["dissipated_energy"].max()),
            **table_cycle.sliding_numbers(last),
        }
    }
    for body, end in BODIES.items():
        own = {key: float(row[f"{name}{end}"]) for key, name in OF_SUMMARY.items() if f"{name}{end}" in known}
        if own:
            own |= _diameters(own) | table_cycle.body_numbers(last, body)
        rooms = (creep, coating, roughness)
        if own := reduce(or_, (room.body_numbers(last, body) for room in rooms), own):
            found[body] = own
    return found


def _diameters(own: Mapping[str, float]) -> dict[str, float]:
    """Return the diameters of a scar that is as long as it is wide, within a tenth: the means of both, mm."""
    keys = [f"scar_{{}}{end}_mm" for end in SHARES]
    both = {key.format(ROUND): [own.get(key.format(name), 0.0) for name in ("length", "width")] for key in keys}
    return {key: sum(one) / 2 for key, one in both.items() if 0 < max(one) <= NEARLY * min(one)}


def sheet_rows(summary: Mapping[str, Any]) -> list[tuple[str, str, list[float | None]]]:
    """Return the lines of a sheet: words, unit, and a value in it for the sliding or for punch and strip.

    Args:
        summary: Of a run, with what `sheet` gave.
    """
    bodies = [summary[body] for body in BODIES if body in summary]
    heat = {f"heat_mJ.{term}": value for term, value in summary.get("heat_mJ", {}).items() if value}
    rows = []
    uncertain = summary.get(UNCERTAINTY, {})
    of_bodies = [uncertain.get(body, {}) for body in BODIES if body in summary]
    for key, line in LINES.items():
        found = next(([one] for one in (summary.get("sliding", {}), heat, summary) if key in one), bodies)
        if any(key in one for one in found):
            rows.append((line.label, line.unit, [shown(one.get(key), line) for one in found]))
            rows += _within(key, line, of_bodies if found is bodies else [uncertain])
    for name, state in summary.get("states", {}).items():
        unit = "" if state["unit"] == "1" else state["unit"]
        labels = (f"{name.replace('_', ' ')}, mean", "... smallest", "... largest")
        rows += [
            (label, unit, [state[key]]) for label, key in zip(labels, ("mean", "smallest", "largest"), strict=True)
        ]
    return rows


def _within(key: str, line: Line, uncertain: Sequence[Mapping[str, Any]]) -> list[tuple[str, str, list[float | None]]]:
    """Return the line below one of the sheet that says how uncertain its numbers are; none where that is not known."""
    if not any(key in one for one in uncertain):
        return []
    return [(WITHIN, line.unit, [_two_digits(shown(one.get(key), line)) for one in uncertain])]


def _two_digits(value: float | None) -> float | None:
    return value if value is None or not np.isfinite(value) else float(f"{value:.1e}")


def shown(value: Any, line: Line) -> Any:
    """Return a value of the summary in the unit in which it is read."""
    return value if value is None or line.factor == 1 else line.factor * value


def sheet_text(summary: Mapping[str, Any]) -> str:
    """Return the sheet of a summary as lines for people."""
    rows, names = sheet_rows(summary), Names(**summary.get("names", {}))
    bodies = [names.by_roles[body] for body in BODIES if body in summary]
    ways = [name for name, one in summary.items() if isinstance(one, Mapping) and "largest_pressure_MPa" in one]
    uncertain = [summary.get(UNCERTAINTY, {}).get(way, {}) for way in ways]
    contact = []
    for key, line in OF_CONTACT.items():
        if any(key in summary[way] for way in ways):
            contact.append((line.label, line.unit, [shown(summary[way].get(key), line) for way in ways]))
            contact += _within(key, line, uncertain)
    labels = [names.told(f"{label} ({unit})" if unit else label) for label, unit, _ in (*rows, *contact)]
    wide = max(map(len, labels), default=0)
    lines = []
    for label, (_, _, row) in zip(labels, (*rows, *contact), strict=True):
        lines.append(f"{label:{wide}}" + "".join(f"  {_number(value):>{COLUMN}}" for value in row))
    first = next((k for k, label in enumerate(labels) if label.startswith("worn ")), len(rows))
    heads = [" " * wide + "".join(f"  {name:>{COLUMN}}" for name in names) for names in (bodies, ways)]
    told = [*lines[:first], heads[0], *lines[first : len(rows)]]
    return "\n".join([*told, heads[1], *lines[len(rows) :]] if contact else told)


def columns_text(names: Sequence[str], rows: Sequence[tuple[str, Sequence[float | None]]]) -> str:
    """Return rows of numbers with their labels as lines, under the names of their columns; "" without rows."""
    wide = max((len(label) for label, _ in rows), default=0)
    column = max((len(name) for name in names), default=0)
    column = max(column, COLUMN)
    told = [(" " * wide, names), *((f"{label:{wide}}", [_number(value) for value in row]) for label, row in rows)]
    return "\n".join(label + "".join(f"  {cell:>{column}}" for cell in cells) for label, cells in told) if rows else ""


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "-"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:,.0f}" if 1e5 <= abs(value) < 1e12 else f"{value:,.5g}"
