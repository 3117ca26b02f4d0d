"""Punch and strip, condensed and joined in every phase of the motion, with the heat of the motion prepared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array, hstack

from fenwear.bodies.condensation import CondensedBody
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.response import Request, identity
from fenwear.bodies.surface_operators import Relocatable, SurfaceOperator, operators_for
from fenwear.case.program import speeds_of
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import all_together
from fenwear.contact import CondensedContact, ContactSolver, SlidingContact
from fenwear.heat.heat_exchange import HeatExchange, Isothermal
from fenwear.heat.passage import Passage
from fenwear.heat.prepare import prepare_exchange, prepare_steady
from fenwear.laws import Layers, conductance_of
from fenwear.laws.layers import SOFT
from fenwear.laws.wear import WornDepths
from fenwear.surfaces import Interface, RigidEquilibrium
from fenwear.surfaces.sliding_field import node_rates
from fenwear.system.both_bodies import Bodies
from fenwear.system.contact_grids import check_felt
from fenwear.system.contact_setup import MIDDLE, ContactSetup
from fenwear.system.memory_estimate import Resources, setup_resources
from fenwear.system.surface_creep import Creep, creep_of

T = TypeVar("T")
Preparation = Literal["as set", "reduced", "none"]  # of the heat
SAME = 1e-12  # of the largest load: what of another is rounding
ROUNDING = 1e-12  # of unit normals: frames that differ by less are the same


@dataclass(frozen=True)
class Condensed:
    """Both bodies condensed onto the contact.

    Attributes:
        punch: Onto the contact nodes.
        strip: Onto its own trace nodes where it moves as a whole, else onto the contact nodes opposite.
        strip_moves: Which of the two.
        passed: Motion of the strip's surface along its normal by each kelvin of this rank's nodes, at the trace nodes
            of its passage (q, owned), mm/K, where it conducts and passes under the punch.
    """

    punch: SurfaceOperator
    strip: SurfaceOperator
    strip_moves: bool
    passed: Array | None = None

    def join(self, rigid: RigidEquilibrium, layer: Array | float) -> Interface:
        """Return both joined at the place of a pair, with a linear layer."""
        strip, moves = self.facing(rigid)
        return Interface(rigid, self.punch, strip, moves, layer=layer)

    def facing(self, rigid: RigidEquilibrium) -> tuple[SurfaceOperator, bool]:
        """Return the strip's operator at the place of a pair, and whether it moves as a whole: not on a grid."""
        pair, strip = rigid.pair, self.strip
        if self.strip_moves and pair.punch.grid is not None and isinstance(strip, Relocatable):
            return strip.at(pair.placement.points_back(pair.punch.x)), False
        return strip, self.strip_moves

    def under_loads(self, bodies: Bodies) -> Condensed:
        """Return the condensed contact under the loads of these bodies; collective."""
        return replace(self, punch=self.punch.under(bodies.punch), strip=self.strip.under(bodies.strip))


@dataclass(frozen=True)
class ElasticContact:
    """Both bodies condensed and joined in every phase.

    Attributes:
        condensed: Both bodies' answers to forces on the contact.
        interface: The condensed interface in the middle position, under the mean loads.
        interfaces: The same in each phase.
        creep: Creep of bodies and layer.
    """

    condensed: Condensed
    interface: Interface
    interfaces: tuple[Interface, ...]
    creep: Creep


