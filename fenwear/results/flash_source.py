"""Heat of friction and places of the strip at instants of a cycle, as a run has come to it.

Where surfaces slide as a whole each position of the strip has a pressure, and Q = mu p v by the speed of the instant;
where they stick each time step has what friction does in it. Energies are those of the run: of what is slid from one
end of an instant's time to the other, or of the time steps.

A cycle is cut into equal steps, whose harmonics the kernels are of; a stroke so long against the contact that these
would not fit into the memory goes by instants that know where the strip has been, and take heat as it is shared now.

Heat of friction on the part of a contact grid that touches, at instants of a cycle.

Where a strip is that goes to and fro, and how fast, at any time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import Case, Cycle
from fenwear.case.program import stages_of
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import check_memory, on_root
from fenwear.results import checkpoint
from fenwear.steps import march
from fenwear.steps.coulomb import Steps
from fenwear.steps.run_state import all_phases
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.surfaces import ContactPair
from fenwear.surfaces.motion import Motion
from fenwear.system import (
    ContactSetup,
    assemble,
    heating_friction,
    place_case,
    placed_on,
)

FINE = 64  # parts of a position of the strip between which places are taken as straight

Past = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Course:
    """Where the strip is, and how fast, over a cycle to and fro.

    Attributes:
        times: From 0 to the period (k + 1,), s.
        offsets: Of the strip then (k + 1,), mm or rad of the motion.
        slid: Up to then (k + 1,), the same.
        ends: Of the phases (phases,), s.
    """

    times: Array
    offsets: Array
    slid: Array
    ends: Array

    @classmethod
    def of(cls, motion: Motion) -> Course:
        """Return the course of a motion."""
        offsets = motion.offsets(FINE)
        durations = np.array([phase.duration for phase in motion.phases])
        times = np.append(0.0, np.repeat(durations / FINE, FINE).cumsum())
        slid = np.append(0.0, np.abs(np.diff(offsets, axis=1)).ravel().cumsum())
        return cls(times, np.append(offsets[0, 0], offsets[:, 1:].ravel()), slid, durations.cumsum())

    @property
    def period(self) -> float:
        """Of the cycle, s."""
        return float(self.times[-1])

    @property
    def speeds(self) -> Array:
        """Mean ones between the times (k,), mm/s or rad/s."""
        return np.asarray(np.diff(self.slid) / np.diff(self.times))

    def place(self, t: Array) -> Array:
        """Return offsets at any times, mm or rad."""
        return np.asarray(np.interp(t % self.period, self.times, self.offsets))

    def speed(self, t: Array) -> Array:
        """Return speeds at any times, mm/s or rad/s."""
        middles = (self.times[1:] + self.times[:-1]) / 2
        return np.asarray(np.interp(t, middles, self.speeds, period=self.period))

    def phase(self, t: Array) -> NDArray[np.int64]:
        """Return the numbers of the phases at times within the cycle."""
        return np.minimum(np.searchsorted(self.ends, t), len(self.ends) - 1)


def past_of(course: Course, along: Array, now: float) -> Past:
    """Return, for times before an instant, the strip's displacement since then, and the heat then over that now."""
    here, speed = course.place(np.array([now])), float(course.speed(np.array([now]))[0])

    def past(before: Array) -> tuple[Array, Array]:
        then = now - before
        return (course.place(then) - here)[:, None] * along, np.asarray(course.speed(then) / speed, dtype=np.float64)

    return past


MARGIN = 0.25  # of the sides of what touches: how far beside it temperatures are told


