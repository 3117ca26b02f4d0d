"""Coatings: worn through when a rigid limit says so, at every place for itself, however long the steps are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from combinations import SMALL as SMALLEST
from combinations import STICK, WARM

from fenwear import CaseError, Tribosystem, assemble, jump, load_case, march, steady
from fenwear.common.arrays import Array
from fenwear.laws.coating import shares
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import march_within
from fenwear.steps.run_state import beginning

Assemble = Callable[..., Tribosystem]
SMALL = ("geometry.degree=2", "geometry.parameters.elements_along_contact=16", "geometry.follow_wear=never")
# One way, without friction: all pressures come to one that wears evenly.
PLAIN = (*SMALL, "contact.friction=0", "motion={kind='one-way', direction='rightward', speed=100, duration=0.1}")
MEAN = 1e4 / 600
COATED = "wear.punch={coefficient=5e-6, coating={thickness=0.05, coefficient=1e-6}}"


def test_shares() -> None:
    """A step cut anywhere is the same; its derivatives are those of differences; no coating, none used."""
    coating, base = np.array([0.1, 1.0, 3.0, 0.0, 2.0]), np.array([0.5, 5.0, 0.0, 0.0, 6.0])
    left = np.array([0.4, 0.4, 0.4, 0.4, 0.0])

    def worn(share: float, left: np.ndarray) -> np.ndarray:
        found = shares(share * coating, share * base, left)
        return np.asarray(share * (found.coating * coating + found.base * base))

    np.testing.assert_allclose(worn(1.0, left), [0.1, 0.4 + 0.6 * 5, 0.4, 0.0, 6.0], rtol=1e-15)
    for share in (0.1, 0.5, 0.9):
        first = worn(share, left)
        rest = np.maximum(left - first, 0.0)
        np.testing.assert_allclose(first + worn(1 - share, rest), worn(1.0, left), rtol=1e-14)
    slopes, size = shares(coating, base, left), 1e-7
    change = (worn(1 + size, left) - worn(1 - size, left)) / (2 * size)
    np.testing.assert_allclose(slopes.by_coating * coating + slopes.by_base * base, change, rtol=1e-7)


def test_rigid_limit(assembled: Assemble) -> None:
    """All worn through, the mean depth is t + k_2 / k_1 (k_1 p s - t) to rounding, however loose jumps are."""
    system = assembled("example2", *PLAIN, COATED)
    steps, weights = 750, system.pair.weights  # of 10 mm
    exact = 0.05 + 5 * (1e-6 * MEAN * 10 * steps - 0.05)
    *_, marched = march_within(system, RunLimits(steps, block=50), implicit=True)
    errors = []
    for tolerance in (3e-2, 1e-3):
        *_, last = jump(system, steps, tolerance=tolerance)
        errors.append(np.abs(last.wear[-1] - marched.wear[-1]).max() / exact)
        assert weights @ last.wear[-1] / weights.sum() == pytest.approx(exact, rel=1e-13)
        assert last.totals.of("volume_punch")[-1] == pytest.approx(10 * weights @ last.wear[-1], rel=1e-12)
    assert weights @ marched.wear[-1] / weights.sum() == pytest.approx(exact, rel=1e-13)
    assert errors[0] < 1e-5
    assert errors[1] < errors[0]


UNEVEN = "{expression='%g*(1 + 0.5 * x / 0.1)', unit='mm'}"
PUNCH = "wear.punch={coefficient='5e-7 1/MPa', coating={thickness=%s, coefficient='1e-7 1/MPa'%s}}"
STRIP = "wear.strip={coefficient='3e-7 1/MPa', coating={thickness='%g mm', coefficient='1e-7 1/MPa'}}"


def coated(law: str, thickness: float, more: str = "", *both: str) -> Tribosystem:
    stick = STICK if law == "coulomb" else ("stick={}",)
    settings = [*SMALLEST, f"contact.law='{law}'", *stick, PUNCH % (UNEVEN % thickness, more), *both]
    return assemble(load_case("fretting-partial-slip", settings))


def test_a_place_that_is_through_first_ends_no_jump_unseen(assembled: Assemble) -> None:
    """Of the surface it is a small part, and wears ten times as much by itself: at the edge, where it is thinnest."""
    thin = "wear.punch={coefficient=4e-7, coating={thickness={expression='5e-3*(1-x/100)'}, coefficient=4e-8}}"
    system, half_cycles = assembled("example2", *SMALL, thin), 1300
    marched = [list(march(system, half_cycles, implicit=way))[-1].wear[-1] for way in (True, False)]
    exact = sum(marched) / 2  # of which the errors of first order go
    left = 5e-3 * (1 - system.pair.punch.unworn[:, 0] / 100) - exact
    assert 0 < (left <= 0).mean() < 0.2
    errors = []
    for tolerance in (0.3, 0.03, 0.003):
        *_, last = jump(system, half_cycles, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - exact).max() / exact.max()))
        assert errors[-1] < tolerance
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("bodies", ["punch", "both", "debris"])
@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_jumps_go_through_the_end_as_marches_do(law: str, bodies: str) -> None:
    """At every place for itself: its pressure and its thickness differ from those beside it."""
    thickness = 1e-4 if law == "gross-sliding" else 1e-6
    more = {
        "punch": (),
        "both": (STRIP % (thickness / 2), "motion.positions=3"),
        "debris": ("contact.third_body={share=0.6, life='0.3 mm'}",),
    }[bodies]
    system, cycles = coated(law, thickness, "", *more), 200
    *_, marched = march(system, 2 * cycles)
    for depth, thick in zip((marched.wear[-1], marched.wear_strip[-1]), system.laws.coatings, strict=True):
        if thick.any():
            assert 0.05 < (depth >= thick).mean() < 0.95
    errors = []
    for tolerance in (3e-2, 1e-3):
        *_, last = jump(system, 2 * cycles, tolerance=tolerance)
        pairs = ((last.wear, marched.wear), (last.wear_strip, marched.wear_strip))
        apart = [np.abs(one[-1] - other[-1]).max() for one, other in pairs]
        errors.append(max(apart) / marched.wear[-1].max())
        for body, weights, depth in (
            ("punch", system.pair.weights, last.wear[-1]),
            ("strip", system.pair.strip.weights, last.wear_strip[-1]),
        ):
            volume = system.bodies.punch.thickness * weights @ depth
            assert last.totals.of(f"volume_{body}")[-1] == pytest.approx(volume, rel=1e-12)
    assert errors[0] < 5e-2
    assert errors[1] < 5e-3


def test_jumps_see_where_friction_ends() -> None:
    """It ends within a few cycles, between begin and end of a jump, where partial slip turns into another one."""
    wear = "wear.punch={coefficient='2.5e-7 1/MPa', coating={thickness=%s, coefficient='5e-8 1/MPa', friction=0.5}}"
    settings = [*SMALLEST, *STICK, "contact.law='coulomb'", "contact.friction=0.9", wear % (UNEVEN % 1e-6)]
    system, half_cycles = assemble(load_case("fretting-partial-slip", settings)), 240
    *_, marched = march(system, half_cycles)
    thickness, exact = system.laws.coatings[0], marched.wear[-1]
    assert 0.1 < (exact >= thickness).mean() < 0.9
    errors = []
    for tolerance in (0.1, 0.001):
        *_, last = jump(system, half_cycles, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - exact).max() / exact.max()))
    assert errors[0] < 0.01
    assert errors[1] < min(errors[0], 0.004), "against marches of half and quarter the wear, this one is 0.0034 off"


@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_per_area(law: str) -> None:
    """All that touches loses t + k_b / k_c (k_c s - t) by its way s, whatever the pressure."""
    wear = "wear.punch={per_area=4e-6, touching_from=1e-3, coating={thickness=%s, per_area=1e-6}}"
    stick, size = (STICK, 4e-7) if law == "coulomb" else (("stick={}",), 5.5e-7)
    settings = [*SMALLEST, f"contact.law='{law}'", *stick, "contact.friction=0.3", wear % (UNEVEN % size)]
    system, half_cycles = assemble(load_case("fretting-partial-slip", settings)), 100
    thickness = system.laws.coatings[0]
    *_, marched = march(system, half_cycles)
    touched = marched.wear[-1] > 0
    assert 0.1 < (marched.wear[-1][touched] >= thickness[touched]).mean() < 0.9
    if law == "gross-sliding":
        way = 1e-6 * marched.totals.of("distance")[-1]
        exact = np.where(way < thickness, way, thickness + 4 * (way - thickness))
        np.testing.assert_allclose(marched.wear[-1][touched], exact[touched], rtol=1e-9)
    for tolerance in (0.1, 1e-3):
        *_, last = jump(system, half_cycles, tolerance=tolerance)
        assert np.abs(last.wear[-1] - marched.wear[-1]).max() < 1e-5 * marched.wear[-1].max()


BASE = "coefficient={expression='2e-7 * (1 + p / 200)', unit='1/MPa'}"
UNLIKE = {
    "base by its pressure": f"wear.punch={{{BASE}, coating={{thickness=%s, coefficient='1e-7 1/MPa'}}}}",
    "per area, then by pressure": "wear.punch={coefficient='4e-7 1/MPa', coating={thickness=%s, per_area=4e-5, "
    "touching_from='5 MPa'}}",
    "by pressure, then per area": "wear.punch={per_area=8e-5, touching_from='5 MPa', coating={thickness=%s, "
    "coefficient='1e-7 1/MPa'}}",
}


@pytest.mark.parametrize(
    ("law", "name"), [*(("coulomb", name) for name in UNLIKE), *(("gross-sliding", name) for name in list(UNLIKE)[1:])]
)
def test_a_coating_whose_law_is_another_one(law: str, name: str) -> None:
    """In a march by hand, of pressures and slips of each half-cycle; jumps the same, falling with the tolerance."""
    thickness = (1 if "area" in name else 1.5) * (3e-5 if law == "gross-sliding" else 3e-7)
    cycles, stick = 100, STICK if law == "coulomb" else ("stick={}",)
    wear = UNLIKE[name] % (UNEVEN % thickness)
    system = assemble(load_case("fretting-partial-slip", [*SMALLEST, f"contact.law='{law}'", *stick, wear]))
    thick = system.laws.coatings[0]
    rates = {
        "base by its pressure": (lambda p: 1e-7 * p, lambda p: 2e-7 * (1 + p / 200) * p),
        "per area, then by pressure": (lambda p: 4e-5 * np.minimum(p / 5, 1), lambda p: 4e-7 * p),
        "by pressure, then per area": (lambda p: 1e-7 * p, lambda p: 8e-5 * np.minimum(p / 5, 1)),
    }[name]
    blocks = list(march(system, 2 * cycles))
    exact, depth = blocks[-1].wear[-1], np.zeros_like(thick)
    assert 0.05 < (exact >= thick).mean() < 0.95
    for records in (steps.records for block in blocks for steps in block.steps):
        slip = np.linalg.norm(records.slip, axis=2)
        coating, base = ((rate(records.pressure) * slip).sum(axis=0) for rate in rates)
        left = np.maximum(thick - depth, 0.0)
        beyond = np.divide(coating - left, coating, out=(left == 0).astype(float), where=coating > 0)
        depth = depth + np.minimum(coating, left) + np.maximum(beyond, 0.0) * base
    if law == "coulomb":
        np.testing.assert_allclose(depth, exact, rtol=1e-9, atol=1e-9 * exact.max())
    errors = []
    for tolerance in (0.3, 0.03, 0.003):
        *_, last = jump(system, 2 * cycles, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - exact).max() / exact.max()))
        assert errors[-1] < tolerance
    assert errors[2] <= max(errors[0], 5e-4)  # below it lies the error of the march, which is explicit


def test_the_end_is_that_of_the_base(assembled: Assemble) -> None:
    """Pressures of the steady state, friction of the coating or not; growth rates alike."""
    own = "wear.punch={coefficient=5e-6, coating={thickness=0.05, coefficient=1e-6, friction=0.1}}"
    coated, base = (steady(assembled("example2", *SMALL, more)) for more in (own, "wear.punch.coefficient=5e-6"))
    np.testing.assert_allclose(coated.pressure, base.pressure, rtol=1e-9)
    np.testing.assert_allclose(coated.wear_per_cycle, base.wear_per_cycle, rtol=1e-9)


def test_friction_of_a_coating_holds_until_it_is_through(assembled: Assemble) -> None:
    """Of the first half-cycle it is the coating's, of the last one the base's, in marches and in jumps."""
    own = "wear.punch={coefficient=5e-6, coating={thickness=0.002, coefficient=1e-6, friction=0.1}}"
    system = assembled("example2", *SMALL, own, "contact.friction=0.3")
    for blocks in (march(system, 160, implicit=True), jump(system, 160, tolerance=1e-2)):
        rows = list(blocks)
        for block, row, friction in ((rows[0], 0, 0.1), (rows[-1], -1, 0.3)):
            mu = block.adds.of("work")[row] / block.adds.of("load_path")[row]
            assert mu == pytest.approx(friction, rel=1e-9)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("{thickness=-1, coefficient=1e-9}", "wear.punch.coating.thickness"),
        (
            "{thickness={expression='x - 1', unit='mm'}, coefficient=1e-9}",
            "wear.punch.coating.thickness: expected zero",
        ),
        (
            "{thickness={expression='p', unit='mm'}, coefficient=1e-9}",
            "wear.punch.coating.thickness: .*x, y, z alone, got p",
        ),
        ("{thickness='0.1 m', coefficient=1e-9}", r"wear.punch.coating.thickness: expected less than the body"),
        ("{thickness=1e-3}", "wear.punch.coating: give one of coefficient, archard, energy and per_area, got none"),
        ("{thickness=1e-3, coefficient=1e-9, touching_from=1}", r"coating.touching_from: expected with per_area"),
        ("{thickness=1e-3, per_area=0}", r"wear.punch.coating.per_area: expected"),
        ("{thickness=1e-3, coefficient=0}", "wear.punch.coating.coefficient: expected a finite number above zero"),
        ("{thickness=1e-3, coefficient='1 mm'}", "coating.coefficient"),
        ("{thickness=1e-3, coefficient=1e-9, modulus=0}", r"wear.punch.coating.modulus: expected"),
        ("{thickness=1e-3, archard=1e-3}", "wear.punch.coating.hardness"),
    ],
)
def test_wrong_input_is_told_by_its_key(wrong: str, told: str) -> None:
    """Before anything is computed."""
    with pytest.raises(CaseError, match=told):
        assemble(load_case("example2", [*SMALL, f"wear.punch={{coefficient=1e-8, coating={wrong}}}"]))


def test_the_end_of_partial_slip_is_shared_through_coatings() -> None:
    """Less than the coating: by its coefficient; deeper, what is beyond it by that of the base; the sum is the same."""
    thickness, both = 1e-4, "wear.strip.coefficient='1e-7 1/MPa'"
    above = f"coating={{thickness={thickness}, coefficient='1e-7 1/MPa'}}"
    laws = {
        "coated": f"wear.punch={{coefficient='3e-7 1/MPa', {above}}}",
        "bare": "wear.punch={coefficient='1e-7 1/MPa'}",
    }
    settings = [*SMALLEST, *STICK, "contact.law='coulomb'", both]
    systems = {name: assemble(load_case("fretting-partial-slip", [*settings, law])) for name, law in laws.items()}
    ends = {name: system.law.end(system) for name, system in systems.items()}
    coated, depth = ends["coated"].worn.punch, ends["bare"].depth
    np.testing.assert_allclose(ends["coated"].depth, depth, rtol=1e-9, atol=1e-12)
    # The strip loses what the coating would: t + 3 (A - t) + A = depth.
    exact = np.where(depth < 2 * thickness, depth / 2, depth - (depth + 2 * thickness) / 4)
    assert (depth > 2 * thickness).any()
    np.testing.assert_allclose(coated, exact, rtol=1e-9, atol=1e-12)


UNEVENLY = "thickness={expression='2e-3*(1-x/100)'}"
SOFT = f"wear.%s={{coefficient=4e-7, coating={{{UNEVENLY}, coefficient=1e-7, modulus='20 MPa'}}}}"


def test_a_soft_coating_is_a_layer_as_thick_as_what_is_left(assembled: Assemble) -> None:
    """Of its modulus over what is left, at each place; unworn, and where it is thinner."""
    soft, half_cycles = assembled("example2", *SMALL, SOFT % "punch"), 60
    *_, worn = march(soft, half_cycles, implicit=True)
    x = soft.pair.punch.unworn[:, 0]
    for start, lost in ((None, 0.0), (worn.end, worn.wear[-1])):
        left = 2e-3 * (1 - x / 100) - lost
        assert left.min() > 0
        count = 1 if start is None else half_cycles + 1
        found = list(march(soft, count, start=start))[-1].pressure[-1]
        layered = assembled("example2", *SMALL, "wear.punch.coefficient=4e-7", _layer(soft, found, left, 20))
        exact = list(march(layered, count, start=start))[-1].pressure[-1]
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-9 * exact.max())


def _layer(system: Tribosystem, pressure: Array, left: Array | float, modulus: float) -> str:
    """Return the linear layer that closes as coatings of which so much is left do under these pressures (n,)."""
    x, pressed = system.pair.punch.unworn[:, 0], np.maximum(pressure, 1e-9 * pressure.max())
    secant = pressed / (left * -np.expm1(-pressed / modulus))  # of Hencky's law
    rows = ", ".join(f"[{at!r}, {own!r}]" for at, own in sorted(zip(x.tolist(), secant.tolist(), strict=True)))
    return f"contact.layer={{kind='linear', stiffness={{table=[{rows}], of='x', unit='MPa/mm'}}}}"


def test_soft_coatings_of_both_bodies() -> None:
    """One behind the other as their sum; a strip's goes with its material."""
    settings = [*SMALLEST, "contact.law='gross-sliding'", "stick={}", "motion.positions=3"]

    def both(base: float) -> Tribosystem:
        text = "wear.%s={coefficient='%g 1/MPa', coating={thickness='%g mm', coefficient='%g 1/MPa', modulus='3 GPa'}}"
        bodies = [text % (body, base, thick, base / 5) for body, thick in (("punch", 2e-4), ("strip", 1e-4))]
        return assemble(load_case("fretting-partial-slip", [*settings, *bodies]))

    bare = [f"wear.{body}={{coefficient='1e-16 1/MPa'}}" for body in ("punch", "strip")]
    unworn = both(1e-16)
    found = next(iter(march(unworn, 1))).pressure[0]
    layer = _layer(unworn, found, 3e-4, 3000)
    layered = assemble(load_case("fretting-partial-slip", [*settings, layer, *bare]))
    exact = next(iter(march(layered, 1))).pressure[0]
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-9 * exact.max())
    soft = both(5e-6)
    marched = [list(march(soft, 100, implicit=way))[-1] for way in (True, False)]
    errors = []
    for tolerance in (0.3, 0.03):
        *_, last = jump(soft, 100, tolerance=tolerance)
        errors.append(0.0)
        for name, thickness in zip(("wear", "wear_strip"), soft.laws.coatings, strict=True):
            one, other = (getattr(block, name)[-1] for block in marched)
            assert 0.1 < (one >= thickness).mean() < 0.9
            apart = np.abs(getattr(last, name)[-1] - (one + other) / 2).max() / one.max()
            errors[-1] = max(errors[-1], float(apart))
    assert errors[1] < errors[0] / 5
    assert errors[1] < 3e-3


