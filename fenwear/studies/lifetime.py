"""Life with scatter: samples of keys, a run for each, and what their lives have in common.

A sampling is a study (`fenwear.studies.study`), a run for each sample; samples.csv has them all in the end.
Quantiles come with the interval of order statistics that holds them with 95 %, whatever the distribution (binomial); a
reliability with that of Clopper and Pearson.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np
from scipy import stats

from fenwear.case import Case
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, ConvergenceError, InputError
from fenwear.common.parallel import on_root
from fenwear.results.disk import finite, write_text
from fenwear.results.export import csv_text
from fenwear.studies.model import Model
from fenwear.studies.quantities import LIMIT, Quantity, of_case, parse_quantity
from fenwear.studies.quantities import lives as lives_until
from fenwear.studies.scatter import Scatter
from fenwear.studies.study import Progress, Run, Study, StudyOptions, Values, case_text, named

SAMPLES = "samples.csv"
LEVEL = 0.95  # of the intervals
QUANTILES = (0.01, 0.05, 0.1, 0.5, 0.9, 0.95)
MOST_FAILED = 0.05  # of the samples, beyond which what is left says nothing of all
UNREACHED = f"not reached; the limit is {LIMIT:,} cycles by default"


@dataclass(frozen=True)
class Estimate:
    """A number estimated from a sample, with the interval that holds the true one with 95 %.

    Attributes:
        level: Of the quantile, or the life wanted.
        value: The quantile, or the reliability.
        low, high: Ends of the interval; infinite where the sample is too small for one.
    """

    level: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Lives:
    """Lives of one part, whose keys do not scatter.

    Attributes:
        quantities: Levels that the lives count to.
        values: The lives; infinite where a level is never reached.
    """

    quantities: tuple[Quantity, ...]
    values: tuple[float, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the object that --json prints and life.json holds."""
        rows = zip(self.quantities, self.values, strict=True)
        lives = [
            {"quantity": quantity.text, "unit": quantity.unit or "cycles", "value": value} for quantity, value in rows
        ]
        return {"lives": finite(lives)}

    def text(self) -> str:
        """Return a line for each."""
        rows = zip(self.quantities, self.values, strict=True)
        return "\n".join(
            f"{quantity.text}: {value:.6g} {quantity.unit or 'cycles'}"
            if np.isfinite(value)
            else f"{quantity.text}: {UNREACHED}"
            for quantity, value in rows
        )


@dataclass(frozen=True)
class Lifetime:
    """Lives of a sample.

    Attributes:
        quantity: Unit of the lives.
        unit: Of the lives.
        keys: That scatter.
        samples: Their values (n, d), in internal units.
        lives: (n,); infinite where the level is never reached, NaN where a run did not converge.
        quantiles: Of the lives; those of level q are reached before by a share q of the parts.
        reliability: Share of parts that live as long as was wanted; None if that was not asked for.
        failures: Errors, by sample.
        seed: Of the sample.
        each: Of the levels that were asked for, and of the named contacts; empty for one level of one contact. The
            lives above are then those until the first of all.
    """

    quantity: str
    unit: str
    keys: tuple[str, ...]
    samples: Array
    lives: Array
    quantiles: tuple[Estimate, ...]
    reliability: Estimate | None
    failures: dict[int, str]
    seed: int
    each: tuple[Lifetime, ...] = ()

    @property
    def first_share(self) -> list[float]:
        """Of each level, in which share of the parts that reach any it is reached first."""
        lives = np.array([level.lives for level in self.each]).reshape(len(self.each), len(self.lives))
        ended = lives[:, np.isfinite(lives).any(axis=0)]
        first = (ended == ended.min(axis=0, initial=np.inf)).sum(axis=1)
        return [float(count) / max(ended.shape[1], 1) for count in first]

    @property
    def counted_in(self) -> str:
        """The unit of the lives, or that they are cycles."""
        return self.unit or ("cycles" if self.quantity.startswith("cycles") or " until " not in self.quantity else "")

    def as_json(self) -> dict[str, Any]:
        """Return the object that --json prints and life.json holds."""

        def row(estimate: Estimate, name: str) -> dict[str, Any]:
            return {name: estimate.level, "value": estimate.value, "interval_95": [estimate.low, estimate.high]}

        each = [{**level.as_json(), "first": share} for level, share in zip(self.each, self.first_share, strict=True)]
        table = {
            "quantity": self.quantity,
            "unit": self.counted_in,
            "samples": len(self.lives),
            "failed": len(self.failures),
            "never_reached": int(np.isinf(self.lives).sum()),
            "quantiles": [row(estimate, "level") for estimate in self.quantiles],
            "reliability": None if self.reliability is None else row(self.reliability, "wanted"),
            "seed": self.seed,
            **({"each": each} if each else {}),
        }
        return dict(finite(table))

    def text(self) -> str:
        """Return a table for people."""
        unit = self.counted_in
        lines = [f"{self.quantity}: {len(self.lives)} samples"]
        if self.failures:
            lines.append(f"  {len(self.failures)} of them did not converge and are left out")
        if np.isinf(self.lives).any():
            lines.append(f"  {np.isinf(self.lives).sum()} of them: {UNREACHED}")
        heading = f"life ({unit})" if unit else "life"
        lines.append(f"  {'share that fails before':24} {heading:>13} {'95 % interval':>27}")
        lines += [
            f"  {estimate.level:24.0%} {estimate.value:13.5g} {_end(estimate.low)} {_end(estimate.high)}"
            for estimate in self.quantiles
        ]
        if any(_end(end).endswith("-") for estimate in self.quantiles for end in (estimate.low, estimate.high)):
            lines.append("  - too few samples to give this end")
        if self.reliability is not None:
            reliability = self.reliability
            lines.append(
                f"  a share of {reliability.value:.4f} ({reliability.low:.4f} to {reliability.high:.4f}) lives "
                f"for {reliability.level:.6g} {unit}"
            )
        if self.each:
            lines.append(
                f"  {'of each, reached before by a share of':40} {'1 %':>11} {'10 %':>12} {'50 %':>12}  is first"
            )
            for part, share in zip(self.each, self.first_share, strict=True):
                known = {q.level: q.value for q in part.quantiles}
                lines.append(
                    f"    {part.quantity:36} {known[0.01]:13.5g} {known[0.1]:12.5g} {known[0.5]:12.5g} {share:9.0%}"
                )
        return "\n".join(lines)


