"""The key numbers of a run, as summary.json has them: of all contacts together, of each with a name, shakedown.

Under a contact that rolls or slides to and fro, what yields at first leaves residual stresses by which the rest is
carried elastically, as long as the largest pressure p_0 is at most 4 k in line contact and 4.7 k in point contact. k is
the yield stress in shear, by von Mises that in tension over sqrt(3) (K. L. Johnson, Contact Mechanics, 1985, 9.1, 9.2;
A. R. S. Ponter et al., J. Mech. Phys. Solids 33, 1985, 339). These are the limits without friction and hardening:
friction lowers them, hardening raises them. Beyond them the surface flows in every cycle.

A geometry names contacts by groups, punch_contact_NAME and strip_contact_NAME. The load of a contact is that on the
punch's surface; what is worn off the punch or the strip on the surface of either that has the name. The volume metered
of a body is shared among its contacts as the integrals of its depths are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.supports import axes
from fenwear.case.body_names import Names
from fenwear.common.arrays import Array, Mask
from fenwear.common.stack import versions
from fenwear.heat.heat_exchange import CROSSING, TERMS
from fenwear.laws.wear import WornDepths
from fenwear.results import forces_and_place, layer_results, sheet, time_steps
from fenwear.results.forces_and_place import node_forces
from fenwear.results.history_surfaces import ContactNet, at_places, conforming, contact_net, without_noise
from fenwear.results.quantity import BODIES, degrees_of, numbers
from fenwear.results.registry import quantities_of
from fenwear.steps import Block
from fenwear.steps.run_state import SUMS, approach
from fenwear.steps.steady_cycle import SteadyCycle
from fenwear.surfaces import ContactPair
from fenwear.system import ContactSetup, Tribosystem

LINE, POINT = 4.0, 4.7  # p_0 / k


def shakedown_limit(placed: ContactSetup) -> tuple[float, str]:
    """Return the limit (MPa) and its material; infinite where surfaces conform, and without a yield stress."""
    case, (punch, strip) = placed.case, placed.bodies.regions
    used = case.punch.materials_at(punch) | case.strip.materials_at(strip)
    known = {name: case.materials[name].yield_stress for name in sorted(used)}
    limits = {
        name: float(factor(placed.pair) * value / np.sqrt(3)) for name, value in known.items() if value is not None
    }
    if conforming(placed.pair) or not limits:
        return np.inf, ""
    softest = min(limits, key=lambda name: limits[name])
    return limits[softest], softest


def factor(pair: ContactPair) -> float:
    """Return p_0 / k: in space of a point, else of a line."""
    return POINT if pair.punch.dim == 3 else LINE


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
        for body in BODIES
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
    of_contact = pair.punch.nodes_of(contact)
    if heat is not None:
        sides = (heat.temperature_punch, heat.temperature_strip)
        warm = [np.where(of_contact, side, -np.inf) for side in sides]
        heat = replace(heat, temperature_punch=warm[0], temperature_strip=warm[1])
    adds, changed = records.adds.sums.copy(), dict[str, Any]()
    if isinstance(records, Block):
        sums = records.totals.sums.copy()
        depths = {"wear": records.wear, "wear_strip": records.wear_strip}
        changed["totals"] = replace(records.totals, sums=sums, energy=np.where(of_contact, records.totals.energy, 0.0))
    for body, surface in (("punch", pair.punch), ("strip", pair.strip)):
        if contact in surface.names:
            nodes, volume = surface.nodes_of(contact), SUMS.index(f"volume_{body}")
            adds[:, volume] *= _share(surface.weights, getattr(rate, body), nodes)
            if isinstance(records, Block):
                key = f"wear{BODIES[body]}"
                sums[:, volume] *= _share(surface.weights, depths[key], nodes)
                changed[key] = np.where(nodes, depths[key], 0.0)
    pressure = np.where(of_contact, records.pressure, 0.0)
    return replace(records, pressure=pressure, heat=heat, adds=replace(records.adds, sums=adds), **changed)


def _share(weights: Array, depth: Array, nodes: Mask) -> Array:
    """Return the share of the integral of depths (..., n) that is of some nodes (...)."""
    total = np.asarray(depth @ weights)
    return np.asarray(np.where(nodes, depth, 0.0) @ weights / np.where(total > 0, total, 1.0))


def contact_sheets(last: Block) -> dict[str, dict[str, Any]]:
    """Return the sheet of each named contact at the end of a run, by their names; empty where none has one.

    Forces, means, largest pressures and areas are of the last cycle.
    """
    pair, sheets, known = last.system.pair, dict[str, dict[str, Any]](), quantities_of(last.system)
    rate = WornDepths(last.wear[-1], last.wear_strip[-1])
    for name in dict.fromkeys((*pair.punch.names, *pair.strip.names)):
        table = sheets.setdefault(name, {})
        part = last if name not in pair.punch.names else within(last, name, rate)
        if name in pair.punch.names:
            table |= _carried(part, name)
        for body in BODIES:
            if name in getattr(pair, body).names and (worn := sheet.body_numbers(part, body, known.values())):
                table[body] = {key: value for key, value in worn.items() if key in OF_BODIES}
    return sheets


def _carried(part: Block, name: str) -> dict[str, Any]:
    """Return the load, friction and temperatures of a named contact."""
    system, degrees = part.system, degrees_of(part.system.case)
    nodes = system.pair.punch.nodes_of(name)
    area = system.bodies.punch.thickness * system.pair.weights
    energy, largest = part.totals.energy[-1], part.pressure[-system.motion.half_cycles :].max(axis=0)
    where = without_noise(system.pair.punch.x[largest.argmax()], system.pair.punch.extent())
    known = quantities_of(system)
    values = {
        **_force(part, nodes),
        **{
            known[quantity].key: float(known[quantity].of_cycle(part))
            for quantity in ("pressure_integral", "largest_pressure")
        },
        **{f"largest_pressure_at_{axis}_mm": float(x) for axis, x in zip(sheet.axes(system), where, strict=False)},
        **{
            known[quantity].key: float(known[quantity].of_cycle(part)) for quantity in ("mean_pressure", "contact_area")
        },
        "friction_work_mJ": float(area @ energy),
        "largest_energy_mJ_per_mm2": float(energy.max()),
        **{key: float(known[of].of_cycle(part)) for key, at in PLACES.items() if (of := f"{at}_{name}") in known},
    }
    if "largest_temperature" in known:
        warmest = float(known["largest_temperature"].of_cycle(part))
        values[f"largest_temperature_{degrees.unit}"] = warmest - degrees.zero
    return values


def _force(last: Block, nodes: Mask) -> dict[str, float]:
    """Return the force on the punch of contact nodes (n,) of one contact, mean of the last cycle; of rings along z."""
    system, cycle = last.system, slice(-last.system.motion.half_cycles, None)
    force = node_forces(last)[cycle][:, nodes].sum(axis=1).mean(axis=0)
    force = without_noise(force, float(np.linalg.norm(force)))
    along = axes(system.pair.punch.dim)
    if system.bodies.punch.law.kind == "axisymmetric":
        along = {"z": 1}
    return {f"force_{axis}_N": float(force[component]) for axis, component in along.items()}


def contact_text(summary: Mapping[str, Any]) -> str:
    """Return the sheets of a summary's named contacts as lines for people, a column each; "" where it has none."""
    contacts = summary.get(CONTACTS, {})
    columns = [
        contact | {f"{body}.{key}": value for body in BODIES for key, value in contact.get(body, {}).items()}
        for contact in contacts.values()
    ]
    names = Names(**summary.get("names", {}))
    rows = [
        (names.with_names(line.heading), [sheet.shown(column.get(key), line) for column in columns])
        for key, line in LINES.items()
        if any(key in column for column in columns)
    ]
    return sheet.columns_text(list(contacts), rows)


