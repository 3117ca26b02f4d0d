"""Open what a run has left."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fenwear.errors import CaseError, InputError
from fenwear.results.history import HISTORY
from fenwear.results.netcdf import load

if TYPE_CHECKING:
    import xarray

# What a quantity was called, with a unit or a body behind it, and is called now; several may follow on each other.
OLD_NAMES = (
    (r"^max_(pressure|temperature)", r"largest_\1"),
    (r"^pressure_beside_max", "pressure_beside_largest"),
    (r"^max_wear_(across|[rxyz])", r"largest_depth_at_\1"),
    (r"^at_(across|[rxyz])_mm", r"largest_depth_at_\1_mm"),
    (r"^(max|largest)_wear", "largest_depth"),
    (r"^scar_(\w+?)_1_percent", r"scar_\1"),
    (r"^scar_(\w+?)_5(?!_percent)", r"scar_\1_5_percent"),
    (r"^largest_pressure_of_cycle", "largest_pressure_in_cycle"),
)
# Names that have come to mean something else: only in files that have one of those above.
TAKEN_NAMES = ((r"^largest_temperature", "largest_temperature_of_run"),)
OLDER = (
    "of an older fenwear, in which worn_area and worn_volume were those of a half-cycle and not from the start; "
    "expected the results of this version: run the case anew"
)


def load_history(directory: Path) -> xarray.Dataset:
    """Return all of history.nc of a run, in memory.

    Raises:
        CaseError: there is none, it cannot be read, or it is of a version whose names meant something else.
    """
    path = directory / HISTORY
    try:
        history = load(path)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if is_older(history.variables):
        raise CaseError(InputError(str(path), OLDER))
    return history.rename(current_names(map(str, history.variables)))


def current_names(names: Iterable[str]) -> dict[str, str]:
    """Return the present name of each of a file's names that has changed, by its old one."""
    known = [*names]
    found = {name: _replaced(name, OLD_NAMES) for name in known}
    if any(name != new for name, new in found.items()):
        found = {name: _replaced(name, TAKEN_NAMES) if new == name else new for name, new in found.items()}
    return {name: new for name, new in found.items() if new != name}


def in_current_names(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of an older summary with the present names of all quantities."""
    inner = {key: in_current_names(value) if isinstance(value, dict) else value for key, value in tables.items()}
    new = current_names(inner)
    return {new.get(key, key): value for key, value in inner.items()}


def _replaced(name: str, table: Iterable[tuple[str, str]]) -> str:
    for old, new in table:
        name = re.sub(old, new, name)
    return name


def is_older(names: Iterable[Hashable]) -> bool:
    """Return whether the names of a history are those of a version in which worn volumes were of one half-cycle."""
    worn = [str(name) for name in names if str(name).startswith(("worn_area", "worn_volume"))]
    return bool(worn) and not any("_increment" in name for name in worn)


def _unreadable(path: Path, error: Exception) -> CaseError:
    reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
    return CaseError(InputError(str(path), f"no readable history of a run: {reason}"))
