"""Heat conduction of a material in UFL: Fourier's law, with a scalar or a tensor for the conductivity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from fenwear.bodies.material import region_field
from fenwear.bodies.mesh import BodyMesh
from fenwear.case import Material


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


def isotropic_conduction(body: BodyMesh, regions: dict[str, str], materials: dict[str, Material]) -> ConductionLaw:
    """Return the conduction law of a body's regions.

    Args:
        body: The body.
        regions: Name of the material of each region.
        materials: By their names.
    """
    of_region = {region: materials[name] for region, name in regions.items()}
    capacity = {r: (m.density or 0.0) * (m.heat_capacity or 0.0) for r, m in of_region.items()}
    return ConductionLaw(
        region_field(body, {r: m.conductivity or 0.0 for r, m in of_region.items()}), region_field(body, capacity)
    )
