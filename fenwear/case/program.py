"""Test programs: tables over cycles, distance or time, read and cut into stages of constant motion."""

from __future__ import annotations

import csv
import difflib
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fenwear.case.course import ProgramStep
from fenwear.case.motions import OneWay, Rotation, Tabulated
from fenwear.case.schema import Case
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError

LENGTHS = {"cycles": "", "distance": "mm", "time": "s"}
COLUMNS = {
    "load": "N",
    "load_factor": "",
    "speed": "mm/s",
    "angular_speed": "rad/s",
    "amplitude": "mm",
    "angular_frequency": "rad/s",
    "period": "s",
    "ambient": "K",
}
MOTION = ("speed", "angular_speed", "amplitude", "angular_frequency", "period")
_HEADING = re.compile(r"\s*(?P<name>[A-Za-z_]+)\s*([(\[]\s*(?P<unit>[^)\]]*?)\s*[)\]])?\s*")
MIDDLES = (np.arange(200) + 0.5) / 200  # of a ramp, over which durations are averaged


@dataclass(frozen=True)
class Stage:
    """Cycles of constant motion and ambient temperature, over which loads may change linearly.

    Attributes:
        begin, end: Half-cycles before its first, and its last one.
        case: With its motion and ambient temperature.
        load: The normal force at its begin and end, N; None where it is not given.
        load_factor: All loads over those of the case, where `load` is None.
        time: At its begin, s.
        slid: Before its begin, mm or rad.
        step: Number of the program's step.
    """

    begin: int
    end: int
    case: Case
    load: tuple[float, float] | None
    load_factor: tuple[float, float]
    time: float
    slid: float
    step: int


