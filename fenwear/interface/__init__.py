"""Two surfaces in contact: opposite each other, in equilibrium, and elastic."""

from fenwear.interface.compliance import Interface, join
from fenwear.interface.equilibrium import Statics, statics
from fenwear.interface.facing import Facing, check_distance, face, interpolation

__all__ = ["Facing", "Interface", "Statics", "check_distance", "face", "interpolation", "join", "statics"]
