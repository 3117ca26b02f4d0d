"""A million half-cycles: memory and files over the run, which must not grow.

python3 tests/benchmarks/endurance.py [--half-cycles N] [--set KEY=VALUE ...] [-o DIR]

Runs Example 1 explicitly in a process of its own and prints, ten times over the run, the rate, the
resident memory of the process and the size of what it has written.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PARTS = 10


def resident(pid: int) -> float:
    """Return the resident memory of a process, MiB; 0 where it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except FileNotFoundError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS")), 0.0)


def size(folder: Path) -> float:
    """Return the size of all files in a folder, MiB."""
    total = 0
    for path in folder.rglob("*"):
        try:
            total += path.stat().st_size
        except FileNotFoundError:  # it has been replaced meanwhile
            continue
    return total / 2**20


def main() -> int:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description="Memory and files of a long run.")
    parser.add_argument("--case", default="example1")
    parser.add_argument("--half-cycles", type=int, default=1_000_000)
    parser.add_argument("--set", action="append", default=[], dest="settings", metavar="KEY=VALUE")
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    settings = [f"run.half_cycles={arguments.half_cycles}", "output.every=100", *arguments.settings]
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.output or Path(temporary) / "run"
        command = [sys.executable, "-m", "fenwear", "run", arguments.case, "-o", str(folder), "--verbose"]
        command += [word for setting in settings for word in ("--set", setting)]
        begin, part = time.monotonic(), 0
        print(f"{'half-cycle':>12} {'a second':>9} {'memory MiB':>11} {'files MiB':>10}")
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr is not None
            for line in process.stderr:
                words = line.split()
                if words[:1] != ["half-cycle"]:
                    print(line, end="")
                    continue
                number = int(words[1].replace(",", ""))
                if number * PARTS // arguments.half_cycles > part:
                    part = number * PARTS // arguments.half_cycles
                    rate = number / (time.monotonic() - begin)
                    row = f"{number:12,} {rate:9,.0f} {resident(process.pid):11.0f} {size(folder):10.1f}"
                    print(row, flush=True)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        print(f"exit status {process.returncode}, {time.monotonic() - begin:.0f} s, files {size(folder):.1f} MiB, "
              f"largest memory {peak:.0f} MiB")  # fmt: skip
    return process.returncode


if __name__ == "__main__":
    sys.exit(main())
