"""Mixed lubrication in its simplest form: asperities carry a share X of the pressure, the fluid the rest.

    wear by X p in place of p,      mu = X mu_asperities + (1 - X) mu_fluid

(K. L. Johnson, J. A. Greenwood, S. Y. Poon, Wear 19, 1972, 91, for the load that is shared; E. R. M. Gelinck and D. J.
Schipper, Tribology International 33, 2000, 175, for curves of Stribeck by it). X is given, of a node's pressure, speed
and temperature, or over lambda, the film thickness over the roughness. No film is computed: neither its pressure, which
is taken to be distributed as that of the asperities, nor where the lubricant comes from.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fenwear.arrays import Array
from fenwear.case import Dependence
from fenwear.case.lubrication import Lubrication
from fenwear.errors import CaseError, InputError


def asperity_share(
    lubrication: Lubrication, state: Mapping[str, Array], shape: tuple[int, ...], *, checked: bool = True
) -> Array:
    """Return X at nodes (n,).

    Args:
        lubrication: Its table.
        state: Variables of laws at the nodes, by name.
        shape: Of nodal values.
        checked: Whether values of a law are: not on the way to a solution.

    Raises:
        CaseError: it is not between 0 and 1 somewhere, or the film is not positive.
    """
    name, value = lubrication.given
    key = f"contact.lubrication.{name}"
    if not isinstance(value, Dependence):
        found = np.full(shape, float(value))
    else:
        of_film = name == "film"
        factor, least = (value.scale("mm"), 1e-300) if of_film else (1.0, 0.0)
        found = value.values(state, shape, factor, key, least, checked=checked)
    if name == "film":
        return np.asarray(np.interp(found / (lubrication.roughness or 1.0), *np.array(lubrication.share_over_lambda).T))
    if checked and np.maximum.reduce(found) > 1:
        at = int(found.argmax())
        told = ", ".join(f"{one} = {np.broadcast_to(state[one], shape)[at]:g}" for one in ("p", "v", "T"))
        raise CaseError(InputError(key, f"expected at most 1, got {found[at]:g} at {told}"))
    return np.asarray(found)
