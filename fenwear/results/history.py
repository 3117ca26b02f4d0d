"""Files of a run: case.toml, history.nc, summary.json. Nothing here computes or draws."""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import Case
from fenwear.case.program import stages_of
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.stack import versions
from fenwear.results import roughness, time_steps
from fenwear.results.disk import check_room, replacing, write_text, writing
from fenwear.results.hdf5 import Netcdf
from fenwear.results.history_surfaces import (
    Column,
    conforming,
    on_mesh,
    part_columns,
    recorded_surfaces,
    surface_columns,
)
from fenwear.results.quantity import KELVIN, Quantity, computed, degrees_in, degrees_of
from fenwear.results.registry import quantities_of
from fenwear.steps import Block
from fenwear.surfaces import ContactPair
from fenwear.system import Tribosystem, grows, kept_volume, node_maps, on_nodes

HISTORY, SUMMARY, CASE = "history.nc", "summary.json", "case.toml"
# What runs and sweeps leave in their folders.
OF_RESULTS = (HISTORY, f"{HISTORY}.part", SUMMARY, CASE, "checkpoint.npz", "checkpoint", "fields", "figures",
              "report.html", "flash", "export", "runs", "sweep.nc", "sweep.csv", "sweep.png")  # fmt: skip
UNKNOWN = ("gap", "creep_depth", "creep_depth_strip")  # beyond the grid that there was; a layer has crept by 0 there
GRID = "contact_grid"  # corner, spacing and counts, where it grows
SECONDS_BETWEEN_WRITES = 2.0
SHARE = 20  # of the time between two writes over that of a write, which copies the file
CHUNK = 256  # rows that a variable's storage grows by, at most
CHUNK_VALUES = 2**18  # that it grows by at most
INDEX = 16384  # bytes of HDF5's index of chunks and of the variable's header, generously

Rows = dict[str, NDArray[Any]]  # of variables, by their names

INTEGERS = ("half_cycle", "direction", "retries", "coupling_iterations")


def variables_of(system: Tribosystem) -> dict[str, Quantity]:
    """Return the quantities that a history has, by their names."""
    return {name: quantity for name, quantity in quantities_of(system).items() if quantity.dims}


def columns_of(system: Tribosystem) -> dict[str, Column]:
    """Return, by name, what does not change in a run."""
    with_names, columns = system.case.names.meant, {**_columns(system), **_of_program(system.case)}
    return {name: column._replace(attributes=with_names(column.attributes)) for name, column in columns.items()}


def _of_program(case: Case) -> dict[str, Column]:
    """Return when the stages of a program begin and end, and what its loads are then; nothing without a program."""
    stages, over = stages_of(case), ("stage", "end")
    if not stages:
        return {}
    ends = np.array([(stage.begin, stage.end) for stage in stages])
    loads = np.array([stage.load or stage.load_factor for stage in stages])
    about = {"stage_ends": (ends, "half-cycles before each stage of the program, and at its end"),
             "stage_loads": (loads, "loads at both ends of a stage, in N or over those of the case")}  # fmt: skip
    return {name: Column(over, values, {"units": "1", "long_name": text}) for name, (values, text) in about.items()}


def _columns(system: Tribosystem) -> dict[str, Column]:
    if system.case.model.kind != "plane":
        return {
            **surface_columns(system),
            **part_columns(system, plane=False),
            **time_steps.columns(system),
            **roughness.columns(system),
        }
    along = "position along the contact, x of the geometry"
    texts = {
        "": along if system.pair.punch.arc is None else "arc length along the contact",
        "_strip": "position along the strip, on its material, as x in the middle position",
    }
    columns = dict[str, Column]()
    for end, surface in recorded_surfaces(system).items():
        over, text = (f"x{end}",), {"units": "mm", "long_name": f"height z of the unworn {surface.body}"}
        columns[f"x{end}"] = Column(over, surface.abscissa, {"units": "mm", "long_name": texts[end]})
        columns[f"height{end}"] = Column(over, surface.unworn[:, 1], text)
        columns |= {} if surface.arc is None else _outline(surface, end)
    return {**columns, **part_columns(system, plane=True), **time_steps.columns(system), **roughness.columns(system)}


