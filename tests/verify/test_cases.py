"""Every verification case agrees with its reference."""

from __future__ import annotations

import pytest
from mpi4py import MPI

from fenwear import CaseError
from fenwear_verify import VerificationCase, registered, run_cases

# What these find, they find in the small matrices of the contact, which every rank holds; bodies and heat go the ways
# of others, which run on several ranks.
ONE_RANK = {
    "bushing", "bushing-elastic", "cattaneo-mindlin", "flat-punch", "flat-punch-stick", "friction-block", "galin",
    "growing-cup", "nafems-cylinder", "nafems-punch", "pads-apart", "partial-slip-end", "pin-in-hole", "rounded-punch",
    "sliding-punch", "sphere-mindlin", "sphere-spence", "sphere-wear-end", "two-bushings", "worn-ball",
}  # fmt: skip


def marks(case: VerificationCase) -> list[pytest.MarkDecorator]:
    """Return how a case runs: the long ones go finer, but no other way than the rest, which runs on several ranks."""
    return [pytest.mark.slow] if case.slow else [] if case.name in ONE_RANK else [pytest.mark.mpi]


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
    assert {case.name for case in registered()} > ONE_RANK
    assert [case.name for case in registered(["galin", "hertz"])] == ["galin", "hertz"]
    with pytest.raises(CaseError, match="--only: no verification case 'herz'; did you mean 'hertz'"):
        registered(["herz"])
