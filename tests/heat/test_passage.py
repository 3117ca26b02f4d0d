"""A strip that passes under the punch through a cycle that a table gives: whichever way it shifts and turns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import erf

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.heat.heat_exchange import CROSSING, TERMS
from fenwear.heat.periodic_heat import CycleHeat
from fenwear.system import steady_exchange

TO_STRIP = {"partition": 0.0, "debris": 0.0, "conductance": 0.0, "conducting": "nominal", "convection": 0.0}
POSITIONS = 3
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=6", "geometry.parameters.overlap=3",
         'wear.strip={coefficient="1e-8 1/MPa"}')  # fmt: skip


def table(rows: list[list[float]], *columns: str) -> str:
    return f"motion={{kind='cycle', positions='steps', columns={['time (s)', *columns]}, rows={rows}}}"


@pytest.mark.mpi
def test_a_sine_is_the_reciprocating_motion(assembled: Callable[..., Tribosystem]) -> None:
    """On the whole meshes pressures, depths and temperatures are the same to rounding."""
    half = load_case("example1-heat").motion.half_period  # type: ignore[union-attr]
    times = np.linspace(0, 2 * half, 2 * POSITIONS + 1)
    rows = [[float(t), float(-1.5 * np.cos(np.pi * t / half))] for t in times]
    settings = (*SMALL, "heat.operator=full")
    steps, own = f"heat.steps={POSITIONS}", f"heat.steps={2 * POSITIONS}"
    known = assembled("example1-heat", *settings, f"motion.positions={POSITIONS}", steps)
    found = assembled("example1-heat", *settings, table(rows, "shift_x (mm)"), own)
    one, other = list(march(known, 8))[-1].end, list(march(found, 4))[-1].end
    for body in ("punch", "strip"):
        depth = getattr(one.worn, body)
        np.testing.assert_allclose(getattr(other.worn, body), depth, rtol=0, atol=1e-12 * depth.max())
    for first, second in zip(one.contacts, other.contacts, strict=True):
        assert first is not None
        assert second is not None
        np.testing.assert_allclose(second.pressure, first.pressure, rtol=0, atol=1e-11 * first.pressure.max())
    assert one.temperature is not None
    assert other.temperature is not None
    for first, second in zip(
        known.exchange.contact_temperatures(one.temperature),
        found.exchange.contact_temperatures(other.temperature),
        strict=True,
    ):
        np.testing.assert_allclose(second, first, rtol=0, atol=1e-11 * first.max())


def test_rows_of_unequal_times(assembled: Callable[..., Tribosystem]) -> None:
    """Rows that are left out where the load stays and the way goes on change nothing but the steps of time.

    The balance of heat closes for each, and jumps end where the direct solution is.
    """
    speed = 40.0
    coarse = [[0, 0], [0.05, 2], [0.15, -2], [0.2, 0]]
    fine = [
        [t, x] for t, x in [(0.0, 0.0), (0.025, 1.0), (0.05, 2.0), (0.1, 0.0), (0.15, -2.0), (0.175, -1.0), (0.2, 0.0)]
    ]
    ends = []
    for rows in (coarse, fine):
        system = assembled("example1-heat", *SMALL[:3], table(rows, "shift_x (mm)").replace("'steps'", "'middle'"))
        assert len({plan.duration for row in system.exchange.plans for plan in row}) == 2
        pressure = np.full((len(rows) - 1, len(system.pair.weights)), 10.0)
        state, terms = system.exchange.initial(), np.zeros(len(TERMS) + len(CROSSING))
        for phase, own in enumerate(pressure):
            state, made = system.exchange.half_cycle(state, phase, own, system.exchange.conductance(own))
            terms += made
        friction = 0.25 * 10.0 * speed * 0.2 * system.pair.weights.sum() * 10.0
        assert terms[0] == pytest.approx(friction, rel=1e-9)
        assert terms[0] == pytest.approx(terms[1 : len(TERMS)].sum(), rel=1e-9)
        heat = CycleHeat(system.exchange)
        end = heat.jump(heat.initial(), np.inf, heat.conductances(pressure))
        ends.append(heat.exchange.contact_temperatures(heat.exchange.at(end.state(pressure)))[1])
    assert np.abs(ends[1] - ends[0]).max() < 0.005 * ends[1].max()


@pytest.mark.mpi
def test_steady_state_with_heat(assembled: Callable[..., Tribosystem]) -> None:
    """Pressures and temperatures of the direct solution are where jumps end."""
    rows = [[0, 2, -4], [0.1, -1, -8], [0.2, -2, -10], [0.3, 2, -4]]
    columns = ["time (s)", "shift_x (mm)", "force_z (kN)"]
    motion = f"motion={{kind='cycle', columns={columns}, rows={rows}, load={{on='punch_load'}}}}"
    settings = ("punch.loads=[]", "wear.punch={coefficient=1e-7}", "contact.friction=0.02", motion)
    system = assembled("example2-heat", *SMALL[:3], *settings)
    state = steady(system)
    *_, last = jump(system, 40_000, tolerance=1e-2)
    ended = np.concatenate([contact.pressure for contact in last.end.contacts])
    np.testing.assert_allclose(ended, state.phase_pressure, atol=1e-6 * state.phase_pressure.max())
    assert state.heat is not None
    warm = system.exchange.contact_temperatures(last.end.temperature)[0]
    np.testing.assert_allclose(warm, state.heat.punch[-1], atol=1e-6 * warm.max())


HALF, PERIOD, CONDUCTIVITY, CAPACITY = 1.0, 0.1, 3.0, 2.0
CORNERS = 0.7 * np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 7)])  # of the strip's way


def round_case() -> Case:
    """Return a square punch under which a wide block goes round in a hexagon, that alone takes the heat."""
    from fenwear_verify.solid import STEEL, describe

    sizes = {"width": 2 * HALF, "depth": 2 * HALF, "margin_x": 1.5, "margin_y": 1.5, "strip_height": 1.5, "growth": 1.3,
             "across_x": 4, "across_y": 4, "margin_elements": 3, "strip_layers": 3, "punch_layers": 1}  # fmt: skip
    material = {**STEEL, "conductivity": CONDUCTIVITY, "heat_capacity": 2 * CAPACITY, "density": 0.5, "expansion": 0.0}
    rows = [[PERIOD * k / 6, float(x), float(y)] for k, (x, y) in enumerate(CORNERS)]
    return describe(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": sizes},
        {
            "supports": [{"on": "punch_sides", "fix": ["x", "y"]}],
            "loads": [{"on": "punch_far", "force": [0, 0, -1]}],
            "temperatures": [{"on": "punch_far"}],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
        materials=(material, material),
        contact={"friction": 0.3},
        motion={"kind": "cycle", "columns": ["time (s)", "shift_x (mm)", "shift_y (mm)"], "rows": rows},
        heat={**TO_STRIP, "steps": 24},
    )


def half_space(x: Array, y: Array, flux: float) -> Array:
    """Return the temperature of a half-space at (x, y) after a cycle in which a square source has gone round on it.

    The integral over time of the instantaneous square source q / (rho c sqrt(pi a tau)) times error functions.
    """
    nodes, weights = np.polynomial.legendre.leggauss(400)
    total = np.zeros(len(x))
    for node, weight in zip(nodes, weights, strict=True):
        root = (node + 1) / 2 * np.sqrt(PERIOD)
        share = 6 * (PERIOD - root**2) / PERIOD
        middle = [-np.interp(share, range(7), corners) for corners in CORNERS.T]
        wide = np.sqrt(4 * CONDUCTIVITY / CAPACITY) * root
        ends = [[erf((c - m + side * HALF) / wide) for side in (1, -1)] for c, m in zip((x, y), middle, strict=True)]
        shape = (ends[0][0] - ends[0][1]) * (ends[1][0] - ends[1][1]) / 4
        total += weight * np.sqrt(PERIOD) * flux / np.sqrt(np.pi * CONDUCTIVITY * CAPACITY) * shape
    return total


@pytest.mark.slow
def test_a_source_that_goes_round() -> None:
    """A strip that goes round under a square punch is as warm as the half-space, at every node but those of the rim."""
    system = assemble(round_case())
    exchange, pressure = system.exchange, np.ones(len(system.pair.weights))
    state = exchange.initial()
    for phase in range(6):
        state, _ = exchange.half_cycle(state, phase, pressure, exchange.conductance(pressure))
    found, x, weights = exchange.contact_temperatures(state, 5)[1], system.pair.punch.x, system.pair.weights
    speed = 6 * np.linalg.norm(CORNERS[1] - CORNERS[0]) / PERIOD
    expected = half_space(x[:, 0] - CORNERS[0, 0], x[:, 1] - CORNERS[0, 1], 0.3 * speed)
    inner = np.abs(x[:, :2]).max(axis=1) < 0.9 * HALF
    assert np.abs(found - expected)[inner].max() < 0.02 * expected.max()
    assert weights @ found == pytest.approx(weights @ expected, rel=0.005)


def test_a_shaft_that_turns_round() -> None:
    """Full turns of a shaft in its bore, in its own frame, are as hot as where its material moves through the mesh."""
    rows, period, elements = 16, 0.1, 24
    thermal = 'conductivity="50 W/(m*K)",heat_capacity="460 J/(kg*K)",density="7800 kg/m^3",expansion="1e-5 1/K"'
    settings = [f'materials.{name}={{young="210 GPa",poisson=0.3,{thermal}}}' for name in ("bronze", "steel")]
    settings += [f"heat.{key}={value}" for key, value in TO_STRIP.items()]
    settings += [f'{body}.temperatures=[{{on="{on}",temperature="0 K"}}]' for body, on in
                 (("punch", "punch_top"), ("strip", "strip_bottom"))]  # fmt: skip
    settings += ["heat.convecting_faces=false", f"geometry.parameters.elements_along_contact={elements}"]
    speed = 2 * np.pi / period
    turning = f'motion={{kind="rotation",axis=[0,1,0],angular_speed="{speed} rad/s",duration="{period} s"}}'
    through, own = (
        assemble(load_case("bushing", [*settings, motion]))
        for motion in (
            turning,
            table([[period * k / rows, 360.0 * k / rows] for k in range(rows + 1)], "angle_y (deg)"),
        )
    )
    x = through.pair.punch.x
    pressure = np.maximum(x[:, 1], 0.0) / 10.0
    fixed = steady_exchange(through, [speed])
    state, _ = fixed.half_cycle(fixed.initial(), 0, pressure, fixed.conductance(pressure))
    expected = fixed.contact_temperatures(state)[1]
    heat, every = CycleHeat(own.exchange), np.tile(pressure, (rows, 1))
    end = heat.jump(heat.initial(), np.inf, heat.conductances(every))
    found = own.exchange.contact_temperatures(own.exchange.at(end.state(every)))[1]
    assert np.abs(found - expected).max() < 0.01 * expected.max()


def test_rings_that_oscillate() -> None:
    """Rings are as warm all around: by a table that turns them to and fro as by an oscillation."""
    small = ["run.half_cycles=4"]
    turning = "motion={kind='oscillation',amplitude='1 rad',period='1 s',profile='triangular'}"
    own = table([[0, -1], [0.5, 1], [1, -1]], "angle_z (rad)").replace("'steps'", "'middle'")
    known, found = (
        assemble(load_case("ring-on-ring-heat", [*small, motion, f"heat.steps={steps}"]))
        for motion, steps in ((turning, 5), (own, 10))
    )
    one, other = list(march(known, 4))[-1].end, list(march(found, 2))[-1].end
    temperatures = [s.exchange.contact_temperatures(e.temperature) for s, e in ((known, one), (found, other))]
    for first, second in zip(*temperatures, strict=True):
        np.testing.assert_allclose(second, first, rtol=1e-9)


def test_out_of_the_plane() -> None:
    motion = "motion={kind='cycle',columns=['time (s)','shift_x (mm)','shift_y (mm)'],rows=[[0,1,0],[1,0,1],[2,1,0]]}"
    with pytest.raises(CaseError, match=r"motion.columns:"):
        load_case("example1-heat", [motion])
