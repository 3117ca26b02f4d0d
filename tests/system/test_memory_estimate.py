"""What a step asks of memory: said and checked before it is spent."""

from __future__ import annotations

import subprocess
from collections.abc import Callable

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import CaseError, assemble, load_case
from fenwear.algebra import factor
from fenwear.bodies.condensation import condense
from fenwear.common import parallel
from fenwear.common.parallel import GIB, check_memory, free_memory
from fenwear.steps.stick_setup import partial_slip_problem
from fenwear.system import elastic, place_case, resources_of, tribosystem

COARSE = ("geometry.degree=1", "geometry.order=1")


def test_memory_of_a_set_up() -> None:
    """Of a ball whose strip passes under it, with 14 phases in 7 places: its numbers one by one."""
    placed = place_case(load_case("ball-on-flat", COARSE))
    n, on_strip = len(placed.pair.weights), len(placed.pair.strip.trace)
    expected = (7 * 3 + 2 * 14 + 1) * n**2
    for body, count in ((placed.bodies.punch, n), (placed.bodies.strip, on_strip)):
        expected += 3 * count**2 + 1.5 * body.matrix_entries() + 1.3 * factor.entries(body.size, 3)
        if 10 * body.surface_dofs.size**2 <= factor.entries(body.size, 3):
            expected += 2 * body.surface_dofs.size**2
    assert resources_of(placed).memory == pytest.approx(8 * expected)


def test_not_enough_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rejected before anything is factored, in gross sliding and with stick."""
    placed = place_case(load_case("ball-on-flat", COARSE))
    monkeypatch.setattr(parallel, "SMALL", 0.0)
    monkeypatch.setattr(parallel, "free_memory", lambda: 1e5)
    monkeypatch.setattr(tribosystem, "operators_for", lambda *_, **__: pytest.fail("condensed all the same"))
    with pytest.raises(CaseError, match=r"geometry: .* unknowns, \d+ contact nodes takes about \d+ MiB, but 0 MiB"):
        elastic(placed)
    monkeypatch.setattr("fenwear.bodies.distributed_mesh.check_memory", lambda *_: None)
    with pytest.raises(CaseError, match="are free"):
        partial_slip_problem(load_case("fretting-partial-slip", ["geometry.parameters.elements_along_contact=20"]))


@pytest.mark.parametrize("way", ["spread", "copies"])
@pytest.mark.mpi
def test_a_factor_over_the_ranks(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A large factor is made over all ranks, and columns are dealt to ranks with copies: with the same answer."""
    strip = place_case(load_case("example1", COARSE)).bodies.strip
    normals = np.broadcast_to([0.0, 1.0], strip.surface.x.shape)
    expected = condense(strip, strip.surface.spread, normals)
    strip.free_factor()
    monkeypatch.setattr("fenwear.bodies.response.BLOCK", 8)
    monkeypatch.setattr("fenwear.bodies.condensation.by_surface", lambda _: False)
    monkeypatch.setattr("fenwear.bodies.condensation.BOUNDARY_SHARE", 0)
    monkeypatch.setattr("fenwear.bodies.condensation.LONG", 1)
    if way == "spread":
        monkeypatch.setattr(factor, "SPREAD", 0)
    found = condense(strip, strip.surface.spread, normals)
    ranks = MPI.COMM_WORLD.size
    assert strip.factor.is_spread == (ranks > 1 and way == "spread")
    assert len(strip.factor.copies) == (1 if way == "spread" else ranks)
    for one, other in ((found.response, expected.response), (found.by_load, expected.by_load)):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * np.abs(expected.response).max())


@pytest.mark.mpi
def test_solutions_without_a_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a factor does not fit the memory, iterations on all ranks give the same."""
    strip = place_case(load_case("example1", COARSE)).bodies.strip
    first, last = strip.stiffness.getOwnershipRange()
    forces = np.sin(np.outer(np.arange(first, last), (1.0, 2.0)))
    forces[strip.supported] = 0.0
    expected = strip.solve(forces)
    strip.free_factor()
    strip.operator = "fine"
    monkeypatch.setattr("fenwear.bodies.elasticity.fits", lambda *_: False)
    np.testing.assert_allclose(strip.solve(forces), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert isinstance(strip.factor, factor.Iterative)


def test_what_fits_and_what_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system says what is free; less than a GiB is never rejected."""
    assert 0 < free_memory() < np.inf
    monkeypatch.setattr(parallel, "free_memory", lambda: 2.0 * GIB)
    check_memory(MPI.COMM_SELF, 2.0 * GIB, "geometry", "it", "")
    with pytest.raises(CaseError, match=r"^geometry: it takes about 3\.0 GiB, but 2\.0 GiB are free\. Use less\."):
        check_memory(MPI.COMM_SELF, 3.0 * GIB, "geometry", "it", "Use less.")
    monkeypatch.setattr(parallel, "free_memory", lambda: 0.0)
    check_memory(MPI.COMM_SELF, 0.9 * GIB, "geometry", "it", "")


@pytest.mark.process
def test_check_tells(fenwear: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    """The sizes come first."""
    done = fenwear("check", "example1")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("4,810 and 12,506 unknowns, 65 contact nodes: the set-up takes about")


def test_a_contact_too_large_is_refused_before_the_bodies_are_meshed() -> None:
    """160,000 contact nodes: hundreds of GiB, told within seconds, where meshing alone takes minutes and gigabytes."""
    case = load_case("ball-on-flat", ["geometry.parameters.across=200", "geometry.parameters.core=0"])
    with pytest.raises(CaseError, match=r"geometry: a contact of some 160,000 nodes takes about [56]\d\d\.\d GiB, but"):
        assemble(case)


def test_a_line_too_fine_is_refused_before_the_bodies_are_meshed() -> None:
    """The nodes of the strip, too: elements of 0.15 nm under an overlap of 50 µm had used up the memory."""
    case = load_case(
        "fretting", ["geometry.parameters.contact_width='0.6 nm'", "geometry.parameters.elements_along_contact=4"]
    )
    with pytest.raises(CaseError, match=r"geometry: a contact of some [\d,]{7,} nodes takes about .* GiB, but"):
        assemble(case)
