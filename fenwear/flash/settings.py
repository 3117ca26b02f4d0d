"""What temperatures need of a run's case: materials that conduct, and a table of heat, of which a grid has none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fenwear.arrays import Mask
from fenwear.assembly import ContactSetup
from fenwear.case import Case, Heat, Material, OneWay, Rotation, changed_case, heat_of, load_case
from fenwear.errors import CaseError, InputError

NEEDED = ("conductivity", "heat_capacity", "density")
TAKEN = (
    *("partition", "debris", "conductance", "conductance_per_pressure", "convection"),
    *("ambient", "inflow", "initial"),
)
OTHERS = ("temperatures", "insulated")  # of a body


def run_case_of(path: Path, settings: Sequence[str]) -> tuple[Case, Heat]:
    """Return the case of a run with other values of what conducts, and its table of heat.

    Args:
        path: The case in the run's folder.
        settings: Overrides `key=value` of heat, materials, held temperatures and insulated boundaries.

    Raises:
        CaseError: they are of something else, or wrong; or the case has no contact grid.
    """
    case = load_case(path)
    if case.heat is not None:
        raise CaseError(InputError("heat", "expected a run without: this one has its temperatures in its history"))
    if case.model.kind != "solid":
        message = (
            "expected a solid: heat that enters a plane model along a line has no steady temperature, and rings no"
        )
        raise CaseError(InputError("model.kind", f"{message} grid"))
    if case.grid is None:
        raise CaseError(InputError("grid", "missing, but required: temperatures follow from pressures on a grid"))
    of_heat = [one for one in settings if one.startswith("heat.")]
    others = [one for one in settings if one not in of_heat]
    for one in others:
        key = one.partition("=")[0].strip()
        role, _, name = key.partition(".")
        if role != "materials" and not (role in case.bodies and name.partition(".")[0] in OTHERS):
            message = f"{key} is of the run itself; expected keys of heat, materials, or temperatures of a body"
            raise CaseError(InputError("--set", message))
    heat = heat_of(of_heat)
    given = [one.partition("=")[0].strip().partition(".")[2] for one in of_heat]
    problems = [
        InputError(f"heat.{key}", f"plays no part in what follows from pressures; expected one of {', '.join(TAKEN)}")
        for key in given
        if key not in TAKEN
    ]
    if heat.conductance == "layer":
        problems.append(
            InputError("heat.conductance", "expected a number, or that per pressure: a grid has no 'layer'")
        )
    if heat.inflow is not None and not isinstance(case.motion, OneWay | Rotation):
        text = "expected one-way sliding: to and fro the same material stays, and none enters"
        problems.append(InputError("heat.inflow", text))
    if problems:
        raise CaseError(problems)
    return (changed_case(case, *others) if others else case), heat


@dataclass(frozen=True)
class Conductor:
    """The material of a body at its contact.

    Attributes:
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        material: Of it.
    """

    conductivity: float
    diffusivity: float
    material: Material


def conductors(placed: ContactSetup, case: Case, heat: Heat, touching: Mask) -> list[Conductor]:
    """Return what punch and strip are of where they touch.

    Args:
        placed: The bodies.
        case: With the materials.
        heat: Whose initial temperature they are taken at.
        touching: Nodes of the punch (n,).

    Raises:
        CaseError: a property is missing, or several materials touch.
    """
    found: list[Conductor] = []
    for name, body, shares in zip(case.bodies, case.bodies.values(), placed.bodies.regions, strict=True):
        used = touching if name == "punch" else np.full(len(next(iter(shares.values()))), True)
        names = {body.regions[region] for region, share in shares.items() if (share[used] > 0).any()}
        materials = {key: case.materials[key].at(heat.initial, f"materials.{key}") for key in sorted(names)}
        problems = [
            InputError(f"materials.{key}.{one}", "missing, but required: in the case or by --set")
            for key, material in materials.items()
            for one in NEEDED
            if getattr(material, one) is None
        ]
        if problems:
            raise CaseError(problems)
        own = {
            key: (float(one.conductivity), float(one.density or 0.0) * float(one.heat_capacity))
            for key, one in materials.items()
        }
        if len(set(own.values())) > 1:
            message = f"expected one material where the {name} touches, got {', '.join(own)}"
            raise CaseError(InputError(f"{name}.regions", message))
        key, (conductivity, capacity) = next(iter(own.items()))
        found.append(Conductor(conductivity, conductivity / capacity, materials[key]))
    return found