@dataclass(frozen=True, kw_only=True, repr=False)
class Tribosystem(ContactSetup):
    """Punch and strip, condensed and joined in every phase of the motion: ready for contact, wear and cycles.

    Attributes:
        elastic: Both bodies' elastic answers.
        exchange: The bodies' temperatures over the phases; isothermal without heat, or where it was not asked for.
        law_state: Parts that the law of contact has prepared.
    """

    elastic: ElasticContact
    exchange: HeatExchange
    law_state: Any = None

    @cached_property
    def layers(self) -> Layers:
        """Layers between the surfaces, which flow beyond a hardness as softly as the bodies are elastic."""
        layers = super().layers
        return (
            layers
            if layers.hardness == np.inf
            else replace(layers, softness=SOFT * self.elastic.interface.elastic_length)
        )

    def contact(self, directions: Sequence[int]) -> ContactSolver:
        """Return the contact in the middle position under the mean loads.

        Args:
            directions: Sliding direction d of each phase that is solved for.
        """
        return self._contact([SlidingContact(self.elastic.interface, self.phases.middle_ratio(d)) for d in directions])

    def phase_contact(self, phases: Sequence[int]) -> ContactSolver:
        """Return the contact of phases of the motion, given by their numbers."""
        ratios = self.phases.ratios()
        return self._contact([SlidingContact(self.elastic.interfaces[k], ratios[k]) for k in phases])

    def passed_contact(self, phase: int, *, capped: bool = True) -> ContactSolver:
        """Return the contact of a phase in a march, with creep and, where possible, plastic flow."""
        return self._contact(
            [SlidingContact(self.elastic.creep.grown[phase], self.phases.ratios()[phase])],
            self.layers.hardness if capped else np.inf,
        )

    def gap(self, phase: int, worn: WornDepths, *, passing: bool = False) -> Array:
        """Return the gap of the unloaded, worn bodies in a phase (n,), mm.

        Args:
            phase: Number of the phase.
            worn: Depths at its start, what lies between and what has crept.
            passing: Whether creep continues over the phase, in a march; else it is left out.
        """
        gap = super().gap(phase, worn)
        return gap + self.elastic.creep.offset(phase, worn.crept) if passing and self.elastic.creep.creeps else gap

    def unworn(self) -> WornDepths:
        """Return the worn depths at the start, none, with the initial layers and without creep."""
        return replace(super().unworn(), crept=self.elastic.creep.beginning())

    def _contact(self, phases: list[SlidingContact], most: float = np.inf) -> ContactSolver:
        return CondensedContact(phases, self.remedies, self.team, most)


def led(system: Tribosystem, function: Callable[[], T]) -> T:
    """Call a function of a prepared system, on rank 0 for all where possible, else on every rank; collective.

    Every rank calls it where temperatures of all nodes are asked for.

    Raises:
        Exception: what `function` raised, on every rank.
    """
    return system.team.lead(function) if system.exchange.reduced else function()


def isothermal(placed: ContactSetup) -> Isothermal:
    """Return the exchange of bodies that stay at their initial temperature."""
    return Isothermal(len(placed.rigids), len(placed.pair.weights), placed.case.initial_temperature)


def layer_conductance(placed: ContactSetup) -> Callable[[Array, int], Array] | None:
    """Return h_c by pressures (n,) and phase, where the layer gives it (`fenwear.laws.contact_conductance`)."""
    return conductance_of(placed.layers, placed.case, placed.bodies.regions, placed.pair)


def resources_of(placed: ContactSetup) -> Resources:
    """Return the resources to condense and join the bodies; collective."""
    moves, fixed, flat = _frame(placed)
    nodes, dim = len(placed.pair.weights), placed.pair.punch.dim
    on_strip = len(placed.pair.strip.trace) if moves else nodes
    axes = 1 if fixed else dim, 1 if not moves or (fixed and flat) else dim
    asked = (nodes, nodes * axes[0]), (on_strip, on_strip * axes[1])
    interfaces = len({id(rigid) for rigid in (*placed.rigids, placed.rigid)})
    return setup_resources(placed.bodies, nodes, asked, interfaces * dim + 2 * len(placed.sliding.pairs) + 1)


def elastic(placed: ContactSetup, *, fresh: bool = False) -> Tribosystem:
    """Condense both bodies and join them in every phase; collective.

    Factors both stiffnesses, unless the bodies are kept on disk.

    Args:
        placed: The bodies.
        fresh: Factor whatever is kept.

    Raises:
        CaseError: there is not memory enough.
    """
    return joined(placed, condense_bodies(placed, fresh=fresh))


