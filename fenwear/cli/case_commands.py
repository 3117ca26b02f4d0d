"""Commands that take a case: run it, check it, write a new one or its mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from mpi4py import MPI

import fenwear
from fenwear.case import plausibility_warnings
from fenwear.cli.application import (
    DEFAULT_CASE,
    CaseArgument,
    FreshOption,
    JsonOption,
    OverwriteOption,
    SetOption,
    app,
    clear,
    load,
    log,
    print_case,
    print_json,
    recorded,
    show,
    suggested_tests,
    with_names,
)
from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root

if TYPE_CHECKING:
    from fenwear.common.progress import How
    from fenwear.system import Tribosystem

HEAT_SECONDS = 60.0  # that `check` looks at the heat
WARNING = "warning: "


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Run the built-in Example 1 where no command is given."""
    if version:
        show(f"fenwear {fenwear.__version__}")
    elif context.invoked_subcommand is None:
        run(DEFAULT_CASE)


@app.command("run")
def run(
    case: CaseArgument = DEFAULT_CASE,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="New folder of the results.")] = None,
    settings: SetOption = [],  # noqa: B006  (typer wants a list)
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Print a line of progress for every block.")] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Print errors only.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Resume from the checkpoint in the folder.")] = False,
    overwrite: OverwriteOption = False,
    fresh: FreshOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a case: pressure, wear and shape over the half-cycles."""
    from fenwear.common.signals import Signals
    from fenwear.report.key_numbers import first_screen
    from fenwear.studies.run import run_with

    loaded = load(case, settings)
    if resume and output is None:
        raise CaseError(InputError("--resume", "expected the folder of the run to resume, as -o DIR"))
    if quiet and verbose:
        raise CaseError(InputError("--quiet", "given together with --verbose; expected one of them"))
    if overwrite:
        clear(output, resume=resume)
    say = (lambda _message: None) if quiet else log
    progress: How = "none" if quiet else "lines" if verbose else "bar"
    signals = Signals(MPI.COMM_WORLD, last=True)
    summary, directory = run_with(
        signals, loaded, Path(case).stem, output, say, resume=resume, progress=progress, fresh=fresh
    )
    if as_json:
        print_json(summary)
    elif not quiet:
        show(first_screen(summary, directory))


@app.command("check")
def check_command(
    case: CaseArgument,
    settings: SetOption = [],  # noqa: B006
    full: Annotated[bool, typer.Option("--full", help="Print the case with all defaults, as a case file.")] = False,
    heat_seconds: Annotated[
        float, typer.Option("--heat-seconds", help="Longest time for the checks of the heat.")
    ] = HEAT_SECONDS,
    as_json: JsonOption = False,
) -> None:
    """Validate a case with its geometry, and print its size, its free motions and warnings."""
    if not as_json:
        _check(case, settings, heat_seconds, full=full)
        return
    with recorded() as said:
        try:
            _check(case, settings, heat_seconds, full=False)
        except CaseError as error:
            problems = [
                {"key": with_names(problem.key), "message": with_names(problem.message)} for problem in error.problems
            ]
            print_json({"valid": False, "errors": problems})
            raise
        warnings = [line.removeprefix(WARNING) for line in said if line.startswith(WARNING)]
        messages = [line for line in said if not line.startswith(WARNING)]
        print_json({"valid": True, "warnings": warnings, "messages": messages})


def _check(case: str, settings: list[str], heat_seconds: float, *, full: bool) -> None:
    """Validate a case and say what it comes to."""
    from fenwear.checks.law_choice import choose_law, with_law
    from fenwear.studies.run import level_of
    from fenwear.system import assemble, elastic, law_named, place_case, resources_of

    loaded = load(case, settings)
    if loaded.sticks:
        _check_stick(assemble(with_law(loaded, "coulomb")), full=full)
        return
    level_of(loaded)
    placed = place_case(loaded)
    log(resources_of(placed).text())
    system = elastic(placed)
    if loaded.contact.law == "auto":
        choice = choose_law(system)
        log(choice.text)
        loaded = with_law(loaded, choice.law)
        if choice.law == "coulomb":
            stuck = law_named(choice.law).of_bodies(loaded, system.bodies, heat="as set", fresh=False)
            _check_stick(stuck, full=full)
            return
        system = replace(system, case=loaded)
    _check_sliding(system, heat_seconds, full=full)


def _check_sliding(system: Tribosystem, heat_seconds: float, *, full: bool) -> None:
    """Say what a case comes to whose surfaces slide as a whole."""
    from fenwear.checks import Seen, fineness_text
    from fenwear.common.parallel import memory_size
    from fenwear.heat.periodic_heat import cycle_memory
    from fenwear.laws.optimum import motion_words
    from fenwear.steps import stability_number
    from fenwear.studies.run import explicit_warnings, position_warnings

    loaded, size = system.case, f"{system.bodies.unknowns:,} displacement degrees of freedom"
    system.phases.passing(system.phases.mean_wear)  # with a look at the life of debris, as at all other laws
    system.law.check_touching(system)
    warnings = [
        *position_warnings(system),
        *system.bodies.remarks,
        *plausibility_warnings(loaded),
        *Seen.of_start(system).warnings(),
    ]
    warm, of_heat = _with_heat(system, heat_seconds)
    warnings += of_heat
    if loaded.run.integration == "explicit":
        number = stability_number(system)
        size = f"{size}, wear step {100 * number:.3g} % of the explicit limit"
        warnings += explicit_warnings(system, number)
    for warning in warnings:
        log(f"{WARNING}{warning}")
    if full:
        print_case(loaded)
    if warm.exchange.conducts:
        log(fineness_text(warm.exchange))
        if loaded.run.integration == "jump":
            log(f"heat: jumps keep the maps of its steps in a cycle, about {memory_size(cycle_memory(warm.exchange))}")
    log(f"the case is valid: {len(system.pair.x)} contact nodes, {size}")
    rigid = system.rigid
    for body, modes in (("punch", rigid.mode_names[: rigid.of_punch]), ("strip", rigid.mode_names[rigid.of_punch :])):
        if modes:
            log(f"the {body} is free to {', '.join(map(motion_words, modes))}: the contact pressure balances the loads")


def _with_heat(system: Tribosystem, seconds: float) -> tuple[Tribosystem, list[str]]:
    """Return the system with its heat prepared, as `run` does and keeps it, and what is to be said of it.

    Args:
        system: The problem.
        seconds: Longest time; the system is returned as it is where that is not enough.
    """
    from fenwear.checks import Seen
    from fenwear.common.errors import TimeUpError
    from fenwear.common.signals import time_limit
    from fenwear.steps import heat_gain, heat_warnings
    from fenwear.system import with_reduced_heat

    if system.case.heat is None:
        return system, []
    nodes = sum(body.space.dofmap.index_map.size_global for body in system.bodies.heat)
    log(f"heat: reduces {nodes:,} temperatures to a basis, as `run` does, for at most {seconds:g} s")
    try:
        with time_limit(seconds, system.bodies.comm):
            warm = with_reduced_heat(system, keep=True)
            jumps = system.case.run.integration == "jump"
            seen = Seen.of_system(warm)
            warnings = [*heat_warnings(heat_gain(warm), jumps=jumps), *seen.warnings("heat", "speed")]
    except TimeUpError:
        text = (
            f"heat: not looked at, as it takes more than {seconds:g} s; `run` and `steady` begin as slowly. Use fewer "
            "elements or a lower `geometry.degree`, or wait longer with `--heat-seconds`"
        )
        return system, [text]
    return warm, warnings


def _check_stick(system: Tribosystem, *, full: bool) -> None:
    """Say what the first cycle of a case with stick comes to."""
    text, warnings = check_text(system)
    for warning in plausibility_warnings(system.case):
        log(f"{WARNING}{warning}")
    if full:
        print_case(system.case)
    log(text)
    for warning in warnings:
        log(f"{WARNING}{warning}")


def check_text(system: Tribosystem) -> tuple[str, list[str]]:
    """Return the first cycle of a system with stick in words, and the warnings; collective.

    Raises:
        CaseError: a property of the geometry is wrong.
        ConvergenceError: a time step did not converge.
    """
    from fenwear.checks import RULES, Seen, law_warnings, unique_text
    from fenwear.results.time_steps import REGIMES, regime_of
    from fenwear.steps.stick_state import TimeStepRecords

    system.law.check_touching(system)
    problem = system.law_state.problem
    setup = problem.interface.needs.text()
    records = TimeStepRecords.joined(problem.cycle(problem.beginning())[1])
    thick, weights = system.case.model.thickness, problem.weights
    stuck = float(weights @ records.sticking.all(axis=0)) / float(weights @ (records.pressure > 0).any(axis=0))
    seen = Seen.of_pressure(system, records.pressure, "in the first cycle")
    dragged, unit = ("torque", "N mm") if any(problem.interface.field.turn) else ("tangential force", "N")
    texts = [RULES[name].text(seen) for name in ("unit", "depth", "few", "shakedown", "large")]
    warnings = (*texts, *law_warnings(system), unique_text(records.unique.astype(bool)))
    text = (
        f"{setup}\n"
        f"the case is valid: {len(weights)} contact nodes, {len(records)} time steps in a cycle\n"
        f"first cycle: {REGIMES[regime_of(records, stuck)]}, "
        f"{dragged} up to {thick * abs(records.force).max():.4g} {unit}, of the contact "
        f"{100 * stuck:.0f} % stick all through, work of friction {thick * records.energy(weights):.4g} mJ"
    )
    return text, [warning for warning in warnings if warning]


@app.command("new")
def new_command(
    template: Annotated[
        str,
        typer.Argument(
            metavar="TEST",
            help="Name of a test, such as block-on-ring; without it all tests are listed.",
            autocompletion=suggested_tests,
            show_default=False,
        ),
    ] = "",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The case file to write; by default TEST.toml.")
    ] = None,
    settings: Annotated[
        list[str], typer.Option("--set", metavar="DIMENSION=VALUE", help='A dimension: --set load="50 N"; repeatable.')
    ] = [],  # noqa: B006
    list_dimensions: Annotated[bool, typer.Option("--list", help="Print the dimensions and exit.")] = False,
) -> None:
    """Write a commented case of a usual test, with its dimensions."""
    from fenwear.case.templates import all_text, dimensions_text, write_case_of

    if not template:
        show(all_text())
    elif list_dimensions:
        show(dimensions_text(template))
    else:
        path = output or Path(f"{template}.toml")
        on_root(MPI.COMM_WORLD, lambda: write_case_of(template, path, settings))
        log(f"case in {path}; next: fenwear check {path}")


@app.command("mesh")
def mesh_command(
    case: CaseArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="The .msh file to write.")],
    settings: SetOption = [],  # noqa: B006
    as_json: JsonOption = False,
) -> None:
    """Write the mesh of a case with its physical groups."""
    from fenwear.bodies.distributed_mesh import write_msh

    loaded = load(case, settings)
    _check_msh(output)
    meshed = (loaded.geometry, loaded.folder, output, loaded.model.law, loaded.diffusion, loaded.names)
    rows, text = on_root(MPI.COMM_WORLD, lambda: write_msh(*meshed))
    _show_groups(rows, text, output, as_json=as_json)


def _show_groups(rows: list[dict[str, Any]], text: str, output: Path, *, as_json: bool) -> None:
    """Print the groups of a mesh that was written."""
    if as_json:
        print_json({"mesh": str(output), "groups": rows, "text": text})
    else:
        log(text)
    log(f"mesh in {output}")


def _check_msh(path: Path) -> None:
    if path.suffix != ".msh":
        raise CaseError(InputError("-o", f"expected a file ending in .msh, got {str(path)!r}"))


@app.command("import")
def import_command(
    source: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A mesh of Abaqus, Salome, Nastran, Exodus, VTK, ... or a shape from CAD."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="The .msh file to write.")],
    groups: Annotated[
        list[str],
        typer.Option(
            "--group",
            metavar="GROUP=SET",
            help="Name in the file of a group, such as punch_contact=PAD_LOW; repeatable.",
        ),
    ] = [],  # noqa: B006
    unit: Annotated[str | None, typer.Option(help="Unit of the file's lengths, such as m; by default mm.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a mesh of another program, or a shape from CAD, as a .msh file; geometry.file takes both without it."""
    from fenwear.bodies.distributed_mesh import write_msh
    from fenwear.case import Geometry

    _check_msh(output)
    pairs = [text.partition("=") for text in groups]
    wrong = next((text for text, (name, equals, _) in zip(groups, pairs, strict=True) if not (name and equals)), None)
    if wrong is not None:
        raise CaseError(InputError("--group", f"expected GROUP=SET, got {wrong!r}"))
    named = {name.strip(): of.strip() for name, _, of in pairs}
    geometry = Geometry(file=str(source), groups=named, unit=unit)  # type: ignore[arg-type]
    rows, text = on_root(MPI.COMM_WORLD, lambda: write_msh(geometry, None, output, None))
    _show_groups(rows, text, output, as_json=as_json)
