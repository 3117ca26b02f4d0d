"""Files of other programs: meshes, shapes from CAD, measured tables and height maps, each read into arrays with names.

Readers are functions from a path to a data class. They know nothing of cases, bodies or solvers.
"""

from fenwear.files.formats import CAD, MESHES, is_foreign, read_mesh
from fenwear.files.mesh import Block, MeshFile, MeshSet

__all__ = ["CAD", "MESHES", "Block", "MeshFile", "MeshSet", "is_foreign", "read_mesh"]
