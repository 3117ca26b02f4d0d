"""The contact conductance of a layer of asperities, from how stiff it is.

A small round contact of radius a between two half-spaces conducts 2 k a per kelvin, with the harmonic mean of both
conductivities k = 2 k_1 k_2 / (k_1 + k_2), and is as stiff as 2 E* a: the conductance of many of them, far enough from
each other, follows from the stiffness of the layer that they make, whatever their heights,

    h_c = (k / E*) dp/d(delta)

(J. R. Barber, Proc. R. Soc. Lond. A 459, 2003, 53). For the asperities of Greenwood and Williamson that is
h_c = 2 k eta sqrt(R sigma) F_(1/2)(d / sigma), with F_(1/2) the integral of (z - h)^(1/2) phi(z) from h = d / sigma on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.case.layers import RoughLayer
from fenwear.errors import CaseError, InputError
from fenwear.layers.between import Layers, common_modulus

Conductance = Callable[[Array], Array]


def conductance_of(
    layers: Layers, case: Case | None, regions: tuple[Mapping[str, Array], Mapping[str, Array]]
) -> Conductance | None:
    """Return h_c of the nodes (n,), N/(mm s K), by their pressures (n,), MPa; None where the case gives it otherwise.

    Args:
        layers: What lies between.
        case: With heat.conductance = "layer".
        regions: Shares of the regions of punch and strip in the contact nodes (n,), by their names.

    Raises:
        CaseError: a body has several materials at the contact.
    """
    if case is None or case.heat is None or case.heat.conductance != "layer":
        return None
    given = getattr(case.contact.layer, "modulus", None) if isinstance(case.contact.layer, RoughLayer) else None
    modulus, conductivity = given or common_modulus(case, *regions), _conductivity(case, *regions)
    if modulus is None or conductivity is None:
        raise CaseError(InputError("heat.conductance", "expected one material of each body at the contact for 'layer'"))
    share = conductivity / modulus

    def conductance(pressure: Array) -> Array:
        given_way = np.zeros_like(pressure) if layers.winkler is None else layers.winkler
        closure = layers.closure
        slope = given_way if closure is None else given_way + closure.slope(np.maximum(pressure, 0.0))
        return np.asarray(share / slope)

    return conductance


def _conductivity(case: Case, punch: Mapping[str, Array], strip: Mapping[str, Array]) -> float | None:
    """Return 2 k_1 k_2 / (k_1 + k_2) at the initial temperature, N/(s K); None where a body has several materials."""
    materials, resistance = case.initial_materials, 0.0
    for shares, body in ((punch, case.punch), (strip, case.strip)):
        own = body.materials_at(shares)
        if len(own) != 1:
            return None
        resistance += 0.5 / float(materials[own.pop()].conductivity or np.nan)
    return 1 / resistance
