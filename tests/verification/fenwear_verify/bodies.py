"""The bodies of the verification cases: two blocks, a rigid punch on a half-plane; how fast wear relieves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from fenwear.case import Case, load_case, make_case
from fenwear.common.arrays import Array
from fenwear.system import Bodies, Tribosystem, assemble, build_bodies

STEEL = {"young": 2e5, "poisson": 0.3}


def two_blocks(
    punch_material: Mapping[str, float], strip_material: Mapping[str, float], sizes: Mapping[str, float], **tables: Any
) -> Tribosystem:
    """Return two rectangles of the same width on each other, see `two_block_case`; collective."""
    return assemble(two_block_case(punch_material, strip_material, sizes, **tables))


def bodies_of_blocks(
    punch_material: Mapping[str, float], strip_material: Mapping[str, float], sizes: Mapping[str, float], **tables: Any
) -> Bodies:
    """Return two rectangles that are neither condensed nor joined, see `two_block_case`; collective."""
    return build_bodies(two_block_case(punch_material, strip_material, sizes, **tables))


def two_block_case(
    punch_material: Mapping[str, float],
    strip_material: Mapping[str, float],
    sizes: Mapping[str, float],
    *,
    degree: int = 2,
    plane: str = "strain",
    punch: Mapping[str, Any] | None = None,
    strip: Mapping[str, Any] | None = None,
    **tables: Any,
) -> Case:
    """Return the case of two rectangles of the same width on each other.

    The punch is pressed down with 1 MPa, its sides held in x; the strip stands on its held far side.

    Args:
        punch_material, strip_material: Tables of a case file's `materials`.
        sizes: Parameters of blocks.geo.
        degree: Of the elements.
        plane: "stress" or "strain".
        punch, strip: Further keys of the bodies' tables.
        tables: Further tables of the case.
    """
    case = {
        "geometry": {"file": "blocks.geo", "degree": degree, "parameters": dict(sizes)},
        "model": {"plane": plane},
        "materials": {"of_punch": dict(punch_material), "of_strip": dict(strip_material)},
        "punch": {
            "regions": {"punch_body": "of_punch"},
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "traction": [0, -1]}],
            **(punch or {}),
        },
        "strip": {
            "regions": {"strip_body": "of_strip"},
            "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
            **(strip or {}),
        },
        "wear": {"punch": {"coefficient": 0}},
        "motion": {"kind": "one-way", "direction": "rightward", "speed": 1.0, "duration": 1.0},
        "run": {"half_cycles": 1},
        **tables,
    }
    return make_case(case)


def clamped(body: str, groups: Sequence[str] = ("sides", "far", "contact")) -> dict[str, Any]:
    """Return the supports that clamp these groups of a block."""
    return {"supports": [{"on": f"{body}_{group}", "fix": ["x", "z"]} for group in groups]}


@cache
def builtin(name: str, *settings: str) -> Tribosystem:
    """Return a built-in case's system, prepared once for all cases that ask for it; collective."""
    return assemble(load_case(name, settings))


@cache
def rigid_punch(depth: float, *settings: str) -> Tribosystem:
    """Return a flat rigid punch of half-width 30 mm, which only translates, on a strip of this depth; collective.

    To (30 mm / depth)² the strip is an elastic half-plane. No friction but by the settings.
    """
    return builtin(
        "example2",
        "materials.rigid={young=2e11, poisson=0.3}",
        "punch.regions={punch_lower='rigid', punch_upper='rigid'}",
        f"geometry.parameters.strip_height={depth}",
        f"geometry.parameters.strip_length={4 * depth}",
        "contact.friction=0",
        *settings,
    )


def relief_rates(system: Tribosystem, modulus: float, speed: Array | float = 1.0) -> Array:
    """Return the eigenvalues (n,) of the pressure that worn depths take away in closed contact, times a modulus.

    Args:
        system: Without friction.
        modulus: That the compliance is measured by, MPa.
        speed: At which the nodes wear (n,).
    """
    rigid = system.rigid
    n, r = rigid.rigid_normal.shape
    matrix = np.zeros((n + r, n + r))
    matrix[:n, :n] = system.elastic.interface.compliance(0.0, modulus).matrix()
    matrix[:n, n:] = rigid.rigid_normal
    matrix[n:, :n] = rigid.equilibrium(0.0)
    return np.asarray(np.linalg.eigvals(np.linalg.inv(matrix)[:n, :n] * speed).real)
