"""A folder for compiled forms, whatever XDG_CACHE_HOME is."""

from __future__ import annotations

import os
from pathlib import Path

import dolfinx.jit
import ffcx.codegeneration.jit
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from fenwear.algebra.assembled import compiled
from fenwear.common.stack import ensure_folder


@pytest.mark.mpi
@pytest.mark.parametrize("place", ["a file", "a file/below", "missing", ""])
def test_folder(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What can be made is made; else one sentence names the place, and a temporary folder takes it."""
    (tmp_path / "a file").write_text("")
    MPI.COMM_WORLD.Barrier()
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / place) if place else "")
    told = ensure_folder(MPI.COMM_WORLD)
    if place.startswith("a file"):
        assert told is not None
        assert told.startswith(f"{tmp_path / place} cannot be written (Not a directory): ")
        assert MPI.COMM_WORLD.bcast(os.environ["XDG_CACHE_HOME"]) == os.environ["XDG_CACHE_HOME"]
        assert Path(os.environ["XDG_CACHE_HOME"]).is_dir()
    else:
        assert told is None
        assert (tmp_path / (place or ".cache") / "fenics").is_dir()


def test_another_compilation_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where another process compiles the same form, and takes longer than the ten seconds that dolfinx waits."""
    monkeypatch.setitem(dolfinx.jit.DOLFINX_DEFAULT_JIT_OPTIONS, "cache_dir", (tmp_path, ""))
    form = fem.Constant(mesh.create_unit_interval(MPI.COMM_SELF, 2), 3.0) * ufl.dx
    compiled(form)
    (ready,) = tmp_path.rglob("*.cached")
    hidden, waited = ready.rename(tmp_path / "hidden"), []

    def sleep(seconds: float) -> None:
        waited.append(seconds)
        if sum(waited) == 60:
            hidden.rename(ready)

    monkeypatch.setattr(ffcx.codegeneration.jit.time, "sleep", sleep)
    assert fem.assemble_scalar(compiled(form)) == pytest.approx(3)
    assert sum(waited) == 60
