"""Checkpoints: a state of a run on disk, whole or not at all, for any number of ranks.

Arrays of the interface go to one NumPy file; temperatures of each body to one of their own with the places of
the nodes, so that another number of ranks can read them.
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
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, grows
from fenwear.bodies.grid import RegularGrid
from fenwear.case import Case, OneWay, Rotation
from fenwear.contact import ContactState
from fenwear.cycle.state import RunState
from fenwear.cycle.totals import SUMS, Totals
from fenwear.errors import CaseError, InputError, OutputError
from fenwear.heat.conduction import HeatBody
from fenwear.heat.field import HeatState
from fenwear.parallel import on_root
from fenwear.results import nodal
from fenwear.results.disk import check_room, writing, writing_together
from fenwear.sliding.wear import WornDepths

FOLDER, NEW, OLD = "checkpoint", "checkpoint.new", "checkpoint.old"
CASE, ARRAYS, EXTREMES = "case.toml", "state.npz", "extremes.json"
NUMBERS, WEAR, STATES = (
    ("half_cycle", "jump_length", "periodic_phases"),
    ("wear", "wear_strip"),
    ("pressure", "gap", "rigid"),
)
TOTALS = ("totals", "energy", "pressure_sum")
BETWEEN = "between"  # the state of what lies between the surfaces, without rows where nothing does that changes
CREPT = "crept"  # the state of what creeps, empty where nothing does
CARRIED = "carried"  # the states of the strip's material that laws remember, without rows where there are none
WARMED = "warmed"  # temperatures that the properties of materials are taken at, where they depend on them
MEMORY, REMEMBERED = "memory", "remembered"  # what a law of contact remembers, and its temperatures
BULK = "bulk"  # what is on its way back on a closed track; NaN where there is none
FOLLOWED = ("followed_punch", "followed_strip")  # the wear that the meshes follow, where they do
GRID = "grid"  # corner, spacing and counts of the contact grid (3, d - 1), where it grows
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
    if system.bodies.warmed is not None and system.bodies.heat is not None:
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
        nodal.write(path, function)


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


def _write(new: Path, system: Tribosystem, state: RunState) -> None:
    n, r = len(system.pair.weights), len(system.rigid.resultant)
    empty = ContactState(np.full((1, n), np.nan), np.full((1, n), np.nan), np.full((1, r), np.nan), 0)
    contacts = [contact or empty for contact in state.contacts]
    with (new / ARRAYS).open("wb") as file:
        np.savez(
            file,
            **{name: getattr(state, name) for name in NUMBERS},
            **_depths(WEAR, state.worn),
            **_between(state.worn),
            **_totals(state.totals),
            **_bulk(state.temperature),
            **({} if system.bodies.followed is None else _depths(FOLLOWED, system.bodies.followed)),
            **_grid(system),
            **{name: np.concatenate([getattr(c, name) for c in contacts]) for name in STATES},
            **_packed(state.memory),
        )
        file.flush()
        os.fsync(file.fileno())


def _grid(system: Tribosystem) -> dict[str, Any]:
    own = system.pair.punch.grid
    return {} if own is None or not grows(system) else {GRID: own.numbers}


def _remembered(memory: Any) -> tuple[HeatState, ...]:
    """Return the temperatures that a law of contact remembers."""
    return () if memory is None else tuple(memory.warm)


def _packed(memory: Any) -> dict[str, Any]:
    """Return the arrays of what a law of contact remembers, by their paths."""
    arrays = dict[str, Any]()
    if memory is not None:
        pack(replace(memory, warm=()), MEMORY, arrays)
    return arrays


def _memory(folder: Path, system: Tribosystem, arrays: dict[str, Any]) -> Any:
    """Return what a law of contact remembers; collective."""
    if not any(name.startswith(f"{MEMORY}.") for name in arrays):
        return None
    kind: Any = system.contact_law.memory
    try:
        memory = unpack(kind, MEMORY, arrays)
    except (KeyError, TypeError, ValueError):
        raise damaged(folder) from None
    warm, number, bodies = [], 0, system.bodies.heat
    while bodies is not None and on_root(system.comm, (folder / f"{REMEMBERED}_{number}").is_dir):
        own = folder / f"{REMEMBERED}_{number}"
        warm.append(HeatState.nodal(bodies, [read_temperature(own, body) for body in bodies]))
        number += 1
    return replace(memory, warm=tuple(warm))


def _bulk(temperature: HeatState | None) -> dict[str, Any]:
    track = None if temperature is None else temperature.track
    return {BULK: np.nan if track is None else track}


def _totals(totals: Totals) -> dict[str, Any]:
    return dict(zip(TOTALS, (totals.sums, totals.energy, totals.pressure), strict=True))


def _between(worn: WornDepths) -> dict[str, Any]:
    return {BETWEEN: worn.between, CREPT: worn.crept, CARRIED: worn.carried}


def _depths(names: tuple[str, str], worn: WornDepths) -> dict[str, Any]:
    return dict(zip(names, (worn.punch, worn.strip), strict=True))


def followed(directory: Path, system: Tribosystem) -> WornDepths | None:
    """Return the worn depths that the meshes of a checkpoint follow, None where they are as made; collective.

    Raises:
        CaseError: there is no checkpoint, or it is of another case.
    """
    arrays = on_root(system.comm, lambda: _read(find(directory), system))
    return WornDepths(*(arrays[name] for name in FOLLOWED)) if FOLLOWED[0] in arrays else None


def grid(directory: Path, system: Tribosystem) -> RegularGrid | None:
    """Return the contact grid of a checkpoint, None where it stays as it is; collective.

    Raises:
        CaseError: there is no checkpoint, or it is of another case.
    """

    def read() -> Array | None:
        folder = find(directory)
        check_case(folder, system.case)
        return _arrays(folder).get(GRID)

    found, own = on_root(system.comm, read), system.pair.punch.grid
    return None if found is None or own is None else own.with_numbers(found)


@dataclass(frozen=True)
class LastContact:
    """The contact of the last cycle of a run, as its checkpoint has it.

    Attributes:
        half_cycle: It ends with.
        pressure: Of each phase (phases, n), MPa; NaN where there was none yet.
        worn: Depths at its end.
        grid: Corner, spacing and counts of a contact grid that grows (3, d - 1); None of one that stays.
        followed: The wear that the meshes follow; None where they are as made.
    """

    half_cycle: int
    pressure: Array
    worn: WornDepths
    grid: Array | None
    followed: WornDepths | None


def last_contact(directory: Path) -> LastContact:
    """Return the contact of a run's last cycle; for one rank.

    Raises:
        CaseError: there is no checkpoint, or it is damaged.
    """
    arrays = _arrays(find(directory))
    worn = WornDepths(*(arrays[name] for name in (*WEAR, BETWEEN, CREPT, CARRIED)))
    follows = WornDepths(*(arrays[name] for name in FOLLOWED)) if FOLLOWED[0] in arrays else None
    return LastContact(int(arrays["half_cycle"]), arrays["pressure"], worn, arrays.get(GRID), follows)


def warmed(directory: Path, system: Tribosystem) -> tuple[Array, Array] | None:
    """Return the temperatures that the materials' properties of a checkpoint are taken at (owned,) each; collective.

    None where they are those of the initial temperature.

    Raises:
        CaseError: there is no checkpoint, or it is damaged.
    """
    comm, bodies = system.comm, system.bodies.heat
    folder = on_root(comm, lambda: find(directory))
    if bodies is None or not on_root(comm, _file(folder, f"{WARMED}_punch").exists):
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


def load(directory: Path, system: Tribosystem) -> RunState:
    """Return the state of a run's checkpoint; collective.

    Raises:
        CaseError: there is no checkpoint, it is damaged, or it is of another case; names the differences.
    """
    comm = system.comm
    folder = on_root(comm, lambda: find(directory))
    arrays: dict[str, Any] = on_root(comm, lambda: _read(folder, system))
    temperature = None
    if system.bodies.heat is not None:
        track = None if np.isnan(arrays[BULK]).any() else np.atleast_2d(arrays[BULK])
        read = [read_temperature(folder, body) for body in system.bodies.heat]
        temperature = HeatState.nodal(system.bodies.heat, read, track)
    contacts = tuple(
        None if np.isnan(p).any() else ContactState(p[None], g[None], a[None], 0)
        for p, g, a in zip(arrays["pressure"], arrays["gap"], arrays["rigid"], strict=True)
    )
    length, periodic = float(arrays["jump_length"]), int(arrays["periodic_phases"])
    length = int(length) if length >= 1 else length
    worn = WornDepths(*(arrays[name] for name in (*WEAR, BETWEEN, CREPT, CARRIED)))
    totals = Totals(*(arrays[name] for name in TOTALS))
    memory = _memory(folder, system, arrays)
    return RunState(int(arrays["half_cycle"]), worn, contacts, temperature, totals, length, periodic, memory)


def read_temperature(folder: Path, body: HeatBody, name: str = "temperature") -> Array:
    """Return the temperatures of this rank's own nodes of a body; collective.

    Raises:
        CaseError: they cannot be read.
    """
    comm, values = body.body.mesh.comm, np.full(body.owned, np.nan)
    with suppress(EOFError, KeyError, OSError, ValueError, zipfile.BadZipFile):
        values = nodal.read(_file(folder, f"{name}_{body.body.name}"), body.space)
    if not comm.allreduce(bool(np.isfinite(values).all()), op=MPI.LAND):
        raise damaged(folder)
    return values


def damaged(folder: Path) -> CaseError:
    """Return the error of a checkpoint that cannot be read."""
    what = f"the checkpoint in {folder} is damaged, or of an earlier version; expected to start anew, without"
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
        return int(_arrays(find(directory))["half_cycle"])
    except CaseError:
        return None


def _arrays(folder: Path) -> dict[str, Any]:
    try:
        with np.load(folder / ARRAYS) as arrays:
            followed = (*(FOLLOWED if set(FOLLOWED) & set(arrays) else ()), *({GRID} & set(arrays)))
            memory = [name for name in arrays if name.startswith(f"{MEMORY}.")]
            depths = (*WEAR, BETWEEN, CREPT, CARRIED)
            return {name: arrays[name] for name in (*NUMBERS, *depths, *TOTALS, BULK, *STATES, *followed, *memory)}
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
        raise damaged(folder) from None


def check_case(folder: Path, case: Case) -> None:
    """Make sure that a checkpoint is of this case.

    Raises:
        CaseError: it is of another one, whose differences are named, of an earlier version, or damaged.
    """
    to_and_fro = not isinstance(case.motion, OneWay | Rotation)
    if case.heat is not None and to_and_fro and not (folder / EXTREMES).is_file():
        what = (
            f"the checkpoint in {folder} is of an earlier version, which to and fro had the strip's temperatures below "
            "the punch in place of those of its material; expected to start anew, without"
        )
        raise CaseError(InputError("--resume", what))
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


def _read(folder: Path, system: Tribosystem) -> dict[str, Any]:
    check_case(folder, system.case)
    arrays = _arrays(folder)
    for names in (WEAR, FOLLOWED):
        for name, unworn in _depths(names, system.unworn()).items():
            if name in arrays and (arrays[name].shape != unworn.shape or not np.isfinite(arrays[name]).all()):
                raise damaged(folder)
    unworn = system.unworn()
    kept = {BETWEEN: unworn.between, CREPT: unworn.crept, CARRIED: unworn.carried}
    if any(arrays[name].shape != state.shape for name, state in kept.items()):
        raise damaged(folder)
    if arrays["totals"].shape != (len(SUMS),) or any(
        arrays[name].shape != system.pair.weights.shape for name in TOTALS[1:]
    ):
        raise damaged(folder)
    return arrays


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
    """Put a data class, a list of them, an array or a number under its path; None is left out."""
    if is_dataclass(value):
        for field in fields(value):
            pack(getattr(value, field.name), f"{path}.{field.name}", into)
    elif isinstance(value, list):
        into[path] = np.asarray(len(value))
        for number, item in enumerate(value):
            pack(item, f"{path}.{number}", into)
    elif value is not None:
        into[path] = np.asarray(value)


def unpack(kind: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """Return what was put under a path."""
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: unpack(hints[f.name], f"{path}.{f.name}", arrays) for f in fields(kind)})
    if get_origin(kind) is tuple:  # of temperatures, which are kept apart
        return ()
    inner = next((one for one in get_args(kind) if is_dataclass(one)), None)
    if get_origin(kind) is not list and inner is not None and any(name.startswith(f"{path}.") for name in arrays):
        return unpack(inner, path, arrays)
    if get_origin(kind) is list:
        return [unpack(get_args(kind)[0], f"{path}.{k}", arrays) for k in range(int(arrays[path]))]
    if path not in arrays and type(None) in get_args(kind):
        return None
    values = arrays[path]
    return values if values.ndim else values.item()
