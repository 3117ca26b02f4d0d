"""What stands on a tribometer's sheet, of every half-cycle and of a whole run: volumes, rates, scars, forces, work.

Depths belong to the shape, all else to what has been added up, see `fenwear.cycle.totals`:

    specific wear rate   k = dV / (F ds), volume over load path, of the half-cycle (current) or from the start (mean);
    normal force         F = integral of p cos(slope) over the contact, in the middle of the half-cycle, the slope
                         of the surface against the sliding: along a worn scar the load, too;
    friction force       work of friction in the half-cycle over its sliding distance.

In the plane worn area is volume over thickness.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Placed
from fenwear.cycle import Block
from fenwear.results.scar import scar_geometry

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name
BODIES = {"punch": "", "strip": "_strip"}  # and how the names of their variables end
SHARES = {"": 0.01, "_5": 0.05}  # of the largest depth, where widths are read, and how their names end
WEAR_RATE = "mm3/(N m)"
PLACES = 9  # of a place in mm: the middle is 0, not what rounding of a mesh leaves of it

SLIDING: dict[str, Variable] = {
    "cycles": (("half_cycle",), "1", "cycles done"),
    "sliding_distance": (("half_cycle",), "mm", "sliding distance from the start, mean over the load"),
    "normal_force": (("half_cycle",), "N", "normal force of the contact in the middle of the half-cycle"),
    "friction_force": (("half_cycle",), "N", "friction force, mean over the half-cycle"),
    "friction_work": (("half_cycle",), "mJ", "work of friction from the start"),
    "dissipated_energy": (("half_cycle", "x"), "mJ/mm2", "work of friction per area from the start"),
}
OF_A_BODY: dict[str, Variable] = {
    "total_area": (("half_cycle",), "mm2", "cross-section worn off the {body} from the start"),
    "total_volume": (("half_cycle",), "mm3", "volume worn off the {body} from the start"),
    "total_mass": (("half_cycle",), "mg", "mass worn off the {body} from the start"),
    "wear_rate": (("half_cycle",), WEAR_RATE, "specific wear rate of the {body} in the half-cycle"),
    "mean_wear_rate": (("half_cycle",), WEAR_RATE, "specific wear rate of the {body} from the start"),
    "max_wear": (("half_cycle",), "mm", "largest worn depth of the {body} at the end of the half-cycle"),
}


def variables(placed: Placed) -> dict[str, Variable]:
    """Return the variables of the sheet: of the bodies that wear, masses where a density is known."""
    found, plane = dict(SLIDING), _is_plane(placed)
    surfaces = (placed.pair.punch, placed.pair.strip)
    for (body, end), surface, law, density in zip(
        BODIES.items(), surfaces, placed.sliding.wear, placed.bodies.densities, strict=True
    ):
        if law is None:
            continue
        missing = {"total_area": not plane, "total_mass": density is None}
        own = {name: variable for name, variable in OF_A_BODY.items() if not missing.get(name)}
        own |= of_the_scar(axes(placed), scar_geometry(placed, surface).names)
        found |= {f"{name}{end}": (over, unit, text.format(body=body)) for name, (over, unit, text) in own.items()}
    return found


def of_the_scar(along: tuple[str, ...], extents: tuple[str, ...]) -> dict[str, Variable]:
    """Return the variables of a scar: where it is deepest, and its extents by their names."""
    found: dict[str, Variable] = {
        f"max_wear_{axis}": (("half_cycle",), "mm", f"where the worn depth of the {{body}} is largest, {axis}")
        for axis in along
    }
    way = "along the contact" if along == ("x",) else "across the sliding"
    texts = {"length": "along the sliding", "width": way}
    for name in extents:
        for end, share in SHARES.items():
            text = f"{name} of the {{body}}'s scar {texts[name]} at {100 * share:g} % of its largest depth"
            found[f"scar_{name}{end}"] = (("half_cycle",), "mm", text)
    return found


def axes(placed: Placed) -> tuple[str, ...]:
    """Return the names of coordinates on the contact surface: x in the plane, r of rings, x, y and z of solids."""
    if placed.pair.punch.dim == 3:
        return ("x", "y", "z")
    return ("x",) if _is_plane(placed) else ("r",)


def _is_plane(placed: Placed) -> bool:
    return placed.bodies.punch.law.kind in ("stress", "strain")


def values(block: Block) -> dict[str, Array]:
    """Return the sheet of each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, totals, adds = block.system, block.totals, block.adds
    thickness = system.bodies.punch.thickness
    found = {
        "cycles": block.half_cycle / system.motion.half_cycles,
        "sliding_distance": totals.of("distance"),
        "normal_force": thickness * (block.pressure * (system.pair.weights * _level(system))).sum(axis=1),
        "friction_force": _over(adds.of("work"), adds.of("distance")),
        "friction_work": totals.of("work"),
        "dissipated_energy": totals.energy,
    }
    depths = ((system.pair.punch, block.wear), (system.pair.strip, block.wear_strip))
    for (body, end), law, (surface, depth) in zip(BODIES.items(), system.sliding.wear, depths, strict=True):
        if law is None:
            continue
        volume = totals.of(f"volume_{body}")
        deepest = np.round(surface.x[depth.argmax(axis=1)], PLACES) + 0.0
        geometry = scar_geometry(system, surface)
        own = {
            "total_area": volume / thickness,
            "total_volume": volume,
            "total_mass": totals.of(f"mass_{body}"),
            "wear_rate": 1e3 * _over(adds.of(f"volume_{body}"), adds.of("load_path")),
            "mean_wear_rate": 1e3 * _over(volume, totals.of("load_path")),
            "max_wear": depth.max(axis=1),
            **{f"max_wear_{axis}": deepest[:, k] for k, axis in enumerate(axes(system))},
            **{
                f"scar_{name}{at}": extent
                for at, share in SHARES.items()
                for name, extent in geometry.extents(depth, share).items()
            },
        }
        found |= {f"{name}{end}": value for name, value in own.items()}
    return found


