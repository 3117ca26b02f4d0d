"""Materials' properties that depend on the temperature, followed in slow steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fenwear import Case, Tribosystem, assemble, make_case, march, read_history, run_case, steady
from fenwear.common.errors import CaseError
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.steps import Block, SteadyState, evolve, follow, monotonic
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.run_state import RunState, beginning
from fenwear.studies.model import Model
from fenwear.studies.quantities import evaluate, parse_quantity
from fenwear.system import properties_outdated, taken_at, warmed_system

HEIGHTS, FAR, SLOPE = (2.0, 3.0), (90.0, 20.0), 0.02
K0 = (5.0, 1.5)
Edited = Callable[..., Case]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")


def stack(materials: dict[str, Any], duration: float, half_cycles: int, layers: int = 2, **heat: Any) -> Case:
    """Return two blocks on each other without friction, held at temperatures far from the contact."""
    mechanical = {"young": 1e5, "poisson": 0.3, "density": 1e-9, "expansion": 0.0}
    return make_case(
        {
            "geometry": {
                "file": "blocks.geo",
                "degree": 2,
                "parameters": {"punch_height": HEIGHTS[0], "strip_height": HEIGHTS[1], "punch_layers": layers},
            },
            "materials": {name: {**mechanical, **own} for name, own in materials.items()},
            "punch": {
                "regions": {"punch_body": "upper"},
                "supports": [{"on": "punch_sides", "fix": ["x"]}],
                "loads": [{"on": "punch_far", "traction": [0, -4]}],
                "temperatures": [{"on": "punch_far", "temperature": FAR[0]}],
            },
            "strip": {
                "regions": {"strip_body": "lower"},
                "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
                "temperatures": [{"on": "strip_far", "temperature": FAR[1]}],
            },
            "wear": {"punch": {"coefficient": 0}},
            "motion": {"kind": "reciprocating", "amplitude": 1e-7, "period": 2 * duration},
            "heat": {"initial": FAR[1], "steps": 1, **heat},
            "run": {"half_cycles": half_cycles},
            "output": {"report": False, "fields_at": []},
        }
    )


def growing(k0: float) -> dict[str, str]:
    return {"expression": f"{k0} * (1 + {SLOPE} * T)"}


def marched(system: Tribosystem, half_cycles: int, start: RunState | None = None) -> list[Block]:
    return list(follow(system, march_within, RunLimits(half_cycles), start))


def by_kirchhoff() -> float:
    """Return the temperature between the blocks: K = integral of k is linear in each, and the flux the same."""

    def potential(k0: float, t: float) -> float:
        return k0 * (t + SLOPE * t**2 / 2)

    def unequal(t: float) -> float:
        above = (potential(K0[0], FAR[0]) - potential(K0[0], t)) / HEIGHTS[0]
        return above - (potential(K0[1], t) - potential(K0[1], FAR[1])) / HEIGHTS[1]

    return float(brentq(unequal, FAR[1], FAR[0], xtol=1e-12))


def test_kirchhoff() -> None:
    """k = k0 (1 + a T) in two blocks in series: the error falls with the tolerance, down to the mesh's."""
    exact, errors = by_kirchhoff(), []
    for tolerance in (0.3, 0.03, 1e-6):
        materials = {
            name: {"conductivity": growing(k0), "heat_capacity": 1e9}
            for name, k0 in zip(("upper", "lower"), K0, strict=True)
        }
        case = stack(materials, 1e6, 16, operator="full", property_tolerance=tolerance)
        last = marched(assemble(case), 16)[-1]
        assert last.heat is not None
        np.testing.assert_allclose(last.heat.temperature_punch[-1], last.heat.temperature_strip[-1], rtol=1e-9)
        errors.append(float(np.abs(last.heat.temperature_punch[-1] - exact).max()))
    assert errors[1] < 0.1 * errors[0]
    assert errors[0] < 0.3 * (FAR[0] - FAR[1])
    assert errors[2] < 1e-5


