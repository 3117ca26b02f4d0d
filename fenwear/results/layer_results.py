"""Layers on the surfaces besides wear, in history.nc and summary.json: debris, plastic depth, coatings, creep.

    worn volume of both bodies + volume at the start = stored + ejected

A state that a law remembers is `state_NAME` there, on the strip's material `state_NAME_strip`.

Between two recorded half-cycles a coating ends where what its coefficient would have worn reaches what was left: exact
where the pressure stays, see `fenwear.laws.coating`.

The depth that a body has crept is how far its contact surface has gone back into it, against its supports or, of a free
body, the surfaces on which its loads act, by what its compliance has grown to since it was loaded. It is that of the
contact nodes in the middle of a half-cycle. Its volume is the integral over them; a contact grid that grows adds nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from fenwear.common.arrays import Array, Mask
from fenwear.laws import Layers
from fenwear.laws.coating import CoatedBody, left_of
from fenwear.laws.layers import DEBRIS, PLASTIC
from fenwear.laws.wear import coefficient
from fenwear.results.history_surfaces import EDGE
from fenwear.results.quantity import BODIES, RECORD, Quantity
from fenwear.steps import Block
from fenwear.steps.run_state import RunState
from fenwear.system import ContactSetup, Tribosystem

ALONG, ON_STRIP = ("half_cycle", "x"), ("half_cycle", "x_strip")


def _areas(block: Block) -> Array:
    """Return the areas of the contact nodes (n,), mm²."""
    return np.asarray(block.system.bodies.punch.thickness * block.system.pair.weights)


def _row(block: Block, name: str) -> Array:
    """Return a row of what lies between the surfaces at the contact nodes (k, n)."""
    return np.asarray(block.between[:, block.system.layers.rows.index(name)])


OF_FLOW = (
    Quantity("plastic_depth", ALONG, "mm", "depth that has flown beyond the hardness, apart from wear",
             lambda b: _row(b, PLASTIC)),
    Quantity("largest_plastic_depth", RECORD, "mm", "largest depth that has flown beyond the hardness",
             lambda b: _row(b, PLASTIC).max(axis=1), of="end"),
    Quantity("plastic_volume", RECORD, "mm3", "volume that has flown beyond the hardness, apart from wear",
             lambda b: _row(b, PLASTIC) @ _areas(b), of="end"),
)  # fmt: skip


def _debris(block: Block) -> tuple[Array, Array, Array]:
    """Return the thickness of stored and of ejected debris (k, m), mm, and the areas that it lies on (m,), mm².

    At the contact nodes, or on the strip's material where that carries it along.
    """
    system = block.system
    if system.layers.strip_carries:
        return block.carried[:, 0], block.carried[:, 1], system.bodies.punch.thickness * system.sliding.carried_areas
    return _row(block, DEBRIS[0]), _row(block, DEBRIS[1]), _areas(block)


def _thickness(block: Block) -> Array:
    """Return the thickness of debris at the contact nodes (k, n), mm."""
    stored = _debris(block)[0]
    carried = block.system.layers.strip_carries
    return np.asarray(stored @ block.system.pair.wear_interpolation.T if carried else stored)


def _balance_error(block: Block) -> Array:
    """Return the worn volume that is neither stored nor ejected, over the worn one (k,)."""
    stored, ejected, areas = _debris(block)
    begun = float(areas.sum()) * block.system.layers.debris.initial
    fed = begun + sum(block.totals.of(f"volume_{body}") for body in ("punch", "strip"))
    return np.asarray(np.abs(fed - (stored + ejected) @ areas) / np.maximum(fed, 1e-300))


OF_DEBRIS = (
    Quantity("debris_thickness", ALONG, "mm", "thickness of the debris between the surfaces at the end", _thickness),
    Quantity("largest_debris_thickness", RECORD, "mm", "largest thickness of the debris at the end",
             lambda b: _thickness(b).max(axis=1), of="end"),
    Quantity("debris_volume", RECORD, "mm3", "volume of the debris between the surfaces at the end",
             lambda b: _debris(b)[0] @ _debris(b)[2], of="end"),
    Quantity("ejected_volume", RECORD, "mm3", "volume of the debris ejected from the start",
             lambda b: _debris(b)[1] @ _debris(b)[2], of="end"),
    Quantity("debris_balance_error", RECORD, "1", "worn volume that is neither stored nor ejected, over the worn one",
             _balance_error, of="end"),
)  # fmt: skip
DEBRIS_ON_STRIP = Quantity("debris_thickness_strip", ON_STRIP, "mm", "thickness of the debris on the strip at the end",
                           lambda b: _debris(b)[0])  # fmt: skip
STATE, STATES = "state_", "states"  # how variables of states begin; where summary.json has them


def _of_states(layers: Layers) -> list[Quantity]:
    """Return the states that laws remember, at the contact nodes and on the strip's material."""
    memory = layers.memory
    state_quantities = []
    for states, first, kept, dims, end, body in (
        (memory.contact, len(layers.rows) - len(memory.contact), "between", ALONG, "", ""),
        (memory.strip, len(layers.carried_rows), "carried", ON_STRIP, "_strip", " of the strip"),
    ):
        for number, (name, state) in enumerate(states.items(), first):
            text = f"{name}{body}, a state that a law remembers, at the end"
            compute = partial(_state, kept=kept, number=number)
            state_quantities.append(Quantity(f"{STATE}{name}{end}", dims, state.unit, text, compute))
    return state_quantities


