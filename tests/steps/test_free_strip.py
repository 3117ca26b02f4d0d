"""A strip that is free to move and passes under a punch as a whole: its steady state, and where there is none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import ConvergenceError, Tribosystem, assemble, jump, make_case, steady
from fenwear.common.arrays import Array

FORCE, OFF, MU, DEPTH, PATH = (180.0, 220.0), 0.2, 0.1, 2.0, 1.6  # N, mm: left and right, their middle; of the pin
MEAN = sum(FORCE) / 4


def rocking(fix: list[str], loads: dict[str, float], exponent: float = 1.0) -> Tribosystem:
    """Return a block that is held, and one that is pushed up against it by loads and slides to and fro with its pin."""
    case: dict[str, Any] = {
        "geometry": {"file": str(Path(__file__).with_name("rocking.geo")), "degree": 2, "follow_wear": "never"},
        "model": {"plane": "strain", "thickness": "1 mm"},
        "materials": {"steel": {"young": 2e5, "poisson": 0.3}},
        "punch": {"regions": {"punch_body": "steel"}, "supports": [{"on": "punch_far", "fix": ["x", "z"]}]},
        "strip": {
            "regions": {"strip_body": "steel"},
            "supports": [{"on": "strip_pin", "fix": fix}],
            "loads": [{"on": f"strip_{side}", "force": [0, force]} for side, force in loads.items()],
        },
        "contact": {"friction": MU},
        "wear": {"punch": {"coefficient": 1e-7 * MEAN ** (1 - exponent), "pressure_exponent": exponent}},
        "motion": {"kind": "reciprocating", "amplitude": PATH / 4, "period": 1.0, "positions": 3},
        "run": {"half_cycles": 100},
        "output": {"report": False, "fields_at": []},
    }
    return assemble(make_case(case))


def jumped(system: Tribosystem, half_cycles: int) -> tuple[Array, Array]:
    """Return the pressures of all phases and the worn depth after a run of jumps."""
    *_, last = jump(system, half_cycles, tolerance=1e-3)
    return np.array([own.pressure[0] for own in last.end.contacts]), last.end.worn.punch


@pytest.mark.mpi("1.5")
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_strip_that_rocks_on_its_load(exponent: float) -> None:
    """Node by node a long run ends in the steady state; the wear is linear, and in each place the loads are balanced.

    The contact's resultant stands opposite that of the loads, but for the moment of friction about the pin.
    """
    system = rocking(["x"], {"left": FORCE[0], "right": FORCE[1]}, exponent)
    assert np.abs(system.rigids[0].rigid_normal - system.rigids[2].rigid_normal).max() > 0.5
    state, x = steady(system), system.pair.x
    pressure, _ = jumped(system, 3_000_000)
    np.testing.assert_allclose(state.phase_pressure, pressure, rtol=0, atol=1e-8 * MEAN)
    line = system.rigid.rigid_normal @ list(state.velocity.values())
    np.testing.assert_allclose(state.wear_per_cycle, line, rtol=1e-12)
    assert np.ptp(line) > 0.4 * line.max()
    if exponent == 1:
        np.testing.assert_allclose(line, 1e-7 * PATH * MEAN * (1 + 3 * OFF * x / 4), rtol=1e-12)
    forces = state.phase_pressure * system.pair.weights
    np.testing.assert_allclose(forces.sum(axis=1), sum(FORCE), rtol=1e-12)
    places = np.array([phase.offset + OFF + phase.direction * MU * DEPTH for phase in system.motion.phases])
    np.testing.assert_allclose(forces @ x, sum(FORCE) * places, atol=1e-9 * sum(FORCE))


def test_no_shape_stays_under_a_strip_on_a_hinge() -> None:
    """x - x_k + s lambda_k of the places k are of different shape: each wears a facet of its own, deeper for ever."""
    system = rocking(["x", "z"], {"right": FORCE[1]})
    with pytest.raises(ConvergenceError, match="no shape stays"):
        steady(system)
    (before, depth), (after, deeper) = jumped(system, 1_000_000), jumped(system, 10_000_000)
    np.testing.assert_allclose(after, before, atol=1e-3 * before.max())
    rate, line = (deeper - depth) / 9e6, system.rigid.rigid_normal
    worn = rate > 1e-3 * rate.max()
    off = rate[worn] - line[worn] @ np.linalg.lstsq(line[worn], rate[worn], rcond=None)[0]
    assert np.abs(off).max() > 0.1 * rate.max()
    touched = [own[worn] > 0 for own in (after[:3] + after[5:2:-1])]  # the same place to and fro
    assert max((one & other).sum() for k, one in enumerate(touched) for other in touched[:k]) <= 1