def rubbing(mu: float, p: float, speed: float, degree: int = 3) -> Case:
    """Return the two blocks with friction, one sliding on the other."""
    materials = {
        name: {"conductivity": growing(k0), "heat_capacity": 1.0}  # next to no heat is carried along
        for name, k0 in zip(("upper", "lower"), K0, strict=True)
    }
    assert p == 4.0  # the load of the stack
    case = stack(materials, 1.0, 2, reduction_tolerance=1e-7)
    tables = case.model_dump(exclude_unset=True) | {
        "contact": {"friction": mu},
        "wear": {"punch": {"coefficient": 1e-9}},
        "motion": {"kind": "one-way", "speed": speed, "direction": "rightward", "duration": 1.0},
        "geometry": {
            "file": "blocks.geo",
            "degree": degree,
            "parameters": {**case.geometry.parameters, "punch_layers": 4, "strip_layers": 4},
        },
    }
    return make_case(tables)


@pytest.mark.mpi
def test_steady_heat_by_kirchhoff() -> None:
    """Friction heats both blocks: the whole fields of `steady` are those of Kirchhoff's transform, node by node.

    q flows off through both, so that in each K(T) - K(T far) = q_i h_i (1 - depth / h_i), K(T) = k0 (T + a T² / 2),
    with the same temperature at the contact. The error falls with the tolerance of the properties, to the mesh's.
    """
    mu, p, speed = 0.5, 4.0, 400.0  # 800 mW/mm²
    system = assemble(rubbing(mu, p, speed), heat="reduced")

    def kirchhoff(k0: float, t: Any) -> Any:
        return k0 * (t + SLOPE * t**2 / 2)

    def carried(t: float) -> float:
        return sum((kirchhoff(k0, t) - kirchhoff(k0, far)) / h for k0, far, h in zip(K0, FAR, HEIGHTS, strict=True))

    top = float(brentq(lambda t: carried(t) - mu * p * speed, FAR[1], 1e3, xtol=1e-12))
    errors = []
    for within in (0.1, 1e-5):
        state = steady(system, properties_within=within)
        assert state.heat is not None
        worst = 0.0
        for body, found, k0, far, h in zip(
            state.system.bodies.heat, state.heat.end.temperatures(), K0, FAR, HEIGHTS, strict=True
        ):
            depth = np.abs(body.space.tabulate_dof_coordinates()[: body.owned, 1])
            share = kirchhoff(k0, far) + (kirchhoff(k0, top) - kirchhoff(k0, far)) * (1 - depth / h)
            exact = (np.sqrt(1 + 2 * SLOPE * share / k0) - 1) / SLOPE
            worst = max(worst, float(np.abs(found - exact).max(initial=0.0)))
        errors.append(system.bodies.comm.allreduce(worst, op=MPI.MAX))
    assert top > FAR[0] + 30
    assert errors[0] > 1e-4 * top
    assert errors[1] < 2e-5 * top
    alone = monotonic(system, properties_within=1e-5)
    assert np.abs(np.array([alone.punch, alone.strip]) - top).max() < 2e-5 * top


def test_heating_up() -> None:
    """k(T) and c(T) while the blocks warm up, against finite volumes: first order in the step.

    The punch alone, with nothing conducted at the contact: volumes in z, and backward differences in time.
    """
    c0, cells, until = 1e9, 60, 0.2
    h = HEIGHTS[0] / cells

    def capacity(t: Any) -> Any:
        return 1 + 0.01 * t

    def rate(_: float, t: Any) -> Any:
        edges = np.concatenate([FAR[:1], t])
        k = K0[0] * (1 + SLOPE * (edges[1:] + edges[:-1]) / 2)
        k[0] *= 2  # half a cell away
        flux = k * np.diff(edges) / h
        return (np.append(flux[1:], 0.0) - flux) / h / capacity(t)

    line = solve_ivp(rate, (0, until), np.full(cells, FAR[1]), method="BDF", rtol=1e-9, atol=1e-9).y[:, -1]
    exact = line[-1] + (line[-1] - line[-2]) / 8  # at the insulated end
    errors: list[float] = []
    for steps in (16, 32):
        own = {"conductivity": growing(K0[0]), "heat_capacity": {"table": [[0, c0], [100, 2 * c0]]}}
        other = {"conductivity": 1.0, "heat_capacity": c0}
        heat = {"operator": "full", "property_tolerance": 1e-4, "conductance": 0.0}
        case = stack({"upper": own, "lower": other}, until / steps, steps, layers=8, **heat)
        last = marched(assemble(case), steps)[-1]
        assert last.heat is not None
        errors.append(float(last.heat.temperature_punch[-1].mean() - exact))
    assert 0.3 < errors[1] / errors[0] < 0.7
    assert abs(2 * errors[1] - errors[0]) < 2e-3 * (exact - FAR[1])