@dataclass(frozen=True)
class Window:
    """The part of a contact grid that touches, and some nodes beside it.

    Attributes:
        nodes: Their numbers in the grid (m, n).
        sides: Of a cell, mm.
    """

    nodes: NDArray[np.int64]
    sides: tuple[float, float]

    @classmethod
    def around(cls, grid: RegularGrid, pressure: Array) -> Window:
        """Return the window of nodes whose pressures (t, N) are above zero at any instant."""
        places = grid.places[pressure.max(axis=0) > 0]
        low, high = places.min(axis=0), places.max(axis=0)
        beside = np.ceil(MARGIN * (high - low + 1)).astype(int)
        low, high = np.maximum(low - beside, 0), np.minimum(high + beside, np.array(grid.counts) - 1)
        number = np.arange(int(np.prod(grid.counts))).reshape(grid.counts)
        first, second = (float(step) for step in grid.spacing)
        return cls(number[low[0] : high[0] + 1, low[1] : high[1] + 1], (first, second))

    @property
    def shape(self) -> tuple[int, int]:
        """Nodes (m, n)."""
        return self.nodes.shape[0], self.nodes.shape[1]

    def extent(self, touching: Mask) -> Array:
        """Return the sides of the contact at any of some instants (t, m, n), as (2,), mm."""
        counts = [len(np.unique(places)) for places in np.nonzero(touching)[1:]]
        return np.asarray(np.array(self.sides) * counts)

    @property
    def cell(self) -> float:
        """Area of a node, mm²."""
        return self.sides[0] * self.sides[1]


@dataclass(frozen=True)
class Heating:
    """Heat of friction at t instants, each of which stands for as much of the cycle.

    Attributes:
        placed: The bodies, on the grid that the pressures are of.
        half_cycle: That the cycle ends with.
        window: The part of the grid.
        times: From the cycle's begin (t,), s.
        pressure: (t, m, n), MPa.
        heat: Q (t, m, n), mW/mm²; on the rim of the grid, whose nodes have a half, over whole cells.
        velocity: Of a strip that goes one way (2,), mm/s; else zero.
        shifts: Where the strip is (t, 2), mm.
        period: Of the cycle, s; infinite where the strip goes one way.
        pasts: Where instants are by themselves, what was before each, see `fenwear.heat.moving_sources.history_kernel`.
        fastest: Largest speed of the cycle, mm/s.
        way: From one end of the strip's stroke to the other, mm.
    """

    placed: ContactSetup
    half_cycle: int
    window: Window
    times: Array
    pressure: Array
    heat: Array
    velocity: Array
    shifts: Array
    period: float
    pasts: tuple[Past, ...]
    fastest: float
    way: float = 0.0

    @property
    def grid(self) -> RegularGrid:
        """The contact."""
        return grid_of(self.placed.pair)

    @property
    def touching(self) -> Mask:
        """Nodes of the window that touch (t, m, n)."""
        return self.pressure > 0

    @property
    def extent(self) -> Array:
        """Sides of the contact (2,), mm."""
        return self.window.extent(self.touching)


def grid_of(pair: ContactPair) -> RegularGrid:
    """Return the contact grid of surfaces that have one."""
    grid = pair.punch.grid
    assert grid is not None
    return grid


FEWEST, MOST = 64, 256  # steps of a cycle; of time steps at most
PER_CONTACT = 8.0  # steps in which the strip passes by the contact's length at the largest speed
CELLS = 1e7  # of the strip's doubled grid in all steps, beyond which a long stroke goes by instants
PER_CELL = 110.0  # bytes (measured, 84 to 102)
LONG = 2.0  # contact lengths that such a stroke is at least
BY_THEMSELVES = 9  # instants of a half-cycle then
VARIES = 0.2  # of the speed, over the contact: beyond, the strip turns about a point that is too near


def heating_of(case: Case, directory: Path) -> Heating:
    """Return the heat of a run's last cycle; collective.

    Raises:
        CaseError: no cycle is done, or the strip moves in a way that has no kernel.
    """
    if isinstance(case.motion, Cycle):
        message = "expected one way or to and fro: a cycle that is a table shifts and turns the strip in many ways"
        raise CaseError(InputError("motion.kind", message))
    if on_root(MPI.COMM_WORLD, lambda: checkpoint.reached(directory)) is None:
        raise CaseError(InputError(str(directory), "there is no state of a run to take pressures from"))
    return _of_time_steps(case, directory) if case.sticks else _of_positions(case, directory)


