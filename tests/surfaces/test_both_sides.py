"""A ring between shoes on both of its sides, in the plane: each patch has its own side opposite."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import assemble, make_case, march, run_case, steady
from fenwear.surfaces.patches import patches

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


COLLAR = """
// The collar from -4 to 0 between rings from 0 to 4 and from -8 to -4; x is the radius.
Point(1) = {15, -4, 0}; Point(2) = {20, -4, 0}; Point(3) = {30, -4, 0}; Point(4) = {32, -4, 0};
For k In {1 : 3}
  Line(k) = {k, k + 1}; Transfinite Curve{k} = (k == 2) ? 9 : 3;
EndFor
s[] = {}; top[] = {};
For k In {1 : 3}
  e[] = Extrude {0, 4, 0} { Line{k}; Layers{4}; Recombine; };
  s[] += e[1]; top[] += e[0];
  If(k == 1)
    bore = e[3];
  EndIf
EndFor
For k In {0 : 1}
  p = newp; y = -4 * k; h = 4 - 8 * k;
  Point(p) = {20, y, 0}; Point(p + 1) = {30, y, 0}; Point(p + 2) = {30, y + h, 0}; Point(p + 3) = {20, y + h, 0};
  l = newl; Line(l) = {p, p + 1}; Line(l + 1) = {p + 1, p + 2}; Line(l + 2) = {p + 2, p + 3}; Line(l + 3) = {p + 3, p};
  Transfinite Curve{l, l + 2} = 9; Transfinite Curve{l + 1, l + 3} = 5;
  c = newll; Curve Loop(c) = {l : l + 3}; r = news; Plane Surface(r) = {c};
  Transfinite Surface{r}; Recombine Surface{r};
  face~{k} = l; back~{k} = l + 2; ring~{k} = r;
EndFor
Physical Surface("strip_collar") = s[]; Physical Curve("strip_bore") = bore;
Physical Curve("strip_contact_upper") = top[1]; Physical Curve("strip_contact_lower") = 2;
Physical Surface("punch_rings") = {ring_0, ring_1};
Physical Curve("punch_contact_upper") = face_0; Physical Curve("punch_contact_lower") = face_1;
Physical Curve("punch_above") = back_0; Physical Curve("punch_below") = back_1;
"""


@pytest.mark.parametrize("below", [2000.0, 1000.0])
def test_rings_on_both_faces_of_a_collar(below: float, tmp_path: Path) -> None:
    """A thrust collar that turns: each ring carries its load; worn in p = F / (2 pi r b), depths k F s / A by name."""
    (tmp_path / "collar.geo").write_text(COLLAR)
    loads = {"upper": 2000.0, "lower": below}
    case = make_case({
        "geometry": {"file": str(tmp_path / "collar.geo"), "degree": 2},
        "model": {"kind": "axisymmetric"},
        "materials": {"steel": {"young": 210e3, "poisson": 0.3}},
        "punch": {
            "regions": {"punch_rings": "steel"},
            "loads": [{"on": "punch_above", "force": [0, -2000]}, {"on": "punch_below", "force": [0, below]}],
        },
        "strip": {"regions": {"strip_collar": "steel"}, "supports": [{"on": "strip_bore", "fix": ["x", "z"]}]},
        "contact": {"friction": 0.1},
        "wear": {"punch": {"coefficient": 5e-9}, "strip": {"coefficient": 1e-9}},
        "motion": {"kind": "rotation", "angular_speed": 1.0, "duration": 2 * np.pi},
        "run": {"half_cycles": 50_000, "integration": "jump"},
        "output": {"report": False, "uncertainty": False},
    })  # fmt: skip
    system = assemble(case)
    assert set(system.rigid.mode_names) == {"lambda_F_upper", "lambda_F_lower"}
    surface = system.pair.punch
    start = system.contact((1,)).solve(system.pair.initial_gap).pressure.reshape(-1)
    upper, lower = (np.flatnonzero(surface.nodes_of(name)) for name in loads)
    upper, lower = (own[np.argsort(surface.x[own, 0])] for own in (upper, lower))
    if below == 2000:
        np.testing.assert_allclose(start[upper], start[lower], rtol=1e-9)
    worn_in = steady(system).pressure[0]
    for own, load in zip((upper, lower), loads.values(), strict=True):
        np.testing.assert_allclose(worn_in[own], load / (2 * np.pi * surface.x[own, 0] * 10), rtol=1e-6)
    summary, _ = run_case(case, "collar", tmp_path / "run", lambda _message: None, progress="none")
    for name, load in loads.items():
        told = summary["contacts"][name]
        assert told["pressure_integral_N"] == pytest.approx(load, rel=1e-9)
        worn = told["friction_work_mJ"] / 0.1  # F s, N mm
        assert told["punch"]["worn_volume_mm3"] == pytest.approx(5e-9 * worn, rel=1e-6)
        assert told["strip"]["worn_volume_mm3"] == pytest.approx(1e-9 * worn, rel=1e-2)
    assert summary["contacts"]["upper"]["force_z_N"] == pytest.approx(2000, rel=1e-6)
    assert summary["contacts"]["lower"]["force_z_N"] == pytest.approx(-below, rel=1e-6)
