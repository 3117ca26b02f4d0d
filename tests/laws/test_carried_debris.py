"""Debris that the strip carries: through the contact and back, along a closed track, and never lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from combinations import SMALL, STICK

from fenwear import Tribosystem, assemble, load_case, steady
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError
from fenwear.results.layer_results import quantities
from fenwear.results.quantity import computed
from fenwear.steps import Block, evolve, growth_rate, march
from fenwear.steps.coupled_phases import cycle_heat
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.run_state import RunState
from fenwear.steps.tangent import lies_after, phase_tangent

MOVES = (
    "contact.law='gross-sliding'",
    "stick={}",
    "geometry.follow_wear='never'",
    "geometry.parameters.overlap='0.1 mm'",
    "motion.positions=4",
    "motion.amplitude='20 um'",
)
BOTH = "wear={punch={coefficient='1e-6 1/MPa'}, strip={coefficient='1e-6 1/MPa'}}"
ROUND, TRACK = 0.7, 400.0  # mm slid in a half-cycle, and round the track
ONE_WAY = f"motion={{kind='one-way', direction='rightward', speed='7 mm/s', duration='0.1 s', track='{TRACK} mm'}}"


def system_of(*more: str) -> Tribosystem:
    return assemble(load_case("fretting-partial-slip", [*SMALL, *MOVES, *more]))


def carried(share: float, life: str) -> str:
    return f"contact.third_body={{share={share}, life='{life}', carried_by='strip'}}"


def end(system: Tribosystem, how: str, tolerance: float = 1e-3) -> Block:
    return list(evolve(system, integration=how, tolerance=tolerance))[-1]


STICKS = ("contact.law='coulomb'", *STICK, "motion.amplitude='3 um'")  # by several places of the strip


@pytest.mark.parametrize("law", [(), STICKS])
@pytest.mark.parametrize("how", ["explicit", "implicit", "jump"])
def test_what_is_never_lost_is_as_if_less_were_worn(how: str, law: tuple[str, ...]) -> None:
    """A strip of which 60 % of the worn stays on it for ever opens the gap as one that wears at 40 %, at any place."""
    runs = [
        end(system_of("run.half_cycles=40", f"wear={{strip={{coefficient='{k} 1/MPa'}}}}", *lies, *law), how)
        for k, lies in ((1e-6, [carried(0.6, "1e30 mm")]), (0.4e-6, []))
    ]
    stays, less = (run.end.worn.strip for run in runs)
    assert 0.4 * stays == pytest.approx(less, rel=1e-10, abs=1e-10 * less.max())
    assert runs[0].pressure[-1] == pytest.approx(runs[1].pressure[-1], abs=1e-8 * runs[1].pressure.max())


def test_jumps_go_with_the_march() -> None:
    """Within 2 % everywhere, as its explicit and implicit steps are from each other; worn = stored + ejected."""
    system = system_of("run.half_cycles=100", BOTH, carried(0.6, "3 mm"))
    explicit, jumps = (end(system, how, 3e-3) for how in ("explicit", "jump"))
    for run in (explicit, jumps):
        found = computed(run, quantities(run.system))
        assert found["debris_balance_error"][-1] < 1e-12
        assert found["debris_thickness_strip"][-1].max() > 0.1 * run.end.worn.strip.max()
    for of in (lambda run: run.end.worn.punch, lambda run: run.end.worn.strip, lambda run: run.end.worn.carried[0]):
        apart = np.abs(of(jumps) - of(explicit)).max()
        assert apart < 0.02 * of(explicit).max()


@pytest.mark.parametrize("law", ["coefficient='1e-7 1/MPa'", "coefficient='1e-9 1/MPa^1.7', pressure_exponent=1.7"])
def test_jumps_come_to_the_steady_state_under_what_goes_to_and_fro(law: str) -> None:
    """Pressures of all phases and what lies on the strip, at all nodes; without debris they are others."""
    wears = f"wear={{punch={{{law}}}}}"
    system, bare = (system_of(wears, *lies, "run.half_cycles=40000") for lies in ([carried(0.6, "3 mm")], []))
    found, blocks = steady(system), list(evolve(system, integration="jump", tolerance=1e-3))
    last = blocks[-1].end
    pressure = np.concatenate([one.pressure for one in last.contacts])
    top = pressure.max()
    assert found.phase_pressure == pytest.approx(pressure, abs=1e-6 * top)
    lies = system.sliding.pairs[0].wear_interpolation @ last.worn.carried[0]
    assert found.debris == pytest.approx(lies, abs=1e-6 * lies.max())
    assert np.abs(steady(bare).pressure - found.pressure).max() > 1e-2 * top


@pytest.mark.slow
def test_marches_come_near_the_steady_state_as_a_cycle_loses_less_of_what_lies() -> None:
    """It has what lies at the end of a cycle in all of its phases: off by what a cycle changes of it."""
    wears, errors = "wear={punch={coefficient='1e-8 1/MPa'}}", []
    bare = steady(system_of(wears))
    for life in (3, 30):
        system = system_of(wears, carried(0.6, f"{life} mm"), "run.half_cycles=400000")
        found, near = steady(system), end(system, "jump").end
        marched = list(march_within(system, RunLimits(near.half_cycle + 1200, block=1200), implicit=True, start=near))[
            -1
        ].end
        pressure = np.concatenate([one.pressure for one in marched.contacts])
        by_debris = np.abs(bare.phase_pressure - found.phase_pressure).max()
        errors.append(np.abs(found.phase_pressure - pressure).max() / by_debris)
    assert errors[0] < 0.1
    assert errors[1] < 0.2 * errors[0]


def test_with_stick_by_hand_and_by_jumps() -> None:
    """Each time step, node by node: t -> e t + share W (1 - e) / x on the strip's material; jumps go with the march."""
    system = system_of("run.half_cycles=400", BOTH, carried(0.6, "0.3 mm"), *STICKS)
    assert system.layers.strip_carries
    problem, weights = system.law_state.problem, system.pair.strip.weights
    lies = ejected = np.zeros(len(weights))
    start = problem.beginning()
    for block in evolve(system, integration="explicit"):
        for steps in block.steps:
            wear = problem.passing(steps.records, replace(start, next_step=steps.first)).wear
            depth = wear.punch.depth(steps.records.pressure) + wear.strip.depth(steps.records.pressure)
            for k, step in enumerate(problem.program.steps[steps.first :][: len(steps.records)]):
                onto = problem.interface.position(step.offset).pair.wear_projection
                x = onto @ (steps.records.slip_magnitude[k] / 0.3)
                worn = onto @ depth[k]
                lost = -np.expm1(-x)
                stays = 0.6 * worn * np.divide(lost, x, out=np.ones_like(x), where=x > 0)
                lies, ejected = lies - lost * lies + stays, ejected + lost * lies + worn - stays
    marched = block
    for own, by_hand in zip(marched.end.worn.carried, (lies, ejected), strict=True):
        assert own == pytest.approx(by_hand, rel=1e-9, abs=1e-9 * by_hand.max())
    assert lies.max() > 0.5 * marched.end.worn.strip.max()
    assert marched.steps[-1].stuck.any()
    apart = []
    for tolerance in (0.3, 0.03, 0.001):
        jumps = end(system, "jump", tolerance)
        assert computed(jumps, quantities(jumps.system))["debris_balance_error"].max() < 1e-12
        apart.append(
            [
                float(np.abs(of(jumps) - of(marched)).max() / of(marched).max())
                for of in (
                    lambda run: run.end.worn.punch,
                    lambda run: run.end.worn.strip,
                    lambda run: run.end.worn.carried[0],
                    lambda run: run.end.worn.carried[1],
                )
            ]
        )
    # The march wears at its shape half a cycle of 200 before: 3e-3. The contact runs in over some 15 cycles.
    assert np.max(apart) < 6e-3
    assert max(apart[-1]) < 1e-3


