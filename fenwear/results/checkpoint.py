"""Checkpoints: a state of a run on disk, whole or not at all, for any number of ranks.

The state goes to one NumPy file, by the paths of its attributes; temperatures of each body to one of their own with the
places of the nodes, so that another number of ranks can read them.
"""

from __future__ import annotations

import json
import os
import shutil
import tomllib
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, grows, regridded, renewed
from fenwear.case import Case
from fenwear.compat import geometry_dofmap
from fenwear.cycle.state import RunState
from fenwear.cycle.totals import none_yet
from fenwear.errors import CaseError, InputError, OutputError
from fenwear.heat.conduction import HeatBody
from fenwear.heat.field import HeatState
from fenwear.parallel import on_root
from fenwear.results.disk import check_room, writing, writing_together
from fenwear.sliding.wear import WornDepths

FOLDER, NEW, OLD = "checkpoint", "checkpoint.new", "checkpoint.old"
CASE, ARRAYS, EXTREMES = "case.toml", "state.npz", "extremes.json"
MEMORY, REMEMBERED = "memory", "remembered"  # what a law of contact remembers, and its temperatures
WARMED = "warmed"  # temperatures that the properties of materials are taken at, where they depend on them
NEAR = 1e-6  # of the extent: how far a node may be from where it was
BYTES_PER_NODE, BYTES = 56, 65536  # that a temperature with its place takes, and a file beside its values
# A run may go on farther than it was meant to, and keep other things.
FREE_KEYS = ("run.half_cycles", "run.periodic_within", "run.until", "output.", "setup.", "title")


