"""Bodies made in Python, without a case; and what a variant shares."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx.mesh import CellType, create_rectangle
from mpi4py import MPI

from fenwear import CaseError, Tribosystem, assemble
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.material import OwnLaw, lame, strain, stress
from fenwear.bodies.mesh import own_mesh
from fenwear.case import Body, Support

DEMO = Path(__file__).parents[1] / "demos" / "own_materials.py"
GROUPS: dict[str, Callable[[Any], Any]] = {
    "punch_contact": lambda x: np.isclose(x[1], 0),
    "top": lambda x: np.isclose(x[1], 1),
}
HELD = Body(supports=(Support(on="top", fix=("x", "z")),))


def block(groups: dict[str, Callable[[Any], Any]], law: OwnLaw) -> ElasticBody:
    mesh = create_rectangle(MPI.COMM_WORLD, [(0, 0), (1, 1)], (4, 4), CellType.quadrilateral)
    return ElasticBody(own_mesh("punch", mesh, groups), HELD, law, degree=2)


def isotropic(u: Any) -> Any:
    return stress(strain(u), *lame(2e5, 0.3, "stress"))


def test_own_materials() -> None:
    """A demo of at most 60 lines; its steady state is twice the mean pressure of 10 MPa, whatever the material."""
    assert len(DEMO.read_text("utf-8").splitlines()) <= 60
    names = runpy.run_path(str(DEMO))
    pressure, weights = names["state"].pressure, names["system"].pair.weights
    assert pressure.max() == pytest.approx(20, rel=1e-9)
    np.testing.assert_allclose(pressure @ weights, 200, rtol=1e-10)  # N/mm of 2 kN over 10 mm
    np.testing.assert_allclose(names["last"].pressure @ weights, 200, rtol=1e-10)


def test_the_fibres_matter() -> None:
    """The stiffness of the fibres' direction is felt: the pad's compliance is that of neither isotropic bound."""
    names = runpy.run_path(str(DEMO))
    carbon = names["pad"].law
    u = ufl.Coefficient(names["pad"].space)
    assert carbon.stress(u).ufl_shape == (2, 2)
    response = names["system"].condensed.punch.response[:, :, :, 0]
    sideways, down = np.abs(response[:, 0]).max(), np.abs(response[:, 1]).max()
    assert 0.01 < sideways / down < 1  # pressed fibres at 30 degrees give way sideways, too


def test_a_stress_that_is_not_linear_is_named() -> None:
    """And groups that are missing or empty."""
    with pytest.raises(CaseError, match=r"punch\.stress: expected a stress that is linear in grad u"):
        block(GROUPS, OwnLaw("stress", lambda u: isotropic(u) * (1 + ufl.tr(strain(u)))))
    with pytest.raises(CaseError, match="punch_contact: missing"):
        block({"top": GROUPS["top"]}, OwnLaw("stress", isotropic))
    with pytest.raises(CaseError, match="bottom: no facet"):
        block({**GROUPS, "bottom": lambda x: np.isclose(x[1], -5)}, OwnLaw("stress", isotropic))


def test_a_variant_equals_a_new_system(assembled: Callable[..., Tribosystem]) -> None:
    """Other loads, friction, wear, motion and positions: shared operators give what new ones do."""
    small = ("geometry.parameters.elements_along_contact=4", "geometry.degree=3", "geometry.parameters.overlap=4")
    base = assembled("example1", *small)
    for settings in (
        ("punch.loads.0.force=['0 N', '-5 kN']",),
        ("contact.friction=0.1", "wear.punch.coefficient=1e-8"),
        ("motion.amplitude=1", "wear.strip.coefficient=1e-8", "motion.positions=3"),
        ("motion.axis=y",),
    ):
        shared, new = base.vary(*settings), assemble(base.vary(*settings).case)
        assert shared.bodies.punch.stiffness is base.bodies.punch.stiffness
        for one, other in zip(shared.interfaces, new.interfaces, strict=True):
            scale = np.abs(other.gap_by_force).max()
            np.testing.assert_allclose(one.gap_by_force, other.gap_by_force, rtol=0, atol=1e-12 * scale)
            np.testing.assert_allclose(one.load_gap, other.load_gap, rtol=0, atol=1e-9 * np.abs(other.load_gap).max())
