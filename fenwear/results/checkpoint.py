"""Checkpoints: a state of a run on disk, whole or not at all, for any number of ranks.

The state goes to one NumPy file, by the paths of its attributes, with the case and the extremes of the run as texts.
Temperatures stand there with the places of their nodes, so that another number of ranks can read them.
"""

from __future__ import annotations

import json
import os
import tomllib
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fenwear.case import Case
from fenwear.case.body_names import by_roles
from fenwear.common.arrays import Array
from fenwear.common.compat import geometry_dofmap
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root
from fenwear.heat.conduction import HeatBody
from fenwear.heat.temperature import HeatState
from fenwear.laws.wear import WornDepths
from fenwear.results.disk import check_room, replacing
from fenwear.steps.run_state import RunState, none_yet
from fenwear.system import Tribosystem, grows, regridded, renewed

FILE = "checkpoint.npz"
CASE, EXTREMES = "case", "extremes"  # names of its texts
MEMORY, REMEMBERED = "memory", "remembered"  # what a law of contact remembers, and its temperatures
TEMPERATURE = "temperature"
WARMED = "warmed"  # temperatures that the properties of materials are taken at, where they depend on them
NEAR = 1e-6  # of the extent: how far a node may be from where it was
BYTES = 1024  # of the file's own for each array, generously
# A run may go on farther than it was meant to, and keep other things.
FREE_KEYS = ("run.half_cycles", "run.periodic_within", "run.until", "output.", "setup.", "title")

Arrays = dict[str, NDArray[Any]]  # of a checkpoint, by their names


@dataclass(frozen=True)
class Checkpoint:
    """The state in a checkpoint, besides temperatures and what the law of contact remembers.

    Attributes:
        state: Of the run, without temperatures.
        track: Temperatures that return on a closed track; None where there is none.
        followed: The wear that the meshes follow; None where they are as made.
        grid: Corner, spacing and counts of the contact grid (3, d - 1); None of one that stays.
    """

    state: RunState
    track: Array | None = None
    followed: WornDepths | None = None
    grid: Array | None = None


