"""Contact, heat and wear together: couplings, time steps, jumps, the steady state and its stability."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import ConvergenceError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.common.arrays import Array
from fenwear.contact import CondensedContact, ContactState
from fenwear.heat import heat_exchange
from fenwear.laws.wear import WornDepths
from fenwear.steps import Block, coupled_phases, growth_rate, stationary_growth
from fenwear.steps.coupled_phases import cycle_heat
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within, march_within
from fenwear.steps.run_state import RunState, none_yet
from fenwear.steps.stability import repeating_temperatures
from fenwear.steps.tangent import phase_tangent

Assemble = Callable[..., Tribosystem]
MEAN = 1e4 / 600
# Faces that convect and no debris: all losses, and a strong feedback.
COARSE = (
    "geometry.parameters.elements_along_contact=4",
    "geometry.degree=2",
    "heat.convecting_faces=true",
    "heat.debris=0",
)


def run(system: Tribosystem, half_cycles: int, **options: Any) -> Block:
    (block,) = march_within(system, RunLimits(half_cycles, block=half_cycles), **options)
    return block


def temperatures(block: Block) -> Array:
    assert block.heat is not None
    return np.stack([block.heat.temperature_punch, block.heat.temperature_strip], axis=1)


@pytest.mark.parametrize("relaxation", [0.4, 1.0])
@pytest.mark.parametrize(
    "settings",
    [
        (),
        ("heat.conducting=nominal",),
        ("heat.conductance=0", "heat.conductance_per_pressure=[0.1, 0.3]"),
        ("heat.conductance=perfect", "heat.debris=0.2"),
    ],
)
def test_split_and_implicit_agree(assembled: Assemble, settings: tuple[str, ...], relaxation: float) -> None:
    """Both solve the same half-cycle: converged, (29)-(30) and the coupled inequality give the same to 1e-6."""
    implicit = run(assembled("example1-heat", *COARSE, *settings), 30)
    tight = ("heat.coupling=split", "heat.split_tolerance=1e-12", f"heat.relaxation={relaxation}")
    split = run(assembled("example1-heat", *COARSE, *settings, *tight), 30)
    assert (implicit.contact_width < 59.5).any()  # nodes open, so that the conductance changes
    np.testing.assert_allclose(split.pressure, implicit.pressure, rtol=0, atol=1e-6 * MEAN)
    np.testing.assert_allclose(temperatures(split), temperatures(implicit), rtol=0, atol=1e-5)
    np.testing.assert_array_equal(split.contact_width, implicit.contact_width)


def test_split_tolerance(assembled: Assemble) -> None:
    """The error of the split falls with its tolerance; the published one (0.01 %) is near 1 % of the pressure."""
    implicit = run(assembled("example1-heat", *COARSE), 30)
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        system = assembled("example1-heat", *COARSE, "heat.coupling=split", f"heat.split_tolerance={tolerance}")
        errors.append(np.abs(run(system, 30).pressure - implicit.pressure).max() / MEAN)
    assert 0.03 > errors[0] > 5 * errors[1] > 25 * errors[2]


def test_too_much_heat_names_the_half_cycle(assembled: Assemble, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too much heat in a half-cycle, without smaller steps, ends with its number and all that came before."""
    monkeypatch.setattr("fenwear.steps.gross_sliding.PARTS", ())
    system = assembled("example1-heat", *COARSE, "motion.amplitude=14")
    done: list[int] = []
    blocks = march(system, 40)
    with pytest.raises(ConvergenceError, match=r"half-cycle \d+: .*did not converge") as failure:
        done.extend(number for block in blocks for number in block.half_cycle)
    number = int(re.findall(r"half-cycle (\d+)", str(failure.value))[0])
    assert number > 1
    assert done == list(range(1, number))


