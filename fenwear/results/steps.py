"""The time steps of half-cycles in history.nc, of a law of contact that resolves them: loops, tractions, slip, stick.

Half-cycles may have unlike numbers of steps: those with fewer end in NaN. A model of the plane has values along x, in
a solid they are those along the sliding and across it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.case import Case
from fenwear.cycle import Block
from fenwear.cycle.block import BlockHeat
from fenwear.interface import ContactPair
from fenwear.results.quantity import Variable
from fenwear.results.surfaces import Column
from fenwear.stick.edge import beside, stick_edges, zone_width
from fenwear.stick.position import along_sliding, directions

if TYPE_CHECKING:
    from fenwear.stick.coulomb import Steps
    from fenwear.stick.records import TimeStepRecords

S = TypeVar("S", Block, Tribosystem)
T = TypeVar("T")
STEP = "step"
ROUNDING = 1e-9  # of a share
VARIABLES: dict[str, Variable] = {
    "step_fraction": (("half_cycle", STEP), "1", "fraction of the cycle at the end of the time step"),
    "displacement": (("half_cycle", STEP), "mm", "displacement of the strip's supports at the end of the time step"),
    "tangential_force": (("half_cycle", STEP), "N", "tangential force on the strip at the end of the time step"),
    "step_pressure": (("half_cycle", STEP, "x"), "MPa", "contact pressure at the end of the time step"),
    "traction": (("half_cycle", STEP, "x"), "MPa", "tangential traction on the punch, along x"),
    "slip": (("half_cycle", STEP, "x"), "mm", "slip of the punch against the strip in the time step"),
    "stick": (("half_cycle", STEP, "x"), "1", "1 where the surfaces touch and do not slip"),
    "surface_stress": (("half_cycle", STEP, "x"), "MPa", "stress along x in the strip's surface opposite each node"),
    "friction_work_increment": (("half_cycle",), "mJ", "work of friction in the half-cycle"),
    "energy_ratio": (("half_cycle",), "1", "work of friction over largest force times stroke"),
    "stick_share": (("half_cycle",), "1", "share of the contact that sticks all through the cycle that ends here"),
    "regime": (("half_cycle",), "1", "regime of fretting: 0 stick, 1 partial slip, 2 gross sliding"),
    "energy_balance_error": (("half_cycle",), "1", "missing energy of the half-cycle over its largest term"),
    "stick_width": (("half_cycle",), "mm", "width that sticks all through the cycle that ends here"),
    "stick_width_within": (("half_cycle",), "mm", "half the interval in which the width that sticks is known to lie"),
    "jump_error": (("half_cycle",), "1", "estimated error of the depths of the jump that ends here, over what it wore"),
}
HEAT_VARIABLES: dict[str, Variable] = {
    "step_temperature_punch": (("half_cycle", STEP, "x"), "K", "temperature of the punch's surface at the step's end"),
    "step_temperature_strip": (("half_cycle", STEP, "x"), "K", "temperature of the strip's surface at the step's end"),
}
ACROSS: dict[str, Variable] = {
    "traction_across": (("half_cycle", STEP, "x"), "MPa", "tangential traction on the punch, across the sliding"),
    "slip_across": (("half_cycle", STEP, "x"), "mm", "slip in the time step, across the sliding"),
}
IN_SOLIDS: dict[str, tuple[str, str, str]] = {
    "traction": ("traction", "MPa", "tangential traction on the punch, along the sliding"),
    "slip": ("slip", "mm", "slip of the punch against the strip in the time step, along the sliding"),
    "surface_stress": ("surface_stress", "MPa", "stress along the sliding in the strip's surface opposite each node"),
    "stick_width": ("stick_area", "mm2", "area that sticks all through the cycle that ends here"),
    "stick_width_within": ("stick_area_within", "mm2", "half the interval in which the area that sticks may lie"),
}
IN_TURNING = {"displacement": "rad", "tangential_force": "N mm"}  # units where the strip turns


def of_time_steps(function: Callable[[S], dict[str, T]]) -> Callable[[S], dict[str, T]]:
    """Let a function of a system or a block return nothing where the law of contact resolves no time steps."""

    @wraps(function)
    def resolved(given: S) -> dict[str, T]:
        system = given.system if isinstance(given, Block) else given
        return function(given) if system.sticks else {}

    return resolved


@of_time_steps
def variables(system: Tribosystem) -> dict[str, Variable]:
    """Return the variables of time steps of a system whose law resolves them; none of others."""
    found = {**VARIABLES, **(HEAT_VARIABLES if system.exchange.conducts else {})}
    if system.pair.punch.dim == 3:
        found = {**{name: one for name, one in found.items() if name not in IN_SOLIDS}, **of_solids()}
    if any(system.sliding.field.turn):
        found = {name: (over, IN_TURNING.get(name, unit), text) for name, (over, unit, text) in found.items()}
    return found


def of_solids() -> dict[str, Variable]:
    """Return what a solid has in place of the plane's variables of the same names, and as well."""
    found = {new: (VARIABLES[name][0], unit, text) for name, (new, unit, text) in IN_SOLIDS.items()}
    return {**found, **ACROSS}


