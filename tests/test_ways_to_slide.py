"""Steep cones, and sliding out of the plane with heat."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx.mesh import CellType, create_mesh, create_rectangle
from mpi4py import MPI

from fenwear import Tribosystem, assemble, load_case, make_case, march, own_mesh, steady, to_dataset
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.results import registry

Marker = Callable[[Any], Any]
STEEL = {"young": "210 GPa", "poisson": 0.3}


def cone(body: str, upward: float) -> BodyMesh:
    """Return a ring, 30 mm high, above or below the cone r = z tan 10° between radii of 100 and 108.8 mm."""
    r, height = np.linspace(100, 108.8213, 13), upward * np.linspace(0, 30, 5)
    x = np.array([(a, a / np.tan(np.radians(10)) + h) for a in r for h in height])
    cells = [(k, k + 1, k + 5, k + 6) for k in range(60) if k % 5 != 4]
    element = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))
    mesh = create_mesh(MPI.COMM_SELF, np.array(cells), x, ufl.Mesh(element))

    def at(h: float) -> Marker:
        return lambda x: np.isclose(x[1], x[0] / np.tan(np.radians(10)) + h)

    return own_mesh(body, mesh, {f"{body}_contact": at(0), "far": at(30 * upward)})


def test_a_cone_clutch_of_ten_degrees() -> None:
    """Its axial load is carried by a contact that looks nearly along r: worn, p r is F / (2 pi (r_o - r_i)).

    The torque is mu F (r_i + r_o) / (2 sin 10°).
    """
    case = make_case(
        {
            "geometry": {"degree": 2},
            "model": {"kind": "axisymmetric"},
            "materials": {"steel": STEEL},
            "punch": {"regions": {"punch_body": "steel"}, "loads": [{"on": "far", "force": [0, -3948]}]},
            "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "far", "fix": ["x", "z"]}]},
            "contact": {"friction": 0.2},
            "wear": {"punch": {"coefficient": "1e-9 1/MPa"}},
            "motion": {"kind": "rotation", "axis": [0, 0, 1], "angular_speed": "600 rpm", "duration": "0.1 s"},
            "run": {"half_cycles": 10},
        },
        meshes={"punch": cone("punch", 1), "strip": cone("strip", -1)},
    )
    system = assemble(case, MPI.COMM_SELF)
    pressure = steady(system).pressure[0]
    expected = 3948 / (2 * np.pi * 8.8213)
    np.testing.assert_allclose(pressure * system.pair.x, expected, rtol=2e-3)
    torque = 0.2 * float(system.pair.weights @ (pressure * system.pair.x))
    assert torque == pytest.approx(0.2 * 3948 * (100 + 108.8213) / (2 * np.sin(np.radians(10))), rel=1e-3)


def column(body: str, upward: float) -> BodyMesh:
    """Return a column, 2 mm wide and 10 mm high."""
    mesh = create_rectangle(MPI.COMM_SELF, [(-1, min(0, 10 * upward)), (1, max(0, 10 * upward))], (2, 40),
                            CellType.quadrilateral)  # fmt: skip
    ends = {f"{body}_contact": lambda x: np.isclose(x[1], 0), "far": lambda x: np.isclose(x[1], 10 * upward)}
    return own_mesh(body, mesh, ends)


def test_heat_of_sliding_out_of_the_plane() -> None:
    """Endless along y, nothing changes that way: q = mu p v heats two half-spaces by q sqrt(t / (pi k rho c))."""
    warm = {"conductivity": 50, "heat_capacity": "460 J/(kg K)", "density": "7850 kg/m^3", "expansion": 0}
    case = make_case(
        {
            "geometry": {"degree": 2},
            "model": {"plane": "strain", "thickness": "10 mm"},
            "materials": {"steel": {**STEEL, **warm}},
            "punch": {
                "regions": {"punch_body": "steel"},
                "supports": [{"on": "far", "fix": ["x"]}],
                "loads": [{"on": "far", "force": [0, -200]}],
            },
            "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "far", "fix": ["x", "z"]}]},
            "contact": {"friction": 0.2},
            "wear": {"punch": {"coefficient": 0}},
            "motion": {"kind": "one-way", "axis": "y", "direction": "rightward", "speed": 100, "duration": 0.1},
            "heat": {"conductance": "perfect", "convection": 0, "steps": 20, "convecting_faces": False},
            "run": {"half_cycles": 1},
        },
        meshes={"punch": column("punch", 1), "strip": column("strip", -1)},
    )
    (block,) = march(assemble(case, MPI.COMM_SELF), 1)
    assert block.heat is not None
    capacity = 7850e-12 * 460e6
    expected = 0.2 * 10 * 100 * np.sqrt(0.1 / (np.pi * 50 * capacity))
    for surface in (block.heat.temperature_punch, block.heat.temperature_strip):
        np.testing.assert_allclose(surface[-1], expected, rtol=0.01)
    heat = registry.quantities_of(block.system)["heat_friction"].compute(block)
    assert heat[-1] == pytest.approx(0.2 * 200 * 100 * 0.1, rel=1e-9)  # mu F v t, mJ


def test_rings_stick_in_torsion() -> None:
    """A rigid sphere on a half-space turns it: in partial slip as a solid on grids does, and as a whole.

    With a Poisson's ratio near one half pressure moves nothing along r, as between like bodies.
    `test_a_solid_sticks_in_torsion` gives 0.55486 N mm with friction 0.3, `grid.nodes=65`, 8 steps and 1e-3 rad.
    """
    shear, radius = 2.1e5 / 2.6, (3 * 50 * 10 / (4 * 1.1538e5)) ** (1 / 3)
    young = 2.1e5 / 0.91 * (1 - 0.49**2)
    turn, drop = 0.5 * shear / (young / 2.98), [[float(x), float(x**2 / 40)] for x in np.linspace(0, 0.2, 401)]
    size = (
        "{inner_radius=0, outer_radius=0.2, punch_height=0.2, strip_height=4, margin_inside=0, margin_outside=4, "
        "across=30, edge_grading=1, margin_elements=14, spread=1.3, punch_layers=6, strip_layers=16, growth=1.35}"
    )
    arms = (0.55486, 3 * np.pi * 0.3 * 50 * radius / 16)  # N mm
    for amplitude, expected in zip((1e-3, 1e-2), arms, strict=True):
        case = load_case(
            "ring-on-ring",
            [
                *(f"geometry.parameters={size}", "geometry.degree=2", "contact.law=coulomb", "contact.friction=0.3"),
                "materials.bronze={young='1e9 MPa', poisson=0.3}",
                f"materials.steel={{young='{young} MPa', poisson=0.49}}",
                *("punch.loads=[{on='punch_far', force=['0 N', '-50 N']}]", f"punch.profile.points={drop}"),
                *("wear.strip.coefficient=1e-9", "stick.steps=8", "stick.step_tolerance=1", "run.half_cycles=4"),
                f"motion={{kind='oscillation', axis=[0, 0, 1], amplitude='{turn * amplitude} rad', period='1 s'}}",
            ],
        )
        block = list(march(assemble(case, MPI.COMM_SELF), 4))[-1]
        history, pair = to_dataset(block), block.system.pair
        torque = history.tangential_force.values
        assert np.abs(torque[-1]).max() == pytest.approx(expected, rel=3e-3)
        by_tractions = history.traction.values @ (pair.weights * pair.punch.x[:, 0])
        np.testing.assert_allclose(np.abs(by_tractions), np.abs(torque), atol=1e-9 * expected)
        np.testing.assert_allclose(history.step_pressure.values @ pair.weights, 50.0, rtol=1e-9)
        assert float(history.energy_balance_error.max()) < 1e-8
        assert block.end.worn.strip.max() > 0


def test_a_solid_sticks_in_torsion(assembled: Callable[..., Tribosystem]) -> None:
    """Two half-spaces that stick turn by T = 8/3 G a^3 (R. D. Mindlin, 1949)."""
    small = "{radius=10, contact_width=0.4, stroke=0, across=4, margin_elements=1, ball_layers=2, flat_layers=2}"
    system = assembled(
        *("fretting-sphere", f"geometry.parameters={small}", "geometry.degree=1", "grid.nodes=33"),
        *("punch.operator=half-space", "strip.operator=half-space", "stick.steps=4", "stick.step_tolerance=1"),
        "motion={kind='oscillation', axis=[0, 0, 1], amplitude='5e-5 rad', period='1 s'}",
    )
    (block,) = march(system, 1)
    history, weights = to_dataset(block), system.pair.weights
    arm = weights * np.hypot(*system.pair.punch.x[:, :2].T)
    torque = np.hypot(history.traction.values[0, -1], history.traction_across.values[0, -1]) @ arm
    radius, modulus = (3 * 50 * 10 / (4 * 1.1538e5)) ** (1 / 3), 2.1e5 / 2.6
    assert torque == pytest.approx(8 / 3 * modulus * radius**3 * 5e-5, rel=0.01)
