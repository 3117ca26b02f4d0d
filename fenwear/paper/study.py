"""The computations behind the comparison: each made once, from the built-in cases under the readings of the scope."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fenwear import vary
from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, assemble
from fenwear.case import load_case
from fenwear.cycle import Steady, growth_rate, jump, march, monotonic, steady
from fenwear.paper.published import (
    MONOTONIC_TEMPERATURE,
    PEAK_HALF_CYCLE,
    PERIODIC_TEMPERATURE,
    TEMPERATURE_HALF_CYCLE,
    VELOCITIES,
)
from fenwear.paper.readings import READINGS, Reading
from fenwear.paper.relaxed import Course, run_relaxed

TRANSIENT = 100  # half-cycles in which the flat punch's edges carry the largest pressure


@dataclass(frozen=True)
class Scope:
    """How much is computed; the default is the whole comparison.

    Attributes:
        settings: Overrides of every case, such as a coarser mesh.
        readings: What runs with heat take for what the paper leaves open; first the built-in cases' values.
        half_cycles: Length of the runs that the table shows, at least as long as the paper's.
        central: Length of the runs of Example 2, whose largest pressure comes early.
        cycles: Length of the runs without heat, by cycle jumps.
        variants: Half-cycles of the runs that show what other open choices, mesh and time step change.
        meshes: Elements along the contact and their degree, of the convergence study.
        steps: Time steps of heat in a half-cycle, of the convergence study.
        conductances: Of the map of stability, W/(m² K).
        shares: What the punch gets of the friction heat, kappa (1 - gamma_d), of the map of stability.
    """

    settings: tuple[str, ...] = ()
    readings: tuple[Reading, ...] = READINGS
    half_cycles: int = 2620
    central: int = 600
    cycles: int = 20_000
    variants: int = 600
    meshes: tuple[tuple[int, int], ...] = ((8, 2), (8, 4), (16, 2), (16, 4), (32, 4))
    steps: tuple[int, ...] = (5, 10, 20)
    conductances: tuple[float, ...] = (0, 20, 40, 60, 80, 120, 160, 200)
    shares: tuple[float, ...] = (0.1, 0.15, 0.175, 0.2, 0.225, 0.25, 0.275, 0.3, 0.4, 0.5, 0.6)

    def __post_init__(self) -> None:
        if self.half_cycles <= max(TEMPERATURE_HALF_CYCLE, PEAK_HALF_CYCLE):
            raise ValueError(f"expected runs of more than {TEMPERATURE_HALF_CYCLE} half-cycles, as in the paper")


FULL = Scope()
# The best known readings, and a coarser look at the rest: what `verify` shows when nothing else is asked for.
BRIEF = Scope(readings=READINGS[:4], meshes=((8, 4), (16, 4)), steps=(10, 5), conductances=(0, 40, 80, 140, 200))


@dataclass(frozen=True)
class NoHeat:
    """An example without heat.

    Attributes:
        x: Along the contact (n,), mm.
        mean: Mean pressure, MPa.
        state: The cyclic steady state.
        marched: Pressures of both directions after the scope's cycles from the flat punch (2, n), MPa.
    """

    x: Array
    mean: float
    state: Steady
    marched: Array


@dataclass(frozen=True)
class SteadyHeat:
    """The states with heat that need no run.

    Attributes:
        monotonic: Temperature of the punch at x = 0 from the two one-way motions, each heating half of the time, K.
        periodic: The same at the end of a half-cycle of the cyclic steady state, K.
        growth: Rate at which the least stable disturbance of this state grows, 1/s.
        state: The cyclic steady state.
    """

    monotonic: float
    periodic: float
    growth: float
    state: Steady

    @property
    def difference(self) -> float:
        """How far the two temperatures are apart, % of the periodic one, as in the paper."""
        return 100 * (self.periodic - self.monotonic) / self.periodic


@dataclass(frozen=True)
class HeatRun:
    """A run from the cold, flat, unworn start under one reading.

    Attributes:
        reading: What it takes for what the paper leaves open.
        x: Along the contact (n,), mm.
        mean: Mean pressure, MPa.
        steady: The states that need no run.
        pressure: Of every half-cycle (k, n), MPa; likewise
        wear: worn depth, mm,
        temperature: temperature of the punch's contact surface at the end, K,
        width: width in contact (k,), mm, and
        friction: friction heat (k,), mJ.
    """

    reading: Reading
    x: Array
    mean: float
    steady: SteadyHeat
    pressure: Array
    wear: Array
    temperature: Array
    width: Array
    friction: Array

    @property
    def half_cycle(self) -> NDArray[np.int64]:
        """The paper's n at the end of each half-cycle (k,)."""
        return self._count * np.arange(1, len(self.pressure) + 1)

    @property
    def _count(self) -> int:
        return STEPS if self.reading.counted == "steps of heat" else 1

    @property
    def one_way(self) -> float:
        """What stands beside the paper's 47.16 K: the mean of the two one-way temperatures, or their sum."""
        return self.steady.monotonic * (2 if self.reading.directions == "sum" else 1)

    @property
    def centre(self) -> int:
        """Index of the node in the middle of the contact."""
        return middle(self.x)

    @property
    def peak(self) -> Array:
        """Largest pressure of each half-cycle (k,), MPa."""
        return np.asarray(self.pressure.max(axis=1))

    @property
    def central_pressure(self) -> Array:
        """Pressure at x = 0, mean of each half-cycle and the one before it (k - 1,), MPa."""
        central = self.pressure[:, self.centre]
        return np.asarray((central[1:] + central[:-1]) / 2)

    @property
    def middle_pressure(self) -> Array:
        """Largest pressure on the middle two thirds of the contact in each half-cycle (k,), MPa."""
        return np.asarray(self.pressure[:, np.abs(self.x) <= self.x[-1] * 2 / 3].max(axis=1))

    @property
    def opened(self) -> int | None:
        """The paper's n at which the middle of the contact is first open, None where it never is."""
        found = np.flatnonzero(self.pressure[:, self.centre] <= 0)
        return int(self.half_cycle[found[0]]) if len(found) else None

    @property
    def bulged(self) -> slice:
        """The half-cycles after the first ones, whose pressure gathers at the flat punch's edges."""
        return slice(TRANSIENT, None)

    @property
    def peak_half_cycle(self) -> int:
        """The paper's n of the largest pressure on the middle two thirds once the punch has bulged."""
        return int(self.half_cycle[self.bulged][self.middle_pressure[self.bulged].argmax()])

    @property
    def repetition(self) -> Array:
        """Largest change of temperature along the contact against one cycle earlier (k - 2,), K."""
        return np.asarray(np.abs(self.temperature[2:] - self.temperature[:-2]).max(axis=1))

    def at(self, half_cycle: int) -> int:
        """Return the row of the paper's n."""
        return half_cycle // self._count - 1

    def at_centre(self, half_cycle: int) -> float:
        """Return the temperature at x = 0 at the paper's n, K."""
        return float(self.temperature[self.at(half_cycle), self.centre])


