"""The time steps of half-cycles in history.nc, of a law of contact that resolves them: loops, tractions, slip, stick.

Half-cycles may have unlike numbers of steps: those with fewer end in NaN. A model of the plane has values along x, in
a solid they are those along the sliding and across it. Of a cycle that is a table there are ways, pressures and
cross-shear over it, and wear per million cycles.

Where surfaces slide as a whole the ways are those of the motion. Where nodes stick or slip by themselves they are their
slips of the last cycle, time step by time step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.laws.sliding_tensors import SlidingTensor
from fenwear.laws.wear import WornDepths
from fenwear.results.history_surfaces import Column
from fenwear.results.quantity import RECORD, InTable, Quantity
from fenwear.steps import Block
from fenwear.steps.block import HeatRecord
from fenwear.steps.run_state import all_phases
from fenwear.steps.stick_final import beside, stick_edges, zone_width
from fenwear.steps.stick_position import Position, along_sliding, directions
from fenwear.surfaces.placement import in_space
from fenwear.system import Tribosystem

if TYPE_CHECKING:
    from fenwear.steps.coulomb import Steps
    from fenwear.steps.stick_state import TimeStepRecords
    from fenwear.system import ContactSetup

STEP = "step"
ROUNDING = 1e-9  # of a share
STEPS, NODES = ("half_cycle", STEP), ("half_cycle", STEP, "x")


def _rows(block: Block) -> dict[str, NDArray[Any]]:
    """Return the time steps of a block's half-cycles by name: (k, ...), padded with NaN."""
    system = block.system
    rows = [_row(system, steps) for steps in steps_of(block)]
    size = most(system)
    return {name: np.array([padded(np.asarray(row[name], dtype=float), size) for row in rows]) for name in rows[0]}


def _in_steps(name: str, dims: tuple[str, ...], unit: str, text: str, **arguments: Any) -> Quantity:
    """Return a quantity of the time steps of half-cycles."""
    return Quantity(name, dims, unit, text, InTable(_rows, name), **arguments)


IN_STEPS = (
    _in_steps("step_fraction", STEPS, "1", "fraction of the cycle at the end of the time step"),
    _in_steps("displacement", STEPS, "mm", "displacement of the strip's supports at the end of the time step"),
    _in_steps("tangential_force", STEPS, "N", "tangential force on the strip at the end of the time step"),
    _in_steps("step_pressure", NODES, "MPa", "contact pressure at the end of the time step"),
    _in_steps("traction", NODES, "MPa", "tangential traction on the punch, along x"),
    _in_steps("slip", NODES, "mm", "slip of the punch against the strip in the time step"),
    _in_steps("stick", NODES, "1", "1 where the surfaces touch and do not slip"),
    _in_steps("surface_stress", NODES, "MPa", "stress along x in the strip's surface opposite each node"),
    _in_steps("friction_work_increment", RECORD, "mJ", "work of friction in the half-cycle", cycle="sum"),
    _in_steps("energy_ratio", RECORD, "1", "work of friction over largest force times stroke", cycle="mean", of="end"),
    _in_steps("stick_share", RECORD, "1", "share of the contact that sticks all through the cycle that ends here"),
    _in_steps("regime", RECORD, "1", "regime of fretting: 0 stick, 1 partial slip, 2 gross sliding"),
    _in_steps("energy_balance_error", RECORD, "1", "missing energy of the half-cycle over its largest term",
              cycle="largest"),
    _in_steps("stick_width", RECORD, "mm", "width that sticks all through the cycle that ends here", of="end"),
    _in_steps("stick_width_within", RECORD, "mm", "half the interval in which the width that sticks is known to lie",
              of="end"),
    _in_steps("jump_error", RECORD, "1", "estimated error of the depths of the jump that ends here, over its wear",
              cycle="largest"),
)  # fmt: skip
OF_HEAT = tuple(
    _in_steps(f"step_temperature_{body}", NODES, "K", f"temperature of the {body}'s surface at the step's end")
    for body in ("punch", "strip")
)
ACROSS = (
    _in_steps("traction_across", NODES, "MPa", "tangential traction on the punch, across the sliding"),
    _in_steps("slip_across", NODES, "mm", "slip in the time step, across the sliding"),
)
# Solids have these in place of the plane's, with other words or under another name.
IN_SOLIDS = {
    "traction": ("traction", "MPa", "tangential traction on the punch, along the sliding"),
    "slip": ("slip", "mm", "slip of the punch against the strip in the time step, along the sliding"),
    "surface_stress": ("surface_stress", "MPa", "stress along the sliding in the strip's surface opposite each node"),
    "stick_width": ("stick_area", "mm2", "area that sticks all through the cycle that ends here"),
    "stick_width_within": ("stick_area_within", "mm2", "half the interval in which the area that sticks may lie"),
}
IN_TURNING = {"displacement": "rad", "tangential_force": "N mm"}  # units where the strip turns