# Over a run, and when; at its end it is largest_temperature.
HOTTEST, HOTTEST_AT = "largest_temperature_of_run", "largest_temperature_of_run_half_cycle"


def summarise(system: Tribosystem, last: Block, extremes: dict[str, float], run: dict[str, Any]) -> dict[str, Any]:
    """Return the key numbers of a run, each with its unit in its name.

    Args:
        last: The last block.
        extremes: Largest values over all half-cycles: errors, and the temperature in K; and numbers of the run.
        run: Course of the run: stop, times, warnings.
    """
    return {
        "title": system.case.title,
        **({"names": system.case.names.by_roles} if system.case.names.given else {}),
        "half_cycles": int(last.half_cycle[-1]),
        **run,
        **sheet_of(last),
        **_contact_summary(system, last),
        **({"shakedown_limit_MPa": limit} if (limit := shakedown_limit(system)[0]) < np.inf else {}),
        **({} if last.heat is None else _heat_summary(system, last, extremes[HOTTEST])),
        **({CONTACTS: contacts} if (contacts := contact_sheets(last)) else {}),
        "periodicity": float(last.periodicity[-1]),
        **{name: value for name, value in extremes.items() if name != HOTTEST},
        "contact_nodes": len(system.pair.x),
        "degrees_of_freedom": system.bodies.unknowns,
        "ranks": system.bodies.comm.size,
        "versions": versions(),
    }


