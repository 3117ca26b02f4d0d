"""Friction that depends on the temperature: a pin through which heat goes straight, with exact states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fenwear import Case, assemble, jump, load_case, make_case, march, steady
from fenwear.common.errors import CaseError


def warming_pin(**contact: Any) -> Case:
    """Return a poor conductor on a steel plate, insulated but for its far end: heat goes straight through it."""
    return make_case(
        {
            "geometry": {
                "file": "blocks.geo",
                "degree": 2,
                "parameters": {"width": 4, "punch_height": 10, "strip_height": 2, "margin": 1, "across": 8},
            },
            "model": {"plane": "strain", "thickness": 10},
            "materials": {
                "ptfe": {"young": 1e3, "poisson": 0, "conductivity": 0.5, "heat_capacity": 1e9, "density": 2e-9,
                         "expansion": 0},
                "steel": {"young": 2.1e5, "poisson": 0, "conductivity": 46, "heat_capacity": 4.6e8, "density": 7.8e-9,
                          "expansion": 0},
            },
            "punch": {
                "regions": {"punch_body": "ptfe"},
                "supports": [{"on": "punch_far", "fix": ["x"]}],
                "no_turning_about": ["y"],
                "loads": [{"on": "punch_far", "force": [0, -40]}],
                "temperatures": [{"on": "punch_far", "temperature": "20 degC"}],
                "insulated": ["punch_sides"],
            },
            "strip": {
                "regions": {"strip_body": "steel"},
                "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
                "temperatures": [{"on": "strip_far", "temperature": "20 degC"}],
            },
            "contact": {"friction": {"expression": "0.2 / (1 + 0.02 * (T - 293.15))"}, **contact},
            "wear": {"punch": {"coefficient": 1e-8}},
            "heat": {"partition": 1, "ambient": "20 degC", "initial": "20 degC", "convection": 0},
            "motion": {"kind": "one-way", "direction": "rightward", "speed": 100, "duration": 10},
            "run": {"half_cycles": 20},
        }
    )  # fmt: skip


def test_a_stage_whose_cycle_begins_colder_than_anything() -> None:
    """Friction that falls with T, as 1 / (1 + 0.02 (T - T_a)): below T_a - 50 K there is none.

    The first stages of a jump look at temperatures before its begin, beyond the pole of the law: a cycle is marched.
    """
    system = assemble(warming_pin())
    *_, jumped = jump(system, 20, tolerance=1e-3)
    *_, marched = march(system, 20, implicit=True)
    assert jumped.heat is not None
    assert marched.heat is not None
    rise = marched.heat.temperature_punch[-1] - 293.15
    np.testing.assert_allclose(jumped.heat.temperature_punch[-1] - 293.15, rise, rtol=2e-3)
    np.testing.assert_allclose(jumped.wear[-1], marched.wear[-1], rtol=2e-3)


@pytest.mark.parametrize(("of", "share"), [("mean", 0.5), ("punch", 1.0), ("hotter", 1.0), ("strip", 0.0)])
def test_friction_is_of_the_chosen_temperature(of: str, share: float) -> None:
    """The rise dT of the punch's surface carries mu p v through it: dT = L mu p v / k, mu = 0.2 / (1 + 0.02 share dT).

    The strip keeps the temperature of the surroundings: 118.6 K of the punch's or the hotter one, 156.2 K of the mean.
    """
    state = steady(assemble(warming_pin(friction_temperature=of)))
    assert state.heat is not None
    exact = 400.0 if share == 0 else (np.sqrt(1 + 0.08 * share * 400) - 1) / (0.04 * share)
    np.testing.assert_allclose(state.heat.punch[-1] - 293.15, exact, rtol=1e-6)
    with pytest.raises(CaseError, match=r"contact\.friction_temperature:"):
        warming_pin(friction_temperature="colder")


def test_a_moving_band_whose_first_stages_are_colder_than_its_surroundings() -> None:
    """Material enters faster than heat spreads: a stage before the begin of a jump would let cold material leave.

    The jumps come to the march, and the way to the steady state is found.
    """
    metal = {"conductivity": 50, "density": 7.8e-9, "heat_capacity": 4.487e8}
    sizes = {"punch_width": 20, "punch_height": 40, "layer_height": 10, "pin_height_1": 15, "pin_height_2": 30}
    around = {"strip_length": 400, "strip_height": 60, "overlap": 0, "elements_along_contact": 8}
    case = load_case("example2-heat").resolved()
    for table, keys in (
        (case["geometry"], {"degree": 2, "parameters": sizes | around}),
        *((case["materials"][name], metal) for name in ("steel", "composite")),
        (case["contact"], {"friction": {"expression": "0.12 - 0.0004 * T"}}),
        (case["heat"], {"partition": 0.0}),
        (case["punch"]["loads"][0], {"force": [0, -2000]}),
    ):
        table.update(keys)
    case["motion"] = {"kind": "one-way", "direction": "rightward", "speed": 28.57, "duration": 1}
    system = assemble(make_case(case))
    *_, jumped = jump(system, 6, tolerance=3e-3)
    *_, marched = march(system, 6, implicit=True)
    np.testing.assert_allclose(jumped.pressure[-1], marched.pressure[-1], rtol=0, atol=0.02 * marched.pressure.max())
    np.testing.assert_allclose(jumped.wear[-1], marched.wear[-1], rtol=0, atol=0.02 * marched.wear.max())  # at its edge
