"""An independent strip in its own frame, for heat that goes to and fro: finite volumes, Crank-Nicolson in time.

A rectangle, cold at its bottom and ends, convects at its top but under the contact, where a flux enters that is even
over the contact and goes with the speed. Nothing of fenwear is in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg


@dataclass(frozen=True)
class Strip:
    """A strip, mm, N, s, K; its material, and the contact that goes over it."""

    length: float
    height: float
    conductivity: float
    capacity: float
    convection: float
    contact: float


def graded(start: float, end: float, size: float, growth: float) -> np.ndarray:
    """Return ascending ends of cells from `start` to `end` whose size grows by a factor from `size` on."""
    sizes = [size]
    while sum(sizes) < end - start:
        sizes.append(sizes[-1] * growth)
    edges = np.concatenate([[0.0], np.cumsum(sizes)])
    return start + edges * (end - start) / edges[-1]


def covered(edges: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return what share of each cell lies between two places."""
    inside = np.minimum(edges[1:], high) - np.maximum(edges[:-1], low)
    return np.maximum(inside, 0.0) / np.diff(edges)


def periodic(
    strip: Strip,
    place: Callable[[float], float],
    period: float,
    flux_per_speed: float,
    at: np.ndarray,
    *,
    size: tuple[float, float],
    steps: int,
    cycles: int,
) -> np.ndarray:
    """Return the temperature of the contact at places `at` from its middle, at the end of the cycle that repeats.

    From the steady state of the mean flux on, which the cycle differs from by what fades within a few cycles.

    Args:
        strip: The strip.
        place: Where the contact's middle is at a time.
        period: s.
        flux_per_speed: mW/mm² for each mm/s.
        at: From the middle of the contact, mm.
        size: Of the smallest cells along the strip and in depth, mm.
        steps: Of a cycle.
        cycles: From the mean state on.
    """
    reach = max(abs(place(t)) for t in np.linspace(0, period, 400)) + strip.contact / 2 + 4 * size[0]
    inner = np.linspace(-reach, reach, 2 * int(np.ceil(reach / size[0])) + 1)
    outer = graded(reach, strip.length / 2, size[0], 1.15)[1:]
    x = np.concatenate([-outer[::-1], inner, outer])
    z = graded(0.0, strip.height, size[1], 1.12)
    dx, dz, k = np.diff(x), np.diff(z), strip.conductivity

    def second(widths: np.ndarray, *, first: bool, last: bool) -> scipy.sparse.csr_array:
        """Conductances between cells, with cold ends where asked for."""
        between = 2 * k / (widths[1:] + widths[:-1])
        diagonal = np.zeros(len(widths))
        diagonal[1:] += between
        diagonal[:-1] += between
        diagonal[0] += first * 2 * k / widths[0]
        diagonal[-1] += last * 2 * k / widths[-1]
        return scipy.sparse.diags_array([-between, diagonal, -between], offsets=[-1, 0, 1]).tocsr()

    along, deep = second(dx, first=True, last=True), second(dz, first=False, last=True)
    stiff = scipy.sparse.kron(scipy.sparse.diags_array(dz), along) + scipy.sparse.kron(
        deep, scipy.sparse.diags_array(dx)
    )
    half = 2 * k / dz[0]
    loss = strip.convection * half / (strip.convection + half)  # from the first cell's centre
    top = np.zeros(len(dz))
    top[0] = 1.0
    stiff = scipy.sparse.csc_array(stiff + scipy.sparse.kron(scipy.sparse.diags_array(top * loss), np.diag(dx)))
    mass = strip.capacity * np.kron(dz, dx)
    n, dt = len(dx), period / steps

    def block(begin: float, end: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean cover of the cells over a time and the flux that enters them."""
        parts = 4
        cover, flux = np.zeros(n), np.zeros(n)
        for j in range(parts):
            t0, t1 = begin + (end - begin) * j / parts, begin + (end - begin) * (j + 1) / parts
            middle = place((t0 + t1) / 2)
            now = covered(x, middle - strip.contact / 2, middle + strip.contact / 2)
            cover += now / parts
            flux += now * flux_per_speed * abs(place(t1) - place(t0)) / (end - begin)
        return cover, flux

    blocks = [block(j * dt, (j + 1) * dt) for j in range(steps)]
    mean_cover = np.mean([one[0] for one in blocks], axis=0)
    mean_flux = np.mean([one[1] for one in blocks], axis=0)
    under = np.zeros(n * len(dz))
    under[:n] = loss * mean_cover * dx
    right = np.zeros(n * len(dz))
    right[:n] = mean_flux * dx
    theta = scipy.sparse.linalg.spsolve(scipy.sparse.csc_array(stiff - scipy.sparse.diags_array(under)), right)
    m = scipy.sparse.diags_array(mass)
    factor = scipy.sparse.linalg.splu(scipy.sparse.csc_array(m / dt + stiff / 2))
    back = scipy.sparse.csr_array(m / dt - stiff / 2)
    before = theta[:n].copy()
    for _ in range(cycles):
        for cover, flux in blocks:
            right = back @ theta
            guess = 1.5 * theta[:n] - 0.5 * before  # what convects under the contact is given back, at mid-step
            right[:n] += (flux + loss * cover * guess) * dx
            before = theta[:n].copy()
            theta = factor.solve(right)
    surface = theta[:n] + blocks[-1][1] / half  # at the surface above the first cells' centres
    surface = np.where(blocks[-1][0] > 0, surface, surface * half / (half + strip.convection))
    return np.interp(place(period) + at, (x[:-1] + x[1:]) / 2, surface)
