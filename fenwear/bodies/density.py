"""The density of what is worn off a body: that of the regions which its contact surface belongs to."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fenwear.arrays import Array


def contact_density(shares: Mapping[str, Array], densities: Mapping[str, float | None]) -> Array | None:
    """Return the density at the pressure nodes (n,), N s²/mm⁴; None where a region there has none.

    A node between two regions has the mean of both.

    Args:
        shares: Of the regions in the nodes (n,), by their names.
        densities: Of the regions.
    """
    found = np.zeros(len(next(iter(shares.values()))))
    for name, share in shares.items():
        rho = densities.get(name)
        found += np.where(share > 0, share * (np.nan if rho is None else rho), 0.0)
    return found if bool(np.isfinite(found).all()) else None
