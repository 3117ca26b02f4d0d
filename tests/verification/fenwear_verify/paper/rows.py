"""The rows of the comparison: the paper's number, ours under every reading, and a verdict that follows from both.

A number is reproduced where ours agrees to one unit of the last digit that the paper prints, whatever the
paper leaves open. It is reproduced under an assumption where it agrees under some reading that keeps to all
that the paper gives; where this reading was fitted to that very number, the reason says so. What only a
reading meets that departs from the paper's data is not reproduced.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fenwear.common.arrays import Array
from fenwear_verify.paper.published import (
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
from fenwear_verify.paper.states import FULL, HeatRun, Scope, Variant
from fenwear_verify.paper.study import central_runs, convergence, heat_runs, no_heat, open_choices, velocities

Verdict = Literal["reproduced", "reproduced under an assumption", "not reproduced"]
YES: Verdict = "reproduced"
IF: Verdict = "reproduced under an assumption"
NO: Verdict = "not reproduced"
REPEATS = 1e-3  # change of temperature per cycle over the largest temperature that a picture does not show
EARLY = 300  # half-cycles in which the contact narrows
NEAR = 0.1  # of the paper's half-cycle and of a pressure that it gives as "about"


@dataclass(frozen=True)
class Row:
    """One quantity of the paper beside ours."""

    quantity: str
    paper: str
    ours: str
    verdict: Verdict
    why: str


def paper_rows(scope: Scope = FULL) -> list[Row]:
    """Return every row of the comparison; collective, two minutes for the full scope at first use."""
    runs = heat_runs(scope)
    return [
        *(_velocity_row(row, ours) for row, ours in zip(VELOCITIES, velocities(scope), strict=True)),
        _pressure_row(scope),
        _flux_row(runs),
        *_temperature_rows(runs),
        _shape_row(runs),
        _narrowing_row(runs),
        _late_peak_row(runs),
        _central_pressure_row([run for run in central_runs(scope) if run is not None]),
        _repetition_row(runs),
    ]


def sensitivity_rows(scope: Scope = FULL) -> tuple[tuple[Variant, ...], tuple[Variant, ...]]:
    """Return what other open choices, and what mesh, time step and coupling change; collective, a minute at first."""
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


def _temperature_rows(runs: Sequence[HeatRun]) -> list[Row]:
    rest = 1 - float(DIFFERENCE) / 100
    return [
        _number_row(
            runs,
            "heat, pin at 20 mm: temperature at x = 0, both one-way motions together (K)",
            MONOTONIC_TEMPERATURE,
            lambda run: run.one_way,
            "linear in the punch's share of the heat, so that some kappa always meets it",
        ),
        _number_row(
            runs,
            "the same in the state that repeats from cycle to cycle (K)",
            PERIODIC_TEMPERATURE,
            lambda run: run.steady.periodic,
            "this state has no bulge left to concentrate the heat; where it is unstable no run stays there",
        ),
        _number_row(
            runs,
            f"the same in the run, at n = {TEMPERATURE_HALF_CYCLE:,} (K)",
            PERIODIC_TEMPERATURE,
            lambda run: run.at_centre(TEMPERATURE_HALF_CYCLE),
            "the ratio of the two temperatures falls with gamma_d and grows with the conductance, so that a pair of "
            "kappa and one of them meets both",
        ),
        _number_row(
            runs,
            "how far the first and the last of these are apart (% of the last)",
            DIFFERENCE,
            lambda run: 100 * (1 - run.one_way / run.at_centre(TEMPERATURE_HALF_CYCLE)),
            f"both as the paper's where the one-way temperature is {rest:.4f} of the other",
        ),
    ]


def _number_row(
    runs: Sequence[HeatRun], quantity: str, printed: str, value: Callable[[HeatRun], float], reason: str
) -> Row:
    """Return the row of a printed number: it is met within one unit of its last digit."""
    met = [run for run in runs if abs(value(run) - float(printed)) < last_digit(printed)]
    verdict, why = _judge(runs, met)
    digits = len(printed.partition(".")[2])
    return Row(quantity, printed, _each(runs, lambda run: f"{value(run):.{digits}f}"), verdict, f"{why}; {reason}")


def _shape_row(runs: Sequence[HeatRun]) -> Row:
    bells = [run for run in runs if _is_bell(run.wear[run.at(PEAK_HALF_CYCLE)], run.centre)]
    verdict, why = _judge(runs, bells)
    return Row(
        f"heat: shape of the worn surface at n = {PEAK_HALF_CYCLE:,}",
        "a bell",
        _each(runs, lambda run: f"{1e3 * float(np.ptp(run.wear[run.at(PEAK_HALF_CYCLE)])):.1f}")
        + " µm from the deepest to the highest point",
        verdict,
        f"deepest in the middle and rising to both ends: {why}",
    )


def _narrowing_row(runs: Sequence[HeatRun]) -> Row:
    def narrows(run: HeatRun) -> bool:
        late = run.middle_pressure[: run.at(PEAK_HALF_CYCLE)].max()
        return bool(run.width[: run.at(PEAK_HALF_CYCLE)].min() < 0.95 * run.width[0] and late > run.middle_pressure[0])

    verdict, why = _judge(runs, [run for run in runs if narrows(run)])
    return Row(
        "heat: contact narrows while its largest pressure grows",
        "described",
        f"from {runs[0].width[0]:.0f} mm to {_each(runs, lambda run: f'{run.width.min():.0f}')} mm",
        verdict,
        f"the punch bulges: {why}",
    )


def _late_peak_row(runs: Sequence[HeatRun]) -> Row:
    def text(run: HeatRun) -> str:
        split = "" if run.opened is None else f", splits at {run.opened:,}"
        return f"{run.peak_half_cycle:,} ({run.middle_pressure[run.bulged].max():.0f} MPa{split})"

    met = [run for run in runs if abs(run.peak_half_cycle - PEAK_HALF_CYCLE) <= NEAR * PEAK_HALF_CYCLE]
    verdict, why = _judge(runs, met)
    return Row(
        f"heat: the largest pressure falls again after n = {PEAK_HALF_CYCLE:,}",
        "described",
        f"largest on the middle two thirds at n = {_each(runs, text)}",
        verdict,
        f"within a tenth of it: {why}. The bulge grows as fast as the composite warms up, some hundred half-cycles; "
        "only what delays it moves the peak",
    )


def _central_pressure_row(runs: Sequence[HeatRun]) -> Row:
    target = float(LARGEST_PRESSURE)
    met = [run for run in runs if abs(_central(run) - target) <= NEAR * target]
    verdict, why = _judge(runs, met)
    return Row(
        "Example 2 with heat: mean pressure of both directions at the centre, largest (MPa)",
        f"about {LARGEST_PRESSURE}, twice the optimum",
        _each(runs, lambda run: f"{_central(run):.1f}"),
        verdict,
        f"within a tenth of it: {why}; the heights of the hinges change it by some MPa",
    )


def _repetition_row(runs: Sequence[HeatRun]) -> Row:
    met = [run for run in runs if run.repetition[-1] < REPEATS * run.temperature[-1].max()]
    verdict, why = _judge(runs, met)
    return Row(
        "heat: temperature repeats from cycle to cycle late in the run (Fig. 8d)",
        "described",
        f"at the end it changes in a cycle by {_each(runs, lambda run: f'{run.repetition[-1]:.3f}')} K",
        verdict,
        f"by less than {100 * REPEATS:g} %: {why}; where not, the contact still opens and closes",
    )


def _judge(runs: Sequence[HeatRun], met: Sequence[HeatRun]) -> tuple[Verdict, str]:
    """Return the verdict on what these of the runs meet, and who they are."""
    keeping = [run for run in met if not run.reading.against]
    verdict = YES if runs and len(met) == len(runs) else IF if keeping else NO
    if verdict == YES:
        return verdict, "met by every reading"
    if not met:
        return verdict, "met by no reading"
    named = [
        run.reading.name
        + (" (fitted" if run.reading.fitted else " (not fitted")
        + (", against the paper's data)" if run.reading.against else ")")
        for run in met
    ]
    return verdict, f"met by {', '.join(named)}"


def _central(run: HeatRun) -> float:
    return float(run.central_pressure[run.bulged].max())


def _is_bell(shape: Array, centre: int) -> bool:
    """Return whether a shape rises to the middle from both ends, but for 1 % of its height."""
    slack = 0.01 * np.ptp(shape)
    return bool((np.diff(shape[: centre + 1]) > -slack).all() and (np.diff(shape[centre:]) < slack).all())


def _each(runs: Sequence[HeatRun], text: Callable[[HeatRun], str]) -> str:
    return ", ".join(f"{run.reading.name} {text(run)}" for run in runs)
