"""A brake of ten stops: its track meshed around the pad alone, against the whole of it by Fourier's series.

Of any thickness: what differs over the section is not gone when the material comes back.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from fenwear import load_case
from fenwear.heat.heat_exchange import TERMS
from fenwear.heat.prepare import prepare_exchange
from fenwear.surfaces.motion import make_motion
from fenwear.system import place_case

Floats = NDArray[np.float64]
K, RHO_C, ROUND, PAD, MESHED = 50.0, 3.6, 502.0, 84.0, 120.0
FLUX, STOPS, SLIDES, RESTS, STEP = 500.0, 10, 4.0, 20.0, 0.5  # mW/mm², s


def around_the_pad(height: float, speed: float) -> tuple[Floats, Floats, float]:
    """Return x of the contact (n,), its temperature after each stop and rest (20, n), and the error of the balance."""
    bulk = (ROUND - MESHED) * height * RHO_C
    settings = [
        "unset=motion.amplitude", "unset=motion.angular_frequency", "unset=geometry.parameters.overlap",
        "motion.kind=one-way", "motion.direction=rightward", f"motion.speed={speed}", f"motion.duration={STEP}",
        "heat.partition=0", "heat.debris=0", "heat.conductance=0", "heat.convection=0", "strip.temperatures=[]",
        f"materials.steel.conductivity={K}", "materials.steel.heat_capacity='500 J/(kg*K)'",
        "materials.steel.density='7200 kg/m^3'", f"geometry.parameters.punch_width={PAD}", "geometry.degree=2",
        f"geometry.parameters.strip_length={MESHED}", f"geometry.parameters.strip_height={height}",
        "geometry.parameters.elements_along_contact=12", f"heat.track={{heat_capacity={bulk}, loss=0}}",
    ]  # fmt: skip
    case = load_case("example1-heat", settings)
    placed = place_case(case)
    heat, bodies, pair, field = placed.case.heat, placed.bodies.heat, placed.pair, placed.sliding.field
    assert heat is not None
    assert bodies is not None
    punch, strip = (np.zeros((len(pair.weights), body.owned)) for body in bodies)
    even, pressure = np.full(len(pair.weights), 1 / speed), np.full(len(pair.weights), FLUX)
    slides, rests = (
        prepare_exchange(
            heat, bodies, pair, (punch, strip), field,
            make_motion(case.motion.model_copy(update={"speed": own})),
            even, 1.0, reduced=True, others=[speed, 0.0],
        )
        for own in (speed, 0.0)
    )  # fmt: skip
    state, found, apart = slides.initial(), [], 0.0
    for _ in range(STOPS):
        for exchange, time in ((slides, SLIDES), (rests, RESTS)):
            for _ in range(round(time / STEP)):
                state, terms = exchange.half_cycle(
                    exchange.on_bases(state), 0, pressure, exchange.conductance(pressure)
                )
                made, *gone = terms[: len(TERMS)]
                apart = max(apart, abs(made - sum(gone)) / (FLUX * PAD * STEP))
            found.append(exchange.contact_temperatures(state)[1])
    return pair.x, np.array(found), apart


def all_around(x: Floats, height: float, speed: float) -> Floats:
    """Return the temperature below the pad after each stop and rest (20, n) of the whole ring, unrolled.

    Waves e^(i k x) cos(n pi z / H) of the length of the ring, each of which decays with a (k² + (n pi / H)²) + i k v.
    """
    m, n = np.arange(-300, 301)[:, None], np.arange(301)[None]
    k, a = 2 * np.pi * m / ROUND, K / RHO_C
    heated = FLUX / (RHO_C * ROUND * height) * PAD * np.sinc(k * PAD / 2 / np.pi) * np.where(n == 0, 1, 2)
    decay = a * (k**2 + (n * np.pi / height) ** 2)
    theta, found = np.zeros(decay.shape, complex), []
    for _ in range(STOPS):
        for own, time in ((speed, SLIDES), (0.0, RESTS)):
            rate = decay + 1j * k * own
            safe = np.where(rate == 0, 1, rate)
            lasts = np.where(rate == 0, time, -np.expm1(-safe * time) / safe)
            theta = np.exp(-rate * time) * theta + (heated * lasts if own else 0)
            found.append((np.exp(1j * k[:, 0] * x[:, None]) @ theta.sum(axis=1)).real)
    return np.array(found)


@pytest.mark.parametrize(("height", "speed"), [(6.0, 800.0), (12.0, 800.0), (24.0, 2500.0), (48.0, 800.0)])
def test_a_track_that_is_meshed_around_the_pad_is_the_whole_ring(height: float, speed: float) -> None:
    """Within 2 % of the largest temperature, at every node of the contact, after every stop and every rest."""
    x, found, apart = around_the_pad(height, speed)
    whole = all_around(x, height, speed)
    assert apart < 1e-9
    assert np.abs(found - whole).max() < 0.02 * whole.max()
