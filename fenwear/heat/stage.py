"""A stage of both bodies on small bases at given conductances, through what the contact meets of them.

Of the coordinates s of a body the contact meets its temperature without flux, theta_c = C (D s + b), alone, from which
and from the friction heat the fluxes follow, see `fenwear.heat.contact_fluxes`:

    s' = D s + b + R (q + h_b (theta_c - theta_a)),

where h_b returns the convection of a strip under the contact (see `fenwear.heat.passing_strip`; else it is zero). With
D diagonal, or of one body, and C D kept, a stage takes a few products with matrices of as many rows as there are nodes.

The linear map of the reduced coordinates of both bodies over a step, or a stage of it, at given conductances.

    s' = P s + b + Q (friction heat),    P = P_0 + R M^-1 r(theta_0),

P_0 and theta_0 the coordinates and surface temperatures without flux, R the response to fluxes, which are M^-1 r, see
`fenwear.heat.contact_fluxes`. Where a factor of M serves other conductances with a few rows c changed, R M^-1 at these
rows is all that its map is changed by: a correction of as low a rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from fenwear.common.arrays import Array
from fenwear.heat.contact_fluxes import Fluxes, FluxFactor, FluxUpdate, Sources
from fenwear.heat.temperature import Field, Functional, Propagation


@dataclass(frozen=True)
class HeatBalance:
    """The heat terms of a stage, per thickness.

    Attributes:
        by_start, by_end: From both bodies' coordinates at its ends (terms, dim).
        by_flux: From the fluxes q (terms, 2 n).
        constant: Without any (terms,).
    """

    by_start: Array
    by_end: Array
    by_flux: Array
    constant: Array


class PreparedStage:
    """Parts of a stage that do not depend on the conducting nodes.

    Args:
        motions: Of punch and strip.
        contacts: Their temperatures at the interface nodes over its places.
        ledger: Its heat terms.
        ambient: theta_a, K.

    Attributes:
        motions: The same.
        given_back: h_b of both bodies' nodes (2 n,), mW/(mm² K).
    """

    def __init__(
        self, motions: Sequence[Propagation], contacts: Sequence[Functional], ledger: HeatBalance, ambient: float
    ) -> None:
        self.motions, self._ambient = motions, ambient
        self._split, n = len(motions[0].source), contacts[0].rows.shape[0]
        self.given_back = np.repeat([motion.given_back for motion in motions], n)
        self._bare = np.eye(2 * n)  # temperature without q, above theta_a, from theta_c - theta_a
        self._terms_by_flux = ledger.by_flux.copy()
        self._rows, self._constants = [], []  # of theta_c - theta_a, and then of the terms
        ends = np.split(np.arange(len(ledger.by_end[0])), [self._split])
        for k, (contact, propagation, columns) in enumerate(zip(contacts, motions, ends, strict=True)):
            nodes, end = np.arange(k * n, (k + 1) * n), ledger.by_end[:, columns]
            decay = np.diag(propagation.decay) if propagation.decay.ndim == 1 else propagation.decay
            met, above = contact.of_changes(decay), contact(propagation.source) - ambient
            returned = ledger.by_flux[:, nodes] * propagation.given_back  # q is what enters less what is given back
            terms = ledger.by_start[:, columns] + end @ decay - returned @ met
            constant = end @ propagation.source - returned @ above + (ledger.constant if k == 0 else 0.0)
            self._rows.append(np.vstack([met, terms]))
            self._constants.append(np.append(above, constant))
            self._terms_by_flux[:, nodes] += end @ propagation.response
            self._bare[np.ix_(nodes, nodes)] += propagation.given_back * contact.of_changes(propagation.response)
        self._decay = None
        if all(motion.decay.ndim == 1 for motion in motions):
            self._decay = np.concatenate([motion.decay for motion in motions])
        self._source = np.concatenate([motion.source for motion in motions])

    def at(self, fluxes: Fluxes, crossing: Array) -> Stage:
        """Return the stage with these fluxes.

        Args:
            fluxes: At its conductances.
            crossing: Heat that a unit of a node's flux carries across the contact in the stage (n,), mm s.
        """
        made = fluxes.sources(np.eye(len(self.given_back)))
        by_temperature = np.hstack([made.first, made.second])
        level = (by_temperature.sum(axis=1) + made.ambient) * self._ambient
        by_contact = by_temperature @ self._bare
        into = by_contact + np.diag(self.given_back)
        summed = scipy.linalg.block_diag(crossing, crossing)
        parts = ((into, by_contact), (made.heat, made.heat), (level, level))
        return Stage(self, *(np.concatenate([every, summed @ flux]) for every, flux in parts))

    def met(self, values: Array, *, sources: bool) -> tuple[Array, Array]:
        """Return theta_c - theta_a (2 n,), K, and the terms without what enters (terms,); or their changes (., k)."""
        n = len(self.given_back) // 2
        first, second = self._rows[0] @ values[: self._split], self._rows[1] @ values[self._split :]
        if sources:
            first += self._constants[0]
            second += self._constants[1]
        return np.concatenate([first[:n], second[:n]]), first[n:] + second[n:]

    def ends(self, values: Array, into: Array, *, sources: bool) -> Array:
        """Return the coordinates at the end, with what enters (2 n,) or (2 n, k)."""
        n = len(into) // 2
        if self._decay is None:
            parts = zip(self.motions, (values[: self._split], values[self._split :]), strict=True)
            ends: Array = np.concatenate([field.free(part, sources=sources) for field, part in parts])
        else:
            ends = (self._decay * values.T).T
            if sources:
                ends += self._source
        ends[: self._split] += self.motions[0].response @ into[:n]
        ends[self._split :] += self.motions[1].response @ into[n:]
        return ends

    def terms(self, into: Array) -> Array:
        """Return the terms of what enters (2 n,) or (2 n, k)."""
        return np.asarray(self._terms_by_flux @ into)


@dataclass(frozen=True)
class Stage:
    """A stage at given conductances.

    Attributes:
        prepared: Parts of the stage that do not depend on the conducting nodes.
        by_contact: The flux that enters, q + h_b (theta_c - theta_a), and the part of q that crosses the contact into
            each body, from theta_c - theta_a (2 n + 2, 2 n).
        by_heat: From the friction heat (2 n + 2, n).
        constant: At the ambient temperature without any (2 n + 2,).
    """

    prepared: PreparedStage
    by_contact: Array
    by_heat: Array
    constant: Array

    def entering(self, heat: Array, *, sources: bool) -> Array:
        """Return the flux at the ambient temperature, mW/mm², and the flux across (2 n + 2,) or (2 n + 2, k).

        Args:
            heat: Of friction (n,), or (n, k), mW/mm².
            sources: Whether there is more than changes.
        """
        flux: Array = self.by_heat @ heat
        return flux + self.constant if sources else flux

    def of(self, values: Array, entering: Array, *, sources: bool) -> tuple[Array, Array]:
        """Return the coordinates of both bodies at the end (dim,), and the heat terms and what crosses, or changes.

        Args:
            values: Coordinates at the start (dim,), or without sources their changes (dim, k).
            entering: Of `entering`.
            sources: Whether there is more than changes.
        """
        met, terms = self.prepared.met(values, sources=sources)
        exchanged = self.by_contact @ met + entering
        into, crossing = exchanged[: len(met)], exchanged[len(met) :]
        terms += self.prepared.terms(into)
        return self.prepared.ends(values, into, sources=sources), np.concatenate([terms, crossing])

    def fluxes(self, values: Array, entering: Array) -> Array:
        """Return the fluxes q of the same (2 n,), mW/mm²."""
        met, _ = self.prepared.met(values, sources=True)
        return np.asarray((self.by_contact @ met + entering)[: len(met)] - self.prepared.given_back * met)


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
        self._bare = [contact.of_changes(response) for contact, response in zip(contacts, free, strict=True)]
        self._bare_source = np.concatenate([contact(source) for contact, source in zip(contacts, sources, strict=True)])
        self._responses = [field.responses[kind] for field, kind in zip(fields, kinds, strict=True)]
        self._known: tuple[FluxFactor, Array, StepMap] | None = None

    def map(self, fluxes: FluxFactor | FluxUpdate) -> StepMap:
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
        return self._by_factor(fluxes)[2]

    def _by_factor(self, factor: FluxFactor) -> tuple[FluxFactor, Array, StepMap]:
        """Return the factor, R M^-1, and the map that follows."""
        if self._known is None or self._known[0] is not factor:
            self._known = None
            rows = factor.solve_rows(scipy.linalg.block_diag(*self._responses))
            by_state, constant, by_heat = self._followed(factor.step.sources(rows))
            self._known = factor, rows, StepMap(self._free + by_state, self._source + constant, by_heat)
        return self._known

    def _followed(self, rows: Sources) -> tuple[Array, Array, Array]:
        """Return rows of what the fluxes come from as rows of the coordinates, a constant, and rows of the heat."""
        by_state = np.hstack([rows.first @ self._bare[0], rows.second @ self._bare[1]])
        return by_state, rows.of(self._bare_source, np.zeros(rows.heat.shape[1]), self._ambient), rows.heat
