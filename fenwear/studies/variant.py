"""The results of one variant: its steady state, its optimum, or the end of its run."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import cast

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.case import Case
from fenwear.checks.law_choice import check_decided
from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.results import registry
from fenwear.results.quantity import RECORD, computed
from fenwear.results.summary import nominal_pressure
from fenwear.steps import Block, at_step, evolve, steady
from fenwear.steps.steady_cycle import SteadyCycle, cycle_of_state
from fenwear.steps.stick_final import FinalShape, cycle_of_final
from fenwear.studies.study import Values
from fenwear.studies.sweep_plan import Of, preparation_for
from fenwear.system import Preparation, Tribosystem, assemble, set_up_by, with_case

FIELDS = ("pressure", "wear", "temperature_punch", "temperature_strip")  # of the registry; and single numbers
LEFT_OUT = ("half_cycle", "time", "direction")


class VariantRunner:
    """Computes one variant after another, on this process alone, and keeps the system that the next may share."""

    def __init__(self, of: Of) -> None:
        self.of = of
        self._system: Tribosystem | None = None
        self._key: tuple[object, ...] = ()

    def __reduce__(self) -> tuple[type[VariantRunner], tuple[Of]]:
        return type(self), (self.of,)

    def compute(self, given: Case) -> Values:
        """Return the results of a case by their names.

        Raises:
            FenwearError: as the assembly of the case and its solution.
        """
        system = self._assembled(given, preparation_for(given, self.of))
        if self.of != "optimum":
            check_decided(system)
        return {**_nodes(system), **COMPUTED[self.of](system)}

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


def _registered(system: Tribosystem, records: Block | SteadyCycle) -> dict[str, Array]:
    """Return the quantities of the last cycle of records of half-cycles, by their names."""
    strokes = system.motion.half_cycles
    numbers = [
        quantity
        for quantity in registry.quantities_of(system).values()
        if (quantity.dims in (RECORD, ()) or quantity.name in FIELDS)
        and quantity.name not in LEFT_OUT
        and (isinstance(records, Block) or (quantity.steady and (records.moves or quantity.nodal)))
    ]
    by_name, nominal = computed(records, numbers), nominal_pressure(system, float(records.load[-1]))
    values = {"direction": np.array(system.motion.stroke_directions, dtype=float)}
    for entry in numbers:
        rows = np.asarray(by_name[entry.name], dtype=float)
        if entry.dims:
            rows = rows[-1] if entry.cycle == "last" else _by_half_cycle(rows, records.half_cycle, strokes)
        values[entry.name] = rows
    return {**values, **{name: np.array(value) for name, value in nominal.items()}}


def _by_half_cycle(rows: Array, numbers: NDArray[np.int64], count: int) -> Array:
    """Return the last row of each half-cycle of the cycle, NaN where there is none."""
    by_number = np.full((count, *rows.shape[1:]), np.nan)
    by_number[(numbers[-count:] - 1) % count] = rows[-count:]
    return by_number


def _final_shape(system: Tribosystem) -> Values:
    """Return the shape to which partial slip wears."""
    final = cast(FinalShape, steady(system))  # under Coulomb's law
    system, thickness = final.system, final.system.bodies.punch.thickness
    values = _registered(system, cycle_of_final(final))
    size = "stick_area" if system.law_state.problem.interface.dim == 3 else "stick_width"
    values |= {size: np.array(final.size), "wear": final.worn.punch, "largest_depth": final.worn.punch.max()}
    values["worn_volume"] = np.array(thickness * float(system.pair.weights @ final.worn.punch))
    if system.sliding.strip_wears:
        values["largest_depth_strip"] = np.array(final.worn.strip.max())
        volume = thickness * float(system.pair.strip.weights @ final.worn.strip)
        values["worn_volume_strip"] = np.array(volume)
    return values


def _steady(system: Tribosystem) -> Values:
    if system.law.sticks:
        return _final_shape(system)
    state = steady(system)
    return {
        **_registered(state.system, cycle_of_state(state)),
        "shape": state.shape,
        "wear_per_cycle": state.wear_per_cycle,
        **{name: np.array(value) for name, value in state.velocity.items()},
        "iterations": np.array(float(state.iterations)),
    }


def _optimum(system: Tribosystem) -> Values:
    system = at_step(system)
    directions = system.motion.stroke_directions
    optima = [system.optimum(d) for d in directions]
    nominal = nominal_pressure(system, system.normal_force)
    return {
        "direction": np.array(directions, dtype=float),
        "pressure": np.array([optimal.pressure for optimal in optima]),
        "largest_pressure": np.array([optimal.pressure.max() for optimal in optima]),
        **{name: np.array(value) for name, value in nominal.items()},
        "angle": np.array([optimal.tilt for optimal in optima]),
        **{name: np.array([optimal.velocity[name] for optimal in optima]) for name in optima[0].velocity},
    }


def _run(system: Tribosystem) -> Values:
    """Return the last cycle of the case's run."""
    ends = deque(evolve(system), maxlen=1)
    if not ends:
        raise ConvergenceError("no half-cycle was done: expected run.half_cycles of one cycle at least")
    last = ends[0]
    by_name = {**_registered(last.system, last), "half_cycles": np.array(float(last.half_cycle[-1]))}
    return {name: np.asarray(values, dtype=float) for name, values in by_name.items()}


COMPUTED: Mapping[Of, Callable[[Tribosystem], Values]] = {"steady": _steady, "optimum": _optimum, "run": _run}
