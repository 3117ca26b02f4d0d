"""Both bodies on their meshes: elasticity, and conduction with heat.

Whether coatings fit on their bodies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from mpi4py import MPI

from fenwear.bodies.contact_surface import ContactSurface, profiled
from fenwear.bodies.distributed_mesh import BodyMesh, build_meshes
from fenwear.bodies.elastic_material import isotropic, nodal_function
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.material_regions import contact_density, contact_regions
from fenwear.bodies.surface_operators import check_operators
from fenwear.bodies.worn_mesh import element_height, follow_wear, movable_surface
from fenwear.case import Body, Case
from fenwear.case.body_names import ROLES, with_body_names
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import release
from fenwear.heat.conduction import HeatBody
from fenwear.heat.fourier_law import ConductionLaw, isotropic_conduction
from fenwear.laws.coating import coating_thickness, coatings_of
from fenwear.laws.friction import regions_opposite
from fenwear.laws.local_laws import LocalLaws
from fenwear.laws.wear import WornDepths
from fenwear.surfaces import ContactPair, pair
from fenwear.surfaces.contact_edges import Edges
from fenwear.system.contact_grids import lay_grids
from fenwear.system.strokes import Sliding, make_sliding

ALL_WAYS = 0.1  # mean of the unit normals of a surface below which it looks all ways, as a bore does


def check_coatings(case: Case, punch: ElasticBody, strip: ElasticBody) -> None:
    """Make sure that coatings are no thicker than their bodies, at any place; collective.

    Raises:
        CaseError: one is, or it is negative somewhere.
    """
    for body, law, elastic in zip(ROLES, case.wear.of_bodies, (punch, strip), strict=True):
        thickness = coating_thickness(law, elastic.surface.unworn, body)
        there, thickest = _height(elastic), float(thickness.max(initial=0.0))
        if thickest >= there:
            message = f"expected less than the body, which is {there:.4g} mm thick, got {thickest:.4g} mm"
            raise CaseError(InputError(f"wear.{body}.coating.thickness", message))


def _height(elastic: ElasticBody) -> float:
    """Return the height of a body along the mean normal of its contact surface, mm; collective."""
    surface, mesh = elastic.surface, elastic.body.mesh
    x = mesh.geometry.x[:, : mesh.geometry.dim]
    normal = surface.weights @ surface.outward / surface.weights.sum()
    size = float(np.linalg.norm(normal))
    along = x @ (normal / size)[:, None] if size > ALL_WAYS else x
    sides = [
        mesh.comm.allreduce(float(coordinate.max(initial=-np.inf)), MPI.MAX)
        - mesh.comm.allreduce(float(coordinate.min(initial=np.inf)), MPI.MIN)
        for coordinate in along.T
    ]
    return max(sides)


FLAT = 1e-6  # of the contact: what lies in a plane
SWALLOWED = 0.2  # of a load: nodes at the end of its group that a support beside it holds may take less of it
TILTED = 4.0  # times Sq: how much a rough surface may rise from end to end


@dataclass(frozen=True)
class Bodies:
    """Both bodies on their meshes, under the mean of their loads.

    Attributes:
        punch, strip: Elasticity.
        heat: Conduction in both; none without heat.
        followed: Worn depths that the meshes follow; None where they are as they were made.
        moved: Displacements of the contact nodes for it.
        regions: Shares of the material regions in the contact nodes of punch and strip, by their names.
        densities: At the pressure nodes of punch and strip, N s²/mm⁴; None where it is not given.
        warmed: Temperatures of this rank's own nodes of both that the materials' properties are taken at (owned,)
            each, K; None for the initial temperature.
    """

    punch: ElasticBody
    strip: ElasticBody
    heat: tuple[HeatBody, ...] = ()
    followed: WornDepths | None = None
    moved: WornDepths | None = None
    regions: tuple[Mapping[str, Array], Mapping[str, Array]] = field(default_factory=lambda: ({}, {}))
    densities: tuple[Array | None, Array | None] = (None, None)
    warmed: tuple[Array, Array] | None = None

    @property
    def comm(self) -> MPI.Comm:
        """The ranks."""
        return self.punch.body.mesh.comm

    @property
    def unknowns(self) -> int:
        """Number of degrees of freedom of both displacements."""
        return self.punch.size + self.strip.size

    @property
    def solved_by(self) -> list[str]:
        """The operators that contacts decided on, in words."""
        return [body.taken for body in (self.punch, self.strip) if body.taken]

    @property
    def last_resorts(self) -> list[str]:
        """Warnings of elements of a poor kind."""
        return [
            f"geometry.degree: the {body.body.name} has tetrahedra of degree 1. They are too stiff: "
            "pressures of a small contact are wrong by a sixth. Set geometry.degree = 2, or mesh with hexahedra"
            for body in (self.punch, self.strip)
            if body.surface.cell == "triangle" and body.surface.degree == 1
        ]

    @property
    def remarks(self) -> list[str]:
        """Warnings of the bodies before anything is computed with them."""
        return [*self.last_resorts, *self.swallowed_loads, *self.tilted_maps]

    @property
    def tilted_maps(self) -> list[str]:
        """Warnings of rough surfaces whose tilt is higher than their roughness."""
        texts = []
        for body in (self.punch, self.strip):
            heights, grid = body.surface.heights, body.surface.grid
            if grid is None or not heights.any():
                continue
            plane = np.column_stack([np.ones(len(heights)), grid.flat - grid.flat.mean(axis=0)])
            fitted = np.linalg.lstsq(plane, heights, rcond=None)[0]
            rise, rough = np.ptp(plane @ fitted), np.sqrt(np.mean((heights - plane @ fitted) ** 2))
            if rise > TILTED * rough and rise > 0:
                slope = 1e3 * float(np.linalg.norm(fitted[1:]))
                texts.append(
                    f"{body.body.name}.topography: the map is tilted by {slope:.2g} mrad. One end lies "
                    f"{1e3 * rise:.3g} µm higher, where Sq is {1e3 * rough:.3g} µm, which moves the contact. "
                    "Set level = 'plane'."
                )
        return texts

    @property
    def swallowed_loads(self) -> list[str]:
        """Warnings of loads where supports hold the motion that they push: nothing else feels them."""
        texts = []
        for body in (self.punch, self.strip):
            least = max(np.abs(body.given).max(initial=0.0), SWALLOWED * body.acting)
            lost = np.abs(body.swallowed) > SWALLOWED * least
            names = ("x", "z") if body.dim == 2 else ("x", "y", "z")
            parts = [
                f"{lost_force:.4g} of {force:.4g} N along {axis}"
                for axis, force, lost_force, is_lost in zip(names, body.given, body.swallowed, lost, strict=True)
                if is_lost
            ]
            if parts:
                texts.append(
                    f"{body.body.name}.loads: {' and '.join(parts)} act where supports hold this motion, so the "
                    "contact does not carry them. Load a group that is free to move that way"
                )
        return texts

    @cached_property
    def element_heights(self) -> WornDepths:
        """Height of the elements at the contact nodes of both bodies, mm; collective at first."""
        return WornDepths(element_height(self.punch), element_height(self.strip))

    def wear_on_meshes(self, worn: WornDepths, case: Case) -> float:
        """Return the largest wear since the meshes were moved over that from which on they follow; 0 where none do.

        Args:
            worn: Depths.
            case: The problem.
        """
        limit = case.geometry.follow_wear
        if limit is None or self.punch.surface.grid is not None:  # nothing of a grid's wear is the mesh's
            return 0.0
        heights, rest = self.element_heights, worn if self.followed is None else worn - self.followed
        pairs = ((rest.punch, heights.punch), (rest.strip, heights.strip))
        return max(float((np.abs(depth) / (limit * height)).max(initial=0.0)) for depth, height in pairs)

    def under(self, case: Case, fraction: float | None = None) -> Bodies:
        """Return the bodies under the loads of a case at a fraction of the cycle, or their mean; collective."""
        punch, strip = (
            body.with_loads(
                [load.mean() if fraction is None else load.at(fraction) for load in case.loads_of(body.body.name)]
            )
            for body in (self.punch, self.strip)
        )
        return replace(self, punch=punch, strip=strip)


@with_body_names
def build_bodies(
    case: Case,
    comm: MPI.Comm = MPI.COMM_WORLD,
    followed: WornDepths | None = None,
    warmed: tuple[Array, Array] | None = None,
    *,
    fresh: bool = False,
) -> Bodies:
    """Mesh both bodies and assemble them; collective.

    Args:
        case: The problem.
        comm: The ranks.
        followed: Worn depths that the meshes follow; by default they are as they were made.
        warmed: Temperatures of this rank's own nodes of both bodies that the materials' properties are taken at
            (owned,) each, K; by default the initial one.
        fresh: Mesh them even where their meshes are kept on disk.

    Raises:
        CaseError: a property of the geometry is wrong, such as a missing group.
        MeshQualityError: an element does not survive the motion.
    """
    check_operators(case)
    release(comm)  # what earlier systems have left
    known = case.diffusion
    owners = (1 % comm.size, 0) if case.setup.reproducible else None  # sums within a body are then those of one rank
    given = case.given.meshes
    meshes = (
        (given["punch"], given["strip"])
        if given
        else build_meshes(case.geometry, case.folder, comm, case.model.law, owners, known, case.names, fresh)
    )
    moved, made = (None, (None, None)) if followed is None else _moved(case, meshes, followed)
    warmed = warmed if case.warming else None
    punch, strip = (
        elastic_body(case, m, d, theta)
        for m, d, theta in zip(meshes, (case.punch, case.strip), warmed or (None, None), strict=True)
    )
    for body, before in zip((punch, strip), made, strict=True):
        body.surface = replace(body.surface, made=before)
    check_coatings(case, punch, strip)
    lay_grids(case, make_sliding(case), punch, strip)
    heat = build_conduction(case, punch, strip, warmed)
    return with_surfaces(case, Bodies(punch, strip, heat, followed, moved, warmed=warmed))


def with_surfaces(case: Case, bodies: Bodies) -> Bodies:
    """Return the bodies with the materials of their contact nodes; collective."""
    regions = contact_regions(bodies.punch), contact_regions(bodies.strip)
    of_punch, of_strip = (
        contact_density(shares, {region: case.materials[name].density for region, name in description.regions.items()})
        for shares, description in zip(regions, (case.punch, case.strip), strict=True)
    )
    return replace(bodies, regions=regions, densities=(of_punch, of_strip))


def build_conduction(
    case: Case, punch: ElasticBody, strip: ElasticBody, warmed: tuple[Array, Array] | None = None
) -> tuple[HeatBody, ...]:
    """Prepare conduction in both bodies, in none for a case without heat; collective.

    Args:
        case: The problem.
        punch, strip: Their elasticity.
        warmed: Temperatures that the properties are taken at; by default the initial one.
    """
    if case.heat is None:
        return ()
    both = zip((punch, strip), (case.punch, case.strip), warmed or (None, None), strict=True)
    return tuple(
        HeatBody(elastic, description, _conduction(case, elastic, description, theta), case.heat)
        for elastic, description, theta in both
    )


def _conduction(case: Case, elastic: ElasticBody, description: Body, theta: Array | None) -> ConductionLaw:
    """Return the conduction of a body at temperatures of its own nodes; collective."""
    if theta is None:
        return isotropic_conduction(elastic.body, description.regions, case.initial_materials)
    at = nodal_function(elastic.body, case.geometry.degree, theta)
    return isotropic_conduction(elastic.body, description.regions, case.materials, at)


def elastic_body(case: Case, mesh: BodyMesh, description: Body, theta: Array | None = None) -> ElasticBody:
    """Assemble the elasticity of one body of a case under the mean of its loads; collective.

    Args:
        case: The problem.
        mesh: Of the body.
        description: Of the body.
        theta: Temperatures of this rank's own nodes that its properties are taken at (owned,), K; by default the
            initial one.
    """
    regions, kind = description.regions, case.model.law
    if mesh.name in case.given.stresses:
        law = case.given.stresses[mesh.name]
    elif theta is None:
        law = isotropic(mesh, regions, case.initial_materials, kind)
    else:
        at = nodal_function(mesh, case.geometry.degree, theta)
        law = isotropic(mesh, regions, case.materials, kind, at)
    at_mean = description.model_copy(update={"loads": tuple(load.mean() for load in case.loads_of(mesh.name))})
    body = ElasticBody(mesh, at_mean, law, case.geometry.degree, case.model.thickness, case.setup)
    if description.profile is not None and (case.grid is None or case.grid.across is not None):
        body.surface = body.meshed = profiled(body.surface, description.profile)
    return body


def _moved(
    case: Case, meshes: tuple[BodyMesh, BodyMesh], followed: WornDepths
) -> tuple[WornDepths, tuple[ContactSurface, ContactSurface]]:
    """Let the meshes follow the wear; return how far contact nodes have moved into the bodies, and what was made."""
    punch, strip = (movable_surface(mesh, case.geometry.degree, case.model.law) for mesh in meshes)
    facing = pair(punch.surface, strip.surface, axisymmetric=case.model.law == "axisymmetric")
    moved = []
    for movable, depth, into, description in (
        (punch, followed.punch, facing.normal, case.punch),
        (strip, followed.strip, -strip.surface.outward, case.strip),
    ):
        pins = [np.array(support.at) for support in description.supports if support.at is not None]
        groups = [point for points in movable.body.points.values() for point in points]
        moved.append(follow_wear(movable, depth, into, [*pins, *groups]))
    return WornDepths(moved[0], moved[1]), (punch.surface, strip.surface)


def edges_of(bodies: Bodies, surface: ContactSurface) -> Edges:
    """Return the distances from the edges of a contact on the punch's surface.

    A plane at which both bodies end, held square to it alone, is one of symmetry: the contact continues beyond it.
    """
    size, surfaces = surface.extent(), (surface, bodies.strip.surface)
    planes = []
    for axis, place in bodies.punch.mirrors:
        shared = any(axis == other and abs(place - there) < FLAT * size for other, there in bodies.strip.mirrors)
        ends = [(float(surface.trace[:, axis].min()), float(surface.trace[:, axis].max())) for surface in surfaces]
        if shared and any(all(abs(end[side] - place) < FLAT * size for end in ends) for side in (0, 1)):
            planes.append((axis, place))
    return Edges(surface, rings=bodies.punch.law.kind == "axisymmetric", planes=planes)


def laws_of(bodies: Bodies, pair: ContactPair, sliding: Sliding, case: Case) -> LocalLaws:
    """Return friction and wear of each node of a pair of surfaces.

    Raises:
        CaseError: a coating's thickness is negative somewhere.
    """
    regions, contact = regions_opposite(bodies.regions, pair), sliding.friction.contact
    friction = replace(sliding.friction, split=regions[0].split(contact.friction))
    edges = edges_of(bodies, pair.punch) if contact.asks("edge", sliding.wear) else None
    coatings = coatings_of(pair, sliding.wear)
    return LocalLaws(friction, sliding.wear, coatings, regions, case.initial_temperature, edges)
