"""The tables of a material: constants, or properties that depend on the temperature; and creep."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fenwear.case.table_parts import Check, Number, Part, Stress, Time, quantity
from fenwear.case.wear_table import Dependence, constant_or_dependence
from fenwear.common.arrays import Array

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


def _of_temperature(constant: Any, name: str) -> Any:
    """Return the type of a property that is a constant, or depends on the temperature alone."""
    return constant_or_dependence(constant, PROPERTIES[name], ("T",), ("expression", "table", "law"))


class Material(Part):
    """An isotropic, linear-elastic material; the thermal values are needed with heat only.

    All but nu and rho may depend on the temperature T, by an expression or a table.
    """

    young: _of_temperature(Annotated[Stress, Field(gt=0)], "young") = Field(  # type: ignore[valid-type]
        description="Young's modulus E"
    )
    poisson: Annotated[Number, Field(gt=-1, le=0.5)] = Field(description="Poisson's ratio nu")
    conductivity: _of_temperature(_Conductivity, "conductivity") = Field(  # type: ignore[valid-type]
        default=None, description="thermal conductivity k; 1 W/(m K) = 1"
    )
    heat_capacity: _of_temperature(_HeatCapacity, "heat_capacity") = Field(  # type: ignore[valid-type]
        default=None, description="specific heat capacity c; 1 J/(kg K) = 1e6: better give the unit"
    )
    density: Annotated[float, *quantity("N*s^2/mm^4"), Field(gt=0)] | None = Field(
        default=None, description="density rho; 1 kg/m³ = 1e-12: better give the unit"
    )
    expansion: _of_temperature(_Expansion, "expansion") = Field(  # type: ignore[valid-type]
        default=None,
        description="linear thermal expansion alpha; where it depends on T, the mean from heat.initial to T",
    )

    yield_stress: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None,
        description="yield stress in tension; with it commands report pressures beyond the shakedown limit",
    )

    @property
    def dependent(self) -> list[str]:
        """Names of the properties that depend on the temperature."""
        return [name for name in PROPERTIES if isinstance(getattr(self, name), Dependence)]

    def at(self, temperature: float, key: str = "materials") -> Material:
        """Return the material as it is at one temperature, K, with constants.

        Raises:
            CaseError: a property is not finite there, or not positive; `key` is the material's.
        """
        material = {name: float(self.values(name, np.array([temperature]), key)[0]) for name in self.dependent}
        return self.model_copy(update=material) if material else self

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


class Retarded(Part):
    """One term of the compliance, compliance (1 - exp(-t / time)), a spring and a dashpot side by side (Kelvin)."""

    compliance: Annotated[Number, Field(ge=0)] = Field(
        description="final growth of the compliance, over the instantaneous compliance"
    )
    time: Annotated[Time, Field(gt=0)] = Field(
        description="retardation time, after which 1 - 1/e of the growth has occurred"
    )


class Creep(Part):
    """Creep at a constant Poisson's ratio: strain under a constant load grows as J(t) / J(0).

    J(t) / J(0) = 1 + sum of compliance (1 - exp(-t / time)) + per_decade log10(1 + t / onset).
    """

    terms: tuple[Retarded, ...] = Field(default=(), description="terms of bounded growth (Prony's series)")
    per_decade: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="growth for each decade of time, over the instantaneous compliance, without a bound"
    )
    onset: Annotated[Time, Field(gt=0)] | None = Field(
        default=None, description="time after which it grows with the logarithm of time, with per_decade"
    )

    together = (("per_decade", "onset"),)
    checks = (
        Check(lambda s: not s.terms and not s.present("per_decade"), "expected terms, or per_decade with an onset"),
    )
