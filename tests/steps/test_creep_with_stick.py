"""Creep where nodes stick or slip: energy, marches, jumps, ends, resumed runs; forces that relax where it sticks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from combinations import SMALL, STICK
from mpi4py import MPI

from fenwear import Case, ConvergenceError, Tribosystem, assemble, load_case, steady
from fenwear.results.stored_history import load_history
from fenwear.steps import Block, evolve
from fenwear.steps.stick_jump import first_cycle, jumped
from fenwear.steps.stick_program import TimeStep
from fenwear.studies.run import run_case
from fenwear_verify.bodies import two_blocks

TERMS = "{terms=[{compliance=0.5, time='20 s'}, {compliance=1, time='400 s'}]}"
LAYER = f"contact.layer={{kind='linear', stiffness='1e6 MPa/mm', creep={TERMS}}}"
WHO = {
    "punch": (f"punch.creep={TERMS}",),
    "strip": (f"strip.creep={TERMS}",),
    "layer": (LAYER,),
    "all": (f"punch.creep={TERMS}", f"strip.creep={TERMS}", LAYER),
}


def case_of(*more: str) -> Case:
    slow = ("motion.period='1 s'", "run.half_cycles=40")
    return load_case("fretting-partial-slip", [*SMALL, "contact.law='coulomb'", *STICK, *slow, *more])


def crept(block: Block) -> np.ndarray:
    return block.system.elastic.creep.depth(block.end.worn.crept)


def end(system: Tribosystem, how: str, count: int | None = None, tolerance: float = 3e-2) -> Block:
    block = list(evolve(system, count, integration=how, tolerance=tolerance))[-1]
    assert block.equilibrium_error.max() < 1e-12
    assert block.complementarity_error.max() < 1e-9
    return block


@pytest.mark.parametrize("who", [pytest.param(one, marks=() if one == "all" else pytest.mark.slow) for one in WHO])
def test_marches_and_jumps_agree(who: str) -> None:
    """In depths that are worn and that have crept; the balance of energy closes."""
    system = assemble(case_of(*WHO[who]))
    marched, jumped_over = end(system, "explicit"), end(system, "jump")
    assert len(jumped_over) < len(marched)
    assert max(one.records.balance_error(system.pair.weights) for one in marched.steps) < 1e-12
    assert np.abs(crept(marched) - crept(jumped_over)).max() < 5e-3 * np.abs(crept(marched)).max()
    worn = (marched.end.worn.punch, jumped_over.end.worn.punch)
    assert np.abs(worn[0] - worn[1]).max() < 3e-2 * worn[0].max()


def test_a_force_relaxes_where_it_sticks() -> None:
    """Held by a tangential displacement, bodies that creep alike let go of its force as their modulus relaxes.

    By the relaxation function that belongs to J, while the load goes on pressing; errors fall with the time steps'
    square, as forces change evenly within them.
    """
    creep, wrong = {"terms": [{"compliance": 1.5, "time": 1.0}]}, []
    bars = ({"young": 1000.0, "poisson": 0.2}, {"young": 500.0, "poisson": 0.2})
    sizes = {"width": 1.0, "punch_height": 2.0, "strip_height": 3.0}
    tables: dict[str, Any] = {
        "contact": {"law": "coulomb", "friction": 20},
        "motion": {"kind": "reciprocating", "amplitude": 1e-3, "period": 1.0},
        "stick": {"steps": 4, "step_tolerance": 1},
        "run": {"half_cycles": 2},
    }
    for steps in (20, 40):
        system = two_blocks(*bars, sizes, punch={"creep": creep}, strip={"creep": creep}, **tables)
        problem, at, forces = system.law_state.problem, system.law_state.problem.beginning(), []
        for duration in (0.0, *[2 / steps] * steps):
            at, record = problem.step(at, TimeStep(0, 0.0, duration, 0.0, 1e-3, None, 0.0))
            forces.append(float(record.force[0]))
        time = 2 / steps * np.arange(steps + 1)
        exact = forces[0] * (1 + 1.5 * np.exp(-2.5 * time)) / 2.5
        wrong.append(float(np.abs(forces - exact).max() / forces[0]))
    assert wrong[1] < 3e-4
    assert wrong[0] / wrong[1] == pytest.approx(4, abs=0.4)


def test_a_shape_has_an_end() -> None:
    """In cycles that last for ages it is that of elastic bodies as soft as these come to be, pressures and all.

    But for how they came there, which sticking nodes remember: these creep in the place of the end of a cycle.
    """
    system = assemble(case_of(*WHO["all"], "motion.period='1e9 s'"))
    soft = ("materials.steel.young='80 GPa'", "contact.layer={kind='linear', stiffness='4e5 MPa/mm'}")
    aged, elastic = steady(system), steady(assemble(case_of(*soft)))
    assert aged.size == pytest.approx(elastic.size, rel=1e-6)
    assert aged.pressure == pytest.approx(elastic.pressure, abs=1e-3 * elastic.pressure.max())
    assert aged.depth == pytest.approx(elastic.depth, abs=1e-3 * elastic.depth.max())
    with pytest.raises(ConvergenceError, match=r"strip\.creep grows with the logarithm of time"):
        steady(assemble(case_of("strip.creep={per_decade=0.1, onset=1}")))


def test_what_has_crept_comes_to_its_end() -> None:
    """Jumps over many retardation times end in the state that cycles leave as it is."""
    system = assemble(case_of(*WHO["all"], "wear.punch.coefficient='1e-12 1/MPa'"))
    problem, creep = system.law_state.problem, system.law_state.problem.interface.creep
    cycle = first_cycle(problem, problem.beginning(), problem.unworn(), 0)
    while cycle.number < 20_000:
        cycle = jumped(problem, cycle, 20_000, 5e-2)
    now = cycle.worn.crept
    lasting = creep.lasting(now, cycle.end.contact.crept, problem.program.period)
    assert np.abs(lasting - now).max() < 1e-2 * np.abs(now).max()


def test_resumed(tmp_path: Path) -> None:
    """A run in parts ends where one in one piece does, with what has crept."""

    def run(name: str, count: int, *, resume: bool = False) -> None:
        case = case_of(*WHO["all"], f"run.half_cycles={count}")
        run_case(case, name, tmp_path / name, lambda _: None, progress="none", resume=resume)

    run("whole", 6)
    run("parts", 4)
    run("parts", 6, resume=True)
    one, other = (load_history(tmp_path / name) for name in ("whole", "parts"))
    for name in ("pressure", "wear", "tangential_force", "creep_depth", "creep_depth_strip", "creep_volume_layer"):
        assert np.nanmax(np.abs(one[name].values - other[name].values)) <= 1e-9 * np.nanmax(np.abs(one[name].values))


@pytest.mark.mpi
def test_on_ranks() -> None:
    """All ranks come to what one comes to."""
    case = case_of(*WHO["all"], "run.half_cycles=4")
    together, alone = (end(assemble(case, comm), "explicit") for comm in (MPI.COMM_WORLD, MPI.COMM_SELF))
    assert np.abs(together.pressure - alone.pressure).max() < 1e-9 * alone.pressure.max()
    assert np.abs(crept(together) - crept(alone)).max() < 1e-9 * np.abs(crept(alone)).max()
