"""Linear-elastic materials in UFL: the stress of a displacement and of a temperature, in every model.

Plane models lie in (x, z), axisymmetric ones in (r, z) with r at x; a solid has x, y and z. Volumes
and surfaces of a plane model are per thickness, those of an axisymmetric one are the whole ring's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh

from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.case import Kind, Material
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError


def strain(u: Any) -> Any:
    """Return eps(u) = (grad u + grad u^T) / 2."""
    return ufl.sym(ufl.grad(u))


def ring_strain(u: Any) -> Any:
    """Return eps(u) of an axisymmetric displacement (u_r, u_z), in r, the circumference and z: eps_tt = u_r / r."""
    r = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(u))[0]
    plane = strain(u)
    return ufl.as_matrix(
        ((plane[0, 0], 0, plane[0, 1]), (0, u[0] / r, 0), (plane[1, 0], 0, plane[1, 1])),
    )


def lame(young: Any, poisson: Any, plane: Kind) -> tuple[Any, Any]:
    """Return Lame's lambda and mu of the model, MPa.

    In plane stress lambda is 2 lambda mu / (lambda + 2 mu), so that sigma_yy = 0.
    """
    mu = young / (2 * (1 + poisson))
    if plane == "stress":
        return young * poisson / (1 - poisson**2), mu
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu


def stress(eps: Any, lmbda: Any, mu: Any) -> Any:
    """Return sigma = lambda tr(eps) I + 2 mu eps, MPa."""
    return lmbda * ufl.tr(eps) * ufl.Identity(eps.ufl_shape[0]) + 2 * mu * eps


class ElasticLaw(Protocol):
    """The response of a body to a displacement and to a temperature, linear in both, in UFL.

    Attributes:
        kind: The model that it belongs to: it gives the strain, the rigid modes and the measure of volumes.
    """

    @property
    def kind(self) -> Kind:
        """The model that it belongs to."""

    def stress(self, u: Any) -> Any:
        """Return the stress of a displacement, MPa, of the strain's shape; linear in grad u."""

    def thermal_stress(self, theta: Any) -> Any:
        """Return the stress that holds back the free expansion of a change of temperature, MPa; linear in theta."""

    def stress_out_of_plane(self, u: Any, theta: Any) -> Any:
        """Return sigma_yy of a plane model at a change of temperature, None for none, MPa."""

    @property
    def shear_modulus(self) -> Any:
        """G of shear out of a plane, MPa."""


def strain_of(u: Any, kind: Kind) -> Any:
    """Return the strain of a displacement in a model."""
    return ring_strain(u) if kind == "axisymmetric" else strain(u)


def measure(mesh: Mesh, kind: Kind) -> Any:
    """Return the measure of one unit of the mesh's volume: the circumference 2 pi r, or 1."""
    return 2 * ufl.pi * ufl.SpatialCoordinate(mesh)[0] if kind == "axisymmetric" else ufl.as_ufl(1.0)


@dataclass(frozen=True)
class Isotropic:
    """Hooke's law with thermal expansion, in one of the models.

    Attributes:
        kind: Of the model.
        lame: lambda and mu of the model, fields or numbers, MPa.
        thermal_modulus: gamma, the stress that holds back each kelvin, MPa/K: E alpha / (1 - nu) in
            plane stress, else E alpha / (1 - 2 nu).
    """

    kind: Kind
    lame: tuple[Any, Any]
    thermal_modulus: Any = 0.0

    def stress(self, u: Any) -> Any:
        """Return lambda tr(eps) I + 2 mu eps, MPa."""
        return stress(strain_of(u, self.kind), *self.lame)

    def thermal_stress(self, theta: Any) -> Any:
        """Return gamma theta I, MPa."""
        dim = 2 if self.kind in ("stress", "strain") else 3
        return self.thermal_modulus * theta * ufl.Identity(dim)

    def stress_out_of_plane(self, u: Any, theta: Any) -> Any:
        """Return sigma_yy: zero in plane stress, in plane strain from eps_yy = 0."""
        if self.kind == "stress":
            return ufl.as_ufl(0.0)
        thermal = 0.0 if theta is None else self.thermal_modulus * theta
        return self.lame[0] * ufl.tr(strain(u)) - thermal

    @property
    def shear_modulus(self) -> Any:
        """Lame's mu, MPa."""
        return self.lame[1]


