"""What is missing below fenwear is told by its name; MPI is loaded before what is linked to it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fenwear.common import stack
from fenwear.common.errors import StackError

Run = Callable[..., Any]
STEADY = ("-m", "fenwear", "steady", "example1", "--set", "geometry.degree=1")


def test_no_compiler(run_python: Run, tmp_path: Path) -> None:
    """With an empty cache: one sentence, on one rank and on two (whose PATH mpirun completes), no traceback."""
    for ranks, without in ((1, {"PATH": str(tmp_path)}), (2, {"CC": "no-compiler -O2"})):
        done = run_python(*STEADY, ranks=ranks, XDG_CACHE_HOME=str(tmp_path / f"cache{ranks}"), **without)
        assert done.returncode == 1, done.stderr
        assert done.stderr.count("fenwear: a form cannot be compiled: there is no C compiler ") == 1
        assert "on PATH: install gcc, or name another one in CC" in done.stderr
        assert "Traceback" not in done.stderr


def test_no_headers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A compiler without Python's headers compiles nothing, either."""
    assert stack.lacks_to_compile() is None
    monkeypatch.setattr("sysconfig.get_paths", lambda: {"include": str(tmp_path)})
    assert f"there is no {tmp_path / 'Python.h'}" in str(stack.lacks_to_compile())
    with pytest.raises(StackError, match="python3-dev"), stack.compiling():
        raise RuntimeError("Python.h: no such file")


@pytest.mark.parametrize("part", ["mpi4py", "dolfinx", "gmsh"])
def test_missing_part(run_python: Run, tmp_path: Path, part: str) -> None:
    """Named with what installs it, by the command line and as a typed error by the package."""
    code = f"import sys; sys.modules[{part!r}] = None\n"
    main = "sys.argv[1:] = ['steady', 'example1']; from fenwear.__main__ import main; sys.exit(main())"
    done = run_python("-c", code + main, cwd=tmp_path)
    assert done.returncode == 1
    said = f"{part} is missing, and nothing is computed without: {stack.SOLVER}"
    assert done.stderr.splitlines()[-1] == f"fenwear: {said}"
    assert "Traceback" not in done.stderr
    api = "import fenwear\ntry:\n    fenwear.assemble(fenwear.load_case('example1'))\nexcept fenwear.FenwearError as e:"
    done = run_python("-c", f"{code}{api}\n    print(type(e).__name__, e)", cwd=tmp_path)
    assert done.stdout.strip() == f"StackError {said}", done.stderr


def test_missing_library() -> None:
    """As gmsh's wheel has it on a machine without a display."""
    lacks = "libGLU.so.1: cannot open shared object file: No such file or directory"
    with pytest.raises(StackError) as told, stack.importing(), stack.importing():
        raise OSError(lacks)
    assert str(told.value) == f"a library is missing ({lacks}): on Debian, gmsh needs {stack.LIBRARIES}"
    with pytest.raises(OSError, match="full"), stack.importing():
        raise OSError("full")
    with pytest.raises(ModuleNotFoundError), stack.importing():
        import nothing_of_ours  # noqa: F401


@pytest.mark.parametrize("linked", stack.LINKED)
def test_mpi_comes_first(run_python: Run, tmp_path: Path, linked: str) -> None:
    """Whatever is imported first after fenwear finds MPI loaded; fenwear itself loads nothing."""
    code = f"""
import sys, fenwear
assert "mpi4py.MPI" not in sys.modules and not {{"dolfinx", "petsc4py"}} & set(sys.modules)
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == {linked!r}:
            print("mpi4py.MPI" in sys.modules)
sys.meta_path.insert(1, Watch())
import {linked}
"""
    done = run_python("-c", code, cwd=tmp_path, PYTHONPATH=os.pathsep.join(sys.path))
    assert done.stdout.strip() == "True", done.stderr
