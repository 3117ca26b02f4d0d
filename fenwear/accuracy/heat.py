"""What steps and bases of the heat contribute: to temperatures what is known of both, to pressures what the gap feels.

The exchange knows how far contact temperatures and the thermal gap are from those of smaller steps and of the whole
mesh, relative to themselves. The pressure is solved for once more with a thermal gap that is larger by as much; worn
depths differ by no more than it does beside a rigid motion, and by no more than the pressure that wears them.
"""

from __future__ import annotations

import numpy as np

from fenwear.accuracy.values import Contribution, Values
from fenwear.arrays import Array
from fenwear.assembly import Tribosystem, with_reduced_heat
from fenwear.cycle import Block
from fenwear.errors import ConvergenceError


def of_heat(last: Block, values: Values) -> dict[str, Contribution]:
    """Return what steps and basis of the heat contribute to the numbers of a run's end; none without heat; collective.

    Args:
        last: The last half-cycles.
        values: Their numbers.
    """
    fineness = last.system.exchange.fineness
    if fineness is None or last.heat is None:
        return {}
    known = {"heat_steps": fineness.change, "heat_basis": fineness.difference}
    return {source: _of(last, values, share) for source, share in known.items() if share is not None}


def of_steady_heat(system: Tribosystem, values: Values) -> dict[str, Contribution]:
    """Return the same of a steady state: relative, of pressures too, which the thermal gap makes at most as much of."""
    exchange = with_reduced_heat(system).exchange
    if exchange.fineness is None:
        return {}
    start = {"largest_temperature": system.initial_temperature}
    return {
        source: {quantity: share * abs(v.number - start.get(quantity.name, 0.0)) for quantity, v in values.items()}
        for source, share in (("heat_steps", exchange.fineness.change), ("heat_basis", exchange.fineness.difference))
        if share is not None
    }


def _of(last: Block, values: Values, share: float) -> Contribution:
    assert last.heat is not None
    system = last.system
    rise = float(last.heat.largest_temperature[-1]) - system.initial_temperature
    pressure, depth = system.led(lambda: _felt(last, share)) if not system.sticks else (share, np.inf)
    found: Contribution = {}
    for quantity, value in values.items():
        relative = pressure * abs(value.number)
        found[quantity] = {
            "largest_temperature": share * abs(rise),
            "largest_depth": min(relative, depth),
            "worn_volume": 0.0,
        }.get(quantity.name, relative)
    return found


def _felt(last: Block, share: float) -> tuple[float, float]:
    """Return the relative change of the largest pressure by a share more of the thermal gap, and that gap's range."""
    system, exchange, temperature = last.system, last.system.exchange, last.end.temperature
    phase = (int(last.half_cycle[-1]) * system.motion.positions - 1) % len(system.motion.phases)
    thermal = exchange.gap(exchange.own(temperature), phase)
    gap: Array = system.gap(phase, last.end.worn) + thermal
    contact = system.phase_contact((phase,))
    try:
        before, after = (contact.solve(g).pressure.max() for g in (gap, gap + share * thermal))
    except ConvergenceError:
        return share, np.inf
    return abs(float(after / before) - 1), share * float(np.ptp(thermal))
