"""Several positions of the strip in a half-cycle, both bodies worn, coefficients that depend on the state."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, ConvergenceError, Tribosystem, jump, march, steady
from fenwear.steps import growth_rate
from fenwear.studies.run import position_warnings

COARSE = ("geometry.parameters.elements_along_contact=8", "geometry.degree=2")
MOVING = (*COARSE, "geometry.parameters.overlap=3", "motion.positions=5")
BOTH = (*MOVING, "wear.strip.coefficient=2e-8")
AREAS = (1.25e-8 * np.pi * 1e4 * 3 / 10, 2e-8 * 1e4 * 3 / 10)  # beta~ F0 2 u0 / t
MEAN = 1e4 / 600


@pytest.mark.mpi
@pytest.mark.parametrize("implicit", [False, True])
def test_worn_areas_of_both_bodies(assembled: Callable[..., Tribosystem], implicit: bool) -> None:
    """Verification 8 for both bodies, whatever the pressure and the offsets."""
    for block in march(assembled("example1", *BOTH), 40, implicit=implicit):
        system = block.system
        np.testing.assert_allclose(block.worn_area_increment, AREAS[0], rtol=1e-11)
        np.testing.assert_allclose(block.worn_area_increment_strip, AREAS[1], rtol=1e-11)
        strip = block.wear_strip @ system.pair.strip.weights
        np.testing.assert_allclose(strip, AREAS[1] * block.half_cycle, rtol=1e-11)
        assert block.equilibrium_error.max() < 1e-12


def test_jumps_follow_the_march(assembled: Callable[..., Tribosystem]) -> None:
    """Cycle jumps with both bodies worn end near the implicit march, and wear exactly as much."""
    fast = (*MOVING, "wear.punch.coefficient=4e-7", "wear.strip.coefficient=2e-7")
    system = assembled("example1", *fast)
    *_, slow = march(system, 400, implicit=True)
    *_, last = jump(system, 400, tolerance=1e-3)
    inner = np.abs(system.pair.x) < 29
    np.testing.assert_allclose(last.pressure[-2:, inner], slow.pressure[-2:, inner], atol=0.02 * MEAN)
    np.testing.assert_allclose(last.wear_strip[-1], slow.wear_strip[-1], atol=0.01 * slow.wear_strip[-1].max())
    assert system.pair.strip.weights @ last.wear_strip[-1] == pytest.approx(200 / 3 * 3 * 2 * 2e-7 * 1e4 * 3 / 10)


def test_many_small_eliminations_equal_a_large_one(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bordered inequality solves the same as the dense one."""
    system = assembled("example1", *BOTH)
    results = []
    for limit in (0, 10**6):
        monkeypatch.setattr("fenwear.algebra.submatrices.DENSE", limit)
        *_, last = jump(system, 2000, tolerance=1e-2)
        results.append((last.pressure[-1], last.wear_strip[-1]))
    np.testing.assert_allclose(results[0][0], results[1][0], atol=1e-9 * MEAN)
    np.testing.assert_allclose(results[0][1], results[1][1], rtol=1e-9, atol=1e-15)


@pytest.mark.mpi
def test_mirrored_strokes_of_a_symmetric_punch(assembled: Callable[..., Tribosystem]) -> None:
    """Example 2, moved positions: p of position k rightward is the mirror image of p of position k leftward."""
    system = assembled("example2", *BOTH)
    *_, block = jump(system, 2000, tolerance=1e-2)
    contacts = [contact.pressure[0] for contact in block.end.contacts if contact.solved]
    for k in range(5):
        np.testing.assert_allclose(contacts[k], contacts[5 + k][::-1], atol=1e-7 * MEAN)


def test_without_strip_wear_positions_change_little(assembled: Callable[..., Tribosystem]) -> None:
    """A uniform strip is the same anywhere below the punch: a moved one gives the pressures of the one that stays."""
    one = steady(assembled("example1", *COARSE, "geometry.parameters.overlap=3"))
    other = steady(assembled("example1", *MOVING))
    inner = slice(1, -1)
    np.testing.assert_allclose(other.pressure[:, inner], one.pressure[:, inner], atol=0.02 * MEAN)


