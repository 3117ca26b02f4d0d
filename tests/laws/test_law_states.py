"""Laws that remember: states of their own against closed forms, the same in march, jump and end, on either body."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from combinations import SMALL, STICK

import fenwear
from fenwear import Case, CaseError, ConvergenceError, State, Tribosystem, assemble, load_case, register_law, steady
from fenwear.case.dependence import forget_laws
from fenwear.steps import Block, evolve, growth_rate

PLAIN = (
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
    "geometry.follow_wear=never",
    "contact.friction=0",
    "motion={kind='one-way', direction='rightward', speed=100, duration=1}",
)
LOAD, SPEED = 1e4, 100.0
GROWTH, BARE, FILM = 37.0, 1e-8, 3e-8  # s; 1/MPa without the film, and with all of it
OWN = "wear.punch.coefficient={law='mine', unit='1/MPa'}"


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Forget the laws of each test."""
    yield
    forget_laws()


def mine(function: Callable[[Any], Any], **states: State) -> None:
    register_law("mine", function, of=list(states), states=states)


def film() -> None:
    """Register a film that grows to one, and wear that goes with it."""
    mine(lambda now: BARE + (FILM - BARE) * now["oxide"], oxide=State(lambda now: (1 - now["oxide"]) / GROWTH, of=[]))


def case_of(law: str, *more: str) -> Case:
    stick = STICK if law == "coulomb" else ("stick={}",)
    return load_case("fretting-partial-slip", [*SMALL, f"contact.law='{law}'", *stick, *more])


def end(system: Tribosystem, how: str, tolerance: float = 1e-3) -> Block:
    block = list(evolve(system, integration=how, tolerance=tolerance))[-1]
    assert block.equilibrium_error.max() < 1e-9
    return block


def worn_with_film(seconds: float) -> float:
    """Return the volume, mm³: the integral of (BARE + (FILM - BARE) (1 - exp(-t / GROWTH))) F v."""
    gone = GROWTH * -np.expm1(-seconds / GROWTH)
    return LOAD * SPEED * (FILM * seconds - (FILM - BARE) * gone)


def test_a_film_and_its_wear_against_the_closed_form() -> None:
    """Of any pressure distribution, the film alike everywhere, the volume is that of the load.

    The film is exact; what it wears is of second order in the half-cycle and, in jumps, falls with the tolerance.
    """
    film()
    errors = {}
    for half_cycles, duration in ((40, 1.0), (20, 2.0)):
        motion = f"motion={{kind='one-way', direction='rightward', speed=100, duration={duration}}}"
        system = assemble(load_case("example2", [*PLAIN, motion, f"run.half_cycles={half_cycles}", OWN]))
        for how in ("explicit", "implicit"):
            block = end(system, how)
            assert block.end.worn.between[0] == pytest.approx(-np.expm1(-40 / GROWTH), rel=1e-12)
            errors[how, duration] = float(block.totals.of("volume_punch")[-1]) / worn_with_film(40) - 1
    for how in ("explicit", "implicit"):
        assert 0 < errors[how, 1.0] < 3e-5
        assert errors[how, 2.0] == pytest.approx(4 * errors[how, 1.0], rel=0.05)
    system = assemble(load_case("example2", [*PLAIN, "run.half_cycles=400", OWN]))
    wrong = []
    for tolerance in (3e-1, 1e-2, 1e-4):
        blocks = list(evolve(system, integration="jump", tolerance=tolerance))
        volume = float(blocks[-1].totals.of("volume_punch")[-1]) / worn_with_film(400) - 1
        wrong.append(abs(blocks[-1].end.worn.between[0, 0] + np.expm1(-400 / GROWTH)))
        assert abs(volume) < 2e-5
        assert sum(map(len, blocks)) < 10 or tolerance < 1e-2
    assert wrong[2] < 0.3 * wrong[1] < 0.1 * wrong[0] < 2e-5
    state = steady(system)
    assert state.states["oxide"] == pytest.approx(1.0, rel=1e-12)
    assert state.wear_per_cycle == pytest.approx(FILM * LOAD / 600 * SPEED, rel=1e-9)


