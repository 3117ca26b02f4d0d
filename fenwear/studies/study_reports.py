"""The commands sensitivity, calibrate and life: compute, draw, write into a folder, print where."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Unpack

import numpy as np
from mpi4py import MPI

from fenwear.case import Case
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root
from fenwear.common.progress import Log, now_and_then
from fenwear.report.style import BLUE, GREY, RED, panels, reference_line
from fenwear.results.disk import replacing, write_text
from fenwear.results.export import csv_text
from fenwear.results.history import make_directory, write_case
from fenwear.studies.calibrate import Calibration, between, between_as_json, calibrate, calibrate_each, check_count
from fenwear.studies.lifetime import Lifetime, Lives, lifetime
from fenwear.studies.measured_data import read_data
from fenwear.studies.model import Model
from fenwear.studies.numeric_keys import parse_unknown, with_values
from fenwear.studies.quantities import Quantity, cycles_of, lives, of_case, parse_amount, parse_quantity, unit_of
from fenwear.studies.scatter import Scatter, load_scatter, parse_scatter
from fenwear.studies.sensitivity import Method, Sensitivity, sensitivity
from fenwear.studies.study import StudyOptions, in_results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DECADE = 10.0


def tornado(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Return a panel for each quantity: its values with each key smaller and larger, the most influential on top."""
    most = max(len(result.derivatives) for result in sensitivities)
    figure, axes = panels(len(sensitivities), 0.9 + 0.35 * most, share_x=False)
    for ax, of_quantity in zip(axes, sensitivities, strict=True):
        rows = of_quantity.ranked()[::-1]
        for height, row in enumerate(rows):
            for end, colour, name in ((row.low, BLUE, "smaller"), (row.high, RED, "larger")):
                if np.isfinite(end):
                    label = f"key {100 * of_quantity.spread:g} % {name}" if height == len(rows) - 1 else None
                    ax.barh(
                        height, end - of_quantity.value, left=of_quantity.value, color=colour, height=0.7, label=label
                    )
        ax.set_yticks(range(len(rows)), [row.key for row in rows])
        ax.axvline(of_quantity.value, color=GREY, linewidth=0.8)
        ax.set_xlabel(f"{of_quantity.quantity} ({of_quantity.unit or '-'})")
        if ax.get_legend_handles_labels()[0]:
            ax.legend(frameon=False)
    return figure


def residuals(calibration: Calibration) -> Figure:
    """Return two panels for each series: measured and fitted, and their difference."""
    traces = calibration.traces
    figure, axes = panels(2 * len(traces), 2.0, share_x=False)
    for k, trace in enumerate(traces):
        fit, rest = axes[2 * k : 2 * k + 2]
        series = trace.series
        factor, unit = (1e3, "µm") if unit_of(series.quantity) == "mm" else (1.0, unit_of(series.quantity) or "-")
        x = series.places
        order = np.argsort(x, kind="stable")
        fit.plot(x, factor * series.values, ".", color=GREY, markersize=3, label="measured")
        fit.plot(x[order], factor * trace.predicted[order], color=BLUE, label="fitted")
        fit.set_title(trace.name)
        fit.set_ylabel(f"{series.quantity} ({unit})")
        fit.legend(frameon=False)
        rest.plot(x[order], factor * trace.residual[order], color=RED, linewidth=0.8)
        reference_line(rest, 0.0, "")
        rest.set_ylabel(f"fitted - measured ({unit})")
        counted = {"cycles": "cycles", "distance": "sliding distance (mm)", "time": "time (s)"}[series.counted]
        rest.set_xlabel("x (mm)" if series.is_profile else counted)
    return figure


def _label_places(ax: Axes) -> None:
    """Label a logarithmic axis of less than a decade by few numbers: powers of ten would stand on each other."""
    from matplotlib.ticker import MaxNLocator, NullLocator, ScalarFormatter  # which takes long to load

    low, high = ax.get_xlim()
    if high < DECADE * low:
        ax.xaxis.set_major_locator(MaxNLocator(6))
        ax.xaxis.set_major_formatter(ScalarFormatter(useMathText=True))
        ax.xaxis.set_minor_locator(NullLocator())


