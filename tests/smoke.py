"""An installed fenwear, without pytest: each way to a result once, on small meshes, against what is exact.

python3 tests/smoke.py FOLDER, in the environment to test; fails at the first thing that is wrong.
"""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

FENWEAR = [sys.executable, "-m", "fenwear"]
HEAT = (
    "geometry.degree=2",
    "geometry.parameters.elements_along_contact=8",
    "heat.steps=2",
    "output.report=false",
    "output.uncertainty=false",
)
STICK = ("geometry.parameters.elements_along_contact=20", "stick.steps=10", "run.half_cycles=8")


def call(command: list[str]) -> str:
    """Return what a command prints on standard output."""
    print("  $", *(Path(command[0]).name, *command[1:]), flush=True)
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    assert done.returncode == 0, f"status {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def run(case: str, folder: Path, *settings: str, ranks: int = 1, more: tuple[str, ...] = ()) -> None:
    """Run a case by the command line."""
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    options = [word for setting in settings for word in ("--set", setting)]
    call([*start, *FENWEAR, "run", case, "-q", "-o", str(folder), *options, *more])


def imports(_: Path) -> None:
    """Whatever is imported first after fenwear, or of it."""
    for first in ("dolfinx", "petsc4py.PETSc", "fenwear.heat.temperature", "fenwear.steps"):
        call([sys.executable, "-c", f"import fenwear, {first}"])
    import fenwear

    for name in fenwear.__all__:
        assert getattr(fenwear, name).__doc__, name


def steady(_: Path) -> None:
    """Example 1: both directions share twice the mean pressure, evenly; the command says the same."""
    import numpy as np

    import fenwear

    pressure = fenwear.steady(fenwear.assemble(fenwear.load_case("example1"))).pressure
    mean = 10_000 / (60 * 10)  # N over mm²
    assert np.abs(pressure.sum(axis=0) - 2 * mean).max() < 1e-9 * mean
    assert abs(pressure.max() - 2 * mean) < 1e-9 * mean
    assert re.search(r"largest pressure \(MPa\) +33\.333 +33\.333", call([*FENWEAR, "steady", "example1"]))


def verified(folder: Path) -> None:
    """What is kept beside the package is found, and a problem of known answer agrees."""
    assert "patch" in call([*FENWEAR, "verify", "--list"])
    call([*FENWEAR, "verify", "--only", "patch", "-o", str(folder / "verified")])


def solids(_: Path) -> None:
    """A ball on a flat and a ring on a ring: pressures in equilibrium with the load, wear that grows."""
    import numpy as np

    import fenwear

    for name, load, settings in (
        ("ball-on-flat", 20.0, ["geometry.parameters.core=0", "geometry.parameters.across=4"]),
        ("ring-on-ring", 2000.0, []),
    ):
        system = fenwear.assemble(fenwear.load_case(name, settings))
        *_, block = fenwear.march(system, 4)
        assert np.abs(block.pressure @ system.pair.weights - load).max() < 1e-9 * load, name
        assert (block.pressure >= -1e-9 * block.pressure.max()).all(), name


def heat_and_restart(folder: Path) -> None:
    """A run with heat begun on two ranks and gone on with on one: the same as on one throughout, to 1e-9."""
    import numpy as np

    from fenwear import read_history

    run("example1-heat", folder / "two", *HEAT, "run.half_cycles=20", ranks=2)
    run("example1-heat", folder / "two", *HEAT, "run.half_cycles=40", more=("--resume",))
    run("example1-heat", folder / "one", *HEAT, "run.half_cycles=40")
    two, one = (read_history(folder / name) for name in ("two", "one"))
    for name in ("largest_pressure", "largest_temperature", "worn_area_increment"):
        np.testing.assert_allclose(two[name], one[name], rtol=1e-9, err_msg=name)


def stick(folder: Path) -> None:
    """Fretting: pressure and traction carry the load; traction is below friction, its work balances."""
    import numpy as np

    from fenwear.results.stored_history import load_history

    run("fretting-partial-slip", folder / "stick", *STICK)
    history = load_history(folder / "stick")
    down = history.normal_z * history.step_pressure - history.normal_x * history.traction
    assert np.abs((down * history.weight).sum("x") - 120).max() < 1e-8 * 120
    assert (np.abs(history.traction) <= 0.9 * history.step_pressure * (1 + 1e-12)).all()
    assert float(history.energy_balance_error.max()) < 1e-8
    assert (folder / "stick" / "report.html").stat().st_size > 0


def main() -> None:
    """Call each of the above and print its processor time."""
    (folder,) = map(Path, sys.argv[1:])
    print(importlib.import_module("fenwear").__file__)
    for check in (imports, steady, verified, solids, heat_and_restart, stick):
        before = os.times()
        check(folder)
        after = os.times()
        print(f"{check.__name__}: {sum(after[:4]) - sum(before[:4]):.1f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
