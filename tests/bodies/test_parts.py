"""Bodies of several parts that nothing joins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import CaseError, assemble, load_case, make_case
from fenwear.bodies.mesh import build_meshes
from fenwear.bodies.parts import connected_parts, part_boxes
from fenwear.case import Geometry

# Two pads on one plate; joined = 1 has a bridge over them.
PADS = """
DefineConstant[ joined = 0 ];
For k In {0 : 1}
  x = 4 * k;
  a = newp; Point(a) = {x, 0, 0}; Point(a + 1) = {x + 2, 0, 0}; Point(a + 2) = {x + 2, 1, 0}; Point(a + 3) = {x, 1, 0};
  l = newl; Line(l) = {a, a + 1}; Line(l + 1) = {a + 1, a + 2}; Line(l + 2) = {a + 2, a + 3}; Line(l + 3) = {a + 3, a};
  c = newll; Curve Loop(c) = {l, l + 1, l + 2, l + 3}; s = news; Plane Surface(s) = {c};
  Transfinite Curve{l, l + 2} = 5; Transfinite Curve{l + 1, l + 3} = 3; Transfinite Surface{s}; Recombine Surface{s};
  lower[] += l; sides[] += {l + 1, l + 3}; upper[] += l + 2; pads[] += s; inner[k] = (k == 0) ? l + 1 : l + 3;
EndFor
If(joined)
  a = newp; Point(a) = {2, 0.5, 0};
  l = newl; Line(l) = {3, 8}; Line(l + 1) = {5, 2};
  c = newll; Curve Loop(c) = {inner[0], l, inner[1], l + 1}; s = news; Plane Surface(s) = {c};
  Transfinite Curve{l, l + 1} = 3; Transfinite Surface{s}; Recombine Surface{s}; pads[] += s;
EndIf
p = newp; Point(p) = {-3, 0, 0}; Point(p + 1) = {9, 0, 0}; Point(p + 2) = {9, -3, 0}; Point(p + 3) = {-3, -3, 0};
m = newl; Line(m) = {p, p + 1}; Line(m + 1) = {p + 1, p + 2}; Line(m + 2) = {p + 2, p + 3}; Line(m + 3) = {p + 3, p};
c = newll; Curve Loop(c) = {m, m + 1, m + 2, m + 3}; plate = news; Plane Surface(plate) = {c};
Transfinite Curve{m, m + 2} = 13; Transfinite Curve{m + 1, m + 3} = 4; Transfinite Surface{plate};
Recombine Surface{plate};
Physical Surface("punch_body") = pads[]; Physical Curve("punch_contact") = lower[];
Physical Curve("punch_far") = upper[]; Physical Curve("punch_sides") = sides[];
Physical Surface("strip_body") = plate; Physical Curve("strip_contact") = m; Physical Curve("strip_far") = m + 2;
"""


def tables(folder: Path, **parameters: float) -> dict[str, Any]:
    if MPI.COMM_WORLD.rank == 0:
        (folder / "pads.geo").write_text(PADS)
    MPI.COMM_WORLD.barrier()
    found = load_case("example2").resolved()
    found["geometry"] = {"file": str(folder / "pads.geo"), "degree": 1, "parameters": parameters}
    found["materials"] = {"steel": {"young": 2e5, "poisson": 0.3}}
    found["punch"] = {
        "regions": {"punch_body": "steel"},
        "supports": [{"on": "punch_far", "fix": ["x"]}],
        "loads": [{"on": "punch_far", "force": [0.0, -1000.0]}],
    }
    found["strip"] = {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_far", "fix": ["x", "z"]}]}
    return found


@pytest.mark.mpi
def test_parts_are_found(tmp_path: Path) -> None:
    """Both pads by their boxes on any number of ranks; one part where they are joined."""
    for joined, count in ((0, 2), (1, 1)):
        tables(tmp_path)
        geometry = Geometry(file=str(tmp_path / "pads.geo"), parameters={"joined": joined})
        punch, strip = build_meshes(geometry, None, MPI.COMM_WORLD)
        part = connected_parts(punch.mesh)
        assert MPI.COMM_WORLD.allreduce(int(part.max(initial=0)), MPI.MAX) + 1 == count
        assert connected_parts(strip.mesh).max(initial=0) == 0
        if count == 2:
            boxes = part_boxes(punch.mesh, part, 2)
            np.testing.assert_allclose(boxes[:, :, 0], [[0, 2], [4, 6]], atol=1e-12)


@pytest.mark.mpi
def test_parts_that_nothing_holds(tmp_path: Path) -> None:
    """Two pads with one load: their pressures were F / A at all nodes, into each other by 33 um, without a word."""
    expected = r"punch\.supports: the punch is of 2 parts .*x = 0 to 2 mm; x = 4 to 6 mm.* parts 1 and 2 could move"
    with pytest.raises(CaseError, match=expected):
        assemble(make_case(tables(tmp_path)))
    joined = assemble(make_case(tables(tmp_path, joined=1)))
    pressure = joined.contact((1,)).solve(joined.pair.initial_gap).pressure[0]
    assert joined.pair.weights @ pressure == pytest.approx(100.0, rel=1e-9)  # of 10 mm thickness


def test_parts_that_are_held(tmp_path: Path) -> None:
    """Each pad held in all directions at its top is a body of its own: no rigid motion is left to mix them up."""
    found = tables(tmp_path)
    found["punch"]["supports"] = [{"on": "punch_far", "fix": ["x", "z"]}]
    found["punch"]["loads"] = [{"on": "punch_sides", "traction": [0.0, -50.0]}]
    system = assemble(make_case(found))
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    assert (contact.pressure > 0).any()
    assert (contact.gap[contact.pressure > 0] < 1e-12).all()
