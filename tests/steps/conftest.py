"""Small bodies in contact with stick."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import pytest

from fenwear.case import Case
from fenwear.steps.stick_interface import StickInterface
from fenwear.system import build_bodies, make_sliding
from fenwear_verify.bodies import two_block_case

SOFT, STIFF = {"young": 7e4, "poisson": 0.1}, {"young": 2e5, "poisson": 0.35}
LOAD = 100.0  # N/mm


def blocks(**tables: Any) -> Case:
    """Return two unlike blocks of 20 x 10 mm, 21 contact nodes in their even middle of 2 mm, the punch pressed down."""
    sizes = {"width": 20, "punch_height": 10, "strip_height": 10, "core": 2, "across": 10, "outer": 4, "spread": 2}
    layers = {"punch_layers": 5, "strip_layers": 5, "growth": 2}
    settings: dict[str, Any] = {
        "contact": {"friction": 0.5},
        "punch": {
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "force": [0, -LOAD]}],
        },
    }
    return two_block_case(SOFT, STIFF, {**sizes, **layers}, **{**settings, **tables})


@lru_cache
def _unlike() -> StickInterface:
    case = blocks()
    return StickInterface(build_bodies(case), make_sliding(case), case)


@pytest.fixture(scope="session")
def unlike() -> Callable[[], StickInterface]:
    """Return the blocks, made once."""
    return _unlike
