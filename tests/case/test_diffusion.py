"""What ready geometries are graded by where the strip's material passes under heat."""

from __future__ import annotations

import pytest

from fenwear import load_case
from fenwear.case.program import stages_of
from fenwear.system import set_up_by

DIFFUSIVITY = 50e3 / 3.6e6 * 1e3  # of the brake pad's disc, mm²/s


@pytest.mark.parametrize("speed", [0.3, 10.0, 100.0, 1e4])
def test_diffusivity_over_speed(speed: float) -> None:
    """Itself, whatever the unit of length; variants of about the same speed keep the mesh of their base."""
    case = load_case("brake-pad", [f"motion.angular_speed={speed}"])
    assert case.diffusion["diffusion_area"] == pytest.approx(DIFFUSIVITY / speed, rel=1e-12)
    faster, far = (load_case("brake-pad", [f"motion.angular_speed={factor * speed}"]) for factor in (1.5, 2.5))
    assert set_up_by(faster.graded_as(case)) == set_up_by(case)
    assert faster.graded_as(case).motion == faster.motion
    assert far.graded_as(case) is far
    assert load_case("example1-heat").diffusion == {}  # to and fro
    assert load_case("ring-on-ring-heat").diffusion == {}  # nothing passes


def test_a_program_has_one_mesh() -> None:
    """That of its fastest step, in all stages and rests."""
    steps = "program.steps=[{angular_speed=[100, 0], time=4}, {angular_speed=0, time=10}, {angular_speed=1, time=7}]"
    case = load_case("brake-pad", ["unset=run.half_cycles", steps])
    alone = load_case("brake-pad", ["motion.angular_speed=100"])
    stages = stages_of(case)
    assert {stage.case.diffusion["diffusion_area"] for stage in stages} == {alone.diffusion["diffusion_area"]}
    assert all(set_up_by(stage.case) == set_up_by(case) for stage in stages)
