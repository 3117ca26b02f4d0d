"""The laws of sliding: friction, wear, coatings, and what lies between the surfaces.

`friction.ContactConditions` has the variables of coefficients, `local_laws.Wear` the wear of a pressure. Both
are asked in every phase of gross sliding (`fenwear.steps.phase`) and every time step of partial slip
(`fenwear.steps.stick_cycle`).

`layers.Layers` is all that lies between: debris, compliant layers, states that laws remember (`law_states`).
"""

from fenwear.laws.contact_conductance import conductance_of
from fenwear.laws.law_states import Evolution
from fenwear.laws.layer_step import LayerEvolution, LayerStep
from fenwear.laws.layers import Layers, common_modulus, layers_of

__all__ = ["Evolution", "LayerEvolution", "LayerStep", "Layers", "common_modulus", "conductance_of", "layers_of"]
