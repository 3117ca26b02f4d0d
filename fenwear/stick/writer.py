"""Writes the kept cycles of a run with stick to history.nc, a few at a time; history.nc is whole at any moment."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray

from fenwear.errors import CaseError, InputError
from fenwear.results.disk import check_room, claim, writing
from fenwear.results.history import HISTORY, next_write
from fenwear.results.reading import is_older, load

CYCLE = "cycle"


class CycleWriter:
    """Appends data sets of cycles to history.nc; for one rank.

    Args:
        directory: Of the run.
        resumed_after: Number of the cycle that a resumed run goes on after; None for a new history.
        every: Of the stored cycles whose numbers are no multiples of it, a resumed run drops the last one.

    Raises:
        CaseError: the history to go on with cannot be read.
        OutputError: it cannot be written.
    """

    def __init__(self, directory: Path, resumed_after: int | None, every: int) -> None:
        self.path, self._part = directory / HISTORY, directory / "history.part"
        self._pending: list[xarray.Dataset] = []
        self._last: Callable[[], xarray.Dataset] | None = None
        self._due = next_write()
        if resumed_after is not None and self.path.exists():
            self._cut(resumed_after, every)

    def _cut(self, number: int, every: int) -> None:
        """Drop what a killed run wrote after its checkpoint, and the last cycle if it was kept as such only."""
        try:
            with h5netcdf.File(self.path, "r") as file:
                stored = np.asarray(file.variables[CYCLE][:])
                if is_older(file.variables):
                    raise KeyError(CYCLE)
        except (OSError, KeyError, RuntimeError):
            message = "cannot be read, or is of another version; remove it to go on with a new one, from the checkpoint"
            raise CaseError(InputError(str(self.path), message)) from None
        rows = int(np.searchsorted(stored, number, side="right"))
        if rows and stored[rows - 1] % every:
            rows -= 1
        if rows < len(stored):
            with writing(self.path):
                shutil.copyfile(self.path, self._part)
                with h5netcdf.File(self._part, "a") as file:
                    file.resize_dimension(CYCLE, rows)
                self._part.replace(self.path)

    def add(self, make: Callable[[], xarray.Dataset], *, keep: bool) -> None:
        """Take a cycle; write what has gathered if the last write is some seconds ago.

        Args:
            make: Makes the data set of this cycle.
            keep: Whether it stays where others follow.

        Raises:
            OutputError: history.nc cannot be written; it stays as it was at the last write.
        """
        self._last = None if keep else make
        if keep:
            self._pending.append(make())
        if time.monotonic() > self._due:
            self.flush()

    def close(self) -> xarray.Dataset:
        """Write the rest, with the last cycle in any case, and return all of it.

        Raises:
            OutputError: as `add`.
        """
        if self._last is not None:
            self._pending.append(self._last())
            self._last = None
        self.flush()
        with writing(self.path):
            return load(self.path)

    def flush(self) -> None:
        """Write what has gathered.

        Raises:
            OutputError: as `add`.
        """
        if not self._pending:
            return
        begin = time.monotonic()
        alike: dict[str, Any] = {"data_vars": "minimal", "coords": "minimal", "compat": "override", "join": "override"}
        new = xarray.concat(self._pending, CYCLE, **alike)
        with writing(self.path):
            try:
                self._write(new)
            except (OSError, RuntimeError):
                self._part.unlink(missing_ok=True)
                raise
        self._pending = []
        self._due = next_write(time.monotonic() - begin)

    def _write(self, new: xarray.Dataset) -> None:
        if not self.path.exists():
            check_room(self.path.parent, int(new.nbytes))
            large = [name for name, values in new.data_vars.items() if values.ndim == 3]
            encoding = {name: {"zlib": True, "complevel": 1} for name in large}
            new.to_netcdf(self._part, engine="h5netcdf", unlimited_dims=[CYCLE], encoding=encoding)
        else:
            shutil.copyfile(self.path, self._part)
            claim(self._part, int(new.nbytes))
            with h5netcdf.File(self._part, "a") as file:
                before = file.dimensions[CYCLE].size
                file.resize_dimension(CYCLE, before + new.sizes[CYCLE])
                for name, values in new.variables.items():
                    if values.dims[:1] == (CYCLE,):
                        file.variables[str(name)][before:] = values.values
        self._part.replace(self.path)