def condense_bodies(placed: ContactSetup, *, fresh: bool = False) -> Condensed:
    """Condense both bodies onto what the phases of the motion ask for; collective.

    They are kept on disk, but with properties of temperatures that no other run has.

    Args:
        placed: The bodies.
        fresh: Factor whatever is kept.

    Raises:
        CaseError: there is not memory enough.
    """
    resources_of(placed).check()
    bodies, middle = placed.bodies, placed.pair
    made = [
        body.thermal_coupling(conduction.space)
        for body, conduction in zip((bodies.punch, bodies.strip), bodies.heat, strict=False)
    ]
    couplings: Sequence[PETSc.Mat | None] = made or (None, None)
    # In one frame, forces and displacements along its normals are all that is ever asked for.
    moves, fixed, flat = _frame(placed)
    onto_punch = Request(bodies.punch, middle.punch.spread, middle.normal if fixed else None, couplings[0])
    if moves:
        trace = middle.strip.trace
        along = np.broadcast_to(middle.normal_on_strip[0], trace.shape) if fixed and flat else None
        onto_strip = Request(bodies.strip, identity(len(trace)), along, couplings[1])
    else:
        opposite = csr_array(middle.transfer.T)
        onto_strip = Request(bodies.strip, opposite, middle.normal_on_strip, couplings[1])
    if placed.sliding.passage is not None:
        onto_strip = _with_passage(onto_strip, placed.pair.strip, placed.sliding.passage)
    punch, strip = operators_for([onto_punch, onto_strip], keep=bodies.warmed is None, fresh=fresh)
    check_felt(middle, bodies.punch, bodies.strip)
    for coupling in made:
        coupling.destroy()
    if placed.sliding.passage is None or strip.by_temperature is None or not isinstance(strip, CondensedBody):
        return Condensed(punch, strip, moves)
    n = len(middle.weights)
    return Condensed(punch, strip.first(n), moves, strip.by_temperature[n:])