def test_slow_split_gives_advice(assembled: Assemble, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relaxation too small to come to an end in the iterations there are: the error names the key."""
    monkeypatch.setattr("fenwear.steps.gross_sliding.PARTS", ())
    slow = ("heat.relaxation=0.01", "heat.split_tolerance=1e-12")
    system = assembled("example1-heat", *COARSE, "heat.coupling=split", *slow)
    with pytest.raises(ConvergenceError, match=r"half-cycle 1: the operator split.*heat\.relaxation"):
        run(system, 2)


def test_order_in_time_steps(assembled: Assemble) -> None:
    """1, 5 and 20 steps in a half-cycle: of second order toward 80 in the punch, in whose frame its material rests."""
    settings = ("heat.operator=full", "heat.partition=0.5")
    ends = [
        temperatures(run(assembled("example1-heat", *COARSE, *settings, f"heat.steps={n}"), 20))[-2:, 0]
        for n in (5, 10, 20, 80, 1)
    ]
    errors = np.array([np.abs(end - ends[3]).max() for end in ends])
    assert (errors[:2] > 3.5 * errors[1:3]).all()
    assert errors[4] > 5 * errors[0]
    assert errors[0] < 0.01 * np.abs(ends[3]).max()


@pytest.mark.parametrize(
    ("settings", "half_cycles"),
    [(("heat.partition=0.1",), 2000), (("heat.partition=0.2", "heat.conducting=nominal"), 400)],
)
def test_jump_equals_march(assembled: Assemble, settings: tuple[str, ...], half_cycles: int) -> None:
    """Where the feedback is stable, jumps end where the march ends, and nearer with a smaller tolerance.

    A jump's phases meet the shape in the middle of its cycle, marches that of the step's start or end: halfway
    between explicit and implicit is what they are compared with, and half of their distance is left of the error.
    It does not fall evenly from one tolerance to the next: 0.13, 0.13, 0.26, 0.17, 0.06 % after 2,000 half-cycles at
    2e-2, 1e-2, 3e-3, 1e-3, 3e-4.
    """
    system = assembled("example1-heat", *COARSE, "wear.punch.coefficient=4e-8", *settings)
    ends = [run(system, half_cycles, implicit=implicit) for implicit in (False, True)]
    pressure = np.mean([end.pressure[-2:] for end in ends], axis=0)
    heated = np.mean([temperatures(end)[-2:] for end in ends], axis=0)
    floor = np.abs(ends[0].pressure[-2:] - pressure).max() / MEAN
    errors = []
    for tolerance in (2e-2, 3e-4):
        *_, end = jump(system, half_cycles, tolerance=tolerance)
        assert end.half_cycle[-1] == half_cycles
        difference = np.abs(temperatures(end)[-2:] - heated).max()
        errors.append((np.abs(end.pressure[-2:] - pressure).max() / MEAN, difference))
    assert errors[1][0] < 0.01
    assert errors[1][1] < 0.1
    assert errors[1][0] < errors[0][0] + floor


@pytest.mark.parametrize("settings", [("heat.partition=0.1",), ("heat.conductance=perfect", "heat.partition=0.5")])
def test_heat_may_be_lagged(assembled: Assemble, monkeypatch: pytest.MonkeyPatch, settings: tuple[str, ...]) -> None:
    """Contact of many nodes at known heat, again and again, and fluxes by factors: the same jumps as all at once."""
    system = assembled("example1-heat", *COARSE, *settings)
    at_once = list(jump_within(system, RunLimits(400, block=2), tolerance=0.01))
    monkeypatch.setattr(coupled_phases, "MANY", 0)
    monkeypatch.setattr(heat_exchange, "FEW", 0)
    solved: list[bool] = []
    solve = CondensedContact.solve

    def noted(self: CondensedContact, gap: Array, start: Any = None, wearing: Any = None, coupling: Any = None) -> Any:
        solved.append(coupling is not None)
        return solve(self, gap, start, wearing, coupling)

    monkeypatch.setattr(CondensedContact, "solve", noted)
    fresh = replace(system, exchange=system.exchange.varied(system.case.heat, system.exchange.friction))
    lagged = list(jump_within(fresh, RunLimits(400, block=2), tolerance=0.01))
    assert len(solved) > 100
    assert sum(solved) < 0.05 * len(solved)
    assert [int(block.half_cycle[-1]) for block in lagged] == [int(block.half_cycle[-1]) for block in at_once]
    for one, other in zip(lagged, at_once, strict=True):
        np.testing.assert_allclose(one.pressure, other.pressure, rtol=0, atol=1e-6 * MEAN)
        np.testing.assert_allclose(temperatures(one), temperatures(other), rtol=0, atol=1e-6)


def test_open_nodes_conduct_in_no_jump(assembled: Assemble, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each stage ends with the temperatures of the nodes that are closed in it: none that opens is left conducting."""
    ends: list[float] = []
    solve = coupled_phases.Coupled.solve

    def followed(self: Any, temperature: Any, cycles: float, *rest: Any, **settings: Any) -> Any:
        solved = solve(self, temperature, cycles, *rest, **settings)
        pressure = solved.contact.pressure
        own = self.heat.jump(temperature, cycles, self.heat.conductances(pressure))
        ends.append(float(np.abs(own.state(self.mu * pressure) - solved.temperature).max()))
        return solved

    monkeypatch.setattr(coupled_phases.Coupled, "solve", followed)
    system = assembled("example1-heat", *COARSE, "heat.conductance=perfect", "heat.partition=0.5")
    *_, last = jump(system, 300, tolerance=0.01)
    assert (last.pressure[-1] == 0).any()
    assert len(ends) > 50
    assert max(ends) < 1e-5


def test_march_tends_to_the_steady_state(assembled: Assemble) -> None:
    """Where the feedback is stable a march and the direct solve agree, up to the wear between two half-cycles.

    Then the run repeats: even and odd half-cycles each keep their pressures and temperatures (Fig. 8d), and
    the mean flux is the same in both directions (31).
    """
    system = assembled("example1-heat", *COARSE, "heat.partition=0.2", "wear.punch.coefficient=4e-7")
    state = steady(system)
    assert growth_rate(system, state.phase_pressure) < 0
    *_, last = march(system, 3000, implicit=True)
    step = 0.01  # what the wear of a half-cycle does to the pressure
    np.testing.assert_allclose(last.pressure[-2:], state.pressure, rtol=0, atol=step * MEAN)
    assert state.heat is not None
    assert last.heat is not None
    expected = np.stack([state.heat.punch, state.heat.strip], axis=1)
    np.testing.assert_allclose(temperatures(last)[-2:], expected, rtol=0, atol=2 * step)
    assert np.abs(expected[0] - expected[1]).max() > 1
    np.testing.assert_allclose(temperatures(last)[-4:-2], temperatures(last)[-2:], rtol=0, atol=1e-4)
    np.testing.assert_allclose(last.pressure[-4:-2], last.pressure[-2:], rtol=0, atol=2e-6 * MEAN)
    fluxes = last.pressure[-2:] @ system.pair.weights
    assert fluxes[0] == pytest.approx(fluxes[1], rel=1e-9)
    # Nothing is stored any more, and what is stored in one half-cycle the other one gives back.
    stored = last.heat.terms[-2:, 2].sum()
    assert abs(stored) < 2e-3 * last.heat.terms[-1, 0]


def from_steady(system: Tribosystem, bulge: float = 0.0) -> tuple[RunState, Any]:
    """Return a moment in the cyclic steady state, its shape disturbed by a parabola (mm at the edges)."""
    state, heat = steady(system), cycle_heat(system)
    assert heat is not None
    conductances = heat.conductances(state.pressure)
    periodic = heat.jump(heat.initial(), np.inf, conductances).state(state.pressure)
    modes = np.zeros((1, 2))
    contacts = tuple(ContactState(p[None], g[None], modes, 0) for p, g in zip(state.pressure, state.gap, strict=True))
    shape = state.shape + bulge * (system.pair.x / 30) ** 2
    return RunState(
        0, WornDepths(shape, 0 * system.pair.strip.weights), contacts, heat.exchange.at(periodic), none_yet(system.pair)
    ), state


@pytest.mark.parametrize("partition", [0.1, 0.5])
@pytest.mark.parametrize("settings", [(), ("heat.ambient=35", "heat.conductance=perfect")])
@pytest.mark.mpi("settings1-0.5")
def test_a_cycle_reproduces_the_steady_state(assembled: Assemble, partition: float, settings: tuple[str, ...]) -> None:
    """Stable or not, the steady state is a fixed point of the march where the wear of a half-cycle is negligible."""
    quiet = ("wear.punch.coefficient=1e-11", f"heat.partition={partition}")
    system = assembled("example1-heat", *COARSE, *quiet, *settings)
    moment, state = from_steady(system)
    block = run(system, 2, implicit=True, start=moment)
    np.testing.assert_allclose(block.pressure, state.pressure, rtol=0, atol=1e-6 * MEAN)
    expected = np.stack([state.heat.punch, state.heat.strip], axis=1)
    np.testing.assert_allclose(temperatures(block), expected, rtol=0, atol=1e-5)
    assert abs(block.heat.terms[:, 2].sum()) < 1e-6 * block.heat.terms[0, 0]


@pytest.mark.parametrize(("partition", "sign"), [(0.1, -1), (0.5, 1)])
def test_sign_of_growth(assembled: Assemble, partition: float, sign: int) -> None:
    """Example 1's steady state loses its stability between kappa = 0.1 and 0.5."""
    system = assembled("example1-heat", *COARSE, f"heat.partition={partition}")
    assert np.sign(growth_rate(system, steady(system).phase_pressure)) == sign


@pytest.mark.parametrize("coefficient", [1e-10, 4e-8])
def test_growth_of_a_disturbance(assembled: Assemble, coefficient: float) -> None:
    """Two marches beside the unstable steady state part at the rate of the eigenvalue."""
    system = assembled("example1-heat", *COARSE, f"wear.punch.coefficient={coefficient}")
    moment, state = from_steady(system)
    rate = growth_rate(system, state.phase_pressure)
    disturbed, _ = from_steady(system, 1e-9)
    one, other = (run(system, 240, implicit=True, start=m) for m in (moment, disturbed))
    apart = np.linalg.norm(one.pressure - other.pressure, axis=1)[1::2]
    measured = np.log(apart[115] / apart[85]) / (30 * system.motion.period)
    assert rate > 0.05
    assert measured == pytest.approx(rate, rel=0.03)


LAWS = {
    "constant": ("wear.punch.coefficient=4e-7",),
    "h(p)": ("heat.conductance=0", "heat.conductance_per_pressure=[0.02, 0.02]", "heat.partition=0.7"),
    "h of a layer": (
        "heat.conductance=layer",
        "heat.partition=0.7",
        "contact.layer={kind='rough', roughness='1 um', asperity_radius='50 um', asperity_density='300 1/mm^2'}",
    ),
    "mu(T)": ("contact.friction={expression='0.25*(1+0.005*T)'}", "wear.punch.coefficient=4e-7"),
    "mu(p)": ("contact.friction={expression='0.2*(1+0.5*exp(-p/16))'}",),
    "beta(T, p)": ("wear.punch.coefficient={expression='4e-7*(1+0.02*T)*(p/16)**0.5'}",),
}


@pytest.mark.parametrize("name", LAWS)
def test_tangent_of_a_half_cycle(assembled: Assemble, name: str) -> None:
    """What a march makes of a small disturbance in one half-cycle is what the growth rate is made of, pointwise."""
    system = assembled("example1-heat", *COARSE, *LAWS[name])
    state = steady(system)
    heat = cycle_heat(system)
    assert heat is not None
    repeating = repeating_temperatures(system, state.phase_pressure)
    before = repeating[1][0] if repeating[1] else heat.exchange.at(np.full(len(heat.initial()), 3.0))
    contacts = from_steady(system)[0].contacts

    def end(temperature: Array, worn: Array) -> tuple[Array, Array, Array]:
        start = heat.exchange.at(before.values + temperature)
        moment = RunState(
            0, WornDepths(state.shape + worn, 0 * system.pair.strip.weights), contacts, start, none_yet(system.pair)
        )
        block = run(system, 1, implicit=True, start=moment)
        return block.end.temperature.values, block.end.worn.punch, block.pressure[0]

    dim, n = len(heat.initial()), len(system.pair.x)
    pressure = end(np.zeros(dim), np.zeros(n))[2]
    matrix = phase_tangent(system, 0, pressure, repeating[0], before)
    rng = np.random.default_rng(0)
    warmer, deeper = (
        rng.normal(size=dim) * np.abs(before.values[: len(heat.exchange.bases[0])]).max(),
        1e-3 * (system.pair.x / 30) ** 2,
    )
    for disturbance in ((warmer, 0 * deeper), (0 * warmer, deeper)):
        ends = [end(step * disturbance[0], step * disturbance[1]) for step in (1e-4, -1e-4, 2e-4, -2e-4)]
        expected = np.split(matrix @ np.concatenate(disturbance), [dim])
        for k, one in enumerate(expected):
            near, far = ends[0][k] - ends[1][k], ends[2][k] - ends[3][k]
            measured = (8 * near - far) / 12e-4  # of fourth order: of second order its own error was 1e-6
            np.testing.assert_allclose(one, measured, rtol=0, atol=1e-6 * np.abs(measured).max())


def test_growth_with_conductance_by_pressure(assembled: Assemble) -> None:
    """Two marches part at the rate of the eigenvalue, 0.08 1/s; with the conductance frozen it were 0.19."""
    system = assembled("example1-heat", *COARSE, *LAWS["h(p)"], "wear.punch.coefficient=1e-10")
    moment, state = from_steady(system)
    disturbed, _ = from_steady(system, 1e-10)
    one, other = (run(system, 240, implicit=True, start=m) for m in (moment, disturbed))
    apart = np.linalg.norm(one.pressure - other.pressure, axis=1)[1::2]
    measured = np.log(apart[115] / apart[85]) / (30 * system.motion.period)
    assert measured == pytest.approx(growth_rate(system, state.phase_pressure), rel=0.03)


def test_growth_with_friction_by_temperature(assembled: Assemble) -> None:
    """A disturbance along the eigenvector grows by the eigenvalue from the first cycle on."""
    system = assembled("example1-heat", *COARSE, "contact.friction={expression='0.25*(1+0.005*T)'}")
    state = steady(system)
    pressure = state.phase_pressure
    heat, states = repeating_temperatures(system, pressure)
    assert heat is not None
    first, second = (phase_tangent(system, k, pressure[k], heat, states[k]) for k in range(2))
    values, vectors = np.linalg.eig(second @ first)
    largest = np.argmax(np.abs(values) * (np.abs(values - 1) > 1e-8))
    assert values[largest].imag == 0
    mode, dim = vectors[:, largest].real, len(heat.initial())
    mode *= 1e-4 / np.abs(mode[:dim]).max()
    contacts = from_steady(system)[0].contacts
    ends = []
    for sign in (1, -1):
        temperature = heat.exchange.at(states[0].values + sign * mode[:dim])
        worn = WornDepths(state.shape + sign * mode[dim:], 0 * system.pair.strip.weights)
        ends.append(
            run(system, 20, implicit=True, start=RunState(0, worn, contacts, temperature, none_yet(system.pair)))
        )
    apart = np.linalg.norm(ends[0].pressure - ends[1].pressure, axis=1)[1::2]
    rate = growth_rate(system, pressure)
    assert rate == pytest.approx(np.log(values[largest].real) / system.motion.period, rel=1e-12)
    assert np.log(apart[-1] / apart[0]) / (9 * system.motion.period) == pytest.approx(rate, rel=0.01)


def test_no_growth_rate_of_what_is_not_stationary(assembled: Assemble) -> None:
    """The rate of a run's last state is told where it stays, and else the reason why it is not."""
    system = assembled("example1-heat", *COARSE, "heat.partition=0.2", "wear.punch.coefficient=4e-6")
    for half_cycles, told in ((1, False), (40, False), (3000, True)):
        *_, last = march(system, half_cycles, implicit=True)
        contacts = [c.pressure[0] for c in last.end.contacts]
        surfaces = (last.heat.temperature_punch[-1], last.heat.temperature_strip[-1])
        change = last.periodicity[-2:].max() if half_cycles > 1 else np.nan
        rate, reason = stationary_growth(system, np.array(contacts), surfaces, half_cycles % 2, change)
        assert (rate is not None) == told
        assert bool(reason) != told


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="needs several ranks")
@pytest.mark.parametrize("operator", ["full", "reduced"])
@pytest.mark.mpi
def test_ranks_agree(assembled: Assemble, operator: str) -> None:
    """March, jump, steady state and growth rate on these ranks and on one alone, to 1e-8."""
    settings = [*COARSE, f"heat.operator={operator}", "heat.partition=0.2", "heat.initial=-10"]
    together, alone = (
        assembled("example1-heat", *settings),
        assemble(load_case("example1-heat", settings), MPI.COMM_SELF),
    )
    for solve in (
        lambda s: run(s, 30).pressure,
        lambda s: temperatures(run(s, 30)),
        lambda s: run(s, 4).heat.terms,
        lambda s: temperatures(list(jump(s, 400, tolerance=1e-2))[-1]),
        lambda s: steady(s).heat.punch,
        lambda s: np.array([growth_rate(s, steady(s).phase_pressure)]),
    ):
        one, other = solve(alone), solve(together)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-8 * np.abs(one).max())


def test_growth_conducts_as_the_state(assembled: Assemble) -> None:
    """Nodes that are open but for rounding do not conduct; nodes that the state has conducting do."""
    system = assembled("example1-heat", *COARSE, "heat.conductance='80 W/(m² K)'", "heat.partition=0.5")
    state = steady(system)
    assert state.heat is not None
    assert state.conductances is not None
    opened = state.phase_pressure == 0
    assert opened.any()
    assert np.isnan(state.conductances[opened]).all()
    rounding = np.where(opened, 1e-14 * state.phase_pressure.max(), state.phase_pressure)
    rate = growth_rate(system, state.phase_pressure, state.conductances)
    assert growth_rate(system, state) == rate
    assert growth_rate(system, rounding) == pytest.approx(rate, rel=1e-9)
    # A node without pressure that conducts changes it: what the state says is followed.
    other = np.where(opened, np.nanmax(state.conductances), state.conductances)
    assert growth_rate(system, state.phase_pressure, other) != pytest.approx(rate, rel=1e-6)
