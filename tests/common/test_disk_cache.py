"""What is kept on disk: taken where it fits, computed where it does not, and never in the way."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from fenwear import Case, CaseError, Tribosystem, assemble, load_case
from fenwear.algebra import factor
from fenwear.bodies import distributed_mesh, substructure
from fenwear.bodies.ready_geometries import meshes_folder
from fenwear.case import Geometry
from fenwear.common import disk_cache
from fenwear.heat import fitted, passing_strip
from fenwear.heat.temperature import ReducedBasis
from fenwear.system.both_bodies import build_bodies

SMALL = ("geometry.parameters.elements_along_contact=4", "geometry.degree=2")
Setup = Callable[..., tuple[Tribosystem, int]]


@pytest.fixture
def setup(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Setup:
    """Return setup(*settings): a system, with how many factors it took; what is kept is in a folder of the test."""
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("cache"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.setenv(disk_cache.LIMIT, "1")
    monkeypatch.setattr(disk_cache, "_reported", [])
    made: list[object] = []
    for kind, name in ((factor.Factor, "compute"), (substructure.Substructures, "compute")):
        compute = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda self, compute=compute: (made.append(self), compute(self))[1])

    def setup(*settings: str, name: str = "example1", fresh: bool = False) -> tuple[Tribosystem, int]:
        made.clear()
        system = assemble(load_case(name, [*SMALL, *settings]), heat="none", fresh=fresh)
        return system, len(made)

    return setup


def same(one: Tribosystem, other: Tribosystem) -> bool:
    """Return whether both bodies' answers are equal to the last bit."""
    pairs = [
        (getattr(one.elastic.condensed, name), getattr(other.elastic.condensed, name)) for name in ("punch", "strip")
    ]
    return all(
        a.arrays().keys() == b.arrays().keys() and all((a.arrays()[k] == b.arrays()[k]).all() for k in a.arrays())
        for a, b in pairs
    )


@pytest.mark.parametrize("name", ["example1", "example1-heat"])
@pytest.mark.mpi
def test_a_second_start_factors_nothing(setup: Setup, name: str) -> None:
    """And has the same bits; --fresh factors, and gives them, too."""
    first, count = setup(name=name)
    again, none = setup(name=name)
    anew, both = setup(name=name, fresh=True)
    assert (count, none, both) == (2, 0, 2)
    assert same(first, again)
    assert same(first, anew)


@pytest.mark.parametrize(
    ("setting", "count"),
    [
        ("contact.friction=0.1", 0),
        ("motion.amplitude=1", 0),
        ("materials.steel.young=2.1e5", 2),
        ("materials.composite.poisson=0.2", 1),
        ("punch.loads.0.force=['0 N', '-5 kN']", 1),
        ("geometry.parameters.strip_height=90", 2),
        ("model.thickness=11", 1),
        ("geometry.degree=3", 2),
    ],
)
def test_only_what_a_change_leaves_is_taken(
    setup: Setup, monkeypatch: pytest.MonkeyPatch, setting: str, count: int
) -> None:
    """A body whose mesh, material, supports or loads differ is condensed anew, to what it is without a cache."""
    setup()
    changed, found = setup(setting)
    assert found == count
    monkeypatch.setenv(disk_cache.LIMIT, "0")
    assert same(changed, setup(setting)[0])


