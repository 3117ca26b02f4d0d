"""Commands of many runs: verification, sensitivity, calibration, life and sweeps."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fenwear.cli.application import (
    CaseArgument,
    JsonOption,
    OverwriteOption,
    SetOption,
    app,
    clear,
    load,
    log,
    show,
    show_results,
)
from fenwear.common.errors import CaseError, InputError, StackError

if TYPE_CHECKING:
    from fenwear.studies.study import StudyOptions

QuantitiesOption = Annotated[
    list[str],
    typer.Option(
        "--of", metavar="QUANTITY", help='Quantity, such as largest_depth, "steady largest_pressure"; may be repeated.'
    ),
]
OutputOption = Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")]
OnlyOption = Annotated[list[str], typer.Option("--only", metavar="NAME", help="Run this case alone; repeatable.")]
ListOption = Annotated[bool, typer.Option("--list", help="Print the names of the cases and exit.")]
KeysOption = Annotated[
    list[str], typer.Option("--to", metavar="KEY", help="Key, such as wear.punch.coefficient; repeatable.")
]

ResumeOption = Annotated[bool, typer.Option("--resume", help="Resume in the folder: compute the missing runs.")]
PartOption = Annotated[
    str,
    typer.Option(
        metavar="I/N", help="Compute part I of N into the shared folder; by default that of a Slurm job array."
    ),
]
CollectOption = Annotated[bool, typer.Option("--collect", help="Put together what all parts have computed.")]
ScriptOption = Annotated[
    str, typer.Option(metavar="slurm", help="Print the batch file of a job array of N parts (--part 1/N), and exit.")
]
ProcessesOption = Annotated[
    int | None, typer.Option(help="Local processes; by default as many as cores, where that pays.")
]


def _options(
    output: Path | None, part: str, script: str, *, resume: bool, collect: bool = False, processes: int | None = 1
) -> StudyOptions:
    """Return how a study computes its runs; print its batch file instead where that is asked for."""
    from fenwear.studies.study import batch_file, parse_part

    chosen = parse_part(part)
    if script not in ("", "slurm"):
        raise CaseError(InputError("--script", f"expected slurm, got {script!r}"))
    if script:
        if chosen is None or output is None:
            raise CaseError(
                InputError("--script", "expected the number of parts, as --part 1/8, and a folder, as -o DIR")
            )
        show(batch_file(sys.argv[1:], chosen[1]))
        raise typer.Exit
    return {"folder": output, "part": chosen, "resume": resume, "collect": collect, "processes": processes}


@app.command("verify")
def verify_command(
    output: OutputOption = None,
    only: OnlyOption = [],  # noqa: B006
    list_cases: ListOption = False,
    as_json: JsonOption = False,
) -> None:
    """Solve problems with known answers, and compare: a table, a page, and exit status 1 where they differ."""
    verification = _beside("command")
    cases, paper = verification.choose(only)
    if list_cases:
        _show_titles(verification.titles(), only)
        return
    outcome, directory = verification.verify(cases, paper, output, log if as_json else print)
    page = f"page in {directory}/verification.html"
    if as_json:
        show_results(outcome, page)
    else:
        log(page)
    if not outcome["agree"]:
        log(f"does not agree: {', '.join(outcome['differing'])}")
        raise typer.Exit(1)


@app.command("validate")
def validate_command(
    output: OutputOption = None,
    only: OnlyOption = [],  # noqa: B006
    list_cases: ListOption = False,
    short: Annotated[bool, typer.Option("--short", help="Use coarse meshes, in a fifth of the time.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compute measured experiments and compare: numbers with their uncertainty, and a figure of each."""
    gallery = _beside("validation.command")
    if list_cases:
        _show_titles(gallery.titles(), only)
        return
    outcome, directory = gallery.validate(only, output, log if as_json else print, "short" if short else "full")
    if as_json:
        show_results(outcome, f"figures in {directory}")
    else:
        log(f"figures in {directory}")


def _show_titles(titles: dict[str, str], only: list[str]) -> None:
    for name, title in titles.items():
        if not only or name in only:
            show(f"{name:24} {title}")


def _beside(module: str) -> Any:
    """Return a module of the package beside this one: it is installed, or in the checkout that this one is run from.

    Raises:
        StackError: it is neither.
    """
    beside = Path(__file__).parents[2] / "tests" / "verification"
    if beside.is_dir():
        sys.path.append(str(beside))
    try:
        return import_module(f"fenwear_verify.{module}")
    except ModuleNotFoundError as error:
        if error.name != "fenwear_verify":
            raise
        text = 'the package with the problems of verify and validate is missing: pip install "fenwear[verify]"'
        raise StackError(text) from error


