"""The strip in its own frame: against an independent one, the whole mesh, and what must balance."""

from __future__ import annotations

import numpy as np
import pytest
from strip_frame import Strip, periodic

from fenwear import CaseError, Tribosystem, assemble, load_case
from fenwear.heat.periodic_heat import CycleHeat
from fenwear.system import with_reduced_heat

ALL_TO_STRIP = ("heat.partition=0", "heat.debris=0", "heat.conductance=0", "heat.conducting=nominal")
PRESSURE, FREQUENCY, WIDTH = 10.0, 10.0, 60.0


def _system(amplitude: float, *settings: str, length: float = 480.0, height: float = 40.0) -> Tribosystem:
    shape = {"strip_length": length, "strip_height": height, "overlap": amplitude, "elements_along_contact": 8}
    parameters = [f"geometry.parameters.{key}={value}" for key, value in shape.items()]
    case = load_case("example2-heat", [*parameters, f"motion.amplitude={amplitude}", *settings])
    return assemble(case)


def _repeating(system: Tribosystem) -> np.ndarray:
    """Return the strip's contact temperature at the end of the cycle that repeats under an even pressure (n,)."""
    heat = CycleHeat(with_reduced_heat(system).exchange)
    pressure = np.full((2, len(system.pair.weights)), PRESSURE)
    end = heat.jump(heat.initial(), np.inf, heat.conductances(pressure))
    return heat.exchange.contact_temperatures(heat.exchange.at(end.state(pressure)))[1]


@pytest.mark.parametrize("strokes", [0.1, 3.0])
def test_source_to_and_fro(strokes: float) -> None:
    """At any stroke, in widths of the contact, every node of it but the outermost is right to 1 % by default."""
    amplitude = strokes * WIDTH / 2
    system = _system(amplitude, *ALL_TO_STRIP)
    strip = Strip(480.0, 40.0, 55.0, 7800 * 460e-6, 0.08, WIDTH)
    inner = system.pair.x[1:-1]
    expected = periodic(
        strip,
        lambda time: amplitude * np.cos(FREQUENCY * time),  # the strip begins on the left
        2 * np.pi / FREQUENCY,
        0.25 * PRESSURE,
        inner,
        size=(1.0, 0.2),
        steps=200,
        cycles=8,
    )
    assert np.abs(_repeating(system)[1:-1] / expected - 1).max() < 0.01


def test_stroke_beyond_the_strip() -> None:
    """A stroke that leaves the strip's contact surface is refused, with the length that is missing."""
    settings = ["geometry.parameters.overlap=5", "motion.amplitude=8"]
    with pytest.raises(CaseError, match=r"motion: the stroke runs off .*strip_contact by 3 mm"):
        assemble(load_case("example2-heat", settings))
