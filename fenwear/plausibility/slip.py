"""What is told of time steps in which nodes stick or slip: too coarse, of several answers, sliding as a whole."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.arrays import Mask
from fenwear.assembly import Tribosystem
from fenwear.stick.program import passes

if TYPE_CHECKING:
    from fenwear.cycle import Block


def law_warnings(system: Tribosystem) -> list[str]:
    """Return what is to be said of the time steps of a system before it is followed."""
    fineness = None if system.law_state is None else system.law_state.fineness
    return [] if fineness is None or fineness.enough else [fineness.text()]


def unique_text(unique: Mask) -> str:
    """Say that friction is so large that there may be several answers, and which was taken; "" if it is not."""
    if unique.all():
        return ""
    return (
        f"friction is so large that the contact may have no or several answers in {int((~unique).sum())} of "
        f"{len(unique)} time steps; those taken are the ones that Newton's method came to from the step before; "
        "expected less friction"
    )


def sliding_text(last: Block) -> str:
    """Say that nothing sticks in time steps of the last cycle; "" if something does, or nothing can."""
    steps: tuple[Any, ...] = last.steps[-last.system.motion.half_cycles :]
    if not steps:
        return ""
    slipping = np.concatenate(
        [(one.records.pressure > 0).any(axis=1) & ~one.records.sticking.any(axis=1) for one in steps]
    )
    if not slipping.any():
        return ""
    return f"gross sliding: in {100 * float(np.mean(slipping)):.0f} % of the last cycle's time steps nothing sticks"


def passing_text(last: Block) -> str:
    """Say that a strip passes that slips less than a node, as it was asked to; "" if it does not."""
    system = last.system
    steps: tuple[Any, ...] = last.steps[-system.motion.half_cycles :]
    if not steps or system.law_state is None or not system.law_state.problem.interface.moves:
        return ""
    pair = system.pair
    slipped = sum(one.records.slip_amplitude(pair.weights, len(steps)) for one in steps)
    if passes(slipped, pair.punch):
        return ""
    return (
        f"the strip passes under the punch with its supports, but slips by {1e3 * slipped:.2g} µm each way, less than "
        f"nodes are apart ({1e3 * pair.punch.spacing():.2g} µm): where nodes stick its wear is smeared over them, and "
        "grows with every cycle; expected motion.positions left away, or 1"
    )


def uniques(block: Block) -> Mask:
    """Return of each time step of a block whether its answer was the only one near (k,)."""
    steps: tuple[Any, ...] = block.steps
    return np.concatenate([np.ones(0, dtype=bool), *(one.records.unique.astype(bool) for one in steps)])
