"""Lines and bars of progress."""

from __future__ import annotations

import pytest
from mpi4py import MPI

from fenwear.common.progress import Progress


def test_lines_tell_the_pace_where_there_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    """The first record of a run with jumps is that of no cycle."""
    with Progress("cycle", 10, 0, MPI.COMM_SELF, "lines") as told:
        told.reached(0, "new")
        told.reached(5, "worn")
    first, second = capsys.readouterr().err.splitlines()[-2:]
    assert first == "cycle 0 of 10, new"
    assert second.startswith("cycle 5 of 10, ")
    assert second.endswith(" s left, worn")
