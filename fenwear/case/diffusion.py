"""How far heat gets into a strip that slides one way or turns: its diffusivity over its speed.

Below a contact of length L, under which material passes at v, a layer sqrt(a L / v) heats up, a = k / (rho c)
(J. C. Jaeger, Moving sources of heat and the temperature at sliding contacts, 1942).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fenwear.case.motions import OneWay, Rotation

if TYPE_CHECKING:
    from fenwear.case.schema import Case

STEP = 2  # between the values of a / v that meshes are made for: cases of about the same speed share one


def diffusion_of(case: Case) -> dict[str, float]:
    """Return a / v, mm, or where the strip turns a / omega, mm²/rad, by the parameter of the ready geometries.

    The smallest of its regions at the initial temperature and of the speeds of its program, rounded down to a power
    of 2; none without heat, where the strip does not pass, or to and fro.
    """
    motion = case.motion
    if case.heat is None or not case.passes or not isinstance(motion, OneWay | Rotation):
        return {}
    name, key, speed = (
        ("diffusion_length", "speed", motion.speed)
        if isinstance(motion, OneWay)
        else ("diffusion_area", "angular_speed", motion.angular_speed)
    )
    steps = () if case.program is None else case.program.steps
    fastest = max([speed, *(one for step in steps for one in getattr(step, key) or ())])
    materials = case.initial_materials
    diffusivities = [
        (m.conductivity or 0.0) / ((m.density or 0.0) * (m.heat_capacity or 0.0))
        for m in (materials[region] for region in case.strip.regions.values())
    ]
    if fastest <= 0:
        return {}
    exact = min(diffusivities) / fastest
    return {name: float(STEP ** math.floor(math.log(exact, STEP)))}
