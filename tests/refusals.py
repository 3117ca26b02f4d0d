"""What is rejected together though each by itself is fine: inputs, the key of the error, and why; read by the docs.

Physics: no such thing or state exists. Model: the equations, or a way to solve them, are of something else, and the
message names what to use instead. test_refusals.py gives each input of `LOADED` and `PLACED` to the program, and looks
for the key.
"""

from __future__ import annotations

from typing import NamedTuple

PHYSICS, MODEL = "physics", "model"
KINDS = {MODEL: "Of the model, or of the way it is solved", PHYSICS: "Of nature"}

PLANE, HEAT, ONE_WAY, BOTH = "example1", "example1-heat", "monotonic-lz20", "fretting"
RING, RING_HEAT, BALL, CUP = "ring-on-ring", "ring-on-ring-heat", "ball-on-flat", "ball-in-cup"
STICK, SPHERE = "fretting-partial-slip", "fretting-sphere"


def cycle(*columns: str, rest: bool = False, back: bool = True) -> str:
    """Return the setting of a cycle whose columns go from 0 to 1 and back."""
    heads = ", ".join(f"'{name}'" for name in ("time (s)", *columns))
    rows = [[time, *[place] * len(columns)] for time, place in ((0, 0), (1, 0 if rest else 1), (2, 0))]
    return f"motion={{kind='cycle', columns=[{heads}], rows={rows if back else rows[:2]}}}"


def program(*steps: str, more: str = "") -> tuple[str, str]:
    """Return the settings of a program of some steps."""
    return f"program={{steps=[{', '.join(f'{{{step}}}' for step in steps)}]{more}}}", "unset=run.half_cycles"


TURN = "motion={kind='oscillation', amplitude='0.1 rad', angular_frequency=1, axis=[0, 1, 0]}"
AWAY = "motion={kind='one-way', direction='rightward', speed=1, duration=10}"
FINE = ("punch.operator=fine", "strip.operator=fine", "grid.across=16")
SHIFT, Y = cycle("shift_x (mm)"), cycle("shift_x (mm)", "shift_y (mm)")


class Refusal(NamedTuple):
    """An input that is rejected: a case with settings, the key and a number of the error, and why."""

    case: str
    settings: tuple[str, ...]
    key: str
    kind: str
    reason: str
    number: str = ""


