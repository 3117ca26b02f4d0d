"""What a run with stick leaves: history.nc with every time step of the kept cycles, and the key numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.sliding.wear import Worn
from fenwear.stick.cycle import Records, Rig
from fenwear.stick.heat_results import HEAT_VARIABLES, heat_summary, heat_values
from fenwear.stick.jump import Cycle

# name: (dimensions, units, long_name)
VARIABLES = {
    "displacement": (("cycle", "step"), "mm", "displacement of the strip's supports at the end of the time step"),
    "tangential_force": (("cycle", "step"), "N", "tangential force on the strip"),
    "pressure": (("cycle", "step", "x"), "MPa", "contact pressure"),
    "traction": (("cycle", "step", "x"), "MPa", "tangential traction on the punch, along x"),
    "slip": (("cycle", "step", "x"), "mm", "slip of the punch against the strip in the time step"),
    "stick": (("cycle", "step", "x"), "1", "1 where the surfaces touch and do not slip"),
    "surface_stress": (("cycle", "step", "x"), "MPa", "stress along x in the strip's surface opposite each node"),
    "wear": (("cycle", "x"), "mm", "worn depth of the punch before the cycle"),
    "wear_strip": (("cycle", "x_strip"), "mm", "worn depth of the strip before the cycle"),
    "worn_area": (("cycle",), "mm2", "cross-section worn off the punch in the cycle"),
    "worn_area_strip": (("cycle",), "mm2", "cross-section worn off the strip in the cycle"),
    "dissipated_energy": (("cycle",), "mJ", "work of friction in the cycle"),
    "energy_ratio": (("cycle",), "1", "work of friction over four times largest force times largest displacement"),
    "energy_balance_error": (("cycle",), "1", "missing energy of a half-cycle over its largest term, the larger one"),
    "stick_width": (("cycle",), "mm", "width that sticks all through the cycle"),
    "contact_width": (("cycle",), "mm", "largest width in contact"),
    "jump_error": (("cycle",), "1", "estimated error of the depths of the jump to the cycle, over what it wore"),
}
CONTACT_NODE = "position along the contact, from the centre of the geometry"


@dataclass(frozen=True)
class Row:
    """The values of one kept cycle, by the names of `VARIABLES`."""

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
    values: dict[str, Any] = {
        "displacement": records.displacement[order],
        "tangential_force": force[order],
        "pressure": records.pressure[order],
        "traction": records.traction[order, :, 0],
        "slip": records.slip[order, :, 0],
        "stick": records.sticking[order].astype(np.int8),
        "surface_stress": surface_stress(case, records)[order],
        "wear": cycle.worn.punch,
        "wear_strip": cycle.worn.strip,
        "worn_area": float(weights @ cycle.rate.punch),
        "worn_area_strip": float(pair.strip.weights @ cycle.rate.strip),
        "dissipated_energy": energy,
        "energy_ratio": energy / max(4 * most * reach, 1e-300),
        "energy_balance_error": max(part.balance_error(weights) for part in cycle.half_cycles),
        "stick_width": float(weights @ records.sticking.all(axis=0)),
        "contact_width": float(((records.pressure > 0) @ weights).max()),
        "jump_error": cycle.error,
        **heat_values(cycle, order),
    }
    return Row(cycle.number, values)


def surface_stress(case: Case, records: Records) -> Array:
    """Return sigma_xx in the strip's surface (k, n), MPa, from its strain along x and the pressure on it.

    The law of the strip's material, with sigma_zz = -p: in plane strain
    sigma_xx = E / (1 - nu²) eps_xx - nu / (1 - nu) p, in plane stress E eps_xx - nu p.
    """
    names = set(case.strip.regions.values())
    if len(names) > 1 or case.model.kind != "plane":
        return np.full(records.strain.shape, np.nan)
    material = case.materials[names.pop()]
    young, nu = material.young, material.poisson
    if case.model.law == "strain":
        return young / (1 - nu**2) * records.strain - nu / (1 - nu) * records.pressure
    return young * records.strain - nu * records.pressure


def dataset(rig: Rig, case: Case, rows: Sequence[Row]) -> xarray.Dataset:
    """Return the kept cycles as a data set."""
    pair = rig.interface.middle.pair
    data = {
        name: (dimensions, np.array([row.values[name] for row in rows]), {"units": units, "long_name": text})
        for name, (dimensions, units, text) in {**VARIABLES, **({} if rig.heat is None else HEAT_VARIABLES)}.items()
    }
    steps = rig.program.steps
    coordinates: dict[str, Any] = {
        "cycle": ("cycle", [row.number for row in rows], {"units": "1", "long_name": "cycles done before"}),
        "fraction": ("step", [s.fraction for s in steps], {"units": "1", "long_name": "fraction of the cycle"}),
        "half_cycle_of_step": ("step", [s.half_cycle + 1 for s in steps], {"units": "1", "long_name": "half-cycle"}),
        "x": ("x", pair.x, {"units": "mm", "long_name": CONTACT_NODE}),
        "x_strip": ("x_strip", pair.strip.x[:, 0], {"units": "mm", "long_name": "position along the strip"}),
        "weight": ("x", rig.weights, {"units": "mm", "long_name": "length that each contact node stands for"}),
    }
    attributes = {"title": case.title, "law": "coulomb", "friction": float(rig.friction[0])}
    return xarray.Dataset(data, coordinates, attributes)


def summary_of(data: xarray.Dataset, worn: Worn) -> dict[str, Any]:
    """Return the key numbers of the end of a run, each with its unit in its name."""
    last = data.isel(cycle=-1)
    zone = last.traction.where(last.stick == 1)
    return {
        "title": data.attrs["title"],
        "cycles": int(last.cycle),
        "largest_force_N": float(np.abs(last.tangential_force).max()),
        "max_pressure_MPa": float(last.pressure.max()),
        "largest_traction_MPa": float(np.abs(last.traction).max()),
        "largest_stick_traction_MPa": float(np.abs(zone).max()) if zone.notnull().any() else 0.0,
        "largest_surface_stress_MPa": float(last.surface_stress.max()),
        "dissipated_energy_mJ": float(last.dissipated_energy),
        "accumulated_energy_mJ": float(np.trapezoid(data.dissipated_energy, data.cycle)),
        "energy_ratio": float(last.energy_ratio),
        "contact_width_mm": float(last.contact_width),
        "stick_width_mm": float(last.stick_width),
        "wear_max_mm": float(worn.punch.max()),
        "wear_strip_max_mm": float(worn.strip.max()),
        "worn_area_punch_mm2": float(data.weight.values @ worn.punch),
        "largest_energy_balance_error": float(data.energy_balance_error.max()),
        "largest_jump_error": float(data.jump_error.max()),
        **heat_summary(data),
    }