def life_figure(life: Lifetime) -> Figure:
    """Return the distribution of the lives."""
    figure, axes = panels(1, 3.0, share_x=False)
    known = np.sort(life.lives[~np.isnan(life.lives)])
    share = np.arange(1, len(known) + 1) / len(known)
    finite = np.isfinite(known)
    axes[0].step(known[finite], share[finite], where="post", color=BLUE)
    for level, style in zip(life.each, itertools.cycle(("--", ":", "-.")), strict=False):
        alone = np.sort(level.lives[np.isfinite(level.lives)])
        height = np.arange(1, len(alone) + 1) / len(known)
        axes[0].step(alone, height, where="post", color=GREY, linestyle=style, label=level.quantity)
    if life.each:
        axes[0].lines[0].set_label("the first")
        axes[0].legend(frameon=False)
    for estimate in life.quantiles:
        if np.isfinite(estimate.value) and np.isfinite(estimate.high):
            axes[0].plot([estimate.low, estimate.high], [estimate.level, estimate.level], color=RED, linewidth=1.5)
    axes[0].set_xscale("log")
    _label_places(axes[0])
    axes[0].set_xlabel(f"{life.quantity} ({life.unit or 'cycles'})")
    axes[0].set_ylabel("share that has failed")
    axes[0].set_title("95 % intervals of the quantiles in red")
    return figure


Drawn: TypeAlias = Callable[[], "Figure"]
FITTED = "fitted.toml"  # the case with the values that a calibration has found


def _tell_of_stick(case: Case, log: Log, comm: MPI.Comm) -> None:
    """Say at the start, before anything is computed, that stick is left out where it is; collective."""
    asked = case.contact.law == "gross-sliding" or bool(case.against_stick)
    for line in on_root(comm, lambda: Model(case).stick_left_out() if asked else []):
        log(f"warning: {line}")


def _counter(log: Log, subject: str) -> Callable[[int, int], None]:
    """Return the report of progress: first, last, and now and then."""
    seldom = now_and_then(log)
    return lambda done, total: (log if done == total else seldom)(f"{subject} {done:,} of {total:,}")


def _write(folder: Path, comm: MPI.Comm, files: Mapping[str, Any], figures: Mapping[str, Drawn]) -> None:
    """Write texts, tables as JSON, and figures of a study into its folder; collective."""

    def write() -> None:
        for name, content in files.items():
            write_text(folder / name, content if isinstance(content, str) else json.dumps(content, indent=1))
        for name, draw in figures.items():
            with replacing(folder / name, shared=True) as part:
                draw().savefig(part, dpi=150, format="png")

    on_root(comm, write)


def run_sensitivity(
    case: Case,
    name: str,
    quantities: Sequence[str],
    keys: Sequence[str],
    spread: float,
    log: Log,
    *,
    differences: bool = False,
    **how: Unpack[StudyOptions],
) -> tuple[list[Sensitivity], Path]:
    """Compute sensitivities; write sensitivity.json and tornado.png; collective."""
    method: Method | None = "differences" if differences else None
    how, folder, comm = in_results(how, f"sensitivity-{name}")
    _tell_of_stick(case, log, comm)
    sensitivities = sensitivity(
        case, quantities, keys, spread=spread, method=method, progress=_counter(log, "keys"), **how
    )
    figures = {"tornado.png": lambda: tornado(sensitivities)} if spread > 0 else {}
    _write(folder, comm, {"sensitivity.json": [sensitivity.as_json() for sensitivity in sensitivities]}, figures)
    return sensitivities, folder


def run_calibrate(
    case: Case,
    name: str,
    files: Sequence[Path],
    unknowns: Sequence[str],
    baseline: Sequence[str],
    log: Log,
    *,
    each: bool = False,
    **how: Unpack[StudyOptions],
) -> tuple[dict[str, Any], str, Path]:
    """Calibrate, every file alone with the scatter between them if `each`; write the results; collective.

    Returns:
        The table that `life --from` reads, the text, and the folder.

    Raises:
        CaseError: as `calibrate`; or an unknown ends at its bound: what was found is in the folder.
    """
    if each:
        check_count(files)
    asked = [parse_unknown(case, text) for text in unknowns]
    how, folder, comm = in_results(how, f"calibrate-{name}")
    data = on_root(comm, lambda: [read_data(path, case) for path in files])
    for measured in data:
        log(measured.listing)
    _tell_of_stick(case, log, comm)
    if each:
        fits = calibrate_each(case, [[data_set] for data_set in data], asked, baseline=baseline, progress=log, **how)
        scatter = between(fits)
        table = {**between_as_json(fits), "scatter": list(scatter.text), "tests": [fit.as_json() for fit in fits]}
        pictures = [
            (f"residuals_{Path(data_set.name).stem}.png", fit) for data_set, fit in zip(data, fits, strict=True)
        ]
        _write(folder, comm, {"calibration.json": table}, {file: partial(residuals, fit) for file, fit in pictures})
        return table, "\n".join([*(fit.text() for fit in fits), *scatter.text]), folder
    fit = calibrate(case, data, asked, baseline=baseline, progress=log, **how)
    table = fit.as_json()
    texts = {FITTED: with_values(case, fit.values).to_toml(), "residuals.csv": _residual_table(fit)}
    _write(folder, comm, {"calibration.json": table, **texts}, {"residuals.png": lambda: residuals(fit)})
    if fit.at_bound:
        message = f"the best fit lies beyond its bound. Widen the bounds; the fit so far is in {folder}"
        raise CaseError([InputError(f"--unknown {key}", message) for key in fit.at_bound])
    return table, fit.text(), folder


