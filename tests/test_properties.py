"""What holds for every case: balances, complementarity, energy, mirror images, units, ranks.

Cases are drawn at random; `pytest tests/test_properties.py --hypothesis-profile=search` draws many more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, note, settings
from hypothesis import strategies as st
from mpi4py import MPI

from fenwear import Tribosystem, assemble, load_case, steady, vary
from fenwear.common.arrays import Array
from fenwear.heat.heat_exchange import CROSSING, TERMS
from fenwear.steps import Block, stability_number
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within

HALF_WIDTH = 30.0  # mm
FRICTION = 0.5  # at most: with more of it Newton's iteration for contact may stagnate, see the last test


@dataclass(frozen=True)
class Units:
    """How much larger numbers get in other units of length, force, time and temperature."""

    length: float = 1.0
    force: float = 1.0
    time: float = 1.0
    temperature: float = 1.0


MILLIMETRES = Units()


@dataclass(frozen=True)
class HeatParameters:
    """What a case with heat has besides, in N, mm, s, K."""

    partition: float = 0.2
    debris: float = 0.0
    conductance: float | str = 0.08
    conducting: str = "closed"
    convection: float = 0.08
    conductivity: float = 5.0
    expansion: float = 1e-5
    steps: int = 2
    operator: str = "full"


@dataclass(frozen=True)
class Parameters:
    """A punch on a strip. The lever is the arm of friction at the pin over half of the width: below 1 it cannot tip.

    The load is the mean pressure over the stiffer body's modulus. The nodes' places are rounded to 1e-14 mm, which
    is nothing beside the indentation only where the load is not too small.
    """

    example: int = 1
    elements: int = 4
    degree: int = 2
    plane: str = "stress"
    thickness: float = 10.0
    young: tuple[float, float] = (1.3e5, 2e5)
    poisson: tuple[float, float] = (0.23, 0.3)
    pins: tuple[int, int] = (20, 80)
    lever: float = 0.2
    load: float = 1e-4
    amplitude: float = 1.5
    frequency: float = 10.0
    coefficient: float = 4e-8
    heat: HeatParameters | None = None

    @property
    def force(self) -> float:
        """Force on the punch, N."""
        return self.load * max(self.young) * 2 * HALF_WIDTH * self.thickness

    @property
    def friction(self) -> float:
        """Coefficient of friction that belongs to the lever."""
        return min(FRICTION, self.lever * HALF_WIDTH / self.pins[0])

    def settings(self, units: Units = MILLIMETRES) -> list[str]:
        """Return the overrides that make this case of a built-in one, with all numbers in other units."""
        length, force, time, kelvin = units.length, units.force, units.time, units.temperature
        pressure = force / length**2
        conductance = force / (length * time * kelvin)
        sizes = {"punch_width": 60, "punch_height": 100, "layer_height": 25, "strip_length": 400, "strip_height": 60,
                 "pin_height_1": self.pins[0]}  # fmt: skip
        if self.example == 2:
            sizes["pin_height_2"] = self.pins[1]
        if self.heat is not None:
            sizes["overlap"] = 30
        found = {f"geometry.parameters.{name}": size * length for name, size in sizes.items()}
        found |= {
            "geometry.parameters.elements_along_contact": self.elements,
            "geometry.degree": self.degree,
            "model.thickness": self.thickness * length,
            "contact.friction": self.friction,
            "motion.amplitude": self.amplitude * length,
            "motion.angular_frequency": self.frequency / time,
            "wear.punch.coefficient": self.coefficient / pressure,
        }
        for name, young, poisson in zip(("composite", "steel"), self.young, self.poisson, strict=True):
            found[f"materials.{name}.young"] = young * pressure
            found[f"materials.{name}.poisson"] = poisson
        if self.heat is not None:
            found |= {
                "heat.partition": self.heat.partition,
                "heat.debris": self.heat.debris,
                "heat.convection": self.heat.convection * conductance,
                "heat.steps": self.heat.steps,
                "materials.composite.expansion": self.heat.expansion / kelvin,
                "materials.composite.conductivity": self.heat.conductivity * force / (time * kelvin),
                "materials.composite.heat_capacity": 1.2e9 * length**2 / (time**2 * kelvin),
                "materials.composite.density": 846e-12 * force * time**2 / length**4,
                "materials.steel.expansion": 1e-5 / kelvin,
                "materials.steel.conductivity": 55 * force / (time * kelvin),
                "materials.steel.heat_capacity": 4.6e8 * length**2 / (time**2 * kelvin),
                "materials.steel.density": 7800e-12 * force * time**2 / length**4,
            }
            if self.heat.conductance != "perfect":
                found["heat.conductance"] = float(self.heat.conductance) * conductance
        texts = [f"{key}={value!r}" for key, value in found.items()]
        texts += [f"model.plane={self.plane}", f"punch.loads.0.force=[0.0, {-self.force * force!r}]"]
        if self.heat is not None:
            texts += [f"heat.operator={self.heat.operator}", f"heat.conducting={self.heat.conducting}"]
            if self.heat.conductance == "perfect":
                texts.append("heat.conductance=perfect")
        return texts

    def system(self, *settings: str, units: Units = MILLIMETRES, comm: MPI.Comm = MPI.COMM_WORLD) -> Tribosystem:
        """Return the system of this case, changed once more."""
        name = f"example{self.example}" + ("" if self.heat is None else "-heat")
        return assemble(load_case(name, [*self.settings(units), *settings]), comm)


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    """Return numbers of three digits, spread over the decades."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: float(f"{10**power:.3g}"))


