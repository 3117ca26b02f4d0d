"""Checkpoints of runs with stick: the last cycle with the state at its end, from which all that follows is computed."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.errors import CaseError, OutputError
from fenwear.heat.field import HeatState
from fenwear.parallel import on_root
from fenwear.results.checkpoint import (
    ARRAYS,
    NEW,
    begin,
    check_case,
    damaged,
    find,
    read_temperature,
    swap,
    write_temperatures,
)
from fenwear.results.disk import check_room, writing
from fenwear.stick.cycle import Rig
from fenwear.stick.interface import meshed
from fenwear.stick.jump import Cycle

ROOT = "cycle"


def save(directory: Path, case: Case, rig: Rig, cycle: Cycle, extremes: Mapping[str, float]) -> None:
    """Replace the checkpoint of a run; collective. A kill at any moment leaves the old or the new one.

    Temperatures are written as functions on the meshes: bases are not the same on any number of ranks.

    Raises:
        OutputError: it cannot be written; the old one stays.
    """
    comm = meshed(rig.interface).bodies.comm
    try:
        on_root(comm, lambda: _begin(directory / NEW, case, cycle, extremes))
        if rig.heat is not None:
            for name, values in (("end", cycle.end.temperature), ("warm", cycle.warm)):
                if values is not None:
                    on_root(comm, partial((directory / NEW / name).mkdir))
                    write_temperatures(directory / NEW / name, comm, rig.heat.exchange.at(values))
        comm.Barrier()
    except OutputError:  # on all ranks
        on_root(comm, lambda: shutil.rmtree(directory / NEW, ignore_errors=True))
        raise
    on_root(comm, lambda: swap(directory))


def _begin(new: Path, case: Case, cycle: Cycle, extremes: Mapping[str, float]) -> None:
    arrays = dict[str, Any]()
    _pack(cycle, ROOT, arrays)
    check_room(new.parent, sum(values.nbytes + 512 for values in arrays.values()))
    with writing(new):
        begin(new, case, extremes)
        with (new / ARRAYS).open("wb") as file:
            np.savez(file, **arrays)
            file.flush()
            os.fsync(file.fileno())


def load(directory: Path, case: Case, rig: Rig) -> Cycle:
    """Return the cycle of a run's checkpoint; collective.

    Args:
        directory: Of the run.
        case: To go on with.
        rig: Of the case.

    Raises:
        CaseError: there is no checkpoint, it is damaged, or it is of another case; names the differences.
    """
    folder, cycle = on_root(meshed(rig.interface).bodies.comm, lambda: _load(directory, case, len(rig.weights)))
    end, warm = (_temperature(folder / name, rig) for name in ("end", "warm"))
    return replace(cycle, end=replace(cycle.end, temperature=end), warm=warm)


def _temperature(folder: Path, rig: Rig) -> Array | None:
    """Return the temperatures (dim,) in a folder of a checkpoint; collective."""
    bodies = meshed(rig.interface).bodies
    if rig.heat is None or bodies.heat is None or not on_root(bodies.comm, folder.is_dir):
        return None
    state = HeatState.nodal(bodies.heat, [read_temperature(folder, body) for body in bodies.heat])
    return rig.heat.exchange.own(state).values


def _load(directory: Path, case: Case, nodes: int) -> tuple[Path, Cycle]:
    folder = find(directory)
    check_case(folder, case)
    cycle = _read(folder)
    contact = cycle.end.contact
    if contact.pressure.shape != (nodes,) or not all(np.isfinite(a).all() for a in (contact.pressure, contact.trial)):
        raise damaged(folder)
    return folder, cycle


def _read(folder: Path) -> Cycle:
    try:
        with np.load(folder / ARRAYS, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        found: Cycle = _unpack(Cycle, ROOT, arrays)
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile):
        raise damaged(folder) from None
    return found


def reached(directory: Path) -> int | None:
    """Return the number of the cycle of the checkpoint in a run's folder; None where there is none to go on from."""
    try:
        return _read(find(directory)).number
    except CaseError:
        return None


def _pack(value: Any, path: str, into: dict[str, Any]) -> None:
    """Put a data class, a list of them, an array or a number under its path; None is left out."""
    if is_dataclass(value):
        for field in fields(value):
            _pack(getattr(value, field.name), f"{path}.{field.name}", into)
    elif isinstance(value, list):
        into[path] = np.asarray(len(value))
        for number, item in enumerate(value):
            _pack(item, f"{path}.{number}", into)
    elif value is not None:
        into[path] = np.asarray(value)


def _unpack(kind: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """Return what was put under a path."""
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{f.name: _unpack(hints[f.name], f"{path}.{f.name}", arrays) for f in fields(kind)})
    if get_origin(kind) is list:
        return [_unpack(get_args(kind)[0], f"{path}.{k}", arrays) for k in range(int(arrays[path]))]
    if path not in arrays and type(None) in get_args(kind):
        return None
    values = arrays[path]
    return values if values.ndim else values.item()