def test_growth_rate_of_several_positions(assembled: Callable[..., Tribosystem]) -> None:
    """Disturbances of a strip that moves by 20 um grow as fast as of one that stays; the stroke enters linearly."""
    motion = ("motion.amplitude=0.01", "motion.angular_frequency=1500")
    base = (*COARSE, *motion, "geometry.parameters.overlap=3")
    for share in (0.1, 0.5):
        rates = []
        for positions in (1, 5):
            system = assembled("example1-heat", *base, f"heat.partition={share}", f"motion.positions={positions}")
            state = steady(system)
            assert state.phase_pressure.shape == (2 * positions, len(system.pair.x))
            np.testing.assert_array_equal(state.phase_pressure[positions // 2 :: positions], state.pressure)
            rates.append(growth_rate(system, state.phase_pressure))
        assert rates[1] == pytest.approx(rates[0], rel=1e-3)


def test_steady_command_with_positions(fenwear: Callable[..., Any]) -> None:
    """The command follows the same state: it says whether a run comes there."""
    settings = [part for setting in MOVING for part in ("--set", setting)]
    done = fenwear("steady", "example1", *settings)
    assert done.returncode == 0, done.stderr
    assert "within 1 % of the pressure scale after" in done.stdout


def test_no_steady_state_where_the_track_deepens(assembled: Callable[..., Tribosystem]) -> None:
    """To and fro over a strip that wears: said in so many words."""
    with pytest.raises(ConvergenceError, match="no cyclic steady state exists: the strip wears"):
        steady(assembled("example1", *BOTH))


def test_steady_on_a_closed_track(assembled: Callable[..., Tribosystem]) -> None:
    """The strip of a closed track wears evenly: the punch's pressure is the optimum, the punch sinks by both."""
    track = "motion={kind='one-way', direction='leftward', speed=200, duration=0.1, track=600}"
    plain = steady(assembled("monotonic-lz20", *COARSE))
    both = steady(assembled("monotonic-lz20", *COARSE, track, "wear.strip.coefficient=5e-6"))
    np.testing.assert_allclose(both.pressure, plain.pressure, atol=1e-7 * MEAN)
    recession = 5e-6 * 20 * 1000 / 600  # beta~ S F0 / t over the track's length
    assert both.velocity["lambda_F"] - plain.velocity["lambda_F"] == pytest.approx(recession, rel=1e-7)
    *_, block = march(assembled("monotonic-lz20", *COARSE, track, "wear.strip.coefficient=5e-6"), 3, implicit=True)
    np.testing.assert_allclose(block.wear_strip[-1], 3 * recession, rtol=1e-10)


def test_sliding_out_of_the_plane(assembled: Callable[..., Tribosystem]) -> None:
    """Friction across the plane leaves the plane's contact without friction; mu_d pulls along it, both ways alike."""
    plain = assembled("example1", *COARSE, "contact.friction=0")
    across = assembled("example1", *COARSE, "motion.axis=y")
    np.testing.assert_allclose(steady(across).pressure, steady(plain).pressure, atol=1e-9 * MEAN)
    np.testing.assert_allclose(
        across.laws.friction.ratio(-1, np.full_like(across.pair.x, 0.25), across.pair)[:, 1], -0.25
    )
    pulled = assembled("example1", *COARSE, "motion.axis=y", "contact.transverse_friction=0.1")
    rightward = assembled("example1", *COARSE, "contact.friction=0.1")  # -mu_d e_n x e_y = mu_d e_x
    for direction in (1, -1):
        np.testing.assert_allclose(pulled.optimum(direction).pressure, rightward.optimum(1).pressure, rtol=1e-12)
    both = assembled("example1", *COARSE, "motion.axis=y", "wear.strip.coefficient=3.926990816987242e-8")
    assert steady(both).velocity["lambda_F"] == pytest.approx(2 * steady(across).velocity["lambda_F"], rel=1e-9)


def test_angle_of_the_wear_velocity(assembled: Callable[..., Tribosystem]) -> None:
    """tan chi = w_t / w_n (4): the pin at height 20 mm turns the punch by lambda_M, so that w_t = -20 lambda_M."""
    system = assembled("monotonic-lz20", *COARSE)
    found = system.optimum(-1)
    normal = found.velocity["lambda_F"] - found.velocity["lambda_M"] * (system.pair.x - 30)
    np.testing.assert_allclose(np.tan(found.tilt), -20 * found.velocity["lambda_M"] / normal, rtol=1e-9)


def test_load_over_the_cycle(assembled: Callable[..., Tribosystem]) -> None:
    """A load twice as high in the first half of the cycle: the wear and the balance of each half-cycle follow it."""
    table = "punch.loads.0.over_cycle=[[0, 1.5], [0.499, 1.5], [0.501, 0.5], [1, 0.5]]"
    system = assembled("example1", *COARSE, table)
    assert system.rigid.mean_pressure == pytest.approx(MEAN, rel=1e-6)
    *_, block = march(system, 10)
    np.testing.assert_allclose(block.worn_area_increment[::2], 1.5 * AREAS[0], rtol=1e-9)
    np.testing.assert_allclose(block.worn_area_increment[1::2], 0.5 * AREAS[0], rtol=1e-9)
    assert block.equilibrium_error.max() < 1e-12


@pytest.mark.parametrize("integration", ["march", "jump", "steady"])
def test_coefficients_that_do_not_vary_are_constants(assembled: Callable[..., Tribosystem], integration: str) -> None:
    """Expressions and tables with one value give what the constants give."""
    dependent = (
        "contact.friction={expression='0.25 + 0 * p'}",
        "wear.punch={coefficient={table=[[0, 3.926990816987242e-8], [1, 3.926990816987242e-8]], of='v'}}",
    )
    found = []
    for system in (assembled("example1", *COARSE), assembled("example1", *COARSE, *dependent)):
        if integration == "steady":
            found.append(steady(system).pressure)
        else:
            blocks = march(system, 30) if integration == "march" else jump(system, 2000, tolerance=3e-3)
            found.append(list(blocks)[-1].pressure)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8, atol=1e-8)


def test_wear_coefficient_of_pressure_is_an_exponent(assembled: Callable[..., Tribosystem]) -> None:
    """beta~ proportional to p is b = 2: the same steady state, and the same wear of a half-cycle."""
    law = "wear.punch={coefficient={expression='2e-9 * p'}}"
    power = "wear.punch={coefficient=2e-9, pressure_exponent=2.0}"
    varying, square = (assembled("example1", *COARSE, setting) for setting in (law, power))
    one, other = (list(march(system, 6))[-1] for system in (varying, square))
    np.testing.assert_allclose(one.wear, other.wear, rtol=1e-9)
    np.testing.assert_allclose(steady(varying).pressure, steady(square).pressure, atol=1e-5 * MEAN)


def test_friction_of_pressure_balances(assembled: Callable[..., Tribosystem]) -> None:
    """With mu = 0.1 + 0.002 p the moments balance at the friction of the pressure found, node by node."""
    system = assembled("example1", *COARSE, "contact.friction={expression='0.1 + 0.002 * p'}")
    *_, block = march(system, 4)
    p = block.pressure[-1]
    balance = system.rigid.equilibrium(np.stack([-(0.1 + 0.002 * p), 0 * p], axis=1)) @ p + system.rigid.resultant
    assert np.abs(balance).max() < 1e-6 * 1000 * 30


def test_temperature_dependent_wear(assembled: Callable[..., Tribosystem]) -> None:
    """Wear that grows by 10 % per kelvin: the first half-cycle wears as at the start, later ones more."""
    law = "wear.punch={coefficient={expression='3.926990816987242e-8 * (1 + 0.1 * T)'}}"
    system = assembled("example1-heat", *COARSE, law)
    *_, block = march(system, 20)
    assert block.worn_area_increment[0] == pytest.approx(AREAS[0], rel=1e-12)
    assert (np.diff(block.worn_area_increment) > 0).all()


def test_growth_rate_with_the_strip_worn(assembled: Callable[..., Tribosystem]) -> None:
    """Out of the plane both bodies wear at the same places: a disturbance dies as if the punch took both rates."""
    both = ("wear.punch.coefficient=3e-8", "wear.strip.coefficient=2e-8")
    alone = ("wear.punch.coefficient=5e-8",)
    rates = []
    for wear in (both, alone):
        system = assembled("example2", *COARSE, "motion.axis=y", *wear)
        rates.append(growth_rate(system, steady(system).phase_pressure))
    assert rates[0] == pytest.approx(rates[1], rel=1e-9)
    assert rates[0] < 0


@pytest.mark.mpi
def test_heat_under_a_strip_that_moves(assembled: Callable[..., Tribosystem]) -> None:
    """With heat and both bodies worn: areas and friction heat exact, the balance closed; nearly as in one position."""
    hot = ("heat.partition=0.2", "heat.steps=5")
    one = assembled("example1-heat", *COARSE, *hot)
    several = assembled("example1-heat", *BOTH, *hot)
    (single,), (block,) = (list(march(system, 40)) for system in (one, several))
    np.testing.assert_allclose(block.worn_area_increment, AREAS[0], rtol=1e-11)
    np.testing.assert_allclose(block.worn_area_increment_strip, AREAS[1], rtol=1e-11)
    assert block.heat is not None
    assert single.heat is not None
    assert block.heat.balance_error.max() < 1e-8
    np.testing.assert_allclose(block.heat.terms[:, 0], 0.25 * 1e4 * 3, rtol=1e-11)  # mu F 2 u0, mJ
    largest = single.heat.temperature_punch.max()
    np.testing.assert_allclose(block.heat.temperature_punch, single.heat.temperature_punch, atol=0.1 * largest)


def test_surfaces_that_never_meet(assembled: Callable[..., Tribosystem]) -> None:
    """A punch that is held, and drawn away from the strip by its load: not a run without wear but an error."""
    held = "punch.supports=[{on='punch_load', fix=['x', 'z']}]"
    for force in (-1000, 1000):
        system = assembled("example1", *COARSE, held, f"punch.loads=[{{on='punch_free', force=[0, {force}]}}]")
        if force < 0:
            system.law.check_touching(system)
            continue
        with pytest.raises(CaseError, match=r"geometry: the surfaces never meet within the stroke: .* mm apart"):
            system.law.check_touching(system)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("motion.amplitude=8", r"motion: the stroke runs off the meshed strip: moved by .* strip_contact spans"),
        (
            "contact.friction={expression='0.3 - p'}",
            r"contact.friction: expected zero or more, got .* at T = 0 K, p = 1",
        ),
        ("wear.strip={coefficient={expression='log(p - p)'}}", "wear.strip.coefficient: expected zero or more, got -i"),
        ("wear.strip={coefficient={expression='T'}}", r"wear.strip.coefficient: .*\bheat\b"),
        ("contact.friction={table=[[0, 0.1], [1, 0.2]]}", r"contact.friction: .*\bheat\b"),
    ],
)
def test_bad_input(assembled: Callable[..., Tribosystem], setting: str, message: str) -> None:
    """A stroke off the mesh and coefficients without a meaning are named by their keys."""
    with pytest.raises(CaseError, match=message):
        list(march(assembled("example1", *MOVING, setting), 1))


