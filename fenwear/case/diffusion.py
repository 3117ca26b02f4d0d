"""How far heat gets into a strip that slides one way or turns: its diffusivity over its speed.

Below a contact of length L, under which material passes at v, a layer sqrt(a L / v) heats up, a = k / (rho c)
(J. C. Jaeger, Moving sources of heat and the temperature at sliding contacts, 1942).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from fenwear.case.materials import Material
from fenwear.case.motions import OneWay, Rotation

STEP = 2  # between the values of a / v that meshes are made for: cases of about the same speed share one


def diffusion_of(motion: OneWay | Rotation, steps: Iterable[Any], materials: Iterable[Material]) -> dict[str, float]:
    """Return a / v, mm, or where the strip turns a / omega, mm²/rad, by the parameter of the ready geometries.

    The smallest of all materials and speeds, rounded down to a power of 2; none where the strip stands.

    Args:
        motion: Of the strip that conducts heat and passes.
        steps: Of its program, whose speeds count, too.
        materials: Of its regions, with constants.
    """
    name, key, speed = (
        ("diffusion_length", "speed", motion.speed)
        if isinstance(motion, OneWay)
        else ("diffusion_area", "angular_speed", motion.angular_speed)
    )
    fastest = max([speed, *(one for step in steps for one in getattr(step, key) or ())])
    diffusivities = [(m.conductivity or 0.0) / ((m.density or 0.0) * (m.heat_capacity or 0.0)) for m in materials]
    if fastest <= 0:
        return {}
    exact = min(diffusivities) / fastest
    return {name: float(STEP ** math.floor(math.log(exact, STEP)))}
