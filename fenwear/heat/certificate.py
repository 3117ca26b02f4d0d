"""How far the reduced temperatures of a body are from those of its whole mesh, at the contact.

Both are led through a cycle of its steps from rest, and to the steady state of the cycle's mean flux, by an even
pressure, one that grows along the contact, and one at random. What is compared is what contact feels: the temperature
at its nodes and the thermal gap beside a rigid motion, at the end of the cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array, csr_array

from fenwear.arrays import Array
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.exchange import EARLIER
from fenwear.heat.field import ReducedField
from fenwear.parallel import total

STEPS = 40  # of a cycle, the last ones, that both are led through at most
FLAT = 1e-6  # of the thermal gap: what of it is less beside a rigid motion counts against that


@dataclass(frozen=True)
class Trial:
    """What a body's reduced temperatures are tried with.

    Attributes:
        inflow: Loads of unit fluxes (owned, q).
        entering: Fluxes of each step of a cycle (q, m) under m pressures.
        contact: Temperature at the contact nodes at the end of the cycle (n, owned).
        opened: Gap there (n, k), mm, by changes of the temperature of this rank's nodes (owned, k); collective.
        rigid: Gaps of rigid motions, orthonormal (n, r).
        through: What takes temperatures where the fluxes enter to the contact nodes (n, q); None where they are these.
    """

    inflow: csc_array
    entering: Sequence[Array]
    contact: csr_array
    opened: Callable[[Array], Array]
    rigid: Array
    through: csr_array | None = None


def certificate(
    step: HeatStep, velocity: float, surroundings: Surroundings, small: ReducedField, trial: Trial
) -> float:
    """Return the largest difference of the readings over their largest, at any node and under any pressure; collective.

    Args:
        step: A stage of the whole body, which it advances by.
        velocity: Of its material in it, mm/s or rad/s.
        surroundings: What the body meets.
        small: Its reduced temperature with this stage.
        trial: Fluxes, and what is compared.
    """
    body, last = step.body, trial.entering[-STEPS:]
    dim, m = len(small.basis), last[0].shape[1]
    compare = _Comparison(body, small, trial)
    whole, reduced = np.zeros((body.owned, m)), np.zeros((dim, m))
    for flux in last:
        heated, answer = step.respond(trial.inflow @ flux), small.responses[0] @ flux
        for counts in (EARLIER, 1.0):
            whole = whole + counts * (step.advance(whole, sources=False) + heated - whole)
            reduced = reduced + counts * (small.advance(0, reduced, sources=False) + answer - reduced)
    found = compare.apart(whole, reduced, last[-1])
    if body.loses_heat(velocity, surroundings):
        mean = np.mean(trial.entering, axis=0)
        steady = body.step(velocity, np.inf, surroundings, at_once=True)
        whole = steady.respond(trial.inflow @ mean)
        steady.free()
        changes = np.eye(dim) - small.advance(0, np.eye(dim), sources=False)
        fixed = scipy.linalg.solve(changes, small.responses[0] @ mean)
        found = max(found, compare.apart(whole, fixed, mean))
    return found


def pressures(x: Array) -> Array:
    """Return what the bodies are tried with at contact nodes x (n, d): even, growing along the contact, at random."""
    along = x[:, 0] - x[:, 0].min()
    random = np.random.default_rng(0).random(len(x))
    return np.stack([np.ones(len(x)), along / max(float(along.max()), 1e-300), random], axis=1)


def rigid_gaps(body: HeatBody, x: Array) -> Array:
    """Return the gaps at contact nodes x (n, d) of rigid motions, orthonormal (n, r): rings do not tilt."""
    tilts = x[:, :0] if body.kind == "axisymmetric" else x[:, :-1]
    return np.asarray(np.linalg.qr(np.column_stack([np.ones(len(x)), tilts]))[0])


class _Comparison:
    """Readings of a body's whole and reduced temperature; collective to make."""

    def __init__(self, body: HeatBody, small: ReducedField, trial: Trial) -> None:
        self._comm, self._trial, self._columns = body.body.mesh.comm, trial, small.basis.columns
        self._contact = small.observe(trial.contact)
        self._beyond: Array | None = None  # what a flux adds at the contact beside the coordinates
        if small.contact_responses is not None:
            exact = small.contact_responses[0]
            exact = exact if trial.through is None else np.asarray(trial.through @ exact)
            self._beyond = exact - self._contact.of_changes(small.responses[0])

    def apart(self, whole: Array, reduced: Array, flux: Array) -> float:
        """Return the largest difference of readings over their largest; collective.

        Args:
            whole: Temperatures (owned, m).
            reduced: Coordinates (dim, m).
            flux: Of the last step (q, m).
        """
        exact = total(self._comm, np.asarray(self._trial.contact @ whole))
        contact = self._contact.of_changes(reduced)
        if self._beyond is not None:
            contact = contact + self._beyond @ flux
        both = self._trial.opened(np.hstack([whole, self._columns @ reduced - whole]))
        (gap, missing), rigid = np.hsplit(both, 2), self._trial.rigid
        size = np.abs(gap).max(axis=0)
        gap, missing = (one - rigid @ (rigid.T @ one) for one in (gap, missing))
        return max(
            _relative(contact - exact, np.abs(exact).max(axis=0)),
            _relative(missing, np.maximum(np.abs(gap).max(axis=0), FLAT * size)),
        )


def _relative(difference: Array, size: Array) -> float:
    return float((np.abs(difference).max(axis=0) / np.maximum(size, 1e-300)).max())
