"""Means that fix what supports leave free: guides hold rotations, and free motions are measured where loads act.

A guide holds a body against turning by a couple, and by nothing else.

With the rotation R that a guide takes, and the couple B that it holds it by,

    K u = f - B y,    B^T u = 0,    y = R^T f,    R^T B = 1.

B is spread over the whole body as its inertia against turning would be, so that it dents nothing: M A (A^T M A)^-1 e,
M the mass of unit density, A all rigid motions and e the rotation about the guide's axis. B has no resultant. Guides
hold the mean rotation that such forces work on: what couples do and what they hold agree (Maxwell and Betti). With K^-1
of supports that take the same rotation up at a few nodes, which y leaves unloaded,

    u = K^-1 f - (K^-1 B) y - R (x - Z y),    x = (K^-1 B)^T f,    Z = B^T K^-1 B:

one more solution for each guide, and a change of rank two for each of the body's answer.

A rigid motion R that is free has no value of its own beside elastic displacements: it depends on what is called
undeformed. The same change of K^-1 fixes it. With B = M R (R^T M R)^-1, M the mass of the surfaces on which loads act
(of the body's volume where none does), u has no mean motion of those surfaces, and the amplitude of R is theirs, in
least squares. Loads and contact balance: y = 0, and no pressure depends on B.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import dolfinx.fem.petsc  # noqa: F401  (makes fem.petsc)
import numpy as np
import ufl
from dolfinx import fem

from fenwear.algebra.assembled import assembled_vector, compiled
from fenwear.common.arrays import Array
from fenwear.common.parallel import total


class Loose(NamedTuple):
    """The rigid motions that supports leave a part of a body.

    Attributes:
        motions: All rigid motions A of the part, on the owned degrees of freedom (owned, k); zero elsewhere.
        turns: The columns of those that guides hold.
        held: The rotations R that supports leave and guides take, as combinations of the motions (k, g).
        free: The rigid modes that neither takes, as combinations of the motions (k, f).
    """

    motions: Array
    turns: list[int]
    held: Array
    free: Array


@dataclass(frozen=True)
class Guides:
    """Rotations that guides hold and rigid modes that stay free, g of them, on the owned degrees of freedom.

    Attributes:
        rotations: R (owned, g), mm per rad; of free translations mm per mm.
        couples: B (owned, g), per thickness.
    """

    rotations: Array
    couples: Array


@dataclass(frozen=True)
class GuideAnswer:
    """Response of a body to its guides.

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


def make_guides(space: fem.FunctionSpace, weight: Any, loaded: ufl.Measure | None, parts: Sequence[Loose]) -> Guides:
    """Return the rotations and couples of all guides of a body, then its free modes and their means; collective.

    Args:
        space: Of the displacement.
        weight: Volume of a unit of the mesh's volume.
        loaded: The surfaces on which loads act; None without loads.
        parts: Motions of each part that supports leave free.
    """
    comm, owned = space.mesh.comm, space.dofmap.index_map.size_local * space.dofmap.index_map_bs
    rotations, couples = [np.zeros((owned, 0))], [np.zeros((owned, 0))]
    volume = ufl.dx(domain=space.mesh)
    for motions, turns, held, free in parts:
        mass = _weighed(space, weight, volume, motions)
        pure = mass @ np.linalg.solve(total(comm, motions.T @ mass), np.eye(motions.shape[1])[:, turns])
        loose = np.concatenate([held, free], axis=1)
        spread = mass if loaded is None else _weighed(space, weight, loaded, motions)
        inertia = loose.T @ total(comm, motions.T @ spread) @ loose
        if not np.diag(inertia).all():  # no load acts on this part
            spread, inertia = mass, loose.T @ total(comm, motions.T @ mass) @ loose
        means = spread @ loose @ np.linalg.inv(inertia)
        rotations.append(motions @ loose)
        # R^T of pure couples: held[turns].T
        couples.append(np.concatenate([pure @ np.linalg.pinv(held[turns].T), means[:, held.shape[1] :]], axis=1))
    return Guides(np.concatenate(rotations, axis=1), np.concatenate(couples, axis=1))


def _weighed(space: fem.FunctionSpace, weight: Any, measure: ufl.Measure, motions: Array) -> Array:
    """Return M A (owned, k) of motions A (owned, k), M the mass of unit density over a measure; collective."""
    field, v = fem.Function(space), ufl.TestFunction(space)
    mass = compiled(ufl.inner(field, v) * weight * measure)
    weighed = np.empty_like(motions)
    for k in range(motions.shape[1]):
        field.x.array[: len(motions)] = motions[:, k]
        field.x.scatter_forward()
        weighed[:, k] = assembled_vector(mass)
    return weighed
