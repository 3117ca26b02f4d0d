"""Fields in both bodies at chosen half-cycles: displacement, stress, temperature, heat flux, contact pressure, wear.

The condensed interface knows the contact alone; here the whole bodies are solved once more,
K u = f + C p + G (theta - theta_0), and written as one time series for ParaView and pyvista (VTKHDF) and, as plain
NetCDF on the nodes, for fenwear's own pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import basix
import basix.ufl
import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from fenwear.algebra.assembled import interpolate, times
from fenwear.bodies.antiplane import shear_out_of_plane, shear_strain
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.subcells import linear_cells
from fenwear.common.arrays import Array
from fenwear.common.compat import facet_nodes
from fenwear.common.parallel import on_root
from fenwear.heat.conduction import HeatBody
from fenwear.laws.wear import WornDepths
from fenwear.results.disk import check_room, replacing, writing
from fenwear.results.quantity import degrees_of
from fenwear.surfaces.placement import in_model, in_space
from fenwear.system import Tribosystem

if TYPE_CHECKING:
    import xarray

FOLDER = "fields"
BYTES_PER_NODE, BYTES_PER_RANK = 512, 262144  # that the files take, generously
SERIES = "fields.hdf"
STRESS = ("xx", "yy", "zz", "xy", "yz", "xz")  # as VTK orders a symmetric tensor
MEANINGS = {
    "displacement": ("mm", "displacement"),
    "displacement_out_of_plane": ("mm", "displacement out of the plane, along y"),
    "stress": ("MPa", "stress"),
    "von_mises": ("MPa", "von Mises stress"),
    "temperature": ("K", "temperature"),
    "heat_flux": ("mW/mm2", "heat flux"),
}
AXES = {2: ("x", "z"), 3: ("x", "y", "z")}


# Functions on the nodes of a body by the names above: displacement, stress by `STRESS` (in rings x, y and z are r,
# around and z) and von Mises stress; out of the plane only where a traction acts along it, the last two only with heat.
Fields = dict[str, fem.Function]


def body_fields(
    system: Tribosystem,
    pressure: Array,
    rigid: Array,
    phase: int,
    temperatures: tuple[Array, Array] | None,
    friction_ratio: Array | None = None,
    worn: WornDepths | None = None,
) -> tuple[Fields, Fields]:
    """Return the fields of the punch and the strip; collective.

    Args:
        system: The assembled problem.
        pressure: Contact pressure (n,), MPa.
        rigid: Amplitudes of the rigid modes (modes,).
        phase: Number of the phase in the cycle.
        temperatures: Of each body's owned nodes, K.
        friction_ratio: tau (n, d), the traction of friction on the punch over the pressure; by default that of sliding.
        worn: Depths, and states that laws remember, for friction that depends on them; by default those at the start.
    """
    traction = friction_ratio
    traction = _traction(system, phase, pressure, temperatures, worn) if traction is None else in_space(traction)
    given: list[tuple[HeatBody, Array] | None] = [None, None]
    if temperatures is not None and system.bodies.heat:
        given = [*zip(system.bodies.heat, temperatures, strict=True)]
    loaded = _loaded(system, phase, pressure, rigid, traction)
    punch, strip = (_solve(*body, warm) for body, warm in zip(loaded, given, strict=True))
    return punch, strip


def displacements(
    system: Tribosystem, pressure: Array, rigid: Array, phase: int = 0
) -> tuple[tuple[ElasticBody, fem.Function], ...]:
    """Return punch and strip, each with its displacement (mm) before any heat, as `body_fields`; collective."""
    traction = _traction(system, phase, pressure, None, None)
    loaded = _loaded(system, phase, pressure, rigid, traction)
    return tuple((elastic, _displacement(elastic, load, modes, np.zeros(1))) for elastic, load, modes in loaded)


def _loaded(
    system: Tribosystem, phase: int, pressure: Array, rigid: Array, traction: Array
) -> list[tuple[ElasticBody, Array, Array]]:
    """Return punch and strip with the forces on their trace nodes (N, 3), N/mm, and the amplitudes of their modes."""
    pair, bodies = system.sliding.pairs[phase], system.loaded[phase]
    force = in_space(pair.normal) + traction
    force *= (pair.weights * pressure)[:, None]
    count = len(bodies.punch.rigid_modes)
    return [
        (bodies.punch, pair.punch.spread @ force, rigid[:count]),
        (bodies.strip, -(pair.transfer.T @ force), rigid[count:]),
    ]


def _traction(
    system: Tribosystem, phase: int, pressure: Array, temperatures: tuple[Array, Array] | None, worn: WornDepths | None
) -> Array:
    """Return the traction of friction on the punch over this pressure, in space (n, 3); collective."""
    friction, surfaces = system.laws.friction, None
    if not friction.constant and temperatures is not None and system.bodies.heat:
        punch, strip = (
            body.trace.pick(values[:, None])[:, 0, 0]
            for body, values in zip(system.bodies.heat, temperatures, strict=True)
        )
        surfaces = (system.pair.punch.spread.T @ punch, system.pair.transfer @ strip)
    mu = friction.values(system.phases.conditions(phase, pressure, surfaces, worn))
    return system.phases.ratio_in_space(phase, mu)


def _solve(elastic: ElasticBody, load: Array, rigid: Array, warm: tuple[HeatBody, Array] | None) -> Fields:
    """Return one body's fields under forces on its contact surface's trace nodes (N, 3), N/mm; collective."""
    fields: Fields = {}
    change: fem.Function | None = None
    thermal: Array = np.zeros(1)
    if warm is not None:
        heat, temperature = warm
        change = heat.function(temperature - heat.heat.initial)
        coupling = elastic.thermal_coupling(heat.space)
        thermal = times(coupling, change.x.array[: heat.owned])
        coupling.destroy()
        fields["temperature"] = theta = heat.function(temperature)
        fields["heat_flux"] = _interpolated(heat.law.flux(theta), elastic, "heat_flux", (elastic.dim,))
    fields["displacement"] = displacement = _displacement(elastic, load, rigid, thermal)
    out_of_plane = None
    if elastic.dim == 2 and load[:, 1].any():
        out_of_plane = shear_out_of_plane(elastic, elastic.on_trace(load)[:, 1])
        fields["displacement_out_of_plane"] = out_of_plane
    components = _stress(elastic, displacement, out_of_plane, change)
    fields["stress"] = _interpolated(ufl.as_vector(components), elastic, "stress", (len(STRESS),))
    fields["von_mises"] = _interpolated(_von_mises(*components), elastic, "von_mises", ())
    return fields


def _displacement(elastic: ElasticBody, load: Array, rigid: Array, thermal: Array) -> fem.Function:
    """Return a body's displacement (mm) under such forces, and those of its heat (owned,), N/mm; collective."""
    force, dim = elastic.load.copy(), elastic.dim
    on_surface = elastic.trace.place(in_model(elastic.on_trace(load), dim)[:, :, None])
    couple = elastic.guided_resultant[:, None] + elastic.couple_of(on_surface)
    force += on_surface[:, 0]
    force[elastic.supported] = 0.0
    force += thermal
    displacement = fem.Function(elastic.space, name="displacement")
    owned = dim * elastic.space.dofmap.index_map.size_local
    solved = elastic.held(elastic.solve(force)[:, None], force[:, None], couple)[:, 0]
    displacement.x.array[:owned] = solved + elastic.imposed.x.array[:owned]
    for mode, amplitude in zip(elastic.rigid_modes, rigid, strict=True):
        displacement.x.array[:owned] += amplitude * mode
    displacement.x.scatter_forward()
    return displacement


