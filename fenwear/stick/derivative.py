"""How what a cycle with stick wears, and what lies between, follow the depths and states that it begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, hstack, vstack

from fenwear.arrays import Array, Mask
from fenwear.interface.placement import Placement
from fenwear.layers import Evolution, Layers
from fenwear.layers.between import DEBRIS
from fenwear.layers.debris import DebrisCycle
from fenwear.layers.memory import Held
from fenwear.layers.step import NUDGE
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.grid_jump import Answering
from fenwear.stick.position import Position
from fenwear.stick.records import FrettingCycle
from fenwear.stick.state import PartialSlipState


def derivative(problem: PartialSlipProblem, now: FrettingCycle) -> tuple[list[Answering], csr_array]:
    """Return A, the derivative of a cycle's wear to depths and what lies between, at the contact zone and slip of now.

    Square, of the depths (n + n_s), the state of what lies between (rows n) and of the strip's material (rows n_s): of
    the time steps in one place with the same nodes closed, on grids with any closed, the part by their pressures; and
    what states do to themselves.
    """
    records, steps, interface = now.records, problem.program.steps, problem.interface
    groups = dict[tuple[float | Placement, bytes], list[int]]()
    answering = np.array([_answering(interface.layers, pressure) for pressure in records.pressure])
    for k in range(len(records)):
        place = steps[(now.first_step + k) % len(steps)].offset if interface.moves else 0.0
        gridded = interface.position(place).compliance.on_grid is not None
        groups.setdefault((place, b"" if gridded else answering[k].tobytes()), []).append(k)
    cycle = _Cycle.of(problem, now)
    found = [cycle.answering(interface.position(place), own, answering) for (place, _), own in groups.items()]
    return found, cycle.itself()


@dataclass(frozen=True)
class _Cycle:
    """A cycle whose wear is differentiated.

    Attributes:
        problem: The bodies and what is done to them.
        now: The cycle.
        debris: What it does to debris; None without.
        stored, ejected: Where thickness and ejected depth of debris begin among all unknowns; 0 without.
        remembered: The states of laws; None without.
        depths, total: Number of the depths, and of all unknowns.
    """

    problem: PartialSlipProblem
    now: FrettingCycle
    debris: DebrisCycle | None
    stored: int
    ejected: int
    remembered: Remembered | None
    depths: int
    total: int

    @classmethod
    def of(cls, problem: PartialSlipProblem, now: FrettingCycle) -> _Cycle:
        """Return it with what its debris and the states of laws do."""
        worn, layers = now.worn, problem.interface.layers
        depths = len(worn.punch) + len(worn.strip)
        debris = None if layers.debris is None else problem.losses.debris_over(now.records, _begun(now))
        stored, ejected = rows_of_debris(layers, len(worn.punch), len(worn.strip))
        total = depths + worn.between.size + worn.carried.size
        return cls(problem, now, debris, stored, ejected, Remembered.of(problem, now, depths), depths, total)

    def answering(self, position: Position, members: list[int], answering: Mask) -> Answering:
        """Return what pressures of some time steps add to the cycle's wear, and what opens the gap there.

        Args:
            position: The place of the strip in all of them.
            members: Which of them.
            answering: Nodes whose pressures answer in each step of the cycle (k, n).
        """
        layers, records = self.problem.interface.layers, self.now.records
        closed = np.flatnonzero(answering[members].any(axis=0))
        slopes = _wear_slopes(self.problem, self.now, members, answering)
        added, filled = self._worn(position, slopes, closed), list[tuple[int, float]]()
        if layers.debris_here is not None:
            filled.append((self.stored, 1.0))
        if self.debris is not None:
            added += self._laid(position, slopes, members, closed)
        for rows, fills_gap, rate in [] if self.remembered is None else self.remembered.filling(members):
            added.append(self._here(rows.start, rate, closed))
            filled.append((rows.start, fills_gap))
        share = float(records.duration[members].sum() / records.duration.sum())
        pressure, closure = records.pressure[members].mean(axis=0), layers.closure_at(position.pair, self.now.worn)
        left = csr_array(sum(added[1:], added[0]))
        return Answering(position, closed, pressure, left, self._opening(position, closed, filled), share, closure)

    def _here(self, first: int, rate: Array, closed: NDArray[np.int64]) -> csr_array:
        """Return what pressures add at their own nodes (total, k), of unknowns of the contact from one on."""
        entries = rate[closed], (first + closed, np.arange(len(closed)))
        return csr_array(entries, shape=(self.total, len(closed)))

    def _worn(self, position: Position, slopes: Array, closed: NDArray[np.int64]) -> list[csr_array]:
        """Return what pressures wear off both bodies (total, k) each, as jumps count depths, by slopes of the steps."""
        by_punch, by_strip = self.problem.coatings.layers_of_wear(self.now.worn)[1]
        n, of_steps, count = len(self.now.worn.punch), slopes.sum(axis=2), len(closed)
        onto = csr_array(position.pair.wear_projection)[:, closed]
        of_coating, of_base = (
            diags_array(own) @ onto @ diags_array(slope[closed])
            for own, slope in zip(by_strip, of_steps[1], strict=True)
        )
        strip = vstack([csr_array((n, count)), of_coating + of_base, csr_array((self.total - self.depths, count))])
        punch = of_steps[0, 0] * by_punch[0] + of_steps[0, 1] * by_punch[1]
        return [self._here(0, punch, closed), csr_array(strip)]

    def _laid(
        self, position: Position, slopes: Array, members: list[int], closed: NDArray[np.int64]
    ) -> list[csr_array]:
        """Return what becomes debris of what pressures wear, and what is ejected of it (total, k) each."""
        assert self.debris is not None
        pair, (of_punch, of_strip) = position.pair, self.problem.coatings.layers_of_wear(self.now.worn)[0]
        there = np.array([of_punch, [pair.wear_interpolation @ part for part in of_strip]])
        lost, fed = np.einsum("blkn,bln->kn", slopes, there), self.debris.fed[members]
        if self.problem.interface.layers.strip_carries:
            entries = csr_array(pair.wear_projection)[:, closed].tocoo()
            node, column = entries.coords
            worn = lost[:, closed][:, column]
            kept = entries.data * np.einsum("ke,ke->e", fed[:, node], worn)
            pairs = ((self.stored, kept), (self.ejected, entries.data * worn.sum(axis=0) - kept))
            shape = (self.total, len(closed))
            return [csr_array((values, (first + node, column)), shape=shape) for first, values in pairs]
        kept = np.einsum("kn,kn->n", fed, lost)
        return [self._here(self.stored, kept, closed), self._here(self.ejected, lost.sum(axis=0) - kept, closed)]

    def _opening(self, position: Position, closed: NDArray[np.int64], filled: Sequence[tuple[int, float]]) -> csr_array:
        """Return the gap that all unknowns open at the closed nodes (k, total).

        Args:
            position: The place of the strip.
            closed: The nodes.
            filled: Where unknowns of the contact begin that fill the gap, and by how much.
        """
        of_punch, of_strip = self.problem.coatings.slopes(self.now.worn)
        n, count, every = len(of_punch), len(closed), np.arange(len(closed))
        reads = csr_array(position.pair.wear_interpolation)[closed]
        own = csr_array((of_punch[closed], (every, closed)), shape=(count, n))
        blocks = [own, reads @ diags_array(of_strip), csr_array((count, self.total - self.depths))]
        found = csr_array(hstack(blocks))
        for first, size in filled:
            found = found - csr_array((np.full(count, size), (every, first + closed)), shape=(count, self.total))
        if self.problem.interface.layers.strip_carries:
            rest = self.total - self.stored - reads.shape[1]
            found = found - hstack([csr_array((count, self.stored)), reads, csr_array((count, rest))])
        return csr_array(found)

    def itself(self) -> csr_array:
        """Return what states do to themselves (total, total)."""
        found = csr_array((self.total, self.total))
        if self.debris is not None:
            lost, at = self.debris.loss, np.arange(len(self.debris.loss))
            for row, rate in ((self.stored, -lost), (self.ejected, lost)):
                found = found + csr_array((rate, (row + at, self.stored + at)), shape=found.shape)
        return csr_array(found if self.remembered is None else found + self.remembered.slopes(self.total))


def rows_of_debris(layers: Layers, nodes: int, on_strip: int) -> tuple[int, int]:
    """Return where thickness and ejected depth of debris begin among all unknowns of a jump; 0 without.

    Args:
        layers: What lies between.
        nodes, on_strip: How many nodes contact and strip have.
    """
    if layers.debris is None:
        return 0, 0
    depths = nodes + on_strip
    if layers.strip_carries:
        first = depths + nodes * len(layers.rows)
        return first, first + on_strip
    first, second = (depths + nodes * layers.row(name) for name in DEBRIS)
    return first, second


def _wear_slopes(problem: PartialSlipProblem, now: FrettingCycle, members: list[int], answering: Mask) -> Array:
    """Return how what time steps wear follows their pressures (2, 2, m, n), of both bodies, of coating and base each.

    Args:
        problem: The bodies and what is done to them.
        now: The cycle of the steps.
        members: Which of them.
        answering: Nodes whose pressures answer in each step of the cycle (k, n).
    """
    records, found = now.records, np.zeros((2, 2, len(members), answering.shape[1]))
    for body, laws in enumerate(problem.wear.layers):
        for layer, law in enumerate(laws):
            if law is None:
                continue
            for row, k in enumerate(members):
                slope = law.slope(records.pressure[k], records.slip_magnitude[k], float(records.duration[k]))
                found[body, layer, row] = slope * answering[k]
    return found


def _begun(now: FrettingCycle) -> PartialSlipState:
    """Return the state that the records of a cycle begin at, as far as laws ask for it."""
    return replace(now.end, worn=now.worn, held=None, next_step=now.first_step)


def _answering(layers: Layers, pressure: Array) -> Mask:
    """Return the nodes whose pressure falls by a depth: they touch, and do not flow, but where all do."""
    found = (pressure > 0) & (pressure < layers.hardness)
    return found if found.any() else pressure > 0


@dataclass(frozen=True)
class Remembered:
    """The states that laws remember among all unknowns of a jump.

    Attributes:
        rows: Where each is, those of the contact first.
        areas: Of the nodes of each.
        evolution: What a cycle does to them.
        held: Where it begins.
        fills: Gap that a unit of each fills, mm.
    """

    rows: tuple[slice, ...]
    areas: tuple[Array, ...]
    evolution: Evolution
    held: Held
    fills: tuple[float, ...]

    @classmethod
    def of(cls, problem: PartialSlipProblem, now: FrettingCycle, depths: int) -> Remembered | None:
        """Return those of a cycle, behind so many depths; None without."""
        layers, pair, memory = problem.interface.layers, problem.interface.middle.pair, problem.interface.layers.memory
        evolution = problem.losses.evolution(now.records, _begun(now))
        if evolution is None:
            return None
        n, n_strip = len(pair.weights), len(pair.strip.weights)
        between = depths + now.worn.between.size
        firsts = [between - n * (len(memory.contact) - k) for k in range(len(memory.contact))]
        firsts += [between + n_strip * (len(layers.carried_rows) + k) for k in range(len(memory.strip))]
        weights = [*(pair.weights for _ in memory.contact), *(pair.strip.weights for _ in memory.strip)]
        rows = tuple(slice(first, first + len(own)) for first, own in zip(firsts, weights, strict=True))
        fills = tuple(state.fills for state in memory.states)
        return cls(rows, tuple(weights), evolution, layers.held(now.worn), fills)

    def error(self, missing: Array, begin: Array, end: Array) -> float:
        """Return the largest error of a state over its size, both integrated."""
        size = np.maximum(np.abs(end), np.abs(begin))
        pairs = zip(self.rows, self.areas, strict=True)
        return max(float(own @ np.abs(missing[row])) / max(float(own @ size[row]), 1e-300) for row, own in pairs)

    def filling(self, steps: Sequence[int]) -> list[tuple[slice, float, Array]]:
        """Return of states that fill the gap where they are, by how much, and how their rates follow the pressure (n,).

        Args:
            steps: Whose pressures change.
        """
        if not any(self.fills):
            return []
        pressure = np.array([one.pressure for one in self.evolution.conditions])
        size, more = NUDGE * max(float(pressure.max()), 1e-300), pressure.copy()
        more[list(steps)] += size
        change = (self.evolution.at(more).rate(self.held)[0] - self.evolution.rate(self.held)[0]).times(1 / size)
        contact = zip(self.rows, self.fills, change.contact, strict=False)
        return [(row, fills, np.asarray(rate)) for row, fills, rate in contact if fills]

    def slopes(self, total: int) -> csr_array:
        """Return how the rates follow the states themselves, among all unknowns (total, total)."""
        found, slopes = csr_array((total, total)), self.evolution.rate(self.held)[1]
        q = slopes.contact.shape[1]
        for own, part in ((self.rows[:q], slopes.contact), (self.rows[q:], slopes.strip)):
            at = np.arange(part.shape[0])
            for i, one in enumerate(own):
                for j, other in enumerate(own):
                    entries = part[:, i, j], (one.start + at, other.start + at)
                    found = found + csr_array(entries, shape=(total, total))
        return csr_array(found)


def stiffness(group: Answering) -> Array:
    """Return how the pressures of closed nodes fall by a depth at each, under a constant load (k, k), MPa/mm."""
    position, closed = group.position, group.closed
    k, r = len(closed), position.modes.shape[1]
    n = len(position.pair.weights)
    unit = float(np.median(position.compliance.diagonal()[:n]))
    system = np.zeros((k + r, k + r))
    system[:k, :k] = position.compliance.entries(closed, closed) / unit
    closure = group.closure
    if closure is not None:
        system[np.arange(k), np.arange(k)] += closure.slope(group.pressure)[closed] / unit
    system[:k, k:] = position.modes[closed]
    system[k:, :k] = position.balance[:, closed]
    right = np.eye(k + r)[:, :k]
    return np.asarray(scipy.linalg.solve(system, right)[:k] / unit)
