"""Rough surfaces on a contact grid: measured height maps, and made ones.

A self-affine surface has the isotropic power spectrum C(q) ~ q^-2(1 + H), in the plane q^-(1 + 2 H), between the wave
numbers of its longest and its shortest wave length, and random phases (B. N. J. Persson et al., J. Phys. Condens.
Matter 17, 2005); its root mean square is set exactly.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import Topography
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.files.height_maps import Heights, read_heights

COARSE = 4.0  # spacings that the shortest wave length needs
USUAL = 8.0  # spacings of the shortest wave length by default
SLACK = 1e-6  # of the map's extent: how far a grid may reach beyond it


def heights_on(grid: RegularGrid, wanted: Topography, key: str, folder: Path | None) -> Array:
    """Return the heights of a topography at the nodes of a grid (n,), mm.

    Args:
        grid: The contact.
        wanted: Description of the heights.
        key: Of the case, for messages.
        folder: Where its file lies.

    Raises:
        CaseError: a file cannot be read, has holes or does not reach over the grid, or the grid is too coarse.
    """
    if wanted.file is not None:
        path = (folder or Path()) / wanted.file
        heights = _interpolated(_measured(path, wanted, key), grid, f"{key}.file")
    elif wanted.wavelength is not None:
        heights = _wave(wanted, grid, key)
    else:
        heights = _self_affine(wanted, grid, key)
    return wanted.height_factor * heights


def _wave(wanted: Topography, grid: RegularGrid, key: str) -> Array:
    assert wanted.wavelength is not None
    if len(wanted.wavelength) > len(grid.counts):
        raise CaseError(InputError(f"{key}.wavelength", f"expected {len(grid.counts)} length(s)"))
    heights = np.full(len(grid.flat), float(wanted.amplitude or 0.0))
    for axis, length in enumerate(wanted.wavelength):
        _fine_enough(grid, axis, length, f"{key}.wavelength")
        heights *= np.cos(2 * np.pi * (grid.flat[:, axis] - grid.middle[axis]) / length)
    return heights


def _fine_enough(grid: RegularGrid, axis: int, length: float, key: str) -> None:
    if length < COARSE * grid.spacing[axis]:
        nodes = int(np.ceil(COARSE * float(np.max(grid.sides)) / length)) + 1
        message = (
            f"{length:.4g} mm is {length / grid.spacing[axis]:.2g} spacings of the contact grid, where a wave takes "
            f"{COARSE:g} at least: set grid.nodes = {nodes} or more"
        )
        raise CaseError(InputError(key, message))


def _self_affine(wanted: Topography, grid: RegularGrid, key: str) -> Array:
    """Return a surface of random phases; of the strip's longer grid it is as long as that."""
    shortest = wanted.shortest or USUAL * float(np.max(grid.spacing))
    for axis in range(len(grid.counts)):
        _fine_enough(grid, axis, shortest, f"{key}.shortest")
    assert wanted.longest is not None
    if wanted.longest <= shortest:
        raise CaseError(InputError(f"{key}.longest", f"expected more than the shortest wave length, {shortest:.4g} mm"))
    waves = [2 * np.pi * np.fft.fftfreq(k, step) for k, step in zip(grid.counts, grid.spacing, strict=True)]
    q = np.sqrt(sum(component**2 for component in np.meshgrid(*waves, indexing="ij")))
    has = (q >= 2 * np.pi / wanted.longest * (1 - 1e-9)) & (q <= 2 * np.pi / shortest)
    if not has.any():
        raise CaseError(InputError(f"{key}.longest", "no wave of these lengths fits on the contact grid"))
    d = len(grid.counts)
    spectrum = np.where(has, np.where(has, q, 1.0) ** (-(wanted.hurst + d / 2)), 0.0)
    noise = np.fft.fftn(np.random.default_rng(wanted.seed).standard_normal(grid.counts))
    heights = np.fft.ifftn(spectrum * noise / np.maximum(np.abs(noise), 1e-300)).real.ravel()
    return np.asarray(heights * (wanted.rms or 0.0) / np.sqrt(np.mean(heights**2)))


def _measured(path: Path, wanted: Topography, key: str) -> Heights:
    """Return the map of a file, levelled and without holes as its keys say.

    Raises:
        CaseError: it cannot be read, or has holes that are not to be filled.
    """
    try:
        measured = read_heights(path)
    except CaseError as error:
        raise CaseError([InputError(f"{key}.file", problem.message) for problem in error.problems]) from None
    missing = int((~np.isfinite(measured.heights)).sum())
    if wanted.holes == "keep":
        measured = replace(measured, far=np.zeros_like(measured.far))
    if measured.holes and wanted.holes != "fill":
        far = (
            f", {measured.far.sum()} of them fill values or spikes far beyond the others" if measured.far.any() else ""
        )
        kept = "" if missing else ", or 'keep' if these heights are real"
        message = f"{path.name} has {measured.holes} holes{far}. Set {key}.holes = 'fill'{kept}."
        raise CaseError(InputError(f"{key}.file", message))
    try:
        measured = measured.filled() if measured.holes else measured
    except ValueError as error:
        raise CaseError(InputError(f"{key}.file", f"{path.name}: {error}")) from None
    return measured if wanted.level is None else measured.levelled(wanted.level)


def _interpolated(measured: Heights, grid: RegularGrid, key: str) -> Array:
    """Return a map at the nodes of a grid, linear between its points; its middle is that of the grid."""
    from scipy.interpolate import RegularGridInterpolator  # which takes long to load

    if len(measured.places) != len(grid.counts):
        raise CaseError(InputError(key, f"has {len(measured.places)} coordinate(s), the contact {len(grid.counts)}"))
    for axis, places in enumerate(measured.places):
        spare = np.ptp(places) * (1 + SLACK) - grid.sides[axis]
        if spare < 0:
            message = (
                f"is {np.ptp(places):.4g} mm long, the contact grid {grid.sides[axis]:.4g}: expected a map over it"
            )
            raise CaseError(InputError(key, message))
        step = float(np.median(np.diff(places)))
        if grid.spacing[axis] > COARSE / 2 * step:
            nodes = int(float(np.max(grid.sides)) / step) + 1
            message = (
                f"has a height every {step:.4g} mm, but the contact grid has a node every {grid.spacing[axis]:.4g} mm, "
                f"too coarse for its roughness. Set grid.nodes = {nodes}, or average the map"
            )
            raise CaseError(InputError(key, message))
    middles = np.array([(axis_places[0] + axis_places[-1]) / 2 for axis_places in measured.places])
    at = grid.flat - grid.middle + middles
    low, high = (np.array([axis_places[end] for axis_places in measured.places]) for end in (0, -1))
    read = RegularGridInterpolator(measured.places, measured.heights)
    return np.asarray(read(np.clip(at, low, high)))