def sheet_of(last: Block) -> dict[str, Any]:
    """Return the numbers of the registry for the tables of a summary, and for its top."""
    known = list(quantities_of(last.system).values())
    sliding = {"half_cycles": int(last.half_cycle[-1]), "time_s": float(last.time[-1])}
    sliding |= numbers(last, "sliding", known)
    bodies = {body: values for body in BODIES if (values := sheet.body_numbers(last, body, known))}
    cycle = time_steps.table_cycle(last)
    if cycle is not None:
        sliding |= time_steps.sliding_numbers(last, cycle)
        bodies = {body: numbers | time_steps.body_numbers(last, cycle, body) for body, numbers in bodies.items()}
    states = {layer_results.STATES: remembered} if (remembered := layer_results.states(last)) else {}
    return {"sliding": sliding, **bodies, **states, **numbers(last, "end", known)}


def net_of(placed: ContactSetup) -> ContactNet:
    """Return the nodes of a contact and the facets between them."""
    return contact_net(placed.pair, placed.sliding.field, sheet.axes(placed))


def _places(pair: ContactPair) -> NDArray[np.float64]:
    """Return three places along a contact that is a line, mm."""
    x = pair.x
    places = (x[-1] + x[0]) / 2 + (x[-1] - x[0]) * np.array([-0.25, 0.0, 0.25])
    return without_noise(places, float(np.ptp(x)))


def _at(system: Tribosystem, values: NDArray[np.float64]) -> list[float | None]:
    """Return nodal values at the three places; None in a gap between parts of the contact."""
    nodal_values = at_places(system.pair.punch, values, _places(system.pair))
    return [None if np.isnan(value) else float(value) for value in nodal_values]


def nominal_pressure(placed: ContactSetup, load: float) -> dict[str, float]:
    """Return a load (N) over the contact's area as the load sees it, MPa, by its name; nothing where that is none.

    So of surfaces that lie on each other before they wear, and of a shaft in a bore: F / (D L).
    """
    if not (conforming(placed.pair) or forces_and_place.bores_of(placed)):
        return {}
    seen = np.maximum(np.einsum("id,id->i", placed.pair.normal, approach(placed.rigid)), 0.0)
    area = placed.bodies.punch.thickness * float(placed.pair.weights @ seen)
    return {"nominal_pressure": load / area} if area > 0 else {}


def _contact_summary(system: Tribosystem, last: Block) -> dict[str, Any]:
    """Return the contact of each half-cycle of the last cycle; in the plane with depths and pressures at three places.

    Pressures over what is in contact; over the nominal contact only where the surfaces lie on each other.
    """
    net, cycle = net_of(system), slice(-system.motion.half_cycles, None)
    known, nominal = quantities_of(system), nominal_pressure(system, float(last.load[-1]))
    sizes = [name for name in ("contact_width", "contact_area") if name in known]
    wanted = [known[name] for name in ("half_cycle", "direction", "largest_pressure", "mean_pressure", *sizes)]
    rows = {quantity.key: np.asarray(quantity.compute(last))[cycle] for quantity in wanted}
    plane = system.case.model.kind == "plane"
    contacts: dict[str, Any] = {f"{name}_MPa": value for name, value in nominal.items()}
    if plane:
        contacts |= {"x_mm": _places(system.pair).tolist(), "wear_mm": _at(system, last.wear[-1])}
    for k, pressure in enumerate(map(np.asarray, last.pressure[cycle])):
        at = {"pressure_MPa": _at(system, pressure)} if plane else {}
        numbers = {key: row[k].item() for key, row in rows.items() if key != "direction"}
        contacts[system.sliding.words[int(rows["direction"][k])]] = {**numbers, **at, **net.numbers(pressure)}
    return contacts


def _heat_summary(system: Tribosystem, last: Block, hottest: float) -> dict[str, Any]:
    assert last.heat is not None
    heat, along, degrees = last.heat, {}, degrees_of(system.case)
    if system.case.model.kind == "plane":
        sides = {"punch": heat.temperature_punch, "strip": heat.temperature_strip}
        along = {
            f"temperature_{body}_{degrees.unit}": _at(system, degrees.of(side[-1])) for body, side in sides.items()
        }
    return {
        f"largest_temperature_{degrees.unit}": float(heat.largest_temperature[-1]) - degrees.zero,
        f"{HOTTEST}_{degrees.unit}": hottest - degrees.zero,
        **along,
        "heat_mJ": dict(zip((*TERMS, *CROSSING), heat.terms[-1].tolist(), strict=True)),
    }
