"""Fields of the whole bodies against the condensed interface and exact stresses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import ufl
import xarray

from fenwear import Tribosystem, march
from fenwear.bodies.antiplane import shear_out_of_plane
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.elasticity import ElasticBody
from fenwear.results.fields import Fields, body_fields, write_fields

COARSE = ("geometry.degree=3", "geometry.parameters.elements_along_contact=8")


def write(system: Tribosystem, folder: Path, half_cycles: int) -> xarray.Dataset:
    """March, write the fields of the last half-cycle, and read them back."""
    *_, block = march(system, half_cycles)
    temperatures = None
    if block.end.temperature is not None:
        temperatures = block.end.temperature.temperatures()
    direction = int(block.direction[-1])
    phase = (half_cycles - 1) % system.motion.half_cycles
    fields = body_fields(system, block.pressure[-1], block.rigid[-1], phase, temperatures)
    write_fields(folder, system, half_cycles, fields, direction, block.end.worn, block.pressure[-1])
    with xarray.open_dataset(folder / "fields" / f"half_cycle_{half_cycles:06d}.nc", engine="h5netcdf") as opened:
        return opened.load()


def surface(data: xarray.Dataset, body: str, name: str) -> np.ndarray:
    """Return the values at z = 100 mm under the punch, in order along the contact."""
    x, z = data[f"{body}_x"].values, data[f"{body}_z"].values
    chosen = np.flatnonzero((np.abs(z - 100) < 1e-6) & (np.abs(x) < 30 + 1e-6))
    return data[f"{body}_{name}"].values[chosen[np.argsort(x[chosen])]]


def test_fields_close_the_gap(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """The displacements of the whole bodies give the gap that the condensed inequality found."""
    system = assembled("example1", *COARSE)
    data = write(system, tmp_path, 21)
    *_, block = march(system, 21)
    opened = surface(data, "punch", "displacement_z") - surface(data, "strip", "displacement_z")
    found = opened + system.pair.initial_gap + block.wear[-2]
    np.testing.assert_allclose(found, block.gap[-1], rtol=0, atol=1e-12)


def test_fields_close_the_gap_with_heat(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """With heat, the strip's expansion is read on its material, which is at the end of its stroke."""
    system = assembled("example1-heat", *COARSE)
    *_, block = march(system, 21)
    state = (block.pressure[-1], block.rigid[-1], 20 % system.motion.half_cycles)
    assert block.end.temperature is not None
    temperatures = block.end.temperature.temperatures()
    warm, cold = (body_fields(system, *state, given) for given in (temperatures, None))

    def on_trace(fields: Fields, elastic: ElasticBody) -> np.ndarray:
        owned = elastic.dim * elastic.space.dofmap.index_map.size_local
        return elastic.trace.pick(fields["displacement"].x.array[:owned, None])[:, 1, 0]

    punch, strip = system.bodies.punch, system.bodies.strip
    pressed, expansion = on_trace(cold[1], strip), on_trace(warm[1], strip) - on_trace(cold[1], strip)
    assert system.sliding.passage is not None
    here, moved = system.pair.transfer, system.sliding.passage.ends[state[2]]
    assert abs(here[:, system.sliding.passage.nodes] - moved).max() > 0.1  # it does matter where
    below = here @ pressed + moved @ expansion[system.sliding.passage.nodes]
    found = system.pair.punch.spread.T @ on_trace(warm[0], punch) - below + system.pair.initial_gap + block.wear[-2]
    np.testing.assert_allclose(found, block.gap[-1], rtol=0, atol=1e-12)
    assert block.heat is not None
    heat = system.bodies.heat
    surface_temperature = system.pair.punch.spread.T @ heat[0].trace.pick(temperatures[0][:, None])[:, 0, 0]
    np.testing.assert_allclose(surface_temperature, block.heat.temperature_punch[-1], atol=1e-9)


def test_cells_tile_the_bodies(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """The linear cells between the nodes cover 60 x 100 and 1140 x 100 mm²."""
    data = write(assembled("example1", *COARSE), tmp_path, 1)
    for body, area in (("punch", 6000), ("strip", 114000)):
        corners = data[f"{body}_cells"].values
        x, z = data[f"{body}_x"].values[corners], data[f"{body}_z"].values[corners]
        areas = (x * np.roll(z, -1, axis=1) - np.roll(x, -1, axis=1) * z).sum(axis=1) / 2
        assert np.abs(areas).sum() == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize(("plane", "expected"), [("stress", 1.0), ("strain", np.sqrt(1 - 0.3 + 0.3**2))])
def test_von_mises_of_a_uniaxial_load(
    assembled: Callable[..., Tribosystem], tmp_path: Path, plane: str, expected: float
) -> None:
    """Far from the contact the punch is under 16.667 MPa alone: sigma_yy = 0, or nu sigma in plane strain."""
    settings = ("contact.friction=0", "geometry.parameters.punch_height=300", f"model.plane={plane}")
    data = write(assembled("example2", *COARSE, *settings), tmp_path, 1)
    middle = np.abs(data.punch_z - 300) < 25
    np.testing.assert_allclose(data.punch_von_mises[middle], expected * 1e4 / 600, rtol=2e-3)


def test_torsion_of_rings(assembled: Callable[..., Tribosystem]) -> None:
    """A tube held at one end and turned at the other by tractions tau r has u = tau r z / G, exactly."""
    narrow = ("geometry.parameters.margin_inside=0", "geometry.parameters.margin_outside=0")
    system = assembled("ring-on-ring", "geometry.degree=2", "geometry.parameters.across=4", *narrow)
    elastic = system.bodies.strip
    radius = ufl.SpatialCoordinate(elastic.body.mesh)[0]
    load = elastic.surface_integral(ufl.as_vector((2.5 * radius, 0.0)), contact_tag(elastic.body))
    force = elastic.trace.pick(load[:, None])[:, 0, 0]
    assert force @ elastic.surface.trace[:, 0] == pytest.approx(2.5 * np.pi / 2 * (30**4 - 20**4), rel=1e-12)
    u = shear_out_of_plane(elastic, force)
    r, z = u.function_space.tabulate_dof_coordinates()[:, :2].T
    exact = 2.5 / (210e3 / 2.6) * r * (z - z.min())
    np.testing.assert_allclose(u.x.array, exact, atol=1e-9 * exact.max())


TURNED = {"punch": 1, "strip": -1}  # the way that friction takes each body as the strip turns about z


def test_stress_of_twisted_rings(assembled: Callable[..., Tribosystem], tmp_path: Path) -> None:
    """Where a ring turns on another, the traction mu p shears both: von Mises' stress holds it, and every value is."""
    system = assembled("ring-on-ring", "geometry.degree=2", "geometry.parameters.across=4", "contact.friction=0.5")
    data = write(system, tmp_path, 1)
    for body in ("punch", "strip"):
        assert np.isfinite(data[f"{body}_von_mises"]).all()
        turned = data[f"{body}_displacement_out_of_plane"]
        assert float(np.abs(turned).max()) == pytest.approx(float((turned * TURNED[body]).max()))
    # In the middle of the contact: nearly uniaxial -p and the shear mu p.
    (block,) = march(system, 1)
    middle = np.argmin(np.abs(system.pair.x - 25))
    p = block.pressure[0, middle]
    at = np.argmin(np.hypot(data.punch_x.values - 25, data.punch_z.values))
    assert float(data.punch_von_mises[at]) == pytest.approx(p * np.sqrt(1 + 3 * 0.5**2), rel=0.1)
