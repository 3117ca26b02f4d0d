"""Geometries in .geo files: the parameters of any, and the descriptions of the ready ones."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from fenwear.common.errors import CaseError, InputError

PACKAGE = Path(__file__).parents[1]
PARAMETER = re.compile(r"^[ \t]*(\w+)[ \t]*=[ \t]*([^,\n/]+?)[ \t]*,?[ \t]*(?://[ \t]*(.*))?$", re.MULTILINE)
GROUP = re.compile(r"^[ \t]*Physical \w+\(\"(\w+)\"", re.MULTILINE)


@dataclass(frozen=True)
class ReadyGeometry:
    """A geometry that comes with fenwear.

    Attributes:
        name: Of its file.
        about: Description of the geometry.
        parameters: Name, default (lengths in mm, angles in degrees) and meaning of each.
        groups: Names of its regions and surfaces, for any parameters: some of these may leave some of them out.
    """

    name: str
    about: str
    parameters: tuple[tuple[str, str, str], ...]
    groups: tuple[str, ...]

    @property
    def title(self) -> str:
        """The first words of what it is."""
        return re.split(r"[.:;](?: |$)", self.about)[0]

    def text(self) -> str:
        """Return the geometry in words, a line for each parameter."""
        lines = (f"    {name} = {value}   {meaning}".rstrip() for name, value, meaning in self.parameters)
        names = f"regions and surfaces: {', '.join(self.groups)}"
        return "\n".join((f"{self.name}: {self.about}", names, "geometry.parameters, in mm and degrees:", *lines))


def meshes_folder() -> Path:
    """Return the folder of the ready geometries, in an installed package or in a checkout."""
    installed = PACKAGE / "meshes"
    return installed if installed.is_dir() else PACKAGE.parent / "meshes"


def ready_geometries() -> dict[str, ReadyGeometry]:
    """Return the ready geometries by their names."""
    return {path.name: _read(path) for path in sorted(meshes_folder().glob("*.geo"))}


def _read(path: Path) -> ReadyGeometry:
    text = path.read_text("utf-8")
    about = " ".join(line.lstrip("/ ") for line in text.partition("\n//\n")[0].splitlines())
    block = re.search(r"DefineConstant\[(.*?)\];", text, re.DOTALL)
    parameters = tuple(PARAMETER.findall(block[1])) if block else ()
    return ReadyGeometry(path.name, about, parameters, tuple(dict.fromkeys(GROUP.findall(text))))


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
