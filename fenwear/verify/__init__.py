"""Problems whose answer is known, solved by fenwear and compared: exact solutions and published results."""

from fenwear.verify import elastic, contact, curved, solid, optimum, wear, jumps, conduction, thermal, ranks  # noqa: I001  (the order of the table)
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
    "jumps",
    "optimum",
    "ranks",
    "registered",
    "run_cases",
    "solid",
    "thermal",
    "wear",
]
