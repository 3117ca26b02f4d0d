"""What the size of the bodies says of the unit of their mesh, which is read in mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fenwear.assembly import Bodies
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Case, Reciprocating, Tabulated
from fenwear.case.program import cycle_of
from fenwear.interface import RigidEquilibrium

UNITS = {"m": 1e3, "µm": 1e-3}
CLEARLY = 1.0  # decades outside what is usual, and by which another unit makes it better


@dataclass(frozen=True)
class Measure:
    """A number that a change of the mesh's unit changes.

    Attributes:
        value: With the mesh in mm.
        power: Of the unit of length that it goes with.
        low, high: Ends of what is usual, wide.
        text: What it is, in words.
    """

    value: float
    power: int
    low: float
    high: float
    text: str

    def outside(self, factor: float = 1.0) -> float:
        """Return by how many decades it is outside what is usual, with a mesh times a factor."""
        value = max(self.value * factor**self.power, 1e-300)
        return max(0.0, float(np.log10(self.low / value)), float(np.log10(value / self.high)))


def size_warnings(case: Case, bodies: Bodies, rigid: RigidEquilibrium) -> list[str]:
    """Return what is to be said of bodies whose mesh is hardly in mm; collective.

    Size, load, stroke and thickness are held against each other: the mesh is doubted where they are far from what is
    usual, and in another unit are not.
    """
    measures = _measures(case, bodies, rigid)
    as_read = sum(measure.outside() for measure in measures)
    others = {unit: sum(m.outside(factor) for m in measures) for unit, factor in UNITS.items()}
    unit = min(others, key=lambda name: others[name])
    if as_read - others[unit] < CLEARLY:
        return []
    told = ", ".join(measure.text for measure in measures if measure.outside() > 0)
    return [
        f"geometry.file: a mesh is read in mm, and this one may be in {unit}: {told}. Expected lengths in mm; in a "
        f".geo Mesh.ScalingFactor = {UNITS[unit]:g}; makes them so"
    ]


def _measures(case: Case, bodies: Bodies, rigid: RigidEquilibrium) -> list[Measure]:
    """Return what is told by the smaller body, and by the load on the whole contact surface."""
    sizes = {"punch": _size(bodies.punch), "strip": _size(bodies.strip)}
    body = min(sizes, key=lambda name: sizes[name])
    size = sizes[body]
    found = [Measure(size, 1, 0.3, 5e3, f"the {body} is {size:.3g} mm in all")]
    if case.model.kind == "plane":
        thickness = case.model.thickness
        found.append(Measure(size / thickness, 1, 0.05, 500, f"model.thickness is {thickness:.3g} mm"))
    if isinstance(case.motion, Reciprocating | Tabulated):
        _, distance, half_cycles = cycle_of(case)
        stroke = distance / half_cycles
        found.append(Measure(size / stroke, 1, 0.05, 1e4, f"the stroke is {stroke:.3g} mm"))
    if rigid.translations:
        used = case.used_materials
        strain = rigid.mean_pressure / min(case.initial_materials[name].young for name in used)
        text = f"the load presses with {rigid.mean_pressure:,.3g} MPa on the whole surface"
        found.append(Measure(strain, -1 if case.model.kind == "plane" else -2, 1e-9, 0.05, text))
    return found


def _size(elastic: ElasticBody) -> float:
    """Return the longest side of the box around a body, mm; collective."""
    mesh = elastic.body.mesh
    x = mesh.geometry.x
    low, high = (x.min(axis=0), x.max(axis=0)) if len(x) else (np.full(3, np.inf), np.full(3, -np.inf))
    ends = np.array(mesh.comm.allgather((low, high)))
    return float((ends[:, 1].max(axis=0) - ends[:, 0].min(axis=0)).max())
