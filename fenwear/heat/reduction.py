"""A small basis for the temperatures that friction on the contact can make.

Only n fluxes go into a body, so its temperatures stay near the responses to these fluxes over all
time scales, from a step to the steady state: a rational Krylov space with the time steps as poles.
Its parts that matter are picked by the singular values in the norm of the heat capacity.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI

from fenwear.arrays import Array
from fenwear.errors import ConvergenceError
from fenwear.heat.conduction import ALONE, HeatBody, Surroundings
from fenwear.heat.field import ReducedBasis
from fenwear.parallel import total

RATIO = 4.0  # of one time scale to the next
SCALES = 9  # of them, from a step on; then come the last ones, to the steady state
ROUNDING = 1e-7  # of the largest singular value: what is left of a dependent field, squared in the Gram matrix
FAST = 4  # scales over which a motion to and fro does not average out


def reduced_basis(
    body: HeatBody,
    inflow: Array,
    speeds: Sequence[float],
    duration: float,
    tolerance: float,
    surroundings: Surroundings = ALONE,
) -> ReducedBasis:
    """Return a basis, with a lift that has the held temperatures; collective.

    Args:
        body: The body.
        inflow: Loads of unit fluxes at the interface nodes (owned, n), mm.
        speeds: Velocities of its material; over a cycle they average out where they have both signs.
        duration: Of one step, s: the shortest time scale.
        tolerance: Singular values below this fraction of the largest are dropped.
        surroundings: What lies beyond the mesh.
    """
    mean = float(np.mean(speeds))
    moving = sorted({min(speeds), max(speeds)} - {mean})
    lift = body.initial()
    # Fluxes of the same power: the singular values then weigh temperatures as friction makes them.
    even = inflow / np.sqrt(total(body.body.mesh.comm, np.abs(inflow).sum(axis=0)))
    scales = [duration * RATIO**k for k in range(SCALES)]
    scales += [np.inf] if body.loses_heat(mean, surroundings) else [scales[-1] * 100]
    # What is new on both sides does not average out: material that leaves is cooled on either way.
    unlike = len(scales) if surroundings.renewed and min(speeds) * max(speeds) < 0 else FAST
    uniform = np.ones((body.owned, 1))  # carries the balance of energy
    uniform[body.held] = 0.0
    snapshots: list[Array] = []
    relaxed: list[Array] = []
    largest = 0.0
    for k, scale in reversed(list(enumerate(scales))):  # the slowest first: it is the largest
        for velocity in [mean, *(moving if k < unlike else [])]:
            step = body.step(velocity, scale, surroundings)
            fields, values = _principal(body, _uneven(body, uniform, step.respond(even)), tolerance, largest)
            largest = max(largest, values[-1])
            snapshots.append(fields)
            if np.isinf(scale):
                lift = step.advance(np.zeros(body.owned))
            else:
                relaxed.append(step.advance(body.initial() - lift, sources=False)[:, None])
            step.free()
    start = (body.initial() - lift)[:, None]
    hottest = body.body.mesh.comm.allreduce(float(np.abs(start).max(initial=0.0)), MPI.MAX)
    warm = hottest > 0
    exact = np.hstack([uniform, start / hottest]) if warm else uniform
    exact[body.held] = 0.0
    exact = _orthonormal(body, exact, 0.0)
    if warm:  # how the initial temperature dies out
        rest = np.hstack(relaxed)
        rest -= exact @ total(body.body.mesh.comm, exact.T @ body.store(rest))
        exact = _orthonormal(body, np.hstack([exact, _orthonormal(body, rest, tolerance)]), 0.0)
    rest = np.hstack(snapshots)
    rest -= exact @ total(body.body.mesh.comm, exact.T @ body.store(rest))
    return ReducedBasis(body, lift, _orthonormal(body, np.hstack([exact, _orthonormal(body, rest, tolerance)]), 0.0))


def _uneven(body: HeatBody, uniform: Array, fields: Array) -> Array:
    """Return fields without their mean, which is in the basis already; collective.

    In a body that hardly loses heat it is far larger than all else, which would be small against it and dropped.
    """
    stored = body.store(uniform)
    means = total(body.body.mesh.comm, stored.T @ np.hstack([fields, uniform]))
    return fields - uniform @ (means[:, :-1] / means[:, -1:])


def _gram(body: HeatBody, fields: Array) -> Array:
    return total(body.body.mesh.comm, fields.T @ body.store(fields))


def _principal(body: HeatBody, fields: Array, tolerance: float, largest: float) -> tuple[Array, Array]:
    """Return the principal fields (owned, kept) with their size, and their singular values; collective.

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
    values, vectors = np.linalg.eigh(gram)
    values = np.sqrt(np.maximum(values, 0.0))
    kept = values > max(tolerance, ROUNDING) * max(largest, values[-1])
    return fields @ vectors[:, kept], values[kept] if kept.any() else np.zeros(1)


def _orthonormal(body: HeatBody, fields: Array, tolerance: float) -> Array:
    """Return an orthonormal basis of the fields' principal parts (owned, dim); collective."""
    fields, values = _principal(body, fields, tolerance, 0.0)
    fields = fields / values
    return fields @ np.linalg.inv(np.linalg.cholesky(_gram(body, fields))).T  # once more: rounding
