"""Contact: balance, complementarity; the condensed and the full inequality."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.optimize import brentq

from fenwear import ConvergenceError, Tribosystem, assemble, march
from fenwear.common.arrays import Array
from fenwear.common.errors import INTERIOR
from fenwear.contact import CondensedContact, ContactState, SlidingContact
from fenwear.laws.wear import WornDepths
from fenwear.surfaces import Interface
from fenwear_verify.full_space import FullContact

P = 1000.0  # load per thickness, N/mm
BOTH = ("polyethylene", "cobalt-chromium")  # bodies of the cup
OPENING = ("contact.friction=0.4", "geometry.parameters.pin_height_1=40")  # c = 1.6: the rear edge lifts off


def solve(system: Tribosystem, direction: int = 1) -> ContactState:
    return system.contact((direction,)).solve(system.pair.initial_gap)


@pytest.fixture(params=["full contact", "opening", "unmatched", "no pin"])
def system(request: pytest.FixtureRequest, assembled: Callable[..., Tribosystem]) -> Tribosystem:
    match request.param:
        case "full contact":
            return assembled("example1")
        case "opening":
            return assembled("example1", *OPENING)
        case "unmatched":
            found: Tribosystem = request.getfixturevalue("unmatched")
            return found
    return assembled("example2", "contact.friction=0.5")


def worn(system: Tribosystem) -> Array:
    """A worn shape that opens part of any contact."""
    return system.pair.initial_gap + 2e-2 * np.cos(system.pair.x / 7) ** 2


@pytest.mark.parametrize("depth", [10.0, 1000.0])
def test_wear_that_is_far_more_than_the_bodies_give(assembled: Callable[..., Tribosystem], depth: float) -> None:
    """What rigid motions have taken up is no matter, however much it is beside the elastic gap of 0.2 µm."""
    system = assembled("pin-on-disc", "geometry.degree=1")
    contact, gap, modes = system.contact((1,)), system.pair.initial_gap, system.rigid.rigid_normal
    reference = contact.solve(gap)
    far = depth * np.array([0.345584, 0.821618, 0.330437]) / np.abs(modes).max(axis=0)
    before = replace(reference, pressure=reference.pressure + 1.0, rigid=reference.rigid - (1 - 1e-6) * far)
    found = contact.solve(gap + modes @ far, before)
    assert found.iterations <= reference.iterations + 1
    np.testing.assert_allclose(found.pressure, reference.pressure, rtol=0, atol=1e-8 * reference.pressure.max())
    np.testing.assert_allclose(found.rigid[0] + far, reference.rigid[0], rtol=0, atol=1e-12 * depth)


def full_contact(system: Tribosystem, interface: Interface, ratio: Array) -> FullContact:
    """Return one phase on all displacements of both bodies."""
    return FullContact([SlidingContact(interface, ratio)], [(system.bodies.punch, system.bodies.strip)])


@pytest.mark.parametrize("direction", [1, -1])
def test_balance_and_complementarity(system: Tribosystem, direction: int) -> None:
    """Verification 5 and 7: force and moment to round-off; p >= 0, gap >= 0, p gap = 0 exactly."""
    x, weights = system.pair.x, system.pair.weights
    mu, tilts = system.case.contact.friction, "lambda_M" in system.rigid.mode_names
    height = system.bodies.punch.pivot[1] - 100
    for gap in (system.pair.initial_gap, worn(system)):
        state = system.contact((direction,)).solve(gap)
        p, g = state.pressure[0], state.gap[0]
        assert weights @ p * 10 == pytest.approx(1e4, rel=1e-12)
        if tilts:  # about the pin at (30, 100 + l_z): the friction pulls the centre of pressure by d mu l_z
            assert weights @ (p * x) == pytest.approx(-direction * mu * height * P, rel=1e-11)
        assert (p >= 0).all()
        assert (g > -1e-11).all()
        np.testing.assert_allclose(g[p > 0], 0, atol=1e-11)
    assert (p == 0).any()


def test_gap_is_the_distance_of_the_displaced_surfaces(system: Tribosystem) -> None:
    """gap = g0 + w + (S_n + d mu S_t) p + H a + g_load, from the state alone."""
    state = system.contact((-1,)).solve(gap := worn(system))
    interface = system.elastic.interface
    expected = interface.compliance(system.phases.middle_ratio(-1)).apply(state.pressure[0])
    expected += system.rigid.rigid_normal @ state.rigid[0] + interface.load_gap + gap
    np.testing.assert_allclose(state.gap[0], expected, atol=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["example1", "example2"])
def test_condensed_equals_full(assembled: Callable[..., Tribosystem], name: str) -> None:
    """Two discretisations of the algebra, (p, a) and (u, p, a), give the same pressure to 1e-8 in worn half-cycles."""
    system = assembled(name, *OPENING, "geometry.degree=2", "geometry.parameters.elements_along_contact=8")
    full = [full_contact(system, system.elastic.interface, system.phases.middle_ratio(d)) for d in (1, -1)]
    condensed = [system.contact((d,)) for d in (1, -1)]
    wear, opened = np.zeros_like(system.pair.x), False
    for half_cycle in range(4):
        phase = half_cycle % 2
        gap = system.pair.initial_gap + wear
        one, other = condensed[phase].solve(gap), full[phase].solve(gap)
        scale = one.pressure.max()
        np.testing.assert_allclose(other.pressure, one.pressure, rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose(
            other.gap, one.gap, rtol=0, atol=1e-8 * scale * system.elastic.interface.elastic_length
        )
        opened |= bool((one.pressure == 0).any() and (one.gap > 1e-5).any())
        wear = wear + 500 * system.phases.mean_wear.depth(np.tile(one.pressure, (2, 1)))[0]
    assert opened or name == "example2"


def test_condensed_equals_full_on_unmatched_nodes(unmatched: Tribosystem) -> None:
    """The same where the nodes of the two surfaces do not coincide."""
    full = full_contact(unmatched, unmatched.elastic.interface, unmatched.phases.middle_ratio(-1)).solve(
        worn(unmatched)
    )
    condensed = unmatched.contact((-1,)).solve(worn(unmatched))
    np.testing.assert_allclose(full.pressure, condensed.pressure, rtol=0, atol=1e-8 * condensed.pressure.max())


def test_unmatched_nodes_change_little(unmatched: Tribosystem, assembled: Callable[..., Tribosystem]) -> None:
    """Another mesh of the strip is the same problem: 1 % of the mean in the force on each element, 1e-4 inside."""
    matched = assembled("example1")
    x, ends = matched.pair.x, matched.pair.x[::4]
    element = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, 15)
    pressures = [solve(s).pressure[0] for s in (matched, unmatched)]
    one, other = (np.bincount(element, matched.pair.weights * p) for p in pressures)
    np.testing.assert_allclose(other / np.diff(ends), one / np.diff(ends), rtol=0, atol=0.01 * P / 60)
    inside = np.abs(x) < 20  # away from the edges, where the pressure has no bound
    np.testing.assert_allclose(pressures[1][inside], pressures[0][inside], rtol=0, atol=1e-4 * P / 60)


def test_several_phases_are_independent_without_a_layer(assembled: Callable[..., Tribosystem]) -> None:
    """Both phases in one inequality are the two phases each for itself."""
    system = assembled("example1", *OPENING)
    both = system.contact((1, -1)).solve(worn(system)).pressure
    for p, d in zip(both, (1, -1), strict=True):
        np.testing.assert_allclose(p, system.contact((d,)).solve(worn(system)).pressure[0], atol=1e-9 * p.max())


def test_warm_start_changes_nothing_but_the_work(system: Tribosystem) -> None:
    """Newton ends at the same contact from its own solution, from another one, and from full contact."""
    contact = system.contact((1,))
    cold = contact.solve(worn(system))
    again = contact.solve(worn(system), cold)
    from_afar = contact.solve(worn(system), contact.solve(worn(system)[::-1]))
    for state in (again, from_afar):
        np.testing.assert_allclose(state.pressure, cold.pressure, rtol=0, atol=1e-10 * cold.pressure.max())
    assert again.iterations == 0 < cold.iterations


def test_a_steel_ball_on_a_few_nodes_of_a_steel_cup(assembled: Callable[..., Tribosystem]) -> None:
    """Sets of nodes go round that start from the few which touch first: every step of walking is found all the same."""
    coarse = ("geometry.parameters.across=2", "geometry.parameters.around=2")
    system = assembled("ball-in-cup", *coarse, *(f"materials.{one}.young=210 GPa" for one in BOTH))
    state, ways = None, Counter[str]()
    for phase, own in enumerate(system.elastic.interfaces):
        state = system.phase_contact([phase]).solve(system.gap(phase, system.unworn()), state)
        ways += system.remedies.take()
        pressure, gap = state.pressure[0], state.gap[0]
        assert (pressure >= 0).all()
        assert gap.min() > -1e-9 * own.pair.initial_gap.max()
        assert np.abs(np.minimum(pressure / pressure.max(), gap / own.pair.initial_gap.max())).max() < 1e-9
        rigid, ratio = own.rigid, system.phases.ratios()[phase]
        np.testing.assert_allclose(rigid.equilibrium(ratio) @ pressure, -rigid.resultant, rtol=0, atol=1e-6)
        assert 3 <= (pressure > 0).sum() < 8
    assert ways[INTERIOR] > 0


def test_friction_follows_the_pressure_of_many_nodes(
    assembled: Callable[..., Tribosystem], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One Newton's method finds what rounds of pressures and coefficients come to, node by node."""
    friction = "contact.friction={expression='0.2 + 0.1 * exp(-p / 50)'}"
    system = assembled("example1", "geometry.degree=2", "geometry.parameters.elements_along_contact=210", friction)
    contact = system.passed_contact(0)
    assert isinstance(contact, CondensedContact)
    assert contact.can_follow
    *_, last = march(system, 3)
    monkeypatch.setattr(CondensedContact, "can_follow", False)
    *_, by_rounds = march(system, 3)
    np.testing.assert_allclose(last.pressure, by_rounds.pressure, rtol=0, atol=1e-9 * last.pressure.max())
    np.testing.assert_allclose(last.wear, by_rounds.wear, rtol=0, atol=1e-9 * last.wear.max())