def test_uniform_warmth_is_other_constants(edited: Edited) -> None:
    """Warm all over, the bodies are those of the constants there: gaps, compliances, heat and all."""

    def warm(tables: dict[str, Any]) -> None:
        tables["materials"]["composite"] |= {
            "young": {"table": [[0, 130], [100, 80]], "unit": "GPa"},
            "expansion": {"expression": "3e-5 + 1e-7 * T"},
            "conductivity": {"expression": "5 + 0.02 * T", "unit": "W/(m K)"},
            "heat_capacity": {"expression": "1200 + 2 * T", "unit": "J/(kg K)"},
        }

    def constant(tables: dict[str, Any]) -> None:
        tables["materials"]["composite"] |= {
            "young": "100 GPa",
            "expansion": 9e-6 + 2.7e-5,
            "conductivity": 6.2,
            "heat_capacity": "1320 J/(kg K)",
        }

    cold = assemble(edited("example1-heat", warm, *SMALL))
    other = assemble(edited("example1-heat", constant, *SMALL))
    at = HeatState.nodal(cold.bodies.heat, [np.full(body.owned, 60.0) for body in cold.bodies.heat])
    assert properties_outdated(cold, at)
    hot = warmed_system(cold, at)
    assert not properties_outdated(hot, at)
    assert hot.bodies.punch is not cold.bodies.punch
    assert np.array_equal(taken_at(hot)[0], np.full(cold.bodies.heat[0].owned, 60.0))
    answers = list(other.elastic.condensed.punch.arrays().values())
    unit = 1e-3 * max(np.abs(its).max(initial=0) for its in answers)  # loads of free bodies leave rounding alone
    for own, its in zip(hot.elastic.condensed.punch.arrays().values(), answers, strict=True):
        np.testing.assert_allclose(own, its, atol=1e-9 * max(np.abs(its).max(initial=0), unit))
    np.testing.assert_allclose(hot.exchange.gap(at), other.exchange.gap(at), rtol=1e-8)
    assert np.abs(hot.exchange.gap(at) / cold.exchange.gap(at) - 1).max() > 0.05
    (one,), (two,) = march(hot, 1), march(other, 1)
    np.testing.assert_allclose(one.pressure, two.pressure, rtol=1e-6)
    assert one.heat is not None
    assert two.heat is not None
    np.testing.assert_allclose(one.heat.temperature_punch, two.heat.temperature_punch, rtol=1e-5)


def softening(tables: dict[str, Any]) -> None:
    """Let the composite soften and conduct better with warmth."""
    tables["materials"]["composite"] |= {
        "young": {"table": [[0, 130], [100, 80]], "unit": "GPa"},
        "conductivity": {"expression": "5 + 0.2 * T", "unit": "W/(m K)"},
    }
    tables["heat"]["property_tolerance"] = 0.05


def _settled(state: SteadyState) -> Block:
    """Return two cycles of a march from a steady state."""
    assert state.heat is not None
    system = state.system
    worn = WornDepths(np.nan_to_num(state.shape - np.nanmin(state.shape)), system.unworn().strip)
    start = replace(beginning(system, state.heat.end), worn=worn)
    return list(evolve(system, 4, integration="explicit", start=start))[-1]


