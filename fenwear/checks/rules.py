"""The rules by which a state is plausible: what each looks at, the key it is about, and its message.

A message says what happened, how much, what it means and what to set. The functions return the fields of the message,
or nothing where all is well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from string import Formatter
from typing import TYPE_CHECKING, Any

import numpy as np

from fenwear.case.unlikely_values import HOT
from fenwear.checks import mesh_fineness
from fenwear.checks.elastic_limits import TAKEN_UP, elastic_share, elastic_way, large, stroke_amplitude
from fenwear.checks.mesh_fineness import Fields
from fenwear.checks.surface_ends import Chamfers, Limits, contact_chamfers, contact_limits, opened, thickness
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, ConvergenceError, readable
from fenwear.contact import ContactState
from fenwear.contact.complementarity import BROKEN, complementarity_error
from fenwear.heat.heat_exchange import TERMS
from fenwear.laws.wear import WornDepths
from fenwear.results.registry import quantities_of
from fenwear.results.summary import factor, net_of, shakedown_limit
from fenwear.steps import Block, SteadyState, critical_speed
from fenwear.system import ContactSetup, Tribosystem

if TYPE_CHECKING:
    from fenwear.steps.stick_final import FinalShape

STRONGEST = 0.1  # of Young's modulus: the strength of a perfect crystal, which no hardness exceeds
WIDER = 0.02  # of the surface's width: what a chamfer adds
DEEP = 0.05  # of the radius: turns of normals, rad
SHALLOW = 1e-3  # of the contact surface's extent: depths that no body is thin enough for
UNBALANCED = 1e-3  # of a balance's largest term
GONE = 0.05  # of a contact surface, that is worn through: less may be the thin end of a wedge


@dataclass(frozen=True)
class Made:
    """Data of the meshes as they were made, which rules use, computed once for a run.

    Attributes:
        system: On these meshes.
        first: In words when a contact was clipped first.
        largest: Terms of the balances of all half-cycles so far, by name.
    """

    system: Tribosystem
    first: dict[str, str] = field(default_factory=dict)
    largest: dict[str, float] = field(default_factory=dict)

    def error(self, name: str, missing: Array, terms: Array) -> Array:
        """Return the error of a balance (k,) over its largest term (k, ...) of all half-cycles so far."""
        self.largest[name] = max(self.largest.get(name, 1e-300), float(np.abs(terms).max()))
        return np.abs(missing) / self.largest[name]

    @cached_property
    def contact(self) -> ContactState:
        """The contact before any wear; collective."""
        return self.system.phase_contact((0,)).solve(self.system.gap(0, self.system.unworn()))

    @cached_property
    def limits(self) -> Limits:
        """Where the contact is clipped; collective."""
        return contact_limits(self.system)

    @cached_property
    def chamfers(self) -> Chamfers:
        """Beside the punch's contact surface; collective."""
        return contact_chamfers(self.system)

    @cached_property
    def thick(self) -> dict[str, Array]:
        """The thickness of both bodies below their contact nodes (n,), mm; collective."""
        return {"punch": thickness(self.system.bodies.punch), "strip": thickness(self.system.bodies.strip)}