@dataclass(frozen=True)
class OwnLaw:
    """A user's own law: any stress in UFL that is linear in grad u, such as an anisotropic one.

    Attributes:
        kind: Of the model.
        of_displacement: sigma(u), MPa, of the strain's shape.
        of_temperature: The stress that holds back the expansion by a change of temperature, MPa; None for none.
        out_of_plane: sigma_yy(u, theta) of a plane model, for von Mises' stress; by default zero.
        shear_modulus: G of shear out of a plane, MPa; needed where a traction acts along y.
    """

    kind: Kind
    of_displacement: Callable[[Any], Any]
    of_temperature: Callable[[Any], Any] | None = None
    out_of_plane: Callable[[Any, Any], Any] | None = None
    shear_modulus: Any = None

    def stress(self, u: Any) -> Any:
        """Return sigma(u), MPa."""
        return self.of_displacement(u)

    def thermal_stress(self, theta: Any) -> Any:
        """Return the stress that holds back the expansion, MPa."""
        dim = 2 if self.kind in ("stress", "strain") else 3
        return 0.0 * theta * ufl.Identity(dim) if self.of_temperature is None else self.of_temperature(theta)

    def stress_out_of_plane(self, u: Any, theta: Any) -> Any:
        """Return sigma_yy, MPa."""
        return ufl.as_ufl(0.0) if self.out_of_plane is None else self.out_of_plane(u, theta)


# A property of a region: its value, or its values at temperatures (n,).
Property = float | Callable[[Array], Array]


def region_field(body: BodyMesh, values: Mapping[str, Property], theta: fem.Function | None = None) -> fem.Function:
    """Return the field of a property: constant on each material region, or a function of the temperature; collective.

    Args:
        body: The body.
        values: The property on each region, by its name.
        theta: The temperature, K, whose nodes in each cell the field then has; needed where a property is a function.

    Raises:
        CaseError: a value that a temperature gives is none; on every rank.
    """
    warm = theta is not None and any(callable(value) for value in values.values())
    element = ("DG", 0) if theta is None or not warm else _broken(theta)
    field = fem.Function(fem.functionspace(body.mesh, element))
    if theta is not None and warm:
        field.interpolate(theta)
    dofs, problem = field.function_space.dofmap.list, None
    for region, value in values.items():
        of_region = np.unique(dofs[body.cell_tags.find(body.regions[region])])
        try:
            field.x.array[of_region] = value(field.x.array[of_region]) if callable(value) else value
        except CaseError as error:  # raised below, on all ranks
            problem = error
    errors = [raised for raised in body.mesh.comm.allgather(problem) if raised is not None] if warm else []
    if errors:
        raise errors[0]
    field.x.scatter_forward()
    return field


def nodal_function(body: BodyMesh, degree: int, values: Array) -> fem.Function:
    """Return the scalar function of values at this rank's own nodes (owned,); collective."""
    space = fem.functionspace(body.mesh, basix.ufl.element("Lagrange", body.mesh.basix_cell(), degree))
    function = fem.Function(space)
    function.x.array[: len(values)] = values
    function.x.scatter_forward()
    return function


def _broken(theta: fem.Function) -> Any:
    """Return the element of a temperature without continuity between the cells: regions meet at their faces."""
    space = theta.function_space
    cell, degree = space.mesh.basix_cell(), space.ufl_element().degree
    return basix.ufl.element("Lagrange", cell, degree, discontinuous=True)


def isotropic(
    body: BodyMesh,
    regions: Mapping[str, str],
    materials: Mapping[str, Material],
    kind: Kind,
    theta: fem.Function | None = None,
) -> Isotropic:
    """Return the isotropic law of a body's regions.

    Args:
        body: The body.
        regions: Name of the material of each region.
        materials: By their names; with constants alone where no temperature is given.
        kind: Of the model.
        theta: Temperature that the properties are taken at, K.

    Raises:
        CaseError: an unknown region, or one without a material.
    """
    _check_regions(body, regions)
    held = 1 if kind == "stress" else 2
    young: dict[str, Property] = {}
    modulus: dict[str, Property] = {}
    for region, name in regions.items():
        m, key = materials[name], f"materials.{name}"
        depends = set(m.dependent) if theta is not None else set()
        young[region] = partial(m.values, "young", key=key) if "young" in depends else m.young
        if depends & {"young", "expansion"}:
            modulus[region] = partial(_thermal_modulus, m, held, key)
        else:
            modulus[region] = m.young * (m.expansion or 0.0) / (1 - held * m.poisson)
    poisson = region_field(body, {region: materials[name].poisson for region, name in regions.items()})
    return Isotropic(kind, lame(region_field(body, young, theta), poisson, kind), region_field(body, modulus, theta))


def _thermal_modulus(material: Material, held: int, key: str, theta: Array) -> Array:
    """Return E alpha / (1 - nu), or / (1 - 2 nu), at temperatures (n,), MPa/K."""
    young, expansion = (material.values(name, theta, key) for name in ("young", "expansion"))
    return np.asarray(young * expansion / (1 - held * material.poisson), dtype=np.float64)


def _check_regions(body: BodyMesh, regions: Mapping[str, str]) -> None:
    problems = [
        InputError(
            f"{body.name}.regions.{name}",
            f"no physical surface of that name; the geometry has {', '.join(body.regions)}",
        )
        for name in regions
        if name not in body.regions
    ] + [
        InputError(f"{body.name}.regions", f"no material for the physical surface {name!r}")
        for name in body.regions
        if name not in regions
    ]
    if problems:
        raise CaseError(problems)