@pytest.fixture
def one_iteration() -> Iterator[None]:
    options = PETSc.Options()
    names = [f"fenwear_{name}snes_max_it" for name in ("contact_", "full_contact_")]
    for name in names:
        options[name] = 1
    yield
    for name in names:
        options.delValue(name)


@pytest.mark.parametrize("solver", ["condensed", "full"])
@pytest.mark.mpi
def test_no_convergence_is_said(assembled: Callable[..., Tribosystem], one_iteration: None, solver: str) -> None:
    """Stopped by PETSc's options after one iteration: a typed error with the reason and the options' prefix."""
    system = assembled("example1", *OPENING)
    contact = (
        system.contact((1,))
        if solver == "condensed"
        else full_contact(system, system.elastic.interface, system.phases.middle_ratio(1))
    )
    with pytest.raises(ConvergenceError, match=r"DIVERGED_MAX_IT after 1 .*-fenwear_.*contact_snes"):
        contact.solve(worn(system))


def rounded(assembled: Callable[..., Tribosystem], force: float, *settings: str) -> Tribosystem:
    """Return a punch that is all but rigid, on a strip that is all but a half-plane, under N/mm."""
    return assembled(
        "rounded-punch",
        *("geometry.parameters.strip_length=4000", "geometry.parameters.strip_height=1000", "contact.friction=0"),
        *("materials.stiff={young=1e9, poisson=0.3}", "punch.regions={punch_body='stiff'}"),
        f"punch.loads=[{{on='punch_top', force=[0, {-10 * force}]}}]",
        *settings,
    )


