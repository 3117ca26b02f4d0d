"""Two cylinders of steel on each other, equal ones mirror images to the last digit, held and loaded as such."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.case import Case, make_case
from fenwear.common.arrays import Array
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_state import Imposed, StickState
from fenwear.system import build_bodies, make_sliding

YOUNG, POISSON, RADIUS = 2e5, 0.3, 8.0
MODULUS = YOUNG / (2 * (1 - POISSON**2))


def line_load(half_width: float) -> float:
    """Return the load of a contact of this half-width between equal cylinders, N/mm."""
    return float(np.pi * MODULUS * half_width**2 / (2 * RADIUS))


@lru_cache
def cylinders(half_width: float, elements: int) -> StickInterface:
    """Return equal cylinders under the load of a half-width, mm, with elements on three times it."""
    return _interface(*_equal(half_width, elements))


def equal_cylinders(half_width: float, elements: int, force: float) -> Case:
    """Return the case of the same that wear under a tangential force to and fro, N/mm."""
    wear = {"wear": {"punch": {"coefficient": 1e-8}, "strip": {"coefficient": 1e-8}}}
    return _case(*_equal(half_width, elements), stick={"force": force, "steps": 6}, **wear)


def _equal(half_width: float, elements: int) -> tuple[str, dict[str, float], str, float, dict[str, Any]]:
    load = line_load(half_width)
    sizes = {"contact_width": 3 * half_width, "elements_along_contact": elements}
    strip = {
        "supports": [{"on": "strip_sides", "fix": ["x"]}, {"on": "strip_axis", "fix": ["z"]}],
        "loads": [{"on": "strip_far", "force": [0, load]}],
    }
    return str(Path(__file__).with_name("cylinders.geo")), sizes, "punch_far", load, strip


def on_flat(half_width: float) -> StickInterface:
    """Return a cylinder on a large flat, under the load of a half-width, mm."""
    sizes = {"radius": RADIUS, "strip_length": 80, "strip_height": 40, "overlap": 0, "contact_width": 3 * half_width}
    strip = {"supports": [{"on": "strip_bottom", "fix": ["x", "z"]}]}
    return _interface("cylinder_on_flat.geo", sizes, "punch_top", line_load(half_width) / 2, strip)


def _interface(file: str, sizes: dict[str, float], top: str, load: float, strip: dict[str, Any]) -> StickInterface:
    case = _case(file, sizes, top, load, strip)
    return StickInterface(build_bodies(case), make_sliding(case), case)


def _case(file: str, sizes: dict[str, float], top: str, load: float, strip: dict[str, Any], **tables: Any) -> Case:
    return make_case(
        {
            "geometry": {"file": file, "degree": 2, "order": 2, "parameters": sizes},
            "model": {"plane": "strain"},
            "materials": {"steel": {"young": YOUNG, "poisson": POISSON}},
            "punch": {
                "regions": {"punch_body": "steel"},
                "supports": [{"on": "punch_sides", "fix": ["x"]}],
                "loads": [{"on": top, "force": [0, -load]}],
            },
            "strip": {"regions": {"strip_body": "steel"}, **strip},
            "contact": {"law": "coulomb", "friction": 0.2},
            "wear": {"punch": {"coefficient": 0}},
            "motion": {"kind": "reciprocating", "profile": "triangular", "amplitude": 1e-3, "period": 1},
            "run": {"half_cycles": 2},
            **tables,
        }
    )


def pressed(interface: StickInterface, friction: float) -> tuple[StickState, Imposed]:
    """Return the contact under the load alone, in four steps, and what is imposed then: no force."""
    loaded, gap = interface.loaded(None), interface.middle.pair.initial_gap
    mu = np.full(len(gap), friction)
    state, start = untouched(interface), Imposed(loaded.times(0), gap)
    for share in (0.25, 0.5, 0.75, 1.0):
        end = Imposed(loaded.times(share), gap)
        state, start = advance(interface, state, start, end, mu), end
    return state, replace(start, displacement=None, force=0.0)


def pulled(interface: StickInterface, friction: float, force: float) -> tuple[StickState, Array]:
    """Return the contact after a tangential force, N/mm, has risen in eight steps, and what has slipped (n,), mm."""
    state, start = pressed(interface, friction)
    slid = np.zeros(len(start.opening))
    for share in np.linspace(0.125, 1, 8):
        end = replace(start, force=float(share) * force)
        state, start = advance(interface, state, start, end, np.full(len(start.opening), friction)), end
        slid += np.abs(state.slip[:, 0])
    return state, slid


def cattaneo(x: Array, half_width: float, friction: float, share: float) -> Array:
    """Return the traction of half-planes at a force Q = share mu P, MPa."""
    c = half_width * np.sqrt(1 - share)
    whole, stuck = (np.sqrt(np.maximum(1 - (x / r) ** 2, 0)) for r in (half_width, c))
    return np.asarray(friction * 2 * line_load(half_width) / (np.pi * half_width) * (whole - c / half_width * stuck))