def _end(value: float) -> str:
    """Return an end of an interval as text, of lives that it is not known of, too."""
    return f"{'-':>13}" if value == 0 or np.isinf(value) else f"{value:13.5g}"


def quantile(values: Array, level: float) -> Estimate:
    """Return a quantile and its interval by order statistics.

    The number of values below the true quantile is binomial (n, level), whatever the distribution: the values
    number l and u enclose it with the probability P(l <= B < u) >= 95 %. Where n is too small for
    that, the end of the interval is zero or infinite: the true quantile may be beyond every value.
    """
    ordered, n = np.sort(values), len(values)
    below = stats.binom(n, level)
    low, high = int(below.ppf((1 - LEVEL) / 2)), int(below.ppf((1 + LEVEL) / 2)) + 1
    if below.cdf(low - 1) > (1 - LEVEL) / 2:  # of a discrete distribution: never less than asked for
        low -= 1
    return Estimate(
        level,
        float(ordered[min(n - 1, int(np.ceil(n * level)) - 1 if level > 0 else 0)]),
        float(ordered[low - 1]) if low >= 1 else 0.0,
        float(ordered[high - 1]) if high <= n else float("inf"),
    )


def reliability(lives: Array, wanted: float) -> Estimate:
    """Return the share of lives as long as wanted, and its interval of Clopper and Pearson."""
    n, good = len(lives), int((lives >= wanted).sum())
    outside = (1 - LEVEL) / 2
    low = float(stats.beta.ppf(outside, good, n - good + 1)) if good > 0 else 0.0
    high = float(stats.beta.ppf(1 - outside, good + 1, n - good)) if good < n else 1.0
    return Estimate(wanted, good / n, low, high)


