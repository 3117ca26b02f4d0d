"""The key numbers of a run, as summary.json has them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.assembly import ContactSetup, Tribosystem
from fenwear.cycle import Block
from fenwear.cycle.totals import approach
from fenwear.heat.exchange import CROSSING, TERMS
from fenwear.results import between, place, sheet, table_cycle
from fenwear.results.contacts import CONTACTS, contact_sheets
from fenwear.results.degrees import degrees_of
from fenwear.results.quantity import numbers
from fenwear.results.registry import quantities_of
from fenwear.results.scar import conforming
from fenwear.results.shakedown import shakedown_limit
from fenwear.results.surfaces import at_places
from fenwear.results.zone import ContactNet, contact_net, without_noise
from fenwear.stack import versions

# Over a run, and when; at its end it is largest_temperature.
HOTTEST, HOTTEST_AT = "largest_temperature_of_run", "largest_temperature_of_run_half_cycle"


def summarise(system: Tribosystem, last: Block, extremes: dict[str, float], run: dict[str, Any]) -> dict[str, Any]:
    """Return the key numbers of a run, each with its unit in its name.

    Args:
        last: The last block.
        extremes: What was largest over all half-cycles: errors, and the temperature in K; and numbers of the run.
        run: How the run went: stop, times, warnings.
    """
    return {
        "title": system.case.title,
        **({"names": system.names.by_roles} if system.names.given else {}),
        "half_cycles": int(last.half_cycle[-1]),
        **run,
        **sheet_of(last),
        **_contact_summary(system, last),
        **({} if (limit := shakedown_limit(system)) is None else {"shakedown_limit_MPa": limit[0]}),
        **({} if last.heat is None else _heat_summary(system, last, extremes[HOTTEST])),
        **({CONTACTS: contacts} if (contacts := contact_sheets(last)) else {}),
        "periodicity": float(last.periodicity[-1]),
        **{name: value for name, value in extremes.items() if name != HOTTEST},
        "contact_nodes": len(system.pair.x),
        "degrees_of_freedom": system.bodies.unknowns,
        "ranks": system.comm.size,
        "versions": versions(),
    }


def sheet_of(last: Block) -> dict[str, Any]:
    """Return what the registry has for the tables of a summary, and for its top."""
    known = list(quantities_of(last.system).values())
    sliding = {"half_cycles": int(last.half_cycle[-1]), "time_s": float(last.time[-1])}
    sliding |= {**numbers(last, "sliding", known), **table_cycle.sliding_numbers(last)}
    bodies = {body: sheet.body_numbers(last, body, known) for body in sheet.BODIES}
    bodies = {body: own | table_cycle.body_numbers(last, body) for body, own in bodies.items() if own}
    states = {between.STATES: found} if (found := between.states(last)) else {}
    return {"sliding": sliding, **bodies, **states, **numbers(last, "end", known)}


def net_of(placed: ContactSetup) -> ContactNet:
    """Return the nodes of a contact and the facets between them."""
    return contact_net(placed.pair, placed.sliding.field, sheet.axes(placed))


def _places(system: Tribosystem) -> NDArray[np.float64]:
    """Return three places along a contact that is a line, mm."""
    x = system.pair.x
    places = (x[-1] + x[0]) / 2 + (x[-1] - x[0]) * np.array([-0.25, 0.0, 0.25])
    return without_noise(places, float(np.ptp(x)))


def _at(system: Tribosystem, values: NDArray[np.float64]) -> list[float | None]:
    """Return nodal values at the three places; None in a gap between parts of the contact."""
    found = at_places(system.pair.punch, values, _places(system))
    return [None if np.isnan(one) else float(one) for one in found]


def nominal_pressure(placed: ContactSetup, load: float) -> float | None:
    """Return a load (N) over the contact's area as the load sees it, MPa; None where that is no pressure.

    So of surfaces that lie on each other before they wear, and of a shaft in a bore: F / (D L).
    """
    if not (conforming(placed.pair) or place.bores_of(placed)):
        return None
    seen = np.maximum(np.einsum("id,id->i", placed.pair.normal, approach(placed.rigid)), 0.0)
    area = placed.bodies.punch.thickness * float(placed.pair.weights @ seen)
    return load / area if area > 0 else None


def _contact_summary(system: Tribosystem, last: Block) -> dict[str, Any]:
    """Return the contact of each half-cycle of the last cycle; in the plane with depths and pressures at three places.

    Pressures over what is in contact; over the nominal contact only where the surfaces lie on each other.
    """
    net, cycle = net_of(system), slice(-system.motion.half_cycles, None)
    known, nominal = quantities_of(system), nominal_pressure(system, float(last.load[-1]))
    sizes = [name for name in ("contact_width", "contact_area") if name in known]
    wanted = [known[name] for name in ("half_cycle", "direction", "largest_pressure", "mean_pressure", *sizes)]
    rows = {one.key: np.asarray(one.compute(last))[cycle] for one in wanted}
    plane = system.case.model.kind == "plane"
    found: dict[str, Any] = {} if nominal is None else {"nominal_pressure_MPa": nominal}
    if plane:
        found |= {"x_mm": _places(system).tolist(), "wear_mm": _at(system, last.wear[-1])}
    for k, pressure in enumerate(map(np.asarray, last.pressure[cycle])):
        at = {"pressure_MPa": _at(system, pressure)} if plane else {}
        numbers = {key: row[k].item() for key, row in rows.items() if key != "direction"}
        found[system.direction_words[int(rows["direction"][k])]] = {**numbers, **at, **net.numbers(pressure)}
    return found


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
