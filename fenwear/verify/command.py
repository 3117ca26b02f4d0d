"""What `fenwear verify` does: runs the cases, says what they find as it goes, writes the page and the numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from fenwear.errors import CaseError, Problem
from fenwear.parallel import on_root
from fenwear.results import CASE, free_directory, make_directory
from fenwear.verify.page import page
from fenwear.verify.suite import Outcome, Row, VerificationCase, run_cases
from fenwear.versions import versions

PAGE, NUMBERS = "verification.html", "verification.json"
DEFAULT = Path("results") / "verification"
WIDTH = 78


def verify(
    cases: Sequence[VerificationCase], output: Path | None, say: Callable[[str], None]
) -> tuple[dict[str, Any], Path]:
    """Run the cases and write verification.html and verification.json; collective.

    Args:
        cases: What to run.
        output: New folder of the results; by default results/verification, or -2, -3, ...
        say: Called with each line of the table.

    Returns:
        What verification.json holds, and the folder.

    Raises:
        CaseError: the folder is not empty or cannot be written.
    """
    comm = MPI.COMM_WORLD
    directory = on_root(comm, lambda: _make(output))
    outcomes = []
    for outcome in run_cases(cases):
        outcomes.append(outcome)
        say("\n".join(_lines(outcome)))
    found = as_json(outcomes)
    on_root(comm, lambda: _write(directory, found, page(outcomes, comm.size, versions())))
    return found, directory


def as_json(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return what verification.json holds."""
    return {
        "agree": all(outcome.verdict != "differs" for outcome in outcomes),
        "differing": [outcome.case.name for outcome in outcomes if outcome.verdict == "differs"],
        "ranks": MPI.COMM_WORLD.size,
        "seconds": round(sum(outcome.seconds for outcome in outcomes), 3),
        "versions": versions(),
        "cases": [outcome.as_json() for outcome in outcomes],
    }


def _make(output: Path | None) -> Path:
    directory = free_directory(DEFAULT) if output is None else output
    make_directory(directory)
    (directory / CASE).unlink()  # its probe
    return directory


def _write(directory: Path, found: dict[str, Any], text: str) -> None:
    try:
        (directory / NUMBERS).write_text(json.dumps(found, indent=2) + "\n", "utf-8")
        (directory / PAGE).write_text(text, "utf-8")
    except OSError as error:
        raise CaseError(Problem("-o", f"{directory} cannot be written: {error.strerror}")) from None


def _lines(outcome: Outcome) -> list[str]:
    case, result = outcome.case, outcome.result
    head = f"{case.name}: {case.title}"
    lines = [f"{head:{WIDTH}} {outcome.verdict:>8} {outcome.seconds:6.1f} s"]
    lines += [f"    {_row(row)}" for row in result.rows]
    return lines + ([f"    {result.note}"] if result.note else [])


def _row(row: Row) -> str:
    order = "" if row.order is None else f", order {row.order:.2f}"
    mark = "" if row.agrees else "   <- DIFFERS"
    text = f"{row.what}: {row.ours:.6g}, reference {row.reference:.6g}"
    return f"{text:100} error {row.error:.1e} of {row.tolerance:.2g}{order}{mark}"
