"""The computations behind the comparison: each made once, from the built-in cases under the readings of the scope."""

from __future__ import annotations

from functools import cache

import numpy as np

from fenwear import vary
from fenwear.case import load_case
from fenwear.steps import growth_rate, jump, march, monotonic, steady
from fenwear.system import Tribosystem, assemble
from fenwear_verify.paper.published import (
    MONOTONIC_TEMPERATURE,
    PERIODIC_TEMPERATURE,
    VELOCITIES,
)
from fenwear_verify.paper.readings import Reading
from fenwear_verify.paper.relaxed import Course, run_relaxed
from fenwear_verify.paper.states import FULL, HeatRun, NoHeat, Scope, StabilityMap, SteadyHeat, Variant, middle


@cache
def velocities(scope: Scope = FULL) -> tuple[dict[str, float], ...]:
    """Return the wear velocities of the paper's table, in its order; collective."""
    found: list[dict[str, float]] = []
    systems = {row.case: assemble(load_case(row.case, scope.settings)) for row in VELOCITIES}
    for row in VELOCITIES:
        found.append(systems[row.case].optimum(row.direction).velocity)
    return tuple(found)


@cache
def no_heat(name: str, scope: Scope = FULL) -> NoHeat:
    """Return an example without heat, directly and by a run of cycle jumps; collective."""
    system = assemble(load_case(name, scope.settings))
    *_, last = jump(system, 2 * scope.cycles, tolerance=system.case.run.jump_tolerance)
    return NoHeat(system.pair.x, system.rigid.mean_pressure, steady(system), last.pressure[-2:])


def steady_heat(system: Tribosystem) -> SteadyHeat:
    """Return the states of a system that need no run; collective."""
    state, centre = steady(system), middle(system.pair.x)
    if state.heat is None:  # the built-in cases with heat have it
        raise ValueError("expected a case with heat")
    at_middle = float(state.heat.punch[:, centre].max())
    alone = float(monotonic(system).periodic_punch[centre])
    return SteadyHeat(alone, at_middle, growth_rate(system, state.phase_pressure, state.conductances), state)


@cache
def _prepared(name: str, settings: tuple[str, ...]) -> Tribosystem:
    return assemble(load_case(name, settings))


def _run(system: Tribosystem, half_cycles: int, reading: Reading) -> HeatRun:
    if reading.relaxed is None:
        course = _marched(system, half_cycles)
    else:
        course = run_relaxed(system, half_cycles, reading.relaxed)
    return HeatRun(reading, system.pair.x, system.rigid.mean_pressure, steady_heat(system), *course)


def _marched(system: Tribosystem, half_cycles: int) -> Course:
    blocks = list(march(system, half_cycles))
    heats = [block.heat for block in blocks if block.heat is not None]
    return Course(
        np.concatenate([block.pressure for block in blocks]),
        np.concatenate([block.wear for block in blocks]),
        np.concatenate([h.temperature_punch for h in heats]),
        np.concatenate([block.contact_width for block in blocks]),
        np.concatenate([h.terms[:, 0] for h in heats]),
    )


@cache
def heat_runs(scope: Scope = FULL) -> tuple[HeatRun, ...]:
    """Return the runs of Example 1 with heat, one for each reading; collective."""
    base = _prepared("example1-heat", scope.settings)
    return tuple(_run(vary(base, *r.settings, *r.alone), scope.half_cycles, r) for r in scope.readings)


@cache
def central_runs(scope: Scope = FULL) -> tuple[HeatRun | None, ...]:
    """Return the shorter runs of Example 2 with heat, None for what concerns Example 1 alone; collective."""
    base = _prepared("example2-heat", scope.settings)
    found: list[HeatRun | None] = []
    for reading in scope.readings:
        late = reading.relaxed is not None or reading.counted == "steps of heat"
        length = scope.half_cycles if late else scope.central
        found.append(None if reading.alone else _run(vary(base, *reading.settings), length, reading))
    return tuple(found)


PANELS = (("faces insulated, gamma_d = 0", False, 0.0), ("faces insulated, gamma_d = 1/2", False, 0.5),
          ("faces convect, gamma_d = 0", True, 0.0))  # fmt: skip


@cache
def stability_maps(scope: Scope = FULL) -> tuple[StabilityMap, ...]:
    """Return growth rates over conductance and heat, and where the paper's two temperatures are met; collective.

    Both temperatures are linear in kappa as long as the same nodes conduct, as they do in the periodic state,
    whose pressure no heat changes.
    """
    return tuple(_stability_map(scope, *panel) for panel in PANELS)


