"""Steps, bases and elements of the heat that are too coarse for what the case asks of them."""

from __future__ import annotations

from fenwear.assembly import Tribosystem
from fenwear.plausibility.layer import layer_warnings


def fineness_text(system: Tribosystem) -> str:
    """Return how fine the steps and bases of the heat are, "" without heat."""
    found = None if system.exchange is None else system.exchange.fineness
    if found is None:
        return ""
    told = [f"heat: {found.steps} steps in a half-cycle"]
    if found.change is not None:
        told.append(f"halving them changes contact temperatures by {found.change:.2g}")
    if found.difference is not None:
        told.append(f"contact temperatures and thermal gap are those of the whole mesh to {found.difference:.2g}")
    return "; ".join(told)


def fineness_warnings(system: Tribosystem) -> list[str]:
    """Say where halving the steps, or the whole mesh in place of the basis, changes more than the tolerances.

    And where elements are thicker than the layer that heats up, see `layer_warnings`; collective.
    """
    return list(fineness_remarks(system).values())


def fineness_remarks(system: Tribosystem) -> dict[str, str]:
    """Return the same, each by its kind; collective."""
    told = {f"layer {number}": text for number, text in enumerate(layer_warnings(system))}
    heat, found = system.heat, None if system.exchange is None else system.exchange.fineness
    if heat is None or found is None:
        return told
    if found.change is not None and found.change > heat.step_tolerance:
        told["steps"] = (
            f"heat: halving the {found.steps} steps of a half-cycle would change contact temperatures by "
            f"{found.change:.2g}, more than heat.step_tolerance = {heat.step_tolerance:g}; expected more heat.steps"
        )
    if found.difference is not None and found.difference > heat.reduction_difference:
        told["basis"] = (
            f"heat: contact temperatures or thermal gap differ from those of the whole mesh by {found.difference:.2g}, "
            f"more than heat.reduction_difference = {heat.reduction_difference:g}; expected a lower "
            "heat.reduction_tolerance"
        )
    return told
