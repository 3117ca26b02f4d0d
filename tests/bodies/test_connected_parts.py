"""Bodies of several parts that nothing joins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import CaseError, assemble, load_case, make_case, steady
from fenwear.bodies.connected_parts import connected_parts, part_boxes
from fenwear.bodies.distributed_mesh import build_meshes
from fenwear.case import Geometry

# Two pads on one plate; joined = 1 has a bridge over them.
PADS = """
DefineConstant[ joined = 0, apart = 0, named = 0, meet = 0 ];
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
Physical Surface("punch_body") = pads[];
If(named)
  Physical Curve("punch_contact_right") = lower[1]; Physical Curve("punch_contact_left") = lower[0];
  If(meet)
    Physical Curve("punch_contact_side") = inner[0];
  EndIf
EndIf
If(!named || meet > 1)
  Physical Curve("punch_contact") = lower[];
EndIf
If(apart)
  Physical Curve("punch_left") = upper[0]; Physical Curve("punch_right") = upper[1];
Else
  Physical Curve("punch_far") = upper[];
EndIf
Physical Curve("punch_sides") = sides[];
Physical Surface("strip_body") = plate; Physical Curve("strip_contact") = m; Physical Curve("strip_far") = m + 2;
"""


# Two pads on sectors of a disc, of 60 degrees and 30; opposed = 1: the second at the disc's lower face.
BRAKE = """
DefineConstant[ opposed = 0 ];
pads[] = {}; touching[] = {}; disc[] = {}; rubbed[] = {}; held[] = {};
For k In {0 : 1}
  below = (opposed && k == 1) ? 1 : 0;
  For of In {0 : 1}  // the pad, and the disc's sector
    half = ((k == 0) ? Pi / 6 : Pi / 12) + 0.05 * of; from = k * Pi - half; to = k * Pi + half;
    r1 = 60 - 5 * of; r2 = 100 + 5 * of; across = 4 + of; around = ((k == 0) ? 8 : 4) + of;
    z = (below && !of) ? -8 : 0; up = of ? -8 : (below ? -10 : 10);
    a = newp; Point(a) = {r1 * Cos(from), r1 * Sin(from), z}; Point(a + 1) = {r2 * Cos(from), r2 * Sin(from), z};
    Point(a + 2) = {r2 * Cos(to), r2 * Sin(to), z}; Point(a + 3) = {r1 * Cos(to), r1 * Sin(to), z};
    Point(a + 4) = {0, 0, z};
    l = newl; Line(l) = {a, a + 1}; Circle(l + 1) = {a + 1, a + 4, a + 2}; Line(l + 2) = {a + 2, a + 3};
    Circle(l + 3) = {a + 3, a + 4, a};
    Transfinite Curve{l, l + 2} = across + 1; Transfinite Curve{l + 1, l + 3} = around + 1;
    c = newll; Curve Loop(c) = {l, l + 1, l + 2, l + 3}; flat = news; Plane Surface(flat) = {c};
    Transfinite Surface{flat}; Recombine Surface{flat};
    body[] = Extrude {0, 0, up} { Surface{flat}; Layers{2}; Recombine; };
    If(of)
      disc[] += body[1]; rubbed[] += below ? body[0] : flat; held[] += body[3];
    Else
      pads[] += body[1]; touching[] += flat; back~{k} = body[0];
    EndIf
  EndFor
EndFor
Physical Volume("punch_body") = pads[]; Physical Surface("punch_contact") = touching[];
Physical Surface("punch_first") = back_0; Physical Surface("punch_second") = back_1;
Physical Volume("strip_body") = disc[]; Physical Surface("strip_contact") = rubbed[];
Physical Surface("strip_ends") = held[];
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
@pytest.mark.parametrize("forces", [(-1000.0,), (-300.0, -900.0)])
def test_parts_that_move_by_themselves(forces: tuple[float, ...], tmp_path: Path) -> None:
    """Two pads, under one load on both or each under its own: no node of one is in the plate when the other touches.

    As one rigid body their pressures were F / A at all nodes, into each other by 33 um. Steady, each wears evenly.
    """
    apart = len(forces) == 2
    found, groups = tables(tmp_path, apart=float(apart)), ("punch_left", "punch_right") if apart else ("punch_far",)
    found["punch"]["supports"] = [{"on": group, "fix": ["x"]} for group in groups]
    found["punch"]["loads"] = [{"on": on, "force": [0.0, force]} for on, force in zip(groups, forces, strict=True)]
    found["punch"]["no_turning_about"] = ["y"]
    system = assemble(make_case(found))
    assert system.rigid.mode_names == ("lambda_F_1", "lambda_F_2")
    left, weights = system.pair.x < 3, system.pair.weights
    shares = np.array(forces if apart else (forces[0] / 2,) * 2) / -10.0  # of 10 mm thickness
    assert system.normal_force == pytest.approx(10 * shares.sum(), rel=1e-12)
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    assert np.abs(contact.gap[contact.pressure > 0]).max() < 1e-12
    assert contact.gap.min() > -1e-12
    for own, share in zip((left, ~left), shares, strict=True):
        assert weights[own] @ contact.pressure[0, own] == pytest.approx(share, rel=1e-9)
        np.testing.assert_allclose(system.optimum(1).pressure[own], share / 2, rtol=1e-9)  # of 2 mm
        np.testing.assert_allclose(steady(system).phase_pressure.mean(axis=0)[own], share / 2, rtol=1e-6)


