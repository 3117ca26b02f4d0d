"""Members that creep, bodies and a layer between them: their elastic displacements and openings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.creep_law import Retardation
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array
from fenwear.surfaces import Interface

BODIES, LAYER = ("punch", "strip"), "layer"


class Member(Protocol):
    """A body or a layer that creeps.

    Attributes:
        name: "punch", "strip" or "layer".
        key: Of its creep in a case.
        retardation: Creep law of the member.
        size: Of its displacement.
    """

    @property
    def retardation(self) -> Retardation:
        """The creep law of the member."""

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

    def from_other(self, other: Member, states: Array, nodes: NDArray[np.int64]) -> Array:
        """Return states (terms, size) from states of the member on another contact grid.

        Args:
            other: The member on the other grid.
            states: States on the other grid (terms, size of other).
            nodes: The contact node there of each one here (n,), -1 for none.
        """


@dataclass(frozen=True)
class CreepingBody:
    """A body that creeps.

    Attributes:
        which: 0 the punch, 1 the strip.
        retardation: Creep law of the body.
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
        displacements = []
        for phase in range(len(self.faces)):
            operator = self._operator(phase)
            displacements.append(np.einsum("qd,qda->qa", operator.by_load - self.moved, operator.directions).ravel())
        return displacements

    def displacement(self, phase: int, pressure: Array, ratio: Array, load: float) -> Array:
        """Return v (size,), mm."""
        face = self.faces[phase]
        if face.in_memory:
            displacement = self.matrix(phase, ratio) @ pressure
        else:
            traction = (face.pair.normal + ratio) * (face.pair.weights * pressure)[:, None]
            displacement = self._answer(face, traction)
        return np.asarray(displacement + load * self._by_load(phase))

    def matrix(self, phase: int, ratio: Array) -> Array:
        """Return v by unit pressures with their friction (size, n), mm/MPa."""
        known = self._known.get(phase)
        if known is None or known[0] is not ratio:
            face = self.faces[phase]
            forces = (face.pair.normal + ratio) * face.pair.weights[:, None]
            each = np.einsum("id,ij->idj", forces, np.eye(len(forces)))
            known = self._known[phase] = (ratio, self._answer(face, each))
        return known[1]

    def _answer(self, face: Interface, forces: Array) -> Array:
        """Return v (size, ...) by forces on the punch (n, d, ...)."""
        return face.displaced(forces)[self.which].reshape(self.size, *forces.shape[2:])

    def _by_load(self, phase: int) -> Array:
        """Return v (size,) by the loads of a phase."""
        return self._loaded[phase]

    def opened(self, phase: int, values: Array) -> Array:
        """Return the gap (n, ...) that displacements open in a phase."""
        displacements = values.reshape(*self._shape, *values.shape[1:])
        face = self.faces[phase]
        parts = [np.zeros((*body.directions.shape[::2], *values.shape[1:])) for body in both(face)]
        parts[self.which] = displacements
        return face.opened(*parts)[:, 0]

    def from_other(self, _other: Member, states: Array, _nodes: NDArray[np.int64]) -> Array:
        """Return states (terms, size) as they are: its grid stays."""
        return states


@dataclass(frozen=True)
class CreepingForces(CreepingBody):
    """A body that creeps below a grid that grows: its state are the forces f behind it, and what loads displace.

    Displacements of places that the grid comes to later were not followed. But v = G f + u, and G does not change: as v
    is retarded, f and u are, and y is G f + u of theirs. On another grid forces keep their sum and moment.
    """

    @property
    def _forces(self) -> tuple[int, int]:
        q, d, _ = self._operator(0).directions.shape
        return q, d

    @property
    def size(self) -> int:
        """Of forces, and of what loads displace."""
        return int(np.prod(self._forces)) + super().size

    def _by_load(self, phase: int) -> Array:
        return np.concatenate([np.zeros(int(np.prod(self._forces))), self._loaded[phase]])

    def _answer(self, face: Interface, forces: Array) -> Array:
        rest = forces.shape[2:]
        pushed = face.pushed(forces)[self.which].reshape(-1, *rest)
        return np.concatenate([pushed, np.zeros((super().size, *rest))])

    def opened(self, phase: int, values: Array) -> Array:
        """Return the gap (n, ...) that forces and loads open in a phase."""
        forces, by_loads = np.split(values, [-super().size])
        displaced = self._operator(phase).apply(forces.reshape(*self._forces, *values.shape[1:]))
        return super().opened(phase, displaced.reshape(by_loads.shape) + by_loads)

    @property
    def _grid(self) -> RegularGrid:
        face = self.faces[0]
        grid = (face.pair.strip if self.which and face.strip_moves else face.pair.punch).grid
        assert grid is not None
        return grid

    def from_other(self, other: Member, states: Array, _nodes: NDArray[np.int64]) -> Array:
        """Return states (terms, size) from states on another grid; the parts of loads follow the loads here."""
        assert isinstance(other, CreepingForces)
        forces, by_loads = np.split(states, [-len(other._loaded[0])], axis=1)
        shares, (q, d) = self._grid.sharing(other._grid), other._forces
        here = [(shares @ force.reshape(q, d)).ravel() for force in forces]
        there, loads = (np.stack(member._loaded, axis=1) for member in (other, self))
        factors = np.linalg.lstsq(there, by_loads.T, rcond=None)[0]
        return np.concatenate([np.array(here), (loads @ factors).T], axis=1)


@dataclass(frozen=True)
class CreepingLayer:
    """A linear layer that creeps.

    Attributes:
        retardation: Creep law of the layer.
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
        """Return the gap that unit pressures open (n, n), mm/MPa."""
        return np.diag(self.closure)

    def opened(self, _phase: int, values: Array) -> Array:
        """Return the gap that closures open: as much."""
        return values

    def from_other(self, _other: Member, states: Array, nodes: NDArray[np.int64]) -> Array:
        """Return closures (terms, n) where they were, elsewhere none."""
        return np.where(nodes >= 0, states[:, np.maximum(nodes, 0)], 0.0)


def both(face: Interface) -> tuple[SurfaceOperator, SurfaceOperator]:
    """Return the operators of punch and strip."""
    return face.punch, face.strip
