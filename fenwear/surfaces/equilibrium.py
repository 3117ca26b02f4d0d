"""The equilibrium of the rigid modes at the interface: loads that pressure must balance, without any elasticity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fenwear.bodies.elasticity import ElasticBody
from fenwear.common.arrays import Array
from fenwear.surfaces.pair import ContactPair
from fenwear.surfaces.placement import in_model


def is_translation(mode: str) -> bool:
    """Return whether a rigid mode of this name moves along an axis, in mm; else it turns, in rad."""
    return mode.startswith("lambda_F")


@dataclass(frozen=True)
class RigidEquilibrium:
    """Data of the interface for the equilibrium of the rigid modes; no elasticity in it.

    sum of w_i p_i (e_n + tau)_i . m_i + F = 0 for each mode's relative motion m of the surfaces, per
    thickness in the plane; tau is the traction of friction on the punch over the pressure.

    Attributes:
        pair: The nodes and the transfer.
        motion: m (n, d, modes), the motion of the punch's surface against the strip's by each rigid mode.
        resultant: F = R^T f of the loads (modes,), N/mm and N; in a solid N and N mm.
        mode_names: Names of the rigid modes, lambda_F and lambda_M for a tilting punch; lambda_Fx along x.
        of_punch: Number of the punch's; they come first.
    """

    pair: ContactPair
    motion: Array
    resultant: Array
    mode_names: tuple[str, ...]
    of_punch: int

    @cached_property
    def rigid_normal(self) -> Array:
        """H (n, modes), the gap opened by each rigid mode."""
        return np.einsum("id,idm->im", self.pair.normal, self.motion)

    @cached_property
    def mode_lengths(self) -> Array:
        """Largest displacement along e_n of each rigid mode for a unit velocity (modes,): 1, and mm for a rotation."""
        return np.abs(self.rigid_normal).max(axis=0, initial=1e-300)

    def equilibrium(self, friction_ratio: Array | float) -> Array:
        """Return the load on each mode (modes, n) that pressure at each node balances.

        Args:
            friction_ratio: tau (n, d), in the model or in space; 0.0 for none.
        """
        traction = self.pair.normal + in_model(np.asarray(friction_ratio), self.pair.punch.dim)
        return np.einsum("id,idm->mi", traction, self.motion) * self.pair.weights

    def of(self, pressure: Array, friction_ratio: Array) -> Array:
        """Return the load on each mode (k, modes) that pressures (k, n) balance, with friction ratios (k, n, d)."""
        traction = self.pair.normal + in_model(friction_ratio, self.pair.punch.dim)
        traction *= (pressure * self.pair.weights)[..., None]
        return np.einsum("kid,idm->km", traction, self.motion)

    @property
    def mean_pressure(self) -> float:
        """Load over the nominal contact, MPa; 1 where supports and not the contact carry the load."""
        return self.carried / float(self.pair.weights.sum()) or 1.0

    @property
    def carried(self) -> float:
        """The load that the contact carries, N or N/mm; of bodies that turn about hinges moments over arms."""
        forces = [float(np.linalg.norm(self.resultant[axes])) for axes in self.translations]
        return sum(forces or [abs(float(self.resultant[k])) / self._arm(k) for k in range(len(self.resultant))])

    def _arm(self, mode: int) -> float:
        """Return the mean arm of the normals about the axis of a rotation, mm."""
        turned = np.abs(self.rigid_normal[:, mode])
        area = float(self.pair.weights @ (turned > 0))
        return float(self.pair.weights @ turned) / area if area > 0 else 1.0

    @property
    def translations(self) -> list[list[int]]:
        """Numbers of the modes that move along axes, of each part that has any: the punch's, or else the strip's."""
        along = [k for k, name in enumerate(self.mode_names) if is_translation(name)]
        chosen = [k for k in along if k < self.of_punch] or along
        parts: dict[str, list[int]] = {}
        for k in chosen:
            parts.setdefault(self.mode_names[k].partition("_F")[2].partition("_")[2], []).append(k)
        return list(parts.values())

    @property
    def approach(self) -> Array | None:
        """Motion of each part's nodes against the other body by the loads' translation (n, d); None without.

        Of each part against the resultant of the loads on it along its translations.
        """
        directions: Array = np.zeros(self.motion.shape[:2])
        for axes in self.translations:
            force = self.resultant[axes]
            share = -force / np.linalg.norm(force) if force.any() else np.eye(len(axes))[0]
            directions += self.motion[:, :, axes] @ share
        return directions if self.translations else None


def _seen(patterns: csr_array, motion: Array) -> Array:
    """Return the readings of motions (N, d, modes) by patterns (n, N), as (n, d, modes)."""
    seen = patterns @ motion.reshape(len(motion), -1)
    return np.asarray(seen).reshape(patterns.shape[0], *motion.shape[1:])


def rigid_equilibrium(pair: ContactPair, punch: ElasticBody, strip: ElasticBody) -> RigidEquilibrium:
    """Gather the rigid modes at the interface; collective."""
    return RigidEquilibrium(
        pair,
        relative_motion(pair, punch.rigid_motion, strip.rigid_motion),
        np.concatenate([punch.rigid_resultant, strip.rigid_resultant]),
        (*punch.mode_names, *strip.mode_names),
        len(punch.mode_names),
    )


def relative_motion(pair: ContactPair, of_punch: Array, of_strip: Array) -> Array:
    """Return motions of the punch's surface against the strip's (n, d, m) from those of trace nodes (N, d, m)."""
    on_punch = _seen(pair.punch.spread.T, of_punch)
    there = [pair.transfer @ pair.placement.vectors(motion) for motion in np.moveaxis(of_strip, 2, 0)]
    on_strip = np.stack(there, axis=2) if there else np.zeros((*on_punch.shape[:2], 0))
    return np.concatenate([on_punch, -on_strip], axis=2)