def test_punch_with_rounded_edges(assembled: Callable[..., Tribosystem]) -> None:
    """Ciavarella, Hills & Monno (1998): flat to b, edges of radius R, on a half-plane.

    P = E* a^2 / (2 R) (pi/2 - phi - sin phi cos phi), sin phi = b/a, and p from the integral of the slope over
    a singular kernel. Found: 0.3 % in the middle, 0.3 % at 23 of 25 mm.
    """
    force, b, radius, modulus = 20_000.0, 25.0, 20.0, 200e3 / (1 - 0.3**2)
    system = rounded(assembled, force)

    def excess(a: float) -> float:
        phi = np.arcsin(b / a)
        return float(modulus * a**2 / (2 * radius) * (np.pi / 2 - phi - np.sin(phi) * np.cos(phi)) - force)

    a = brentq(excess, 1.0001 * b, 30)
    pressure, x = system.contact((1,)).solve(system.pair.initial_gap).pressure[0], system.pair.x
    closed = np.flatnonzero(pressure > 0)
    assert x[closed[-1]] <= a <= x[closed[-1] + 1]
    assert x[closed[0]] >= -a >= x[closed[0] - 1]

    def exact(at: float) -> float:
        start, count = np.arcsin(b / a), 2000
        angle = start + (np.pi / 2 - start) * (np.arange(count) + 0.5) / count
        t = a * np.sin(angle)
        kernel = (t - b) / radius * 2 * t / (t**2 - at**2)
        return float(modulus / (2 * np.pi) * np.sqrt(a**2 - at**2) * kernel.sum() * (np.pi / 2 - start) / count)

    for place, tolerance in ((0.0, 0.005), (10.0, 0.005), (-10.0, 0.005), (23.0, 0.01)):
        assert np.interp(place, x, pressure) == pytest.approx(exact(place), rel=tolerance)


