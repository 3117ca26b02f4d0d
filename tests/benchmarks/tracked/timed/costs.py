"""What a change may make slower, tracked over commits by airspeed velocity: docs/benchmarks.md says how.

Each class sets up once what it times; the numbers are seconds of processor time, and MB at the most.
"""

from __future__ import annotations

import time
from typing import Any

from fenwear import Tribosystem, assemble, jump, load_case, march, steady

CASES: dict[str, tuple[str, ...]] = {
    "example1": (),
    "fretting": ("motion.positions=5",),
    "fretting-partial-slip": ("stick.step_tolerance=1",),
    "ball-on-flat": ("geometry.parameters.across=6", "geometry.parameters.core=0"),
    "bushing": (),
}
timer = time.process_time


def made(name: str) -> Tribosystem:
    """Return the system of a case, set up anew."""
    return assemble(load_case(name, CASES[name]), fresh=True)


class Bodies:
    """From the case to bodies that are ready to slide."""

    params = tuple(CASES)
    param_names = ("case",)
    timer = timer
    rounds, number, repeat = 1, 1, 3

    def time_assemble(self, name: str) -> None:
        """All of it, compiled forms apart."""
        made(name)

    def peakmem_assemble(self, name: str) -> None:
        """Of the process."""
        made(name)


class Steps:
    """What follows on bodies that are set up."""

    params = tuple(CASES)
    param_names = ("case",)
    timer = timer
    rounds, number, repeat = 1, 1, 5

    def setup(self, name: str) -> None:
        """Set up the bodies, and find what the first steps keep."""
        self.system: Any = made(name)
        self.time_half_cycles(name)

    def time_half_cycles(self, name: str) -> None:
        """Ten of them, marched."""
        list(march(self.system, 10))

    def time_jump(self, name: str) -> None:
        """A thousand cycles."""
        list(jump(self.system, 1000 * self.system.motion.half_cycles, tolerance=0.05))


class SteadyStates:
    """Direct ones."""

    params = ("example1", "bushing")
    param_names = ("case",)
    timer = timer
    rounds, number, repeat = 1, 1, 5

    def setup(self, name: str) -> None:
        """Set up the bodies."""
        self.system: Any = made(name)

    def time_steady(self, name: str) -> None:
        """One."""
        steady(self.system)
