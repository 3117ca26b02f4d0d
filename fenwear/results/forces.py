"""What contact nodes carry in space: the force on the punch at node i is A_i p_i (e_n + tau)_i, A_i its area.

tau is the traction of friction over the pressure. Both are those of the middle position of a half-cycle, as all of its
records are.
"""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.cycle import Block


def node_forces(block: Block) -> Array:
    """Return the forces on the punch at the contact nodes in each half-cycle of a block (k, n, d), N."""
    system = block.system
    area = system.bodies.punch.thickness * system.pair.weights
    traction = system.pair.normal + np.array(block.friction_ratio)
    return np.asarray((area * block.pressure)[:, :, None] * traction)
