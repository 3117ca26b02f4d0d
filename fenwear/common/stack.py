"""The stack below fenwear: loaded in an order that works; an error names a missing part.

In wheels from PyPI, dolfinx and PETSc find the library of MPI only where mpi4py has loaded it before.
"""

from __future__ import annotations

import atexit
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fenwear.common.errors import StackError

if TYPE_CHECKING:
    from mpi4py import MPI

LINKED = ("dolfinx", "petsc4py")  # to MPI
PARTS = {"basix", "cffi", "ffcx", "gmsh", "mpi4py", "ufl", *LINKED}
SOLVER = 'pip install "fenwear[solver]"'
LIBRARIES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1"  # of Debian, with what they bring: those of gmsh
PLACE = "XDG_CACHE_HOME"  # where FEniCSx keeps the forms that it compiles
REAL = "fenwear needs PETSc with real numbers: install dolfinx-solver-real, on Debian python3-dolfinx-real"


class _MPIFirst:
    """Finds nothing: loads MPI where something linked to it is about to be imported."""

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> None:  # noqa: ARG002
        if fullname in LINKED:
            with suppress(ImportError):
                import mpi4py.MPI  # noqa: F401


def load_mpi_first() -> None:
    """Let whatever is imported from now on find MPI loaded; imports nothing."""
    sys.meta_path.insert(0, _MPIFirst())


@contextmanager
def importing() -> Iterator[None]:
    """Tell of a part of the stack that cannot be imported by its name, and how it is installed.

    Raises:
        StackError: a part is missing, or a library that it needs.
    """
    try:
        yield
    except StackError:  # told already
        raise
    except (ImportError, OSError) as error:
        part = (getattr(error, "name", None) or "").partition(".")[0]
        if isinstance(error, ModuleNotFoundError) and part in PARTS:
            raise StackError(f"{part} is missing, and nothing is computed without: {SOLVER}") from error
        if "cannot open shared object file" not in str(error):
            raise
        raise StackError(f"a library is missing ({error}): on Debian, gmsh needs {LIBRARIES}") from error


@contextmanager
def without(package: str) -> Iterator[None]:
    """Let what is imported meanwhile go without a package that it would load if it were there."""
    loaded = package in sys.modules
    if not loaded:
        sys.modules[package] = None  # type: ignore[assignment]  # importing it fails, as where it is missing
    try:
        yield
    finally:
        if not loaded:
            del sys.modules[package]


def check_numbers() -> None:
    """Make sure that PETSc computes with real numbers.

    Raises:
        StackError: it is built for complex ones.
    """
    import numpy as np
    from petsc4py import PETSc

    if np.dtype(PETSc.ScalarType).kind == "c":
        raise StackError(REAL)


@contextmanager
def compiling() -> Iterator[None]:
    """Tell what is missing where a form cannot be compiled.

    Raises:
        StackError: no compiler is found, or no headers of Python.
    """
    import cffi

    try:
        yield
    except (cffi.VerificationError, RuntimeError) as error:
        lack = lacks_to_compile()
        if lack is None:
            raise
        raise StackError(f"a form cannot be compiled: {lack}") from error


def lacks_to_compile() -> str | None:
    """Return the missing part of the compiler of forms; None where all is there."""
    import shlex
    import sysconfig

    compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")[0]
    if shutil.which(compiler) is None:
        return f"there is no C compiler {compiler} on PATH: install gcc, or name another one in CC"
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    return None if header.is_file() else f"there is no {header}: install Python's headers, on Debian python3-dev"


def ensure_folder(comm: MPI.Comm) -> str | None:
    """Make sure of a folder for compiled forms, a temporary one where the usual one cannot be had; collective.

    Before dolfinx is imported, which takes the folder from the environment.

    Returns:
        Remark; None where all is well.
    """
    from fenwear.common.parallel import on_root

    text = on_root(comm, _problem)
    if text is None:
        return None
    folder = on_root(comm, lambda: tempfile.mkdtemp(prefix="fenwear-"))
    if comm.rank == 0:
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ[PLACE] = folder
    return f"{text}: forms are compiled in a temporary folder, and nothing is kept; {PLACE} chooses another one"


def _problem() -> str | None:
    folder = Path(os.environ.get(PLACE) or Path.home() / ".cache") / "fenics"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            return None
    except OSError as error:
        return f"{folder.parent} cannot be written ({error.strerror})"


def versions() -> dict[str, str]:
    """Return the version of each part by its name."""
    import dolfinx
    from mpi4py import MPI
    from petsc4py import PETSc

    import fenwear

    by_name = {
        "fenwear": fenwear.__version__,
        "dolfinx": dolfinx.__version__,
        "PETSc": ".".join(map(str, PETSc.Sys.getVersion())),
        "MPI": MPI.Get_library_version().split(",")[0].strip("\x00 \n"),
        "Python": platform.python_version(),
    }
    for name in ("fenics-ufl", "fenics-basix", "gmsh", "numpy", "scipy", "xarray", "h5netcdf", "pydantic", "pint"):
        try:
            by_name[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # a Debian package without Python metadata
            module = __import__(name.removeprefix("fenics-"))
            by_name[name] = str(getattr(module, "__version__", "present"))
    return by_name
