"""The validated description of a problem: one typed object, from a TOML file or from Python.

Nothing here knows of meshes or solvers: properties of the geometry (whether a group exists, whether a pin is on the
punch) are checked where the geometry is read, and reported with the same keys.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from fenwear.case.body_names import Names, by_names
from fenwear.case.body_tables import Body, CourseLoad, Geometry, Grid, Load, Model
from fenwear.case.contact_table import Contact
from fenwear.case.exclusions import AGAINST_STICK, case_problems
from fenwear.case.heat_table import Heat, diffusion_of
from fenwear.case.material_tables import Material
from fenwear.case.motion_table import PLACES, Cycle, Motions, OneWay, Oscillation, Rotation
from fenwear.case.run_tables import Output, Program, Run, Setup
from fenwear.case.table_parts import Part
from fenwear.case.wear_table import Dependence, Stick, Wear, depends_on

NEAR = 2.0  # ratio of diffusion lengths below which a variant keeps the mesh of its base
OFFSET = re.compile(r"deg(?:ree)?s?_?(?:C|F|c|f)|celsius|fahrenheit|°\s*[CF]", re.IGNORECASE)


@dataclass(frozen=True)
class Written:
    """Quantities of a case as they were written; no part of what the case is, so that all compare as equal.

    Attributes:
        bare: Keys of those that were numbers without a unit.
        united: Quantities with a unit, as they were written.
    """

    bare: frozenset[str] = field(default=frozenset(), compare=False)
    united: Mapping[str, str] = field(default_factory=dict, compare=False)


MADE = "made in Python"  # geometry.file of a case whose meshes are given


@dataclass(frozen=True)
class Given:
    """Meshes and stresses that a program in Python gives to a case, by the bodies' roles.

    Attributes:
        meshes: A `BodyMesh` of punch and strip; none where the case has a geometry.
        stresses: An `ElasticLaw` in place of the isotropic one, of either.
    """

    meshes: Mapping[str, Any] = field(default_factory=dict)
    stresses: Mapping[str, Any] = field(default_factory=dict)


NOTHING_GIVEN = Given()


class Case(Part):
    """A problem: the root of the case file."""

    title: str = Field(default="", description="title in the results")
    geometry: Geometry = Field(default=Geometry(), description="the meshes")
    model: Model = Field(default=Model(), description="kind and thickness of the model")
    materials: Annotated[dict[str, Material], Field(min_length=1)] = Field(description="materials by their names")
    punch: Body = Field(description="the body above, body 1")
    strip: Body = Field(description="the body below, which slides, body 2")
    grid: Grid | None = Field(default=None, description="contact grid, finer than the mesh")
    contact: Contact = Field(default=Contact(), description="contact between the two bodies")
    stick: Stick = Field(default=Stick(), description="contact with stick: load of the rig, time steps")
    wear: Wear = Field(description="wear of punch, strip or both")
    motion: Annotated[Motions, Field(discriminator="kind")] = Field(description="motion of the strip under the punch")
    heat: Heat | None = Field(default=None, description="heat; without this table there is no temperature")
    program: Program | None = Field(default=None, description="course of loads, motion and ambient temperature")
    setup: Setup = Field(
        default=Setup(), description="condensation of the bodies, and division of this work among ranks"
    )
    run: Run = Field(description="length and method of the run")
    output: Output = Field(default=Output(), description="results to keep")

    def __repr__(self) -> str:
        """Say in a line what it is; `to_toml` has all of it."""
        return f"<Case {self.title!r}: {self.model.kind}, {self.motion.kind}, {self.run.half_cycles} half-cycles>"

    __str__ = __repr__

    _folder: Path | None = None  # where the case file lies: its geometry's paths start there
    _written: Written = Written()
    _given: Given = NOTHING_GIVEN
    _diffusion: dict[str, float] | None = None  # of a stage: that of its program

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        if problems := case_problems(self):
            raise ValueError("\n".join(problems))
        return self

    def loads_of(self, body: str) -> tuple[Load | CourseLoad, ...]:
        """Return all loads of a body, "punch" or "strip": its own, and on the punch that of the cycle's table."""
        loads: tuple[Load | CourseLoad, ...] = getattr(self, body).loads
        course = self.course_load if body == "punch" else None
        return loads if course is None else (*loads, course)

    @property
    def loading(self) -> tuple[Any, ...]:
        """Sources of its loads: equal of cases with the same loads."""
        return self.punch.loads, self.strip.loads, self.motion if isinstance(self.motion, Cycle) else None

    @property
    def course_load(self) -> CourseLoad | None:
        """The load of the cycle's table on the punch; None without."""
        return self.motion.course_load(self.model.axes) if isinstance(self.motion, Cycle) else None

    @property
    def names(self) -> Names:
        """Names of the bodies."""
        return Names.of({"contact": {"between": self.contact.between, "slides": self.contact.slides}})

    @property
    def bodies(self) -> dict[str, Body]:
        """Both bodies by their roles."""
        return {"punch": self.punch, "strip": self.strip}

    @property
    def used_materials(self) -> set[str]:
        """The names of the materials of all regions."""
        return {name for body in self.bodies.values() for name in body.regions.values()}

    @property
    def in_degrees(self) -> bool:
        """Whether a temperature of it was written in degrees, not in kelvin."""
        return self.heat is not None and any(OFFSET.search(text) for text in self.written.united.values())

    @property
    def initial_temperature(self) -> float:
        """At the start, K; 0 without heat."""
        return self.heat.initial if self.heat else 0.0

    @property
    def initial_materials(self) -> dict[str, Material]:
        """The materials as they are at the initial temperature, with constants."""
        return {
            name: material.at(self.initial_temperature, f"materials.{name}")
            for name, material in self.materials.items()
        }

    @property
    def warming(self) -> bool:
        """Whether a property of a material that is used depends on the temperature."""
        used = self.used_materials
        return any(self.materials[name].dependent for name in used)

    @property
    def turns(self) -> bool:
        """Whether the strip turns, so that speeds are rad/s."""
        return isinstance(self.motion, Oscillation | Rotation)

    @property
    def passes(self) -> bool:
        """Whether the sliding takes the strip's material past the punch within the model, not out of its plane."""
        if self.model.kind != "plane":
            return self.model.kind == "solid"
        if isinstance(self.motion, Cycle):
            return any(not name.endswith("shift_y") for name in self.motion.column_names if name in PLACES)
        return self.motion.axis != "y"

    @property
    def debris_on_strip(self) -> bool:
        """Whether debris lies on the strip."""
        third = self.contact.third_body
        return third is not None and self.names.role_of(third.carried_by) == "strip"

    @property
    def strip_changes(self) -> bool:
        """Whether something of the strip's material changes as it passes: it wears, or carries debris."""
        return self.wear.strip is not None or self.debris_on_strip

    @property
    def strip_varies(self) -> bool:
        """Whether it matters which part of the strip is below the punch: it changes, or its surface is uneven."""
        return self.strip_changes or self.strip.profile is not None or self.strip.topography is not None

    @property
    def diffusion(self) -> dict[str, float]:
        """Length by which ready geometries grade the strip (`diffusion_of`): equal in all stages of a program."""
        if self._diffusion is not None:
            return self._diffusion
        if not self.heat or not self.passes or not isinstance(self.motion, OneWay | Rotation):
            return {}
        regions = [self.initial_materials[name] for name in self.strip.regions.values()]
        return diffusion_of(self.motion, self.program.steps if self.program else (), regions)

    def graded_as(self, other: Case) -> Case:
        """Return the case with the grading of another one's strip, if they differ by less than `NEAR`."""
        grading, others = self.diffusion, other.diffusion
        if grading.keys() != others.keys() or any(not 1 / NEAR < grading[key] / others[key] < NEAR for key in grading):
            return self
        near = self.model_copy()
        near._diffusion = others
        return near

    def stage(self, changes: Mapping[str, Any]) -> Case:
        """Return the case with the motion and heat of a stage of its program, whose stages have the same meshes."""
        at = self.model_copy(update=changes)
        at._diffusion = self.diffusion
        return at

    @property
    def sticks(self) -> bool:
        """Whether the contact is one with stick, without a look at the bodies."""
        return self.contact.law == "coulomb" or (self.contact.law == "auto" and self.stick != Stick())

    @property
    def leaves_positions(self) -> bool:
        """Whether it leaves open in how many positions of a half-cycle the strip passes under the punch."""
        return getattr(self.motion, "positions", 0) is None

    @property
    def against_stick(self) -> list[str]:
        """Problems of contact with stick: a key and what it expects, each."""
        return [check.message.format(self) for check in AGAINST_STICK if check.wrong(self)]

    @property
    def coefficients(self) -> dict[str, Any]:
        """The coefficients that may depend on the state, by their keys."""
        contact = self.contact
        coefficients: dict[str, Any] = {"contact.friction": contact.friction}
        if contact.lubrication:
            coefficients[f"contact.lubrication.{contact.lubrication.key}"] = contact.lubrication.coefficient
        if contact.third_body:
            coefficients["contact.third_body.life"] = contact.third_body.life
        wear = self.wear.by_body.items()
        coefficients |= {f"wear.{body}.{law.coefficient_key}": law.given_coefficient for body, law in wear}
        return coefficients | {f"wear.{body}.film.growth": law.film.growth for body, law in wear if law.film}

    @property
    def passing_laws(self) -> list[str]:
        """Keys of coefficients that change throughout a run: with the worn depth, or with what is slid."""
        return [key for key, value in self.coefficients.items() if depends_on(value, "depth", "s")]

    @property
    def varies(self) -> bool:
        """Whether a coefficient depends on the state, or a load on the time in the cycle."""
        laws = [law.given_coefficient for law in self.wear.laws]
        mixed = self.contact.lubrication is not None and self.contact.lubrication.varies
        dependent = mixed or any(isinstance(value, Dependence) for value in (self.contact.friction, *laws))
        return dependent or not all(load.steady for body in ("punch", "strip") for load in self.loads_of(body))

    @property
    def folder(self) -> Path | None:
        """The folder of the case file, None for a built-in case or one made in Python."""
        return self._folder

    @property
    def written(self) -> Written:
        """Its quantities as they were written; nothing is known of those of a case made from its parts."""
        return self._written

    @property
    def given(self) -> Given:
        """The meshes and stresses that a program has given it."""
        return self._given

    def on(self, given: Given) -> Case:
        """Return this case on meshes that a program gives."""
        placed = self.model_copy()
        placed._given = given
        return placed

    def at(self, folder: Path | None, written: Written | None = None) -> Case:
        """Return this case with the folder that its geometry's path starts from, and how it was written."""
        placed = self.model_copy()
        placed._folder = folder
        placed._written = written or self._written
        return placed

    def resolved(self) -> dict[str, Any]:
        """Return every key with its value and unit, in the names of the bodies: what case.toml holds."""
        return by_names(self.tables_by_roles(), self.names)

    def tables_by_roles(self) -> dict[str, Any]:
        """Return every key with its value and unit, by the bodies' roles."""
        data = self.model_dump(mode="json", exclude_none=True)
        if self._folder is not None and (self._folder / self.geometry.file).is_file():
            data["geometry"]["file"] = str((self._folder / self.geometry.file).resolve())  # wherever it is read next
        for body, heights in (("punch", self.punch.topography), ("strip", self.strip.topography)):
            if self._folder is not None and heights is not None and heights.file is not None:
                data[body]["topography"]["file"] = str((self._folder / heights.file).resolve())
        for body, law in self.wear.by_body.items():
            data["wear"][body] = law.resolved(data["wear"][body])
        if self.geometry.follow_wear is None:
            data["geometry"]["follow_wear"] = "never"
        return data

    def to_toml(self) -> str:
        """Return the resolved case as a case file that reads back as the same case, without keys that say nothing."""
        import tomli_w

        data = self.resolved()
        if self.model.kind != "plane":  # these are of plane models alone
            del data["model"]["plane"], data["model"]["thickness"]
            if self.heat is not None and self.heat.convecting_faces:
                del data["heat"]["convecting_faces"]
            if data["motion"].get("along") is not None:
                del data["motion"]["axis"]
        if not self.sticks:
            del data["stick"]
        return tomli_w.dumps(data)


def part_models(annotation: Any) -> list[Any]:
    """Return the case models inside a type such as dict[str, Material] or tuple[Load, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return [annotation]
    return [m for argument in getattr(annotation, "__args__", ()) for m in part_models(argument)]