def test_steady_is_the_end_of_a_march(edited: Edited) -> None:
    """Gone on with from there, a march stays: its properties are those of its temperatures already."""
    case = edited("example1-heat", softening, *SMALL, "heat.steps=2", "heat.property_tolerance=1e-3")
    system = assemble(case, heat="reduced")
    state = steady(system, properties_within=1e-5)
    assert state.passes > 2
    assert state.heat is not None
    cold = steady(system, properties_within=10.0)
    assert cold.heat is not None
    assert np.abs(cold.heat.punch - state.heat.punch).max() > 5
    last = _settled(state)
    assert last.heat is not None
    assert last.system.bodies.warmed is state.system.bodies.warmed
    np.testing.assert_allclose(last.pressure[-2:], state.pressure, atol=2e-3 * state.pressure.max())
    np.testing.assert_allclose(last.heat.temperature_punch[-2:], state.heat.punch, atol=2e-3 * state.heat.punch.max())


def test_one_way_temperatures_have_their_own_properties(edited: Edited) -> None:
    """Of each direction, node by node, they are those of the steady state of sliding that way."""
    settings = (*SMALL, "heat.property_tolerance=1e-3", "heat.reduction_tolerance=1e-6")
    system = assemble(edited("example1-heat", softening, *settings), heat="none")
    found = monotonic(system)
    motion = f"motion={{kind='one-way', direction='leftward', speed={system.motion.mean_speed!r}, duration=0.1}}"
    state = steady(assemble(edited("example1-heat", softening, *settings, motion), heat="reduced"))
    assert state.heat is not None
    assert state.passes > 1
    for own, its in ((found.punch, state.heat.punch), (found.strip, state.heat.strip)):
        np.testing.assert_allclose(own[0], its[-1], atol=1e-4 * np.abs(its).max())
        assert np.abs(own[1] - own[0]).max() > 0.1 * own.max()
    np.testing.assert_allclose(found.pressure[0], state.pressure[-1], atol=1e-4 * state.pressure.max())


def test_jumps_follow_as_marches(edited: Edited) -> None:
    """Jumped and marched, the properties follow alike, to what they lag behind by."""
    case = edited("example1-heat", softening, *SMALL, "run.half_cycles=16", "heat.steps=2")

    system = assemble(case, heat="reduced")
    jumped, last = (
        list(follow(system, partial(jump_within, tolerance=1e-3), RunLimits(16)))[-1],
        marched(system, 16)[-1],
    )
    for block in (jumped, last):
        assert block.system.bodies.warmed is not None
        assert block.heat is not None
    assert last.heat is not None
    assert jumped.heat is not None
    one, other = last.heat.temperature_punch[-1], jumped.heat.temperature_punch[-1]
    np.testing.assert_allclose(other, one, atol=0.015 * one.max())


@pytest.mark.mpi
def test_a_run_goes_on_with_its_properties(tmp_path: Path) -> None:
    """Ended in between and resumed, a run is the one that was not: its properties are those last taken."""
    materials: dict[str, Any] = {"upper": {"conductivity": growing(K0[0]), "heat_capacity": 1e9}}
    materials["lower"] = {**materials["upper"], "young": {"expression": "1e5 - 200 * T"}}
    part = stack(materials, 0.03, 5)
    whole = part.model_copy(update={"run": part.run.model_copy(update={"half_cycles": 9})})
    told: list[str] = []
    run_case(whole, "whole", tmp_path / "whole", told.append, progress="none")
    assert any("properties are those" in line for line in told)
    run_case(part, "part", tmp_path / "part", told.append, progress="none")
    run_case(whole, "part", tmp_path / "part", told.append, resume=True, progress="none")
    one, other = (read_history(tmp_path / name) for name in ("whole", "part"))
    for name in ("pressure", "temperature_punch", "wear"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-8, atol=1e-12)


