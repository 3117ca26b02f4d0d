"""Mixed lubrication: wear by the asperities' share, friction of both, against hand-computed rigid limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from combinations import SMALL as SMALLEST
from combinations import STICK

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.common.arrays import Array
from fenwear.steps import Block
from fenwear.steps.coupled_phases import cycle_heat
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.run_state import beginning, on_exchange
from fenwear.steps.tangent import phase_tangent
from fenwear.system import layer_conductance

Assemble = Callable[..., Tribosystem]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=16", "geometry.follow_wear=never")
MOTION = "motion={kind='one-way', direction='rightward', speed=%g, duration=1}"
FILM = (
    "contact.lubrication={film={expression='1e-4 * v ** 0.5', unit='mm'}, roughness='1 um', "
    "share_over_lambda=[[0, 1], [1, 0.4], [3, 0]], fluid_friction=0.01}"
)
MEAN = 1e4 / 600


@pytest.mark.parametrize(("speed", "share"), [(25.0, 0.7), (100.0, 0.4), (400.0, 0.2), (1000.0, 0.0)])
def test_a_curve_of_stribeck_in_the_rigid_limit(speed: float, share: float, assembled: Assemble) -> None:
    """Film 0.1 um (v / (mm/s))^0.5 on a roughness of 1 um: lambda 0.5, 1, 2 and 3.16; wear and friction follow."""
    system = assembled("example2", *SMALL, MOTION % speed, FILM, "contact.friction=0.2", "wear.punch.coefficient=1e-7")
    steps, weights = 30, system.pair.weights
    for blocks in (march(system, steps, implicit=True), jump(system, steps, tolerance=1e-2)):
        *_, last = blocks
        depth = float(weights @ last.wear[-1] / weights.sum())
        assert depth == pytest.approx(1e-7 * share * MEAN * speed * steps, rel=1e-9, abs=1e-15)
        mu = last.totals.of("work")[-1] / last.totals.of("load_path")[-1]
        assert mu == pytest.approx(share * 0.2 + (1 - share) * 0.01, rel=1e-9)


@pytest.mark.parametrize(
    "between", ["", "contact.hardness='45 MPa'", "contact.layer={kind='power', reference='1 um', pressure='9 MPa'}"]
)
def test_friction_that_follows_the_pressure_is_that_of_the_pressure(between: str, assembled: Assemble) -> None:
    """Found together, they are a contact by itself whose friction is given: that of these pressures, node by node."""
    film = "contact.lubrication={asperity_share={expression='0.2 + 0.8 * exp(-p / 30)'}, fluid_friction=0.01}"
    given = ("contact.friction=0.6", "wear.punch.coefficient='1e-8 1/MPa'", film, *([between] if between else []))
    system = assembled("example1", *SMALL, *given)
    (*_, two), phase = march(system, 2), 0
    *_, three = march(system, 3, start=two.end)
    before, found = two.end.worn, three.end.contacts[phase].pressure[0]
    apart = system.passed_contact(phase)
    apart.slide([system.phases.ratio(phase, system.laws.friction.values(system.phases.conditions(phase, found)))])
    step = system.phases.passing(system.phases.mean_wear.some([phase]), [phase]).step(
        before, implicit=False, capped=True
    )
    alone = apart.solve(system.gap(phase, before, passing=True), None, step).pressure[0]
    np.testing.assert_allclose(found, alone, rtol=0, atol=1e-9 * alone.max())


def test_with_stick_jumps_fall_to_the_march() -> None:
    """A share by the pressure, in partial slip, at every place."""
    film = "contact.lubrication={asperity_share={expression='min(1, 0.3 + p / 2000)'}, fluid_friction=0.6}"
    cycles, worn = 40, "wear={punch={coefficient='8e-6 1/MPa'}}"
    settings = [*SMALLEST, "contact.law='coulomb'", *STICK, worn, film]
    system = assemble(load_case("fretting-partial-slip", settings))
    *_, marched = march(system, 2 * cycles)
    errors = []
    for tolerance in (0.3, 3e-3):
        *_, last = jump(system, 2 * cycles, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - marched.wear[-1]).max() / marched.wear[-1].max()))
    assert errors[0] < 0.1
    assert errors[1] < 5e-3


SHARES = {"0.4": 0.4, "{expression='min(1, 0.2 + p / 100)'}": None}
LAWS = {
    "{coefficient=1e-8, pressure_threshold='3 MPa'}": lambda q: 1e-8 * np.maximum(q - 3, 0),
    "{coefficient=1e-8, pressure_cap='5 MPa'}": lambda q: 1e-8 * np.minimum(q, 5),
    "{per_area=2e-7, touching_from='8 MPa'}": lambda q: 2e-7 * np.minimum(q / 8, 1),
    "{coefficient=1e-9, pressure_exponent=2, pressure_threshold='2 MPa'}": lambda q: 1e-9 * np.maximum(q - 2, 0) ** 2,
}  # fmt: skip


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("how", ["explicit", "implicit"])
def test_wear_is_that_of_the_asperities_pressure(how: str, law: str, share: str, assembled: Assemble) -> None:
    """Node by node, whatever the law makes of a pressure: threshold and cap are of what asperities carry."""
    given = (f"contact.lubrication={{asperity_share={share}, fluid_friction=0.02}}", f"wear={{punch={law}}}")
    (block,) = march(assembled("example1", *SMALL, MOTION % 100, *given), 1, implicit=how == "implicit")
    pressure = block.pressure[0]
    carried = pressure * (SHARES[share] or np.minimum(1, 0.2 + pressure / 100))
    depth = 100 * LAWS[law](carried)
    np.testing.assert_allclose(block.wear[0], depth, rtol=0, atol=1e-8 * depth.max())


@pytest.mark.parametrize("kind", ["power", "exponential", "rough"])
def test_a_layer_of_asperities_feels_their_pressure(kind: str, assembled: Assemble) -> None:
    """It closes, and conducts, as a dry one does at the pressure of the asperities."""
    layer = {
        "power": "{kind='power', reference='1 um', pressure='5 MPa'}",
        "exponential": "{kind='exponential', length='1 um', pressure='5 MPa'}",
        "rough": "{kind='rough', roughness='4 um', asperity_radius='50 um', asperity_density='100 1/mm^2'}",
    }[kind]
    given = (*SMALL, f"contact.layer={layer}", "heat={conductance='layer', partition=0.9}")
    dry, wet = (
        assembled("example2-heat", *given, *more)
        for more in ((), ("contact.lubrication.asperity_share={expression='min(1, 0.2 + p / 100)'}",))
    )
    pressure, step = np.linspace(1, 60, len(dry.pair.weights)), 1e-3
    carried = pressure * (0.2 + pressure / 100)
    np.testing.assert_allclose(wet.layers.given(pressure), dry.layers.given(carried), rtol=1e-12)
    of_dry, of_wet = layer_conductance(dry), layer_conductance(wet)
    assert of_dry is not None
    assert of_wet is not None
    np.testing.assert_allclose(of_wet(pressure, 0), of_dry(carried, 0), rtol=1e-9)
    change = wet.layers.given(pressure + step) - wet.layers.given(pressure - step)
    np.testing.assert_allclose(wet.layers.slope(pressure), change / (2 * step), rtol=1e-4)


def test_a_layer_of_asperities_under_a_film(assembled: Assemble) -> None:
    """The share follows the speed of each phase, for the heat of the layer, too; with stick it may follow none."""
    layer = "contact.layer={kind='power', reference='1 um', pressure='5 MPa'}"
    dry, wet = (assembled("example2", *SMALL, MOTION % 100, layer, *more) for more in ((), (FILM,)))
    pressure = np.full(len(dry.pair.weights), MEAN)
    np.testing.assert_allclose(wet.layers.given(pressure), dry.layers.given(0.4 * pressure), rtol=1e-12)
    few = ("geometry.degree=1", "geometry.parameters.elements_along_contact=6", "geometry.parameters.overlap=2")
    heat = (*few, "motion.positions=3", layer, "heat.conductance='layer'", "heat.partition=0.9")
    dry, wet = (assembled("example2-heat", *heat, *more) for more in ((), (FILM,)))
    pressure, speeds = pressure[: len(dry.pair.weights)], [wet.phases.conditions(phase).speed[0] for phase in range(3)]
    assert max(speeds) > 1.5 * min(speeds)
    for phase, share in enumerate(np.interp(0.1 * np.sqrt(speeds), [0, 1, 3], [1, 0.4, 0])):
        expected = dry.exchange.conductance(share * pressure)
        np.testing.assert_allclose(wet.exchange.conductance(pressure, phase), expected, rtol=1e-9)
    (*_, marched), (*_, jumped) = march(wet, 8, implicit=True), jump(wet, 8, tolerance=1e-3)
    np.testing.assert_allclose(jumped.wear[-1], marched.wear[-1], rtol=0, atol=1e-2 * marched.wear[-1].max())
    with pytest.raises(CaseError, match=r"heat\.conductance: .* depends on T"):
        assembled("example2-heat", *heat, "contact.lubrication.asperity_share={expression='min(1, 0.01 * T)'}")
    with pytest.raises(CaseError, match=r"contact\.layer: .* depends on v"):
        assembled("fretting-partial-slip", *SMALLEST, "contact.law='coulomb'", *STICK, layer, FILM)


def test_a_layer_under_a_film_that_changes_within_the_cycle(assembled: Assemble) -> None:
    """Of rigid bodies the approach in each phase is that of X(v) p there, and what has worn; jumps follow the march."""
    layer = "contact.layer={kind='power', reference='1 um', pressure='5 MPa', exponent=0.5}"
    given = (*SMALL, "geometry.parameters.overlap=2", "motion.positions=3", layer, FILM, "wear.punch.coefficient=4e-7")
    rigid = [f"materials.{material}.young='1e9 MPa'" for material in ("steel", "composite")]
    system = assembled("example2", *given, *rigid)
    (block,) = march_within(system, RunLimits(1, block=1))
    phases = system.motion.phases[:3]
    slid = np.array([system.phases.conditions(k).speed[0] * phase.duration for k, phase in enumerate(phases)])
    film = 0.1 * (slid / [phase.duration for phase in phases]) ** 0.5
    share = np.interp(film, [0, 1, 3], [1, 0.4, 0])
    worn = np.cumsum([0.0, *(4e-7 * share * MEAN * slid)[:2]])
    approach = [-contact.rigid[0, 0] for contact in block.end.contacts[:3]]
    expected = 1e-3 * np.sqrt(share * MEAN / 5) + worn
    np.testing.assert_allclose(np.diff(approach), np.diff(expected), rtol=1e-3)
    elastic = assembled("example1", *given)
    (*_, marched), (*_, jumped) = march(elastic, 80, implicit=True), jump(elastic, 80, tolerance=1e-3)
    np.testing.assert_allclose(jumped.wear[-1], marched.wear[-1], rtol=0, atol=3e-3 * marched.wear[-1].max())
    state = steady(elastic)
    start = replace(beginning(elastic), worn=replace(elastic.unworn(), punch=state.shape))
    (first,) = march_within(elastic, RunLimits(1, block=1), start=start)
    np.testing.assert_allclose(first.end.contacts[0].pressure[0], state.phase_pressure[0], rtol=1e-9, atol=1e-9)


def test_a_layer_under_a_film_that_thins_with_the_warmth(assembled: Assemble) -> None:
    """X(T) p of the moment closes the layer; march, jump and end agree, and the tangent is that of the march."""
    layer = "contact.layer={kind='power', reference='1 um', pressure='5 MPa', exponent=0.5}"
    share = "contact.lubrication.asperity_share={expression='min(1, 0.3 + 0.01 * T)'}"
    wet = assembled("ring-on-ring-heat", "geometry.degree=1", "geometry.parameters.across=4", layer, share)
    pressure, warm = np.full((1, len(wet.pair.weights)), MEAN), np.full(len(wet.pair.weights), 30.0)
    layers = wet.phases.passing(
        wet.phases.mean_wear, None, None, [wet.phases.conditions(0, pressure[0], (warm, warm))]
    ).layers
    np.testing.assert_allclose(layers.closing(pressure), 1e-3 * np.sqrt(0.6 * pressure / 5), rtol=1e-12)
    (*_, marched), (*_, jumped) = march(wet, 40, implicit=True), jump(wet, 40, tolerance=1e-3)
    np.testing.assert_allclose(jumped.wear[-1], marched.wear[-1], rtol=0, atol=1e-3 * marched.wear[-1].max())
    state = steady(wet)
    assert state.heat is not None
    start = replace(beginning(wet, state.heat.end), worn=replace(wet.unworn(), punch=state.shape))
    *_, block = march(wet, 1, implicit=True, start=start)
    np.testing.assert_allclose(block.end.contacts[0].pressure[0], state.phase_pressure[0], rtol=1e-6)
    heat, n = cycle_heat(wet), len(wet.pair.weights)
    begin = on_exchange(replace(marched.end, half_cycle=0), heat.exchange)
    assert begin.temperature is not None
    values = begin.temperature.values

    def ended(change: Array) -> tuple[Array, Block]:
        worn = replace(begin.worn, punch=begin.worn.punch + change[len(values) :])
        warmed = heat.exchange.at(values + change[: len(values)])
        *_, last = march(wet, 1, implicit=True, start=replace(begin, worn=worn, temperature=warmed))
        end = on_exchange(last.end, heat.exchange).temperature
        assert end is not None
        return np.append(end.values, last.wear[-1] + last.wear_strip[-1]), last

    change = np.concatenate([1e-4 * values, 1e-9 * np.sin(np.arange(n) ** 2)])
    (_, last), (up, _), (down, _) = (ended(sign * change) for sign in (0, 1, -1))
    found = (up - down) / 2 - change
    expected = phase_tangent(wet, 0, last.pressure[0], heat, begin.temperature) @ change - change
    for part in (slice(0, len(values)), slice(len(values), None)):
        np.testing.assert_allclose(expected[part], found[part], rtol=0, atol=1e-3 * np.abs(found[part]).max())


def test_wear_by_powers_of_the_pressure_and_by_energy(assembled: Assemble) -> None:
    """The share is of the pressure: at b = 2 it counts twice; energy wears by what asperities rub."""
    laws = {"{coefficient=1e-9, pressure_exponent=2}": 1e-9 * 0.25, "{energy=1e-7}": 1e-7 * 0.2 * 0.5}
    for law, rate in laws.items():
        settings = ("contact.lubrication.asperity_share=0.5", "contact.friction=0.2", f"wear.punch={law}")
        system = assembled("example2", *SMALL, MOTION % 100, *settings)
        np.testing.assert_allclose(system.phases.mean_wear.punch.rate, 100 * rate, rtol=1e-12)


def test_pressures_of_the_end(assembled: Assemble) -> None:
    """A share that grows with p wears as a higher power of it: X p is even where p is, and X p^1 as beta~ p^1.5."""
    share = "contact.lubrication.asperity_share={expression='min(1, 0.2 * (p / 16) ** 0.5)'}"
    wide = "wear.punch.coefficient={expression='1e-8*(1 + (x/30)**2)'}"
    system = assembled("example2", *SMALL, MOTION % 100, share, "contact.friction=0", wide)
    state, x, weights = steady(system), system.pair.x, system.pair.weights
    shape = (1 + (x / 30) ** 2) ** (-1 / 1.5)
    np.testing.assert_allclose(state.pressure[0], 1000 * shape / (weights @ shape), rtol=1e-7)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("{asperity_share=1.5}", "contact.lubrication.asperity_share"),
        ("{}", "give one of asperity_share and film"),
        ("{film='1 um'}", "contact.lubrication.roughness: expected together with film"),
        ("{asperity_share={expression='depth'}}", "contact.lubrication.asperity_share: .* alone, got depth"),
        ("{asperity_share={expression='T'}}", "contact.lubrication.asperity_share: depends on the temperature T"),
        ("{film='1 um', roughness='1 um', share_over_lambda=[[1, 1], [0, 0]]}", "with rising lambda"),
    ],
)
def test_wrong_input_is_told_by_its_key(wrong: str, told: str) -> None:
    """Before anything is computed."""
    with pytest.raises(CaseError, match=told):
        load_case("example2", [f"contact.lubrication={wrong}"])


def test_a_share_above_one_is_told(assembled: Assemble) -> None:
    """With the state that it was met at."""
    case = load_case("example2", [*SMALL, "contact.lubrication.asperity_share={expression='p'}"])
    with pytest.raises(CaseError, match=r"contact.lubrication.asperity_share:"):
        assemble(case).laws.friction.values(assemble(case).phases.conditions(0))
