"""Operators of bodies: by name, as half-spaces, and of one's own."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fenwear import CaseError, assemble, load_case, march, register_operator
from fenwear.bodies import surface_operators
from fenwear.bodies.condensation import condense
from fenwear.bodies.half_space import HalfSpace, influence
from fenwear.bodies.response import Request
from fenwear.bodies.surface_operators import OPERATORS, SurfaceOperator
from fenwear.common.arrays import Array

DEMO = Path(__file__).parents[2] / "demos" / "elastic_foundation.py"
BALL = (
    "geometry.degree=1", "geometry.order=1", "geometry.parameters.core=0", "geometry.parameters.core_elements=0",
    "contact.friction=0", "wear.punch.coefficient=0", "wear.strip.coefficient=0", "motion.positions=2",
)  # fmt: skip
HALF_SPACES = ("punch.operator='half-space'", "strip.operator='half-space'")


@pytest.fixture
def registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a test registers."""
    monkeypatch.setattr(surface_operators, "OPERATORS", dict(OPERATORS))


def plane(along: Array | None = None) -> HalfSpace:
    """Return a half-plane with a hole in its row of nodes."""
    places = np.array([0, 1, 2, 3, 5, 6, 9])[:, None]
    return HalfSpace(places, (0.02,), 8e4, 0.3, (0, 1), -1.0, depth=5.0, along=along)


def space(along: Array | None = None) -> HalfSpace:
    """Return a half-space whose nodes fill no rectangle."""
    places = np.array([(i, j) for i in range(4) for j in range(3) if (i, j) != (2, 1)])
    return HalfSpace(places, (0.02, 0.05), 8e4, 0.3, (0, 1, 2), 1.0, along=along)


@pytest.mark.parametrize("make", [plane, space])
def test_products_are_of_the_entries(make: Callable[..., HalfSpace]) -> None:
    """Products by transforms, numbers and the diagonal are of one operator, along all axes and along one."""
    whole = make()
    forces = np.random.default_rng(1).standard_normal((len(whole.places), whole.dim, 2))
    upright = make(np.eye(whole.dim)[-1:])
    for one in (whole, upright):
        every = one.entries(slice(None), slice(None))
        scale = np.abs(every).max()
        found = np.einsum("iajd,jdk->iak", every, forces)
        np.testing.assert_allclose(one.apply(forces), found, rtol=0, atol=1e-11 * np.abs(found).max())
        here = every[np.arange(len(every)), :, np.arange(len(every))]
        np.testing.assert_allclose(one.diagonal(), here, rtol=0, atol=1e-13 * scale)
    np.testing.assert_array_equal(every, whole.entries(slice(None), slice(None))[:, -1:])


@pytest.mark.parametrize("make", [plane, space])
def test_forces_and_displacements_are_reciprocal(make: Callable[..., HalfSpace]) -> None:
    """Maxwell and Betti hold for the nodes' average displacements, here up to the spreading of the forces."""
    every = make().entries(slice(None), slice(None))
    swapped = every.transpose(2, 3, 0, 1)
    np.testing.assert_allclose(every, swapped, rtol=0, atol=1e-14 * np.abs(every).max())


def test_far_away_it_is_the_point_force() -> None:
    """Boussinesq, Cerruti and Flamant: (1 - nu) P / 2 pi G r and its like, to the square of size over distance."""
    far, side, shear, nu = np.array([[0.3, 0.4]]), 0.002, 8e4, 0.3
    found = influence(far, (side, side), shear, nu)[0] / side**2 * 2 * np.pi * shear
    r, (x, y) = 0.5, far[0]
    exact = [
        [(1 - nu) / r + nu * x**2 / r**3, nu * x * y / r**3, -(0.5 - nu) * x / r**2],
        [nu * x * y / r**3, (1 - nu) / r + nu * y**2 / r**3, -(0.5 - nu) * y / r**2],
        [(0.5 - nu) * x / r**2, (0.5 - nu) * y / r**2, (1 - nu) / r],
    ]
    np.testing.assert_allclose(found, exact, rtol=2e-5)
    line = influence(np.array([[-0.5]]), (side,), shear, nu, depth=5.0)[0] / side * np.pi * shear
    along, down, across = (1 - nu) * np.log(10) + 0.5, (1 - nu) * np.log(10) - 0.5, np.pi / 2 * (0.5 - nu)
    np.testing.assert_allclose(line, [[along, across], [-across, down]], rtol=2e-5)


