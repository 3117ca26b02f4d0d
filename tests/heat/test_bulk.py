"""A closed track: the disc or ring beneath warms up as a whole."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Case, Tribosystem, assemble, jump, march
from fenwear.common.errors import CaseError
from fenwear.results import checkpoint
from fenwear.steps import follow_program
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.steady import steady

Edited = Callable[..., Case]
SMALL = (
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
    "geometry.parameters.diffusion_length=0",
    "geometry.follow_wear=never",
    "heat.reduction_tolerance=1e-7",
)
CAPACITY, LOSS, SPEED = 2e6, 4e3, 500.0  # N mm/K, N mm/(s K), mm/s


def on_track(**more: Any) -> Callable[[dict[str, Any]], None]:
    def edit(tables: dict[str, Any]) -> None:
        tables["motion"] = {"kind": "one-way", "direction": "rightward", "speed": SPEED, "duration": 1.0}
        tables["strip"]["supports"] = [{"on": "strip_bottom", "fix": ["x", "z"]}]
        for body in ("punch", "strip"):
            tables[body].pop("temperatures", None)
        for material in tables["materials"].values():  # good conductors: a low Biot number
            material["conductivity"] = "400 W/(m*K)"
            material["expansion"] = 0.0
        tables["heat"] = {
            "conductance": "perfect",
            "convection": 1e-9,  # nothing, but a sink for the punch
            "steps": 4,
            "track": {"heat_capacity": CAPACITY, "loss": LOSS},
            **more,
        }
        tables["run"] = {"half_cycles": 100}

    return edit


def bulk(system: Tribosystem, block: Any) -> float:
    found = system.exchange.on_bases(block.end.temperature).bulk
    assert found is not None
    assert found == pytest.approx(block.heat.temperature_bulk[-1], rel=1e-10)
    return found


def test_lumped_disc(edited: Edited) -> None:
    """At a low Biot number the bulk follows C dT/dt = mu F v - G T, C of the disc and of what is meshed.

    Energy is balanced in each step, and nothing is carried out of the model any more.
    """
    system = assemble(edited("example1-heat", on_track(), *SMALL))
    exchange, count = system.exchange, 200
    (block,) = march_within(system, RunLimits(count, block=count))
    power = 0.25 * 1e4 * SPEED
    meshed = sum(side.capacity for side in exchange.sides) * system.bodies.punch.thickness
    assert meshed > CAPACITY
    time = np.arange(1, count + 1)
    lumped = power / LOSS * (1 - np.exp(-LOSS * time / meshed))
    found = bulk(system, block)
    # The punch is warmer than the bulk by what drives its heat, and so the bulk a little later.
    assert found == pytest.approx(lumped[-1], rel=0.03)
    assert block.heat.balance_error.max() < 1e-8
    assert np.abs(block.heat.terms[:, 5]).max() < 1e-9 * block.heat.terms[0, 0]
    stored = block.heat.terms[:, 2].sum()
    assert stored == pytest.approx(meshed * found, rel=0.03)
    assert block.heat.temperature_strip[-1].min() > found


def test_lumped_turning_disc(edited: Edited) -> None:
    """The same in space, beneath a pad on a disc that turns: P = mu omega times the integral of p r, a turn a step."""
    capacity, loss, count = 4e6, 4e3, 100

    def disc(tables: dict[str, Any]) -> None:
        on_track(track={"heat_capacity": capacity, "loss": loss})(tables)
        tables["motion"] = {"kind": "rotation", "angular_speed": 10.0, "duration": 4.0}
        tables["strip"]["supports"] = [{"on": "strip_far", "fix": ["x", "y", "z"]}]

    sizes = [f"geometry.parameters.{name}" for name in ("across=2", "along=3", "pad_layers=1", "disc_layers=2")]
    system = assemble(edited("brake-pad", disc, "geometry.degree=1", "geometry.order=1", *sizes))
    (block,) = march_within(system, RunLimits(count, block=count))
    power = block.heat.terms[:, 0] / 4.0
    radius = np.hypot(*system.pair.punch.x[:, :2].T)
    torque = 0.35 * system.pair.weights @ (block.pressure[-1] * radius)
    assert power[-1] == pytest.approx(10.0 * torque, rel=1e-9)
    whole = sum(side.capacity for side in system.exchange.sides)
    lumped = power[-1] / loss * (1 - np.exp(-loss * 4.0 * np.arange(1, count + 1) / whole))
    np.testing.assert_allclose(block.heat.temperature_bulk, lumped, rtol=0, atol=0.02 * lumped[-1])
    assert block.heat.balance_error.max() < 1e-8
    assert np.abs(block.heat.terms[:, 5]).max() < 1e-9 * block.heat.terms[0, 0]
    *_, end = jump(system, 20000, tolerance=1e-2)
    torque = 0.35 * system.pair.weights @ (steady(system).pressure[0] * radius)
    assert end.heat.temperature_bulk[-1] == pytest.approx(10.0 * torque / loss, rel=1e-6)


def test_steady_bulk(edited: Edited) -> None:
    """In the end G T = mu F v exactly; jumps and the steady state come there."""
    system = assemble(edited("example1-heat", on_track(), *SMALL), heat="reduced")
    *_, last = jump(system, 20000, tolerance=1e-2)
    exact = 0.25 * 1e4 * SPEED / LOSS
    assert bulk(system, last) == pytest.approx(exact, rel=1e-3)
    state = steady(system)
    assert state.heat is not None
    np.testing.assert_allclose(state.heat.strip[0], last.heat.temperature_strip[-1], rtol=2e-3)


def test_ambient_is_where_it_begins(edited: Edited) -> None:
    """Another zero of the temperature shifts all of it."""
    here, there = (assemble(edited("example1-heat", on_track(initial=t, ambient=t), *SMALL)) for t in (0.0, 300.0))
    one, other = (list(march(system, 5))[-1] for system in (here, there))
    apart = other.heat.temperature_strip - 300 - one.heat.temperature_strip
    # Their bases are not the same: 59 and 68 columns, each of which knows the bulk to a few parts in ten thousand.
    assert np.abs(apart).max() < 1e-3 * np.ptp(one.heat.temperature_strip)
    assert bulk(there, other) - 300 == pytest.approx(bulk(here, one), rel=1e-3)
    np.testing.assert_allclose(other.heat.terms, one.heat.terms, atol=1e-4 * one.heat.terms[0, 0])


def test_goes_on_from_a_checkpoint(edited: Edited, tmp_path: Any) -> None:
    """The bulk's temperature is in the checkpoint."""
    system = assemble(edited("example1-heat", on_track(), *SMALL))
    first = list(march(system, 5))[-1]
    checkpoint.save(tmp_path, system, first.end, {})
    _, state, _ = checkpoint.load(tmp_path, system)
    assert state.temperature is not None
    assert state.temperature.bulk == pytest.approx(bulk(system, first), rel=1e-12)
    rest, whole = (list(march(system, 8, start=start))[-1] for start in (state, first.end))
    np.testing.assert_allclose(rest.heat.temperature_strip[-1], whole.heat.temperature_strip[-1], rtol=1e-8)