def _level(system: Placed) -> Array:
    """Return the cosine of the slope of the contact surface against the sliding (n,); 1 where nothing slides."""
    pair, field = system.pair, system.sliding.field
    speed = np.linalg.norm(field.velocity(pair.opposite), axis=1)
    return _over(field.rate(pair.opposite, pair.normal), speed, 1.0)


def _over(above: Array, below: Array, otherwise: float = np.nan) -> Array:
    """Return the quotient, or another value where nothing slides or presses."""
    return np.where(below > 0, above, otherwise) / np.where(below > 0, below, 1.0)


class Line(NamedTuple):
    """A line of the sheet: its words, the unit it is read in, and that unit over the one of its value."""

    label: str
    unit: str
    factor: float = 1.0


LINES = {
    "half_cycles": Line("half-cycles", ""),
    "cycles": Line("cycles", ""),
    "time_s": Line("time", "s"),
    "sliding_distance_mm": Line("sliding distance", "m", 1e-3),
    "normal_force_N": Line("normal force", "N"),
    "friction_force_N": Line("friction force", "N"),
    "friction_coefficient": Line("friction coefficient, mean", ""),
    "friction_work_mJ": Line("work of friction", "J", 1e-3),
    "largest_energy_mJ_per_mm2": Line("dissipated energy per area, largest", "J/mm²", 1e-3),
    "worn_area_mm2": Line("worn area", "mm²"),
    "worn_volume_mm3": Line("worn volume", "mm³"),
    "worn_mass_mg": Line("worn mass", "mg"),
    "mean_wear_rate_mm3_per_N_m": Line("specific wear rate, mean", "mm³/(N m)"),
    "wear_rate_mm3_per_N_m": Line("specific wear rate, last", "mm³/(N m)"),
    "largest_depth_mm": Line("largest worn depth", "µm", 1e3),
    **{f"at_{axis}_mm": Line(f"at {axis}", "mm") for axis in "rxyz"},
    **{
        f"scar_{name}_{100 * share:g}_percent_mm": Line(f"scar {name} at {100 * share:g} % of the depth", "mm")
        for name in ("length", "width")
        for share in SHARES.values()
    },
}
OF_SUMMARY = {
    "worn_area_mm2": "total_area",
    "worn_volume_mm3": "total_volume",
    "worn_mass_mg": "total_mass",
    "mean_wear_rate_mm3_per_N_m": "mean_wear_rate",
    "wear_rate_mm3_per_N_m": "wear_rate",
    "largest_depth_mm": "max_wear",
    **{f"at_{axis}_mm": f"max_wear_{axis}" for axis in "rxyz"},
    **{
        f"scar_{name}_{100 * share:g}_percent_mm": f"scar_{name}{end}"
        for name in ("length", "width")
        for end, share in SHARES.items()
    },
}


def sheet(last: Block) -> dict[str, Any]:
    """Return the sheet at the end of a run, for summary.json: of the sliding, and of each body that wears."""
    known, row = variables(last.system), {name: value[-1] for name, value in values(last).items()}
    path = float(last.totals.of("load_path")[-1]) or np.nan
    found: dict[str, Any] = {
        "sliding": {
            "half_cycles": int(last.half_cycle[-1]),
            "cycles": float(row["cycles"]),
            "time_s": float(last.time[-1]),
            "sliding_distance_mm": float(row["sliding_distance"]),
            "normal_force_N": float(row["normal_force"]),
            "friction_force_N": float(row["friction_force"]),
            "friction_coefficient": float(row["friction_work"]) / path,
            "friction_work_mJ": float(row["friction_work"]),
            "largest_energy_mJ_per_mm2": float(row["dissipated_energy"].max()),
        }
    }
    for body, end in BODIES.items():
        own = {key: float(row[f"{name}{end}"]) for key, name in OF_SUMMARY.items() if f"{name}{end}" in known}
        if own:
            found[body] = own
    return found


def sheet_rows(summary: Mapping[str, Any]) -> list[tuple[str, str, list[float | None]]]:
    """Return the lines of a sheet: words, unit, and a value in it for the sliding or for punch and strip.

    Args:
        summary: Of a run, with what `sheet` gave.
    """
    bodies = [summary[body] for body in BODIES if body in summary]
    rows = []
    for key, line in LINES.items():
        found = [summary.get("sliding", {})] if key in summary.get("sliding", {}) else bodies
        if any(key in one for one in found):
            rows.append((line.label, line.unit, [shown(one.get(key), line) for one in found]))
    return rows


def shown(value: Any, line: Line) -> Any:
    """Return a value of the summary in the unit in which it is read."""
    return value if value is None or line.factor == 1 else line.factor * value


def sheet_text(summary: Mapping[str, Any]) -> str:
    """Return the sheet of a summary as lines for people."""
    rows = sheet_rows(summary)
    bodies = [body for body in BODIES if body in summary]
    labels = [f"{label} ({unit})" if unit else label for label, unit, _ in rows]
    wide = max(map(len, labels), default=0)
    lines = []
    for label, (_, _, row) in zip(labels, rows, strict=True):
        lines.append(f"{label:{wide}}" + "".join(f"  {_number(value):>12}" for value in row))
    first = next((k for k, label in enumerate(labels) if label.startswith("worn ")), len(lines))
    head = " " * wide + "".join(f"  {body:>12}" for body in bodies)
    return "\n".join([*lines[:first], head, *lines[first:]])


def _number(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "-"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:,.0f}" if 1e5 <= abs(value) < 1e12 else f"{value:,.5g}"
