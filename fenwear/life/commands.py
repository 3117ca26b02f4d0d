"""The commands sensitivity, calibrate and life: compute, draw, write into a folder, print where."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.life.calibrate import Calibration, between, between_as_json, calibrate
from fenwear.life.data import read_data
from fenwear.life.keys import parse_unknown, with_values
from fenwear.life.lifetime import Lifetime, Lives, lifetime
from fenwear.life.model import Model
from fenwear.life.quantities import Quantity, cycles_of, lives, of_case, parse_amount, parse_quantity, unit_of
from fenwear.life.runs import TRIALS, Trials, everywhere
from fenwear.life.scatter import Scatter, load_scatter, parse_scatter
from fenwear.life.sensitivity import Method, Sensitivity, sensitivity
from fenwear.parallel import on_root
from fenwear.progress import now_and_then
from fenwear.report.style import BLUE, GREY, RED, panels, reference_line
from fenwear.results.disk import write_text, writing
from fenwear.results.export import csv_text
from fenwear.results.history import free_directory, make_directory, write_case

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DECADE = 10.0


def tornado(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Return a panel for each quantity: its values with each key smaller and larger, the most influential on top."""
    most = max(len(one.derivatives) for one in sensitivities)
    figure, axes = panels(len(sensitivities), 0.9 + 0.35 * most, share_x=False)
    for ax, one in zip(axes, sensitivities, strict=True):
        rows = one.ranked()[::-1]
        for height, row in enumerate(rows):
            for end, colour, name in ((row.low, BLUE, "smaller"), (row.high, RED, "larger")):
                if np.isfinite(end):
                    label = f"key {100 * one.spread:g} % {name}" if height == len(rows) - 1 else None
                    ax.barh(height, end - one.value, left=one.value, color=colour, height=0.7, label=label)
        ax.set_yticks(range(len(rows)), [row.key for row in rows])
        ax.axvline(one.value, color=GREY, linewidth=0.8)
        ax.set_xlabel(f"{one.quantity} ({one.unit or '-'})")
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
    for own, style in zip(life.each, itertools.cycle(("--", ":", "-.")), strict=False):
        alone = np.sort(own.lives[np.isfinite(own.lives)])
        height = np.arange(1, len(alone) + 1) / len(known)
        axes[0].step(alone, height, where="post", color=GREY, linestyle=style, label=own.quantity)
    if life.each:
        axes[0].lines[0].set_label("the first")
        axes[0].legend(frameon=False)
    for one in life.quantiles:
        if np.isfinite(one.value) and np.isfinite(one.high):
            axes[0].plot([one.low, one.high], [one.level, one.level], color=RED, linewidth=1.5)
    axes[0].set_xscale("log")
    _label_places(axes[0])
    axes[0].set_xlabel(f"{life.quantity} ({life.unit or 'cycles'})")
    axes[0].set_ylabel("share that has failed")
    axes[0].set_title("95 % intervals of the quantiles in red")
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(path):
        figure.savefig(path, dpi=150)


Log = Callable[[str], None]
FITTED = "fitted.toml"  # the case with the values that a calibration has found


def _folder(output: Path | None, what: str, name: str, comm: MPI.Comm) -> Path:
    """Return the new folder of the results."""

    def make() -> Path:
        path = output or free_directory(Path("results") / f"{what}-{name}")
        make_directory(path)
        return path

    return on_root(comm, make)


def _tell_of_stick(case: Case, log: Log, comm: MPI.Comm) -> None:
    """Say at the start, before anything is computed, that stick is left out where it is; collective."""
    asked = case.contact.law == "gross-sliding" or bool(case.against_stick)
    for line in on_root(comm, lambda: Model(case).stick_left_out() if asked else []):
        log(f"warning: {line}")


def _counter(log: Log, what: str) -> Callable[[int, int], None]:
    """Return what tells of progress: first, last, and now and then."""
    seldom = now_and_then(log)
    return lambda done, total: (log if done == total else seldom)(f"{what} {done:,} of {total:,}")