@pytest.fixture
def meshed(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Return meshed(case, *settings): how often gmsh is called for a case; what is kept is in a folder of the test."""
    opened: list[object] = []
    open_model = distributed_mesh.gmsh_model
    monkeypatch.setattr(distributed_mesh, "gmsh_model", lambda: (opened.append(1), open_model())[1])

    def meshed(case: Case, *, fresh: bool = False) -> int:
        opened.clear()
        build_bodies(case, fresh=fresh)
        return MPI.COMM_WORLD.bcast(len(opened))

    return meshed


@pytest.mark.parametrize(
    ("setting", "count"),
    [
        ("materials.steel.young=2.1e5", 0),
        ("geometry.parameters.strip_height=90", 1),
        ("model.plane='strain'", 1),
        ("geometry.order=2", 1),
    ],
)
@pytest.mark.mpi("geometry.order=2-1")
def test_meshes_are_kept_too(meshed: Callable[..., int], setting: str, count: int) -> None:
    """And made again by --fresh, or where they are others."""
    case, changed = (load_case("example1", [*SMALL, *more]) for more in ([], [setting]))
    assert (meshed(case), meshed(case), meshed(case, fresh=True)) == (1, 0, 1)
    assert (meshed(changed), meshed(changed)) == (count, 0)


@pytest.mark.parametrize("name", ["own.geo", "part.geo"])
def test_a_geometry_that_has_changed_is_meshed_again(meshed: Callable[..., int], tmp_path: Path, name: str) -> None:
    """Its own text, and that of what it includes, which nothing is kept of."""
    text = (meshes_folder() / "punch_on_strip.geo").read_text("utf-8")
    (tmp_path / "part.geo").write_text(text, "utf-8")
    (tmp_path / "own.geo").write_text(text if name == "own.geo" else 'Include "part.geo";', "utf-8")
    case = load_case("example1").model_copy(update={"geometry": Geometry(file="own.geo")}).at(tmp_path)
    assert (meshed(case), meshed(case)) == ((1, 0) if name == "own.geo" else (1, 1))
    (tmp_path / name).write_text(text.replace("100", "90"), "utf-8")
    assert meshed(case) == 1


@pytest.mark.parametrize("damage", ["cut", "changed", "emptied", "another"])
@pytest.mark.mpi("changed")
def test_a_broken_file_is_computed_again(setup: Setup, damage: str) -> None:
    """On every rank, though one of them alone finds it broken."""
    first, _ = setup()
    if MPI.COMM_WORLD.rank == 0:
        for path in disk_cache.folder().glob("*-0of*.npz"):  # the meshes among them
            content = bytearray(path.read_bytes())
            content[len(content) // 2] ^= 255
            path.write_bytes(
                {"cut": bytes(content[:900]), "changed": bytes(content), "emptied": b"", "another": b"text"}[damage]
            )
    MPI.COMM_WORLD.Barrier()
    again, count = setup()
    assert count == 2
    assert same(first, again)
    assert setup()[1] == 0


def test_a_folder_that_cannot_be_written_is_told_once(setup: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    """And the set-up goes on."""
    Path(os.environ["XDG_CACHE_HOME"], "fenwear").write_text("a file")
    assert setup()[1] == 2
    assert setup()[1] == 2
    assert capsys.readouterr().err.count("set-ups are not kept in") == 1


def test_a_full_disk_leaves_no_part_of_a_file(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor does it end the run."""

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    assert setup()[1] == 2
    assert not list(disk_cache.folder().iterdir())


def test_the_longest_unused_goes_first(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """Above the limit."""
    setup()
    for path, _ in disk_cache.files():
        os.utime(path, (1.0, 1.0))
    room = 1.01 * sum(size for _, size in disk_cache.files())
    monkeypatch.setenv(disk_cache.LIMIT, str(room / 2**30))
    setup("materials.steel.young=2.1e5")
    assert sum(size for _, size in disk_cache.files()) <= disk_cache.limit()
    assert all(path.stat().st_mtime > 1.0 for path, _ in disk_cache.files())


@pytest.mark.parametrize("text", ["much", "-1", "nan"])
def test_a_limit_that_is_no_number_is_named(setup: Setup, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    """Before anything is computed."""
    monkeypatch.setenv(disk_cache.LIMIT, text)
    with pytest.raises(CaseError, match="FENWEAR_KEPT_GIB: expected a number of GiB, 0 to keep nothing"):
        setup()


@pytest.mark.parametrize("change", ["", "heat.convection=90", "heat.steps=6", "motion.amplitude=20"])
@pytest.mark.mpi("heat.steps=6")
def test_reduced_heat_is_kept_too(setup: Setup, monkeypatch: pytest.MonkeyPatch, change: str) -> None:
    """With the same bits, and reduced again by --fresh or where conduction or motion is another."""
    made: list[object] = []
    reduce = fitted.reduced_basis
    for module in (fitted, passing_strip):
        monkeypatch.setattr(
            module, "reduced_basis", lambda *given, **named: (made.append(given), reduce(*given, **named))[1]
        )

    def bases(*changes: str, fresh: bool = False) -> tuple[list[bytes], int]:
        made.clear()
        system = assemble(load_case("example1-heat", [*SMALL, *changes]), heat="reduced", fresh=fresh)
        pair = [basis for basis in system.exchange.bases if isinstance(basis, ReducedBasis)]
        return [part.tobytes() for basis in pair for part in (basis.lift, basis.columns)], len(made)

    first, all_of_them = bases()
    assert all_of_them >= 2
    changed, count = bases(*([change] if change else []))
    assert (count == 0) == (not change)
    monkeypatch.setenv(disk_cache.LIMIT, "0")
    again, _ = bases(*([change] if change else []))
    assert changed == again
    monkeypatch.setenv(disk_cache.LIMIT, "1")
    assert bases(fresh=True) == (first, all_of_them)
