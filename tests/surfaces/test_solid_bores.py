"""A shaft in the whole bore of a bushing, as solids: a slice is the plane, a load off the middle tilts it."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenwear import Tribosystem, assemble, load_case, make_case, march
from fenwear.results.forces_and_place import quantities
from fenwear.results.quantity import computed
from fenwear.surfaces.patches import patches

LENGTH = 2.0  # mm


def thin(around: int, *, solid: bool) -> Tribosystem:
    """Return a thin bushing on a thin shaft, one element high, in the plane or as a slice whose ends are held."""
    high = 62.4 / around
    sizes: dict[str, Any] = {"radius": 10, "clearance": 0.01, "wall": high, "shaft_wall": high}
    if solid:
        sizes |= {"length": LENGTH, "overhang": 0, "fine_angle": 90, "fine_elements": around // 2, "along": 2,
                  "beyond_elements": around // 4, "wall_layers": 1, "shaft_layers": 1}  # fmt: skip
    else:
        sizes |= {"contact_angle": 180, "elements_along_contact": around}
    ends = [{"on": "punch_ends", "fix": ["y"]}] if solid else []
    return assemble(
        make_case(
            {
                "geometry": {
                    "file": "bushing_solid.geo" if solid else "bushing.geo",
                    "degree": 2,
                    "order": 2,
                    "parameters": sizes,
                },
                "model": {"kind": "solid"} if solid else {"plane": "strain", "thickness": LENGTH},
                "materials": {"bronze": {"young": 110e3, "poisson": 0.34}, "steel": {"young": 210e3, "poisson": 0.3}},
                "punch": {
                    "regions": {"punch_body": "bronze"},
                    "supports": ends,
                    "no_turning_about": ["x", "y", "z"] if solid else ["y"],
                    "loads": [{"on": "punch_top", "force": [0, 0, -2000.0] if solid else [0, -2000.0]}],
                },
                "strip": {
                    "regions": {"strip_body": "steel"},
                    "supports": [{"on": "strip_bottom", "fix": ["x", "y", "z"] if solid else ["x", "z"]}]
                    + ([{"on": "strip_ends", "fix": ["y"]}] if solid else []),
                },
                "contact": {"friction": 0.0},
                "wear": {"punch": {"coefficient": 1e-6}},
                "motion": {"kind": "rotation", "axis": [0, 1, 0], "angular_speed": 1.0, "duration": 1.0},
                "run": {"half_cycles": 3},
            }
        )
    )


def test_a_slice_is_the_plane() -> None:
    """Pressure, worn depth and the shaft's place of a closed bore: apart by what facets in charts of two ways are."""
    errors = []
    for around in (16, 32):
        plane, solid = (thin(around, solid=kind) for kind in (False, True))
        assert len(patches(solid.pair.punch, solid.pair.strip)) == 4
        assert set(solid.rigid.mode_names) == {"lambda_F", "lambda_Fx"}
        (flat,), (deep,) = ([*march(system, 3)] for system in (plane, solid))
        angle, there = (np.arctan2(s.pair.punch.x[:, 0], s.pair.punch.x[:, -1] + 0.01) for s in (plane, solid))
        apart = np.abs(np.exp(1j * there[:, None]) - np.exp(1j * angle))
        at = apart.argmin(axis=1)
        assert apart.min(axis=1).max() < 1e-7
        expected, found = flat.pressure[-1], deep.pressure[-1]
        errors.append(np.abs(found - expected[at]).max() / expected.max())
        np.testing.assert_allclose(deep.wear[-1], flat.wear[-1][at], rtol=0, atol=1e-3 * flat.wear[-1].max())
        eccentricity = (computed(block, quantities(block.system))["eccentricity"] for block in (deep, flat))
        np.testing.assert_allclose(*eccentricity, rtol=1e-4)
    assert errors[1] < 0.5 * errors[0] < 1e-3


def test_a_load_off_the_middle_tilts() -> None:
    """Free about both axes across its own, not about that: the contact carries the load where it acts."""
    coarse = (
        "geometry.parameters.fine_elements=12",
        "geometry.parameters.along=2",
        "geometry.parameters.wall_layers=1",
    )
    system = assemble(load_case("bushing-misaligned", coarse))
    assert set(system.rigid.mode_names) == {"lambda_F", "lambda_Fx", "lambda_Mx", "lambda_Mz"}
    (first,) = march(system, 1)
    traction = system.pair.normal + system.phases.middle_ratio(1)
    forces = (system.pair.weights * first.pressure[-1])[:, None] * traction
    np.testing.assert_allclose(forces.sum(axis=0)[[0, 2]], [0, 2000], atol=1e-6)
    x = system.pair.opposite
    about_x = (x[:, 1] * forces[:, 2] - x[:, 2] * forces[:, 1]).sum()
    np.testing.assert_allclose(about_x / 2000, 3, rtol=1e-3)
    found = computed(first, quantities(first.system))
    assert found["turned_x"][-1] < 0  # down where the load is
    assert found["attitude_angle"][-1] < 0
