"""Several ranks: a distributed problem is the same problem."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from fenwear.case import load_case
from fenwear.steps import jump, march, steady
from fenwear.system import assemble
from fenwear_verify.suite import Result, Row, profile, verification


@verification("ranks", "Ranks: this communicator against each rank on its own", "the same case on one rank")
def ranks() -> Result:
    """Contact, march, jump and steady state of Examples 1 and 2, distributed and not, to 1e-9 of the largest."""
    if MPI.COMM_WORLD.size == 1:
        return Result(note="one rank only: start it as mpirun -n 2 python3 -m fenwear verify --only ranks")
    rows: list[Row] = []
    for name in ("example1", "example2"):
        alone, together = (assemble(load_case(name), comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
        for what, solve in (
            ("pressure of contact (MPa)", lambda s: s.contact((1,)).solve(s.pair.initial_gap).pressure[0]),
            ("wear after 30 half-cycles (mm)", lambda s: next(march(s, 30)).wear[-1]),
            (
                "pressure after 2,000 half-cycles by jumps (MPa)",
                lambda s: list(jump(s, 2000, tolerance=3e-3))[-1].pressure,
            ),
            ("pressure of the steady state (MPa)", lambda s: steady(s).pressure),
        ):
            one, other = solve(alone), solve(together)
            case = f"{name}, {MPI.COMM_WORLD.size} ranks: {what}"
            rows.append(profile(case, one, other, 1e-9, scale=np.abs(one).max()))
    return Result(rows)
