"""Everything goes with everything: each cell of `combinations`, on small cases, held against what must hold there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from combinations import CLOSED, FEATURES, LAWS, STICK, WAYS, closed
from mpi4py import MPI

import fenwear
from fenwear import Case, CaseError, ConvergenceError, State, assemble, jump, load_case, march, register_law, steady
from fenwear.case import Dependence
from fenwear.case.dependence import forget_laws
from fenwear.results import layer_results
from fenwear.results.quantity import computed
from fenwear.results.stored_history import load_history
from fenwear.steps import Block, evolve
from fenwear.studies import (
    DataSet,
    Model,
    Series,
    calibrate,
    evaluate,
    lifetime,
    parse_quantity,
    parse_scatter,
    sensitivity,
)
from fenwear.studies.run import run_case

KEY, EXPONENT = "wear.punch.coefficient", "wear.punch.pressure_exponent"
COATING = "wear.punch.coating.coefficient"


@pytest.fixture(autouse=True)
def laws_that_remember() -> Iterator[None]:
    """Register a film that pressure rubs off and that grows again, and the wear and friction that it makes."""

    def growth(now: Any) -> Any:
        return 20 * (1 - now["oxide"]) - now["p"] * now["v"] * now["oxide"] / 5

    film = State(growth, of=["p", "v"], initial=1.0, least=0.0)
    register_law("filmed", lambda now: 5e-8 * (1.5 - now["oxide"]), states={"oxide": film})
    register_law("slippery", lambda now: 0.75 - 0.1 * now["oxide"], of=["oxide"])
    yield
    forget_laws()


def case_of(feature: str, law: str, *more: str) -> Case:
    base, settings = FEATURES[feature]
    stick = STICK if LAWS[law] == "coulomb" else ("stick={}",)
    return load_case(base, [*settings, f"contact.law='{LAWS[law]}'", *stick, *more])


def check(block: Block) -> None:
    """What is metered is what is worn, nothing is pulled or overlaps, and the loads are carried."""
    assert block.equilibrium_error.max() < 1e-9
    assert block.complementarity_error.max() < 1e-5
    system = block.system
    if system.sliding.track is None:
        volume = system.bodies.punch.thickness * float(system.pair.weights @ block.end.worn.punch)
        followed = 1e-3 if system.bodies.followed is not None else 1e-9
        assert float(block.totals.of("volume_punch")[-1]) == pytest.approx(volume, rel=followed)
    if system.layers.debris.present:
        assert computed(block, layer_results.OF_DEBRIS)["debris_balance_error"].max() < 1e-12
    if block.heat is not None:
        assert block.heat.balance_error.max() < 1e-8


def marched(feature: str, law: str, _: Path) -> None:
    """And the work of friction is that of the tractions."""
    check(list(evolve(assemble(case_of(feature, law)), integration="explicit"))[-1])


def jumped(feature: str, law: str, _: Path) -> None:
    """Jumps come to the depths of a march."""
    case = case_of(feature, law, "run.half_cycles=12")
    far = [list(evolve(assemble(case), integration=how, tolerance=1e-3))[-1] for how in ("explicit", "jump")]
    for block in far:
        check(block)
    one, other = (block.end.worn.punch for block in far)
    weights = far[0].system.pair.weights
    assert weights @ np.abs(one - other) < 0.1 * float(weights @ one)


def steadied(feature: str, law: str, _: Path) -> None:
    """The end carries the load with pressures that are none of them negative."""
    system = assemble(case_of(feature, law), heat="reduced")
    found = steady(system)
    pressure = getattr(found, "pressures", None)
    pressure = found.pressure if pressure is None else pressure
    assert (pressure >= 0).all()
    forces = pressure @ system.pair.weights
    assert forces == pytest.approx(np.full(len(pressure), forces[0]), rel=0.05)
    assert forces[0] > 0


def programmed(feature: str, law: str, _: Path) -> None:
    """Loads are those of its steps."""
    steps = "program={steps=[{cycles=1}, {cycles=1, load_factor=0.8}]}"
    one_way = feature in ("heat, one way", "heat on a closed track", "a cycle as a table")
    system = assemble(case_of(feature, law, f"run.half_cycles={2 if one_way else 4}", steps))
    block = list(evolve(system, 2 * system.motion.half_cycles))[-1]
    check(block)
    assert block.load_factor[-1] == pytest.approx(0.8)


def resumed(feature: str, law: str, folder: Path) -> None:
    """A run in parts ends where one in one piece does."""

    def run(name: str, count: int, *, resume: bool = False) -> None:
        case = case_of(feature, law, f"run.half_cycles={count}")
        run_case(case, name, folder / name, lambda _: None, progress="none", resume=resume)

    run("whole", 4)
    run("parts", 2)
    run("parts", 4, resume=True)
    one, other = (load_history(folder / name) for name in ("whole", "parts"))
    assert one.sizes == other.sizes
    for name in (
        "pressure",
        "wear",
        "friction_work",
        "normal_force",
        "largest_temperature",
        "debris_thickness",
        "state_oxide",
    ):
        if name in one:
            scale = np.abs(one[name].values).max()
            assert np.abs(one[name].values - other[name].values).max() <= 1e-9 * scale, name


def swept(feature: str, law: str, _: Path) -> None:
    """Variants are what their cases give alone."""
    case = case_of(feature, law)
    found = fenwear.sweep(case, {"run.half_cycles": [2, 4]}, of="run")
    alone = list(evolve(assemble(case, MPI.COMM_SELF)))[-1]
    assert float(found["worn_volume"][1]) == pytest.approx(float(alone.totals.of("volume_punch")[-1]), rel=1e-9)
    assert float(found["worn_volume"][0]) < float(found["worn_volume"][1])


def unknown_of(case: Case) -> str:
    """Return a key that the worn volume depends on smoothly."""
    law = case.wear.punch
    if law is not None and isinstance(law.coefficient, Dependence) and law.coefficient.states:
        return EXPONENT  # no other motion has to be made ready
    if law is not None and law.coating is not None:
        return COATING
    return KEY if law is not None and isinstance(law.coefficient, float) else "motion.amplitude"


def differentiated(feature: str, law: str, _: Path) -> None:
    """The volume goes with the coefficient, where so little is worn."""
    case = case_of(feature, law)
    (found,) = sensitivity(case, ["volume after 1 cycles"], [unknown_of(case)], spread=0, comm=MPI.COMM_SELF)
    elasticity = found.derivatives[0].elasticity
    if unknown_of(case) == COATING:
        assert 0 < elasticity < 2  # the later a coating is through, the less the base has worn besides
    elif unknown_of(case) == KEY:
        assert elasticity == pytest.approx(1.0, abs=0.02)
    else:
        assert elasticity > 0.9


def fitted(feature: str, law: str, _: Path) -> None:
    """Volumes of the model give the value that they were made with, to a few of their own errors."""
    case = case_of(feature, law)
    key, model, cycles = unknown_of(case), Model(case), (1.0, 2.0)
    made = float(model_value(case, key))
    volumes = [evaluate(model, parse_quantity(f"volume after {n:g} cycles"), {key: made})[0] for n in cycles]
    series = Series(
        "volume", "punch", np.zeros(0), np.array(cycles), "cycles", np.array(volumes), 1e-3 * np.array(volumes), (1, 2)
    )
    start = case_of(feature, law, f"{key}={1.02 * made!r}")
    assert calibrate(start, [DataSet("twin", (), (series,))], [key]).values[key] == pytest.approx(made, rel=5e-3)


def model_value(case: Case, key: str) -> float:
    return float(reduce(getattr, key.split("."), case))


def lived(feature: str, law: str, _: Path) -> None:
    """Lives to a volume scatter as what wears does."""
    case = case_of(feature, law)
    key = unknown_of(case)
    made, spread = model_value(case, key), 1 if key == EXPONENT else 5
    level = evaluate(Model(case), parse_quantity("volume after 2 cycles"), {key: made})[0]
    scatter = parse_scatter(case, f"{key}=lognormal({made!r}, {spread} %)")
    found = lifetime(case, f"volume {level!r} mm^3", scatter, samples=3, comm=MPI.COMM_SELF)
    assert not found.failures
    assert found.lives == pytest.approx(np.full(3, 2.0), rel=0.4)
    order = np.argsort(found.samples[:, 0])
    assert (np.diff(found.lives[order]) < 0).all(), "what wears more lives less"


WALKED: dict[str, Callable[[str, str, Path], None]] = {
    "march": marched,
    "jump": jumped,
    "steady": steadied,
    "program": programmed,
    "resume": resumed,
    "sweep": swept,
    "sensitivity": differentiated,
    "calibrate": fitted,
    "life": lived,
}
CELLS = [(feature, law, way) for feature in FEATURES for law in LAWS for way in WAYS]
OPEN = [cell for cell in CELLS if not closed(*cell)]


# A calibration is several runs and a run with heat many small steps: they are walked at length.
LONG = {"calibrate", "sensitivity", "life"}
# Studies ask for runs, which every row walks: rows with a state of their own that jumps keep are studied, too; with
# stick, whose states are those of rows that slide, the plain one and that of laws with memory.
OWN_STATE = ("in the plane", "heat, to and fro", "heat on a closed track", "laws with memory", "in rings", "in solids")
STUDIED = {"gross-sliding": OWN_STATE, "coulomb": ("in the plane", "laws with memory")}
# A checkpoint holds the state: a row whose state has no part that other rows lack is not resumed.
LAYERS = ("all that lies between", "a coating", "debris on the strip", "meshes that follow", "a cycle as a table")
RESUMED = {"gross-sliding": (*OWN_STATE, *LAYERS), "coulomb": ("in the plane", "heat, to and fro", *LAYERS[:3])}


def repeats(feature: str, law: str, way: str) -> bool:
    """Return whether other cells walk all that an open one would."""
    kind = LAWS[law]
    if way == "march":
        return not closed(feature, law, "jump")  # which marches, too, farther, and checks the same
    if way == "resume":
        return feature not in RESUMED[kind]
    studied = way in ("calibrate", "life", "sweep") or (way == "sensitivity" and kind == "coulomb")
    return studied and feature not in STUDIED[kind]


# Set-ups and states of heat are spread over ranks; what lies between and the laws rank 0 asks, with stick more often.
RANKED = [
    (feature, law) for feature, law, way in OPEN if way == "ranks" and (feature in OWN_STATE or LAWS[law] == "coulomb")
]
WALKS = [
    pytest.param(*cell, marks=pytest.mark.slow if cell[2] in LONG or cell[0] != "in the plane" else ())
    for cell in OPEN
    if cell[2] != "ranks" and not repeats(*cell)
]


@pytest.mark.parametrize(("feature", "law", "way"), WALKS)
def test_what_goes_with_what(feature: str, law: str, way: str, tmp_path: Path) -> None:
    """Every open cell of the table, but what others walk."""
    WALKED[way](feature, law, tmp_path)


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
@pytest.mark.mpi
@pytest.mark.parametrize(("feature", "law"), RANKED)
def test_on_ranks(feature: str, law: str) -> None:
    """All ranks come to what one comes to.

    What a reduced basis leaves out of material that moves one way depends on rounding: there every rank makes the same.
    """
    one_way = any("one-way" in setting for setting in FEATURES[feature][1])
    case = case_of(feature, law, *(["setup.reproducible=true"] if one_way else []))
    together, alone = (list(march(assemble(case, comm), 2))[-1] for comm in (MPI.COMM_WORLD, MPI.COMM_SELF))
    assert np.abs(together.pressure - alone.pressure).max() < 1e-9 * alone.pressure.max()
    assert np.abs(together.wear - alone.wear).max() < 1e-9 * alone.wear.max()


@pytest.mark.parametrize("cell", list(CLOSED))
def test_what_is_closed_is_refused_with_a_reason(cell: tuple[str, str | None, str | None], tmp_path: Path) -> None:
    """No closed cell gives a number: an error says why."""
    feature, law, way = cell
    with pytest.raises((CaseError, ConvergenceError)):
        WALKED[way or "march"](feature, law or "gross sliding", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("layer", ["exponential", "rough"])
def test_all_that_lies_between_ends_where_long_runs_do(layer: str) -> None:
    """The pressures of the steady state, node by node, are those of a run, the nearer the longer it is."""
    rough = "contact.layer={kind='rough', roughness='0.2 um', asperity_radius='50 um', asperity_density='1000 1/mm^2'}"
    case = case_of("all that lies between", "gross sliding", *([rough] if layer == "rough" else []))
    system = assemble(case)
    state, blocks = steady(system), list(jump(system, 60_000, tolerance=1e-2))
    found, at = (np.concatenate([getattr(block, name) for block in blocks]) for name in ("pressure", "half_cycle"))
    expected = state.phase_pressure[(at - 1) % len(state.phase_pressure)]
    apart = np.abs(found - expected).max(axis=1) / expected.max()
    early = np.flatnonzero(at >= 6_000)[:2]  # of one cycle
    assert at[early[1]] < 12_000
    assert at[-1] == 60_000
    assert apart[-2:].max() < 1e-5
    assert apart[-2:].max() < 0.1 * apart[early].max()
