"""Combinations of tables that a case rejects: by subject, with a table of the simple ones.

Problems of a single table stand with the table, see `table_parts.Part`. Each problem is a key and what it expects.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any

from fenwear.case.body_names import ROLES
from fenwear.case.body_tables import AUTO, CONDENSED
from fenwear.case.motion_table import Cycle, OneWay, Oscillation, Rotation
from fenwear.case.table_parts import Check
from fenwear.case.wear_table import Dependence, Stick, depends_on

if TYPE_CHECKING:
    from fenwear.case.schema import Case

FINER = "with heat: a contact finer than the meshes heats a layer as thin as its node spacing, too thin for the meshes"
NO_HEAT = "depends on the temperature T. Add the table heat"
NO_FILM = "depends on the thickness of a film. Add the table wear.punch.film"
NO_DEBRIS = "depends on the thickness of debris. Add the table contact.third_body"
POISSON = {"strain": "in plane strain", "axisymmetric": "in rings", "solid": "in solids"}


def one_way(case: Case) -> bool:
    """Return whether a case slides steadily one way."""
    return isinstance(case.motion, OneWay | Rotation)


def to_and_fro(case: Case) -> bool:
    """Return whether a case slides to and fro, in positions of its strip."""
    return not isinstance(case.motion, OneWay | Rotation | Cycle)


def strip_track(case: Case) -> bool:
    """Return whether what changes of the strip passes under the punch, which slides as a whole."""
    return case.strip_changes and case.passes and not case.sticks


def _of_one_way(key: str) -> Check:
    """Return the check of a key of the heat that belongs to sliding one way."""
    message = f"heat.{key}: expected one-way sliding: to and fro the same material stays, and none enters"
    return Check(lambda case: case.heat and case.heat.present(key) and not one_way(case), message)


CHECKS = (
    Check(
        lambda c: not (c.punch.loads or c.strip.loads or c.course_load or any(s.moves for s in supports(c))),
        "punch.loads: expected at least one load that presses the punch on the strip, of either body, or a support "
        "moved `by`",
    ),
    Check(
        lambda c: c.setup.reproducible and c.heat and c.heat.operator == "full",
        "setup.reproducible: expected heat.operator = 'reduced', whose steps are equal on all ranks",
    ),
    Check(
        lambda c: c.run.integration == "jump" and c.run.half_cycles < (1 if one_way(c) else 2),
        "run.half_cycles: expected at least one whole cycle for cycle jumps",
    ),
    # Heat
    _of_one_way("track"),
    _of_one_way("inflow"),
    Check(
        lambda c: c.heat and c.heat.conductance == "layer" and not c.contact.layer,
        "heat.conductance: expected a table contact.layer for 'layer'",
    ),
    Check(lambda c: c.heat and c.grid, f"grid: expected none {FINER}"),
    # Sliding
    Check(
        lambda c: c.model.kind == "plane" and turning(c) and (c.motion.axis[0] or c.motion.axis[2]),
        "motion.axis: expected [0, 1, 0], out of the plane, in a plane model",
    ),
    Check(
        lambda c: c.model.kind == "axisymmetric" and turning(c) and any((*c.motion.axis[:2], *c.motion.centre[:2])),
        "motion.axis: expected the axis z of the rings, through x = y = 0",
    ),
    Check(
        lambda c: c.model.kind == "axisymmetric" and not turning(c) and not isinstance(c.motion, Cycle),
        "motion.kind: expected rotation or oscillation, or a cycle, in an axisymmetric model",
    ),
    Check(
        lambda c: c.model.kind == "plane" and getattr(c.motion, "along", None) is not None,
        "motion.along: belongs to solids; a plane model has axis = 'x' or 'y'",
    ),
    Check(
        lambda c: isinstance(c.motion, Cycle) and c.motion.course.rests and not c.sticks,
        "motion.columns: the strip moves in no row. Change a shift or a rotation from row to row",
    ),
    Check(
        lambda c: not c.passes and getattr(c.motion, "positions", 1) not in (None, 1, "middle"),
        "motion.positions: expected 1 for sliding out of the plane",
    ),
    Check(
        lambda c: strip_track(c) and isinstance(c.motion, OneWay) and not c.motion.track,
        "motion.track: missing, but required where the strip wears in one-way sliding",
    ),
    Check(
        lambda c: strip_track(c) and to_and_fro(c) and c.motion.positions == 1,
        "motion.positions: expected 2 or more, since the strip's wear spreads over the stroke",
    ),
    Check(
        lambda c: strip_track(c) and isinstance(c.motion, Cycle) and c.motion.positions == "middle",
        "motion.positions: expected 'steps', since the strip's wear moves with its material",
    ),
    Check(
        lambda c: c.strip.creep and one_way(c) and c.passes,
        "strip.creep: expected a motion to and fro: sliding one way, crept material leaves the contact, and other "
        "material enters that has not crept",
    ),
    Check(
        lambda c: c.contact.law == "gross-sliding" and c.stick != Stick(),
        "stick: expected with contact.law = 'coulomb' only",
    ),
)

AGAINST_STICK = (
    Check(
        lambda c: c.contact.transverse_friction != 0,
        "contact.transverse_friction: expected 0, as friction opposes the computed slip,",
    ),
    Check(
        lambda c: c.model.kind == "axisymmetric" and c.stick.bulk_stress != 0,
        "stick.bulk_stress: expected 0, as a stress along x does not keep rings round,",
    ),
    Check(
        lambda c: c.heat and c.heat.operator == "full",
        "heat.operator: expected 'reduced', as a time step needs temperatures as a matrix of its tractions,",
    ),
    Check(
        lambda c: c.heat and c.heat.coupling == "split",
        "heat.coupling: expected 'implicit', as a time step is solved together with its heat,",
    ),
    Check(one_way, "motion.kind: expected a motion to and fro, or a cycle,"),
    Check(
        lambda c: c.model.kind == "plane" and not c.passes and not isinstance(c.motion, Cycle),
        "motion.axis: expected 'x', since a plane model has no displacements along y,",
    ),
    Check(
        lambda c: c.model.kind == "plane" and any(name.endswith("shift_y") for name in columns(c)),
        "motion.columns: expected no column shift_y in a plane model, whose tractions lie in the plane,",
    ),
    Check(
        lambda c: isinstance(c.motion, Cycle) and c.stick.force,
        "stick.force: expected none in a cycle, whose forces are columns,",
    ),
    Check(
        lambda c: isinstance(c.motion, Oscillation) and c.stick.force,
        "stick.force: expected none for a motion that turns",
    ),
)


def case_problems(case: Case) -> list[str]:
    """Return the problems of a case: each a key and the expected value."""
    messages = [check.message for check in CHECKS if check.wrong(case)]
    if case.sticks:
        messages += [f"{problem} with contact.law = 'coulomb'" for problem in case.against_stick]
    return [*messages, *chain(*(problems(case) for problems in SUBJECTS))]


def turning(case: Case) -> bool:
    """Return whether the strip turns about an axis."""
    return isinstance(case.motion, Oscillation | Rotation)


def columns(case: Case) -> tuple[str, ...]:
    """Return the columns of the cycle's table; none of other motions."""
    return case.motion.column_names if isinstance(case.motion, Cycle) else ()