def run_sensitivity(
    case: Case,
    name: str,
    quantities: Sequence[str],
    keys: Sequence[str],
    spread: float,
    output: Path | None,
    log: Log,
    *,
    differences: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> tuple[list[Sensitivity], Path]:
    """Compute sensitivities; write sensitivity.json and tornado.png; collective."""
    method: Method | None = "differences" if differences else None
    _tell_of_stick(case, log, comm)
    found = sensitivity(case, quantities, keys, spread=spread, method=method, comm=comm, progress=_counter(log, "keys"))
    folder = _folder(output, "sensitivity", name, comm)

    def write() -> None:
        write_case(folder, case)
        write_text(folder / "sensitivity.json", json.dumps([one.as_json() for one in found], indent=1))
        if spread > 0:
            save(tornado(found), folder / "tornado.png")

    on_root(comm, write)
    return found, folder


def run_calibrate(
    case: Case,
    name: str,
    files: Sequence[Path],
    unknowns: Sequence[str],
    baseline: Sequence[str],
    output: Path | None,
    log: Log,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    resume: bool = False,
) -> tuple[Calibration, Path]:
    """Calibrate; write the fitted case, calibration.json, residuals and the trials of the fit; collective.

    Raises:
        CaseError: as `calibrate`; or an unknown ends at its bound: what was found is in the folder.
    """
    asked = [parse_unknown(case, text) for text in unknowns]
    data = on_root(comm, lambda: [read_data(path, case) for path in files])
    for one in data:
        log(one.listing)
    _tell_of_stick(case, log, comm)
    folder = _resumed(output) if resume else _folder(output, "calibrate", name, comm)
    trials = Trials(folder / TRIALS)
    found = calibrate(case, data, asked, baseline=baseline, comm=comm, progress=log, trials=trials, resume=resume)

    def write() -> None:
        write_case(folder, case)
        write_text(folder / FITTED, with_values(case, found.values).to_toml())
        write_text(folder / "calibration.json", json.dumps(found.as_json(), indent=1))
        write_text(folder / "residuals.csv", _residual_table(found))
        save(residuals(found), folder / "residuals.png")

    on_root(comm, write)
    if found.at_bound:
        raise CaseError(
            [
                InputError(f"--unknown {key}", "the best fit lies beyond its bound. Widen the bounds; the fit so far "
                        f"is in {folder}")
                for key in found.at_bound
            ]
        )  # fmt: skip
    return found, folder


def run_calibrate_each(
    case: Case,
    name: str,
    files: Sequence[Path],
    unknowns: Sequence[str],
    baseline: Sequence[str],
    output: Path | None,
    log: Log,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> tuple[list[Calibration], Scatter, Path]:
    """Calibrate every file alone; write calibration.json with the scatter between them; collective."""
    asked = [parse_unknown(case, text) for text in unknowns]
    data = on_root(comm, lambda: [read_data(path, case) for path in files])
    for one in data:
        log(one.listing)
    _tell_of_stick(case, log, comm)
    found = []
    for one in data:
        log(f"calibrating on {one.name}")
        found.append(calibrate(case, [one], asked, baseline=baseline, comm=comm, progress=log))
    scatter = between(found)
    folder = _folder(output, "calibrate", name, comm)

    def write() -> None:
        write_case(folder, case)
        write_text(folder / "calibration.json", json.dumps(each_as_json(found, scatter), indent=1))
        for one, calibration in zip(data, found, strict=True):
            save(residuals(calibration), folder / f"residuals_{Path(one.name).stem}.png")

    on_root(comm, write)
    return found, scatter, folder


def each_as_json(found: Sequence[Calibration], scatter: Scatter) -> dict[str, Any]:
    """Return what `fenwear calibrate --each --json` prints; `fenwear life --from` reads it."""
    return {**between_as_json(found), "scatter": list(scatter.text), "tests": [one.as_json() for one in found]}


def _residual_table(found: Calibration) -> str:
    rows: list[list[object]] = []
    for trace in found.traces:
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
    output: Path | None,
    log: Log,
    *,
    resume: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> tuple[Lifetime | Lives, Path]:
    """Compute lives; write samples.csv, life.json and life.png; collective.

    Without any scatter it is one life, in life.json.
    """
    quantities = [parse_quantity(one, "--until", case.names) for one in until]
    scatter = Scatter() if calibration is None else load_scatter(calibration, case)
    for text in scatters:
        scatter = scatter.and_also(parse_scatter(case, text))
    if not scatter.keys:
        if resume or wanted is not None:
            option = "--resume" if resume else "--wanted"
            message = f"expected {option} with --scatter KEY=KIND(A, B), or --from a calibration, only"
            raise CaseError(InputError(option, message))
        return _one_life(case, name, quantities, output, log, comm)
    scatter.check(case)
    _tell_of_stick(case, log, comm)
    level = None if wanted is None else _wanted(case, quantities[0].life, wanted)
    folder = _resumed(output) if resume else _folder(output, "life", name, comm)
    for line in scatter.text:
        log(line)
    found = lifetime(
        case, quantities, scatter, samples=samples, seed=seed, wanted=level, folder=folder,
        resume=resume, comm=comm, progress=_counter(log, "samples"),
    )  # fmt: skip

    def write() -> None:
        write_case(folder, case)
        write_text(folder / "life.json", json.dumps(found.as_json(), indent=1))
        save(life_figure(found), folder / "life.png")

    on_root(comm, write)
    return found, folder


def _one_life(
    case: Case, name: str, quantities: Sequence[Quantity], output: Path | None, log: Log, comm: MPI.Comm
) -> tuple[Lives, Path]:
    """Return the lives until each level of a case whose keys do not scatter, and write them; collective."""
    _tell_of_stick(case, log, comm)
    asked = [of_case(one, case, "--until") for one in quantities]
    folder = _folder(output, "life", name, comm)
    on_root(comm, lambda: write_case(folder, case))
    values = everywhere(comm, lambda: [float(life) for life in lives(Model(case), asked, {})])
    found = Lives(tuple(one.text for one in asked), tuple(one.unit for one in asked), tuple(values))
    on_root(comm, lambda: write_text(folder / "life.json", json.dumps(found.as_json(), indent=1)))
    return found, folder


def _resumed(output: Path | None) -> Path:
    """Return the folder to resume in.

    Raises:
        CaseError: none is given.
    """
    if output is None:
        raise CaseError(InputError("--resume", "needs the folder of the study to resume, as -o DIR"))
    return output


def _wanted(case: Case, life: str, text: str) -> float:
    """Return a wanted life in the unit of the lives."""
    amount = parse_amount(text, "--wanted")
    measures = Model(case).cycle_measures()
    factor = {"cycles": 1.0, "distance": measures[0], "time": measures[1]}[life]
    return cycles_of(amount, *measures) * factor


def as_json(found: Sequence[Sensitivity]) -> dict[str, Any]:
    """Return what `fenwear sensitivity --json` prints."""
    return {"sensitivities": [one.as_json() for one in found]}
