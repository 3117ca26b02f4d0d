"""Meshes and a stress made in Python, all else as in a case file.

A carbon-fibre pad, stiff along fibres that lie at 30 degrees to the contact, wears on a steel strip.
"""

import numpy as np
import ufl
from dolfinx.mesh import CellType, create_rectangle
from mpi4py import MPI

from fenwear import OwnLaw, assemble, make_case, own_mesh, run_case, steady

# Fibres along a: sigma = 2 G eps + (E_f - 2 G) (a . eps a) a a, MPa.
angle, fibre, shear = np.radians(30), 140e3, 4e3
a = ufl.as_vector((np.cos(angle), np.sin(angle)))


def carbon(u):  # noqa: D103
    eps = ufl.sym(ufl.grad(u))
    return 2 * shear * eps + (fibre - 2 * shear) * ufl.inner(a, eps * a) * ufl.outer(a, a)


def mesh(name, corners, cells, groups):  # noqa: D103
    return own_mesh(name, create_rectangle(MPI.COMM_WORLD, corners, cells, CellType.quadrilateral), groups)


pad = mesh("punch", [(-10, 0), (10, 15)], (20, 12), {
    "punch_contact": lambda x: np.isclose(x[1], 0), "top": lambda x: np.isclose(x[1], 15),
    "guide": lambda x: np.isclose(np.abs(x[0]), 10) & (x[1] > 5)})  # fmt: skip
strip = mesh("strip", [(-30, -20), (30, 0)], (60, 12), {
    "strip_contact": lambda x: np.isclose(x[1], 0), "bottom": lambda x: np.isclose(x[1], -20)})  # fmt: skip

case = make_case(
    {
        "title": "carbon fibres on steel",
        "geometry": {"degree": 2},
        "model": {"thickness": "10 mm"},
        "materials": {"carbon": {"young": "10 GPa", "poisson": 0.3}, "steel": {"young": "210 GPa", "poisson": 0.3}},
        "punch": {
            "regions": {"punch_body": "carbon"},
            "supports": [{"on": "guide", "fix": ["x"]}],
            "loads": [{"on": "top", "force": [0, "-2 kN"]}],
        },
        "strip": {"regions": {"strip_body": "steel"}, "supports": [{"on": "bottom", "fix": ["x", "z"]}]},
        "contact": {"friction": 0.2},
        "wear": {"punch": {"coefficient": "1e-8 1/MPa"}},
        "motion": {"kind": "reciprocating", "amplitude": "2 mm", "period": "1 s"},
        "run": {"half_cycles": 200},
    },
    meshes={"punch": pad, "strip": strip},
    stresses={"punch": OwnLaw("stress", carbon)},
)
summary, folder = run_case(case, "carbon")
system = assemble(case)
state = steady(system)
after = max(summary[way]["largest_pressure_MPa"] for way in ("rightward", "leftward"))
print(f"largest pressure: {after:.2f} MPa after 200 half-cycles, {state.pressure.max():.2f} MPa in the end")
