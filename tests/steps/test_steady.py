"""The cyclic steady state in one solve."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Case, CaseError, ConvergenceError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.heat.periodic_heat import CycleHeat, cycle_memory
from fenwear.steps import SteadyState, cycles_to_reach
from fenwear.system import with_reduced_heat

A, MEAN = 30.0, 1e4 / 600
COEFFICIENT = 1.25e-8 * np.pi


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("name", ["example1", "example1-lz40", "example2"])
@pytest.mark.mpi("example1-stress", "example1-lz40-strain")
def test_sum_of_the_two_pressures_is_uniform(assembled: Callable[..., Tribosystem], name: str, plane: str) -> None:
    """Verification 11 and the paper: p+ + p- = 2 p_m; where one vanishes the other is 33.33 MPa."""
    system = assembled(name, f"model.plane='{plane}'")
    state = steady(system)
    np.testing.assert_allclose(state.pressure.sum(axis=0), 2 * MEAN, rtol=1e-9)
    assert state.pressure.max() == pytest.approx(2 * MEAN, rel=1e-9)
    assert (state.pressure.min(axis=1) == 0).all()
    assert (state.gap > -1e-11).all()
    np.testing.assert_allclose(state.pressure * state.gap, 0, atol=1e-9)
    # The wear of a cycle is a rigid motion: beta~ 2 u0 times 2 p_m everywhere.
    np.testing.assert_allclose(state.wear_per_cycle, COEFFICIENT * 3 * 2 * MEAN, rtol=1e-9)
    assert state.velocity["lambda_F"] == pytest.approx(COEFFICIENT * 3 * 2 * MEAN, rel=1e-9)
    assert state.velocity.get("lambda_M", 0) == pytest.approx(0, abs=1e-16)
    force = state.pressure * system.pair.weights
    np.testing.assert_allclose(force.sum(axis=1), 1000, rtol=1e-10)
    if "lambda_M" in state.velocity:
        height = system.bodies.punch.pivot[1] - 100
        np.testing.assert_allclose(force @ system.pair.x, [-250 * height, 250 * height], rtol=1e-9)


@pytest.mark.mpi
def test_example_2_is_symmetric(assembled: Callable[..., Tribosystem]) -> None:
    """p+(x) = p-(-x), and the shape is even."""
    state = steady(assembled("example2"))
    np.testing.assert_allclose(state.pressure[0], state.pressure[1, ::-1], atol=1e-8 * MEAN)
    np.testing.assert_allclose(state.shape, state.shape[::-1], atol=1e-7 * np.ptp(state.shape))


def test_off_centre_load(edited: Callable[..., Case]) -> None:
    """A tilting punch with its load x_c off the centre: p+ + p- = 2 p_m (1 + 3 x_c x / a²), linear.

    100 N/mm to the right on the sides, 30 mm above the pin, shift the load by x_c = 100 * 30 / 1000 = 3 mm.
    """

    def push(case: dict[str, Any]) -> None:
        case["punch"]["loads"].append({"on": "punch_free", "force": [1000, 0]})

    system = assemble(edited("example1", push))
    state = steady(system)
    slope = 3 * 3 / A**2
    x = system.pair.x
    np.testing.assert_allclose(state.pressure.sum(axis=0), 2 * MEAN * (1 + slope * x), rtol=1e-8)
    assert state.velocity["lambda_M"] == pytest.approx(-COEFFICIENT * 3 * 2 * MEAN * slope, rel=1e-8)


@pytest.mark.parametrize("name", ["example1", "example2"])
@pytest.mark.parametrize("b", [0.5, 1.5, 2.0])
def test_power_law(assembled: Callable[..., Tribosystem], name: str, b: float) -> None:
    """b != 1: p+^b + p-^b is a rigid motion over beta~ S; where one vanishes the other is its b-th root."""
    coefficient = f"wear.punch.coefficient={COEFFICIENT * MEAN ** (1 - b)!r}"
    system = assembled(name, f"wear.punch.pressure_exponent={b}", coefficient)
    state = steady(system)
    power = (state.pressure**b).sum(axis=0)
    x = system.pair.x
    if name == "example2":
        np.testing.assert_allclose(power, power.mean(), rtol=1e-8)
    line = np.polyval(np.polyfit(x, power, 1), x)
    np.testing.assert_allclose(power, line, rtol=1e-7)
    worn = COEFFICIENT * MEAN ** (1 - b) * 3 * power
    rigid = state.velocity["lambda_F"] - state.velocity.get("lambda_M", 0) * (x - A)
    np.testing.assert_allclose(worn, rigid, rtol=1e-7)
    np.testing.assert_allclose(state.pressure @ system.pair.weights, 1000, rtol=1e-9)


@pytest.mark.parametrize(
    "settings",
    [
        (),
        ("wear.punch.pressure_exponent=2", "wear.punch.coefficient=2e-9"),
        ("wear.punch.pressure_exponent=0.5", "wear.punch.coefficient=2e-7"),
    ],
)
def test_jumps_end_there(assembled: Callable[..., Tribosystem], settings: tuple[str, ...]) -> None:
    """Verification 11: a run of cycle jumps and the direct solve agree to 1e-3 p_m, in pressure and in shape."""
    system = assembled("example1", *settings)
    state = steady(system)
    *_, last = jump(system, 2_000_000, tolerance=1e-2)
    np.testing.assert_allclose(last.pressure[-2:], state.pressure, rtol=0, atol=1e-3 * MEAN)
    rigid = np.stack([np.ones_like(system.pair.x), system.pair.x], axis=1)
    difference = last.wear[-1] - state.shape
    difference -= rigid @ np.linalg.lstsq(rigid, difference, rcond=None)[0]
    np.testing.assert_allclose(difference, 0, atol=5e-3 * np.ptp(state.shape))


def test_a_cup_in_which_loads_and_turns_change(assembled: Callable[..., Tribosystem]) -> None:
    """Steps of walking, none with an even pressure near: one shape, on which each rests, wears by a rigid motion."""
    system = assembled("ball-in-cup", "geometry.parameters.across=2", "geometry.parameters.around=2")
    assert 0.9 < touching_where_it_stays(steady(system)) < 1


@pytest.mark.parametrize(
    ("positions", "settings"),
    [
        (2, ("wear.punch={coefficient='1e-9 MPa^-1.7', pressure_exponent=1.7}",)),
        (1, ("contact.friction=3",)),  # by which nodes open in one direction
    ],
)
def test_on_a_grid(positions: int, settings: tuple[str, ...]) -> None:
    """Several positions of the strip, wear by a power of the pressure, nodes that never touch."""
    sizes = "core=0", "core_elements=0", "across=4"
    fine = "punch.operator='fine'", "strip.operator='fine'", "grid.size=['0.3 mm', '0.2 mm']", "grid.nodes=25"
    case = load_case("ball-on-flat", [*(f"geometry.parameters.{size}" for size in sizes), *fine, *settings])
    wear = case.wear.model_copy(update={"strip": None})
    motion = case.motion.model_copy(update={"positions": positions})
    system = assemble(case.model_copy(update={"wear": wear, "motion": motion}))
    state = steady(system)
    assert (state.phase_pressure == 0).any() == (positions == 1)
    assert touching_where_it_stays(state) == 1


def touching_where_it_stays(state: SteadyState) -> float:
    """Return which share of the nodes touches in a steady state, whose equations hold."""
    system = state.system
    pressure, touched = state.phase_pressure, state.phase_pressure.max(axis=0) > 0
    motion = system.rigid.rigid_normal @ list(state.velocity.values())
    largest = state.wear_per_cycle.max()
    np.testing.assert_allclose(state.wear_per_cycle[touched], motion[touched], rtol=0, atol=1e-9 * largest)
    assert (motion[~touched] < 1e-9 * largest).all()  # there nothing wears, and the motion does not press
    worn = np.where(np.isnan(state.shape), 1.0, state.shape)
    phases = range(len(pressure))
    gaps = np.array([own.pair.initial_gap + worn for own in system.elastic.interfaces])
    found = system.phase_contact(phases).solve(gaps).pressure  # by the contact of given shapes
    np.testing.assert_allclose(found, pressure, rtol=0, atol=1e-8 * pressure.max())
    return float(touched.mean())


@pytest.mark.parametrize(("friction", "exists"), [(0.37, True), (0.38, False)])
def test_friction_can_tip_the_punch_out_of_any_steady_state(
    assembled: Callable[..., Tribosystem], friction: float, exists: bool
) -> None:
    """With p+ + p- = 2 p_m the resultant of p+ can be no farther from the middle than L/4 = 15 mm = mu l_z."""
    system = assembled("example1-lz40", f"contact.friction={friction}")
    if exists:
        centre = (steady(system).pressure * system.pair.weights) @ system.pair.x / 1000
        np.testing.assert_allclose(centre, [-friction * 40, friction * 40], rtol=1e-9)
    else:
        with pytest.raises(ConvergenceError, match="no cyclic steady state exists: friction"):
            steady(system)


@pytest.mark.slow
def test_marched_half_cycles_end_there(assembled: Callable[..., Tribosystem]) -> None:
    """Verification 11: marched and directly solved pressures within 0.1 MPa.

    What wears four times as fast is there after a quarter of the 40,000 half-cycles of Example 1.
    """
    system = assembled("example1", "geometry.degree=2", f"wear.punch.coefficient={4 * COEFFICIENT!r}")
    *_, last = march(system, 10_000)
    order = [1, 0] if last.direction[-1] == 1 else [0, 1]
    np.testing.assert_allclose(last.pressure[-2:][order], steady(system).pressure, rtol=0, atol=0.1)


def test_neither_speed_nor_coefficient_changes_it(assembled: Callable[..., Tribosystem]) -> None:
    """For any a, beta~, u0 and omega the pressures and the shape are the same; only the wear per cycle scales."""
    one = steady(assembled("example1"))
    system = assembled(
        "example1", "wear.punch.speed_exponent=2", "wear.punch.coefficient=1e-6", "motion.angular_frequency=3"
    )
    two = steady(system)
    np.testing.assert_allclose(two.pressure, one.pressure, atol=1e-8 * MEAN)
    np.testing.assert_allclose(two.shape, one.shape, atol=1e-8 * np.ptp(one.shape))
    # a = 2: the integral of (u0 omega sin)² over half a period is u0² omega pi / 2.
    np.testing.assert_allclose(two.wear_per_cycle, 1e-6 * 1.5**2 * 3 * np.pi / 2 * 2 * MEAN, rtol=1e-9)


ONE_WAY = [(f"monotonic-lz{h}", b, d) for h in (20, 40) for b in (0.5, 1.0, 2.0) for d in ("leftward", "rightward")]


@pytest.mark.parametrize(("name", "b", "direction"), ONE_WAY)
@pytest.mark.mpi("monotonic-lz20-0.5-leftward", "monotonic-lz40-2.0-rightward")
def test_one_way_is_the_optimum(assembled: Callable[..., Tribosystem], name: str, b: float, direction: str) -> None:
    """The steady state of one-way sliding is the optimum, with its wear velocity (duration 0.1 s)."""
    system = assembled(name, f"motion.direction='{direction}'", f"wear.punch.pressure_exponent={b}",
                      "wear.punch.coefficient=1e-6")  # fmt: skip
    state, optimum = steady(system), system.optimum(system.motion.directions[0])
    np.testing.assert_allclose(state.pressure[0], optimum.pressure, atol=1e-6 * MEAN)
    for mode, velocity in optimum.velocity.items():
        assert state.velocity[mode] == pytest.approx(velocity * 0.1, rel=1e-6, abs=1e-9)


def test_surfaces_that_never_meet_again(assembled: Callable[..., Tribosystem]) -> None:
    """One-way with c > 1: the worn contact is the optimum's triangle, and the rest of the punch stays open."""
    system = assembled("monotonic-lz40", "contact.friction=0.4", "motion.direction='rightward'")
    state = steady(system)
    np.testing.assert_allclose(state.pressure[0], system.optimum(1).pressure, atol=1e-6 * MEAN)
    opened = state.pressure[0] == 0
    assert opened.any()
    assert np.isnan(state.shape[opened]).all()
    assert state.contact_width[0] == pytest.approx(3 * (30 - 0.4 * 40), abs=4)


