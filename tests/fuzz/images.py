"""A problem in other units, and its mirror image, and whether all that two histories hold is each other's image.

Three sizes make a problem another one of the same numbers: of lengths, stresses and times; of temperatures a fourth.
Every quantity is then as many times larger as its unit says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pint
import xarray

from fenwear.bodies.ready_geometries import constants, meshes_folder

Tables = dict[str, Any]
COUNTS = re.compile(r"elements|grading|growth|angle|pins|across|around|along|layers|quarter|tetrahedra|^outer$|spread")
# No image of another run's, or by rounding: which of two equal nodes it is, whether nodes lie just on the edge swept.
COUNTED = re.compile(r"_error$|^retries$|^coupling_iterations$|^facets|_surface|^weight_strip$|_at_")
SMALL = 1e-6  # of what is largest in a unit: rounding below it
REGISTRY = pint.UnitRegistry()


@cache
def _dimensions(unit: str) -> tuple[float, float, float, float]:
    """Return the exponents of mass, length, time and temperature."""
    text = re.sub(r"([a-z])(-?\d)", r"\1**\2", unit.replace("^", "**").replace("degree", "deg"))
    if "(" not in text:
        text = text.replace(" ", "*")
    found = REGISTRY.Quantity(1, re.sub(r"N m\b", "N*m", text)).dimensionality
    return tuple(float(found.get(f"[{name}]", 0)) for name in ("mass", "length", "time", "temperature"))  # type: ignore


class Sizes:
    """How many times larger lengths (mm), stresses (MPa), times (s) and temperatures (K) are."""

    def __init__(self, length: float, stress: float, time: float, temperature: float) -> None:
        self.bases = (stress * length * time**2, length, time, temperature)
        self.by_name = {"p": stress, "x": length, "depth": length, "s": length, "v": length / time, "T": temperature}

    def of(self, unit: str) -> float:
        """Return how many times larger a quantity is."""
        return float(np.prod([b**e for b, e in zip(self.bases, _dimensions(unit), strict=True)]))


def scaled(value: Any, sizes: Sizes) -> Any:
    """Return the tables of a case, every quantity with its unit, in other sizes."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([-+0-9.eE]+)\s+(\S.*)", value)
        return f"{float(match[1]) * sizes.of(match[2])!r} {match[2]}" if match else value
    if isinstance(value, list):
        return [scaled(one, sizes) for one in value]
    if not isinstance(value, dict):
        return value
    found = {key: scaled(one, sizes) for key, one in value.items()}
    if "per_area" not in value:
        found.pop("touching_from", None)  # a default that only goes with it
    if "table" in value:
        by, of = sizes.of(value.get("unit", "")), sizes.by_name[value["of"]]
        found["table"] = [[a * of, b * by] for a, b in value["table"]]
    if "parameters" in value:
        defaults = {
            key: float(one) for key, one in constants(meshes_folder() / value["file"]).items() if "diffusion" not in key
        }
        found["parameters"] = {
            key: one if COUNTS.search(key) else one * sizes.of("mm^2" if key == "diffusion_area" else "mm")
            for key, one in {**defaults, **value["parameters"]}.items()
        }
    if "columns" in value:
        factors = [sizes.of(match[1]) for match in (re.search(r"\((.*)\)", c) for c in value["columns"]) if match]
        found["rows"] = [[a * f for a, f in zip(row, factors, strict=True)] for row in value["rows"]]
    return found


def number(value: Any) -> float:
    """Return the number of a quantity."""
    return float(str(value).split()[0])


def mirrored(tables: Tables) -> tuple[Tables, Tables]:
    """Return a problem, and what it is with x the other way, for bodies that are symmetric about x = 0.

    A motion to and fro begins one way; as a table it can begin either way.
    """
    motion = dict(tables["motion"])
    one, other = dict(tables), dict(tables)
    if motion["kind"] == "reciprocating":
        size = number(motion["amplitude"])
        turning = "angular_frequency" in motion
        half = np.pi / number(motion["angular_frequency"]) if turning else number(motion["period"]) / 2
        kept = {key: motion[key] for key in ("axis", "positions") if key in motion}
        times = [f"{k * half!r} s" for k in range(3)]
        one["motion"], other["motion"] = (
            {**kept, "kind": "table", "times": times, "displacements": [f"{v!r} mm" for v in (-a, a, -a)]}
            for a in (size, -size)
        )
    elif motion["kind"] == "table":
        other["motion"] = {**motion, "displacements": [f"{-number(v)!r} mm" for v in motion["displacements"]]}
    else:
        ways = ("rightward", "leftward") if motion["kind"] == "one-way" else ("counterclockwise", "clockwise")
        now = motion.get("direction", ways[0])
        other["motion"] = {**motion, "direction": ways[1 - ways.index(now)]}
    for body in ("punch", "strip"):
        if "profile" in tables[body] and tables["model"]["kind"] == "plane":
            points = [[-number(x), number(z)] for x, z in tables[body]["profile"]["points"]][::-1]
            other[body] = {**tables[body], "profile": {"points": points}}
    return one, other


def _floors(history: xarray.Dataset, sizes: Sizes) -> dict[str, float]:
    """Return below which values of each unit are rounding."""
    largest: dict[str, float] = {}
    for name, values in history.data_vars.items():
        if values.dtype.kind == "f" and not COUNTED.search(str(name)):
            unit = values.attrs.get("units", "1")
            largest[unit] = max(largest.get(unit, 0.0), float(np.nanmax(np.abs(values.values), initial=0.0)))
    # A bulk, or a place where a body is held, that no heat has come to yet: what the mesh makes of it, and a basis,
    # whose tolerance of 1e-7 of all heat is 5e-6 of this.
    passed = {unit: 0.02 * largest.get(unit, 0.0) for unit in ("K", "mJ")}
    return {unit: SMALL * value for unit, value in largest.items()} | {"1": 1e-3, "rad": 1e-3} | passed


def apart(
    one: xarray.Dataset,
    other: xarray.Dataset,
    sizes: Sizes,
    order: Mapping[str, np.ndarray],
    signs: tuple[float, ...] = (1.0,),
) -> tuple[str, float]:
    """Return the quantity that differs most from its image, and by how much of its largest value.

    Args:
        one: A history.
        other: That of its image.
        sizes: How many times larger quantities are there.
        order: Nodes of the image by dimension.
        signs: That a quantity may have.
    """
    if set(one.data_vars) != set(other.data_vars):
        return f"only one has {sorted(map(str, set(one.data_vars) ^ set(other.data_vars)))}", 1.0
    floors = _floors(one, sizes)
    worst = ("", 0.0)
    for key, values in one.data_vars.items():
        name, unit = str(key), values.attrs.get("units", "1")
        if values.dtype.kind != "f" or COUNTED.search(name) or (values.dims and "half_cycle" not in values.dims):
            continue
        here, there = values.values, other[key].values / sizes.of(unit)
        if here.shape != there.shape:
            return f"{name}: shapes {here.shape}, {there.shape}", 1.0
        for axis, dim in enumerate(map(str, values.dims)):
            if dim in order:
                there = np.take(there, order[dim], axis=axis)
        scale = max(float(np.nanmax(np.abs(here), initial=0.0)), floors.get(unit, 0.0), 1e-300)
        off = min(float(np.nanmax(np.abs(here - sign * there), initial=0.0)) for sign in signs) / scale
        if np.any(np.isnan(here) != np.isnan(there)):
            off = 1.0
        if off > worst[1]:
            worst = (name, off)
    return worst
