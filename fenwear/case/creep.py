"""The table of creep: the compliance of a body or of a layer that grows under load as time passes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from fenwear.case.quantities import Number, Part, Time


class Retarded(Part):
    """One term of the compliance, compliance (1 - exp(-t / time)), a spring and a dashpot side by side (Kelvin)."""

    compliance: Annotated[Number, Field(ge=0)] = Field(description="that it comes to in the end, over the one at once")
    time: Annotated[Time, Field(gt=0)] = Field(description="retardation time, after which 1 - 1/e of it is there")


class Creep(Part):
    """Creep at a constant Poisson's ratio: strain under a constant load grows as J(t) / J(0).

    J(t) / J(0) = 1 + sum of compliance (1 - exp(-t / time)) + per_decade log10(1 + t / onset).
    """

    terms: tuple[Retarded, ...] = Field(default=(), description="terms that each come to an end (Prony's series)")
    per_decade: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="growth for each decade of time, over the compliance at once, without an end"
    )
    onset: Annotated[Time, Field(gt=0)] | None = Field(
        default=None, description="time from which on it grows with the logarithm of time, with per_decade"
    )

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.terms and self.per_decade is None:
            raise ValueError("expected terms, or per_decade with an onset")
        if (self.per_decade is None) != (self.onset is None):
            raise ValueError("onset: expected together with per_decade, and only then")
        return self


def creep_problems(bodies: Mapping[str, Any], layer: Any, *, passes_on: bool) -> list[str]:
    """Return what does not go with creep.

    Args:
        bodies: Punch and strip.
        layer: Of the contact; None without.
        passes_on: Whether the strip's material passes under the punch and does not come back.
    """
    given = {f"{name}.creep": body.creep for name, body in bodies.items()}
    creeps = [key for key, creep in {**given, "contact.layer.creep": getattr(layer, "creep", None)}.items() if creep]
    problems = []
    if "strip.creep" in creeps and passes_on:
        problems.append(
            "strip.creep: expected a motion to and fro: sliding one way, what has crept leaves the contact, and other "
            "material comes in that has not"
        )
    return problems