def _step_quantities(system: Tribosystem) -> list[Quantity]:
    """Return the quantities of time steps of a system whose law resolves them; none of others."""
    if not system.law.sticks:
        return []
    step_quantities, turns = [*IN_STEPS, *(OF_HEAT if system.exchange.conducts else ())], any(system.sliding.field.turn)
    if system.law_state.problem.interface.dim == 3:
        step_quantities = [*(quantity for quantity in step_quantities if quantity.name not in IN_SOLIDS), *of_solids()]
    if turns:
        step_quantities = [
            replace(quantity, unit=IN_TURNING.get(quantity.name, quantity.unit)) for quantity in step_quantities
        ]
    other = "largest_force" if turns else "largest_torque"
    return [*step_quantities, *(quantity for quantity in OF_CYCLE if quantity.name != other)]


def of_solids() -> list[Quantity]:
    """Return the quantities that a solid has in place of the plane's, and as well."""
    known = {quantity.name: quantity for quantity in IN_STEPS}
    return [
        *(
            _in_steps(new, known[name].dims, unit, text, of=known[name].of)
            for name, (new, unit, text) in IN_SOLIDS.items()
        ),
        *ACROSS,
    ]


def _step_columns(system: Tribosystem) -> dict[str, Column]:
    """Return the columns of time steps that do not change in a run."""
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


def attributes(system: Tribosystem) -> dict[str, Any]:
    """Return the attributes of a history of a law that resolves half-cycles; none of others."""
    if not system.law.sticks:
        return {}
    problem = system.law_state.problem
    return {"law": system.law.name, "friction": float(problem.friction[0]), "period": problem.program.period}


def most(system: Tribosystem) -> int:
    """Return the largest number of time steps of a half-cycle."""
    return int(np.bincount([step.half_cycle for step in system.law_state.problem.program.steps]).max())


