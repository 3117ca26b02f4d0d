"""The scatter of measurements: independent, adding up from one row to the next, or alike over a length.

    independent      each row has an error of its own, with the standard deviation sigma;
    adds up          a specimen is weighed and goes on: the increments since the row before are independent. sigma is
                     that of an increment; without it their variance grows with the sliding between the rows;
    alike over l     the roughness of a profile: neighbours have the correlation exp(-|x - x'| / l).

The file of the measurements says which, by `# scatter = ...`. Residuals are whitened by it (generalised least squares),
so that standard errors and Student's intervals hold for any number of rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fenwear.arrays import Array
from fenwear.case.units import convert
from fenwear.life.quantities import GROWING

TIED = 0.1  # of the usual spacing: how far apart places count that are the same
FEW, SMOOTH = 20, 1.5  # rows that say little of their scatter; von Neumann's ratio below which they are correlated


@dataclass(frozen=True)
class Noise:
    """How the errors of a series depend on each other.

    Attributes:
        kind: Of the module's docstring; "" where the file does not say, which counts as independent.
        length: Over which errors are alike, mm.
    """

    kind: Literal["", "independent", "adds up", "alike"] = ""
    length: float = 0.0

    @classmethod
    def parse(cls, text: str) -> Noise:
        """Return the noise that a file asks for.

        Raises:
            ValueError: none of the three.
        """
        if text in ("independent", "adds up"):
            return cls(text)  # type: ignore[arg-type]
        if not text.startswith("alike over "):
            raise ValueError(f"expected independent, adds up or alike over LENGTH (such as 0.2 mm), got {text!r}")
        length = convert(text.removeprefix("alike over "), "mm")
        if not length > 0:
            raise ValueError(f"expected a length above zero, got {text!r}")
        return cls("alike", length)

    def check(self, quantity: str, x: Array | None) -> None:
        """Check that a quantity can scatter so.

        Raises:
            ValueError: it cannot.
        """
        if self.kind == "adds up" and (x is not None or quantity not in GROWING):
            raise ValueError(f"{quantity} does not add up; expected {', '.join(GROWING)} after more and more sliding")
        if self.kind == "alike" and x is None:
            raise ValueError("expected a profile, with a column x")

    def whitened(self, values: Array, sigma: Array | None, x: Array | None, after: Array) -> Array:
        """Return residuals or columns of their Jacobian (n, ...) as those of independent errors of one size.

        Args:
            values: In the unit of the measurement (n, ...).
            sigma: (n,), or none.
            x: Places of a profile (n,), mm.
            after: Sliding before each row (n,).
        """
        over = np.ones(len(values)) if sigma is None else sigma
        wide = (slice(None),) + (None,) * (values.ndim - 1)
        if self.kind == "adds up":
            steps = in_order(np.concatenate([[0.0], after]))[1]
            over = np.sqrt(steps / steps.mean()) if sigma is None else sigma
            return np.diff(values, axis=0, prepend=0.0) / over[wide]
        scaled = values / over[wide]
        if self.kind != "alike" or x is None:
            return np.asarray(scaled)
        order, gaps = in_order(x)
        alike, rest, ordered = np.exp(-gaps / self.length), np.sqrt(-np.expm1(-2 * gaps / self.length)), scaled[order]
        return np.concatenate([ordered[:1], (ordered[1:] - alike[wide] * ordered[:-1]) / rest[wide]])


def in_order(x: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the order of places (n,), and the gaps between them (n - 1,), mm."""
    order: NDArray[np.int64] = np.argsort(x, kind="stable")
    gaps = np.diff(x[order])
    usual = float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else 1.0
    return order, np.maximum(gaps, TIED * usual)


def neighbours_ratio(residual: Sequence[float] | Array) -> float:
    """Return von Neumann's ratio: 2 for independent residuals, near 0 for those like their neighbours."""
    found = np.asarray(residual)
    return float((np.diff(found) ** 2).sum() / max(float(found @ found), 1e-300))
