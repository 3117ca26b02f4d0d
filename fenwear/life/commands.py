"""What the commands sensitivity, calibrate and life do: compute, write into a folder, say where."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from fenwear.case import Case
from fenwear.errors import CaseError, InputError
from fenwear.life.between_tests import between, between_as_json
from fenwear.life.calibrate import Calibration, calibrate
from fenwear.life.data import read_data
from fenwear.life.keys import with_values
from fenwear.life.lifetime import SAMPLES, Lifetime, Lives, lifetime
from fenwear.life.model import Model
from fenwear.life.pictures import life_figure, residuals, save, tornado
from fenwear.life.quantities import Quantity, cycles_of, lives, of_case, parse_amount, parse_quantity, unit_of
from fenwear.life.ranks import everywhere
from fenwear.life.scatter import Scatter, load_scatter, parse_scatter
from fenwear.life.sensitivity import Method, Sensitivity, sensitivity
from fenwear.life.trials import TRIALS, Trials
from fenwear.life.unknowns import parse_unknown
from fenwear.parallel import on_root
from fenwear.progress import now_and_then
from fenwear.results.disk import write_text
from fenwear.results.history import CASE, free_directory, make_directory, write_case

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
                InputError(f"--unknown {key}", "the data want a value beyond its bound; expected bounds that hold it "
                        f"(what was found is in {folder})")
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


def _table(heading: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(rows)
    return text.getvalue()


def _residual_table(found: Calibration) -> str:
    rows: list[list[object]] = []
    for trace in found.traces:
        series = trace.series
        for k, row in enumerate(series.rows):
            rows.append(
                [trace.name, row, series.quantity, "" if series.x is None else float(series.x[k]),
                 float(series.after[k]), series.counted, float(series.values[k]), float(trace.predicted[k]),
                 unit_of(series.quantity)]
            )  # fmt: skip
    heading = ["file", "row", "quantity", "x (mm)", "after", "counted in", "measured", "fitted", "unit"]
    return _table(heading, rows)


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
    scatter: Scatter | None = None if calibration is None else load_scatter(calibration, case)
    for text in scatters:
        one = parse_scatter(case, text)
        scatter = one if scatter is None else scatter.and_also(one)
    if scatter is None:
        if resume or wanted is not None:
            option = "--resume" if resume else "--wanted"
            message = f"expected {option} with --scatter KEY=KIND(A, B), or --from a calibration, only"
            raise CaseError(InputError(option, message))
        return _one_life(case, name, quantities, output, log, comm)
    scatter.check(case)
    _tell_of_stick(case, log, comm)
    level = None if wanted is None else _wanted(case, quantities[0].life, wanted)
    folder = _resumed(output) if resume else _folder(output, "life", name, comm)
    if resume:
        on_root(comm, lambda: _check_folder(folder, case))
    on_root(comm, lambda: write_case(folder, case))
    for line in scatter.text:
        log(line)
    found = lifetime(
        case, quantities, scatter, samples=samples, seed=seed, wanted=level, folder=folder,
        resume=resume, comm=comm, progress=_counter(log, "samples"),
    )  # fmt: skip

    def write() -> None:
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


def _check_folder(folder: Path, case: Case) -> None:
    """Check that a folder holds samples of the same case.

    Raises:
        CaseError: it does not.
    """
    if not (folder / SAMPLES).is_file():
        raise CaseError(InputError("--resume", f"{folder} holds no {SAMPLES} to go on with"))
    try:
        before = (folder / CASE).read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        raise CaseError(InputError("--resume", f"{folder / CASE} cannot be read")) from None
    if before != case.to_toml():
        raise CaseError(InputError("--resume", f"the case differs from {folder / CASE}, of which the samples are"))


def _wanted(case: Case, life: str, text: str) -> float:
    """Return a wanted life in the unit of the lives."""
    amount = parse_amount(text, "--wanted")
    measures = Model(case).cycle_measures()
    factor = {"cycles": 1.0, "distance": measures[0], "time": measures[1]}[life]
    return cycles_of(amount, *measures) * factor


def as_json(found: Sequence[Sensitivity]) -> dict[str, Any]:
    """Return what `fenwear sensitivity --json` prints."""
    return {"sensitivities": [one.as_json() for one in found]}
