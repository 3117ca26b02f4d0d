"""The optimal pressure and wear velocity of one-way sliding."""

from __future__ import annotations

import numpy as np
from scipy.integrate import quad
from scipy.optimize import fsolve

from fenwear.common.arrays import Array
from fenwear_verify.bodies import builtin
from fenwear_verify.suite import Line, Plot, Result, Row, number, profile, verification

HALF_WIDTH, MEAN = 30.0, 1e4 / 600  # mm; p_m, MPa
FRICTION, RATE = 0.25, 1e-5 * 200  # mu; beta~ v, mm/s per MPa
DIRECTIONS = {"leftward": -1, "rightward": 1}
PUBLISHED = {  # lambda_F, lambda_M; the paper cuts digits off
    (20, "leftward"): (0.05, -5.55e-4),
    (20, "rightward"): (0.0166, 5.55e-4),
    (40, "leftward"): (0.06666, -0.001111),
    (40, "rightward"): (0.0, 0.001111),
}


@verification(
    "optimum-table",
    "Optimum: the published wear velocities of Example 1",
    "Paczelt and Mroz, Numerical Analysis of Thermo-Mechanical Wear Problems for Reciprocal Punch Sliding",
)
def optimum_table() -> Result:
    """lambda_F and lambda_M to the digits printed: 1e-4 mm/s and 1e-6 rad/s."""
    rows: list[Row] = []
    for (height, direction), (lambda_f, lambda_m) in PUBLISHED.items():
        velocity = builtin(f"monotonic-lz{height}").optimum(DIRECTIONS[direction]).velocity
        case = f"pin {height} mm, {direction}"
        rows.append(number(f"{case}: lambda_F (mm/s), absolute error", lambda_f, velocity["lambda_F"], 1e-4, scale=1))
        rows.append(number(f"{case}: lambda_M (rad/s), absolute error", lambda_m, velocity["lambda_M"], 1e-6, scale=1))
    return Result(rows)


@verification(
    "optimum-linear",
    "Optimum for b = 1: a linear pressure",
    "equilibrium by hand: p = p_m (1 - d c x / a), c = 6 mu l_z / L",
)
def optimum_linear() -> Result:
    """The pressure and, from w_n = beta~ v p, lambda_F and lambda_M about the pin at x = a."""
    rows: list[Row] = []
    for height in (20, 40):
        c = 6 * FRICTION * height / (2 * HALF_WIDTH)
        for direction, d in DIRECTIONS.items():
            system = builtin(f"monotonic-lz{height}")
            found = system.optimum(d)
            exact = MEAN * (1 - d * c * system.pair.x / HALF_WIDTH)
            case = f"pin {height} mm, {direction}"
            rows.append(profile(f"{case}: pressure (MPa)", exact, found.pressure, 1e-10, scale=MEAN))
            rows.append(
                number(
                    f"{case}: lambda_F (mm/s)",
                    RATE * MEAN * (1 - d * c),
                    found.velocity["lambda_F"],
                    1e-10,
                    scale=RATE * MEAN,
                )
            )
            rows.append(
                number(f"{case}: lambda_M (rad/s)", RATE * MEAN * d * c / HALF_WIDTH, found.velocity["lambda_M"], 1e-10)
            )
    return Result(rows)


def by_quadrature(b: float, x: Array) -> Array:
    """Return p_m (f + g x / a)_+^(1/b), f and g from force and moment by QUADPACK and MINPACK; rightward, pin 20 mm."""

    def shape(x: float, f: float, g: float) -> float:
        return float(max(f + g * x / HALF_WIDTH, 0.0) ** (1 / b))

    def balance(unknown: Array) -> list[float]:
        force, moment = (
            quad(lambda x, k=k: shape(x, *unknown) * x**k, -HALF_WIDTH, HALF_WIDTH, epsabs=1e-11)[0]  # type: ignore[misc]
            for k in (0, 1)
        )
        return [force / (2 * HALF_WIDTH) - 1, moment / (2 * HALF_WIDTH) + FRICTION * 20]

    f, g = fsolve(balance, [1.0, -0.4], xtol=1e-12)
    return MEAN * np.array([shape(at, f, g) for at in x])


@verification(
    "optimum-power",
    "Optimum for b = 1 and b = 2, Examples 1 and 2",
    "force and moment by adaptive quadrature (QUADPACK) and Newton's method (MINPACK); statics",
)
def optimum_power() -> Result:
    """Pressure (w_n / K)^(1/b): Example 1 against quadrature, Example 2 uniform; force and moment to 1e-10."""
    rows: list[Row] = []
    lines: list[Line] = []
    for b in (1.0, 2.0):
        settings = (f"wear.punch.pressure_exponent={b}", "wear.punch.coefficient=1e-8")
        for name in ("example1", "example2"):
            system = builtin(name, *settings)
            x, weights = system.pair.x, system.pair.weights
            exact = by_quadrature(b, x) if name == "example1" else np.full_like(x, MEAN)
            found = system.optimum(1)
            case = f"{name}, b = {b:g}"
            rows.append(profile(f"{case}: pressure (MPa)", exact, found.pressure, 1e-9, scale=MEAN))
            rows.append(number(f"{case}: force (N/mm)", 1000, weights @ found.pressure, 1e-10))
            if name == "example1":
                rows.append(
                    number(
                        f"{case}: moment about x = 0 (N)", -FRICTION * 20 * 1000, weights @ (found.pressure * x), 1e-10
                    )
                )
                lines += [
                    Line(f"quadrature, b = {b:g}", x, exact, reference=True),
                    Line(f"fenwear, b = {b:g}", x, found.pressure),
                ]
    return Result(rows, [Plot("Optimal pressure of Example 1, rightward", "x (mm)", "pressure (MPa)", lines)])