def supports(case: Case) -> list[Any]:
    """Return the supports of both bodies."""
    return [*case.punch.supports, *case.strip.supports]


def material_problems(case: Case) -> Iterator[str]:
    """Yield what is wrong with regions and their materials."""
    known = ", ".join(sorted(case.materials))
    for body, part in case.bodies.items():
        if not part.regions:
            yield f"{body}.regions: missing, but required"
        for region, name in part.regions.items():
            if name not in case.materials:
                yield f"{body}.regions.{region}: no material {name!r}; known are {known}"
    for name, material in case.materials.items():
        if material.poisson >= 0.5 and case.model.law in POISSON:
            wanted = f"expected less than 0.5 {POISSON[case.model.law]}"
            yield f"materials.{name}.poisson: {wanted}, got {material.poisson:g}"
        if not case.heat:
            yield from (f"materials.{name}.{key}: {NO_HEAT}" for key in material.dependent)
        elif name in case.used_materials:
            missing = [key for key in THERMAL if not material.present(key)]
            yield from (f"materials.{name}.{key}: missing, but required with heat" for key in missing)


THERMAL = ("conductivity", "heat_capacity", "density", "expansion")


def operator_problems(case: Case) -> Iterator[str]:
    """Yield the problems of bodies whose compliance is not that of a mesh, and of contact grids."""
    meshed = [name for name, body in case.bodies.items() if body.operator == CONDENSED]
    rough = [name for name, body in case.bodies.items() if body.topography]
    for name, body in case.bodies.items():
        if case.heat and body.operator not in (AUTO, CONDENSED):
            yield f"{name}.operator: expected '{CONDENSED}' {FINER}"
    if not case.grid:
        for name in rough:
            yield f"grid: missing, but required with {name}.topography, whose heights are those of its nodes"
        return
    for key, names, why in (
        ("operator", meshed, f"with {{}} = '{CONDENSED}', one solution for each node; or 'fine'"),
        ("topography", rough, "with {}, which a coarser grid would lose"),
    ):
        if case.grid.across and names:
            keys = " and ".join(f"{name}.{key}" for name in names)
            yield f"grid.across: expected grid.nodes, of a grid that stays, {why.format(keys)}"