def lifetime(
    case: Case,
    until: str | Quantity | Sequence[str | Quantity],
    scatter: Scatter,
    *,
    samples: int = 200,
    seed: int = 0,
    wanted: float | None = None,
    limit: int = LIMIT,
    progress: Progress = lambda done, total: None,
    **how: Unpack[StudyOptions],
) -> Lifetime:
    """Return the distribution of the life of parts whose keys scatter; collective.

    Args:
        case: The problem.
        until: Such as "depth 0.2 mm", or "distance until volume 3 mm^3"; of several, as of each named contact
            ("depth in left 0.2 mm"), a part lives until the first. A level of all contacts is also reported for each.
        scatter: Distribution of keys.
        samples: Size n of the sample, a run for each; a study may resume with more.
        seed: Of the sample.
        wanted: A life whose reliability is asked for, in the unit of the lives.
        limit: Cycles after which a level counts as never reached.
        progress: Called with the numbers of samples done and of all.
        how: Folder, parts, processes, executor and ranks, as `fenwear.studies.StudyOptions`.

    Raises:
        CaseError: what is asked for makes no sense; the samples of the folder belong to another sampling.
        ConvergenceError: more than 5 % of the runs did not converge; theirs are kept in the folder.
        OutputError: the folder takes no file.
        PartDoneError: other parts of the sampling are not done.
    """
    study = Study(**how)
    asked = _asked(case, [until] if isinstance(until, str | Quantity) else until)
    if samples < 2:
        raise CaseError(InputError("--samples", f"expected two or more, got {samples}"))
    scatter.check(case)
    design = on_root(study.comm, lambda: scatter.sample(samples, seed))
    model = Model(case)
    quantities = on_root(study.comm, lambda: _of_contacts(model, asked))
    names = [quantity.text for quantity in quantities]
    store = study.open(case, named(case_text(case), scatter.keys, names, limit, seed))
    runs = [Run(row, named(row.tobytes()), f"sample {k + 1}") for k, row in enumerate(design)]
    done = study.outcomes(_Samples(model, quantities, scatter.keys, limit), runs, store, progress)
    outcomes = [done[run.name] for run in runs]
    unknown = np.full(len(quantities), np.nan)
    lives = np.array([outcome.values.get("lives", unknown) for outcome in outcomes])
    failures = {k: outcome.trouble for k, outcome in enumerate(outcomes) if outcome.trouble}
    if (folder := study.folder) is not None:
        heading = ["sample", *scatter.keys, *names, "trouble"]
        table = [[k, *map(float, (*design[k], *lives[k])), failures.get(k, "")] for k in range(samples)]
        on_root(study.comm, lambda: write_text(folder / SAMPLES, csv_text(heading, table)))

    def summary(quantity: Quantity, level_lives: Array, level: float | None) -> Lifetime:
        return _summary(quantity, scatter.keys, design, level_lives, failures, level, seed)

    first_level = replace(asked[0], text=asked[0].text if len(asked) == 1 else f"first of {', '.join(names)}")
    life = summary(first_level, lives.min(axis=1), wanted)
    further = [(k, quantity) for k, quantity in enumerate(quantities) if len(asked) > 1 or quantity != asked[0]]
    each = tuple(summary(quantity, np.asarray(lives[:, k]), None) for k, quantity in further)
    return replace(life, each=each)


@dataclass(frozen=True)
class _Samples:
    """Computes the lives of samples."""

    model: Model
    quantities: Sequence[Quantity]
    keys: Sequence[str]
    limit: int

    def compute(self, given: Array) -> Values:
        """Return the lives until each level (q,) with the keys at these values."""
        values = dict(zip(self.keys, map(float, given), strict=True))
        return {"lives": lives_until(self.model, self.quantities, values, self.limit)}


def _asked(case: Case, until: Sequence[str | Quantity]) -> list[Quantity]:
    """Return the levels asked for.

    Raises:
        CaseError: one is none, or makes no sense; or they are not counted alike.
    """
    levels = [parse_quantity(level, "--until", case.names) if isinstance(level, str) else level for level in until]
    for quantity in levels:
        if quantity.kind != "life":
            message = f"expected a quantity and its level such as 'depth 0.2 mm', got {quantity.text!r}"
            raise CaseError(InputError("--until", message))
        of_case(quantity, case, "--until")
    if not levels or len({level.life for level in levels}) > 1:
        raise CaseError(InputError("--until", "expected levels that are all counted in cycles, distance or time"))
    return levels


def _of_contacts(model: Model, asked: Sequence[Quantity]) -> list[Quantity]:
    """Return the levels asked for, and where it is one of all contacts that of each contact with a name besides.

    Raises:
        CaseError: a contact is not known.
    """
    pair = model.system().pair
    surfaces = {"punch": pair.punch, "strip": pair.strip}
    for level in asked:
        names = [name for name in pair.punch.names if name in surfaces[level.body].names]
        if level.contact and level.contact not in names:
            known = f"known are {', '.join(names)}" if names else f"contacts of the {level.body} have no names"
            raise CaseError(InputError("--until", f"{level.text!r}: no contact is called {level.contact!r}; {known}"))
    single = asked[0]
    names = [name for name in pair.punch.names if name in surfaces[single.body].names]
    if len(asked) > 1 or single.contact or single.at or len(names) < 2:
        return list(asked)
    return [single, *(single.within(name) for name in names)]


def _summary(
    quantity: Quantity,
    keys: tuple[str, ...],
    design: Array,
    lives: Array,
    failures: dict[int, str],
    wanted: float | None,
    seed: int,
) -> Lifetime:
    if len(failures) > MOST_FAILED * len(lives):
        first = next(iter(failures.values()))
        raise ConvergenceError(
            f"{len(failures)} of {len(lives)} samples did not converge, too many for a distribution; the first: {first}"
        )
    known = lives[~np.isnan(lives)]
    return Lifetime(
        quantity.text,
        quantity.unit,
        keys,
        design,
        lives,
        tuple(quantile(known, level) for level in QUANTILES),
        None if wanted is None else reliability(known, wanted),
        failures,
        seed,
    )
