"""gmsh geometry to distributed meshes, one for each body, with their named groups.

The contract of a geometry, a .geo or a .msh: physical groups whose names start with the body they belong to, punch_
or strip_, or with the name that the case gives it; surfaces are the material regions; punch_contact and strip_contact
are the curves that meet, or several of them each with a name of its own, punch_contact_NAME; further curves and points
are for supports, loads and thermal conditions. In a solid the regions are volumes and what meets are surfaces. An
axisymmetric model has r along x.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh, MeshTags, locate_entities_boundary, meshtags
from mpi4py import MPI
from numpy.typing import NDArray

from fenwear.bodies.raw_mesh import GmshView, RawMesh, raw_mesh
from fenwear.bodies.ready_geometries import constants, meshes_folder
from fenwear.case import Geometry, Kind
from fenwear.case.body_names import BY_ROLE, ROLES, Names
from fenwear.common import compat, disk_cache
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError, OutputError, did_you_mean
from fenwear.common.parallel import check_memory, on_root
from fenwear.common.units import convert
from fenwear.files.by_gmsh import gmsh_model, model_mesh
from fenwear.files.cad import name_parts, read_shapes, set_sizes
from fenwear.files.formats import CAD, MESHES, is_foreign, read_mesh
from fenwear.files.groups import GroupedMesh, grouped, into_gmsh, normal
from fenwear.files.mesh_file import ENTITIES, FLAT, sound

BODIES = ROLES
TRIANGLE = 2  # gmsh's number of the cell
MATRICES = (
    3  # of n by n contact nodes, that a contact holds at least: of forces along three axes; in a plane it is four
)
NOTHING: Mapping[str, float] = MappingProxyType({})
SCALING = "Mesh.ScalingFactor"  # of all lengths, as set in a .geo
# What makes the mesh of a .geo follow from more than its text and parameters.
REACHES_OUT = re.compile(rb"Include|Merge|File|System|GetEnv|GetString|GetNumber|Onelab|Plugin")
MOST_ELEMENTS = 1_000_000  # along one line: with more gmsh comes to no end
TOLERANCE, SAME_POINT = "Geometry.Tolerance", 1e-8  # of the size of what gmsh compares points in: closer ones are one
_largest = [
    1.0
]  # size of all geometries that this process has read: gmsh goes on comparing points by the largest of them


@dataclass(frozen=True)
class BodyMesh:
    """The mesh of one body, distributed over the ranks, with its named groups.

    Attributes:
        regions: Tag in `cell_tags` of each material region.
        curves: Tag in `facet_tags` of each group of facets.
        points: Coordinates (count, gdim) of each group of points, mm.
        contacts: Facets of this rank, ghosts too, of each named contact of NAME_contact; none where it has one alone.
    """

    name: str
    mesh: Mesh
    cell_tags: MeshTags
    facet_tags: MeshTags
    regions: dict[str, int]
    curves: dict[str, int]
    points: dict[str, NDArray[np.float64]]
    contacts: Mapping[str, NDArray[np.int32]] = MappingProxyType({})

    def curve(self, group: str, key: str) -> int:
        """Return the tag of a group of facets.

        Raises:
            CaseError: no such group; `key` is the case's key that asked for it.
        """
        if group not in self.curves:
            entity = ENTITIES[self.mesh.topology.dim - 1]
            raise CaseError(InputError(key, f"no physical {entity} {group!r} on the {self.name}{_known(self.curves)}"))
        return self.curves[group]

    def for_role(self, role: str) -> BodyMesh:
        """Return the mesh for the body of a role, which begins the names of its groups in place of the mesh's own."""
        start = f"{self.name}_"
        by_role = {group: f"{role}_{group.removeprefix(start)}" for group in (*self.regions, *self.curves)}
        regions, curves = (
            {by_role[group] if group.startswith(start) else group: tag for group, tag in tags.items()}
            for tags in (self.regions, self.curves)
        )
        return replace(self, name=role, regions=regions, curves=curves)


