"""What is told of flash temperatures: numbers, a text, and maps over the cycle as a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray

from fenwear.arrays import Array
from fenwear.flash.temperatures import BODIES, FlashTemperatures

WAYS = {
    "steady": "the strip goes one way: steady, a source over which its material passes",
    "harmonics": "the strip goes to and fro: {steps} steps of the cycle, in harmonics of it",
    "instants": "the strip goes far to and fro: {steps} instants of the cycle, each with all that was before it",
}


def numbers(found: FlashTemperatures) -> dict[str, Any]:
    """Return the numbers of `--json`."""
    heating, powers = found.heating, found.powers
    both = {
        name: {
            **_largest(found, flash),
            "mean_flash_K": float(_means(found, flash).max()),
            "mean_flash_over_cycle_K": float(_means(found, flash).mean()),
            "by_finite_body_K": None if found.bulk is None else found.bulk[number],
            "largest_rise_K": None if found.bulk is None else float(flash.max()) + found.bulk[number],
            "power_mW": powers[number],
            "largest_peclet": found.peclet[number],
            "spreading_over_half_cycle": found.quick[number],
        }
        for number, (name, flash) in enumerate(zip(BODIES, found.flash, strict=True))
    }
    return {
        "half_cycle": heating.half_cycle,
        "way": found.way,
        "instants": len(heating.times),
        **both,
        "friction_power_mW": sum(powers),
        "share_into_punch": powers[0] / sum(powers) if sum(powers) else None,
        "stroke_mm": heating.way,
        "largest_speed_mm_per_s": heating.fastest,
        "contact_mm": heating.extent.tolist(),
        "nodes_across": list(found.across),
        "thermal_feedback": found.feedback,
        "warnings": [heating.placed.names.told(one) for one in found.warnings],
    }


def _largest(found: FlashTemperatures, flash: Array) -> dict[str, Any]:
    """Return the largest rise of a surface, and where and when it is."""
    instant, first, second = np.unravel_index(int(flash.argmax()), flash.shape)
    grid, window = found.heating.grid, found.heating.window
    place = grid.flat[window.nodes[first, second]]
    at = {f"at_{'xyz'[axis]}_mm": round(float(c), 9) + 0.0 for axis, c in zip(grid.axes, place, strict=True)}
    return {"largest_flash_K": float(flash.max()), **at, "at_time_s": float(found.heating.times[instant])}


def _means(found: FlashTemperatures, flash: Array) -> Array:
    """Return the means over what touches at each instant (t,), K."""
    touching = found.heating.touching
    return np.asarray((flash * touching).sum(axis=(1, 2)) / np.maximum(touching.sum(axis=(1, 2)), 1))


def text(found: FlashTemperatures, name: str) -> str:
    """Return the same for readers."""
    of = numbers(found)
    along = {key: [of[body][key] for body in BODIES] for key in of["punch"]}

    def row(label: str, key: str, form: str = ".4g") -> str:
        values = (f"{value:{form}}" if value is not None else "-" for value in along[key])
        return f"{label:48}" + "".join(f"{value:>14}" for value in values)

    axes = [key for key in of["punch"] if key.startswith("at_") and key.endswith("_mm")]
    share = of["share_into_punch"]
    lines = [
        f"flash temperatures of {name}, of the cycle that half-cycle {of['half_cycle']:,} ends",
        f"  {WAYS[found.way].format(steps=of['instants'])}",
        f"{'':48}{'punch':>14}{'strip':>14}",
        row("largest flash (K)", "largest_flash_K"),
        *(row(f"at {key[3]} (mm)", key) for key in axes),
        row("mean over the contact, largest (K)", "mean_flash_K"),
        row("... over the cycle (K)", "mean_flash_over_cycle_K"),
        row("what the finite body adds (K)", "by_finite_body_K"),
        row("largest rise over the surroundings (K)", "largest_rise_K"),
        row("mean heat into the body (mW)", "power_mW"),
        row("largest v a / 2 kappa", "largest_peclet", ".3g"),
        f"share of the heat into the punch {'-' if share is None else f'{100 * share:.4g} %'}",
    ]
    if found.feedback is not None:
        lines.append(f"share of a pressure that its bulge would give back {found.feedback:.2g}")
    return "\n".join([*lines, *(f"warning: {one}" for one in found.warnings)])


def dataset(found: FlashTemperatures) -> xarray.Dataset:
    """Return maps at the instants of the cycle."""
    heating = found.heating
    first, second = ("xyz"[axis] for axis in heating.grid.axes)
    places = heating.grid.flat[heating.window.nodes]
    over = ("instant", first, second)
    maps = {"pressure": (heating.pressure, "MPa", "contact pressure")}
    for body, heat, flash in zip(BODIES, found.heat, found.flash, strict=True):
        maps[f"heat_{body}"] = heat, "mW/mm2", f"heat of friction into the {body}"
        maps[f"flash_{body}"] = flash, "K", f"rise of the surface of the {body} over its bulk"
    variables: dict[str, Any] = {
        name: (over, values, {"units": unit, "long_name": words}) for name, (values, unit, words) in maps.items()
    }
    variables["time"] = ("instant", heating.times, {"units": "s", "long_name": "time from the cycle's begin"})
    lines = {first: places[:, 0, 0], second: places[0, :, 1]}
    coordinates = {axis: (axis, x, {"units": "mm", "long_name": f"{axis} of the nodes"}) for axis, x in lines.items()}
    told = {"half_cycle": heating.half_cycle, "way": found.way, "Conventions": "CF-1.11"}
    if found.bulk is not None:
        told |= {f"by_finite_{body}_K": rise for body, rise in zip(BODIES, found.bulk, strict=True)}
    return xarray.Dataset(variables, coordinates, told)
