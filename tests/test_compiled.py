"""A folder for compiled forms, whatever XDG_CACHE_HOME is."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from mpi4py import MPI

from fenwear.compiled import ensure_folder


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