def powder() -> None:
    """Register a third body of one's own: wear as a constant, a share of it kept, lost as it slides."""
    mine(
        lambda now: np.full_like(now["powder"], 1e-7),
        powder=State(
            lambda now: 0.6 * now["wear"] - now["v"] * now["powder"] / 0.3, of=["v", "wear"], fills=1.0, unit="mm"
        ),
    )


@pytest.mark.parametrize("how", ["explicit", "implicit", "jump"])
@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_a_third_body_of_ones_own_is_the_one_that_is_built_in(law: str, how: str) -> None:
    """Written as a state that fills the gap: the same depths, pressures and thickness."""
    powder()
    built = end(assemble(case_of(law, "run.half_cycles=6", "contact.third_body={share=0.6, life='0.3 mm'}")), how)
    own = end(assemble(case_of(law, "run.half_cycles=6", OWN)), how)
    close = 1e-11 if law == "gross-sliding" or how == "explicit" else 1e-7
    thick = 1e-11 if close == 1e-11 else 1e-3  # jumps with stick look at it half a cycle apart
    for one, other, within in (
        (built.end.worn.punch, own.end.worn.punch, close),
        (built.pressure[-1], own.pressure[-1], close),
        (built.end.worn.between[0], own.end.worn.between[0], thick),
    ):
        assert np.abs(one - other).max() < within * one.max()


def test_a_film_that_fills_the_gap_rests_as_debris_does() -> None:
    """In the steady state, too: what a cycle feeds times its life."""
    powder()
    built, own = (
        steady(assemble(case_of("gross-sliding", *more)))
        for more in (("contact.third_body={share=0.6, life='0.3 mm'}",), (OWN,))
    )
    assert built.debris is not None
    assert own.states["powder"] == pytest.approx(built.debris, rel=1e-9)
    assert own.pressure == pytest.approx(built.pressure, rel=1e-9)


@pytest.mark.slow
def test_states_that_depend_on_each_other() -> None:
    """A chain of two against the exponential of its matrix, in marches and, to the tolerance, in jumps; fast, too."""
    for fast in (0.05, 40.0):  # 1/s, in cycles of a second
        mine(
            lambda now: BARE * (1 + now["second"]),
            first=State(lambda now, k=fast: k * (1 - now["first"]), of=[]),
            second=State(
                lambda now: 0.02 * (now["first"] - now["second"]), of=["first"], initial=lambda now: 0 * now["x"]
            ),
        )
        system = assemble(load_case("example2", [*PLAIN, "run.half_cycles=40", OWN]))
        matrix = np.array([[-fast, 0, fast], [0.02, -0.02, 0], [0, 0, 0]])
        exact = scipy.linalg.expm(40 * matrix) @ np.array([0, 0, 1.0])
        for how, within in (("explicit", 1e-8), ("jump", 2e-3)):
            found = end(system, how, 1e-3).end.worn.between
            assert found[:, 0] == pytest.approx(exact[:2], rel=within)
        assert steady(system).states["second"] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_friction_and_wear_share_a_state(law: str) -> None:
    """A film that pressure rubs off and that grows again: marches and jumps agree, and rest where the end is."""
    grown = State(
        lambda now: 3.0 * (1 - now["oxide"]) - now["p"] * now["v"] / 20 * now["oxide"], of=["p", "v"], initial=1.0
    )
    register_law("mine", lambda now: 1e-6 * (1.5 - now["oxide"]), of=["oxide"], states={"oxide": grown})
    register_law("slippery", lambda now: 0.7 - 0.2 * now["oxide"], of=["oxide"])
    more = (OWN, "contact.friction={law='slippery'}", "motion.period='1 s'")
    system = assemble(case_of(law, "run.half_cycles=24", *more))
    assert system.layers.rows == ("state oxide",)
    marched, jumped = (end(system, how) for how in ("explicit", "jump"))
    for row in (lambda block: block.end.worn.punch, lambda block: block.end.worn.between[0]):
        assert np.abs(row(marched) - row(jumped)).max() < 2e-2 * np.abs(row(marched)).max()
    assert np.ptp(marched.end.worn.between[0]) > 0.03
    if law == "gross-sliding":
        state, far = steady(system), end(assemble(case_of(law, "run.half_cycles=40000", *more)), "jump", 1e-2)
        assert far.end.worn.between[0] == pytest.approx(state.states["oxide"], rel=1e-4)
        assert far.pressure[-1] == pytest.approx(state.pressure[-1], rel=1e-2, abs=1e-3 * far.pressure.max())
        assert growth_rate(system, state.phase_pressure) < 0


