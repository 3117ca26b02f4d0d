"""What a step, or a stage of it, does to the small coordinates of both bodies at given conductances, as a linear map.

    s' = P s + b + Q (friction heat),    P = P_0 + R M^-1 r(theta_0),

P_0 and theta_0 the coordinates and surface temperatures without flux, R the response to fluxes, which are M^-1 r, see
`fenwear.heat.fluxes`. Where a factor of M serves other conductances with a few rows c changed, R M^-1 at these rows is
all that its map is changed by: a correction of as low a rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from fenwear.arrays import Array
from fenwear.heat.field import Field, Functional
from fenwear.heat.fluxes import Fluxes, FluxFactor, FluxUpdate, Sources


@dataclass(frozen=True)
class StepMap:
    """One step or stage for given conductances: s' = propagator s + source + response Q, Q the friction heat (n,)."""

    propagator: Array
    source: Array
    response: Array

    def twice(self, earlier: float) -> StepMap:
        """Return the map of two such stages, the second from where the first leads `earlier` times as far."""
        through = earlier * self.propagator
        then = through.copy()
        then[np.diag_indices_from(then)] += 1 - earlier
        return StepMap(
            self.propagator @ then, through @ self.source + self.source, through @ self.response + self.response
        )


class PreparedStep:
    """One stage of both bodies on small bases, whatever conducts.

    Args:
        fields: Of punch and strip.
        kinds: Which prepared step each takes.
        contacts: Their temperatures at the interface nodes.
        ambient: Temperature of the surroundings, K.
    """

    def __init__(
        self, fields: Sequence[Field], kinds: Sequence[int], contacts: Sequence[Functional], ambient: float
    ) -> None:
        self._ambient = ambient
        free = [
            field.advance(kind, np.eye(len(field.basis)), sources=False)
            for field, kind in zip(fields, kinds, strict=True)
        ]
        sources = [field.advance(kind, np.zeros(len(field.basis))) for field, kind in zip(fields, kinds, strict=True)]
        self._free, self._source = scipy.linalg.block_diag(*free), np.concatenate(sources)
        self._bare = [contact.of_changes(one) for contact, one in zip(contacts, free, strict=True)]
        self._bare_source = np.concatenate([contact(one) for contact, one in zip(contacts, sources, strict=True)])
        self._responses = [field.responses[kind] for field, kind in zip(fields, kinds, strict=True)]
        self._known: tuple[FluxFactor, Array, StepMap] | None = None

    def map(self, fluxes: Fluxes) -> StepMap:
        """Return the map with these fluxes."""
        if isinstance(fluxes, FluxUpdate):
            _, rows, base = self._by_factor(fluxes.base)
            by_state, constant, by_heat = self._followed(fluxes.added)
            picked = rows[:, fluxes.changed]
            return StepMap(
                base.propagator + picked @ by_state,
                base.source + picked @ constant,
                base.response + picked @ by_heat,
            )
        if isinstance(fluxes, FluxFactor):
            return self._by_factor(fluxes)[2]
        return self._made(fluxes.sources(scipy.linalg.block_diag(*self._responses)))

    def _by_factor(self, factor: FluxFactor) -> tuple[FluxFactor, Array, StepMap]:
        """Return the factor, R M^-1, and the map that follows."""
        if self._known is None or self._known[0] is not factor:
            self._known = None
            rows = factor.solve_rows(scipy.linalg.block_diag(*self._responses))
            self._known = (factor, rows, self._made(factor.step.sources(rows)))
        return self._known

    def _made(self, responses: Sources) -> StepMap:
        """Return the map from the responses to what the fluxes come from."""
        by_state, constant, by_heat = self._followed(responses)
        return StepMap(self._free + by_state, self._source + constant, by_heat)

    def _followed(self, rows: Sources) -> tuple[Array, Array, Array]:
        """Return rows of what the fluxes come from as rows of the coordinates, a constant, and rows of the heat."""
        by_state = np.hstack([rows.first @ self._bare[0], rows.second @ self._bare[1]])
        return by_state, rows.of(self._bare_source, None, self._ambient), rows.heat
