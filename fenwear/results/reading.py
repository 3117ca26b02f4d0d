"""Open what a run has left."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from fenwear.errors import CaseError, InputError
from fenwear.results.history import HISTORY
from fenwear.results.netcdf import load

if TYPE_CHECKING:
    import xarray

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
    return history


def is_older(names: Iterable[Hashable]) -> bool:
    """Return whether the names of a history are those of a version in which worn volumes were of one half-cycle."""
    worn = [str(name) for name in names if str(name).startswith(("worn_area", "worn_volume"))]
    return bool(worn) and not any("_increment" in name for name in worn)


def _unreadable(path: Path, error: Exception) -> CaseError:
    reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
    return CaseError(InputError(str(path), f"no readable history of a run: {reason}"))
