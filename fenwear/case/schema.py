"""The validated description of a problem: one typed object, from a TOML file or from Python.

Nothing here knows of meshes or solvers: what only the geometry can tell (whether a group exists, whether a pin is on
the punch) is checked where the geometry is read, and reported with the same keys.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from fenwear.case.bodies import AUTO, CONDENSED, Body, CourseLoad, Geometry, Grid, Load, Model
from fenwear.case.contact import Contact
from fenwear.case.course import Output, Program, Run
from fenwear.case.creep import creep_problems
from fenwear.case.cycle_table import PLACES
from fenwear.case.diffusion import diffusion_of
from fenwear.case.laws import Dependence, Stick, Wear
from fenwear.case.materials import Material
from fenwear.case.motions import Cycle, Motions, OneWay, Oscillation, Rotation
from fenwear.case.names import ROLES, Names, renamed
from fenwear.case.quantities import Part
from fenwear.case.setup import Setup
from fenwear.case.thermal import Heat

OFFSET = re.compile(r"deg(?:ree)?s?_?(?:C|F|c|f)|celsius|fahrenheit|°\s*[CF]", re.IGNORECASE)


@dataclass(frozen=True)
class Written:
    """How the quantities of a case were written; no part of what the case is, so that all compare as equal.

    Attributes:
        bare: Keys of those that were numbers without a unit.
        united: Those with a unit, as they were written.
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

    title: str = Field(default="", description="shown with the results")
    geometry: Geometry = Field(default=Geometry(), description="the meshes")
    model: Model = Field(default=Model(), description="of the plane")
    materials: Annotated[dict[str, Material], Field(min_length=1)] = Field(description="by their names")
    punch: Body = Field(description="the body above, body 1")
    strip: Body = Field(description="the body below, which slides, body 2")
    grid: Grid | None = Field(default=None, description="contact nodes of its own, finer than the mesh")
    contact: Contact = Field(default=Contact(), description="between the two")
    stick: Stick = Field(default=Stick(), description="of contact with stick: what the rig imposes, time steps")
    wear: Wear = Field(description="of punch, strip or both")
    motion: Annotated[Motions, Field(discriminator="kind")] = Field(description="of the strip under the punch")
    heat: Heat | None = Field(default=None, description="without this table there is no temperature")
    program: Program | None = Field(default=None, description="loads, motion and ambient temperature that change")
    setup: Setup = Field(default=Setup(), description="how the bodies are condensed, and by which ranks")
    run: Run = Field(description="how far, and how")
    output: Output = Field(default=Output(), description="what is kept")

    def __repr__(self) -> str:
        """Say in a line what it is; `to_toml` has all of it."""
        return f"<Case {self.title!r}: {self.model.kind}, {self.motion.kind}, {self.run.half_cycles} half-cycles>"

    __str__ = __repr__

    _folder: Path | None = None  # where the case file lies: its geometry's paths start there
    _written: Written = Written()
    _given: Given = NOTHING_GIVEN
    _diffusion: dict[str, float] | None = None  # of a stage: that of its program

    @model_validator(mode="before")
    @classmethod
    def _groups_by_role(cls, data: Any) -> Any:
        """Return the tables with groups of the geometry by the bodies' roles; see `names`."""
        if not isinstance(data, Mapping):
            return data
        names = Names.of(data)
        return renamed(data, names.by_role) if names.given and not names.problems else data

    @model_validator(mode="after")
    def _materials_known(self) -> Self:
        problems = [*self.names.problems]
        problems += [
            f"{body}.regions.{region}: no material {name!r}; known are {', '.join(sorted(self.materials))}"
            for body, part in self.bodies.items()
            for region, name in part.regions.items()
            if name not in self.materials
        ]
        if self.model.law != "stress":
            where = {"strain": "in plane strain", "axisymmetric": "in rings", "solid": "in solids"}[self.model.law]
            problems += [
                f"materials.{name}.poisson: expected less than 0.5 {where}, got {material.poisson:g}"
                for name, material in self.materials.items()
                if material.poisson >= 0.5
            ]
        if self.heat is not None:
            problems += self._thermal_problems(self.heat)
        problems += self.setup.problems(None if self.heat is None else self.heat.operator)
        problems += [*self._kind_problems(), *self._sliding_problems(), *self._operator_problems()]
        problems += [*self._program_problems(), *self._stick_problems()]
        problems += [f"{body}.regions: missing, but required" for body, part in self.bodies.items() if not part.regions]
        held = [*self.punch.supports, *self.strip.supports]
        pressed = self.punch.loads or self.strip.loads or self._course_load is not None
        if not pressed and not any(one.moves for one in held):
            problems.append(
                "punch.loads: expected at least one load that presses the punch on the strip, of either body, or a "
                "support moved `by`"
            )
        if problems:
            raise ValueError(self.names.told("\n".join(problems)))
        return self

    def _operator_problems(self) -> list[str]:
        """Return what does not go with bodies whose meshes are not what answers to forces."""
        others = [name for name, body in self.bodies.items() if body.operator not in (AUTO, CONDENSED)]
        against = {
            "with heat: a contact finer than the meshes warms a layer as thin as its own nodes are wide, whose "
            "temperatures and expansion the meshes do not have": self.heat is not None,
        }
        bare = [name for name in ("punch", "strip") if getattr(self, name).topography is not None and self.grid is None]
        lacking = [
            f"grid: missing, but required with {name}.topography: the nodes that have its heights" for name in bare
        ]
        grid = lacking + [f"grid: expected none {why}" for why, so in against.items() if so and self.grid is not None]
        grid += self._growing_problems()
        return grid + [
            f"{name}.operator: expected '{CONDENSED}' {why}" for name in others for why, so in against.items() if so
        ]

    def _growing_problems(self) -> list[str]:
        """Return what does not go with a contact grid that grows."""
        if self.grid is None or self.grid.across is None:
            return []
        meshed = [name for name, body in self.bodies.items() if body.operator == CONDENSED]
        rough = [name for name, body in self.bodies.items() if body.topography is not None]
        against = {
            f"with {' and '.join(f'{name}.operator' for name in meshed)} = '{CONDENSED}', one solution for each node; "
            "or 'fine'": bool(meshed),
            f"with {' and '.join(f'{name}.topography' for name in rough)}, which a coarser grid would lose": bool(
                rough
            ),
        }
        return [f"grid.across: expected grid.nodes, of a grid that stays, {why}" for why, so in against.items() if so]

    def _kind_problems(self) -> list[str]:
        """Return what does not go with a plane, an axisymmetric or a solid model."""
        kind, axes, motion = self.model.kind, self.model.axes, self.motion
        names, problems = " or ".join(f"'{axis}'" for axis in axes), []
        for body, part in self.bodies.items():
            vectors: dict[str, tuple[float, ...] | None] = {f"{body}.pivot": part.pivot}
            for number, support in enumerate(part.supports):
                vectors[f"{body}.supports.{number}.at"] = support.at
                problems += [
                    f"{body}.supports.{number}.fix.{place}: expected {names} in a {kind} model, got '{axis}'"
                    for place, axis in enumerate(support.fix)
                    if axis not in axes
                ]
            for number, load in enumerate(part.loads):
                vectors[f"{body}.loads.{number}.force"] = load.force
                vectors[f"{body}.loads.{number}.traction"] = load.traction
                vectors[f"{body}.loads.{number}.through"] = load.through
                problems += load.moment_problems(f"{body}.loads.{number}", kind)
            problems += [
                f"{key}: expected {len(axes)} components ({', '.join(axes)}) in a {kind} model, got {len(vector)}"
                for key, vector in vectors.items()
                if vector is not None and len(vector) != len(axes)
            ]
        if isinstance(motion, Oscillation | Rotation):
            if kind == "plane" and (motion.axis[0] or motion.axis[2] or not motion.axis[1]):
                problems.append("motion.axis: expected [0, 1, 0], out of the plane, in a plane model")
            if kind == "axisymmetric" and (any(motion.axis[:2]) or any(motion.centre[:2])):
                problems.append("motion.axis: expected the axis z of the rings, through x = y = 0")
        elif isinstance(motion, Cycle):
            problems += self._cycle_problems(motion)
        elif kind == "axisymmetric":
            problems.append("motion.kind: expected rotation or oscillation, or a cycle, in an axisymmetric model")
        elif kind == "plane" and motion.along is not None:
            problems.append("motion.along: belongs to solids; a plane model has axis = 'x' or 'y'")
        return problems

    def _cycle_problems(self, motion: Cycle) -> list[str]:
        """Return what of a cycle's table does not go with the model, or with heat and other solvers."""
        problems = motion.model_problems(self.model.kind, self.model.axes)
        if self.heat is not None and self.model.kind == "plane" and self.passes:
            leaving = [name for name in motion.column_names if name.endswith("shift_y")]
            why = "with heat: what moves along x as well takes heat out of a plane model"
            problems += [f"motion.columns: expected no column {name} {why}" for name in leaving]
        if motion.course.rests and not self.sticks:
            problems.append("motion.columns: expected a motion: the strip stays in its place in all rows")
        return problems

    def loads_of(self, body: str) -> tuple[Load | CourseLoad, ...]:
        """Return all loads of a body, "punch" or "strip": its own, and on the punch that of the cycle's table."""
        own: tuple[Load | CourseLoad, ...] = getattr(self, body).loads
        course = self._course_load if body == "punch" else None
        return own if course is None else (*own, course)

    @property
    def loading(self) -> tuple[Any, ...]:
        """What its loads come from: equal of cases with the same loads."""
        return self.punch.loads, self.strip.loads, self.motion if isinstance(self.motion, Cycle) else None

    @property
    def _course_load(self) -> CourseLoad | None:
        return self.motion.course_load(self.model.axes) if isinstance(self.motion, Cycle) else None

    @property
    def names(self) -> Names:
        """What the bodies are called."""
        return Names(self.punch.name or "punch", self.strip.name or "strip")

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
    def initial_materials(self) -> dict[str, Material]:
        """The materials as they are at the initial temperature, with constants."""
        start = 0.0 if self.heat is None else self.heat.initial
        return {name: material.at(start, f"materials.{name}") for name, material in self.materials.items()}

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
        """What ready geometries grade the strip by, see `diffusion_of`: the same for all stages of a program."""
        if self._diffusion is not None:
            return self._diffusion
        motion = self.motion
        if self.heat is None or not self.passes or not isinstance(motion, OneWay | Rotation):
            return {}
        materials = self.initial_materials
        regions = [materials[region] for region in self.strip.regions.values()]
        return diffusion_of(motion, () if self.program is None else self.program.steps, regions)

    def stage(self, changes: Mapping[str, Any]) -> Case:
        """Return the case with the motion and heat of a stage of its program, whose stages have the same meshes."""
        at = self.model_copy(update=changes)
        at._diffusion = self.diffusion
        return at

    def _sliding_problems(self) -> list[str]:
        problems = []
        motion, one_way = self.motion, isinstance(self.motion, OneWay | Rotation)
        least = 1 if one_way else 2
        if self.run.integration == "jump" and self.run.half_cycles < least:
            problems.append("run.half_cycles: expected at least one whole cycle for cycle jumps")
        if self.strip_changes and self.passes and not self.sticks:
            problems += self._track_problems()
        passes_on = one_way and self.passes
        problems += creep_problems(self.bodies, self.contact.layer, passes_on=passes_on)
        several = not isinstance(motion, OneWay | Rotation | Cycle) and (motion.positions or 1) > 1
        if not self.passes and (several or (isinstance(motion, Cycle) and motion.positions == "steps")):
            problems.append("motion.positions: expected 1 for sliding out of the plane")
        if self.heat is None:
            given: dict[str, Any] = {"contact.friction": self.contact.friction}
            if self.contact.lubrication is not None:
                key, value = self.contact.lubrication.given
                given[f"contact.lubrication.{key}"] = value
            given["contact.third_body.life"] = getattr(self.contact.third_body, "life", None)
            for body, law in self.wear.by_body.items():
                if law is not None:
                    given[f"wear.{body}.{law.coefficient_key}"] = law.given_coefficient
            problems += [
                f"{key}: depends on the temperature T, which a case without the table heat does not know"
                for key, value in given.items()
                if isinstance(value, Dependence) and value.law is None and value.depends_on("T")
            ]
            problems += [
                f"materials.{name}.{key}: depends on the temperature T, which a case without the table heat does not "
                "know"
                for name, material in self.materials.items()
                for key in material.dependent
            ]
        problems += self._debris_problems() + self._body_problems() + self._region_problems()
        friction = self.contact.friction
        for body, law in self.wear.by_body.items():
            if law is not None and (law.beta, law.energy) != (None, None) and friction == 0:
                problems.append(f"wear.{body}: expected friction where beta or energy gives the coefficient")
        return problems

    def _body_problems(self) -> list[str]:
        """Return what is wrong with the bodies that carry debris and set the temperature of friction."""
        third, names, contact = self.contact.third_body, self.names, self.contact
        given: list[tuple[str, str, tuple[str, ...]]] = [
            ("friction_temperature", contact.friction_temperature, ("mean", "hotter"))
        ]
        if third is not None:
            given.append(("third_body.carried_by", third.carried_by, ()))
        return [
            f"contact.{key}: expected {' or '.join(map(repr, (*others, *names.by_roles.values())))}, got {name!r}"
            for key, name, others in given
            if names.role_of(name) not in (*others, *ROLES)
        ]

    def _debris_problems(self) -> list[str]:
        """Return which coefficients ask for the thickness of debris where there is none."""
        if self.contact.third_body is not None:
            return []
        felt: dict[str, Any] = {"contact.friction": self.contact.friction}
        pairs = self.wear.by_body.items()
        felt |= {f"wear.{body}.{law.coefficient_key}": law.given_coefficient for body, law in pairs if law}
        return [
            f"{key}: depends on the thickness of debris, which a case without contact.third_body does not know"
            for key, value in felt.items()
            if isinstance(value, Dependence) and value.depends_on("debris")
        ]

    def _region_problems(self) -> list[str]:
        """Return what is wrong with coefficients that are given by regions."""
        given = {"contact.friction": (self.contact.friction, self.punch)}
        for name, law, body in (("punch", self.wear.punch, self.punch), ("strip", self.wear.strip, self.strip)):
            if law is not None:
                given[f"wear.{name}.{law.coefficient_key}"] = (law.given_coefficient, body)
        problems = []
        for key, (value, body) in given.items():
            if not isinstance(value, Dependence) or value.regions is None:
                continue
            known = ", ".join(body.regions)
            problems += [
                f"{key}.regions.{r}: no such region; known are {known}" for r in value.regions.keys() - body.regions
            ]
            problems += [f"{key}.regions.{r}: missing, but required" for r in body.regions.keys() - value.regions]
        return problems

    def _program_problems(self) -> list[str]:
        """Return what of a program does not go with the motion and the heat."""
        if self.program is None:
            return []
        motion, problems = self.motion, []
        groups = sorted({load.on for body in self.bodies.values() for load in body.loads})
        for number, step in enumerate(self.program.steps):
            at = f"program.steps.{number}"
            problems += [
                f"{at}.load_factors.{name}: no load of the case acts on it, but on {', '.join(groups) or 'none'}"
                for name in step.load_factors or {}
                if name not in groups
            ]
            for key in ("speed", "angular_speed", "amplitude", "angular_frequency", "period"):
                known = key in type(motion).model_fields and not (key == "amplitude" and self.turns)
                known = known and not isinstance(motion, Cycle)
                if getattr(step, key) is not None and not known:
                    problems.append(f"{at}.{key}: does not change with motion.kind = '{motion.kind}'")
            if step.distance is not None and isinstance(motion, Cycle):
                problems.append(f"{at}.distance: expected cycles or time: nodes slide different ways in a cycle")
            if step.motion is not None:
                problems += self._other_cycle_problems(step.motion, at)
            if step.ambient is not None and self.heat is None:
                problems.append(f"{at}.ambient: expected a case with the table heat")
        told = self.program.radius is not None
        if told and not self.turns:
            problems.append(f"program.radius: does not go with motion.kind = '{motion.kind}', which does not turn")
        if not told and self.turns and any(step.distance is not None for step in self.program.steps):
            problems.append(
                "program.radius: missing, but required where the strip turns and a step has a distance: the radius at "
                "which it is slid, such as that of the middle of the wear track"
            )
        if any(step.load for step in self.program.steps) and any(step.load_factors for step in self.program.steps):
            problems.append(
                "program.steps: load is the sum of the case's loads; expected load_factor with load_factors"
            )
        ramps = self.program.steps[-1].ramps
        if self.run.periodic_within is not None and ramps:
            at = f"program.steps.{len(self.program.steps) - 1}.{ramps[0]}"
            problems.append(
                f"run.periodic_within: expected a last step of the program that stays as it is: cycles do not repeat "
                f"while {at} goes from one value to another"
            )
        return problems

    def _other_cycle_problems(self, motion: Cycle, at: str) -> list[str]:
        """Return what of another table in a step of a program does not go."""
        if not isinstance(self.motion, Cycle):
            return [f"{at}.motion: does not change with motion.kind = '{self.motion.kind}': expected 'cycle'"]
        told = motion.model_problems(self.model.kind, self.model.axes)
        problems = [f"{at}.{problem}" for problem in told]
        laws = [self.contact.friction, *(law.given_coefficient for law in self.wear.laws)]
        if any(isinstance(law, Dependence) and law.depends_on("s") for law in laws):
            problems.append(f"{at}.motion: expected no coefficient that depends on s: cycles slide different ways")
        return problems

    def _track_problems(self) -> list[str]:
        """Return what does not go with wear of a strip that passes under the punch."""
        motion = self.motion
        if isinstance(motion, OneWay) and motion.track is None:
            return ["motion.track: missing, but required where the strip wears in one-way sliding"]
        if not isinstance(motion, OneWay | Rotation | Cycle) and motion.positions == 1:
            return ["motion.positions: expected 2 or more, since the strip's wear spreads over the stroke"]
        if isinstance(motion, Cycle) and motion.positions == "middle":
            return ["motion.positions: expected 'steps', since the strip's wear goes with its material"]
        return []

    def _stick_problems(self) -> list[str]:
        """Return what does not go with contact with stick, where the case has that."""
        if self.contact.law == "gross-sliding":
            return [] if self.stick == Stick() else ["stick: expected with contact.law = 'coulomb' only"]
        return [f"{problem} with contact.law = 'coulomb'" for problem in self.against_stick] if self.sticks else []

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
        """What does not go with contact with stick: a key and what it expects, each."""
        table = isinstance(self.motion, Cycle)
        columns = self.motion.column_names if isinstance(self.motion, Cycle) else ()
        wrong = {
            "contact.transverse_friction: expected 0, friction being against the slip that is found,": (
                self.contact.transverse_friction != 0
            ),
            "model.kind: expected a plane model or a solid, such as fretting-sphere with motion.kind = 'oscillation': "
            "rings slide around their axis, where displacements in (r, z) do not give way, so that nothing sticks": (
                self.model.kind == "axisymmetric"
            ),
            "heat.operator: expected 'reduced', whose heat each time step has as a matrix of its tractions,": (
                self.heat is not None and self.heat.operator == "full"
            ),
            "heat.coupling: expected 'implicit', each time step being found together with its heat,": (
                self.heat is not None and self.heat.coupling == "split"
            ),
            "motion.kind: expected a motion to and fro, or a cycle,": isinstance(self.motion, OneWay | Rotation),
            "motion.axis: expected 'x', as bodies of a plane model do not give way along y,": (
                not self.passes and not table
            ),
            "motion.columns: expected no column shift_y in a plane model, whose tractions lie in the plane,": (
                table and self.model.kind == "plane" and any(name.endswith("shift_y") for name in columns)
            ),
            "stick.force: expected none in a cycle, whose forces are columns,": table and self.stick.force is not None,
            "stick.force: expected none for a motion that turns": (
                self.stick.force is not None and isinstance(self.motion, Oscillation)
            ),
        }
        return [problem for problem, so in wrong.items() if so]

    @property
    def varies(self) -> bool:
        """Whether a coefficient depends on the state, or a load on the time in the cycle."""
        laws = [law.given_coefficient for law in (self.wear.punch, self.wear.strip) if law is not None]
        mixed = self.contact.lubrication is not None and self.contact.lubrication.varies
        dependent = mixed or any(isinstance(value, Dependence) for value in (self.contact.friction, *laws))
        return dependent or not all(load.steady for body in ("punch", "strip") for load in self.loads_of(body))

    def _thermal_problems(self, heat: Heat) -> list[str]:
        needed = ("conductivity", "heat_capacity", "density", "expansion")
        used = self.used_materials & set(self.materials)
        problems = [
            f"materials.{name}.{key}: missing, but required with heat"
            for name in sorted(used)
            for key in needed
            if getattr(self.materials[name], key) is None
        ]
        if not isinstance(self.motion, OneWay | Rotation):
            problems += [
                f"heat.{key}: expected one-way sliding: to and fro the same material stays, and none enters"
                for key in ("track", "inflow")
                if getattr(heat, key) is not None
            ]
        if heat.track is not None:
            if heat.inflow is not None:
                problems.append("heat.inflow: expected none with heat.track, whose bulk comes in")
            if heat.operator != "reduced":
                problems.append("heat.operator: expected 'reduced' with heat.track")
        if heat.conductance == "layer" and self.contact.layer is None:
            problems.append("heat.conductance: expected a table contact.layer for 'layer'")
        if heat.conductance_per_pressure is not None and heat.conductance != 0:
            problems.append("heat.conductance: give either conductance or conductance_per_pressure")
        return problems

    @property
    def folder(self) -> Path | None:
        """The folder of the case file, None for a built-in case or one made in Python."""
        return self._folder

    @property
    def written(self) -> Written:
        """How its quantities were written; nothing is known of those of a case made from its parts."""
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
        """Return every key with its value and unit: what case.toml holds."""
        data = self.model_dump(mode="json", exclude_none=True)
        if self._folder is not None and (self._folder / self.geometry.file).is_file():
            data["geometry"]["file"] = str((self._folder / self.geometry.file).resolve())  # wherever it is read next
        for body, heights in (("punch", self.punch.topography), ("strip", self.strip.topography)):
            if self._folder is not None and heights is not None and heights.file is not None:
                data[body]["topography"]["file"] = str((self._folder / heights.file).resolve())
        for body, law in self.wear.by_body.items():
            if law is not None:
                data["wear"][body] = law.resolved(data["wear"][body])
        if self.geometry.follow_wear is None:
            data["geometry"]["follow_wear"] = "never"
        return dict(renamed(data, self.names.by_name)) if self.names.given else data

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