def _outline(surface: ContactSurface, end: str) -> dict[str, Column]:
    """Return where the nodes of a curve that is no graph over x are, and the normals into the body there."""
    over, inwards = (f"x{end}",), -surface.outward
    known = {
        "place": (surface.x[:, 0], "mm", "x of the contact node"),
        "inwards_x": (inwards[:, 0], "1", f"x component of the normal into the {surface.body}"),
        "inwards_z": (inwards[:, 1], "1", f"z component of the normal into the {surface.body}"),
    }
    return {
        f"{name}{end}": Column(over, values, {"units": unit, "long_name": text})
        for name, (values, unit, text) in known.items()
    }


def grid_of(directory: Path, pair: ContactPair) -> RegularGrid | None:
    """Return the contact grid that the history in a folder stands on, where grids grow; None where there is none."""
    grid = pair.punch.grid
    try:
        with h5py.File(directory / HISTORY, "r") as file:
            numbers = file.attrs.get(GRID)
    except OSError:
        return None
    return None if numbers is None or grid is None else grid.with_numbers(numbers)


def _on_grid(
    rows: dict[str, NDArray[Any]],
    variables: dict[str, Quantity],
    before: Tribosystem,
    after: Tribosystem,
) -> dict[str, NDArray[Any]]:
    """Return rows of variables at the nodes of another contact grid; what is not known there is NaN."""
    of_punch, of_strip = node_maps(before, after)
    surfaces = {"": (of_punch, before.pair.weights, after.pair.weights)}
    surfaces["_strip"] = (of_strip, before.pair.strip.weights, after.pair.strip.weights)
    new_rows = {}
    for name, values in rows.items():
        last = variables[name].dims[-1]
        end = {"x": "", "node": "", "x_strip": "_strip", "node_strip": "_strip"}.get(last)
        if end is None:
            new_rows[name] = values
            continue
        nodes, old, new = surfaces[end]
        if name in ("wear", "wear_strip"):
            new_rows[name] = kept_volume(values, nodes, old, new)
            continue
        if name in ("weight", "weight_strip"):
            new_rows[name] = np.broadcast_to(new, (*values.shape[:-1], len(new)))
            continue
        start: Array = np.full(len(nodes), np.nan if name in UNKNOWN else 0.0)
        new_rows[name] = on_nodes(values, nodes, start) if len(values) else np.zeros((*values.shape[:-1], len(nodes)))
    return new_rows


