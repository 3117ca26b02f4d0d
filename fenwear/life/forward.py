"""Quantities of interest as a function of keys, with its Jacobian: what samplers, surrogates and optimisers ask."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.life.keys import Key, find_key, with_values
from fenwear.life.model import Model
from fenwear.life.quantities import Quantity, evaluate, of_case, parse_quantity
from fenwear.life.sensitivity import sensitivity

KEPT = 64  # Jacobians


@dataclass
class Forward:
    """Quantities of interest of a case as a function of its keys.

    Attributes:
        case: The case.
        quantities: What is wanted.
        keys: What they are functions of.
    """

    case: Case
    quantities: Sequence[Quantity]
    keys: Sequence[Key]
    _model: Model = field(init=False)
    _jacobians: dict[tuple[float, ...], Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._model = Model(self.case)

    def values(self, given: Sequence[float]) -> list[float]:
        """Return the quantities at values of the keys (k,).

        Raises:
            CaseError: a value is not possible.
            ConvergenceError: a run or a steady state did not converge.
        """
        return [evaluate(self._model, quantity, self._named(given))[0] for quantity in self.quantities]

    def jacobian(self, given: Sequence[float]) -> Array:
        """Return the derivatives of the quantities to the keys (quantities, keys).

        Raises:
            CaseError, ConvergenceError: as `values`.
        """
        at = tuple(given)
        if at not in self._jacobians:
            case = with_values(self.case, self._named(given))
            paths = [key.path for key in self.keys]
            found = sensitivity(case, self.quantities, paths, spread=0, comm=MPI.COMM_SELF)
            if len(self._jacobians) >= KEPT:
                self._jacobians.clear()
            self._jacobians[at] = np.array([[row.derivative for row in one.derivatives] for one in found])
        return self._jacobians[at]

    def _named(self, given: Sequence[float]) -> dict[str, float]:
        return {key.path: float(value) for key, value in zip(self.keys, given, strict=True)}


def forward(case: Case, quantities: Sequence[str], keys: Sequence[str]) -> Forward:
    """Return quantities of a case as a function of its keys.

    Raises:
        CaseError: one that the case does not have, or none.
    """
    for option, given in (("--of", quantities), ("--to", keys)):
        if not given:
            raise CaseError(InputError(option, "expected at least one"))
    wanted = [of_case(parse_quantity(text, names=case.names), case) for text in quantities]
    return Forward(case, wanted, [find_key(case, key, "--to") for key in keys])
