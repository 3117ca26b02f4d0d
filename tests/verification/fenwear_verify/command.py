"""What `fenwear verify` does: cases and comparison with the paper, what they find as it goes, page and numbers."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from fenwear.common.errors import CaseError, InputError
from fenwear.common.parallel import on_root
from fenwear.common.stack import versions
from fenwear.results.history import CASE, free_directory, make_directory
from fenwear_verify.page import page
from fenwear_verify.paper import BRIEF, FULL, Scope, paper_rows, section
from fenwear_verify.suite import Outcome, Row, VerificationCase, registered, run_cases

PAPER, PAPER_TITLE = "paper", "Every number of the paper beside fenwear's, under every reading (5 minutes)"
PAGE, NUMBERS = "verification.html", "verification.json"
DEFAULT = Path("results") / "verification"
WIDTH = 78


def choose(names: Sequence[str]) -> tuple[list[VerificationCase], Scope | None]:
    """Return the cases of these names and how much of the comparison with the paper.

    By default all cases and the main readings of the paper; all of its readings where it is named.

    Raises:
        CaseError: a name that nothing has.
    """
    paper = FULL if PAPER in names else None if names else BRIEF
    return registered(names, besides=(PAPER,)), paper


def titles() -> dict[str, str]:
    """Return everything that can be asked for, with its title."""
    return {**{case.name: case.title for case in registered()}, PAPER: PAPER_TITLE}


def verify(
    cases: Sequence[VerificationCase], paper: Scope | None, output: Path | None, say: Callable[[str], None]
) -> tuple[dict[str, Any], Path]:
    """Run the cases, compare with the paper, and write verification.html and verification.json; collective.

    Args:
        cases: What to run.
        paper: How much of the comparison with the paper, None for nothing of it.
        output: New folder of the results; by default results/verification, or -2, -3, ...
        say: Called with each line of the table.

    Returns:
        What verification.json holds, and the folder.

    Raises:
        CaseError: the folder is not empty or cannot be written.
    """
    comm = MPI.COMM_WORLD
    directory = on_root(comm, lambda: new_folder(output, DEFAULT))
    outcomes = []
    for outcome in run_cases(cases):
        outcomes.append(outcome)
        say("\n".join(_lines(outcome)))
    found = as_json(outcomes)
    beside = None
    if paper is not None:
        begin = time.perf_counter()
        rows = paper_rows(paper)
        say("\n".join(section.lines(rows)))
        beside = section.write_section(paper)
        found["paper"] = {**section.as_json(paper), "seconds": round(time.perf_counter() - begin, 3)}
        say(section.summary(rows))
    on_root(comm, lambda: write_results(directory / NUMBERS, json.dumps(found, indent=2) + "\n"))
    on_root(comm, lambda: write_results(directory / PAGE, page(outcomes, beside, comm.size, versions())))
    return found, directory


def as_json(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return what verification.json holds of the cases: what they agree with is exact or published, never open."""
    return {
        "agree": all(outcome.verdict != "differs" for outcome in outcomes),
        "differing": [outcome.case.name for outcome in outcomes if outcome.verdict == "differs"],
        "ranks": MPI.COMM_WORLD.size,
        "seconds": round(sum(outcome.seconds for outcome in outcomes), 3),
        "versions": versions(),
        "cases": [outcome.as_json() for outcome in outcomes],
        "paper": None,
    }


def new_folder(output: Path | None, default: Path) -> Path:
    """Make the new folder of results, by default the next free one beside the default; return it."""
    folder = free_directory(default) if output is None else output
    make_directory(folder)
    (folder / CASE).unlink()  # its probe
    return folder


def write_results(path: Path, content: str | bytes) -> None:
    """Write a file of results.

    Raises:
        CaseError: it cannot be written.
    """
    try:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    except OSError as error:
        raise CaseError(InputError("-o", f"cannot write {path}: {error.strerror}")) from None


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
