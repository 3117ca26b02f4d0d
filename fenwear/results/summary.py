"""The key numbers of a run, as summary.json has them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenwear.assembly import ContactSetup, Tribosystem
from fenwear.cycle import Block
from fenwear.heat.exchange import CROSSING, TERMS
from fenwear.results import between, creep, place, sheet, steps
from fenwear.results.contacts import CONTACTS, contact_sheets
from fenwear.results.degrees import degrees_of
from fenwear.results.scar import conforming
from fenwear.results.shakedown import shakedown_limit
from fenwear.results.zone import ContactNet, contact_net, without_noise
from fenwear.versions import versions

# Over a run, and when; at its end it is largest_temperature.
HOTTEST, HOTTEST_AT = "largest_temperature_of_run", "largest_temperature_of_run_half_cycle"


def summarise(system: Tribosystem, last: Block, extremes: dict[str, float], run: dict[str, Any]) -> dict[str, Any]:
    """Return the key numbers of a run, each with its unit in its name.

    Args:
        last: The last block.
        extremes: What was largest over all half-cycles: errors, and the temperature in K; and numbers of the run.
        run: How the run went: stop, times, warnings.
    """
    plane = system.case.model.kind == "plane"
    return {
        "title": system.case.title,
        **({"names": system.names.by_roles} if system.names.given else {}),
        "half_cycles": int(last.half_cycle[-1]),
        **run,
        **sheet.sheet(last),
        **place.numbers(last),
        **(_plane_summary(system, last) if plane else _surface_summary(system, last)),
        **between.numbers(last),
        **creep.numbers(last),
        **({} if (limit := shakedown_limit(system)) is None else {"shakedown_limit_MPa": limit[0]}),
        **steps.numbers(last),
        **({} if last.heat is None else _heat_summary(system, last, extremes[HOTTEST])),
        **({CONTACTS: contacts} if (contacts := contact_sheets(last)) else {}),
        "periodicity": float(last.periodicity[-1]),
        **{name: value for name, value in extremes.items() if name != HOTTEST},
        "contact_nodes": len(system.pair.x),
        "degrees_of_freedom": system.bodies.unknowns,
        "ranks": system.comm.size,
        "versions": versions(),
    }


def net_of(placed: ContactSetup) -> ContactNet:
    """Return the nodes of a contact and the facets between them."""
    return contact_net(placed.pair, placed.sliding.field, sheet.axes(placed))


def _places(system: Tribosystem) -> NDArray[np.float64]:
    """Return three places along a contact that is a line, mm."""
    x = system.pair.x
    places = (x[-1] + x[0]) / 2 + (x[-1] - x[0]) * np.array([-0.25, 0.0, 0.25])
    return without_noise(places, float(np.ptp(x)))


def _plane_summary(system: Tribosystem, last: Block) -> dict[str, Any]:
    pair, places, phases = system.pair, _places(system), system.motion.half_cycles
    net = net_of(system)
    return {
        "mean_pressure_MPa": system.rigid.mean_pressure,
        "x_mm": places.tolist(),
        "wear_mm": pair.interpolate(last.wear[-1], places).tolist(),
        **{
            system.direction_words[int(d)]: {
                "half_cycle": int(last.half_cycle[-phases:][i]),
                "largest_pressure_MPa": float(last.largest_pressure[-phases:][i]),
                "pressure_MPa": pair.interpolate(last.pressure[-phases:][i], places).tolist(),
                **net.numbers(last.pressure[-phases:][i]),
                "contact_width_mm": float(last.contact_width[-phases:][i]),
            }
            for i, d in enumerate(last.direction[-phases:])
        },
    }


def _surface_summary(system: Tribosystem, last: Block) -> dict[str, Any]:
    """Return the key numbers of solids and rings: their scars, and the contact of the last cycle.

    The mean pressure is that over what is in contact; over the nominal contact only where the surfaces lie on each
    other before they wear.
    """
    pair, phases, net = system.pair, system.motion.half_cycles, net_of(system)
    mean = {"mean_pressure_MPa": system.rigid.mean_pressure} if conforming(pair) else {}
    cycle = slice(-phases, None)
    rows = zip(
        last.direction[cycle], last.half_cycle[cycle], last.pressure[cycle], last.contact_width[cycle], strict=True
    )
    return {
        **mean,
        **{
            system.direction_words[int(d)]: {
                "half_cycle": int(number),
                "largest_pressure_MPa": float(pressure.max()),
                "mean_pressure_MPa": float(pair.weights @ pressure / max(area, 1e-300)),
                **net.numbers(np.asarray(pressure)),
                "contact_area_mm2": float(area),
            }
            for d, number, pressure, area in rows
        },
    }


def _heat_summary(system: Tribosystem, last: Block, hottest: float) -> dict[str, Any]:
    assert last.heat is not None
    heat, along, degrees = last.heat, {}, degrees_of(system.case)
    if system.case.model.kind == "plane":
        places, interpolate = _places(system), system.pair.interpolate
        along = {
            f"temperature_punch_{degrees.unit}": degrees.of(interpolate(heat.temperature_punch[-1], places)).tolist(),
            f"temperature_strip_{degrees.unit}": degrees.of(interpolate(heat.temperature_strip[-1], places)).tolist(),
        }
    return {
        f"largest_temperature_{degrees.unit}": float(heat.largest_temperature[-1]) - degrees.zero,
        f"{HOTTEST}_{degrees.unit}": hottest - degrees.zero,
        **along,
        "heat_mJ": dict(zip((*TERMS, *CROSSING), heat.terms[-1].tolist(), strict=True)),
    }
