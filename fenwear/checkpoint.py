"""Checkpoints: a moment of a run on disk, whole or not at all, for any number of ranks.

Arrays of the interface go to one NumPy file; temperatures are functions on the meshes, written by
adios4dolfinx in the numbering of the geometry, so that another number of ranks can read them.
"""

from __future__ import annotations

import os
import shutil
import tomllib
from pathlib import Path
from typing import Any

import adios4dolfinx
import numpy as np

from fenwear.contact import ContactState
from fenwear.cycle.moment import Moment
from fenwear.errors import CaseError, Problem
from fenwear.heat.exchange import HeatExchange
from fenwear.parallel import on_root
from fenwear.system import System
from fenwear.wear import Worn

FOLDER, NEW, OLD = "checkpoint", "checkpoint.new", "checkpoint.old"
CASE, ARRAYS = "case.toml", "moment.npz"
# A run may go on farther than it was meant to, and keep other things.
FREE_KEYS = ("run.half_cycles", "run.periodic_within", "output.", "title")


def save(directory: Path, system: System, exchange: HeatExchange | None, moment: Moment) -> None:
    """Replace the checkpoint of a run; collective. A kill at any moment leaves the old or the new one."""
    comm, new = system.comm, directory / NEW
    on_root(comm, lambda: _begin(new, system, moment))
    if exchange is not None and moment.temperature is not None and system.heat_bodies is not None:
        temperatures = exchange.temperatures(moment.temperature)
        for body, values in zip(system.heat_bodies, temperatures, strict=True):
            path = new / f"temperature_{body.body.name}.bp"
            adios4dolfinx.write_function_on_input_mesh(path, body.function(values))
    comm.Barrier()
    on_root(comm, lambda: _swap(directory))


def _begin(new: Path, system: System, moment: Moment) -> None:
    shutil.rmtree(new, ignore_errors=True)
    new.mkdir()
    (new / CASE).write_text(system.case.to_toml(), "utf-8")
    n, r = len(system.facing.weights), len(system.statics.resultant)
    empty = ContactState(np.full((1, n), np.nan), np.full((1, n), np.nan), np.full((1, r), np.nan), 0)
    contacts = [contact or empty for contact in moment.contacts]
    with (new / ARRAYS).open("wb") as file:
        np.savez(
            file,
            half_cycle=moment.half_cycle,
            wear=moment.worn.punch,
            wear_strip=moment.worn.strip,
            **({} if system.followed is None else _followed_arrays(system.followed)),
            jump_length=moment.jump_length,
            periodic_phases=moment.periodic_phases,
            **{name: np.concatenate([getattr(c, name) for c in contacts]) for name in ("pressure", "gap", "rigid")},
        )
        file.flush()
        os.fsync(file.fileno())


def _followed_arrays(worn: Worn) -> dict[str, Any]:
    return {"followed_punch": worn.punch, "followed_strip": worn.strip}


def followed(directory: Path, system: System) -> Worn | None:
    """Return the worn depths that the meshes of a checkpoint follow, None where they are as made; collective.

    Raises:
        CaseError: there is no checkpoint, or it is of another case.
    """
    arrays = on_root(system.comm, lambda: _read(_find(directory), system))
    if "followed_punch" not in arrays:
        return None
    return Worn(arrays["followed_punch"], arrays["followed_strip"])


def _swap(directory: Path) -> None:
    new, current, old = (directory / name for name in (NEW, FOLDER, OLD))
    shutil.rmtree(old, ignore_errors=True)
    if current.exists():
        current.rename(old)
    new.rename(current)
    shutil.rmtree(old, ignore_errors=True)


def load(directory: Path, system: System, exchange: HeatExchange | None) -> Moment:
    """Return the moment of a run's checkpoint; collective.

    Raises:
        CaseError: there is no checkpoint, or it is of another case; names the differences.
    """
    comm = system.comm
    folder = on_root(comm, lambda: _find(directory))
    arrays: dict[str, Any] = on_root(comm, lambda: _read(folder, system))
    temperature = None
    if exchange is not None and system.heat_bodies is not None:
        values = []
        for body in system.heat_bodies:
            function = body.function(body.initial())
            adios4dolfinx.read_function(folder / f"temperature_{body.body.name}.bp", function)
            values.append(function.x.array[: body.owned].copy())
        temperature = exchange.state((values[0], values[1]))
    contacts = tuple(
        None if np.isnan(p).any() else ContactState(p[None], g[None], a[None], 0)
        for p, g, a in zip(arrays["pressure"], arrays["gap"], arrays["rigid"], strict=True)
    )
    numbers = (int(arrays[name]) for name in ("jump_length", "periodic_phases"))
    worn = Worn(arrays["wear"], arrays["wear_strip"])
    return Moment(int(arrays["half_cycle"]), worn, contacts, temperature, *numbers)


def _find(directory: Path) -> Path:
    for name in (FOLDER, OLD):  # killed between two renames only the old one is left
        if (directory / name / ARRAYS).is_file():
            return directory / name
    raise CaseError(Problem("--resume", f"no checkpoint in {directory}"))


def _read(folder: Path, system: System) -> dict[str, Any]:
    saved = _flat(tomllib.loads((folder / CASE).read_text("utf-8")))
    present = _flat(tomllib.loads(system.case.to_toml()))
    keys = sorted({*saved, *present})
    problems = [
        Problem(key, f"the checkpoint has {saved.get(key, 'nothing')!r}, the case {present.get(key, 'nothing')!r}")
        for key in keys
        if saved.get(key) != present.get(key) and not key.startswith(FREE_KEYS)
    ]
    if problems:
        raise CaseError([Problem("--resume", "the checkpoint is of another case"), *problems])
    with np.load(folder / ARRAYS) as arrays:
        return {name: arrays[name] for name in arrays.files}


def _flat(tables: Any, path: str = "") -> dict[str, Any]:
    """Return nested tables as one, keyed by the path."""
    if isinstance(tables, dict):
        items: Any = tables.items()
    elif isinstance(tables, list) and any(isinstance(item, dict) for item in tables):
        items = enumerate(tables)
    else:
        return {path: tables}
    return {k: v for key, value in items for k, v in _flat(value, f"{path}.{key}" if path else str(key)).items()}