LOADED = (
    Refusal(RING, ("punch.loads.0.through=[1, 2]",), "punch.loads.0.through", PHYSICS,
            "loads through a point, and moments that bend, on rings"),
    Refusal(RING, ("punch.loads.0.moment=[1]",), "punch.loads.0.moment", PHYSICS,
            "loads through a point, and moments that bend, on rings"),
    Refusal(PLANE, (cycle("shift_x (mm)", back=False),), "motion.rows", PHYSICS, "a cycle that does not come back"),
    Refusal(HEAT, ("grid.nodes=33",), "grid", MODEL, 'heat on contact grids, `"fine"` bodies and half-spaces'),
    Refusal(HEAT, ("punch.operator=fine",), "punch.operator", MODEL,
            'heat on contact grids, `"fine"` bodies and half-spaces'),
    Refusal(BALL, ("punch.operator=condensed", "grid.across=16"), "grid.across", MODEL,
            "`grid.across` with condensed bodies: each growth would condense them again"),
    Refusal(BALL, (*FINE, "punch.topography={rms='0.1 um', longest='0.1 mm'}"), "grid.across", PHYSICS,
            "`grid.across` with topography: a coarser grid has no place for its heights"),
    Refusal(PLANE, ("punch.supports.0.fix=['y']",), "punch.supports.0.fix.0", PHYSICS,
            "supports along axes that a model does not have"),
    Refusal(PLANE, ("punch.loads.0.force=[1, 2, 3]",), "punch.loads.0.force", PHYSICS,
            "vectors along axes that a model does not have", "3"),
    Refusal(PLANE, (TURN.replace("[0, 1, 0]", "[1, 0, 0]"),), "motion.axis", PHYSICS,
            "turning about another axis than a plane model's"),
    Refusal(RING, ("motion.axis=[0, 1, 0]",), "motion.axis", PHYSICS, "rings that turn about another axis than theirs"),
    Refusal(RING, ("motion={kind='reciprocating', amplitude=1, angular_frequency=1}",), "motion.kind", PHYSICS,
            "rings that slide along a line: they open"),
    Refusal(PLANE, ("motion.along=[1, 0, 0]",), "motion.along", PHYSICS, "directions in space of a plane model"),
    Refusal(HEAT, (Y,), "motion.columns", MODEL,
            "heat and sliding along x and y together: what leaves along y carries heat away; a solid has it"),
    Refusal(PLANE, (cycle("shift_x (mm)", rest=True),), "motion.columns", PHYSICS, "gross sliding without motion"),
    Refusal(PLANE, ("motion.axis=y", "motion.positions=5"), "motion.positions", PHYSICS,
            "places of a strip that slides out of the plane: all are alike", "1"),
    Refusal(PLANE, ("contact.friction={expression='0.2 + T*1e-4'}",), "contact.friction", PHYSICS,
            "coefficients of T without heat"),
    Refusal(PLANE, ("wear.punch={energy='1e-8 1/MPa'}", "contact.friction=0"), "wear.punch", PHYSICS,
            "wear by the work of friction without friction"),
    Refusal(PLANE, ("contact.friction={expression='0.2 + debris'}",), "contact.friction", PHYSICS,
            "coefficients of debris without debris"),
    Refusal(PLANE, program("cycles=1, load_factors={nowhere=2}"), "program.steps.0.load_factors.nowhere", PHYSICS,
            "factors of loads that do not exist"),
    Refusal(PLANE, program("cycles=1, angular_speed=2"), "program.steps.0.angular_speed", PHYSICS,
            "steps of a program that change what their motion does not have"),
    Refusal(CUP, program("distance=100"), "program.steps.0.distance", PHYSICS,
            "steps of a cycle's table by distance: each node has its own"),
    Refusal(PLANE, program("cycles=1, ambient=20"), "program.steps.0.ambient", PHYSICS,
            "ambient temperatures without heat"),
    Refusal(PLANE, program("cycles=1", more=", radius=5"), "program.radius", PHYSICS,
            "a radius where nothing turns"),
    Refusal(PLANE, (*program("cycles=1", "cycles=4, load_factor=[1, 2]"), "run.periodic_within=1e-3"),
            "run.periodic_within", PHYSICS, "`run.periodic_within` while loads still change"),
    Refusal(PLANE, program(f"cycles=1, {SHIFT}"), "program.steps.0.motion", PHYSICS,
            "other tables in a program whose motion is none"),
    Refusal(PLANE, (SHIFT, "contact.friction={expression='0.2 + 1e-6*s'}", *program(f"cycles=1, {SHIFT}")),
            "program.steps.0.motion", PHYSICS, "coefficients of s where a program changes the table"),
    Refusal(BOTH, ("motion.positions=1",), "motion.positions", PHYSICS,
            "a strip that wears in a single place: its wear spreads over the stroke", "2"),
    Refusal(BOTH, ("contact.law=gross-sliding", "stick={force=1}"), "stick", PHYSICS,
            "forces and stresses of a rig with stick, in gross sliding"),
    Refusal(STICK, ("contact.transverse_friction=0.1",), "contact.transverse_friction", PHYSICS,
            "stick with a given transverse friction: its direction is a result", "0"),
    Refusal(RING, ("contact.law=coulomb", "stick.bulk_stress='10 MPa'"), "stick.bulk_stress", MODEL,
            "a bulk stress along x in rings with stick, which does not keep them round"),
    Refusal(STICK, ("heat={operator='full'}",), "heat.operator", MODEL,
            'stick with `heat.operator = "full"`, the check of the reduced basis: a time step needs temperatures as a '
            "matrix of its tractions, a solve on the mesh for each contact node and step"),
    Refusal(STICK, ("heat={coupling='split'}",), "heat.coupling", MODEL,
            'stick with `heat.coupling = "split"`, which heats by the step before: stick takes one Newton step '
            "of contact and heat together, and nothing is saved"),
    Refusal(STICK, (AWAY,), "motion.kind", PHYSICS,
            "stick one way: after the first of it all slips, and gross sliding is the answer"),
    Refusal(STICK, ("motion.axis=y",), "motion.axis", MODEL,
            "stick and sliding out of a plane model, whose tractions lie in the plane: a solid has it"),
    Refusal(STICK, (cycle("shift_y (mm)"),), "motion.columns", MODEL,
            "stick and sliding out of a plane model, whose tractions lie in the plane: a solid has it"),
    Refusal(SPHERE, (TURN.replace("[0, 1, 0]", "[0, 0, 1]"), "stick.force=1"), "stick.force", PHYSICS,
            "a force of the rig that a turning motion does not have: it would be a couple"),
    Refusal(HEAT, ("heat.inflow=1",), "heat.inflow", PHYSICS, "inflow and a closed track, to and fro"),
    Refusal(ONE_WAY, ("strip.creep={terms=[{compliance=1e-6, time=1}]}",), "strip.creep", PHYSICS,
            "a strip that creeps, one way: no crept material stays"),
    Refusal(HEAT, ("setup.reproducible=true", "heat.operator=full"), "setup.reproducible", MODEL,
            "the same on any number of ranks with all temperatures, which the ranks share"),
    Refusal(RING_HEAT, ("heat.track={volume=1000}", "heat.inflow=20"), "heat.inflow", PHYSICS,
            "inflow on a closed track"),
    Refusal(RING_HEAT, ("heat.track={volume=1000}", "heat.operator=full"), "heat.operator", MODEL,
            'a closed track with `heat.operator = "full"`: its bulk is one of the numbers that the basis has'),
    Refusal(PLANE, ("wear.punch={archard=1e-4, hardness='2 GPa', pressure_exponent=2}",), "wear.punch.archard", PHYSICS,
            "`archard` and `energy`, laws of p v, with other exponents"),
    Refusal(BALL, ("model.plane=strain",), "model.plane", PHYSICS, "a state of the plane in solids or rings"),
    Refusal(PLANE, ("wear.punch={per_area=1e-8, pressure_cap=20}",), "wear.punch.per_area", PHYSICS,
            "wear per contact area, whose pressure is given, with bounds of pressure"),
)  # fmt: skip