def _residual_table(calibration: Calibration) -> str:
    rows: list[list[object]] = []
    for trace in calibration.traces:
        series = trace.series
        for k, row in enumerate(series.rows):
            rows.append(
                [trace.name, row, series.quantity, float(series.places[k]) if series.is_profile else float("nan"),
                 float(series.after[k]), series.counted, float(series.values[k]), float(trace.predicted[k]),
                 unit_of(series.quantity)]
            )  # fmt: skip
    heading = ["file", "row", "quantity", "x (mm)", "after", "counted in", "measured", "fitted", "unit"]
    return csv_text(heading, rows)


def run_life(
    case: Case,
    name: str,
    until: Sequence[str],
    scatters: Sequence[str],
    calibration: Path | None,
    samples: int,
    seed: int,
    wanted: str | None,
    log: Log,
    **how: Unpack[StudyOptions],
) -> tuple[Lifetime | Lives, Path]:
    """Compute lives; write samples.csv, life.json and life.png; collective.

    Without any scatter it is one life, in life.json.
    """
    quantities = [parse_quantity(level, "--until", case.names) for level in until]
    scatter = Scatter() if calibration is None else load_scatter(calibration, case)
    for text in scatters:
        scatter = scatter.and_also(parse_scatter(case, text))
    how, folder, comm = in_results(how, f"life-{name}")
    if not scatter.keys:
        options = {"--resume": how.get("resume"), "--collect": how.get("collect"), "--wanted": wanted}
        for option in (option for option, given in options.items() if given):
            message = (
                f"applies to a distribution of lives. Add --scatter KEY=KIND(A, B) or --from DIR, or leave out {option}"
            )
            raise CaseError(InputError(option, message))
        return _life_without_scatter(case, quantities, folder, log, comm), folder
    scatter.check(case)
    _tell_of_stick(case, log, comm)
    level = None if wanted is None else _wanted(case, quantities[0].life, wanted)
    for line in scatter.text:
        log(line)
    counter = _counter(log, "samples")
    life = lifetime(case, quantities, scatter, samples=samples, seed=seed, wanted=level, progress=counter, **how)
    _write(folder, comm, {"life.json": life.as_json()}, {"life.png": lambda: life_figure(life)})
    return life, folder


def _life_without_scatter(case: Case, quantities: Sequence[Quantity], folder: Path, log: Log, comm: MPI.Comm) -> Lives:
    """Return the lives until each level of a case whose keys do not scatter, and write them; collective."""
    _tell_of_stick(case, log, comm)
    asked = [of_case(quantity, case, "--until") for quantity in quantities]
    on_root(comm, lambda: make_directory(folder))
    on_root(comm, lambda: write_case(folder, case))
    values = on_root(comm, lambda: [float(life) for life in lives(Model(case), asked, {})])
    result = Lives(tuple(asked), tuple(values))
    _write(folder, comm, {"life.json": result.as_json()}, {})
    return result


def _wanted(case: Case, life: str, text: str) -> float:
    """Return a wanted life in the unit of the lives."""
    measures = Model(case).cycle_measures()
    return cycles_of(parse_amount(text, "--wanted"), *measures) / cycles_of((1.0, life), *measures)


def as_json(sensitivities: Sequence[Sensitivity]) -> dict[str, Any]:
    """Return what `fenwear sensitivity --json` prints."""
    return {"sensitivities": [sensitivity.as_json() for sensitivity in sensitivities]}