def _stress(elastic: ElasticBody, displacement: Any, out_of_plane: Any, change: Any) -> tuple[Any, ...]:
    """Return the components of the stress by `STRESS` in UFL, those out of the plane included."""
    sigma = elastic.law.stress(displacement)
    if change is not None:
        sigma = sigma - elastic.law.thermal_stress(change)
    xy = yz = 0.0 * sigma[0, 0]
    if out_of_plane is not None:
        slope = elastic.law.shear_modulus * shear_strain(out_of_plane, elastic.law.kind)
        xy, yz = slope[0], slope[1]
    if sigma.ufl_shape[0] == 2:
        out = elastic.law.stress_out_of_plane(displacement, change)
        return sigma[0, 0], out, sigma[1, 1], xy, yz, sigma[0, 1]
    if elastic.law.kind != "axisymmetric":
        xy, yz = sigma[0, 1], sigma[1, 2]
    return sigma[0, 0], sigma[1, 1], sigma[2, 2], xy, yz, sigma[0, 2]


def _von_mises(xx: Any, yy: Any, zz: Any, xy: Any, yz: Any, xz: Any) -> Any:
    """Return sqrt(3/2 s : s), s the deviator of the stress."""
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return ufl.sqrt(normal / 2 + 3 * (xy**2 + yz**2 + xz**2))