def _with_passage(request: Request, strip: ContactSurface, passage: Passage) -> Request:
    """Return the request with the strip's trace nodes of the passage, along its normal, after the others."""
    nodes = passage.nodes
    outward = strip.extension @ strip.outward
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    picked = csr_array((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(len(strip.trace), len(nodes)))
    patterns = csr_array(hstack([request.patterns, picked]))
    return replace(request, patterns=patterns, directions=np.vstack([request.along[:, :, 0], outward[nodes]]))


def joined(placed: ContactSetup, condensed: Condensed, exchange: HeatExchange | None = None) -> Tribosystem:
    """Join the condensed bodies in every phase; what phases share is made once; collective."""
    interface = condensed.join(placed.rigid, placed.layers.winkler)
    under = _under_all(condensed, placed)
    joins: list[Interface] = []
    for k, (rigid, bodies) in enumerate(zip(placed.rigids, placed.loaded, strict=True)):
        earlier = next((j for j in range(k) if placed.rigids[j] is rigid and placed.loaded[j] is bodies), None)
        if rigid is placed.rigid:
            joins.append(interface)
        elif earlier is not None:
            joins.append(joins[earlier])
        else:
            loaded = under[id(bodies)]
            alike = rigid.pair.transfer is placed.pair.transfer and rigid.pair.normal is placed.pair.normal
            layer = placed.layers.winkler
            joins.append(
                interface.under(rigid, loaded.punch, loaded.facing(rigid)[0]) if alike else loaded.join(rigid, layer)
            )
    parts = {name: getattr(placed, name) for name in ContactSetup.__dataclass_fields__}
    interfaces = tuple(joins)

    def on_material(phase: int) -> Interface:
        interface, bodies = interfaces[phase], under[id(placed.loaded[phase])]
        return (
            interface
            if interface.strip is bodies.strip
            else Interface(interface.rigid, bodies.punch, bodies.strip, strip_moves=True)
        )

    creep = creep_of(placed, (condensed.punch, condensed.strip), interfaces, on_material)
    return Tribosystem(
        **parts,
        elastic=ElasticContact(condensed, interface, interfaces, creep),
        exchange=exchange or isothermal(placed),
    )


def _under_all(condensed: Condensed, placed: ContactSetup) -> dict[int, Condensed]:
    """Return the condensed bodies under the loads of each phase, by the id of its bodies; collective.

    Displacements are linear in the loads: solved are those that the others are made of.
    """
    others = list({id(bodies): bodies for bodies in placed.loaded if bodies is not placed.bodies}.values())
    by_id = {id(placed.bodies): condensed}
    if not others:
        return by_id
    loads = np.array([np.concatenate([bodies.punch.load, bodies.strip.load]) for bodies in (placed.bodies, *others)])
    chosen, shares = _spanning(placed.bodies.comm, loads)
    base = [condensed if k == 0 else condensed.under_loads(others[k - 1]) for k in chosen]
    for share, bodies in zip(shares.T[1:], others, strict=True):
        if isinstance(condensed.punch, CondensedBody) and isinstance(condensed.strip, CondensedBody):
            on_punch, on_strip = (
                np.asarray(np.tensordot(share, [body.by_load for body in bodies_of], 1), dtype=np.float64)
                for bodies_of in ([body.punch for body in base], [body.strip for body in base])
            )
            by_id[id(bodies)] = replace(
                condensed,
                punch=replace(condensed.punch, by_load=on_punch),
                strip=replace(condensed.strip, by_load=on_strip),
            )
        else:
            by_id[id(bodies)] = condensed.under_loads(bodies)
    return by_id


def _spanning(comm: MPI.Comm, loads: Array) -> tuple[list[int], Array]:
    """Return loads that span all others, and their shares in each (chosen, all); collective.

    The first is among them. One after the other that which differs most from those before is taken, and its direction
    out of all (Gram and Schmidt, with pivoting).

    Args:
        comm: The ranks.
        loads: At this rank's own degrees of freedom (all, owned).
    """
    left = loads.copy()
    sizes = np.sqrt(comm.allreduce(np.einsum("ko,ko->k", left, left)))
    chosen: list[int] = []
    scale, parts = sizes.max(initial=0.0), []
    while len(chosen) < len(loads):
        best = 0 if not chosen and sizes[0] > SAME * scale else int(np.argmax(sizes))
        if chosen and sizes[best] <= SAME * scale:
            break
        chosen.append(best)
        along = left[best] / max(sizes[best], 1e-300)
        parts.append(comm.allreduce(left @ along))
        left -= np.outer(parts[-1], along)
        sizes = np.sqrt(comm.allreduce(np.einsum("ko,ko->k", left, left)))
    all_loads = np.array(parts)
    return chosen, np.linalg.lstsq(all_loads[:, chosen], all_loads, rcond=None)[0]


def answers_for(before: ContactSetup, placed: ContactSetup) -> bool:
    """Return whether bodies condensed for one motion answer for another one, too."""
    frame = _frame(placed)
    if _frame(before) != frame:
        return False
    first, second = (
        np.zeros(0) if setup.sliding.passage is None else setup.sliding.passage.nodes for setup in (before, placed)
    )
    return np.array_equal(first, second)


def _frame(placed: ContactSetup) -> tuple[bool, bool, bool]:
    """Return whether the strip moves as a whole, whether the frame stays, and whether the strip is flat."""
    middle = placed.pair
    moves = any(pair.transfer is not middle.transfer for pair in placed.sliding.pairs)
    fixed = all(_close(pair.normal, middle.normal) for pair in placed.sliding.pairs)
    return moves, fixed, not moves or _close(middle.normal_on_strip, middle.normal_on_strip[:1])


def _close(first: Array, second: Array) -> bool:
    return bool(np.abs(first - second).max() < ROUNDING)


def with_exchange(
    system: Tribosystem, *, reduced: bool | None = None, keep: bool = False, fresh: bool = False
) -> Tribosystem:
    """Return the system with the heat of its motion prepared; collective.

    Args:
        system: With condensed bodies.
        reduced: Whether temperatures are reduced to a small basis, as whole cycles need; by default as
            the settings say.
        keep: Whether what is reduced is kept on disk, and taken from there where it is.
        fresh: Reduce whatever is kept.
    """
    if system.case.heat is None:
        return system
    all_together(system.bodies.comm)
    reduced = system.case.heat.operator == "reduced" if reduced is None else reduced
    exchange = prepare_exchange(
        system.case.heat,
        system.bodies.heat,
        system.pair,
        expansions(system.elastic),
        system.sliding.field,
        system.motion,
        heating_frictions(system),
        system.bodies.punch.thickness,
        reduced=reduced,
        passage=system.sliding.passage,
        others=speeds_of(system.case),
        keep=keep,
        fresh=fresh,
    )
    return replace(system, exchange=exchange.through(layer_conductance(system)))


def with_reduced_heat(system: Tribosystem, *, keep: bool = False, fresh: bool = False) -> Tribosystem:
    """Return the system with its heat on a small basis, whatever the settings say; see `with_exchange`; collective."""
    if system.case.heat is None or (system.exchange.conducts and system.exchange.reduced):
        return system
    return with_exchange(system, reduced=True, keep=keep, fresh=fresh)


def preparation(system: Tribosystem) -> Preparation:
    """Return the preparation of the heat of a system: "reduced" where its settings do not say so themselves."""
    if system.case.heat is None:
        return "as set"
    if not system.exchange.conducts:
        return "none"
    return "reduced" if system.exchange.reduced and system.case.heat.operator != "reduced" else "as set"


def steady_exchange(system: Tribosystem, velocities: Sequence[float]) -> HeatExchange:
    """Return the exchange whose phases are steady states at these velocities of the strip; collective.

    Raises:
        CaseError: there is no heat, or a body has no heat sink.
    """
    if system.case.heat is None:
        raise CaseError(InputError("heat", "missing, but required here"))
    exchange = prepare_steady(
        system.case.heat,
        system.bodies.heat,
        system.pair,
        expansions(system.elastic, in_middle=True),
        system.sliding.field,
        velocities,
        heating_friction(system, mean_friction(system)),
        system.bodies.punch.thickness,
    )
    return exchange.through(layer_conductance(system))


def expansions(elastic: ElasticContact, *, in_middle: bool = False) -> tuple[Array, Array]:
    """Return the motion of each surface along the normal by each kelvin of this rank's nodes, mm/K.

    Args:
        elastic: The condensed bodies.
        in_middle: Whether the strip is in its middle position, even where it passes under the punch.

    Returns:
        At the contact nodes (n, owned) each, or of a strip that passes under the punch at its passage's (q, owned).
    """
    condensed = elastic.condensed
    punch, strip = condensed.punch.by_temperature, condensed.strip.by_temperature
    if condensed.passed is not None and not in_middle:
        strip = condensed.passed
    if punch is None or strip is None:
        raise CaseError(InputError("heat", "missing, but required here"))
    return punch, strip


def friction_power(system: ContactSetup) -> float:
    """Return the mean power of friction at the mean pressure and speed, per thickness, mW/mm."""
    slid = np.array([phase.distance for phase in system.motion.phases]) @ heating_frictions(system)
    return float(system.pair.weights @ slid) * system.rigid.mean_pressure / system.motion.period


def mean_friction(system: ContactSetup) -> Array:
    """Return mu at the mean pressure and speed (n,)."""
    return system.laws.friction.values(system.phases.conditions(MIDDLE))


def heating_friction(system: ContactSetup, mu: Array, phase: int = MIDDLE) -> Array:
    """Return mu times the sliding for a unit of the stroke's law (n,): friction heat is this times p v.

    Args:
        system: The placed bodies.
        mu: (n,).
        phase: Number of the phase; MIDDLE for the field of the whole motion.
    """
    return mu * (system.sliding.ratio[phase] if phase >= 0 else node_rates(system.sliding.field, system.pair))


def heating_frictions(system: ContactSetup) -> Array:
    """Return the friction ratios that heat in each phase (phases, n), at the mean pressure and speed."""
    mu = mean_friction(system)
    return np.array([heating_friction(system, mu, phase) for phase in range(len(system.motion.phases))])
