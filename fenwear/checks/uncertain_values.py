"""The numbers of a run's end that get an uncertainty, and whether they lie at an edge."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array
from fenwear.results.history_surfaces import rim, surface_cells
from fenwear.results.quantity import BODIES
from fenwear.steps import Block, SteadyState
from fenwear.system import ContactSetup

SAME = 1e-4  # of the surface's extent: nodes that are one


class Quantity(NamedTuple):
    """The meaning of a number: a quantity of the registry, of a body, of a half-cycle or of the whole contact.

    Attributes:
        name: Of the quantity.
        of: Body, or number of the half-cycle in the cycle; "" for a number of the whole contact.
    """

    name: str
    of: str = ""


@dataclass(frozen=True)
class Value:
    """A number, in mm, mm³, MPa or K, with what it is the largest of.

    Attributes:
        number: Itself.
        at_edge: Whether it is found at an edge of contact or surface.
        x: The nodes that it is the largest of (n, d), mm; none of a number of the whole surface.
        along: The values there (n,).
        weights: Their areas (n,).
    """

    number: float
    at_edge: bool = False
    x: Array = field(default_factory=lambda: np.zeros((0, 1)))
    along: Array = field(default_factory=lambda: np.zeros(0))
    weights: Array = field(default_factory=lambda: np.zeros(0))

    def towards(self, other: Value, share: float) -> Value:
        """Return the value at a share of the way to another one on these nodes."""
        number = self.number + share * (other.number - self.number)
        return replace(self, number=number, along=self.along + share * (other.along - self.along))

    def apart(self, other: Value) -> float:
        """Return how far a number is from another discretisation's: never less than the fields of both are on average.

        The largest of: the difference of the numbers; that at the common node nearest to where the number is found; the
        mean of those at the common nodes where there is anything. Two of them may be small by chance. Of pressures the
        mean falls by the same order as differences inside, 3/2, the mean square by that beside the ends alone.
        """
        difference = abs(self.number - other.number)
        if not len(self.x) or not len(other.x):
            return difference
        distance, nearest = cKDTree(other.x).query(self.x)
        common = distance < SAME * max(float(np.ptp(self.x, axis=0).max()), 1e-300)
        if not common.any():
            return difference
        differences = np.where(common, np.abs(self.along - other.along[nearest]), 0.0)
        far = np.linalg.norm(self.x - self.x[self.along.argmax()], axis=1)
        weights = np.where(common & (self.along > 0), self.weights, 0.0)
        mean = float(weights @ differences / max(float(weights.sum()), 1e-300))
        return max(difference, float(differences[np.where(common, far, np.inf).argmin()]), mean)


Values = dict[Quantity, Value]
Contribution = dict[Quantity, float]  # to the uncertainty of each number, in its unit


def values_of(last: Block) -> Values:
    """Return the numbers at the end of a run: largest depths, volumes, largest pressures of a cycle and temperature."""
    system, numbers = last.system, Values()
    depths, surfaces = (last.wear[-1], last.wear_strip[-1]), (system.pair.punch, system.pair.strip)
    for body, law, depth, surface in zip(BODIES, system.sliding.wear, depths, surfaces, strict=True):
        if law.wears:
            numbers[Quantity("largest_depth", body)] = _largest(depth, surface)
            numbers[Quantity("worn_volume", body)] = Value(float(last.totals.of(f"volume_{body}")[-1]))
    numbers |= _pressures(system, last)
    if last.heat is not None:
        sides: list[Array] = [last.heat.temperature_punch[-1], last.heat.temperature_strip[-1]]
        warmer = max(sides, key=lambda side: float(side.max()))
        numbers[Quantity("largest_temperature")] = _largest(warmer, system.pair.punch)
    return numbers


def values_of_steady(state: SteadyState) -> Values:
    """Return the numbers of a cyclic steady state: the largest pressure of each half-cycle, and the temperature."""
    surface, strokes = state.system.pair.punch, len(state.directions)
    numbers = _of_half_cycles(state.system, np.arange(1, strokes + 1), state.pressure)
    if state.heat is not None:
        sides = [*state.heat.punch, *state.heat.strip]
        numbers[Quantity("largest_temperature")] = _largest(
            np.asarray(max(sides, key=lambda side: float(side.max()))), surface
        )
    return numbers


def _pressures(system: ContactSetup, last: Block) -> Values:
    surface, strokes = system.pair.punch, system.motion.half_cycles
    if last.steps:
        steps: Array = np.concatenate([stroke.pressure for stroke in last.steps[-strokes:]])
        return {Quantity("largest_pressure_in_cycle"): _largest(steps[np.argmax(steps.max(axis=1))], surface)}
    return _of_half_cycles(system, last.half_cycle[-strokes:], last.pressure[-strokes:])


def _of_half_cycles(system: ContactSetup, numbers: NDArray[np.int64], pressure: Array) -> Values:
    """Return the largest and the mean pressure of half-cycles of these numbers (k,), from their pressures (k, n)."""
    values, surface, weights = Values(), system.pair.punch, system.pair.weights
    for number, row in zip(numbers, np.asarray(pressure), strict=True):
        of, area = str(int(number) % system.motion.half_cycles), float(weights @ (row > 0))
        values[Quantity("largest_pressure", of)] = _largest(np.asarray(row), surface)
        values[Quantity("mean_pressure", of)] = Value(float(weights @ row) / (area or 1.0))
    return values


def _largest(values: Array, surface: ContactSurface) -> Value:
    """Return the largest of values at the nodes of a surface (n,), at an edge where one beside it has none."""
    node = int(values.argmax())
    cells = surface_cells(surface)
    near = np.unique(cells[(cells == node).any(axis=1)])
    at_edge = bool(rim(surface)[node] or (values[near] <= 0).any())
    return Value(float(values[node]), at_edge, surface.x, values, surface.weights)
