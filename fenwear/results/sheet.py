"""Numbers of a tribometer's sheet, of every half-cycle and of a whole run: volumes, rates, scars, forces, work.

Depths belong to the shape, all else to what has been added up, see `fenwear.steps.run_state`:

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

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.case.body_names import Names
from fenwear.common.arrays import Array
from fenwear.results.history_surfaces import ScarGeometry, scar_geometry, without_noise
from fenwear.results.quantity import BODIES, RECORD, InTable, Quantity, numbers
from fenwear.steps import Block
from fenwear.system import Bodies, ContactSetup

SHARES = {"": 0.01, "_5_percent": 0.05}  # of the largest depth, where widths are read, and how their names end
ROUND, NEARLY = "diameter", 1.1  # what a scar has that is round: its length and width differ by a tenth at most
PLACES = {**{axis: axis for axis in "rxyz"}, "across": "place across the sliding"}
WEAR_RATE = "mm3/(N m)"
UNCERTAINTY, WITHIN = "uncertainty", "... numerical uncertainty"
ROUNDING = 1e-9  # share of a number below which its uncertainty is zero
COLUMN = 12  # characters of a column of the printed sheet


def _over(above: Array, below: Array, otherwise: Array | float = np.nan) -> Array:
    """Return the quotient, or another value where nothing slides or presses."""
    return np.where(below > 0, above, otherwise) / np.where(below > 0, below, 1.0)


def _integral(records: Any) -> Array:
    """Return the integral of the pressure over the contact (k,), N."""
    pair, thickness = records.system.pair, records.system.bodies.punch.thickness
    return np.asarray(thickness * (records.pressure * pair.weights).sum(axis=1))


def _contact_area(records: Any) -> Array:
    """Return the area in contact (k,), mm²."""
    return np.asarray(records.contact_width * records.system.bodies.punch.thickness)


def _angles(records: Any) -> Array:
    """Return the angle of each half-cycle (k,), rad."""
    motion = records.system.motion
    each = np.array([phase.distance for phase in motion.phases]).reshape(motion.half_cycles, -1).sum(axis=1)
    return np.asarray(each[(records.half_cycle - 1) % motion.half_cycles])


CONTACT = (
    Quantity("largest_pressure", RECORD, "MPa", "largest contact pressure", lambda b: b.pressure.max(axis=1),
             "largest", steady=True, nodal=True),
    Quantity("contact_area", RECORD, "mm2", "area in contact", _contact_area, "largest", steady=True, nodal=True),
    Quantity("mean_pressure", RECORD, "MPa", "mean contact pressure over the area in contact",
             lambda b: _over(_integral(b), _contact_area(b), 0.0), "largest", steady=True, nodal=True),
)  # fmt: skip
SLIDING = (
    Quantity("cycles", RECORD, "1", "cycles done", lambda b: b.half_cycle / b.system.motion.half_cycles, of="sliding"),
    Quantity("sliding_distance", RECORD, "mm", "sliding distance from the start, mean over the load",
             lambda b: b.totals.of("distance"), of="sliding"),
    Quantity("normal_force", RECORD, "N", "load: normal force of the contact, mean over the half-cycle",
             lambda b: _over(b.adds.of("load_distance"), b.adds.of("distance"), b.load),  # at rest: what rests
             "mean", steady=True, of="sliding"),
    Quantity("pressure_integral", RECORD, "N", "integral of the pressure over the contact, mean over the half-cycle; "
             "more than the load on curved contacts", _integral, "mean", steady=True, nodal=True, of="sliding"),
    Quantity("friction_force", RECORD, "N",
             "friction force: resultant of friction, mean over the distance slid in the half-cycle",
             lambda b: _over(b.adds.of("drag_distance"), b.adds.of("distance"), 0.0), "mean", steady=True,
             of="sliding"),
    Quantity("friction_coefficient", RECORD, "1", "friction coefficient: mean over the sliding of the pressure",
             lambda b: _over(b.adds.of("work"), b.adds.of("load_path"), 0.0), "mean", steady=True,
             of="sliding"),
    Quantity("friction_work", RECORD, "mJ", "work of friction from the start", lambda b: b.totals.of("work"),
             of="sliding"),
    Quantity("mean_friction_coefficient", RECORD, "1", "friction coefficient from the start: mean over the sliding of "
             "the pressure", lambda b: _over(b.totals.of("work"), b.totals.of("load_path")), of="sliding"),
    Quantity("friction_over_load", RECORD, "1", "work of friction from the start over load and sliding distance",
             lambda b: _over(b.totals.of("work"), b.totals.of("load_distance")), of="sliding"),
    Quantity("largest_energy", RECORD, "mJ/mm2", "largest work of friction per area from the start",
             lambda b: b.totals.energy.max(axis=1), nodal=True, of="sliding"),
    Quantity("dissipated_energy", ("half_cycle", "x"), "mJ/mm2", "work of friction per area from the start",
             lambda b: b.totals.energy, nodal=True),
    Quantity("pressure_sum", ("half_cycle", "x"), "MPa", "pressure added up over the half-cycles from the start: over "
             "their number the difference of two is the mean", lambda b: b.totals.pressure, nodal=True),
)  # fmt: skip
TURNING = (
    Quantity("friction_torque", RECORD, "N mm", "torque of friction about the axis, mean over the half-cycle",
             lambda b: _over(b.adds.of("work"), _angles(b), 0.0), "mean", steady=True, of="sliding"),
)  # fmt: skip


def of_a_body(body: str) -> tuple[Quantity, ...]:
    """Return the quantities of the wear of a body."""
    end, volume, mass = BODIES[body], f"volume_{body}", f"mass_{body}"

    def rate(which: str, path: str) -> Callable[[Any], Array]:
        return lambda b: 1e3 * _over(getattr(b, which).of(volume), getattr(b, which).of(path))

    rates = (
        ("wear_rate", f"specific wear rate of the {body} in the half-cycle, over load and sliding distance", "adds",
         "load_distance"),
        ("mean_wear_rate", f"specific wear rate of the {body} from the start, over load and sliding distance", "totals",
         "load_distance"),
        ("law_wear_rate", f"specific wear rate of the {body} in the half-cycle, over the sliding of the pressure: that "
         "of the law", "adds", "load_path"),
        ("mean_law_wear_rate", f"specific wear rate of the {body} from the start, over the sliding of the pressure: "
         "that of the law", "totals", "load_path"),
    )  # fmt: skip
    return (
        Quantity(f"worn_volume{end}", RECORD, "mm3", f"volume worn off the {body} from the start",
                 lambda b: b.totals.of(volume), nodal=True, of=body),
        Quantity(f"worn_volume_increment{end}", RECORD, "mm3", f"volume worn off the {body} in the half-cycle",
                 lambda b: b.adds.of(volume), "sum", steady=True, nodal=True),
        Quantity(f"worn_mass{end}", RECORD, "mg", f"mass worn off the {body} from the start",
                 lambda b: b.totals.of(mass), of=body),
        *(
            Quantity(f"{name}{end}", RECORD, WEAR_RATE, text, rate(which, path), of=body)
            for name, text, which, path in rates
        ),
        Quantity(f"largest_depth{end}", RECORD, "mm", f"largest worn depth of the {body} at the end of the half-cycle",
                 lambda b: _depth(b, body).max(axis=1), nodal=True, of=body),
    )  # fmt: skip


def of_a_plane_body(body: str) -> tuple[Quantity, ...]:
    """Return the quantities of a body's wear in a cross-section."""

    def over_thickness(which: str) -> Callable[[Any], Array]:
        return lambda b: getattr(b, which).of(f"volume_{body}") / b.system.bodies.punch.thickness

    end = BODIES[body]
    return (
        Quantity(f"worn_area{end}", RECORD, "mm2", f"cross-section worn off the {body} from the start",
                 over_thickness("totals"), nodal=True, of=body),
        Quantity(f"worn_area_increment{end}", RECORD, "mm2", f"cross-section worn off the {body} in the half-cycle",
                 over_thickness("adds"), "sum", steady=True, nodal=True),
    )  # fmt: skip


