"""The numerical uncertainty that is told of a run, against its true errors."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fenwear import Block, Tribosystem, evolve, march, steady
from fenwear.checks import (
    Quantity,
    Value,
    uncertainty,
    uncertainty_of_steady,
    uncertainty_table,
    values_of,
)
from fenwear.checks.uncertain_values import values_of_steady
from fenwear.checks.uncertainty_sources import by_short_jumps, of_mesh
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.system import with_reduced_heat

Assembled = Callable[..., Tribosystem]
FEW = "geometry.parameters.elements_along_contact=8"
RINGS = ("geometry.parameters.across=4", "run.half_cycles=20000")
DEPTH, VOLUME, PRESSURE = (
    Quantity("largest_depth", "punch"),
    Quantity("worn_volume", "punch"),
    Quantity("largest_pressure", "0"),
)


def end_of(system: Tribosystem) -> Block:
    """Return the last half-cycles of the run of a system."""
    *_, last = evolve(system)
    return last


def test_rings_end_within_what_is_told(assembled: Assembled) -> None:
    """Turning rings wear to p = F / (2 pi (r2 - r1) r): the error at the inner edge is told."""
    system = assembled("ring-on-ring", *RINGS, "geometry.degree=2")
    found = uncertainty(system.case, end_of(system))
    exact = 2000 / (2 * np.pi * 10 * 20)
    error, told = abs(found.values[PRESSURE].number - exact), found.total[PRESSURE]
    assert error < told < 0.01 * exact


@pytest.mark.mpi
def test_true_error_of_a_flat_punch_is_told(assembled: Assembled) -> None:
    """Against four times as many elements, of depth and pressure, at the edges where they are largest."""
    settings = ("run.half_cycles=40", "geometry.degree=3")
    system = assembled("example1", *settings, FEW)
    found = uncertainty(system.case, end_of(system))
    exact = values_of(end_of(assembled("example1", *settings, FEW.replace("8", "32"))))
    for quantity in (DEPTH, PRESSURE, Quantity("largest_pressure", "1")):
        error = abs(found.values[quantity].number - exact[quantity].number)
        assert error < found.total[quantity] < 10 * error
    assert found.values[DEPTH].at_edge


def test_worn_volume_of_flat_contacts_is_certain(assembled: Assembled) -> None:
    """With a = b = 1 equilibrium gives it on any mesh: that is what the comparison finds, while depths differ."""
    system = assembled("example1", "run.half_cycles=40", "geometry.degree=3", FEW)
    found = uncertainty(system.case, end_of(system))
    volume = found.values[VOLUME].number
    assert volume == pytest.approx(1.25e-8 * np.pi * 10000 * 40 * 3.0, rel=1e-9)
    assert found.total[VOLUME] < 1e-9 * volume
    assert found.total[DEPTH] > 1e-3 * found.values[DEPTH].number


def test_uncertainty_falls_with_the_elements(assembled: Assembled) -> None:
    """Smaller elements leave less."""
    told = []
    for elements in (8, 16, 32):
        settings = ("run.half_cycles=2000", 'run.integration="jump"', "geometry.degree=2")
        system = assembled("example2", *settings, FEW.replace("8", str(elements)))
        told.append(uncertainty(system.case, end_of(system)).total[DEPTH])
    assert told[0] > 1.3 * told[1] > 1.69 * told[2]


def test_half_cycles_as_steps_are_told(assembled: Assembled) -> None:
    """Explicit and implicit half-cycles lie on either side of small steps, each as far as is told."""
    fast = ('wear.punch.coefficient="1e-6 1/MPa"', "run.half_cycles=20", "geometry.degree=2", FEW)
    one = end_of(system := assembled("example2", *fast, 'run.integration="implicit"'))
    small = ('wear.punch.coefficient="1e-7 1/MPa"', "run.half_cycles=200", *fast[2:])
    exact = values_of(end_of(assembled("example2", *small, 'run.integration="implicit"')))[DEPTH].number
    error = abs(values_of(one)[DEPTH].number - exact)
    steps = uncertainty(system.case, one).contributions["wear_steps"][DEPTH]
    assert 0.5 * error < steps < 5 * error


def test_temperatures_of_jumps_are_told(assembled: Assembled) -> None:
    """What separates them from those of a march, at strokes of 3 and 10 mm: never by chance next to nothing."""
    coarse = ("geometry.degree=2", "geometry.parameters.elements_along_contact=4", "geometry.parameters.overlap=20")
    for amplitude in (3, 10):
        of_run = ("contact.friction=0.05", f"motion.amplitude={amplitude}", "run.half_cycles=40")
        system = assembled("example2-heat", *coarse, *of_run, "run.integration=jump", "run.jump_tolerance=0.01")
        *_, last = evolve(system)
        told, warmest = uncertainty(system.case, last), Quantity("largest_temperature")
        *_, marched = march(system, 40, implicit=True)
        found = told.values[warmest].number
        true = abs(values_of(marched)[warmest].number - found)
        assert true < told.contributions["wear_steps"][warmest] < 0.06 * found


@pytest.mark.parametrize("integration", ["implicit", "jump"])
def test_half_cycles_of_the_warm_up_are_told(assembled: Assembled, integration: str) -> None:
    """From cold, heat moves the pressure within a half-cycle: 9 % in 3, against half-cycles 16 times as short."""
    duration, few = 2 * np.pi / 10, ("geometry.parameters.across=4", f"run.integration={integration}")

    def ended(parts: int) -> Block:
        own = (f"run.half_cycles={3 * parts}", f"motion.duration='{duration / parts} s'")
        return end_of(assembled("ring-on-ring-heat", *few, *own))

    system_end = ended(1)
    found = uncertainty(system_end.system.case, system_end)
    exact = values_of(ended(16))
    error = abs(found.values[DEPTH].number - exact[DEPTH].number)
    assert 0.05 * exact[DEPTH].number < error < found.total[DEPTH] < 3 * error


def test_linear_elements_have_nothing_below(assembled: Assembled) -> None:
    """What cannot be compared is said, with the key that helps; all else is told."""
    system = assembled("example2", "run.half_cycles=4", "geometry.degree=1", FEW)
    found = uncertainty(system.case, end_of(system))
    assert "geometry.degree" in found.untold["mesh"]
    assert "wear_steps" in found.contributions
    table = uncertainty_table(system, found)
    assert "punch" not in table  # a sum without the mesh's part would say nothing
    assert table["contributions"]["wear_steps"]["punch"]["largest_depth_mm"] > 0


JUMPED = {
    "plane": ("example1", "run.half_cycles=2000", "geometry.degree=3", FEW),
    "heat": ("ring-on-ring-heat", "run.half_cycles=200", "geometry.parameters.across=4"),
    "stick": (
        "fretting-partial-slip",
        "run.half_cycles=100",
        'wear.punch.coefficient="2e-7 1/MPa"',
        'wear.strip.coefficient="2e-7 1/MPa"',
        FEW.replace("8", "16"),
    ),
}


@pytest.mark.mpi("stick", "heat")
@pytest.mark.parametrize("kind", JUMPED)
def test_what_jumps_leave_is_found_beside_them(assembled: Assembled, kind: str) -> None:
    """Against jumps of a hundredth of the tolerance, node by node; the jumps themselves are as without."""
    base, *settings = JUMPED[kind]
    system = with_reduced_heat(assembled(base, *settings))
    half_cycles = system.case.run.half_cycles

    def end(tolerance: float, *, finer: bool = False) -> Block:
        *_, last = jump_within(system, RunLimits(half_cycles), tolerance=tolerance, finer=finer)
        return last

    alone, exact, last = end(3e-3), end(3e-5), end(3e-3, finer=True)
    np.testing.assert_array_equal(last.end.worn.punch, alone.end.worn.punch)
    short = by_short_jumps(last)
    assert short is not last
    weights = system.pair.weights
    true, told, left = (
        weights @ np.abs(one.wear[-1] - other.wear[-1]) for one, other in ((last, exact), (last, short), (short, exact))
    )
    assert left < true
    assert true / 2 < told < 2 * true


def test_equal_largest_values_of_other_fields_are_apart() -> None:
    """Two largest values may agree by chance where their fields do not."""
    x = np.linspace(0, 1, 5)[:, None]
    fine = Value(1.0, False, x, np.array([0, 0.5, 1.0, 0.5, 0]), np.full(5, 0.2))
    coarse = Value(1.0, False, x[::2], np.array([0.4, 1.0, 0.4]), np.full(3, 0.4))
    other = Value(1.0, False, x[::2], np.array([0.0, 0.9, 1.0]), np.full(3, 0.4))
    assert fine.apart(coarse) == 0.0  # they differ only where there is nothing
    assert fine.apart(other) == pytest.approx(0.1)
    assert of_mesh({DEPTH: fine}, {DEPTH: other}, 2)[DEPTH] == pytest.approx(1.25 * 0.1 / (2**1.5 - 1))
    at_edge = replace(fine, at_edge=True)
    assert of_mesh({DEPTH: at_edge}, {DEPTH: other}, 2)[DEPTH] == pytest.approx(1.25 * 0.1)
    assert of_mesh({VOLUME: Value(1.0)}, {VOLUME: Value(0.7)}, 2)[VOLUME] == pytest.approx(1.25 * 0.3 / (2**2 - 1))


def test_steady_state_within_what_is_told(assembled: Assembled) -> None:
    """Of rings p = F / (2 pi (r2 - r1) r); a finer mesh changes a tilting punch's by less than is told."""
    found = uncertainty_of_steady(steady(assembled("ring-on-ring", *RINGS, "geometry.degree=2")))
    exact = 2000 / (2 * np.pi * 10 * 20)
    assert abs(found.values[PRESSURE].number - exact) <= found.total[PRESSURE] < 0.1 * exact
    one, other = (
        steady(assembled("example1", "geometry.degree=3", FEW.replace("8", elements))) for elements in ("8", "32")
    )
    found, finer = uncertainty_of_steady(one), values_of_steady(other)
    for quantity in (PRESSURE, Quantity("largest_pressure", "1")):
        assert abs(found.values[quantity].number - finer[quantity].number) < found.total[quantity]


