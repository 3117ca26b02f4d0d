"""fenwear: thermo-mechanical sliding wear with FEniCSx.

From Python:

    from fenwear import assemble, load_case, steady
    system = assemble(load_case("example1"))
    print(steady(system).pressure.max())
"""

from __future__ import annotations

from typing import Any

from fenwear.common.stack import importing, load_mpi_first

__version__ = "0.2.0"

__all__ = [
    "Block",
    "Case",
    "CaseError",
    "ConvergenceError",
    "FenwearError",
    "OwnLaw",
    "State",
    "SteadyState",
    "Tribosystem",
    "assemble",
    "critical_speed",
    "cycles_to_reach",
    "evolve",
    "export",
    "flash_temperatures",
    "growth_rate",
    "jump",
    "load_case",
    "make_case",
    "march",
    "own_mesh",
    "read_history",
    "register_contact_law",
    "register_law",
    "register_operator",
    "run_case",
    "steady",
    "sweep",
    "to_dataset",
    "vary",
]

_HOMES = {
    "Case": "case",
    "load_case": "case",
    "make_case": "case",
    "register_law": "case",
    "State": "case",
    "own_mesh": "bodies.distributed_mesh",
    "OwnLaw": "bodies.elastic_material",
    "register_operator": "bodies.surface_operators",
    "register_contact_law": "system",
    "CaseError": "common.errors",
    "ConvergenceError": "common.errors",
    "FenwearError": "common.errors",
    "Tribosystem": "system",
    "assemble": "system",
    "vary": "system",
    "Block": "steps",
    "SteadyState": "steps",
    "critical_speed": "steps",
    "cycles_to_reach": "steps",
    "evolve": "steps",
    "growth_rate": "steps",
    "jump": "steps",
    "march": "steps",
    "steady": "steps",
    "run_case": "studies.run",
    "export": "results.export",
    "read_history": "results.stored_history",
    "to_dataset": "results.stored_history",
    "flash_temperatures": "results.flash_temperatures",
    "sweep": "studies",
}


def __getattr__(name: str) -> Any:
    """Import the public names at first use: reading a case needs no MPI."""
    if name not in _HOMES:
        raise AttributeError(f"module 'fenwear' has no attribute {name!r}")
    from importlib import import_module

    with importing():
        return getattr(import_module(f"fenwear.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """Return the public names, for completion."""
    return sorted(__all__)


load_mpi_first()
