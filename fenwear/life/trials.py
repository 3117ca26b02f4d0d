"""Computed trials of a fit, kept in a file: an interrupted calibration resumes at any run."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError
from fenwear.results.disk import writing

TRIALS = "trials.jsonl"


class Trials:
    """Arrays by what they were computed for; each is on the disk as soon as it is known, where there is a file.

    A fit asks for the same trials in the same order again, so that those on the disk take the place of runs.
    """

    def __init__(self, path: Path | None = None) -> None:
        """Begin without any; the file appears with the first one."""
        self.path = path
        self._kept: dict[str, Array] = {}

    def begin(self, problem: str, *, resume: bool) -> None:
        """Read those that a folder holds of the same problem.

        Raises:
            CaseError: the folder holds none, or those of another problem.
        """
        self._kept.clear()
        first = json.dumps({"problem": hashlib.sha256(problem.encode()).hexdigest()})
        if self.path is None:
            return
        if not resume:
            with writing(self.path):
                self.path.write_text(first + "\n", "utf-8")
            return
        try:
            head, *lines = self.path.read_text("utf-8").splitlines()
        except (OSError, ValueError):
            raise CaseError(InputError("--resume", f"{self.path} cannot be read. Start again without it")) from None
        if head != first:
            raise CaseError(
                InputError("--resume", f"{self.path} belongs to another case, data or unknowns. Start without it")
            )
        for line in lines:
            try:
                one = json.loads(line)
            except ValueError:  # the last line of a process that was killed
                break
            self._kept[one["trial"]] = np.array(one["values"])

    def get(self, kind: str, z: Array) -> Array | None:
        """Return the array of a kind at fitted unknowns; None where it has not been computed."""
        return self._kept.get(self._key(kind, z))

    def put(self, kind: str, z: Array, values: Array) -> Array:
        """Keep an array; return it."""
        key = self._key(kind, z)
        self._kept[key] = values
        if self.path is not None:
            with writing(self.path), self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"trial": key, "values": values.tolist()}) + "\n")
        return values

    @staticmethod
    def _key(kind: str, z: Array) -> str:
        return f"{kind} {z.tobytes().hex()}"
