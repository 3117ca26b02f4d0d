"""Results of mirrored problems are mirrored, and free motions are those of the surfaces on which loads act."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem

from fenwear import assemble, load_case, march
from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear.common.parallel import total
from fenwear.results.fields import body_fields
from fenwear.results.stored_history import load_history
from fenwear.studies.run import run_case

CREEP = "punch.creep={terms=[{compliance=0.5, time='2 s'}]}"
QUICK = ("run.half_cycles=3", "output.report=false", "output.uncertainty=false", "output.fields_at=[]")
BORE = "geometry.parameters={elements_along_contact=16, contact_angle=45, clearance='0.02 mm'}"
PROBLEMS = {
    "block-on-ring": ("geometry.parameters.elements_along_contact=16",),
    "bushing": (BORE, "punch.no_turning_about=['y']"),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_quantity_is_mirrored(name: str, tmp_path: Path) -> None:
    """A shaft that turns the other way leaves all of a history as it is, or with the other sign."""
    found = []
    for way in ("clockwise", "counterclockwise"):
        settings = (*PROBLEMS[name], CREEP, "contact.friction=0.4", f"motion.direction={way}", *QUICK)
        run_case(load_case(name, settings), name, tmp_path / way, lambda _: None, progress="none")
        found.append(load_history(tmp_path / way))
    compared = 0
    for key in found[0].data_vars:
        here, there = (history[key] for history in found)
        if here.dtype.kind != "f" or "phase" in here.dims or str(key).endswith("_error"):
            continue
        along = "x" in here.dims
        one, other = here.values, there.isel(x=slice(None, None, -1)).values if along else there.values
        apart = min(np.nanmax(np.abs(one - sign * other), initial=0.0) for sign in (1, -1))
        assert apart <= 1e-8 * np.nanmax(np.abs(one), initial=0.0), key
        compared += 1
    assert compared > 10
    assert {"moved_z", "creep_depth", "creep_volume"} <= set(map(str, found[0].data_vars))


def loaded_motion(body: ElasticBody, displacement: Array) -> Array:
    """Return the rigid modes' amplitudes that fit a displacement over the loaded surface best, in least squares."""
    mesh, field = body.body.mesh, fem.Function(body.space)
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=body.body.facet_tags)(body.body.curves["punch_load"])
    modes = []
    for mode in body.rigid_modes:
        function = fem.Function(body.space)
        function.x.array[: len(mode)] = mode
        function.x.scatter_forward()
        modes.append(function)
    field.x.array[: len(displacement)] = displacement
    field.x.scatter_forward()

    def product(one: fem.Function, other: fem.Function) -> float:
        return float(total(mesh.comm, np.array([fem.assemble_scalar(fem.form(ufl.inner(one, other) * ds))]))[0])

    gram = np.array([[product(one, other) for other in modes] for one in modes])
    return np.linalg.solve(gram, np.array([product(one, field) for one in modes]))


@pytest.mark.mpi
def test_free_motions_are_those_of_loaded_surfaces() -> None:
    """A punch that comes down and tilts: the fields' motion of the surface under load is what is reported."""
    settings = ("geometry.parameters.elements_along_contact=4", "geometry.degree=1")
    system = assemble(load_case("example1", [*settings, "run.integration=explicit"]))
    (block,) = march(system, 1)
    fields = body_fields(system, block.pressure[-1], block.rigid[-1], 0, None)
    punch = system.bodies.punch
    (field, _), size = fields, len(punch.load)
    moved = loaded_motion(punch, field["displacement"].x.array[:size])
    np.testing.assert_allclose(moved, block.rigid[-1], rtol=1e-8)
