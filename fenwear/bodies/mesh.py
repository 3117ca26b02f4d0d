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

from fenwear import compat
from fenwear.arrays import Array, Mask
from fenwear.bodies import kept
from fenwear.bodies.raw_mesh import GmshView, RawMesh, element_problems, raw_mesh
from fenwear.bodies.ready import constants, meshes_folder
from fenwear.case import Geometry, Kind
from fenwear.case.names import BY_ROLE, ROLES, Names
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError, OutputError, did_you_mean
from fenwear.files.by_gmsh import gmsh_model
from fenwear.files.cad import name_parts, read_shapes, set_sizes
from fenwear.files.formats import CAD, MESHES, is_foreign, read_mesh
from fenwear.files.groups import Group, GroupedMesh, grouped, into_gmsh, normal, rows_text
from fenwear.files.mesh import stacked
from fenwear.parallel import check_memory, on_root

BODIES = ROLES
ENTITIES = ("point", "curve", "surface", "volume")  # gmsh's words for groups of dimension 0 to 3
TRIANGLE = 2  # gmsh's number of the cell
MATRICES = (
    3  # of n by n contact nodes, that a contact holds at least: of forces along three axes; in a plane it is four
)
SOLID_ELEMENTS = ("Tetrahedron", "Hexahedron")  # as gmsh names them
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


def own_mesh(name: str, mesh: Mesh, groups: Mapping[str, Callable[[Array], Mask]]) -> BodyMesh:
    """Return the mesh of a body with groups of boundary facets that are marked by functions; collective.

    Args:
        name: "punch" or "strip".
        mesh: Its mesh, mm.
        groups: For each group whether points x (3, q) belong to it, such as NAME_contact for the contact.

    Raises:
        CaseError: the name is another one, or a group is missing or has no facets.
    """
    if name not in BODIES:
        raise CaseError(InputError("name", f"expected one of {' and '.join(BODIES)}, got {name!r}"))
    fdim = mesh.topology.dim - 1
    facets, values = [], []
    for tag, (group, marker) in enumerate(groups.items(), start=1):
        found = locate_entities_boundary(mesh, fdim, marker)
        if mesh.comm.allreduce(len(found)) == 0:
            raise CaseError(InputError(group, f"no facet on the boundary of the {name} belongs to it"))
        facets.append(found)
        values.append(np.full(len(found), tag, dtype=np.int32))
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
        raise CaseError(InputError("geometry.file", f"no file {geometry.file!r}; ready ones are {names}"))
    ends = (".geo", ".msh", *CAD, *MESHES)
    if path.suffix.lower() not in ends:
        message = f"expected a file that ends in {', '.join(ends)}, got {geometry.file!r}"
        raise CaseError(InputError("geometry.file", message))
    meshed_here = path.suffix.lower() in (".geo", *CAD)
    if not meshed_here and geometry.order != 1:
        message = f"a {path.suffix} file has its own; it belongs to a .geo file or to a shape from CAD"
        raise CaseError(InputError("geometry.order", message))
    shape = path.suffix.lower() in CAD
    for key in ("size", "sizes"):
        if getattr(geometry, key) and not shape:
            message = f"belongs to a shape from CAD ({', '.join(CAD)}); a {path.suffix} file has its own sizes"
            raise CaseError(InputError(f"geometry.{key}", message))
    if geometry.unit is not None and path.suffix.lower() in (".geo", ".msh"):
        message = "belongs to the mesh of another program; a .geo has Mesh.ScalingFactor"
        raise CaseError(InputError("geometry.unit", message))
    if path.suffix == ".msh" and geometry.parameters:
        raise CaseError(InputError("geometry.parameters", "a .msh file has none; they belong to a .geo file"))
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
    """Return the meshes of the punch and the strip: those kept on disk, or gmsh's, which are kept; on one rank."""
    parameters = _parameters(geometry, path, known)
    content = path.read_bytes()
    keep = path.suffix in (".geo", ".msh", *CAD) and not (path.suffix == ".geo" and REACHES_OUT.search(content))
    sizes = (geometry.size, sorted(geometry.sizes.items()), geometry.unit, sorted(geometry.groups.items()))
    shape = (geometry.order, geometry.degree, kind, names, path.suffix, sorted(parameters.items()), sizes)
    place = kept.known(MPI.COMM_SELF, lambda: [*shape, content], fresh=fresh) if keep else kept.NOWHERE
    if (stored := place.arrays) is not None:
        _check_size(float(stored["contact_nodes"]))
        own = [{name.removeprefix(body): a for name, a in stored.items() if name.startswith(body)} for body in BODIES]
        return RawMesh.of_arrays(own[0]), RawMesh.of_arrays(own[1])
    foreign = foreign_mesh(geometry, path, kind, names)
    with gmsh_model() as gmsh:
        contact_nodes = _load(gmsh, geometry, path, kind, parameters, names, foreign)
        punch, strip = (raw_mesh(gmsh, body, _dim(kind)) for body in BODIES)
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
    parameters, foreign = _parameters(geometry, geo, known), foreign_mesh(geometry, geo, kind, names)
    with gmsh_model() as gmsh:
        _load(gmsh, geometry, geo, kind, parameters, names, foreign)
        _name_groups(gmsh, names.by_name)
        try:
            path.touch()
        except OSError as error:
            raise CaseError(InputError(str(path), f"cannot be written: {error.strerror}")) from None
        gmsh.write(str(path))
        if not path.read_bytes().endswith(b"$EndElements\n"):  # gmsh does not tell
            path.unlink()
            raise OutputError(path, "gmsh wrote only a part of it; is there room?")
        if foreign is not None:
            return foreign.rows(), foreign.text()
        rows = _group_rows(gmsh)
    return rows, rows_text(rows)


