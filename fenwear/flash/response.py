"""Temperatures of the contact by heat that enters a half-space, over twice the grid and in harmonics of the time.

A place of the punch is always the same of its material. A strip that is X(t) away is heated at x - X(t) of its own:

    T_n(k) = q_n(k) / (K sqrt(k^2 + i n omega / kappa)),    the strip's q times exp(i k . X), its T times exp(-i k . X)

with the kernels of `fenwear.flash.kernels` in place of their symbols.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.flash.kernels import Complex, cell_integrals

PLANE = (1, 2)


class Response(Protocol):
    """What takes heat (t, m, n), mW/mm², at t instants of a grid to the temperatures there, K."""

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""


@dataclass(frozen=True)
class Instants:
    """Instants that do not feel each other: of what is steady, or by kernels of what was before.

    Attributes:
        conductivity: K, N/(s K).
        kernels: Of each instant, or one of all (t or 1, 2 m - 1, 2 n - 1), mm.
    """

    conductivity: float
    kernels: Array

    @cached_property
    def _size(self) -> tuple[int, ...]:
        return tuple(scipy.fft.next_fast_len(count + 1, real=True) for count in self.kernels.shape[1:])

    @cached_property
    def _waves(self) -> Complex:
        return np.asarray(scipy.fft.rfftn(_wrapped(self.kernels, self._size), axes=PLANE) / self.conductivity)

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""
        waves = scipy.fft.rfftn(heat, self._size, axes=PLANE)
        found = scipy.fft.irfftn(waves * self._waves, self._size, axes=PLANE)
        return np.asarray(found[:, : heat.shape[1], : heat.shape[2]])


@dataclass(frozen=True)
class Periodic:
    """A cycle in t equal steps.

    Attributes:
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        period: s.
        sides: Of a cell, mm.
        shape: Nodes (m, n).
        shifts: Where the body is in the middle of each step, from anywhere (t, 2), mm.
    """

    conductivity: float
    diffusivity: float
    period: float
    sides: tuple[float, float]
    shape: tuple[int, int]
    shifts: Array

    @cached_property
    def _reach(self) -> tuple[int, ...]:
        """Nodes of the grid with all of its places."""
        far = np.ceil(np.ptp(self.shifts, axis=0) / self.sides - 1e-9).astype(int)
        return tuple(int(count + more) for count, more in zip(self.shape, far, strict=True))

    @cached_property
    def _size(self) -> tuple[int, ...]:
        return tuple(scipy.fft.next_fast_len(2 * count, real=True) for count in self._reach)

    @cached_property
    def _waves(self) -> Complex:
        """Of the kernel of each harmonic (t, ...)."""
        steps = len(self.shifts)
        found = np.empty((steps, self._size[0], self._size[1] // 2 + 1), dtype=complex)
        for n in range(steps // 2 + 1):
            decay = np.sqrt(1j * 2 * np.pi * n / self.period / self.diffusivity)
            kernel = _wrapped(cell_integrals(self._reach, self.sides, decay if n else 0.0), self._size)
            real, other = (
                scipy.fft.rfftn(np.ascontiguousarray(part), axes=(0, 1)) for part in (kernel.real, kernel.imag)
            )
            found[n] = real if 2 * n == steps else real + 1j * other
            found[-n] = real if n == 0 or 2 * n == steps else real - 1j * other
        return np.asarray(found / self.conductivity, dtype=np.complex128)

    @cached_property
    def _phases(self) -> Complex | None:
        """What moves heat to its place on the body (t, ...): exp(i k . X), real at the shortest waves."""
        if not np.ptp(self.shifts, axis=0).any():
            return None
        parts: list[Complex] = []
        for axis, (count, side) in enumerate(zip(self._size, self.sides, strict=True)):
            k = 2 * np.pi * (scipy.fft.fftfreq(count, side) if axis == 0 else scipy.fft.rfftfreq(count, side))
            turn = np.exp(1j * k * self.shifts[:, axis, None])
            if count % 2 == 0:
                turn[:, count // 2] = turn[:, count // 2].real
            parts.append(turn)
        return np.asarray(parts[0][:, :, None] * parts[1][:, None, :])

    def apply(self, heat: Array) -> Array:
        """Return the temperatures (t, m, n), K."""
        waves, moved = scipy.fft.rfftn(heat, self._size, axes=PLANE), self._phases
        if moved is not None:
            waves *= moved
        waves = scipy.fft.ifft(scipy.fft.fft(waves, axis=0) * self._waves, axis=0)
        if moved is not None:
            waves *= moved.conj()
        found = scipy.fft.irfftn(waves, self._size, axes=PLANE)
        return np.asarray(found[:, : heat.shape[1], : heat.shape[2]])


def _wrapped(kernel: NDArray[Any], size: tuple[int, ...]) -> NDArray[Any]:
    """Return kernels at all distances (..., 2 m - 1, 2 n - 1) on a grid of this size, distance 0 first."""
    counts = [(count + 1) // 2 for count in kernel.shape[-2:]]
    found = np.zeros((*kernel.shape[:-2], *size), dtype=kernel.dtype)
    rows, columns = (np.arange(1 - count, count) % whole for count, whole in zip(counts, size, strict=True))
    found[..., rows[:, None], columns] = kernel
    return found
