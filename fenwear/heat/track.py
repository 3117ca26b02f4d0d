"""A closed track: what the strip's material carries out of the mesh warms the rest of the disc or ring, and comes back.

Beyond the mesh the material mixes to one temperature T_b, that of the bulk. With its capacity C, the mW/K G by which
it loses heat to the surroundings, and what is carried out of the mesh less what enters it at T_b,

    C dT_b/dt = (integral of rho c v . n theta over both ends) - G (T_b - theta_a),

implicitly in each step together with the temperatures of the mesh. It holds where the heat of a turn spreads through
the section until it comes back: at a low Biot number of the disc.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from fenwear.arrays import Array
from fenwear.case import Track
from fenwear.heat.conduction import HeatStep
from fenwear.heat.field import Functional, ReducedField, TrackBasis
from fenwear.heat.side import Side
from fenwear.parallel import total


@dataclass(frozen=True)
class _Coupling:
    """How the bulk meets the mesh in a step.

    Attributes:
        enters: Coordinates at the end for each kelvin that the material enters warmer (dim,).
        leaves: What is carried out a second for each coordinate (dim,), mW/mm.
        constant: The same without any, less what enters at the reference and what the bulk then loses, mW/mm.
        stays: C over the duration of the step, mW/(mm K).
        resists: What a kelvin of the bulk takes in all, mW/(mm K).
    """

    enters: Array
    leaves: Array
    constant: float
    stays: float
    resists: float


class TrackField:
    """The reduced temperature of the strip with that of the bulk of its track, less the reference, as the last one.

    Args:
        inner: Of the strip, whose last inflow is what enters at a kelvin, in some proportion.
        steps: Of the strip.
        kelvins: What of the last inflow a kelvin is in each step.
        duration: Of a step, s.
        track: The bulk.
        thickness: Of a plane model, mm.
    """

    contact_responses: Sequence[Array] | None = None

    def __init__(
        self,
        inner: ReducedField,
        steps: Sequence[HeatStep],
        kelvins: Sequence[float],
        duration: float,
        track: Track,
        thickness: float,
    ) -> None:
        self.inner, body = inner, steps[0].body
        reference = body.heat.initial
        self.basis = TrackBasis(body, inner.basis.lift, inner.basis.columns, reference)
        self.capacity, self.loss = track.heat_capacity / thickness, track.loss / thickness
        comm = body.body.mesh.comm
        self._couplings: list[_Coupling] = []
        self.responses: Sequence[Array] = []
        found = []
        for step, kelvin, answers in zip(steps, kelvins, inner.responses, strict=True):
            leaves = total(comm, step.carried @ inner.basis.columns)
            at_lift, entering = total(comm, np.array([step.carried @ inner.basis.lift, step.entering.sum()]))
            enters, stays = kelvin * answers[:, -1], self.capacity / duration
            constant = at_lift - entering * reference - self.loss * (reference - body.heat.ambient)
            resists = stays + entering + self.loss - float(leaves @ enters)
            self._couplings.append(_Coupling(enters, leaves, float(constant), stays, float(resists)))
            own = answers[:, :-1]
            warms = leaves @ own / resists
            found.append(np.vstack([own + np.outer(enters, warms), warms]))
        self.responses = found

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Apply the step to the mesh and the bulk."""
        one = self._couplings[step]
        free = self.inner.advance(step, coordinates[:-1], sources=sources)
        bulk = (one.stays * coordinates[-1] + one.leaves @ free + sources * one.constant) / one.resists
        return np.concatenate([free + (one.enters * np.asarray(bulk)[..., None]).T, np.asarray(bulk)[None]])

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional of the mesh's temperatures; collective."""
        return _with_bulk(self.inner.observe(rows))

    def balanced(self, side: Side) -> Side:
        """Return the strip's side with the bulk in its balance: nothing is carried out any more."""
        rows, constant = side.balance.rows.copy(), side.balance.constant.copy()
        reference = self.basis.reference
        for row, value in ((0, self.capacity), (1, self.loss)):
            rows[row, -1] += value
            constant[row] += value * reference
        rows[4::3], constant[4::3] = 0.0, 0.0
        return replace(
            side,
            balance=replace(side.balance, rows=rows, constant=constant),
            brought=[0.0] * len(side.brought),
            ambient_loss=side.ambient_loss + self.loss * self.inner.basis.body.heat.ambient,
            capacity=side.capacity + self.capacity,
            bounded=True,
            cooled=self.loss > 0 or self.inner.basis.body.loses_heat(),
        )


def _with_bulk(functional: Functional) -> Functional:
    rows = np.asarray(functional.rows)
    return replace(functional, rows=np.hstack([rows, np.zeros((len(rows), 1))]))
