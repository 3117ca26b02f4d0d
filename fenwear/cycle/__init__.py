"""The cycle controller: march half-cycle by half-cycle, jump over cycles, or solve for the end.

`march` and `jump` yield blocks of half-cycles; `steady` returns the cyclic steady state. Their loop is `driver`, and
which of them a case asks for is read in `evolve.integrate`. The law of contact gives the step: `gross_sliding`
here, whose wear is taken off in `phase` and over many cycles in `jump_step`; `fenwear.stick.coulomb` beside it.
"""

from fenwear.cycle.block import Block
from fenwear.cycle.evolve import evolve, integrate, march
from fenwear.cycle.follow import Renewal, follow
from fenwear.cycle.jump import jump
from fenwear.cycle.monotonic import Monotonic, monotonic
from fenwear.cycle.program import Span, at_step, follow_program, held
from fenwear.cycle.stability import (
    critical_speed,
    decay_rates,
    explicit_growth,
    growth_rate,
    stability_number,
    stationary_growth,
)
from fenwear.cycle.steady import RunningIn, SteadyState, cycles_to_reach, running_in, steady
from fenwear.cycle.uniqueness import heat_gain, heat_warnings

__all__ = [
    "Block",
    "Monotonic",
    "Renewal",
    "RunningIn",
    "Span",
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
