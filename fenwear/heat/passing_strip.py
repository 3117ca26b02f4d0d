"""A strip that passes under the punch, with its modes and the steps that they ask for.

The temperature of a strip that passes under the punch to and fro or through a cycle, in its own frame.

The strip's mesh and its ends move with the material, and the source moves over it (see `fenwear.heat.passage`):
no velocity is in its equation, so that capacity M and conductivity K are symmetric. All of its contact surface
convects in K. Under the contact what convects is given back by the flux, with the temperature theta_c = C theta of the
same step: with C the transfer of a step's places, W the nodes' areas and A = M / dt + K,

    (A - h C^T W C) theta = B theta_before + f - h C^T W theta_a + C^T W q,

which Woodbury's formula solves with A alone, the same for all places. On its modes A is diagonal, see
`fenwear.heat.temperature`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from fenwear.case import Heat
from fenwear.common.arrays import Array
from fenwear.common.parallel import total
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.fitted import TRIES, Trial, Way, certificate, contact_responses, pressures, rigid_gaps
from fenwear.heat.passage import Passage
from fenwear.heat.reduction import reduced_basis
from fenwear.heat.side import STAGE, Fineness, HeatedCycle, StepPlan, chosen
from fenwear.heat.temperature import FullField, Functional, Propagation, ReducedBasis, ReducedField, modal_basis
from fenwear.surfaces.motion import Motion


class ReciprocatingField:
    """The temperature of a strip in its own frame, over the steps of a motion.

    Attributes:
        contacts: Temperature at the interface nodes over the places of each step (n,), K.
        given_back: Convection that is returned, for each kelvin of this rank's nodes in each step (k, owned).
    """

    def __init__(
        self,
        inner: FullField | ReducedField,
        nodes: csr_array,
        transfers: Sequence[csr_array],
        kinds: Sequence[int],
        weights: Array,
        convection: float,
        ambient: float,
    ) -> None:
        """Bring the contact to the places of each step; collective.

        Args:
            inner: The strip without the contact, its steps and its responses to unit loads at q trace nodes.
            nodes: Temperature at these trace nodes (q, owned).
            transfers: From them to the interface nodes in each step (n, q).
            kinds: Which step of the inner field each takes.
            weights: Areas of the interface nodes (n,).
            convection: h, mW/(mm² K).
            ambient: theta_a, K.
        """
        self.inner, self.basis, self._ambient, self._convection = inner, inner.basis, ambient, convection
        at_nodes = inner.observe(nodes)
        self._at_nodes, self._kinds = at_nodes, kinds
        self.contacts = [at_nodes.through(transfer) for transfer in transfers]
        self._loads = [csr_array(transfer.T @ diags_array(weights)) for transfer in transfers]
        self.responses: Sequence[Array] = []
        self._returns: list[Array] = []
        responses, corrected = [], []
        for contact, load, transfer, kind in zip(self.contacts, self._loads, transfers, kinds, strict=True):
            response = np.asarray(inner.responses[kind] @ load)
            warms = contact.of_changes(response)
            back = np.linalg.inv(np.eye(len(weights)) - convection * warms)
            responses.append(response @ back)
            self._returns.append(convection * responses[-1])
            if inner.contact_responses is not None:
                exact = inner.contact_responses[kind]
                corrected.append(back @ warms + np.asarray(transfer @ (exact @ load)) - warms)
        self.responses = responses
        self.contact_responses: Sequence[Array] | None = None if inner.contact_responses is None else corrected
        self.given_back = np.array([convection * (nodes.T @ load.sum(axis=1)) for load in self._loads])

    def advance(self, step: int, coordinates: Array, *, sources: bool = True) -> Array:
        """Return the coordinates after a step without flux through the contact, but with the heat that comes back."""
        free = self.inner.advance(self._kinds[step], coordinates, sources=sources)
        contact = self.contacts[step]
        above = contact(free) - self._ambient if sources else contact.of_changes(free)
        return np.asarray(free + self._returns[step] @ above)

    def propagation(self, step: int) -> Propagation | None:
        """Return the step over its places; None on the nodes of a mesh."""
        inner = self.inner.propagation(self._kinds[step])
        return inner and replace(inner, response=self.responses[step], given_back=self._convection)

    def observe(self, rows: Array | csr_array) -> Functional:
        """Return the functional; collective."""
        return self.inner.observe(rows)

    def reading(self, transfer: csr_array) -> Functional:
        """Return the temperature at the interface nodes at a place of the contact, given by its transfer (n, q)."""
        return self._at_nodes.through(transfer)

    def left_out(self, transfer: csr_array, step: int) -> Array | None:
        """Return the reading of a unit flux in a step that the coordinates leave out (n, n); None for nothing."""
        if self.inner.contact_responses is None:
            return None
        load, kind = self._loads[step], self._kinds[step]
        known = self.reading(transfer).of_changes(np.asarray(self.inner.responses[kind] @ load))
        return np.asarray(transfer @ (self.inner.contact_responses[kind] @ load)) - known


MANY = 300  # contact nodes above which a basis holds what is felt a step later alone
LEAST_AREA = 0.1  # of the mean: what a node counts for that has no area of its own


class PassingStrip:
    """A strip in its own frame, all of whose contact surface convects, with loads at the nodes that the punch passes.

    Args:
        heat: Settings of the heat.
        body: Conduction in the strip.
        passage: Where the punch is on it.
        way: Origin of the basis.

    Attributes:
        nodes: Temperature at the trace nodes of the passage (q, owned).
        loads: Unit loads there (owned, q).
        around: Boundary beyond its mesh.
    """

    def __init__(self, heat: Heat, body: HeatBody, passage: Passage, way: Way) -> None:
        self.body, self.passage, self._way = body, passage, way
        self._tolerance = heat.reduction_tolerance
        self._areas = body.surface.spread @ body.surface.weights
        self.around = Surroundings(exposed=body.place(self._areas))
        self.nodes = csr_array(body.trace.rows[passage.nodes])
        self.loads = csc_array(self.nodes.T)
        self._known: tuple[float, ReducedBasis, Array] | None = None

    @property
    def lasting(self) -> bool:
        """Whether its modes hold what is felt a step later alone; the rest is in the nodes' own responses."""
        return len(self.passage.nodes) > MANY

    def _modes(self, shortest: float) -> tuple[ReducedBasis, Array]:
        """Return a basis of modes for stages of this length, s, and longer ones, and their rates (dim,); collective."""
        if self._known is None or self._known[0] > shortest * (1 + 1e-9):
            step = self.body.step(0.0, shortest, self.around)
            # Fluxes weigh by their areas, as friction makes them; a node of a triangle may have none.
            areas = self._areas[self.passage.nodes]
            loads = csc_array(self.loads @ diags_array(np.maximum(areas, LEAST_AREA * self._areas.mean())))
            settings = (loads, [0.0], shortest, self._tolerance, self.around)
            basis = self._way(partial(reduced_basis, self.body, *settings, lasting=self.lasting), [step])
            self._known = (shortest, *modal_basis(basis, step, shortest))
            step.free()
        return self._known[1:]

    def fitted(
        self,
        steps: Sequence[HeatStep],
        duration: float,
        transfers: Sequence[csr_array],
        plans: Sequence[Sequence[StepPlan]],
        opened: Callable[[Array], Array],
        allowed: float,
    ) -> tuple[ReducedField, float]:
        """Return the strip on its modes and its difference from the whole mesh, more of them where it is large.

        Collective.

        Args:
            steps: Stages, the shortest first.
            duration: Of the shortest, s.
            transfers: Of the places of each prepared step.
            plans: The steps of each phase.
            opened: Gap at the end of the last phase by changes of temperature, see `Trial`.
            allowed: Difference that is let pass, relative.
        """
        pair, end = self.passage.middle, self.passage.ends[-1]
        forces = pressures(pair.punch.x) * pair.weights[:, None]
        entering = [transfers[plan.strip].T @ (forces * plan.speed) for row in plans for plan in row]
        rigid = rigid_gaps(self.body, pair.punch.x)
        trial = Trial(self.loads, entering, csr_array(end @ self.nodes), opened, rigid, through=end)
        exact = contact_responses(steps, self.loads, self.nodes) if self.lasting else None
        for tries in range(1, TRIES + 1):
            small = ReducedField(steps, self.loads, self._modes(duration)[0], exact, modal=True)
            difference = certificate(steps[0], 0.0, self.around, small, trial)
            if difference <= allowed or tries == TRIES:
                break
            self._tolerance, self._known = self._tolerance / 10, None
        return small, difference

    def fineness(self, motion: Motion, heat: Heat) -> Fineness:
        """Return the steps of a half-cycle, as given or as many as the tolerance asks for; collective."""

        def temperatures(count: int) -> tuple[Array, Array]:
            basis, rates = self._modes(STAGE * min(phase.duration for phase in motion.phases) / (2 * count))
            at_nodes = total(self.body.body.mesh.comm, self.nodes @ basis.columns)
            coarse, fine = (self._cycle(rates, at_nodes, motion, k).repeating() for k in (count, 2 * count))
            return coarse, fine

        return chosen(heat, motion.positions, temperatures)

    def _cycle(self, rates: Array, at_nodes: Array, motion: Motion, count: int) -> HeatedCycle:
        """Return a cycle of an even pressure in this many steps of each phase."""
        transfers, kinds = self.passage.steps(count)
        weights, speeds = self.passage.middle.weights, motion.mean_speeds(count)
        entering = [at_nodes.T @ (transfer.T @ weights) for transfer in transfers]
        loads = [entering[kind] * speeds[phase, k] for phase, row in enumerate(kinds) for k, kind in enumerate(row)]
        reading = np.asarray(self.passage.ends[-1] @ at_nodes)
        durations = [duration / count for duration in motion.durations for _ in range(count)]
        return HeatedCycle(rates, loads, reading, durations)
