"""The validated description of a problem: one typed object, from a TOML file or from Python."""

from fenwear.case.bodies import AUTO, CONDENSED, Body, Geometry, Grid, Load, Model, Prescribed, Support, Topography
from fenwear.case.contact import Contact
from fenwear.case.course import Output, Run, Setup
from fenwear.case.dependence import State, register_law
from fenwear.case.laws import Dependence, Stick, Wear, WearLaw
from fenwear.case.materials import Material
from fenwear.case.motions import Cycle, Motions, OneWay, Oscillation, Reciprocating, Rotation, Tabulated
from fenwear.case.plausible import plausibility_warnings
from fenwear.case.quantities import Kind
from fenwear.case.reading import builtin_cases, changed_case, heat_of, load_case, make_case
from fenwear.case.schema import Case
from fenwear.case.thermal import Heat, Track

__all__ = [
    "AUTO",
    "CONDENSED",
    "Body",
    "Case",
    "Contact",
    "Cycle",
    "Dependence",
    "Geometry",
    "Grid",
    "Heat",
    "Kind",
    "Load",
    "Material",
    "Model",
    "Motions",
    "OneWay",
    "Oscillation",
    "Output",
    "Prescribed",
    "Reciprocating",
    "Rotation",
    "Run",
    "Setup",
    "State",
    "Stick",
    "Support",
    "Tabulated",
    "Topography",
    "Track",
    "Wear",
    "WearLaw",
    "builtin_cases",
    "changed_case",
    "heat_of",
    "load_case",
    "make_case",
    "plausibility_warnings",
    "register_law",
]