def _group_rows(gmsh: Any) -> list[dict[str, Any]]:
    """Return a row of each group of bodies in gmsh's current model."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    points = np.asarray(flat, dtype=np.float64).reshape(-1, 3)[order]
    groups = []
    for dim in range(4):
        for name, tag in _groups(gmsh, dim).items():
            cells: dict[int, NDArray[np.int64]] = {}
            for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
                for kind, labels, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
                    rows = np.searchsorted(np.asarray(tags)[order], nodes).reshape(len(labels), -1)
                    cells[int(kind)] = stacked(cells.get(int(kind)), rows)
            if cells:
                groups.append(Group(name, dim, cells, name))
    return GroupedMesh(points, tuple(groups), (), ()).rows()


def foreign_mesh(geometry: Geometry, path: Path, kind: Kind | None, names: Names) -> GroupedMesh | None:
    """Return the groups that the mesh of another program gives; None of a file that gmsh meshes or writes itself.

    Raises:
        CaseError: it cannot be read, or its sets do not fit.
    """
    if not is_foreign(path):
        return None
    mesh = read_mesh(path)
    scale = None if geometry.unit is None else _millimetres(geometry.unit)
    dim = mesh.dim if kind is None else _dim(kind)
    return grouped(mesh, geometry.groups, scale, dim, _any_case(names), lambda text: convert(text, "mm"))


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
    """Return what gives a group's name by role, whatever its case and spaces."""

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
    names: Names,
    foreign: GroupedMesh | None,
) -> float:
    """Read and mesh the geometry in the current gmsh model, name its groups by roles, and check the contract.

    Returns:
        About how many contact nodes a solid has; 0 of others.
    """
    gmsh.parser.clear()
    for name, value in parameters.items():
        gmsh.parser.setNumber(name, [value])
    gmsh.option.setNumber(SCALING, 1.0)  # not of a geometry that was read before
    contact_nodes, shape = 0.0, path.suffix.lower() in CAD
    try:
        if foreign is not None:
            into_gmsh(gmsh, foreign)
        elif shape:
            read_shapes(gmsh, path, _millimetres(geometry.unit or "mm"))
        else:
            _merge(gmsh, path)
            _rename_groups(gmsh, path, geometry, names)
        kind = kind or ("solid" if gmsh.model.getEntities(3) else "stress")
        dim = _dim(kind)
        if shape:
            parts = {_any_case(names)(name): part for name, part in geometry.groups.items()}
            name_parts(gmsh, path.name, parts, dim, _any_case(names), lambda text: convert(text, "mm"))
        _by_roles(gmsh, path, names)
        if shape:
            tags = {name: (d, tag) for d in range(4) for name, tag in _groups(gmsh, d).items()}
            sizes = {_any_case(names)(name): size for name, size in geometry.sizes.items()}
            set_sizes(gmsh, geometry.size, sizes, tags)
            _check_groups_there(gmsh, path, kind)
        if shape or path.suffix == ".geo":
            gmsh.model.mesh.generate(dim - 1)
            most = max(_contact_nodes(gmsh, geometry, body, dim - 1) for body in BODIES[: 1 if kind == "solid" else 2])
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
    _check_groups(gmsh, path, kind)
    return contact_nodes


