"""Two surfaces in contact: opposite each other, in equilibrium, and elastic.

Which nodes are opposite is found by `patches` and `overlap`, gaps and weights are those of `pair`, what forces open is
`compliance.Interface`, and which rigid motions the contact balances `equilibrium`.
"""

from fenwear.interface.compliance import Compliance, Interface
from fenwear.interface.equilibrium import RigidEquilibrium, is_translation, rigid_equilibrium
from fenwear.interface.pair import ContactPair, check_distance, pair, pass_material, transfer_at
from fenwear.interface.placement import Placement

__all__ = [
    "Compliance",
    "ContactPair",
    "Interface",
    "Placement",
    "RigidEquilibrium",
    "check_distance",
    "is_translation",
    "pair",
    "pass_material",
    "rigid_equilibrium",
    "transfer_at",
]