@app.command("sensitivity")
def sensitivity_command(
    case: CaseArgument,
    quantities: QuantitiesOption,
    keys: KeysOption,
    spread: Annotated[float, typer.Option(help="Relative change of the keys in the tornado plot; 0 for none.")] = 0.1,
    differences: Annotated[
        bool, typer.Option("--differences", help="Take all derivatives by differences of runs.")
    ] = False,
    output: OutputOption = None,
    resume: ResumeOption = False,
    part: PartOption = "",
    collect: CollectOption = False,
    script: ScriptOption = "",
    processes: ProcessesOption = None,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Print the derivatives of quantities of interest to keys of the case, and draw a tornado plot."""
    from fenwear.studies import study_reports

    how = _options(output, part, script, resume=resume, collect=collect, processes=processes)
    loaded = load(case, settings)
    derivatives, folder = study_reports.run_sensitivity(
        loaded, Path(case).stem, quantities, keys, spread, log, differences=differences, **how
    )
    text = "\n\n".join(table.text() for table in derivatives)
    show_results(study_reports.as_json(derivatives) if as_json else text, f"results in {folder}")


@app.command("calibrate")
def calibrate_command(
    case: CaseArgument,
    data: Annotated[list[Path], typer.Argument(metavar="DATA.csv...", help="Files of measurements.")],
    unknowns: Annotated[
        list[str], typer.Option("--unknown", metavar="KEY[=LOW..HIGH]", help="Key to find; repeatable.")
    ],
    baseline: Annotated[
        list[str], typer.Option(metavar="NAME", help="Also find the offset or tilt of each trace; repeatable.")
    ] = [],  # noqa: B006
    each: Annotated[
        bool, typer.Option("--each", help="Fit every file alone, and print the scatter between them.")
    ] = False,
    output: OutputOption = None,
    resume: ResumeOption = False,
    part: PartOption = "",
    script: ScriptOption = "",
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Fit keys of the case to measurements, with standard errors and what the data cannot determine."""
    from fenwear.studies import study_reports

    how = _options(output, part, script, resume=resume)
    loaded = load(case, settings)
    table, text, folder = study_reports.run_calibrate(
        loaded, Path(case).stem, data, unknowns, baseline, log, each=each, **how
    )
    show_results(table if as_json else text, f"results in {folder}")


@app.command("life")
def life_command(
    case: CaseArgument,
    until: Annotated[
        list[str],
        typer.Option(
            help='A level: "largest_depth 0.2 mm", "distance until worn_volume 3 mm^3", "largest_depth in left 5 um" '
            "of the contact left; repeatable: until the first."
        ),
    ],
    scatters: Annotated[
        list[str],
        typer.Option(
            "--scatter",
            metavar="KEY=KIND(A, B)",
            help='"contact.friction=normal(0.25, 8 %)"; repeatable. normal(mean, standard deviation), '
            "lognormal(median, coefficient of variation), uniform(least, largest).",
        ),
    ] = [],  # noqa: B006
    calibration: Annotated[
        Path | None, typer.Option("--from", metavar="DIR", help="Folder of a calibration whose result scatters.")
    ] = None,
    samples: Annotated[int, typer.Option(help="Number of samples; each is a run.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of the sample.")] = 0,
    wanted: Annotated[str | None, typer.Option(help='Life whose reliability is computed: "1e6 cycles".')] = None,
    output: OutputOption = None,
    resume: ResumeOption = False,
    part: PartOption = "",
    collect: CollectOption = False,
    script: ScriptOption = "",
    processes: ProcessesOption = None,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Print the life until a level, or with --scatter the distribution of the lives of many parts."""
    from fenwear.studies import study_reports

    how = _options(output, part, script, resume=resume, collect=collect, processes=processes)
    loaded = load(case, settings)
    lives, folder = study_reports.run_life(
        loaded, Path(case).stem, until, scatters, calibration, samples, seed, wanted, log, **how
    )
    show_results(lives.as_json() if as_json else lives.text(), f"results in {folder}")


@app.command("sweep")
def sweep_command(
    case: CaseArgument,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUES", help="Key and values: 0.1:0.3:9 is nine values; or a list: 10 mm,12 mm; repeatable."
        ),
    ] = [],  # noqa: B006
    of: Annotated[str, typer.Option(metavar="WHAT", help="Result of each variant: steady, optimum or run.")] = "steady",
    zipped: Annotated[
        bool, typer.Option("--zip", help="Combine the first values of all keys, the second values, and so on.")
    ] = False,
    table: Annotated[Path | None, typer.Option(help="CSV of variants: a heading of keys, then rows.")] = None,
    output: OutputOption = None,
    resume: ResumeOption = False,
    part: PartOption = "",
    collect: CollectOption = False,
    script: ScriptOption = "",
    processes: ProcessesOption = None,
    overwrite: OverwriteOption = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No progress.")] = False,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Compute many variants of a case side by side: keys over their values, in one dataset."""
    from fenwear.studies.sweep import as_json as sweep_json
    from fenwear.studies.sweep import run_sweep, text

    how = _options(output, part, script, resume=resume, collect=collect, processes=processes)
    loaded = load(case, settings)
    if overwrite:
        clear(output, resume=resume or collect or how["part"] is not None)
    dataset, folder = run_sweep(loaded, Path(case).stem, over, table, of, log, zipped=zipped, quiet=quiet, **how)
    show_results(sweep_json(dataset) if as_json else text(dataset), f"results in {folder}")
    if (dataset["trouble"].values != "").any():
        raise typer.Exit(3)