def test_run_tells_it(fenwear: Callable[..., Any], tmp_path: Any) -> None:
    """On the first screen, in summary.json, on the sheet and in the report; not where the case does not want it."""
    short = ("--set", "run.half_cycles=4", "--set", FEW, "--set", "output.fields_at=[]")
    done = fenwear("run", "example1", *short, "-o", tmp_path / "a")
    assert done.returncode == 0
    screen = done.stdout.splitlines()
    assert len(screen) <= 10
    rows = {line.split("  ")[1]: line for line in screen if line.startswith("  ")}
    assert re.search(r" ± \S+ µm$", rows["largest worn depth, punch"])
    assert rows["worn volume, punch"].endswith("mm³ (uncertainty below 0.1 %)")
    assert len(rows) == 4  # and a temperature with heat
    assert screen[-1] == f"Report: {tmp_path}/a/report.html. All numbers: fenwear sheet {tmp_path}/a"
    sheet = fenwear("sheet", tmp_path / "a").stdout
    assert "... numerical uncertainty (µm)" in sheet
    assert fenwear("sheet", tmp_path).returncode == 2
    told = json.loads((tmp_path / "a" / "summary.json").read_text())["uncertainty"]
    assert told["punch"]["largest_depth_mm"] > 0
    assert (
        told["rightward"]["largest_pressure_MPa"] > told["contributions"]["solver"]["rightward"]["largest_pressure_MPa"]
    )
    assert "Numerical uncertainty" in (tmp_path / "a" / "report.html").read_text()
    without = ("--set", "output.uncertainty=false", "--set", "output.report=false")
    fenwear("run", "example1", *short, *without, "-o", tmp_path / "b")
    assert "uncertainty" not in json.loads((tmp_path / "b" / "summary.json").read_text())