def save(directory: Path, system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> None:
    """Replace the checkpoint of a run; collective. A kill at any moment leaves the old or the new one.

    Args:
        directory: Of the run.
        system: The problem.
        state: To resume from.
        extremes: The largest errors and temperatures up to it, by name.

    Raises:
        OutputError: it cannot be written; the old one stays.
    """
    temperatures = {name: nodal_table(function) for name, function in _temperatures(system, state).items()}
    on_root(
        system.bodies.comm, lambda: _write(directory / FILE, {**_arrays_of(system, state, extremes), **temperatures})
    )


def _temperatures(system: Tribosystem, state: RunState) -> dict[str, fem.Function]:
    """Return the temperatures of a state as functions on the meshes, by their names in a checkpoint; collective."""
    warm = {} if state.temperature is None else {TEMPERATURE: state.temperature.functions()}
    remembered = () if state.memory is None else state.memory.warm
    warm |= {f"{REMEMBERED}_{number}": temperatures.functions() for number, temperatures in enumerate(remembered)}
    if system.bodies.warmed is not None:
        punch, strip = (body.function(t) for body, t in zip(system.bodies.heat, system.bodies.warmed, strict=True))
        warm[WARMED] = punch, strip
    return {
        f"{name}_{body}": function
        for name, pair in warm.items()
        for body, function in zip(("punch", "strip"), pair, strict=True)
    }


def _arrays_of(system: Tribosystem, state: RunState, extremes: Mapping[str, float]) -> dict[str, Any]:
    """Return the arrays of a checkpoint without temperatures."""
    grid, track = system.pair.punch.grid, None if state.temperature is None else state.temperature.track
    plain = replace(state, temperature=None, memory=None, finer=None)
    growing = grid.numbers if grid is not None and grows(system) else None
    arrays: dict[str, Any] = {CASE: system.case.to_toml(), EXTREMES: json.dumps(dict(extremes))}
    pack(Checkpoint(plain, track, system.bodies.followed, growing), "", arrays)
    if state.memory is not None:
        pack(replace(state.memory, warm=()), MEMORY, arrays)
    return arrays


def _write(path: Path, arrays: Mapping[str, Any]) -> None:
    with replacing(path) as part:
        check_room(path.parent, sum(np.asarray(array).nbytes + BYTES for array in arrays.values()))
        with part.open("wb") as file:
            np.savez(file, **arrays)
            file.flush()
            os.fsync(file.fileno())


def load(directory: Path, system: Tribosystem) -> tuple[Tribosystem, RunState, dict[str, float]]:
    """Return the system on the grid, the meshes and with the properties of a checkpoint, its state, and its extremes.

    Collective.

    Args:
        directory: Of the run.
        system: As it was at the start of the run.

    Raises:
        CaseError: there is no checkpoint, it is damaged, or it is of another case; names the differences.
    """
    comm = system.bodies.comm
    arrays = on_root(comm, lambda: _checked(directory, system.case))
    kept, grid, temperature = _unpacked(Checkpoint, "", directory, arrays), system.pair.punch.grid, None
    if kept.grid is not None and grid is not None:
        system = regridded(system, grid.with_numbers(kept.grid))
    on_root(comm, lambda: _check_sizes(directory, kept, system))
    warmed = _read(directory, arrays, WARMED, system.bodies.heat)
    if kept.followed is not None or warmed:
        system = renewed(system, kept.followed, (warmed[0], warmed[1]) if warmed else None)
    bodies, memory = system.bodies.heat, None
    if bodies:
        read = _read(directory, arrays, TEMPERATURE, bodies)
        if not read:
            raise damaged(directory)
        temperature = HeatState.nodal(bodies, read, kept.track)
    if any(name.startswith(f"{MEMORY}.") for name in arrays):
        names = [f"{REMEMBERED}_{k}" for k in range(len(arrays)) if f"{REMEMBERED}_{k}_punch" in arrays]
        warm = tuple(HeatState.nodal(bodies, _read(directory, arrays, name, bodies)) for name in names)
        memory = replace(_unpacked(system.law.memory, MEMORY, directory, arrays), warm=warm)
    state = replace(kept.state, temperature=temperature, memory=memory)
    return system, state, {name: float(value) for name, value in json.loads(str(arrays[EXTREMES])).items()}


def _read(directory: Path, arrays: Arrays, name: str, bodies: Sequence[HeatBody]) -> list[Array]:
    """Return temperatures of this rank's own nodes of both bodies; none where a checkpoint has none; collective.

    Raises:
        CaseError: they are of other nodes, or no numbers.
    """
    temperatures: list[Array] = []
    for body in bodies:
        if (table := arrays.get(f"{name}_{body.body.name}")) is None:
            continue
        values = np.full(body.owned, np.nan)
        with suppress(IndexError, ValueError):
            values = nodal_values(table, body.space)
        if not body.body.mesh.comm.allreduce(bool(np.isfinite(values).all()), op=MPI.LAND):
            raise damaged(directory)
        temperatures.append(values)
    return temperatures


def last_contact(directory: Path) -> Checkpoint:
    """Return the checkpoint of a run; for one rank.

    Raises:
        CaseError: there is no checkpoint, or it is damaged.
    """
    return _unpacked(Checkpoint, "", directory, _arrays(directory))


def damaged(directory: Path) -> CaseError:
    """Return the error of a checkpoint that cannot be read."""
    message = f"the checkpoint in {directory} is damaged, or of an earlier version. Start again without --resume"
    return CaseError(InputError("--resume", message))


def reached(directory: Path) -> int | None:
    """Return the half-cycle of the checkpoint in a run's folder; None where there is none to resume from."""
    try:
        return int(_arrays(directory)["state.half_cycle"])
    except CaseError:
        return None


def _arrays(directory: Path) -> Arrays:
    try:
        with np.load(directory / FILE) as arrays:
            return dict(arrays)
    except FileNotFoundError:
        older = (directory / "checkpoint").is_dir()
        raise (
            damaged(directory) if older else CaseError(InputError("--resume", f"no checkpoint in {directory}"))
        ) from None
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
        raise damaged(directory) from None


def _unpacked(kind: Any, path: str, directory: Path, arrays: Arrays) -> Any:
    """Return an object of a kind from a checkpoint's arrays.

    Raises:
        CaseError: they do not hold it.
    """
    try:
        return unpack(kind, path, arrays)
    except (KeyError, TypeError, ValueError):
        raise damaged(directory) from None


def _checked(directory: Path, case: Case) -> Arrays:
    """Return the arrays of the checkpoint of a case.

    Raises:
        CaseError: there is none, it is damaged, or of another case, whose differences are named.
    """
    arrays = _arrays(directory)
    try:
        saved, _ = _flat(by_roles(tomllib.loads(str(arrays[CASE])))), json.loads(str(arrays[EXTREMES]))
    except (KeyError, ValueError):
        raise damaged(directory) from None
    present = _flat(by_roles(tomllib.loads(case.to_toml())))
    keys = sorted({*saved, *present})
    problems = [
        InputError(key, f"the checkpoint has {_shown(saved, key)}, the case {_shown(present, key)}")
        for key in keys
        if saved.get(key) != present.get(key) and not key.startswith(FREE_KEYS)
    ]
    if problems:
        raise CaseError([InputError("--resume", "the checkpoint is of another case"), *problems])
    return arrays


def _check_sizes(directory: Path, kept: Checkpoint, system: Tribosystem) -> None:
    """Raise where depths and totals are not those of a system on the checkpoint's grid, or are no numbers."""
    expected = system.unworn()
    worn = kept.state.worn
    followed = kept.followed or worn
    for stored, like in ((worn, expected), (followed, expected), (kept.state.totals, none_yet(system.pair))):
        pairs = [(getattr(stored, field.name), getattr(like, field.name)) for field in fields(like)]
        if any(values.shape != wanted.shape for values, wanted in pairs):
            raise damaged(directory)
    if not all(np.isfinite(depth).all() for depths in (worn, followed) for depth in (depths.punch, depths.strip)):
        raise damaged(directory)


def _shown(keys: Mapping[str, Any], key: str) -> str:
    """Return the value of a key for a message, a number without the digits that are rounding."""
    value = keys.get(key, "nothing")
    return f"{value:.12g}" if isinstance(value, float) else repr(value)


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
    """Return the object stored under a path, of this type."""
    start, kinds = f"{path}." if path else "", get_args(kind)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: unpack(hints[f.name], start + f.name, arrays) for f in fields(kind)})
    if get_origin(kind) in (list, tuple):
        return get_origin(kind)(unpack(kinds[0], f"{start}{k}", arrays) for k in range(int(arrays[path])))
    present = path in arrays or any(name.startswith(start) for name in arrays)
    if not present and (kind is Any or type(None) in kinds):
        return None
    inner = next((member for member in kinds if is_dataclass(member)), None)
    if inner is not None:
        return unpack(inner, path, arrays)
    values = arrays[path]
    return values if values.ndim else values.item()