def test_states_of_the_strip_move_with_its_material() -> None:
    """What nodes of the contact add comes to the strip's nodes by their areas; on a track it is spread along it."""
    register_law(
        "mine",
        lambda now: 1e-8 * (1 + now["passed"]),
        of=["passed"],
        states={"passed": State(lambda now: now["v"], ["v"])},
    )
    strip = "wear.strip.coefficient={law='mine', unit='1/MPa'}"
    for more in ((), (OWN,)):
        system = assemble(case_of("gross-sliding", "motion.positions=3", "motion.amplitude='0.05 mm'", strip, *more))
        block = end(system, "explicit")
        slid = sum(phase.distance for phase in system.motion.phases) * 2  # in two cycles
        areas = system.pair.strip.weights
        assert float(areas @ block.end.worn.carried[0]) == pytest.approx(
            slid * float(system.pair.weights.sum()), rel=1e-9
        )
        assert np.ptp(block.end.worn.carried[0]) > 0.1 * slid  # its ends have slid less
        if more:
            assert block.end.worn.between[0] == pytest.approx(slid, rel=1e-12)
    track = "motion={kind='one-way', direction='rightward', speed=100, duration=1, track='6 m'}"
    system = assemble(load_case("example2", [*PLAIN, track, "run.half_cycles=5", strip]))
    assert end(system, "explicit").end.worn.carried[0] == pytest.approx(0.01 * 500, rel=1e-9)


def test_what_goes_on_for_ever_has_no_steady_state() -> None:
    """Damage that adds up is followed by runs; with a bound it rests there."""
    for most in (np.inf, 2.0):
        mine(
            lambda now: BARE * (1 + now["damage"]),
            damage=State(lambda now: now["p"] * now["v"] / 1e4, ["p", "v"], most=most),
        )
        system = assemble(load_case("example2", [*PLAIN, "run.half_cycles=10", OWN]))
        jumped, marched = (end(system, how).end.worn.between[0] for how in ("jump", "explicit"))
        areas = system.pair.weights
        bounded = 5.0 if most < np.inf else 1.0  # a bound is met within a jump
        assert areas @ np.abs(jumped - marched) < bounded * 1e-3 * (areas @ marched)
        added_up = LOAD / 10 * SPEED / 1e4 * 10
        assert float(areas @ marched) == pytest.approx(added_up, rel=1e-9) if most == np.inf else marched.max() <= most
        if most == np.inf:
            with pytest.raises(ConvergenceError, match="the state 'damage' of a law continues as long as it slides"):
                steady(system)
        else:
            assert steady(system).states["damage"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("name", "state", "text"),
    [
        ("p", State(abs), "expected a word that is none of"),
        ("oxide", State(3), "expected functions as its rate"),  # type: ignore[arg-type]
        ("oxide", 3, "expected a fenwear.State"),
        ("oxide", State(abs, of=["q"]), "expected a list of some of"),
        ("oxide", State(abs, least=1, most=0), "expected least < most"),
        ("oxide", State(abs, initial=-1, least=0), "expected an initial value from 0 to inf, got -1"),
        ("oxide", State(abs, fills=-1), "expected fills of zero or more"),
    ],
)
def test_states_that_make_no_sense(name: str, state: Any, text: str) -> None:
    """They are refused where they are registered, by their names."""
    with pytest.raises(CaseError, match=text):
        register_law("mine", abs, states={name: state})


def test_rates_that_fail_say_so() -> None:
    """With the state's name, and what it was asked at."""
    for wrong, text in (
        (lambda now: now["T"], "state 'oxide': .*'T'"),
        (lambda now: now["oxide"] / 0 * np.inf, r"state 'oxide': expected finite numbers, got inf at oxide = 1"),
    ):
        mine(lambda now: BARE * now["oxide"], oxide=State(wrong, of=[], initial=1.0))
        system = assemble(load_case("example2", [*PLAIN, "run.half_cycles=2", OWN]))
        with pytest.raises(CaseError, match=text), np.errstate(all="ignore"):
            end(system, "explicit")
    with pytest.raises(CaseError, match="expected a list of some of"):
        fenwear.register_law("other", abs, of=["unknown"])
