"""Whether coatings fit on their bodies."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.sliding.coating import coating_thickness

ALL_WAYS = 0.1  # mean of the unit normals of a surface below which it looks all ways, as a bore does


def check_coatings(case: Case, punch: ElasticBody, strip: ElasticBody) -> None:
    """Make sure that coatings are no thicker than their bodies, at any place; collective.

    Raises:
        CaseError: one is, or it is negative somewhere.
    """
    for body, law, elastic in (("punch", case.wear.punch, punch), ("strip", case.wear.strip, strip)):
        thickness = coating_thickness(law, elastic.surface.unworn, body)
        if thickness is None:
            continue
        there, thickest = _height(elastic), float(thickness.max(initial=0.0))
        if thickest >= there:
            message = f"expected less than the body, which is {there:.4g} mm thick, got {thickest:.4g} mm"
            raise CaseError(InputError(f"wear.{body}.coating.thickness", message))


def _height(elastic: ElasticBody) -> float:
    """Return how far a body reaches along the mean normal of its contact surface, mm; collective."""
    surface, mesh = elastic.surface, elastic.body.mesh
    x = mesh.geometry.x[:, : mesh.geometry.dim]
    normal = surface.weights @ surface.outward / surface.weights.sum()
    size = float(np.linalg.norm(normal))
    along = x @ (normal / size)[:, None] if size > ALL_WAYS else x
    sides = [
        mesh.comm.allreduce(float(one.max(initial=-np.inf)), MPI.MAX)
        - mesh.comm.allreduce(float(one.min(initial=np.inf)), MPI.MIN)
        for one in along.T
    ]
    return max(sides)