def _of_positions(case: Case, directory: Path) -> Heating:
    """Return the heat of surfaces that slide as a whole; collective."""
    placed = place_case(case)
    kept = on_root(placed.bodies.comm, lambda: checkpoint.last_contact(directory))
    last = kept.state
    stage = next((stage for stage in stages_of(case) if stage.end >= last.half_cycle), None)
    if stage is not None:
        case = case.model_copy(update={"motion": stage.case.motion, "program": None})
    if stage is not None or kept.followed is not None:
        placed = place_case(case, followed=kept.followed)
    if kept.grid is not None:
        placed = placed_on(placed, grid_of(placed.pair).with_numbers(kept.grid))
    motion, reached = placed.motion, all_phases(last.contacts).pressure
    if reached.shape != (len(motion.phases), len(placed.pair.weights)):
        raise CaseError(InputError(str(directory), "expected a run that has done a whole cycle"))
    heat = np.empty_like(reached)
    for k in range(len(heat)):
        conditions = placed.phases.conditions(k, reached[k], worn=last.worn, half_cycles=last.half_cycle)
        heat[k] = reached[k] * heating_friction(placed, placed.laws.friction.values(conditions), k)
    along = _along(placed, reached)
    window = Window.around(grid_of(placed.pair), reached)
    heat *= placed.pair.weights / window.cell
    pressure, heat = reached[:, window.nodes], heat[:, window.nodes]
    if motion.one_way:
        velocity = motion.directions[0] * motion.mean_speed * along
        fast, flux = float(np.linalg.norm(velocity)), heat[:1] * motion.mean_speed
        still = np.zeros((1, 2))
        return Heating(
            placed, last.half_cycle, window, still[:, 0], pressure[:1], flux, velocity, still, np.inf, (), fast
        )
    course = Course.of(motion)
    steps, pasts, way = _steps(course, window, pressure, along, len(motion.phases), motion.half_cycles)
    if not pasts:
        _check_memory(placed.bodies.comm, _cells(window, steps, way * np.abs(along) / np.linalg.norm(along)))
    edges = course.period * np.arange(steps + 1) / steps
    times = (edges[1:] + edges[:-1]) / 2
    phases = course.phase(times)
    mean = np.diff(np.interp(edges, course.times, course.slid)) * steps / course.period
    return Heating(
        placed,
        last.half_cycle,
        window,
        times,
        pressure[phases],
        heat[phases] * mean[:, None, None],
        np.zeros(2),
        course.place(times)[:, None] * along,
        course.period,
        tuple(past_of(course, along, float(t)) for t in times) if pasts else (),
        float(course.speeds.max() * np.linalg.norm(along)),
        way,
    )


def _steps(
    course: Course, window: Window, pressure: Array, along: Array, phases: int, half_cycles: int
) -> tuple[int, bool, float]:
    """Return how many instants a cycle has, whether each is by itself, and how far the strip goes, mm."""
    length = float(window.extent(pressure > 0) @ np.abs(along / np.linalg.norm(along)))
    way = float(np.ptp(course.offsets)) * np.abs(along)
    passes = PER_CONTACT * course.period * float(course.speeds.max() * np.linalg.norm(along)) / length
    wanted = max(FEWEST, passes)
    steps = phases * int(np.ceil(wanted / phases))
    far = float(np.linalg.norm(way))
    if _cells(window, steps, way) > CELLS and far > LONG * length:
        return half_cycles * BY_THEMSELVES, True, far
    return steps, False, far


def _cells(window: Window, steps: int, way: Array) -> float:
    """Return how many cells a strip has that goes so far along both axes (2,), mm, over twice its grid in all steps."""
    return steps * float(np.prod(2 * (np.array(window.shape) + way / window.sides)))


