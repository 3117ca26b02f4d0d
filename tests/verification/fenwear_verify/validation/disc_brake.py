"""A railway disc brake in one stop: the temperature 1 mm below the rubbed surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from fenwear.common.arrays import Array
from fenwear_verify.validation.experiment import Comparison, Curve, Finding, Scope, experiment, table
from fenwear_verify.validation.runs import history_of, uncertainty

RADIUS, DEPTH = 247.5, 1.0  # of the thermocouples, mm
CONDUCTIVITY, DENSITY = 48.0, 7.85e-9  # mW/(mm K), t/mm³
INTO_DISC = 0.88
START = 60.0  # °C
SHORT = ("geometry.parameters.across=6", "program.levels=8")
# A pad's 18 round elements in three rows of six, which together just reach over the rubbed ring. Friction at a radius
# has the share of the way around the axis on which elements rub there, over their mean share of the ring.
ELEMENT, ROWS, MEAN_SHARE = 18.8, (196.8, 240.5, 284.2), 0.2116
_CHORDS = " + ".join(f"sqrt(max(0, {ELEMENT}**2 - (x - {row})**2))" for row in ROWS)
ELEMENTS = f'contact.friction={{expression = "0.376 * 12 / {np.pi} / {MEAN_SHARE} * ({_CHORDS}) / x"}}'


STOPS: dict[str, tuple[float, Sequence[str]]] = {  # heat capacity of the disc, J/(kg K), and further settings
    "462 J/(kg K)": (462, ()),
    "500 J/(kg K)": (500, ("output.uncertainty=false",)),
    "462 J/(kg K), round elements": (462, (ELEMENTS, "geometry.parameters.across=24", "output.uncertainty=false")),
}


@experiment(
    name="disc-brake",
    title="Railway disc brake, one stop from 160 km/h: temperature of the disc",
    source="A public study of a full-scale stop; facts and figures as cited, no text or figure of it.",
    measured="Mean of three thermocouples 1 mm below the surface at 13 times, ±1 K.",
    given="Dimensions, steel, speed, pressure that rises over 4 s, friction 0.376, 88 % of the heat into the disc, "
    "convection 77.5 W/(m² K), start and surroundings at 60 °C. The pressure is even over the rubbed ring.",
    calibrated="Nothing. A second run takes the heat capacity of steel at the mean temperature (EN 1993-1-2). "
    "A third one heats the disc where the 18 round elements of a pad rub; that they lie in three rows of six is an "
    "assumption.",
    predicted="Temperature at the thermocouples over the stop.",
    verdict="An even pressure gives the end, not the overshoot: 50 K too warm after 7 s, 34 K too cold after 14 s. "
    "The place of most pressure must have moved over the radius. Thermoelastic contact does that, and fenwear "
    "computes it; but it depends on the stiffness of the pad, which the source does not state.",
)
def compare(scope: Scope) -> Finding:
    """Return the comparison at the thermocouples' times."""
    data = table("disc_brake.csv")
    measured = Curve("measured", data["time (s)"], data["temperature (degC)"], np.ones(len(data["time (s)"])), True)
    comparisons, curves = [], [measured]
    for name, (capacity, settings) in STOPS.items():
        asked = [f"materials.steel.heat_capacity={capacity} J/(kg*K)", *settings]
        history, summary = history_of("disc_brake.toml", asked, SHORT, scope)
        time, u_num = history["time"].values, uncertainty(summary, "largest_temperature_degC")
        predicted = Curve(name, time, _below_the_surface(history, capacity), np.full(len(time), u_num))
        curves.append(predicted)
        comparisons += [
            Comparison(f"{what}, {name} (°C)", d, float(s), 1.0, u_num)
            for what, d, s in (
                ("largest temperature", measured.y.max(), predicted.y.max()),
                ("temperature at the end", measured.y[-1], predicted.at(measured.x[-1:])[0]),
            )
        ]
    misfits = [curve.misfit(measured) for curve in curves[1:]]
    percent = 100 * misfits[0] / (measured.y.max() - START)
    return Finding(
        f"root mean square difference {misfits[0]:.0f} K ({percent:.0f} % of the largest rise) with nothing fitted, "
        f"{misfits[1]:.0f} K with the heat capacity of the mean temperature, {misfits[2]:.0f} K with round elements",
        percent, comparisons, ("time (s)", "temperature 1 mm deep (°C)"), curves,
    )  # fmt: skip


def _below_the_surface(history: xr.Dataset, capacity: float) -> Array:
    """Return the temperature at the thermocouples (n,), °C, from that of the surface above them.

    T(z) = T(0) - q z / k + z² T'(0) / (2 a), the series of the heat equation from the surface, where q is the flux.
    """
    surface = _at_the_radius(history, "temperature_strip", "_strip")
    time, work = history["time"].values, _at_the_radius(history, "dissipated_energy", "")
    flux = INTO_DISC * np.diff(work, prepend=0.0) / np.diff(time, prepend=0.0)
    diffusivity = CONDUCTIVITY / (DENSITY * capacity * 1e6)
    return surface - flux * DEPTH / CONDUCTIVITY + np.gradient(surface, time) * DEPTH**2 / (2 * diffusivity)


def _at_the_radius(history: xr.Dataset, name: str, body: str) -> Array:
    """Return a field of the contact surface at the thermocouples' radius over the run (n,), in its unit."""
    radius = history[f"r{body}"].values
    order = np.argsort(radius)
    return np.array([np.interp(RADIUS, radius[order], row[order]) for row in history[name].values])
