"""Heat in solids."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear.cycle import march
from fenwear.verify.solid import STEEL, solve
from fenwear.verify.suite import Result, Row, profile, verification

THERMAL = {**STEEL, "conductivity": 50.0, "heat_capacity": 4.6e8, "density": 7.8e-9, "expansion": 1e-5}


@verification(
    "solid-slice-heat",
    "A solid slice with its sides held is in plane strain, with friction heat, too",
    "the plane model on the same mesh, which is verified by itself",
)
def slice_with_heat() -> Result:
    """Pressure and both surfaces' temperatures after 20 half-cycles, all nodes' temperatures followed."""
    depth = 0.7
    sizes = {"width": 2, "punch_height": 1.5, "strip_height": 1, "punch_layers": 2, "strip_layers": 2, "growth": 1.4}
    shared: dict[str, Any] = {
        "materials": (THERMAL, THERMAL),
        "contact": {"friction": 0.3},
        "wear": {"punch": {"coefficient": 2e-7}},
        "motion": {"kind": "reciprocating", "amplitude": 0.5, "period": 1.0},
        "heat": {"operator": "full", "partition": 0.5, "conductance": 1.0},
    }
    cold = {body: {"temperatures": [{"on": f"{body}_far"}]} for body in ("punch", "strip")}
    flat = solve(
        {"file": "blocks.geo", "degree": 2, "parameters": {**sizes, "across": 4}},
        {
            "supports": [{"on": "punch_sides", "fix": ["x"]}],
            "loads": [{"on": "punch_far", "force": [0, -100]}],
            **cold["punch"],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "z"]}], **cold["strip"]},
        **{**shared, "model": {"plane": "strain", "thickness": depth}},
    )
    held = {body: {"on": f"{body}_ends", "fix": ["y"]} for body in ("punch", "strip")}
    deep = {**sizes, "depth": depth, "across_x": 4, "across_y": 1}
    solid = solve(
        {"file": "solid_blocks.geo", "degree": 2, "parameters": deep},
        {
            "supports": [{"on": "punch_sides", "fix": ["x"]}, held["punch"]],
            "loads": [{"on": "punch_far", "force": [0, 0, -100]}],
            **cold["punch"],
        },
        {"supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}, held["strip"]], **cold["strip"]},
        **shared,
    )
    node = np.searchsorted(flat.pair.x, solid.pair.x - 1e-9)
    (exact,), (found,) = (march(system, 20, block=20) for system in (flat, solid))
    rows: list[Row] = [profile("pressure (MPa)", exact.pressure[-1][node], found.pressure[-1], 1e-9)]
    if exact.heat is None or found.heat is None:
        return Result(rows)
    for body in ("punch", "strip"):
        one, other = (getattr(heat, f"temperature_{body}")[-1] for heat in (exact.heat, found.heat))
        rows.append(profile(f"temperature of the {body} (K)", one[node], other, 1e-9))
    return Result(rows)
