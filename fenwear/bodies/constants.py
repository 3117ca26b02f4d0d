"""The parameters of a .geo file: what its DefineConstant names, with their defaults."""

from __future__ import annotations

import re
from pathlib import Path

from fenwear.errors import CaseError, InputError


def constants(path: Path) -> dict[str, str]:
    """Return the parameters of a .geo file, in their order, with their defaults as they are written.

    Raises:
        CaseError: it defines a Macro, which gmsh would read a second time in a wrong way.
    """
    text = re.sub(r"//.*", "", path.read_text("utf-8"))
    if re.search(r"^\s*(Macro|Function)\b", text, re.MULTILINE):
        message = (
            f"{path.name} defines a Macro, which gmsh reads safely only once in a process: write it out, or give a .msh"
        )
        raise CaseError(InputError("geometry.file", message))
    blocks = re.findall(r"DefineConstant\s*\[(.*?)\]\s*;", text, re.DOTALL)
    return {name: value.strip() for block in blocks for name, value in re.findall(r"(\w+)\s*=\s*([^,]*)", block)}
