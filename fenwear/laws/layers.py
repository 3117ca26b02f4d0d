"""All layers between two surfaces as one object: what it adds to the gap of the nodes, and the rows of its state.

    gap = bodies + winkler p + delta(p) - t + D,    p <= hardness

with the linear closure, that of a law and of coatings by what is left of them (`compliant_layer`), the thickness of
debris (`debris`) and the plastic depth D, which grows where the pressure is at the hardness. In one phase that is an
upper bound of the inequality, and D grows by what the gap would be below zero (0 <= dD, p <= hardness, dD (p -
hardness) = 0). Where phases flow together, in jumps, or nodes are many, the surface yields in a solve by s (p -
hardness) beyond it, s being SOFT times the elastic closure by a unit of pressure. This is put into the gap, and the
contact is solved again: the excess falls to a fraction each time (augmented Lagrangians; M. R. Hestenes, J.
Optim. Theory Appl. 4, 1969, 303), until it is CAPPED of the hardness. Closures linear in the pressure belong to the
compliance of the bodies (`fenwear.surfaces.Interface`), so that every study has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.sparse import csr_array

from fenwear.case import Case, Contact, Dependence, Material, WearLaw
from fenwear.case.contact_table import STIFFNESS, ExponentialLayer, LinearLayer, Lubrication, PowerLayer, RoughLayer
from fenwear.case.wear_table import NO_WEAR, depends_on, place_values
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.laws.coating import SoftCoating, soft_coatings
from fenwear.laws.compliant_layer import (
    RIGID,
    Closure,
    CoatedClosure,
    ExponentialClosure,
    Law,
    PowerClosure,
    RoughClosure,
    SharedClosure,
)
from fenwear.laws.debris import LIFE, NO_DEBRIS, Debris
from fenwear.laws.friction import ContactConditions, asperity_share
from fenwear.laws.law_states import FORGETFUL, Held, Memory
from fenwear.laws.wear import NOTHING, WornDepths
from fenwear.surfaces import ContactPair
from fenwear.surfaces.placement import in_space

RMS = np.sqrt(np.pi / 2)  # of Gaussian heights over Sa
DEBRIS = ("debris_thickness", "debris_ejected")
PLASTIC = "plastic_depth"
SOFT = 1.0  # softness beyond the hardness over that of the bodies
MOST_FLOWS, CAPPED = 500, 1e-8  # iterations; pressure off the hardness, over it, that is rounding
T = TypeVar("T")
Regions = tuple[Mapping[str, Array], Mapping[str, Array]]


@dataclass(frozen=True)
class Layers:
    """The layers between the surfaces at n nodes.

    Attributes:
        nodes: n.
        closure: The law of its closure; None where it does not, or in proportion to the pressure.
        winkler: Closure over pressure of a linear layer (n,), mm/MPa; 0 without.
        debris: Of the third body.
        hardness: Largest pressure, MPa.
        softness: Yield of the surfaces in a solve, over the pressure beyond the hardness, mm/MPa.
        memory: States of laws of one's own.
        begun: These at the start.
        strip_carries: Whether debris lies on the strip's material.
        soft: Coatings of punch and strip that may have a compliance beside their base; none where no law of wear is
            known.
    """

    nodes: int
    closure: Law | None = None
    winkler: Array | float = 0.0
    debris: Debris = NO_DEBRIS
    hardness: float = np.inf
    softness: float = 0.0
    memory: Memory = FORGETFUL
    begun: Held = field(default_factory=lambda: Held(NOTHING, NOTHING))
    strip_carries: bool = False
    soft: tuple[SoftCoating, ...] = ()

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows of the state: of debris and of what has flown, mm each, and of what laws remember."""
        remembered = map(row_of_state, self.memory.contact)
        flown = (PLASTIC,) if self.hardness < np.inf else ()
        return (*(DEBRIS if self.lies_here else ()), *flown, *remembered)

    @property
    def carried_rows(self) -> tuple[str, ...]:
        """Names of the first rows of what the strip carries, of debris, mm; others are what laws remember there."""
        return DEBRIS if self.strip_carries else ()

    def row(self, name: str) -> int:
        """Return the number of a row of the state, by its name in `rows`."""
        return self.rows.index(name)

    @cached_property
    def _fills(self) -> tuple[Array, Array]:
        """Gap that a unit of each row fills: of those at the contact's nodes, and of those that the strip carries."""
        fills = {DEBRIS[0]: 1.0, DEBRIS[1]: 0.0, PLASTIC: -1.0}
        contact, strip = self.memory.fills
        first = [fills[name] for name in self.rows[: len(self.rows) - len(contact)]]
        return np.array([*first, *contact]), np.array([*(fills[name] for name in self.carried_rows), *strip])

    @property
    def lies_here(self) -> bool:
        """Whether debris lies at the contact's nodes, and not on a strip that carries it."""
        return self.debris.present and not self.strip_carries

    @property
    def gives(self) -> Closure:
        """The law of its closure, beside a linear layer; that of nothing where there is none."""
        return RIGID if self.closure is None else self.closure

    def given(self, pressure: Array, closure: Closure | None = None) -> Array:
        """Return by how much pressures (..., n) close what lies between, mm, by default without what coatings do."""
        return self.winkler * pressure + (closure or self.gives).closure(pressure)

    def at(self, phases: int | Sequence[int]) -> Layers:
        """Return the layers in phases of the motion: asperities under a film that follows the speed close by phase."""
        return replace(self, closure=self.closure.at(phases)) if isinstance(self.closure, SharedClosure) else self

    def under(self, conditions: Sequence[ContactConditions]) -> Layers:
        """Return the layers of phases at their temperatures, which a share of asperities may depend on."""
        closure = self.closure
        if not conditions or not isinstance(closure, SharedClosure) or "T" not in closure.variables:
            return self
        warmth = np.array([condition.of("friction")["T"] for condition in conditions])
        return replace(self, closure=replace(closure, variables={**closure.variables, "T": warmth}))

    @property
    def varies(self) -> bool:
        """Whether debris is lost by a law that changes with more than the place."""
        return self.debris.varies

    @property
    def curved(self) -> bool:
        """Whether a layer has a closure that is not linear."""
        return self.closure is not None or self.hardness < np.inf

    def gives_way(self, *, capped: bool) -> bool:
        """Return whether a layer has a closure that is not linear, apart from the flow of `capped` pressures."""
        return self.softens or (self.closure is not None if capped else self.curved)

    @cached_property
    def softens(self) -> bool:
        """Whether a coating has a compliance beside its base."""
        return any(coating.modulus < np.inf for coating in self.soft)

    def coatings_left(self, pairs: Sequence[ContactPair], punch: Array, strip: Array) -> tuple[Array, Array]:
        """Return the remaining coatings of punch and strip in each phase (m, n), mm.

        Args:
            pairs: The surfaces opposite each other in each phase.
            punch, strip: Depths worn off both bodies at their own nodes, mm.
        """
        of_punch, of_strip = self.soft
        below = of_strip.left(strip)
        return (
            np.broadcast_to(of_punch.left(punch), (len(pairs), self.nodes)),
            np.array([pair.wear_interpolation @ below for pair in pairs]),
        )

    def coatings_closure(self, pairs: Sequence[ContactPair], punch: Array, strip: Array) -> CoatedClosure:
        """Return the compliant coatings in each phase (m, n) at depths; arguments as of `coatings_left`."""
        left = self.coatings_left(pairs, punch, strip)
        return CoatedClosure(
            RIGID, tuple((thickness, soft.modulus) for thickness, soft in zip(left, self.soft, strict=True))
        )

    def closure_at(self, pair: ContactPair, worn: WornDepths) -> Closure | None:
        """Return the law of closure of all layers where these depths are worn, at one place."""
        if not self.softens:
            return self.closure
        coats = self.coatings_closure([pair], worn.punch, worn.strip).coatings
        return CoatedClosure(self.gives, tuple((left[0], modulus) for left, modulus in coats))

    def unworn(self, strip: int) -> WornDepths:
        """Return the depths at the start, none, of the contact's nodes and so many of the strip, and the state then."""
        state = np.zeros((len(self.rows), self.nodes))
        carried = np.zeros((len(DEBRIS), strip)) if self.strip_carries else NOTHING
        if self.debris.present:
            (carried if self.strip_carries else state)[0] = self.debris.initial
        depths = WornDepths(np.zeros(self.nodes), np.zeros(strip), state, carried=carried)
        return self.with_held(depths, self.begun)

    def held(self, worn: WornDepths) -> Held:
        """Return the states of laws at these depths, or at the start where none are given."""
        first = len(self.rows) - len(self.begun.contact)
        contact = worn.between[first:] if len(worn.between) else self.begun.contact
        return Held(contact, worn.carried[len(self.carried_rows) :] if len(worn.carried) else self.begun.strip)

    def places(self, pairs: Sequence[ContactPair]) -> list[csr_array]:
        """Return the matrices from the contact's nodes to a strip that carries debris, of each phase; else none."""
        return [pair.wear_projection for pair in pairs] if self.strip_carries else []

    def lies(self, worn: WornDepths) -> Array:
        """Return the thickness of the debris at the contact's nodes (n,), or at those of a strip that carries it, mm.

        Zero without, and that of the start where the depths have no states.
        """
        rows = worn.carried if self.strip_carries else worn.between
        return np.asarray(rows[0]) if self.debris.present and len(rows) else np.full(self.nodes, self.debris.initial)

    def facing(self, pair: ContactPair, worn: WornDepths | None) -> Array:
        """Return the thickness of the debris between the surfaces at one place (n,), mm, by default that at the start.

        Values that the strip carries are those opposite each node, for the laws: where it is heaped up, quadratic
        elements fall below nothing beside it.
        """
        if worn is None or (self.strip_carries and not len(worn.carried)):
            return np.full(self.nodes, self.debris.initial)
        lies = self.lies(worn)
        return np.asarray(np.maximum(pair.wear_interpolation @ lies, 0.0)) if self.strip_carries else lies

    def with_thickness(self, worn: WornDepths, thickness: Array) -> WornDepths:
        """Return the depths with debris of another thickness, mm, at the nodes where it lies."""
        rows = (worn.carried if self.strip_carries else worn.between).copy()
        rows[0] = thickness
        return self.with_debris(worn, rows)

    def with_debris(self, worn: WornDepths, rows: Array) -> WornDepths:
        """Return the depths with other rows of states where debris lies, its own the first two of them."""
        return replace(worn, carried=rows) if self.strip_carries else replace(worn, between=rows)

    def known(
        self, pair: ContactPair, worn: WornDepths | None, held: Held | None = None
    ) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Return the states of laws at the contact's nodes, as those of punch and strip know them.

        Args:
            pair: The surfaces opposite each other.
            worn: With the states; by default those at the start.
            held: The states, where they are not those.
        """
        held = held or (self.begun if worn is None else self.held(worn))
        return self.memory.known(held.at_contact(pair))

    def with_held(self, worn: WornDepths, held: Held) -> WornDepths:
        """Return the depths with other states of laws."""
        if not self.memory.names:
            return worn
        first = len(self.rows) - len(held.contact)
        lies = len(self.carried_rows)
        carried = np.concatenate([worn.carried[:lies], held.strip]) if lies else held.strip
        between = np.concatenate([worn.between[:first], held.contact]) if first else held.contact
        return WornDepths(worn.punch, worn.strip, between, worn.crept, carried)

    def flown(self, worn: WornDepths, flowed: Array) -> WornDepths:
        """Return depths where surfaces have flown (n,) more, mm: beyond a hardness alone."""
        if self.hardness == np.inf:
            return worn
        state = worn.between.copy()
        state[self.row(PLASTIC)] += flowed
        return replace(worn, between=state)

    def flown_as(self, worn: WornDepths, other: WornDepths) -> WornDepths:
        """Return depths where surfaces have flown as at others."""
        if self.hardness == np.inf:
            return worn
        row = self.row(PLASTIC)
        return self.flown(worn, other.between[row] - worn.between[row])

    def opening(self, pair: ContactPair, worn: WornDepths) -> Array | float:
        """Return the gap that the layers open at one place (n,), mm."""
        gap = self.opened(worn.between)
        if len(worn.carried) and self._fills[1].any():
            gap = gap - pair.wear_interpolation @ (self._fills[1] @ worn.carried)
        return gap

    def opened(self, state: Array) -> Array | float:
        """Return the gap that a state at the contact's nodes opens (n,), mm."""
        return -(self._fills[0] @ state) if len(state) else 0.0

    def closing(self, pressure: Array, *, capped: bool = False) -> Array:
        """Return the closure by pressures (m, n) in a step of layers that are not linear, mm.

        Where pressures are `capped` at the hardness what flows is left out.
        """
        closure = self.gives.closure(pressure)
        return closure if capped or self.hardness == np.inf else closure + self.flow(pressure)

    def slope(self, pressure: Array, *, capped: bool = False) -> Array:
        """Return the derivative of `closing` (m, n), mm/MPa."""
        derivative = self.gives.slope(pressure)
        return derivative if capped else derivative + np.where(pressure > self.hardness, self.softness, 0.0)

    def flowed(self, pressure: Array, gap: Array) -> Array:
        """Return the plastic flow (n,), mm, of surfaces whose pressures were capped at the hardness."""
        return np.where(pressure >= (1 - CAPPED) * self.hardness, np.maximum(-gap, 0.0), 0.0)

    def flow(self, pressure: Array) -> Array:
        """Return by how much more the surfaces have to flow at pressures (m, n), mm."""
        return self.softness * np.maximum(pressure - self.hardness, 0.0)

    def flowing(self, solve: Callable[[Array], T], pressure_of: Callable[[T], Array]) -> tuple[T, Array]:
        """Return the solution of a contact with no pressure above the hardness, and its plastic flow (n,), mm.

        Args:
            solve: Contact for a depth (n,), mm, that has flown.
            pressure_of: Pressures (m, n) of what it returns.

        Raises:
            ConvergenceError: phases continue to flow in turn.
        """
        flowed = np.zeros(self.nodes)
        solution = solve(flowed)
        for _ in range(MOST_FLOWS):
            pressure = pressure_of(solution)
            if pressure.max() <= (1 + CAPPED) * self.hardness:  # which may be infinite
                return solution, flowed
            flowed = flowed + self.flow(pressure).max(axis=0)
            solution = solve(flowed)
        beyond = float(pressure_of(solution).max()) / self.hardness - 1
        raise ConvergenceError(
            f"Plastic flow did not converge: after {MOST_FLOWS} iterations the largest pressure exceeds "
            f"contact.hardness by {100 * beyond:.2g} %. Increase contact.hardness"
        )

    def bounded(self, worn: WornDepths) -> WornDepths:
        """Return depths with states of laws within their bounds."""
        return self.with_held(worn, self.memory.bounded(self.held(worn)))

    def settled(self, worn: WornDepths) -> WornDepths:
        """Return depths after a step that may have overshot: no thickness below zero, nothing lost, states bounded."""
        depths = self.bounded(worn)
        rows = depths.carried if self.strip_carries else depths.between
        if not self.debris.present or not len(rows) or rows[0].min(initial=0.0) >= 0:
            return depths
        rows = rows.copy()
        rows[1] += np.minimum(rows[0], 0.0)
        rows[0] = np.maximum(rows[0], 0.0)
        return self.with_debris(depths, rows)


