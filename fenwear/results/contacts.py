"""The sheet of each named contact, as summary.json has it beside that of all contacts together.

A geometry names them by its groups, punch_contact_NAME and strip_contact_NAME. What a contact carries is told on the
punch's surface; what is worn off the punch or the strip on the surface of either that has the name. The volume metered
of a body is shared among its contacts as the integrals of its depths are.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.supports import axes
from fenwear.case.names import Names
from fenwear.cycle import Block
from fenwear.results import place, sheet
from fenwear.results.degrees import degrees_of
from fenwear.results.forces import node_forces
from fenwear.results.scar import scar_geometry
from fenwear.results.zone import without_noise

CONTACTS = "contacts"  # the table of summary.json
SCARS = [key for key in sheet.LINES if key.startswith("scar_")]
LINES = {
    **{f"force_{axis}_N": sheet.Line(f"force on the punch, {axis}", "N") for axis in "xyz"},
    "pressure_integral_N": sheet.LINES["pressure_integral_N"],
    **{key: sheet.LINES[key] for key in ("eccentricity_mm", "attitude_angle_deg")},
    "largest_pressure_MPa": sheet.OF_CONTACT["largest_pressure_MPa"],
    **{f"largest_pressure_at_{axis}_mm": sheet.OF_CONTACT[f"largest_pressure_at_{axis}_mm"] for axis in "rxyz"},
    "contact_area_mm2": sheet.OF_CONTACT["contact_area_mm2"],
    "friction_work_mJ": sheet.LINES["friction_work_mJ"],
    "largest_energy_mJ_per_mm2": sheet.LINES["largest_energy_mJ_per_mm2"],
    **{f"largest_temperature_{unit}": sheet.LINES[f"largest_temperature_{unit}"] for unit in ("K", "degC")},
    **{
        f"{body}.{key}": sheet.LINES[key]._replace(label=f"{body}: {sheet.LINES[key].label}")
        for body in sheet.BODIES
        for key in (
            "worn_volume_mm3",
            "largest_depth_mm",
            *(f"largest_depth_at_{axis}_mm" for axis in sheet.PLACES),
            *SCARS,
        )
    },
}


def contact_sheets(last: Block) -> dict[str, dict[str, Any]]:
    """Return the sheet of each named contact at the end of a run, by their names; empty where none has one.

    Forces, means and largest pressures are of the last cycle, areas in contact of its end.
    """
    system, pair = last.system, last.system.pair
    found: dict[str, dict[str, Any]] = {name: _carried(last, name) for name in pair.punch.names}
    for body, surface, law, depth in zip(
        sheet.BODIES, (pair.punch, pair.strip), system.sliding.wear, (last.wear, last.wear_strip), strict=True
    ):
        if law is None:
            continue
        volume = float(last.totals.of(f"volume_{body}")[-1])
        for name in surface.names:
            own = surface.nodes_of(name)
            found.setdefault(name, {})[body] = _worn(system, surface, own, depth[-1], volume)
    return found


def _carried(last: Block, name: str) -> dict[str, Any]:
    """Return what the nodes of a named contact carry, rub and warm to."""
    system, cycle = last.system, slice(-last.system.motion.half_cycles, None)
    own = system.pair.punch.nodes_of(name)
    pair, thickness = system.pair, system.bodies.punch.thickness
    area, pressure = thickness * pair.weights[own], last.pressure[cycle][:, own]
    energy, largest = last.totals.energy[-1][own], pressure.max(axis=0)
    where = without_noise(pair.punch.x[own][largest.argmax()], pair.punch.extent())
    found = {
        **_force(last, own),
        "pressure_integral_N": float((pressure @ area).mean()),
        "largest_pressure_MPa": float(largest.max()),
        **{f"largest_pressure_at_{axis}_mm": float(x) for axis, x in zip(sheet.axes(system), where, strict=False)},
        "contact_area_mm2": float(area @ (pressure[-1] > 0)),
        "friction_work_mJ": float(area @ energy),
        "largest_energy_mJ_per_mm2": float(energy.max()),
    }
    found |= place.numbers(last, name)
    if last.heat is not None:
        degrees = degrees_of(system.case)
        warmest = max(float(side[-1][own].max()) for side in (last.heat.temperature_punch, last.heat.temperature_strip))
        found[f"largest_temperature_{degrees.unit}"] = warmest - degrees.zero
    return found


def _force(last: Block, own: Mask) -> dict[str, float]:
    """Return the force on the punch of contact nodes (n,) of one contact, mean of the last cycle; of rings along z."""
    system, cycle = last.system, slice(-last.system.motion.half_cycles, None)
    force = node_forces(last)[cycle][:, own].sum(axis=1).mean(axis=0)
    force = without_noise(force, float(np.linalg.norm(force)))
    along = axes(system.pair.punch.dim)
    if system.bodies.punch.law.kind == "axisymmetric":
        along = {"z": 1}
    return {f"force_{axis}_N": float(force[component]) for axis, component in along.items()}


def _worn(placed: ContactSetup, surface: ContactSurface, own: Mask, depth: Array, volume: float) -> dict[str, Any]:
    """Return what is worn off the nodes (n,) of one contact of a body."""
    geometry = scar_geometry(placed, surface)
    whole, deepest = float(surface.weights @ depth), int(np.where(own, depth, -np.inf).argmax())
    return {
        "worn_volume_mm3": volume * float(surface.weights[own] @ depth[own]) / whole if whole else 0.0,
        "largest_depth_mm": float(depth[deepest]),
        **{
            f"largest_depth_at_{axis}_mm": float(x[deepest])
            for axis, x in sheet.places(placed, surface, geometry).items()
        },
        **{
            f"scar_{name}{end}_mm": float(extent[0])
            for end, share in sheet.SHARES.items()
            for name, extent in geometry.extents(np.where(own, depth, 0.0)[None], share).items()
        },
    }


def contact_text(summary: Mapping[str, Any]) -> str:
    """Return the sheets of a summary's named contacts as lines for people, a column each; "" where it has none."""
    contacts = summary.get(CONTACTS, {})
    columns = [
        one | {f"{body}.{key}": value for body in sheet.BODIES for key, value in one.get(body, {}).items()}
        for one in contacts.values()
    ]
    names = Names(**summary.get("names", {}))
    rows = [
        (names.told(line.heading), [sheet.shown(one.get(key), line) for one in columns])
        for key, line in LINES.items()
        if any(key in one for one in columns)
    ]
    return sheet.columns_text(list(contacts), rows)
