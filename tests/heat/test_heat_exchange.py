"""Heat across the interface: resistances in series, shares of the friction heat, and its balance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem, jump, march
from fenwear.common.arrays import Array
from fenwear.heat import heat_exchange
from fenwear.heat.heat_exchange import TERMS
from fenwear.steps import Block
from fenwear.system import steady_exchange

Make = Callable[..., Any]
HEIGHTS, CONDUCTIVITIES, FAR = (2.0, 3.0), (5.0, 1.5), (90.0, 20.0)  # of punch and strip
SPEED, FRICTION, PRESSURE = 12.0, 0.3, 4.0


def stack(heat: dict[str, Any], held: tuple[bool, bool] = (True, True)) -> dict[str, Any]:
    """Return a case of two blocks with temperatures held far from the contact, nothing lost at the sides."""
    material = {"young": 1e5, "poisson": 0.3, "heat_capacity": 1e9, "density": 1e-9, "expansion": 1e-5}
    far = [[{"on": f"{b}_far", "temperature": t}] for b, t in zip(("punch", "strip"), FAR, strict=True)]
    return {
        "geometry": {"degree": 2},
        "materials": {f"m{i}": {**material, "conductivity": k} for i, k in enumerate(CONDUCTIVITIES)},
        "punch": {
            "regions": {"punch_body": "m0"},
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "traction": [0, -PRESSURE]}],
            "temperatures": far[0] if held[0] else [],
        },
        "strip": {
            "regions": {"strip_body": "m1"},
            "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
            "temperatures": far[1] if held[1] else [],
        },
        "contact": {"friction": FRICTION},
        "wear": {"punch": {"coefficient": 0}},
        "motion": {"kind": "one-way", "direction": "rightward", "speed": SPEED, "duration": 1.0},
        "heat": heat,
        "run": {"half_cycles": 1},
    }


def steady_contact(system: Tribosystem, velocity: float, pressure: Array) -> tuple[Array, Array]:
    """Return the temperatures of the contact surfaces in the steady state at these pressures."""
    exchange = steady_exchange(system, [velocity])
    state, _ = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
    return exchange.contact_temperatures(state)


def in_series(conductance: float, friction_heat: float, partition: float) -> tuple[float, float]:
    """Solve q1 + q2 = Q, kappa Q - q1 = h (t1 - t2), t_i = T_i + q_i l_i / k_i by hand."""
    r1, r2 = (height / k for height, k in zip(HEIGHTS, CONDUCTIVITIES, strict=True))
    if np.isinf(conductance):
        q1 = (FAR[1] - FAR[0] + friction_heat * r2) / (r1 + r2)
    else:
        drop = FAR[0] - FAR[1] - friction_heat * r2
        q1 = (partition * friction_heat - conductance * drop) / (1 + conductance * (r1 + r2))
    return FAR[0] + q1 * r1, FAR[1] + (friction_heat - q1) * r2


def test_perfect_contact_is_the_limit(blocks: Make) -> None:
    """theta1 = theta2 to the last digit, and h_c = 1e8 is 1e-8 from it."""
    systems = [blocks(stack({"conductance": h})) for h in ("perfect", 1e8)]
    (first, second), near = (steady_contact(s, SPEED, np.full(5, PRESSURE)) for s in systems)
    np.testing.assert_allclose(first, second, rtol=1e-13)
    np.testing.assert_allclose(near, (first, second), rtol=1e-6)


@pytest.mark.parametrize("conducting", ["closed", "nominal"])
@pytest.mark.mpi
def test_open_nodes(blocks: Make, conducting: str) -> None:
    """Open and only the closed ones conduct: both surfaces convect, (T l + h k t_a) in series; else they conduct.

    The blocks are so wide that their sides do not show in the middle.
    """
    ambient, h, conductance = -5.0, 0.4, 0.7
    heat = {
        "conductance": conductance,
        "conducting": conducting,
        "convection": h,
        "ambient": ambient,
        "convecting_faces": False,
    }
    sizes = {"width": 60, "across": 20, "punch_layers": 3, "strip_layers": 3}
    system = blocks(stack(heat), punch_height=HEIGHTS[0], strip_height=HEIGHTS[1], **sizes)
    found = steady_contact(system, 0.0, np.zeros(len(system.pair.x)))
    if conducting == "nominal":
        exact = in_series(conductance, 0.0, 0.5)
    else:
        biot = [h * height / k for height, k in zip(HEIGHTS, CONDUCTIVITIES, strict=True)]
        exact = tuple((t + b * ambient) / (1 + b) for t, b in zip(FAR, biot, strict=True))
    middle = len(system.pair.x) // 2
    assert (found[0][middle], found[1][middle]) == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("operator", ["full", "reduced", "of many nodes"])
@pytest.mark.parametrize("inflow", [None, -4.0])
def test_one_step_shares_the_heat(
    blocks: Make, monkeypatch: pytest.MonkeyPatch, operator: str, inflow: float | None
) -> None:
    """Steps by hand for lumped blocks: so good conductors that each has one temperature.

    In each of two stages, g dt with g = 1 - 1/sqrt(2), C_i (t_i - T) / (g dt) = q_i with q1 + q2 = Q and
    kappa Q - q1 = h (t1 - t2); every step warms both anew. The strip's material enters at the inflow's temperature, by
    default the ambient 2 K, and leaves with its own.
    """
    if operator == "of many nodes":
        monkeypatch.setattr(heat_exchange, "FEW", 0)
        operator = "reduced"
    heat = {"conductance": 0.7, "partition": 0.3, "steps": 2, "operator": operator, "initial": 15.0, "ambient": 2.0}
    case = stack({**heat, "inflow": inflow}, (False, False))
    for material in case["materials"].values():
        material["conductivity"] = 1e6
    system = blocks(case, punch_height=HEIGHTS[0], strip_height=HEIGHTS[1])
    exchange, heat, dt = system.exchange, FRICTION * PRESSURE * SPEED, 0.5
    pressure = np.full(len(system.pair.x), PRESSURE)
    state, terms = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
    t = np.array([15.0, 15.0])
    stage = 1 - 1 / np.sqrt(2)
    capacity, between = np.diag(HEIGHTS) / (stage * dt), 0.7 * np.array([[1, -1], [-1, 1]])
    through, carried, into = SPEED * HEIGHTS[1], 0.0, 0.0  # heat capacity a second
    brought = through * (2.0 if inflow is None else inflow)
    for _ in range(2):
        sources = heat * np.array([0.3, 0.7]) + [0.0, brought]
        for counts in ((1 - stage) / stage, 1.0):
            end = np.linalg.solve(capacity + between + np.diag([0.0, through]), capacity @ t + sources)
            carried += counts * stage * dt * (through * end[1] - brought)
            into += counts * stage * dt * (0.3 * heat - 0.7 * (end[0] - end[1]))
            t = t + counts * (end - t)
    for surface, exact in zip(exchange.contact_temperatures(state), t, strict=True):
        np.testing.assert_allclose(surface, exact, rtol=1e-5)
    assert terms[TERMS.index("friction")] == pytest.approx(heat * 1.0, rel=1e-12)  # of 1 s, 1 mm x 1 mm
    assert terms[TERMS.index("stored")] == pytest.approx(HEIGHTS @ (t - 15.0), rel=1e-5)
    assert terms[TERMS.index("carried")] == pytest.approx(carried, rel=1e-5)
    assert terms[len(TERMS) :] == pytest.approx([into, heat - into], rel=1e-5)


# Faces that convect and no debris: all losses, and a strong feedback.
COARSE = (
    "geometry.parameters.elements_along_contact=4",
    "geometry.degree=2",
    "wear.punch.coefficient=4e-6",
    "heat.convecting_faces=true",
    "heat.debris=0",
)
HELD = "strip.temperatures=[{on='strip_bottom', temperature=-30}, {on='strip_ends', temperature=12}]"
EXCHANGES = {
    "as published": (),
    "nominal": ("heat.conducting=nominal", "heat.conductance=2"),
    "perfect": ("heat.conductance=perfect",),
    "by pressure": ("heat.conductance=0", "heat.conductance_per_pressure=[0.1, 0.3]"),
    "debris": ("heat.debris=0.3", "heat.partition=0.2"),
    "warm": ("heat.ambient=35", "heat.initial=-10", HELD),
    "isolated": ("heat.convection=0", "strip.temperatures=[]"),
    "one-way": ("motion={kind='one-way', direction='leftward', speed=200, duration=0.2}", "heat.ambient=35", HELD),
}


def check_balance(block: Block) -> None:
    """Verification 16, from the terms themselves."""
    assert block.heat is not None
    (friction, *rest), crossing = np.split(block.heat.terms.T, [len(TERMS)])
    np.testing.assert_allclose(np.sum(rest, axis=0), friction, rtol=0, atol=1e-8 * np.abs(block.heat.terms).max())
    assert block.heat.balance_error.max() < 1e-8
    # The friction heat is mu F0 times the sliding distance, whatever the pressure; mJ.
    system = block.system
    np.testing.assert_allclose(friction, 0.25 * 1e4 * system.motion.sliding()[0], rtol=1e-9)
    np.testing.assert_allclose(rest[0], system.case.heat.debris * friction, rtol=1e-12)
    if system.case.heat.coupling == "implicit":  # split, nodes that have just opened rub at the relaxed pressure
        np.testing.assert_allclose(crossing.sum(axis=0), friction - rest[0], rtol=1e-9)


# On several ranks every exchange marches with either operator, and one of them goes all ways.
ON_RANKS = [(name, "march") for name in ("as published", "warm", "one-way")] + [("by pressure", "jump")]
BALANCED = [
    pytest.param(name, operator, run, marks=[pytest.mark.mpi] if (name, run) in ON_RANKS else [])
    for name in EXCHANGES
    for operator in ("reduced", "full")
    for run in ("march", "split", "jump")
]


@pytest.mark.parametrize(("name", "operator", "run"), BALANCED)
def test_heat_balance(assembled: Make, name: str, operator: str, run: str) -> None:
    """Verification 16: friction work = debris + stored + convected + held + carried in every half-cycle, to 1e-8."""
    coupling = "split" if run == "split" else "implicit"
    settings = (f"heat.operator={operator}", f"heat.coupling={coupling}", "heat.partition=0.2")
    system = assembled("example1-heat", *COARSE, *settings, *EXCHANGES[name])
    half_cycles = 2000 if operator == "reduced" else 40  # jumps, over which the same terms are added up
    for block in jump(system, half_cycles, tolerance=1e-2) if run == "jump" else march(system, 6, implicit=True):
        check_balance(block)


@pytest.mark.parametrize("velocity", [-200.0, 9.5])
@pytest.mark.parametrize("name", ["as published", "warm", "perfect"])
def test_power_balance_of_a_steady_state(assembled: Make, name: str, velocity: float) -> None:
    """Verification 16 of the steady state: friction power = convected + held + carried, nothing stored."""
    system = assembled("example1-heat", *COARSE, "heat.partition=0.2", "heat.debris=0.1", *EXCHANGES[name])
    exchange = steady_exchange(system, [velocity])
    pressure = system.optimum(1 if velocity > 0 else -1).pressure
    _, found = exchange.half_cycle(exchange.initial(), 0, pressure, exchange.conductance(pressure))
    terms = found[: len(TERMS)]
    assert terms[0] == pytest.approx(0.25 * 1e4 * abs(velocity), rel=1e-9)  # mu F0 v
    assert terms[1] == pytest.approx(0.1 * terms[0], rel=1e-12)
    assert terms[2] == 0
    assert terms[0] == pytest.approx(terms[1:].sum(), abs=1e-8 * np.abs(terms).max())
