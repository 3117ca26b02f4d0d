"""A finite body whose contact is finer than its mesh: a half-space, and a correction that its mesh is solved for.

    G(x, y) = G_half(x, y) + sum of L_i(x) C_ij L_j(y)

The first is singular, exact, and the same everywhere: products go by fast Fourier transforms over the contact grid, of
any number of nodes. The second is what the body does otherwise (supports, sides, bottom, layers below, free rigid
motions): smooth while the contact is away from other boundaries, so that a few tens of points and a mesh that is coarse
at the contact give it (`correction`). Where it is not, the coefficients of its polynomials do not fall, and it is
rejected. Nothing of the set-up depends on the number of contact nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fenwear.algebra.factor import entries
from fenwear.algebra.tensor_interpolation import TensorWeights
from fenwear.bodies.contact_surface import contact_tag
from fenwear.bodies.convolution import Convolution, GridOperator
from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.grid_surface import RegularGrid
from fenwear.bodies.guides import GuideAnswer
from fenwear.bodies.half_space import HalfSpace, extent_along
from fenwear.bodies.half_space_correction import (
    Correction,
    Ground,
    below,
    coefficients,
    constants_of,
    correct,
    interpolation,
)
from fenwear.bodies.response import Request
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import total

FEWEST, MOST = 5, 17  # points along an axis
PER_DEPTH = 2.5  # further points for each distance of the next boundary that the grid is long
RESOLVED, TRUSTED = 1e-3, 1e-2  # of the half-space's mean over the grid: what polynomials should, and may leave out
FALLS = 0.7  # of what polynomials leave out: by how much two more points along an axis have to lessen it
UNEVEN = 0.1  # of the same mean: what may not be symmetric, by coarse elements or a strongly curved surface
OF_SQUARE, OF_LINE = 2.97, 1.5  # mean of s / r, and of ln(s / r), over two points of a square or line of side s
LARGE = 2**25  # entries of a factor, a quarter of a GiB, above which it is not kept beside the contact


@dataclass(frozen=True)
class FineBody(GridOperator):
    """A half-space and what a finite body does otherwise.

    Attributes:
        half: The half-space, on the nodes of the grid.
        grid: Where the correction is known: the contact's grid, or how far it may grow.
        correction: Between its points.
        weights: L, from values at the points to the nodes.
        unresolved: Rest that the correction's polynomials leave out, over the half-space's mean compliance over the
            grid.
        loaded: Displacement of each point by the loads (m, d), mm.
    """

    half: HalfSpace
    grid: RegularGrid
    correction: Correction
    weights: TensorWeights
    unresolved: float
    loaded: Array
    by_temperature: Array | None = None

    @property
    def directions(self) -> Array:
        """Unit vectors (q, d, a)."""
        return self.half.directions

    @property
    def by_load(self) -> Array:
        """Displacement by the loads (q, d), mm."""
        return self.weights.to_nodes(self.loaded)

    @property
    def places(self) -> NDArray[np.int64]:
        """Whole numbers of each node along the axes of the grid (q, d - 1)."""
        return self.half.places

    @cached_property
    def convolution(self) -> Convolution:
        """C along its directions, by forces along the model's axes."""
        return replace(self.half.convolution, smooth=[(self.weights, self.correction.response)])

    def at(self, x: Array) -> FineBody:
        """Return the operator with nodes at other places of the body (q, d), mm."""
        half = self.half.at(x)
        weights = at_nodes(self.correction, self.grid, half.places, x[:, self.grid.axes], half.spacing)
        return replace(self, half=half, weights=weights)

    def under(self, elastic: ElasticBody) -> FineBody:
        """Return the operator under other loads, those of `elastic`; collective."""
        return replace(self, loaded=by_loads(elastic, self.correction, self.half.directions[0]))


def by_loads(elastic: ElasticBody, correction: Correction, along: Array) -> Array:
    """Return the displacements at a correction's points (m, d) by the body's loads, along (d, a); collective."""
    comm = elastic.body.mesh.comm
    displacements = total(comm, np.asarray(np.tensordot(elastic.load, correction.fields, 1), dtype=np.float64))
    answer, rotations, moved = correction.guided
    work = total(comm, answer.moved.T @ elastic.load)
    displacements = displacements + answer.change(rotations, moved, elastic.guided_resultant, work) @ along
    return np.asarray(displacements @ along.T)