def nodal_table(function: fem.Function) -> Array:
    """Return the places and, in the last column, the values of all nodes of a function (N, 7); collective.

    On rank 0; that of no node on others.
    """
    space = function.function_space
    owned = space.dofmap.index_map.size_local
    rows = np.column_stack([_places(space), function.x.array[:owned]])
    return np.concatenate(space.mesh.comm.gather(rows) or [rows[:0]])


def nodal_values(table: Array, space: fem.FunctionSpace) -> Array:
    """Return the values of this rank's own nodes (owned,), from a table of all nodes (N, 7); collective.

    Raises:
        ValueError: they are of other nodes.
    """
    places = table[:, :-1]
    far, at = cKDTree(places).query(_places(space))
    if far.max(initial=0.0) > NEAR * np.ptp(places, axis=0).max():
        raise ValueError("values of other nodes")
    return np.asarray(table[at, -1])


def _places(space: fem.FunctionSpace) -> Array:
    """Return where this rank's own nodes are, and the middle of the cells around each (owned, 6); collective.

    The middle separates the nodes on both sides of a slit, which have the same place.
    """
    mesh, index_map = space.mesh, space.dofmap.index_map
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    nodes = space.dofmap.list[:cells]
    middles = mesh.geometry.x[geometry_dofmap(mesh)[:cells]].mean(axis=1)
    sums = [fem.Function(space) for _ in range(4)]
    for function, values in zip(sums, (*middles.T, np.ones(cells)), strict=True):
        np.add.at(function.x.array, nodes, values[:, None])
        function.x.scatter_reverse(la.InsertMode.add)
    owned = np.column_stack([function.x.array[: index_map.size_local] for function in sums])
    return np.hstack([space.tabulate_dof_coordinates()[: len(owned)], owned[:, :3] / owned[:, 3:]])
