"""What lies between two surfaces, as one: what it adds to the gap of the nodes, and the rows of its state.

    gap = bodies + winkler p + factor delta(p) - t

with the linear closure, that of a law (`closure`) and the thickness of debris (`debris`). What is linear in the
pressure belongs to the compliance of the bodies (`fenwear.interface.Interface`), so that every study has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Case, Contact
from fenwear.case.layers import (
    STIFFNESS,
    ExponentialLayer,
    LinearLayer,
    PowerLayer,
    RoughLayer,
    place_values,
)
from fenwear.errors import CaseError, InputError
from fenwear.interface import ContactPair
from fenwear.interface.placement import in_space
from fenwear.layers.closure import Closure, ExponentialClosure, PowerClosure, RoughClosure
from fenwear.layers.debris import Debris

RMS = np.sqrt(np.pi / 2)  # of Gaussian heights over Sa
DEBRIS = ("debris_thickness", "debris_ejected")


@dataclass(frozen=True)
class Layers:
    """What lies between the surfaces at n nodes.

    Attributes:
        nodes: n.
        closure: The law by which it gives way; None where it does not, or in proportion to the pressure.
        winkler: Closure over pressure of a linear layer (n,), mm/MPa; None without.
        debris: Of the third body; None without.
    """

    nodes: int
    closure: Closure | None = None
    winkler: Array | None = None
    debris: Debris | None = None

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows of the state, mm each: thickness of the debris, and depth that is ejected."""
        return () if self.debris is None else DEBRIS

    @property
    def nothing(self) -> bool:
        """Whether it changes nothing of contact and wear beside the compliance of the bodies."""
        return self.closure is None and self.debris is None

    def given(self, pressure: Array) -> Array:
        """Return by how much pressures (..., n) close what lies between, mm."""
        found = np.zeros_like(pressure) if self.winkler is None else self.winkler * pressure
        return found if self.closure is None else found + self.closure.closure(pressure)

    def beginning(self) -> Array:
        """Return the state at the start (rows, n)."""
        state = np.zeros((len(self.rows), self.nodes))
        if self.debris is not None:
            state[0] = self.debris.initial
        return state

    def opening(self, state: Array) -> Array | float:
        """Return the gap that a state opens (n,), mm."""
        return -state[0] if self.debris is not None and len(state) else 0.0

    def settled(self, state: Array) -> Array:
        """Return a state after a step that may have overshot: no thickness below zero, nothing lost."""
        if self.debris is None or not len(state) or state[0].min(initial=0.0) >= 0:
            return state
        return np.array([np.maximum(state[0], 0.0), state[1] + np.minimum(state[0], 0.0)])


def layers_of(contact: Contact, pair: ContactPair, modulus: float | None = None) -> Layers:
    """Return what the table of the contact puts between the surfaces of a pair.

    Args:
        contact: The table.
        pair: The surfaces.
        modulus: E* of the materials at the contact, MPa; None where there is none for all of it.

    Raises:
        CaseError: a value is not positive somewhere, or E* is missing.
    """
    n, winkler, debris = len(pair.weights), None, None
    closure: Closure | None = None
    place = dict(zip("xyz", in_space(pair.punch.x).T, strict=True))
    match contact.layer:
        case LinearLayer(stiffness=stiffness):
            winkler = 1 / place_values(stiffness, place, n, STIFFNESS, "contact.layer.stiffness")
        case PowerLayer() as law:
            closure = PowerClosure(law.reference, law.pressure, law.exponent)
        case ExponentialLayer() as law:
            closure = ExponentialClosure(law.length, law.pressure)
        case RoughLayer() as law:
            closure = _rough(law, modulus)
    third = contact.third_body
    if third is not None:
        life = place_values(third.life, place, n, "mm", "contact.third_body.life")
        debris = Debris(third.share, life, third.initial)
    return Layers(n, closure, winkler, debris)


def _rough(law: RoughLayer, modulus: float | None) -> Closure:
    young = law.modulus or modulus
    if young is None:
        message = "missing, but required where a body has several materials at the contact"
        raise CaseError(InputError("contact.layer.modulus", message))
    height = RMS * law.roughness
    stiffness = 4 / 3 * young * law.asperity_density * np.sqrt(law.asperity_radius) * height**1.5
    return RoughClosure(float(height), float(stiffness))


def common_modulus(case: Case, punch: Mapping[str, Array], strip: Mapping[str, Array]) -> float | None:
    """Return E*, 1/E* = sum of (1 - nu^2)/E at the initial temperature, MPa; None where a body has several there.

    Args:
        case: With the materials.
        punch, strip: Shares of the regions in the contact nodes (n,), by their names.
    """
    materials, given = case.initial_materials, 0.0
    for shares, body in ((punch, case.punch), (strip, case.strip)):
        own = {body.regions[name] for name, share in shares.items() if share.any()}
        if len(own) != 1:
            return None
        material = materials[own.pop()]
        given += (1 - material.poisson**2) / float(material.young)
    return 1 / given
