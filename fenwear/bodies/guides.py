"""Guides that hold a body against turning by a couple, and nothing else.

With the rotation R that a guide takes, and the couple B that it holds it by,

    K u = f - B y,    B^T u = 0,    y = R^T f,    R^T B = 1.

B is spread over the whole body as its inertia against turning would be, so that it dents nothing: M A (A^T M A)^-1 e,
M the mass of unit density, A all rigid motions and e the rotation about the guide's axis. It has no resultant. What is
held is the mean rotation that such forces work on: what couples do and what they hold agree (Maxwell and Betti).
With K^-1 of supports that take the same rotation up at a few nodes, which y leaves unloaded,

    u = K^-1 f - (K^-1 B) y - R (x - Z y),    x = (K^-1 B)^T f,    Z = B^T K^-1 B:

one more solution for each guide, and a change of rank two for each of the body's answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem

from fenwear.arrays import Array
from fenwear.bodies.assembly import assembled_vector, compiled
from fenwear.parallel import total


class Guided(NamedTuple):
    """What guides hold of a part of a body.

    Attributes:
        motions: All rigid motions A of the part, on the owned degrees of freedom (owned, k); zero elsewhere.
        turns: The columns of those that guides hold.
        held: The rotations R that supports leave and guides take, as combinations of the motions (k, g).
    """

    motions: Array
    turns: list[int]
    held: Array


@dataclass(frozen=True)
class Guides:
    """Rotations that guides hold, g of them, on the owned degrees of freedom.

    Attributes:
        rotations: R (owned, g), mm per rad.
        couples: B (owned, g), per thickness.
    """

    rotations: Array
    couples: Array


@dataclass(frozen=True)
class GuideAnswer:
    """What a body answers to its guides.

    Attributes:
        guides: Of the body.
        moved: K^-1 B (owned, g).
        turning: Z (g, g).
        rotations_there, moved_there: R and K^-1 B at the trace nodes of the contact surface (N, d, g).
    """

    guides: Guides
    moved: Array
    turning: Array
    rotations_there: Array
    moved_there: Array

    def change(self, rotations: Array, moved: Array, couple: Array, work: Array) -> Array:
        """Return by how much guides change displacements (..., k) somewhere.

        Args:
            rotations, moved: R and K^-1 B there (..., g).
            couple: y of the forces (g, k).
            work: x of them (g, k).
        """
        return np.asarray(-(moved @ couple) - rotations @ (work - self.turning @ couple))


def make_guides(space: fem.FunctionSpace, measure: Any, parts: Sequence[Guided]) -> Guides:
    """Return the rotations and couples of all guides of a body; collective.

    Args:
        space: Of the displacement.
        measure: Of the body's volume by that of its mesh, in UFL.
        parts: What is held of each part.
    """
    comm, field, v = space.mesh.comm, fem.Function(space), ufl.TestFunction(space)
    mass = compiled(ufl.inner(field, v) * measure * ufl.dx(domain=space.mesh))
    rotations, couples = [], []
    for part in parts:
        motions, turns, held = part.motions, part.turns, part.held
        weighed = np.empty_like(motions)
        for k in range(motions.shape[1]):
            field.x.array[: len(motions)] = motions[:, k]
            field.x.scatter_forward()
            weighed[:, k] = assembled_vector(mass)
        inertia = total(comm, motions.T @ weighed)
        unit = np.eye(len(inertia))[:, turns]
        pure = weighed @ np.linalg.solve(inertia, unit)
        rotations.append(motions @ held)
        couples.append(pure @ np.linalg.pinv(held[turns].T))  # R^T of pure couples: held[turns].T
    return Guides(np.concatenate(rotations, axis=1), np.concatenate(couples, axis=1))
