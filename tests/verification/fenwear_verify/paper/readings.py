"""What a run with heat may take for what the paper leaves open: each reading as overrides of the built-in cases.

Some 60 readings were tried against seven numbers and descriptions of the paper; that one of them meets
one number closely says little. Those kept here are the simplest, the best, and what shows why others fail.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Reading:
    """One choice of all that the paper leaves open.

    Attributes:
        name: What it is called.
        settings: Overrides of `example1-heat`, and of `example2-heat`.
        alone: Overrides of `example1-heat` only.
        fitted: What was chosen to meet which number; empty where nothing was.
        against: What departs from the paper's words or data; empty where nothing does.
        directions: Whether the paper's 47.16 K is the mean of the two one-way temperatures or their sum.
        relaxed: Relaxation (29) from the pressure of the half-cycle before; None where heat and contact are solved
            together.
        counted: What n counts.
        point: Where it lies on the map of stability: h_c in W/(m² K) and kappa (1 - gamma_d); None where it does not.
        faces: Whether the two faces of the plane model convect.
        debris: gamma_d.
    """

    name: str
    settings: tuple[str, ...] = ()
    alone: tuple[str, ...] = ()
    fitted: str = ""
    against: str = ""
    directions: Literal["mean", "sum"] = "mean"
    relaxed: float | None = None
    counted: Literal["half-cycles", "steps of heat"] = "half-cycles"
    point: tuple[float, float] | None = None
    faces: bool = False
    debris: float = 0.0

    @property
    def command(self) -> str:
        """The command that computes its Example 1."""
        if self.relaxed is not None:
            return "verify --only paper"  # no coupling to use: it stands on this page only
        words = ["run", "example1-heat"]
        for setting in (*self.settings, *self.alone):
            words += ["--set", setting]
        return shlex.join(words)


# A conductance that changes with the pressure in every half-cycle is slow. These cost a few hundredths of a kelvin.
FASTER = ("geometry.parameters.elements_along_contact=8", "heat.coupling=split", "heat.relaxation=1.0")
NO_DEBRIS = "heat.debris=0"
TRIED = 60  # readings, about
READINGS = (
    Reading("round values", point=(80, 0.25), debris=0.5),
    Reading(
        "fitted with debris",
        ("heat.debris=0.648", "heat.partition=0.7428"),
        fitted="kappa and gamma_d, to both temperatures",
    ),
    Reading(
        "fitted without debris",
        (NO_DEBRIS, "heat.partition=0.206", "heat.conductance=0.034"),
        fitted="kappa and h_c, to both temperatures",
        against="h_c = 34 W/(m² K)",
        point=(34, 0.206),
    ),
    Reading(
        "text literal",
        ("heat.convecting_faces=true", NO_DEBRIS, "heat.partition=0.4681"),
        fitted="kappa, to 47.16 K",
        point=(80, 0.4681),
        faces=True,
    ),
    Reading("round values, relaxed", fitted="the relaxation of 0.001, to n = 1,800", relaxed=0.001),
    Reading(
        "fitted and relaxed",
        (NO_DEBRIS, "heat.partition=0.1876", "heat.conductance=0.016"),
        fitted="kappa and h_c, to both temperatures; the relaxation of 0.001, to n = 1,800",
        against="h_c = 16 W/(m² K)",
        relaxed=0.001,
    ),
    Reading(
        "conductance with pressure and debris",
        (
            *FASTER,
            "heat.debris=0.34",
            "heat.partition=0.3983",
            "heat.conductance=0",
            "heat.conductance_per_pressure=[0.01, 0.01]",
        ),
        fitted="kappa and gamma_d, to both temperatures",
    ),
    Reading(
        "friction arm of 30 mm",
        alone=("geometry.parameters.pin_height_1=30",),
        against="pin at 30 mm, not 20",
    ),
    Reading(
        "literal sum",
        (
            *FASTER,
            "heat.convecting_faces=true",
            NO_DEBRIS,
            "heat.conductance=0",
            "heat.conductance_per_pressure=[0.08, 0.08]",
        ),
        directions="sum",
        faces=True,
    ),
    Reading(
        "small face loss",
        (
            "heat.convecting_faces=true",
            'model.thickness="90 mm"',
            'punch.loads.0.force=["0 N", "-90 kN"]',
            NO_DEBRIS,
            "heat.partition=0.2135",
            "heat.conductance=0",
        ),
        fitted="kappa and the faces' loss, to both temperatures",
        against="h_c = 0; a ninth of the faces' loss",
    ),
    Reading(
        "response times 0.65",
        (
            NO_DEBRIS,
            "heat.partition=0.2327",
            "heat.conductance=0.06",
            "materials.steel.expansion=0.65e-5",
            "materials.composite.expansion=1.95e-5",
        ),
        fitted="kappa and h_c, to both temperatures; the expansion, to 33.33 MPa",
        against="both expansions times 0.65; h_c = 60 W/(m² K)",
    ),
    Reading(
        "n in steps of heat",
        (NO_DEBRIS, "heat.partition=0.1968", "heat.conductance=0.025"),
        fitted="kappa and h_c, to both temperatures",
        against="h_c = 25 W/(m² K); n is not twice the number of cycles",
        counted="steps of heat",
    ),
)
