"""The errors that fenwear raises on purpose; the command line maps each to an exit status."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple


class FenwearError(Exception):
    """Base of all errors below."""


class InputError(NamedTuple):
    """One thing wrong with a case: the key's path and what was expected there."""

    key: str
    message: str


def did_you_mean(word: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return "; did you mean ...?" of a misspelt word; "" where no known one is near."""
    close = difflib.get_close_matches(word, list(known), 1, cutoff)
    return f"; did you mean {close[0]!r}?" if close else ""


def readable(value: float, digits: int = 2) -> str:
    """Return a number in some digits, without an exponent where it is large."""
    text = f"{value:,.{digits}g}"
    return f"{float(text):,.0f}" if "e+" in text else text


def _shortened(text: str, length: int = 500) -> str:
    """Return a text that may repeat what a file holds, however long that is, as long as people read."""
    return text if len(text) <= length else f"{text[: length - 50]} ... ({len(text):,} characters)"


class CaseError(FenwearError):
    """The case, its geometry or the usage is wrong; lists every problem found."""

    def __init__(self, problems: Sequence[InputError] | InputError) -> None:
        listed = [problems] if isinstance(problems, InputError) else problems
        self.problems = [InputError(_shortened(p.key), _shortened(p.message)) for p in listed]
        super().__init__("\n".join(f"{p.key}: {p.message}" if p.key else p.message for p in self.problems))

    def __reduce__(self) -> tuple[type[CaseError], tuple[list[InputError]]]:
        return type(self), (self.problems,)  # crosses ranks by pickle


class ConvergenceError(FenwearError):
    """A solver did not converge; names the solver, the reason and what may help."""


class CoefficientError(CaseError, ConvergenceError):
    """A coefficient is not finite or too small at a state: the case is wrong, or the state is only an iterate."""


class HeatError(ConvergenceError):
    """Temperatures that no friction and no boundary can make: the heat, not the contact, has failed."""


class OutputError(FenwearError):
    """A file of the results cannot be written: names it, the reason and, in a run, the way to resume."""

    def __init__(self, path: Path, reason: str, how_to_go_on: str = "") -> None:
        self.path, self.reason, self.how_to_go_on = path, reason, how_to_go_on
        super().__init__("\n".join(filter(None, (f"{path} cannot be written: {reason}", how_to_go_on))))

    def __reduce__(self) -> tuple[type[OutputError], tuple[Path, str, str]]:
        return type(self), (self.path, self.reason, self.how_to_go_on)  # crosses ranks by pickle


class RanksError(FenwearError):
    """Ranks did not act together: one leads where all are asked for, or its answer cannot reach them."""


class StackError(FenwearError, ImportError):
    """A part of what fenwear is built on is missing or of the wrong kind; says which, and how to install it."""


class InterruptedRunError(FenwearError):
    """A signal ended a run; its checkpoint can be resumed."""


class TimeUpError(Exception):
    """A task took longer than its time limit."""


class PartDoneError(FenwearError):
    """A part of a study is done, and others are not: there is no result yet."""


class MeshQualityError(ConvergenceError):
    """A mesh that follows the wear has an element that is no longer good enough to compute on."""


FULL_START = "contact solved from full contact on"
INTERIOR = "contact solved by an interior-point method"
SOFTER_START = "contact solved by way of softer bodies"
SMALLER_STEPS = "solved in {} smaller steps"
SHORTER_JUMPS = "jump shortened"
MARCHED = "cycle marched in place of a jump"
GRAZING = "nodes conduct whose pressure tends to nothing"


class Remedies:
    """Counts remedies by their names until they are taken; the same on every rank."""

    def __init__(self) -> None:
        self._noted: Counter[str] = Counter()

    def note(self, name: str) -> None:
        """Count a remedy."""
        self._noted[name] += 1

    def take(self) -> Counter[str]:
        """Return the remedies noted since the last call; mostly none."""
        noted, self._noted = self._noted, Counter()
        return noted