def test_joined_parts(tmp_path: Path) -> None:
    """Pads that a bridge joins have one rigid motion and one load."""
    joined = assemble(make_case(tables(tmp_path, joined=1)))
    pressure = joined.contact((1,)).solve(joined.pair.initial_gap).pressure[0]
    assert joined.pair.weights @ pressure == pytest.approx(100.0, rel=1e-9)


@pytest.mark.mpi
def test_a_part_that_neither_touches_nor_is_held(tmp_path: Path) -> None:
    """It is named: mostly a mesh whose layers share no nodes."""
    found = tables(tmp_path)
    text = (tmp_path / "pads.geo").read_text()
    MPI.COMM_WORLD.barrier()
    if MPI.COMM_WORLD.rank == 0:
        (tmp_path / "pads.geo").write_text(text.replace("= lower[];", "= lower[0];"))
    MPI.COMM_WORLD.barrier()
    expected = r"punch\.supports: the punch has 2 parts .*x = 0 to 2 mm; x = 4 to 6 mm.* part 2 neither touches nor"
    with pytest.raises(CaseError, match=expected):
        assemble(make_case(found))


def test_parts_that_are_held(tmp_path: Path) -> None:
    """Each pad held in all directions at its top is a body of its own: no rigid motion is left to mix them up."""
    found = tables(tmp_path)
    found["punch"]["supports"] = [{"on": "punch_far", "fix": ["x", "z"]}]
    found["punch"]["loads"] = [{"on": "punch_sides", "traction": [0.0, -50.0]}]
    system = assemble(make_case(found))
    contact = system.contact((1,)).solve(system.pair.initial_gap)
    assert (contact.pressure > 0).any()
    assert (contact.gap[contact.pressure > 0] < 1e-12).all()


@pytest.mark.parametrize("opposed", [0, 1])
def test_two_pads_on_one_disc(opposed: int, tmp_path: Path) -> None:
    """Both on one face of a disc that wears, too, or on both faces: p r is even in each pad, by its own load.

    Rates of approach k omega p r, the disc's by what both spread along its whole circumference.
    """
    (tmp_path / "brake.geo").write_text(BRAKE)
    found = load_case("brake-pad", ["unset=heat"]).resolved()
    found["geometry"] = {"file": str(tmp_path / "brake.geo"), "degree": 1, "parameters": {"opposed": opposed}}
    found["materials"] = {"steel": {"young": 2e5, "poisson": 0.3}}
    loads = {"punch_first": -5000.0, "punch_second": 2000.0 if opposed else -2000.0}
    found["punch"] = {
        "regions": {"punch_body": "steel"},
        "supports": [{"on": on, "fix": ["x", "y"]} for on in loads],
        "loads": [{"on": on, "force": [0.0, 0.0, force]} for on, force in loads.items()],
        "no_turning_about": ["x", "y"],
    }
    found["strip"] = {"regions": {"strip_body": "steel"}, "supports": [{"on": "strip_ends", "fix": ["x", "y", "z"]}]}
    found["wear"] = {"punch": {"coefficient": 1e-8}, "strip": {"coefficient": 0.0 if opposed else 1e-9}}
    found["contact"] = {"friction": 0.3}
    found["motion"] = {"kind": "rotation", "axis": [0, 0, 1], "angular_speed": 10.0, "duration": 1.0}
    system = assemble(make_case(found))
    assert system.rigid.mode_names == ("lambda_F_1", "lambda_F_2")
    assert system.normal_force == pytest.approx(7000, rel=1e-9)
    x, weights = system.pair.punch.x, system.pair.weights
    radius, first = np.hypot(x[:, 0], x[:, 1]), x[:, 0] > 0
    best = system.optimum(1)
    spread = 0.0 if opposed else 2.7852115e-7
    for name, own, load, rate in (
        ("lambda_F_2", first, 5000, 1.1936621e-5),
        ("lambda_F_1", ~first, 2000, 9.5492966e-6),
    ):
        assert weights[own] @ best.pressure[own] == pytest.approx(load, rel=1e-8)
        pressed = (best.pressure * radius)[own]
        assert np.ptp(pressed) < 0.01 * pressed.mean()
        assert abs(best.velocity[name]) == pytest.approx(rate + spread, rel=0.01)
    pressure = steady(system).phase_pressure[0]
    np.testing.assert_allclose(pressure, best.pressure, rtol=0, atol=1e-6 * best.pressure.max())
