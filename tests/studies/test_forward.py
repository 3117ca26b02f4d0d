"""Quantities of interest as a function of keys: values, derivatives, and the errors by option."""

from __future__ import annotations

import pytest

from fenwear import CaseError, load_case
from fenwear.studies import Forward, forward

FEW = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2", "run.half_cycles=20")
KEYS = ("wear.punch.coefficient", "contact.friction")


@pytest.fixture(scope="module")
def model() -> Forward:
    """Return volume and largest steady pressure of Example 2 over coefficients of wear and friction."""
    return forward(load_case("example2", FEW), ["volume", "steady pressure"], KEYS)


def test_values_and_derivatives_are_those_of_the_case(model: Forward) -> None:
    """The worn volume is beta~ F s, its elasticity to beta~ is 1; friction does not change it."""
    at = [4e-8, 0.25]
    values = model.values(at)
    assert values[0] == pytest.approx(4e-8 * 10e3 * 20 * 3.0, rel=1e-9)
    assert model.jacobian(at)[0] == pytest.approx([values[0] / at[0], 0.0], rel=1e-5, abs=1e-6)
    with pytest.raises(CaseError, match="coefficient"):
        model.values([-1.0, 0.25])


@pytest.mark.parametrize(
    ("quantities", "keys", "key"),
    [
        (["width of moon"], KEYS, "--of"),
        (["depth"], ["contact.stickiness"], "contact.stickiness"),
        (["depth"], [], "--to"),
        ([], KEYS, "--of"),
    ],
)
def test_bad_quantities_and_keys_are_named(quantities: list[str], keys: list[str], key: str) -> None:
    with pytest.raises(CaseError, match=key):
        forward(load_case("example2", FEW), quantities, keys)
