"""The contact conductance of a layer of asperities, from how stiff it is.

A small round contact of radius a between two half-spaces conducts 2 k a per kelvin, with the harmonic mean of both
conductivities k = 2 k_1 k_2 / (k_1 + k_2), and is as stiff as 2 E* a: the conductance of many of them, far enough from
each other, follows from the stiffness of the layer that they make, whatever their heights,

    h_c = (k / E*) dp/d(delta)

(J. R. Barber, Proc. R. Soc. Lond. A 459, 2003, 53). For the asperities of Greenwood and Williamson that is
h_c = 2 k eta sqrt(R sigma) F_(1/2)(d / sigma), with F_(1/2) the integral of (z - h)^(1/2) phi(z) from h = d / sigma on.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fenwear.case import Case
from fenwear.case.contact_table import RoughLayer
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.laws.compliant_layer import SharedClosure
from fenwear.laws.layers import Layers, Regions, common_modulus, over_materials
from fenwear.surfaces import ContactPair

Conductance = Callable[[Array, int], Array]


def conductance_of(layers: Layers, case: Case, regions: Regions, pair: ContactPair) -> Conductance | None:
    """Return h_c (n,), N/(mm s K), by the pressures (n,), MPa, and the phase; None where the case gives it otherwise.

    Args:
        layers: The layers.
        case: With heat.conductance = "layer".
        regions: Shares of the regions of punch and strip in their own contact nodes, by their names.
        pair: The surfaces opposite each other.

    Raises:
        CaseError: the share that asperities carry depends on the temperature.
    """
    if case.heat is None or case.heat.conductance != "layer":
        return None
    if isinstance(layers.closure, SharedClosure) and "T" in layers.closure.variables:
        message = (
            "expected a number: contact.lubrication depends on T. Spots that conduct by their own temperature make "
            "conduction non-linear, which its steps are not"
        )
        raise CaseError(InputError("heat.conductance", message))
    given = getattr(case.contact.layer, "modulus", None) if isinstance(case.contact.layer, RoughLayer) else None
    modulus = common_modulus(case, regions, pair) if given is None else given
    resistance = over_materials(case, regions, pair, lambda material: 0.5 / float(material.conductivity or np.nan))
    share = 1 / (resistance * modulus)  # 2 k_1 k_2 / (k_1 + k_2) over E*

    def conductance(pressure: Array, phase: int) -> Array:
        closure, carried = layers.at(phase).gives, np.maximum(pressure, 0.0)
        if isinstance(closure, SharedClosure):  # the spots conduct that asperities make
            carried = closure.carried(carried)
            closure = closure.law
        return np.asarray(share / (layers.winkler + closure.slope(carried)))

    return conductance
