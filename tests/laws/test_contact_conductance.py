"""The contact conductance of layers: against integrals over the asperities, and as the constant that it is."""

from __future__ import annotations

import numpy as np
import pytest
from combinations import SMALL, STICK, WARM
from scipy.integrate import quad

from fenwear import Case, CaseError, assemble, load_case, steady
from fenwear.steps import Block, evolve
from fenwear.system import layer_conductance

CONDUCTIVITY, MODULUS, STIFFNESS = 45.0, 2e5 / (2 * (1 - 0.3**2)), 1e6  # N/(s K); MPa; MPa/mm
LAYER = f"contact.layer={{kind='linear', stiffness='{STIFFNESS:g} MPa/mm'}}"


def case_of(law: str, conductance: str, *more: str) -> Case:
    stick = STICK if law == "coulomb" else ("stick={}",)
    heat = f"heat.conductance={conductance}"  # all heat is made in the punch, and has to pass
    return load_case(
        "fretting-partial-slip", [*SMALL, *WARM, "heat.partition=1", f"contact.law='{law}'", *stick, heat, *more]
    )


def end(case: Case, how: str) -> Block:
    return list(evolve(assemble(case), integration=how, tolerance=1e-3))[-1]


def test_asperities_conduct_by_their_radii() -> None:
    """h_c = 2 k eta times the mean radius of those that touch, at the distance that carries the pressure."""
    sigma, radius, density = 0.2e-3 * np.sqrt(np.pi / 2), 50e-3, 1000.0
    layer = "{kind='rough', roughness='0.2 um', asperity_radius='50 um', asperity_density='1000 1/mm^2'}"
    system = assemble(case_of("gross-sliding", "'layer'", f"contact.layer={layer}"))
    conductance = layer_conductance(system)
    assert conductance is not None

    def over(h: float, power: float) -> float:
        gaussian = quad(lambda z: (z - h) ** power * np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi), h, h + 12)
        return float(gaussian[0])

    for h in (3.0, 1.0, -1.0):
        pressure = 4 / 3 * MODULUS * density * np.sqrt(radius) * sigma**1.5 * over(h, 1.5)
        exact = 2 * CONDUCTIVITY * density * np.sqrt(radius * sigma) * over(h, 0.5)
        assert conductance(np.full(len(system.pair.x), pressure), 0) == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_a_layer_that_is_as_stiff_everywhere_conducts_as_well_everywhere(law: str) -> None:
    """A linear one gives the temperatures of its constant, in march and jump; a stiffer one conducts better."""
    constant = f"'{1e3 * CONDUCTIVITY / MODULUS * STIFFNESS!r} W/(m^2 K)'"
    for how in ("explicit",) if law == "coulomb" else ("explicit", "jump"):
        one, other = (end(case_of(law, own, LAYER), how) for own in ("'layer'", constant))
        for name in ("temperature_punch", "temperature_strip"):
            a, b = (getattr(block.heat, name) for block in (one, other))
            assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()
    soft = end(case_of(law, "'layer'", LAYER.replace("1e+06", "1e3")), "explicit")
    drops = [np.abs(block.heat.temperature_punch - block.heat.temperature_strip).max() for block in (one, soft)]
    assert drops[1] > 2 * drops[0]


def test_the_end_is_that_of_the_constant() -> None:
    """Directly."""
    found = [
        steady(assemble(case_of("gross-sliding", own, LAYER), heat="reduced"))
        for own in ("'layer'", f"'{1e3 * CONDUCTIVITY / MODULUS * STIFFNESS!r} W/(m^2 K)'")
    ]
    assert found[0].pressure == pytest.approx(found[1].pressure, rel=1e-8)


def test_without_a_layer_there_is_none() -> None:
    """It is refused by its key."""
    with pytest.raises(CaseError, match=r"heat\.conductance: expected a table contact\.layer"):
        case_of("gross-sliding", "'layer'")