def test_crowned_punch(assembled: Callable[..., Tribosystem]) -> None:
    """Hertz under a crown whose edges do not touch: half-width and pressure along the contact."""
    force, radius, modulus = 1000.0, 4000.0, 200e3 / (1 - 0.3**2)
    system = rounded(
        assembled,
        force,
        f"geometry.parameters.crown_radius={radius}",
        "geometry.parameters.flat_grading=1",
        "geometry.parameters.elements_along_flat=60",
    )
    a = np.sqrt(4 * force * radius / (np.pi * modulus))
    pressure, x = system.contact((1,)).solve(system.pair.initial_gap).pressure[0], system.pair.x
    exact = 2 * force / (np.pi * a) * np.sqrt(np.maximum(1 - (x / a) ** 2, 0))
    inner = np.abs(x) < 0.8 * a
    assert inner.sum() > 15
    np.testing.assert_allclose(pressure[inner], exact[inner], rtol=0.01)
    assert pressure[np.abs(x) > 1.1 * a].max() == 0


def test_action_is_reaction_on_a_scarred_surface(assembled: Callable[..., Tribosystem]) -> None:
    """A flat with a deep scar slides as a whole: in every position the condensed contact is that of the full bodies.

    The frame turns with the scar, and what acts on one body acts on the other the other way: forces balance.
    """
    small = (
        "geometry.parameters.elements_along_contact=12",
        "geometry.degree=1",
        "motion.positions=3",
        "contact.friction=0.3",
    )
    flat = assembled("fretting", *small)
    x = flat.pair.strip.x[:, 0]
    scar = WornDepths(np.zeros(len(flat.pair.weights)), 4e-3 * np.maximum(1 - (x / 0.25) ** 2, 0) ** 2)
    system = assemble(flat.case, followed=scar)
    assert np.ptp(system.pair.normal[:, 0]) > 0.02  # radians that the frame turns by
    thickness = flat.case.model.thickness
    for phase, ratio in enumerate(system.phases.ratios()):
        interface = system.elastic.interfaces[phase]
        gap = system.gap(phase, scar)
        condensed = CondensedContact([SlidingContact(interface, ratio)]).solve(gap)
        full = full_contact(system, interface, ratio).solve(gap)
        scale = condensed.pressure.max()
        np.testing.assert_allclose(full.pressure, condensed.pressure, rtol=0, atol=1e-8 * scale)
        force = (interface.pair.normal + ratio).T @ (interface.pair.weights * condensed.pressure[0])
        assert force[1] * thickness == pytest.approx(18.5, rel=1e-9)  # down the guide, friction included