def _rename_groups(gmsh: Any, path: Path, geometry: Geometry, names: Names) -> None:
    """Give groups of a .geo or .msh the names that geometry.groups has, and known ones in capitals their own.

    Raises:
        CaseError: a group does not exist.
    """
    for dim in range(4):
        for name, tag in _groups(gmsh, dim).items():
            group = _any_case(names)(name)
            if group.startswith(tuple(f"{body}_" for body in BODIES)) and names.by_role(name) == name != group:
                gmsh.model.removePhysicalName(name)
                gmsh.model.setPhysicalName(dim, tag, group)
    for wanted, value in geometry.groups.items():
        every = {normal(name): (dim, tag, name) for dim in range(4) for name, tag in _groups(gmsh, dim).items()}
        for text in [value] if isinstance(value, str) else value:
            if text and normal(text) not in every:
                message = f"{path.name} has no group {text!r}. It has {', '.join(sorted(every)) or 'none'}."
                raise CaseError(InputError(f"geometry.groups.{wanted}", message))
        parts = [every[normal(text)] for text in ([value] if isinstance(value, str) else value) if text]
        old = every.get(normal(wanted))
        if old is not None and old not in parts:
            gmsh.model.removePhysicalGroups([old[:2]])
        if parts:
            own = [e for dim, tag, _ in parts for e in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
            for dim, tag, name in parts:
                gmsh.model.removePhysicalGroups([(dim, tag)])
                gmsh.model.removePhysicalName(name)
            tag = gmsh.model.addPhysicalGroup(parts[0][0], own)
            gmsh.model.setPhysicalName(parts[0][0], tag, wanted)


def _by_roles(gmsh: Any, path: Path, names: Names) -> None:
    """Name the groups of bodies by their roles.

    Raises:
        CaseError: a body has groups of both names.
    """
    groups = {name for dim in range(4) for name in _groups(gmsh, dim)}
    both = sorted(f"{name} and {names.by_role(name)}" for name in groups if {names.by_role(name)} & (groups - {name}))
    if both:
        raise CaseError(InputError("geometry.file", f"{path.name} has {', '.join(both)}: expected one of each"))
    _name_groups(gmsh, names.by_role)


def _name_groups(gmsh: Any, change: Callable[[str], str]) -> None:
    """Give the groups of the current gmsh model other names."""
    for dim in range(4):
        for name, tag in _groups(gmsh, dim).items():
            if (new := change(name)) != name:
                gmsh.model.removePhysicalName(name)
                gmsh.model.setPhysicalName(dim, tag, new)


def _contact_nodes(gmsh: Any, geometry: Geometry, body: str, dim: int) -> float:
    """Return about how many contact nodes a body has on its meshed surfaces, or lines."""
    nodes = 0.0
    tags = [tag for name, tag in _groups(gmsh, dim).items() if name == f"{body}_contact" or _contact_name(body, name)]
    for entity in (entity for tag in tags for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)):
        for cell, cells in zip(*gmsh.model.mesh.getElements(dim, entity)[:2], strict=True):
            nodes += len(cells) * (0.5 if cell == TRIANGLE else geometry.degree**dim)
    return nodes


def _check_size(contact_nodes: float) -> None:
    """Refuse what would not fit into memory with its contact alone, a line or a surface, before bodies are meshed.

    Raises:
        CaseError: it has too many contact nodes.
    """
    what, advice = f"a contact of some {contact_nodes:,.0f} nodes", "Use larger elements at the contact, or a `grid`."
    check_memory(MPI.COMM_SELF, MATRICES * 8 * contact_nodes**2, "geometry", what, advice)


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
    defined = _checked_parameters(geometry, path)
    return {**{name: value for name, value in known.items() if name in defined}, **geometry.parameters}


def _checked_parameters(geometry: Geometry, path: Path) -> list[str]:
    """Return the parameters that the .geo file defines by DefineConstant, and reject others."""
    if path.suffix != ".geo":
        return []
    known = sorted(constants(path))
    unknown = [name for name in geometry.parameters if name not in known]
    if unknown:
        raise CaseError(
            [InputError(f"geometry.parameters.{name}", _no_parameter(path, name, known)) for name in unknown]
        )
    many = [name for name, value in geometry.parameters.items() if "elements" in name and value > MOST_ELEMENTS]
    if many:
        message = f"expected at most {MOST_ELEMENTS:,} elements, got {geometry.parameters[many[0]]:g}"
        raise CaseError(InputError(f"geometry.parameters.{many[0]}", message))
    return known


def _no_parameter(path: Path, name: str, known: list[str]) -> str:
    hint = did_you_mean(name, known)
    return f"{path.name} has no such parameter, but {', '.join(known) or 'none'}{hint}"


