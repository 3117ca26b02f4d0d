"""Problems whose answer is known, solved by fenwear and compared: exact solutions and published results."""

from fenwear.verify import (
    conduction,
    contact,
    curved,
    elastic,
    half_space,
    jumps,
    optimum,
    ranks,
    solid,
    solid_heat,
    solid_wear,
    stick,
    thermal,
    wear,
)
from fenwear.verify.suite import Outcome, Plot, Result, Row, VerificationCase, registered, run_cases

__all__ = [
    "Outcome",
    "Plot",
    "Result",
    "Row",
    "VerificationCase",
    "conduction",
    "contact",
    "curved",
    "elastic",
    "half_space",
    "jumps",
    "optimum",
    "ranks",
    "registered",
    "run_cases",
    "solid",
    "solid_heat",
    "solid_wear",
    "stick",
    "thermal",
    "wear",
]