@dataclass(frozen=True)
class Variant:
    """One other choice, mesh, time step or coupling, with all else as in the built-in case.

    Attributes:
        group: What kind of choice.
        name: Which.
        steady: The states that need no run.
        late: Temperature at x = 0 at the end of the run, K.
        narrowest: Least width in contact of the run, mm.
        peak: Largest pressure on the middle two thirds of the contact once the punch has bulged, MPa.
        central: Largest pressure at x = 0, mean of both directions, MPa.
    """

    group: str
    name: str
    steady: SteadyHeat
    late: float
    narrowest: float
    peak: float
    central: float


@dataclass(frozen=True)
class StabilityMap:
    """How the periodic state of Example 1 depends on conductance and heat, with all else as in the built-in case.

    Attributes:
        name: What is held.
        faces: Whether the two faces of the plane model convect.
        debris: gamma_d.
        conductance: h_c (c,), W/(m² K).
        share: kappa (1 - gamma_d), what the punch gets of the friction heat (s,).
        growth: Rate of the least stable disturbance (c, s), 1/s; NaN where kappa would be above 1.
        one_way: The share at which the mean of the two one-way temperatures is the paper's (c,).
        periodic: The share at which the periodic state has the paper's temperature (c,).
    """

    name: str
    faces: bool
    debris: float
    conductance: Array
    share: Array
    growth: Array
    one_way: Array
    periodic: Array

    @property
    def neutral(self) -> Array:
        """The share above which the periodic state is unstable (c,); NaN where that is beyond the map."""
        return np.array([_first_crossing(self.share, row) for row in self.growth])


def middle(x: Array) -> int:
    """Return the index of the node nearest to x = 0."""
    return int(np.abs(x).argmin())


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
    return SteadyHeat(alone, at_middle, growth_rate(system, state.phase_pressure), state)


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


def _first_crossing(x: Array, values: Array) -> float:
    """Return where values over x first rise above zero, linear between them; NaN where they never do."""
    for k in range(len(x) - 1):
        a, b = values[k], values[k + 1]
        if a <= 0 < b:
            return float(x[k] - a * (x[k + 1] - x[k]) / (b - a))
    return float("nan")


HINGES = ((40, 80), (20, 40), (20, 60), (60, 90))  # mm above the contact; first the built-in case's
STEPS = 5  # of heat in a half-cycle, the paper's
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
