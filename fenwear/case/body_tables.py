"""The tables of the two bodies, in this order.

Both share `Geometry`, the contact `Grid` and `Model`. The parts of a body: `Support`, `Load` with its course over a
cycle, `Prescribed` temperatures, `Profile` and `Topography` of its surface. The `Body` itself comes last.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fenwear.case.material_tables import Creep
from fenwear.case.table_parts import (
    Axis,
    Check,
    Forces,
    Kind,
    Length,
    Moments,
    Number,
    OverCycle,
    Part,
    Point,
    Stresses,
    Temperature,
    Unit,
)
from fenwear.common.arrays import Array
from fenwear.common.units import convert, shown


def _parameter(value: object) -> float:
    """Convert a geometry parameter: a plain number, or a length with its unit."""
    try:
        return convert(value, "mm")
    except ValueError:
        raise ValueError(f"expected a number or a length such as '60 mm', got {shown(value)}") from None


class Geometry(Part):
    """Where the meshes come from: a gmsh .geo with its parameters, a mesh, or a shape from CAD."""

    file: str = Field(
        default="punch_on_strip.geo",
        description="geometry beside the case file, or a ready one: .geo or .msh of gmsh; a mesh of another program "
        "(.inp, .med, .unv, .cgns, .bdf, .exo, .vtu, .xdmf); a shape from CAD (.step, .iges, .brep)",
    )
    groups: dict[str, str | tuple[str, ...]] = Field(
        default={},
        description='names in the file of fenwear\'s groups: punch_contact = "Group_3", or a list of names; "face 3" '
        'of a shape from CAD; a plane "y = 0 mm" of a mesh; "" leaves a group out; case and spaces do not count',
    )
    unit: str | None = Field(
        default=None, description="unit of the lengths in a mesh of another program, or a .brep: mm (default), m, in"
    )
    size: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="size of the largest elements in a shape from CAD; by default a fifteenth of the smaller body",
    )
    sizes: dict[str, Annotated[Length, Field(gt=0)]] = Field(
        default={}, description='size of elements at groups of a shape from CAD: punch_contact = "0.2 mm"'
    )
    parameters: dict[str, Annotated[float, Unit("mm"), BeforeValidator(_parameter)]] = Field(
        default={}, description="values of parameters of the .geo, by their names"
    )
    degree: Annotated[int, Field(ge=1, le=8, strict=True)] = Field(
        default=4, description="polynomial degree of the elements, 1 to 8"
    )
    order: Annotated[int, Field(ge=1, le=2, strict=True)] = Field(
        default=1, description="order of the elements' shape from a .geo; 2 follows curved boundaries"
    )
    follow_wear: Annotated[
        Annotated[Number, Field(gt=0)] | None, BeforeValidator(lambda value: None if value == "never" else value)
    ] = Field(
        default=0.5,
        description="worn depth over the elements' height above which the mesh follows the worn surface, or never",
    )


class Grid(Part):
    """A regular grid of contact nodes in the tangent plane of the contact, whatever the meshes are there."""

    nodes: Annotated[int, Field(ge=5, le=2049, strict=True)] | None = Field(
        default=None, description="nodes along the longer side of a constant grid; by default 65"
    )
    across: Annotated[int, Field(ge=8, le=1024, strict=True)] | None = Field(
        default=None,
        description="in place of nodes: nodes along the longer side of the first contact, such as 64; the grid begins "
        "around it, grows with the scar up to size, and coarsens where there are twice as many",
    )
    size: Annotated[tuple[Annotated[Length, Field(gt=0)], ...], Field(min_length=1, max_length=2)] | None = Field(
        default=None,
        description="sides of the grid, [x] in the plane and [x, y] in solids; with across the largest sides; by "
        "default those of the contact, less a spacing at each end",
    )
    middle: Annotated[tuple[Length, ...], Field(min_length=1, max_length=2)] | None = Field(
        default=None, description="middle of the grid; by default that of the contact surface"
    )

    @model_validator(mode="before")
    @classmethod
    def _one_number(cls, data: object) -> object:
        if not isinstance(data, Mapping) or data.get("across") is None:
            return {"nodes": 65, **data} if isinstance(data, Mapping) else data
        if data.get("nodes") is not None:
            raise ValueError("across: expected either nodes, of a grid that stays, or across, of one that grows")
        return data


def _of_planes(key: str, default: object) -> Check:
    """Return the check of a key that only plane models have."""
    message = f"{key}: belongs to plane models, not with kind = '{{0.kind}}'"
    return Check(lambda model: model.kind != "plane" and getattr(model, key) != default, message)


class Model(Part):
    """Plane bodies in (x, z) with their thickness; rings in (x, z), x the radius; or solids in (x, y, z)."""

    kind: Literal["plane", "axisymmetric", "solid"] = Field(
        default="plane", description="plane bodies, rings, or solids"
    )
    plane: Literal["stress", "strain"] = Field(default="stress", description="plane stress or plane strain")
    thickness: Annotated[Length, Field(gt=0)] = Field(
        default=1.0, description="thickness of plane bodies, out of their plane"
    )

    checks = (_of_planes("plane", "stress"), _of_planes("thickness", 1.0))

    @property
    def law(self) -> Kind:
        """Plane stress, plane strain, axisymmetric or solid."""
        return self.plane if self.kind == "plane" else self.kind

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of vectors."""
        return ("x", "y", "z") if self.kind == "solid" else ("x", "z")