def row_of_state(name: str) -> str:
    """Return the name of the row of a state that a law remembers."""
    return f"state {name}"


def layers_of(
    contact: Contact,
    pair: ContactPair,
    modulus: float | Array,
    wear: Sequence[WearLaw] = (NO_WEAR, NO_WEAR),
    temperature: float = 0.0,
    *,
    strip_carries: bool = False,
    alike: Mapping[str, Array] | None = None,
) -> Layers:
    """Return the layers of a pair by the table of the contact, and the states of laws there.

    Args:
        contact: The table.
        pair: The surfaces.
        modulus: E* of the materials at the contact, of all of it or at the nodes (n,), MPa.
        wear: The wear laws of punch and strip.
        temperature: The initial one, K.
        strip_carries: Whether debris lies on the strip's material.
        alike: Variables of laws: the speed v in each phase (m, n), or in all of them (n,), and the initial temperature
            T (n,), which `Layers.under` changes.

    Raises:
        CaseError: a value is not positive somewhere.
    """
    n, debris = len(pair.weights), NO_DEBRIS
    winkler: Array | float = 0.0
    closure: Law | None = None
    x = in_space(pair.punch.x)
    place = {name: np.asarray(x[:, axis]) for axis, name in enumerate("xyz")}
    match contact.layer:
        case LinearLayer(stiffness=stiffness):
            winkler = 1 / place_values(stiffness, place, n, STIFFNESS, "contact.layer.stiffness")
        case PowerLayer() as law:
            reference, pressure = _at_nodes(law, place, n)
            closure = PowerClosure(reference, pressure, law.exponent)
        case ExponentialLayer() as law:
            closure = ExponentialClosure(*_at_nodes(law, place, n))
        case RoughLayer() as law:
            closure = _rough(law, modulus, _at_nodes(law, place, n))
    if closure is not None and contact.lubrication is not None:
        closure = _of_asperities(closure, contact.lubrication, place, alike or {})
    third = contact.third_body
    if third is not None:
        varies = isinstance(third.life, Dependence) and third.life.varies
        life = third.life if varies else place_values(third.life, place, n, "mm", LIFE)
        debris = Debris(third.share, life, third.initial, third.edge_life or np.inf, third.edge_length or 1.0)
    hardness = np.inf if contact.hardness is None else contact.hardness
    of_friction = contact.friction.states if isinstance(contact.friction, Dependence) else {}
    punch, strip = wear[0].states_of("punch"), wear[1].states_of("strip")
    here = {**punch, **{name: state for name, state in of_friction.items() if name not in strip or name in punch}}
    memory = Memory(here, strip, frozenset(punch), temperature)
    begun = memory.beginning(pair)
    on_strip = debris.present and strip_carries
    soft = soft_coatings(pair, (wear[0], wear[1]))
    return Layers(n, closure, winkler, debris, hardness, 0.0, memory, begun, on_strip, soft)


