"""The sheet of each named contact, as summary.json has it beside that of all contacts together.

A geometry names them by its groups, punch_contact_NAME and strip_contact_NAME. What a contact carries is told on the
punch's surface; what is worn off the punch or the strip on the surface of either that has the name. The volume metered
of a body is shared among its contacts as the integrals of its depths are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.bodies.supports import axes
from fenwear.case.names import Names
from fenwear.cycle import Block
from fenwear.cycle.steady_cycle import SteadyCycle
from fenwear.cycle.totals import SUMS
from fenwear.results import sheet
from fenwear.results.degrees import degrees_of
from fenwear.results.forces import node_forces
from fenwear.results.registry import quantities_of
from fenwear.results.zone import without_noise
from fenwear.sliding.wear import WornDepths

CONTACTS = "contacts"  # the table of summary.json
SCARS = [key for key in sheet.LINES if key.startswith("scar_")]
OF_BODIES = ("worn_volume_mm3", "largest_depth_mm", *(f"largest_depth_at_{axis}_mm" for axis in sheet.PLACES), *SCARS)
PLACES = {"eccentricity_mm": "eccentricity", "attitude_angle_deg": "attitude_angle"}
R = TypeVar("R", bound=Block | SteadyCycle)
LINES = {
    **{f"force_{axis}_N": sheet.Line(f"force on the punch, {axis}", "N") for axis in "xyz"},
    "pressure_integral_N": sheet.LINES["pressure_integral_N"],
    **{key: sheet.LINES[key] for key in ("eccentricity_mm", "attitude_angle_deg")},
    "largest_pressure_MPa": sheet.OF_CONTACT["largest_pressure_MPa"],
    **{f"largest_pressure_at_{axis}_mm": sheet.OF_CONTACT[f"largest_pressure_at_{axis}_mm"] for axis in "rxyz"},
    **{key: sheet.OF_CONTACT[key] for key in ("mean_pressure_MPa", "contact_area_mm2")},
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


def within(records: R, contact: str, rate: WornDepths) -> R:
    """Return records of half-cycles with nothing that presses, wears or is warm beyond a named contact.

    Args:
        records: A block, or a steady cycle.
        contact: The name.
        rate: Depths worn in a cycle, by which the volumes that half-cycles add are shared.
    """
    pair, heat = records.system.pair, records.heat
    own = pair.punch.nodes_of(contact)
    if heat is not None:
        sides = (heat.temperature_punch, heat.temperature_strip)
        warm = [np.where(own, side, -np.inf) for side in sides]
        heat = replace(heat, temperature_punch=warm[0], temperature_strip=warm[1])
    adds, changed = records.adds.sums.copy(), dict[str, Any]()
    if isinstance(records, Block):
        sums = records.totals.sums.copy()
        depths = {"wear": records.wear, "wear_strip": records.wear_strip}
        changed["totals"] = replace(records.totals, sums=sums, energy=np.where(own, records.totals.energy, 0.0))
    for body, surface in (("punch", pair.punch), ("strip", pair.strip)):
        if contact in surface.names:
            nodes, volume = surface.nodes_of(contact), SUMS.index(f"volume_{body}")
            adds[:, volume] *= _share(surface.weights, getattr(rate, body), nodes)
            if isinstance(records, Block):
                key = f"wear{sheet.BODIES[body]}"
                sums[:, volume] *= _share(surface.weights, depths[key], nodes)
                changed[key] = np.where(nodes, depths[key], 0.0)
    pressure = np.where(own, records.pressure, 0.0)
    return replace(records, pressure=pressure, heat=heat, adds=replace(records.adds, sums=adds), **changed)


def _share(weights: Array, depth: Array, nodes: Mask) -> Array:
    """Return the share of the integral of depths (..., n) that is of some nodes (...)."""
    whole = np.asarray(depth @ weights)
    return np.asarray(np.where(nodes, depth, 0.0) @ weights / np.where(whole > 0, whole, 1.0))


def contact_sheets(last: Block) -> dict[str, dict[str, Any]]:
    """Return the sheet of each named contact at the end of a run, by their names; empty where none has one.

    Forces, means, largest pressures and areas are of the last cycle.
    """
    pair, found, known = last.system.pair, dict[str, dict[str, Any]](), quantities_of(last.system)
    rate = WornDepths(last.wear[-1], last.wear_strip[-1])
    for name in dict.fromkeys((*pair.punch.names, *pair.strip.names)):
        own = found.setdefault(name, {})
        part = last if name not in pair.punch.names else within(last, name, rate)
        if name in pair.punch.names:
            own |= _carried(part, name)
        for body in sheet.BODIES:
            if name in getattr(pair, body).names and (worn := sheet.body_numbers(part, body, known.values())):
                own[body] = {key: value for key, value in worn.items() if key in OF_BODIES}
    return found


def _carried(part: Block, name: str) -> dict[str, Any]:
    """Return what a named contact carries, rubs and warms to."""
    system, degrees = part.system, degrees_of(part.system.case)
    own = system.pair.punch.nodes_of(name)
    area = system.bodies.punch.thickness * system.pair.weights
    energy, largest = part.totals.energy[-1], part.pressure[-system.motion.half_cycles :].max(axis=0)
    where = without_noise(system.pair.punch.x[largest.argmax()], system.pair.punch.extent())
    known = quantities_of(system)
    found = {
        **_force(part, own),
        **{known[one].key: float(known[one].of_cycle(part)) for one in ("pressure_integral", "largest_pressure")},
        **{f"largest_pressure_at_{axis}_mm": float(x) for axis, x in zip(sheet.axes(system), where, strict=False)},
        **{known[one].key: float(known[one].of_cycle(part)) for one in ("mean_pressure", "contact_area")},
        "friction_work_mJ": float(area @ energy),
        "largest_energy_mJ_per_mm2": float(energy.max()),
        **{key: float(known[of].of_cycle(part)) for key, at in PLACES.items() if (of := f"{at}_{name}") in known},
    }
    if "largest_temperature" in known:
        warmest = float(known["largest_temperature"].of_cycle(part))
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
