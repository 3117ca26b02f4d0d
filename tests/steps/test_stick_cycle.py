"""Cycles with stick: energy, loops, wear, jumps, gross sliding as the limit, time steps, bad input."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
import pytest
from combinations import FEATURES, STICK

from fenwear import Block, CaseError, assemble, jump, load_case, march
from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.steps import evolve
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_jump import first_cycle as begin_cycle
from fenwear.steps.stick_jump import jumped
from fenwear.steps.stick_program import make_program
from fenwear.steps.stick_setup import HALVINGS, fine_enough, partial_slip_problem, with_steps
from fenwear.steps.stick_state import PartialSlipState, TimeStepRecords

COARSE = ("geometry.parameters.elements_along_contact=20", "geometry.follow_wear='never'")
SMALL = (*COARSE, "motion.amplitude='3 um'")


@lru_cache
def problem(*settings: str) -> PartialSlipProblem:
    return partial_slip_problem(load_case("fretting-partial-slip", [*SMALL, *settings]))


def worn_in_steps(
    driven: PartialSlipProblem, records: TimeStepRecords, begin: PartialSlipState | None = None
) -> tuple[Array, Array]:
    """Return what punch and strip lose in each time step at the contact nodes (k, n), mm."""
    wear = driven.passing(records, begin or driven.beginning()).wear
    return wear.punch.depth(records.pressure), wear.strip.depth(records.pressure)


def first_cycle(of: PartialSlipProblem) -> TimeStepRecords:
    return TimeStepRecords.joined(of.cycle(of.beginning())[1])


def second_cycle(of: PartialSlipProblem) -> TimeStepRecords:
    return TimeStepRecords.joined(of.cycle(of.cycle(of.beginning())[0])[1])


@pytest.mark.parametrize("settings", [(), ("stick.force='60 N'",), ("stick.bulk_stress='200 MPa'",)])
def test_energy_of_every_half_cycle(settings: tuple[str, ...]) -> None:
    """What the rig puts in is stored or dissipated, to rounding; friction never gives energy back."""
    driven = problem(*settings)
    at, parts = driven.cycle(driven.beginning())
    again = driven.cycle(at)[1]
    for part in [*parts, *again]:
        assert (part.dissipated >= 0).all()
        assert part.energy(driven.weights) > 0
        assert part.balance_error(driven.weights) < 1e-10
    there, back = (part.energy(driven.weights) for part in again)
    assert there == pytest.approx(back, rel=0.03 if "bulk" in str(settings) else 1e-6)


def test_loop_area_is_the_work_of_friction() -> None:
    """The area of the closed loop tends to it with the time steps."""
    errors = []
    for steps in (10, 20, 40):
        driven = with_steps(problem(), load_case("fretting-partial-slip", list(SMALL)), steps)
        at, _ = driven.cycle(driven.beginning())
        records = TimeStepRecords.joined(driven.cycle(at)[1])
        Q, d = records.force, records.displacement
        area = 0.5 * np.abs(np.sum(Q * np.roll(d, -1) - np.roll(Q, -1) * d))
        errors.append(abs(records.energy(driven.weights) / area - 1))
    assert errors[2] < 0.35 * errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.01


def test_force_and_displacement_drive_the_same_loop() -> None:
    """The forces of a run by displacement, imposed, move the strip as it was moved."""
    moved = second_cycle(problem())
    largest = float(np.abs(moved.force).max())
    pulled = second_cycle(problem(f"stick.force='{largest!r} N'"))
    ends = slice(len(moved) // 2 - 1, None, len(moved) // 2)
    assert pulled.force[ends] == pytest.approx([largest, -largest], rel=1e-9)
    assert pulled.displacement[ends] == pytest.approx(moved.displacement[ends], rel=2e-3)


def depths(blocks: list[Block]) -> np.ndarray:
    return np.concatenate([blocks[-1].wear[-1], blocks[-1].wear_strip[-1]])


def test_jumps_tend_to_the_march() -> None:
    """The difference to the march falls with the tolerance, of depths and mean pressures; no depth ever decreases."""
    fast = ("wear.punch.coefficient='1e-6 1/MPa'", "wear.strip.coefficient='2e-6 1/MPa'")
    settings = [*SMALL, *fast, "stick.steps=10", "stick.step_tolerance=1"]
    system, cycles = assemble(load_case("fretting-partial-slip", settings)), 40
    marched = list(march(system, 2 * cycles))
    exact, pressed = depths(marched), marched[-1].totals.pressure[-1]
    differences, others, counts = [], [], []
    for tolerance in (0.1, 1e-3):
        found = list(jump_within(system, RunLimits(2 * cycles, block=1), tolerance=tolerance))  # a block for each jump
        assert found[-1].half_cycle[-1] == 2 * cycles
        counts.append(len(found))
        for before, after in itertools.pairwise(found):
            assert (after.wear[-1] >= before.wear[-1]).all()
            assert (after.wear_strip[-1] >= before.wear_strip[-1]).all()
        differences.append(np.abs(depths(found) - exact).sum() / exact.sum())
        others.append(np.abs(found[-1].totals.pressure[-1] - pressed).sum() / pressed.sum())
    assert counts[0] < counts[1] < cycles
    assert max(differences) < 5e-3  # a march of cycles this long is off by 1e-3 itself
    assert others[0] < 0.1
    assert others[1] < min(0.02, others[0])


@pytest.mark.parametrize(("feature", "bound"), [("wear by depth and distance", 7e-4), ("both bodies worn", 7e-4)])
def test_short_jumps_end_where_the_march_does(feature: str, bound: float) -> None:
    """A law knows the distance in the middle of a cycle; a passing strip runs in over as many cycles as a jump has."""
    base, settings = FEATURES[feature]
    system = assemble(load_case(base, [*settings, "contact.law='coulomb'", *STICK]))
    marched, jumped_to = (depths(list(go)) for go in (march(system, 80), jump(system, 80, tolerance=1e-3)))
    assert np.abs(jumped_to - marched).max() < bound * marched.max()


def test_a_cycle_that_wears_too_much_goes_in_parts() -> None:
    """Beyond what one explicit cycle may wear: every jump is within its tolerance, and the depth is as smooth as that
    of gross sliding, which the contact nearly is, and near to it."""
    sizes = ("geometry.parameters.elements_along_contact=20", "motion.positions=1", "motion.amplitude='25 um'")
    wear = ("wear={punch={coefficient='2e-5 1/MPa'}}", "contact.friction=0.3", "stick={steps=4, step_tolerance=1}")
    own, sliding = (
        partial_slip_problem(load_case("fretting", [*sizes, *wear, "contact.law='coulomb'"])),
        [*sizes, *wear[:2]],
    )
    cycle = begin_cycle(own, own.beginning(), own.unworn(), 0)
    while cycle.number < 3:
        cycle = jumped(own, cycle, 3, 3e-2)
        assert cycle.error <= 3e-2
    system = assemble(load_case("fretting", [*sliding, "contact.law='gross-sliding'"]))
    *_, block = jump(system, 6, tolerance=1e-2)
    smooth, depth = block.wear[-1], cycle.worn.punch
    np.testing.assert_allclose(depth, smooth, atol=0.05 * smooth.max())
    assert np.abs(np.diff(depth, 2)).max() < 1.3 * np.abs(np.diff(smooth, 2)).max()


@pytest.mark.parametrize("elements", [20, 40])
def test_jumps_over_growing_contacts_are_as_many_on_any_mesh(elements: int) -> None:
    """What slides as a whole wears as in gross sliding, in about as many jumps: nodes come into contact within them."""
    sizes = (f"geometry.parameters.elements_along_contact={elements}", "motion.positions=1", "motion.amplitude='25 um'")
    wear = ("wear={punch={coefficient='4.8e-8 1/MPa'}}", "contact.friction=0.3")
    laws = ("contact.law='coulomb'", "stick={steps=4, step_tolerance=1}"), ("contact.law='gross-sliding'",)
    sticking, sliding = (
        list(
            jump_within(
                assemble(load_case("fretting", [*sizes, *wear, *law])), RunLimits(3000, block=1), tolerance=3e-3
            )
        )
        for law in laws
    )
    assert len(sticking) <= len(sliding)
    depth, expected = sticking[-1].wear[-1], sliding[-1].wear[-1]
    np.testing.assert_allclose(depth, expected, rtol=0, atol=0.015 * expected.max())


HARDLY_WORN = ("wear.punch.coefficient='1e-14 1/MPa'", "wear.strip.coefficient='1e-14 1/MPa'", "stick.step_tolerance=1")


def work_of_program(steps: str, integration: str = "jump") -> float:
    """Return the work of friction of a program on bodies that hardly wear, mJ."""
    settings = [*SMALL, *HARDLY_WORN, "stick.steps=10", f"program.steps={steps}", f"run.integration={integration}"]
    system = assemble(load_case("fretting-partial-slip", [*settings, "unset=['run.half_cycles']"]))
    return list(evolve(system))[-1].totals.of("work")[-1]


def test_a_spectrum_does_the_work_of_its_cycles() -> None:
    """In jumps each block has cycles of its own from its first one on, whatever came before."""
    blocks = [(50, 3.0), (20, 4.5), (100, 2.2), (20, 4.5), (3, 3.0)]
    expected = 0.0
    for count, amplitude in blocks:
        own = problem(*HARDLY_WORN, "stick.steps=10", f"motion.amplitude='{amplitude} um'")
        expected += count * second_cycle(own).energy(own.weights)
    steps = [f"{{cycles={count}, amplitude='{amplitude} um'}}" for count, amplitude in blocks]
    assert work_of_program(f"[{', '.join(steps)}]") == pytest.approx(expected, rel=5e-4)


def test_jumps_follow_loads() -> None:
    """Loads that leap, and a ramp of them, do the work in jumps that they do in a march."""
    steps = "[{cycles=10}, {cycles=100, load_factor=[1.4, 0.8]}, {cycles=10, load_factor=1}]"
    assert work_of_program(steps) == pytest.approx(work_of_program(steps, "explicit"), rel=3e-3)


def test_worn_volume_goes_with_the_work_of_friction() -> None:
    """For b = a = 1 the worn area is coefficient / mu times the work of friction."""
    driven = problem()
    records = first_cycle(driven)
    energy, worn = records.energy(driven.weights), driven.worn(records, driven.beginning())
    assert driven.weights @ worn.punch == pytest.approx(2e-8 / 0.9 * energy, rel=1e-9)
    strip = driven.interface.middle.pair.strip.weights
    assert strip @ worn.strip == pytest.approx(2e-8 / 0.9 * energy, rel=1e-9)


def test_wear_begins_at_a_pressure_and_ends_to_grow_at_another() -> None:
    """Threshold and cap count at each node in each time step; sqrt(p) and the square of the speed, too."""
    law = "wear.punch={coefficient='1e-8 1/MPa', pressure_threshold='200 MPa', pressure_cap='500 MPa'}"
    driven = problem(law)
    records = first_cycle(driven)
    expected = 1e-8 * (np.clip(records.pressure, 200, 500) - 200) * records.slip_magnitude
    assert worn_in_steps(driven, records)[0] == pytest.approx(expected, rel=1e-12)
    law = "wear.punch={coefficient=1e-8, pressure_exponent=0.5, speed_exponent=2}"
    driven = problem(law)
    records = first_cycle(driven)
    duration = 0.2 / 40
    assert worn_in_steps(driven, records)[0] == pytest.approx(
        1e-8 * records.pressure**0.5 * records.slip_magnitude**2 / duration, rel=1e-12
    )


def test_large_strokes_slide_as_a_whole() -> None:
    """Fretting of 25 um: pressures as of known direction; the bodies take 3 % of the stroke elastically."""
    settings = ["geometry.parameters.elements_along_contact=24", "motion.positions=9"]
    sliding = assemble(load_case("fretting", settings))
    case = load_case("fretting", [*settings, "contact.law='coulomb'", "stick.steps=9"])
    driven = partial_slip_problem(case)
    at, _ = driven.cycle(driven.beginning())
    _, parts = driven.cycle(at)
    for half, part in enumerate(parts):
        for k in range(3, 9):
            phase = 9 * half + k
            known = sliding.phase_contact((phase,)).solve(sliding.gap(phase, sliding.unworn()))
            difference = np.abs(part.pressure[k] - known.pressure[0]).max()
            assert difference < 1e-7 * known.pressure.max()
            assert not part.sticking[k].any()
            assert abs(part.force[k]) == pytest.approx(0.9 * 18.5, rel=1e-6)
    energy = sum(part.energy(driven.weights) for part in parts)
    assert energy / (0.9 * 18.5 * 0.1) == pytest.approx(0.97, abs=0.01)


COURSE = "[[0, 1], [0.3, 1], [0.35, 0.7], [0.4, 1], [1, 1]]"
LOAD = f"punch.loads=[{{on='punch_top', force=['0 N', '-120 N'], over_cycle={COURSE}}}]"


def test_steps_are_halved_where_it_counts() -> None:
    """The work of friction of the cycle tends to that of many equal steps as the tolerance falls, in fewer steps."""
    start = problem(LOAD, "stick.steps=8")
    case = load_case("fretting-partial-slip", [*SMALL, LOAD, "stick.steps=8"])
    exact = first_cycle(with_steps(start, case, 96)).energy(start.weights)
    errors, counts = [], []
    for tolerance in (0.1, 0.01):
        within = load_case(
            "fretting-partial-slip", [*SMALL, LOAD, "stick.steps=8", f"stick.step_tolerance={tolerance}"]
        )
        found, fineness = fine_enough(start, within)
        assert fineness.enough
        assert fineness.change <= tolerance
        errors.append(abs(first_cycle(found).energy(start.weights) / exact - 1))
        steps = found.program.steps
        assert sum(step.duration for step in steps) == pytest.approx(found.program.period)
        assert [step.half_cycle for step in steps] == sorted(step.half_cycle for step in steps)
        durations = [step.duration for step in steps]
        counts.append((len(steps), round(found.program.period / min(durations))))
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 0.01
    assert 2 * counts[1][0] < counts[1][1], "equal steps as short as the shortest would be more"


def test_steps_that_stay_too_coarse_are_told() -> None:
    """Where the finest do not reach the tolerance."""
    case = load_case("fretting-partial-slip", [*SMALL, LOAD, "stick.steps=2", "stick.step_tolerance=1e-7"])
    found, fineness = fine_enough(problem(LOAD, "stick.steps=2"), case)
    assert not fineness.enough
    assert 1e-7 < fineness.change < 0.1
    assert len(found.program.steps) <= 2 * 2 * 2**HALVINGS
    assert "stick.steps" in fineness.text()


def test_the_program_follows_the_motion() -> None:
    """It leads from the middle to the start, to the other side and back; a table goes as it says."""
    program = make_program(load_case("fretting-partial-slip"))
    ends = [step.displacement for step in program.steps]
    assert ends[19] == pytest.approx(3e-3)
    assert ends[39] == pytest.approx(-3e-3)
    assert program.lead_in[-1].displacement == pytest.approx(-3e-3)
    table = "motion={kind='table', times=[0, 1, 3, 4], displacements=['0 um', '2 um', '-2 um', '0 um']}"
    program = make_program(load_case("fretting-partial-slip", [table, "stick.steps=4"]))
    assert program.half_cycles == 3
    assert [step.displacement for step in program.steps][3::4] == pytest.approx([2e-3, -2e-3, 0.0])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["contact.law='gross-sliding'", "stick.force='1 N'"], "stick: expected with contact.law = 'coulomb' only"),
        (["contact.law='viscous'"], "contact.law"),
        (["stick.steps=1"], "stick.steps"),
        (["stick.bulk_over_cycle=[[0, 1], [0.5, 0]]"], "stick.bulk_over_cycle: expected pairs"),
        (
            ["contact.transverse_friction=0.1"],
            "contact.transverse_friction: expected 0",
        ),
        (["motion={kind='one-way', direction='rightward', speed=1, duration=1}"], "motion.kind: expected"),
    ],
)
def test_bad_cases_name_the_key(settings: list[str], message: str) -> None:
    """What does not go with stick is refused when the case is read."""
    with pytest.raises(CaseError, match=message.replace(".", r"\.")):
        load_case("fretting-partial-slip", settings)


def test_more_force_than_friction_holds() -> None:
    """The run ends with what the contact carries."""
    driven = problem("stick.force='109 N'")
    with pytest.raises(ConvergenceError, match=r"gross sliding starts: the tangential force .* reaches mu P = 108"):
        driven.cycle(driven.beginning())


def test_the_surface_is_stretched_most_at_the_ends_of_strokes() -> None:
    """Like bodies stretch alike: what sticks keeps its strain. None swings at a node as the edge of slip comes by."""
    driven = problem()
    _, parts = driven.cycle(driven.cycle(driven.beginning())[0])
    strain = TimeStepRecords.joined(parts).strain[:, :, 0]
    largest, at_ends = strain.max(axis=0), strain[[len(strain) // 2 - 1, -1]].max(axis=0)
    assert np.abs(largest - at_ends).max() < 0.02 * np.ptp(strain, axis=0).max()


def test_mean_pressure_of_the_last_cycle() -> None:
    """A wear law by pm and cs: of the cycle before that of the steps, over its slip; to and fro nothing crosses."""
    law = "coefficient={expression='1e-9 * pm * (1 + cs)', unit='1/MPa'}"
    driven = problem(f"wear={{punch={{{law}}}, strip={{{law}}}}}")
    at, parts = driven.cycle(driven.beginning())
    before = TimeStepRecords.joined(parts)
    now = TimeStepRecords.joined(driven.cycle(at)[1])
    p, s = before.pressure, before.slip_magnitude
    slid = s.sum(axis=0) > 0
    mean = (p * s).sum(axis=0)[slid] / s.sum(axis=0)[slid]
    wanted = 1e-9 * mean * (now.pressure * now.slip_magnitude)[:, slid]
    assert wanted.max() > 0
    # Directions at nodes of the strip are those of some of the punch's, which is round.
    for depth, same in zip(worn_in_steps(driven, now, at), (1e-11, 1e-8), strict=True):
        assert np.abs(depth[:, slid] - wanted).max() < same * depth.max()


@pytest.mark.parametrize(("amplitude", "passes"), [("5 um", False), ("8 um", True)])
def test_a_strip_passes_by_what_slips(amplitude: str, *, passes: bool) -> None:
    """Where its supports move by two nodes of 2.5 um, but the surfaces slip by a fifth of one, they stay opposite."""
    wears = "wear={punch={coefficient='1e-7 1/MPa'}, strip={coefficient='1e-7 1/MPa'}}"
    system = assemble(load_case("fretting-partial-slip", [wears, f"motion.amplitude='{amplitude}'"]))
    assert getattr(system.elastic.condensed, "strip_moves") == passes  # noqa: B009  (of bodies that are condensed)
