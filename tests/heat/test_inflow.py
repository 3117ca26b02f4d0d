"""Strips with free ends: new material enters, the reduced steps are stable, and heat is bounded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigvals

from fenwear import Tribosystem, assemble, make_case, march, steady, to_dataset, vary
from fenwear.case.program import stages_of
from fenwear.common.errors import HeatError
from fenwear.heat.temperature import ReducedField
from fenwear.steps import growth_rate
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.program_stages import at_stage
from fenwear.system import steady_exchange

Make = Callable[..., Any]
STEEL = {"young": 2e5, "poisson": 0.3, "conductivity": 55, "heat_capacity": 4.6e8, "density": 7.8e-9, "expansion": 1e-5}
PAD = {"young": 3e3, "poisson": 0.3, "conductivity": 1, "heat_capacity": 1e9, "density": 2e-9, "expansion": 1e-6}
SHARE = 0.02  # of the friction heat to the pad


def pad_on_strip(speed: float, conductivity: float = 55.0, **tables: Any) -> Tribosystem:
    """Return a pad that a strip 100 mm long slides under one way: its bottom held, its ends free."""
    sizes = {"punch_width": 20, "punch_height": 20, "layer_height": 10, "pin_height_1": 10, "strip_length": 100}
    parameters = {**sizes, "strip_height": 50, "elements_along_contact": 12}
    case = {
        "geometry": {
            "file": "punch_on_strip.geo",
            "degree": 2,
            "parameters": {**parameters, **tables.pop("sizes", {})},
        },
        "model": {"thickness": 10.0},
        "materials": {"steel": {**STEEL, "conductivity": conductivity}, "pad": PAD},
        "punch": {
            "regions": {"punch_lower": "pad", "punch_upper": "steel"},
            "supports": [{"on": "punch_free", "fix": ["x"]}],
            "loads": [{"on": "punch_load", "traction": [0, -0.5]}],
            "temperatures": [{"on": "punch_load"}],
        },
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}],
            "temperatures": [{"on": "strip_bottom"}],
        },
        "contact": {"friction": 0.3},
        "wear": {"punch": {"coefficient": 1e-9}},
        "motion": {"kind": "one-way", "direction": "rightward", "speed": speed, "duration": 0.05},
        "run": {"half_cycles": 40},
        **tables,
        "heat": {"partition": SHARE, **tables.get("heat", {})},
    }
    return assemble(make_case(case))


@pytest.mark.parametrize("direction", ["rightward", "leftward"])
@pytest.mark.parametrize(("speed", "conductivity"), [(500.0, 55.0), (2000.0, 1.0)])
def test_reduced_equals_full_on_an_open_strip(speed: float, conductivity: float, direction: str) -> None:
    """A pad on a strip with free ends: the same temperatures, all heat carried away, a stable state.

    Without new material at the end where it enters, these reduced steps grew by 0.3 and 13 % each.
    """
    motion = {"kind": "one-way", "direction": direction, "speed": speed, "duration": 0.05}
    found = []
    for operator in ("full", "reduced"):
        system = pad_on_strip(speed, conductivity, motion=motion, heat={"operator": operator})
        (block,) = march_within(system, RunLimits(40, block=40), implicit=True)
        found.append(np.array([block.heat.temperature_punch, block.heat.temperature_strip]))
        assert block.heat.balance_error.max() < 1e-8
        through = system.motion.mean_speed * 0.05 / 100  # times that the material is renewed in a half-cycle
        if 40 * through > 4 and conductivity < 2:  # next to nothing goes into the cold bottom
            friction, stored, carried = block.heat.terms[-1, [0, 2, 5]]
            assert carried == pytest.approx((1 - SHARE) * friction, rel=0.03)
            assert abs(stored) < 0.03 * friction
    assert found[0].max() > 1
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-2 * found[0].max())
    np.testing.assert_allclose(found[1][:, 5:], found[0][:, 5:], rtol=0, atol=1e-3 * found[0].max())
    assert growth_rate(system, steady(system).phase_pressure) < 0


@pytest.mark.parametrize("velocity", [500.0, -2000.0])
@pytest.mark.mpi
def test_every_temperature_dies_out(velocity: float) -> None:
    """The form is coercive: full steps shorten the norm of the heat capacity, the reduced ones die out, too."""
    system = pad_on_strip(
        abs(velocity),
        1.0,
        motion={
            "kind": "one-way",
            "direction": "rightward" if velocity > 0 else "leftward",
            "speed": abs(velocity),
            "duration": 0.05,
        },
        heat={"steps": 5},
    )
    field = system.exchange.sides[1].field
    assert isinstance(field, ReducedField)
    assert field.spectral_radius([0]) < 1
    step = field
    rng = np.random.default_rng(1)
    state = rng.normal(size=len(field.basis))
    sizes = []
    for _ in range(300):
        state = step.advance(0, state, sources=False)
        sizes.append(np.linalg.norm(state))
    assert max(sizes) < 3 * sizes[0]
    assert sizes[-1] < 1e-2 * sizes[0]


def test_steps_are_as_many_as_the_tolerance_asks_for() -> None:
    """After the first half-cycle, the hardest, halving them changes the temperatures of a run by less; halving half as
    many by more."""
    system = pad_on_strip(500.0)
    chosen = system.exchange.fineness.steps
    assert chosen > 5
    found = []
    for steps in (chosen // 2, chosen, 2 * chosen):
        (block,) = march(vary(system, f"heat.steps={steps}"), 1)
        found.append(block.heat.temperature_strip[-1])
    size = np.maximum(found[-1], 0.1 * found[-1].max())
    coarse, fine = (np.abs((found[k] - found[k + 1]) / size).max() for k in (0, 1))
    assert fine < 0.005 < coarse


def test_stages_have_the_same_steps() -> None:
    """They are chosen once, by the fastest stage; all stages share their bases, too."""
    small: dict[str, Any] = {"sizes": {"elements_along_contact": 6}, "heat": {"reduction_tolerance": 1e-3}}
    alone = pad_on_strip(500.0, **small)
    steps = [{"cycles": 3, "speed": [10, 500]}, {"cycles": 1, "speed": 500}]
    system = pad_on_strip(10.0, program={"steps": steps, "levels": 3}, run={}, **small)
    stages = [at_stage(system, stage) for stage in stages_of(system.case)]
    found = {(stage.exchange.fineness.steps, stage.exchange.fineness.change) for stage in stages}
    assert len(stages) == 4
    assert len(system.bodies.heat[1].fineness) == 1
    assert len({id(stage.exchange.sides[1].field.basis) for stage in stages}) == 1
    assert found == {(alone.exchange.fineness.steps, alone.exchange.fineness.change)}
    assert alone.exchange.fineness.steps > vary(alone, "motion.speed=10").exchange.fineness.steps


def test_full_step_is_coercive() -> None:
    """x . (A - B) x > 0 of any temperature, which at free ends needs the material that enters."""
    system = pad_on_strip(2000.0, 1.0, heat={"operator": "full"})
    step = system.exchange.sides[1].field.steps[0]
    a, b = (matrix.convert("dense").getDenseArray() for matrix in (step.a, step.b))
    free = np.setdiff1d(np.arange(len(a)), step.body.held)
    matrix = (a - b)[np.ix_(free, free)]
    assert eigvals(matrix + matrix.T).real.min() > 0


def test_material_enters_at_the_given_temperature() -> None:
    """Without friction the strip takes on what enters; by default the ambient temperature."""
    insulated = {
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}],
        }
    }
    for inflow, expected in ((None, 7.0), (31.0, 31.0)):
        system = pad_on_strip(
            2000.0, contact={"friction": 0}, heat={"ambient": 7, "initial": 50, "inflow": inflow}, **insulated
        )
        exchange, n = system.exchange, len(system.pair.x)
        state = exchange.initial()
        for _ in range(20):
            state, terms = exchange.half_cycle(state, 0, np.ones(n), np.full(n, 0.0))
        np.testing.assert_allclose(exchange.contact_temperatures(state)[1], expected, atol=1e-3)
        assert abs(terms[5]) < 1e-3 * system.bodies.heat[1].storage.sum()


def test_heat_out_of_bounds_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that grow end the run by an error that says heat; not where friction is all that warms."""
    monkeypatch.setattr("fenwear.steps.gross_sliding.PARTS", ())
    system = pad_on_strip(500.0)
    field = system.exchange.sides[1].field
    list(march(system, 10, implicit=True))
    field._decays = [4 * p for p in field._decays]
    system.exchange._forget()
    with pytest.raises(HeatError, match=r"half-cycle \d+: the heat has failed, not the contact"):
        list(march(system, 200, implicit=True))


