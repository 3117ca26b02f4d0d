"""The validated description of a problem: one typed object, from a TOML file or from Python."""

from fenwear.case.reading import builtin_cases, changed_case, load_case, make_case
from fenwear.case.schema import (
    Body,
    Case,
    Contact,
    Geometry,
    Heat,
    Load,
    Material,
    Model,
    OneWay,
    Output,
    Prescribed,
    Reciprocating,
    Run,
    Support,
    Wear,
    WearLaw,
)

__all__ = [
    "Body",
    "Case",
    "Contact",
    "Geometry",
    "Heat",
    "Load",
    "Material",
    "Model",
    "OneWay",
    "Output",
    "Prescribed",
    "Reciprocating",
    "Run",
    "Support",
    "Wear",
    "WearLaw",
    "builtin_cases",
    "changed_case",
    "load_case",
    "make_case",
]
