"""The computations behind the comparison: each made once, from the built-in cases, with nothing fitted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, assemble
from fenwear.case import load_case
from fenwear.cycle import Steady, growth_rate, jump, march, monotonic, steady
from fenwear.paper.published import PEAK_HALF_CYCLE, TEMPERATURE_HALF_CYCLE, VELOCITIES

TRANSIENT = 100  # half-cycles in which the flat punch's edges carry the largest pressure


@dataclass(frozen=True)
class Scope:
    """How much is computed; the default is the whole comparison.

    Attributes:
        settings: Overrides of every case, such as a coarser mesh.
        shares: Values of kappa that runs with heat take.
        half_cycles: Length of the runs that the table shows, at least as long as the paper's.
        cycles: Length of the runs without heat, by cycle jumps.
        variants: Half-cycles of the runs that show what open choices change.
        variant_shares: Their values of kappa: one stable, one unstable.
        meshes: Elements along the contact and their degree, of the convergence study.
        steps: Time steps of heat in a half-cycle, of the convergence study.
    """

    settings: tuple[str, ...] = ()
    shares: tuple[float, ...] = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    half_cycles: int = 2620
    cycles: int = 20_000
    variants: int = 600
    variant_shares: tuple[float, ...] = (0.2, 0.5)
    meshes: tuple[tuple[int, int], ...] = ((8, 2), (8, 4), (16, 2), (16, 4), (32, 2), (32, 4))
    steps: tuple[int, ...] = (5, 10, 20)

    def __post_init__(self) -> None:
        if self.half_cycles <= max(TEMPERATURE_HALF_CYCLE, PEAK_HALF_CYCLE):
            raise ValueError(f"expected runs of more than {TEMPERATURE_HALF_CYCLE} half-cycles, as in the paper")


FULL = Scope()


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
    """A run from the cold, flat, unworn start with one value of kappa.

    Attributes:
        share: kappa.
        x: Along the contact (n,), mm.
        mean: Mean pressure, MPa.
        steady: The states that need no run.
        pressure: Of every half-cycle (k, n), MPa; likewise
        wear: worn depth, mm,
        temperature: temperature of the punch's contact surface at the end, K,
        width: width in contact (k,), mm, and
        friction: friction heat (k,), mJ.
    """

    share: float
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
        """Number of each half-cycle (k,)."""
        return np.arange(1, len(self.pressure) + 1)

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
        """Largest pressure on the middle third of the contact in each half-cycle (k,), MPa."""
        return np.asarray(self.pressure[:, np.abs(self.x) <= self.x[-1] / 3].max(axis=1))

    @property
    def opened(self) -> int | None:
        """First half-cycle in which the middle of the contact is open, None where it never is."""
        found = np.flatnonzero(self.pressure[:, self.centre] <= 0)
        return int(found[0]) + 1 if len(found) else None

    @property
    def bulged(self) -> slice:
        """The half-cycles after the first ones, whose pressure gathers at the flat punch's edges."""
        return slice(TRANSIENT, None)

    @property
    def peak_half_cycle(self) -> int:
        """Half-cycle of the largest pressure once the punch has bulged."""
        return TRANSIENT + 1 + int(self.peak[self.bulged].argmax())

    @property
    def repetition(self) -> Array:
        """Largest change of temperature along the contact against one cycle earlier (k - 2,), K."""
        return np.asarray(np.abs(self.temperature[2:] - self.temperature[:-2]).max(axis=1))

    def at(self, half_cycle: int) -> int:
        """Return the row of a half-cycle."""
        return half_cycle - 1


@dataclass(frozen=True)
class Variant:
    """One choice of what the paper leaves open, or of the discretisation, at one value of kappa.

    Attributes:
        group: What kind of choice.
        name: Which.
        share: kappa.
        steady: The states that need no run.
        narrowest: Least width in contact of the run, mm.
        peak: Largest pressure on the middle third of the contact once the punch has bulged, MPa.
        central: Largest pressure at x = 0, mean of both directions, MPa.
    """

    group: str
    name: str
    share: float
    steady: SteadyHeat
    narrowest: float
    peak: float
    central: float


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
def neutral_share(scope: Scope = FULL) -> float | None:
    """Return the kappa above which the periodic state of Example 1 is unstable, to 1e-3; None beyond the scope's.

    Collective. The growth rate has a kink there, where another disturbance becomes the least stable: by bisection.
    """
    system, low, high = _prepared("example1-heat", scope.settings), min(scope.shares), max(scope.shares)

    def grows(share: float) -> bool:
        varied = system.vary(f"heat.partition={share}")
        return growth_rate(varied, steady(varied).phase_pressure) > 0

    if grows(low) or not grows(high):
        return None
    while high - low > 1e-3:
        half = (low + high) / 2
        low, high = (low, half) if grows(half) else (half, high)
    return (low + high) / 2


