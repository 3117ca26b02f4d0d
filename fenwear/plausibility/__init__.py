"""What is told of states that the model computes and can hardly be true of.

ends      contact clipped at the end of a plane's or ring's meshed surface
rim       contact clipped at the rim of a solid's
chamfer   chamfers beside the contact surface that wear would bring into contact
few       contact on a few nodes
depth     elements below a contact deeper than it is wide
polygon   curved contact surfaces of straight sides
stroke    strokes that the bodies take up elastically
thickness bodies that are worn through
fineness  steps, bases and elements of the heat that are too coarse
heated    the same of all stages of a run, and contact that has several answers
slip      time steps of stick and slip: too coarse, several answers, sliding as a whole
large     displacements beyond small strain
layer     elements thicker than the layer that heats up below a fast contact
size      bodies whose mesh is hardly in mm
states    a run's blocks, the first contact and the steady state: clipped, too hot, harder pressed than hard
"""

from fenwear.plausibility.fineness import fineness_text, fineness_warnings
from fenwear.plausibility.heated import HeatMonitor
from fenwear.plausibility.layer import HeatedLayer, heated_layer, layer_warnings
from fenwear.plausibility.size import size_warnings
from fenwear.plausibility.slip import law_warnings, passing_text, sliding_text, unique_text, uniques
from fenwear.plausibility.states import StateMonitor, hot, initial_warnings, pressed, steady_warnings
from fenwear.plausibility.stroke import TAKEN_UP, elastic_share, elastic_way, stroke_warnings

__all__ = [
    "TAKEN_UP",
    "HeatMonitor",
    "HeatedLayer",
    "StateMonitor",
    "elastic_share",
    "elastic_way",
    "fineness_text",
    "fineness_warnings",
    "heated_layer",
    "hot",
    "initial_warnings",
    "law_warnings",
    "layer_warnings",
    "passing_text",
    "pressed",
    "size_warnings",
    "sliding_text",
    "steady_warnings",
    "stroke_warnings",
    "unique_text",
    "uniques",
]