@dataclass(frozen=True)
class Seen:
    """A first contact, the half-cycles of a block, or the phases of a cyclic steady state.

    Attributes:
        made: The system on meshes as they were made.
        system: That of the state.
        when: In words, of each row (k,).
        pressure: MPa (k, n).
        error: By which contact violates its conditions (k,).
        worn: Depths worn off the punch (k, n) and the strip (k, m), mm.
        end: Depths at the end.
        temperature: Largest one of each row, K (k,); none without heat.
        touching: Nodes that carry pressure or wear, of each row (k, n).
        kind: "start", "run", "steady" or "final".
        balances: Errors of the balances of each row (k,), relative, by name.
    """

    made: Made
    system: Tribosystem
    when: Sequence[str]
    pressure: Array
    error: Array
    worn: dict[str, Array]
    end: WornDepths
    temperature: Array
    touching: Mask
    kind: str
    balances: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def of_pressure(cls, system: Tribosystem, pressure: Array, when: str, error: float = 0.0) -> Seen:
        """Look at pressures before any wear (k, n), MPa."""
        rows = len(pressure)
        return cls(
            Made(system), system, [when] * rows, pressure, np.full(rows, error), {}, system.unworn(), np.zeros(0),
            pressure > 0, "start",
        )  # fmt: skip

    @classmethod
    def of_start(cls, system: Tribosystem) -> Seen:
        """Look at the contact before any wear; collective."""
        made = Made(system)
        contact = made.contact
        error = complementarity_error(contact.pressure[0], contact.gap[0], system.elastic.interface.elastic_length)
        return replace(cls.of_pressure(system, contact.pressure, "at the start", float(error)), made=made)

    @classmethod
    def of_system(cls, system: ContactSetup) -> Seen:
        """Look at what is set up, before anything is solved."""
        return cls.of_pressure(system, np.zeros((1, len(system.pair.weights))), "at the start")  # type: ignore[arg-type]

    @classmethod
    def of_block(cls, made: Made, block: Block) -> Seen:
        """Look at half-cycles of a run."""
        touching = (block.pressure > 0) | (block.wear > 0)
        for contact in block.end.contacts:
            touching[-1] |= contact.pressure[0] > 0
        return cls(
            made, block.system, [f"in half-cycle {int(n):,}" for n in block.half_cycle], block.pressure,
            block.complementarity_error, {"punch": block.wear, "strip": block.wear_strip}, block.end.worn,
            np.zeros(0) if block.heat is None else block.heat.largest_temperature, touching, "run",
            _balances(made, block),
        )  # fmt: skip

    @classmethod
    def of_steady(cls, system: Tribosystem, state: SteadyState) -> Seen:
        """Look at a cyclic steady state; collective."""
        pressure, heat = state.phase_pressure, state.heat
        touching = (pressure > 0) | (state.wear_per_cycle > 0)
        return cls(
            Made(system), system, ["in the cyclic steady state"] * len(pressure), pressure,
            np.array([state.complementarity_error]), {}, system.unworn(),
            np.zeros(0) if heat is None else np.array([heat.punch.max(), heat.strip.max()]), touching, "steady",
        )  # fmt: skip

    @classmethod
    def of_final(cls, final: FinalShape) -> Seen:
        """Look at the shape to which partial slip wears; collective."""
        seen = cls.of_pressure(final.system, final.pressures, "in the end of the wear")
        touching = (final.pressures > 0) | (final.depth > 0)
        return replace(seen, worn={"punch": final.worn.punch[None]}, end=final.worn, touching=touching, kind="final")

    def warnings(self, *kinds: str) -> list[str]:
        """Return the warnings about it, of its own kind or of others; collective."""
        return list(remarks(self, *kinds).values())


def _balances(made: Made, block: Block) -> dict[str, Array]:
    """Return the errors of the balances of each half-cycle (k,), relative, by name."""
    system, errors = block.system, {"force and moment": block.equilibrium_error}
    if block.heat is not None:
        terms = block.heat.terms[:, : len(TERMS)]
        errors["heat"] = made.error("heat", terms[:, 0] - terms[:, 1:].sum(axis=1), terms)
    steps: tuple[Any, ...] = block.steps
    if steps:
        weights = system.law_state.problem.weights
        errors["energy"] = np.array([stroke.records.balance_error(weights) for stroke in steps])
    if system.bodies.followed is None:  # else on other meshes
        lost, worn = block.totals.of("volume_punch"), block.wear @ system.pair.weights
        errors["worn volume"] = made.error("worn volume", lost - system.bodies.punch.thickness * worn, lost)
    debris = quantities_of(block.system).get("debris_balance_error")
    return errors if debris is None else {**errors, "debris": debris.compute(block)}


def unbalanced(seen: Seen) -> Fields:
    """Return the balance that is farthest from being fulfilled."""
    if not seen.balances:
        return {}
    name, errors = max(seen.balances.items(), key=lambda item: float(item[1].max(initial=0.0)))
    row = int(errors.argmax())
    if not errors[row] > UNBALANCED:
        return {}
    key, remedy = BALANCES[name]
    return {"name": name, "percent": 100 * float(errors[row]), "when": seen.when[row], "key": key, "remedy": remedy}


def above_hardness(seen: Seen) -> Fields:
    """Return the mean pressure of the contact where it is above a hardness."""
    pressure, when = _mean_pressure(seen)
    for body, law in seen.system.case.wear.by_body.items():
        if law.hardness and pressure > law.hardness:
            return {"pressure": pressure, "when": when, "limit": law.hardness, "body": body}
    return {}


