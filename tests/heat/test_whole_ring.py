"""A brake of ten stops: its track meshed around the pad alone, against the whole of it by Fourier's series."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fenwear import load_case
from fenwear.assembly import place_case
from fenwear.heat.prepare import prepare_exchange
from fenwear.sliding.motion import make_motion

Floats = NDArray[np.float64]
K, RHO_C, HEIGHT, ROUND, PAD, MESHED, SPEED = 50.0, 3.6, 6.0, 502.0, 84.0, 120.0, 800.0
FLUX, STOPS, SLIDES, RESTS, STEP = 500.0, 10, 4.0, 20.0, 0.5  # mW/mm², s


def around_the_pad() -> tuple[Floats, Floats, float]:
    """Return x of the contact (n,), its temperature after each stop and rest (20, n), and the error of the balance."""
    bulk = (ROUND - MESHED) * HEIGHT * RHO_C
    settings = [
        "unset=motion.amplitude", "unset=motion.angular_frequency", "unset=geometry.parameters.overlap",
        "motion.kind=one-way", "motion.direction=rightward", f"motion.speed={SPEED}", f"motion.duration={STEP}",
        "heat.partition=0", "heat.debris=0", "heat.conductance=0", "heat.convection=0", "strip.temperatures=[]",
        f"materials.steel.conductivity={K}", "materials.steel.heat_capacity='500 J/(kg*K)'",
        "materials.steel.density='7200 kg/m^3'", f"geometry.parameters.punch_width={PAD}", "geometry.degree=2",
        f"geometry.parameters.strip_length={MESHED}", f"geometry.parameters.strip_height={HEIGHT}",
        "geometry.parameters.elements_along_contact=12", f"heat.track={{heat_capacity={bulk}, loss=0}}",
    ]  # fmt: skip
    case = load_case("example1-heat", settings)
    placed = place_case(case)
    heat, bodies, pair, field = placed.heat, placed.bodies.heat, placed.pair, placed.sliding.field
    assert heat is not None
    assert bodies is not None
    punch, strip = (np.zeros((len(pair.weights), body.owned)) for body in bodies)
    even, pressure = np.full(len(pair.weights), 1 / SPEED), np.full(len(pair.weights), FLUX)
    slides, rests = (
        prepare_exchange(
            heat, bodies, pair, (punch, strip), field,
            make_motion(case.motion.model_copy(update={"speed": speed})),
            even, 1.0, reduced=True, others=[SPEED, 0.0],
        )
        for speed in (SPEED, 0.0)
    )  # fmt: skip
    state, found, apart = slides.initial(), [], 0.0
    for _ in range(STOPS):
        for exchange, time in ((slides, SLIDES), (rests, RESTS)):
            for _ in range(round(time / STEP)):
                state, terms = exchange.half_cycle(exchange.own(state), 0, pressure, exchange.conductance(pressure))
                made, *gone = terms
                apart = max(apart, abs(made - sum(gone)) / (FLUX * PAD * STEP))
            found.append(exchange.contact_temperatures(state)[1])
    return pair.x, np.array(found), apart


def all_around(x: Floats) -> Floats:
    """Return the temperature below the pad after each stop and rest (20, n) of the whole ring, unrolled.

    Waves e^(i k x) cos(n pi z / H) of the length of the ring, each of which decays with a (k² + (n pi / H)²) + i k v.
    """
    m, n = np.arange(-300, 301)[:, None], np.arange(301)[None]
    k, a = 2 * np.pi * m / ROUND, K / RHO_C
    heated = FLUX / (RHO_C * ROUND * HEIGHT) * PAD * np.sinc(k * PAD / 2 / np.pi) * np.where(n == 0, 1, 2)
    decay = a * (k**2 + (n * np.pi / HEIGHT) ** 2)
    theta, found = np.zeros(decay.shape, complex), []
    for _ in range(STOPS):
        for speed, time in ((SPEED, SLIDES), (0.0, RESTS)):
            rate = decay + 1j * k * speed
            safe = np.where(rate == 0, 1, rate)
            lasts = np.where(rate == 0, time, -np.expm1(-safe * time) / safe)
            theta = np.exp(-rate * time) * theta + (heated * lasts if speed else 0)
            found.append((np.exp(1j * k[:, 0] * x[:, None]) @ theta.sum(axis=1)).real)
    return np.array(found)


def test_a_track_that_is_meshed_around_the_pad_is_the_whole_ring() -> None:
    """Within 2 % of the largest temperature, at every node of the contact, after every stop and every rest."""
    x, found, apart = around_the_pad()
    whole = all_around(x)
    assert apart < 1e-9
    assert np.abs(found - whole).max() < 0.02 * whole.max()
