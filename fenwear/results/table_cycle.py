"""What is told of a cycle that is a table: ways, pressures and cross-shear over it, and wear per million cycles.

Where surfaces slide as a whole the ways are those of the motion. Where nodes stick or slip by themselves they are their
slips of the last cycle, time step by time step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fenwear.arrays import Array
from fenwear.cycle import Block
from fenwear.cycle.state import known_pressures
from fenwear.interface.placement import in_space
from fenwear.results.steps import steps_of
from fenwear.results.surfaces import Column
from fenwear.sliding.ways import SlidingTensor
from fenwear.sliding.wear import WornDepths

if TYPE_CHECKING:
    from fenwear.assembly import ContactSetup
    from fenwear.stick.coulomb import Steps

MILLION = 1e6


@dataclass(frozen=True)
class TableCycle:
    """The last cycle of a block.

    Attributes:
        ways: What each contact node slides in it (n,), mm.
        pressure: Of its phases or time steps (m, n), MPa.
        worn: What it wears off both bodies.
        tensors: Of the sliding of the punch's and the strip's material, of the work.
    """

    ways: Array
    pressure: Array
    worn: WornDepths
    tensors: tuple[SlidingTensor, SlidingTensor]


def table_cycle(last: Block) -> TableCycle | None:
    """Return the last cycle of a block; None where it is no table, or where not all of it is known."""
    system = last.system
    if not system.motion.steps:
        return None
    if system.sticks:
        return _of_time_steps(last, steps_of(last)[-1])
    pressure = known_pressures(last.end.contacts)
    if pressure is None:
        return None
    end, shear = last.end, system.ways.shear(pressure)
    states = [
        system.conditions(k, np.asarray(own), worn=end.worn, half_cycles=end.half_cycle, cycle=shear)
        for k, own in enumerate(pressure)
    ]
    tensors = system.ways.tensor(pressure), system.ways.tensor_of_strip(pressure)
    worn = system.wear.phases(states).begun(end.worn).worn(pressure)
    return TableCycle(system.path.sum(axis=0), pressure, worn, tensors)


def _of_time_steps(last: Block, steps: Steps) -> TableCycle:
    """Return the cycle of time steps, in which nodes that are open slide nothing."""
    records, problem, pair = steps.records, last.system.law_state.problem, last.system.pair
    slip = np.where(records.pressure[:, :, None] > 0, records.slip, 0.0)
    ways, values, on_strip = np.linalg.norm(slip, axis=2), [], np.zeros((len(pair.strip.weights), 9))
    for k, own in enumerate(slip):
        place = problem.program.steps[(steps.first + k) % len(problem.program.steps)].offset
        position = problem.interface.position(place)
        vectors = in_space(np.einsum("nmc,nm->nc", position.frame[:, 1:], own))
        scale = np.divide(records.pressure[k], ways[k], out=np.zeros_like(ways[k]), where=ways[k] > 0)
        values.append(scale[:, None, None] * vectors[:, :, None] * vectors[:, None, :])
        back = in_space(position.pair.placement.back(vectors if pair.punch.dim == 3 else vectors[:, [0, 2]]))
        squares = scale[:, None, None] * back[:, :, None] * back[:, None, :]
        on_strip += position.pair.wear_projection @ squares.reshape(-1, 9)
    tensors = SlidingTensor(np.sum(values, axis=0)), SlidingTensor(on_strip.reshape(-1, 3, 3))
    return TableCycle(ways.sum(axis=0), records.pressure, steps.wear, tensors)


PRINCIPAL = tuple(f"principal_{axis}" for axis in "xyz")


_OVER = ("half_cycle", "x")
_MOST = "direction with most of the work of friction in a cycle"
VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "cross_shear": (_OVER, "1", "cross-shear ratio of a cycle on the punch: share of the work across its direction"),
    **{name: (_OVER, "1", f"{_MOST}, along {name[-1]}") for name in PRINCIPAL},
}


def variables(placed: ContactSetup) -> dict[str, tuple[tuple[str, ...], str, str]]:
    """Return the variables of a history of solids that slide in directions of their own at each place."""
    return VARIABLES if placed.slides_many_ways else {}


def values(block: Block) -> dict[str, Array]:
    """Return them of each half-cycle of a block (k, n)."""
    if not block.sliding:
        return {}
    directions = np.array([one.direction for one in block.sliding])
    return {
        "cross_shear": np.array([one.ratio for one in block.sliding]),
        **dict(zip(PRINCIPAL, np.moveaxis(directions, 2, 0), strict=True)),
    }


def columns(placed: ContactSetup) -> dict[str, Column]:
    """Return what each place slides in each step of a table, and the tracks of the strip's material."""
    if not placed.slides_many_ways:
        return {}
    ways = placed.ways
    slid = ways.lengths[:, :, None] * ways.directions
    return {
        "slid": Column(
            ("table_step", "node", "axis"),
            slid,
            {"units": "mm", "long_name": "way of the strip past each node in each step of the table: x, y and z"},
        ),
        "track": Column(
            ("table_row", "node", "axis"),
            _tracks(placed),
            {
                "units": "mm",
                "long_name": "where the strip's material is, at each node at first, in each row of the table",
            },
        ),
    }


def _tracks(placed: ContactSetup) -> Array:
    """Return the places of the strip's material that lies at each node of the punch in the first row (rows, n, 3)."""
    x, screws = placed.pair.punch.x, [phase.way for phase in placed.motion.phases if phase.way is not None]
    material = screws[0].at(0.0).points_back(x)
    return np.array([x, *(screw.at(1.0).points(material) for screw in screws)])


def sliding_numbers(last: Block) -> dict[str, float]:
    """Return those of the last cycle for the sheet, or nothing where it is no table."""
    cycle = table_cycle(last)
    if cycle is None:
        return {}
    areas = last.system.pair.weights * (cycle.pressure.max(axis=0) > 0 if last.system.sticks else 1.0)
    return {
        "mean_way_of_cycle_mm": float(areas @ cycle.ways / areas.sum()),
        "largest_way_of_cycle_mm": float(cycle.ways.max()),
    }


def body_numbers(last: Block, body: str) -> dict[str, float]:
    """Return those of a body that wears, "punch" or "strip", by the wear of the last cycle; or nothing."""
    cycle, pair = table_cycle(last), last.system.pair
    if cycle is None:
        return {}
    depth: Array = getattr(cycle.worn, body)
    areas = last.system.bodies.punch.thickness * (pair.weights if body == "punch" else pair.strip.weights)
    return {
        "worn_volume_per_million_cycles_mm3": MILLION * float(areas @ depth),
        "depth_per_million_cycles_mm": MILLION * float(depth.max()),
        **_cross_shear(cycle.tensors[body == "strip"], areas),
    }


def _cross_shear(tensor: SlidingTensor, areas: Array) -> Mapping[str, float]:
    """Return the mean over the work of friction, and the largest where there is a hundredth of the largest work."""
    work, ratio = tensor.work, tensor.ratio
    rubbed = work > 0.01 * work.max(initial=0.0)
    mean = float(areas * work @ ratio) / max(float(areas @ work), 1e-300)
    return {"mean_cross_shear": mean, "largest_cross_shear": float(np.max(ratio, where=rubbed, initial=0.0))}