def vector_problems(case: Case) -> Iterator[str]:
    """Yield the vectors and supports along axes that the model does not have."""
    kind, axes = case.model.kind, case.model.axes
    names = " or ".join(f"'{axis}'" for axis in axes)
    for body, part in case.bodies.items():
        vectors: dict[str, tuple[float, ...] | None] = {f"{body}.pivot": part.pivot}
        for number, support in enumerate(part.supports):
            vectors[f"{body}.supports.{number}.at"] = support.at
            for place, axis in enumerate(support.fix):
                if axis not in axes:
                    yield f"{body}.supports.{number}.fix.{place}: expected {names} in a {kind} model, got '{axis}'"
        for number, load in enumerate(part.loads):
            at = f"{body}.loads.{number}"
            vectors |= {f"{at}.{key}": getattr(load, key) for key in ("force", "traction", "through")}
            yield from load.moment_problems(at, kind)
        for key, vector in vectors.items():
            if vector and len(vector) != len(axes):
                expected = f"expected {len(axes)} components ({', '.join(axes)}) in a {kind} model"
                yield f"{key}: {expected}, got {len(vector)}"


def cycle_problems(case: Case) -> Iterator[str]:
    """Yield the problems of a cycle's table with the model and with heat."""
    if not isinstance(case.motion, Cycle):
        return
    yield from case.motion.model_problems(case.model.kind, case.model.axes)
    if case.heat and case.model.kind == "plane" and case.passes:
        why = "with heat: motion along x as well takes heat out of a plane model"
        leaving = [name for name in columns(case) if name.endswith("shift_y")]
        yield from (f"motion.columns: expected no column {name} {why}" for name in leaving)


def coefficient_problems(case: Case) -> Iterator[str]:
    """Yield what is wrong with coefficients that depend on the state, or on the bodies."""
    for key, value in case.coefficients.items():
        own_law = isinstance(value, Dependence) and value.law
        if not case.heat and not own_law and depends_on(value, "T"):
            yield f"{key}: {NO_HEAT}"
        if not any(law.film for law in case.wear.laws) and depends_on(value, "film"):
            yield f"{key}: {NO_FILM}"
        if not case.contact.third_body and depends_on(value, "debris"):
            yield f"{key}: {NO_DEBRIS}"
        if isinstance(value, Dependence) and value.regions:
            regions = (case.strip if key.startswith("wear.strip") else case.punch).regions
            unknown, missing = value.regions.keys() - regions, regions.keys() - value.regions
            yield from (f"{key}.regions.{r}: no such region; known are {', '.join(regions)}" for r in unknown)
            yield from (f"{key}.regions.{r}: missing, but required" for r in missing)
    for body, law in case.wear.by_body.items():
        if law.present("energy") and case.contact.friction == 0:
            yield f"wear.{body}: expected friction where energy gives the coefficient"


