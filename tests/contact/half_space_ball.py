"""A ball on a block, both half-spaces on a contact grid and both worn."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear import Case

WEAR = {"punch": {"coefficient": "1e-6 1/MPa"}, "strip": {"coefficient": "2e-6 1/MPa"}}


def ball(force: float, **more: Any) -> Case:
    """Return a block with the profile of a ball of radius 20 on another one, as half-spaces on a grid.

    Args:
        force: That presses it, N.
        more: Tables in place of those here.
    """
    x = np.linspace(-1.2, 1.2, 49)
    points = [(a, b, (a * a + b * b) / 40) for a in x for b in x]
    body = {"operator": "half-space", "regions": {}}
    data: dict[str, Any] = {
        "geometry": {
            "file": "solid_blocks.geo",
            "degree": 1,
            "parameters": {"width": 2.4, "depth": 2.4, "margin_x": 1, "margin_y": 1, "punch_height": 1}
            | {"strip_height": 1, "across_x": 2, "across_y": 2, "margin_elements": 1, "punch_layers": 1}
            | {"strip_layers": 1},
        },
        "model": {"kind": "solid"},
        "materials": {"steel": {"young": 2.1e5, "poisson": 0.3}, "brass": {"young": 1.0e5, "poisson": 0.34}},
        "punch": body
        | {"regions": {"punch_body": "steel"}, "supports": [{"on": "punch_far", "fix": ["x", "y"]}]}
        | {"loads": [{"on": "punch_far", "force": [0, 0, -force]}], "profile": {"points": points}}
        | {"no_turning_about": ["x", "y", "z"]},
        "strip": body | {"regions": {"strip_body": "brass"}, "supports": [{"on": "strip_far", "fix": ["x", "y", "z"]}]},
        "grid": {"nodes": 15, "size": [2.0, 1.8]},
        "contact": {"friction": 0.3},
        "wear": WEAR,
        "motion": {"kind": "reciprocating", "amplitude": 0.12, "period": 1.0, "positions": 3},
        "run": {"half_cycles": 40, "integration": "jump"},
    }
    return Case.model_validate({**data, **more})
