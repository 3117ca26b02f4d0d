"""A strip that passes under the punch, with its modes and the steps that they ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from fenwear.arrays import Array
from fenwear.case import Heat
from fenwear.heat.certificate import Trial, certificate, pressures, rigid_gaps
from fenwear.heat.conduction import HeatBody, HeatStep, Surroundings
from fenwear.heat.contact_response import contact_responses
from fenwear.heat.exchange import STAGE
from fenwear.heat.field import ReducedBasis
from fenwear.heat.fitted import TRIES
from fenwear.heat.halving import HeatedCycle, chosen
from fenwear.heat.kept_basis import Way
from fenwear.heat.modal import ModalField, modal_basis
from fenwear.heat.passage import Passage
from fenwear.heat.reduction import reduced_basis
from fenwear.heat.side import Fineness, StepPlan
from fenwear.parallel import total
from fenwear.sliding.motion import Motion

MANY = 300  # contact nodes above which a basis holds what is felt a step later alone
LEAST_AREA = 0.1  # of the mean: what a node counts for that has no area of its own


class PassingStrip:
    """A strip in its own frame, all of whose contact surface convects, with loads at the nodes that the punch passes.

    Args:
        heat: Settings of the heat.
        body: Conduction in the strip.
        passage: Where the punch is on it.
        way: How a basis is come by.

    Attributes:
        nodes: Temperature at the trace nodes of the passage (q, owned).
        loads: Unit loads there (owned, q).
        around: What it meets beyond its mesh.
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

    def modes(self, shortest: float) -> ReducedBasis:
        """Return a basis of modes for stages of this length, s, and longer ones; collective."""
        return self._modes(shortest)[0]

    def _modes(self, shortest: float) -> tuple[ReducedBasis, Array]:
        """Return the same, and the rates of the modes (dim,), 1/s."""
        if self._known is None or self._known[0] > shortest * (1 + 1e-9):
            step = self.body.step(0.0, shortest, self.around, at_once=True)
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
    ) -> tuple[ModalField, float]:
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
            small = ModalField(steps, self.loads, self.modes(duration), exact)
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
