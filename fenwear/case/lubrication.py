"""The table of mixed lubrication: the share of the load that asperities carry, and the friction of the fluid."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from fenwear.case.dependence import VARIABLES
from fenwear.case.laws import Dependence, constant_or_dependence
from fenwear.case.quantities import Length, Number, Part

_Share = Annotated[Number, Field(ge=0, le=1)] | None
_Film = Annotated[Length, Field(gt=0)] | None
OF = ("T", "p", "v", "x", "y", "z")  # what share and film may depend on


class Lubrication(Part):
    """Mixed lubrication: asperities carry a share of the pressure, by which they wear, and the fluid the rest.

    The share is given as a law of speed, pressure and temperature, or over lambda, film thickness over roughness.
    """

    asperity_share: constant_or_dependence(_Share) = Field(  # type: ignore[valid-type]
        default=None, description="of the pressure that asperities carry, from 0 to 1: of p, v, T and the place"
    )
    film: constant_or_dependence(_Film) = Field(  # type: ignore[valid-type]
        default=None, description="film thickness of p, v, T and the place, in place of asperity_share"
    )
    roughness: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="rms height of both surfaces together, with film: lambda = film / roughness"
    )
    share_over_lambda: tuple[tuple[Number, Annotated[Number, Field(ge=0, le=1)]], ...] | None = Field(
        default=None, description="[lambda, share] pairs with straight lines between, with film"
    )
    fluid_friction: Annotated[Number, Field(ge=0)] = Field(
        default=0.0, description="coefficient of friction of the fluid; contact.friction is that of the asperities"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.asperity_share is None) == (self.film is None):
            raise ValueError("give one of asperity_share and film")
        if any((self.film is None) != (one is None) for one in (self.roughness, self.share_over_lambda)):
            raise ValueError("film: expected together with roughness and share_over_lambda")
        if self.share_over_lambda is not None:
            arguments = [argument for argument, _ in self.share_over_lambda]
            if len(arguments) < 2 or np.any(np.diff(arguments) <= 0):
                raise ValueError("share_over_lambda: expected at least two pairs [lambda, share] with rising lambda")
        for key, unit in (("asperity_share", ""), ("film", "mm")):
            value = getattr(self, key)
            if not isinstance(value, Dependence):
                continue
            other = [one for one in VARIABLES if one not in OF and value.depends_on(one)]
            if other or value.regions is not None or value.law is not None:
                got = other[0] if other else "regions" if value.regions is not None else "a law"
                raise ValueError(f"{key}: expected an expression or a table of p, v, T, x, y and z alone, got {got}")
            if unit == "" and value.unit:
                raise ValueError(f"{key}: expected no unit: its values are pure numbers, got {value.unit!r}")
            try:
                value.scale(unit or "1")
            except ValueError as error:
                raise ValueError(f"{key}: unit: {error}") from None
        return self

    @property
    def given(self) -> tuple[str, float | Dependence]:
        """What tells the share, with its key."""
        if self.film is not None:
            return "film", self.film
        return "asperity_share", self.asperity_share or 0.0

    @property
    def uniform_share(self) -> float | None:
        """The share where it is one number; None where it depends on anything."""
        name, value = self.given
        if isinstance(value, Dependence):
            return None
        if name == "film" and self.share_over_lambda is not None:
            return float(np.interp(value / (self.roughness or 1.0), *np.array(self.share_over_lambda).T))
        return value

    @property
    def varies(self) -> bool:
        """Whether the share changes with more than the place."""
        value = self.given[1]
        return isinstance(value, Dependence) and value.varies