def test_the_end_of_stick_keeps_what_lay_there() -> None:
    """Debris that was there at first is lost where it slips, and stays where it sticks: so much less is worn beside."""
    thick, depths = 1e-5, []
    for initial in (0.0, thick):
        lies = f"contact.third_body={{share=0.6, life='0.3 mm', initial={initial}}}"
        found = steady(system_of(lies, *STICKS, "motion.positions=1"))
        depths.append(found.depth.max())
    assert depths[1] == pytest.approx(depths[0] - thick, rel=1e-5)  # of a zone that the first cycles move by less


def test_along_a_closed_track_against_the_closed_form() -> None:
    """t = share V / (L x) (1 - e^-Nx): V worn in a half-cycle, of whose way a place is x lives long under the punch."""
    share, life, count = 0.6, 50.0, 100
    lies = f"contact.third_body={{share={share}, life='{life} mm', carried_by='strip'}}"
    few = ("geometry.degree=1", f"run.half_cycles={count}", ONE_WAY, lies)
    system = assemble(load_case("example2", few))
    width, thickness = float(system.pair.weights.sum()), system.bodies.punch.thickness
    for how, tolerance, error in (("explicit", 1.0, 1e-10), ("jump", 0.03, 3e-3), ("jump", 3e-4, 2e-4)):
        block = end(system, how, tolerance)
        x, worn = width * ROUND / TRACK / life, float(block.totals.of("volume_punch")[-1]) / thickness / count
        wanted = share * worn / (TRACK * x) * -np.expm1(-count * x)
        assert block.end.worn.carried[0] == pytest.approx(wanted, rel=error)
        assert computed(block, quantities(block.system))["debris_balance_error"][-1] < 1e-12
        assert computed(block, quantities(block.system))["debris_volume"][-1] == pytest.approx(
            thickness * TRACK * wanted, rel=error
        )
    assert steady(system).debris == pytest.approx(share * worn / (TRACK * x), rel=1e-8)


