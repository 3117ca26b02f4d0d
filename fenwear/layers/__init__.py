"""What lies between the surfaces: debris, layers that give way, states that laws remember."""

from fenwear.layers.between import Layers, common_modulus, layers_of
from fenwear.layers.memory import Evolution
from fenwear.layers.step import LayerStep, Passing

__all__ = ["Evolution", "LayerStep", "Layers", "Passing", "common_modulus", "layers_of"]
