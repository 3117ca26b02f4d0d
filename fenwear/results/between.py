"""What lies between the surfaces, in history.nc and summary.json: the third body, the plastic depth, states of laws.

worn volume of both bodies + volume at the start = stored + ejected

A state that a law remembers is `state_NAME` there, on the strip's material `state_NAME_strip`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import ContactSetup
from fenwear.cycle import Block
from fenwear.layers.between import DEBRIS, PLASTIC
from fenwear.results.quantity import Variable

OF_DEBRIS: dict[str, Variable] = {
    "debris_thickness": (("half_cycle", "x"), "mm", "thickness of the debris between the surfaces at the end"),
    "largest_debris_thickness": (("half_cycle",), "mm", "largest thickness of the debris at the end"),
    "debris_volume": (("half_cycle",), "mm3", "volume of the debris between the surfaces at the end"),
    "ejected_volume": (("half_cycle",), "mm3", "volume of the debris ejected from the start"),
    "debris_balance_error": (("half_cycle",), "1", "worn volume that is neither stored nor ejected, over the worn one"),
}
ON_STRIP: dict[str, Variable] = {
    "debris_thickness_strip": (("half_cycle", "x_strip"), "mm", "thickness of the debris on the strip at the end"),
}
OF_FLOW: dict[str, Variable] = {
    "plastic_depth": (("half_cycle", "x"), "mm", "depth that has flown beyond the hardness, apart from wear"),
    "largest_plastic_depth": (("half_cycle",), "mm", "largest depth that has flown beyond the hardness"),
    "plastic_volume": (("half_cycle",), "mm3", "volume that has flown beyond the hardness, apart from wear"),
}
STATE, STATES = "state_", "states"  # how variables of states begin; where summary.json has them


def variables(placed: ContactSetup) -> dict[str, Variable]:
    """Return the variables of what lies between the surfaces."""
    layers = placed.layers
    own = {**({} if layers.debris is None else OF_DEBRIS), **(OF_FLOW if PLASTIC in layers.rows else {})}
    if layers.strip_carries:
        own |= ON_STRIP
    return {**own, **_of_states(placed)}


def _of_states(placed: ContactSetup) -> dict[str, Variable]:
    memory, found = placed.layers.memory, dict[str, Variable]()
    for states, over, end, body in (
        (memory.contact, "x", "", ""),
        (memory.strip, "x_strip", "_strip", " of the strip"),
    ):
        for name, state in states.items():
            text = f"{name}{body}, a state that a law remembers, at the end"
            found[f"{STATE}{name}{end}"] = (("half_cycle", over), state.unit, text)
    return found


def _states(block: Block) -> dict[str, Array]:
    """Return the states of laws by the names of their variables (k, n), on the strip's material (k, n_strip)."""
    layers = block.system.layers
    first, own = len(layers.rows) - len(layers.memory.contact), len(layers.carried_rows)
    found = {f"{STATE}{name}": block.between[:, first + k] for k, name in enumerate(layers.memory.contact)}
    return found | {f"{STATE}{name}_strip": block.carried[:, own + k] for k, name in enumerate(layers.memory.strip)}


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, rows = block.system, block.system.layers.rows
    areas = system.bodies.punch.thickness * system.pair.weights
    found: dict[str, Array] = {}
    if PLASTIC in rows:
        depth = block.between[:, rows.index(PLASTIC)]
        found = {
            "plastic_depth": depth,
            "largest_plastic_depth": depth.max(axis=1),
            "plastic_volume": depth @ areas,
        }
    found |= _states(block)
    if system.layers.debris is None:
        return found
    if system.layers.strip_carries:
        areas = system.bodies.punch.thickness * system.carried_areas
        stored, ejected = block.carried[:, 0], block.carried[:, 1]
        lies, on_strip = stored @ system.pair.wear_interpolation.T, {"debris_thickness_strip": stored}
    else:
        stored, ejected = (block.between[:, rows.index(name)] for name in DEBRIS)
        lies, on_strip = stored, {}
    begun = float(areas.sum()) * system.layers.debris.initial
    fed = begun + sum(block.totals.of(f"volume_{body}") for body in ("punch", "strip"))
    return {
        **found,
        **on_strip,
        "debris_thickness": lies,
        "largest_debris_thickness": lies.max(axis=1),
        "debris_volume": stored @ areas,
        "ejected_volume": ejected @ areas,
        "debris_balance_error": np.abs(fed - (stored + ejected) @ areas) / np.maximum(fed, 1e-300),
    }


def states(last: Block) -> dict[str, dict[str, Any]]:
    """Return mean, smallest and largest of the states that laws remember at the end of a run, for summary.json."""
    units = {name: unit for name, (_, unit, _) in _of_states(last.system).items()}
    return {
        name.removeprefix(STATE): {"unit": units[name], **_extent(_weights(last, name), rows[-1])}
        for name, rows in _states(last).items()
    }


def _weights(block: Block, name: str) -> Array:
    """Return the areas of the nodes that a state has values at."""
    on_strip = _of_states(block.system)[name][0][-1] == "x_strip"
    return block.system.pair.strip.weights if on_strip else block.system.pair.weights


def _extent(weights: Array, values: Array) -> dict[str, float]:
    """Return mean over the surface, smallest and largest of nodal values."""
    mean = float(weights @ values) / float(weights.sum())
    return {"mean": mean, "smallest": float(values.min()), "largest": float(values.max())}
