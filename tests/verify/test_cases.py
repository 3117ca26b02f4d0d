"""Every verification case agrees with its reference."""

from __future__ import annotations

import pytest
from mpi4py import MPI

from fenwear import CaseError
from fenwear_verify import VerificationCase, registered, run_cases

# One for each way that bodies and heat are spread over ranks, and the one that compares ranks. What the others find,
# they find in the small matrices of the contact, which every rank holds.
ON_RANKS = {
    "ball-in-cup", "bulk-stress", "creep-sphere", "elasticity", "energy", "open-strip", "optimum-table",
    "patch", "ranks", "ring-heat", "round-punch", "sliding-cylinder", "solid-patch", "solid-slice-heat",
    "thermal-strain", "turning-heat", "wear-volume",
}  # fmt: skip


def marks(case: VerificationCase) -> list[pytest.MarkDecorator]:
    """Return how a case runs: the long ones go finer, but no other way than the rest, on one rank."""
    return [pytest.mark.slow] if case.slow else [pytest.mark.mpi] if case.name in ON_RANKS else []


CASES = [pytest.param(c, id=c.name, marks=marks(c)) for c in registered()]


@pytest.mark.parametrize("case", CASES)
def test_case(case: VerificationCase) -> None:
    """On one rank, and on two: every row within its tolerance."""
    (outcome,) = run_cases([case])
    differing = [row for row in outcome.result.rows if not row.agrees]
    assert not differing
    expected = "not run" if case.name == "ranks" and MPI.COMM_WORLD.size == 1 else "agrees"
    assert outcome.verdict == expected, outcome.result.note


def test_every_row_can_be_asked_for() -> None:
    """By name, in the order asked for; another name is refused with the nearest one."""
    assert {case.name for case in registered() if not case.slow} > ON_RANKS
    assert [case.name for case in registered(["galin", "hertz"])] == ["galin", "hertz"]
    with pytest.raises(CaseError, match="--only: no verification case 'herz'; did you mean 'hertz'"):
        registered(["herz"])
