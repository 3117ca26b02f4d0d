"""Both bodies with stick, condensed along all axes, and the places of the strip under the punch."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fenwear.bodies.antiplane import turning
from fenwear.bodies.creep_law import Retardation
from fenwear.bodies.response import Request, identity
from fenwear.bodies.surface_operators import SurfaceOperator, operators_for
from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.common.parallel import Team
from fenwear.laws import common_modulus, layers_of
from fenwear.steps.stick_creep import StickCreep, stiff
from fenwear.steps.stick_position import LoadEffect, Position, along_tangents, position_of, surface_gradient
from fenwear.steps.stick_program import steps_of
from fenwear.steps.stick_state import StickState
from fenwear.surfaces import (
    ContactPair,
    check_distance,
    pair,
    rigid_equilibrium,
)
from fenwear.surfaces.placement import HERE, Placement, in_model
from fenwear.surfaces.track import Border
from fenwear.system import Bodies, Resources, Sliding, setup_resources


class StickInterface:
    """Two meshed bodies condensed along all axes, and the places of the strip under the punch.

    Args:
        bodies: Both, under the mean of their loads.
        sliding: Motion of the strip, friction and wear.
        case: The problem: it gives the loads of each time.
        moves: Whether the strip's surface passes under the punch, which slides along it; otherwise the surfaces stay
            opposite each other, as for slip that is small against the contact, and have a common frame.
        far: Whether the strip goes so far that its own place says what gap there is, not what it is moved by.
        keep: Whether the condensed bodies are kept on disk, and taken from there where they are.
        fresh: Condense them whatever is kept.
        condensed: Both bodies, where they are condensed already.

    Raises:
        CaseError: there is not memory enough.
    """

    def __init__(
        self,
        bodies: Bodies,
        sliding: Sliding,
        case: Case,
        *,
        moves: bool = False,
        far: bool = False,
        keep: bool = False,
        fresh: bool = False,
        condensed: tuple[SurfaceOperator, SurfaceOperator] | None = None,
    ) -> None:
        self.moved = bodies.moved
        self.bodies, self.sliding, self.case, self.moves, self.far = bodies, sliding, case, moves, moves or far
        self.team = Team.of(bodies.comm)
        self.team.serve(self)
        self.keep, self.fresh = keep, fresh
        self.field = sliding.field
        rings = bodies.punch.law.kind == "axisymmetric"
        self.dim = 3 if rings else bodies.punch.dim
        middle = pair(bodies.punch.surface, bodies.strip.surface, axisymmetric=rings, halfway=not moves)
        places = {sliding.placement(phase) for phase in sliding.motion.phases} - {HERE} if moves else set()
        self.whole_strip = middle.strip
        self.border = Border.of_swept([middle, *(pair(middle.punch, middle.strip, there) for there in places)])
        middle = self.border.on(middle, self.border.on_strip(middle.strip))
        modulus = common_modulus(case, bodies.regions, middle)
        initial = case.initial_temperature
        carries = moves and case.debris_on_strip  # else surfaces stay opposite each other: it lies where it is
        self.layers = layers_of(case.contact, middle, modulus, sliding.wear, initial, strip_carries=carries)
        if bodies.followed is None:
            check_distance(middle)
        onto = identity(len(middle.strip.trace)) if moves else csr_array(middle.transfer.T)
        self.patterns = middle.punch.spread, onto
        self.needs = self._needs(len(middle.weights), onto.shape[1])
        if condensed is None:
            self.needs.check()
            wanted = [Request(bodies.punch, middle.punch.spread), Request(bodies.strip, onto)]
            operators = operators_for(wanted, keep=keep, fresh=fresh)
            if rings:
                operators = [turning(*body) for body in zip(wanted, operators, strict=True)]
            self.punch, self.strip = operators
        else:
            self.punch, self.strip = condensed
        self.creep = self._creep()
        self._positions: dict[float | Placement, Position] = {0.0: self._position(middle)}
        self._loaded: dict[float | None, LoadEffect] = {}

    @cached_property
    def gradient(self) -> list[csr_array]:
        """Derivatives along the surface of values at the nodes, see `surface_gradient`."""
        return surface_gradient(self.middle.pair.punch)

    @property
    def middle(self) -> Position:
        """The middle position of the strip."""
        return self._positions[0.0]

    def _needs(self, nodes: int, on_strip: int) -> Resources:
        """Return the resources for condensed bodies, C of each position and Newton's matrix; collective.

        Args:
            nodes: Of the contact.
            on_strip: Unknowns that the strip is condensed onto.
        """
        d, both = self.dim, self.bodies
        positions = 1 + (steps_of(self.case) if self.moves else 0)
        asked = (nodes, d * nodes), (on_strip, d * on_strip)
        return setup_resources(both, nodes, asked, positions * d**2 + 2 * d**2 + 1)

    def _creep(self) -> StickCreep:
        """Return the creep of bodies and layer; collective."""
        bodies, operators = (self.bodies.punch, self.bodies.strip), (self.punch, self.strip)
        layer = getattr(self.case.contact.layer, "creep", None)
        punch, strip, between = (Retardation.of(table) for table in (bodies[0].creep, bodies[1].creep, layer))
        creep = replace(stiff(*operators), laws=(punch, strip, between))
        if not creep.creeps:
            return creep
        moved = [
            operator.under(body.with_loads(())).by_load if body.moved else np.zeros_like(operator.by_load)
            for operator, body in zip(operators, bodies, strict=True)
        ]
        closure = creep.closure + self.layers.winkler
        behind = None if bodies[0].reach is None else operators
        return replace(creep, moved=(moved[0], moved[1]), closure=closure, behind=behind)

    @cached_property
    def bulk(self) -> Array:
        """Displacement of the strip at the nodes of its operator by a unit bulk strain along x (q, d), mm.

        A solid under stress along x alone gets narrower along y.
        """
        pair = self.middle.pair
        x = in_model(pair.strip.trace if self.moves else pair.transfer @ pair.strip.trace, self.dim)
        displacements = np.zeros_like(x)
        displacements[:, 0] = x[:, 0]
        if self.dim == 3:
            names = set(self.case.strip.regions.values())
            displacements[:, 1] = -x[:, 1] * (self.case.materials[names.pop()].poisson if len(names) == 1 else 0.0)
        return displacements

    def position(self, offset: float | Placement) -> Position:
        """Return the place of the strip moved by this amount of its motion; collective, or for rank 0 that leads."""
        if not self.moves or offset == HERE:
            offset = 0.0
        elif not isinstance(offset, Placement):
            offset = round(offset, 12)
        if offset not in self._positions:
            self.team.each(self, "prepare_position", offset)
        return self._positions[offset]

    def prepare_position(self, offset: float | Placement) -> None:
        """Make a new place of the strip; collective."""
        middle = self.middle.pair
        there = pair(middle.punch, self.whole_strip, self.placement(offset))
        self._positions[offset] = self._position(self.border.on(there, middle.strip))

    def placement(self, offset: float | Placement) -> Placement:
        """Return the place of the strip moved by this amount of its motion, or there by a table."""
        return offset if isinstance(offset, Placement) else self.field.placement(offset)

    def loaded(self, fraction: float | None) -> LoadEffect:
        """Return the loads' effect at a fraction of the cycle, or its mean; collective, or for rank 0 that leads."""
        loads = [load for body in ("punch", "strip") for load in self.case.loads_of(body)]
        constant = fraction is None or all(load.steady for load in loads)
        key = None if constant or fraction is None else round(fraction, 12)
        if key not in self._loaded:
            self.team.each(self, "prepare_load", key)
        return self._loaded[key]

    def prepare_load(self, fraction: float | None) -> None:
        """Find what the loads do at a fraction of the cycle, or their mean; collective."""
        bodies = self.bodies if fraction is None else self.bodies.under(self.case, fraction)
        resultant = np.concatenate([bodies.punch.rigid_resultant, bodies.strip.rigid_resultant])
        punch, strip = self.punch.under(bodies.punch).by_load, self.strip.under(bodies.strip).by_load
        forced_punch, forced_strip = punch - self.creep.moved[0], strip - self.creep.moved[1]
        self._loaded[fraction] = LoadEffect(resultant, punch, strip, forced_punch, forced_strip)

    def _position(self, pair: ContactPair) -> Position:
        rigid = rigid_equilibrium(pair, self.bodies.punch, self.bodies.strip)
        position = position_of(
            rigid, self.punch, self.strip, self.field, strip_moves=self.moves, layer=self.layers.winkler
        )
        return along_tangents(position) if self.far else position


def untouched(interface: StickInterface) -> StickState:
    """Return the unloaded bodies before they touch."""
    n, d, _ = interface.middle.frame.shape
    none = np.zeros((n, d - 1))
    return StickState(
        np.zeros(n),
        none,
        np.zeros(n),
        none,
        np.zeros(n),
        np.zeros(interface.middle.modes.shape[1]),
        0.0,
        0.0,
        np.zeros((n, d)),
        np.zeros(interface.strip.by_load.shape),
        none,
        crept=interface.creep.beginning(),
        elastic=interface.creep.unloaded(),
        flowed=np.zeros(n),
    )