def test_what_does_not_go_with_it(edited: Edited) -> None:
    with pytest.raises(CaseError, match=r"heat\.track: expected one-way sliding"):
        edited("example1-heat", lambda tables: tables["heat"].update(track={"heat_capacity": 1e6}))
    with pytest.raises(CaseError, match=r"heat\.inflow: expected none"):
        edited("example1-heat", on_track(inflow=3.0))
    with pytest.raises(CaseError, match=r"heat\.operator: expected 'reduced'"):
        edited("example1-heat", on_track(operator="full"))

    def held(tables: dict[str, Any]) -> None:
        on_track()(tables)
        tables["strip"]["temperatures"] = [{"on": "strip_ends", "temperature": 0}]

    with pytest.raises(CaseError, match=r"heat\.track:"):
        assemble(edited("example1-heat", held, *SMALL))


def test_ten_stops(edited: Edited) -> None:
    """A brake that stops ten times and rests in between: C dT/dt = mu F v - G T at a low Biot number, after each stop.

    At rest nothing comes or goes through the ends of the mesh, and the bulk alone loses e^(-G t / C).
    """
    steps = [
        {"time": "8 s", "speed": ["500 mm/s", "0 mm/s"]},
        {"time": "20 s", "speed": "0 mm/s"},
    ] * 10

    def brake(tables: dict[str, Any]) -> None:
        on_track()(tables)
        tables["program"] = {"steps": steps, "levels": 4}
        tables["run"].pop("half_cycles")

    system = assemble(edited("example1-heat", brake, *SMALL))
    blocks = list(follow_program(system, march_within, RunLimits(280)))
    assert max(block.heat.balance_error.max() for block in blocks) < 1e-9
    bulks = np.concatenate([block.heat.temperature_bulk for block in blocks])
    rests = bulks.reshape(10, 28)[:, 7:]
    decay = rests[:, 1:] / rests[:, :-1]
    np.testing.assert_allclose(decay, np.exp(-LOSS / CAPACITY), rtol=1e-8)
    meshed = sum(side.capacity for side in system.exchange.sides) * system.bodies.punch.thickness
    speeds = np.tile(np.r_[500 - 125 * (np.arange(8) // 2) - 62.5, np.zeros(20)], 10)
    of_bulk, of_mesh, lumped = 0.0, 0.0, []
    for speed in speeds:
        if speed:
            mixed = (CAPACITY * of_bulk + (meshed - CAPACITY) * of_mesh) / meshed
            limit = 0.25 * 1e4 * speed / LOSS
            of_bulk = of_mesh = limit + (mixed - limit) * np.exp(-LOSS / meshed)
        else:
            of_bulk *= np.exp(-LOSS / CAPACITY)
        lumped.append(of_bulk)
    # The punch is warmer than the bulk by what drives its heat; in a stop what it heats is still on its way.
    after = np.array(lumped).reshape(10, 28)[:, 7:]
    np.testing.assert_allclose(rests, after, rtol=0, atol=0.03 * max(lumped))
    terms = np.concatenate([block.heat.terms for block in blocks])
    np.testing.assert_allclose(terms[:, 0], 0.25 * 1e4 * speeds, rtol=1e-9, atol=1e-9)