def _check_memory(comm: MPI.Comm, cells: float) -> None:
    """Make sure that the temperatures of so many cells fit into the memory; collective.

    Raises:
        CaseError: they do not.
    """
    subject = f"a cycle's temperatures in {cells:,.0f} cells"
    check_memory(comm, PER_CELL * cells, "grid.nodes", subject, "Use fewer nodes, or a shorter stroke.")


def _of_time_steps(case: Case, directory: Path) -> Heating:
    """Return the heat of surfaces that stick or slip, of a cycle that continues from the run's end; collective."""
    if case.program is not None:
        raise CaseError(
            InputError("program", "expected none with contact.law = 'coulomb', where a cycle is done again")
        )
    system, state, _ = checkpoint.load(directory, assemble(case))
    until = state.half_cycle + system.motion.half_cycles
    blocks = list(march(system, until, implicit=True, start=state))
    steps_of = [stroke for block in blocks for stroke in block.steps if isinstance(stroke, Steps)]
    records = TimeStepRecords.joined([stroke.records for stroke in steps_of])
    along = _along(system, records.pressure)
    edges = np.append(0.0, records.duration.cumsum())
    period, count = float(edges[-1]), len(records)
    even = np.ptp(records.duration) < 1e-9 * records.duration.max()
    steps = count if even else int(np.clip(2 * count, FEWEST, MOST))
    times = period * (np.arange(steps) + 0.5) / steps
    step = np.minimum(np.searchsorted(edges[1:], times), count - 1)
    window = Window.around(grid_of(system.pair), records.pressure)
    done = records.dissipated * system.pair.weights / window.cell
    work = np.concatenate([np.zeros((1, done.shape[1])), done.cumsum(axis=0)])[:, window.nodes]
    parts = np.array([_read(edges, work, t) for t in period * np.arange(steps + 1) / steps])
    heat = np.maximum(np.diff(parts, axis=0), 0.0) * steps / period
    places = np.append(records.displacement[-1], records.displacement)
    offsets = np.interp(times, edges, places)
    way = float(np.ptp(places)) * np.abs(along)
    _check_memory(system.bodies.comm, _cells(window, steps, way))
    return Heating(
        system,
        until,
        window,
        times,
        records.pressure[step][:, window.nodes],
        heat,
        np.zeros(2),
        offsets[:, None] * along,
        period,
        (),
        float(np.abs(np.diff(places) / records.duration).max() * np.linalg.norm(along)),
        float(np.linalg.norm(way)),
    )


def _read(edges: Array, values: Array, t: float) -> Array:
    """Return values at a time, straight between those at edges."""
    k = int(np.clip(np.searchsorted(edges, t) - 1, 0, len(edges) - 2))
    share = (t - edges[k]) / (edges[k + 1] - edges[k])
    return np.asarray((1 - share) * values[k] + share * values[k + 1])


def _along(placed: ContactSetup, pressure: Array) -> Array:
    """Return how a unit of the motion moves the strip in the middle of the contact (2,).

    Raises:
        CaseError: nothing touches, or it moves otherwise at its rim.
    """
    mean = placed.pair.weights * pressure.mean(axis=0)
    if not mean.any():
        raise CaseError(InputError("geometry", "nothing touches in the last cycle, so that there is no heat"))
    velocity = placed.sliding.field.velocity(placed.pair.punch.x)[:, grid_of(placed.pair).axes]
    middle = mean @ velocity / mean.sum()
    differs = np.linalg.norm(velocity[mean > 0] - middle, axis=1).max()
    if not differs <= VARIES * np.linalg.norm(middle):
        message = (
            "turns the strip about a point so near to the contact that it slides in many directions there. The kernels "
            "are of sources that move as a whole. Expected an axis farther away"
        )
        raise CaseError(InputError("motion.centre", message))
    return np.asarray(middle)
