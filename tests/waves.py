"""A hard block on a wavy one, whose pressures and wear are known."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear import Case

LENGTH, HEIGHT, FULL = 0.05, 1e-4, np.pi * 2e5 / (1 - 0.3**2) * 1e-4 / 0.05  # lam, h, mm, and p* = pi E* h / lam, MPa


def wavy(load: float, nodes: int = 1281, worn: float = 0.0, output: dict[str, Any] | None = None, **run: Any) -> Case:
    """Return a hard block on a wavy one of E = 200 GPa, plane strain, as half-planes over 20 waves.

    Args:
        load: Over the width, MPa.
        nodes: Of the grid.
        worn: Wear coefficient of the wavy one.
        output: Table of what is written.
        run: How far and how.
    """
    return Case.model_validate(
        {
            "geometry": {"file": "blocks.geo", "degree": 2, "parameters": {"margin": 0.2}},
            "model": {"kind": "plane", "plane": "strain"},
            "materials": {"steel": {"young": 2e5, "poisson": 0.3}, "hard": {"young": 2e9, "poisson": 0.3}},
            "punch": {
                "regions": {"punch_body": "hard"},
                "supports": [{"on": "punch_far", "fix": ["x"]}],
                "no_turning_about": ["y"],
                "loads": [{"on": "punch_far", "force": [0, -load]}],
                "operator": "half-space",
            },
            "strip": {
                "regions": {"strip_body": "steel"},
                "supports": [{"on": "strip_far", "fix": ["x", "z"]}],
                "operator": "half-space",
                "topography": {"amplitude": HEIGHT, "wavelength": [LENGTH]},
            },
            "grid": {"nodes": nodes, "size": [1.0]},
            "contact": {"friction": 0.0},
            "wear": {"strip": {"coefficient": worn}},
            "motion": {"kind": "reciprocating", "amplitude": 0.01, "period": 1.0},
            "run": {"half_cycles": 2, **run},
            "output": output or {},
        }
    )
