"""Open what a run has left."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Hashable, Iterable
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
    (r"^coating_worn_through", "worn_through_of_surface"),
    (r"^layer_creep_volume", "creep_volume_layer"),
    (r"^largest_layer_creep_depth", "largest_creep_depth_layer"),
)
# Names that have come to mean something else: only in files that have one of those above.
TAKEN_NAMES = (
    (r"^largest_temperature(?!_of_run)", "largest_temperature_of_run"),
    (r"^friction_coefficient", "mean_friction_coefficient"),
)
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
    changes = _changes(any(re.search(old, name) for old, _ in OLD_NAMES for name in known))
    return {name: new for name in known if (new := changes(name)) != name}


def in_current_names(summary: str) -> Any:
    """Return the tables of a summary with the present names of all quantities.

    Raises:
        ValueError: the text is no JSON.
    """
    old = any(re.search(f'"{pattern[1:]}', summary) for pattern, _ in OLD_NAMES)
    changes = _changes(old)
    found = json.loads(summary, object_pairs_hook=lambda pairs: {changes(key): value for key, value in pairs})
    if old and "mean_pressure_MPa" in found:  # was the load over the meshed surface; now only of what touches
        found["pressure_over_surface_MPa"] = found.pop("mean_pressure_MPa")
    return found


def _changes(old: bool) -> Callable[[str], str]:
    """Return how names of an older file change to those of today; those of today do not."""

    def changed(name: str) -> str:
        for pattern, new in (*TAKEN_NAMES, *OLD_NAMES) if old else ():
            name = re.sub(pattern, new, name)
        return name

    return changed


def is_older(names: Iterable[Hashable]) -> bool:
    """Return whether the names of a history are those of a version in which worn volumes were of one half-cycle."""
    known = {str(name) for name in names}
    stem = "worn_area" if "worn_area" in known or "worn_area_strip" in known else "worn_volume"
    return bool(known & {stem, f"{stem}_strip"}) and not known & {f"{stem}_increment", f"{stem}_increment_strip"}


def _unreadable(path: Path, error: Exception) -> CaseError:
    reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
    return CaseError(InputError(str(path), f"no readable history of a run: {reason}"))
