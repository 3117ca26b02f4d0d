"""Heat of friction by the local slip: into both bodies in every time step, and back to the contact as expansion.

A node that slips makes the heat q = -t . s / dt for its area, with the slip s of its time step dt. Both bodies
conduct it on their reduced bases (see `heat.exchange`), and what they expand by at the end of the step, in every
direction, moves their surfaces in that step as loads do. Contact and heat of a step are solved together.

A time step of contact with stick and of heat, solved together.

A node conducts where it touches at the end of the step. Nodes that open as they are heated, and close as they cool, may
have no answer of that kind: then those conduct that touched when the iterations had seen enough of it.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg
import scipy.spatial
from scipy.sparse import coo_array, csr_array

from fenwear.algebra.fixed_point import fixed_point
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Case, Heat
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.heat.conduction import HeatBody
from fenwear.heat.heat_exchange import HeatExchange
from fenwear.heat.passage import Passage
from fenwear.heat.periodic_heat import JumpEnd
from fenwear.heat.prepare import prepare_exchange
from fenwear.heat.temperature import Functional, HeatState, ReducedBasis
from fenwear.laws import conductance_of
from fenwear.steps.stick_interface import StickInterface
from fenwear.steps.stick_position import LoadEffect
from fenwear.steps.stick_program import TimeStep, far_enough, timed_motion
from fenwear.steps.stick_state import PartialSlipState, StickState
from fenwear.surfaces.placement import HERE, Placement
from fenwear.system import Bodies

NEUTRAL = 1e-10  # of a cycle's largest factor below 1: temperatures do not die out


class StickHeat:
    """Temperatures of both bodies over the time steps of a cycle.

    Args:
        exchange: With a phase for each time step; takes heat in place of pressures.
        expansions: Displacement of punch and strip by their temperatures, rows (q, d, dim), along all axes, mm.
        interface: The bodies in contact.
        stays: Whether the heated place stays under the punch; else it is the strip's material that carries it.
    """

    def __init__(
        self,
        exchange: HeatExchange,
        expansions: tuple[Functional, Functional],
        interface: StickInterface,
        *,
        stays: bool,
    ) -> None:
        self._stays = stays
        self.exchange, self.expansions, self._interface = exchange, expansions, interface
        self._split = len(exchange.bases[0])
        self._seen: dict[float | Placement, csr_array] = {}

    def initial(self) -> Array:
        """Return the temperatures at the start (dim,)."""
        return self.exchange.initial().values

    def step(self, number: int, temperature: Array, heat: Array, conductance: Array) -> tuple[HeatState, Array]:
        """Return the temperatures at the end of a time step, and the terms of its balance (8,), mJ.

        Args:
            number: Of the time step in the cycle.
            temperature: Before (dim,).
            heat: Of friction (n,), mW/mm².
            conductance: Of the nodes (n,).
        """
        return self.exchange.conduct(self.exchange.at(temperature), number, heat, conductance)

    def check_bounds(self, before: Array, after: Array, terms: Array) -> None:
        """Hold what a half-cycle has stored against what can have entered: a step that slips little has no influence.

        Args:
            before, after: Temperatures (dim,).
            terms: Of the balances of its time steps (k, 8), mJ.

        Raises:
            HeatError: the bodies are hotter or colder than friction and their boundaries can make them.
        """
        friction, debris = terms.sum(axis=0)[:2]
        self.exchange.check_bounds(self.exchange.at(before), self.exchange.at(after), float(friction - debris))

    def expanded(self, temperature: Array, loaded: LoadEffect, offset: float | Placement) -> LoadEffect:
        """Return the effect of the loads and of the expansion at temperatures (dim,), with the strip at an offset."""
        punch, strip = (
            expansion(part)
            for expansion, part in zip(self.expansions, np.split(temperature, [self._split]), strict=True)
        )
        if self._stays and self._interface.moves and offset not in (0.0, HERE):
            if offset not in self._seen:
                surface = self._interface.middle.pair.strip
                self._seen[offset] = read_at(surface, self._interface.placement(offset).points(surface.trace))
            strip = self._seen[offset] @ strip
        return replace(loaded, on_punch=loaded.on_punch + punch, on_strip=loaded.on_strip + strip)

    def surfaces(self, temperature: Array) -> Array:
        """Return the contact temperatures of punch and strip (2, n), K."""
        return np.array(self.exchange.contact_temperatures(self.exchange.at(temperature)))

    def through(self, heats: Array, conductances: Array) -> CycleMap:
        """Return the map of a cycle from the temperatures at its start to those at its end.

        Args:
            heats: Of friction in each of its time steps (k, n), mW/mm².
            conductances: Of the nodes (k, n), N/(mm s K).
        """
        exchange, dim = self.exchange, sum(len(basis) for basis in self.exchange.bases)
        through: Array = np.eye(dim)
        source: Array = np.zeros(dim)
        for number in range(len(heats)):
            through, _ = exchange.change(number, conductances[number], changes=through)
            source = exchange.conduct(exchange.at(source), number, heats[number], conductances[number])[0].values
        return CycleMap(through, source)


@dataclass(frozen=True)
class CycleMap:
    """Change of temperatures over a cycle of constant heat, s -> P s + b, with P (dim, dim) and b (dim,)."""

    through: Array
    source: Array

    def after(self, temperature: Array, cycles: float) -> Array:
        """Return the temperatures after so many cycles in one implicit Euler step: (I + N (I - P)) s' = s + N b."""
        return JumpEnd(self.through, cycles).state(temperature, self.source)

    def at_rest(self) -> Array:
        """Return the temperatures that cycles lead to in the end (dim,): (I - P) s = b.

        Raises:
            CaseError: they rise without end, as neither body loses heat.
        """
        if np.abs(scipy.linalg.eigvals(self.through)).max() > 1 - NEUTRAL:
            message = (
                "the bodies lose no heat, so their final temperature depends on the run before: use `run`. For "
                "`steady` hold a temperature or set any convection, since in the end nothing slips"
            )
            raise CaseError(InputError("heat.convection", message))
        return JumpEnd(self.through, np.inf).state(self.source, self.source)

    def error(self, before: Array, after: Array, rate: Array, cycles: float) -> Array:
        """Return about the error of such a step (dim,), by the trapezoidal rule with the rate of change before it."""
        now = self.through @ after + self.source - after
        missing = after - before - cycles / 2 * (rate + now)
        return JumpEnd(self.through, cycles).state(missing, np.zeros_like(missing))


