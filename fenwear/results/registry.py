"""The registry of quantities: all that histories, summaries, sweeps, studies and figures know of a contact.

A quantity has one name, unit and meaning, and one function that computes it. `quantities_of` lists those of a system,
`known` those of any, by their names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import cache, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.common.arrays import Array
from fenwear.heat.heat_exchange import CROSSING, TERMS
from fenwear.results import forces_and_place, layer_results, roughness, sheet, time_steps
from fenwear.results.quantity import BODIES, RECORD, Quantity
from fenwear.steps import Block
from fenwear.steps.run_state import all_phases
from fenwear.steps.steady_cycle import SteadyCycle
from fenwear.surfaces import is_translation

if TYPE_CHECKING:
    from fenwear.system import Tribosystem

ALONG = ("half_cycle", "x")
TURNS = {"moved": "mm", "turned": "rad"}  # units of the rigid motions of bodies, by how their names begin


def _weights(records: Any, body: str) -> Array:
    """Return the areas that the nodes of a surface stand for (k, n): meshes that follow the wear change them."""
    pair = records.system.pair
    weights = pair.weights if body == "punch" else pair.strip.weights
    return np.broadcast_to(weights, (len(records), len(weights)))


def _of_records(name: str, dims: tuple[str, ...], unit: str, long_name: str, **arguments: Any) -> Quantity:
    """Return a quantity that records of half-cycles have under its name."""
    return Quantity(name, dims, unit, long_name, attrgetter(name), **arguments)


IN_RUN = (
    _of_records("half_cycle", RECORD, "1", "number of the half-cycle"),
    _of_records("time", RECORD, "s", "time at the end of the half-cycle"),
    _of_records("direction", RECORD, "1",
                "sliding direction of the strip: 1 rightward or counterclockwise, -1 leftward or clockwise"),
    _of_records("pressure", ALONG, "MPa", "contact pressure during the half-cycle", cycle="largest", steady=True,
                nodal=True),
    _of_records("gap", ALONG, "mm", "gap between punch and strip during the half-cycle"),
    _of_records("wear", ALONG, "mm", "worn depth of the punch at the end of the half-cycle", nodal=True),
    *sheet.CONTACT[:1],
    _of_records("contact_width", RECORD, "mm", "width in contact", cycle="largest", steady=True, nodal=True),
    *sheet.CONTACT[1:],
    _of_records("optimum_distance", RECORD, "1", "share of the load that is carried elsewhere than in the optimum: "
                "half the integral of their difference"),
    _of_records("periodicity", RECORD, "1",
                "largest change of pressure against one cycle ago over the pressure scale"),
    _of_records("equilibrium_error", RECORD, "1", "error of the force and moment balance relative to the load",
                cycle="largest"),
    _of_records("complementarity_error", RECORD, "1",
                "largest error of p >= 0, gap >= 0, p gap = 0 over their scales", cycle="largest"),
    _of_records("retries", RECORD, "1", "solves that took a second attempt, in another way or in smaller steps"),
    Quantity("weight", ALONG, "mm", "length that each contact node stands for, on the mesh of the half-cycle",
             partial(_weights, body="punch")),
)  # fmt: skip
OF_STRIP = (
    _of_records("wear_strip", ("half_cycle", "x_strip"), "mm", "worn depth of the strip at the end of the half-cycle",
                nodal=True),
    Quantity("weight_strip", ("half_cycle", "x_strip"), "mm", "length swept by the punch that each node stands for, on "
             "the mesh of the half-cycle; of a closed track that of its meshed part", partial(_weights, body="strip")),
)  # fmt: skip
OF_PROGRAM = (
    _of_records("load", RECORD, "N", "normal force on the contact, the mean of the cycle"),
    _of_records("load_factor", RECORD, "1", "all loads over those of the case"),
    _of_records("speed", RECORD, "mm s-1", "mean sliding speed"),
    _of_records("ambient", RECORD, "K", "temperature of the surroundings"),
)
ANGULAR = "mean angular speed of the strip"
TERM_TEXTS = {
    "friction": "heat made by friction in the half-cycle",
    "debris": "heat carried off by debris",
    "stored": "heat gained by both bodies",
    "convected": "heat lost to the surroundings",
    "held": "heat lost through boundaries of held temperature",
    "carried": "heat that the strip's material carries out of the model",
    "into_punch": "heat that enters the punch across the contact in the half-cycle",
    "into_strip": "heat that enters the strip across the contact in the half-cycle",
}


def _term(records: Any, number: int) -> Array:
    return np.asarray(records.heat.terms[:, number])


def _of_heat(name: str, dims: tuple[str, ...], unit: str, text: str, attribute: str = "", **arguments: Any) -> Quantity:
    return Quantity(name, dims, unit, text, attrgetter(f"heat.{attribute or name}"), **arguments)


OF_HEAT = (
    _of_heat("temperature_punch", ALONG, "K", "temperature of the punch's contact surface at the end", cycle="largest",
             steady=True, nodal=True),
    _of_heat("temperature_strip", ALONG, "K", "temperature of the strip's contact surface at the end", cycle="largest",
             steady=True, nodal=True),
    _of_heat("largest_temperature", RECORD, "K", "largest temperature of the contact surfaces at the end",
             cycle="largest", steady=True, nodal=True),
    _of_heat("coupling_iterations", RECORD, "1", "iterations of heat and contact"),
    _of_heat("heat_balance_error", RECORD, "1", "missing heat over the largest term of the balance", "balance_error",
             cycle="largest"),
    *(
        Quantity(f"heat_{name}", RECORD, "mJ", TERM_TEXTS[name], partial(_term, number=k), "sum")
        for k, name in enumerate((*TERMS, *CROSSING))
    ),
)  # fmt: skip
OF_TRACK = (
    _of_heat("temperature_bulk", RECORD, "K", "temperature of the bulk of the strip's closed track at the end"),
)
# What solids and rings have in place of the plane's.
ON_SURFACES = {
    "weight": ("mm2", "area that each contact node stands for, on the mesh of the half-cycle"),
    "weight_strip": ("mm2", "swept area that each node stands for, on the mesh of the half-cycle"),
    "direction": ("1", "sliding direction of the strip: 1 forward or counterclockwise, -1 backward or clockwise"),
}
NODES = {"x": "node", "x_strip": "node_strip"}


def on_surface(quantity: Quantity) -> Quantity:
    """Return a quantity of plane models as that of solids and rings."""
    unit, text = ON_SURFACES.get(quantity.name, (quantity.unit, quantity.long_name))
    return replace(quantity, dims=tuple(NODES.get(d, d) for d in quantity.dims), unit=unit, long_name=text)


def on_surfaces(quantities: Iterable[Quantity]) -> list[Quantity]:
    """Return the quantities of plane models that solids and rings have, as theirs."""
    return [on_surface(quantity) for quantity in quantities if quantity.name != "contact_width"]


def _in_cycle(records: Block | SteadyCycle) -> float:
    """Return the largest pressure of a cycle in any phase or time step, MPa."""
    if isinstance(records, SteadyCycle):
        return float(records.phase_pressure.max())
    strokes, contacts = records.system.motion.half_cycles, all_phases(records.end.contacts).pressure
    steps_taken = [stroke.pressure for stroke in records.steps[-strokes:]]
    return float(
        np.max([pressures.max() for pressures in steps_taken or [contacts if len(contacts) else records.pressure]])
    )


IN_CYCLE = Quantity("largest_pressure_in_cycle", (), "MPa", "largest contact pressure at any time of the cycle",
                    _in_cycle, steady=True, of="end")  # fmt: skip


def quantities_of(system: Tribosystem) -> dict[str, Quantity]:
    """Return the quantities of a system by their names."""
    case = system.case
    heat, track = case.heat is not None, case.heat is not None and case.heat.track is not None
    quantities = [
        *IN_RUN,
        *(() if case.wear.strip is None else OF_STRIP),
        *(quantity for quantity in OF_PROGRAM if case.program is not None and (heat or quantity.name != "ambient")),
        *(OF_HEAT if heat else ()),
        *(OF_TRACK if track else ()),
        *sheet.quantities(system),
        *(
            quantity
            for room in (layer_results, forces_and_place, roughness, time_steps)
            for quantity in room.quantities(system)
        ),
        IN_CYCLE,
    ]
    if case.model.kind != "plane":
        quantities = on_surfaces(quantities)
    if case.turns:
        quantities = [
            replace(quantity, unit="rad s-1", long_name=ANGULAR) if quantity.name == "speed" else quantity
            for quantity in quantities
        ]
    return {
        quantity.name: replace(quantity, long_name=case.names.with_names(quantity.long_name)) for quantity in quantities
    }


@cache
def _prototypes() -> dict[str, Quantity]:
    listed = [*IN_RUN, *OF_STRIP, *OF_PROGRAM, *OF_HEAT, *OF_TRACK, *sheet.SLIDING, *sheet.TURNING]
    for body in BODIES:
        listed += [*sheet.of_a_body(body), *sheet.of_a_plane_body(body)]
        listed += sheet.of_the_scar(body, sheet.PLACES, ("length", "width"))
        listed += [*layer_results.of_creeping(body), *layer_results.of_coated(body), *roughness.of_body(body)]
    listed += [
        *forces_and_place.of_bore("", dict),
        *time_steps.IN_STEPS,
        *time_steps.of_solids(),
        *layer_results.OF_DEBRIS,
        *layer_results.OF_FLOW,
    ]
    listed += [IN_CYCLE, *time_steps.OF_CYCLE]
    return {quantity.name: quantity for quantity in listed}


UNKNOWN = Quantity("", ("unknown",), "1", "", attrgetter(""))


def known(name: str) -> Quantity:
    """Return the quantity of a name that some system has; `UNKNOWN`, which has no name, where none does."""
    motion, mode = re.fullmatch(r"(moved|turned)_([xyz])(_\w+)?", name), re.fullmatch(r"lambda_[FM]\w*", name)
    if motion:
        text = f"how far a body has {motion[1]} along or about {motion[2]}, from where it was meshed"
        return Quantity(name, RECORD, TURNS[motion[1]], text, attrgetter(name))
    if mode:
        unit = "mm" if is_translation(name) else "rad"
        text = "rigid-body wear of the punch in a cycle: its approach, or its rotation"
        return Quantity(name, (), unit, text, attrgetter(name), steady=True)
    return _prototypes().get(name, UNKNOWN)


def names_known() -> list[str]:
    """Return the names of all quantities that are one number of a half-cycle or cycle, without those of the strip."""
    single = [quantity.name for quantity in _prototypes().values() if quantity.dims in (RECORD, ())]
    listed = [name for name in single if not name.endswith("_strip")]
    return [*listed, *(f"{motion}_{axis}" for motion in TURNS for axis in "xyz")]


LARGEST = {
    "wear": "largest_depth",
    "wear_strip": "largest_depth_strip",
    "pressure": "largest_pressure",
    "temperature": "largest_temperature",
    "creep_depth": "largest_creep_depth",
    "creep_depth_strip": "largest_creep_depth_strip",
}  # fmt: skip  (what the largest value of nodal ones is called)
