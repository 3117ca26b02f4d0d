"""The benchmark of an elastic block with Coulomb friction on rigid ground, which other programs have been held against.

A plate 80 mm wide and 40 mm high, in plane strain, is pressed on rigid ground from above by 50 MPa and inwards from
both sides by 150 MPa, in proportion. Along the ground it lifts off, slips and sticks. GRECO's benchmark after
M. Raous, P. Chabrand, F. Lebon, Numerical methods for frictional contact problems and applications, J. Mec. Theor.
Appl. 7, 1988; the numbers are those that Code_Aster's test SSNV128 is held against: displacements, which it asks for
to 5 %, and a nodal force over the length of its element.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fenwear.case import Case, make_case
from fenwear.common.arrays import Array
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import StickInterface, untouched
from fenwear.steps.stick_state import Imposed, StickState
from fenwear.system import build_bodies, make_sliding
from fenwear_verify.suite import Line, Plot, Result, number, verification

PLACES = np.array([0.0, 1.25, 5.0, 7.5, 11.25])  # mm
PUBLISHED = np.array([28.6, 27.2, 22.8, 19.8, 15.0])  # um
TOLERANCES = (5e-3, 5e-3, 5e-3, 5e-3, 3e-2)  # where it slips most it is ours that does not change with the mesh
BESIDE_MIDDLE, PRESSURE = 38.75, 104.864 / 1.25  # mm, MPa
FRICTION, MESHES = 1.0, (16, 32)


def block(across: int) -> Case:
    """Return the plate on its ground, with elements along its side."""
    return make_case(
        {
            "geometry": {
                "file": str(Path(__file__).with_name("friction_block.geo")),
                "degree": 2,
                "parameters": {"across": across},
            },
            "model": {"plane": "strain"},
            "materials": {"of_plate": {"young": 130e3, "poisson": 0.2}, "rigid": {"young": 1e12, "poisson": 0.2}},
            "punch": {
                "regions": {"punch_body": "of_plate"},
                "supports": [{"on": "punch_middle", "fix": ["x"]}],
                "loads": [{"on": "punch_top", "traction": [0, -50]}, {"on": "punch_side", "traction": [150, 0]}],
            },
            "strip": {
                "regions": {"strip_body": "rigid"},
                "supports": [{"on": "strip_bottom", "fix": ["x", "z"]}],
            },
            "contact": {"friction": FRICTION, "law": "coulomb"},
            "wear": {"punch": {"coefficient": 0}},
            "motion": {"kind": "reciprocating", "amplitude": 1e-3, "period": 1.0},
            "run": {"half_cycles": 2},
        }
    )


def loaded(across: int) -> tuple[Array, Array, StickState]:
    """Return x (n,), the displacement along the ground (n,), um, and the contact under the loads; collective."""
    case = block(across)
    interface = StickInterface(build_bodies(case), make_sliding(case), case)
    x, load = interface.middle.pair.x, interface.loaded(None)
    begin, end = (Imposed(load.times(share), np.zeros(len(x))) for share in (0.0, 1.0))
    state = advance(interface, untouched(interface), begin, end, np.full(len(x), FRICTION))
    return x, 1e3 * state.on_punch[:, 0], state


@verification(
    "friction-block",
    "An elastic block with friction on rigid ground: it lifts off, slips and sticks",
    "benchmark of GRECO, M. Raous and others 1988; numbers as in Code_Aster's SSNV128",
)
def friction_block() -> Result:
    """Loads in proportion: one step has the solution of all."""
    (x_coarse, coarse, _), (x, moved, state) = (loaded(across) for across in MESHES)
    along = np.interp(PLACES, x, moved)
    rows = [
        number(f"displacement at {place:g} mm (um)", published, value, tolerance)
        for place, published, value, tolerance in zip(PLACES, PUBLISHED, along, TOLERANCES, strict=True)
    ]
    beside = np.interp(BESIDE_MIDDLE, x, state.pressure)
    rows.append(number(f"pressure at {BESIDE_MIDDLE:g} mm (MPa)", PRESSURE, beside, 2e-3))
    change = float(np.abs(along / np.interp(PLACES, x_coarse, coarse) - 1).max())
    rows.append(number("displacements on elements twice as long, over these", 1.0, 1 + change, 2e-3))
    lines = [Line("published", PLACES, PUBLISHED, reference=True), Line("fenwear", x, moved)]
    return Result(
        rows,
        [Plot("A block with friction on rigid ground", "x (mm)", "displacement along the ground (um)", lines)],
        note=f"open to {x[state.pressure == 0].max():.4g} mm, sticks from {x[state.sticking].min():.4g} mm",
    )