def above_strength(seen: Seen) -> Fields:
    """Return the mean pressure of the contact where it is above what a perfect crystal carries."""
    (pressure, when), case = _mean_pressure(seen), seen.system.case
    softest = min(case.used_materials, key=lambda name: case.initial_materials[name].young)
    young = case.initial_materials[softest].young
    weak = pressure > STRONGEST * young and not above_hardness(seen)
    return {"pressure": pressure, "when": when, "young": young, "material": softest} if weak else {}


def _mean_pressure(seen: Seen) -> tuple[float, str]:
    weights = seen.system.pair.weights
    means = (seen.pressure @ weights) / np.maximum((seen.pressure > 0) @ weights, 1e-300)
    return float(means.max()), seen.when[int(means.argmax())]


def above_shakedown(seen: Seen) -> Fields:
    """Return the largest pressure where it is beyond the shakedown limit, and no hardness caps it."""
    limit, material = shakedown_limit(seen.system)
    row = int(seen.pressure.max(axis=1).argmax())
    pressure = float(seen.pressure[row].max())
    if pressure <= limit or seen.system.layers.hardness < np.inf:
        return {}
    return {"pressure": pressure, "when": seen.when[row], "limit": limit, "factor": factor(seen.system.pair),
            "material": material}  # fmt: skip


def broken(seen: Seen) -> Fields:
    """Return by how much contact violates its conditions."""
    row = int(seen.error.argmax())
    return {"percent": 100 * float(seen.error[row]), "when": seen.when[row]} if seen.error[row] > BROKEN else {}


def hot(seen: Seen) -> Fields:
    """Return a temperature that is too high to be believed."""
    if not len(seen.temperature) or not seen.temperature.max() > HOT:
        return {}
    row = int(seen.temperature.argmax())
    return {"temperature": float(seen.temperature[row]), "when": seen.when[row], "limit": HOT}


def deep_elements(seen: Seen) -> Fields:
    """Return the elements that are too deep for the contact; collective."""
    pressure, net = seen.pressure[0], net_of(seen.system)
    elements = mesh_fineness.deepest(seen.system, net, pressure, _hertzian(seen, pressure))
    if elements.excess <= 1:
        return {}
    where = "at the contact" if elements.distance == 0 else f"{elements.distance:.2g} mm below the contact"
    return {
        "body": elements.body,
        "where": where,
        "depth": elements.depth,
        "when": seen.when[0],
        "allowed": elements.allowed,
    }


def few_nodes(seen: Seen) -> Fields:
    """Return how few nodes lie across the contact; nothing where deep elements make it narrow; collective."""
    if deep_elements(seen):
        return {}
    rows: list[Array] = list(seen.pressure if seen.kind == "steady" else seen.pressure[:1])
    for pressure, when in zip(rows, seen.when, strict=False):
        fields = mesh_fineness.few(seen.system.case, net_of(seen.system), pressure, _hertzian(seen, pressure))
        if fields:
            return {**fields, "when": when}
    return {}


def _hertzian(seen: Seen, pressure: Array) -> float:
    return seen.made.limits.hertzian(float(seen.system.pair.weights @ pressure))


def polygon(seen: Seen) -> Fields:
    """Return the curved surface whose straight sides show in the pressures."""
    fields = mesh_fineness.polygon(seen.made.system, seen.pressure if seen.kind == "steady" else seen.pressure[0])
    return {**fields, "when": seen.when[0]} if fields else {}


def beyond_small_strain(seen: Seen) -> Fields:
    """Return the body that the first contact moves beyond small strain; collective."""
    return large(seen.made.system, seen.made.contact)


def clipped(seen: Seen) -> Fields:
    """Return where the contact reaches the end of its surface, and how wide it should be; collective at first."""
    limits, case = seen.made.limits, seen.system.case
    rows = (seen.touching & limits.clips).any(axis=1)
    if not rows.any():
        return {}
    load = float(seen.system.pair.weights @ seen.pressure[-1])
    needed = 0.0 if seen.kind == "steady" else limits.width_needed(opened(seen.made.system.pair, seen.end), load)
    key = "grid.size" if limits.of_grid else "geometry.parameters.contact_width"
    known = limits.of_grid or "contact_width" in case.geometry.parameters
    then = {
        "steady": f"the scar is as wide as that surface, {limits.width:.4g} mm. Follow a scar that grows with `run`",
        "width": f"a width of about {needed:.3g} mm is needed, it has {limits.width:.3g} mm. "
        + (f"Set `{key}`" if known else "Widen `punch_contact` and `strip_contact`"),
        "": "Widen `punch_contact` and `strip_contact`",
    }
    when = seen.made.first.setdefault("clipped", seen.when[int(np.argmax(rows))])
    where = limits.where(np.asarray(seen.touching.any(axis=0)))
    end = "contact grid" if limits.of_grid else "meshed contact surface"
    kind = "steady" if seen.kind == "steady" else "width" if needed else ""
    return {"when": when, "where": where, "end": end, "then": then[kind]}


