"""The package: an installed wheel works anywhere, importing it is light."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fenwear
from fenwear.bodies.mesh import meshes_folder

ROOT = Path(fenwear.__file__).parents[1]
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def wheel(run_python: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    done = run_python("-m", "pip", "wheel", ROOT, "--no-deps", "--no-build-isolation", "--no-index", "-w", folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = folder.glob("fenwear-*.whl")
    return path


def test_wheel_is_complete(wheel: Path) -> None:
    """Modules, built-in cases, geometries, templates of pages, the marker of typing, the licence; nothing else."""
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = {p.relative_to(ROOT).as_posix() for p in (ROOT / "fenwear").rglob("*.py")}
    cases = {p.relative_to(ROOT).as_posix() for p in (ROOT / "fenwear" / "cases").glob("*.toml")}
    meshes = {f"fenwear/meshes/{p.name}" for p in meshes_folder().glob("*.geo")}
    folders = (ROOT / "fenwear/report/templates", ROOT / "fenwear/templates")
    templates = {p.relative_to(ROOT).as_posix() for folder in folders for p in folder.iterdir()}
    expected = sources | cases | meshes | templates | {"fenwear/py.typed"}
    assert expected <= names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not {n for n in names if not n.startswith(("fenwear/", "fenwear-"))}


def test_installed_wheel_works_elsewhere(wheel: Path, run_python: Run, tmp_path: Path) -> None:
    """Installed into an empty folder and started from another: cases and geometries are its own."""
    target, elsewhere = tmp_path / "target", tmp_path / "elsewhere"
    elsewhere.mkdir()
    install = ("-m", "pip", "install", "--no-deps", "--no-index", "--target", target, wheel)
    done = run_python(*install)
    assert done.returncode == 0, done.stderr
    where = "import fenwear, fenwear.bodies.mesh; print(fenwear.__file__); print(fenwear.bodies.mesh.meshes_folder())"
    found = run_python("-c", where, cwd=elsewhere, PYTHONPATH=str(target)).stdout.split()
    assert [Path(f).is_relative_to(target) for f in found] == [True, True]
    arguments = ("-m", "fenwear", "optimum", "monotonic-lz20")
    done = run_python(*arguments, cwd=elsewhere, PYTHONPATH=str(target))
    assert done.returncode == 0, done.stderr
    assert "0.05 mm/s" in done.stdout
    assert list(elsewhere.iterdir()) == []


def test_import_is_light(run_python: Run) -> None:
    """Reading a case needs neither MPI nor a mesh, nor a plotting library."""
    heavy = "{'mpi4py.MPI', 'dolfinx', 'gmsh', 'matplotlib', 'pyvista', 'petsc4py.PETSc'}"
    code = f"import sys, fenwear; fenwear.load_case('example1'); print(sorted({heavy} & set(sys.modules)))"
    assert run_python("-c", code).stdout.strip() == "[]"


def test_public_names() -> None:
    """Everything that the package offers by name is there, with a docstring; nothing else is."""
    for name in fenwear.__all__:
        assert getattr(fenwear, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'wobble'"):
        fenwear.wobble  # noqa: B018