def _at_nodes(law: PowerLayer | ExponentialLayer | RoughLayer, place: Mapping[str, Array], n: int) -> list[Array]:
    """Return the properties of a layer at the nodes (n,) each, in the order of its keys."""
    return [place_values(getattr(law, key), place, n, unit, f"contact.layer.{key}") for key, unit in law.units.items()]


def _of_asperities(
    law: Law, lubrication: Lubrication, place: Mapping[str, Array], known: Mapping[str, Array]
) -> SharedClosure:
    """Return the closure of asperities that carry a share of the pressure (..., n) by it, the speed and the warmth.

    Raises:
        CaseError: it depends on a speed or temperature that changes, which a layer does not follow with stick.
    """
    asked = [name for name in ("v", "T") if depends_on(lubrication.coefficient, name)]
    changing = [name for name in asked if name not in known]
    if changing:
        message = (
            f"contact.lubrication.{lubrication.key} depends on {changing[0]}, which changes from step to step. "
            "With stick, a layer of asperities does not follow it: nodes that stop keep a film for a while, which no "
            "share describes. Remove the layer, or let the share depend on p and the place alone"
        )
        raise CaseError(InputError("contact.layer", message))

    def share(pressure: Array, variables: Mapping[str, Array]) -> Array:
        return asperity_share(lubrication, {**variables, "p": pressure}, pressure.shape, checked=False)

    return SharedClosure(law, share, {**place, **{name: known[name] for name in asked}})


