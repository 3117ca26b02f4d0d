"""Open what a run has left."""

from __future__ import annotations

from pathlib import Path

import xarray

from fenwear.errors import CaseError, InputError
from fenwear.results.history import HISTORY


def open_history(directory: Path) -> xarray.Dataset:
    """Open history.nc of a run.

    Raises:
        CaseError: there is none, or it cannot be read.
    """
    path = directory / HISTORY
    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else str(error)
        raise CaseError(InputError(str(path), f"no readable history of a run: {reason}")) from None
