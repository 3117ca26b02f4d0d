"""How what a cycle with stick wears, and what lies between, follow the depths and states that it begins with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array, diags_array, hstack, vstack

from fenwear.arrays import Array, Mask
from fenwear.interface.placement import Placement
from fenwear.layers import Evolution, Layers
from fenwear.layers.between import DEBRIS
from fenwear.layers.memory import Held
from fenwear.layers.step import NUDGE
from fenwear.stick.cycle import PartialSlipProblem
from fenwear.stick.grid_jump import Answering
from fenwear.stick.records import FrettingCycle
from fenwear.stick.state import PartialSlipState


def derivative(problem: PartialSlipProblem, now: FrettingCycle) -> tuple[list[Answering], csr_array]:
    """Return A, the derivative of a cycle's wear to depths and what lies between, at the contact zone and slip of now.

    Square, of the depths (n + n_s), the state of what lies between (rows n) and of the strip's material (rows n_s): of
    the time steps in one place with the same nodes closed, on grids with any closed, the part by their pressures; and
    what states do to themselves.
    """
    records, steps, n = now.records, problem.program.steps, len(now.worn.punch)
    depths, layers = n + len(now.worn.strip), problem.interface.layers
    debris, total = layers.debris, depths + now.worn.between.size + now.worn.carried.size
    remembered = Remembered.of(problem, now, depths)
    of_punch, of_strip = problem.coatings.slopes(now.worn)
    parts, measured = problem.coatings.layers_of_wear(now.worn)
    stored, ejected = (0, 0) if debris is None else (depths + n * layers.row(name) for name in DEBRIS)
    groups = dict[tuple[float | Placement, bytes], list[int]]()
    over = None if debris is None else problem.losses.debris_over(records, _begun(now))
    fed, found = None if over is None else over.fed, list[Answering]()
    answering = np.array([_answering(layers, pressure) for pressure in records.pressure])
    for k in range(len(records)):
        place = steps[(now.first_step + k) % len(steps)].offset if problem.interface.moves else 0.0
        gridded = problem.interface.position(place).compliance.on_grid is not None
        groups.setdefault((place, b"" if gridded else answering[k].tobytes()), []).append(k)
    for (place, _), members in groups.items():
        position = problem.interface.position(place)
        closed = np.flatnonzero(answering[members].any(axis=0))
        slopes = _wear_slopes(problem, now, members, answering)
        of_steps, (by_punch, by_strip) = slopes.sum(axis=2), measured
        left = [(closed, of_steps[0, 0] * by_punch[0] + of_steps[0, 1] * by_punch[1])]
        fills = [] if debris is None else [(stored, 1.0)]
        if fed is not None:
            there = np.array([parts[0], [position.pair.wear_interpolation @ part for part in parts[1]]])
            lost = np.einsum("blkn,bln->kn", slopes, there)
            kept = np.einsum("kn,kn->n", fed[members], lost)
            left += [(stored + closed, kept), (ejected + closed, lost.sum(axis=0) - kept)]
        if remembered is not None:
            for rows, filled, rate in remembered.filling(members):
                left.append((rows.start + closed, rate))
                fills.append((rows.start, filled))
        count, every = len(closed), np.arange(len(closed))
        onto_strip = csr_array(position.pair.wear_projection)[:, closed]
        of_coating, of_base = (
            diags_array(own) @ onto_strip @ diags_array(slope[closed])
            for own, slope in zip(by_strip, of_steps[1], strict=True)
        )
        put = csr_array(of_coating + of_base)
        onto = [csr_array((rate[closed], (rows, every)), shape=(total, count)) for rows, rate in left]
        onto.append(csr_array(vstack([csr_array((n, count)), put, csr_array((total - depths, count))])))
        read = diags_array(of_strip)
        seen = csr_array(position.pair.wear_interpolation)[closed] @ read
        own = csr_array((of_punch[closed], (every, closed)), shape=(count, n))
        by = csr_array(hstack([own, seen, csr_array((count, total - depths))]))
        for first, filled in fills:
            by = by - csr_array((np.full(count, filled), (every, first + closed)), shape=(count, total))
        share = float(records.duration[members].sum() / records.duration.sum())
        pressure = records.pressure[members].mean(axis=0)
        closure = layers.closure_at(position.pair, now.worn)
        found.append(
            Answering(position, closed, pressure, csr_array(sum(onto[1:], onto[0])), csr_array(by), share, closure)
        )
    itself = csr_array((total, total))
    if over is not None:
        lost, at = over.loss, np.arange(n)
        for row, rate in ((stored, -lost), (ejected, lost)):
            itself = itself + csr_array((rate, (row + at, stored + at)), shape=(total, total))
    return found, csr_array(itself if remembered is None else itself + remembered.slopes(total))


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
        if memory is None or evolution is None:
            return None
        begin = depths + now.worn.between.size - len(pair.weights) * len(memory.contact)
        weights = [*(pair.weights for _ in memory.contact), *(pair.strip.weights for _ in memory.strip)]
        ends = begin + np.cumsum([len(own) for own in weights])
        rows = tuple(slice(int(end) - len(own), int(end)) for end, own in zip(ends, weights, strict=True))
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