def test_jumps_through_soft_coatings_as_marches(assembled: Assemble) -> None:
    """Stiffness ends where the coating does: what is left gives way, thinner and thinner."""
    system, half_cycles = assembled("example2", *SMALL, SOFT % "punch"), 240
    marched = [list(march(system, half_cycles, implicit=way))[-1].wear[-1] for way in (True, False)]
    exact, thickness = sum(marched) / 2, system.laws.coatings[0]  # of which the errors of first order go
    assert 0.05 < (exact >= thickness).mean() < 0.5
    hard = assembled("example2", *SMALL, (SOFT % "punch").replace(", modulus='20 MPa'", ""))
    assert np.abs(list(march(hard, half_cycles))[-1].wear[-1] - exact).max() > 0.1 * exact.max()
    errors = []
    for tolerance in (0.3, 0.03):
        *_, last = jump(system, half_cycles, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - exact).max() / exact.max()))
        assert errors[-1] < tolerance / 10
    assert errors[1] < errors[0] / 5


def test_a_soft_coating_under_many_times_its_modulus(assembled: Assemble) -> None:
    """Pressures of 10 MPa and more on 1 MPa: all of it but e^-10 is compressed, and wears through as any other."""
    system = assembled("example2", *SMALL, (SOFT % "punch").replace("20 MPa", "1 MPa"))
    marched = [list(march(system, 240, implicit=way))[-1].wear[-1] for way in (True, False)]
    *_, last = jump(system, 240, tolerance=0.03)
    exact = sum(marched) / 2
    assert np.abs(last.wear[-1] - exact).max() < 3e-3 * exact.max()