def own_mesh(name: str, mesh: Mesh, groups: Mapping[str, Callable[[Array], Mask]]) -> BodyMesh:
    """Return the mesh of a body with groups of boundary facets that are marked by functions; collective.

    Args:
        name: "punch" or "strip", or the name that the case gives the body.
        mesh: Mesh of the body, mm.
        groups: For each group whether points x (3, q) belong to it, such as NAME_contact for the contact.

    Raises:
        CaseError: a group is missing or has no facets.
    """
    fdim = mesh.topology.dim - 1
    facets, values = [], []
    for tag, (group, marker) in enumerate(groups.items(), start=1):
        marked = locate_entities_boundary(mesh, fdim, marker)
        if mesh.comm.allreduce(len(marked)) == 0:
            raise CaseError(InputError(group, f"no facet on the boundary of the {name} belongs to it"))
        facets.append(marked)
        values.append(np.full(len(marked), tag, dtype=np.int32))
    if f"{name}_contact" not in groups and not any(_contact_name(name, group) for group in groups):
        raise CaseError(InputError(f"{name}_contact", f"missing, but required{_known(groups)}"))
    order = np.argsort(np.concatenate(facets), kind="stable")
    every, first = np.unique(np.concatenate(facets)[order], return_index=True)
    facet_tags = meshtags(mesh, fdim, every.astype(np.int32), np.concatenate(values)[order][first])
    cells = np.arange(mesh.topology.index_map(fdim + 1).size_local, dtype=np.int32)
    cell_tags = meshtags(mesh, fdim + 1, cells, np.ones(len(cells), dtype=np.int32))
    curves = {group: tag for tag, group in enumerate(groups, start=1)}
    return _with_contacts(BodyMesh(name, mesh, cell_tags, facet_tags, {f"{name}_body": 1}, curves, {}))


def _known(groups: object) -> str:
    names = ", ".join(sorted(groups))  # type: ignore[call-overload]
    return f"; the geometry has {names}" if names else ""


def find_geometry(geometry: Geometry, folder: Path | None) -> Path:
    """Return the geometry's file: beside the case file, or one of the ready ones.

    Raises:
        CaseError: no such file, or not one that gmsh meshes.
    """
    ready = meshes_folder()
    places = [(folder or Path()) / geometry.file]
    try:
        path = next((p for p in (*places, ready / geometry.file) if p.is_file()), None)
    except OSError:  # a name that no file can have
        path = None
    if path is None:
        names = ", ".join(sorted(p.name for p in ready.glob("*.geo")))
        known = f"; ready ones are {names}" if geometry.file.endswith(".geo") else f" in {places[0].parent.resolve()}"
        raise CaseError(InputError("geometry.file", f"no file {geometry.file!r}{known}"))
    ends, suffix = (".geo", ".msh", *CAD, *MESHES), path.suffix.lower()
    shape, of_gmsh = suffix in CAD, suffix in (".geo", ".msh")
    of_cad = f"belongs to a shape from CAD ({', '.join(CAD)}); a {path.suffix} file has its own sizes"
    of_shape = f"a {path.suffix} file has its own; it belongs to a .geo file or to a shape from CAD"
    of_others = "belongs to the mesh of another program; a .geo has Mesh.ScalingFactor"
    for key, wrong, message in (
        ("file", suffix not in ends, f"expected a file that ends in {', '.join(ends)}, got {geometry.file!r}"),
        ("order", geometry.order != 1 and not shape and suffix != ".geo", of_shape),
        ("size", geometry.size and not shape, of_cad),
        ("sizes", geometry.sizes and not shape, of_cad),
        ("unit", geometry.unit and of_gmsh, of_others),
        ("parameters", geometry.parameters and suffix == ".msh", "a .msh file has none; they belong to a .geo file"),
    ):
        if wrong:
            raise CaseError(InputError(f"geometry.{key}", message))
    return path


def build_meshes(
    geometry: Geometry,
    folder: Path | None,
    comm: MPI.Comm,
    kind: Kind = "stress",
    owners: tuple[int, int] | None = None,
    known: Mapping[str, float] = NOTHING,
    names: Names = BY_ROLE,
    fresh: bool = False,
) -> tuple[BodyMesh, BodyMesh]:
    """Mesh the geometry and distribute it: the punch and the strip; collective.

    Args:
        geometry: Of the case.
        folder: Where its path starts.
        comm: The ranks.
        kind: Of the model: solids are meshed in volumes.
        owners: The ranks that have the whole punch and the whole strip; by default all have parts of both.
        known: Values of parameters that a geometry may have and does not set itself.
        names: Of the bodies, which its groups may start with.
        fresh: Mesh it even where the meshes are kept on disk.

    Raises:
        CaseError: the geometry cannot be read or meshed, or a group of the contract is missing.
        StackError: there is no gmsh.
    """
    made: list[RawMesh] = []
    on_root(comm, lambda: made.extend(_meshed(geometry, find_geometry(geometry, folder), kind, known, names, fresh)))
    owned = owners or (None, None)
    parts = zip(made or (None, None), BODIES, owned, strict=True)
    punch, strip = (_distribute(raw, body, owner, comm, kind) for raw, body, owner in parts)
    return punch, strip


