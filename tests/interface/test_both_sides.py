"""A ring between shoes on both of its sides, in the plane: each patch has its own side opposite."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fenwear import assemble, make_case, march
from fenwear.interface.patches import patches

RING = """
SetFactory("OpenCASCADE");
Point(1) = {0, 0, 0};
Circle(1) = {0, 0, 0, 20, 0, 2 * Pi}; Circle(2) = {0, 0, 0, 24, 0, 2 * Pi};
Curve Loop(1) = {1}; Curve Loop(2) = {2}; Plane Surface(1) = {2, 1};
r[] = {24, 30, 20, 14}; a = 60 * Pi / 180;
For k In {0 : 3}
  Circle(100 + k) = {0, 0, 0, r[k], a, Pi - a};
EndFor
For k In {0 : 1}
  b[] = Boundary{ Curve{100 + 2 * k}; }; d[] = Boundary{ Curve{101 + 2 * k}; };
  l = newl; Line(l) = {b[0], d[0]}; Line(l + 1) = {b[1], d[1]};
  c = newll; Curve Loop(c) = {100 + 2 * k, l + 1, -(101 + 2 * k), -l}; s = news; Plane Surface(s) = {c}; shoe[k] = s;
EndFor
Mesh.MeshSizeMax = 1.5;
Physical Surface("strip_ring") = 1; Physical Curve("strip_contact_in") = 1; Physical Curve("strip_contact_out") = 2;
Physical Surface("punch_shoes") = shoe[];
Physical Curve("punch_contact_out") = 100; Physical Curve("punch_contact_in") = 102;
Physical Curve("punch_above") = 101; Physical Curve("punch_below") = 103;
"""


def test_shoes_inside_and_outside_a_ring(tmp_path: Path) -> None:
    """Pressed against each other through the ring: each carries its load, and the ring's supports none."""
    (tmp_path / "ring.geo").write_text(RING)
    steel = {"young": 210e3, "poisson": 0.3}
    case = {
        "geometry": {"file": str(tmp_path / "ring.geo"), "degree": 2, "order": 2},
        "model": {"plane": "strain", "thickness": 1.0},
        "materials": {"steel": steel},
        "punch": {
            "regions": {"punch_shoes": "steel"},
            "no_turning_about": ["y"],
            "supports": [{"on": "punch_above", "fix": ["x"]}, {"on": "punch_below", "fix": ["x"]}],
            "loads": [{"on": "punch_above", "force": [0, -40]}, {"on": "punch_below", "force": [0, 40]}],
        },
        "strip": {
            "regions": {"strip_ring": "steel"},
            "supports": [{"at": [20, 0], "fix": ["x", "z"]}, {"at": [24, 0], "fix": ["x", "z"]}],
        },
        "contact": {"friction": 0.0},
        "wear": {"punch": {"coefficient": 1e-7}},
        "motion": {"kind": "rotation", "axis": [0, 1, 0], "angular_speed": 1.0, "duration": 1.0},
        "run": {"half_cycles": 1},
    }
    system = assemble(make_case(case))
    pair = system.pair
    assert len(patches(pair.punch, pair.strip)) == 2
    np.testing.assert_allclose(pair.initial_gap, 0, atol=1e-3)
    assert set(system.rigid.mode_names) == {"lambda_F_in", "lambda_F_out"}
    (block,) = march(system, 1)
    for name, force in (("out", 40), ("in", -40)):
        own = pair.punch.nodes_of(name)
        carried = (pair.weights[own] * block.pressure[-1][own]) @ pair.normal[own]
        np.testing.assert_allclose(carried, [0, force], atol=1e-2)
