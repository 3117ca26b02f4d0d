"""Layers between the surfaces: debris, compliant layers, states that laws remember."""

from fenwear.layers.between import Layers, common_modulus, layers_of
from fenwear.layers.conductance import conductance_of
from fenwear.layers.memory import Evolution
from fenwear.layers.step import LayerEvolution, LayerStep

__all__ = ["Evolution", "LayerEvolution", "LayerStep", "Layers", "common_modulus", "conductance_of", "layers_of"]
