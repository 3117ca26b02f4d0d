"""Types of arrays, for hints."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Nodes: TypeAlias = NDArray[np.integer[Any]] | slice  # some of them, by their numbers
