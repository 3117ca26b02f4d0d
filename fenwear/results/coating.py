"""What is left of coatings, and where and when they are worn through, in history.nc and summary.json.

Between two recorded half-cycles a coating ends where what its coefficient would have worn reaches what was left: exact
where the pressure stays, see `fenwear.sliding.coating`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.cycle import Block
from fenwear.cycle.state import RunState
from fenwear.results.quantity import Variable
from fenwear.results.scar import EDGE
from fenwear.sliding.coating import CoatedBody, left_of
from fenwear.sliding.wear import coefficient

BODIES = {"punch": "", "strip": "_strip"}  # and how the names of their variables end
SHARES = {"worn_through_of_scar": "scar", "worn_through_of_surface": "surface"}


def of_body(body: str) -> dict[str, Variable]:
    """Return the variables of a coated body."""
    end = BODIES[body]
    left = f"coating of the {body} that is left at the end of the half-cycle"
    text = "share of the {}'s coated {} in which the coating is worn through at the end of the half-cycle"
    return {
        f"coating{end}": (("half_cycle", f"x{end}"), "mm", left),
        **{f"{name}{end}": (("half_cycle",), "1", text.format(body, of)) for name, of in SHARES.items()},
        f"least_coating{end}": (("half_cycle",), "mm", f"least {left}"),
    }


def variables(placed: ContactSetup) -> dict[str, Variable]:
    """Return the variables of coatings."""
    coated = zip(BODIES, placed.coatings, strict=True)
    return {name: one for body, own in coated if own.any() for name, one in of_body(body).items()}


def values(block: Block) -> dict[str, Array]:
    """Return them for each half-cycle of a block by name: (k,), and (k, n) along the contact."""
    pair, found = block.system.pair, dict[str, Array]()
    surfaces = ((pair.weights, block.wear), (pair.strip.weights, block.wear_strip))
    for end, thickness, (weights, depth) in zip(BODIES.values(), block.system.coatings, surfaces, strict=True):
        if thickness.any():
            coated, left = weights * (thickness > 0), left_of(thickness, depth)
            through = (depth >= thickness) @ coated
            scar = (depth > EDGE * depth.max(axis=1, keepdims=True)) @ coated
            found |= {f"coating{end}": left, f"least_coating{end}": left.min(axis=1)}
            found[f"worn_through_of_scar{end}"] = np.asarray(through / np.maximum(scar, 1e-300))
            found[f"worn_through_of_surface{end}"] = np.asarray(through / max(float(coated.sum()), 1e-300))
    return found


def worn_through(block: Block, before: RunState, known: Mapping[str, float]) -> dict[str, float]:
    """Return when and where coatings are worn through first in a run, and when last so far.

    Args:
        block: The half-cycles after those before.
        before: Where they begin.
        known: What of it was known before.
    """
    system, found = block.system, dict[str, float]()
    for row, (body, thickness) in enumerate(zip(BODIES, system.coatings, strict=True)):
        begun, own = ((before.worn.punch, block.wear), (before.worn.strip, block.wear_strip))[row]
        cycles = np.concatenate([[before.half_cycle], block.half_cycle])
        ended, at = _ends(_coated(system, body, thickness), np.vstack([begun, own]), cycles)
        if not ended.any():
            continue
        first, key = int(np.where(ended, at, np.inf).argmin()), f"{body}_coating_first_through"
        surface = system.pair.punch if row == 0 else system.pair.strip
        if f"{key}_half_cycle" not in known:
            names = (f"{key}_at_{axis}_mm" for axis in _axes(surface.dim))
            found |= {f"{key}_half_cycle": float(at[first]), **dict(zip(names, surface.x[first].tolist(), strict=True))}
        found[f"{body}_coating_last_through_half_cycle"] = float(np.where(ended, at, -np.inf).max())
    return found


def _axes(dim: int) -> tuple[str, ...]:
    return ("x", "z") if dim == 2 else ("x", "y", "z")


def _coated(system: ContactSetup, body: str, thickness: Array) -> CoatedBody:
    """Return a coating with the mean ratio of both coefficients at the start."""
    law = system.sliding.wear[list(BODIES).index(body)]
    above = law.of_coating
    if above is None:
        return CoatedBody(thickness, np.ones_like(thickness))
    conditions = system.conditions(0)
    base, coating = (coefficient(one, system.friction, conditions, f"wear.{body}").mean() for one in (law, above))
    return CoatedBody(thickness, np.full_like(thickness, base / coating))


def _ends(coated: CoatedBody, depths: Array, cycles: Array) -> tuple[Mask, Array]:
    """Return which coatings end within rows of depths (k, n), and after how many half-cycles (n,)."""
    ended: Mask = np.zeros(depths.shape[1], dtype=bool)
    at: Array = np.zeros(depths.shape[1])
    for k in range(len(depths) - 1):
        now = (depths[k] < coated.thickness) & (depths[k + 1] >= coated.thickness)
        left, grown = coated.thickness - depths[k], coated.measure(depths[k + 1]) - depths[k]
        share = np.divide(left, grown, out=np.ones_like(left), where=grown > 0)
        at = np.where(now, cycles[k] + share * (cycles[k + 1] - cycles[k]), at)
        ended |= now
    return ended, at
