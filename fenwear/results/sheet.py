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
from fenwear.assembly import Tribosystem
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.cycle import Block
from fenwear.sliding.scar import EDGES, scar_widths, scars

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name
BODIES = ("punch", "strip")
WEAR_RATE = "mm3/(N m)"

SLIDING: dict[str, Variable] = {
    "cycles": (("half_cycle",), "1", "cycles done"),
    "sliding_distance": (("half_cycle",), "mm", "sliding distance from the start, mean over the nominal contact"),
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
    "max_depth": (("half_cycle",), "mm", "largest worn depth of the {body}"),
    "max_depth_{axis}": (("half_cycle",), "mm", "where the worn depth of the {body} is largest, {axis}"),
    "scar_width_{share}{along}": (
        ("half_cycle",),
        "mm",
        "width of the {body}'s scar along {axis} at {share} % of its largest depth",
    ),
}
SHARES = {f"{100 * share:g}": share for share in EDGES}


def quantities(axes: tuple[str, ...] = ("x",), bodies: Mapping[str, bool] | None = None) -> dict[str, Variable]:
    """Return the variables of the sheet by name.

    Args:
        axes: Of the contact surface.
        bodies: Those that wear, and whether their density is known; by default both.
    """
    found = dict(SLIDING)
    plane = len(axes) == 1
    for body, weighs in (bodies or dict.fromkeys(BODIES, True)).items():
        for name, (dimensions, units, text) in OF_A_BODY.items():
            if (name == "total_area" and not plane) or (name == "total_mass" and not weighs):
                continue
            for axis in axes if "{axis}" in text else ("",):
                for share in SHARES if "{share}" in text else ("",):
                    words = {"axis": axis, "share": share, "along": "" if plane else f"_{axis}", "body": body}
                    found[f"{name.format(**words)}_{body}"] = (dimensions, units, text.format(**words))
    return found


def quantities_of(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of the sheet of a system: of the bodies that wear, masses where a density is known."""
    wears = dict(zip(BODIES, system.sliding.wear, strict=True))
    weighs = dict(zip(BODIES, system.bodies.densities, strict=True))
    of = {body: weighs[body] is not None for body, law in wears.items() if law is not None}
    return quantities(contact_axes(system), of)


def contact_axes(system: Tribosystem) -> tuple[str, ...]:
    """Return the axes along a contact surface."""
    return ("x", "y")[: system.pair.punch.dim - 1]


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
    depths = zip(BODIES, (system.pair.punch, system.pair.strip), (block.wear, block.wear_strip), strict=True)
    for body, surface, depth in depths:
        volume = totals.of(f"volume_{body}")
        found |= {
            f"total_area_{body}": volume / thickness,
            f"total_volume_{body}": volume,
            f"total_mass_{body}": totals.of(f"mass_{body}"),
            f"wear_rate_{body}": 1e3 * _over(adds.of(f"volume_{body}"), adds.of("load_path")),
            f"mean_wear_rate_{body}": 1e3 * _over(volume, totals.of("load_path")),
            **_scar(body, surface, depth),
        }
    return found


def _level(system: Tribosystem) -> Array:
    """Return the cosine of the slope of the contact surface against the sliding (n,); 1 where nothing slides."""
    pair, field = system.pair, system.sliding.field
    speed = np.linalg.norm(field.velocity(pair.punch.x), axis=1)
    return _over(field.rate(pair.punch.x, pair.normal), speed, 1.0)


def _scar(body: str, surface: ContactSurface, depth: Array) -> dict[str, Array]:
    axes = ("x", "y")[: surface.dim - 1]
    found = scars(surface.x[:, :-1], depth)
    rows = {f"max_depth_{body}": found.depth}
    rows |= {f"max_depth_{axis}_{body}": found.place[:, k] for k, axis in enumerate(axes)}
    for share, level in SHARES.items():
        width = scar_widths(surface, depth, level)
        for k, axis in enumerate(axes):
            along = "" if len(axes) == 1 else f"_{axis}"
            rows[f"scar_width_{share}{along}_{body}"] = width[:, k]
    return rows


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
    "at_x_mm": Line("at x", "mm"),
    "at_y_mm": Line("at y", "mm"),
    **{
        f"scar_width_{share}_percent_{along}mm": Line(f"scar width{where} at {share} % of the depth", "mm")
        for share in SHARES
        for along, where in (("", ""), ("x_", " along x"), ("y_", " along y"))
    },
}


def sheet(last: Block) -> dict[str, Any]:
    """Return the sheet at the end of a run, for summary.json: of the sliding, and of each body that wears."""
    system = last.system
    known, row = quantities_of(system), {name: value[-1] for name, value in values(last).items()}
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
    names = {
        "worn_area_mm2": "total_area",
        "worn_volume_mm3": "total_volume",
        "worn_mass_mg": "total_mass",
        "mean_wear_rate_mm3_per_N_m": "mean_wear_rate",
        "wear_rate_mm3_per_N_m": "wear_rate",
        "largest_depth_mm": "max_depth",
        **{f"at_{axis}_mm": f"max_depth_{axis}" for axis in "xy"},
        **{
            f"scar_width_{share}_percent_{along[1:]}{'_' if along else ''}mm": f"scar_width_{share}{along}"
            for share in SHARES
            for along in ("", "_x", "_y")
        },
    }
    for body in BODIES:
        own = {key: float(row[f"{name}_{body}"]) for key, name in names.items() if f"{name}_{body}" in known}
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
            rows.append((line.label, line.unit, [_in_unit(one.get(key), line) for one in found]))
    return rows


def _in_unit(value: Any, line: Line) -> Any:
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
    return f"{value:,}" if isinstance(value, int) else f"{value:.5g}"
