"""Heat conduction of a material in UFL: Fourier's law, with a scalar or a tensor for the conductivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import ufl
from dolfinx import fem

from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.elastic_material import Property, region_field
from fenwear.case import Material
from fenwear.common.arrays import Array


@dataclass(frozen=True)
class ConductionLaw:
    """Fourier's law, q = -k grad theta, and the heat that a material stores.

    Attributes:
        conductivity: k, a scalar or a symmetric tensor (d, d) of UFL, N/(s K): the number of W/(m K).
        capacity: rho c, of a volume, N/(mm² K).
    """

    conductivity: Any
    capacity: Any

    def flux(self, theta: Any) -> Any:
        """Return q = -k grad theta, mW/mm²."""
        conductivity = ufl.as_ufl(self.conductivity)
        return -ufl.dot(conductivity, ufl.grad(theta)) if conductivity.ufl_shape else -conductivity * ufl.grad(theta)

    @property
    def diffusivity(self) -> Any:
        """The mean of k / (rho c) over the directions, mm²/s."""
        conductivity = ufl.as_ufl(self.conductivity)
        shape = conductivity.ufl_shape
        return (ufl.tr(conductivity) / shape[0] if shape else conductivity) / self.capacity


def isotropic_conduction(
    body: BodyMesh, regions: Mapping[str, str], materials: Mapping[str, Material], theta: fem.Function | None = None
) -> ConductionLaw:
    """Return the conduction law of a body's regions.

    Args:
        body: The body.
        regions: Name of the material of each region.
        materials: By their names; with constants alone where no temperature is given.
        theta: Temperature that the properties are taken at, K.

    Raises:
        CaseError: a property is not positive at a temperature.
    """
    conductivity: dict[str, Property] = {}
    capacity: dict[str, Property] = {}
    for region, name in regions.items():
        m, key = materials[name], f"materials.{name}"
        depends = m.dependent if theta is not None else []
        conductivity[region] = (
            partial(m.values, "conductivity", key=key) if "conductivity" in depends else m.conductivity or 0.0
        )
        capacity[region] = (
            partial(_capacity, m, key) if "heat_capacity" in depends else (m.density or 0.0) * (m.heat_capacity or 0.0)
        )
    return ConductionLaw(region_field(body, conductivity, theta), region_field(body, capacity, theta))


def _capacity(material: Material, key: str, theta: Array) -> Array:
    """Return rho c at temperatures (n,), N/(mm² K)."""
    return (material.density or 0.0) * material.values("heat_capacity", theta, key)