def chamfer(seen: Seen) -> Fields:
    """Return by how much the contact would be wider beside chamfers; collective at first."""
    if seen.kind != "run":
        return {}
    chamfers = seen.made.chamfers
    widened = chamfers.widened(seen.made.system, seen.end)
    return {} if widened < WIDER * chamfers.width else {"widened": widened, "width": chamfers.width}


def turned(seen: Seen) -> Fields:
    """Return by how much a round contact has moved into its bore."""
    pair = seen.made.system.pair
    turn = mesh_fineness.turned(pair, seen.system.pair.opening(seen.end.punch, seen.end.strip))
    return {"percent": 100 * turn, "when": seen.when[-1]} if turn >= DEEP else {}


def worn_through(seen: Seen) -> Fields:
    """Return the body that is worn through; collective at first."""
    bodies = seen.made.system.bodies
    for elastic in (bodies.punch, bodies.strip):
        name, surface = elastic.body.name, elastic.surface
        depths = seen.worn.get(name, np.zeros((0, len(surface.weights))))
        if depths.max(initial=0.0) < SHALLOW * surface.extent():
            continue
        thick = seen.made.thick[name]
        gone = (depths >= thick) @ surface.weights >= GONE * surface.weights.sum()
        if gone.any():
            first = int(np.argmax(gone))
            at = int(np.argmax(depths[first] - thick))
            return {"when": seen.when[first], "body": name, "depth": float(depths[first, at]),
                    "thick": float(thick[at])}  # fmt: skip
    return {}


def other_unit(seen: Seen) -> Fields:
    """Return the unit that the mesh is probably in; collective."""
    return mesh_fineness.other_unit(seen.system.case, seen.system.bodies, seen.system.rigid)


def high_elements(seen: Seen) -> Fields:
    """Return elements higher than the layer that heats up below a fast contact; collective."""
    layer = mesh_fineness.heated_layer(seen.system)
    return vars(layer) if layer.remedy else {}


def stroke_taken_up(seen: Seen) -> Fields:
    """Return the share of a stroke that the bodies take up elastically before they slide as a whole."""
    share, against = elastic_share(seen.system), seen.system.case.against_stick
    if share is None or share <= TAKEN_UP:
        return {}
    remedy = f"stick and slip cannot be followed here: {against[0]}" if against else (
        'Set `contact.law = "coulomb"` to follow stick and slip'
    )  # fmt: skip
    return {"way": 1e3 * elastic_way(seen.system), "percent": 100 * share,
            "amplitude": 1e3 * stroke_amplitude(seen.system), "remedy": remedy}  # fmt: skip


def beside_radius(seen: Seen) -> Fields:
    """Return the radius at which a program measures distances, where nothing touches there."""
    program = seen.system.case.program
    if program is None or program.radius is None:
        return {}
    radii, weights = seen.system.sliding.ratio[0], seen.system.pair.weights
    if radii.min() <= program.radius <= radii.max():
        return {}
    mean = float(weights @ radii / weights.sum())
    return {"radius": program.radius, "least": radii.min(), "largest": radii.max(), "mean": mean}


def coarse_heat_steps(seen: Seen) -> Fields:
    """Return by how much halving the steps of the heat changes temperatures, beyond the tolerance."""
    heat, fineness = seen.system.case.heat, seen.system.exchange.fineness
    if heat is None or not fineness.change > heat.step_tolerance:
        return {}
    return {"steps": fineness.steps, "percent": 100 * fineness.change, "limit": heat.step_tolerance}


def coarse_heat_basis(seen: Seen) -> Fields:
    """Return by how much the reduced temperatures differ from those of the whole mesh, beyond the tolerance."""
    heat, fineness = seen.system.case.heat, seen.system.exchange.fineness
    if heat is None or not fineness.difference > heat.reduction_difference:
        return {}
    return {"percent": 100 * fineness.difference, "limit": heat.reduction_difference}


