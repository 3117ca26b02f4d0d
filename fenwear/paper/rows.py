"""The rows of the comparison: the paper's number, ours, and a verdict that follows from both.

A number is reproduced where ours agrees to one unit of the last digit that the paper prints. It is
reproduced under an assumption where that needs a value which the paper does not give; a number that
some value of kappa always meets says nothing by itself, and the reason says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fenwear.arrays import Array
from fenwear.paper.published import (
    DIFFERENCE,
    LARGEST_PRESSURE,
    MONOTONIC_TEMPERATURE,
    PEAK_HALF_CYCLE,
    PERIODIC_TEMPERATURE,
    TEMPERATURE_HALF_CYCLE,
    VELOCITIES,
    Velocity,
    last_digit,
)
from fenwear.paper.study import (
    FULL,
    HeatRun,
    Scope,
    Variant,
    convergence,
    heat_runs,
    neutral_share,
    no_heat,
    open_choices,
    velocities,
)

Verdict = Literal["reproduced", "reproduced under an assumption", "not reproduced"]
YES: Verdict = "reproduced"
IF: Verdict = "reproduced under an assumption"
NO: Verdict = "not reproduced"
REPEATS = 1e-3  # change of temperature per cycle over the largest temperature that a picture does not show
EARLY = 300  # half-cycles in which the contact narrows
NEUTRAL = "neutral stability"  # among the kappas that numbers need, the one that only ours has
SAME_SHARE = 0.01  # differences of kappa that are none


@dataclass(frozen=True)
class Row:
    """One quantity of the paper beside ours."""

    quantity: str
    paper: str
    ours: str
    verdict: Verdict
    why: str


def paper_rows(scope: Scope = FULL) -> list[Row]:
    """Return every row of the comparison; collective, half a minute for the full scope at first use."""
    one, two = heat_runs("example1-heat", scope), heat_runs("example2-heat", scope)
    return [
        *(_velocity_row(row, ours) for row, ours in zip(VELOCITIES, velocities(scope), strict=True)),
        _pressure_row(scope),
        _flux_row(one),
        *_temperature_rows(one, neutral_share(scope)),
        _shape_row(one),
        _narrowing_row(one),
        _late_peak_row(one),
        _central_pressure_row(two),
        _repetition_row(one),
    ]


def needed_shares(scope: Scope = FULL) -> dict[str, float | None]:
    """Return for each number of the paper with heat the kappa that meets it, None where none of ours does; collective.

    Linear between the values of the scope.
    """
    one, two = heat_runs("example1-heat", scope), heat_runs("example2-heat", scope)
    shares = [run.share for run in one]
    return {
        "monotonic temperature": _share_at(shares, [r.steady.monotonic for r in one], float(MONOTONIC_TEMPERATURE)),
        "periodic temperature": _share_at(shares, [r.steady.periodic for r in one], float(PERIODIC_TEMPERATURE)),
        "their difference": _share_of_difference(one),
        "central pressure, Example 2": _share_at(shares, [_central(r) for r in two], float(LARGEST_PRESSURE)),
        NEUTRAL: neutral_share(scope),
    }


def sensitivity_rows(scope: Scope = FULL) -> tuple[tuple[Variant, ...], tuple[Variant, ...]]:
    """Return what the open choices and what mesh and time step change; collective, two minutes at first use."""
    return open_choices(scope), convergence(scope)


def _velocity_row(row: Velocity, ours: dict[str, float]) -> Row:
    way = "rightward" if row.direction > 0 else "leftward"
    printed = {"lambda_F": row.at_pin, "lambda_M": row.rotation}
    agree = all(abs(ours[name] - float(text)) < last_digit(text) for name, text in printed.items())
    return Row(
        f"{way} sliding at 200 mm/s, pin at {row.pin_height} mm: lambda_F (mm/s), lambda_M (rad/s)",
        f"{row.at_pin}, {row.rotation}",
        f"{ours['lambda_F']:.6f}, {ours['lambda_M']:.7f}",
        IF if agree else NO,
        "beta~ = 1e-5 per MPa, which is not the value of the cycles, and the pin on the punch's right side follow "
        "from these eight numbers; all eight agree with that one pair"
        if agree
        else "differs by more than the last printed digit",
    )


def _pressure_row(scope: Scope) -> Row:
    examples = [no_heat(name, scope) for name in ("example1", "example2")]
    largest = [example.state.pressure.max() for example in examples]
    marched = [example.marched.max() for example in examples]
    target, unit = float(LARGEST_PRESSURE), last_digit(LARGEST_PRESSURE)
    return Row(
        "no heat, both examples: largest pressure at the end (MPa)",
        f"{LARGEST_PRESSURE}, twice the mean",
        f"{largest[0]:.3f} and {largest[1]:.3f}; {marched[0]:.3f} and {marched[1]:.3f} after {scope.cycles:,} cycles "
        "from the flat punch",
        YES if all(abs(value - target) < unit for value in largest) else NO,
        "it follows from a uniform wear of each cycle, p+ + p- = 2 p_m, whatever mesh, supports, hinges and plane are; "
        "an independent run arrives there",
    )


def _flux_row(runs: Sequence[HeatRun]) -> Row:
    spread = max(float(np.ptp(run.friction) / run.friction.mean()) for run in runs)
    return Row(
        "heat: mean flux of both directions (31)",
        "equal",
        f"friction heat of all half-cycles equal to {max(spread, 1e-15):.0e}",
        YES if spread < 1e-9 else NO,
        "it follows from the balance of forces: mu times the load times 2 u0 in every half-cycle",
    )


def _temperature_rows(runs: Sequence[HeatRun], neutral: float | None) -> list[Row]:
    shares = [run.share for run in runs]
    of = _of(shares)
    alone = [run.steady.monotonic for run in runs]
    periodic = [run.steady.periodic for run in runs]
    first = _share_at(shares, alone, float(MONOTONIC_TEMPERATURE))
    second = _share_at(shares, periodic, float(PERIODIC_TEMPERATURE))
    stable = "" if neutral is None else f"; the state is unstable for kappa above {neutral:.2f}: no run stays there"
    return [
        Row(
            "heat, pin at 20 mm: temperature at x = 0, both one-way motions together (K)",
            MONOTONIC_TEMPERATURE,
            f"{_numbers(alone, 1)} {of}",
            IF if first is not None else NO,
            f"{_needs(first)}; it is linear in kappa, so that one value always fits",
        ),
        Row(
            "the same in the state that repeats from cycle to cycle (K)",
            PERIODIC_TEMPERATURE,
            f"{_numbers(periodic, 1)} {of}",
            IF if second is not None else NO,
            f"{_needs(second)}{stable}",
        ),
        _late_temperature_row(runs),
        _difference_row(runs, first),
    ]


def _late_temperature_row(runs: Sequence[HeatRun]) -> Row:
    row = runs[0].at(TEMPERATURE_HALF_CYCLE)
    late = [float(run.temperature[row, run.centre]) for run in runs]
    hottest = [float(run.temperature[row].max()) for run in runs]
    shares = [run.share for run in runs]
    needed = _share_at(shares, late, float(PERIODIC_TEMPERATURE))
    return Row(
        f"the same in the run, half-cycle {TEMPERATURE_HALF_CYCLE:,} (K)",
        PERIODIC_TEMPERATURE,
        f"{_numbers(late, 1)} {_of(shares)}; the hottest point of the contact {_numbers(hottest, 1)}",
        IF if needed is not None else NO,
        _needs(needed)
        if needed is not None
        else "where kappa heats enough the state is unstable: the run leaves it, the middle opens and cools",
    )


def _difference_row(runs: Sequence[HeatRun], first: float | None) -> Row:
    shares = [run.share for run in runs]
    apart = [run.steady.difference for run in runs]
    needed = _share_of_difference(runs)
    agree = first is not None and needed is not None and abs(first - needed) < SAME_SHARE
    why = _needs(needed)
    if first is not None:
        why += f"; with the kappa of the first temperature ours are {np.interp(first, shares, apart):.1f} % apart"
    return Row(
        "how far the first two are apart (% of the periodic one)",
        DIFFERENCE,
        f"{_numbers(apart, 1)} {_of(shares)}",
        IF if agree else NO,
        why,
    )


def _shape_row(runs: Sequence[HeatRun]) -> Row:
    row = runs[0].at(PEAK_HALF_CYCLE)
    bells = [
        run.share
        for run in runs
        if _is_bell(run.wear[row], run.centre) and _is_bell(run.steady.state.shape, run.centre)
    ]
    heights = [1e3 * float(np.ptp(run.wear[row])) for run in runs]
    return Row(
        "heat: shape of the worn surface",
        "a bell",
        f"a bell, {_numbers(heights, 1)} µm high at half-cycle {PEAK_HALF_CYCLE:,} {_of([run.share for run in runs])}",
        YES if len(bells) == len(runs) else IF if bells else NO,
        f"deepest in the middle and rising to both ends, in the run and in the state that repeats, {_of(bells)}",
    )


def _narrowing_row(runs: Sequence[HeatRun]) -> Row:
    early = slice(0, EARLY)
    narrowest = [float(run.width[early].min()) for run in runs]
    largest = [float(run.middle_pressure[early].max()) for run in runs]
    narrows = [
        width < 0.95 * run.width[0] and pressure > run.middle_pressure[0]
        for run, width, pressure in zip(runs, narrowest, largest, strict=True)
    ]
    named = [run.share for run, yes in zip(runs, narrows, strict=True) if yes]
    return Row(
        "heat: contact narrows while its largest pressure grows",
        "described",
        f"from {runs[0].width[0]:.0f} mm to {_numbers(narrowest, 0)} mm, up to {_numbers(largest, 0)} MPa in "
        f"the middle, {_of([run.share for run in runs])}",
        YES if all(narrows) else IF if any(narrows) else NO,
        f"within {EARLY} half-cycles {_of(named)}: the punch bulges",
    )


def _late_peak_row(runs: Sequence[HeatRun]) -> Row:
    at = [run.peak_half_cycle for run in runs]
    opened = ["never" if run.opened is None else f"{run.opened:,}" for run in runs]
    shares = [run.share for run in runs]
    fits = [s for s, n in zip(shares, at, strict=True) if abs(n - PEAK_HALF_CYCLE) <= 0.1 * PEAK_HALF_CYCLE]
    return Row(
        f"heat: the largest pressure falls again after half-cycle {PEAK_HALF_CYCLE:,}",
        "described",
        f"largest at half-cycle {', '.join(f'{n:,}' for n in at)} {_of(shares)}; the middle first opens: "
        f"{', '.join(opened)}",
        IF if fits else NO,
        f"within a tenth of it {_of(fits)}"
        if fits
        else "ours grows as fast as the composite warms up, some hundred half-cycles, then falls slowly; it rises "
        "again only where the middle opens and the contact splits. The paper's relaxation is not known",
    )


def _central_pressure_row(runs: Sequence[HeatRun]) -> Row:
    largest = [_central(run) for run in runs]
    shares = [run.share for run in runs]
    needed = _share_at(shares, largest, float(LARGEST_PRESSURE))
    return Row(
        "Example 2 with heat: mean pressure of both directions at the centre, largest (MPa)",
        f"about {LARGEST_PRESSURE}, twice the optimum",
        f"{_numbers(largest, 1)} {_of(shares)}",
        IF if needed is not None else NO,
        f"{_needs(needed)}; the heights of the hinges change it by some MPa",
    )


def _repetition_row(runs: Sequence[HeatRun]) -> Row:
    ends = [float(run.repetition[-1]) for run in runs]
    small = [end < REPEATS * run.temperature[-1].max() for run, end in zip(runs, ends, strict=True)]
    fits = [run.share for run, yes in zip(runs, small, strict=True) if yes]
    return Row(
        "heat: temperature repeats from cycle to cycle late in the run (Fig. 8d)",
        "described",
        f"at the end it changes by {_numbers(ends, 3)} K in a cycle {_of([run.share for run in runs])}",
        YES if all(small) else IF if fits else NO,
        f"by less than {100 * REPEATS:g} % {_of(fits)}; else the contact still opens and closes"
        if fits
        else "the contact still opens and closes",
    )


def _central(run: HeatRun) -> float:
    return float(run.central_pressure[run.bulged].max())


def _is_bell(shape: Array, centre: int) -> bool:
    """Return whether a shape rises to the middle from both ends, but for 1 % of its height."""
    slack = 0.01 * np.ptp(shape)
    return bool((np.diff(shape[: centre + 1]) > -slack).all() and (np.diff(shape[centre:]) < slack).all())


def _share_at(shares: Sequence[float], values: Sequence[float], target: float) -> float | None:
    """Return where values over shares first meet a target, linear between them; None where they never do."""
    differences = np.asarray(values) - target
    for k in range(len(shares) - 1):
        a, b = differences[k], differences[k + 1]
        if a * b <= 0 and a != b:
            return float(shares[k] + (shares[k + 1] - shares[k]) * a / (a - b))
    return None


def _share_of_difference(runs: Sequence[HeatRun]) -> float | None:
    """Return where the two temperatures are as far apart as the paper's: both are nearly linear in kappa."""
    rest = 1 - float(DIFFERENCE) / 100
    excess = [rest * run.steady.periodic - run.steady.monotonic for run in runs]
    return _share_at([run.share for run in runs], excess, 0.0)


def _needs(share: float | None) -> str:
    return "no kappa of ours meets it" if share is None else f"needs kappa = {share:.2f}"


def _numbers(values: Sequence[float], digits: int) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)


def _of(shares: Sequence[float]) -> str:
    return f"for kappa = {', '.join(f'{share:g}' for share in shares)}"