def test_a_soft_coating_that_sticks_is_a_layer_and_wears_through() -> None:
    """Where it is strained little it is a linear layer node by node; jumps fall to the march through its end."""
    small = [*SMALLEST, *STICK, "contact.law='coulomb'", "motion.positions=1"]
    coat = "wear.punch={coefficient='%s', coating={thickness='%s', coefficient='%s', modulus='%s'}}"
    thick = coat % ("1e-16 1/MPa", "5 mm", "1e-16 1/MPa", "10000 GPa")
    soft = assemble(load_case("fretting-partial-slip", [*small, thick]))
    found = next(iter(march(soft, 1))).pressure[0]
    bare = assemble(load_case("fretting-partial-slip", [*small, "wear.punch.coefficient='1e-16 1/MPa'"]))
    assert np.abs(next(iter(march(bare, 1))).pressure[0] - found).max() > 0.05 * found.max()
    layer = _layer(soft, found, 5.0, 1e7)
    layered = assemble(load_case("fretting-partial-slip", [*small, "wear.punch.coefficient='1e-16 1/MPa'", layer]))
    exact = next(iter(march(layered, 1))).pressure[0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-8 * exact.max())
    wears = assemble(
        load_case("fretting-partial-slip", [*small, coat % ("4e-5 1/MPa", "0.1 um", "1e-5 1/MPa", "200 MPa")])
    )
    *_, marched = march(wears, 200)
    assert 0.1 < (marched.wear[-1] >= 1e-4).mean() < 0.9
    errors = []
    for tolerance in (0.1, 0.003):
        *_, last = jump(wears, 200, tolerance=tolerance)
        errors.append(float(np.abs(last.wear[-1] - marched.wear[-1]).max() / marched.wear[-1].max()))
    assert errors[0] < 0.03
    assert errors[1] < 5e-3


