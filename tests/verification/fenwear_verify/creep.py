"""Creep: a sphere that sinks into a body of growing compliance, and the decay of pressures where creep and wear act."""

from __future__ import annotations

import numpy as np
from scipy.integrate import quad

from fenwear.case import changed_case
from fenwear.common.arrays import Array
from fenwear.steps import decay_rates, growth_rate, march
from fenwear.system import Tribosystem, assemble
from fenwear_verify.bodies import rigid_punch
from fenwear_verify.half_space import disc_case
from fenwear_verify.solid import MODULUS, RIGID, STEEL
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, verification
from fenwear_verify.wear import HALF_WIDTH, MEAN, STROKE, stiffness_rates

GROWTH = 1.0  # of the compliance in the end; with it J(tau)/J(0) = 2 - 1/e
RADIUS, FORCE = 10.0, 200.0
SLOW, FAST = -0.3819660, -2.6180340


def _creeping_sphere(across: int, steps: int) -> Tribosystem:
    """Return a rigid sphere on a body whose retardation time is so many half-cycles, as many elements under it."""
    places = np.linspace(0, 0.3, 4 * across + 1)
    shape = [[float(r), float(r * r / (2 * RADIUS))] for r in (*places, 0.35)]
    return assemble(
        changed_case(
            disc_case(0.3, across, materials=(RIGID, STEEL)),
            f"punch.profile={{points={shape}}}",
            f"strip.creep={{terms=[{{compliance={GROWTH}, time=1}}]}}",
            f"motion.duration={1 / steps!r}",
            f"run.half_cycles={steps}",
        )
    )


def _radius(time: float) -> float:
    """Return a of the sphere, mm."""
    first = (3 * FORCE * RADIUS / (4 * MODULUS)) ** (1 / 3)
    return float(first * (1 + GROWTH * -np.expm1(-time)) ** (1 / 3))


def _pressure(r: float, time: float) -> float:
    """Return the pressure after Lee and Radok: that of all spheres' since, each relaxing from when it was."""

    def shape(since: float) -> float:
        return float(np.sqrt(max(_radius(since) ** 2 - r * r, 0.0)))

    rate = 1 + GROWTH
    faded, _ = quad(lambda since: shape(since) * GROWTH * np.exp(-rate * (time - since)), 0, time, limit=400)
    return 2 * MODULUS / (np.pi * RADIUS) * (shape(time) - faded)


@verification(
    "creep-sphere",
    "A rigid sphere under a constant load on a body that creeps",
    "E. H. Lee and J. R. M. Radok, J. Appl. Mech. 27, 1960, 438: a / a_0 = (J / J_0)^(1/3), 1.177382 after one "
    "retardation time of J / J_0 = 2 - exp(-t / tau); the pressure is no longer Hertz's",
)
def creep_sphere() -> Result:
    """Indentation delta = a² / R over the first one, and pressures; how their errors fall with elements and steps."""
    exact, rows, lines = (2 - np.exp(-1)) ** (1 / 3), list[Row](), list[Line]()
    rows.append(number("a / a_0, the row's number", 1.177382, exact, 1e-6))
    dense = np.linspace(0, 0.3, 200)
    deepest = _pressure(0.0, 1.0)
    indented, in_time = [], []
    for across in (16, 32):
        system = _creeping_sphere(across, 16)
        first = system.phase_contact((0,)).solve(system.gap(0, system.unworn()))
        last = list(march(system, 16))[-1]
        grown = float(np.sqrt(last.rigid[-1, 0] / first.rigid[0, 0]))
        indented.append(abs(grown - exact))
        rows.append(number(f"{across} elements: a / a_0, from the indentation", exact, grown, 1e-3))
    rows.append(order("order of its error with the elements", 0.5, indented, 0.4))
    for steps in (8, 16, 32):
        system = _creeping_sphere(32, steps)
        last = list(march(system, steps))[-1]
        inside = system.pair.x < 0.85 * _radius(1.0)
        r, p = system.pair.x, last.pressure[-1]
        lee = np.array([_pressure(float(one), 1.0) for one in r[inside]])
        in_time.append(float(np.abs(p[inside] - lee).max() / deepest))
        rows.append(
            number(f"{steps} half-cycles in tau: pressure for r < 0.85 a (MPa)", 0.0, in_time[-1], 0.01, scale=1)
        )
        lines.append(Line(f"{steps} half-cycles", r, p))
    rows.append(order("order of the pressure's error with the half-cycles", 1, in_time, 0.3))
    reference = Line("Lee and Radok", dense, np.array([_pressure(float(r), 1.0) for r in dense]), reference=True)
    hertz = 1.5 * FORCE / (np.pi * _radius(1.0) ** 2) * np.sqrt(np.maximum(1 - (dense / _radius(1.0)) ** 2, 0))
    lines = [reference, Line("Hertz, of the same radius", dense, hertz, reference=True), *lines]
    return Result(rows, [Plot("Sphere on a body that creeps, t = tau", "r (mm)", "pressure (MPa)", lines)])


