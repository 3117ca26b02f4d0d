"""What is on the surfaces besides wear, in history.nc and summary.json: debris, plastic depth, coatings, creep.

    worn volume of both bodies + volume at the start = stored + ejected

A state that a law remembers is `state_NAME` there, on the strip's material `state_NAME_strip`.

Between two recorded half-cycles a coating ends where what its coefficient would have worn reaches what was left: exact
where the pressure stays, see `fenwear.sliding.coating`.

The depth that a body has crept is how far its contact surface has gone back into it, against its supports or, of a free
body, the surfaces on which its loads act, by what its compliance has grown to since it was loaded. It is that of the
contact nodes in the middle of a half-cycle. Its volume is the integral over them; a contact grid that grows adds nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup, Tribosystem
from fenwear.cycle import Block
from fenwear.cycle.state import RunState
from fenwear.layers.between import DEBRIS, PLASTIC
from fenwear.results.quantity import Variable
from fenwear.results.surfaces import EDGE
from fenwear.sliding.coating import CoatedBody, left_of
from fenwear.sliding.wear import coefficient

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


def _lying_variables(placed: ContactSetup) -> dict[str, Variable]:
    """Return the variables of what lies between the surfaces."""
    layers = placed.layers
    own = {**(OF_DEBRIS if layers.debris.present else {}), **(OF_FLOW if PLASTIC in layers.rows else {})}
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


def _lying_values(block: Block) -> dict[str, Array]:
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
    if not system.layers.debris.present:
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


BODIES = {"punch": "", "strip": "_strip"}  # and how the names of their variables end
SHARES = {"worn_through_of_scar": "scar", "worn_through_of_surface": "surface"}


def of_coated(body: str) -> dict[str, Variable]:
    """Return the variables of a coated body."""
    end = BODIES[body]
    left = f"coating of the {body} that is left at the end of the half-cycle"
    text = "share of the {}'s coated {} in which the coating is worn through at the end of the half-cycle"
    return {
        f"coating{end}": (("half_cycle", f"x{end}"), "mm", left),
        **{f"{name}{end}": (("half_cycle",), "1", text.format(body, of)) for name, of in SHARES.items()},
        f"least_coating{end}": (("half_cycle",), "mm", f"least {left}"),
    }


def _coating_variables(placed: ContactSetup) -> dict[str, Variable]:
    """Return the variables of coatings."""
    coated = zip(BODIES, placed.coatings, strict=True)
    return {name: one for body, own in coated if own.any() for name, one in of_coated(body).items()}


def coating_values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    pair, found = block.system.pair, dict[str, Array]()
    surfaces = ((pair.weights, block.wear), (pair.strip.weights, block.wear_strip))
    for end, thickness, (weights, depth) in zip(BODIES.values(), block.system.coatings, surfaces, strict=True):
        if thickness.any():
            coated, left = weights * (thickness > 0), left_of(thickness, depth)
            through = (depth >= thickness) @ coated
            scar = (depth > EDGE * depth.max(axis=1, keepdims=True)) @ coated
            found |= {f"coating{end}": left, f"least_coating{end}": left.min(axis=1)}
            found[f"worn_through_of_scar{end}"] = np.asarray(through / np.maximum(scar, 1e-300))
            found[f"worn_through_of_surface{end}"] = np.asarray(through / max(float(coated.sum()), 1e-300))
    return found


def worn_through(block: Block, before: RunState, known: Mapping[str, float]) -> dict[str, float]:
    """Return when and where coatings are worn through first in a run, and when last so far.

    Args:
        block: The half-cycles after those before.
        before: Where they begin.
        known: What of it was known before.
    """
    system, found = block.system, dict[str, float]()
    for row, (body, thickness) in enumerate(zip(BODIES, system.coatings, strict=True)):
        if not thickness.any():
            continue
        begun, own = ((before.worn.punch, block.wear), (before.worn.strip, block.wear_strip))[row]
        cycles = np.concatenate([[before.half_cycle], block.half_cycle])
        ended, at = _ends(_coated(system, body, thickness), np.vstack([begun, own]), cycles)
        if not ended.any():
            continue
        first, key = int(np.where(ended, at, np.inf).argmin()), f"{body}_coating_first_through"
        surface = system.pair.punch if row == 0 else system.pair.strip
        if f"{key}_half_cycle" not in known:
            names = (f"{key}_at_{axis}_mm" for axis in _axes(surface.dim))
            found |= {f"{key}_half_cycle": float(at[first]), **dict(zip(names, surface.x[first].tolist(), strict=True))}
        found[f"{body}_coating_last_through_half_cycle"] = float(np.where(ended, at, -np.inf).max())
    return found


def _axes(dim: int) -> tuple[str, ...]:
    return ("x", "z") if dim == 2 else ("x", "y", "z")


def _coated(system: ContactSetup, body: str, thickness: Array) -> CoatedBody:
    """Return a coating with the mean ratio of both coefficients at the start."""
    law = system.sliding.wear[list(BODIES).index(body)]
    above = law.of_coating
    if above is None:
        return CoatedBody(thickness, np.ones_like(thickness))
    conditions = system.conditions(0)
    base, coating = (coefficient(one, system.friction, conditions, f"wear.{body}").mean() for one in (law, above))
    return CoatedBody(thickness, np.full_like(thickness, base / coating))


def _ends(coated: CoatedBody, depths: Array, cycles: Array) -> tuple[Mask, Array]:
    """Return which coatings end within rows of depths (k, n), and after how many half-cycles (n,)."""
    ended: Mask = np.zeros(depths.shape[1], dtype=bool)
    at: Array = np.zeros(depths.shape[1])
    for k in range(len(depths) - 1):
        now = (depths[k] < coated.thickness) & (depths[k + 1] >= coated.thickness)
        left, grown = coated.thickness - depths[k], coated.measure(depths[k + 1]) - depths[k]
        share = np.divide(left, grown, out=np.ones_like(left), where=grown > 0)
        at = np.where(now, cycles[k] + share * (cycles[k + 1] - cycles[k]), at)
        ended |= now
    return ended, at


ENDS = {"punch": "", "strip": "_strip", "layer": "_layer"}  # how the names of variables end


def of_creeping(name: str) -> dict[str, Variable]:
    """Return the variables of a body or layer that creeps."""
    end = ENDS[name]
    depth = f"depth that the {name} has crept at the end of the half-cycle, apart from wear"
    volume = f"volume that the {name} has crept over the contact nodes, at the end of the half-cycle"
    return {
        f"creep_depth{end}": (("half_cycle", "x"), "mm", depth),
        f"creep_volume{end}": (("half_cycle",), "mm3", volume),
        f"largest_creep_depth{end}": (("half_cycle",), "mm", f"largest {depth}"),
    }


def _creep_variables(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of what creeps."""
    return {name: one for member in system.creep.members for name, one in of_creeping(member.name).items()}


def _creep_values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, found = block.system, dict[str, Array]()
    areas = system.bodies.punch.thickness * system.pair.weights
    for name, depth in system.creep.depths(block.crept.T).items():
        found[f"creep_depth{ENDS[name]}"] = depth.T
        found[f"creep_volume{ENDS[name]}"] = areas @ depth
        found[f"largest_creep_depth{ENDS[name]}"] = depth.max(axis=0)
    return found


def variables(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of what lies between the surfaces, of coatings and of what creeps."""
    return {**_lying_variables(system), **_coating_variables(system), **_creep_variables(system)}


def values(block: Block) -> dict[str, Array]:
    """Return the values of these variables for each half-cycle of a block: (k,), and (k, n) along the contact."""
    return {**_lying_values(block), **coating_values(block), **_creep_values(block)}