def stick_heat(interface: StickInterface, case: Case, heat: Heat, steps: int) -> StickHeat:
    """Return the heat of a case with this many time steps in a half-cycle; collective.

    Raises:
        HeatError: no basis gives temperatures that die out.
    """
    bodies, middle, motion, passage = interface.bodies, interface.middle.pair, timed_motion(case, steps), None
    if case.stick.force is None and far_enough(case, middle.punch):
        passage = Passage(middle, interface.sliding.field, motion)
    punch, strip = bodies.heat
    n = len(middle.weights)
    rows = n, n if passage is None else len(passage.nodes)
    nothing = tuple(np.zeros((count, body.owned)) for count, body in zip(rows, bodies.heat, strict=True))
    exchange = prepare_exchange(
        heat,
        bodies.heat,
        middle,
        (nothing[0], nothing[1]),
        interface.sliding.field,
        motion,
        np.ones(len(middle.weights)),
        case.model.thickness,
        reduced=True,
        passage=passage,
        moved=(partial(free_expansion, bodies.punch, punch), partial(free_expansion, bodies.strip, strip)),
        keep=interface.keep,
        fresh=interface.fresh,
    )
    expanded = expansions(interface, exchange, bodies, heat.initial)
    exchange = exchange.through(conductance_of(interface.layers, case, bodies.regions, interface.middle.pair))
    return StickHeat(heated_directly(exchange), expanded, interface, stays=passage is None)


def read_at(surface: ContactSurface, points: Array) -> csr_array:
    """Return the matrix from a surface's trace nodes to points near it (p, N): linear, constant beyond the rim.

    Args:
        surface: Seen along the axis that is nearest to its mean normal.
        points: (p, d), mm.
    """
    axis = int(np.argmax(np.abs(surface.weights @ surface.outward)))
    nodes, seen = np.delete(surface.trace, axis, axis=1), np.delete(points, axis, axis=1)
    if nodes.shape[1] == 1:
        order = np.argsort(nodes[:, 0])
        x = nodes[order, 0]
        place = np.clip(np.searchsorted(x, seen[:, 0]) - 1, 0, len(x) - 2)
        share = np.clip((seen[:, 0] - x[place]) / (x[place + 1] - x[place]), 0, 1)
        corners, shares = order[np.stack([place, place + 1], axis=1)], np.stack([1 - share, share], axis=1)
    else:
        mesh = scipy.spatial.Delaunay(nodes)
        simplex = mesh.find_simplex(seen)
        flat = np.einsum("pij,pj->pi", mesh.transform[simplex, :2], seen - mesh.transform[simplex, 2])
        shares = np.column_stack([flat, 1 - flat.sum(axis=1)])
        corners = np.asarray(mesh.simplices[simplex])
        beside = simplex < 0
        corners[beside] = scipy.spatial.KDTree(nodes).query(seen[beside])[1][:, None]
        shares[beside] = [1.0, 0.0, 0.0]
    rows = np.repeat(np.arange(len(seen)), corners.shape[1])
    return coo_array((shares.ravel(), (rows, corners.ravel())), shape=(len(seen), len(nodes))).tocsr()


