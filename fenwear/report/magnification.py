"""How many times larger displacements are drawn than they are."""

from __future__ import annotations

import numpy as np


def magnification(largest: float, width: float) -> float:
    """Return a round factor that shows the largest displacement as about a tenth of the width."""
    if largest <= 0:
        return 1.0
    target = 0.1 * width / largest
    power = 10.0 ** np.floor(np.log10(target))
    return float(max(step * power for step in (1, 2, 5) if step * power <= target))