@of_time_steps
def columns(system: Tribosystem) -> dict[str, Column]:
    """Return what of time steps does not change in a run."""
    pair, position = system.pair, system.law_state.problem.interface.middle
    none = Column((STEP,), np.arange(1, most(system) + 1), {"units": "1", "long_name": "time step of the half-cycle"})
    if pair.punch.dim == 3:
        ways = directions(position)
        text = {"sliding_along": "direction of the sliding", "sliding_across": "direction across it"}
        return {STEP: none} | {
            name: Column(("node", "axis"), ways[:, k], {"units": "1", "long_name": meaning})
            for k, (name, meaning) in enumerate(text.items())
        }
    return {STEP: none} | {
        f"normal_{axis}": Column(
            ("x",), pair.normal[:, k], {"units": "1", "long_name": f"contact's normal, along {axis}"}
        )
        for k, axis in enumerate("xz")
    }


@of_time_steps
def attributes(system: Tribosystem) -> dict[str, Any]:
    """Return what a history says of a law that resolves half-cycles."""
    problem = system.law_state.problem
    return {"law": system.law, "friction": float(problem.friction[0]), "period": problem.program.period}


def most(system: Tribosystem) -> int:
    """Return the largest number of time steps of a half-cycle."""
    return int(np.bincount([step.half_cycle for step in system.law_state.problem.program.steps]).max())


@of_time_steps
def values(block: Block) -> dict[str, NDArray[Any]]:
    """Return the time steps of a block's half-cycles by name: (k, ...), padded with NaN."""
    system = block.system
    rows = [_row(system, steps) for steps in steps_of(block)]
    size = most(system)
    return {name: np.array([padded(np.asarray(row[name], dtype=float), size) for row in rows]) for name in rows[0]}


def steps_of(block: Block) -> tuple[Steps, ...]:
    """Return the time steps of each half-cycle of a block."""
    found: tuple[Any, ...] = block.steps
    return found


def padded(values: Array, size: int, axis: int = 0) -> Array:
    """Return an array over time steps, with as many as others have; a number as it is."""
    if not values.ndim or values.shape[axis] == size:
        return values
    missing = [n if k != axis else size - n for k, n in enumerate(values.shape)]
    return np.concatenate([values, np.full(missing, np.nan)], axis=axis)


def _row(system: Tribosystem, steps: Steps) -> dict[str, Any]:
    records, thick, problem = steps.records, system.bodies.punch.thickness, system.law_state.problem
    program, pair = problem.program.steps, system.pair
    turn = along_sliding(problem.interface.middle)
    traction, slip = (np.einsum("nam,knm->akn", turn, v) for v in (records.traction, records.slip))
    stuck, within = stuck_size(pair, steps)
    share = float(pair.weights @ (steps.stuck & records.touched)) / max(float(pair.weights @ records.touched), 1e-300)
    found: dict[str, Any] = {
        "step_fraction": [program[steps.first + k].fraction for k in range(len(records))],
        "displacement": records.displacement,
        "tangential_force": thick * records.force,
        "step_pressure": records.pressure,
        "traction": traction[0],
        "slip": slip[0],
        "stick": records.sticking.astype(float),
        "surface_stress": surface_stress(system.case, records),
        "friction_work_increment": thick * records.energy(problem.weights),
        "energy_ratio": steps.energy_ratio,
        "stick_share": share,
        "regime": regime_of(records, share),
        "energy_balance_error": records.balance_error(problem.weights),
        "stick_width": stuck,
        "stick_width_within": within,
        "stick_area": stuck,
        "stick_area_within": within,
        "jump_error": steps.jump_error,
    }
    if len(traction) > 1:
        found |= {"traction_across": traction[1], "slip_across": slip[1]}
    if records.heat.size:
        for k, body in enumerate(("punch", "strip")):
            found[f"step_temperature_{body}"] = records.temperature[:, k]
    return found


REGIMES = ("stick", "partial slip", "gross sliding")