def body_problems(case: Case) -> Iterator[str]:
    """Yield what is wrong with the bodies that carry debris and set the temperature of friction."""
    given: dict[str, tuple[str, tuple[str, ...]]] = {
        "friction_temperature": (case.contact.friction_temperature, ("mean", "hotter"))
    }
    if case.contact.third_body:
        given["third_body.carried_by"] = (case.contact.third_body.carried_by, ())
    for key, (name, others) in given.items():
        if case.names.role_of(name) not in (*others, *ROLES):
            known = " or ".join(map(repr, (*others, *case.names.by_roles.values())))
            yield f"contact.{key}: expected {known}, got {name!r}"


def program_problems(case: Case) -> Iterator[str]:
    """Yield the problems of a program with the motion and the heat."""
    if not case.program:
        return
    program, motion = case.program, case.motion
    for number, step in enumerate(program.steps):
        yield from step_problems(case, step, f"program.steps.{number}")
    if program.radius and not case.turns:
        yield f"program.radius: motion.kind = '{motion.kind}' does not turn. Remove the radius"
    if not program.radius and case.turns and any(step.distance for step in program.steps):
        yield (
            "program.radius: missing, but required where the strip turns and a step has a distance. Set the radius "
            "at which the distance is slid, such as that of the middle of the wear track"
        )
    if any(step.load for step in program.steps) and any(step.load_factors for step in program.steps):
        yield "program.steps: load is the sum of the case's loads; expected load_factor with load_factors"
    if case.run.periodic_within and program.steps[-1].ramps:
        at = f"program.steps.{len(program.steps) - 1}.{program.steps[-1].ramps[0]}"
        yield (
            f"run.periodic_within: cycles do not repeat while {at} changes from one value to another. Add a last step "
            "with constant values"
        )


def step_problems(case: Case, step: Any, at: str) -> Iterator[str]:
    """Yield the problems of a program step with the motion and the heat."""
    motion = case.motion
    groups = sorted({load.on for body in case.bodies.values() for load in body.loads})
    for name in step.load_factors or {}:
        if name not in groups:
            loaded = ", ".join(groups) or "none"
            yield f"{at}.load_factors.{name}: no load of the case acts on this group. Loads act on {loaded}"
    for key in step.present("speed", "angular_speed", "amplitude", "angular_frequency", "period"):
        known = key in type(motion).model_fields and not (key == "amplitude" and case.turns)
        if not known or isinstance(motion, Cycle):
            yield f"{at}.{key}: does not change with motion.kind = '{motion.kind}'"
    if step.distance and isinstance(motion, Cycle):
        yield f"{at}.distance: expected cycles or time, as nodes slide different distances in a cycle"
    if step.motion and not isinstance(motion, Cycle):
        yield f"{at}.motion: does not change with motion.kind = '{motion.kind}': expected 'cycle'"
    elif step.motion:
        of_motion = step.motion.model_problems(case.model.kind, case.model.axes)
        yield from (f"{at}.{problem}" for problem in of_motion)
        if any(depends_on(value, "s") for value in case.coefficients.values()):
            yield f"{at}.motion: expected no coefficient that depends on s, as cycles slide different distances"
    if step.present("ambient") and not case.heat:
        yield f"{at}.ambient: expected a case with the table heat"


SUBJECTS = (
    material_problems,
    operator_problems,
    vector_problems,
    cycle_problems,
    coefficient_problems,
    body_problems,
    program_problems,
)