class Support(Part):
    """Displacement components held, at zero or at what is prescribed, on a named group or at a point."""

    on: str | None = Field(default=None, description="group of the geometry")
    at: Point | None = Field(
        default=None, description="in place of on: a point [x, z], in a solid [x, y, z], at a mesh node"
    )
    fix: Annotated[tuple[Axis, ...], Field(min_length=1)] = Field(description="components held at zero, or moved by")
    by: Annotated[tuple[Length, ...], Field(min_length=1)] | None = Field(
        default=None,
        description="displacement of each of these components, such as an approach in place of a load; by default zero",
    )

    one_of = (("on", "at"),)
    checks = (
        Check(
            lambda s: s.by and len(s.by) != len(s.fix),
            "by: expected a displacement for each of fix, {0.fix}, got {0.by}",
        ),
    )

    @property
    def moves(self) -> bool:
        """Whether it prescribes a displacement."""
        return any(self.by or ())


NOTHING = 1e-9  # of a load: what is called a factor still


class Load(Part):
    """A load over a named group: its resultant, or a traction; (x, z), in a solid (x, y, z); and a moment.

    It is spread evenly, or with a moment linearly: t = F / A + w x (x - c) with c the group's centroid.
    """

    on: str = Field(description="group of the geometry")
    force: Forces | None = Field(
        default=None, description="resultant force [x, z], in a solid [x, y, z], spread evenly"
    )
    traction: Stresses | None = Field(default=None, description="in place of force: the traction itself")
    through: Point | None = Field(
        default=None,
        description="point [x, z], in a solid [x, y, z], through which the force acts; by default the centroid",
    )
    moment: Moments | None = Field(
        default=None, description="additional moment, or the moment alone: [about y], in a solid [about x, y, z]"
    )
    over_cycle: OverCycle | None = Field(
        default=None,
        description="[fraction of the cycle, factor] pairs from 0 to 1: the load varies linearly between them",
    )

    checks = (
        Check(lambda s: len(s.present("force", "traction")) > 1, "give either force or traction"),
        Check(lambda s: not s.present("force", "traction", "moment"), "expected a force, a traction or a moment"),
        Check(
            lambda s: s.present("through") and not s.present("force"),
            "through: expected a force, which acts through this point",
        ),
        Check(
            lambda s: 0 < max((abs(factor) for _, factor in s.over_cycle or ()), default=0.0) < NOTHING,
            f"over_cycle: expected a factor of at least {NOTHING:g}, or none but zeros",
        ),
    )

    _of_table: bool = False  # of a motion that is a table

    @property
    def steady(self) -> bool:
        """Whether it is the same over the whole cycle."""
        return self.over_cycle is None

    def key(self, body: str, number: int) -> str:
        """Return its key in a case, as a load of this number of a body."""
        return "motion.load" if self._of_table else f"{body}.loads.{number}"

    def moment_problems(self, key: str, model: str) -> list[str]:
        """Return the problems of moments in a plane, an axisymmetric or a solid model."""
        if model == "axisymmetric":
            wrong = self.present("through", "moment")
            return [f"{key}.{name}: expected none in rings: what acts on them is the same all around" for name in wrong]
        size = {"plane": (1, "[about y]"), "solid": (3, "[about x, about y, about z]")}[model]
        if self.moment is None or len(self.moment) == size[0]:
            return []
        return [f"{key}.moment: expected {size[0]} component(s) {size[1]} in a {model} model, got {len(self.moment)}"]

    def times(self, factor: float) -> Load:
        """Return the load times a factor at every time."""
        return self._scaled(factor).model_copy(update={"over_cycle": self.over_cycle})

    def at(self, fraction: float) -> Load:
        """Return the load at this fraction of the cycle."""
        if self.over_cycle is None:
            return self
        return self._scaled(float(np.interp(fraction, *np.array(self.over_cycle).T)))

    def mean(self) -> Load:
        """Return the mean of the load over the cycle."""
        if self.over_cycle is None:
            return self
        fractions, factors = np.array(self.over_cycle).T
        return self._scaled(float(np.diff(fractions) @ (factors[1:] + factors[:-1]) / 2))

    def _scaled(self, factor: float) -> Load:
        scaled = {
            name: tuple(factor * component for component in getattr(self, name))
            for name in self.present("force", "traction", "moment")
        }
        return self.model_copy(update={**scaled, "over_cycle": None})


