"""What is told of a cycle that is a table: ways, pressures and cross-shear over it, and wear per million cycles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly.cycle_shear import sliding_tensor, sliding_tensor_of_strip
from fenwear.cycle import Block
from fenwear.cycle.state import known_pressures
from fenwear.sliding.cross_shear import SlidingTensor

MILLION = 1e6


def sliding_numbers(last: Block) -> dict[str, float]:
    """Return those of the last cycle for the sheet, or nothing where it is no table."""
    pressure = known_pressures(last.end.contacts)
    if not last.system.motion.steps or pressure is None:
        return {}
    ways = last.system.path.sum(axis=0)
    return {
        "mean_way_of_cycle_mm": float(last.system.pair.weights @ ways / last.system.pair.weights.sum()),
        "largest_way_of_cycle_mm": float(ways.max()),
        "largest_pressure_of_cycle_MPa": float(pressure.max()),
    }


def body_numbers(last: Block, body: str) -> dict[str, float]:
    """Return those of a body that wears, "punch" or "strip", by the wear of the last cycle; or nothing."""
    system, pressure = last.system, known_pressures(last.end.contacts)
    if not system.motion.steps or pressure is None:
        return {}
    end, surface = last.end, system.pair.punch if body == "punch" else system.pair.strip
    states = [
        system.conditions(k, np.asarray(own), worn=end.worn, half_cycles=end.half_cycle, cycle=pressure)
        for k, own in enumerate(pressure)
    ]
    depth: Array = getattr(system.wear.phases(states).worn(pressure), body)
    areas = system.bodies.punch.thickness * (system.pair.weights if body == "punch" else surface.weights)
    tensor = sliding_tensor(system, pressure) if body == "punch" else sliding_tensor_of_strip(system, pressure)
    return {
        "worn_volume_per_million_cycles_mm3": MILLION * float(areas @ depth),
        "depth_per_million_cycles_mm": MILLION * float(depth.max()),
        **_cross_shear(tensor, areas),
    }


def _cross_shear(tensor: SlidingTensor, areas: Array) -> Mapping[str, float]:
    """Return the mean over the work of friction, and the largest where there is a hundredth of the largest work."""
    work, ratio = tensor.work, tensor.ratio
    rubbed = work > 0.01 * work.max(initial=0.0)
    mean = float(areas * work @ ratio) / max(float(areas @ work), 1e-300)
    return {"mean_cross_shear": mean, "largest_cross_shear": float(np.max(ratio, where=rubbed, initial=0.0))}