def _meshed(
    geometry: Geometry, path: Path, kind: Kind, known: Mapping[str, float], names: Names, fresh: bool
) -> tuple[RawMesh, RawMesh]:
    """Return the meshes of the punch and the strip: those kept on disk, or new ones, which are kept; on one rank."""
    parameters = _parameters(geometry, path, known)
    content = path.read_bytes()
    keep = path.suffix in (".geo", ".msh", *CAD) and not (path.suffix == ".geo" and REACHES_OUT.search(content))
    sizes = (geometry.size, sorted(geometry.sizes.items()), geometry.unit, sorted(geometry.groups.items()))
    shape = (geometry.order, geometry.degree, kind, names, path.suffix, sorted(parameters.items()), sizes)
    place = disk_cache.known(MPI.COMM_SELF, lambda: [*shape, content], fresh=fresh) if keep else disk_cache.NOWHERE
    if stored := place.arrays:
        _check_size(float(stored["contact_nodes"]))
        by_body = [
            {name.removeprefix(body): a for name, a in stored.items() if name.startswith(body)} for body in BODIES
        ]
        return RawMesh.of_arrays(by_body[0]), RawMesh.of_arrays(by_body[1])
    mesh, contact_nodes = _grouped(geometry, path, kind, parameters, names)
    punch, strip = (raw_mesh(mesh, body, _dim(kind)) for body in BODIES)
    both = zip(BODIES, (punch, strip), strict=True)
    arrays = {f"{body}{name}": a for body, raw in both for name, a in raw.arrays().items()}
    place.save({**arrays, "contact_nodes": np.array(contact_nodes)})
    return punch, strip


def _dim(kind: Kind) -> int:
    return 3 if kind == "solid" else 2


def write_msh(
    geometry: Geometry,
    folder: Path | None,
    path: Path,
    kind: Kind | None = "stress",
    known: Mapping[str, float] = NOTHING,
    names: Names = BY_ROLE,
) -> tuple[list[dict[str, Any]], str]:
    """Mesh the geometry and write it as a .msh file (format 4.1); on one rank.

    Args:
        geometry: The geometry to mesh.
        folder: Of the case file.
        path: The .msh file.
        kind: Of the model; None for the one that the file's elements or shapes are of.
        known: Of the parameters that the geometry may have.
        names: Of the bodies.

    Returns:
        A row of each group, with its size, and all of it in lines with what is left out of the mesh of another program.

    Raises:
        CaseError: as `build_meshes`; or `path` cannot be written.
        OutputError: there is no room for it.
    """
    geo = find_geometry(geometry, folder)
    mesh, _ = _grouped(geometry, geo, kind, _parameters(geometry, geo, known), names)
    with gmsh_model() as gmsh:
        into_gmsh(gmsh, mesh, names.by_name)
        try:
            path.touch()
        except OSError as error:
            raise CaseError(InputError(str(path), f"cannot be written: {error.strerror}")) from None
        gmsh.write(str(path))
        if not path.read_bytes().endswith(b"$EndElements\n"):  # gmsh does not tell
            path.unlink()
            raise OutputError(path, "gmsh wrote only a part of it. Free some space on the disk")
    return mesh.rows(), mesh.text()


def _grouped(
    geometry: Geometry, path: Path, kind: Kind | None, parameters: Mapping[str, float], names: Names
) -> tuple[GroupedMesh, float]:
    """Return the groups of the mesh that a file has or gives, and about how many contact nodes a solid has, else 0.

    Raises:
        CaseError: it cannot be read or meshed, or its groups do not fit.
    """
    by_role, wanted, contact_nodes = _any_case(names), geometry.groups, 0.0
    scale = None if geometry.unit is None else _millimetres(geometry.unit)
    if is_foreign(path):
        mesh = read_mesh(path)
        dim = mesh.dim if kind is None else _dim(kind)
    else:
        scale = 1.0
        with gmsh_model() as gmsh:
            dim, contact_nodes = _load(gmsh, geometry, path, kind, parameters, by_role)
            mesh = sound(model_mesh(path.name, gmsh))
        if path.suffix.lower() in CAD:
            wanted = {}  # its parts are named
    groups = grouped(mesh, wanted, scale, dim, by_role, _length)
    if kind == "axisymmetric" and (inner := float(groups.points[:, 0].min())) < -FLAT * float(np.ptp(groups.points)):
        message = f"{path.name} reaches to x = {inner:g} mm, but x is the radius of an axisymmetric model: x >= 0"
        raise CaseError(InputError("geometry.file", message))
    return groups, contact_nodes


