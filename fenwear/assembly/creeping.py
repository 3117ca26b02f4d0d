"""Who creeps: bodies, and a layer between them; their elastic displacements and what these open."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from fenwear.arrays import Array
from fenwear.bodies.creep import Retardation
from fenwear.bodies.operators import SurfaceOperator
from fenwear.interface import Interface

BODIES, LAYER = ("punch", "strip"), "layer"


class Member(Protocol):
    """A body or a layer that creeps.

    Attributes:
        name: "punch", "strip" or "layer".
        key: Of its creep in a case.
        retardation: Its law.
        size: Of its displacement.
    """

    @property
    def retardation(self) -> Retardation:
        """Its law."""

    @property
    def name(self) -> str:
        """Which it is."""

    @property
    def key(self) -> str:
        """Of its creep in a case."""

    @property
    def size(self) -> int:
        """Of its displacement."""

    def displacement(self, phase: int, pressure: Array, ratio: Array, load: float) -> Array:
        """Return v (size,), mm, at pressures (n,) with their friction tau (n, d) and loads times a factor."""

    def matrix(self, phase: int, ratio: Array) -> Array:
        """Return v by unit pressures with their friction (size, n), mm/MPa."""

    def opened(self, phase: int, values: Array) -> Array:
        """Return the gap (n, ...) that displacements (size, ...) open in a phase."""


@dataclass(frozen=True)
class CreepingBody:
    """A body that creeps.

    Attributes:
        which: 0 the punch, 1 the strip.
        retardation: Its law.
        faces: The surfaces in each phase, with what the strip's material answers.
        moved: Displacement by moved supports alone (q, d), mm.
    """

    which: int
    retardation: Retardation
    faces: tuple[Interface, ...]
    moved: Array

    @property
    def name(self) -> str:
        """The body."""
        return BODIES[self.which]

    @property
    def key(self) -> str:
        """Of its creep in a case."""
        return f"{self.name}.creep"

    @property
    def _shape(self) -> tuple[int, int]:
        q, _, a = self._operator(0).directions.shape
        return q, a

    def _operator(self, phase: int) -> SurfaceOperator:
        return both(self.faces[phase])[self.which]

    @property
    def size(self) -> int:
        """Of its displacement."""
        q, a = self._shape
        return q * a

    @cached_property
    def _known(self) -> dict[int, tuple[Array, Array]]:
        return {}

    @cached_property
    def _loaded(self) -> list[Array]:
        """Displacement by the loads of each phase (size,), mm."""
        found = []
        for phase in range(len(self.faces)):
            operator = self._operator(phase)
            found.append(np.einsum("qd,qda->qa", operator.by_load - self.moved, operator.directions).ravel())
        return found

    def displacement(self, phase: int, pressure: Array, ratio: Array, load: float) -> Array:
        """Return v (size,), mm."""
        face = self.faces[phase]
        if face.cost is None:
            found = self.matrix(phase, ratio) @ pressure
        else:
            traction = (face.pair.normal + ratio) * (face.pair.weights * pressure)[:, None]
            found = face.displaced(traction)[self.which].ravel()
        return np.asarray(found + load * self._loaded[phase])

    def matrix(self, phase: int, ratio: Array) -> Array:
        """Return v by unit pressures with their friction (size, n), mm/MPa."""
        known = self._known.get(phase)
        if known is None or known[0] is not ratio:
            face = self.faces[phase]
            forces = (face.pair.normal + ratio) * face.pair.weights[:, None]
            each = np.einsum("id,ij->idj", forces, np.eye(len(forces)))
            known = self._known[phase] = (ratio, face.displaced(each)[self.which].reshape(self.size, -1))
        return known[1]

    def opened(self, phase: int, values: Array) -> Array:
        """Return the gap (n, ...) that displacements open in a phase."""
        own = values.reshape(*self._shape, *values.shape[1:])
        face = self.faces[phase]
        parts = [np.zeros((*body.directions.shape[::2], *values.shape[1:])) for body in both(face)]
        parts[self.which] = own
        return face.opened(*parts)[:, 0]


@dataclass(frozen=True)
class CreepingLayer:
    """A linear layer that creeps.

    Attributes:
        retardation: Its law.
        closure: By unit pressures at once (n,), mm/MPa.
    """

    retardation: Retardation
    closure: Array
    name: str = LAYER
    key: str = f"contact.{LAYER}.creep"

    @property
    def size(self) -> int:
        """Of its closure."""
        return len(self.closure)

    def displacement(self, _phase: int, pressure: Array, _ratio: Array, _load: float) -> Array:
        """Return its closure at once (n,), mm."""
        return self.closure * pressure

    def matrix(self, _phase: int, _ratio: Array) -> Array:
        """Return it by unit pressures (n, n), mm/MPa."""
        return np.diag(self.closure)

    def opened(self, _phase: int, values: Array) -> Array:
        """Return the gap that closures open: as much."""
        return values


def both(face: Interface) -> tuple[SurfaceOperator, SurfaceOperator]:
    """Return the operators of punch and strip."""
    return face.punch, face.strip
