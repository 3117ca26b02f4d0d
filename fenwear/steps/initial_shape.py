"""The shape to machine: the one that wear would make in the end, so that nothing is left to run in.

At the cyclic steady state the wear of a cycle is a rigid motion of the punch. Its shape omega, the depth worn off
up to a rigid motion, is the optimal contact shape of Paczelt and Mroz: a punch that is made with it has the steady
pressures from its first cycle on, and keeps them, at the load it was found for. The depth to take off is omega less the
rigid motion H a of the free parts that leaves the least to take off,

    minimise  sum of A_i (omega - H a)_i    with    omega - H a >= 0 where surfaces touch,

a linear programme. Where they never touch the depth keeps them apart, and is zero wherever that does.

For loads of several sizes that take turns, with shares w_k of the sliding, the pressures are to first order
p_k(omega) = p_k - S_k^-1 (omega - omega_k), which wear the contact evenly in all where

    omega = sum of w_k omega_k,

exactly so for linear wear and one contact zone, as the shapes of the loads differ by elasticity alone. Elsewhere
iterations begin there: where all loads together wear w more than evenly, and on average k times their mean pressure,
S w / k is taken off, with S the gap by unit pressures, until the wear is even.

In partial slip the shape is that of `fenwear.steps.stick_final`: the stick zone carries all of the load, and nothing
else wears.

A shape may also be asked for a pressure p of the first contact. Where p > 0 the gap is zero, so that with the
compliance S(tau) under friction tau, the gap g_load of the loads and the present gap g_0

    depth = -H a - (S(tau) p + g_load + g_0),

where the rigid motion a leaves the least to take off. Where p = 0 the depth keeps the surfaces apart. The pressure must
balance the loads on each rigid mode, E(tau) p + F = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy

from fenwear.algebra.fixed_point import fixed_point
from fenwear.bodies.contact_surface import ContactSurface, profiled
from fenwear.case.body_tables import Profile
from fenwear.case.dependence import parse_expression
from fenwear.common.arrays import Array, Mask
from fenwear.common.csv_table import read_profile
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.steps.program_stages import loads_times
from fenwear.steps.run_state import pressure_scale
from fenwear.steps.steady import SteadyState, steady
from fenwear.steps.stick_final import FinalShape
from fenwear.steps.stick_state import TimeStepRecords
from fenwear.surfaces import is_translation
from fenwear.system import Tribosystem
from fenwear.system.variants import with_case

ALLOWED = 0.1  # of the pressure scale: what a deviation of the size of the tolerance changes the pressure by
ROUNDED = 1e-12  # of the largest depth: what rounding leaves of none
UNBALANCED = 0.01  # of what a pressure carries: what is corrected of it
EVEN = 1e-9  # unevenness of the wear in several loads together that ends their iterations
PROBE = 1e-3  # of the elastic gap under the pressure scale: a deviation that is small


@dataclass(frozen=True)
class InitialShape:
    """The shape to machine, for one load or several.

    Attributes:
        surface: The punch's contact surface.
        depth: To be taken off it at its nodes (n,), mm; 0 somewhere, and never less.
        states: The steady state of each load; in partial slip the final shape; none for a wanted pressure.
        largest_pressure: On that shape, of each load, MPa; NaN with heat.
        left_to_run_in: Largest difference between the first cycle's pressures on that shape and the steady ones, or
            those wanted, over the pressure scale, of each load; NaN with heat, where the first cycle is colder.
        uneven_wear: Largest deviation of the wear in all loads together from a rigid motion, over the largest wear;
            NaN with heat, 0 in partial slip, where nothing wears.
        tolerance: Amplitude of a wave once over the contact that changes the pressure by a tenth of its scale, mm.
    """

    surface: ContactSurface
    depth: Array
    states: tuple[SteadyState | FinalShape, ...]
    largest_pressure: tuple[float, ...]
    left_to_run_in: tuple[float, ...]
    uneven_wear: float
    tolerance: float


def initial_shape(system: Tribosystem, loads: Sequence[tuple[float, float]] = ((1.0, 1.0),)) -> InitialShape:
    """Return the shape of the punch that has nothing left to run in; collective.

    Args:
        system: The assembled problem.
        loads: Factor of all loads of the case, and share of the sliding, of each load that acts in turn.

    Raises:
        CaseError: a factor or share is not positive, or there are several loads in partial slip.
        ConvergenceError: there is no steady state.
    """
    for factor, share in loads:
        if not (0 < factor < np.inf and 0 < share < np.inf):
            raise CaseError(InputError("--load", f"expected positive numbers FACTOR or FACTOR:SHARE, got {factor:g}"))
    if system.law.sticks and len(loads) > 1:
        message = "each load has its own stick zone, which alone carries the load in the end. Give one load"
        raise CaseError(InputError("--load", message))
    systems = [system if factor == 1.0 else with_case(system, loads_times(system.case, factor)) for factor, _ in loads]
    states: tuple[SteadyState | FinalShape, ...] = tuple(steady(loaded) for loaded in systems)
    if system.law.sticks:
        systems = [state.system for state in states]  # on the grid that the scar has grown to
    shares = np.array([share for _, share in loads]) / sum(share for _, share in loads)
    depth = _depth(system, states, shares)
    goals = [_steady_pressures(state) for state in states]
    first, uneven = [np.full_like(goal, np.nan) for goal in goals], np.nan
    if system.case.heat is None:
        depth = depth if len(loads) == 1 else _evened(systems, shares, depth)
        first = [_pressures(loaded, depth) for loaded in systems]
        uneven = 0.0 if system.law.sticks else _uneven(systems, shares, first)[0]
    left = [
        float(np.abs(p - goal).max() / pressure_scale(loaded, goal))
        for loaded, p, goal in zip(systems, first, goals, strict=True)
    ]
    tolerance = min(_tolerance(loaded, goal, depth) for loaded, goal in zip(systems, goals, strict=True))
    largest = tuple(float(p.max()) for p in first)
    return InitialShape(systems[0].pair.punch, depth, states, largest, tuple(left), uneven, tolerance)


def shape_for_pressure(system: Tribosystem, pressure: Array) -> InitialShape:
    """Return the shape of the punch whose first contact has a pressure; collective.

    A pressure that misses the balance by less than a hundredth is corrected in proportion to itself.

    Args:
        system: The assembled problem, of gross sliding without heat.
        pressure: At the contact nodes (n,), MPa.

    Raises:
        CaseError: the pressure is negative somewhere or nowhere positive, the loads do not balance it, or material
            would have to be added; the system sticks, or has heat.
        ConvergenceError: the contact on the shape did not converge.
    """
    if system.law.sticks or system.case.heat is not None:
        key = "contact.law" if system.law.sticks else "heat"
        raise CaseError(
            InputError(
                key,
                "--pressure works in gross sliding without heat alone. Leave out --pressure, or change this setting",
            )
        )
    if not (np.isfinite(pressure).all() and pressure.min() >= 0 and pressure.any()):
        raise CaseError(InputError("--pressure", "expected numbers of zero or more, and some above zero"))
    interface, ratio, unworn = system.elastic.interfaces[0], system.phases.ratios()[0], system.unworn()
    goal = _balanced(system, pressure, ratio)
    forces = (interface.pair.normal + ratio) * (goal * interface.pair.weights)[:, None]
    shape = -(interface.apply(forces)[:, 0] + interface.load_gap + system.gap(0, unworn))
    pressed = goal > 0
    depth = np.maximum(shape - _least_motion(system, shape, pressed), 0.0)
    pressures = system.phase_contact((0,)).solve(system.gap(0, replace(unworn, punch=depth))).pressure[0]
    off = float(np.abs(pressures - goal).max() / pressure_scale(system, goal[None]))
    tolerance = _tolerance(system, goal[None], depth)
    return InitialShape(system.pair.punch, depth, (), (float(pressures.max()),), (off,), np.nan, tolerance)


def _balanced(system: Tribosystem, pressure: Array, ratio: Array) -> Array:
    """Return a pressure (n,) that balances the loads exactly, from one that nearly does.

    Raises:
        CaseError: it does not; names each rigid mode with what the pressure carries, and what it must.
    """
    rigid, thickness = system.elastic.interfaces[0].rigid, system.bodies.punch.thickness
    balance = rigid.equilibrium(ratio)
    carried, needed = balance @ pressure, -rigid.resultant
    allowed = UNBALANCED * np.abs(balance) @ pressure
    problems = [
        InputError(
            "--pressure",
            f"the pressure carries {thickness * has:.6g} {unit} along {name}; loads and friction need "
            f"{thickness * must:.6g} {unit}. Scale or shift the pressure",
        )
        for name, has, must, most in zip(rigid.mode_names, carried, needed, allowed, strict=True)
        if abs(has - must) > most and (unit := "N" if is_translation(name) else "N mm")
    ]
    if problems:
        raise CaseError(problems)
    shares = (pressure[:, None] * rigid.rigid_normal) / np.abs(rigid.rigid_normal).max(axis=0)
    return np.asarray(pressure + shares @ np.linalg.solve(balance @ shares, needed - carried))


def pressure_at(surface: ContactSurface, text: str) -> Array:
    """Return the pressures at the nodes of a surface (n,), MPa, by a CSV file or an expression in x, y, z.

    Raises:
        CaseError: the file cannot be read, or does not reach over the surface; the expression is none.
    """
    path = Path(text)
    if path.suffix == ".csv" or path.is_file():
        table = read_profile(path, "--pressure", {"pressure": "MPa"})
        try:
            return np.asarray(profiled(surface, Profile.model_construct(**table)).profile)
        except CaseError as error:
            raise CaseError([InputError("--pressure", problem.message) for problem in error.problems]) from None
    place = {name: surface.x[:, k] for k, name in enumerate("xyz" if surface.dim == 3 else "xz")}
    try:
        return np.asarray(parse_expression(text)(place) + np.zeros(len(surface.weights)))
    except (ValueError, KeyError) as error:
        raise CaseError(
            InputError(
                "--pressure", f"expected a CSV file or an expression in {', '.join(place)}, got {text!r}: {error}"
            )
        ) from None


def _depth(system: Tribosystem, states: Sequence[SteadyState | FinalShape], shares: Array) -> Array:
    """Return the depth to take off (n,), mm: the mean of the shapes less the rigid motion that leaves the least."""
    shapes = [state.depth if isinstance(state, FinalShape) else state.closest_shape for state in states]
    pressed = np.any([_steady_pressures(state).any(axis=0) for state in states], axis=0)
    mean = shares @ np.array(shapes)
    return mean if system.law.sticks else _least(system, mean, pressed)


def _least(system: Tribosystem, shape: Array, pressed: Mask) -> Array:
    """Return a shape less the rigid motion that leaves the least of it (n,), mm."""
    depth = shape - _least_motion(system, shape, pressed)
    return np.where(depth > ROUNDED * depth.max(), depth, 0.0)


def _evened(systems: Sequence[Tribosystem], shares: Array, start: Array) -> Array:
    """Return the shape next to one on which all loads together wear evenly (n,), mm; collective.

    Raises:
        ConvergenceError: none is found.
    """
    system = systems[0]
    compliance = system.elastic.interface.compliance(np.mean(system.phases.ratios(), axis=0))

    def advance(depth: Array) -> tuple[Array, tuple[Array, Mask], bool]:
        pressures = [_pressures(loaded, depth) for loaded in systems]
        uneven, rest, total = _uneven(systems, shares, pressures)
        carried = shares @ np.array([p.sum(axis=0) for p in pressures])
        off = compliance.apply(rest * (carried.sum() / total.sum()))
        return depth + off, (depth, carried > 0), uneven < EVEN

    failure = "the shape that all loads wear evenly did not converge. Give loads that differ less"
    return _least(system, *fixed_point(advance, start, lambda *_: False, failure, team=system.team))


def _least_motion(system: Tribosystem, shape: Array, where: Mask) -> Array:
    """Return the rigid motion of the free parts that leaves a shape above zero and the least of it (n,), mm.

    Raises:
        ConvergenceError: there is none.
    """
    modes, scale = system.rigid.rigid_normal / system.rigid.mode_lengths, float(np.abs(shape[where]).max()) or 1.0
    weights = system.pair.weights / system.pair.weights.sum()
    solution = scipy.optimize.linprog(
        -(weights * where) @ modes, A_ub=modes[where], b_ub=shape[where] / scale, bounds=(None, None)
    )
    if solution.x is None:
        raise ConvergenceError("no shape to machine exists: material would have to be added somewhere in each")
    depth = shape - scale * (modes @ solution.x)  # to the programme's tolerance, which a clipped depth would show
    touching = np.flatnonzero(where)[solution.ineqlin.marginals < 0]
    return np.asarray(shape - depth + modes @ np.linalg.lstsq(modes[touching], depth[touching], rcond=None)[0])


def _steady_pressures(state: SteadyState | FinalShape) -> Array:
    """Return the pressures of every phase or time step of a cycle (phases, n), MPa."""
    return state.pressures if isinstance(state, FinalShape) else state.phase_pressure


def _pressures(system: Tribosystem, depth: Array) -> Array:
    """Return the pressures of the first cycle on a shape (phases, n), MPa; collective."""
    if system.law.sticks:
        problem = system.law_state.problem
        made = problem.beginning(replace(problem.unworn(), punch=depth))
        return TimeStepRecords.joined(problem.cycle(made)[1]).pressure
    worn = replace(system.unworn(), punch=depth)
    phases = range(len(system.motion.phases))
    return np.array([system.phase_contact((k,)).solve(system.gap(k, worn)).pressure[0] for k in phases])


def _uneven(systems: Sequence[Tribosystem], shares: Array, pressures: Sequence[Array]) -> tuple[float, Array, Array]:
    """Return the share of the wear in all loads that no rigid motion follows, this part (n,), and the wear (n,)."""
    worn = [
        share * loaded.phases.mean_wear.opening(p)[0]
        for loaded, share, p in zip(systems, shares, pressures, strict=True)
    ]
    total, pressed = np.sum(worn, axis=0), np.any([p.any(axis=0) for p in pressures], axis=0)
    modes, rest = systems[0].rigid.rigid_normal[pressed], np.zeros_like(total)
    rest[pressed] = total[pressed] - modes @ np.linalg.lstsq(modes, total[pressed], rcond=None)[0]
    return float(np.abs(rest).max() / total.max()), rest, total


def _tolerance(system: Tribosystem, goal: Array, depth: Array) -> float:
    """Return the amplitude of a wave over the contact that changes the pressure by a share of its scale, mm."""
    scale = pressure_scale(system, goal)
    small = PROBE * system.law.elastic_length(system) * scale
    before, surface, amplitudes = _pressures(system, depth), system.pair.punch, []
    for s in surface.places.T:
        wave = np.cos(2 * np.pi * (s - s.min()) / np.ptp(s))
        change = _pressures(system, depth + small * (1 + wave)) - before
        amplitudes.append(small * ALLOWED * scale / float(np.abs(change).max()))
    return min(amplitudes)