def at_nodes(
    correction: Correction, grid: RegularGrid, places: NDArray[np.int64], x: Array, spacing: Sequence[float]
) -> TensorWeights:
    """Return the weights from values at the points of a correction to nodes.

    Args:
        correction: Between its points.
        grid: Over which these stand.
        places: Of the nodes along the axes of their own grid (q, d - 1).
        x: Of the nodes (q, d - 1), mm.
        spacing: Of their grid, mm.
    """
    low, factors = places.min(axis=0), []
    for k, count in enumerate(correction.counts):
        first = x[np.argmin(places[:, k]), k]
        along = first + spacing[k] * np.arange(np.ptp(places[:, k]) + 1)
        factors.append(interpolation(count, grid.corner[k], grid.corner[k] + grid.sides[k], along))
    return TensorWeights(tuple(factors), places - low)


def fine(request: Request) -> FineBody:
    """Return a body on a contact grid, as a half-space and a correction; collective.

    Raises:
        CaseError: there is no grid, it is of rings or not isotropic, several materials touch, or the correction is not
            smooth: it says by which number.
        ConvergenceError: its stiffness has no factor.
    """
    elastic, key = request.elastic, f"{request.elastic.body.name}.operator"
    grid = elastic.surface.grid
    if grid is None:
        raise CaseError(InputError("grid", f"missing, but required with {key} = 'fine': the nodes of the contact"))
    if elastic.law.kind == "axisymmetric":
        raise CaseError(InputError(key, "expected 'condensed' for rings: 'fine' is of plane models and solids"))
    ground = _ground(elastic, key)
    x = request.places[:, grid.axes]
    half = HalfSpace(
        np.rint((x - grid.corner) / grid.spacing).astype(np.int64),
        grid.spacing,
        ground.shear,
        ground.poisson,
        axes=(*grid.axes, grid.normal),
        outward=ground.outward,
        depth=ground.depth,
        along=request.even_direction,
    )
    direction = np.ascontiguousarray(half.directions[0])
    entry = elastic.known.get(direction.tobytes())
    if entry is None or not entry[2].holds(ground.grid):
        correction, unresolved = _resolved(elastic, ground, direction.T, key)
        guided = _guided(request, correction, at_nodes(correction, ground.grid, half.places, x, grid.spacing))
        entry = _held(replace(correction, guided=guided), direction), unresolved, ground.grid
        if entries(elastic.size, elastic.dim) > LARGE:  # else it waits for the fields of the end
            elastic.free_factor()
        elastic.known[direction.tobytes()] = entry  # it stays on other grids
    correction, unresolved, over = entry
    weights = at_nodes(correction, over, half.places, x, grid.spacing)
    return FineBody(half, over, correction, weights, unresolved, by_loads(elastic, correction, direction))


def _guided(request: Request, correction: Correction, weights: TensorWeights) -> tuple[GuideAnswer, Array, Array]:
    """Return the answer of a body to its guides, and rotations and displacements by couples at points; collective.

    The correction is of supports at points, about which couples turn the body far: what turns goes by the moments that
    the correction has, and the rest of what couples move by polynomials through the nodes.

    Args:
        request: Of the body.
        correction: With the moments of unit forces at its points about what guides hold (m, d, g).
        weights: L, from values at the points to the nodes, of a whole grid.

    Returns:
        Of the whole body, and (m, d, g) of each at the points.
    """
    elastic, (answer, moments, _) = request.elastic, correction.guided
    reach = elastic.reach
    bent = answer.moved_there - answer.rotations_there @ answer.turning
    if reach is None:
        seen = request.seen(elastic.on_surface(bent))
    else:
        seen = np.asarray(reach.reading @ bent.reshape(len(bent), -1))
        weights = at_nodes(correction, reach.grid, reach.grid.places, reach.grid.flat, reach.grid.spacing)
    fit = weights.fitted(seen.reshape(len(seen), -1))
    return answer, moments, fit.reshape(moments.shape) + moments @ answer.turning


def _held(correction: Correction, along: Array) -> Correction:
    """Return a correction with the guides, for displacements along directions (d, a)."""
    answer, rotations, moved = correction.guided
    couple, work = (fields.reshape(len(fields) * fields.shape[1], -1).T for fields in (rotations, moved))
    change = answer.change(rotations, moved, couple, work).reshape(*rotations.shape[:2], *rotations.shape[:2])
    return replace(correction, response=correction.response + np.einsum("da,idjk->iajk", along, change))


