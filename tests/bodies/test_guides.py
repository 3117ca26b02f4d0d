"""Guides hold by couples that dent nothing: where they act makes no difference to a bore, and all solvers agree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem, assemble, load_case, march, vary
from fenwear.common.arrays import Array
from fenwear.common.parallel import total
from fenwear.results.fields import body_fields
from fenwear_verify.full_space import nothing_condensed

MU, LOAD = 0.2, 1000.0


def bushing(wall: float, moment: float = 0.0, *settings: str) -> Tribosystem:
    """Return a free bushing on a turning shaft, under a moment besides its load, N mm."""
    load: dict[str, Any] = {"on": "punch_top", "force": [0, -LOAD], **({"moment": [moment]} if moment else {})}
    told = "{" + ", ".join(f"{key}={value!r}" for key, value in load.items()) + "}"
    return assemble(
        load_case(
            "bushing",
            [
                f"geometry.parameters.wall={wall}",
                "geometry.parameters.elements_along_contact=60",
                f"contact.friction={MU}",
                "wear={punch={coefficient=1e-9}}",
                f"punch.loads=[{told}]",
                *settings,
            ],
        )
    )


def pressed(system: Tribosystem) -> tuple[Array, float]:
    """Return the first pressures (n,) and the moment of what the contact does to the bushing about y, N mm."""
    pressure = system.contact((1,)).solve(system.pair.initial_gap).pressure[0]
    traction = system.pair.normal + system.phases.middle_ratio(1)
    force = system.bodies.punch.thickness * (system.pair.weights * pressure)[:, None] * traction
    x = system.pair.opposite
    return pressure, float((x[:, 1] * force[:, 0] - x[:, 0] * force[:, 1]).sum())


@pytest.mark.mpi("2.0")
@pytest.mark.parametrize("wall", [2.0, 4.0])
def test_a_couple_dents_nothing(wall: float) -> None:
    """As if the housing took the friction's moment evenly: then the guide has nothing to hold."""
    pressure, moment = pressed(bushing(wall))
    again, turning = pressed(bushing(wall, -moment))
    assert turning == pytest.approx(moment, rel=1e-6)
    np.testing.assert_allclose(pressure, again, rtol=0, atol=1e-6 * again.max())


@pytest.mark.mpi
def test_nothing_turns_in_the_mean() -> None:
    """Fields of a guided body do no work on its couple, and touch where the condensed body touches."""
    system = bushing(2.0)
    (first,) = march(system, 1)
    bodies, gap = system.bodies, system.pair.initial_gap
    fields = body_fields(system, first.pressure[-1], first.rigid[-1], 0, None)
    u, beside = (
        field["displacement"].x.array[: len(body.load)]
        for field, body in zip(fields, (bodies.punch, bodies.strip), strict=True)
    )
    held = u - sum(a * mode for mode, a in zip(bodies.punch.rigid_modes, first.rigid[-1], strict=True))
    assert bodies.punch.guides.couples.size
    assert abs(total(system.bodies.comm, bodies.punch.guides.couples.T @ held)[0]) * 10 < 1e-9 * gap.max()
    on_punch, on_strip = (
        body.trace.pick(own[:, None])[:, :, 0] for body, own in ((bodies.punch, u), (bodies.strip, beside))
    )
    moved = system.pair.punch.spread.T @ on_punch - system.pair.transfer @ on_strip
    opened = gap + np.einsum("nd,nd->n", system.pair.normal, moved)
    np.testing.assert_allclose(opened, first.gap[-1], rtol=0, atol=1e-9 * gap.max())


@pytest.mark.parametrize("law", ["gross-sliding", "coulomb"])
def test_solvers_agree(law: str) -> None:
    """The condensed inequality, and that on all displacements, whose guides are further unknowns."""
    motion = ["run.integration=explicit", "run.half_cycles=2"]
    if law == "coulomb":
        motion += ["contact.law=coulomb"]
    settings = ["geometry.parameters.elements_along_contact=4", "geometry.degree=1", "punch.no_turning_about=['y']"]
    system = assemble(load_case("example1", [*settings, *motion]))
    assert system.bodies.punch.guides.couples.size
    found = [next(march(system, 1)).pressure[-1]]
    with nothing_condensed():
        found.append(next(march(system, 1)).pressure[-1])
    np.testing.assert_allclose(*found, rtol=0, atol=1e-9 * found[0].max())


def test_variants_have_the_guides_of_their_case() -> None:
    """A guide is no operator that variants share."""
    system = assemble(load_case("example1", ["geometry.parameters.elements_along_contact=4", "geometry.degree=1"]))
    assert system.rigid.mode_names == ("lambda_F", "lambda_M")
    assert vary(system, "punch.no_turning_about=['y']").rigid.mode_names == ("lambda_F",)
