"""Two surfaces in contact: opposite each other, sliding, in equilibrium, and elastic.

Which nodes are opposite is found by `patches` and `overlap`, gaps and weights are those of `pair`, what forces open is
`compliance.Interface`, and which rigid motions the contact balances `equilibrium`. The module `motion`
has the course of a cycle, `sliding_field` the velocity over the contact.
"""

from fenwear.surfaces.compliance import Compliance, Interface
from fenwear.surfaces.equilibrium import RigidEquilibrium, is_translation, rigid_equilibrium
from fenwear.surfaces.pair import ContactPair, check_distance, pair, pass_material, transfer_at
from fenwear.surfaces.placement import Placement

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
