"""What a run with stick leaves: history.nc with every time step of the kept cycles, and the key numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.contact.complementarity import complementarity_error
from fenwear.interface import ContactPair
from fenwear.results.degrees import KELVIN, degrees_of
from fenwear.results.summary import HOTTEST
from fenwear.results.surfaces import DIMENSIONS, Variable, columns_of_pair, on_mesh
from fenwear.results.zone import ContactNet, contact_net
from fenwear.sliding.wear import Worn
from fenwear.stick.cycle import Records, Rig
from fenwear.stick.edge import beside, stick_edges, zone_width
from fenwear.stick.heat_results import HEAT_VARIABLES, heat_extremes, heat_summary, heat_values
from fenwear.stick.jump import Cycle
from fenwear.stick.strain import along_sliding, directions

# name: (dimensions, units, long_name)
VARIABLES: dict[str, Variable] = {
    "displacement": (("cycle", "step"), "mm", "displacement of the strip's supports at the end of the time step"),
    "tangential_force": (("cycle", "step"), "N", "tangential force on the strip"),
    "pressure": (("cycle", "step", "x"), "MPa", "contact pressure"),
    "traction": (("cycle", "step", "x"), "MPa", "tangential traction on the punch, along x"),
    "slip": (("cycle", "step", "x"), "mm", "slip of the punch against the strip in the time step"),
    "stick": (("cycle", "step", "x"), "1", "1 where the surfaces touch and do not slip"),
    "surface_stress": (("cycle", "step", "x"), "MPa", "stress along x in the strip's surface opposite each node"),
    "wear": (("cycle", "x"), "mm", "worn depth of the punch before the cycle"),
    "wear_strip": (("cycle", "x_strip"), "mm", "worn depth of the strip before the cycle"),
    "worn_area_increment": (("cycle",), "mm2", "cross-section worn off the punch in the cycle"),
    "worn_area_increment_strip": (("cycle",), "mm2", "cross-section worn off the strip in the cycle"),
    "dissipated_energy": (("cycle",), "mJ", "work of friction in the cycle"),
    "accumulated_energy": (("cycle",), "mJ", "work of friction in all cycles before"),
    "energy_ratio": (("cycle",), "1", "work of friction over four times largest force times largest displacement"),
    "energy_balance_error": (("cycle",), "1", "missing energy of a half-cycle over its largest term, the larger one"),
    "complementarity_error": (("cycle",), "1", "largest error of p >= 0, gap >= 0, p gap = 0 over their scales"),
    "stick_width": (("cycle",), "mm", "width that sticks all through the cycle"),
    "stick_width_within": (("cycle",), "mm", "half the interval in which the width that sticks is known to lie"),
    "contact_width": (("cycle",), "mm", "largest width in contact"),
    "jump_error": (("cycle",), "1", "estimated error of the depths of the jump to the cycle, over what it wore"),
}
CONTACT_NODE = "position along the contact, from the centre of the geometry"
# of solids: the name in a plane model, and name, unit and meaning instead
IN_SOLIDS = {
    "traction": ("traction", "MPa", "tangential traction on the punch, along the sliding"),
    "slip": ("slip", "mm", "slip of the punch against the strip in the time step, along the sliding"),
    "surface_stress": ("surface_stress", "MPa", "stress along the sliding in the strip's surface opposite each node"),
    "worn_area_increment": ("worn_volume_increment", "mm3", "volume worn off the punch in the cycle"),
    "worn_area_increment_strip": ("worn_volume_increment_strip", "mm3", "volume worn off the strip in the cycle"),
    "stick_width": ("stick_area", "mm2", "area that sticks all through the cycle"),
    "stick_width_within": ("stick_area_within", "mm2", "half the interval in which the area that sticks may lie"),
    "contact_width": ("contact_area", "mm2", "largest area in contact"),
}
ACROSS: dict[str, Variable] = {
    "traction_across": (("cycle", "step", "x"), "MPa", "tangential traction on the punch, across the sliding"),
    "slip_across": (("cycle", "step", "x"), "mm", "slip in the time step, across the sliding"),
}


def of_solids() -> dict[str, Variable]:
    """Return what a solid has in place of the plane's variables of the same names, and as well."""
    plane = {name: value for name, value in VARIABLES.items() if name in IN_SOLIDS or value[0][-1] in DIMENSIONS}
    found = {}
    for name, (dimensions, units, text) in {**plane, **ACROSS}.items():
        new, unit, meaning = IN_SOLIDS.get(name, (name, units, text))
        found[new] = (tuple(DIMENSIONS.get(d, d) for d in dimensions), unit, meaning)
    return found


@dataclass(frozen=True)
class Row:
    """The values of one kept cycle, by the names of `VARIABLES` and `ACROSS`."""

    number: int
    values: dict[str, Any]