def test_cycles_to_reach(assembled: Callable[..., Tribosystem]) -> None:
    """A march that long is as near as asked for, one half as long is not; None beyond the limit."""
    system = assembled("example1", "geometry.degree=2", "wear.punch.coefficient=4e-7")
    state = steady(system)
    cycles = cycles_to_reach(system, state, 0.05)
    assert cycles is not None
    distance = []
    for half_cycles in (cycles, 4 * cycles):
        *_, last = jump(system, half_cycles - half_cycles % 2, tolerance=1e-3)
        distance.append(np.abs(last.pressure[-2:] - state.pressure).max() / MEAN)
    assert distance[1] < 0.05 < distance[0]
    assert cycles_to_reach(system, state, 0.05, limit=10) is None


def test_maps_of_heat_that_do_not_fit_are_refused(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before they are made; told are the bytes of the maps and of what they are made of, about as much."""
    system = with_reduced_heat(assembled("example1-heat", "geometry.degree=2"))
    heat = CycleHeat(system.exchange)
    phases, n = len(system.motion.phases), len(system.pair.weights)
    maps = {id(one): one for phase in heat.cycle(np.ones((phases, n))).maps for one, _ in phase.steps}
    made = sum(one.propagator.nbytes + one.response.nbytes for one in maps.values())
    assert 0.4 * cycle_memory(heat.exchange) < made < 0.7 * cycle_memory(heat.exchange)
    monkeypatch.setattr("fenwear.common.parallel.free_memory", lambda: 1e3)
    monkeypatch.setattr("fenwear.common.parallel.SMALL", 0)
    for solved in (steady, lambda own: next(jump(own, 100, tolerance=0.1))):
        with pytest.raises(CaseError, match=r"(heat|geometry): .* are free"):
            solved(system)
    next(march(system, 1))


CAPPED = ("geometry.degree=2", "geometry.parameters.elements_along_contact=12")


@pytest.mark.parametrize(("name", "cap"), [("example2", 25), ("example1", 16)])
def test_pressure_cap(assembled: Callable[..., Tribosystem], name: str, cap: int) -> None:
    """Beyond a cap wear grows no more: what both ways wear is a rigid motion, and a long run ends there."""
    system = assembled(name, *CAPPED, f"wear.punch.pressure_cap={cap}")
    state = steady(system)
    assert state.pressure.max() > 2.5 * MEAN
    touched = state.pressure.max(axis=0) > 0
    worn = np.minimum(state.pressure, cap).sum(axis=0)[touched] * COEFFICIENT * 3
    arm = system.pair.x[touched] - system.bodies.punch.pivot[0]
    turned = arm * state.velocity.get("lambda_M", 0.0)
    moved = [state.velocity["lambda_F"] + sign * turned for sign in (1, -1)]
    assert min(np.abs(worn - one).max() for one in moved) < 1e-9 * worn.max()
    np.testing.assert_allclose(state.pressure @ system.pair.weights, 1000, rtol=1e-10)
    last = list(jump(system, 400_000, tolerance=1e-2))[-1]
    np.testing.assert_allclose(last.pressure[-2:], state.pressure, atol=1e-6 * MEAN)


def test_cap_that_holds_nothing(assembled: Callable[..., Tribosystem]) -> None:
    """A cap above the largest pressure changes nothing; where no state exists the cap is named, and why."""
    plain, capped = (steady(assembled("example2", *CAPPED, *more)) for more in ((), ("wear.punch.pressure_cap=34",)))
    np.testing.assert_allclose(capped.pressure, plain.pressure, atol=1e-9 * MEAN)
    with pytest.raises(ConvergenceError, match=r"wear.punch.pressure_cap = 12 MPa"):
        steady(assembled("example2", *CAPPED, "wear.punch.pressure_cap=12"))
    with pytest.raises(ConvergenceError, match=r"pressure_cap = 20 MPa.* 16.67 MPa"):
        steady(assembled("monotonic-lz20", *CAPPED, "wear.punch.pressure_cap=20"))


@pytest.mark.parametrize(("name", "threshold"), [("example1", 14), ("fretting", 14)])
def test_pressure_threshold(assembled: Callable[..., Tribosystem], name: str, threshold: int) -> None:
    """Runs end there, node by node and in every phase, the nearer the longer they are; what wears is above it."""
    few = ("geometry.degree=2", "geometry.parameters.elements_along_contact=12", "geometry.follow_wear=never")
    law = f"wear={{punch={{coefficient=1e-7, pressure_threshold={threshold}}}}}"
    system = assembled(name, *few, law)
    state, apart = steady(system), []
    for cycles in (3_000, 100_000):
        *_, last = jump(system, 2 * cycles, tolerance=1e-2)
        pressure = np.concatenate([one.pressure for one in last.end.contacts])
        apart.append(float(np.abs(pressure - state.phase_pressure).max() / state.phase_pressure.max()))
    assert apart[1] < 1e-8 < apart[0]
    worn = state.wear_per_cycle > 0
    assert (state.phase_pressure.max(axis=0)[worn] > threshold).all()


@pytest.mark.parametrize("way", ["example1", "one way", "stick"])
def test_pressures_below_the_threshold_have_no_end_of_their_own(
    assembled: Callable[..., Tribosystem], way: str
) -> None:
    """Any of them stays: none is given. What slips partially has no end beside a threshold at all."""
    few = ("geometry.degree=2", "geometry.parameters.elements_along_contact=12", "geometry.follow_wear=never")
    one_way = "motion={kind='one-way', direction='rightward', speed='10 mm/s', duration='0.1 s'}"
    more = {"example1": few, "one way": (*few, one_way), "stick": ("geometry.parameters.elements_along_contact=8",)}
    name = "fretting-partial-slip" if way == "stick" else "example1"
    system = assembled(name, *more[way], "wear={punch={coefficient=1e-7, pressure_threshold=40}}")
    with pytest.raises(ConvergenceError, match="pressure_threshold"):
        steady(system)


def test_a_pressure_of_rounding_is_none(assembled: Callable[..., Tribosystem]) -> None:
    """The built-in bushing: a node that never touches was left with 5e-17 MPa, which was told as no steady state."""
    state = steady(assembled("bushing", "geometry.parameters.elements_along_contact=60"))
    np.testing.assert_array_equal(state.phase_pressure[:, np.isnan(state.shape)], 0)
    assert state.phase_pressure.max() == pytest.approx(3.1588, rel=1e-3)