def _chunk(inner: tuple[int, ...]) -> int:
    """Return the rows that a variable's storage grows by, fewer where a row is long."""
    return max(1, min(CHUNK, CHUNK_VALUES // max(math.prod(inner), 1)))


def make_directory(path: Path) -> None:
    """Make the new folder of a run.

    Raises:
        CaseError: it exists and is not empty, or cannot be made.
    """
    try:
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            raise CaseError(InputError("-o", f"{path} exists already; expected a new or an empty folder"))
        path.mkdir(parents=True, exist_ok=True)
        (path / CASE).touch(exist_ok=False)  # of two runs that begin at once one finds it there
    except FileExistsError:
        raise CaseError(
            InputError("-o", f"{path} is another run's that has just begun. Name another folder.")
        ) from None
    except OSError as error:
        raise CaseError(InputError("-o", f"{path} cannot be written: {error.strerror}")) from None


def clear_directory(path: Path) -> None:
    """Remove the results of a run or sweep in a folder; for one rank.

    Raises:
        CaseError: it holds other files too, or cannot be removed.
    """
    try:
        others = (
            [entry.name for entry in path.iterdir() if entry.name not in OF_RESULTS and entry.suffix != ".part"]
            if path.is_dir()
            else []
        )
        if others:
            message = f"{path} holds {', '.join(sorted(others)[:5])}, which fenwear did not write. Remove the folder."
            raise CaseError(InputError("--overwrite", message))
        if path.is_dir():
            shutil.rmtree(path)
    except OSError as error:
        raise CaseError(InputError("--overwrite", f"{path} cannot be removed: {error.strerror}")) from None


def free_directory(stem: Path) -> Path:
    """Return `stem`, or the first of stem-2, stem-3, ... that does not exist."""
    if not stem.exists():
        return stem
    number = 2
    while (path := stem.with_name(f"{stem.name}-{number}")).exists():
        number += 1
    return path


def next_write(writing_took: float = 0.0) -> float:
    """Return when a history is written again, s of the monotonic clock, after a write of so many seconds."""
    return time.monotonic() + max(SECONDS_BETWEEN_WRITES, SHARE * writing_took)


class HistoryWriter:
    """Writes blocks of half-cycles to history.nc, every few seconds; for one rank.

    A write appends to a copy of history.nc, which takes its place: the file is whole and readable at any moment.
    """

    def __init__(self, directory: Path, system: Tribosystem, resumed_after: int | None = None) -> None:
        """Begin a history, or continue that of a run that is resumed after a half-cycle.

        Raises:
            CaseError: the history to continue cannot be read.
            OutputError: it cannot be written.
        """
        self.path = directory / HISTORY
        self._variables = variables_of(system)
        self._columns = columns_of(system)
        self._system = system
        self._degrees = degrees_of(system.case)
        self._phases = system.motion.half_cycles
        # Cycle jumps have few records: all are kept.
        self._every = 1 if system.case.run.integration == "jump" else system.case.output.every
        self._written: NDArray[np.int64] = np.zeros(0, dtype=np.int64)  # half-cycles in the file
        self._pending: list[Rows] = []
        self._last: Rows = {}  # those of the last cycle
        self._due = next_write()
        if resumed_after is None or not self.path.exists():
            self._lay_out({})
        else:
            self._resume(resumed_after)

    def relay(self, before: Tribosystem, after: Tribosystem) -> None:
        """Continue with another contact grid, on which what is written then stands, too, worn volumes as they were.

        Raises:
            OutputError: as `add`.
        """
        old, columns = self._variables, columns_of(after)
        if time_steps.STEP in columns:
            columns[time_steps.STEP] = self._columns[time_steps.STEP]
        self._system = after
        self._begin_anew(columns, lambda rows: _on_grid(rows, old, before, after))

    def _begin_anew(self, columns: dict[str, Column], changed: Callable[[Rows], Rows]) -> None:
        """Continue in a file of other sizes, with what is written by now changed to them."""
        self.flush()
        self._columns = columns
        with writing(self.path), h5py.File(self.path, "r") as file:
            stored = {name: file[name][: len(self._written)] for name in self._variables}
        self._lay_out(changed(stored))
        self._last = changed(self._last) if self._last else {}

    def _over_steps(self, rows: Rows) -> Rows:
        """Return rows whose half-cycles have as many time steps as the file has; it gets more where they have more."""
        counts = [rows[name].shape[1] for name, quantity in self._variables.items() if time_steps.STEP in quantity.dims]
        if counts and max(counts) > len(self._columns[time_steps.STEP].values):
            column = self._columns[time_steps.STEP]._replace(values=np.arange(1, max(counts) + 1))
            self._begin_anew({**self._columns, time_steps.STEP: column}, self._padded)
        return self._padded(rows)

    def _padded(self, rows: Rows) -> Rows:
        if time_steps.STEP not in self._columns:
            return rows
        count = len(self._columns[time_steps.STEP].values)
        return {
            name: time_steps.padded(values, count, axis=1) if time_steps.STEP in self._variables[name].dims else values
            for name, values in rows.items()
        }

    def _lay_out(self, rows: Rows) -> None:
        """Make the file with some rows."""
        system, sizes = self._system, self._sizes()
        count, about = len(rows.get("half_cycle", ())), system.pair.punch.dim
        columns = sum(column.values.nbytes + INDEX for column in self._columns.values())
        with replacing(self.path) as part:
            check_room(self.path.parent, self._bytes(count) + 4 * len(system.case.to_toml()) + columns)
            with Netcdf(part, {"half_cycle": None, **sizes}) as file:
                file.attributes.update(_attributes(system))
                for name, column in self._columns.items():
                    file.add(name, column.dimensions, column.attributes, column.values)
                for name, quantity in self._variables.items():
                    inner = tuple(sizes[d] for d in quantity.dims[1:])
                    unit = self._degrees.unit if quantity.unit == KELVIN.unit else quantity.unit
                    words = {"units": unit, "long_name": quantity.long_name, **on_mesh(quantity.dims, about)}
                    kind = int if name in INTEGERS else float
                    file.add(name, quantity.dims, words, kind=kind, chunks=(_chunk(inner), *inner))
            if rows:
                self._put(part, rows, 0)

    def _resume(self, half_cycle: int) -> None:
        """Take up the file, up to a half-cycle: the next write drops what a killed run wrote after it."""
        try:
            with h5py.File(self.path, "r") as file:
                stored = file["half_cycle"][:]
                if "largest_temperature" in file:  # a run continues in the degrees that it began with
                    self._degrees = degrees_in(str(file["largest_temperature"].attrs["units"]))
                if time_steps.STEP in self._columns:  # more than the case's where a step of its program had more
                    column = self._columns[time_steps.STEP]._replace(values=file[time_steps.STEP][:])
                    self._columns = {**self._columns, time_steps.STEP: column}
                missing = [name for name, quantity in self._variables.items() if file[name].ndim != len(quantity.dims)]
            if missing:
                raise KeyError(missing[0])  # of an older version
        except (OSError, KeyError, RuntimeError):
            message = (
                "cannot be read, or is of another version; remove it to continue with a new one, from the checkpoint"
            )
            raise CaseError(InputError(str(self.path), message)) from None
        self._written = stored[: np.searchsorted(stored, half_cycle, side="right")]

    def add(self, block: Block) -> None:
        """Take a block; write what has gathered if the last write is some seconds ago.

        Raises:
            OutputError: history.nc cannot be written; it stays as it was at the last write.
        """
        rows = computed(block, variables_of(block.system).values())
        for name, quantity in self._variables.items():
            if quantity.unit == KELVIN.unit:
                rows[name] = self._degrees.of(rows[name])
        rows = self._over_steps(rows)
        keep = (block.half_cycle - 1) // self._phases % self._every == 0
        self._pending.append({name: values[keep] for name, values in rows.items()})
        before = self._last or {name: values[:0] for name, values in rows.items()}
        self._last = {n: np.concatenate([before[n], values])[-self._phases :] for n, values in rows.items()}
        if time.monotonic() > self._due:
            self.flush()

    def close(self) -> None:
        """Write the rest, with the last cycle whatever `output.every` is.

        Raises:
            OutputError: as `add`.
        """
        if self._last:
            first = self._last["half_cycle"][0]
            self._pending = [{n: v[rows["half_cycle"] < first] for n, v in rows.items()} for rows in self._pending]
            self._pending.append(self._last)
            self._written = self._written[self._written < first]
        self.flush()

    def flush(self) -> None:
        """Write what has gathered.

        Raises:
            OutputError: as `add`.
        """
        begin = time.monotonic()
        joined = {n: np.concatenate([rows[n] for rows in self._pending]) for n in self._variables if self._pending}
        if len(joined.get("half_cycle", ())):
            count = len(self._written)
            with replacing(self.path) as part:
                check_room(self.path.parent, self.path.stat().st_size + self._bytes(len(joined["half_cycle"])))
                shutil.copyfile(self.path, part)
                self._put(part, joined, count)
            self._written = np.concatenate([self._written, joined["half_cycle"]])
        self._pending = []
        self._due = next_write(time.monotonic() - begin)

    def _put(self, path: Path, rows: Rows, start: int) -> None:
        """Write rows behind the first so many of a file, in place of what follows there."""
        with h5py.File(path, "r+") as file:
            for name in self._variables:
                file[name].resize(start + len(rows[name]), axis=0)
                file[name][start:] = rows[name]

    def _sizes(self) -> dict[str, int]:
        return {
            d: n
            for column in self._columns.values()
            for d, n in zip(column.dimensions, column.values.shape, strict=True)
        }

    def _bytes(self, rows: int) -> int:
        """Return the most bytes that so many rows add: whole chunks, and for each variable some nodes of an index."""
        sizes, total = self._sizes(), 0
        for quantity in self._variables.values():
            inner = tuple(sizes[d] for d in quantity.dims[1:])
            chunk = _chunk(inner)
            chunks = (rows > 0) + -(-rows // chunk)
            total += chunks * chunk * 8 * math.prod(inner) + (chunks // 16 + 1) * INDEX
        return total


def _attributes(system: Tribosystem) -> dict[str, Any]:
    """Return the attributes of a history."""
    solid, grid = system.case.model.kind != "plane", system.pair.punch.grid
    return {
        "title": system.case.title or "fenwear run",
        "Conventions": "CF-1.11 UGRID-1.0" if solid else "CF-1.11",
        "case": system.case.to_toml(),
        "directions": " ".join(system.sliding.words.values()),  # of d = 1 and d = -1
        "conforming": int(conforming(system.pair)),
        "versions": json.dumps(versions()),
        **({"model": system.case.model.kind} if solid else {}),
        **({GRID: grid.numbers} if grid is not None and grows(system) else {}),
        **time_steps.attributes(system),
    }


def write_summary(directory: Path, summary: dict[str, Any]) -> None:
    """Write summary.json."""
    write_text(directory / SUMMARY, json.dumps(summary, indent=2) + "\n")


def write_case(directory: Path, case: Case) -> None:
    """Write the resolved case.toml, which runs again as it is."""
    write_text(directory / CASE, case.to_toml())