def read_program(path: Path) -> list[dict[str, Any]]:
    """Return the steps of a table in a CSV file: straight lines between its rows, jumps where one is repeated.

    Args:
        path: Of the file; one of the columns cycles, distance and time comes first, each heading has its unit.

    Raises:
        CaseError: it cannot be read, runs backwards or overlaps; names column and row.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [(n, row) for n, row in enumerate(csv.reader(file), 1) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _wrong(path, f"cannot be read: {getattr(error, 'strerror', None) or 'not a CSV file in UTF-8'}") from None
    if len(rows) < 3:
        raise _wrong(path, f"expected a row of headings and at least two rows of numbers, got {len(rows)} in all")
    names, units = _headings(path, rows[0][1])
    values = [_numbers(path, line, row, names, units) for line, row in rows[1:]]
    _check_order(path, names[0], [line for line, _ in rows[1:]], [row[0] for row in values])
    steps = []
    for before, after in itertools.pairwise(values):
        length = after[0] - before[0]
        if length > 0:
            step: dict[str, Any] = {names[0]: round(length) if names[0] == "cycles" else length}
            step |= {
                name: [a, b] if a != b else [a] for name, a, b in zip(names[1:], before[1:], after[1:], strict=True)
            }
            steps.append(step)
    return steps


def _wrong(path: Path, message: str) -> CaseError:
    return CaseError(InputError("program.file", f"{path}: {message}"))


def _headings(path: Path, row: Sequence[str]) -> tuple[list[str], list[str]]:
    names, units = [], []
    for cell in row:
        match, known = _HEADING.fullmatch(cell), [*LENGTHS, *COLUMNS]
        name = match["name"] if match else cell.strip()
        if name not in known:
            close = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
            raise _wrong(path, f"the column {name!r} is not known; {hint}")
        unit = (match["unit"] if match else None) or ""
        wanted = {**LENGTHS, **COLUMNS}[name]
        if wanted and not unit:
            raise _wrong(path, f"the column {name} has no unit; expected such as '{name} ({wanted})'")
        try:
            convert(f"1 {unit}" if unit else 1.0, wanted)
        except ValueError as error:
            raise _wrong(path, f"the column {name}: {error}") from None
        names.append(name)
        units.append(unit)
    if names[0] not in LENGTHS or any(name in LENGTHS for name in names[1:]) or len(set(names)) < len(names):
        raise _wrong(path, "expected one of cycles, distance and time as the first column, and no column twice")
    if len(names) < 2:
        raise _wrong(path, f"expected a column of what changes: {', '.join(COLUMNS)}")
    return names, units


def _numbers(path: Path, line: int, row: Sequence[str], names: list[str], units: list[str]) -> list[float]:
    if len(row) != len(names):
        raise _wrong(path, f"row {line}: expected {len(names)} values, got {len(row)}")
    found = []
    for cell, name, unit in zip(row, names, units, strict=True):
        try:
            found.append(convert(f"{cell.strip()} {unit}".strip(), {**LENGTHS, **COLUMNS}[name]))
        except ValueError:
            raise _wrong(path, f"row {line}: {name}: expected a finite number, got {cell.strip()!r}") from None
        if name == "cycles" and found[-1] != round(found[-1]):
            raise _wrong(path, f"row {line}: cycles: expected a whole number, got {cell.strip()!r}")
    return found


def _check_order(path: Path, name: str, lines: Sequence[int], places: Sequence[float]) -> None:
    """Raise where a table does not begin at zero, runs backwards, or has a place more than twice."""
    if places[0] != 0:
        raise _wrong(path, f"row {lines[0]}: expected {name} = 0 in the first row, got {places[0]:g}")
    for k in range(1, len(places)):
        if places[k] < places[k - 1]:
            raise _wrong(path, f"row {lines[k]}: {name} runs backwards, from {places[k - 1]:g} to {places[k]:g}")
        if k > 1 and places[k] == places[k - 2]:
            raise _wrong(
                path, f"row {lines[k]}: {name} = {places[k]:g} stands there three times; expected two for a jump"
            )
    if places[-1] == 0:
        raise _wrong(path, f"{name} ends at 0; expected a table that goes on")


def with_program(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a case with the program's file read into steps.

    Raises:
        CaseError: the file cannot be read, or there are steps besides.
    """
    program = data.get("program")
    if not isinstance(program, Mapping) or "file" not in program:
        return dict(data)
    if "steps" in program or not isinstance(program["file"], str):
        raise CaseError(InputError("program.file", "expected the name of a CSV file, and no steps beside it"))
    rest = {key: value for key, value in program.items() if key != "file"}
    path = Path(program["file"]) if folder is None else folder / program["file"]
    return {**data, "program": {**rest, "steps": read_program(path)}}


@dataclass
class _Now:
    """What acts at the end of the steps so far."""

    load: float | None = None
    load_factor: float = 1.0
    values: dict[str, float] = field(default_factory=dict)


def stages_of(case: Case) -> tuple[Stage, ...]:
    """Return the stages of a case's program; none without a program.

    Each lasts whole cycles. Ramps of the motion and of the ambient temperature are cut into levels, each at the
    value of its middle: what they slide and how long they take adds up as over the ramp.

    Raises:
        CaseError: a step is shorter than a cycle.
    """
    program = case.program
    if program is None:
        return ()
    stages: list[Stage] = []
    now, half_cycle, time, slid = _Now(), 0, 0.0, 0.0
    for number, step in enumerate(program.steps):
        ramps = {key: _ends(getattr(step, key), now.values.get(key)) for key in (*MOTION, "ambient")}
        given = {key: ends for key, ends in ramps.items() if ends is not None}
        strokes, cycles = _cycles(case, step, given, number)
        loads = _ends(step.load, now.load if step.load_factor is None else None)
        factors = _ends(step.load_factor, now.load_factor) or (1.0, 1.0)
        count = min(cycles, program.levels) if any(a != b for a, b in given.values()) else 1
        edges = [round(cycles * k / count) for k in range(count + 1)]
        for low, high in itertools.pairwise(edges):
            at = _at(case, given, (low + high) / 2 / cycles)
            part = (low / cycles, high / cycles)
            period, distance, _ = cycle_of(at)
            stages.append(
                Stage(
                    half_cycle + strokes * low,
                    half_cycle + strokes * high,
                    at,
                    None if loads is None else _between(loads, part),
                    _between(factors, part),
                    time,
                    slid,
                    number,
                )
            )
            time += (high - low) * period
            slid += (high - low) * distance
        half_cycle += strokes * cycles
        last = {key: ends[1] for key, ends in given.items()}
        now = _Now(None if loads is None else loads[1], factors[1], last)
    return tuple(stages)


