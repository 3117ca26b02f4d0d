"""The cycle controller: march half-cycle by half-cycle, jump over cycles, or solve for the end.

`march` and `jump` yield blocks of half-cycles; `steady` returns the cyclic steady state. Their loop is `driver`, and
which of them a case asks for is read in `evolve.integrate`. The law of contact gives the step: `gross_sliding`
is one, whose wear is taken off in `phase` and over many cycles in `jump_step`; `coulomb` with stick is the other.

Modules `stick_*` belong to the latter: which nodes stick, slip or open is decided in `stick_equations`, a time step of
it solved in `stick_increment`; `stick_cycle` goes through the steps of a cycle, records them, and has their wear;
states and records are in `stick_state`, many cycles in `stick_jump`, the end in `stick_final`.
"""

from fenwear.steps.block import Block
from fenwear.steps.evolve import evolve, integrate, jump, march
from fenwear.steps.monotonic import Monotonic, monotonic
from fenwear.steps.program_stages import at_step, follow_program, held
from fenwear.steps.slow_changes import Renewal, follow
from fenwear.steps.stability import (
    critical_speed,
    decay_rates,
    explicit_growth,
    growth_rate,
    heat_gain,
    heat_warnings,
    stability_number,
    stationary_growth,
)
from fenwear.steps.steady import RunningIn, SteadyState, cycles_to_reach, running_in, steady

__all__ = [
    "Block",
    "Monotonic",
    "Renewal",
    "RunningIn",
    "SteadyState",
    "at_step",
    "critical_speed",
    "cycles_to_reach",
    "decay_rates",
    "evolve",
    "explicit_growth",
    "follow",
    "follow_program",
    "growth_rate",
    "heat_gain",
    "heat_warnings",
    "held",
    "integrate",
    "jump",
    "march",
    "monotonic",
    "running_in",
    "stability_number",
    "stationary_growth",
    "steady",
]