@dataclass(frozen=True)
class CourseLoad:
    """A force and a moment that change over a cycle by themselves, not in proportion: straight lines between rows.

    Attributes:
        on: Group of the geometry.
        through: Point that the force acts through; None for the centroid.
        fraction: Of the cycle, rising from 0 to 1 (k,).
        force: (k, d), N.
        moment: (k, 1), in a solid (k, 3), N mm.
        factor: Of both.
    """

    on: str
    through: tuple[float, ...] | None
    fraction: Array
    force: Array
    moment: Array
    factor: float = 1.0
    steady: ClassVar[bool] = False

    def times(self, factor: float) -> CourseLoad:
        """Return the load times a factor at every time."""
        return replace(self, factor=factor * self.factor)

    def at(self, fraction: float) -> Load:
        """Return the load at this fraction of the cycle."""
        loads = (self.force, self.moment)
        return self._load(*([np.interp(fraction, self.fraction, part) for part in given.T] for given in loads))

    def mean(self) -> Load:
        """Return the mean of the load over the cycle."""
        loads = (self.force, self.moment)
        return self._load(*(np.diff(self.fraction) @ (given[1:] + given[:-1]) / 2 for given in loads))

    def _load(self, *parts: Sequence[float] | Array) -> Load:
        force, moment = (tuple(self.factor * float(c) for c in part) for part in parts)
        load = Load.model_construct(
            on=self.on, force=force, traction=None, through=self.through, moment=moment, over_cycle=None
        )
        load._of_table = True
        return load


class Prescribed(Part):
    """A temperature held on a named group of the boundary."""

    on: str = Field(description="group of the geometry")
    temperature: Temperature = Field(default=0.0, description="held temperature theta")


class Profile(Part):
    """The depths by which the contact surface differs from the mesh, at places on it, linear in between."""

    points: Annotated[
        tuple[Annotated[tuple[Length, ...], Field(min_length=2, max_length=4)], ...], Field(min_length=2)
    ] = Field(
        description="[x, depth] of plane bodies and rings (x the radius), [x, y, depth] of solids; [s, depth] of "
        "curves with several places at one x, and [x, y, z, depth] of such surfaces of solids, as bores; "
        "positive where the surface lies deeper; in their place file = a CSV file with these columns and "
        "their units"
    )
    along: Literal["x", "arc"] = Field(
        default="x",
        description="meaning of the first number of points of a plane body: x, or the arc length s; s is x in the "
        "middle of the curve and grows with x there; the heading of a file states it",
    )


Positive = Annotated[Length, Field(gt=0)]


def _degree(value: object) -> object:
    """Return the degree of a polynomial that has a name."""
    return {"plane": 1, "mean": 0}.get(value, value) if isinstance(value, str) else value


