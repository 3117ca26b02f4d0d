"""What the comparison computes: how much of it, and what is read off its runs and states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fenwear.common.arrays import Array
from fenwear.steps import SteadyState
from fenwear_verify.paper.published import (
    PEAK_HALF_CYCLE,
    TEMPERATURE_HALF_CYCLE,
)
from fenwear_verify.paper.readings import READINGS, Reading

STEPS = 5  # of heat in a half-cycle, the paper's
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
    state: SteadyState
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
    state: SteadyState

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


def _first_crossing(x: Array, values: Array) -> float:
    """Return where values over x first rise above zero, linear between them; NaN where they never do."""
    for k in range(len(x) - 1):
        a, b = values[k], values[k + 1]
        if a <= 0 < b:
            return float(x[k] - a * (x[k + 1] - x[k]) / (b - a))
    return float("nan")
