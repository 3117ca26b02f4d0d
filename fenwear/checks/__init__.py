"""Checks of states and results: rules of plausibility, the numerical uncertainty, and the law of contact that fits.

rules           what each rule looks at, the key it is about, and its message, for states that can hardly be true
monitor         applies the rules to the first contact, to the blocks and stages of a run, and to steady states
surface_ends    where a contact surface ends: rims, chamfers, thickness
mesh_fineness   meshes that are too coarse for a contact, or in another unit
elastic_limits  displacements beyond small strain, and strokes that the bodies take up elastically
law_choice      the law of contact that a case leaves open

The numerical uncertainty of a run's end (`uncertainty_sources`) says how far depth, volume, pressure and temperature
may be from the limit.

In the words of ASME V&V 20 the error of a number against a measurement has parts of the input, the model and the
numerics; here it is the last of these alone, u_num, estimated after the run (solution verification, V&V 10). Each
source is a contribution of its own, and their sum bounds what they come to together, whatever their signs:

    mesh         of bodies, contact and temperatures, from the same run at the next lower degree of the elements; of a
                 contact grid, with every second or fourth of its nodes;
    wear steps   of marched half-cycles by what they wear; of jumps by their own errors, which continue from jump to
                 jump (`fenwear.steps.evolve`), in the run that the mesh is compared with, by their fields;
                 temperatures by half of what the last cycle changes at least, as jumps see whole cycles;
    positions    of the strip in a half-cycle, from the same run with half as many;
    following    of meshes that follow the wear, from the same run in which they follow half as often;
    heat steps   what halving them changes of the contact's temperatures;
    heat basis   how far temperatures on it are from those of the whole mesh;
    solver       what is left of equilibrium, and rounding.

The runs that are compared are made on the coarser elements, one for mesh and jumps together, so that all of them take
less than the set-up of solids does; only that against the run itself is of its own size. Where jumps are dear they are
longer there: then its numbers are those of jumps as long as the run's own, to first order. With phi_h of the run, phi_H
of the coarser one and r = H / h, the ratio of the distances of their nodes (P. J. Roache, J. Fluids Eng. 116, 1994),

    u = 1.25 d / (r^q - 1),    d = |phi_h - phi_H| or, if that is more, what their fields differ by (`Value.apart`).

Contact limits the order: displacements of quadratic elements and better have q = 3/2 where the edges of contact are
free (Z. Belhachmi, F. Ben Belgacem, Math. Comp. 72, 2003), pressures, whose slope there is infinite, q = 1 whatever the
degree. So depths, volumes and temperatures are taken to have 3/2; pressures, and what is largest at an edge, where the
limit may be a singularity or a step that wear has left, 1. Errors of the model and of the friction and wear
coefficients, which the coarser run cannot show, are no part of it.
"""

from fenwear.checks.elastic_limits import TAKEN_UP, elastic_share, elastic_way
from fenwear.checks.monitor import (
    HeatMonitor,
    StateMonitor,
    fineness_text,
    law_warnings,
    passing_text,
    sliding_text,
    unique_text,
    uniques,
)
from fenwear.checks.rules import RULES, Made, Rule, Seen, remarks
from fenwear.checks.uncertain_values import Quantity, Value, values_of
from fenwear.checks.uncertainty_sources import (
    Uncertainty,
    uncertainty,
    uncertainty_of_steady,
    uncertainty_table,
)

__all__ = [
    "RULES",
    "TAKEN_UP",
    "HeatMonitor",
    "Made",
    "Quantity",
    "Rule",
    "Seen",
    "StateMonitor",
    "Uncertainty",
    "Value",
    "elastic_share",
    "elastic_way",
    "fineness_text",
    "law_warnings",
    "passing_text",
    "remarks",
    "sliding_text",
    "uncertainty",
    "uncertainty_of_steady",
    "uncertainty_table",
    "unique_text",
    "uniques",
    "values_of",
]