def regime_of(records: TimeStepRecords, share: float) -> int:
    """Return the regime of time steps by its number in `REGIMES`: gross where nothing sticks in one of them.

    Args:
        records: The time steps.
        share: Of the contact, that sticks all through.
    """
    if not records.sticking.any(axis=1).all():
        return 2
    return 0 if share > 1 - ROUNDING else 1


def stuck_size(pair: ContactPair, steps: Steps) -> tuple[float, float]:
    """Return the width, in a solid the area, that sticks all through a cycle, and half the interval left of it.

    In a solid it is the area of the nodes, to half of what those beside it stand for.
    """
    records, stuck = steps.records, steps.stuck
    if pair.punch.dim == 3:
        rim = beside(pair.punch, stuck) & records.touched
        return float(pair.weights @ stuck), float(pair.weights @ rim) / 2
    return zone_width(stick_edges(pair.x, stuck, records.slip_magnitude.sum(axis=0), records.touched))


def surface_stress(case: Case, records: TimeStepRecords) -> Array:
    """Return the stress along the sliding in the strip's surface (k, n), MPa, from its strains and the pressure on it.

    The law of the strip's material, with sigma_zz = -p: in a solid, and with eps_yy = 0 in plane strain,
    sigma_xx = E / (1 - nu²) (eps_xx + nu eps_yy) - nu / (1 - nu) p, in plane stress E eps_xx - nu p.
    """
    along = records.strain[:, :, 0]
    names = set(case.strip.regions.values())
    if len(names) > 1:
        return np.full(along.shape, np.nan)
    material = case.initial_materials[names.pop()]
    young, nu = material.young, material.poisson
    if case.model.kind == "plane" and case.model.law == "stress":
        return young * along - nu * records.pressure
    both = along if case.model.kind == "plane" else along + nu * records.strain[:, :, 1]
    return young / (1 - nu**2) * both - nu / (1 - nu) * records.pressure


OF_CYCLE = {
    "largest_force": ("N", "largest tangential force in the cycle"),
    "largest_torque": ("N mm", "largest torque in the cycle"),
    "largest_traction": ("MPa", "largest tangential traction in the cycle"),
    "largest_stick_traction": ("MPa", "largest tangential traction in the cycle where it sticks"),
    "largest_surface_stress": ("MPa", "largest stress along the sliding in the strip's surface in the cycle"),
    "friction_work_of_cycle": ("mJ", "work of friction in the cycle"),
    "steps_per_half_cycle": ("1", "time steps of a half-cycle, mean over the cycle"),
}


@of_time_steps
def of_cycle(last: Block) -> dict[str, float]:
    """Return the numbers of the time steps of the last cycle, by `OF_CYCLE`; none of a law without them."""
    system = last.system
    found = values(last)
    cycle = slice(-system.motion.half_cycles, None)
    traction = np.abs(found["traction"][cycle])
    if system.pair.punch.dim == 3:
        traction = np.hypot(traction, found["traction_across"][cycle])
    stuck = traction[found["stick"][cycle] == 1]
    force = np.nanmax(np.abs(found["tangential_force"][cycle]))
    return {
        "largest_torque" if any(system.sliding.field.turn) else "largest_force": float(force),
        "largest_traction": float(np.nanmax(traction)),
        "largest_stick_traction": float(stuck.max(initial=0.0)),
        "largest_surface_stress": float(np.nanmax(found["surface_stress"][cycle])),
        "friction_work_of_cycle": float(found["friction_work_increment"][cycle].sum()),
        "steps_per_half_cycle": len(system.law_state.problem.program.steps) / system.motion.half_cycles,
    }


def names_of_cycle(system: Tribosystem) -> list[str]:
    """Return the names of what `of_cycle` tells of a system."""
    other = "largest_force" if any(system.sliding.field.turn) else "largest_torque"
    return [name for name in OF_CYCLE if name != other] if system.sticks else []


@of_time_steps
def extremes(block: Block) -> dict[str, float]:
    """Return what is largest over the time steps of a block, by the names of a run's extremes."""
    weights = block.system.law_state.problem.weights
    steps = steps_of(block)
    return {
        "largest_energy_balance_error": max(one.records.balance_error(weights) for one in steps),
        "largest_jump_error": max(one.jump_error for one in steps),
    }


def hottest(block: Block, heat: BlockHeat) -> Array:
    """Return the largest temperature of each half-cycle of a block (k,), K: of its time steps, or at its end."""
    if not block.system.sticks:
        return heat.largest_temperature
    return np.array([one.records.temperature.max() for one in steps_of(block)])