def fractions(high: float) -> st.SearchStrategy[float]:
    return st.integers(0, 20).map(lambda k: round(k * high / 20, 4))


HEIGHTS = st.integers(1, 19).map(lambda k: 5 * k)


def heats(*operators: str) -> st.SearchStrategy[HeatParameters]:
    """Return heats; the reduced operator keeps balances, but its basis is exact to its own tolerance only."""
    return st.builds(
        HeatParameters,
        partition=fractions(1.0),
        debris=fractions(0.8),
        conductance=st.one_of(st.just(0.0), floats(1e-3, 10), st.just("perfect")),
        conducting=st.sampled_from(["closed", "nominal"]),
        convection=st.one_of(st.just(0.0), floats(1e-3, 1)),
        conductivity=floats(1, 100),
        expansion=floats(1e-7, 3e-5),
        steps=st.integers(1, 4),
        operator=st.sampled_from(operators),
    )


HEATS, WITH_OR_WITHOUT = heats("full", "reduced"), st.one_of(st.none(), heats("full"))


def problems(heat: st.SearchStrategy[Any] = st.none(), lever: float = 0.9) -> st.SearchStrategy[Parameters]:  # noqa: B008
    """Return cases of both examples; elements and degree stay small, so that a system takes a tenth of a second."""
    return st.builds(
        Parameters,
        example=st.sampled_from([1, 2]),
        elements=st.sampled_from([2, 4, 6, 8]),
        degree=st.integers(1, 4),
        plane=st.sampled_from(["stress", "strain"]),
        thickness=floats(0.1, 100),
        young=st.tuples(floats(1e3, 1e6), floats(1e3, 1e6)),
        poisson=st.tuples(fractions(0.45), fractions(0.45)),
        pins=st.tuples(HEIGHTS, HEIGHTS),
        lever=fractions(lever),
        load=floats(1e-5, 1e-2),
        amplitude=floats(1e-2, 10),
        frequency=floats(0.1, 100),
        coefficient=floats(1e-10, 1e-7),
        heat=heat,
    )


def run(system: Tribosystem, half_cycles: int, **options: Any) -> Block:
    (block,) = march_within(system, RunLimits(half_cycles, block=half_cycles), **options)
    return block


def check_contact(system: Tribosystem, parameters: Parameters, block: Block) -> None:
    """Equilibrium by hand, p >= 0, gap >= 0, p gap = 0, and the worn area."""
    x, weights = system.pair.x, system.pair.weights
    load = parameters.force / parameters.thickness
    force = block.pressure * weights
    np.testing.assert_allclose(force.sum(axis=1), load, rtol=1e-9)
    if parameters.example == 1:
        arm = -block.direction * parameters.friction * parameters.pins[0]
        np.testing.assert_allclose(force @ x / load, arm, rtol=0, atol=1e-8 * HALF_WIDTH)
    assert (block.pressure >= 0).all()
    depth = system.elastic.interface.elastic_length * load / 60  # of the mean pressure
    assert (block.gap > -1e-8 * depth).all()
    assert (np.minimum(block.pressure * 60 / load, block.gap / depth) < 1e-8).all()
    worn = parameters.coefficient * load * 2 * parameters.amplitude
    np.testing.assert_allclose(block.worn_area_increment, worn, rtol=1e-9)
    np.testing.assert_allclose(np.diff(block.wear @ weights), worn, rtol=1e-9)
    assert (block.equilibrium_error < 1e-8).all()


