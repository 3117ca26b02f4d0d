"""Derivatives against differences of states solved anew, and against exact ones."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import Case, CaseError, assemble, load_case
from fenwear.steps import follow
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.studies import Model, evaluate, parse_quantity, sensitivity
from fenwear.studies.model import Snapshot, edge_moved
from fenwear.studies.quantities import Path

TWO_WORN = (
    "contact.friction",
    "punch.loads.0.force.1",
    "wear.punch.coefficient",
    "wear.strip.coefficient",
    "motion.track",
)
HOT = ("contact.friction", "punch.loads.0.force.1", "heat.partition", "heat.conductance", "motion.amplitude")
STRIP = ('wear.strip.coefficient="5e-6 1/MPa"', 'motion.track="500 mm"')


def central(case: Case, text: str, key: str, value: float, relative: float = 1e-4) -> float:
    """Return a plain central difference of the quantity."""
    model, quantity, h = Model(case), parse_quantity(text), relative * abs(value)
    ends = [evaluate(model, quantity, {key: value + sign * h})[0] for sign in (-1, 1)]
    return (ends[1] - ends[0]) / (2 * h)


@pytest.mark.parametrize(
    ("name", "settings", "keys", "quantity"),
    [
        ("monotonic-lz20", STRIP, TWO_WORN, "steady pressure at 12 mm"),
        ("example1-heat", (), HOT, "steady temperature"),
    ],
)
def test_derivatives_of_steady_states(
    small: Callable[..., Case], name: str, settings: tuple[str, ...], keys: tuple[str, ...], quantity: str
) -> None:
    """Two worn bodies, and heat: within 1e-5 of central differences with other steps, for five keys."""
    case = small(name, *settings)
    found = sensitivity(case, [quantity], keys, spread=0, comm=MPI.COMM_SELF)[0]
    influential = 0
    for row in found.derivatives:
        assert row.method == "differences"
        expected = central(case, quantity, row.key, row.key_value)
        size = abs(found.value / row.key_value)  # derivatives of no influence are small against this
        assert row.derivative == pytest.approx(expected, rel=1e-5, abs=1e-7 * size)
        assert row.error <= 1e-5 * max(abs(row.derivative), 1e-2 * size)
        influential += abs(row.derivative) > 1e-3 * size
    assert influential >= 2


def test_life_to_a_volume_has_exact_derivatives(small: Callable[..., Case]) -> None:
    """N = V / (beta~ F 4 u0): elasticities of -1, and none to friction; by differences of runs."""
    keys = ("wear.punch.coefficient", "punch.loads.0.force.1", "motion.amplitude", "contact.friction")
    found = sensitivity(small("example2"), ["cycles until volume 3 mm^3"], keys, spread=0.1)[0]
    for row, expected in zip(found.derivatives, (-1.0, -1.0, -1.0, 0.0), strict=True):
        assert row.method == "differences"
        assert row.elasticity == pytest.approx(expected, abs=1e-7)
        assert row.error <= 1e-4 * abs(found.value / row.key_value)
        if expected:
            assert row.low == pytest.approx(found.value / 0.9, rel=1e-9)
            assert row.high == pytest.approx(found.value / 1.1, rel=1e-9)


def test_the_depth_of_a_run_scales_with_load_and_modulus(small: Callable[..., Case]) -> None:
    """Without heat loads and moduli times a factor leave the shape: depth(E, F) = F times a function of F / E ...

    ... and of beta~ E, so that the elasticities to load, coefficient and both moduli obey e_F = 1, e_beta = 1 + e_E.
    """
    case = small("example2")
    keys = ("punch.loads.0.force.1", "wear.punch.coefficient", "materials.steel.young", "materials.composite.young")
    load, beta, steel, composite = (
        row.elasticity for row in sensitivity(case, ["depth after 30 cycles"], keys, spread=0)[0].derivatives
    )
    assert load == pytest.approx(1.0, rel=1e-7)
    assert beta < 0.999
    assert beta == pytest.approx(1.0 + steel + composite, rel=1e-6)


def test_two_worn_bodies_that_slide_to_and_fro() -> None:
    """No steady state: the volume of each body follows its own coefficient alone; depths obey a similarity.

    Loads and moduli times a factor, coefficients over it, leave all displacements: e_k1 + e_k2 = e_E + e_F, which the
    nodes that are in contact obey as such.
    """
    case = load_case("fretting", ["geometry.parameters.elements_along_contact=16", "motion.positions=3"])
    keys = ("wear.punch.coefficient", "wear.strip.coefficient", "materials.steel.young", "punch.loads.0.force.1")
    wanted = ["volume of strip after 60 cycles", "depth of strip after 60 cycles"]
    volume, depth = sensitivity(case, wanted, keys, spread=0, method="differences")
    assert [row.elasticity for row in volume.derivatives] == pytest.approx([0.0, 1.0, 0.0, 1.0], abs=1e-7)
    punch, strip, modulus, load = (row.elasticity for row in depth.derivatives)
    assert abs(modulus) > 0.01
    assert punch + strip == pytest.approx(modulus + load, rel=1e-5)


@pytest.mark.parametrize("elements", [20, 40])
def test_a_growing_scar_keeps_its_exponents(elements: int) -> None:
    """Block on ring: widths, pressure and depth go by k^(1/3), k^(-1/3), k^(2/3); each within its error, which shrinks.

    A scar of the width 2 a on a ring is a^2 / 2 R deep, and its area goes by a^3; p = F / 2 a. The bodies give way by
    1e-3 of that depth.
    """
    exponents = {"scar_width": 1 / 3, "contact_width": 1 / 3, "pressure": -1 / 3, "depth": 2 / 3}
    case = load_case("block-on-ring", [f"geometry.parameters.elements_along_contact={elements}"])
    for found in sensitivity(case, list(exponents), ["wear.punch.coefficient"], spread=0, comm=MPI.COMM_SELF):
        (row,) = found.derivatives
        error = row.error * abs(row.key_value / found.value)
        assert row.method == "window"
        assert row.elasticity == pytest.approx(exponents[found.quantity], abs=error + 2e-3)
        assert error < 4 / elements


def test_a_key_at_the_end_of_its_range(small: Callable[..., Case]) -> None:
    """A partition of 1 has values on one side only: the derivative is that to this side."""
    case = small("example1-heat", "heat.partition=1.0")
    row = sensitivity(case, ["steady temperature"], ["heat.partition"], spread=0)[0].derivatives[0]
    model, quantity = Model(case), parse_quantity("steady temperature")
    values = [evaluate(model, quantity, {"heat.partition": 1 - k * 1e-3})[0] for k in (0, 1, 2)]
    assert row.derivative == pytest.approx((3 * values[0] - 4 * values[1] + values[2]) / 2e-3, rel=1e-4)


@pytest.mark.parametrize(
    ("quantity", "key", "expected"),
    [
        ("steady pressure", "contact.fricton", "did you mean contact.friction"),
        ("steady pressure", "run.half_cycles", "no such key"),
        ("steady temperature", "contact.friction", "needs the table heat"),
        ("steady lambda_M", "contact.friction", "rigid motions are lambda_F"),
        ("cycles until depth 1 mm", "wear.punch.coefficient", "never reached"),
    ],
)
def test_what_makes_no_sense_is_refused(small: Callable[..., Case], quantity: str, key: str, expected: str) -> None:
    case = small("example2") if "depth" not in quantity else small("example2", "wear.punch.coefficient=0.0")
    with pytest.raises(CaseError, match=expected):
        sensitivity(case, [quantity], [key], spread=0)


@pytest.mark.parametrize(
    ("law", "keys"),
    [
        (
            "coefficient={regions={punch_lower=2e-8, punch_upper=1e-8}, unit='1/MPa'}",
            ("wear.punch.coefficient.regions.punch_lower", "contact.friction"),
        ),
        ("pressure_cap='60 MPa'", ("contact.friction", "wear.punch.pressure_cap")),
    ],
)
def test_laws_that_vary(small: Callable[..., Case], law: str, keys: tuple[str, ...]) -> None:
    """Region and cap: within 1e-3 of central differences with other steps."""
    case = small("example1", f"wear.punch.{law}")
    found = sensitivity(case, ["steady pressure at 12 mm"], keys, spread=0, comm=MPI.COMM_SELF)[0]
    for row in found.derivatives:
        expected = central(case, "steady pressure at 12 mm", row.key, row.key_value)
        assert row.derivative == pytest.approx(expected, rel=1e-3, abs=1e-5 * abs(found.value / row.key_value))


def test_threshold(small: Callable[..., Case]) -> None:
    """Where all presses beyond it V = k s (F - p_0 A), so dV/dp_0 = -k s A; in the end, too."""
    k, p0, cycles = 1e-7, 0.5, 20
    case = small("example2", "contact.friction=0.05", f"wear.punch={{coefficient={k}, pressure_threshold={p0}}}")
    keys = ["wear.punch.pressure_threshold", "wear.punch.coefficient"]
    found = sensitivity(case, [f"volume after {cycles} cycles"], keys, spread=0, comm=MPI.COMM_SELF)[0]
    slid, area = cycles * 6.0, 600.0
    assert found.value == pytest.approx(k * slid * (1e4 - p0 * area), rel=1e-9)
    by_threshold, by_coefficient = found.derivatives
    assert by_threshold.derivative == pytest.approx(-k * slid * area, rel=1e-6)
    assert by_coefficient.derivative == pytest.approx(found.value / k, rel=1e-6)
    (steady,) = sensitivity(case, ["steady volume_rate"], keys[:1], spread=0, comm=MPI.COMM_SELF)
    assert steady.value == pytest.approx(found.value / cycles, rel=1e-6)
    assert steady.derivatives[0].derivative == pytest.approx(-k * 6.0 * area, rel=1e-6)


@pytest.mark.parametrize("of", ["depth", "s"])
def test_laws_that_pass_are_refused(small: Callable[..., Case], of: str) -> None:
    """What changes with depth or distance is not followed here, and says so."""
    law = f"wear.punch.coefficient={{table=[[0, 1e-8], [1, 2e-8]], of='{of}', unit='1/MPa'}}"
    with pytest.raises(CaseError, match=r"wear.punch.coefficient:"):
        sensitivity(small("example1", law), ["steady lambda_F"], ["contact.friction"], spread=0, comm=MPI.COMM_SELF)


@pytest.mark.slow
def test_properties_that_are_taken_anew(small: Callable[..., Case]) -> None:
    """A run in which properties follow the temperature is that of `follow`; runs beside it take them anew when it does.

    Differences of small steps agree, where thresholds that each run passes by itself would leave steps in between.
    """
    conducting = "materials.composite.conductivity={expression='5 + 0.2 * T', unit='W/(m K)'}"
    case = small("example1-heat", conducting, "run.jump_tolerance=0.03", "heat.property_tolerance=0.2")
    cycles, quantity = 200, parse_quantity("temperature after 200 cycles")

    system = assemble(case, MPI.COMM_SELF, heat="reduced")
    *_, last = follow(system, partial(jump_within, tolerance=0.03), RunLimits(2 * cycles))
    model = Model(case)
    run = list(model.run({}, cycles))
    assert sum(len(one.renewals) for one in run) > 1
    assert run[-1].end.wear[-1] == pytest.approx(last.end.worn.punch, rel=1e-12)
    value, path = evaluate(model, quantity, {})
    slopes = []
    for h in (1e-4, 1e-5):
        friction = case.contact.friction
        assert isinstance(friction, float)
        ends = [evaluate(model, quantity, {"contact.friction": friction * (1 + s * h)}, path=path)[0] for s in (-1, 1)]
        slopes.append((ends[1] - ends[0]) / (2 * h * value))
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-5)
    assert 0.5 < slopes[0] < 1.0  # a warmer surface conducts better


def test_run_in_has_derivatives(small: Callable[..., Case]) -> None:
    """Cycles of the run-in are interpolated: loads and moduli times a factor leave the shapes, and wear goes by it.

    So the elasticities to all of these add up to that to the coefficient, which is -1 but for the jumps.
    """
    keys = ("wear.punch.coefficient", "punch.loads.0.force.1", "materials.steel.young", "materials.composite.young")
    (found,) = sensitivity(small("example1"), ["run-in cycles"], keys, spread=0)
    coefficient, *others = (row.elasticity for row in found.derivatives)
    assert coefficient == pytest.approx(-1, abs=0.03)
    assert coefficient == pytest.approx(sum(others), rel=1e-5)
    assert others[-1] == pytest.approx(-0.45, abs=0.02)  # by runs of other moduli


def test_a_jagged_quantity_is_held_against_a_wide_step(
    small: Callable[..., Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of whole numbers small steps give exactly nothing; the change over a tenth of the key tells otherwise."""
    monkeypatch.setattr(sys.modules["fenwear.studies.sensitivity"], "evaluate", lambda model, quantity, values, **_: (
        float(np.floor(100 * values.get("contact.friction", 0.25) + 0.5)), Path()))  # fmt: skip
    (row,) = sensitivity(small("example1"), ["run-in cycles"], ["contact.friction"], spread=0)[0].derivatives
    assert row.derivative == pytest.approx(100, rel=0.2)
    assert row.error >= abs(row.derivative) / 2
    assert row.error_of == "step of the difference"


def test_an_edge_that_comes_back_has_moved() -> None:
    """A contact that narrows and closes again is as rough as one that grows."""

    def run(*closed: list[int]) -> list[Snapshot]:
        return [cast("Snapshot", SimpleNamespace(end=None, phase_pressure=np.array([c]))) for c in closed]

    assert edge_moved(run([1, 1, 1], [0, 1, 1], [1, 1, 1]))
    assert edge_moved(run([0, 1], [0, 1], [1, 1]))
    assert not edge_moved(run([0, 1, 1], [0, 1, 1]))