def _ends(ramp: tuple[float, ...] | None, before: float | None) -> tuple[float, float] | None:
    """Return the values at the begin and the end of a step: those given, or what was before."""
    if ramp is not None:
        return ramp[0], ramp[-1]
    return None if before is None else (before, before)


def _between(ends: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    first, last = (ends[0] + share * (ends[1] - ends[0]) for share in part)
    return first, last


def _at(case: Case, ramps: Mapping[str, tuple[float, float]], share: float) -> Case:
    """Return the case at a share of a step."""
    values = {key: a + share * (b - a) for key, (a, b) in ramps.items()}
    motion: dict[str, float | None] = {key: value for key, value in values.items() if key in MOTION}
    if "period" in motion:
        motion["angular_frequency"] = None
    elif "angular_frequency" in motion:
        motion["period"] = None
    update: dict[str, Any] = {"motion": case.motion.model_copy(update=motion)}
    if "ambient" in values and case.heat is not None:
        update["heat"] = case.heat.model_copy(update={"ambient": values["ambient"]})
    return case.model_copy(update=update)


def _cycles(case: Case, step: ProgramStep, ramps: Mapping[str, tuple[float, float]], number: int) -> tuple[int, int]:
    """Return how many half-cycles a cycle has, and how many cycles a step takes."""
    strokes = cycle_of(case)[2]
    if step.cycles is not None:
        return strokes, step.cycles
    varies = any(a != b for a, b in ramps.values())
    found = [cycle_of(_at(case, ramps, share)) for share in (MIDDLES if varies else MIDDLES[:1])]
    duration, distance = (float(np.mean([one[k] for one in found])) for k in (0, 1))
    key, whole, each, unit = "distance", step.distance, distance, "mm"
    if step.time is not None:
        key, whole, each, unit = "time", step.time, duration, "s"
    cycles = round((whole or 0.0) / each)
    if cycles < 1:
        key = f"program.steps.{number}.{key}"
        raise CaseError(InputError(key, f"expected at least a cycle of {each:.4g} {unit}, got {whole:.4g} {unit}"))
    return strokes, cycles


def cycle_of(case: Case) -> tuple[float, float, int]:
    """Return the duration of a cycle in s, what it slides in mm or rad, and its number of half-cycles."""
    motion = case.motion
    if isinstance(motion, OneWay):
        return motion.duration, motion.speed * motion.duration, 1
    if isinstance(motion, Rotation):
        return motion.duration, motion.angular_speed * motion.duration, 1
    if isinstance(motion, Tabulated):
        moved = np.diff(motion.displacements)
        ways = np.sign(moved[moved != 0])
        return motion.times[-1], float(np.abs(moved).sum()), 1 + int(np.count_nonzero(np.diff(ways)))
    return 2 * motion.half_period, 4 * motion.amplitude, 2


def half_cycles_of(case: Case) -> int:
    """Return the number of half-cycles of a case's program."""
    return stages_of(case)[-1].end


def check_length(case: Case) -> None:
    """Raise where a run is to go on behind the end of its program.

    Raises:
        CaseError: it is.
    """
    if case.program is None:
        return
    last = half_cycles_of(case)
    if case.run.half_cycles > last:
        raise CaseError(
            InputError(
                "run.half_cycles",
                f"the program ends after {last:,} half-cycles, but {case.run.half_cycles:,} are to be run: "
                "expected a further step, or no run.half_cycles",
            )
        )