def of_the_scar(body: str, along: Iterable[str], extents: Iterable[str]) -> tuple[Quantity, ...]:
    """Return where the scar of a body is deepest, and its extents by their names."""
    end, scar = BODIES[body], SCARS[body]
    texts = {"length": "along the sliding", "width": "along the contact" if tuple(along) == ("x",) else
             "across the sliding"}  # fmt: skip
    return (
        *(
            Quantity(f"largest_depth_at_{axis}{end}", RECORD, "mm", f"where the worn depth of the {body} is largest, "
                     f"{PLACES[axis]}", InTable(scar, f"largest_depth_at_{axis}"), nodal=True,
                     of=body)
            for axis in along
        ),
        *(
            Quantity(f"scar_{name}{share}{end}", RECORD, "mm", f"{name} of the {body}'s scar {texts[name]} at "
                     f"{100 * SHARES[share]:g} % of its largest depth", InTable(scar, f"scar_{name}{share}"),
                     nodal=True, of=body)
            for name in extents
            for share in SHARES
        ),
    )  # fmt: skip


def _depth(records: Any, body: str) -> Array:
    """Return the worn depth of a body (k, n), mm."""
    return np.asarray(getattr(records, f"wear{BODIES[body]}"))


def _scar(records: Any, body: str) -> dict[str, Array]:
    """Return where the scars of a body are deepest, and how far they reach (k,), mm."""
    system = records.system
    surface, depth = getattr(system.pair, body), _depth(records, body)
    geometry, deepest = scar_geometry(system, surface), depth.argmax(axis=1)
    return {
        **{f"largest_depth_at_{axis}": x[deepest] for axis, x in places(system, surface, geometry).items()},
        **{
            f"scar_{name}{end}": extent
            for end, share in SHARES.items()
            for name, extent in geometry.extents(depth, share).items()
        },
    }