def test_refused(edited: Edited) -> None:
    """What is no property of the temperature alone, what cannot be followed, and values that are none."""

    def composite(**keys: Any) -> Callable[[dict[str, Any]], None]:
        return lambda tables: tables["materials"]["composite"].update(keys)

    with pytest.raises(CaseError, match="conductivity: expected an expression, a table or a law of T alone"):
        edited("example1-heat", composite(conductivity={"expression": "5 + p"}))
    with pytest.raises(CaseError, match=r"young\.unit: .*of another kind"):
        edited("example1-heat", composite(young={"expression": "5 + T", "unit": "W/(m K)"}))
    with pytest.raises(CaseError, match=r"^materials\.composite\.young: .*\bheat\b"):
        edited("example1", composite(young={"expression": "1e5 - T"}))
    with pytest.raises(CaseError, match=r"composite.conductivity: .*1.*0"):
        assemble(edited("example1-heat", composite(conductivity={"expression": "T - 1"}), *SMALL))
    sinking = edited("example1-heat", composite(conductivity={"expression": "5 - 0.5 * T"}), *SMALL)
    with pytest.raises(CaseError, match=r"composite.conductivity:"):
        marched(assemble(sinking), 40)


def test_jumps_over_a_program_follow_as_marches(edited: Edited) -> None:
    """Load steps, a ramp and other surroundings: properties follow over all stages alike, jumped and marched.

    Wear is that of load and distance exactly, and a stage begins with the properties that the stage before has left.
    """
    steps: list[dict[str, Any]] = [
        {"cycles": 4, "load": "10 kN"},
        {"cycles": 6, "load": ["10 kN", "20 kN"], "ambient": "20 K"},
    ]

    def program(tables: dict[str, Any]) -> None:
        tables["materials"]["composite"]["conductivity"] = {"expression": "5 + 0.2 * T", "unit": "W/(m K)"}
        tables["heat"]["property_tolerance"] = 0.2
        tables["program"] = {"steps": steps}
        tables["run"].pop("half_cycles")

    case = edited("example1-heat", program, "geometry.degree=2", "geometry.parameters.elements_along_contact=4",
                  "heat.steps=2", "geometry.follow_wear=never")  # fmt: skip
    system = assemble(case, heat="reduced")
    ends = []
    for way in ("jump", "implicit"):
        blocks = list(evolve(system, integration=way, tolerance=1e-3))
        late = [block.system.bodies.warmed for block in blocks if block.half_cycle[0] > 8]
        early = [block.system.bodies.warmed for block in blocks if block.half_cycle[-1] <= 8]
        assert len({id(one) for one in late}) > 1
        assert early[-1] is not None
        assert late[0] is not None
        last = blocks[-1]
        assert last.half_cycle[-1] == 20
        assert last.heat is not None
        path = 6.0 * (4 * 10e3 + 6 * 15e3)  # a cycle slides 4 u0
        worn = float(system.pair.weights @ last.wear[-1]) * system.bodies.punch.thickness
        assert worn == pytest.approx(1.25 * np.pi * 1e-8 * path, rel=1e-9)
        ends.append((last.heat.temperature_punch[-1], last.wear[-1]))
    (warm, depth), (exact, exact_depth) = ends
    np.testing.assert_allclose(warm, exact, atol=0.03 * exact.max())
    assert (np.abs(depth - exact_depth) < exact_depth / 20).all()  # the wear of a half-cycle: what a march errs by


def test_derivative_of_a_warm_steady_state() -> None:
    """dT/dmu of Kirchhoff's transform, (sum of k_i(T) / h_i) dT = p v dmu: properties of each state, by differences."""
    mu, p, speed, step = 0.5, 4.0, 400.0, 5e-4
    model, quantity = Model(rubbing(mu, p, speed, degree=2)), parse_quantity("steady temperature")
    low, high = (evaluate(model, quantity, {"contact.friction": mu + sign * step})[0] for sign in (-1, 1))
    top = (low + high) / 2
    exact = p * speed / sum(k0 * (1 + SLOPE * top) / h for k0, h in zip(K0, HEIGHTS, strict=True))
    assert (high - low) / (2 * step) == pytest.approx(exact, rel=1e-5)
