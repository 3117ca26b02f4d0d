"""Coulomb's law with stick: partial slip, fretting."""

from fenwear.stick.increment import advance
from fenwear.stick.interface import Loaded, Position, StickInterface
from fenwear.stick.state import Imposed, StickState, untouched

__all__ = ["Imposed", "Loaded", "Position", "StickInterface", "StickState", "advance", "untouched"]
