"""No unit of pressure is hidden in contacts that supports press: bodies a million times as stiff carry as much more."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import pytest

from fenwear import assemble, load_case, march
from fenwear_verify.full_space import nothing_condensed

PRESSED = "punch.supports=[{on='punch_load', fix=['x', 'z'], by=['0 mm', '-0.01 mm']}]"


@pytest.mark.parametrize("how", [nullcontext, nothing_condensed])
def test_pressures_by_moved_supports(how: Callable[[], AbstractContextManager[None]]) -> None:
    """Pressures are proportional to the moduli, and wear to both."""
    found = []
    for stiff in (1.0, 1e-6, 1e6):
        young = (f"materials.steel.young={2e5 * stiff}", f"materials.composite.young={1.3e5 * stiff}")
        wear = f"wear.punch.coefficient={4e-8 / stiff}"
        mesh = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2")
        system = assemble(load_case("example2", [*mesh, *young, wear, "punch.loads=[]", PRESSED]))
        with how():
            (block,) = march(system, 2, implicit=True)
        found.append((block.pressure / stiff, block.wear))
    for other in found[1:]:
        for here, there in zip(found[0], other, strict=True):
            np.testing.assert_allclose(here, there, rtol=0, atol=1e-10 * np.abs(here).max())