PROTECTS = "wear={punch={coefficient={expression='1e-6 * (0.2 + 0.8 * exp(-debris / 1e-4))', unit='1/MPa'}}}"
FELT = "contact.friction={expression='0.2 + 0.3 * exp(-debris / 1e-4)'}"
LIES = "contact.third_body={share=0.6, life='3 mm', initial='0.1 um', carried_by='strip'}"
OWN = (
    "contact.third_body={share=0.8, initial='0.1 um', carried_by='strip', "
    "life={expression='3 * (1 + p / 300) / (1 + 100 * debris)', unit='mm'}}"
)


@pytest.mark.parametrize("way", ["to and fro", "track"])
@pytest.mark.parametrize("laws", [(LIES, PROTECTS, FELT), (OWN,)], ids=["felt", "own law"])
@pytest.mark.parametrize("implicit", [True, False])
def test_growth_rates_follow_what_the_strip_carries(laws: tuple[str, ...], way: str, *, implicit: bool) -> None:
    """A cycle's map of its thickness and the punch's depth is the derivative of a march's, by differences."""
    wears = "wear={punch={coefficient='1e-6 1/MPa'}}"
    few = (
        "geometry.degree=1",
        "geometry.follow_wear='never'",
        "geometry.parameters.elements_along_contact=12",
        ONE_WAY,
    )
    system = assemble(load_case("example2", [*few, wears, *laws])) if way == "track" else system_of(wears, *laws)
    start = list(march_within(system, RunLimits(100, block=100), implicit=implicit))[-1].end
    n, lies, worn = len(system.pair.weights), len(system.pair.strip.weights), start.worn
    phases, strokes = range(len(system.motion.phases)), system.motion.half_cycles

    def cycle(change: Array) -> RunState:
        carried = worn.carried + np.array([change[:lies], np.zeros(lies)])
        moved = replace(start, worn=replace(worn, punch=worn.punch + change[lies:], carried=carried))
        return list(march(system, 100 + strokes, implicit=implicit, start=moved))[-1].end

    predicted, known, contacts = np.eye(lies + n), worn, cycle(np.zeros(lies + n)).contacts
    heat = cycle_heat(system)
    for phase in phases:
        pressure = contacts[phase].pressure[0]
        predicted = phase_tangent(system, phase, pressure, heat, implicit=implicit, worn=known) @ predicted
        known = lies_after(system, phase, pressure, heat, None, known)
    change = 1e-9 * np.sin(np.arange(lies + n) ** 2)
    ends = [cycle(sign * change).worn for sign in (1.0, -1.0)]
    found = np.concatenate([ends[0].carried[0] - ends[1].carried[0], ends[0].punch - ends[1].punch]) / 2
    assert np.abs(found - change).max() > 1e-3 * np.abs(change).max()
    assert np.abs(found - predicted @ change).max() < 1e-5 * np.abs(found - change).max()
    if way == "track":
        assert growth_rate(system, np.concatenate([one.pressure for one in contacts]), implicit=implicit) < 0


