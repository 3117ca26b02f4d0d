"""What is told of states that the model computes and can hardly be true of.

ends      contact clipped at the end of a plane's or ring's meshed surface
rim       contact clipped at the rim of a solid's
chamfer   chamfers beside the contact surface that wear would bring into contact
stroke    strokes that the bodies take up elastically
thickness bodies that are worn through
size      bodies whose mesh is hardly in mm
states    a run's blocks, the first contact and the steady state: clipped, too hot, harder pressed than hard
"""

from fenwear.watch.size import size_warnings
from fenwear.watch.states import Watch, hot, initial_warnings, pressed, steady_warnings
from fenwear.watch.stroke import TAKEN_UP, elastic_share, elastic_way, stroke_warnings

__all__ = [
    "TAKEN_UP",
    "Watch",
    "elastic_share",
    "elastic_way",
    "hot",
    "initial_warnings",
    "pressed",
    "size_warnings",
    "steady_warnings",
    "stroke_warnings",
]