def heated_directly(exchange: HeatExchange) -> HeatExchange:
    """Return the exchange that takes the heat of friction in place of pressures."""
    other = copy.copy(exchange)
    other.plans = [[replace(plan, speed=1.0) for plan in plans] for plans in exchange.plans]
    return other.with_friction(np.ones_like(exchange.friction))


def expansions(
    interface: StickInterface, exchange: HeatExchange, bodies: Bodies, initial: float
) -> tuple[Functional, Functional]:
    """Return the thermal expansion of both bodies on the bases of their temperatures; collective."""
    expansions = []
    for elastic, patterns, basis in zip((bodies.punch, bodies.strip), interface.patterns, exchange.bases, strict=True):
        if not isinstance(basis, ReducedBasis):
            raise CaseError(InputError("heat.operator", "expected 'reduced' with contact.law = 'coulomb'"))
        fields = np.hstack([basis.columns, (basis.lift - initial)[:, None]])
        picked = free_expansion(elastic, basis.body, fields)
        at_patterns = np.einsum("qN,Ndk->qdk", patterns.T.toarray(), picked)
        if interface.dim > elastic.dim:  # rings, which heat does not turn
            at_patterns = np.insert(at_patterns, 1, 0.0, axis=1)
        expansions.append(Functional(at_patterns[:, :, :-1], at_patterns[:, :, -1]))
    return expansions[0], expansions[1]


def free_expansion(elastic: ElasticBody, body: HeatBody, fields: Array) -> Array:
    """Return the displacement of the trace nodes (N, d, k) by temperatures (owned, k) without contact; collective."""
    coupling = elastic.thermal_coupling(body.space)
    theta, force = coupling.createVecs()
    forces = []
    for field in fields.T:
        theta.array[:] = field
        coupling.mult(theta, force)
        forces.append(force.array.copy())
    for petsc_object in (coupling, theta, force):
        petsc_object.destroy()
    right = np.stack(forces, axis=1)
    none = np.zeros((elastic.guides.rotations.shape[1], right.shape[1]))
    return elastic.trace.pick(elastic.held(elastic.solve(right), right, none))  # expansion turns nothing


CLOSE = 1e-9  # change of heat and pressure over their largest that ends the iterations of a step
ENOUGH = 12  # iterations after which nodes that open and close no longer decide who conducts
APART = "contact with stick and heat did not converge. Increase stick.steps, or reduce the friction heat"


def coupled_step(
    heat: StickHeat,
    solved: Callable[[LoadEffect, tuple[Array, Array] | None], StickState],
    loaded: LoadEffect,
    at: PartialSlipState,
    step: TimeStep,
    flux: float,
) -> tuple[StickState, LoadEffect, dict[str, Any]]:
    """Return contact and heat of a time step that belong together: state, loads with the expansion, and what is warm.

    The last one by the names of `PartialSlipState`.

    Args:
        heat: Of both bodies.
        solved: Returns the contact under loads, from the pressure and the trial of one that is near.
        loaded: The loads without expansion.
        at: Where the run is at the start.
        step: Loads and motions of the step.
        flux: Largest friction heat, about, mW/mm².

    Raises:
        ConvergenceError: they do not converge.
    """
    before, near = at.contact, at.near
    n = len(before.pressure)
    units = np.repeat([1 / max(flux, 1e-300), 1 / max(float(before.pressure.max()), 1e-300)], n)
    last, conducting, settled, tries = before, before.closed, False, 0

    def conductance(pressure: Array, closed: Mask) -> Array:
        return heat.exchange.conductance(np.where(closed, np.maximum(pressure, 1e-300), 0.0))

    def once(x: Array) -> tuple[Array, LoadEffect, bool]:
        nonlocal last, conducting, settled, tries, near
        # Pressures that iterations have mixed are not zero where nodes are open: the last contact tells who conducts.
        conducting = last.closed if tries < ENOUGH else conducting
        made, pressure = np.split(x / units, 2)
        warm = heat.step(at.next_step, at.temperature, made, conductance(pressure, conducting))[0].values
        expanded = heat.expanded(warm, loaded, step.offset)
        last = solved(expanded, near)
        near, tries = (last.pressure, last.trial), tries + 1
        settled = tries >= ENOUGH or bool((last.closed == conducting).all())
        return units * np.concatenate([last.heat / step.duration, last.pressure]), expanded, False

    def close(change: Array, _: Array) -> bool:
        return settled and float(np.abs(change).max()) < CLOSE

    expanded = fixed_point(once, units * np.concatenate([at.heating, before.pressure]), close, APART)
    made, conducts = np.asarray(last.heat / step.duration), conductance(last.pressure, conducting)
    warm = heat.step(at.next_step, at.temperature, made, conducts)[0].values
    return last, expanded, {"temperature": warm, "heating": made, "conductance": conducts, "coupling": tries}
