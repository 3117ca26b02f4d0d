"""A small basis for the temperatures that friction on the contact can make.

Only n fluxes go into a body, so its temperatures stay near the responses to these fluxes over all
time scales, from a step to the steady state: a rational Krylov space with the time steps as poles.
The basis takes its main parts by the singular values in the norm of the heat capacity, scale by
scale, the slowest first: of each, what lies beside the basis so far. Of few fluxes they are picked again
in the end, of all scales together.

Where there are many fluxes, most of them differ over a short wave length l, and warm a layer as thin as
that for a time of l²/(4 pi² a) with the diffusivity a. Later steps do not see the rest of such fields: there the
singular values are those of the fields one step later, so that the basis stays as small on any mesh, and `ReducedField`
adds what it leaves out to the contact temperature of the step itself. The fluxes whose fields last are found from
random ones, in place of all n of them, a block beside the other until the last one brings what does not count (Halko,
Martinsson and Tropp, SIAM Review 53, 2011). Each scale takes them a block after the other, until one brings nothing
new.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from scipy.sparse import csc_array, diags_array

from fenwear.common.arrays import Array
from fenwear.common.errors import ConvergenceError
from fenwear.common.parallel import total
from fenwear.heat.conduction import ALONE, HeatBody, HeatStep, Surroundings
from fenwear.heat.temperature import ReducedBasis

RATIO = 4.0  # of one time scale to the next
RUNG = 3.0  # of one speed to the next, of a program of many
SCALES = 9  # of them, from a step on; then come the last ones, to the steady state
ROUNDING = 1e-7  # of the largest singular value: what is left of a dependent field, squared in the Gram matrix
STAGES = 2  # of the shortest scale, which a time step begins with
PASSES, PASSING = 4, 2  # of what moving material carries, to begin with, and of so many scales
FAST = 4  # scales over which a motion to and fro does not average out
SOME = 200  # fluxes that are tried at once, where there are many
SHARPER = 0.3  # of the tolerance, for what is felt a step later: at a corner of the contact many such fields add up


def reduced_basis(
    body: HeatBody,
    inflow: csc_array,
    speeds: Sequence[float],
    duration: float,
    tolerance: float,
    surroundings: Surroundings = ALONE,
    *,
    lasting: bool = False,
    passes: int = PASSES,
) -> ReducedBasis:
    """Return a basis, with a lift that has the held temperatures; collective.

    Args:
        body: The body.
        inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        speeds: Velocities of its material; over a cycle they average out where they have both signs.
        duration: Of one step, s: the shortest time scale.
        tolerance: Singular values below this fraction of the largest are dropped.
        surroundings: Boundary beyond the mesh.
        lasting: Whether it holds what is felt a step later alone.
        passes: Over how many steps what moving material carries is followed, of the shortest scales.
    """
    mean, moving = _velocities(speeds)
    lift = body.initial()
    # Fluxes of the same power: the singular values then weigh temperatures as friction makes them.
    even = csc_array(inflow @ diags_array(1 / np.sqrt(total(body.body.mesh.comm, abs(inflow).sum(axis=0)))))
    scales = [duration * RATIO**k for k in range(SCALES)]
    scales += [np.inf] if body.loses_heat(mean, surroundings) else [scales[-1] * 100]
    later = body.step(0.0, duration, surroundings) if lasting else None
    basis = _Growing(body, later)
    if later is None:
        fluxes = even.toarray()
    else:
        tolerance *= SHARPER
        slowest = body.step(mean, scales[-1], surroundings)
        fluxes = _lasting_fluxes(body, even, later, slowest, basis, tolerance)
        slowest.free()
    block = SOME // 4 if lasting else max(fluxes.shape[1], 1)
    unlike = len(scales) if surroundings.renewed else FAST
    relaxed: list[Array] = []
    for k, scale in reversed(list(enumerate(scales))):  # the slowest first: it is the largest
        for velocity in [mean, *(v for v in moving if k < unlike and _has_scale(body, v, scale, surroundings))]:
            step = body.step(velocity, scale, surroundings)
            times = passes if velocity != 0 and k < PASSING else STAGES if k == 0 else 1
            for begin in range(0, fluxes.shape[1], block):
                if not basis.follow(step, fluxes[:, begin : begin + block], times, tolerance):
                    break  # the next ones matter less
            if np.isinf(scale) and velocity != mean:
                relaxed.append(step.advance(np.zeros(body.owned))[:, None] - lift[:, None])
            elif np.isinf(scale):
                lift = step.advance(np.zeros(body.owned))
            else:
                start = (body.initial() - lift)[:, None]
                for _ in range(times):
                    start = step.advance(start, sources=False)
                    relaxed.append(start)
            step.free()
    if later is None:
        basis.compress(tolerance)
    else:
        later.free()
    basis.start_from(body.initial() - lift, np.hstack(relaxed), tolerance)
    return ReducedBasis(body, lift, np.array(basis.columns))


def _has_scale(body: HeatBody, velocity: float, scale: float, surroundings: Surroundings) -> bool:
    """Return whether there is a field of this time scale: a steady one only where heat is lost; collective."""
    return not np.isinf(scale) or body.loses_heat(velocity, surroundings)


def _velocities(speeds: Sequence[float]) -> tuple[float, list[float]]:
    """Return the velocity that the steady state is made of, and others whose fields a basis has.

    To and fro the mean and the extremes. One way, at several speeds, the fastest and a ladder from there down.
    """
    low, high = min(speeds), max(speeds)
    if low * high < 0 or low == high:
        mean = float(np.mean(speeds))
        return mean, sorted({low, high} - {mean})
    fastest, slowest = max(low, high, key=abs), min((v for v in speeds if v), key=abs)
    ladder = [fastest / RUNG**k for k in range(1, 1 + int(np.log(fastest / slowest) / np.log(RUNG)))]
    return fastest, sorted({*ladder, slowest, *({0.0} & set(speeds))} - {fastest})


class _Growing:
    """An orthonormal basis in the norm of the heat capacity, that begins with the uniform temperature; collective.

    The uniform one carries the balance of energy. In a body that hardly loses heat it is far larger than all
    else, which would be small against it and dropped.

    Args:
        body: The body.
        later: The step by whose end fields are weighed; None to weigh them as they are.
    """

    def __init__(self, body: HeatBody, later: HeatStep | None) -> None:
        self.body, self._later = body, later
        self._largest = 0.0
        uniform: Array = np.ones((body.owned, 1))
        uniform[body.held] = 0.0
        stored = _gram(body, uniform)[0, 0]
        self._first = int(stored > 0)  # how many columns the uniform temperature has: none where it is held everywhere
        column = uniform[:, : self._first] / np.sqrt(stored if stored > 0 else 1.0)
        self.columns = np.array(column, order="F")  # V (owned, dim)
        self._stored = np.array(body.store(column), order="F")  # M V: so nothing else is multiplied by M
        self._added: list[Array] = []  # in coordinates of the basis as it was then

    def _coordinates(self, fields: Array) -> Array:
        """Return V^T M times fields (owned, k), (dim, k)."""
        return total(self.body.body.mesh.comm, self._stored.T @ np.asfortranarray(fields))

    def add(self, fields: Array, tolerance: float) -> bool:
        """Add the principal parts of fields (owned, k) beside the basis, down to a share of the largest ever.

        Returns:
            Whether there were any.
        """
        rest = self._beside(fields)
        parts, values, largest = _principal(self.body, self._felt(rest), tolerance, self._largest)
        self._largest = max(self._largest, largest)
        self._append(rest @ (parts / values))
        if self._later is None:
            self._added.append(self._coordinates(fields))
        return len(values) > 0

    def follow(self, step: HeatStep, fluxes: Array, passes: int, tolerance: float) -> bool:
        """Add the fields of loads (owned, k) over so many steps; return whether there was anything to add."""
        fields = step.respond(fluxes)
        grown = self.add(fields, tolerance)
        for _ in range(1, passes):
            fields = step.advance(fields, sources=False)
            grown |= self.add(fields, tolerance)
        return grown

    def largest(self, fields: Array) -> float:
        """Return the largest singular value of fields (owned, k) beside the basis, as `add` would find it."""
        return _principal(self.body, self._felt(self._beside(fields)), 0.0, 0.0)[2]

    def compress(self, tolerance: float) -> None:
        """Keep the principal parts of all that was added, and the uniform temperature; of fields as they are."""
        dim, first = self.columns.shape[1], self._first
        if dim == first:
            return
        added = np.hstack([np.pad(block, ((0, dim - len(block)), (0, 0))) for block in self._added])[first:]
        columns = self.columns[:, first:]
        parts, values, _ = np.linalg.svd(added, full_matrices=False)
        self.columns, self._stored = self.columns[:, :first], self._stored[:, :first]
        self._append(columns @ parts[:, values > max(tolerance, ROUNDING) * values[0]])

    def start_from(self, field: Array, relaxed: Array, tolerance: float) -> None:
        """Add a field (owned,) exactly, and how it dies out, fields (owned, k), to a tolerance of its own."""
        hottest = self.body.body.mesh.comm.allreduce(float(np.abs(field).max(initial=0.0)), MPI.MAX)
        if hottest == 0:
            return
        _principal(self.body, field[:, None], 0.0, 0.0)  # told here if its energy is no number
        start = field[:, None] / hottest
        start[self.body.held] = 0.0
        for fields, share in ((start, 0.0), (relaxed / hottest, tolerance)):
            _, values, largest = _principal(self.body, fields, 0.0, 0.0)
            rest = self._beside(fields)
            parts, values, _ = _principal(self.body, rest, share, largest)
            self._append(rest @ (parts / values))

    def _felt(self, fields: Array) -> Array:
        """Return the fields by which the basis is chosen: one step later where a step is given."""
        return fields if self._later is None else self._later.advance(fields, sources=False)

    def _beside(self, fields: Array) -> Array:
        """Return fields without their parts in the basis; first without the uniform one, which may be far larger."""
        comm = self.body.body.mesh.comm
        fields = np.asfortranarray(fields)  # one layout, whoever has made them: the same bits on any number of ranks
        for some in (slice(self._first), slice(None)):
            columns, stored = self.columns[:, some], self._stored[:, some]
            fields = fields - columns @ total(comm, stored.T @ fields)
        return fields

    def _append(self, fields: Array) -> None:
        """Append fields that lie beside the basis, but for what rounding has made of dependent ones.

        Raises:
            ConvergenceError: they are no numbers.
        """
        for _ in range(2):  # once more: rounding
            if not fields.shape[1]:
                return
            fields = self._beside(fields @ _orthogonal(self.body, fields))
        self.columns = np.asfortranarray(np.hstack([self.columns, fields]))
        self._stored = np.asfortranarray(np.hstack([self._stored, self.body.store(fields)]))


def _lasting_fluxes(
    body: HeatBody, even: csc_array, step: HeatStep, slowest: HeatStep, basis: _Growing, tolerance: float
) -> Array:
    """Return loads (owned, k) of the fluxes whose fields are felt a step later, the most felt first; collective.

    The principal ones of fields in material at rest, where they last longest. Short-lived fields leave the same on any
    time scale: they count against the largest field of the slowest one, which the most felt fluxes make.

    Args:
        even: Loads of single fluxes of the same power (owned, n).
        step: The shortest one, at rest.
        slowest: The longest one.
        basis: Empty but for the uniform temperature.
        tolerance: Share of the largest field down to which they count.
    """
    comm = body.body.mesh.comm

    def lasting(fluxes: Array) -> Array:
        """Return S times fluxes (n, k), S = (A^-1 B) A^-1 C: their fields a step later."""
        return step.advance(step.respond(even @ fluxes), sources=False)

    def felt(fluxes: Array) -> Array:
        """Return S^T M S times fluxes (n, k): A and B are symmetric."""
        return total(comm, even.T @ step.advance(step.respond(body.store(lasting(fluxes))), sources=False))

    size, random = even.shape[1], np.random.default_rng(0)  # the same on every rank and in every run
    space, fields, least = np.zeros((size, 0)), np.zeros((body.owned, 0)), 0.0
    gram: Array = np.zeros((0, 0))
    while True:
        fresh = felt(random.standard_normal((size, min(SOME, size - space.shape[1]))))
        for _ in range(2):  # once more: rounding
            fresh = np.linalg.qr(fresh - space @ (space.T @ fresh))[0]
        before, new = len(gram), lasting(fresh)
        space, fields = np.hstack([space, fresh]), np.hstack([fields, new])
        across = total(comm, fields.T @ body.store(new))
        gram = np.block([[gram, across[:before]], [across[:before].T, across[before:]]])
        squares, vectors = np.linalg.eigh(gram)
        values = np.sqrt(np.maximum(squares, 0.0))
        if not least:
            first = even @ (space @ vectors[:, -SOME // 4 :])
            least = max(tolerance, ROUNDING) * basis.largest(slowest.respond(first))
        if values[0] <= least or len(values) == size:
            break
    return np.asarray(even @ (space @ vectors[:, values > least][:, ::-1]))


def _gram(body: HeatBody, fields: Array) -> Array:
    return total(body.body.mesh.comm, fields.T @ body.store(fields))


def _orthogonal(body: HeatBody, fields: Array) -> Array:
    """Return the combinations of fields (k, kept) that are orthonormal in the norm of the heat capacity; collective.

    Raises:
        ConvergenceError: they are no numbers.
    """
    gram = _numbers(body, fields)
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(gram)).T)
    except np.linalg.LinAlgError:  # one depends on the others; the same on every rank
        sizes = np.sqrt(np.maximum(np.diag(gram), 0.0))
        scale = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0)
        squares, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
        kept = squares > ROUNDING
        return np.asarray(scale[:, None] * vectors[:, kept] / np.sqrt(squares[kept]))


def _numbers(body: HeatBody, fields: Array) -> Array:
    """Return the products of fields (k, k); collective.

    Raises:
        ConvergenceError: there are none, or they are no numbers.
    """
    with np.errstate(all="ignore"):  # what overflows is told below
        gram = _gram(body, fields)
    if not gram.size or not np.isfinite(gram).all():
        raise ConvergenceError(
            f"the temperatures of the {body.body.name} are beyond all numbers: a material, a temperature or a time "
            "is too large or too small to compute with"
        )
    return gram


def _principal(body: HeatBody, fields: Array, tolerance: float, largest: float) -> tuple[Array, Array, float]:
    """Return the combinations of fields that are principal (k, kept), their singular values, and the largest of all.

    Collective.

    Raises:
        ConvergenceError: there are none, or they are no numbers.
    """
    gram = _numbers(body, fields)
    values, vectors = np.linalg.eigh(gram)
    values = np.sqrt(np.maximum(values, 0.0))
    kept = values > max(tolerance, ROUNDING) * max(largest, values[-1])
    return vectors[:, kept], values[kept], float(values[-1])