@given(problems(), st.booleans())
def test_balances_without_heat(parameters: Parameters, implicit: bool) -> None:
    """Verifications 7 and 8 for any case, explicit within its limit or implicit."""
    system = parameters.system()
    if not implicit:
        coefficient = min(1.0, 0.5 / stability_number(system)) * parameters.coefficient
        parameters = replace(parameters, coefficient=coefficient)
        system = vary(system, f"wear.punch.coefficient={coefficient!r}")
    check_contact(system, parameters, run(system, 6, implicit=implicit))


@given(problems(HEATS, lever=0.8))
def test_balances_with_heat(parameters: Parameters) -> None:
    """Verifications 7, 8 and 16: also the heat of every half-cycle is accounted for."""
    system = parameters.system()
    block = run(system, 4, implicit=True)
    check_contact(system, parameters, block)
    assert block.heat is not None
    assert parameters.heat is not None
    assert (block.heat.balance_error < 1e-8).all()
    terms = dict(zip((*TERMS, *CROSSING), block.heat.terms.T, strict=True))
    done = parameters.friction * parameters.force * 2 * parameters.amplitude
    np.testing.assert_allclose(terms["friction"], done, rtol=1e-9)
    np.testing.assert_allclose(terms["debris"], parameters.heat.debris * done, rtol=1e-9)
    leaves = sum(terms[name] for name in TERMS[1:])
    np.testing.assert_allclose(leaves, done, rtol=1e-8)


@given(problems(lever=0.45), st.booleans())
def test_steady_state(parameters: Parameters, one_way: bool) -> None:
    """Verification 11: p+ + p- = 2 p_m over the contact, in balance; one-way it is the optimum.

    With a lever below a half the resultant of p+ stays within the quarters, where such pressures exist.
    """
    speed = parameters.amplitude * parameters.frequency
    motion = f"motion={{kind='one-way', direction='leftward', speed={speed!r}, duration=1.0}}"
    system = parameters.system(*([motion] if one_way else []))
    state = steady(system)
    mean = parameters.force / parameters.thickness / 60
    if one_way:
        np.testing.assert_allclose(state.pressure[0], system.optimum(-1).pressure, rtol=0, atol=1e-6 * mean)
    else:
        np.testing.assert_allclose(state.pressure.sum(axis=0), 2 * mean, rtol=1e-8)
    assert (state.pressure >= 0).all()
    np.testing.assert_allclose(state.pressure @ system.pair.weights, 60 * mean, rtol=1e-9)
    if parameters.example == 1:
        arm = -np.array(state.directions) * parameters.friction * parameters.pins[0]
        centre = (state.pressure * system.pair.weights) @ system.pair.x / (60 * mean)
        np.testing.assert_allclose(centre, arm, rtol=0, atol=1e-7 * HALF_WIDTH)


@given(problems(WITH_OR_WITHOUT, lever=0.7))
def test_mirror_image(parameters: Parameters) -> None:
    """Pins on the other side and the strip moving the other way: the mirrored state in every half-cycle."""
    parameters = replace(parameters, example=1)
    pin = f"punch.supports.0={{at=[{-HALF_WIDTH}, {60 + parameters.pins[0]}], fix=['x']}}"
    speed = parameters.amplitude * parameters.frequency
    blocks = []
    for direction, settings_ in (("rightward", []), ("leftward", [pin])):
        duration = math.pi / parameters.frequency
        motion = f"motion={{kind='one-way', direction='{direction}', speed={speed!r}, duration={duration!r}}}"
        blocks.append(run(parameters.system(motion, *settings_), 4, implicit=True))
    one, other = blocks
    np.testing.assert_allclose(other.pressure[:, ::-1], one.pressure, rtol=0, atol=1e-7 * one.pressure.max())
    np.testing.assert_allclose(other.wear[:, ::-1], one.wear, rtol=0, atol=1e-7 * one.wear.max())
    if one.heat is not None and other.heat is not None:
        scale = 1e-7 * max(one.heat.largest_temperature.max(), 1e-9)
        for name in ("temperature_punch", "temperature_strip"):
            np.testing.assert_allclose(getattr(other.heat, name)[:, ::-1], getattr(one.heat, name), rtol=0, atol=scale)


