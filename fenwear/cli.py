"""The command line: parses, calls, prints; nothing else."""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from mpi4py import MPI

import fenwear
from fenwear import completion
from fenwear.case import Case, builtin_cases, doubts, load_case
from fenwear.errors import CaseError, InputError
from fenwear.parallel import on_root

if TYPE_CHECKING:
    from fenwear.assembly import Tribosystem
    from fenwear.cycle import Steady

app = typer.Typer(
    help="Thermo-mechanical sliding wear with FEniCSx. Without a command: runs the built-in Example 1.",
    pretty_exceptions_enable=False,
    no_args_is_help=False,
    rich_markup_mode=None,
)

DEFAULT_CASE = "example1-heat"

CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE",
        help="A case file (TOML) or the name of a built-in case.",
        autocompletion=completion.cases,
    ),
]
SetOption = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Override a key: --set motion.amplitude="2 mm"',
        autocompletion=completion.settings,
    ),
]
FreshOption = Annotated[bool, typer.Option("--fresh", help="Set up anew, whatever earlier runs have kept on disk.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]


def log(message: str) -> None:
    """Print to standard error; every rank but 0 has it closed."""
    print(message, file=sys.stderr, flush=True)


def _load(case: str, settings: list[str]) -> Case:
    loaded = on_root(MPI.COMM_WORLD, lambda: (c := load_case(case, settings), c.folder))
    return loaded[0].at(loaded[1])


def _print_json(data: dict[str, Any]) -> None:
    print(json.dumps(data), flush=True)


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and end.")] = False,
) -> None:
    """Run the built-in Example 1 where no command is given."""
    if version:
        print(f"fenwear {fenwear.__version__}")
    elif context.invoked_subcommand is None:
        run(DEFAULT_CASE)


@app.command("run")
def run(
    case: CaseArgument = DEFAULT_CASE,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")] = None,
    settings: SetOption = [],  # noqa: B006  (typer wants a list)
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="A line of progress for every block.")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No progress and no messages but errors.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint in the folder.")] = False,
    fresh: FreshOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a case: pressure, wear and shape over the half-cycles."""
    from fenwear.results.sheet import sheet_text
    from fenwear.run import Progress, run_case

    loaded = _load(case, settings)
    if resume and output is None:
        raise CaseError(InputError("--resume", "expected the folder of the run to go on with, as -o DIR"))
    if quiet and verbose:
        raise CaseError(InputError("--quiet", "given together with --verbose; expected one of them"))
    say = (lambda _message: None) if quiet else log
    progress: Progress = "none" if quiet else "lines" if verbose else "bar"
    summary, directory = run_case(
        loaded, Path(case).stem, output, say, resume=resume, progress=progress, last=True, fresh=fresh
    )
    if as_json:
        _print_json(summary)
    else:
        if not quiet:
            print(sheet_text(summary))
        say(f"results in {directory}")


@app.command("steady")
def steady_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    fresh: FreshOption = False,
    as_json: JsonOption = False,
) -> None:
    """Solve for the cyclic steady state directly."""
    from fenwear.assembly import assemble
    from fenwear.cycle import cycles_to_reach, growth_rate, steady
    from fenwear.watch import steady_warnings

    begin = time.perf_counter()
    loaded = _load(case, settings)
    if loaded.contact.law == "coulomb":
        _print_final(case, loaded, as_json=as_json)
        return
    system = assemble(loaded, heat="reduced", fresh=fresh)
    setup = time.perf_counter() - begin
    state = steady(system)
    warnings = [*system.bodies.last_resorts, *doubts(loaded), *steady_warnings(system, state)]
    for warning in warnings:
        log(f"warning: {warning}")
    if not as_json:
        _print_steady(case, system, state)
    way = time.perf_counter()
    rate = growth_rate(system, state.phase_pressure)
    cycles = cycles_to_reach(system, state, 0.01) if rate < 0 else None
    seconds = {"setup": setup, "steady": state.seconds, "way_there": time.perf_counter() - way}
    if not as_json:
        _print_way(rate, cycles, seconds, time.perf_counter() - begin)
        return
    pressures = {d: p.tolist() for d, p in zip(state.directions, state.pressure, strict=True)}
    _print_json(
        {
            **_coordinates(system),
            "pressure_plus": pressures.get(1),
            "pressure_minus": pressures.get(-1),
            "shape": state.shape.tolist(),
            "temperature": None if state.heat is None else state.heat.punch[-1].tolist(),
            "temperature_strip": None if state.heat is None else state.heat.strip[-1].tolist(),
            "growth_rate": rate,
            "contact_width" if system.case.model.kind == "plane" else "contact_area": state.contact_width.tolist(),
            "wear_per_cycle": state.wear_per_cycle.tolist(),
            **state.velocity,
            "cycles_to_1_percent": cycles,
            "seconds": state.seconds,
            "all_seconds": {**seconds, "in_all": time.perf_counter() - begin},
            "warnings": warnings,
        }
    )


def _print_final(name: str, case: Case, *, as_json: bool) -> None:
    """Print the shape to which partial slip wears."""
    from fenwear.stick.command import final_of, final_text

    _, numbers = final_of(case)
    if as_json:
        _print_json(numbers)
    else:
        print(f"end of the wear of {name} in partial slip\n{final_text(numbers)}")


def _coordinates(system: Tribosystem) -> dict[str, Any]:
    """Return the coordinates of the contact nodes, mm: x in the plane, r and z of rings, x, y and z of a solid."""
    if system.case.model.kind == "plane":
        return {"x": system.pair.x.tolist()}
    x = system.pair.punch.x
    names = ("r", "z") if x.shape[1] == 2 else ("x", "y", "z")
    return {name: x[:, k].tolist() for k, name in enumerate(names)}


def _print_steady(case: str, system: Tribosystem, state: Steady) -> None:
    """Print the state as soon as it is there: the way to it may take longer.

    The load over the whole surface is a pressure only where the surfaces lie on each other before they wear.
    """
    from fenwear.cycle.state import pressure_scale
    from fenwear.results.scar import conforming

    print(f"cyclic steady state of {case} ({state.iterations} Newton iterations)")
    part = "width {:7.3f} mm" if system.case.model.kind == "plane" else "area {:.3f} mm²"
    words = system.sliding.field.words
    for d, p, width in zip(state.directions, state.pressure, state.contact_width, strict=True):
        print(f"  strip moves {words[d]:9} largest pressure {p.max():8.3f} MPa, "
              f"contact {part.format(width)}")  # fmt: skip
    if conforming(system.pair):
        print(f"  mean pressure {system.rigid.mean_pressure:.4f} MPa")
    scale = pressure_scale(system, state.phase_pressure)
    print(f"  pressure scale {scale:.4f} MPa (integral of p² over integral of p)")
    print(f"  wear per cycle {1e3 * state.wear_per_cycle.mean():.4g} µm; " + _velocities(state.velocity, "per cycle"))
    if state.heat is not None:
        punch, strip = state.heat.punch.max(), state.heat.strip.max()
        print(f"  largest temperature at the contact: punch {punch:.3f} K, strip {strip:.3f} K")
    sys.stdout.flush()


def _print_way(rate: float, cycles: int | None, seconds: dict[str, float], in_all: float) -> None:
    """Print how the state is reached, and where the time went."""
    if rate > 0:
        print(f"  unstable: disturbances grow at {rate:.3g} 1/s, so that a run moves away from this state")
    elif cycles is None:
        print("  pressure within 1 % of the pressure scale: not within ten million cycles from the initial shape")
    else:
        print(f"  pressure within 1 % of the pressure scale after about {cycles:,} cycles from the initial shape")
    print(f"  {_duration(in_all)} in all: meshes and operators {_duration(seconds['setup'])}, "
          f"steady state {_duration(seconds['steady'])}, the way there {_duration(seconds['way_there'])}")  # fmt: skip


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def _velocities(velocity: dict[str, float], per: str) -> str:
    units = {name: "mm" if name == "lambda_F" else "rad" for name in velocity}
    separator = "/" if len(per) == 1 else " "
    return ", ".join(f"{name} = {value:.5g} {units[name]}{separator}{per}" for name, value in velocity.items())


@app.command("optimum")
def optimum_command(case: CaseArgument, settings: SetOption = [], as_json: JsonOption = False) -> None:  # noqa: B006
    """Print lambda_F, lambda_M, the optimal pressure and the angle chi of the wear velocity in both directions."""
    from fenwear.assembly import place_case

    system = place_case(_load(case, settings))
    found = {name: system.optimum(d) for d, name in reversed(system.sliding.field.words.items())}
    if as_json:
        x = system.pair.x.tolist()
        _print_json(
            {
                n: {**o.velocity, "x": x, "pressure": o.pressure.tolist(), "chi": o.tilt.tolist()}
                for n, o in found.items()
            }
        )
        return
    for name, state in found.items():
        print(f"{name:9}  {_velocities(state.velocity, 's')}")
        for end in (0, -1):
            chi = math.degrees(state.tilt[end])
            names, place = system.case.model.axes[:-1], system.pair.punch.x[end]
            at = ", ".join(f"{axis} = {c:g}" for axis, c in zip(names, place, strict=False))
            print(f"           p = {state.pressure[end]:.4f} MPa, chi = {chi:.2f}° at {at} mm")


@app.command("check")
def check_command(case: CaseArgument, settings: SetOption = []) -> None:  # noqa: B006
    """Validate a case with its geometry and print it with all defaults."""
    from fenwear.assembly import elastic, needs_of, place_case
    from fenwear.cycle import stability_number
    from fenwear.run import position_warnings
    from fenwear.watch import initial_warnings

    loaded = _load(case, settings)
    if loaded.contact.law == "coulomb":
        from fenwear.stick.command import check_text

        text = check_text(loaded)
        for warning in doubts(loaded):
            log(f"warning: {warning}")
        print(loaded.to_toml())
        log(text)
        return
    placed = place_case(loaded)
    log(needs_of(placed).text())
    system = elastic(placed)
    number = stability_number(system)
    system.check_touching()
    warnings = [*position_warnings(system), *system.bodies.last_resorts, *doubts(loaded), *initial_warnings(system)]
    for warning in warnings:
        log(f"warning: {warning}")
    print(loaded.to_toml())
    log(f"the case is valid: {len(system.pair.x)} contact nodes, "
        f"{system.bodies.unknowns:,} displacement degrees of freedom, "
        f"wear step {100 * number:.3g} % of the explicit limit")  # fmt: skip


@app.command("new")
def new_command(
    template: Annotated[
        str | None, typer.Argument(metavar="TEST", help="Such as block-on-ring; without it all are listed.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The case file to write; by default TEST.toml.")
    ] = None,
    settings: Annotated[
        list[str], typer.Option("--set", metavar="DIMENSION=VALUE", help='A dimension: --set load="50 N"; repeatable.')
    ] = [],  # noqa: B006
    list_dimensions: Annotated[bool, typer.Option("--list", help="Print the dimensions and end.")] = False,
) -> None:
    """Write a commented case of a usual test, with its dimensions, to go on from."""
    from fenwear.case.templates import all_text, dimensions_text, write_case_of

    if template is None:
        print(all_text())
    elif list_dimensions:
        print(dimensions_text(template))
    else:
        path = output or Path(f"{template}.toml")
        on_root(MPI.COMM_WORLD, lambda: write_case_of(template, path, settings))
        log(f"case in {path}; next: fenwear check {path}")


@app.command("mesh")
def mesh_command(
    case: CaseArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="The .msh file to write.")],
    settings: SetOption = [],  # noqa: B006
) -> None:
    """Write the mesh of a case with its physical groups."""
    from fenwear.bodies.mesh import write_msh

    loaded = _load(case, settings)
    if output.suffix != ".msh":
        raise CaseError(InputError("-o", f"expected a file ending in .msh, got {str(output)!r}"))
    on_root(MPI.COMM_WORLD, lambda: write_msh(loaded.geometry, loaded.folder, output, loaded.model.law))
    log(f"mesh in {output}")


@app.command("plot")
def plot_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")],
    formats: Annotated[str, typer.Option("--format", help="Of the figures: png, pdf, svg, with commas.")] = "png",
    width: Annotated[str, typer.Option(help='Of the figures, such as "85 mm" for a column of a paper.')] = "178 mm",
    axis: Annotated[str, typer.Option(help="What a run is drawn over: cycles, distance or time.")] = "cycles",
) -> None:
    """Draw a run: figures with captions, pictures of the bodies, animation and report.html, into its folder."""
    from fenwear.report.chosen import chosen_formats, chosen_look
    from fenwear.report.page import write_report

    look, endings = chosen_look(width, axis), chosen_formats(formats)
    paths = on_root(MPI.COMM_WORLD, lambda: write_report(directory, log, complete=True, look=look, formats=endings))
    for path in paths:
        print(path)


@app.command("export")
def export_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The folder of the CSV files; by default DIR/export.")
    ] = None,
    at: Annotated[
        str, typer.Option(metavar="NUMBERS", help="Kept half-cycles of the profiles, first and last too, with commas.")
    ] = "first,last",
) -> None:
    """Write a run as CSV: a line for each kept half-cycle, and the profiles of both bodies."""
    from fenwear.results.export import export

    for path in on_root(MPI.COMM_WORLD, lambda: export(directory, output, at)):
        print(path)


@app.command("compare")
def compare_command(
    directories: Annotated[list[Path], typer.Argument(metavar="DIR...", help="The folders of several runs.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The figure to write: .png, .pdf or .svg.")] = Path(
        "compare.png"
    ),
    as_json: JsonOption = False,
) -> None:
    """Put several runs in one figure and one table, with the differences of their cases."""
    from fenwear.report.compare import compare, draw_comparison

    comparison = on_root(MPI.COMM_WORLD, lambda: compare(directories))
    on_root(MPI.COMM_WORLD, lambda: draw_comparison(comparison, output))
    if as_json:
        _print_json(comparison.as_json())
    else:
        print(comparison.text())
    log(f"figure in {output}")


@app.command("verify")
def verify_command(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")] = None,
    only: Annotated[
        list[str], typer.Option("--only", metavar="NAME", help="Run this case alone; may be repeated.")
    ] = [],  # noqa: B006
    list_cases: Annotated[bool, typer.Option("--list", help="Print the names of the cases and end.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Solve problems whose answer is known, and compare: a table, a page and an exit status of 1 where they differ."""
    from fenwear.verify.command import choose, titles, verify

    cases, paper = choose(only)
    if list_cases:
        for name, title in titles().items():
            if not only or name in only:
                print(f"{name:24} {title}")
        return
    found, directory = verify(cases, paper, output, log if as_json else print)
    if as_json:
        _print_json(found)
    log(f"page in {directory}/verification.html")
    if not found["agree"]:
        log(f"does not agree: {', '.join(found['differing'])}")
        raise typer.Exit(1)


@app.command("sensitivity")
def sensitivity_command(
    case: CaseArgument,
    quantities: Annotated[
        list[str], typer.Option("--of", metavar="QUANTITY", help='Such as depth, "steady pressure"; may be repeated.')
    ],
    keys: Annotated[
        list[str], typer.Option("--to", metavar="KEY", help="Such as wear.punch.coefficient; may be repeated.")
    ],
    spread: Annotated[float, typer.Option(help="Relative change of the keys in the tornado plot; 0 for none.")] = 0.1,
    differences: Annotated[bool, typer.Option("--differences", help="By differences of runs throughout.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")] = None,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Print the derivatives of quantities of interest to keys of the case, and draw a tornado plot."""
    from fenwear.life import commands

    loaded = _load(case, settings)
    found, folder = commands.run_sensitivity(
        loaded, Path(case).stem, quantities, keys, spread, output, log, differences=differences
    )
    if as_json:
        _print_json(commands.as_json(found))
    else:
        print("\n\n".join(one.text() for one in found))
    log(f"results in {folder}")


@app.command("calibrate")
def calibrate_command(
    case: CaseArgument,
    data: Annotated[list[Path], typer.Argument(metavar="DATA.csv...", help="Files of measurements.")],
    unknowns: Annotated[
        list[str], typer.Option("--unknown", metavar="KEY[=LOW..HIGH]", help="A key to find; may be repeated.")
    ],
    baseline: Annotated[
        list[str], typer.Option(metavar="NAME", help="offset or tilt of each trace, to find too; may be repeated.")
    ] = [],  # noqa: B006
    each: Annotated[
        bool, typer.Option("--each", help="Fit every file alone, and print the scatter between them.")
    ] = False,
    posterior: Annotated[
        int | None, typer.Option(metavar="STEPS", help="Sample the posterior too, so many steps of each walker.")
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")] = None,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Find keys of the case from measurements, with standard errors and what the data cannot tell."""
    from fenwear.life import commands

    loaded = _load(case, settings)
    if each:
        if posterior is not None:
            raise CaseError(InputError("--posterior", "given together with --each; expected one of them"))
        tests, between, folder = commands.run_calibrate_each(
            loaded, Path(case).stem, data, unknowns, baseline, output, log
        )
        if as_json:
            _print_json(commands.each_as_json(tests, between))
        else:
            print("\n".join([*(one.text() for one in tests), *between.text]))
        log(f"results in {folder}")
        return
    found, sample, folder = commands.run_calibrate(
        loaded, Path(case).stem, data, unknowns, baseline, posterior, output, log
    )
    if as_json:
        _print_json(found.as_json())
    else:
        print(found.text() if sample is None else f"{found.text()}\n{sample.text()}")
    log(f"results in {folder}")


@app.command("life")
def life_command(
    case: CaseArgument,
    until: Annotated[str, typer.Option(help='A level: "depth 0.2 mm", "distance until volume 3 mm^3".')],
    scatters: Annotated[
        list[str],
        typer.Option("--scatter", metavar="KEY=KIND(A, B)", help='"contact.friction=normal(0.25, 8 %)"; repeatable.'),
    ] = [],  # noqa: B006
    calibration: Annotated[
        Path | None, typer.Option("--from", metavar="DIR", help="Folder of a calibration whose result scatters.")
    ] = None,
    samples: Annotated[int, typer.Option(help="Size of the sample.")] = 200,
    seed: Annotated[int, typer.Option(help="Of the sample.")] = 0,
    wanted: Annotated[str | None, typer.Option(help='A life whose reliability is asked for: "1e6 cycles".')] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder of the results.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the samples in the folder.")] = False,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Print the distribution of the life of parts whose keys scatter, and what the scatter comes from."""
    from fenwear.life import commands

    loaded = _load(case, settings)
    found, folder = commands.run_life(
        loaded, Path(case).stem, until, scatters, calibration, samples, seed, wanted, output, log, resume=resume
    )
    if as_json:
        _print_json(found.as_json())
    else:
        print(found.text())
    log(f"results in {folder}")


@app.command("sweep")
def sweep_command(
    case: CaseArgument,
    over: Annotated[
        list[str],
        typer.Option(metavar="KEY=VALUES", help="0.1:0.3:9 is nine values; or a list: 10 mm,12 mm; may be repeated."),
    ] = [],  # noqa: B006
    of: Annotated[str, typer.Option(metavar="WHAT", help="steady, optimum or run.")] = "steady",
    zipped: Annotated[bool, typer.Option("--zip", help="First values together, second ones, and so on.")] = False,
    table: Annotated[Path | None, typer.Option(help="CSV of variants: a heading of keys, then rows.")] = None,
    processes: Annotated[int | None, typer.Option(help="Local processes; by default cores, where that pays.")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder of the results.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Compute what the folder lacks.")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No progress.")] = False,
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Compute many variants of a case side by side: keys over their values, in one dataset."""
    from fenwear.sweeps import command

    dataset, folder = command.run_sweep(
        _load(case, settings), Path(case).stem, over, table, of, output, log,
        zipped=zipped, resume=resume, processes=processes, quiet=quiet,
    )  # fmt: skip
    if as_json:
        _print_json(command.as_json(dataset))
    else:
        print(command.text(dataset))
    log(f"results in {folder}")
    if (dataset["trouble"].values != "").any():
        raise typer.Exit(3)


@app.command("info")
def info_command(
    key: Annotated[
        str | None,
        typer.Argument(
            metavar="KEY",
            help="Explain this key of the case file, or this table.",
            autocompletion=completion.keys,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Print the versions of the stack and the built-in cases; or explain a key of the case file."""
    from fenwear.bodies import kept
    from fenwear.case.keys import find_keys
    from fenwear.versions import versions

    if key is not None:
        found = find_keys(key)
        if as_json:
            _print_json({"keys": [asdict(k) for k in found]})
        else:
            print("\n".join(k.text() for k in found))
        return
    if as_json:
        _print_json({"versions": versions(), "cases": builtin_cases(), "kept": kept.summary()})
        return
    for name, version in versions().items():
        print(f"{name:14} {version}")
    state = kept.summary()
    print(
        f"\nkept set-ups: {state['files']} files, {state['MiB']:g} of {state['limit_MiB']:g} MiB in {state['folder']}"
    )
    print("\nbuilt-in cases:")
    for name, title in builtin_cases().items():
        print(f"  {name:26} {title}")


@app.command("schema")
def schema_command() -> None:
    """Print the JSON schema of case files, by which editors complete and check them."""
    from fenwear.case.keys import json_schema

    _print_json(json_schema())