def unstable_speed(seen: Seen) -> Fields:
    """Return by how much sliding one way is faster than full contact is thermo-elastically stable."""
    system, motion = seen.system, seen.system.motion
    if system.case.heat is None or not isinstance(system, Tribosystem) or not motion.one_way:
        return {}
    try:
        critical = critical_speed(system, motion.directions[0])
    except (CaseError, ConvergenceError):  # nothing takes the heat away, or coefficients are of no uniform contact
        return {}
    if motion.mean_speed <= critical:
        return {}
    unit = "rad/s" if system.case.turns else "mm/s"
    return {"speed": motion.mean_speed, "critical": critical, "ratio": motion.mean_speed / critical, "unit": unit}


class _Readable(Formatter):
    """Fills numbers into a message, without exponents where they are large."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        """Return a field as text."""
        text = super().format_field(value, format_spec)
        return readable(value, 4) if format_spec.endswith("g") and "e+" in text else text


@dataclass(frozen=True)
class Rule:
    """A check of a state and its message.

    Attributes:
        find: Returns the fields of the message; none where all is well.
        key: Of the case, that changes it.
        message: With its fields.
        of: Kinds of states that it is about; "system" before anything is solved.
        latest: Whether a later state counts, as the width that a scar needs; else the first does.
    """

    find: Callable[[Seen], Fields]
    key: str
    message: str
    of: tuple[str, ...] = ("start", "run", "steady")
    latest: bool = False

    def text(self, seen: Seen) -> str:
        """Return the message about a state; "" where all is well."""
        fields: Any = self.find(seen)
        return _Readable().format(f"{self.key}: {self.message}", **fields) if fields else ""


# The key that each balance depends on, and what to do where it is not fulfilled.
BALANCES = {
    "force and moment": ("punch.supports", "Check the supports, or take smaller steps"),
    "heat": ("heat.operator", 'Set `heat.operator = "full"`, or reduce `heat.reduction_tolerance`'),
    "energy": ("stick.steps", "Increase `stick.steps`"),
    "worn volume": ("geometry", "Make the elements at the contact smaller"),
    "debris": ("contact.third_body", "Take smaller steps"),
}

RULES: dict[str, Rule] = {
    "balance": Rule(
        unbalanced,
        "{key}",
        "the balance of {name} is off by {percent:.2g} % of its largest term {when}. Do not use these results. "
        "{remedy}",
        ("run",),
    ),
    "unit": Rule(
        other_unit,
        "geometry.file",
        "a mesh is read in mm, and this one may be in {unit}: {odd}. Give lengths in mm: in a .geo "
        "add `Mesh.ScalingFactor = {factor:g};`",
        ("start", "system", "steady"),
    ),
    "hardness": Rule(
        above_hardness,
        "wear.{body}.hardness",
        "the mean contact pressure reaches {pressure:,.4g} MPa {when}, above the hardness of {limit:,.4g} MPa. The "
        "surface would yield, and an elastic contact does not. Reduce the load, or set `contact.hardness`",
    ),
    "strength": Rule(
        above_strength,
        "punch.loads",
        "the mean contact pressure reaches {pressure:,.4g} MPa {when}, above a tenth of Young's modulus of {material} "
        "({young:,.4g} MPa). No material is that strong. Reduce the load, or check its unit",
    ),
    "shakedown": Rule(
        above_shakedown,
        "contact.hardness",
        "the largest pressure is {pressure:,.4g} MPa {when}, above the shakedown limit of {limit:,.4g} MPa "
        "({factor:g} k by materials.{material}.yield_stress). The surface flows in every cycle, and an elastic contact "
        "does not. Reduce the load, or set `contact.hardness`",
    ),
    "broken": Rule(
        broken,
        "contact",
        "contact did not converge {when}: pressures and gaps violate p >= 0, gap >= 0, p gap = 0 by "
        "{percent:.2g} %. Do "
        "not use these results. Check the supports, or take smaller steps",
    ),
    "hot": Rule(
        hot,
        "heat",
        "the contact surfaces reach {temperature:,.4g} K {when}, above {limit:,.0f} K. Most metals have melted, and no "
        "property holds. Check the units of the heat data, `heat.conductance` and the boundaries that lose heat",
        ("run", "steady"),
    ),
    "depth": Rule(
        deep_elements,
        "geometry",
        "elements of the {body} {where} are {depth:.2g} mm deep, too deep for the contact {when}. The body is "
        "too stiff "
        "there, and pressures are too high by tens of per cent. Make elements there at most {allowed:.2g} mm "
        "deep. More "
        "elements along the contact do not help",
        ("start", "first", "steady"),
    ),
    "few": Rule(
        few_nodes,
        "geometry",
        "only {nodes} across the contact {when}. The largest pressure may be off by tens of per cent. {remedy}",
        ("start", "first", "steady"),
    ),
    "polygon": Rule(
        polygon,
        "geometry.order",
        "the curved contact surface of the {body} is meshed with straight sides that meet at {degrees:.2g} degrees. "
        "Pressures {when} have waves of about {waves:,.3g} MPa for it. Set `geometry.order = 2`, or give a .msh "
        "of order 2",
        ("start", "first", "steady"),
    ),
    "large": Rule(
        beyond_small_strain,
        "punch.loads",
        "the {body} moves by up to {farthest:.3g} mm: where it is strained it stretches by {stretched:.3g} % and turns "
        "by {turned:.3g} degrees. The linear theory, of small strains and rotations, is off by some {percent:.0f} % "
        "there. Reduce the load or the approach, or use a program for large displacements",
        ("start", "first"),
    ),
    "clipped": Rule(
        clipped,
        "geometry",
        "contact is clipped {when}: it reaches the end of the {end} {where}, and the bodies extend beyond it. "
        "Pressures and depths "
        "are those of a narrower surface: {then}",
        ("start", "run", "steady", "final"),
        latest=True,
    ),
    "chamfer": Rule(
        chamfer,
        "geometry",
        "the chamfer beside punch_contact comes into contact as the surface wears. The contact would be about "
        "{widened:.2g} mm wider than the {width:.3g} mm that are tagged. Make the chamfer part of `punch_contact`",
        ("run",),
        latest=True,
    ),
    "turned": Rule(
        turned,
        "geometry",
        "wear has moved a round contact by {percent:.2g} % of its radius {when}. Pressures and depths are "
        "counted along "
        "the normals of the unworn surfaces, and may be off by half as much",
        ("run",),
    ),
    "worn through": Rule(
        worn_through,
        "run.half_cycles",
        "the {body} is worn through {when}: it has lost {depth:.4g} mm where it was {thick:.4g} mm thick. "
        "Results after "
        "that are invalid. Reduce `run.half_cycles`, or make the {body} higher",
        ("run",),
    ),
    "stroke": Rule(
        stroke_taken_up,
        "contact.law",
        "the bodies follow friction elastically before they slide, by about {way:.3g} µm each way, {percent:.3g} "
        "% of the "
        "amplitude of {amplitude:.3g} µm. Gross sliding leaves that out: its slip and wear are too large by it. "
        "{remedy}",
        ("start", "system"),
    ),
    "radius": Rule(
        beside_radius,
        "program.radius",
        "distances are those at {radius:g} mm from the axis. The contact lies between {least:.4g} and "
        "{largest:.4g} mm, "
        "in the mean at {mean:.4g} mm",
        ("start", "system"),
    ),
    "layer": Rule(
        high_elements,
        "geometry",
        "the strip's elements below the contact are up to {height:.3g} mm high. The layer that heats up while "
        "its material "
        "passes is {thickness:.3g} mm thick, so the contact stays too cold. {remedy}",
        ("steady", "heat"),
    ),
    "speed": Rule(
        unstable_speed,
        "motion",
        "the speed, {speed:.4g} {unit}, is {ratio:.3g} times the critical speed of thermoelastic instability, "
        "{critical:.4g} {unit}. Full contact breaks up into hot bands that grow and move. A run does not become "
        "stationary, takes very many short half-cycles, and may not converge. Reduce speed or friction, or let more "
        "heat flow off",
        ("speed",),
    ),
    "steps": Rule(
        coarse_heat_steps,
        "heat.steps",
        "halving the {steps} steps of a half-cycle changes contact temperatures by {percent:.2g} %, more than "
        "heat.step_tolerance = {limit:g}. Increase `heat.steps`",
        ("heat",),
    ),
    "basis": Rule(
        coarse_heat_basis,
        "heat.reduction_tolerance",
        "contact temperatures or thermal gap differ from those of the whole mesh by {percent:.2g} %, more than "
        "heat.reduction_difference = {limit:g}. Reduce `heat.reduction_tolerance`",
        ("heat",),
    ),
}


def remarks(seen: Seen, *kinds: str) -> dict[str, str]:
    """Return the warnings of a state, by the rules' names; collective."""
    chosen = {name: rule.text(seen) for name, rule in RULES.items() if set(kinds or (seen.kind,)) & set(rule.of)}
    return {name: text for name, text in chosen.items() if text}