def row_of(rig: Rig, case: Case, cycle: Cycle) -> Row:
    """Return what is kept of a cycle; its time steps in the order of the motion."""
    records, weights, thick = cycle.records, rig.weights, case.model.thickness
    order = (np.arange(len(records)) - cycle.first_step) % len(records)
    energy = thick * records.energy(weights)
    force = thick * records.force
    reach = float(np.ptp(records.displacement)) / 2
    most = float(np.abs(force).max())
    pair = rig.interface.middle.pair
    turn = along_sliding(rig.interface.middle)
    traction, slip = (np.einsum("nam,knm->akn", turn, v[order]) for v in (records.traction, records.slip))
    stuck, within = stuck_size(pair, records)
    values: dict[str, Any] = {
        "displacement": records.displacement[order],
        "tangential_force": force[order],
        "pressure": records.pressure[order],
        "traction": traction[0],
        "slip": slip[0],
        "stick": records.sticking[order].astype(np.int8),
        "surface_stress": surface_stress(case, records)[order],
        "wear": cycle.worn.punch,
        "wear_strip": cycle.worn.strip,
        "worn_area_increment": float(weights @ cycle.rate.punch),
        "worn_area_increment_strip": float(pair.strip.weights @ cycle.rate.strip),
        "dissipated_energy": energy,
        "accumulated_energy": thick * cycle.spent,
        "energy_ratio": energy / max(4 * most * reach, 1e-300),
        **errors_of(rig, cycle),
        "stick_width": stuck,
        "stick_width_within": within,
        "contact_width": float(((records.pressure > 0) @ weights).max()),
        **heat_values(cycle, order),
    }
    if len(traction) > 1:
        values |= {"traction_across": traction[1], "slip_across": slip[1]}
    return Row(cycle.number, values)


def errors_of(rig: Rig, cycle: Cycle) -> dict[str, float]:
    """Return what of a cycle is held against its bounds, by the names of `VARIABLES`."""
    records = cycle.records
    broken = complementarity_error(records.pressure, records.gap, rig.interface.middle.elastic_length)
    return {
        "complementarity_error": float(broken.max()),
        "energy_balance_error": max(part.balance_error(rig.weights) for part in cycle.half_cycles),
        "jump_error": cycle.error,
    }


def extremes_with(extremes: Mapping[str, float], rig: Rig, cycle: Cycle) -> dict[str, float]:
    """Return what was largest in the cycles so far and in one more, by name; of temperatures in K."""
    new = {**errors_of(rig, cycle), **heat_extremes(cycle)}
    return {f"largest_{name}": max(extremes.get(f"largest_{name}", -np.inf), value) for name, value in new.items()}


def net_of(rig: Rig) -> ContactNet:
    """Return the nodes of the contact and the facets between them."""
    pair = rig.interface.middle.pair
    return contact_net(pair, rig.interface.field, ("x", "y", "z") if pair.punch.dim == 3 else ("x",))


def stuck_size(pair: ContactPair, records: Records) -> tuple[float, float]:
    """Return the width, in a solid the area, that sticks all through a cycle, and half the interval left of it.

    In a solid it is the area of the nodes, to half of what those beside it stand for.
    """
    if pair.punch.dim == 3:
        rim = beside(pair.punch, records.stuck) & records.touched
        return float(pair.weights @ records.stuck), float(pair.weights @ rim) / 2
    return zone_width(stick_edges(pair.x, records.stuck, records.slid.sum(axis=0), records.touched))


def surface_stress(case: Case, records: Records) -> Array:
    """Return the stress along the sliding in the strip's surface (k, n), MPa, from its strains and the pressure on it.

    The law of the strip's material, with sigma_zz = -p: in a solid, and with eps_yy = 0 in plane strain,
    sigma_xx = E / (1 - nu²) (eps_xx + nu eps_yy) - nu / (1 - nu) p, in plane stress E eps_xx - nu p.
    """
    along = records.strain[:, :, 0]
    names = set(case.strip.regions.values())
    if len(names) > 1:
        return np.full(along.shape, np.nan)
    material = case.materials[names.pop()]
    young, nu = material.young, material.poisson
    if case.model.kind == "plane" and case.model.law == "stress":
        return young * along - nu * records.pressure
    both = along if case.model.kind == "plane" else along + nu * records.strain[:, :, 1]
    return young / (1 - nu**2) * both - nu / (1 - nu) * records.pressure