def test_laws_know_what_the_strip_carries_past_a_place() -> None:
    """A life that does not change is as if it were given; wear that debris slows goes on in jumps as in a march."""
    by_law = "contact.third_body={share=0.6, life={expression='3+0*debris', unit='mm'}, carried_by='strip'}"
    for how in ("explicit", "implicit"):
        one, other = (end(system_of("run.half_cycles=6", BOTH, lies), how) for lies in (by_law, carried(0.6, "3 mm")))
        assert one.end.worn.carried == pytest.approx(other.end.worn.carried, rel=1e-7, abs=1e-9 * other.wear.max())
    slowed = "wear={punch={coefficient={expression='1e-6*exp(-debris/3e-4)', unit='1/MPa'}}, strip={coefficient=1e-7}}"
    system = system_of("run.half_cycles=40", slowed, carried(0.9, "3 mm"))
    marched = [end(system, how) for how in ("explicit", "implicit")]
    bare = end(
        system_of("run.half_cycles=40", slowed.replace("debris/", "0*debris/"), carried(0.9, "3 mm")), "implicit"
    )
    jumps = end(system, "jump", 0.03)
    for of in (lambda run: run.end.worn.punch, lambda run: run.end.worn.strip, lambda run: run.end.worn.carried[0]):
        exact = (of(marched[0]) + of(marched[1])) / 2
        assert np.abs(of(jumps) - exact).max() < 0.01 * exact.max()
    assert marched[1].wear.max() < 0.8 * bare.wear.max()


def test_a_film_that_slows_its_own_wear_comes_to_rest_along_a_track() -> None:
    """The steady state is where jumps come to, in few of them: what lies on the strip is no error of what is worn."""
    slowed = "wear={punch={coefficient={expression='1e-8*(0.5+exp(-debris/1e-5))', unit='1/MPa'}}}"
    few = ("geometry.degree=1", "run.half_cycles=20000", ONE_WAY, carried(0.6, "50 mm"), slowed)
    system = assemble(load_case("example2", few))
    blocks = list(evolve(system, integration="jump", tolerance=3e-3))
    assert sum(len(block.wear) for block in blocks) < 50
    assert blocks[-1].end.worn.carried[0] == pytest.approx(steady(system).debris.mean(), rel=1e-8)


def test_what_sticks_stays_where_it_is_on_either_body() -> None:
    found = []
    for body in ("punch", "strip"):
        lies = f"contact.third_body={{share=0.6, life='3 mm', carried_by='{body}'}}"
        settings = [*SMALL, "contact.law='coulomb'", *STICK, "run.half_cycles=4", lies]
        found.append(end(assemble(load_case("fretting-partial-slip", settings)), "explicit"))
    punch, strip = (run.end.worn.between for run in found)
    assert strip == pytest.approx(punch, rel=1e-9, abs=1e-9 * punch.max())


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (
            ["contact.third_body={share=0.5, life='1 mm', carried_by='disc'}"],
            "carried_by: expected 'punch' or 'strip', got",
        ),
        ([carried(0.5, "1 mm"), "motion.positions=1"], "motion.positions: expected 2 or more"),
        ([carried(0.5, "1 mm"), ONE_WAY.replace(f", track='{TRACK} mm'", "")], "motion.track: missing"),
    ],
)
def test_what_makes_no_sense_is_told_by_its_key(settings: list[str], told: str) -> None:
    with pytest.raises(CaseError, match=told):
        load_case("example2", settings)
