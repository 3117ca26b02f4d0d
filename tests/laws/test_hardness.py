"""Plastic flow beyond a hardness: free of units of length, jumps as marches, half-cycles in which little flows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from combinations import SMALL, STICK

from fenwear import assemble, load_case, march
from fenwear.common.errors import CaseError
from fenwear.laws.layers import PLASTIC, Layers
from fenwear.steps import Block, evolve

LENGTHS = {
    "punch_width": 60, "punch_height": 100, "layer_height": 20, "pin_height_1": 40, "pin_height_2": 80,
    "strip_length": 1140, "strip_height": 100, "overlap": 6,
}  # fmt: skip


def settings(hardness: float, count: int, scale: float = 1.0) -> list[str]:
    """Return settings of the paper's second example with a hardness, MPa, all lengths times a factor."""
    geometry = ", ".join(f"{key}={value * scale!r}" for key, value in LENGTHS.items())
    return [
        f"geometry.parameters={{elements_along_contact=8, pins_on_left_side=1, {geometry}}}", "geometry.degree=2",
        f"model.thickness={10 * scale}", f"punch.loads=[{{on='punch_load', force=[0, {-1e4 * scale**2}]}}]",
        f"contact.hardness='{hardness} MPa'", f"run.half_cycles={count}",
    ]  # fmt: skip


def last(name: str, given: list[str], how: str, tolerance: float = 3e-3) -> Block:
    return list(evolve(assemble(load_case(name, given)), integration=how, tolerance=tolerance))[-1]


def volume(block: Block) -> float:
    state = block.end.worn.between[block.system.layers.row(PLASTIC)]
    return float(block.system.pair.weights @ state)


@pytest.mark.parametrize("grid", ["", "grid.nodes=33"])
def test_the_unit_of_length_changes_nothing(grid: str) -> None:
    """Depths are proportional to lengths, pressures equal, in jumps and on grids, where surfaces flow by iterations."""
    found = []
    for scale in (1.0, 1e-3, 1e3):
        amplitude = f"motion.amplitude={1.5 * scale}"
        block = last("example2", [*settings(40, 20, scale), amplitude, *([grid] if grid else [])], "jump")
        worn = block.end.worn
        found.append((block.pressure[-1], worn.punch / scale, worn.between[block.system.layers.row(PLASTIC)] / scale))
    for other in found[1:]:
        for here, there in zip(found[0], other, strict=True):
            assert np.abs(here - there).max() < 1e-7 * np.abs(here).max()


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("example2", []),
        ("example2", ["grid.nodes=33"]),
        ("example2-heat", ["heat.steps=4"]),
        ("example2-heat", ["heat.steps=4", "program.steps=[{cycles=3}, {cycles=7, load_factor=1.2}]"]),
    ],
    ids=["plain", "grid", "heat", "step of load"],
)
def test_jumps_flow_as_marches(name: str, more: list[str]) -> None:
    """What flows depends on the order of phases, on what they heat and on when loads rise."""
    given = [*settings(40, 20), *more]
    marched = last(name, given, "explicit")
    for how in ("implicit", "jump"):
        assert volume(last(name, given, how)) == pytest.approx(volume(marched), rel=2e-3)


ROUGH = """
[geometry]
file = "solid_blocks.geo"
degree = 1
[geometry.parameters]
across_x = 8
across_y = 8
punch_layers = 2
strip_layers = 2
[model]
kind = "solid"
[materials.metal]
young = "100 GPa"
poisson = 0.3
[punch]
regions = {punch_body = "metal"}
operator = "half-space"
supports = [{on = "punch_far", fix = ["x", "y"]}]
no_turning_about = ["x", "y"]
loads = [{on = "punch_far", force = ["0 N", "0 N", "-2000 N"]}]
topography = {rms = "2.5 um", hurst = 0.8, longest = "0.5 mm", shortest = "0.2 mm", seed = 1}
[strip]
regions = {strip_body = "metal"}
operator = "half-space"
supports = [{on = "strip_far", fix = ["x", "y", "z"]}]
[contact]
friction = 0
hardness = "5.5 GPa"
[grid]
nodes = 21
[wear.punch]
coefficient = "1e-12 1/MPa"
[motion]
kind = "reciprocating"
amplitude = "1 um"
period = "1 s"
along = [1, 0, 0]
positions = 1
[run]
half_cycles = 3
"""


def test_half_cycles_in_which_little_flows(tmp_path: Path) -> None:
    """A rough square at 0.4 of its hardness flows once; nearly nothing flows in the half-cycles after that."""
    file = tmp_path / "rough.toml"
    file.write_text(ROUGH)
    (block,) = march(assemble(load_case(str(file))), 3)
    flown = block.between[:, block.system.layers.row(PLASTIC)] @ block.system.pair.weights
    assert flown[0] > 0
    assert flown == pytest.approx(flown[0], rel=1e-5)
    assert block.pressure.max() == pytest.approx(5500, rel=1e-7)


def test_a_step_of_a_program_is_no_heavier_than_the_hardness_carries() -> None:
    """Twice 16.7 MPa in the mean on a hardness of 25 MPa: rejected by key, as without a program."""
    settings = ("geometry.parameters.elements_along_contact=4", "geometry.degree=1", "contact.hardness='25 MPa'")
    for step in ("load_factor=[1, 2]", "load=['10 kN', '20 kN']"):
        case = load_case("example2", [*settings, f"program={{steps=[{{cycles=1, {step}}}]}}", "run.half_cycles=2"])
        with pytest.raises(CaseError, match=r"contact.hardness.*33\.33"):
            list(evolve(assemble(case)))


def test_a_curved_layer_with_stick() -> None:
    """Beside a rough layer a hardness that nothing reaches changes nothing; one that is reached bounds the pressure."""
    rough = "contact.layer={kind='rough', roughness='0.54 um', asperity_radius='54 um', asperity_density='1700 1/mm^2'}"
    given = [*SMALL, *STICK, "contact.law='coulomb'", rough, "run.half_cycles=2"]
    free, far, near = (
        last("fretting-partial-slip", [*given, *more], "explicit")
        for more in ((), ("contact.hardness='2 GPa'",), ("contact.hardness='500 MPa'",))
    )
    largest = free.pressure.max()
    assert 600 < largest < 1000
    np.testing.assert_allclose(far.pressure, free.pressure, rtol=0, atol=1e-9 * largest)
    assert near.pressure.max() == pytest.approx(500, rel=1e-12)
    assert max(block.equilibrium_error.max() for block in (far, near)) < 1e-12


def test_a_pressure_that_rounding_leaves_below_the_hardness_flows() -> None:
    """The gap that is left where the pressure is the hardness: 1.5e-4 of a plastic depth was missing, by rounding."""
    layers, hardness = Layers(3, hardness=40.0), 40.0
    flowed = layers.flowed(hardness * np.array([1 - 2**-52, 0.99, 1.0]), np.array([-1e-6, -1e-6, 1e-6]))
    np.testing.assert_array_equal(flowed, [1e-6, 0, 0])
