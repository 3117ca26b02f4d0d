"""Newton's steps by the factor of an earlier derivative, where it changes with the solution.

    step = -K^-1 F

K is the derivative of an earlier place, whose factor is kept. What bends is local: the step of each unknown is taken
over how its own diagonal has grown since. What is left of the error is corrected by Broyden's updates of rank one,
whose steps of all solves since the factor tell how the derivative has changed (C. T. Kelley, Iterative Methods for
Linear and Nonlinear Equations, SIAM 1995, 7.3). Unknowns that come to be free, and give way by themselves far more than
by the bodies, as the last asperities that touch do, step by their diagonal alone. Another factor is made where the
steps that it would have saved have cost as much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fenwear.arrays import Array, Mask
from fenwear.contact.operators import Indices, Operator, Solve

MOST_UPDATES = 20  # of rank one, that are kept
MOST_SHARE = 0.5  # of a step along the last one, that is corrected
BENT = 1e-3  # change of a diagonal in a step, over it: beyond it the law's own bend is what is left of the residual
NEWTONS = 2  # steps, that Newton's own take of a start that is near
STEEP = 10.0  # times what the bodies give way by: what unknowns do alone whose set may change without a factor
Diagonal = Callable[[Array], tuple[Array, Array] | None]


@dataclass(frozen=True)
class Factor:
    """The factor of the free rows and columns of an operator.

    Attributes:
        operator: What is factored.
        key: Which of all are free, as bytes.
        free: Their numbers; a slice where all are free.
        bounded: The others.
        solve: The solution operator.
    """

    operator: Operator
    key: bytes
    free: Indices | slice
    bounded: Indices
    solve: Solve


@dataclass
class Chord:
    """Steps by one factor.

    Attributes:
        factor: Of the derivative where it was made.
        cost: Of it, in steps.
        bent: Diagonal of the derivative there (size,); None where it is not known.
    """

    factor: Factor
    cost: float
    bent: Array | None
    _spent: int = 0
    _last: Array | None = None
    _at: Array | None = None  # diagonal where the next step begins
    _bends: bool = False  # whether it has changed since the last step

    def __post_init__(self) -> None:
        size = len(self.factor.key)
        self._by: Array = np.zeros((0, size))  # updates: what they add to a step is onto^T (by step)
        self._onto: Array = np.zeros((0, size))

    def of(self, factor: Factor) -> Chord:
        """Return steps by another factor of the same derivative."""
        return Chord(factor, self.cost, self.bent, self._spent)

    def solved(self, steps: int) -> None:
        """Take note of a solve of so many steps."""
        self._spent += max(steps - NEWTONS, 0)

    @property
    def worn_out(self) -> bool:
        """Whether its steps beyond Newton's own have come to cost as much as another one."""
        return self._spent > self.cost

    def serves(self, free: Mask, bodies: Array, bends: Array) -> bool:
        """Return whether all unknowns that are free (size,), but were not, or the reverse, bend by themselves alone.

        Args:
            free: Which are free now.
            bodies, bends: The two parts of the diagonal, of what unknowns share and of what is their own.
        """
        changed = free != np.frombuffer(self.factor.key, dtype=bool)
        return bool((bends[changed] > STEEP * bodies[changed]).all())

    def begin(self, diagonal: Array | None) -> None:
        """Forget the last step: the next one does not follow it.

        Args:
            diagonal: Of the derivative where it begins (size,); None where it is not known.
        """
        self._last, self._bends = None, False
        self._at = None if self.bent is None else diagonal

    def bend(self, diagonal: Array | None) -> None:
        """Take the diagonal where the next step begins (size,), which follows the last one; None where not known."""
        if self._at is not None and diagonal is not None:
            self._bends = bool((np.abs(diagonal - self._at) > BENT * self._at).any())
            self._at = diagonal

    def step(self, rest: Array, key: bytes) -> Array:
        """Return the step (size,) of the free unknowns, nothing for the others.

        Args:
            rest: The residual of the free unknowns, nothing for the others (size,).
            key: Which unknowns are free, as bytes.
        """
        factor, at = self.factor, self._at
        if isinstance(factor.free, slice):
            opens = factor.solve(rest)
        else:
            opens = np.zeros_like(rest)
            opens[factor.free] = factor.solve(rest[factor.free])
        if at is not None and self.bent is not None:
            opens *= self.bent
        if key != factor.key:
            free, before = (np.frombuffer(one, dtype=bool) for one in (key, factor.key))
            opens = np.where(free, np.where(before, opens, rest), 0.0)
        opens = self._corrected(np.negative(opens, out=opens))
        return opens if at is None else opens / at

    def _corrected(self, step: Array) -> Array:
        """Return a step by Broyden's updates, in what unknowns open by themselves: in it those that bend are alike.

        The last one tells of the derivative where nothing bends by itself.
        """
        if len(self._by):
            step = step + self._onto.T @ (self._by @ step)
        last, self._last = self._last, step
        if last is None:
            return step
        square = float(last @ last)
        share = float(last @ step) / square
        if self._bends or not share < MOST_SHARE:
            return step
        self._last = step = np.asarray(step / (1 - share))
        if len(self._by) < MOST_UPDATES:  # (1 + onto by) after those before, as one sum
            by = last / square
            if len(self._by):
                by = by + (self._onto @ by) @ self._by
            self._by, self._onto = np.vstack([self._by, by]), np.vstack([self._onto, step])
        return step
