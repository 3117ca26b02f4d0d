"""Bodies made in Python, without a case file: own meshes, own anisotropic stress, own sliding.

A carbon-fibre pad, stiff along fibres that lie at 30 degrees to the contact, wears on a steel strip.
"""

import numpy as np
import ufl
from dolfinx.mesh import CellType, create_rectangle
from mpi4py import MPI

from fenwear import march, steady
from fenwear.assembly import Bodies, Sliding, elastic, place
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.material import Isotropic, OwnLaw, lame, strain
from fenwear.bodies.mesh import own_mesh
from fenwear.case import Body, Contact, Load, Reciprocating, Support, WearLaw
from fenwear.sliding.field import SlidingField
from fenwear.sliding.friction import Friction
from fenwear.sliding.motion import make_motion

# Fibres along a: sigma = 2 G eps + (E_f - 2 G) (a . eps a) a a, MPa.
angle, fibre, shear = np.radians(30), 140e3, 4e3
a = ufl.as_vector((np.cos(angle), np.sin(angle)))


def carbon(u):  # noqa: D103
    eps = strain(u)
    return 2 * shear * eps + (fibre - 2 * shear) * ufl.inner(a, eps * a) * ufl.outer(a, a)


def body(name, corners, cells, law, description, groups):  # noqa: D103
    mesh = create_rectangle(MPI.COMM_WORLD, corners, cells, CellType.quadrilateral)
    return ElasticBody(own_mesh(name, mesh, groups), description, law, degree=2, thickness=10.0)


pad = body(
    "punch", [(-10, 0), (10, 15)], (20, 12), OwnLaw("stress", carbon),
    Body(supports=(Support(on="guide", fix=("x",)),), loads=(Load(on="top", force=(0, -2000)),)),
    {"punch_contact": lambda x: np.isclose(x[1], 0), "top": lambda x: np.isclose(x[1], 15),
     "guide": lambda x: np.isclose(np.abs(x[0]), 10) & (x[1] > 5)},
)  # fmt: skip
strip = body(
    "strip", [(-30, -20), (30, 0)], (60, 12), Isotropic("stress", lame(210e3, 0.3, "stress")),
    Body(supports=(Support(on="bottom", fix=("x", "z")),)),
    {"strip_contact": lambda x: np.isclose(x[1], 0), "bottom": lambda x: np.isclose(x[1], -20)},
)  # fmt: skip

field = SlidingField(shift=(1.0, 0.0, 0.0))  # along x
motion = make_motion(Reciprocating(kind="reciprocating", amplitude=2.0, period=1.0))
sliding = Sliding(motion, field, Friction(Contact(friction=0.2), field), (WearLaw(coefficient=1e-8), None))
system = elastic(place(Bodies(pad, strip), sliding))
*_, last = march(system, 200)
state = steady(system)
after, end = last.largest_pressure[-1], state.pressure.max()
print(f"largest pressure: {after:.2f} MPa after 200 half-cycles, {end:.2f} MPa in the end")
