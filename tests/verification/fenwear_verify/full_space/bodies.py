"""Both bodies with nothing condensed, and where the contact sees and pushes them: for comparisons on small meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_array, block_diag, coo_array, csr_array, diags_array

from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear.steps.stick_position import Position
from fenwear.system import Bodies

GUIDES = ("rotations", "couples")


@dataclass(frozen=True)
class WholeBodies:
    """Both stiffnesses, and where the contact nodes of a position see and push the bodies; on rank 0, else empty.

    Couples y and rotations s of guides (`fenwear.bodies.guides`) are further unknowns after the displacements:
    K u + B y, y = R^T of what is pushed, s = -B^T u, and what is seen is that of u + R s.

    Attributes:
        stiffness: K of both (N, N), with ones for what is held; N with the guides' unknowns.
        seen: J_1 and -J_2: the gap and the tangential displacements that displacements make (d n, N).
        pushed: What tractions add to the nodal forces (N, d n), N/mm or N.
        trace: Of the contact nodes of the punch, and of what the strip was condensed onto, each (k d, N).
        sizes: Of the displacements of punch and strip.
    """

    stiffness: csr_array
    seen: csr_array
    pushed: csr_array
    trace: tuple[csr_array, csr_array]
    sizes: tuple[int, int]

    def softened(self, punch: float, strip: float) -> csr_array:
        """Return the stiffness of bodies so many times as soft."""
        if punch == strip == 1.0:
            return self.stiffness
        found, (first, second) = self.stiffness.tocoo(), self.sizes
        rows, columns = found.coords
        last = np.maximum(rows, columns)
        by = np.where(last < first, punch, np.where(last < first + second, strip, 1.0))
        return csr_array((found.data / by, (rows, columns)), shape=found.shape)


def whole_bodies(bodies: Bodies, position: Position, *, moves: bool) -> WholeBodies:
    """Return both bodies with nothing condensed; collective.

    Args:
        bodies: Both.
        position: The place of the strip.
        moves: Whether the strip was condensed onto its own surface.
    """
    pair, both = position.pair, (bodies.punch, bodies.strip)
    back, d = pair.placement.back, position.frame.shape[2]
    shares = csr_array(pair.punch.spread.T), csr_array(pair.transfer)
    frames = [[position.frame[:, k] for k in range(d)], [back(position.frame[:, k]) for k in range(d)]]
    sizes = [body.stiffness.getSize()[0] for body in both]
    read = [
        block_array([[_reading(body, share, along)] for along in ways], format="csr")
        for body, share, ways in zip(both, shares, frames, strict=True)
    ]
    free = diags_array(np.concatenate([_free(body) for body in both]))
    seen = csr_array(block_array([[read[0], -read[1]]]))
    axes = [np.eye(d)[k] for k in range(d)]
    strip_share = csr_array(diags_array(np.ones(len(pair.strip.trace)))) if moves else shares[1]
    traces = [
        block_array([[_reading(body, share, np.tile(axis, (share.shape[0], 1)))] for axis in axes], format="csr")
        for body, share in zip(both, (shares[0], strip_share), strict=True)
    ]
    none = [csr_array((trace.shape[0], size)) for trace, size in zip(traces, reversed(sizes), strict=True)]
    found = WholeBodies(
        csr_array(block_diag([_gathered(body) for body in both])),
        seen,
        csr_array(free @ seen.T @ diags_array(position.weights)),
        (
            csr_array(block_array([[traces[0], none[0]]])),
            csr_array(block_array([[none[1], traces[1]]])),
        ),
        (sizes[0], sizes[1]),
    )
    return found if not any(body.guides.couples.size for body in both) else _guided(found, both, free, position.weights)


def _guided(whole: WholeBodies, both: tuple[ElasticBody, ElasticBody], free: Any, weights: Array) -> WholeBodies:
    """Return both bodies with couples and rotations of their guides as further unknowns; collective."""
    rotations, couples = (csr_array(block_diag([_whole(body, name) for body in both])) for name in GUIDES)
    count, held = rotations.shape[1], free @ couples
    unit, none = csr_array(np.eye(count)), csr_array((count, len(weights)))

    def shown(part: csr_array) -> csr_array:
        return csr_array(block_array([[part, csr_array((part.shape[0], count)), part @ rotations]]))

    moments = rotations.T @ whole.seen.T @ diags_array(weights)
    return WholeBodies(
        csr_array(block_array([[whole.stiffness, held, None], [None, unit, None], [held.T, None, unit]])),
        shown(whole.seen),
        csr_array(block_array([[whole.pushed], [moments], [none]])),
        (shown(whole.trace[0]), shown(whole.trace[1])),
        whole.sizes,
    )


def _whole(body: ElasticBody, name: str) -> csr_array:
    """Return rotations or couples of guides on all degrees of freedom of a body (N, g), on every rank; collective."""
    return csr_array(np.concatenate(body.body.mesh.comm.allgather(getattr(body.guides, name))))


def _gathered(body: ElasticBody) -> csr_array:
    """Return the whole stiffness on rank 0, nothing on others; collective."""
    starts, columns, values = body.stiffness.getValuesCSR()
    size = body.stiffness.getSize()[0]
    own = csr_array((values, columns, starts), shape=(len(starts) - 1, size))
    parts = body.body.mesh.comm.gather(own.tocoo())
    if parts is None:
        return csr_array((size, size))
    return csr_array(block_array([[part] for part in parts]))


def _free(body: ElasticBody) -> Array:
    """Return 1 for each degree of freedom of the whole body that no support holds, on every rank; collective."""
    own = np.ones(body.stiffness.getLocalSize()[0])
    own[body.supported] = 0.0
    return np.concatenate(body.body.mesh.comm.allgather(own))


def _reading(body: ElasticBody, shares: csr_array, along: Array) -> csr_array:
    """Return the displacement along vectors (n, d) as nodes see it by their shares of the trace nodes, (n, dofs)."""
    part = csr_array(shares).tocoo()
    rows, nodes = part.coords
    d = body.dim
    columns = d * body.trace.blocks[nodes, None] + np.arange(d)
    values = part.data[:, None] * along[rows]
    places = (np.repeat(rows, d), columns.ravel())
    return csr_array(coo_array((values.ravel(), places), (len(along), body.stiffness.getSize()[0])))