SCALES = floats(1e-3, 1e3)


@given(problems(WITH_OR_WITHOUT, lever=0.7), st.builds(Units, SCALES, SCALES, SCALES, SCALES))
def test_units(parameters: Parameters, units: Units) -> None:
    """The same problem in other units of length, force, time and temperature has the same answer in those units."""
    system, other = parameters.system(), parameters.system(units=units)
    one, two = run(system, 3, implicit=True), run(other, 3, implicit=True)
    note(f"contact width {one.contact_width}")
    # gmsh places the nodes of graded lines by an integral of its own tolerance, 2e-8 of the length.
    np.testing.assert_allclose(other.pair.x / units.length, system.pair.x, rtol=0, atol=1e-7 * HALF_WIDTH)

    def same(found: Array, expected: Array, unit: float) -> None:
        np.testing.assert_allclose(found / unit, expected, rtol=0, atol=1e-6 * max(np.abs(expected).max(), 1e-300))

    same(two.pressure, one.pressure, units.force / units.length**2)
    same(two.wear, one.wear, units.length)
    if one.heat is not None and two.heat is not None:
        same(two.heat.temperature_punch, one.heat.temperature_punch, units.temperature)
        same(two.heat.temperature_strip, one.heat.temperature_strip, units.temperature)
        same(two.heat.terms, one.heat.terms, units.force * units.length)


@given(problems(), floats(1e-3, 1e3))
def test_stiffer_and_more_loaded(parameters: Parameters, factor: float) -> None:
    """Stiffness and load times a factor, wear per pressure divided by it: pressures times it, the same depths."""
    stiff = replace(
        parameters,
        young=(parameters.young[0] * factor, parameters.young[1] * factor),
        coefficient=parameters.coefficient / factor,
    )
    one, two = (run(p.system(), 4, implicit=True) for p in (parameters, stiff))
    np.testing.assert_allclose(two.pressure / factor, one.pressure, rtol=0, atol=1e-7 * one.pressure.max())
    np.testing.assert_allclose(two.wear, one.wear, rtol=0, atol=1e-7 * one.wear.max())


@pytest.mark.mpi
@settings(derandomize=True, max_examples=6)  # all ranks draw the same, whatever the profile
@given(problems(WITH_OR_WITHOUT, lever=0.45))
def test_ranks(parameters: Parameters) -> None:
    """Verification 18: each rank on its own and all together give the same numbers to 1e-9."""
    alone, together = (parameters.system(comm=comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    numbers = []
    for system in (alone, together):
        block = run(system, 3, implicit=True)
        heat = block.heat  # with it a steady state needs somewhere to lose it
        rest = [steady(system).pressure] if heat is None else [heat.temperature_punch, heat.temperature_strip]
        numbers.append([block.pressure, block.wear, *rest])
    errors = [np.abs(a - b).max() / max(np.abs(a).max(), 1e-300) for a, b in zip(*numbers, strict=True)]
    worst = MPI.COMM_WORLD.allreduce(max(errors), MPI.MAX)  # or a rank that fails leaves the others waiting
    assert worst < 1e-9


def test_large_friction() -> None:
    """A contact with exactly one solution, 9 of 13 nodes closed: full Newton steps find it rightward alone.

    Leftward, the mirror image, they stagnate at a clipped node, and the line search finds it.
    """
    case = Parameters(example=2, elements=6, young=(1e3, 1e3), poisson=(0, 0), pins=(20, 25))
    system = case.system("contact.friction=0.81")
    right, left = (system.contact((d,)).solve(system.pair.initial_gap).pressure[0] for d in (1, -1))
    np.testing.assert_allclose(left[::-1], right, rtol=0, atol=1e-8 * right.max())
