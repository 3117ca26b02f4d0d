"""The command line in a process of its own: exit statuses, messages, JSON, files."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5netcdf
import numpy as np
import pytest

import fenwear as package
from fenwear import Tribosystem, steady
from fenwear.case import builtin_cases
from fenwear.cli.state_commands import steady_command
from fenwear.common.errors import HeatError
from fenwear.steps import RunningIn

Run = Callable[..., Any]
MEAN = 1e4 / 600


def options(*settings: str) -> list[str]:
    small = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8", *settings)
    return [word for setting in small for word in ("--set", setting)]


def test_optimum_json(fenwear: Run) -> None:
    """shared/design.md: one JSON object on standard output and nothing else; the paper's values."""
    done = fenwear("optimum", "monotonic-lz20", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert set(found) == {"leftward", "rightward"}
    assert found["leftward"]["lambda_F"] == pytest.approx(0.05, rel=1e-9)
    assert found["rightward"]["lambda_M"] == pytest.approx(MEAN * 1e-5 * 200 * 0.5 / 30, rel=1e-9)
    assert len(found["leftward"]["x"]) == len(found["leftward"]["pressure"]) == 65


def test_steady_json(fenwear: Run, assembled: Callable[..., Tribosystem]) -> None:
    """The keys of shared/design.md; p+ + p- = 2 p_m; the same numbers as from Python."""
    done = fenwear("steady", "example1", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert {"x", "pressure_plus", "pressure_minus", "shape", "temperature"} <= set(found)
    assert found["temperature"] is None
    assert found["warnings"] == []
    assert found["all_seconds"]["in_all"] >= found["all_seconds"]["setup"] + found["all_seconds"]["steady"]
    total = np.add(found["pressure_plus"], found["pressure_minus"])
    np.testing.assert_allclose(total, 2 * MEAN, rtol=1e-9)
    state = steady(assembled("example1"))
    np.testing.assert_allclose(found["pressure_plus"], state.pressure[0], atol=1e-9 * MEAN)
    np.testing.assert_allclose(found["shape"], state.shape, atol=1e-9 * np.ptp(state.shape))
    np.testing.assert_allclose(found["normal_force"], 1e4, rtol=1e-9)
    np.testing.assert_allclose(found["friction_force"], 0.25 * 1e4, rtol=1e-9)
    assert found["nominal_pressure"] == pytest.approx(MEAN, rel=1e-9)


def test_texts(fenwear: Run) -> None:
    """Without --json: the numbers with their units, in words."""
    steady_text = fenwear("steady", "example2", *options()).stdout
    assert "33.333" in steady_text
    optimum_text = fenwear("optimum", "monotonic-lz20").stdout
    assert re.search(r"lambda_F \(mm/s\) +0.05 ", optimum_text)
    assert re.search(r"lambda_M \(rad/s\) +-0.00055556 ", optimum_text)


def test_steady_tells_all_its_time(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A command of 196 s printed "663 ms": the state alone. The state is printed before the way to it is sought."""
    clock, printed = [0.0], []

    def slow(*_arguments: object) -> RunningIn:
        printed.append(capsys.readouterr().out)
        clock[0] += 196.0
        return RunningIn(7, 1)

    monkeypatch.setattr("fenwear.cli.state_commands.time", SimpleNamespace(perf_counter=lambda: clock[0]))
    monkeypatch.setattr("fenwear.steps.running_in", slow)
    steady_command("example2", list(options()[1::2]))
    assert "33.333" in printed[0]
    rest = capsys.readouterr().out
    assert "after about 7 ± 1 cycles" in rest
    assert "196.0 s in all: " in rest
    assert "running-in 196.0 s" in rest


def test_steady_that_is_found_is_reported_whatever_follows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The state is printed, also as JSON; that the way to it failed is a warning."""

    def failing(*_arguments: object) -> RunningIn:
        raise HeatError("too hot by far")

    monkeypatch.setattr("fenwear.steps.running_in", failing)
    steady_command("example2", list(options()[1::2]), as_json=True)
    out, err = capsys.readouterr()
    assert max(json.loads(out)["pressure_plus"]) == pytest.approx(100 / 3, rel=1e-3)
    assert json.loads(out)["cycles_to_1_percent"] is None
    assert "too hot by far" in err


def test_check_doubts(fenwear: Run) -> None:
    """Values that are hardly meant are told on standard error; the case is valid and, asked for, printed."""
    done = fenwear("check", "example1", "--full", *options("materials.steel.young=210"))
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("warning: materials.steel.young: 0.21 GPa") == 1
    assert 'young = "210.0 MPa"' in done.stdout


def test_run(fenwear: Run, tmp_path: Path) -> None:
    """A run writes the files of shared/design.md; --json prints summary.json; progress bars are for terminals only."""
    out = tmp_path / "deep" / "run"
    done = fenwear("run", "example1", "-o", out, "--json", *options("run.half_cycles=6"))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == json.loads((out / "summary.json").read_text())
    assert {p.name for p in out.iterdir()} >= {"case.toml", "history.nc", "summary.json", "figures"}
    assert "half-cycles/s" not in done.stderr
    assert "warning" not in done.stderr.lower()


def test_runs_from_anywhere(fenwear: Run, tmp_path: Path) -> None:
    """Without -o results go to results/NAME, then results/NAME-2; a case file may lie elsewhere."""
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "mine.toml").write_text('base = "example1"\n[run]\nhalf_cycles = 2\n')
    for _ in range(2):
        done = fenwear(
            "run", "cases/mine.toml", *options("output.report=false", "output.uncertainty=false"), cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "mine" / "history.nc").is_file()
    assert (tmp_path / "results" / "mine-2" / "history.nc").is_file()


def test_check_prints_a_case_that_runs(fenwear: Run, tmp_path: Path) -> None:
    """With --full standard output is the resolved case: checked again it prints the same."""
    first = fenwear("check", "example2", "--full", *options("motion.amplitude='0.2 cm'"))
    assert first.returncode == 0, first.stderr
    assert 'amplitude = "2.0 mm"' in first.stdout
    (tmp_path / "again.toml").write_text(first.stdout)
    assert fenwear("check", tmp_path / "again.toml", "--full").stdout == first.stdout


def test_mesh(fenwear: Run, tmp_path: Path) -> None:
    """The mesh file holds the named groups; another ending is refused."""
    done = fenwear("mesh", "example1", "-o", tmp_path / "own.msh", *options())
    assert done.returncode == 0, done.stderr
    assert '"punch_contact"' in (tmp_path / "own.msh").read_text()
    wrong = fenwear("mesh", "example1", "-o", tmp_path / "own.vtk")
    assert (wrong.returncode, list(tmp_path.glob("*.vtk"))) == (2, [])


def test_info_and_version(fenwear: Run) -> None:
    """The stack and the built-in cases."""
    found = json.loads(fenwear("info", "--json").stdout)
    assert found["cases"] == builtin_cases()
    assert {"fenwear", "dolfinx", "petsc"} <= {name.lower() for name in found["versions"]}
    assert fenwear("--version").stdout.strip() == f"fenwear {package.__version__}"
    assert fenwear("--help").returncode == 0


def refused(done: Any, status: int, *expected: str) -> None:
    """Check the exit status, the message's parts, that it is said once, and that there is no traceback."""
    assert done.returncode == status, done.stderr
    for part in expected:
        assert done.stderr.count(part) == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


BAD = [
    (["--set", "contact.frction=1"], "contact.frction: unknown key"),
    (["--set", "run.half_cycles=0"], "run.half_cycles: "),
    (["--set", "punch.loads.0.on='lid'"], "punch.loads.0.on: no physical curve 'lid'"),
    (["--set", "geometry.parameters.pin_height_1=300"], "a pin is off the punch"),
    (["--set", "geometry.parameters.x=3"], "geometry.parameters.x: "),
    (["--set", "contact.friction=0.9", "--set", "geometry.parameters.pin_height_1=40"], "punch.loads: no pressure"),
    (["--set", "model.plane='strain'", "--set", "materials.steel.poisson=0.5"], "materials.steel.poisson: "),
]


@pytest.mark.parametrize(("arguments", "expected"), BAD)
def test_wrong_case(fenwear: Run, tmp_path: Path, arguments: list[str], expected: str) -> None:
    """Exit status 2, the key named, no traceback, nothing written."""
    refused(fenwear("run", "example1", "-o", tmp_path / "run", *arguments), 2, expected)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "arguments", [["fly"], ["run", "--colour"], ["steady"], ["run", "a", "b"], ["mesh", "example1"]]
)
def test_wrong_usage(fenwear: Run, arguments: list[str]) -> None:
    """A wrong command line is as wrong as a wrong case."""
    refused(fenwear(*arguments), 2)


def test_wrong_files(fenwear: Run, tmp_path: Path) -> None:
    """No file, no UTF-8, no TOML."""
    (tmp_path / "latin.toml").write_bytes("title = 'é'".encode("latin-1"))
    (tmp_path / "broken.toml").write_text("title =")
    for name, expected in (
        ("none.toml", "cannot be read"),
        ("latin.toml", "not a UTF-8 text"),
        ("broken.toml", "TOML"),
    ):
        refused(fenwear("check", tmp_path / name), 2, expected)


def test_output_folder_in_the_way(fenwear: Run, tmp_path: Path) -> None:
    """A folder with something in it, a file, a place that cannot be written: refused, and left as they were."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    for out, expected in (("full", "exists already"), ("file", "exists already"), ("file/below", "cannot be written")):
        refused(fenwear("run", "example1", "-o", tmp_path / out, *options("run.half_cycles=2")), 2, expected)
    refused(fenwear("run", "example1", "-o", "/proc/fenwear", *options("run.half_cycles=2")), 2, "cannot be written")
    assert os.listdir(tmp_path / "full") == ["thesis.txt"]
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("command", ["run", "steady"])
def test_no_convergence(fenwear: Run, tmp_path: Path, command: str) -> None:
    """Exit status 3 with PETSc's reason; what follows -- goes to PETSc."""
    output = ["-o", tmp_path / "run"] if command == "run" else []
    settings = options("output.report=false", "output.uncertainty=false")
    done = fenwear(command, "example1", *output, *settings, "--", "-fenwear_contact_snes_max_it", "0")
    refused(done, 3, "DIVERGED_MAX_IT")


def test_two_ranks_give_the_same_scalars(fenwear: Run, tmp_path: Path) -> None:
    """Verification 18: history and summary of 1 and 2 ranks agree to 1e-9; standard output holds one JSON object."""
    histories, summaries = [], []
    for ranks in (1, 2):
        out = tmp_path / str(ranks)
        done = fenwear(
            "run",
            "example1",
            "-o",
            out,
            "--json",
            *options("run.half_cycles=40", "output.report=false", "output.uncertainty=false"),
            ranks=ranks,
        )
        assert done.returncode == 0, done.stderr
        summaries.append(json.loads(done.stdout))
        with h5netcdf.File(out / "history.nc") as file:
            histories.append(
                {name: file[name][:] for name in ("pressure", "wear", "largest_pressure", "optimum_distance")}
            )
    assert [s["ranks"] for s in summaries] == [1, 2]
    for name, values in histories[0].items():
        np.testing.assert_allclose(histories[1][name], values, rtol=0, atol=1e-9 * np.abs(values).max())
    assert summaries[1]["wear_mm"] == pytest.approx(summaries[0]["wear_mm"], rel=1e-9)


@pytest.mark.parametrize(("arguments", "expected"), [BAD[0], (["-o", "/proc/fenwear"], "cannot be written")])
def test_two_ranks_say_it_once(fenwear: Run, tmp_path: Path, arguments: list[str], expected: str) -> None:
    """The same refusal on two ranks: said once, exit status 2, nothing hangs, nothing is written."""
    done = fenwear("run", "example1", *options(), *arguments, ranks=2, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count(expected) == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert os.listdir(tmp_path) == []


# One command after another, each with its status. What rank 0 says goes to a file: mpirun may exchange lines.
SEVERAL = """
import json, sys
from mpi4py import MPI
from fenwear.__main__ import main

commands, said = json.loads(sys.argv[1]), sys.argv[2]
if MPI.COMM_WORLD.rank == 0:
    sys.stderr = open(said, "w")
for words in commands:
    sys.argv = ["fenwear", *words]
    status = main()
    print("status", status, file=sys.stderr, flush=True)
"""


def test_two_ranks_refuse_whatever_is_wrong(run_python: Run, tmp_path: Path) -> None:
    """Wherever it is found, on whichever rank: by the case's tables, by gmsh, by the contact, by the command line."""
    wrong = [BAD[2], BAD[3], BAD[5], (["--colour"], "No such option")]
    commands = [["run", "example1", *options(), *arguments] for arguments, _ in wrong]
    folder, report = tmp_path / "folder", tmp_path / "said"
    folder.mkdir()
    done = run_python("-m", "mpi4py", "-c", SEVERAL, json.dumps(commands), report, ranks=2, cwd=folder)
    assert done.returncode == 0, done.stderr
    said = report.read_text("utf-8")
    messages = said.split("status 2\n")
    assert len(messages) == len(wrong) + 1, said
    for (_, expected), message in zip(wrong, messages, strict=False):
        assert message.count(expected) == 1, said
    assert "Traceback" not in said + done.stderr
    assert os.listdir(folder) == []


def test_two_ranks_without_convergence(fenwear: Run, tmp_path: Path) -> None:
    """Exit status 3 from all ranks."""
    limit = ("-fenwear_contact_snes_max_it", "0")
    done = fenwear("steady", "example1", *options(), "--", *limit, ranks=2, cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    assert done.stderr.count("DIVERGED_MAX_IT") == 1


def test_shell_completion(run_python: Run) -> None:
    """The shell is told commands, options, cases and keys that begin as what stands there."""
    for words, place, expected in (
        ("fenwear st", 1, ["steady"]),
        ("fenwear run --re", 2, ["--resume"]),
        ("fenwear check example1-l", 2, ["example1-lz40", "example1-lz40-heat"]),
        ("fenwear check example1 --set motion.am", 4, ["motion.amplitude="]),
        ("fenwear check example1 --set wear.punch.coefficient.t", 4, ["wear.punch.coefficient.table="]),
        ("fenwear new block", 2, ["block-on-ring"]),
        ("fenwear info wear.strip.coefficient.t", 2, ["wear.strip.coefficient.table"]),
    ):
        variables = {"_FENWEAR_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(place)}
        assert run_python("-m", "fenwear", **variables).stdout.split() == expected