def _resolved(elastic: ElasticBody, ground: Ground, along: Array, key: str) -> tuple[Correction, float]:
    """Return a correction whose polynomials resolve it, and by how much they may not; collective.

    Raises:
        CaseError: none does.
    """
    low, high = extent_along(elastic, ground.grid.normal)
    wanted = FEWEST + PER_DEPTH * np.maximum(ground.grid.sides / (high - low) - 1, 0)
    counts = [min(int(np.ceil(count)), MOST) for count in wanted]
    before: Array = np.full(len(counts), np.inf)
    while True:
        correction = correct(elastic, ground, tuple(counts), along)
        rests = rest_of(correction, ground)
        refined = (rests > RESOLVED) & (np.array(counts) < MOST) & (rests < FALLS * before)
        if not refined.any():
            break
        counts = [min(count + 2 * int(refine), MOST) for count, refine in zip(counts, refined, strict=True)]
        before = np.where(refined, rests, before)
    if not rests.max() <= TRUSTED:
        message = (
            f"the {elastic.body.name}'s difference from a half-space is not smooth at the contact: polynomials "
            f"through {' x '.join(map(str, counts))} points leave {100 * rests.max():.2g} % of the compliance. "
            f"'fine' allows at most {100 * TRUSTED:.2g} %. Set a smaller grid.size, so that the contact keeps away "
            "from edges, or use 'condensed'"
        )
        raise CaseError(InputError(key, message))
    uneven = correction.uneven / _mean_compliance(ground)
    if uneven > UNEVEN:
        message = (
            f"the {elastic.body.name}'s difference from a half-space violates Betti's theorem by "
            f"{100 * uneven:.2g} % of the half-space's compliance. 'fine' allows at most {100 * UNEVEN:g} %. "
            "Use smaller elements, a smaller grid.size (the contact should be small against the radius of the "
            "surface), or 'condensed'"
        )
        raise CaseError(InputError(key, message))
    return correction, float(rests.max())


def rest_of(correction: Correction, ground: Ground) -> Array:
    """Return the remainder of the correction's polynomials along each axis of the grid (d - 1,).

    Over the mean of the half-space's compliance over the grid. From the last two orders and the two before them, as
    the coefficients of a smooth function fall by the same factor from order to order.
    """
    to_orders: Array = np.ones((1, 1))
    numbers: NDArray[np.int64] = np.zeros((1, 0), dtype=np.int64)
    for count in correction.counts:
        to_orders = np.asarray(np.kron(to_orders, coefficients(count)), dtype=np.float64)
        degrees = np.tile(np.arange(count), len(numbers))
        numbers = np.column_stack([np.repeat(numbers, count, axis=0), degrees])
    orders = np.einsum("pi,iajd->pajd", to_orders, correction.response)
    mean, rests = _mean_compliance(ground), []
    for axis, count in enumerate(correction.counts):
        pairs = [(count - 2, count), (count - 4, count - 2)]
        sizes = [
            float(np.sqrt((orders[(numbers[:, axis] >= low) & (numbers[:, axis] < high)] ** 2).sum(axis=0)).max())
            for low, high in pairs
        ]
        rests.append(sizes[0] * min(sizes[0] / max(sizes[1], 1e-300), 1.0) / mean)
    return np.array(rests)


def _mean_compliance(ground: Ground) -> float:
    """Return the mean of the half-space's compliance over the grid, mm/N, in the plane mm/(N/mm)."""
    ease, sides = (1 - ground.poisson) / (2 * np.pi * ground.shear), ground.grid.sides  # 1 / (pi E*) of one body
    return float(ease * OF_SQUARE / np.sqrt(np.prod(sides)) if len(sides) == 2 else 2 * ease * OF_LINE)


def _ground(elastic: ElasticBody, key: str) -> Ground:
    """Return the half-space that a body is at its contact; collective.

    Raises:
        CaseError: several materials touch, or the body is not isotropic.
    """
    grid, comm = elastic.surface.grid, elastic.body.mesh.comm
    if elastic.reach is not None:
        grid = elastic.reach.grid
    assert grid is not None
    mesh = elastic.body.mesh
    facets = below(elastic, grid, elastic.body.facet_tags.find(contact_tag(elastic.body)))
    to_cell = mesh.topology.connectivity(elastic.dim - 1, elastic.dim)
    touching = np.array([to_cell.links(facet)[0] for facet in facets], dtype=np.int64)
    if not comm.allreduce(len(touching)):
        raise CaseError(InputError("grid", f"lies off {elastic.body.name}_contact"))
    low, high = extent_along(elastic, grid.normal)
    outward = float(np.sign(elastic.surface.outward[0, grid.normal]))
    return Ground(grid, outward, *constants_of(elastic, key, touching), high - low)