def _length(text: str) -> float:
    """Return a length in mm."""
    return convert(text, "mm")


def _millimetres(unit: str) -> float:
    """Return the length of a unit, mm.

    Raises:
        CaseError: it is no unit of length.
    """
    try:
        return convert(f"1 {unit}", "mm")
    except ValueError as error:
        raise CaseError(InputError("geometry.unit", str(error))) from None


def _any_case(names: Names) -> Callable[[str], str]:
    """Return the function from a group's name to the name by role, whatever its case and spaces."""

    def by_role(group: str) -> str:
        key = normal(group)
        for role, name in names.by_roles.items():
            if key.startswith(f"{normal(name)}_"):
                return f"{role}{key[len(normal(name)) :]}"
        return key

    return by_role


def _load(
    gmsh: Any,
    geometry: Geometry,
    path: Path,
    kind: Kind | None,
    parameters: Mapping[str, float],
    by_role: Callable[[str], str],
) -> tuple[int, float]:
    """Read a file of gmsh or a shape into the current gmsh model, and mesh it.

    Returns:
        Dimension of the bodies, and about how many contact nodes a solid has; 0 of others.
    """
    gmsh.parser.clear()
    for name, value in parameters.items():
        gmsh.parser.setNumber(name, [value])
    gmsh.option.setNumber(SCALING, 1.0)  # not of a geometry that was read before
    contact_nodes, shape = 0.0, path.suffix.lower() in CAD
    try:
        if shape:
            read_shapes(gmsh, path, _millimetres(geometry.unit or "mm"))
        else:
            _merge(gmsh, path)
        top_dim = 3 if gmsh.model.getEntities(3) else 2
        dim = top_dim if kind is None else _dim(kind)
        if dim < top_dim and any(by_role(name).startswith(BODIES) for name in _groups(gmsh, 3)):
            message = f"{path.name} has physical volumes: expected model.kind = 'solid' with it"
            raise CaseError(InputError("geometry.file", message))
        if shape:
            parts = {by_role(name): part for name, part in geometry.groups.items()}
            name_parts(gmsh, path.name, parts, dim, by_role, _length)
            tags = {name: (d, tag) for d in range(4) for name, tag in _groups(gmsh, d).items()}
            set_sizes(gmsh, geometry.size, {by_role(name): size for name, size in geometry.sizes.items()}, tags)
        if shape or path.suffix == ".geo":
            gmsh.model.mesh.generate(dim - 1)
            contact = _contact_nodes(gmsh, geometry, by_role, dim - 1)
            most = max(contact[body] for body in BODIES[: 1 if kind == "solid" else 2])
            _check_size(most)
            contact_nodes = most if kind == "solid" else 0.0
            gmsh.model.mesh.generate(dim)
            gmsh.model.mesh.setOrder(geometry.order)
            factor = gmsh.option.getNumber(SCALING)  # gmsh itself would apply it to files alone
            gmsh.model.mesh.affineTransform([factor, 0, 0, 0, 0, factor, 0, 0, 0, 0, factor, 0])
            gmsh.option.setNumber(SCALING, 1.0)
    except CaseError:
        raise
    except Exception as error:  # gmsh raises bare Exception only
        raise CaseError(InputError("geometry.file", f"gmsh on {path.name}: {error}")) from None
    return dim, contact_nodes


def _contact_nodes(gmsh: Any, geometry: Geometry, by_role: Callable[[str], str], dim: int) -> dict[str, float]:
    """Return about how many contact nodes each body has on its meshed surfaces, or lines."""
    wanted = {
        normal(text): by_role(group)
        for group, value in geometry.groups.items()
        for text in ([value] if isinstance(value, str) else value)
    }
    nodes = dict.fromkeys(BODIES, 0.0)
    for name, tag in _groups(gmsh, dim).items():
        body, _, rest = wanted.get(normal(name), by_role(name)).partition("_")
        if body not in nodes or rest.partition("_")[0] != "contact":
            continue
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            for cell, cells in zip(*gmsh.model.mesh.getElements(dim, entity)[:2], strict=True):
                nodes[body] += len(cells) * (0.5 if cell == TRIANGLE else geometry.degree**dim)
    return nodes


