"""200 variants of Example 1's steady state: by one process, by two, and on ranks.

python3 tests/benchmarks/sweep.py

Whole commands, from their start to their end. The first 200 variants have meshes of their own (another height of the
pin each); the second share ten meshes, and each is set up once. CPU times tell what several processes cost on top;
times by the clock mean something on idle cores only.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import xarray

SWEEPS = {
    "200 meshes": ["geometry.parameters.pin_height_1=10:40:200"],
    "10 meshes": ["geometry.parameters.pin_height_1=10:40:10", "contact.friction=0.1:0.3:20"],
}
WAYS = {"one process": ["--processes", "1"], "two processes": ["--processes", "2"], "by default": [], "3 ranks": []}


def timed(over: list[str], way: str, folder: Path) -> tuple[float, float, xarray.Dataset]:
    """Return the seconds of a sweep by the clock and of CPU, and its dataset."""
    words = [word for text in over for word in ("--over", text)]
    start = ["mpirun", "--oversubscribe", "-n", "3"] if way == "3 ranks" else []
    command = [
        *start,
        sys.executable,
        "-m",
        "fenwear",
        "sweep",
        "example1",
        *words,
        *WAYS[way],
        "-o",
        str(folder),
        "-q",
    ]
    before, begin = os.times(), time.perf_counter()
    subprocess.run([*command, "--json"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - begin, cpu, xarray.load_dataset(folder / "sweep.nc", engine="h5netcdf")


def main() -> None:
    """Print the table."""
    print("| variants | way | s | CPU s | times one process | variants' own s | largest difference |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    load = {}
    for name, over in SWEEPS.items():
        first = None
        for way in WAYS:
            with tempfile.TemporaryDirectory() as folder:
                seconds, cpu, found = timed(over, way, Path(folder) / "out")
            first = (seconds, found) if first is None else first
            difference = float(abs(found["pressure"] - first[1]["pressure"]).max() / first[1]["pressure"].max())
            print(
                f"| {name} | {way} | {seconds:.1f} | {cpu:.1f} | {first[0] / seconds:.2f} "
                f"| {float(found['seconds'].sum()):.1f} | {difference:.0e} |",
                flush=True,
            )
            load[way] = os.getloadavg()[0]
    print(f"load of the machine meanwhile: {json.dumps({way: round(value, 1) for way, value in load.items()})}")


if __name__ == "__main__":
    main()
