"""Versions of fenwear and of the stack below it."""

from __future__ import annotations

import platform
from importlib import metadata

import fenwear


def versions() -> dict[str, str]:
    """Return the version of each part by its name."""
    import dolfinx
    from mpi4py import MPI
    from petsc4py import PETSc

    found = {
        "fenwear": fenwear.__version__,
        "dolfinx": dolfinx.__version__,
        "PETSc": ".".join(map(str, PETSc.Sys.getVersion())),
        "MPI": MPI.Get_library_version().split(",")[0].strip("\x00 \n"),
        "Python": platform.python_version(),
    }
    for name in ("fenics-ufl", "fenics-basix", "gmsh", "numpy", "scipy", "xarray", "h5netcdf", "pydantic", "pint"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # a Debian package without Python metadata
            module = __import__(name.removeprefix("fenics-"))
            found[name] = str(getattr(module, "__version__", "present"))
    return found
