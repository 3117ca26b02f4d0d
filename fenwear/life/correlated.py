"""Errors of measurements that are correlated: scatter that adds up from one volume to the next, roughness of profiles.

Residuals r = J d + e of a fit, over the given standard deviations if there are some, with covariance c² S:

    what grows (volumes, depths, widths after more and more sliding)    S = 1 + q R, R_ij = min(s_i, s_j) / step:
        errors of reading, and increments of independent scatter whose variance grows with the sliding s between them;
    profiles, friction, temperatures     S_ij = exp(-|x_i - x_j| / l), of places or amounts of sliding x.

The restricted likelihood of a parameter t = q or l is |S|^-1/2 |J^T S^-1 J|^-1/2 RSS^-(n - m)/2, RSS = r^T S^-1 r at
the best d (H. D. Patterson and R. Thompson, Biometrika 58, 1971). Its ratio to that of independent errors tests for
correlation; how it is distributed without any is drawn by chance (C. Crainiceanu and D. Ruppert, J. R. Stat. Soc. B
66, 2004). Where it shows, every t counts by its restricted likelihood and a prior: for each d is distributed as
Student's t with n - m degrees of freedom, and intervals are quantiles of the mixture. So they know how little
is known of t (J. O. Berger, V. De Oliveira and B. Sanso, J. Am. Stat. Assoc. 96, 2001). The priors: uniform in log q,
and half of all on increments alone; of l Jeffreys', up to `LONGEST` of a profile.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise, product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize, stats

from fenwear.arrays import Array
from fenwear.life.data import Series
from fenwear.life.quantities import GROWING

LARGEST_CONDITION = 1e12  # of the Jacobian, beyond which the data do not tell what is fitted
LEVEL = 0.2  # share of independent residuals that count as correlated: a lenient test, as few data show little
DRAWS, SEED = 499, 1  # of independent residuals
LEAST_FREEDOM = 3  # measurements less unknowns, from which residuals tell anything
NEGLIGIBLE = 0.05  # of sigma²: residuals less than this are no errors of measurement
RATIOS = np.logspace(-3, 3, 31)  # q
TIED = 0.1  # of the usual spacing: places that are the same
SHORTEST, LONGEST, LENGTHS = 0.3, 0.7, 31  # of the spacing and of the extent: l, and how many
SAME = 1e-9  # of an error
HIDDEN, OPEN = (
    1.5,
    2.0,
)  # factor of a standard error worth a word; logarithm of a likelihood ratio that excludes nothing

Whitener: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class _Member:
    """One S of a kind of series: q or l, its logarithmic prior, and of each series L^-1 and log |S|."""

    value: float
    prior: float
    parts: tuple[tuple[Whitener, float], ...]


@dataclass(frozen=True)
class _Family:
    """A kind of series: which (k,), in words, and all its members, the uncorrelated one first."""

    which: tuple[int, ...]
    adds_up: bool
    members: tuple[_Member, ...]


@dataclass(frozen=True)
class Correlated:
    """Residuals that are correlated.

    Attributes:
        whiten: Takes residuals (n, ...) to independent ones, for the most probable correlation.
        lines: What is to be said, in sentences.
    """

    whiten: Whitener
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Mixture:
    """Where the unknowns are: Student's t with `freedom` for each of k covariances.

    Attributes:
        weights: (k,), their sum is one.
        means: (k, m), by how much the unknowns differ from the fit.
        covariances: (k, m, m).
        freedom: Degrees of freedom.
    """

    weights: Array
    means: Array
    covariances: Array
    freedom: int

    @property
    def covariance(self) -> Array:
        """Mean covariance about the fit (m, m)."""
        inner = self.covariances + self.means[:, :, None] * self.means[:, None, :]
        return np.asarray(np.einsum("k,kij->ij", self.weights, inner))

    def below(self, j: int, value: float) -> float:
        """Return the probability that unknown j differs from the fit by less than a value."""
        errors = np.sqrt(self.covariances[:, j, j])
        return float(self.weights @ stats.t.cdf((value - self.means[:, j]) / errors, self.freedom))

    def interval(self, j: int, level: float = 0.95) -> tuple[float, float]:
        """Return the ends that hold unknown j less its fit with a probability."""
        ends = []
        errors = np.sqrt(self.covariances[:, j, j])
        for share in ((1 - level) / 2, (1 + level) / 2):
            each = self.means[:, j] + errors * stats.t.ppf(share, self.freedom)
            low, high = float(each.min()), float(each.max())
            if high - low > SAME * float(errors.min()):
                low = optimize.brentq(lambda value, q=share: self.below(j, value) - q, low, high)
            ends.append(low)
        return ends[0], ends[1]


class Correlation:
    """The models of correlation of some series, as they are measured.

    Args:
        series: What was measured.
        jacobian: Of the residuals over sigma by all that is fitted (n, p), where the fit ends.
        sigma: (n,); ones where there is none.
        has_sigma: Whether there is one.
    """

    def __init__(self, series: Sequence[Series], jacobian: Array, sigma: Array, *, has_sigma: bool) -> None:
        self._jacobian, self._has_sigma, self._series = jacobian, has_sigma, list(series)
        ends = np.cumsum([0, *(len(one.values) for one in series)])
        self._rows = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self._families = []
        for adds_up in (True, False):
            which = [k for k, one in enumerate(series) if _adds_up(one) is adds_up and len(one.values) > 1]
            if which:
                own = [(series[k], sigma[self._rows[k]]) for k in which]
                members = _increments(own) if adds_up else _waves([one for one, _ in own])
                self._families.append(_Family(tuple(which), adds_up, members))
        self._choices = list(product(*(family.members for family in self._families)))

    @property
    def _known(self) -> bool:
        """Whether the data tell all that is fitted."""
        lengths = np.linalg.norm(self._jacobian, axis=0)
        return bool((lengths > 0).all() and np.linalg.cond(self._jacobian / lengths) < LARGEST_CONDITION)

    @property
    def freedom(self) -> int:
        """Measurements less unknowns."""
        n, p = self._jacobian.shape
        return n - p

    def test(self, residual: Array) -> tuple[Correlated | None, tuple[str, ...]]:
        """Return the correlation of residuals over sigma (n,), if there is one; and what is to be said if not."""
        freedom = self.freedom
        small = self._has_sigma and residual @ residual <= NEGLIGIBLE * freedom
        if freedom < LEAST_FREEDOM or small or not residual.any() or not self._known or not self._families:
            return None, ()
        found = self._likelihoods(residual[:, None])[:, 0]
        ratio = float(found.max() - found[0])
        p = float((1 + (self._by_chance >= ratio).sum()) / (1 + DRAWS))
        best = self._choices[int(found.argmax())]
        if ratio == 0 or p > LEVEL:
            return None, self._hidden(residual, found)
        return Correlated(partial(self._whitened, best), (self._told(best, p),)), ()

    @cached_property
    def _by_chance(self) -> Array:
        """The logarithms of the likelihood ratio of independent residuals, drawn (DRAWS,)."""
        drawn = np.random.default_rng(SEED).standard_normal((len(self._jacobian), DRAWS))
        found = self._likelihoods(drawn)
        return np.asarray(found.max(axis=0) - found[0])

    def _likelihoods(self, residuals: Array) -> Array:
        return np.array([self._likelihood(choice, residuals) for choice in self._choices])

    def mixture(self, residual: Array, m: int) -> Mixture:
        """Return where the first m of the unknowns are, given residuals over sigma (n,) that are correlated."""
        logs, means, covariances = [], [], []
        for choice in self._choices[1:]:
            r, rest, step = self._fit(choice, residual[:, None])
            inverse = np.linalg.inv(r)
            logs.append(self._likelihood(choice, residual[:, None])[0] + sum(one.prior for one in choice))
            means.append(step[:m, 0])
            covariances.append((inverse @ inverse.T)[:m, :m] * float(rest[0]) / self.freedom)
        weights = np.exp(np.array(logs) - max(logs))
        return Mixture(weights / weights.sum(), np.array(means), np.array(covariances), self.freedom)

    def _whitened(self, choice: Sequence[_Member], values: Array) -> Array:
        found = np.array(values, dtype=float)
        for family, member in zip(self._families, choice, strict=True):
            for k, (whiten, _) in zip(family.which, member.parts, strict=True):
                found[self._rows[k]] = whiten(found[self._rows[k]])
        return found

    def _fit(self, choice: Sequence[_Member], residuals: Array) -> tuple[Array, Array, Array]:
        """Return R of the whitened Jacobian, RSS (c,) of residuals (n, c), and the steps to their best fits."""
        p = self._jacobian.shape[1]
        both = self._whitened(choice, np.hstack([self._jacobian, residuals]))
        q, r = np.linalg.qr(both[:, :p])
        along = q.T @ both[:, p:]
        rest = (both[:, p:] ** 2).sum(axis=0) - (along**2).sum(axis=0)
        return r, np.maximum(rest, 1e-300), -np.linalg.solve(r, along)

    def _likelihood(self, choice: Sequence[_Member], residuals: Array) -> Array:
        """Return the logarithms of the restricted likelihood of residuals (n, c): (c,)."""
        r, rest, _ = self._fit(choice, residuals)
        size = sum(log for member in choice for _, log in member.parts)
        return np.asarray(-size / 2 - np.log(np.abs(np.diag(r))).sum() - self.freedom / 2 * np.log(rest / self.freedom))

    def _told(self, best: Sequence[_Member], p: float) -> str:
        texts = []
        for family, member in zip(self._families, best, strict=True):
            names = " and ".join(dict.fromkeys(self._series[k].quantity for k in family.which))
            if not member.value:
                continue
            if family.adds_up:
                texts.append(f"scatter of {names} that adds up from one measurement to the next")
            else:
                of_profiles = any(self._series[k].x is not None for k in family.which)
                over = f" over {member.value:.3g} mm" if of_profiles else ""
                texts.append(f"residuals of {names} that are alike{over}: roughness, or what the model does not have")
        return f"the residuals are correlated (restricted likelihood ratio, p = {p:.2g}): " + "; ".join(texts)

    def _hidden(self, residual: Array, likelihood: Array) -> tuple[str, ...]:
        """Say how wide the errors would be if scatter added up, where so few data cannot tell."""
        for number, choice in enumerate(self._choices):
            pairs = zip(self._families, choice, strict=True)
            if any(one is not own.members[-1 if own.adds_up else 0] for own, one in pairs):
                continue
            if number == 0 or likelihood[number] < likelihood[0] - OPEN:
                return ()
            factor = float((self._errors(choice, residual) / self._errors(self._choices[0], residual)).max())
            if factor > HIDDEN:
                return (f"the data are too few to tell whether their scatter adds up from one measurement to the next: "
                        f"if it does, standard errors are up to {factor:.2g} times as large",)  # fmt: skip
        return ()

    def _errors(self, choice: Sequence[_Member], residual: Array) -> Array:
        """Return the standard errors of all that is fitted (p,)."""
        r, rest, _ = self._fit(choice, residual[:, None])
        return np.asarray(np.linalg.norm(np.linalg.inv(r), axis=1) * np.sqrt(rest[0] / self.freedom))


def _adds_up(series: Series) -> bool:
    return series.x is None and series.quantity in GROWING


def _as_they_are(values: Array) -> Array:
    return values


def _independent(count: int) -> _Member:
    return _Member(0.0, float(np.log(0.5)), ((_as_they_are, 0.0),) * count)


def _increments(series: Sequence[tuple[Series, Array]]) -> tuple[_Member, ...]:
    """Return the members of scatter that adds up: one q for all series."""
    weights = np.full(len(RATIOS), 0.5 / len(RATIOS))
    weights[-1] += 0.5
    members = [_independent(len(series))]
    for ratio, weight in zip(RATIOS, weights, strict=True):
        parts = []
        for one, sigma in series:
            slid = one.after / float(np.median(np.diff(np.unique([0.0, *one.after]))))
            added = np.minimum.outer(slid, slid) * np.mean(sigma**2) / np.outer(sigma, sigma)
            lower = np.linalg.cholesky(np.eye(len(sigma)) + ratio * added)
            whiten = partial(linalg.solve_triangular, lower, lower=True)
            parts.append((whiten, 2 * float(np.log(np.diag(lower)).sum())))
        members.append(_Member(float(ratio), float(np.log(0.5 * weight)), tuple(parts)))
    return tuple(members)


def _waves(series: Sequence[Series]) -> tuple[_Member, ...]:
    """Return the members of residuals that are alike nearby: one l for all series."""
    chains = [_Chain.of(one.after if one.x is None else one.x) for one in series]
    spacing = min(float(np.median(one.gaps)) for one in chains)
    lengths = np.geomspace(SHORTEST * spacing, LONGEST * max(float(one.gaps.sum()) for one in chains), LENGTHS)
    priors = np.log(lengths) + 0.5 * np.log([sum(one.information(length) for one in chains) for length in lengths])
    priors += np.log(0.5) - np.logaddexp.reduce(priors)
    members = [
        _Member(float(length), float(prior), tuple(one.at(float(length)) for one in chains))
        for length, prior in zip(lengths, priors, strict=True)
    ]
    return (_independent(len(series)), *members)


@dataclass(frozen=True)
class _Chain:
    """Places in their order: residuals at one depend on those at the one before it alone.

    Attributes:
        order: Of the places (n,).
        gaps: Between them (n - 1,).
    """

    order: NDArray[np.int64]
    gaps: Array

    @classmethod
    def of(cls, places: Array) -> _Chain:
        """Put places in order; those that are the same count as a part of the usual spacing apart."""
        order = np.argsort(places, kind="stable")
        gaps = np.diff(places[order])
        usual = float(np.median(gaps[gaps > 0])) if (gaps > 0).any() else 1.0
        return cls(order, np.maximum(gaps, TIED * usual))

    def at(self, length: float) -> tuple[Whitener, float]:
        """Return L^-1 and log |S| for a length."""
        alike = np.exp(-self.gaps / length)
        rest = np.sqrt(-np.expm1(-2 * self.gaps / length))
        return partial(self._whiten, alike, rest), 2 * float(np.log(rest).sum())

    def _whiten(self, alike: Array, rest: Array, values: Array) -> Array:
        ordered = values[self.order]
        wide = (slice(None),) + (None,) * (values.ndim - 1)
        return np.concatenate([ordered[:1], (ordered[1:] - alike[wide] * ordered[:-1]) / rest[wide]])

    def information(self, length: float) -> float:
        """Return Fisher's information of the length, apart from what it shares with that of the variance."""
        alike = np.exp(-self.gaps / length)
        slope, rest = alike * self.gaps / length**2, -np.expm1(-2 * self.gaps / length)
        shared = float((alike * slope / rest).sum())
        return float(((1 + alike**2) * (slope / rest) ** 2).sum()) - 2 * shared**2 / (len(alike) + 1)
