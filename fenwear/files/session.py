"""A session of gmsh, opened quietly."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fenwear.stack import importing


def _library() -> Any:
    """Return gmsh.

    Raises:
        StackError: it is missing, or a library that it needs.
    """
    with importing():
        import gmsh
    return gmsh


def gmsh_there() -> None:
    """Look whether there is gmsh.

    Raises:
        StackError: it is missing, or a library that it needs.
    """
    _library()


@contextmanager
def gmsh_model() -> Iterator[Any]:
    """Open gmsh quietly, and close it unless someone else had opened it."""
    gmsh = _library()
    was_open = gmsh.isInitialized()
    if not was_open:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("fenwear")
    try:
        yield gmsh
    finally:
        if was_open:
            gmsh.model.remove()
        else:
            gmsh.finalize()
