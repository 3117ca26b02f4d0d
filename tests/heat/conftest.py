"""Bodies of simple shape for exact solutions: a rectangle, and two rectangles on each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_rectangle, locate_entities, locate_entities_boundary, meshtags
from mpi4py import MPI

from fenwear import Case, Tribosystem, assemble, make_case
from fenwear.bodies.distributed_mesh import BodyMesh
from fenwear.bodies.elastic_material import isotropic
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Body, Heat, Material
from fenwear.heat.conduction import HeatBody
from fenwear.heat.fourier_law import isotropic_conduction

SIDES, BOTTOM, CONTACT = 1, 2, 3


@pytest.fixture(scope="session")
def rectangle() -> Callable[..., BodyMesh]:
    """Return rectangle(width, height, cells, layers=[...]): a strip in [0, width] x [0, height], contact on top.

    `layers` are the heights where a region ends and the next one, strip_0, strip_1, ..., begins.
    """

    def rectangle(
        width: float = 1.0,
        height: float = 1.0,
        cells: tuple[int, int] = (4, 4),
        layers: Sequence[float] = (),
        kind: CellType = CellType.quadrilateral,
    ) -> BodyMesh:
        mesh = create_rectangle(MPI.COMM_WORLD, [(0, 0), (width, height)], cells, kind)
        count = mesh.topology.index_map(2).size_local + mesh.topology.index_map(2).num_ghosts
        regions = np.full(count, 10, dtype=np.int32)
        for number, level in enumerate(layers, start=1):
            regions[locate_entities(mesh, 2, lambda x, level=level: x[1] > level - 1e-9)] = 10 + number
        facets = np.concatenate(
            [
                locate_entities_boundary(mesh, 1, where)
                for where in (
                    lambda x: np.isclose(x[0], 0) | np.isclose(x[0], width),
                    lambda x: np.isclose(x[1], 0),
                    lambda x: np.isclose(x[1], height),
                )
            ]
        )
        middle = np.array([mesh.geometry.x[n].mean(axis=0) for n in _vertices(mesh, facets)]).reshape(-1, 3)
        tags = np.where(np.isclose(middle[:, 1], 0), BOTTOM, np.where(np.isclose(middle[:, 1], height), CONTACT, SIDES))
        order = np.argsort(facets)
        return BodyMesh(
            "strip",
            mesh,
            meshtags(mesh, 2, np.arange(count, dtype=np.int32), regions),
            meshtags(mesh, 1, facets[order], tags[order].astype(np.int32)),
            {f"strip_{number}": 10 + number for number in range(len(layers) + 1)},
            {"strip_sides": SIDES, "strip_bottom": BOTTOM, "strip_contact": CONTACT},
            {},
        )

    return rectangle


def _vertices(mesh: Any, facets: Any) -> Any:
    from dolfinx.mesh import entities_to_geometry

    return entities_to_geometry(mesh, 1, facets)


def _description(body: BodyMesh, tables: dict[str, Any]) -> Body:
    return Body.model_validate({"regions": {r: f"m{r.removeprefix('strip_')}" for r in body.regions}, **tables})


def _materials(tables: Sequence[dict[str, float]]) -> dict[str, Material]:
    return {f"m{k}": Material.model_validate(t) for k, t in enumerate(tables)}


@pytest.fixture(scope="session")
def conducting() -> Callable[..., HeatBody]:
    """Return conducting(mesh, degree, materials, heat={}, thickness=1, **body): conduction in a rectangle."""

    def conducting(
        body: BodyMesh,
        degree: int,
        materials: Sequence[dict[str, float]],
        heat: dict[str, Any] | None = None,
        thickness: float = 1.0,
        **tables: Any,
    ) -> HeatBody:
        heat_table = Heat.model_validate(heat or {})
        held = {"supports": [{"on": "strip_sides", "fix": ["x", "z"]}]}
        description, made = _description(body, {**held, **tables}), _materials(materials)
        elastic = ElasticBody(
            body, description, isotropic(body, description.regions, made, "stress"), degree, thickness
        )
        return HeatBody(elastic, description, isotropic_conduction(body, description.regions, made), heat_table)

    return conducting


@pytest.fixture(scope="session")
def blocks() -> Callable[..., Tribosystem]:
    """Return blocks(case, **parameters): two rectangles of the same width on each other, from blocks.geo."""

    def blocks(case: dict[str, Any], **parameters: float) -> Tribosystem:
        geometry = {"file": "blocks.geo", **case.pop("geometry", {}), "parameters": parameters}
        made: Case = make_case({"geometry": geometry, **case})
        return assemble(made)

    return blocks
