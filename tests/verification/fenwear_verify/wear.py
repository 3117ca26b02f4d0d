"""Wear: volume, equilibrium, decay of the pressure, the ends of one-way and of cyclic sliding, step limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from fenwear import vary
from fenwear.common.arrays import Array
from fenwear.laws.optimum import WearRates
from fenwear.laws.optimum import optimum as minimal_dissipation
from fenwear.laws.pressure_law import PressureLaw
from fenwear.steps import growth_rate, jump, march, stability_number, steady
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.system import Tribosystem
from fenwear_verify.bodies import builtin, relief_rates, rigid_punch
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, profile, verification

HALF_WIDTH, MEAN = 30.0, 1e4 / 600  # mm; p_m, MPa
COEFFICIENT, STROKE = 1.25e-8 * np.pi, 3.0  # beta~ of the built-in cases, 1/MPa; 2 u0, mm
OPENING = ("contact.friction=0.4", "geometry.parameters.pin_height_1=40")  # the rear edge lifts off


@verification(
    "wear-volume",
    "Worn areas of both bodies in every half-cycle for a = b = 1",
    "beta~ F0 2 u0 / t, whatever the pressure: the integral of p over the contact is F0 / t",
)
def wear_volume() -> Result:
    """Example 1 with full and with partial contact: explicit and implicit half-cycles, and jumps over 20,000.

    Once more with a strip that wears, too, in five positions of its stroke whose nodes do not face the punch's.
    """
    exact = COEFFICIENT * 1e4 * STROKE / 10
    rows: list[Row] = []
    for contact, settings in (("full contact", ()), ("partial contact", OPENING)):
        system = builtin("example1", *settings)
        blocks = {
            "explicit": list(march(system, 40)),
            "implicit": list(march(system, 40, implicit=True)),
            "jumps": list(jump(system, 20_000, tolerance=3e-3)),
        }
        for name, run in blocks.items():
            area = np.concatenate([block.worn_area_increment for block in run])
            rows.append(
                profile(f"{contact}, {name}: per half-cycle (mm²)", np.full_like(area, exact), area, 1e-9, scale=exact)
            )
            total = exact * run[-1].half_cycle[-1]
            rows.append(number(f"{contact}, {name}: in all (mm²)", total, run[-1].wear[-1] @ system.pair.weights, 1e-9))
    return Result([*rows, *_areas_of_both()])


def _areas_of_both() -> list[Row]:
    """Return the comparisons where both bodies wear; what is worn off the strip is counted on its own surface."""
    moving = ("geometry.degree=2", "geometry.parameters.overlap=3", "motion.positions=5")
    strip = 2e-8
    system = builtin("example1", *moving, f"wear.strip.coefficient={strip}")
    exact = {"punch": COEFFICIENT * 1e4 * STROKE / 10, "strip": strip * 1e4 * STROKE / 10}
    weights = {"punch": system.pair.weights, "strip": system.pair.strip.weights}
    rows: list[Row] = []
    for name, run in (
        ("implicit", list(march(system, 20, implicit=True))),
        ("jumps", list(jump(system, 20_000, tolerance=3e-2))),
    ):
        depths = {"punch": run[-1].wear[-1], "strip": run[-1].wear_strip[-1]}
        areas = {"punch": [b.worn_area_increment for b in run], "strip": [b.worn_area_increment_strip for b in run]}
        for body, one in exact.items():
            area = np.concatenate(areas[body])
            what = f"both wear, {name}, {body}"
            rows.append(profile(f"{what}: per half-cycle (mm²)", np.full_like(area, one), area, 1e-9, scale=one))
            total = one * run[-1].half_cycle[-1]
            rows.append(number(f"{what}: in all (mm²)", total, depths[body] @ weights[body], 1e-9))
    return rows


@verification(
    "equilibrium",
    "Force and moment balance in every half-cycle",
    "statics by hand: F0 on the contact, no moment about the pin O",
)
def equilibrium() -> Result:
    """Example 1 with ten times its wear, recomputed from the pressure alone, over 200 half-cycles."""
    rows: list[Row] = []
    for contact, settings in (("full contact", ()), ("partial contact", OPENING)):
        system = builtin("example1", *settings, "wear.punch.coefficient=4e-7")
        x, weights = system.pair.x, system.pair.weights
        friction, height = system.case.contact.friction, 40.0 if settings else 20.0
        block = next(march_within(system, RunLimits(200, block=200)))
        force = block.pressure * weights
        total = force.sum(axis=1)
        arm = force @ (x - HALF_WIDTH) + block.direction * friction * height * total
        rows.append(profile(f"{contact}: force (N/mm)", np.full(200, 1000.0), total, 1e-8, scale=1000))
        rows.append(
            profile(
                f"{contact}: moment of the contact about O (N)",
                np.full(200, -1000 * HALF_WIDTH),
                arm,
                1e-8,
                scale=1000 * HALF_WIDTH,
            )
        )
    return Result(rows)


def half_plane_rates(terms: int = 24) -> Array:
    """Return the decay rates of a wearing half-plane under a flat punch that does not tilt, in E* k V / a, ascending.

    A mode q(x) e^(-r t) without resultant satisfies k V q = r u, u = -(2 / pi E*) int q(s) ln|x - s| ds + const.
    In Legendre polynomials P_n on (-1, 1), -int P_n ln|x - s| ds = 2 (Q_(n-1) - Q_(n+1)) / (2 n + 1) + const and
    int P_m Q_k dx = (1 - (-1)^(m+k)) / ((m - k)(m + k + 1)) (Neumann's formula).
    """
    n: NDArray[Any] = np.arange(1.0, terms + 1)
    m = n[:, None]

    def integral(k: NDArray[Any]) -> NDArray[Any]:
        odd = (m + k) % 2 == 1
        return np.asarray(np.where(odd, 2 / np.where(odd, (m - k) * (m + k + 1), 1), 0.0))

    kernel = 2 / (2 * n + 1) * (integral(n - 1) - integral(n + 1))
    values = scipy.linalg.eigh(np.pi / 2 * np.diag(2 / (2 * n + 1)), (kernel + kernel.T) / 2, eigvals_only=True)
    return np.sort(values)


def stiffness_rates(system: Tribosystem, effective: float) -> Array:
    """Return the same rates of fenwear's interface: eigenvalues of the pressure that a worn depth takes away."""
    values = relief_rates(system, effective) * HALF_WIDTH
    return np.sort(values[values > 1e-6])


def shared_wear(coefficient: float) -> tuple[str, ...]:
    """Return the settings of sliding out of the plane with the wear shared by punch and strip, 2 to 1."""
    return (
        "motion.axis=y",
        f"wear.punch.coefficient={2 * coefficient / 3!r}",
        f"wear.strip.coefficient={coefficient / 3!r}",
    )


@verification(
    "galin",
    "A flat punch on a half-plane that wears at constant load: decay of the pressure",
    "Galin and Goryacheva: 1.7267 and 3.3143; all rates once more by Legendre polynomials",
)
def galin() -> Result:
    """Pressure tends to the mean as a sum of exponentials; the even modes' rates from a march and from eigenvalues.

    An implicit step divides each mode by exactly 1 + rate k 2 u0. The factors of the three slowest are the
    roots of the recurrence that four late shapes of the pressure, ten half-cycles apart, satisfy. Sliding out of
    the plane, where the strip's material stays below the same point of the punch, k is the sum of both bodies'.
    """
    rows: list[Row] = []
    plots: list[Plot] = []
    exact = half_plane_rates()
    rows += [
        number(f"even mode {k}: published against Legendre polynomials (E* k V/a)", p, exact[2 * k - 1], 1e-4)
        for k, p in ((1, 1.7267), (2, 3.3143))
    ]
    fine = ("geometry.parameters.elements_along_contact=32", "geometry.degree=2", "geometry.parameters.edge_grading=8")
    step = 0.02  # E* k V dt / a of a half-cycle
    for plane, effective in (("stress", 2e5), ("strain", 2e5 / (1 - 0.3**2))):
        wear = f"wear.punch.coefficient={step * HALF_WIDTH / effective / STROKE!r}"
        system = rigid_punch(1e4, *fine, f"model.plane='{plane}'", wear)
        for k, rate in enumerate(stiffness_rates(system, effective)[:4]):
            kind = ("odd", "even")[k % 2]
            rows.append(number(f"plane {plane}, eigenvalue, {kind} mode {k // 2 + 1} (E* k V/a)", exact[k], rate, 2e-3))
        growth = growth_rate(system, np.full((2, len(system.pair.x)), MEAN))
        slowest = np.expm1(-growth * system.motion.period / 2) / step
        rows.append(number(f"plane {plane}, growth rate of the slowest mode (E* k V/a)", exact[0], slowest, 2e-3))
        block = next(march_within(system, RunLimits(100, block=100), implicit=True))
        deviation = block.pressure - MEAN
        late = deviation[[50, 60, 70, 80]] * np.sqrt(system.pair.weights)
        recurrence, *_ = np.linalg.lstsq(late[2::-1].T, late[3], rcond=None)
        factors = np.sort(np.roots([1, *-recurrence]).real)[::-1] ** (1 / 10)
        rates = (1 / factors - 1) / step
        rows.append(number(f"plane {plane}, march, even mode 1 (E* k V/a)", 1.7267, rates[0], 2e-3))
        rows.append(number(f"plane {plane}, march, even mode 2 (E* k V/a)", 3.3143, rates[1], 5e-3))
        across = rigid_punch(1e4, *fine, f"model.plane='{plane}'", *shared_wear(step * HALF_WIDTH / effective / STROKE))
        both = next(march_within(across, RunLimits(100, block=100), implicit=True))
        rows.append(
            profile(f"plane {plane}, both bodies wear: pressure (MPa)", block.pressure, both.pressure, 1e-7, scale=MEAN)
        )
        if plane == "stress":
            time = step * block.half_cycle
            size = np.sqrt((deviation**2) @ system.pair.weights) / (MEAN * np.sqrt(2 * HALF_WIDTH))
            slope = size[-1] * (1 + exact[1] * step) ** (100.0 - block.half_cycle)
            plots.append(
                Plot(
                    "Galin: distance of the pressure from its mean",
                    "time (a / E* k V)",
                    "L2 norm / p_m",
                    [Line("fenwear", time, size), Line("slowest even mode", time, slope, reference=True)],
                    ("linear", "log"),
                )
            )
    return Result(rows, plots)


def one_way(direction: str) -> str:
    """Return the setting of one-way sliding, 3 mm in each half-cycle."""
    return f"motion={{kind='one-way', direction='{direction}', speed=3, duration=1}}"


@verification(
    "one-way",
    "One-way sliding tends to the optimum",
    "the minimum of the wear dissipation power, which knows no elasticity (Paczelt and Mroz)",
)
def one_way_sliding() -> Result:
    """Example 1 marched over 1500 half-cycles of fast wear, b = 1/2, 1 and 2, in both directions."""
    rows: list[Row] = []
    lines: list[Line] = []
    for b in (0.5, 1, 2):
        for direction in ("leftward", "rightward"):
            coefficient = f"wear.punch.coefficient={1e-4 * MEAN ** (1 - b)!r}"
            exponent = f"wear.punch.pressure_exponent={b}"
            system = builtin("example1", "geometry.degree=2", one_way(direction), coefficient, exponent)
            block = next(march_within(system, RunLimits(1500, block=1500), implicit=True))
            rates = WearRates((np.full(len(system.pair.x), 3 * 1e-4 * MEAN ** (1 - b)),), (PressureLaw(b),))
            optimum = minimal_dissipation(system.rigid, system.phases.middle_ratio(system.motion.directions[0]), rates)
            x, case = system.pair.x, f"b = {b}, {direction}"
            rows.append(profile(f"{case}: pressure (MPa)", optimum.pressure, block.pressure[-1], 1e-6, scale=MEAN))
            rigid = optimum.velocity["lambda_F"] - optimum.velocity["lambda_M"] * (x - HALF_WIDTH)
            worn = block.wear[-1] - block.wear[-2]
            rows.append(profile(f"{case}: wear of the last half-cycle (mm)", rigid, worn, 1e-4, scale=rigid))
            if (b, direction) == (1, "leftward"):
                lines = [Line(f"half-cycle {k}", x, block.pressure[k - 1]) for k in (1, 2, 4, 8)]
                lines.append(Line("optimum", x, optimum.pressure, reference=True))
    return Result(rows, [Plot("One-way sliding, b = 1, leftward: pressure", "x (mm)", "pressure (MPa)", lines)])


@verification(
    "cyclic",
    "The cyclic steady state",
    "p+ + p- = 2 p_m where the punch does not turn, linear where it does, from the periodicity of the wear; "
    "largest pressure 33.33 MPa (Paczelt and Mroz)",
)
def cyclic() -> Result:
    """Solved for directly; reached by jumps over two million half-cycles, and by a march of faster and faster wear.

    In the march the half-cycle between p+ and p- shifts the shape by its wear: the difference is of first order in it.
    """
    rows: list[Row] = []
    lines: list[Line] = []
    for name in ("example1", "example1-lz40", "example2"):
        system = builtin(name)
        state = steady(system)
        both = state.pressure.sum(axis=0)
        rows.append(profile(f"{name}: p+ + p- (MPa)", np.full_like(both, 2 * MEAN), both, 1e-9, scale=2 * MEAN))
        rows.append(number(f"{name}: largest pressure (MPa)", 2 * MEAN, state.pressure.max(), 1e-9))
        if name == "example1":
            *_, last = jump(system, 2_000_000, tolerance=1e-2)
            rows.append(
                profile(f"{name}: end of a run of jumps (MPa)", state.pressure, last.pressure[-2:], 1e-3, scale=MEAN)
            )
            x = system.pair.x
            for k, d in enumerate("+-"):
                lines += [
                    Line(f"p{d} direct", x, state.pressure[k], reference=True),
                    Line(f"p{d} by jumps", x, last.pressure[k - 2]),
                ]
    # 100 N/mm to the right, 30 mm above the pin, act as the load 3 mm off the centre.
    pushed = "[{on='punch_load', force=[0, -10000]}, {on='punch_free', force=[1000, 0]}]"
    system = vary(builtin("example1"), f"punch.loads={pushed}")
    x, both = system.pair.x, steady(system).pressure.sum(axis=0)
    linear = 2 * MEAN * (1 + 3 * 3.0 * x / HALF_WIDTH**2)
    rows.append(profile("example1, load 3 mm off the centre: p+ + p- (MPa)", linear, both, 1e-8, scale=2 * MEAN))
    differences = []
    for factor in (80, 40, 20):
        fast = builtin("example1", "geometry.degree=2", f"wear.punch.coefficient={factor * COEFFICIENT!r}")
        *_, last = march(fast, 160_000 // factor, implicit=True)
        inner = slice(3, -3)
        differences.append(np.abs(last.pressure[-2:] - steady(fast).pressure)[:, inner].max() / MEAN)
    rows.append(order("example1, march: order in the wear of a half-cycle", 1, differences, 0.25))
    return Result(rows, [Plot("Example 1: cyclic steady state", "x (mm)", "pressure (MPa)", lines)])


EVEN = ("geometry.degree=1", "geometry.parameters.edge_grading=1", "geometry.parameters.elements_along_contact=32")


def at_number(ratio: float) -> Tribosystem:
    """Return one-way sliding of Example 1, even linear elements, whose wear step is `ratio` of the explicit limit."""
    base = builtin("example1", *EVEN, one_way("leftward"), "wear.punch.coefficient=1e-7")
    return vary(base, f"wear.punch.coefficient={1e-7 * ratio / stability_number(base)!r}")


def settles(ratio: float) -> bool:
    """Return whether 1000 explicit half-cycles come to rest."""
    *_, last = march(at_number(ratio), 1000)
    return bool(np.abs(np.diff(last.pressure[-2:], axis=0)).max() < 1e-4 * MEAN)


@verification(
    "explicit-limit",
    "The largest explicit wear step",
    "k ds = 4 h / (pi E*): the wave from node to node on a half-plane, stiffness pi E* / 2 h; an estimate",
)
def explicit_limit() -> Result:
    """Where explicit half-cycles cease to settle, by bisection; implicit ones settle far above."""
    low, high = 0.9, 1.1
    for _ in range(4):
        middle = (low + high) / 2
        low, high = (middle, high) if settles(middle) else (low, middle)
    rows = [number("explicit: step at which the march ceases to settle / fenwear's limit", 1, (low + high) / 2, 0.02)]
    for ratio in (1.03, 100.0, 1e4):
        system = at_number(ratio)
        block = next(march_within(system, RunLimits(200, block=200), implicit=True))
        deviation = np.sqrt((block.pressure - system.optimum(-1).pressure) ** 2 @ system.pair.weights)
        steps = np.diff(deviation[deviation > 1e-9 * deviation[0]])
        rows.append(
            number(
                f"implicit at {ratio:g} of the limit: half-cycles that lead away from the optimum",
                0,
                np.count_nonzero(steps >= 0),
                0,
                scale=1,
            )
        )
    limits = []
    for count in (16, 32):
        even = (*EVEN, f"geometry.parameters.elements_along_contact={count}", "wear.punch.coefficient=1e-6")
        estimate = 1e-6 * STROKE / (4 * (2 * HALF_WIDTH / count) / (np.pi * 2e5))
        limits.append(estimate / stability_number(rigid_punch(3000, *even)))
        what = f"half-plane, {count} nodal spacings: limit / (4 h / pi E*); error as a power of 2"
        rows.append(Row(what, 1, limits[-1], abs(np.log2(limits[-1])), 1.0))
    rows.append(number("half-plane: change of that ratio when h is halved", 1, limits[1] / limits[0], 0.05))
    return Result(rows)