def _stability_map(scope: Scope, name: str, faces: bool, debris: float) -> StabilityMap:
    base = _prepared("example1-heat", (*scope.settings, MAP_MESH, f"heat.convecting_faces={str(faces).lower()}"))
    shares, growth = np.array(scope.shares), np.full((len(scope.conductances), len(scope.shares)), np.nan)
    lines = np.empty((2, len(scope.conductances)))
    for row, conductance in enumerate(scope.conductances):
        there = vary(base, f"heat.conductance={1e-3 * conductance}", f"heat.debris={debris}")
        kappas = shares / (1 - debris)
        states = {}
        for column, kappa in enumerate(kappas):
            if kappa <= 1:
                states[column] = steady_heat(vary(there, f"heat.partition={kappa}"))
                growth[row, column] = states[column].growth
        first, last = min(states), max(states)
        a, b = (np.array([states[k].monotonic, states[k].periodic]) for k in (first, last))
        targets = np.array([float(MONOTONIC_TEMPERATURE), float(PERIODIC_TEMPERATURE)])
        lines[:, row] = shares[first] + (shares[last] - shares[first]) * (targets - a) / (b - a)
    return StabilityMap(name, faces, debris, np.array(scope.conductances), shares, growth, *lines)


HINGES = ((40, 80), (20, 40), (20, 60), (60, 90))  # mm above the contact; first the built-in case's
SUPPORTS = {
    "strip fixed at the bottom only": ("strip.supports=[{on='strip_bottom', fix=['x', 'z']}]",),
    "strip's bottom free to slide, ends fixed": (
        "strip.supports=[{on='strip_bottom', fix=['z']}, {on='strip_ends', fix=['x']}]",
    ),
}
COUPLINGS: dict[str, tuple[str, ...]] = {
    "heat and contact in turn, relaxed by 0.1": ("heat.coupling=split", "heat.relaxation=0.1"),
    "heat and contact in turn, relaxed by 0.5": ("heat.coupling=split",),
    "heat and contact together": (),
}
MOVING = {"strip in 5 positions of its stroke": ("geometry.parameters.overlap=3", "motion.positions=5")}
AS_BUILT_IN = "Example 1 as it is"
MAP_MESH = "geometry.parameters.elements_along_contact=8"  # of the map: growth rates within 1e-4 of the built-in mesh's


@cache
def open_choices(scope: Scope = FULL) -> tuple[Variant, ...]:
    """Return what each open choice changes; the first of each example is the built-in case itself; collective."""
    base = _prepared("example1-heat", scope.settings)
    variants = [_variant(base, scope, "example 1", AS_BUILT_IN)]
    for key, name in (
        ("heat.debris=0.4", "gamma_d = 0.4"),
        ("heat.debris=0.6", "gamma_d = 0.6"),
        ("heat.partition=0.4", "kappa = 0.4"),
        ("heat.partition=0.6", "kappa = 0.6"),
        ("heat.conducting=nominal", "open nodes conduct, too"),
    ):
        variants.append(_variant(vary(base, key), scope, "example 1", name))
    for name, keys in {"plane strain": ("model.plane=strain",), **SUPPORTS, **MOVING}.items():
        variants.append(_variant(vary(base, *keys), scope, "example 1", name))
    built_in = _prepared("example2-heat", scope.settings)
    variants.append(
        _variant(built_in, scope, "example 2", f"Example 2, hinges at {HINGES[0][0]} and {HINGES[0][1]} mm")
    )
    for low, high in HINGES[1:]:
        heights = (f"geometry.parameters.pin_height_1={low}", f"geometry.parameters.pin_height_2={high}")
        variants.append(_variant(vary(built_in, *heights), scope, "example 2", f"hinges at {low} and {high} mm"))
    return tuple(variants)


@cache
def convergence(scope: Scope = FULL) -> tuple[Variant, ...]:
    """Return the same numbers on other meshes, with other time steps of heat and other couplings; collective."""
    base, variants = _prepared("example1-heat", scope.settings), []
    for elements, degree in scope.meshes:
        mesh = (f"geometry.parameters.elements_along_contact={elements}", f"geometry.degree={degree}")
        variants.append(_variant(vary(base, *mesh), scope, "mesh", f"{elements} elements of degree {degree}"))
    for steps in scope.steps:
        system = vary(base, f"heat.steps={steps}")
        variants.append(_variant(system, scope, "steps", f"{steps} time steps in a half-cycle"))
    for name, keys in COUPLINGS.items():
        variants.append(_variant(vary(base, *keys), scope, "coupling", name))
    return tuple(variants)


def _variant(system: Tribosystem, scope: Scope, group: str, name: str) -> Variant:
    run = _run(system, scope.variants, scope.readings[0])
    numbers = (
        run.at_centre(scope.variants),
        run.width.min(),
        run.middle_pressure[run.bulged].max(),
        run.central_pressure[run.bulged].max(),
    )
    return Variant(group, name, run.steady, *(float(number) for number in numbers))
