"""Runs that are killed at random moments and gone on with: they end with the numbers of those that nobody killed.

python3 tests/fuzz/kills.py                50 moments of each kind of case
python3 tests/fuzz/kills.py --count 5 --only stick

A run is a process forked from this one, ended by SIGKILL, which nothing can answer; then `resume` goes on from what
lies in its folder, or says that nothing does, and the run begins anew.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bases
import numpy as np
import xarray

from fenwear import Case, make_case, run_case
from fenwear.common.errors import FenwearError
from fenwear.results.checkpoint import FILE
from fenwear.results.stored_history import load_history

KINDS = {  # and half-cycles: seconds of which most are not the set-up
    "example1": 2000, "example1-heat": 1500, "fretting": 1200, "implicit laws": 200, "stick": 3000,
    "stick between": 3000, "between": 2000, "cap": 2000, "rings": 2000, "warm rings": 1000, "bushing": 2000,
    "solid": 1000, "stick of a sphere": 1500, "table": 1500, "grid": 300, "rough": 300, "followed": 40,
}  # fmt: skip
EXACT = 1e-9
LEAVES = 1800.0  # s by the clock, after which a process counts as hanging, however busy the machine is


def quiet(_message: str) -> None:
    """Say nothing."""


def forked(task: Callable[[], object]) -> int:
    """Start a task in a process of its own; return its number."""
    pid = os.fork()
    if pid:
        return pid
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    status = 1
    try:
        task()
        status = 0
    except FenwearError:
        status = 2
    finally:
        os._exit(status)


def ended(pid: int, after: float = LEAVES) -> tuple[int, float]:
    """Wait for a process, killed where it takes longer; return its status and how long it took."""
    begin = time.monotonic()
    while (done := os.waitpid(pid, os.WNOHANG)) == (0, 0):
        if time.monotonic() > begin + after:
            os.kill(pid, signal.SIGKILL)
            done = os.waitpid(pid, 0)
            break
        time.sleep(0.002)
    return done[1], time.monotonic() - begin


def await_checkpoint(pid: int, folder: Path) -> None:
    """Wait until a process has kept a checkpoint, or has ended."""
    while not (folder / FILE).is_file() and os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        time.sleep(0.002)


def case_of(name: str, half_cycles: int) -> Case:
    """Return a base of the fuzzing that runs so long and keeps often."""
    tables = bases.base(name)
    tables["run"]["half_cycles"] = half_cycles
    tables["run"]["integration"] = "implicit" if "implicit" in name else "explicit"
    tables["output"] |= {"checkpoint": "0.01 s", "report": False, "uncertainty": False, "fields_at": []}
    return make_case(tables)


def apart(one: xarray.Dataset, other: xarray.Dataset) -> str:
    """Return the variable in which two histories differ by more than rounding; "" where none does."""
    if one.sizes != other.sizes:
        return f"sizes {dict(one.sizes)} and {dict(other.sizes)}"
    for name in ("pressure", "wear", "wear_strip", "friction_work", "largest_temperature", "debris_thickness"):
        if name in one:
            scale = float(np.abs(one[name].values).max()) or 1.0
            if not np.abs(one[name].values - other[name].values).max() <= EXACT * scale:
                return name
    return ""


def try_kind(name: str, half_cycles: int, count: int, seed: int) -> list[str]:
    """Return what went wrong, of so many runs that are killed once."""
    case, choose, wrong = case_of(name, half_cycles), random.Random(f"{name} {seed}"), []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)

        def run(where: str, *, resume: bool = False) -> int:
            return forked(lambda: run_case(case, "run", folder / where, quiet, progress="none", resume=resume))

        run_case(case, "run", folder / "first", quiet, progress="none")  # modules and forms are loaded, set-ups kept
        status, whole = ended(run("whole"))
        if status:
            return [f"{name}: the whole run ended with {status}"]
        expected, begun = load_history(folder / "whole"), 0
        for number in range(count):
            where = f"killed {number}"
            pid = run(where)
            if number % 2:  # within what goes on, else at any moment: before the first checkpoint, most often
                await_checkpoint(pid, folder / where)
            ended(pid, choose.uniform(0, whole / (1 + number % 2)))
            status, _ = ended(run(where, resume=True))
            if status == 2 << 8:  # nothing to go on from, which is said
                begun += 1
                where += " anew"
                status, _ = ended(run(where))
            trouble = f"ended with {status}" if status else apart(expected, load_history(folder / where))
            if trouble:
                wrong.append(f"{name}, moment {number} of seed {seed}: {trouble}")
                print(wrong[-1], flush=True)
    print(
        f"{name}: {count - len(wrong)} of {count} the same, {begun} of them begun anew; {whole:.2f} s each", flush=True
    )
    return wrong


def main() -> int:
    """Kill and go on; return an exit status of 1 where anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=50, help="moments of each kind")
    parser.add_argument("--only", choices=list(KINDS), action="append", help="this kind; may be repeated")
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    options = parser.parse_args()
    wrong = [
        text for name in options.only or KINDS for text in try_kind(name, KINDS[name], options.count, options.seed)
    ]
    print("\n".join(wrong))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
