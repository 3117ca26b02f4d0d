"""What is computed of one variant, by name, with dimensions and units."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Preparation, Tribosystem, assemble, set_up_by, with_case
from fenwear.case import Case
from fenwear.cycle import at_step, evolve, steady
from fenwear.cycle.state import joined
from fenwear.errors import ConvergenceError
from fenwear.interface import is_translation
from fenwear.law_choice import check_decided
from fenwear.results.steps import numbers
from fenwear.stick.final import FinalShape
from fenwear.sweeps.plan import Of, preparation_for

Values = Mapping[str, NDArray[np.float64]]
SIZE = "size"  # a unit: mm of plane bodies, mm2 of rings and solids


@dataclass(frozen=True)
class Meaning:
    """What a result is.

    Attributes:
        dims: Its dimensions besides those of the sweep.
        unit: Of its values.
        name: In words.
    """

    dims: tuple[str, ...]
    unit: str
    name: str


MEANINGS = {
    "x": Meaning(("node",), "mm", "position along the contact"),
    "y": Meaning(("node",), "mm", "position across the contact"),
    "weight": Meaning(("node",), SIZE, "part of the contact that a node stands for"),
    "direction": Meaning(
        ("half_cycle",),
        "",
        "sliding direction of the strip, 1 rightward or counterclockwise and -1 leftward or clockwise",
    ),
    "pressure": Meaning(("half_cycle", "node"), "MPa", "contact pressure in the middle of the half-cycle"),
    "largest_pressure": Meaning(("half_cycle",), "MPa", "largest contact pressure"),
    "mean_pressure": Meaning((), "MPa", "load over the whole contact"),
    "contact_size": Meaning(("half_cycle",), SIZE, "size in contact"),
    "shape": Meaning(("node",), "mm", "worn shape without the rigid motion of the punch"),
    "wear_per_cycle": Meaning(("node",), "mm", "depth worn off both bodies in a cycle"),
    "wear": Meaning(("node",), "mm", "worn depth of the punch"),
    "largest_depth": Meaning((), "mm", "largest worn depth of the punch"),
    "largest_depth_strip": Meaning((), "mm", "largest worn depth of the strip"),
    "worn_volume": Meaning((), "mm3", "volume worn off the punch"),
    "worn_volume_strip": Meaning((), "mm3", "volume worn off the strip"),
    "stick_size": Meaning((), SIZE, "size that sticks all through the cycle"),
    "largest_force": Meaning((), "N", "largest tangential force in the last cycle, a torque in N mm where it turns"),
    "energy_ratio": Meaning((), "", "work of friction in the last cycle over largest force times stroke"),
    "friction_work_of_cycle": Meaning((), "mJ", "work of friction in the last cycle"),
    "temperature_punch": Meaning(("half_cycle", "node"), "K", "temperature of the punch at the end of the half-cycle"),
    "temperature_strip": Meaning(("half_cycle", "node"), "K", "temperature of the strip at the end of the half-cycle"),
    "largest_temperature": Meaning((), "K", "largest temperature of the contact"),
    "angle": Meaning(("half_cycle", "node"), "rad", "angle chi between the normal and the wear velocity"),
    "half_cycles": Meaning((), "", "half-cycles done"),
    "periodicity": Meaning((), "", "largest change of pressure against the cycle before, over the pressure scale"),
    "iterations": Meaning((), "", "Newton iterations"),
}


def meaning(name: str, of: Of, case: Case) -> Meaning:
    """Return what a result is."""
    if name in MEANINGS:
        found = MEANINGS[name]
        if found.unit != SIZE:
            return found
        unit, size = ("mm", "width") if case.model.kind == "plane" else ("mm2", "area")
        return replace(found, unit=unit, name=found.name.replace(SIZE, size))
    unit, per = ("mm" if is_translation(name) else "rad"), ("s" if of == "optimum" else "cycle")
    dims = ("half_cycle",) if of == "optimum" else ()
    return Meaning(dims, f"{unit}/{per}", "rigid-body wear of the punch")


class VariantRunner:
    """Computes one variant after another, on this process alone, and keeps what the next may share."""

    def __init__(self) -> None:
        self._system: Tribosystem | None = None
        self._key: tuple[object, ...] = ()

    def values(self, case: Case, of: Of) -> Values:
        """Return the results of a case by their names.

        Raises:
            FenwearError: as the assembly of the case and its solution.
        """
        system = self._assembled(case, preparation_for(case, of))
        if of != "optimum":
            check_decided(system)
        return {**_nodes(system), **COMPUTED[of](system)}

    def _assembled(self, case: Case, heat: Preparation) -> Tribosystem:
        key = (heat, *set_up_by(case))
        if self._system is None or self._key != key:
            self._system = None  # two at once may be more than there is room for
            self._system, self._key = assemble(case, MPI.COMM_SELF, heat=heat), key
        else:
            self._system = with_case(self._system, case)
        return self._system


def _nodes(system: Tribosystem) -> dict[str, Array]:
    nodes = system.pair.punch.x
    across = {"y": nodes[:, 1]} if system.case.model.kind == "solid" else {}
    return {"x": nodes[:, 0], **across, "weight": system.pair.weights}


def _final_shape(system: Tribosystem) -> Values:
    """Return the shape to which partial slip wears."""
    found = cast(FinalShape, steady(system))  # under Coulomb's law
    system = found.system
    steps = system.law_state.problem.program.steps
    ends = [k for k, step in enumerate(steps) if steps[(k + 1) % len(steps)].half_cycle != step.half_cycle]
    pressure = found.pressures[ends]
    values: dict[str, Array] = {
        "direction": np.array(system.motion.stroke_directions, dtype=float),
        "pressure": pressure,
        "largest_pressure": pressure.max(axis=1),
        "mean_pressure": np.array(system.rigid.mean_pressure),
        "contact_size": (pressure > 0) @ system.pair.weights,
        "stick_size": np.array(found.size),
        "wear": found.worn.punch,
        "largest_depth": np.array(found.worn.punch.max()),
        "worn_volume": np.array(system.bodies.punch.thickness * float(system.pair.weights @ found.worn.punch)),
    }
    if system.strip_wears:
        values["largest_depth_strip"] = np.array(found.worn.strip.max())
        volume = system.bodies.punch.thickness * float(system.pair.strip.weights @ found.worn.strip)
        values["worn_volume_strip"] = np.array(volume)
    if found.temperature is not None:
        values |= _temperatures(*np.repeat(found.temperature[:, None], len(ends), axis=1))
    return values


def _steady(system: Tribosystem) -> Values:
    if system.sticks:
        return _final_shape(system)
    state = steady(system)
    found = {
        "direction": np.array(state.directions, dtype=float),
        "pressure": state.pressure,
        "largest_pressure": state.pressure.max(axis=1),
        "mean_pressure": np.array(state.system.rigid.mean_pressure),
        "contact_size": state.contact_width,
        "shape": state.shape,
        "wear_per_cycle": state.wear_per_cycle,
        **{name: np.array(value) for name, value in state.velocity.items()},
        "iterations": np.array(float(state.iterations)),
    }
    if state.heat is not None:
        found |= _temperatures(state.heat.punch, state.heat.strip)
    return found


def _optimum(system: Tribosystem) -> Values:
    system = at_step(system)
    directions = system.motion.stroke_directions
    found = [system.optimum(d) for d in directions]
    return {
        "direction": np.array(directions, dtype=float),
        "pressure": np.array([one.pressure for one in found]),
        "largest_pressure": np.array([one.pressure.max() for one in found]),
        "mean_pressure": np.array(system.rigid.mean_pressure),
        "angle": np.array([one.tilt for one in found]),
        **{name: np.array([one.velocity[name] for one in found]) for name in found[0].velocity},
    }


def _run(system: Tribosystem) -> Values:
    """Return the last cycle of the case's run."""
    ends = deque(evolve(system), maxlen=1)
    if not ends:
        raise ConvergenceError("no half-cycle was done: expected run.half_cycles of one cycle at least")
    last = ends[0]
    motion, contacts = last.system.motion, joined(last.end.contacts)
    middle = slice(motion.positions // 2, None, motion.positions)
    pressure = last.pressure[-motion.half_cycles :] if contacts is None else contacts.pressure[middle]
    found = {
        "direction": np.array(motion.stroke_directions[: len(pressure)], dtype=float),
        "pressure": pressure,
        "largest_pressure": pressure.max(axis=1),
        "mean_pressure": np.array(last.system.rigid.mean_pressure * last.load_factor[-1]),
        "contact_size": (pressure > 0) @ last.system.pair.weights,
        "wear": last.wear[-1],
        "largest_depth": last.wear[-1].max(),
        "worn_volume": last.totals.of("volume_punch")[-1],
        "half_cycles": np.array(float(last.half_cycle[-1])),
        "periodicity": last.periodicity[-1],
    }
    if system.strip_wears:
        found["largest_depth_strip"] = last.wear_strip[-1].max()
        found["worn_volume_strip"] = last.totals.of("volume_strip")[-1]
    if last.steps:
        told = numbers(last)
        for name, key in (("friction_work_of_cycle", "friction_work_of_cycle_mJ"), ("energy_ratio", "energy_ratio")):
            found[name] = np.array(told[key])
        found["largest_force"] = np.array(told.get("largest_force_N", told.get("largest_torque_N_mm")))
        found["stick_size"] = np.array(told.get("stick_width_mm", told.get("stick_area_mm2")))
    if last.heat is not None:
        surfaces = [last.heat.temperature_punch, last.heat.temperature_strip]
        found |= _temperatures(*(_by_half_cycle(rows, last.half_cycle, motion.half_cycles) for rows in surfaces))
    return {name: np.asarray(values, dtype=float) for name, values in found.items()}


def _by_half_cycle(rows: Array, numbers: NDArray[np.int64], count: int) -> Array:
    """Return the last row of each half-cycle of the cycle, NaN where there is none."""
    found = np.full((count, rows.shape[1]), np.nan)
    found[(numbers[-count:] - 1) % count] = rows[-count:]
    return found


def _temperatures(punch: Array, strip: Array) -> dict[str, Array]:
    largest = np.array(np.nanmax([np.nanmax(punch), np.nanmax(strip)]))
    return {"temperature_punch": punch, "temperature_strip": strip, "largest_temperature": largest}


COMPUTED: Mapping[Of, Callable[[Tribosystem], Values]] = {"steady": _steady, "optimum": _optimum, "run": _run}