FINE = (  # a ball on fine half-spaces
    "geometry.parameters.core=0", "geometry.parameters.core_elements=0", "geometry.parameters.across=4",
    "punch.operator='fine'", "strip.operator='fine'", "grid.size=['0.4 mm', '0.4 mm']", "grid.nodes=21",
    "motion.positions=1",
)  # fmt: skip
WITH_HEAT = (*SMALLEST, *WARM, "contact.law='gross-sliding'", "stick={}", "motion.positions=1")


@pytest.mark.parametrize(
    ("base", "settings", "coefficient"),
    [("fretting-partial-slip", WITH_HEAT, 1e-5), ("ball-on-flat", FINE, 1e-7)],
    ids=["heat", "grid"],
)
def test_a_soft_coating_opens_a_gap_of_its_own(base: str, settings: tuple[str, ...], coefficient: float) -> None:
    """Of its compression, which bodies without it that are worn by as much more have, too: unworn, and in its end."""
    text = "wear={punch={coefficient='%g 1/MPa'%s}}"
    coat = f", coating={{thickness='2 um', coefficient='{coefficient:g} 1/MPa', modulus='2 GPa'}}"
    soft, bare = (assemble(load_case(base, [*settings, text % (coefficient, more)])) for more in (coat, ""))
    # As far as a part of it is worn through.
    *_, worn = march_within(soft, RunLimits(400, leave=lambda state: bool((state.worn.punch > 2e-3).sum() > 2)))
    assert 2 < (worn.wear[-1] > 2e-3).sum() < (worn.pressure[-1] > 0).sum()
    none = next(iter(march(bare, 1)))
    for start in (None, worn.end):
        number = 1 if start is None else start.half_cycle + 1
        *_, found = march(soft, number, start=start)
        pressure, lost = found.pressure[-1], np.zeros(len(soft.pair.weights)) if start is None else start.worn.punch
        compressed = np.maximum(2e-3 - lost, 0) * -np.expm1(-pressure / 2000)
        begin = start or beginning(bare)
        *_, exact = march(bare, number, start=replace(begin, worn=replace(begin.worn, punch=lost + compressed)))
        assert np.abs(none.pressure[0] - pressure).max() > 0.05 * pressure.max()
        np.testing.assert_allclose(pressure, exact.pressure[-1], rtol=0, atol=1e-9 * pressure.max())
        if exact.heat is not None and found.heat is not None:
            warm = found.heat.temperature_punch[-1]
            np.testing.assert_allclose(warm, exact.heat.temperature_punch[-1], rtol=0, atol=1e-9 * warm.max())
