"""What bodies and layer have crept, in history.nc and summary.json, apart from wear.

The depth that a body has crept is how far its contact surface has gone back into it, against its supports or, of a free
body, the surfaces on which its loads act, by what its compliance has grown to since it was loaded. It is that of the
contact nodes in the middle of a half-cycle. Its volume is the integral over them; a contact grid that grows adds nodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle import Block

Variable = tuple[tuple[str, ...], str, str]  # dimensions, units, long name
ENDS = {"punch": "", "strip": "_strip", "layer": "_layer"}  # how the names of variables end


def variables(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of what creeps."""
    found: dict[str, Variable] = {}
    for member in () if system.creep is None else system.creep.members:
        name, end = member.name, ENDS[member.name]
        text = f"depth that the {name} has crept at the end of the half-cycle, apart from wear"
        found[f"creep_depth{end}"] = (("half_cycle", "x"), "mm", text)
        volume = f"volume that the {name} has crept over the contact nodes, at the end of the half-cycle"
        found[f"creep_volume{end}"] = (("half_cycle",), "mm3", volume)
    return found


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, found = block.system, dict[str, Array]()
    if system.creep is None:
        return found
    areas = system.bodies.punch.thickness * system.pair.weights
    for name, depth in system.creep.depths(block.crept.T).items():
        found[f"creep_depth{ENDS[name]}"] = depth.T
        found[f"creep_volume{ENDS[name]}"] = areas @ depth
    return found


def body_numbers(last: Block, body: str) -> dict[str, float]:
    """Return the key numbers of a body at the end of a run, for its part of summary.json; none where it creeps not."""
    found = values(last)
    if f"creep_volume{ENDS[body]}" not in found:
        return {}
    depth = found[f"creep_depth{ENDS[body]}"][-1]
    return {
        "creep_volume_mm3": float(found[f"creep_volume{ENDS[body]}"][-1]),
        "largest_creep_depth_mm": float(np.max(depth)),
    }


def numbers(last: Block) -> dict[str, Any]:
    """Return those of the layer, for summary.json."""
    return {key.replace("creep", "layer_creep", 1): value for key, value in body_numbers(last, "layer").items()}
