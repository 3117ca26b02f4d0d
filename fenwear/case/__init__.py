"""The validated description of a problem: one typed object, from a TOML file or from Python."""

from fenwear.case.body_tables import AUTO, CONDENSED, Body, Geometry, Grid, Load, Model, Prescribed, Support, Topography
from fenwear.case.contact_table import Contact
from fenwear.case.dependence import State, register_law
from fenwear.case.heat_table import Heat, Track
from fenwear.case.material_tables import Material
from fenwear.case.motion_table import Cycle, Motions, OneWay, Oscillation, Reciprocating, Rotation, Tabulated
from fenwear.case.reading import builtin_cases, changed_case, heat_of, load_case, make_case
from fenwear.case.run_tables import Output, Run, Setup
from fenwear.case.schema import Case
from fenwear.case.table_parts import Kind
from fenwear.case.unlikely_values import plausibility_warnings
from fenwear.case.wear_table import Dependence, Stick, Wear, WearLaw

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
