"""A railway disc brake in one stop: the temperature 1 mm below the rubbed surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from fenwear import load_case
from fenwear.arrays import Array
from fenwear_verify.validation.experiment import (
    Comparison,
    Curve,
    Finding,
    Scope,
    experiment,
    root_mean_square,
    table,
)
from fenwear_verify.validation.runs import history_of, with_settings

RADIUS, DEPTH = 247.5, 1.0  # of the thermocouples, mm
CONDUCTIVITY, DENSITY = 48.0, 7.85e-9  # mW/(mm K), t/mm³
CAPACITIES = {462: "as published", 500: "at the mean temperature, EN 1993-1-2"}  # J/(kg K)
START, AMBIENT = 60.0, 60.0  # °C
SHORT = ("geometry.parameters.across=6", "geometry.degree=1", "program.levels=8")


@experiment(
    name="disc-brake",
    title="Railway disc brake, one stop from 160 km/h: temperature of the disc",
    source="A public study of a full-scale stop; facts and figures as cited, no text or figure of it.",
    measured="Mean of three thermocouples 1 mm below the surface at 13 times, ±1 K.",
    given="Dimensions, steel, speed, pressure that rises over 4 s, friction 0.376, 88 % of the heat into the disc, "
    "convection 77.5 W/(m² K), start and surroundings at 60 °C. The pressure is even over the rubbed ring.",
    calibrated="Nothing. A second run takes the heat capacity of steel at the mean temperature (EN 1993-1-2).",
    predicted="Temperature at the thermocouples over the stop.",
    verdict="An even pressure gives the end, not the overshoot: 50 K too warm after 7 s, 34 K too cold after 14 s. The "
    "place of most pressure must have moved over the radius. Thermoelastic contact does that, and fenwear computes it; "
    "but it depends on the stiffness of the pad, which the source does not state.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison at the thermocouples' times."""
    measured = table("disc_brake.csv")
    at, temperature = measured["time (s)"], measured["temperature (degC)"]
    comparisons, curves = [], [Curve("measured", at, temperature, np.ones(len(at)), measured=True)]
    numbers = []
    for capacity, source in CAPACITIES.items():
        settings = with_settings([f"materials.steel.heat_capacity={capacity} J/(kg*K)"], SHORT, scope)
        history, _ = history_of(load_case(Path(__file__).with_name("disc_brake.toml"), settings))
        time, predicted = history["time"].values, _below_the_surface(history, capacity)
        name = f"{capacity} J/(kg K), {source}"
        curves.append(Curve(name, time, predicted))
        values = np.interp(at, time, predicted)
        numbers.append(root_mean_square(values - temperature))
        comparisons += [
            Comparison(
                f"largest temperature, {capacity} J/(kg K) (°C)", temperature.max(), float(predicted.max()), 1.0
            ),
            Comparison(f"temperature at the end, {capacity} J/(kg K) (°C)", temperature[-1], float(values[-1]), 1.0),
        ]
    percent = 100 * numbers[0] / (temperature.max() - START)
    return Finding(
        f"root mean square difference {numbers[0]:.0f} K ({percent:.0f} % of the largest rise) with nothing fitted, "
        f"{numbers[1]:.0f} K with the heat capacity of the mean temperature",
        percent, comparisons, ("time (s)", "temperature 1 mm below the surface (°C)"), curves,
    )  # fmt: skip


def _below_the_surface(history: xr.Dataset, capacity: float) -> Array:
    """Return the temperature at the thermocouples (n,), °C, from that of the surface above them.

    T(z) = T(0) - q z / k + z² T'(0) / (2 a), the series of the heat equation from the surface, where q is the flux.
    """
    surface = _at_the_radius(history, "temperature_strip", "_strip")
    time, pressure = history["time"].values, _at_the_radius(history, "pressure", "")
    moment = (history["weight"] * history["pressure"] * history["r"]).sum("node").values
    flux = history["heat_into_strip"].values / np.diff(time, prepend=0.0) * pressure * RADIUS / moment
    diffusivity = CONDUCTIVITY / (DENSITY * capacity * 1e6)
    return surface - flux * DEPTH / CONDUCTIVITY + np.gradient(surface, time) * DEPTH**2 / (2 * diffusivity)


def _at_the_radius(history: xr.Dataset, name: str, body: str) -> Array:
    """Return a field of the contact surface at the thermocouples' radius over the run (n,), in its unit."""
    radius = history[f"r{body}"].values
    order = np.argsort(radius)
    return np.array([np.interp(RADIUS, radius[order], row[order]) for row in history[name].values])
