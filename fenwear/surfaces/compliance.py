"""Two bodies joined: relative displacements of their surfaces by forces on the contact, rigid motion and loads.

Forces f on the punch's nodes, and their reactions on the strip, move the punch's surface against the strip's by

    j_i = sum over k of G_ik f_k,    G = G_punch + R^T (X G_strip X^T) R,

with the transfer X of a strip that passes under the punch and the turn R of its place; a layer between them that closes
in proportion to its pressure adds its closure along e_n to the node's own entry. Components of j are computed: along
e_n alone in gross sliding, along e_n and the tangents where nodes stick. A square matrix comes of it by the tractions
of the unknowns: a pressure with its friction, or one along each axis of the contact frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fenwear.bodies.condensation import product
from fenwear.bodies.surface_operators import SurfaceOperator
from fenwear.common.arrays import Array, Nodes
from fenwear.surfaces.equilibrium import RigidEquilibrium
from fenwear.surfaces.grid_compliance import GridCompliance, on_one_grid
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.placement import ZERO, in_model

EVERY, RUN = slice(None), 512  # rows that are taken at once, where whole matrices would take memory
MATRIX = 1000  # nodes up to which a matrix in memory is faster than products, asked for again and again
GRIDDED = 400  # nodes of a grid from where products along all axes are faster
SOME = 64  # nodes whose rows tell the scale of gaps where no numbers are in memory


@dataclass(frozen=True)
class Interface:
    """Two bodies in contact, an operator from nodal forces to the relative displacement of their surfaces.

    In gross sliding gap = S(tau) p + H a + g_load + g_0 + w. Arrays of the bodies' compliance are made at their first
    use, and kept; others are asked each time.

    Attributes:
        rigid: H, F, the nodes and the transfer.
        punch: Response of the punch at its pressure nodes.
        strip: At its trace nodes where it moves as a whole, else at the contact nodes opposite.
        strip_moves: Which of the two.
        frame: Axes along which displacements are asked for, e_n first (n, a, d); None for e_n alone.
        like: One that differs by its loads or by where the strip's material is: what bodies answer is known of it.
        layer: Closure along e_n by unit pressures of what lies between (n,), mm/MPa; 0 of nothing.
    """

    rigid: RigidEquilibrium
    punch: SurfaceOperator
    strip: SurfaceOperator
    strip_moves: bool
    frame: Array | None = None
    like: Interface | None = None
    layer: Array | float = 0.0

    def under(self, rigid: RigidEquilibrium, punch: SurfaceOperator, strip: SurfaceOperator) -> Interface:
        """Return the interface under other loads, or where others of the strip's material face the punch."""
        return Interface(rigid, punch, strip, self.strip_moves, self.frame, like=self._made, layer=self.layer)

    @property
    def pair(self) -> ContactPair:
        """The nodes and the transfer."""
        return self.rigid.pair

    @property
    def _made(self) -> Interface:
        """That for which what the bodies answer is made and kept."""
        return self.like or self

    @cached_property
    def axes(self) -> Array:
        """Along which displacements are asked for (n, a, d)."""
        if self.frame is not None:
            return self.frame
        return in_model(self.pair.normal, self.punch.directions.shape[1])[:, None]

    @cached_property
    def _axes_on_strip(self) -> Array:
        """The axes of the displacements (n, a, d) in the strip's unmoved frame."""
        return self.pair.placement.back(self.axes.reshape(-1, self.axes.shape[2])).reshape(self.axes.shape)

    @property
    def in_memory(self) -> bool:
        """Whether a body answers by numbers in memory."""
        return self.punch.in_memory or self.strip.in_memory

    def apply(self, forces: Array) -> Array:
        """Return the relative displacements (n, a, ...), mm, by forces on the punch (n, d, ...), N/mm or N."""
        if self.in_memory:
            return product(self.dense(), forces)
        relative = self.opened(*self.displaced(forces))
        relative[:, 0] += np.einsum("id,id...->i...", self._closing, forces)
        return relative

    @cached_property
    def _closing(self) -> Array:
        """Closure of what lies between by unit forces along the axes of space at its own node (n, d)."""
        return np.asarray((self.layer / self.pair.weights)[:, None] * self.axes[:, 0])

    def displaced(self, forces: Array) -> tuple[Array, Array]:
        """Return the displacements of both bodies at their operators' patterns by forces on the punch (n, d, ...).

        Displacements of punch and strip (q, a, ...), mm, along the directions of their operators.
        """
        on_punch, on_strip = self.pushed(forces)
        return self.punch.apply(on_punch), self.strip.apply(on_strip)

    def pushed(self, forces: Array) -> tuple[Array, Array]:
        """Return forces on the punch (n, d, ...) and their reactions at the patterns of each operator (q, d, ...)."""
        n, d, *rest = forces.shape
        back = self.pair.placement.back(np.moveaxis(forces, 1, -1).reshape(-1, d)).reshape(n, *rest, d)
        back = np.moveaxis(back, -1, 1)
        if self.strip_moves:
            back = (self.pair.transfer.T @ back.reshape(n, -1)).reshape(-1, *back.shape[1:])
        return forces, -back

    def opened(self, on_punch: Array, on_strip: Array) -> Array:
        """Return the relative displacements (n, a, ...) where the bodies' patterns are displaced as by `displaced`."""
        seen = on_strip
        if self.strip_moves:
            seen = self.pair.transfer @ on_strip.reshape(len(on_strip), -1)
            seen = seen.reshape(-1, *on_strip.shape[1:])
        return _along(self.axes, on_punch) - _along(self._axes_on_strip, seen)

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return displacements at some nodes from unit forces along the axes of space at others (rows, a, columns, d).

        Args:
            rows, columns: Their numbers.
        """
        if self.in_memory:
            kept = self.dense()
            if isinstance(rows, slice) or isinstance(columns, slice):
                return kept[rows][:, :, columns]
            return kept[rows[:, None], :, columns].transpose(0, 2, 1, 3)
        return self.asked(rows, columns)

    def diagonal(self) -> Array:
        """Return displacements at each node from unit forces at itself (n, a, d)."""
        return self._made._diagonal

    @cached_property
    def _diagonal(self) -> Array:
        if self.in_memory:
            every = np.arange(len(self.pair.weights))
            return self.dense()[every, :, every]
        gridded = self.pair.punch.grid is not None
        if (not self.strip_moves or gridded) and self.pair.placement.turn == ZERO:
            below = self.strip.diagonal()
            if self.strip_moves:  # what nodes of the strip's grid have, between them a little more than there is
                read = self.pair.transfer @ below.reshape(len(below), -1)
                below = np.asarray(read).reshape(-1, *below.shape[1:])
            both = zip((self.axes, self._axes_on_strip), (self.punch.diagonal(), below), strict=True)
            blocks = np.asarray(sum(_along(axes, response) for axes, response in both))
            blocks[:, 0] += self._closing
            return blocks
        each = (np.array([node]) for node in range(len(self.pair.weights)))
        return np.concatenate([self.asked(node, node)[:, :, 0] for node in each])

    def dense(self) -> Array:
        """Return all entries (n, a, n, d), which are kept."""
        return self._made._dense

    @cached_property
    def _dense(self) -> Array:
        return self.asked(EVERY, EVERY)

    def asked(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the entries of rows and columns (k, a, m, d), computed from the bodies and not kept."""
        numbers = np.arange(len(self.pair.weights))[rows]
        on_punch = _along(self.axes[numbers], self.punch.entries(rows, columns))
        on_strip = self._on_strip(numbers, rows, columns)
        if self.pair.placement.turn != ZERO:
            d = on_strip.shape[-1]
            on_strip = self.pair.placement.vectors(on_strip.reshape(-1, d)).reshape(on_strip.shape)
        entries = on_punch + on_strip
        if np.any(self.layer):
            to, by = np.equal.outer(numbers, np.arange(len(self.pair.weights))[columns]).nonzero()
            entries[to, 0, by] += self._closing[numbers[to]]
        return entries

    def _on_strip(self, numbers: NDArray[np.int64], rows: Nodes, columns: Nodes) -> Array:
        """Return the strip's displacements at the contact nodes by forces in its own frame."""
        axes, strip = self._axes_on_strip[numbers], self.strip
        if not self.strip_moves:
            return _along(axes, strip.entries(rows, columns))
        transfer = csr_array(self.pair.transfer)
        seen, read = _used(csr_array(transfer[numbers]), rows)
        pushed, push = _used(csr_array(transfer[columns]), columns)
        block = strip.entries(seen, pushed)
        displacements: Array = np.zeros((len(numbers), axes.shape[1], push.shape[0], axes.shape[2]))
        for axis in range(axes.shape[2]):
            for across in range(block.shape[1]):  # along e_n, or each axis, from a force along `axis`
                part = (push @ (read @ block[:, across, :, axis]).T).T
                if block.shape[1] == 1:
                    displacements[:, 0, :, axis] = part
                    continue
                for k in range(axes.shape[1]):
                    displacements[:, k, :, axis] += axes[:, k, across, None] * part
        return displacements

    @cached_property
    def load_gap(self) -> Array:
        """g_load (n,), mm."""
        pair, strip = self.pair, self.strip.by_load
        by_load = pair.transfer @ strip if self.strip_moves else strip
        return np.einsum("id,id->i", self.axes[:, 0], self.punch.by_load) - np.einsum(
            "id,id->i", self._axes_on_strip[:, 0], by_load
        )

    @property
    def by_even(self) -> Array:
        """Gap that an even unit pressure opens without friction (n,), mm/MPa."""
        return self.apply(self.axes[:, 0] * self.pair.weights[:, None])[:, 0]

    def compliance(
        self, friction_ratio: Array | float, scale: float = 1.0, known: dict[bytes, Array] | None = None
    ) -> Compliance:
        """Return S, mm/MPa: the gap from unit pressures with their friction.

        Args:
            friction_ratio: tau (n, d), the traction of friction on the punch over the pressure; 0.0 for none.
            scale: A factor of S.
            known: Tables of convolutions that were made for other phases.
        """
        traction = scale * (self.axes[:, 0] + in_model(np.asarray(friction_ratio), self.axes.shape[2]))
        return Compliance(self, traction[:, :, None], {} if known is None else known)

    @cached_property
    def along_axes(self) -> Compliance:
        """C, mm/MPa: displacements along the axes from unit tractions along them."""
        return Compliance(self, self.axes.transpose(0, 2, 1), {})

    @cached_property
    def pressure_scale(self) -> float:
        """Mean pressure of the loads, MPa; without loads, that of moved supports or overlapping surfaces."""
        closed = max(float(np.abs(self.load_gap).max()), -float(self.pair.initial_gap.min()))
        by_gap = closed / self.elastic_length if closed > 0 and self.elastic_length > 0 else 1.0
        return self.rigid.mean_pressure if self.rigid.carried > 0 else by_gap

    @property
    def elastic_length(self) -> float:
        """Gap that unit pressures open on average without any rigid motion, mm/MPa: the scale of gaps.

        Over all nodes; where no numbers are in memory, over some of them.
        """
        return self._made._elastic_length

    @cached_property
    def _elastic_length(self) -> float:
        pair, modes = self.pair, self.rigid.rigid_normal
        rigid = np.zeros(modes.T.shape)  # what modes take up of S, which is symmetric but for the weights
        if rigid.size:
            inverse = np.linalg.pinv(modes)
            opened = self.apply(self.axes[:, 0, :, None] * inverse.T[:, None, :])[:, 0]
            rigid = opened.T * pair.weights
        count, compliance = len(pair.weights), self.compliance(0.0)
        step = 1 if self.in_memory else max(count // SOME, 1)
        runs = [slice(start, start + RUN * step, step) for start in range(0, count, RUN * step)]
        parts = [np.abs(compliance.entries(run, EVERY) - modes[run] @ rigid).sum(axis=1) for run in runs]
        return float(np.concatenate(parts).mean())


class Compliance:
    """S (a n, b n): displacements along axes of the contact by unit tractions, mm/MPa.

    Of all components, one after the other: those along e_n of all nodes first. A convolution where both bodies are on
    one grid; where they answer by numbers a matrix, which is kept for several components.

    Args:
        interface: The surfaces.
        traction: On the punch by units of the unknowns (n, d, b): a pressure with its friction, or one along each axis.
        known: Tables of convolutions that were made for other phases.
    """

    def __init__(self, interface: Interface, traction: Array, known: dict[bytes, Array]) -> None:
        self.interface, self._traction, self._known = interface, traction, known
        n, _, self.components = traction.shape
        self._n, self._local = n, interface.layer * np.einsum("id,id->i", interface.axes[:, 0], traction[:, :, 0])
        self._force = traction * interface.pair.weights[:, None, None]
        self._keeps = self.components > 1 and (interface.in_memory or n <= MATRIX)

    @cached_property
    def on_grid(self) -> GridCompliance | None:
        """The compliance as a convolution; None where the surfaces are on no common grid, or pass each other."""
        interface = self.interface
        few = self.components > 1 and self._n < GRIDDED
        if few or interface.strip_moves or interface.in_memory or interface.pair.placement.turn != ZERO:
            return None
        axes, bodies = interface.axes[:, : self.components], [interface.punch, interface.strip]
        return on_one_grid(bodies, axes, self._traction, interface.pair.weights, self._local, self._known)

    def _block(self, rows: Nodes, nodes: Nodes) -> Array:
        """Return the block of compliances between components of nodes (components, nodes, components, rows)."""
        return np.einsum("iajc,jcb->bjai", self.interface.asked(rows, nodes), self._force[nodes], optimize=True)

    @cached_property
    def _columns(self) -> Array:
        """S^T, so that what a component moves lies together in memory."""
        size = self._n * self.components
        return self._block(EVERY, EVERY).reshape(size, size)

    def apply(self, traction: Array) -> Array:
        """Return the displacements (a n,) of tractions (b n,)."""
        if self.on_grid is not None:
            return self.on_grid.apply(traction)
        if self._keeps:
            loaded = np.flatnonzero(traction)
            return traction[loaded] @ self._columns[loaded]
        force = np.einsum("jcb,bj->jc", self._force, traction.reshape(-1, self._n))
        return self.interface.apply(force)[:, : self.components].T.ravel()

    def entries(self, rows: Nodes, columns: Nodes) -> Array:
        """Return the numbers of some rows and columns; runs of them where there is one component alone."""
        if self.components == 1:
            if self.on_grid is not None:
                return self.on_grid.entries(rows, columns)
            return np.einsum("ijd,jd->ij", self.interface.entries(rows, columns)[:, 0], self._force[columns, :, 0])
        i, j = (np.arange(self._n * self.components)[some] for some in (rows, columns))
        if self._keeps:
            return self._columns[j, i[:, None]]
        (to, at), (of, by) = (np.divmod(numbers, self._n) for numbers in (i, j))
        (seen, i), (pushed, j) = (np.unique(places, return_inverse=True) for places in (at, by))
        return self._block(seen, pushed)[of, j, to[:, None], i[:, None]]

    def diagonal(self) -> Array:
        """Return the diagonal (a n,)."""
        return self._diagonal

    @cached_property
    def _diagonal(self) -> Array:
        if self.on_grid is not None:
            return self.on_grid.diagonal()
        if self._keeps:
            return self._columns.diagonal().copy()
        diagonal = self.interface.diagonal()[:, : self.components]
        return np.einsum("iac,ica->ai", diagonal, self._force).ravel()

    def matrix(self) -> Array:
        """Return the compliance as one matrix."""
        return self.entries(EVERY, EVERY)


def _along(axes: Array, vectors: Array) -> Array:
    """Return components (rows, a, ...) along axes (rows, a, d) of vectors (rows, d, ...), or of what is along e_n."""
    return vectors if vectors.shape[1] == 1 else np.einsum("iab,ib...->ia...", axes, vectors)


def _used(shares: csr_array, nodes: Nodes) -> tuple[Nodes, csr_array]:
    """Return which columns have shares, and these alone; all of them for runs of nodes."""
    if isinstance(nodes, slice):
        return EVERY, shares
    some = np.unique(shares.indices).astype(np.int64)
    return some, csr_array(shares[:, some])
