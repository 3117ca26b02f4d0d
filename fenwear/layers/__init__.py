"""What lies between the surfaces: debris that stays, layers that give way; what they add to the gap."""

from fenwear.layers.between import Layers, common_modulus, layers_of
from fenwear.layers.step import LayerStep, Passing

__all__ = ["LayerStep", "Layers", "Passing", "common_modulus", "layers_of"]
