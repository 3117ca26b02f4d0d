"""Profiles of contact surfaces in CSV files, read into the tables of a case."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fenwear.case.csv_table import read_csv
from fenwear.errors import CaseError, InputError

COLUMNS = {"x": "mm", "r": "mm", "y": "mm", "depth": "mm"}
BODIES = ("punch", "strip")


def with_profiles(data: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the tables of a case with the files of its bodies' profiles read into points.

    Raises:
        CaseError: a file cannot be read, or there are points besides.
    """
    found = dict(data)
    for body in BODIES:
        table = data.get(body)
        profile = table.get("profile") if isinstance(table, Mapping) else None
        if not isinstance(table, Mapping) or not isinstance(profile, Mapping) or "file" not in profile:
            continue
        key = f"{body}.profile.file"
        if "points" in profile or not isinstance(profile["file"], str):
            raise CaseError(InputError(key, "expected the name of a CSV file, and no points beside it"))
        rest = {name: value for name, value in profile.items() if name != "file"}
        path = Path(profile["file"]) if folder is None else folder / profile["file"]
        found[body] = {**table, "profile": {**rest, "points": read_profile(path, key)}}
    return found


def read_profile(path: Path, key: str) -> list[list[float]]:
    """Return [x, depth] or [x, y, depth] of each row of a CSV file, mm.

    Args:
        path: Of the file; each heading has its unit, as in "depth (um)".
        key: Of the case, for messages.

    Raises:
        CaseError: it cannot be read; names column and row.
    """
    table = read_csv(path, key, COLUMNS, least=2)
    names = table.names
    places = [name for name in names if name != "depth"]
    if sorted(places) not in (["x"], ["r"], ["x", "y"]) or names.count("depth") != 1:
        raise table.wrong("expected the columns x and depth, r and depth of rings, or x, y and depth of solids")
    order = [names.index(name) for name in (*sorted(places), "depth")]
    return [[row[k] for k in order] for row in table.rows]


def profile_text(axes: tuple[str, ...], points: list[list[float]]) -> str:
    """Return a CSV file that reads back as these points, [x, (y,) depth], mm; depths in micrometres."""
    lines = [",".join([*(f"{axis} (mm)" for axis in axes), "depth (um)"])]
    lines += [",".join([*(f"{place:.9g}" for place in row[:-1]), f"{1e3 * row[-1]:.9g}"]) for row in points]
    return "\n".join(lines) + "\n"
