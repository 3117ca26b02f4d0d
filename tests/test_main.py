"""What becomes of errors that nobody foresaw, and of parts of the stack without metadata."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
import typer
from mpi4py import MPI

from fenwear import __main__, cli
from fenwear.common.errors import CaseError, OutputError
from fenwear.common.stack import versions
from fenwear.results.history import clear_directory, make_directory


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (typer.Abort(), "fenwear: interrupted\n"),
        (KeyboardInterrupt(), "fenwear: interrupted\n"),
        (OutputError(Path("x.nc"), "no space left"), "fenwear: x.nc cannot be written: no space left\n"),
    ],
)
def test_ends(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: BaseException, said: str
) -> None:
    """Status 1 and one line, without a traceback."""

    def app(**_: object) -> None:
        raise error

    monkeypatch.setattr(cli, "app", app)
    assert __main__._call([], MPI.COMM_SELF) == 1
    assert capsys.readouterr().err == said


def test_a_defect_shows_where_it_is(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    """Status 1 with the traceback: a defect of the program is not hidden."""

    def app(**_: object) -> None:
        raise KeyError("missing")

    monkeypatch.setattr(cli, "app", app)
    monkeypatch.setattr(sys, "__stderr__", sys.stderr)
    assert __main__._call([], MPI.COMM_SELF) == 1
    assert "KeyError: 'missing'" in capfd.readouterr().err


def test_complex_petsc_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """PETSc built for complex numbers: said before anything is assembled."""
    from petsc4py import PETSc

    monkeypatch.setattr(PETSc, "ScalarType", np.complex128)
    monkeypatch.setattr("sys.argv", ["fenwear", "info"])
    assert __main__.main() == 1
    assert "PETSc with real numbers" in capsys.readouterr().err


def test_version_of_a_module_without_metadata(monkeypatch: pytest.MonkeyPatch) -> None:
    """The module's own version, under the same name."""
    known, right = versions(), metadata.version

    def version(name: str) -> str:
        if name in ("gmsh", "fenics-ufl"):
            raise metadata.PackageNotFoundError(name)
        return right(name)

    monkeypatch.setattr(metadata, "version", version)
    import gmsh
    import ufl

    found = versions()
    assert list(found) == list(known)
    assert (found["gmsh"], found["fenics-ufl"]) == (gmsh.__version__, str(getattr(ufl, "__version__", "present")))


def test_a_reader_that_goes_away_ends_nothing() -> None:
    """What is written to `head`, or `less` that was left, is lost, and the run goes on."""
    script = """
import os
from fenwear.__main__ import _Patient
reader, writer = os.pipe()
os.close(reader)
stream = _Patient(os.fdopen(writer, "w"))
for _ in range(3):
    stream.write("x" * 100_000)
    stream.flush()
assert stream.fileno() == writer
stream.close()
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)  # PETSc, which tests load, takes the signal


def test_a_folder_of_results_is_overwritten_or_left(tmp_path: Path) -> None:
    """Results alone are removed; of two runs that begin at once in a folder one finds the other."""
    folder = tmp_path / "run"
    make_directory(folder)
    with pytest.raises(CaseError, match="exists already"):
        make_directory(folder)
    (folder / "history.nc").touch()
    clear_directory(folder)
    assert not folder.exists()
    clear_directory(folder)
    folder.mkdir()
    (folder / "notes.txt").touch()
    with pytest.raises(CaseError, match=r"--overwrite.*notes\.txt"):
        clear_directory(folder)