class Topography(Part):
    """Heights of a surface above its shape: of a map in a file, self-affine, or wavy; on a contact grid alone."""

    file: str | None = Field(
        default=None,
        description="height map: .npz with height, x (and y) and the unit of all, .nc with them and a unit of each; "
        ".csv with columns x, (y,) height and their units; .sur, .plu, .al3d, .opd, .xyz, ... by "
        "SurfaceTopography, where it is installed",
    )
    holes: Literal["reject", "fill", "keep"] = Field(
        default="reject",
        description="points of a map without a number, fill values such as -9999 and spikes; fill: from their "
        "neighbours; keep: heights far beyond the others are real",
    )
    level: Annotated[int, BeforeValidator(_degree), Field(ge=0, le=8)] | None = Field(
        default=None,
        description="form to remove from a map: plane, or a polynomial of this degree; by default none",
    )
    rms: Positive | None = Field(default=None, description="Sq of a generated self-affine surface, mean zero")
    hurst: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.8, description="Hurst exponent H: the spectrum falls by q^-2(1+H)"
    )
    longest: Positive | None = Field(default=None, description="longest wave length of the roughness")
    shortest: Positive | None = Field(
        default=None, description="shortest wave length; by default 8 spacings of the grid"
    )
    seed: Annotated[int, Field(ge=0, strict=True)] = Field(
        default=0, description="seed of the phases: the same seed gives the same surface"
    )
    amplitude: Positive | None = Field(
        default=None, description="in place of rms: amplitude of a wave, half of peak to valley"
    )
    wavelength: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=2)] | None = Field(
        default=None, description="wave length along the grid, [x] or [x, y]; of two the product of both cosines"
    )
    height_factor: Number = Field(default=1.0, description="factor of all heights")

    one_of = (("file", "rms", "amplitude"),)
    together = (("rms", "longest"), ("amplitude", "wavelength"))
    checks = (
        Check(
            lambda s: s.present("shortest") and s.longest and s.shortest >= s.longest,
            "shortest: expected less than longest",
        ),
    )


AUTO = "auto"  # operator that the contact decides: "fine" on a grid of its own where that may be, else "condensed"
CONDENSED = "condensed"  # operator of a body whose mesh is eliminated down to its contact surface


class Body(Part):
    """One body: the material of each of its regions, its supports, loads and held temperatures."""

    regions: dict[str, str] = Field(default={}, description="name of the material of each region")
    supports: tuple[Support, ...] = Field(default=(), description="places where displacement is held")
    loads: tuple[Load, ...] = Field(default=(), description="forces on the body")
    temperatures: tuple[Prescribed, ...] = Field(default=(), description="places where temperature is held")
    insulated: tuple[str, ...] = Field(
        default=(), description="groups of the geometry without heat loss, such as a plane of symmetry"
    )
    pivot: Point | None = Field(
        default=None,
        description="the point O of lambda_F and lambda_M; by default the centre of the first support (for parts with "
        "point supports their own), or the origin",
    )
    no_turning_about: tuple[Axis, ...] = Field(
        default=(),
        description="axes about which guides hold the body against turning, by a couple, where supports leave it free",
    )
    operator: str = Field(
        default=AUTO,
        description="answer of the contact surface to forces: condensed: by the mesh; half-space: by a half-space or "
        "half-plane of its material, without supports and other boundaries, fast for many nodes; fine: by "
        "a half-space corrected by the mesh, on a grid finer than the mesh; auto: fine with the table "
        "grid where the contact is far enough from edges, else condensed; or an operator made in Python",
    )
    topography: Topography | None = Field(
        default=None, description="roughness or waves on top of its shape, measured or generated; needs the table grid"
    )
    creep: Creep | None = Field(
        default=None,
        description="growth of the compliance of the whole body under load, as of polymers; by default none",
    )
    profile: Profile | None = Field(
        default=None, description="difference of the contact surface from the mesh: a measured or machined shape"
    )

    @property
    def boundary_of_heat(self) -> tuple[object, ...]:
        """Its thermal boundary conditions."""
        return (self.temperatures, self.insulated)

    def materials_at(self, shares: Mapping[str, Array]) -> set[str]:
        """Return the names of the materials at nodes, of which regions have these shares (n,), by their names."""
        return {self.regions[name] for name, share in shares.items() if share.any()}
