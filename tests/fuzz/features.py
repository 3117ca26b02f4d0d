"""Random features of a problem besides its bodies and motion: layers, debris, coatings, creep, laws by tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np

Changes = dict[str, Any]


@dataclass(frozen=True)
class Scales:
    """What is usual in a problem.

    Attributes:
        pressure: MPa.
        length: Width of the contact, mm.
        slide: Sliding in a half-cycle, mm.
        time: Of a half-cycle, s.
        wear: Coefficient of the punch, 1/MPa.
        strip: Whether the strip wears.
        heat: Whether friction heats.
        one_way: Whether the strip's material leaves the contact.
        solid: Whether bodies are solids.
        power: Of the pressure in the law of wear.
        friction: Coefficient.
    """

    pressure: float
    length: float
    slide: float
    time: float
    wear: float
    strip: bool
    heat: bool
    one_way: bool
    solid: bool
    power: float
    friction: float

    @property
    def depth(self) -> float:
        """Worn in a half-cycle, mm."""
        return self.wear * self.pressure * self.slide

    @property
    def yields(self) -> float:
        """By how much bodies of steel yield, mm."""
        return self.pressure * self.length / 2e5


def _debris(dice: Random, s: Scales) -> Changes:
    body: dict[str, Any] = {"share": dice.choice([0.3, 0.7, 1.0]), "life": f"{dice.choice([2, 20]) * s.slide} mm"}
    if s.strip and dice.random() < 0.3:
        body["carried_by"] = "strip"
    elif dice.random() < 0.5:
        body |= {"edge_life": f"{2 * s.slide} mm", "edge_length": f"{s.length / 20} mm"}
    if dice.random() < 0.3:
        body["initial"] = f"{3 * s.depth} mm"
    return {"contact.third_body": body}


def _layer(dice: Random, s: Scales) -> Changes:
    depth = s.yields * dice.choice([0.1, 1.0])
    kind = dice.choice(["linear", "power", "exponential", "rough"])
    layer: dict[str, Any] = {"kind": kind, **{
        "linear": {"stiffness": f"{s.pressure / depth} N/mm^3"},
        "power": {"reference": f"{depth} mm", "pressure": f"{s.pressure} MPa"},
        "exponential": {"length": f"{depth} mm", "pressure": f"{s.pressure / 3} MPa"},
        "rough": {"roughness": f"{depth} mm", "asperity_radius": f"{100 * depth} mm",
                  "asperity_density": f"{0.05 / (100 * depth**2)} 1/mm^2"},
    }[kind]}  # fmt: skip
    if kind == "linear" and dice.random() < 0.5:
        layer["creep"] = {"terms": [{"compliance": 0.7, "time": f"{3 * s.time} s"}]}
    return {"contact.layer": layer}


def _shared(dice: Random, s: Scales) -> Changes:
    table = [[0.0, 0.3], [s.pressure, 0.6], [4 * s.pressure, 0.9]]
    return {"contact.lubrication": {"asperity_share": {"table": table, "of": "p"}, "fluid_friction": 0.01}}


def _coating(dice: Random, s: Scales) -> Changes:
    coat: dict[str, Any] = {"thickness": f"{3 * s.depth} mm", "coefficient": f"{0.3 * s.wear} 1/MPa"}
    if dice.random() < 0.5:
        coat["modulus"] = f"{20 * s.pressure} MPa"
    if dice.random() < 0.5:
        coat["friction"] = 0.1
    return {"wear.punch.coating": coat}


def _creep(body: str) -> Callable[[Random, Scales], Changes]:
    def change(dice: Random, s: Scales) -> Changes:
        terms = [{"compliance": 0.5, "time": f"{f * s.time} s"} for f in dice.choice([(2, 20), (5,), (0.1,)])]
        return {f"{body}.creep": {"terms": terms}}

    return change


def _friction(dice: Random, s: Scales) -> Changes:
    mu = s.friction
    if s.heat and dice.random() < 0.5:
        return {"contact.friction": {"table": [[0.0, mu], [5.0, 0.8 * mu]], "of": "T"},
                "contact.friction_temperature": dice.choice(["mean", "punch", "strip", "hotter"])}  # fmt: skip
    return {"contact.friction": {"table": [[0.0, mu], [s.pressure, 0.7 * mu], [3 * s.pressure, 0.5 * mu]], "of": "p"}}


def _law(dice: Random, s: Scales) -> Changes:
    of, most = dice.choice([("depth", 5 * s.depth), ("p", 2 * s.pressure), *([("T", 5.0)] if s.heat else [])])
    return {"wear.punch.coefficient": {"table": [[0.0, s.wear], [most, 2 * s.wear]], "of": of, "unit": "1/MPa"}}


def _profile(dice: Random, s: Scales) -> Changes:
    x = np.array([-10.0, -0.6, -0.3, 0.0, 0.3, 0.6, 10.0]) * s.length
    return {"punch.profile": {"points": [[float(a), dice.uniform(0, 0.3) * s.yields] for a in x]}}


def _conductance(dice: Random, s: Scales) -> Changes:
    return {"heat.conductance": f"{dice.uniform(50, 5000):.4g} W/(m^2 K)", "heat.partition": 0.8, "heat.debris": 0.2}


FEATURES: dict[str, Callable[[Random, Scales], Changes]] = {
    "debris": _debris,
    "layer": _layer,
    "lubrication": _shared,
    "coating": _coating,
    "hardness": lambda dice, s: {"contact.hardness": f"{1.5 * s.pressure} MPa"},
    "creep": _creep("punch"),
    "creep of the strip": _creep("strip"),
    "threshold": lambda dice, s: {"wear.punch.pressure_threshold": f"{0.2 * s.pressure} MPa"},
    "cap": lambda dice, s: {"wear.punch.pressure_cap": f"{0.8 * s.pressure} MPa"},
    "friction": _friction,
    "law": _law,
    "profile": _profile,
    "conductance": _conductance,
}


OF_BODIES = ("creep", "creep of the strip", "profile")  # which bodies are made with
OF_PHYSICS = tuple(name for name in FEATURES if name not in OF_BODIES)


def drawn(
    dice: Random, scales: Scales, among: tuple[str, ...], counts: tuple[int, ...]
) -> tuple[tuple[str, ...], Changes]:
    """Return the names of some features, and what they change."""
    left = {*(["conductance"] if not scales.heat else []), *(["creep of the strip"] if scales.one_way else []),
            *(["profile", "hardness"] if scales.solid else []),
            *(["law", "coating"] if scales.power != 1.0 else [])}  # fmt: skip
    names = [name for name in among if name not in left]
    chosen = tuple(dice.sample(names, min(dice.choice(counts), len(names))))
    changes: Changes = {}
    for name in chosen:
        changes |= FEATURES[name](dice, scales)
    return chosen, changes
