"""The tables of what lies between the surfaces: debris that stays (the third body), and layers that give way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fenwear.case.creep import Creep
from fenwear.case.laws import Dependence, OfPlace, constant_or_dependence
from fenwear.case.quantities import Length, Number, Part, Stress, quantity

STIFFNESS, DENSITY = "MPa/mm", "1/mm^2"


class ThirdBody(Part):
    """Debris that stays between the surfaces as a layer of thickness t >= 0, until it is lost.

    Over the sliding distance s of a place, dt/ds = share * (worn depth of both bodies)' - t / life, and at the distance
    d from an edge of the contact - exp(-d / edge_length) t / edge_life besides: what is worn is kept in part, and lost
    as it slides. The gap is the worn one less t.
    """

    share: Annotated[Number, Field(ge=0, le=1)] = Field(
        description="of what both bodies lose at a place, by volume, that stays there as debris; the rest is ejected "
        "at once"
    )
    life: constant_or_dependence(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="sliding distance over which 1 - 1/e of what lies at a place is ejected; an expression, a table or "
        "a registered law of what coefficients may depend on, debris (its own thickness, mm) and edge among it: a law "
        "of loss, t / life over sliding distance"
    )
    edge_life: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="the same of what lies at an edge of the contact, where surfaces part or the punch's ends, besides "
        "life; by default edges lose as any place does",
    )
    edge_length: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="with edge_life: distance from the edge over which that loss falls e times"
    )
    initial: Annotated[Length, Field(ge=0)] = Field(
        default=0.0, description="thickness at the start, such as of a powder or a solid lubricant"
    )
    carried_by: str = Field(
        default="punch",
        description="body whose surface it lies on and moves with, by its name: on the strip it passes through the "
        "contact and comes back, or lies along a closed track",
    )

    @model_validator(mode="after")
    def _together(self) -> Self:
        if (self.edge_life is None) != (self.edge_length is None):
            missing, given = ("edge_length", "edge_life") if self.edge_length is None else ("edge_life", "edge_length")
            raise ValueError(f"{missing}: missing, but required with {given}")
        if isinstance(self.life, Dependence):
            if self.life.regions is not None:
                raise ValueError("life: expected an expression, a table or a law, got regions")
            try:
                self.life.scale("mm")
            except ValueError as error:
                raise ValueError(f"life: unit: {error}") from None
        return self

    def asks(self, name: str) -> bool:
        """Return whether the loss depends on a variable of coefficients."""
        by_edge = name == "edge" and self.edge_life is not None
        return by_edge or (isinstance(self.life, Dependence) and self.life.depends_on(name))

    @property
    def varies(self) -> bool:
        """Whether the loss changes with more than the place."""
        return self.edge_life is not None or (isinstance(self.life, Dependence) and self.life.varies)


class LinearLayer(OfPlace):
    """A layer that closes by p / stiffness, after Winkler."""

    kind: Literal["linear"] = Field(description="closes in proportion to the pressure")
    stiffness: constant_or_dependence(Annotated[float, *quantity(STIFFNESS), Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="pressure over closure"
    )
    creep: Creep | None = Field(default=None, description="growth of its closure under load; by default none")

    @classmethod
    def units(cls) -> Mapping[str, str]:
        """Return the units of what may depend on the place, by key."""
        return {"stiffness": STIFFNESS}


class PowerLayer(OfPlace):
    """A layer that closes by reference (p / pressure)^exponent, as ground joints of machine tools do."""

    kind: Literal["power"] = Field(description="closes by a power of the pressure")
    reference: constant_or_dependence(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="closure at the pressure"
    )
    pressure: constant_or_dependence(Annotated[Stress, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="that closes it by the reference"
    )
    exponent: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.5, description="of the pressure; 0.5 of ground joints"
    )

    @classmethod
    def units(cls) -> Mapping[str, str]:
        """Return the units of what may depend on the place, by key."""
        return {"reference": "mm", "pressure": "MPa"}


class ExponentialLayer(OfPlace):
    """A layer whose pressure grows by p = pressure (exp(closure / length) - 1)."""

    kind: Literal["exponential"] = Field(description="its pressure grows by an exponential of the closure")
    length: constant_or_dependence(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="closure by which the pressure grows e times, as of rough surfaces: 0.3 to 0.5 of their rms height"
    )
    pressure: constant_or_dependence(Annotated[Stress, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="scale of the pressure, reached at 0.69 lengths"
    )

    @classmethod
    def units(cls) -> Mapping[str, str]:
        """Return the units of what may depend on the place, by key."""
        return {"length": "mm", "pressure": "MPa"}


class RoughLayer(OfPlace):
    """Rough surfaces after Greenwood and Williamson: round asperities of one radius and Gaussian heights."""

    kind: Literal["rough"] = Field(description="asperities after Greenwood and Williamson")
    roughness: constant_or_dependence(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="Sa of both surfaces together, the root of the sum of both squares; their rms height is 1.2533 Sa"
    )
    asperity_radius: constant_or_dependence(Annotated[Length, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="mean radius of the asperities' tips"
    )
    asperity_density: constant_or_dependence(  # type: ignore[valid-type]
        Annotated[float, *quantity(DENSITY), Field(gt=0)]
    ) = Field(description="asperities on an area")
    modulus: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None, description="E* of the asperities; by default that of the materials at the contact"
    )

    @classmethod
    def units(cls) -> Mapping[str, str]:
        """Return the units of what may depend on the place, by key."""
        return {"roughness": "mm", "asperity_radius": "mm", "asperity_density": DENSITY}


Layers = LinearLayer | PowerLayer | ExponentialLayer | RoughLayer


def place_values(value: Any, place: Mapping[str, Any], n: int, unit: str, key: str, least: float = 1e-300) -> Any:
    """Return a constant or what depends on the place at n nodes (n,), in a unit.

    Raises:
        CaseError: it is less than `least` somewhere, by default not positive; names the key.
    """
    import numpy as np

    if isinstance(value, Dependence):
        return value.values(place, (n,), value.scale(unit), key, least)
    return np.full(n, float(value))