# These are rejected where the bodies are brought opposite each other.
PLACED = (
    Refusal(RING, ("grid.nodes=33",), "grid", MODEL,
            "`grid` in rings: their forces are of whole circles, no kernel of a half-space is"),
    Refusal(PLANE, ("geometry={file='solid_blocks.geo'}",), "geometry.file", PHYSICS, "volumes in a plane model"),
)  # fmt: skip

# Of these a solver knows, or a mesh: by the test that provokes them, "" where none does.
ELSEWHERE = (
    (PHYSICS, "a load where its own motion is held: no force comes to the contact",
     "test_approach.py::test_a_load_on_a_held_group"),
    (PHYSICS, "a cycle that moves the strip into or off the punch",
     "steps/test_table.py::test_loads_that_no_contact_can_carry"),
    (MODEL, '`operator = "half-space"` on elements of degree 2, whose nodes have unequal areas',
     "bodies/test_surface_operators.py::test_bodies_that_are_no_half_space"),
    (PHYSICS, "a half-space and supports that move it: it is held far away", ""),
    (MODEL, "a body that is free along the surface's normal where this is not z: turn the geometry",
     "test_solid.py::test_a_free_body_whose_contact_does_not_face_z"),
    (PHYSICS, "a part that nothing holds",
     "bodies/test_connected_parts.py::test_a_part_that_neither_touches_nor_is_held"),
    (PHYSICS, "an end where loads press to either side in turn",
     "steps/test_table.py::test_a_ring_pressed_to_either_side_has_no_steady_state"),
    (PHYSICS, "an end where the strip wears to and fro",
     "steps/test_positions.py::test_no_steady_state_where_the_track_deepens"),
    (PHYSICS, "an end of laws of depth or distance", "studies/test_sensitivity.py::test_laws_that_pass_are_refused"),
    (PHYSICS, "an end of creep without end", "steps/test_creep.py::test_growth_without_an_end"),
    (PHYSICS, "an end of wear between bodies that are held apart", "test_refusals.py::test_no_end_of_held_bodies"),
    (PHYSICS, "an end whose loads no wear balances",
     "steps/test_steady.py::test_friction_can_tip_the_punch_out_of_any_steady_state"),
    (PHYSICS, "an end beyond `pressure_cap`", "steps/test_steady.py::test_cap_that_holds_nothing"),
    (PHYSICS, "an end beyond `contact.hardness`",
     "laws/test_layers.py::test_a_hardness_that_carries_nothing_is_refused"),
    (PHYSICS, "an end where only a strip's turning about a hinge that slides with it could follow the wear: each place "
     "wears a facet of its own, deeper for ever",
     "steps/test_free_strip.py::test_no_shape_stays_under_a_strip_on_a_hinge"),
    (MODEL, "`flash` of a cycle that is a table: kernels of sources have one way to and fro",
     "test_refusals.py::test_flash_of_cycles_without_a_kernel"),
    (MODEL, "`flash` of a test program with stick, whose last cycle is done again",
     "test_refusals.py::test_flash_of_cycles_without_a_kernel"),
    (MODEL, "`flash` where the strip turns about a point near to the contact",
     "results/test_flash_temperatures.py::test_refused_turning_about_the_contact"),
    (MODEL, "a reduced basis whose temperatures grow of themselves", ""),
    (PHYSICS, "`contact.lubrication` whose share follows speed or temperature, with stick and a layer that closes by "
     "a law: nodes that stop keep a film for a while",
     "test_refusals.py::test_a_share_that_changes_with_a_layer_and_stick"),
    (PHYSICS, "an end of partial slip with a threshold, which depends on the way there",
     "steps/test_steady.py::test_pressures_below_the_threshold_have_no_end_of_their_own"),
    (PHYSICS, "an end of partial slip where all slips",
     "steps/test_final_shape.py::test_a_force_shrinks_the_zone_under_a_prescribed_approach"),
    (PHYSICS, "steady quantities with laws of depth or distance",
     "studies/test_sensitivity.py::test_laws_that_pass_are_refused"),
    (MODEL, "run-in and critical speeds with properties of T: rates of small disturbances of bodies that stay",
     "test_refusals.py::test_no_rates_with_properties_of_the_temperature"),
    (PHYSICS, "an end of bodies that lose no heat",
     "steps/test_stick_heat.py::test_what_does_not_go_with_heat_is_told"),
    (MODEL, "stick with a strip that passes under a grid of over 3,000 nodes: both grids move against each other, "
     "which no product by waves has, and factors do not fit",
     "steps/test_on_grids.py::test_a_strip_that_passes_under_a_fine_grid_is_refused"),
)  # fmt: skip


def reasons() -> dict[str, list[str]]:
    """Return the reasons of each kind, each once."""
    pairs = [*((one.kind, one.reason) for one in (*LOADED, *PLACED)), *(row[:2] for row in ELSEWHERE)]
    return {kind: list(dict.fromkeys(text for of, text in pairs if of == kind)) for kind in KINDS}
