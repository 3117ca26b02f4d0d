"""Displacements that supports prescribe, in place of loads; and loads that supports swallow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, ConvergenceError, assemble, load_case, make_case, march, steady
from fenwear.results.fields import body_fields

E, NU = 2e5, 0.3
APPROACH = 2e-3


def blocks(approach: float | None = APPROACH, **changes: Any) -> dict[str, Any]:
    """Return two blocks of the same width and of heights 2 and 3 mm, pressed as bars: sides free, no friction."""
    found = load_case("example2").resolved()
    sizes = {"width": 1.0, "punch_height": 2.0, "strip_height": 3.0}
    found["geometry"] = {"file": "blocks.geo", "degree": 2, "parameters": sizes}
    found["model"] = {"kind": "plane", "plane": "stress", "thickness": 5.0}
    found["materials"] = {"steel": {"young": E, "poisson": NU}}
    top: dict[str, Any] = {"on": "punch_far", "fix": ["z"]}
    if approach is not None:
        top["by"] = [-approach]
    middle = {"at": [0.0, 2.0], "fix": ["x"]}
    found["punch"] = {"regions": {"punch_body": "steel"}, "supports": [top, middle], "loads": []}
    held = [{"on": "strip_far", "fix": ["z"]}, {"at": [0.0, -3.0], "fix": ["x"]}]
    found["strip"] = {"regions": {"strip_body": "steel"}, "supports": held}
    found["contact"] = {"friction": 0.0, "law": "gross-sliding"}
    found["wear"] = {"punch": {"coefficient": 1e-7}}
    found["run"] = {"half_cycles": 10, "integration": "implicit"}
    return {**found, **changes}


@pytest.mark.mpi
def test_bars() -> None:
    """Two bars in series, p = E d / (L1 + L2), at every node; the same by a load of that size."""
    system = assemble(make_case(blocks()))
    exact = E * APPROACH / 5.0
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    np.testing.assert_allclose(contact.pressure[0], exact, rtol=1e-9)
    by_load = blocks(None)
    by_load["punch"]["supports"] = by_load["punch"]["supports"][1:]
    by_load["punch"]["loads"] = [{"on": "punch_far", "force": [0.0, -exact * 5.0]}]
    loaded = assemble(make_case(by_load))
    again = loaded.contact((1,)).solve(loaded.pair.initial_gap)
    np.testing.assert_allclose(again.pressure, contact.pressure, rtol=1e-9)


def test_wear_relieves_it() -> None:
    """Of bars that wear, p' = -k v E p / L, an exponential, here by implicit steps; nothing stays in the end."""
    system = assemble(make_case(blocks()))
    *_, block = march(system, 10, implicit=True)
    step = 1e-7 * 2 * 1.5 * E / 5.0  # of an implicit Euler step, k 2 u0 E / L
    expected = E * APPROACH / 5.0 / (1 + step) ** np.arange(1, 11)
    np.testing.assert_allclose(block.pressure, np.tile(expected[:, None], block.pressure.shape[1]), rtol=1e-8)
    with pytest.raises(ConvergenceError, match="supports hold the bodies along the contact's normal"):
        steady(system)


def test_with_stick() -> None:
    """The same approach where the surfaces stick: the force is that of the bars."""
    from fenwear.steps.stick_setup import partial_slip_problem

    found = blocks(contact={"friction": 0.3, "law": "coulomb"}, run={"half_cycles": 2, "integration": "explicit"})
    found["motion"]["amplitude"] = 1e-4
    problem = partial_slip_problem(make_case(found))
    assert problem.weights @ problem.beginning().contact.pressure == pytest.approx(E * APPROACH / 5.0, rel=1e-6)


def test_of_both_bodies() -> None:
    """Either body or both may be moved; the written displacements are those of bars, up to the supports themselves."""
    found = blocks(APPROACH / 4)
    found["strip"]["supports"][0]["by"] = [3 * APPROACH / 4]
    system = assemble(make_case(found))
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    pressure = E * APPROACH / 5.0
    np.testing.assert_allclose(contact.pressure[0], pressure, rtol=1e-9)
    fields = body_fields(system, contact.pressure[0], contact.rigid[0], 0, None)
    for field, far, moved in zip(fields, (2.0, -3.0), (-APPROACH / 4, 3 * APPROACH / 4), strict=True):
        displacement = field["displacement"]
        z = displacement.function_space.tabulate_dof_coordinates()[:, 1]
        exact = moved + pressure / E * (far - z)
        np.testing.assert_allclose(displacement.x.array[1::2], exact, atol=1e-9 * APPROACH)


@pytest.mark.parametrize(("change", "message"), [
    ({"by": [0.1, 0.2]}, r"punch\.supports\.0\.by: expected a displacement for each of fix"),
    ({"by": ["1 N"]}, r"punch\.supports\.0\.by\.0.*mm"),
])  # fmt: skip
def test_bad_input(change: dict[str, Any], message: str) -> None:
    """By key."""
    found = blocks()
    found["punch"]["supports"][0] |= change
    with pytest.raises(CaseError, match=message):
        make_case(found)


def test_a_load_on_a_held_group() -> None:
    """It was swallowed: valid, normal force 0, worn 1e-20, exit 0."""
    found = blocks(None)
    found["punch"]["loads"] = [{"on": "punch_far", "force": [0.0, -1000.0]}]
    system = assemble(make_case(found))
    (text,) = system.bodies.remarks
    assert text.startswith("punch.loads: -1000 of -1000 N along z ")
    with pytest.raises(CaseError, match=r"punch\.supports: .*1000"):
        system.law.check_touching(system)


def test_supports_that_carry_a_part() -> None:
    """Loaded on its sides, held at its top: the contact carries a part, and nothing is to be said."""
    found = blocks(None)
    found["punch"]["loads"] = [{"on": "punch_sides", "traction": [0.0, -50.0]}]
    system = assemble(make_case(found))
    system.law.check_touching(system)
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    force = 5.0 * float(system.pair.weights @ contact.pressure[0])
    assert 0.0 < force < 50.0 * 2 * 2 * 5.0
    assert not [text for text in system.bodies.remarks if "loads" in text]
