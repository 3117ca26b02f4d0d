"""The contact surfaces of solids and rings in history.nc: nodes, their coordinates, and the facets between them.

Values live on the dimension `node` (`node_strip` for the strip's own material). Coordinates and facets follow the UGRID
conventions (ugrid-conventions.github.io), which programs for maps on meshes read.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array, Mask
from fenwear.assembly import ContactSetup
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.bodies.subcells import linear_cells
from fenwear.interface import ContactPair
from fenwear.sliding.chart import SlidingChart, sliding_chart
from fenwear.sliding.field import SlidingField

SEAM = 3.0  # chords of an element, along a curve: farther apart its ends lie on both sides of a closed curve's seam
UPRIGHT = 1e-6  # of the squares of a facet's sides: seen from above it is a line
ON_FACET = 1e-9  # of a facet: rounding


class Column(NamedTuple):
    """A variable that does not change in a run.

    Attributes:
        dimensions: Their names.
        values: Of these sizes.
        attributes: Units, long name and what else is to be known.
    """

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: dict[str, Any]


def surface_cells(surface: ContactSurface) -> NDArray[np.int64]:
    """Return the pressure nodes around each linear facet (f, 2, 3 or 4)."""
    number = np.full(len(surface.trace), -1)
    number[surface.nodes] = np.arange(len(surface.nodes))
    if surface.cell == "triangle":  # the pressure lives on the vertices
        return number[surface.facets[:, :3]]
    cells = number[surface.facets[:, linear_cells(surface.cell, surface.degree)]]
    cells = cells.reshape(-1, cells.shape[-1])
    return cells[(cells >= 0).all(axis=1)]


def at_places(surface: ContactSurface, values: Array, places: Array, own: Mask | None = None) -> Array:
    """Return nodal values at places on a surface (k,), linear on each of its facets; NaN beside it.

    Args:
        surface: The contact surface of a body.
        values: At its pressure nodes (n,).
        places: Abscissae along a curve (k,), mm; in a solid x and y (k, 2). Where several facets lie one above the
            other, the largest value counts.
        own: Nodes whose facets count (n,).
    """
    cells = surface_cells(surface)
    cells = cells if own is None else cells[own[cells].all(axis=1)]
    if surface.dim == 2:
        begin, end = surface.abscissa[cells].T
        chord = np.linalg.norm(surface.x[cells[:, 1]] - surface.x[cells[:, 0]], axis=1)
        seam = np.abs(end - begin) > SEAM * chord  # of a closed curve
        begin, end = np.where(seam, np.maximum(begin, end), begin), np.where(seam, np.maximum(begin, end) + chord, end)
        cells = np.where((seam & (surface.abscissa[cells[:, 0]] < begin))[:, None], cells[:, ::-1], cells)
        share = (places.reshape(-1, 1) - begin) / (end - begin)
        shares = np.stack([1 - share, share], axis=-1)
    else:
        cells = np.concatenate([cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)])
        corners = surface.x[cells][:, :, :2]
        sides = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
        flat = np.abs(np.linalg.det(sides)) > UPRIGHT * (np.linalg.norm(sides, axis=1) ** 2).sum(axis=1)
        cells, corners, sides = cells[flat], corners[flat], sides[flat]
        two = np.einsum("fij,kfj->kfi", np.linalg.inv(sides), places[:, None] - corners[:, 0])
        shares = np.concatenate([1 - two.sum(axis=-1, keepdims=True), two], axis=-1)
    inside = (shares > -ON_FACET).all(axis=-1)
    found = np.where(inside, (shares * values[cells]).sum(axis=-1), -np.inf).max(axis=1, initial=-np.inf)
    return np.asarray(np.where(np.isfinite(found), found, np.nan))


def rim(surface: ContactSurface) -> Mask:
    """Return which pressure nodes lie on the rim of a contact surface (n,): on a side of one linear facet alone."""
    cells = surface_cells(surface)
    found: Mask = np.zeros(len(surface.nodes), dtype=bool)
    if cells.shape[1] == 2:
        nodes, count = np.unique(cells, return_counts=True)
        found[nodes[count == 1]] = True
        return found
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)  # corners come around
    pairs, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    found[pairs[count == 1].ravel()] = True
    return found


def surface_columns(placed: ContactSetup) -> dict[str, Column]:
    """Return coordinates and facets of the contact surfaces that a history has values on, by name."""
    return columns_of_pair(placed.pair, placed.sliding.field, with_strip=placed.strip_changes)


def columns_of_pair(pair: ContactPair, field: SlidingField, *, with_strip: bool) -> dict[str, Column]:
    """Return coordinates and facets of the punch's contact surface, and of the strip's own, by name."""
    chart = sliding_chart(field, pair)
    columns = _columns(chart, pair.punch, "")
    return columns | _columns(chart, pair.strip, "_strip") if with_strip else columns


def part_columns(placed: ContactSetup, plane: bool) -> dict[str, Column]:
    """Return the named contact that each node of the surfaces is of, and in the plane its part where there are more."""
    ends = {"": placed.pair.punch} | ({"_strip": placed.pair.strip} if placed.strip_changes else {})
    found = {}
    for end, surface in ends.items():
        over = (f"{'x' if plane else 'node'}{end}",)
        if surface.contact is not None:
            flags = {"flag_values": np.arange(len(surface.names)), "flag_meanings": " ".join(surface.names)}
            text = {"units": "1", "long_name": f"contact that each node of the {surface.body} belongs to"}
            found[f"contact{end}"] = Column(over, surface.contact, {**text, **flags})
        part = surface.part
        if plane and part.max() > 0:
            text = {"units": "1", "long_name": f"part of the {surface.body}'s surface that each node belongs to"}
            found[f"part{end}"] = Column(over, part, text)
    return found


def coordinate_names(end: str, dim: int) -> tuple[str, ...]:
    """Return the names of the nodes' coordinates, such as x_strip: r and z of rings, x, y and z of a solid."""
    return tuple(f"{axis}{end}" for axis in (("r", "z") if dim == 2 else ("x", "y", "z")))


