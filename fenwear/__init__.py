"""fenwear: thermo-mechanical sliding wear with FEniCSx.

From Python:

    from fenwear import assemble, load_case, steady
    system = assemble(load_case("example1"))
    print(steady(system).pressure.max())
"""

from __future__ import annotations

from typing import Any

__version__ = "0.2.0"

__all__ = [
    "Case",
    "CaseError",
    "ConvergenceError",
    "FenwearError",
    "Tribosystem",
    "assemble",
    "jump",
    "load_case",
    "make_case",
    "march",
    "register_law",
    "steady",
    "sweep",
    "vary",
]

_HOMES = {
    "Case": "case",
    "load_case": "case",
    "make_case": "case",
    "register_law": "case",
    "CaseError": "errors",
    "ConvergenceError": "errors",
    "FenwearError": "errors",
    "Tribosystem": "assembly",
    "assemble": "assembly",
    "vary": "assembly",
    "jump": "cycle",
    "march": "cycle",
    "steady": "cycle",
    "sweep": "sweeps",
}


def __getattr__(name: str) -> Any:
    """Import the public names at first use: reading a case needs no MPI."""
    if name not in _HOMES:
        raise AttributeError(f"module 'fenwear' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"fenwear.{_HOMES[name]}"), name)