def steps_of(block: Block) -> tuple[Steps, ...]:
    """Return the time steps of each half-cycle of a block."""
    time_steps: tuple[Any, ...] = block.steps
    return time_steps


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
    stuck, within = stuck_size(problem.interface.middle, steps)
    share = float(pair.weights @ (steps.stuck & records.touched)) / max(float(pair.weights @ records.touched), 1e-300)
    row: dict[str, Any] = {
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
        row |= {"traction_across": traction[1], "slip_across": slip[1]}
    if records.heat.size:
        for k, body in enumerate(("punch", "strip")):
            row[f"step_temperature_{body}"] = records.temperature[:, k]
    return row


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


def stuck_size(position: Position, steps: Steps) -> tuple[float, float]:
    """Return the width, or area in solids and rings, that sticks all through a cycle, and half the interval left of it.

    An area is that of the nodes, to half of what those beside it stand for.
    """
    records, stuck, pair = steps.records, steps.stuck, position.pair
    if position.frame.shape[1] == 3:
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


def _of_cycle(last: Block) -> dict[str, float]:
    """Return the numbers of the time steps of the last cycle, by `OF_CYCLE`."""
    system = last.system
    numbers = _rows(last)
    cycle = slice(-system.motion.half_cycles, None)
    traction = np.abs(numbers["traction"][cycle])
    if "traction_across" in numbers:
        traction = np.hypot(traction, numbers["traction_across"][cycle])
    stuck = traction[numbers["stick"][cycle] == 1]
    force = float(np.nanmax(np.abs(numbers["tangential_force"][cycle])))
    return {
        "largest_force": force,
        "largest_torque": force,
        "largest_traction": float(np.nanmax(traction)),
        "largest_stick_traction": float(stuck.max(initial=0.0)),
        "largest_surface_stress": float(np.nanmax(numbers["surface_stress"][cycle])),
        "friction_work_of_cycle": float(numbers["friction_work_increment"][cycle].sum()),
        "steps_per_half_cycle": len(system.law_state.problem.program.steps) / system.motion.half_cycles,
    }


OF_CYCLE = tuple(
    Quantity(name, (), unit, text, InTable(_of_cycle, name), of="end")
    for name, unit, text in (
        ("largest_force", "N", "largest tangential force in the cycle"),
        ("largest_torque", "N mm", "largest torque in the cycle"),
        ("largest_traction", "MPa", "largest tangential traction in the cycle"),
        ("largest_stick_traction", "MPa", "largest tangential traction in the cycle where it sticks"),
        ("largest_surface_stress", "MPa", "largest stress along the sliding in the strip's surface in the cycle"),
        ("friction_work_of_cycle", "mJ", "work of friction in the cycle"),
        ("steps_per_half_cycle", "1", "time steps of a half-cycle, mean over the cycle"),
    )
)


def extremes(block: Block) -> dict[str, float]:
    """Return the largest values over the time steps of a block, by the names of a run's extremes."""
    if not block.system.law.sticks:
        return {}
    weights = block.system.law_state.problem.weights
    steps = steps_of(block)
    return {
        "largest_energy_balance_error": max(stroke.records.balance_error(weights) for stroke in steps),
        "largest_jump_error": max(stroke.jump_error for stroke in steps),
    }


def hottest(block: Block, heat: HeatRecord) -> Array:
    """Return the largest temperature of each half-cycle of a block (k,), K: of its time steps, or at its end."""
    if not block.system.law.sticks:
        return heat.largest_temperature
    return np.array([stroke.records.temperature.max() for stroke in steps_of(block)])


MILLION = 1e6


@dataclass(frozen=True)
class TableCycle:
    """The last cycle of a block.

    Attributes:
        ways: Sliding of each contact node in it (n,), mm.
        pressure: Of its phases or time steps (m, n), MPa.
        worn: Its wear of both bodies.
        tensors: Of the sliding of the punch's and the strip's material, of the work.
    """

    ways: Array
    pressure: Array
    worn: WornDepths
    tensors: tuple[SlidingTensor, SlidingTensor]


def table_cycle(last: Block) -> TableCycle | None:
    """Return the last cycle of a block; None where it is no table, or where not all of it is known."""
    system = last.system
    if not system.motion.steps:
        return None
    if system.law.sticks:
        return _of_time_steps(last, steps_of(last)[-1])
    pressure = all_phases(last.end.contacts).pressure
    if not len(pressure):
        return None
    end, shear = last.end, system.phases.ways.shear(pressure)
    states = [
        system.phases.conditions(k, np.asarray(phase_pressure), worn=end.worn, half_cycles=end.half_cycle, cycle=shear)
        for k, phase_pressure in enumerate(pressure)
    ]
    tensors = system.phases.ways.tensor(pressure), system.phases.ways.tensor_of_strip(pressure)
    worn = system.phases.wear.phases(states).begun(end.worn).worn(pressure)
    return TableCycle(system.sliding.path.sum(axis=0), pressure, worn, tensors)


def _of_time_steps(last: Block, steps: Steps) -> TableCycle:
    """Return the cycle of time steps, in which nodes that are open slide nothing."""
    records, problem, pair = steps.records, last.system.law_state.problem, last.system.pair
    slip = np.where(records.pressure[:, :, None] > 0, records.slip, 0.0)
    ways, values, on_strip = np.linalg.norm(slip, axis=2), [], np.zeros((len(pair.strip.weights), 9))
    for k, phase_slip in enumerate(slip):
        place = problem.program.steps[(steps.first + k) % len(problem.program.steps)].offset
        position = problem.interface.position(place)
        vectors = in_space(np.einsum("nmc,nm->nc", position.frame[:, 1:], phase_slip))
        scale = np.divide(records.pressure[k], ways[k], out=np.zeros_like(ways[k]), where=ways[k] > 0)
        values.append(scale[:, None, None] * vectors[:, :, None] * vectors[:, None, :])
        back = position.pair.placement.back(vectors)
        squares = scale[:, None, None] * back[:, :, None] * back[:, None, :]
        on_strip += position.pair.wear_projection @ squares.reshape(-1, 9)
    tensors = SlidingTensor(np.sum(values, axis=0)), SlidingTensor(on_strip.reshape(-1, 3, 3))
    return TableCycle(ways.sum(axis=0), records.pressure, steps.wear, tensors)


def _directions(block: Block, axis: int) -> Array:
    """Return a component of the direction of most work of friction (k, n)."""
    return np.array([sliding.direction[:, axis] for sliding in block.sliding])


OF_TABLE = (
    Quantity("cross_shear", ("half_cycle", "x"), "1", "cross-shear ratio of a cycle on the punch: share of the work "
             "across its direction", lambda b: np.array([sliding.ratio for sliding in b.sliding])),
    *(
        Quantity(f"principal_{axis}", ("half_cycle", "x"), "1",
                 f"direction with most of the work of friction in a cycle, along {axis}", partial(_directions, axis=k))
        for k, axis in enumerate("xyz")
    ),
)  # fmt: skip


def _table_columns(placed: ContactSetup) -> dict[str, Column]:
    """Return the sliding of each place in each step of a table, and the tracks of the strip's material."""
    if not placed.sliding.many_ways:
        return {}
    ways = placed.phases.ways
    slid = ways.lengths[:, :, None] * ways.directions
    return {
        "slid": Column(
            ("table_step", "node", "axis"),
            slid,
            {"units": "mm", "long_name": "way of the strip past each node in each step of the table: x, y and z"},
        ),
        "track": Column(
            ("table_row", "node", "axis"),
            _tracks(placed),
            {
                "units": "mm",
                "long_name": "where the strip's material is, at each node at first, in each row of the table",
            },
        ),
    }


def _tracks(placed: ContactSetup) -> Array:
    """Return the places of the strip's material that lies at each node of the punch in the first row (rows, n, 3)."""
    x, screws = placed.pair.punch.x, [phase.way for phase in placed.motion.phases if phase.way is not None]
    material = screws[0].at(0.0).points_back(x)
    return np.array([x, *(screw.at(1.0).points(material) for screw in screws)])


def sliding_numbers(last: Block, cycle: TableCycle) -> dict[str, float]:
    """Return the ways of a last cycle for the sheet."""
    areas = last.system.pair.weights * (cycle.pressure.max(axis=0) > 0 if last.system.law.sticks else 1.0)
    return {
        "mean_way_of_cycle_mm": float(areas @ cycle.ways / areas.sum()),
        "largest_way_of_cycle_mm": float(cycle.ways.max()),
    }


def body_numbers(last: Block, cycle: TableCycle, body: str) -> dict[str, float]:
    """Return the wear per million cycles of a body, "punch" or "strip", and its cross-shear in a last cycle."""
    pair, depth = last.system.pair, getattr(cycle.worn, body)
    areas = last.system.bodies.punch.thickness * (pair.weights if body == "punch" else pair.strip.weights)
    return {
        "worn_volume_per_million_cycles_mm3": MILLION * float(areas @ depth),
        "depth_per_million_cycles_mm": MILLION * float(depth.max()),
        **_cross_shear(cycle.tensors[body == "strip"], areas),
    }


def _cross_shear(tensor: SlidingTensor, areas: Array) -> Mapping[str, float]:
    """Return the mean over the work of friction, and the largest where there is a hundredth of the largest work."""
    work, ratio = tensor.work, tensor.ratio
    rubbed = work > 0.01 * work.max(initial=0.0)
    mean = float(areas * work @ ratio) / max(float(areas @ work), 1e-300)
    return {"mean_cross_shear": mean, "largest_cross_shear": float(np.max(ratio, where=rubbed, initial=0.0))}


def quantities(system: Tribosystem) -> list[Quantity]:
    """Return the quantities of time steps, and of a cycle that is a table of a solid's ways."""
    return [*_step_quantities(system), *(OF_TABLE if system.sliding.many_ways else ())]


def columns(system: Tribosystem) -> dict[str, Column]:
    """Return the columns of time steps and of tables that do not change in a run."""
    return {**(_step_columns(system) if system.law.sticks else {}), **_table_columns(system)}