def _state(block: Block, kept: str, number: int) -> Array:
    return np.asarray(getattr(block, kept)[:, number])


def states(last: Block) -> dict[str, dict[str, Any]]:
    """Return mean, smallest and largest of the states that laws remember at the end of a run, for summary.json."""
    pair = last.system.pair
    weights: dict[tuple[str, ...], Array] = {ALONG: pair.weights, ON_STRIP: pair.strip.weights}
    return {
        quantity.name.removeprefix(STATE): {
            "unit": quantity.unit,
            **_extent(weights[quantity.dims], quantity.compute(last)[-1]),
        }
        for quantity in _of_states(last.system.layers)
    }


def _extent(weights: Array, values: Array) -> dict[str, float]:
    """Return mean over the surface, smallest and largest of nodal values."""
    mean = float(weights @ values) / float(weights.sum())
    return {"mean": mean, "smallest": float(values.min()), "largest": float(values.max())}


def of_coated(body: str) -> list[Quantity]:
    """Return the quantities of a coated body."""
    end = BODIES[body]
    text = f"coating of the {body} that is left at the end of the half-cycle"
    through = f"share of the {body}'s coated {{}} in which the coating is worn through at the end of the half-cycle"

    def left(block: Block) -> Array:
        thickness, _, depth = _coat(block, body)
        return left_of(thickness, depth)

    def of_scar(block: Block) -> Array:
        thickness, areas, depth = _coat(block, body)
        scar = (depth > EDGE * depth.max(axis=1, keepdims=True)) @ areas
        return np.asarray((depth >= thickness) @ areas / np.maximum(scar, 1e-300))

    def of_surface(block: Block) -> Array:
        thickness, areas, depth = _coat(block, body)
        return np.asarray((depth >= thickness) @ areas / max(float(areas.sum()), 1e-300))

    return [
        Quantity(f"coating{end}", ("half_cycle", f"x{end}"), "mm", text, left),
        Quantity(f"worn_through_of_scar{end}", RECORD, "1", through.format("scar"), of_scar, of=body),
        Quantity(f"worn_through_of_surface{end}", RECORD, "1", through.format("surface"), of_surface, of=body),
        Quantity(f"least_coating{end}", RECORD, "mm", f"least {text}", lambda b: left(b).min(axis=1), of=body),
    ]


def _coat(block: Block, body: str) -> tuple[Array, Array, Array]:
    """Return a body's coating (n,), mm, the areas of its coated nodes (n,), mm², and the worn depth (k, n), mm."""
    system, punch = block.system, body == "punch"
    thickness = system.laws.coatings[0 if punch else 1]
    weights = system.pair.weights if punch else system.pair.strip.weights
    return thickness, weights * (thickness > 0), block.wear if punch else block.wear_strip