def test_a_warm_front_at_a_held_end_of_long_elements_is_no_failure(assembled: Callable[..., Tribosystem]) -> None:
    """Elements longer than what passes in a half-cycle take heat in there; the contact is that with a free end."""
    motion = "motion={kind='one-way', direction='leftward', speed='400 mm/s', duration='0.2 s'}"
    coarse = ("geometry.parameters.elements_along_contact=6", "geometry.parameters.growth=1.5", "geometry.degree=1")
    case = ("example2-heat", *coarse, motion, "contact.friction=0.05")
    held, free = (
        to_dataset(list(march(assembled(*case, *ends), 6, implicit=True)))
        for ends in ((), ("strip.temperatures=[{on='strip_bottom', temperature='0 K'}]",))
    )
    assert held.heat_stored.max() > 1.2 * (held.heat_friction - held.heat_debris).max()
    np.testing.assert_allclose(held.wear, free.wear, rtol=0, atol=1e-5 * float(free.wear.max()))


@pytest.mark.parametrize("operator", ["full", "reduced"])
def test_bare_contact_surface_convects(operator: str) -> None:
    """Strip_contact far wider than the punch loses heat beside it like a surface that has no such name."""
    found = []
    for overlap in (0.0, 30.0):
        system = pad_on_strip(
            50.0,
            sizes={"overlap": overlap, "elements_along_contact": 16},
            heat={"operator": operator, "convection": 4.0, "ambient": 3.0},
        )
        (block,) = march_within(system, RunLimits(100, block=100), implicit=True)
        assert block.heat.balance_error.max() < 1e-8
        found.append(np.append(block.heat.temperature_strip[-1].max(), block.heat.terms[-1, 3]))
    np.testing.assert_allclose(found[1], found[0], rtol=0.01)


def test_new_material_is_a_heat_sink(assembled: Callable[..., Tribosystem]) -> None:
    """A strip that is cooled by what comes in only has a steady state: that of its velocity, by any step."""
    errors = []
    for elements in (4, 16):
        system = assembled(
            "example1-heat",
            "motion={kind='one-way',direction='leftward',speed='200 mm/s',duration='1 s'}",
            f"geometry.parameters.elements_along_contact={elements}",
            "geometry.degree=2",
            "contact.friction=0.02",
            "strip.temperatures=[]",
            "punch.temperatures=[{on='punch_load',temperature='0 K'}]",
            "heat.convection=0",
        )
        found = steady(system)
        exchange = steady_exchange(system, [-200.0])
        pressure = found.pressure[0]
        end, _ = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
        punch, strip = exchange.contact_temperatures(end)
        assert found.heat is not None
        assert np.abs(found.heat.punch[0] - punch).max() < 1e-4 * np.abs(punch).max()
        errors.append(np.abs(found.heat.strip[0] - strip).max() / np.abs(strip).max())
    assert max(errors) < 1e-5