def test_positions_far_apart_are_warned_about(assembled: Callable[..., Tribosystem]) -> None:
    """Neighbouring positions more than two contact nodes apart leave steps in the strip's scar; the number is named."""
    settings = (*COARSE, "geometry.parameters.overlap=12", "wear.strip.coefficient=2e-8", "motion.amplitude=10")
    few, many = (assembled("example1", *settings, f"motion.positions={n}") for n in (3, 25))
    (warning,) = position_warnings(few)
    named = int(re.findall(r"motion\.positions = (\d+)", warning)[0])
    assert not position_warnings(assembled("example1", *settings, f"motion.positions={named}"))
    assert not position_warnings(many)
    assert not position_warnings(assembled("example1", *COARSE))


UNEVEN = ("strip.profile={points=[[-40, 2e-3], [-4, 2e-3], [0, 0.0], [4, 2e-3], [40, 2e-3]]}",)


def test_an_uneven_strip_passes_under_the_punch(assembled: Callable[..., Tribosystem]) -> None:
    """A ridge goes to and fro under the punch by default, as in many positions: it does not stay where it is."""
    ridge = (*COARSE, "geometry.parameters.overlap=6", "motion.amplitude='4.5 mm'", *UNEVEN)
    found = []
    for positions in ((), ("motion.positions=15",)):
        system = assembled("example2", *ridge, *positions)
        assert position_warnings(system) == []
        *_, block = jump(system, 400, tolerance=1e-2)
        inner = np.abs(system.pair.x) < 25
        found.append((block.pressure[-1][inner].max(), np.ptp(block.wear[-1][inner])))
    np.testing.assert_allclose(found[0], found[1], rtol=0.05)
    (warning,) = position_warnings(assembled("example2", *ridge, "motion.positions=1"))
    assert "strip.profile" in warning
    one_way = "motion={kind='one-way', direction='rightward', speed='30 mm/s', duration='0.3 s'}"
    (warning,) = position_warnings(assembled("example2", *COARSE, *UNEVEN, one_way))
    assert "punch.profile" in warning
    even = "strip.profile={points=[[-40, 2e-3], [40, 2e-3]]}"
    assert position_warnings(assembled("example2", *COARSE, even, one_way)) == []
