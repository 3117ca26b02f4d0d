"""The package: an installed wheel works anywhere, importing it is light."""

from __future__ import annotations

import ast
import itertools
import json
import re
import shutil
import sys
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fenwear
from fenwear.bodies.ready_geometries import meshes_folder

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


def test_source_distribution_makes_the_same_wheel(wheel: Path, run_python: Run, tmp_path: Path) -> None:
    """What is published as source holds all that the wheel is made of; the metadata of both are as PyPI wants them."""
    done = run_python("-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    (source,) = tmp_path.glob("fenwear-*.tar.gz")
    again = tmp_path / "again"
    done = run_python("-m", "pip", "wheel", source, "--no-deps", "--no-build-isolation", "--no-index", "-w", again)
    assert done.returncode == 0, done.stderr
    (other,) = again.glob("*.whl")
    contents = [{i.filename: i.CRC for i in zipfile.ZipFile(path).infolist()} for path in (wheel, other)]
    assert contents[0] == contents[1]
    if not shutil.which("twine"):
        pytest.skip("twine is missing")
    done = run_python("-m", "twine", "check", "--strict", wheel, source)
    assert done.returncode == 0, done.stdout + done.stderr


def test_dependencies_are_declared() -> None:
    """Every library that a module imports, but for what comes with the compiled stack or with a declared one."""
    comes_along = {
        "basix",
        "cffi",
        "dolfinx",
        "ffcx",
        "petsc4py",
        "ufl",
        "h5py",
        "markupsafe",
        "pandas",
        "pydantic_core",
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    given = [*project["dependencies"], *itertools.chain.from_iterable(extras.values())]
    assert not {"fenics-dolfinx", "petsc4py", "adios4dolfinx"} & {re.split(r"[<>=]", name)[0] for name in given}
    names = {re.split(r"[<>=]", name)[0].replace("-", "_").replace("pillow", "PIL") for name in given}
    for path in (ROOT / "fenwear").rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
        found = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        found |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
        libraries = {name.partition(".")[0] for name in found} - {"fenwear"} - sys.stdlib_module_names
        assert libraries <= names | comes_along, path


def test_one_version_everywhere() -> None:
    """Package, citation, changelog and codemeta name the same."""
    citation, changes, meta = (
        (ROOT / name).read_text("utf-8") for name in ("CITATION.cff", "CHANGELOG.md", "codemeta.json")
    )
    assert json.loads(meta)["version"] == fenwear.__version__
    assert re.search(r"^version: (.*)$", citation, re.MULTILINE)[1] == fenwear.__version__  # type: ignore[index]
    assert re.search(r"^## (\S+)", changes, re.MULTILINE)[1] == fenwear.__version__  # type: ignore[index]


def test_installed_wheel_works_elsewhere(wheel: Path, run_python: Run, tmp_path: Path) -> None:
    """Installed into an empty folder and started from another: cases and geometries are its own."""
    target, elsewhere = tmp_path / "target", tmp_path / "elsewhere"
    elsewhere.mkdir()
    install = ("-m", "pip", "install", "--no-deps", "--no-index", "--target", target, wheel)
    done = run_python(*install)
    assert done.returncode == 0, done.stderr
    where = "import fenwear, fenwear.bodies.ready_geometries as g; print(fenwear.__file__); print(g.meshes_folder())"
    found = run_python("-c", where, cwd=elsewhere, PYTHONPATH=str(target)).stdout.split()
    assert [Path(f).is_relative_to(target) for f in found] == [True, True]
    arguments = ("-m", "fenwear", "optimum", "monotonic-lz20")
    done = run_python(*arguments, cwd=elsewhere, PYTHONPATH=str(target))
    assert done.returncode == 0, done.stderr
    assert "lambda_F (mm/s)" in done.stdout
    done = run_python("-m", "fenwear", "verify", "--list", cwd=elsewhere, PYTHONPATH=str(target))
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith('missing: pip install "fenwear[verify]"'), done.stderr
    assert list(elsewhere.iterdir()) == []


def test_import_is_light(run_python: Run) -> None:
    """Reading a case needs neither MPI nor a mesh, nor a plotting library."""
    heavy = "{'mpi4py.MPI', 'dolfinx', 'gmsh', 'matplotlib', 'pyvista', 'petsc4py.PETSc'}"
    code = f"import sys, fenwear; fenwear.load_case('example1'); print(sorted({heavy} & set(sys.modules)))"
    assert run_python("-c", code).stdout.strip() == "[]"


def test_start_is_quick(run_python: Run) -> None:
    """The steady state needs no tables, statistics or plots: a third of its start."""
    late = "{'xarray', 'pandas', 'scipy.stats', 'matplotlib', 'pyvista', 'gmsh'}"
    modules = "fenwear.cli.state_commands, fenwear.steps, fenwear.results.quantity"
    code = f"import sys, {modules}; print(sorted({late} & set(sys.modules)))"
    assert run_python("-c", code).stdout.strip() == "[]"


def test_public_names() -> None:
    """Everything that the package offers by name is there, with a docstring; nothing else is."""
    for name in fenwear.__all__:
        assert getattr(fenwear, name).__doc__
    assert dir(fenwear) == sorted(fenwear.__all__)
    with pytest.raises(AttributeError, match="no attribute 'wobble'"):
        fenwear.wobble  # noqa: B018


def test_one_line_says_what_it_is(assembled: Callable[..., Any]) -> None:
    """In a notebook: never pages of numbers; and results know where their nodes lie."""
    system = assembled("example1", "geometry.degree=1", "geometry.parameters.elements_along_contact=4")
    state, (block,) = fenwear.steady(system), fenwear.march(system, 2)
    optimum = system.optimum(1)
    for thing, word in (
        (system, "33 contact nodes"),
        (system.case, "<Case 'Example 1: a tilting punch, pin 20 mm above the contact, without heat': plane, "),
        (state, "<Steady: 33 contact nodes, 2 half-cycles, largest pressure "),
        (block, "<Block: 2 records of half-cycles 1 to 2, "),
        (optimum, "<Optimum: "),
    ):
        assert word.replace("33", str(len(system.pair.x))) in repr(thing)
        assert str(thing) == repr(thing)
        assert len(repr(thing)) < 160
        assert "\n" not in repr(thing)
    for result in (state, block):
        assert (result.x == system.pair.x).all()
        assert result.x.shape == result.pressure[0].shape
        assert (result.coordinates == system.pair.punch.x).all()