def _interpolated(expression: Any, elastic: ElasticBody, name: str, shape: tuple[int, ...]) -> fem.Function:
    """Return the expression on the body's nodes, averaged between the elements that share one."""
    mesh, degree = elastic.body.mesh, elastic.space.ufl_element().degree
    broken = fem.functionspace(mesh, basix.ufl.element("DG", mesh.basix_cell(), degree, shape=shape))
    values = fem.Function(broken)
    if elastic.law.kind == "axisymmetric":  # on the axis u / r has no value: taken at points inside the elements
        inner = fem.functionspace(mesh, _inside_cells(mesh.basix_cell(), degree, shape))
        within = fem.Function(inner)
        interpolate(expression, within)
        values.interpolate(within)
    else:
        interpolate(expression, values)
    smooth = fem.functionspace(mesh, basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=shape))
    sums, counts = fem.Function(smooth, name=name), fem.Function(smooth)
    size = smooth.dofmap.bs
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    to = smooth.dofmap.list[:cells].ravel()
    from_ = broken.dofmap.list[:cells].ravel()
    for component in range(size):
        np.add.at(sums.x.array, to * size + component, values.x.array[from_ * size + component])
        np.add.at(counts.x.array, to * size + component, 1.0)
    for function in (sums, counts):
        function.x.scatter_reverse(dolfinx.la.InsertMode.add)
    sums.x.array[:] /= np.maximum(counts.x.array, 1.0)
    sums.x.scatter_forward()
    return sums


def _inside_cells(cell: Any, degree: int, shape: tuple[int, ...]) -> Any:
    """Return the element whose nodes are Gauss-Legendre points, none on an element's edge."""
    variant = basix.LagrangeVariant.gl_warped
    return basix.ufl.element("DG", cell, degree, lagrange_variant=variant, shape=shape)