def worn_through(block: Block, before: RunState, known: Mapping[str, float]) -> dict[str, float]:
    """Return when and where coatings are worn through first in a run, and when last so far.

    Args:
        block: The half-cycles after those before.
        before: Where they begin.
        known: Its earlier numbers.
    """
    system, events = block.system, dict[str, float]()
    for row, (body, thickness) in enumerate(zip(BODIES, system.laws.coatings, strict=True)):
        if not thickness.any():
            continue
        begun, depths = ((before.worn.punch, block.wear), (before.worn.strip, block.wear_strip))[row]
        cycles = np.concatenate([[before.half_cycle], block.half_cycle])
        ended, at = _ends(_coated(system, body, thickness), np.vstack([begun, depths]), cycles)
        if not ended.any():
            continue
        first, key = int(np.where(ended, at, np.inf).argmin()), f"{body}_coating_first_through"
        surface = system.pair.punch if row == 0 else system.pair.strip
        if f"{key}_half_cycle" not in known:
            names = (f"{key}_at_{axis}_mm" for axis in system.case.model.axes)
            events |= {
                f"{key}_half_cycle": float(at[first]),
                **dict(zip(names, surface.x[first].tolist(), strict=True)),
            }
        events[f"{body}_coating_last_through_half_cycle"] = float(np.where(ended, at, -np.inf).max())
    return events


def _coated(system: ContactSetup, body: str, thickness: Array) -> CoatedBody:
    """Return a coating with the mean ratio of both coefficients at the start."""
    law = system.sliding.wear[list(BODIES).index(body)]
    above = law.of_coating
    if above is None:
        return CoatedBody(thickness, np.ones_like(thickness))
    conditions = system.phases.conditions(0)
    base, coating = (
        coefficient(wear_law, system.laws.friction, conditions, f"wear.{body}").mean() for wear_law in (law, above)
    )
    return CoatedBody(thickness, np.full_like(thickness, base / coating))


def _ends(coated: CoatedBody, depths: Array, cycles: Array) -> tuple[Mask, Array]:
    """Return which coatings end within rows of depths (k, n), and after how many half-cycles (n,)."""
    ended: Mask = np.zeros(depths.shape[1], dtype=bool)
    at: Array = np.zeros(depths.shape[1])
    for k in range(len(depths) - 1):
        now = (depths[k] < coated.thickness) & (depths[k + 1] >= coated.thickness)
        left, beyond = coated.thickness - depths[k], depths[k + 1] - coated.thickness
        longer = np.divide(beyond, coated.ratio, out=np.zeros_like(left), where=coated.ratio > 0)  # by the coating
        share = np.divide(left, left + longer, out=np.ones_like(left), where=now)
        at = np.where(now, cycles[k] + share * (cycles[k + 1] - cycles[k]), at)
        ended |= now
    return ended, at


ENDS = {**BODIES, "layer": "_layer"}  # how the names of variables end


def of_creeping(name: str) -> list[Quantity]:
    """Return the quantities of a body or layer that creeps."""
    end, of = ENDS[name], "end" if name == "layer" else name
    text = f"depth that the {name} has crept at the end of the half-cycle, apart from wear"
    volume = f"volume that the {name} has crept over the contact nodes, at the end of the half-cycle"

    def depth(block: Block) -> Array:
        return np.asarray(block.system.elastic.creep.depths(block.crept.T)[name].T)

    return [
        Quantity(f"creep_depth{end}", ALONG, "mm", text, depth),
        Quantity(f"creep_volume{end}", RECORD, "mm3", volume, lambda b: depth(b) @ _areas(b), of=of),
        Quantity(f"largest_creep_depth{end}", RECORD, "mm", f"largest {text}", lambda b: depth(b).max(axis=1), of=of),
    ]


def quantities(system: Tribosystem) -> list[Quantity]:
    """Return the quantities of what lies between the surfaces, of coatings and of what creeps."""
    layers = system.layers
    return [
        *(OF_FLOW if PLASTIC in layers.rows else ()),
        *(OF_DEBRIS if layers.debris.present else ()),
        *([DEBRIS_ON_STRIP] if layers.strip_carries else ()),
        *_of_states(system.layers),
        *(
            quantity
            for body, thickness in zip(BODIES, system.laws.coatings, strict=True)
            if thickness.any()
            for quantity in of_coated(body)
        ),
        *(quantity for member in system.elastic.creep.members for quantity in of_creeping(member.name)),
    ]
