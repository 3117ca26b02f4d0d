"""Heat of friction and places of the strip at instants of a cycle, as a run has come to it.

Where surfaces slide as a whole each position of the strip has a pressure, and Q = mu p v by the speed of the instant;
where they stick each time step has what friction does in it. Energies are those of the run: of what is slid from one
end of an instant's time to the other, or of the time steps.

A cycle is cut into equal steps, whose harmonics the kernels are of; a stroke so long against the contact that these
would not fit into the memory goes by instants that know where the strip has been, and take heat as it is shared now.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.assembly import (
    ContactSetup,
    assemble,
    heating_friction,
    place_case,
    placed_on,
    regridded,
    renewed,
)
from fenwear.case import Case, Cycle
from fenwear.case.program import stages_of
from fenwear.cycle import march
from fenwear.errors import CaseError, InputError
from fenwear.flash.heating import Course, Heating, Window, grid_of, past_of
from fenwear.parallel import check_memory, on_root
from fenwear.results import checkpoint
from fenwear.stick.coulomb import Steps
from fenwear.stick.records import TimeStepRecords

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
    last = on_root(placed.comm, lambda: checkpoint.last_contact(directory))
    stage = next((one for one in stages_of(case) if one.end >= last.half_cycle), None)
    if stage is not None:
        case = case.model_copy(update={"motion": stage.case.motion, "program": None})
    if stage is not None or last.followed is not None:
        placed = place_case(case, followed=last.followed)
    if last.grid is not None:
        placed = placed_on(placed, grid_of(placed).with_numbers(last.grid))
    motion = placed.motion
    if last.pressure.shape != (len(motion.phases), len(placed.pair.weights)) or np.isnan(last.pressure).any():
        raise CaseError(InputError(str(directory), "expected a run that has done a whole cycle"))
    heat = np.empty_like(last.pressure)
    for k in range(len(heat)):
        conditions = placed.conditions(k, last.pressure[k], worn=last.worn, half_cycles=last.half_cycle)
        heat[k] = last.pressure[k] * heating_friction(placed, placed.friction.values(conditions), k)
    along = _along(placed, last.pressure)
    window = Window.around(grid_of(placed), last.pressure)
    heat *= placed.pair.weights / window.cell
    pressure, heat = last.pressure[:, window.nodes], heat[:, window.nodes]
    if motion.one_way:
        velocity = motion.directions[0] * motion.mean_speed * along
        fast, whole = float(np.linalg.norm(velocity)), heat[:1] * motion.mean_speed
        still = np.zeros((1, 2))
        return Heating(
            placed, last.half_cycle, window, still[:, 0], pressure[:1], whole, velocity, still, np.inf, (), fast
        )
    course = Course.of(motion)
    steps, pasts, way = _steps(course, window, pressure, along, len(motion.phases), motion.half_cycles)
    if not pasts:
        _check_memory(placed.comm, _cells(window, steps, way * np.abs(along) / np.linalg.norm(along)))
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
    what = f"a cycle's temperatures in {cells:,.0f} cells"
    check_memory(comm, PER_CELL * cells, "grid.nodes", what, "Use fewer nodes, or a shorter stroke.")


def _of_time_steps(case: Case, directory: Path) -> Heating:
    """Return the heat of surfaces that stick or slip, of a cycle that goes on from the run's end; collective."""
    if case.program is not None:
        raise CaseError(
            InputError("program", "expected none with contact.law = 'coulomb', where a cycle is done again")
        )
    system = assemble(case)
    grid = checkpoint.grid(directory, system)
    if grid is not None:
        system = regridded(system, grid)
    followed = checkpoint.followed(directory, system)
    if followed is not None:
        system = renewed(system, followed)
    state = checkpoint.load(directory, system)
    until = state.half_cycle + system.motion.half_cycles
    blocks = list(march(system, until, implicit=True, start=state))
    steps_of = [one for block in blocks for one in block.steps if isinstance(one, Steps)]
    records = TimeStepRecords.joined([one.records for one in steps_of])
    along = _along(system, records.pressure)
    edges = np.append(0.0, records.duration.cumsum())
    period, count = float(edges[-1]), len(records)
    even = np.ptp(records.duration) < 1e-9 * records.duration.max()
    steps = count if even else int(np.clip(2 * count, FEWEST, MOST))
    times = period * (np.arange(steps) + 0.5) / steps
    own = np.minimum(np.searchsorted(edges[1:], times), count - 1)
    window = Window.around(grid_of(system), records.pressure)
    done = records.dissipated * system.pair.weights / window.cell
    work = np.concatenate([np.zeros((1, done.shape[1])), done.cumsum(axis=0)])[:, window.nodes]
    parts = np.array([_read(edges, work, t) for t in period * np.arange(steps + 1) / steps])
    heat = np.maximum(np.diff(parts, axis=0), 0.0) * steps / period
    places = np.append(records.displacement[-1], records.displacement)
    offsets = np.interp(times, edges, places)
    way = float(np.ptp(places)) * np.abs(along)
    _check_memory(system.comm, _cells(window, steps, way))
    return Heating(
        system,
        until,
        window,
        times,
        records.pressure[own][:, window.nodes],
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
    velocity = placed.sliding.field.velocity(placed.pair.punch.x)[:, grid_of(placed).axes]
    middle = mean @ velocity / mean.sum()
    differs = np.linalg.norm(velocity[mean > 0] - middle, axis=1).max()
    if not differs <= VARIES * np.linalg.norm(middle):
        message = (
            "turns the strip about a point so near to the contact that it slides in many ways there; the kernels are "
            "of sources that move as a whole: expected an axis farther away"
        )
        raise CaseError(InputError("motion.centre", message))
    return np.asarray(middle)
