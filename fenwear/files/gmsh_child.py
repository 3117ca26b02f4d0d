"""Reading of a file by gmsh in a process apart: gmsh ends the process on some broken files.

    python3 gmsh_child.py FILE RESULT.npz     # of a mesh: its arrays
    python3 gmsh_child.py FILE                # of shapes: only whether they can be read

It imports gmsh and numpy alone, and prints what gmsh says is wrong.
"""

import json
import sys
from typing import Any

import numpy as np


def main(path: str, result: str = "") -> None:
    """Read the file; write what it holds."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.AbortOnError", 2)
    if not result:
        gmsh.model.occ.importShapes(path, highestDimOnly=True)
        gmsh.model.occ.synchronize()
        return
    gmsh.merge(path)
    np.savez(result, **arrays_of(gmsh.model))


def arrays_of(model: Any) -> dict[str, Any]:
    """Return nodes, elements and physical groups of a model of gmsh as arrays."""
    tags, points, _ = model.mesh.getNodes()
    arrays: dict[str, Any] = {"tags": tags, "points": points}
    blocks: list[tuple[int, int, int, str]] = []
    for dim, tag in model.getEntities():
        for kind, labels, nodes in zip(*model.mesh.getElements(dim, tag), strict=True):
            arrays[f"labels{len(blocks)}"], arrays[f"nodes{len(blocks)}"] = labels, nodes
            blocks.append((dim, tag, int(kind), model.mesh.getElementProperties(kind)[0]))
    groups = [
        (
            dim,
            tag,
            model.getPhysicalName(dim, tag),
            [int(entity) for entity in model.getEntitiesForPhysicalGroup(dim, tag)],
        )
        for dim, tag in model.getPhysicalGroups()
    ]
    named = json.dumps({"blocks": blocks, "groups": groups})
    return {**arrays, "named": np.frombuffer(named.encode(), dtype=np.uint8)}


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:  # gmsh raises bare Exception only
        sys.exit(str(error) or "no reason given")