@cache
def _prepared(name: str, settings: tuple[str, ...]) -> Tribosystem:
    return assemble(load_case(name, settings))


def _run(system: Tribosystem, half_cycles: int) -> HeatRun:
    blocks = list(march(system, half_cycles))
    heats = [block.heat for block in blocks if block.heat is not None]
    heat = system.heat
    return HeatRun(
        float("nan") if heat is None else heat.partition,
        system.pair.x,
        system.rigid.mean_pressure,
        steady_heat(system),
        np.concatenate([block.pressure for block in blocks]),
        np.concatenate([block.wear for block in blocks]),
        np.concatenate([h.temperature_punch for h in heats]),
        np.concatenate([block.contact_width for block in blocks]),
        np.concatenate([h.terms[:, 0] for h in heats]),
    )


@cache
def heat_runs(name: str, scope: Scope = FULL) -> tuple[HeatRun, ...]:
    """Return the runs of an example with heat, one for each share; collective."""
    system = _prepared(name, scope.settings)
    return tuple(_run(system.vary(f"heat.partition={share}"), scope.half_cycles) for share in scope.shares)


HINGES = ((40, 80), (20, 40), (20, 60), (60, 90))  # mm above the contact; first the built-in case's
SUPPORTS = {
    "strip fixed at the bottom only": ("strip.supports=[{on='strip_bottom', fix=['x', 'z']}]",),
    "strip's bottom free to slide, ends fixed": (
        "strip.supports=[{on='strip_bottom', fix=['z']}, {on='strip_ends', fix=['x']}]",
    ),
}
MOVING = {"strip in 5 positions of its stroke": ("geometry.parameters.overlap=3", "motion.positions=5")}
AS_BUILT_IN = "Example 1 as it is"


@cache
def open_choices(scope: Scope = FULL) -> tuple[Variant, ...]:
    """Return what each open choice changes; the first of each example is the built-in case itself; collective."""
    base = _prepared("example1-heat", scope.settings)
    variants = [*_variants(base, scope, "example 1", AS_BUILT_IN)]
    for key, name in (
        ("heat.debris=0.1", "gamma_d = 0.1"),
        ("heat.debris=0.2", "gamma_d = 0.2"),
        ("heat.conducting=nominal", "open nodes conduct, too"),
        ("heat.coupling=split", "heat and contact in turn, relaxed by 0.5"),
    ):
        variants += _variants(base.vary(key), scope, "example 1", name)
    for name, keys in {"plane strain": ("model.plane=strain",), **SUPPORTS, **MOVING}.items():
        variants += _variants(assemble(load_case("example1-heat", (*scope.settings, *keys))), scope, "example 1", name)
    built_in = _prepared("example2-heat", scope.settings)
    variants += _variants(built_in, scope, "example 2", f"Example 2, hinges at {HINGES[0][0]} and {HINGES[0][1]} mm")
    for low, high in HINGES[1:]:
        heights = (f"geometry.parameters.pin_height_1={low}", f"geometry.parameters.pin_height_2={high}")
        system = assemble(load_case("example2-heat", (*scope.settings, *heights)))
        variants += _variants(system, scope, "example 2", f"hinges at {low} and {high} mm")
    return tuple(variants)


@cache
def convergence(scope: Scope = FULL) -> tuple[Variant, ...]:
    """Return the same numbers on other meshes and with other time steps of heat; collective."""
    variants: list[Variant] = []
    for elements, degree in scope.meshes:
        mesh = (f"geometry.parameters.elements_along_contact={elements}", f"geometry.degree={degree}")
        system = assemble(load_case("example1-heat", (*scope.settings, *mesh)))
        variants += _variants(system, scope, "mesh", f"{elements} elements of degree {degree}")
    for steps in scope.steps:
        system = _prepared("example1-heat", scope.settings).vary(f"heat.steps={steps}")
        variants += _variants(system, scope, "steps", f"{steps} time steps in a half-cycle")
    return tuple(variants)


def _variants(system: Tribosystem, scope: Scope, group: str, name: str) -> list[Variant]:
    found = []
    for share in scope.variant_shares:
        run = _run(system.vary(f"heat.partition={share}"), scope.variants)
        numbers = (run.width.min(), run.middle_pressure[run.bulged].max(), run.central_pressure[run.bulged].max())
        found.append(Variant(group, name, share, run.steady, *(float(number) for number in numbers)))
    return found