def _groups(gmsh: Any, dim: int) -> dict[str, int]:
    return {gmsh.model.getPhysicalName(dim, tag): tag for _, tag in gmsh.model.getPhysicalGroups(dim)}


def _named(gmsh: Any, dim: int) -> str:
    names = [name or "one without a name" for name in _groups(gmsh, dim)]
    return f"it has {', '.join(names)}" if names else f"it has no physical {ENTITIES[dim]}"


def _check_groups_there(gmsh: Any, path: Path, kind: Kind) -> None:
    """Refuse a geometry without the groups that bodies need, before or after it is meshed.

    Raises:
        CaseError: a body has no region or no contact.
    """
    if problems := _missing_groups(gmsh, path, _dim(kind)):
        raise CaseError([InputError("geometry.file", text) for text in problems])


def _missing_groups(gmsh: Any, path: Path, whole: int) -> list[str]:
    """Return which groups of the contract are missing, in words."""
    problems = []
    region, facet = ENTITIES[whole], ENTITIES[whole - 1]
    for body in BODIES:
        regions = [name for name in _groups(gmsh, whole) if name.startswith(f"{body}_")]
        if not regions:
            problems.append(f"{path.name} has no physical {region} named {body}_...; {_named(gmsh, whole)}")
        facets = _groups(gmsh, whole - 1)
        named = [name for name in facets if _contact_name(body, name)]
        if f"{body}_contact" not in facets and not named:
            problems.append(f"{path.name} has no physical {facet} named {body}_contact; {_named(gmsh, whole - 1)}")
        if f"{body}_contact" in facets and named:
            problems.append(
                f"{path.name} has {body}_contact and {', '.join(sorted(named))}; expected one or the others"
            )
    if problems and whole == 2 and any(name.startswith(BODIES) for name in _groups(gmsh, 3)):
        problems.append(f"{path.name} has physical volumes: expected model.kind = 'solid' with it")
    return problems


def _check_groups(gmsh: Any, path: Path, kind: Kind) -> None:
    whole = _dim(kind)
    problems = _missing_groups(gmsh, path, whole)
    for dim in (whole, whole - 1):
        names = _groups(gmsh, dim)
        types = {name: _element_types(gmsh, dim, tag) for name, tag in names.items()}
        problems += [f"{path.name}: physical group {name} has no elements" for name in names if not types[name]]
        problems += [
            f"{path.name}: physical group {name} mixes element types" for name in names if len(types[name]) > 1
        ]
    if not problems and whole == 3:
        problems = [f"{path.name}: {text}" for text in _solid_types(gmsh)]
    if not problems:
        groups = [{n: t for n, t in _groups(gmsh, dim).items() if n.startswith(BODIES)} for dim in range(whole + 1)]
        found = element_problems(gmsh, groups, axisymmetric=kind == "axisymmetric")
        problems = [f"{path.name}: {text}" for text in found]
    if problems:
        raise CaseError([InputError("geometry.file", text) for text in problems])


def _contact_name(body: str, group: str) -> str:
    """Return NAME of a group BODY_contact_NAME, "" of any other."""
    head, _, name = group.partition(f"{body}_contact_")
    return "" if head else name


def _element_types(gmsh: Any, dim: int, tag: int) -> set[int]:
    entities = gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
    return {int(t) for entity in entities for t in gmsh.model.mesh.getElementTypes(dim, entity)}


def _solid_types(gmsh: Any) -> list[str]:
    """Return what is wrong with the kinds of elements of solids, in words."""
    problems = []
    for body in BODIES:
        regions = [tag for name, tag in _groups(gmsh, 3).items() if name.startswith(f"{body}_")]
        types = {t for tag in regions for t in _element_types(gmsh, 3, tag)}
        names = sorted(gmsh.model.mesh.getElementProperties(t)[0] for t in types)
        if len(types) > 1:
            problems.append(f"the {body} mixes elements ({', '.join(names)}); expected one kind in a body")
        if not names[0].startswith(SOLID_ELEMENTS):
            problems.append(f"the {body} has elements of the kind {names[0]}; expected tetrahedra or hexahedra")
    return problems


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
    tags, whole = body.facet_tags, min(named.values())
    values = np.where(np.isin(tags.values, list(named.values())), whole, tags.values).astype(np.int32)
    curves = {group: tag for group, tag in body.curves.items() if not _contact_name(body.name, group)}
    return replace(
        body,
        facet_tags=meshtags(body.mesh, tags.dim, tags.indices, values),
        curves={**curves, f"{body.name}_contact": whole},
        contacts={name: tags.find(tag) for name, tag in sorted(named.items())},
    )