def _rough(law: RoughLayer, modulus: float | Array, values: list[Array]) -> Law:
    young = modulus if law.modulus is None else law.modulus
    roughness, radius, density = values
    height = RMS * roughness
    return RoughClosure(height, 4 / 3 * young * density * np.sqrt(radius) * height**1.5)


def common_modulus(case: Case, regions: Regions, pair: ContactPair) -> float | Array:
    """Return E*, 1/E* = sum of (1 - nu^2)/E at the initial temperature, MPa; (n,) where a body has several materials.

    Args:
        case: With the materials.
        regions: Shares of the regions of punch and strip in their own contact nodes, by their names.
        pair: The surfaces opposite each other.
    """
    return 1 / over_materials(case, regions, pair, lambda material: (1 - material.poisson**2) / float(material.young))


def over_materials(
    case: Case, regions: Regions, pair: ContactPair, value: Callable[[Material], float]
) -> float | Array:
    """Return the sum over both bodies of a value of their materials; at the nodes (n,) where a body has several."""
    materials, total, onto = case.initial_materials, 0.0, (None, pair.wear_interpolation)
    for shares, body, reads in zip(regions, (case.punch, case.strip), onto, strict=True):
        body_materials = body.materials_at(shares)
        if len(body_materials) == 1:
            total = total + value(materials[body_materials.pop()])
            continue
        at = np.sum([share * value(materials[body.regions[name]]) for name, share in shares.items()], axis=0)
        total = total + (at if reads is None else reads @ at)
    return total