def _galin(step: float, rate: float) -> Tribosystem:
    """Return Galin's punch, of which a half-cycle wears off this share of its slowest mode, on a strip that creeps."""
    fine = ("geometry.parameters.elements_along_contact=16", "geometry.degree=2", "geometry.parameters.edge_grading=4")
    wear = f"wear.punch.coefficient={step * HALF_WIDTH / 2e5 / STROKE / rate!r}"
    half_period = rigid_punch(1e4, *fine).motion.period / 2
    creep = f"strip.creep={{terms=[{{compliance={GROWTH}, time={half_period / step!r}}}]}}"
    return rigid_punch(1e4, *fine, wear, creep)


@verification(
    "galin-creep",
    "A flat punch on a half-plane that wears and creeps at constant load: growth rates of disturbances",
    "lambda² + lambda (r + (1 + dJ) / tau) + r / tau = 0 of each mode whose rate without creep is r: with dJ = 1, "
    "r tau = 1: -0.3819660 and -2.6180340 in 1 / tau",
)
def galin_creep() -> Result:
    """The slowest mode's two rates by the growth rate of the state, as steps get small; and one from a march."""
    rows: list[Row] = []
    fine = ("geometry.parameters.elements_along_contact=16", "geometry.degree=2", "geometry.parameters.edge_grading=4")
    rate, even_rate = (float(one) for one in stiffness_rates(rigid_punch(1e4, *fine), 2e5)[:2])
    errors: tuple[list[float], list[float]] = ([], [])
    for step in (0.02, 0.01, 0.005):
        system = _galin(step, rate)
        even = np.full((2, len(system.pair.x)), MEAN)
        unit = system.motion.period / 2 / step  # tau
        slow, all_rates = growth_rate(system, even) * unit, decay_rates(system, even) * unit
        fast = float(all_rates[np.abs(all_rates - FAST).argmin()])
        for exact, found, wrong, name in ((SLOW, slow, errors[0], "slow"), (FAST, fast, errors[1], "fast")):
            wrong.append(abs(found - exact))
            within = 5e-2 * step / 0.02
            rows.append(number(f"{step:g} tau in a half-cycle: {name} rate (1/tau)", exact, found, within))
    rows += [
        order(f"order of the {n} rate's error", 1, one, 0.1) for n, one in zip(("slow", "fast"), errors, strict=True)
    ]
    return Result([*rows, _decay(even_rate)])


def _decay(rate: float) -> Row:
    """Return the slow rate of the slowest even mode from a march so long that nothing else is left of the pressure."""
    step, begin, end = 0.02, 2000, 2100
    system = _galin(step, rate)
    pressure = np.concatenate([block.pressure for block in march(system, end, implicit=True)])
    one, other = (_away(system, pressure[n - 1]) for n in (begin, end))
    found = np.log(other / one) / (end - begin) / step
    return number(f"{step:g} tau in a half-cycle, march: slow rate of the slowest even mode (1/tau)", SLOW, found, 2e-3)


def _away(system: Tribosystem, pressure: Array) -> float:
    """Return how far a pressure is from the mean."""
    return float(np.sqrt(system.pair.weights @ (pressure - MEAN) ** 2))