def write_fields(
    directory: Path,
    system: Tribosystem,
    half_cycle: int,
    fields: tuple[Fields, Fields],
    direction: int,
    worn: WornDepths,
    pressure: Array,
) -> None:
    """Write the fields of a half-cycle into `directory`/fields; collective.

    Args:
        directory: Of the run.
        system: The assembled problem.
        half_cycle: Its number.
        fields: Of punch and strip.
        direction: Sliding direction d.
        worn: Depths at its end.
        pressure: Of the contact (n,), MPa.

    Raises:
        OutputError: they cannot be written.
    """
    comm = system.bodies.comm
    folder = directory / FOLDER
    nodes = sum(body.space.dofmap.index_map.size_global for body in (system.bodies.punch, system.bodies.strip))
    on_root(comm, lambda: _make_folder(folder, BYTES_PER_NODE * nodes + BYTES_PER_RANK * comm.size))
    stem = f"half_cycle_{half_cycle:06d}"
    data: dict[str, Any] = {}
    for elastic, body in zip((system.bodies.punch, system.bodies.strip), fields, strict=True):
        data.update(_gathered(elastic, [body[name] for name in MEANINGS if name in body]))
        data.update(_groups(elastic))
    time = float(system.sliding.time(np.array(half_cycle)))
    attributes = {"half_cycle": half_cycle, "direction": direction, "time": time, **_frame(system)}
    attributes["directions"] = " ".join(system.sliding.words.values())
    data.update(_contact_surfaces(system, worn, pressure))
    _in_degrees(data, system)
    data = {name: (*values, system.case.names.meant(attributes)) for name, (*values, attributes) in data.items()}
    import xarray  # with pandas, half a second that runs without fields spare themselves

    on_root(comm, lambda: _write_nodal(xarray.Dataset(data, attrs=attributes), folder, stem))


def _in_degrees(data: dict[str, Any], system: Tribosystem) -> None:
    """Put temperatures on the scale of the case."""
    degrees = degrees_of(system.case)
    for name in ("punch_temperature", "strip_temperature"):
        if name in data:
            over, values, attributes = data[name]
            data[name] = (over, degrees.of(values), {**attributes, "units": degrees.unit})


def _frame(system: Tribosystem) -> dict[str, Any]:
    """Return the model of solids and rings, the strip's way in the middle of the contact and the normal there (3,)."""
    pair, kind = system.pair, system.bodies.punch.law.kind
    if kind in ("stress", "strain"):
        return {}
    normal = in_space(pair.weights[None] @ pair.normal)[0]
    normal /= np.linalg.norm(normal)
    middle = pair.weights[None] @ pair.punch.x / pair.weights.sum()
    velocity = system.sliding.field.velocity(middle)[0]
    velocity -= (velocity @ normal) * normal
    size = float(np.linalg.norm(velocity))
    if size < 1e-9 * pair.punch.extent():  # a pin that spins on its own axis
        velocity, size = np.eye(3)[0], 1.0
    return {"model": kind, "along": velocity / size, "normal": normal}


def _contact_surfaces(system: Tribosystem, worn: WornDepths, pressure: Array) -> dict[str, Any]:
    """Return where the contact nodes of both bodies are, their pressure and wear, and what no mesh follows of it."""
    rest = worn if system.bodies.moved is None else worn - system.bodies.moved
    pair = system.pair
    data: dict[str, Any] = {}
    force = pair.wear_interpolation.T @ (pair.weights * pressure)
    surfaces = (
        ("punch", pair.punch, rest.punch, worn.punch, pressure),
        ("strip", pair.strip, rest.strip, worn.strip, force / pair.strip.weights),
    )
    for name, nodes, depth, total_depth, p in surfaces:
        at = f"{name}_contact"
        data |= {f"{at}_{axis}": (at, nodes.x[:, k], {"units": "mm"}) for k, axis in enumerate(AXES[nodes.dim])}
        data[f"{at}_wear"] = (at, depth, {"units": "mm", "long_name": "worn depth that the mesh does not follow"})
        data[f"{at}_depth"] = (at, total_depth, {"units": "mm", "long_name": "worn depth"})
        data[f"{at}_pressure"] = (at, p, {"units": "MPa", "long_name": "contact pressure"})
    return data


def _make_folder(folder: Path, size: int) -> None:
    with writing(folder):
        folder.mkdir(exist_ok=True)
    check_room(folder, size)


def _write_nodal(dataset: xarray.Dataset, folder: Path, stem: str) -> None:
    from fenwear.results.hdf5 import append, step_of, write  # HDF5, which a steady state does without

    with replacing(folder / f"{stem}.nc") as part:
        write(part, dataset)
    append(folder / SERIES, step_of(dataset))


