"""Worn surfaces as files, and back in as the bodies of another run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fenwear import CaseError, assemble, load_case, run_case
from fenwear.bodies.contact_surface import profiled
from fenwear.case.body_tables import Profile
from fenwear.common.errors import FenwearError
from fenwear.results.export import TRIANGLE, export_worn, profile_of
from fenwear.results.stored_history import load_history
from fenwear.system import build_bodies, place_case

QUIET = ("output.report=false", "output.uncertainty=false", "output.fields_at=[]", "geometry.follow_wear='never'")
PLANE = ("geometry.parameters.elements_along_contact=12", "run.integration='explicit'", *QUIET)


def run(name: str, folder: Path, *settings: str) -> Path:
    """Run a case without a word; return its folder."""
    run_case(load_case(name, settings), "worn", folder, lambda _: None, progress="none")
    return folder


def test_next_half_cycle_goes_on_from_the_files(tmp_path: Path) -> None:
    """Of both bodies: the first half-cycles on worn bodies are those that follow on the run itself."""
    both = (*PLANE, "motion.positions=3")
    whole = load_history(run("fretting", tmp_path / "whole", *both, "run.half_cycles=8"))
    first = run("fretting", tmp_path / "first", *both, "run.half_cycles=6")
    paths = export_worn(first, tmp_path / "surfaces")
    assert [path.name for path in paths] == [
        f"worn_{body}.{kind}" for body in ("punch", "strip") for kind in ("csv", "stl", "vtk")
    ]
    profiles = [f"{body}.profile.file='{tmp_path}/surfaces/worn_{body}.csv'" for body in ("punch", "strip")]
    again = load_history(run("fretting", tmp_path / "again", *both, *profiles, "run.half_cycles=2"))
    after = whole.pressure.values[6:8]
    assert np.abs(again.pressure.values - after).max() < 1e-6 * after.max()
    for body, side in (("punch", -1), ("strip", 1)):
        triangles = np.frombuffer((tmp_path / "surfaces" / f"worn_{body}.stl").read_bytes()[84:], dtype=TRIANGLE)
        assert (side * triangles["normal"][:, 2] > 0).all()
    # From there on once more: a profile has that of the body before.
    export_worn(tmp_path / "again", tmp_path / "twice")
    twice = [text.replace("surfaces", "twice") for text in profiles]
    third = load_history(run("fretting", tmp_path / "third", *both, *twice, "run.half_cycles=1"))
    longer = load_history(run("fretting", tmp_path / "longer", *both, "run.half_cycles=9"))
    assert np.abs(third.pressure.values[0] - longer.pressure.values[8]).max() < 1e-6 * after.max()


def test_a_bore_goes_on_from_its_files(tmp_path: Path) -> None:
    """A closed curve has each x twice; its profile goes by the arc length, on other meshes and all around, too."""
    coarse = (
        "geometry.degree=1",
        "geometry.parameters.elements_along_contact=60",
        "run.integration='explicit'",
        *QUIET,
    )
    worn = ("wear.punch.coefficient='4e-8 mm^3/(N mm)'", "unset=wear.strip")
    whole = load_history(run("bushing", tmp_path / "whole", *coarse, *worn, "run.half_cycles=4"))
    export_worn(run("bushing", tmp_path / "first", *coarse, *worn, "run.half_cycles=3"), tmp_path / "surfaces")
    profile = f"punch.profile.file='{tmp_path}/surfaces/worn_punch.csv'"
    again = load_history(run("bushing", tmp_path / "again", *coarse, *worn, profile, "run.half_cycles=1"))
    after = whole.pressure.values[3]
    assert np.abs(after - whole.pressure.values[0]).max() > 0.05 * after.max()
    assert np.abs(again.pressure.values[0] - after).max() < 1e-6 * after.max()
    with pytest.raises(CaseError, match=r"punch\.profile\.along"):
        assemble(load_case("bushing", [*coarse, "punch.profile.points=[[-11, 0.0], [11, 0.0]]"]))
    finer = ("geometry.degree=1", "geometry.parameters.elements_along_contact=120")
    areas = []
    for settings in (coarse, finer):
        surface = place_case(load_case("bushing", [*settings, profile])).pair.punch
        areas.append(surface.weights @ surface.below_mesh)
    assert areas[1] == pytest.approx(areas[0], rel=5e-3)


def test_a_bore_in_a_solid_goes_on_from_its_points() -> None:
    """Each x and y twice: profiles have all coordinates; read at the nodes of a finer mesh, too."""
    coarse, fine = (
        build_bodies(load_case("bushing-misaligned", ["geometry.degree=1", *sizes])).punch.surface
        for sizes in (
            ("geometry.parameters.fine_elements=12", "geometry.parameters.along=2"),
            ("geometry.parameters.fine_elements=16", "geometry.parameters.along=4"),
        )
    )

    def depth(x: np.ndarray) -> np.ndarray:
        return np.asarray(1e-3 * (2 + np.cos(np.arctan2(x[:, 0], x[:, 2])) + 0.02 * x[:, 1]))

    profile = Profile(**profile_of(coarse, depth(coarse.x)))
    np.testing.assert_allclose(profiled(coarse, profile).profile, depth(coarse.x), atol=1e-15)
    np.testing.assert_allclose(profiled(fine, profile).profile, depth(fine.x), rtol=0.03)


def test_files_of_a_solid_have_its_surface(tmp_path: Path) -> None:
    """Triangles that look out of the body, and the depths."""
    pyvista = pytest.importorskip("pyvista")
    small = ("geometry.parameters.core_elements=2", "geometry.parameters.across=2", "run.half_cycles=2")
    folder = run("ball-on-flat", tmp_path / "ball", *small, "motion.positions=2", "run.integration='explicit'", *QUIET)
    paths = {path.name: path for path in export_worn(folder, tmp_path / "surfaces")}
    history = load_history(folder)
    surface = pyvista.read(paths["worn_punch.vtk"])
    assert surface["wear_mm"] == pytest.approx(history.wear.values[-1], rel=1e-9)
    triangles = np.frombuffer(paths["worn_punch.stl"].read_bytes()[84:], dtype=TRIANGLE)
    assert len(triangles) == surface.triangulate().n_cells
    assert (triangles["normal"][:, 2] < 0).all()  # the ball looks down


def test_a_grid_goes_on_from_its_files(tmp_path: Path) -> None:
    """On a contact grid, too, whatever mesh lies below it: a ball's own roundness is not in the file, its heights are.

    The grid ends within the meshed surface, and so does the file.
    """
    grid = ("punch.operator='fine'", "strip.operator='fine'", "grid={nodes=17, size=['0.4 mm', '0.4 mm']}")
    small = ("geometry.parameters.core_elements=0", "geometry.parameters.core=0", "geometry.parameters.across=3")
    heights = "punch.topography={rms='0.02 um', longest='0.4 mm'}"
    settings = (*small, *grid, "unset=wear.strip", "motion.positions=1", "run.integration='explicit'", *QUIET)
    own = (*settings, heights)
    whole = load_history(run("ball-on-flat", tmp_path / "whole", *own, "run.half_cycles=6"))
    export_worn(run("ball-on-flat", tmp_path / "first", *own, "run.half_cycles=4"), tmp_path / "surfaces")
    profile = f"punch.profile.file='{tmp_path}/surfaces/worn_punch.csv'"
    again = load_history(run("ball-on-flat", tmp_path / "again", *settings, profile, "run.half_cycles=2"))
    after = whole.pressure.values[4:6]
    assert np.abs(after - whole.pressure.values[:2]).max() > 5e-3 * after.max()
    assert np.abs(again.pressure.values - after).max() < 1e-5 * after.max()


def test_rings_and_bad_requests(tmp_path: Path) -> None:
    """A profile over r; one half-cycle at a time, of a run."""
    small = ("geometry.parameters.across=4", "run.half_cycles=2", "run.integration='explicit'", *QUIET)
    folder = run("ring-on-ring", tmp_path / "rings", *small)
    assert export_worn(folder)[0].read_text().startswith("r (mm),depth (um)\n")
    for at, key in (("1,2", "--at"), ("7", "--at")):
        with pytest.raises(CaseError, match=key):
            export_worn(folder, tmp_path / "x", at)
    with pytest.raises(FenwearError):
        export_worn(tmp_path / "nothing")
