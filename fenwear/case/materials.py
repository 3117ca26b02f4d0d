"""The table of a material: constants, or properties that depend on the temperature."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from fenwear.arrays import Array
from fenwear.case.dependence import VARIABLES
from fenwear.case.laws import Dependence, constant_or_dependence
from fenwear.case.quantities import Number, Part, Stress, quantity

PROPERTIES = {  # of a material, that may depend on the temperature, with their units
    "young": "MPa",
    "conductivity": "N/(s*K)",
    "heat_capacity": "mm^2/(s^2*K)",
    "expansion": "1/K",
}
# Beyond 1e12, far above any material, what a body stores is lost in rounding beside what it conducts.
_Conductivity = Annotated[float, *quantity("N/(s*K)"), Field(gt=0, le=1e12)] | None
_HeatCapacity = Annotated[float, *quantity("mm^2/(s^2*K)"), Field(gt=0)] | None
_Expansion = Annotated[float, *quantity("1/K")] | None


class Material(Part):
    """An isotropic, linear-elastic material; the thermal values are needed with heat only.

    All but nu and rho may depend on the temperature T, by an expression or a table.
    """

    young: constant_or_dependence(Annotated[Stress, Field(gt=0)]) = Field(  # type: ignore[valid-type]
        description="Young's modulus E"
    )
    poisson: Annotated[Number, Field(gt=-1, le=0.5)] = Field(description="Poisson's ratio nu")
    conductivity: constant_or_dependence(_Conductivity) = Field(  # type: ignore[valid-type]
        default=None, description="thermal conductivity k; 1 W/(m K) = 1"
    )
    heat_capacity: constant_or_dependence(_HeatCapacity) = Field(  # type: ignore[valid-type]
        default=None, description="c; 1 J/(kg K) = 1e6: better give the unit"
    )
    density: Annotated[float, *quantity("N*s^2/mm^4"), Field(gt=0)] | None = Field(
        default=None, description="rho; 1 kg/m³ = 1e-12: better give the unit"
    )
    expansion: constant_or_dependence(_Expansion) = Field(  # type: ignore[valid-type]
        default=None,
        description="linear thermal expansion alpha; where it depends on T, the mean from heat.initial to T",
    )

    yield_stress: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None, description="in tension; where it is given pressures beyond the shakedown limit are told"
    )

    @model_validator(mode="after")
    def _of_temperature_alone(self) -> Self:
        for name in self.dependent:
            value = getattr(self, name)
            others = [one for one in VARIABLES if one != "T" and value.depends_on(one)]
            if others or value.regions is not None:
                got = "regions" if value.regions is not None else others[0]
                raise ValueError(f"{name}: expected an expression or a table of the temperature T alone, got {got}")
            try:
                value.scale(PROPERTIES[name])
            except ValueError as error:
                raise ValueError(f"{name}: unit: {error}") from None
        return self

    @property
    def dependent(self) -> list[str]:
        """Names of the properties that depend on the temperature."""
        return [name for name in PROPERTIES if isinstance(getattr(self, name), Dependence)]

    def at(self, temperature: float, key: str = "materials") -> Material:
        """Return the material as it is at one temperature, K, with constants.

        Raises:
            CaseError: a property is not finite there, or not positive; `key` is the material's.
        """
        found = {name: float(self.values(name, np.array([temperature]), key)[0]) for name in self.dependent}
        return self.model_copy(update=found) if found else self

    def values(self, name: str, temperature: Array, key: str) -> Array:
        """Return a property at temperatures (n,), 0 where it is not given.

        Raises:
            CaseError: as `at`.
        """
        value = getattr(self, name)
        if not isinstance(value, Dependence):
            return np.full(temperature.shape, value or 0.0)
        least = -np.inf if name == "expansion" else np.nextafter(0.0, 1.0)
        return value.values(
            {"T": temperature}, temperature.shape, value.scale(PROPERTIES[name]), f"{key}.{name}", least
        )
