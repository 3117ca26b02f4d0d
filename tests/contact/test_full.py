"""Contact on all displacements of both bodies: with whatever a case has, the same as condensed, node by node."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from combinations import FEATURES, STICK
from mpi4py import MPI

from fenwear import assemble, load_case
from fenwear.contact import ContactState
from fenwear.steps import Block, evolve
from fenwear.steps.jump_method import Moment, Trend
from fenwear_verify.full_space import FullContact, nothing_condensed

CLOSE = 1e-8
LINEAR = "geometry.degree=1"
FEW = (LINEAR, "run.half_cycles=2")
CREEP = "punch.creep={terms=[{compliance=0.2, time='2e-3 s'}]}"
COATED = (
    "wear={punch={coefficient='2e-7 1/MPa', coating={thickness='0.1 um', coefficient='1e-7 1/MPa', modulus='500 MPa'}}}"
)
DRY = ("contact.friction=0.7",)
PROGRAM = "program={steps=[{cycles=1, load_factor=[0.5, 1]}, {cycles=1, amplitude='2 um'}]}"


def last_block(feature: str, how: str, *more: str, sticks: bool = False) -> Block:
    base, settings = FEATURES[feature]
    law = ("contact.law='coulomb'", *STICK) if sticks else ("contact.law='gross-sliding'", "stick={}")
    ways = (f"run.integration='{how}'", "run.half_cycles=4")
    return list(evolve(assemble(load_case(base, [*settings, *law, *ways, *more]))))[-1]


def agree(feature: str, how: str, *more: str, sticks: bool = False) -> Block:
    """Both ways give the same pressures, gaps and depths at every node, at the ends of the contact, too."""
    one = last_block(feature, how, *more, sticks=sticks)
    with nothing_condensed():
        other = last_block(feature, how, *more, sticks=sticks)
    assert (other.pressure >= 0).all()
    assert ((other.pressure > 0) == (one.pressure > 0)).all()
    gives = one.pressure.max() * one.system.elastic.interface.elastic_length
    for what, scale in (("pressure", 0.0), ("gap", gives), ("wear", 0.0), ("wear_strip", 0.0)):
        expected, found = getattr(one, what), getattr(other, what)
        assert np.abs(found - expected).max() <= CLOSE * max(scale, np.abs(expected).max()), what
    return other


@pytest.mark.parametrize(
    ("feature", "how", "more"),
    [
        ("heat, to and fro", "explicit", ()),
        ("both bodies worn", "implicit", ()),
        ("friction by p and v", "explicit", (PROGRAM,)),
        ("all that lies between", "explicit", DRY),
        pytest.param("all that lies between", "jump", (*DRY, LINEAR, "run.half_cycles=12"), marks=pytest.mark.slow),
        pytest.param("a cycle as a table", "explicit", (LINEAR,), marks=pytest.mark.slow),
        pytest.param("in rings", "jump", (LINEAR,), marks=pytest.mark.slow),
        pytest.param("in solids", "explicit", (LINEAR,), marks=pytest.mark.slow),
    ],
)
def test_with_whatever_a_case_has(feature: str, how: str, more: tuple[str, ...]) -> None:
    """Heat, wear of the step, loads and friction that change, layers, creep and flow; rings and solids."""
    agree(feature, how, *more)


@pytest.mark.parametrize(
    ("feature", "how", "more"),
    [
        (
            "in the plane",
            "explicit",
            (*FEW, CREEP, "contact.layer={kind='exponential', length='1 um', pressure='10 MPa'}"),
        ),
        ("in the plane", "explicit", (*FEW, COATED, "contact.hardness='550 MPa'")),
        pytest.param("heat, to and fro", "explicit", (LINEAR, PROGRAM), marks=pytest.mark.slow),
        pytest.param("both bodies worn", "jump", (LINEAR, "run.half_cycles=12"), marks=pytest.mark.slow),
    ],
)
def test_with_stick(feature: str, how: str, more: tuple[str, ...]) -> None:
    """The same where nodes stick."""
    agree(feature, how, *more, sticks=True)


@pytest.mark.slow
def test_sets_follow_each_other_where_cut_off_pressures_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A jump's wear and heat keep SNES at a node: sets of nodes that touch find what condensed bodies have."""
    asked = []
    by_sets = FullContact._by_sets
    monkeypatch.setattr(FullContact, "_by_sets", lambda self, f: asked.append(1) or by_sets(self, f))

    def even(_self: object, moment: Moment, _to: float) -> ContactState:
        pressure = moment.contact.pressure
        mean = pressure.mean() if len(pressure) else 0.0
        return replace(moment.contact, pressure=np.full_like(pressure, mean))

    monkeypatch.setattr(Trend, "expected_from", even)  # from near the solution none of them stays there
    agree("heat, one way", "jump", LINEAR, "run.half_cycles=12")
    assert asked


@pytest.mark.mpi("ranks")
@pytest.mark.parametrize("feature", [pytest.param("heat, to and fro", id="ranks")])
def test_on_ranks(feature: str) -> None:
    """All phases of a jump together, spread over the ranks with their bodies, as on one rank."""
    base, settings = FEATURES[feature]
    case = load_case(base, [*settings, "contact.law='gross-sliding'", "stick={}", "run.integration='jump'"])
    with nothing_condensed():
        one, other = (list(evolve(assemble(case, comm)))[-1] for comm in (MPI.COMM_WORLD, MPI.COMM_SELF))
    assert np.abs(one.pressure - other.pressure).max() < 1e-9 * other.pressure.max()
    assert np.abs(one.wear - other.wear).max() < 1e-9 * other.wear.max()