SCARS: Mapping[str, Callable[[Any], Mapping[str, Array]]] = {body: partial(_scar, body=body) for body in BODIES}


def quantities(placed: ContactSetup) -> list[Quantity]:
    """Return the quantities of the sheet: of the bodies that wear, masses where a density is known."""
    sliding_quantities = [*SLIDING, *(TURNING if turns(placed) else ())]
    return [*sliding_quantities, *(quantity for body in BODIES for quantity in of_body(placed, body))]


def of_body(placed: ContactSetup, body: str) -> list[Quantity]:
    """Return the quantities of a body that wears; none of another."""
    number = list(BODIES).index(body)
    if not placed.sliding.wear[number].wears:
        return []
    geometry = scar_geometry(placed, surface := getattr(placed.pair, body))
    weighed = placed.bodies.densities[number] is not None
    return [
        *(of_a_plane_body(body) if _is_plane(placed.bodies) else ()),
        *(quantity for quantity in of_a_body(body) if weighed or "mass" not in quantity.name),
        *of_the_scar(body, places(placed, surface, geometry), geometry.names),
    ]


def places(placed: ContactSetup, surface: ContactSurface, geometry: ScarGeometry) -> dict[str, Array]:
    """Return the coordinates by which the deepest place of a scar is given, by name: coordinates of the nodes (n,), mm.

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
    return ("x",) if _is_plane(placed.bodies) else ("r",)


def _is_plane(bodies: Bodies) -> bool:
    return bodies.punch.law.kind in ("stress", "strain")


def turns(placed: ContactSetup) -> bool:
    """Return whether the strip turns, so that friction has a torque."""
    return any(placed.sliding.field.turn) and not placed.motion.steps


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
    "mean_friction_coefficient": Line("friction coefficient, mean", ""),
    "friction_coefficient": Line("... in the last half-cycle", ""),
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
    "nominal_pressure_MPa": Line("nominal pressure: load over the projected area", "MPa"),
    "largest_pressure_in_cycle_MPa": Line("largest pressure at any time of the last cycle", "MPa"),
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
    "worn_through_of_scar": Line("coating worn through, share of the scar", "%", 100),
    "worn_through_of_surface": Line("... of the coated surface", "%", 100),
    "least_coating_mm": Line("... least that is left", "µm", 1e3),
    "creep_volume_mm3": Line("crept volume, apart from wear", "mm³"),
    "largest_creep_depth_mm": Line("... depth, largest", "µm", 1e3),
    "roughness_Sa_mm": Line("roughness Sa where it has worn, without its form", "µm", 1e3),
    "roughness_Sq_mm": Line("... Sq", "µm", 1e3),
    "creep_volume_layer_mm3": Line("crept volume of the layer", "mm³"),
    "largest_creep_depth_layer_mm": Line("... depth, largest", "µm", 1e3),
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
    "mean_pressure_MPa": Line("mean pressure over the area in contact", "MPa"),
    "contact_width_mm": Line("width in contact", "mm"),
    "contact_area_mm2": Line("area in contact", "mm²"),
    "nodes_across_contact": Line("nodes across the contact", ""),
    "nodes_along_sliding": Line("nodes across it, along the sliding", ""),
    "nodes_across_sliding": Line("... across the sliding", ""),
}


def body_numbers(records: Block, body: str, known: Iterable[Quantity]) -> dict[str, float]:
    """Return the wear and other numbers of a body at the end of a run; none of a body that does not wear."""
    values = numbers(records, body, known)
    return values | _diameters(values)


def _diameters(values: Mapping[str, float]) -> dict[str, float]:
    """Return the diameters of a scar that is as long as it is wide, within a tenth: the means of both, mm."""
    keys = [f"scar_{{}}{end}_mm" for end in SHARES]
    both = {key.format(ROUND): [values.get(key.format(name), 0.0) for name in ("length", "width")] for key in keys}
    return {key: sum(extents) / 2 for key, extents in both.items() if 0 < max(extents) <= NEARLY * min(extents)}


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
        tables = next(([table] for table in (summary.get("sliding", {}), heat, summary) if key in table), bodies)
        if any(key in table for table in tables):
            rows.append((line.label, line.unit, [shown(table.get(key), line) for table in tables]))
            rows += _within(key, line, of_bodies if tables is bodies else [uncertain], tables)
    for name, state in summary.get("states", {}).items():
        unit = "" if state["unit"] == "1" else state["unit"]
        labels = (f"{name.replace('_', ' ')}, mean", "... smallest", "... largest")
        rows += [
            (label, unit, [state[key]]) for label, key in zip(labels, ("mean", "smallest", "largest"), strict=True)
        ]
    return rows


def _within(
    key: str, line: Line, uncertain: Sequence[Mapping[str, Any]], tables: Sequence[Mapping[str, Any]]
) -> list[tuple[str, str, list[float | None]]]:
    """Return the line below one of the sheet that says how uncertain its numbers are; none where that is not known."""
    if not any(key in table for table in uncertain):
        return []
    pairs = zip(uncertain, tables, strict=True)
    return [(WITHIN, line.unit, [_two_digits(shown(by.get(key), line), shown(of.get(key), line)) for by, of in pairs])]


def _two_digits(value: float | None, of: float | None) -> float | None:
    """Return an uncertainty in two digits, zero where it is rounding of the number that it is of."""
    if value is None or not np.isfinite(value):
        return value
    return 0.0 if value < ROUNDING * abs(of or 0.0) else float(f"{value:.1e}")


def shown(value: Any, line: Line) -> Any:
    """Return a value of the summary in the unit in which it is read."""
    return value if value is None or line.factor == 1 else line.factor * value


def sheet_text(summary: Mapping[str, Any]) -> str:
    """Return the sheet of a summary as lines for people: of the sliding, of the bodies, and of the contact each way."""
    names = Names(**summary.get("names", {}))
    bodies = [names.by_roles[body] for body in BODIES if body in summary]
    ways = [name for name, table in summary.items() if isinstance(table, Mapping) and "largest_pressure_MPa" in table]
    uncertain = [summary.get(UNCERTAINTY, {}).get(way, {}) for way in ways]
    rows, contact = sheet_rows(summary), list[Any]()
    for key, line in OF_CONTACT.items():
        if any(key in summary[way] for way in ways):
            contact.append((line.label, line.unit, [shown(summary[way].get(key), line) for way in ways]))
            contact += _within(key, line, uncertain, [summary[way] for way in ways])
    first = next((k for k, (label, _, _) in enumerate(rows) if label.startswith("worn ")), len(rows))
    tables = [
        (heads, [(names.with_names(Line(label, unit).heading), values) for label, unit, values in table])
        for heads, table in (([], rows[:first]), (bodies, rows[first:]), (ways, contact))
    ]
    wide = max((len(label) for _, table in tables for label, _ in table), default=0)
    return "\n".join(columns_text(heads, table, wide) for heads, table in tables if table)


def columns_text(names: Sequence[str], rows: Sequence[tuple[str, Sequence[float | None]]], wide: int = 0) -> str:
    """Return rows of numbers with their labels as lines, under the names of their columns; "" without rows."""
    wide = max((wide, *(len(label) for label, _ in rows)))
    column = max((COLUMN, *map(len, names)))
    head = [("", names)] if names else []
    table = [*head, *((label, [_number(value) for value in row]) for label, row in rows)] if rows else []
    return "\n".join(f"{label:{wide}}" + "".join(f"  {cell:>{column}}" for cell in cells) for label, cells in table)


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "-"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:,.0f}" if 1e5 <= abs(value) < 1e12 else f"{value:,.5g}"
