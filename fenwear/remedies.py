"""What was done where the usual way to solve did not converge: noted where it happens, told with the results."""

from __future__ import annotations

from collections import Counter

FULL_START = "contact solved from full contact on"
PIVOTS = "contact solved by pivots"
SOFTER_START = "contact solved by way of softer bodies"
SMALLER_STEPS = "solved in {} smaller steps"
SHORTER_JUMPS = "jump shortened"
MARCHED = "cycle marched in place of a jump"
NONE: Counter[str] = Counter()
GRAZING = "nodes conduct whose pressure tends to nothing"


class Remedies:
    """Counts remedies by their names until they are taken; the same on every rank."""

    def __init__(self) -> None:
        self._noted: Counter[str] = Counter()

    def note(self, name: str) -> None:
        """Count a remedy."""
        self._noted[name] += 1

    def take(self) -> Counter[str]:
        """Return what was noted since the last time; mostly nothing."""
        if not self._noted:
            return NONE
        noted, self._noted = self._noted, Counter()
        return noted
