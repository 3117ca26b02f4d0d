"""Coulomb's law with stick: partial slip, fretting.

Which nodes stick, slip or open is decided in `equations`, a time step of it solved in `increment`, with heat in
`heated`; `cycle.PartialSlipProblem` goes through the steps of a cycle and keeps their `records`, by the `conditions`
that laws know; what they wear and leave between is in `losses`, of `coated` bodies, too; `jump` goes over many cycles;
`coulomb` is the law for the controller, `fenwear.cycle`.
"""

from fenwear.stick.increment import advance
from fenwear.stick.interface import StickInterface, untouched
from fenwear.stick.position import LoadEffect, Position
from fenwear.stick.state import Imposed, StickState

__all__ = ["Imposed", "LoadEffect", "Position", "StickInterface", "StickState", "advance", "untouched"]