def _check_size(contact_nodes: float) -> None:
    """Refuse what would not fit into memory with its contact alone, a line or a surface, before bodies are meshed.

    Raises:
        CaseError: it has too many contact nodes.
    """
    subject, advice = (
        f"a contact of some {contact_nodes:,.0f} nodes",
        "Use larger elements at the contact, or a `grid`.",
    )
    check_memory(MPI.COMM_SELF, MATRICES * 8 * contact_nodes**2, "geometry", subject, advice)


def _merge(gmsh: Any, path: Path) -> None:
    """Read a file to its end: an error thrown inside gmsh's parser would spoil all that it reads later.

    Raises:
        Exception: the first error in the file.
    """
    gmsh.option.setNumber("General.AbortOnError", 0)
    gmsh.option.setNumber(TOLERANCE, SAME_POINT / max(1.0, _largest[0]))
    gmsh.logger.start()
    gmsh.merge(str(path))
    messages = gmsh.logger.get()
    gmsh.logger.stop()
    gmsh.option.setNumber(TOLERANCE, SAME_POINT)
    _largest[0] = max(_largest[0], gmsh.option.getNumber("General.BoundingBoxSize"))
    gmsh.option.setNumber("General.AbortOnError", 2)
    errors = [m.removeprefix("Error: ") for m in messages if m.startswith("Error: ")]
    if errors:
        raise RuntimeError(errors[0])


def _parameters(geometry: Geometry, path: Path, known: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of a .geo file that are set: by the case, or known of what the file asks for.

    Raises:
        CaseError: the file does not define one by DefineConstant, or too many elements are asked for.
    """
    defined = sorted(constants(path)) if path.suffix == ".geo" else list(geometry.parameters)
    problems = []
    for name, value in geometry.parameters.items():
        key = f"geometry.parameters.{name}"
        if name not in defined:
            has = f"{', '.join(defined) or 'none'}{did_you_mean(name, defined)}"
            problems.append(InputError(key, f"{path.name} has no such parameter. It has {has}"))
        elif "elements" in name and value > MOST_ELEMENTS:
            problems.append(InputError(key, f"expected at most {MOST_ELEMENTS:,} elements, got {value:g}"))
    if problems:
        raise CaseError(problems)
    return {**{name: value for name, value in known.items() if name in defined}, **geometry.parameters}


def _groups(gmsh: Any, dim: int) -> dict[str, int]:
    return {gmsh.model.getPhysicalName(dim, tag): tag for _, tag in gmsh.model.getPhysicalGroups(dim)}


def _contact_name(body: str, group: str) -> str:
    """Return NAME of a group BODY_contact_NAME, "" of any other."""
    head, _, name = group.partition(f"{body}_contact_")
    return "" if head else name


def _distribute(raw: RawMesh | None, body: str, owner: int | None, comm: MPI.Comm, kind: Kind) -> BodyMesh:
    """Distribute rank 0's mesh of one body over the ranks, or the whole to its owner; collective."""
    *_, curves, regions = comm.bcast(None if raw is None else raw.groups)
    points = comm.bcast(None if raw is None else raw.points)
    model = None if raw is None else GmshView(raw)
    mesh, cell_tags, facet_tags = compat.model_to_mesh(model, comm, _dim(kind), owner)
    return _with_contacts(BodyMesh(body, mesh, cell_tags, facet_tags, regions, curves, points))


def _with_contacts(body: BodyMesh) -> BodyMesh:
    """Return the body with one contact, whose facets its named contacts share among them."""
    named = {name: tag for group, tag in body.curves.items() if (name := _contact_name(body.name, group))}
    if not named:
        return body
    tags, common_tag = body.facet_tags, min(named.values())
    values = np.where(np.isin(tags.values, list(named.values())), common_tag, tags.values).astype(np.int32)
    curves = {group: tag for group, tag in body.curves.items() if not _contact_name(body.name, group)}
    return replace(
        body,
        facet_tags=meshtags(body.mesh, tags.dim, tags.indices, values),
        curves={**curves, f"{body.name}_contact": common_tag},
        contacts={name: tags.find(tag) for name, tag in sorted(named.items())},
    )