def save(directory: Path, system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> None:
    """Replace the checkpoint of a run; collective. A kill at any moment leaves the old or the new one.

    Args:
        directory: Of the run.
        system: The problem.
        state: To go on from.
        extremes: What was largest up to it, which a run that goes on is to know, see `extremes`.

    Raises:
        OutputError: it cannot be written; the old one stays.
    """
    try:
        _save(directory, system, state, extremes)
    except OutputError:  # on all ranks
        on_root(system.comm, lambda: shutil.rmtree(directory / NEW, ignore_errors=True))
        raise


def _save(directory: Path, system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> None:
    comm, new = system.comm, directory / NEW
    on_root(comm, lambda: _begin(new, system, state, extremes))
    if state.temperature is not None:
        write_temperatures(new, comm, state.temperature)
    for number, warm in enumerate(_remembered(state.memory)):
        folder = new / f"{REMEMBERED}_{number}"
        on_root(comm, partial(folder.mkdir))
        write_temperatures(folder, comm, warm)
    if system.bodies.warmed is not None:
        for body, taken in zip(system.bodies.heat, system.bodies.warmed, strict=True):
            _write_function(comm, new, f"{WARMED}_{body.body.name}", body.function(taken))
    comm.Barrier()
    on_root(comm, lambda: swap(directory))


def write_temperatures(folder: Path, comm: MPI.Comm, state: HeatState) -> None:
    """Write the temperatures of both bodies into a folder; collective.

    Raises:
        OutputError: they cannot be written.
    """
    for basis, function in zip(state.bases, state.functions(), strict=True):
        _write_function(comm, folder, f"temperature_{basis.body.body.name}", function)


def _write_function(comm: MPI.Comm, new: Path, name: str, function: fem.Function) -> None:
    """Write a temperature; collective."""
    path = _file(new, name)
    size = BYTES_PER_NODE * function.function_space.dofmap.index_map.size_global + BYTES
    on_root(comm, partial(check_room, new, size))
    with writing_together(comm, path):
        write_nodal(path, function)


def _file(folder: Path, name: str) -> Path:
    """Return the file of a temperature."""
    return folder / f"{name}.npz"


def _begin(new: Path, system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> None:
    with writing(new):
        begin(new, system.case, extremes)
        _write(new, system, state)


def begin(new: Path, case: Case, extremes: Mapping[str, float]) -> None:
    """Make the folder of a new checkpoint, with its case and what was largest; for one rank."""
    shutil.rmtree(new, ignore_errors=True)
    new.mkdir()
    (new / CASE).write_text(case.to_toml(), "utf-8")
    (new / EXTREMES).write_text(json.dumps(dict(extremes)), "utf-8")


def extremes(directory: Path, comm: MPI.Comm) -> dict[str, float]:
    """Return what was largest in a run up to its checkpoint, by name; collective.

    Raises:
        CaseError: there is no checkpoint, or it is damaged.
    """
    return on_root(comm, lambda: _extremes(find(directory)))


def _extremes(folder: Path) -> dict[str, float]:
    try:
        return {str(name): float(value) for name, value in json.loads((folder / EXTREMES).read_text("utf-8")).items()}
    except (AttributeError, OSError, TypeError, ValueError):
        raise damaged(folder) from None


@dataclass(frozen=True)
class Checkpoint:
    """What state.npz holds, besides what the law of contact remembers.

    Attributes:
        state: Of the run, without temperatures, which have files of their own.
        track: What is on its way back on a closed track; None where there is none.
        followed: The wear that the meshes follow; None where they are as made.
        grid: Corner, spacing and counts of the contact grid (3, d - 1); None of one that stays.
    """

    state: RunState
    track: Array | None = None
    followed: WornDepths | None = None
    grid: Array | None = None


def _write(new: Path, system: Tribosystem, state: RunState) -> None:
    grid, track = system.pair.punch.grid, None if state.temperature is None else state.temperature.track
    plain = replace(state, temperature=None, memory=None, finer=None)
    growing = grid.numbers if grid is not None and grows(system) else None
    arrays = dict[str, Any]()
    pack(Checkpoint(plain, track, system.bodies.followed, growing), "", arrays)
    if state.memory is not None:
        pack(replace(state.memory, warm=()), MEMORY, arrays)
    with (new / ARRAYS).open("wb") as file:
        np.savez(file, **arrays)
        file.flush()
        os.fsync(file.fileno())


def _remembered(memory: Any) -> tuple[HeatState, ...]:
    """Return the temperatures that a law of contact remembers."""
    return () if memory is None else tuple(memory.warm)


def _memory(folder: Path, system: Tribosystem, arrays: dict[str, Any]) -> Any:
    """Return what a law of contact remembers; collective."""
    if not any(name.startswith(f"{MEMORY}.") for name in arrays):
        return None
    memory, bodies = _unpacked(system.contact_law.memory, MEMORY, folder, arrays), system.bodies.heat
    count = on_root(system.comm, lambda: len(list(folder.glob(f"{REMEMBERED}_*")))) if bodies else 0
    folders = [folder / f"{REMEMBERED}_{k}" for k in range(count)]
    warm = [HeatState.nodal(bodies, [read_temperature(own, body) for body in bodies]) for own in folders]
    return replace(memory, warm=tuple(warm))


def last_contact(directory: Path) -> Checkpoint:
    """Return the checkpoint of a run; for one rank.

    Raises:
        CaseError: there is no checkpoint, or it is damaged.
    """
    folder = find(directory)
    return _unpacked(Checkpoint, "", folder, _arrays(folder))


def _warmed(folder: Path, system: Tribosystem) -> tuple[Array, Array] | None:
    """Return the temperatures that the materials' properties of a checkpoint are taken at (owned,) each; collective.

    None where they are those of the initial temperature.

    Raises:
        CaseError: it is damaged.
    """
    comm, bodies = system.comm, system.bodies.heat
    if not bodies or not on_root(comm, _file(folder, f"{WARMED}_punch").exists):
        return None
    punch, strip = (read_temperature(folder, body, WARMED) for body in bodies)
    return punch, strip


def swap(directory: Path) -> None:
    """Let the new checkpoint take the place of the one before; for one rank.

    Raises:
        OutputError: it cannot.
    """
    new, current, old = (directory / name for name in (NEW, FOLDER, OLD))
    with writing(current):
        shutil.rmtree(old, ignore_errors=True)
        if current.exists():
            current.rename(old)
        new.rename(current)
        shutil.rmtree(old, ignore_errors=True)


def load(directory: Path, system: Tribosystem) -> tuple[Tribosystem, RunState]:
    """Return the system on the grid, the meshes and with the properties of a checkpoint, and its state; collective.

    Args:
        directory: Of the run.
        system: As it was at the start of the run.

    Raises:
        CaseError: there is no checkpoint, it is damaged, or it is of another case; names the differences.
    """
    comm = system.comm
    folder = on_root(comm, lambda: find(directory))
    kept, arrays = on_root(comm, lambda: _read(folder, system.case))
    grid, temperature = system.pair.punch.grid, None
    if kept.grid is not None and grid is not None:
        system = regridded(system, grid.with_numbers(kept.grid))
    on_root(comm, lambda: _check_sizes(folder, kept, system))
    warmed = _warmed(folder, system)
    if kept.followed is not None or warmed is not None:
        system = renewed(system, kept.followed, warmed)
    if system.bodies.heat:
        read = [read_temperature(folder, body) for body in system.bodies.heat]
        temperature = HeatState.nodal(system.bodies.heat, read, kept.track)
    return system, replace(kept.state, temperature=temperature, memory=_memory(folder, system, arrays))


def read_temperature(folder: Path, body: HeatBody, name: str = "temperature") -> Array:
    """Return the temperatures of this rank's own nodes of a body; collective.

    Raises:
        CaseError: they cannot be read.
    """
    comm, values = body.body.mesh.comm, np.full(body.owned, np.nan)
    with suppress(EOFError, KeyError, OSError, ValueError, zipfile.BadZipFile):
        values = read_nodal(_file(folder, f"{name}_{body.body.name}"), body.space)
    if not comm.allreduce(bool(np.isfinite(values).all()), op=MPI.LAND):
        raise damaged(folder)
    return values


def damaged(folder: Path) -> CaseError:
    """Return the error of a checkpoint that cannot be read."""
    what = f"the checkpoint in {folder} is damaged, or of an earlier version; expected to start again, without"
    return CaseError(InputError("--resume", what))


def find(directory: Path) -> Path:
    """Return the folder of a run's checkpoint.

    Raises:
        CaseError: there is none.
    """
    for name in (FOLDER, OLD):  # killed between two renames only the old one is left
        if (directory / name / ARRAYS).is_file():
            return directory / name
    raise CaseError(InputError("--resume", f"no checkpoint in {directory}"))


def reached(directory: Path) -> int | None:
    """Return the half-cycle of the checkpoint in a run's folder; None where there is none to go on from."""
    try:
        return int(_arrays(find(directory))["state.half_cycle"])
    except CaseError:
        return None


def _arrays(folder: Path) -> dict[str, Any]:
    try:
        with np.load(folder / ARRAYS) as arrays:
            return dict(arrays)
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
        raise damaged(folder) from None


def _unpacked(kind: Any, path: str, folder: Path, arrays: dict[str, Any]) -> Any:
    """Return an object of a kind from a checkpoint's arrays.

    Raises:
        CaseError: they do not hold it.
    """
    try:
        return unpack(kind, path, arrays)
    except (KeyError, TypeError, ValueError):
        raise damaged(folder) from None


def check_case(folder: Path, case: Case) -> None:
    """Make sure that a checkpoint is of this case.

    Raises:
        CaseError: it is of another one, whose differences are named, or damaged.
    """
    try:
        saved = _flat(tomllib.loads((folder / CASE).read_text("utf-8")))
    except (OSError, ValueError):
        raise damaged(folder) from None
    present = _flat(tomllib.loads(case.to_toml()))
    keys = sorted({*saved, *present})
    problems = [
        InputError(key, f"the checkpoint has {saved.get(key, 'nothing')!r}, the case {present.get(key, 'nothing')!r}")
        for key in keys
        if saved.get(key) != present.get(key) and not key.startswith(FREE_KEYS)
    ]
    if problems:
        raise CaseError([InputError("--resume", "the checkpoint is of another case"), *problems])


def _read(folder: Path, case: Case) -> tuple[Checkpoint, dict[str, Any]]:
    """Return a checkpoint of this case and the arrays that it is made of."""
    check_case(folder, case)
    arrays = _arrays(folder)
    return _unpacked(Checkpoint, "", folder, arrays), arrays


def _check_sizes(folder: Path, kept: Checkpoint, system: Tribosystem) -> None:
    """Raise where depths and totals are not those of a system on the checkpoint's grid, or are no numbers."""
    expected = system.unworn()
    worn = kept.state.worn
    followed = kept.followed or worn
    for own, like in ((worn, expected), (followed, expected), (kept.state.totals, none_yet(system))):
        pairs = [(getattr(own, field.name), getattr(like, field.name)) for field in fields(like)]
        if any(values.shape != wanted.shape for values, wanted in pairs):
            raise damaged(folder)
    if not all(np.isfinite(depth).all() for one in (worn, followed) for depth in (one.punch, one.strip)):
        raise damaged(folder)


def _flat(tables: Any, path: str = "") -> dict[str, Any]:
    """Return nested tables as one, keyed by the path."""
    if isinstance(tables, dict):
        items: Any = tables.items()
    elif isinstance(tables, list) and any(isinstance(item, dict) for item in tables):
        items = enumerate(tables)
    else:
        return {path: tables}
    return {k: v for key, value in items for k, v in _flat(value, f"{path}.{key}" if path else str(key)).items()}


def pack(value: Any, path: str, into: dict[str, Any]) -> None:
    """Put a data class, a list or tuple, an array or a number under its path; None is left out."""
    start = f"{path}." if path else ""
    if is_dataclass(value):
        for field in fields(value):
            pack(getattr(value, field.name), start + field.name, into)
    elif isinstance(value, list | tuple):
        into[path] = np.asarray(len(value))
        for number, item in enumerate(value):
            pack(item, f"{start}{number}", into)
    elif value is not None:
        into[path] = np.asarray(value)


def unpack(kind: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """Return what was put under a path, of this type."""
    start, kinds = f"{path}." if path else "", get_args(kind)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: unpack(hints[f.name], start + f.name, arrays) for f in fields(kind)})
    if get_origin(kind) in (list, tuple):
        return get_origin(kind)(unpack(kinds[0], f"{start}{k}", arrays) for k in range(int(arrays[path])))
    present = path in arrays or any(name.startswith(start) for name in arrays)
    if not present and (kind is Any or type(None) in kinds):
        return None
    inner = next((one for one in kinds if is_dataclass(one)), None)
    if inner is not None:
        return unpack(inner, path, arrays)
    values = arrays[path]
    return values if values.ndim else values.item()


def write_nodal(path: Path, function: fem.Function) -> None:
    """Write nodal values of a scalar function with their places; collective.

    Raises:
        OSError: they cannot be written; on every rank.
    """
    space = function.function_space
    own = space.dofmap.index_map.size_local
    parts = space.mesh.comm.gather((_places(space), function.x.array[:own])) or []

    def save() -> None:
        with path.open("wb") as file:
            np.savez(file, places=np.concatenate([p[0] for p in parts]), values=np.concatenate([p[1] for p in parts]))

    on_root(space.mesh.comm, save)


def read_nodal(path: Path, space: fem.FunctionSpace) -> Array:
    """Return the values of this rank's own nodes (owned,); collective.

    Raises:
        ValueError: they are of other nodes.
        EOFError, KeyError, OSError, zipfile.BadZipFile: they cannot be read.
    """
    own = _places(space)
    with np.load(path, allow_pickle=False) as stored:
        places, values = stored["places"], np.asarray(stored["values"])
    far, at = cKDTree(places).query(own)
    if far.max(initial=0.0) > NEAR * np.ptp(places, axis=0).max():
        raise ValueError("values of other nodes")
    found: Array = values[at]
    return found


def _places(space: fem.FunctionSpace) -> Array:
    """Return where this rank's own nodes are, and the middle of the cells around each (owned, 6); collective.

    The middle tells the nodes on both sides of a slit apart, which have the same place.
    """
    mesh, index_map = space.mesh, space.dofmap.index_map
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    nodes = space.dofmap.list[:cells]
    middles = mesh.geometry.x[geometry_dofmap(mesh)[:cells]].mean(axis=1)
    sums = [fem.Function(space) for _ in range(4)]
    for function, values in zip(sums, (*middles.T, np.ones(cells)), strict=True):
        np.add.at(function.x.array, nodes, values[:, None])
        function.x.scatter_reverse(la.InsertMode.add)
    own = np.column_stack([function.x.array[: index_map.size_local] for function in sums])
    return np.hstack([space.tabulate_dof_coordinates()[: len(own)], own[:, :3] / own[:, 3:]])
