"""What bodies and layer have crept, in history.nc and summary.json, apart from wear.

The depth that a body has crept is how far its contact surface has gone back into it, against its supports or, of a free
body, the surfaces on which its loads act, by what its compliance has grown to since it was loaded. It is that of the
contact nodes in the middle of a half-cycle. Its volume is the integral over them; a contact grid that grows adds nodes.
"""

from __future__ import annotations

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.cycle import Block
from fenwear.results.quantity import Variable

ENDS = {"punch": "", "strip": "_strip", "layer": "_layer"}  # how the names of variables end


def of_member(name: str) -> dict[str, Variable]:
    """Return the variables of a body or layer that creeps."""
    end = ENDS[name]
    depth = f"depth that the {name} has crept at the end of the half-cycle, apart from wear"
    volume = f"volume that the {name} has crept over the contact nodes, at the end of the half-cycle"
    return {
        f"creep_depth{end}": (("half_cycle", "x"), "mm", depth),
        f"creep_volume{end}": (("half_cycle",), "mm3", volume),
        f"largest_creep_depth{end}": (("half_cycle",), "mm", f"largest {depth}"),
    }


def variables(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of what creeps."""
    return {name: one for member in system.creep.members for name, one in of_member(member.name).items()}


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    system, found = block.system, dict[str, Array]()
    areas = system.bodies.punch.thickness * system.pair.weights
    for name, depth in system.creep.depths(block.crept.T).items():
        found[f"creep_depth{ENDS[name]}"] = depth.T
        found[f"creep_volume{ENDS[name]}"] = areas @ depth
        found[f"largest_creep_depth{ENDS[name]}"] = depth.max(axis=0)
    return found
