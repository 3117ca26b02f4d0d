"""What lies between, in contact: march, implicit march, jump and end agree, the balances close, wrong input is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from combinations import SMALL, STICK

from fenwear import Case, CaseError, ConvergenceError, Tribosystem, assemble, load_case, steady
from fenwear.laws.wear import WornDepths
from fenwear.steps import Block, evolve, growth_rate

DEBRIS = "contact.third_body={share=0.6, life='0.3 mm'}"
LAYERS = {
    "linear": "{kind='linear', stiffness='1e6 MPa/mm'}",
    "power": "{kind='power', reference='1 um', pressure='100 MPa'}",
    "exponential": "{kind='exponential', length='1 um', pressure='10 MPa'}",
    "rough": "{kind='rough', roughness='0.2 um', asperity_radius='50 um', asperity_density='1000 1/mm^2'}",
}
LAWS = ("gross-sliding", "coulomb")


def case_of(law: str, *more: str) -> Case:
    stick = STICK if law == "coulomb" else ("stick={}",)
    return load_case("fretting-partial-slip", [*SMALL, f"contact.law='{law}'", *stick, *more])


def end(system: Tribosystem, how: str, tolerance: float = 1e-3) -> Block:
    block = list(evolve(system, integration=how, tolerance=tolerance))[-1]
    assert block.equilibrium_error.max() < 1e-12
    assert block.complementarity_error.max() < 1e-9
    return block


@pytest.mark.parametrize(
    "layer", [pytest.param(name, marks=() if name == "rough" else pytest.mark.slow) for name in LAYERS]
)
@pytest.mark.parametrize("law", LAWS)
def test_layers_give_way_alike_in_all_steps(law: str, layer: str) -> None:
    """Marches, explicit and implicit, and jumps come to the same; a layer lowers the pressure."""
    system = assemble(case_of(law, "run.half_cycles=4", f"contact.layer={LAYERS[layer]}"))
    bare = assemble(case_of(law, "run.half_cycles=4"))
    depths = [end(system, how).end.worn.punch for how in ("explicit", "implicit", "jump")]
    scale = depths[0].max()
    assert np.abs(depths[2] - depths[1]).max() < 1e-3 * scale
    assert np.abs(depths[2] - depths[0]).max() < (2e-2 if law == "coulomb" else 1e-3) * scale  # its first half-cycle
    assert end(system, "explicit").pressure.max() < 0.9 * end(bare, "explicit").pressure.max()


@pytest.mark.parametrize("law", LAWS)
def test_debris_is_worn_stored_or_ejected(law: str) -> None:
    """In every step, to rounding; marches and jumps have it as thick."""
    system = assemble(case_of(law, "run.half_cycles=8", DEBRIS, f"contact.layer={LAYERS['exponential']}"))
    weights, thick = system.pair.weights, {}
    for how in ("explicit", "implicit", "jump"):
        block = end(system, how)
        stored, ejected = block.end.worn.between
        worn = float(block.totals.of("volume_punch")[-1]) / system.bodies.punch.thickness
        assert float(weights @ (stored + ejected)) == pytest.approx(worn, rel=1e-12)
        assert (stored >= 0).all()
        thick[how] = stored
    for how in ("implicit", "jump"):
        wrong = 5e-2 if law == "coulomb" else 5e-3  # its first half-cycle
        assert np.abs(thick[how] - thick["explicit"]).max() < wrong * thick["explicit"].max()


def test_the_steady_state_has_what_is_fed_times_its_life() -> None:
    """A run of jumps to the end has its thickness and its pressures, with a layer, too; debris changes no pressure."""
    more = (DEBRIS, f"contact.layer={LAYERS['exponential']}", "wear.punch.coefficient='1e-4 1/MPa'")
    system = assemble(case_of("gross-sliding", "run.half_cycles=400000", *more))
    state, last = steady(system), end(system, "jump", 1e-2)
    assert state.debris is not None
    slid = sum(phase.distance for phase in system.motion.phases)
    assert state.debris == pytest.approx(0.6 * 0.3 * state.wear_per_cycle / slid, rel=1e-2)
    assert np.abs(last.end.worn.between[0] - state.debris).max() < 1e-5 * state.debris.max()
    assert np.abs(last.pressure[-1] - state.pressure[-1]).max() < 1e-3 * state.pressure.max()
    without = steady(assemble(case_of("gross-sliding", *more[1:])))
    assert state.pressure == pytest.approx(without.pressure, rel=1e-9)


def test_debris_that_stays_for_ever_carries_like_what_was_worn() -> None:
    """All of it kept, nothing lost: the gap never changes, nor does the pressure, however much is worn."""
    system = assemble(case_of("gross-sliding", "run.half_cycles=8", "contact.third_body={share=1, life='1e9 m'}"))
    block = end(system, "explicit")
    assert np.ptp(block.pressure[0::2], axis=0).max() < 1e-9 * block.pressure.max()
    assert block.end.worn.between[0] == pytest.approx(block.end.worn.punch, rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_parameters_of_layers_are_maps(law: str) -> None:
    """Those of a constant give its pressures; where half of the contact is softer, it carries less there."""
    depths, pressures = [], []
    middle = "{kind='power', reference={table=[[-1e3, 1], [1e3, 1]], of='x', unit='um'}, pressure='100 MPa'}"
    softer = "{kind='power', reference={table=[[-1e-6, 1], [1e-6, 4]], of='x', unit='um'}, pressure='100 MPa'}"
    for layer in ("{kind='power', reference='1 um', pressure='100 MPa'}", middle, softer):
        block = end(assemble(case_of(law, "run.half_cycles=2", f"contact.layer={layer}")), "explicit")
        depths.append(block.end.worn.punch)
        pressures.append(block.pressure[0])
    assert np.abs(depths[1] - depths[0]).max() < 1e-9 * depths[0].max()
    assert np.abs(pressures[1] - pressures[0]).max() < 1e-9 * pressures[0].max()
    x = block.system.pair.x
    left, right = (float(block.system.pair.weights[side] @ pressures[2][side]) for side in (x < 0, x > 0))
    assert right < 0.9 * left


@pytest.mark.parametrize(
    "layer",
    [
        "{kind='exponential', length={expression='1 + x', unit='um'}, pressure='10 MPa'}",
        "{kind='rough', roughness={expression='0.2 * (1 + x)', unit='um'}, asperity_radius='50 um', "
        "asperity_density={expression='1000 + 100 * x', unit='1/mm^2'}}",
    ],
)
def test_maps_close_as_their_places_alone(layer: str) -> None:
    """Each node by the law of constants with the values there; in all steps alike."""
    system = assemble(case_of("gross-sliding", "run.half_cycles=4", f"contact.layer={layer}"))
    pressure = np.linspace(1.0, 300.0, len(system.pair.x))
    found = system.layers.given(pressure)
    for k in (0, 7, len(pressure) - 1):
        x = float(system.pair.x[k])
        own = layer.replace("1000 + 100 * x", repr(1000 + 100 * x)).replace("1 + x", repr(1 + x))
        alone = assemble(case_of("gross-sliding", f"contact.layer={own}")).layers.given(pressure)
        assert found[k] == pytest.approx(alone[k], rel=1e-12)
    depths = [end(system, how).end.worn.punch for how in ("explicit", "jump")]
    assert np.abs(depths[1] - depths[0]).max() < 1e-3 * depths[0].max()


def test_energy_of_a_layer_is_metered() -> None:
    """What a layer stores closes the balance of energy in partial slip, to rounding."""
    system = assemble(case_of("coulomb", f"contact.layer={LAYERS['power']}"), heat="none")
    problem = system.law_state.problem
    at, _ = problem.cycle(problem.beginning())
    _, parts = problem.cycle(at)
    assert max(one.balance_error(problem.weights) for one in parts) < 1e-12


def test_growth_rates_see_what_gives_way() -> None:
    """A law that is linear by another name, p / stiffness, lets disturbances die out as the linear layer does."""
    laws = ("{kind='linear', stiffness='1e6 MPa/mm'}", "{kind='power', reference=1e-4, pressure=100, exponent=1}")
    rates = []
    for law in laws:
        system = assemble(case_of("gross-sliding", f"contact.layer={law}"))
        rates.append(growth_rate(system, steady(system).phase_pressure))
    assert rates[0] < 0
    assert rates[1] == pytest.approx(rates[0], rel=1e-9)


HARD = 500.0  # MPa; without it the largest pressure is 844 MPa


def test_no_pressure_is_beyond_the_hardness() -> None:
    """What flows stays: with the plastic depth in the gap the bodies have these pressures without any hardness, too.

    It is metered apart from wear, never less than before, and nothing where no pressure comes near.
    """
    system = assemble(case_of("gross-sliding", "run.half_cycles=6", f"contact.hardness='{HARD} MPa'"))
    bare = assemble(case_of("gross-sliding", "run.half_cycles=6"))
    block = end(system, "explicit")
    assert block.pressure.max() == pytest.approx(HARD, rel=1e-8)
    depths = block.between[:, 0]
    assert (np.diff(depths, axis=0) >= 0).all()
    assert depths[-1].max() > 1e-4
    for row, phase in ((4, 0), (5, 1)):
        gap = bare.gap(phase, WornDepths(block.wear[row - 1], block.wear_strip[row - 1])) + depths[row]
        alone = bare.phase_contact((phase,)).solve(gap).pressure[0]
        assert np.abs(alone - block.pressure[row]).max() < 1e-6 * HARD
    volumes = [float(one.totals.of("volume_punch")[-1]) for one in (block, end(bare, "explicit"))]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-9)
    jumped = end(system, "jump").end.worn.between[0]
    assert np.abs(jumped - depths[-1]).max() < 1e-2 * depths[-1].max()  # all phases flow at once, not in turn
    hard = end(assemble(case_of("gross-sliding", "run.half_cycles=6", "contact.hardness='900 MPa'")), "explicit")
    assert not hard.between.any()


def test_a_hardness_that_carries_nothing_is_refused() -> None:
    """Below the mean pressure, and in an end whose pressures are beyond it."""
    with pytest.raises(CaseError, match=r"contact\.hardness:"):
        assemble(case_of("gross-sliding", "contact.hardness='100 MPa'"))
    with pytest.raises(CaseError, match=r"contact\.hardness:"):
        assemble(case_of("coulomb", "contact.hardness='100 MPa'"))
    with pytest.raises(ConvergenceError, match="without plastic flow"):
        steady(assemble(case_of("gross-sliding", "contact.hardness='450 MPa'")))
    with pytest.raises(ConvergenceError, match="without plastic flow"):
        steady(assemble(case_of("coulomb", "contact.hardness='450 MPa'")))


def test_what_sticks_flows_beyond_the_hardness() -> None:
    """Next to no friction gives the pressures and plastic depths of gross sliding without any; friction is mu H there.

    What flows takes its work from the loads, to rounding; march and jump have it as deep.
    """
    smooth = assemble(case_of("coulomb", f"contact.hardness='{HARD} MPa'", "contact.friction=1e-6"), heat="none")
    problem = smooth.law_state.problem
    at = problem.driven(replace(problem.program, lead_in=())).beginning()
    without = assemble(
        case_of("gross-sliding", f"contact.hardness='{HARD} MPa'", "contact.friction=0", "run.half_cycles=1")
    )
    block = end(without, "explicit")
    frames = (
        5e-4  # areas seen along normals half-way between those of both bodies, and along the strip's, differ by 2e-4
    )
    assert np.abs(at.contact.pressure - block.pressure[0]).max() < frames * HARD
    assert np.abs(at.worn.between[0] - block.between[0, 0]).max() < frames * block.between.max()
    depths = {}
    for how in ("explicit", "implicit", "jump"):
        system = assemble(case_of("coulomb", f"contact.hardness='{HARD} MPa'", "run.half_cycles=8"))
        depths[how] = end(system, how).end.worn.between[0]
    assert depths["explicit"].max() > 1e-4
    for how in ("implicit", "jump"):
        assert np.abs(depths[how] - depths["explicit"]).max() < 1e-3 * depths["explicit"].max()
    problem = system.law_state.problem
    flows = 0
    at, parts = problem.cycle(problem.beginning())
    for records in (*parts, *problem.cycle(at)[1]):
        traction, limit = (
            np.linalg.norm(records.traction, axis=2),
            problem.friction * np.minimum(records.pressure, HARD),
        )
        assert (traction <= limit * (1 + 1e-12)).all()
        assert records.pressure.max() <= HARD
        assert records.balance_error(problem.weights) < 1e-12
        assert (records.flowed >= 0).all()
        assert not records.flowed[records.pressure < HARD].any()
        flows += int((records.flowed > 0).sum())
    assert flows


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("contact.third_body={share=1.2, life=1}", "contact.third_body.share"),
        ("contact.third_body={share=0.5, life=-1}", "contact.third_body.life"),
        ("contact.third_body={share=0.5, life=1, initial=-1}", "contact.third_body.initial"),
        ("contact.third_body={share=0.5, life={expression='p', unit='MPa'}}", r"contact\.third_body\.life\.unit: "),
        ("contact.third_body={share=0.5, life={regions={punch=1}}}", r"contact\.third_body\.life: expected an expr"),
        ("contact.third_body={share=0.5, life=1, edge_life=1}", r"contact\.third_body\.edge_length: expected together"),
        ("contact.third_body={share=0.5, life=1, edge_length=1}", r"contact\.third_body\.edge_life: expected together"),
        ("contact.third_body={share=0.5, life=1, edge_life=0, edge_length=1}", r"contact\.third_body\.edge_life"),
        ("contact.third_body={share=0.5, life={expression='T', unit='mm'}}", r"contact\.third_body\.life: depends on"),
        ("contact.friction={expression='0.3 + debris'}", r"contact\.friction: depends on the thickness of debris"),
        ("contact.layer={kind='linear', stiffness=0}", "contact.layer"),
        (
            "contact.layer={kind='exponential', length={expression='p', unit='mm'}, pressure=1}",
            "x, y, z alone, got p",
        ),
        ("contact.layer={kind='power', reference=1, pressure=1, exponent=2}", "exponent"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_key(setting: str, text: str) -> None:
    """The message names the key."""
    with pytest.raises(CaseError, match=text):
        case_of("gross-sliding", setting)


def test_values_of_a_place_are_positive_everywhere() -> None:
    """A life that is none somewhere is refused with the place."""
    case = case_of("gross-sliding", "contact.third_body={share=0.5, life={expression='x', unit='mm'}}")
    with pytest.raises(CaseError, match=r"contact\.third_body\.life:"):
        assemble(case)