def test_middle_of_a_pressed_square() -> None:
    """Love (1929): u = 4 (1 - nu) p a ln(1 + sqrt 2) / (pi G) under the middle of a square of side 2 a."""
    count = 21
    places = np.array([(i, j) for i in range(count) for j in range(count)])
    body = HalfSpace(places, (1 / count, 1 / count), 8e4, 0.3, (0, 1, 2), 1.0)
    pressed = np.zeros((count**2, 3))
    pressed[:, 2] = -1 / count**2
    middle = body.apply(pressed)[count**2 // 2]
    exact = -4 * (1 - 0.3) * 0.5 * np.log(1 + np.sqrt(2)) / (np.pi * 8e4)
    np.testing.assert_allclose(middle, [0, 0, exact], rtol=1e-12, atol=1e-12 * abs(exact))


@pytest.mark.mpi
def test_ball_on_flat_is_the_contact_of_hertz() -> None:
    """Both bodies as half-spaces: pressures node by node, falling with the spacing; no mesh is condensed."""
    errors = []
    for across in (12, 24):
        even = (f"geometry.parameters.across={across}", f"geometry.parameters.stroke_elements={across // 4}")
        system = assemble(load_case("ball-on-flat", [*BALL, *HALF_SPACES, *even]))
        pressure = next(iter(march(system, 1))).pressure[-1]
        modulus, radius = 210e3 / (2 * (1 - 0.3**2)), 5.0
        a = (3 * 20 * radius / (4 * modulus)) ** (1 / 3)
        r = np.hypot(*system.pair.punch.x[:, :2].T)
        exact = 1.5 * 20 / (np.pi * a**2) * np.sqrt(np.maximum(1 - (r / a) ** 2, 0))
        inside = r < 0.75 * a
        errors.append(np.abs(pressure / exact.max() - exact / exact.max())[inside].max())
        assert pressure @ system.pair.weights == pytest.approx(20, rel=1e-9)
    assert errors[1] < 0.5 * errors[0] < 0.03


@pytest.mark.usefixtures("registry")
@pytest.mark.parametrize(
    ("name", "small"),
    [
        ("example1", ["geometry.parameters.elements_along_contact=12"]),
        ("fretting-partial-slip", ["geometry.parameters.elements_along_contact=16"]),
        ("ball-on-flat", [*BALL[:5], "geometry.parameters.across=8"]),
    ],
)
def test_by_name_or_condensed(name: str, small: list[str]) -> None:
    """An operator that answers by products as the condensed body does gives the same pressures with the other body."""

    class Product:
        """The condensed body, by products."""

        def __init__(self, own: Any) -> None:
            self.own = own

        cost = 1.0

        def under(self, elastic: Any) -> Product:
            return Product(self.own.under(elastic))

        def __getattr__(self, name: str) -> Any:
            return getattr(self.own, name)

    @register_operator("products")
    def products(request: Request) -> SurfaceOperator:
        return Product(condense(request.elastic, request.patterns, request.directions))

    assert surface_operators.OPERATORS["products"] is products
    settings = ("punch.operator='products'", "strip.operator='products'")
    pressed, by_products = (
        list(march(assemble(load_case(name, [*small, *by])), 2))[-1].pressure[-1] for by in ((), settings)
    )
    np.testing.assert_allclose(by_products, pressed, rtol=0, atol=1e-9 * pressed.max())


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("example1", ["punch.operator='foundation'"], "punch.operator: no operator 'foundation' is registered"),
        ("ring-on-ring", ["geometry.degree=1", HALF_SPACES[0]], "punch.operator: expected 'condensed' for rings"),
        ("example1", ["geometry.degree=2", HALF_SPACES[1]], "geometry.degree: expected 1"),
        ("example1-heat", [HALF_SPACES[0]], "punch.operator: expected 'condensed' with heat"),
        ("ball-on-flat", [*BALL, *HALF_SPACES, "geometry.parameters.across=6"], "strip.operator: .* on a regular grid"),
        (
            "ball-on-flat",
            [*BALL, *HALF_SPACES, "geometry.parameters.across=16"],
            "strip.operator: .* on a regular grid",
        ),
    ],
)
def test_bodies_that_are_no_half_space(name: str, settings: list[str], message: str) -> None:
    """Each by its key."""
    with pytest.raises(CaseError, match=message):
        assemble(load_case(name, settings))


@pytest.mark.usefixtures("registry")
@pytest.mark.parametrize(
    ("name", "make"), [("condensed", print), ("auto", print), ("two words", print), (3, print), ("mine", 3)]
)
def test_what_cannot_be_registered(name: Any, make: Any) -> None:
    """A name that is taken or no word, and what cannot be called."""
    with pytest.raises(CaseError, match="operator"):
        register_operator(name, make)


@pytest.mark.usefixtures("registry")
def test_elastic_foundation() -> None:
    """The demo: a steel cylinder on a thin layer has Johnson's parabola of pressure, node by node."""
    names, errors = runpy.run_path(str(DEMO)), []
    for elements in (60, 120):
        system, pressure = names["main"](
            [
                "geometry.parameters.radius=60",
                "materials.steel.young=2e9",
                f"geometry.parameters.elements_along_contact={elements}",
            ]
        )
        x, half_width = system.pair.x, (1.5 * 2 * 60 * 0.5 / 200) ** (1 / 3)
        exact = 200 / (2 * 60 * 0.5) * np.maximum(half_width**2 - x**2, 0)
        errors.append(np.abs(pressure - exact).max() / exact.max())
    assert errors[1] < 0.7 * errors[0] < 0.05