def _gathered(elastic: ElasticBody, functions: list[fem.Function]) -> dict[str, Any]:
    """Return a body's nodes, cells and nodal values as variables of a dataset, on rank 0; collective."""
    comm, space, name = elastic.body.mesh.comm, elastic.space, elastic.body.name
    index_map, degree, dim = space.dofmap.index_map, space.ufl_element().degree, elastic.dim
    cells = space.dofmap.list[: elastic.body.mesh.topology.index_map(dim).size_local]
    corners = _corners(elastic.body.mesh.basix_cell().name, degree)
    linear = index_map.local_to_global(cells[:, corners].reshape(-1).astype(np.int32)).reshape(-1, corners.shape[1])
    x = space.tabulate_dof_coordinates()[: index_map.size_local, :dim]
    parts = comm.gather((x, linear))
    gathered = [(f.name, comm.gather(_on_nodes(f, elastic))) for f in functions]
    if comm.rank != 0:
        return {}
    point, cell = f"{name}_point", f"{name}_cell"
    points = np.concatenate([p[0] for p in parts])
    data: dict[str, Any] = {f"{name}_{a}": (point, points[:, k], {"units": "mm"}) for k, a in enumerate(AXES[dim])}
    # Bodies of different elements have corners of their own.
    corner = "corner" if dim == 2 else f"{name}_corner"
    data[f"{name}_cells"] = ((cell, corner), np.concatenate([p[1] for p in parts]), {"degree": degree})
    for field, values in gathered:
        joined = np.concatenate(values)
        units, text = MEANINGS[field]
        parts_of = STRESS if field == "stress" else AXES[dim] if joined.shape[1] > 1 else ("",)
        for k, component in enumerate(parts_of):
            attributes = {
                "units": units,
                "long_name": f"{text} of the {name}" + (f", {component}" if component else ""),
            }
            data[f"{name}_{field}{'_' if component else ''}{component}"] = (point, joined[:, k], attributes)
    return data


def _groups(elastic: ElasticBody) -> dict[str, Any]:
    """Return where the named groups of a plane body's boundary are: lines (count, 2, 2), points (count, 1, 2); mm."""
    if elastic.dim != 2:
        return {}
    body, mesh, data = elastic.body, elastic.body.mesh, {}
    owned = mesh.topology.index_map(1).size_local
    for group, tag in sorted(body.curves.items()):
        facets = body.facet_tags.find(tag)
        ends = facet_nodes(mesh, facets[facets < owned])[:, :2]
        lines = np.concatenate(mesh.comm.allgather(mesh.geometry.x[ends][:, :, :2]))
        name = f"{body.name}_group_{group}"
        data[name] = ((f"{name}_line", "end", "axis"), lines, {"units": "mm"})
    for group, points in sorted(body.points.items()):
        name = f"{body.name}_group_{group}"
        where = np.asarray(points)[:, None, :2]
        data[name] = ((f"{name}_line", "point", "axis"), where, {"units": "mm", "long_name": f"points of {group}"})
    return data


def _on_nodes(function: fem.Function, elastic: ElasticBody) -> Array:
    """Return the owned nodal values in the order of the displacement's nodes.

    Spaces of the same mesh and degree may number their nodes differently: go by the cells.
    """
    space, size = elastic.space, function.function_space.dofmap.bs
    index_map = space.dofmap.index_map
    count = index_map.size_local + index_map.num_ghosts
    values = np.zeros((count, size))
    to, from_ = space.dofmap.list.ravel(), function.function_space.dofmap.list.ravel()
    values[to] = function.x.array.reshape(-1, size)[from_]
    return values[: index_map.size_local]


def _corners(cell: str, degree: int) -> NDArray[np.int64]:
    """Return the corners of the linear cells between the nodes of one element, around each."""
    corners = linear_cells(cell, degree)
    # In the plane all have four: of triangles the last one twice.
    return np.hstack([corners, corners[:, 2:]]) if cell == "triangle" else corners