def _columns(chart: SlidingChart, surface: ContactSurface, end: str) -> dict[str, Column]:
    node, facet, corner = f"node{end}", f"facet{end}", f"corner{end}"
    names = coordinate_names(end, surface.dim)
    columns = {
        name: Column(
            (node,), surface.unworn[:, k], {"units": "mm", "long_name": f"{name[0]} of the {surface.body}'s nodes"}
        )
        for k, name in enumerate(names)
    }
    if surface.dim == 3:
        along, across = chart.coordinates(surface.x).T
        columns[f"along{end}"] = Column((node,), along, _mm("place along the sliding"))
        columns[f"across{end}"] = Column((node,), across, _mm("place across the sliding"))
    cells, kind = surface_cells(surface), "edge" if surface.dim == 2 else "face"
    facets, mesh = f"facets{end}", f"{surface.body}_surface"
    role = f"{kind}_node_connectivity"
    attributes = {"cf_role": role, "start_index": 0, "units": "1", "long_name": "nodes around each linear facet"}
    columns[facets] = Column((facet, corner), cells, attributes)
    columns[mesh] = Column(
        (),
        np.array(0),
        {
            "cf_role": "mesh_topology",
            "topology_dimension": surface.dim - 1,
            "node_coordinates": " ".join(names),
            role: facets,
            "units": "1",
            "long_name": f"contact surface of the {surface.body}",
        },
    )
    return columns


def _mm(text: str) -> dict[str, Any]:
    return {"units": "mm", "long_name": text}


def on_mesh(dimensions: tuple[str, ...], dim: int) -> dict[str, str]:
    """Return the attributes that tell on which surface a variable lives; none for a series."""
    for end, body in (("", "punch"), ("_strip", "strip")):
        if f"node{end}" in dimensions:
            names = [*coordinate_names(end, dim), *([f"along{end}", f"across{end}"] if dim == 3 else [])]
            return {"mesh": f"{body}_surface", "location": "node", "coordinates": " ".join(names)}
    return {}