def dataset(rig: Rig, case: Case, rows: Sequence[Row]) -> xarray.Dataset:
    """Return the kept cycles as a data set."""
    solid, degrees = case.model.kind == "solid", degrees_of(case)
    data = {}
    variables = {**VARIABLES, **(ACROSS if solid else {}), **({} if rig.heat is None else HEAT_VARIABLES)}
    for name, (dimensions, units, text) in variables.items():
        values = np.array([row.values[name] for row in rows])
        warm = units == KELVIN.unit
        as_told = (name, degrees.unit if warm else units, text)
        new, unit, meaning = IN_SOLIDS.get(name, as_told) if solid else as_told
        over = tuple(DIMENSIONS.get(d, d) for d in dimensions) if solid else dimensions
        place = on_mesh(over, 3) if solid else {}
        data[new] = (
            over,
            degrees.of(values) if warm else values,
            {"units": _turned(unit, new, rig), "long_name": meaning, **place},
        )
    steps = rig.program.steps
    coordinates: dict[str, Any] = {
        "cycle": ("cycle", [row.number for row in rows], {"units": "1", "long_name": "cycles done before"}),
        "fraction": ("step", [s.fraction for s in steps], {"units": "1", "long_name": "fraction of the cycle"}),
        "half_cycle_of_step": ("step", [s.half_cycle + 1 for s in steps], {"units": "1", "long_name": "half-cycle"}),
        **_nodes(rig),
    }
    attributes = {
        "title": case.title,
        "law": "coulomb",
        "friction": float(rig.friction[0]),
        "model": case.model.kind,
        "period": rig.program.period,  # s
    }
    return xarray.Dataset(data, coordinates, attributes)


def _turned(unit: str, name: str, rig: Rig) -> str:
    """Return the unit of a variable where the strip turns: by rad, against a torque."""
    turns = any(rig.interface.field.turn)
    return {"displacement": "rad", "tangential_force": "N mm"}.get(name, unit) if turns else unit


def _nodes(rig: Rig) -> dict[str, Any]:
    """Return where the nodes of both surfaces are."""
    pair = rig.interface.middle.pair
    if pair.normal.shape[1] == 3:
        found: dict[str, Any] = dict(columns_of_pair(pair, rig.interface.field, with_strip=True))
        area = {"units": "mm2", "long_name": "area that each contact node stands for"}
        ways = directions(rig.interface.middle)
        return {
            **found,
            "weight": ("node", rig.weights, area),
            "sliding_along": (("node", "axis"), ways[:, 0], {"units": "1", "long_name": "direction of the sliding"}),
            "sliding_across": (("node", "axis"), ways[:, 1], {"units": "1", "long_name": "direction across it"}),
        }
    return {
        "x": ("x", pair.x, {"units": "mm", "long_name": CONTACT_NODE}),
        "x_strip": ("x_strip", pair.strip.x[:, 0], {"units": "mm", "long_name": "position along the strip"}),
        "weight": ("x", rig.weights, {"units": "mm", "long_name": "length that each contact node stands for"}),
        **{
            f"normal_{axis}": ("x", pair.normal[:, k], {"units": "1", "long_name": f"contact's normal, along {axis}"})
            for k, axis in enumerate("xz")
        },
    }


def summary_of(rig: Rig, data: xarray.Dataset, worn: Worn, extremes: Mapping[str, float]) -> dict[str, Any]:
    """Return the key numbers of the end of a run, each with its unit in its name.

    Args:
        rig: The bodies.
        data: The kept cycles.
        worn: The depths at its end.
        extremes: What was largest in all cycles, see `extremes_with`.
    """
    last = data.isel(cycle=-1)
    solid = data.attrs["model"] == "solid"
    traction = np.hypot(last.traction, last.traction_across) if solid else np.abs(last.traction)
    zone = traction.where(last.stick == 1)
    hardest = last.pressure.values[last.pressure.values.max(axis=1).argmax()]
    sizes = (
        {
            "contact_area_mm2": float(last.contact_area),
            "stick_area_mm2": float(last.stick_area),
            "stick_area_within_mm2": float(last.stick_area_within),
        }
        if solid
        else {
            "contact_width_mm": float(last.contact_width),
            "stick_width_mm": float(last.stick_width),
            "stick_width_within_mm": float(last.stick_width_within),
        }
    )
    return {
        "title": data.attrs["title"],
        "cycles": int(last.cycle),
        "largest_force_N": float(np.abs(last.tangential_force).max()),
        "max_pressure_MPa": float(hardest.max()),
        **net_of(rig).numbers(hardest),
        "largest_traction_MPa": float(traction.max()),
        "largest_stick_traction_MPa": float(zone.max()) if zone.notnull().any() else 0.0,
        "largest_surface_stress_MPa": float(last.surface_stress.max()),
        "dissipated_energy_mJ": float(last.dissipated_energy),
        "accumulated_energy_mJ": float(last.accumulated_energy),
        "energy_ratio": float(last.energy_ratio),
        **sizes,
        "wear_max_mm": float(worn.punch.max()),
        "wear_strip_max_mm": float(worn.strip.max()),
        "worn_volume_punch_mm3" if solid else "worn_area_punch_mm2": float(data.weight.values @ worn.punch),
        **heat_summary(data, extremes),
        **{name: value for name, value in extremes.items() if name != HOTTEST},
    }
