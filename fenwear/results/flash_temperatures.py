"""Temperatures of the contact of a finished run: flash of its last cycle, and the rise by the finite bodies.

It goes one way: pressures and wear of the run make the heat, and its temperatures do not act back on them. The
thermoelastic feedback measures how far that holds: heat mu v p that goes into both bodies by their
shares s_i raises waves of the number k by alpha_i (1 + nu_i) s_i / (K_i k^2), which pressures of E* k / 2 flatten,

    G = mu v E* sum of alpha_i (1 + nu_i) s_i / K_i / (2 k),

at rest and in the end: at G = 1 waves grow by themselves (R. A. Burton, Wear 59, 1980, 1; J. R. Barber, Wear 26, 1973,
425). It is reported for the longest wave that fits into the contact, k = 2 pi over its length.

Temperatures need from a run's case: materials that conduct, and a table of heat, of which a grid has none.

The output of flash temperatures: numbers, a text, and maps over the cycle as a dataset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from fenwear.bodies.elasticity import ElasticBody
from fenwear.bodies.half_space import extent_along
from fenwear.case import Case, Heat, Material, OneWay, Rotation, changed_case, heat_of, load_case
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import CaseError, InputError
from fenwear.heat.flash_partition import NO_BULK, Bulk, HeatedSide, bulk_of, mean_power, shared, spots_of
from fenwear.heat.moving_sources import Instants, Periodic, Response, cell_integrals, history_kernel
from fenwear.results.flash_source import Heating, Past, heating_of
from fenwear.results.history import CASE
from fenwear.results.quantity import BODIES
from fenwear.system import Bodies, build_conduction

NEEDED = ("conductivity", "heat_capacity", "density")
TAKEN = (
    *("partition", "debris", "conductance", "conductance_per_pressure", "convection"),
    *("ambient", "inflow", "initial"),
)
OTHERS = ("temperatures", "insulated")  # of a body


def run_case_of(path: Path, settings: Sequence[str]) -> tuple[Case, Heat]:
    """Return the case of a run with other values of what conducts, and its table of heat.

    Args:
        path: The case in the run's folder.
        settings: Overrides `key=value` of heat, materials, held temperatures and insulated boundaries.

    Raises:
        CaseError: they are of something else, or wrong; or the case has no contact grid.
    """
    case = load_case(path)
    if case.heat is not None:
        raise CaseError(InputError("heat", "expected a run without: this one has its temperatures in its history"))
    if case.model.kind != "solid":
        message = (
            "expected a solid: heat that enters a plane model along a line has no steady temperature, and rings no"
        )
        raise CaseError(InputError("model.kind", f"{message} grid"))
    if case.grid is None:
        raise CaseError(InputError("grid", "missing, but required: temperatures follow from pressures on a grid"))
    of_heat = [setting for setting in settings if setting.startswith("heat.")]
    others = [setting for setting in settings if setting not in of_heat]
    for other in others:
        key = other.partition("=")[0].strip()
        role, _, name = key.partition(".")
        if role != "materials" and not (role in case.bodies and name.partition(".")[0] in OTHERS):
            message = f"{key} is of the run itself; expected keys of heat, materials, or temperatures of a body"
            raise CaseError(InputError("--set", message))
    heat = heat_of(of_heat)
    given = [setting.partition("=")[0].strip().partition(".")[2] for setting in of_heat]
    problems = [
        InputError(f"heat.{key}", f"has no effect on flash temperatures; expected one of {', '.join(TAKEN)}")
        for key in given
        if key not in TAKEN
    ]
    if heat.conductance == "layer":
        problems.append(
            InputError("heat.conductance", "expected a number, or that per pressure: a grid has no 'layer'")
        )
    if heat.inflow is not None and not isinstance(case.motion, OneWay | Rotation):
        text = "expected one-way sliding: to and fro the same material stays, and none enters"
        problems.append(InputError("heat.inflow", text))
    if problems:
        raise CaseError(problems)
    return (changed_case(case, *others) if others else case), heat


@dataclass(frozen=True)
class Conductor:
    """The material of a body at its contact.

    Attributes:
        conductivity: K, N/(s K).
        diffusivity: kappa, mm²/s.
        material: Of it.
    """

    conductivity: float
    diffusivity: float
    material: Material


def conductors(bodies: Bodies, case: Case, heat: Heat, touching: Mask) -> list[Conductor]:
    """Return the conducting materials of punch and strip where they touch.

    Args:
        bodies: Both.
        case: With the materials.
        heat: Whose initial temperature they are taken at.
        touching: Nodes of the punch (n,).

    Raises:
        CaseError: a property is missing, or several materials touch.
    """
    conducting: list[Conductor] = []
    for name, body, shares in zip(case.bodies, case.bodies.values(), bodies.regions, strict=True):
        used = touching if name == "punch" else np.full(len(next(iter(shares.values()))), True)
        names = {body.regions[region] for region, share in shares.items() if (share[used] > 0).any()}
        materials = {key: case.materials[key].at(heat.initial, f"materials.{key}") for key in sorted(names)}
        problems = [
            InputError(f"materials.{key}.{needed}", "missing, but required: in the case or by --set")
            for key, material in materials.items()
            for needed in NEEDED
            if getattr(material, needed) is None
        ]
        if problems:
            raise CaseError(problems)
        properties = {
            key: (float(material.conductivity), float(material.density or 0.0) * float(material.heat_capacity))
            for key, material in materials.items()
        }
        if len(set(properties.values())) > 1:
            message = f"expected one material where the {name} touches, got {', '.join(properties)}"
            raise CaseError(InputError(f"{name}.regions", message))
        key, (conductivity, capacity) = next(iter(properties.items()))
        conducting.append(Conductor(conductivity, conductivity / capacity, materials[key]))
    return conducting


HALF_SPACE = "half-space"
FEW = 12  # nodes across what touches, below which temperatures are rough
FELT = 0.1  # share of a pressure that its bulge gives back, from which on it is told
QUICK = 1.0  # of the time in which heat spreads over the contact, over that of a stroke: beyond, instants feel others


@dataclass(frozen=True)
class FlashTemperatures:
    """Temperatures of a contact over a cycle, at t instants of m by n nodes.

    Attributes:
        heating: The source.
        heat: That goes into punch and strip (t, m, n), mW/mm².
        flash: Rise of the surfaces of both over their bulk (t, m, n), K.
        bulk: Addition of each finite body at the contact, K over the surroundings; None where it is not
            known.
        way: Its origin: "steady", "harmonics" or "instants".
        peclet: Largest v a / 2 kappa of both bodies, a half the contact's length.
        quick: a^2 / kappa over the time of a half-cycle, of both; 0 of one that is steady.
        feedback: G; None without `expansion`.
        across: Nodes across the contact along both axes.
        warnings: Remarks.
    """

    heating: Heating
    heat: tuple[Array, Array]
    flash: tuple[Array, Array]
    bulk: tuple[float, float] | None
    way: str
    peclet: tuple[float, float]
    quick: tuple[float, float]
    feedback: float | None
    across: tuple[int, int]
    warnings: tuple[str, ...]

    @property
    def powers(self) -> tuple[float, float]:
        """Mean heat into punch and strip, mW."""
        cell = self.heating.window.cell
        first, second = (mean_power(heat, cell) for heat in self.heat)
        return first, second


def flash_temperatures(directory: Path | str, settings: Sequence[str] = ()) -> FlashTemperatures:
    """Return the temperatures of the last cycle of a run on a contact grid; collective.

    Args:
        directory: Of the run.
        settings: Overrides `key=value` of its materials, of a table of heat, and of held temperatures.

    Raises:
        CaseError: there is no such run, or what its temperatures need is missing; names the keys.
        ConvergenceError: the share of the heat was not found.
    """
    folder = Path(directory)
    case, heat = run_case_of(folder / CASE, settings)
    heating = heating_of(run_case_of(folder / CASE, ())[0], folder)
    ever = np.zeros(len(heating.placed.pair.weights), dtype=bool)
    ever[heating.window.nodes] = heating.touching.any(axis=0)
    both = conductors(heating.placed.bodies, case, heat, ever)
    friction = (1 - heat.debris) * heating.heat
    bulks, remarks = _bulks(case, heat, heating, both)
    sides = [
        HeatedSide(
            _response(heating, conductor, moves=name == "strip"),
            conductor.conductivity,
            conductor.diffusivity,
            bulk or NO_BULK,
        )
        for name, conductor, bulk in zip(BODIES, both, bulks or (None, None), strict=True)
    ]
    into_punch = _shared(heat, heating, sides, friction)
    parts = into_punch, friction - into_punch
    flash = sides[0].response.apply(parts[0]), sides[1].response.apply(parts[1])
    powers = mean_power(parts[0], heating.window.cell), mean_power(parts[1], heating.window.cell)
    levels = None
    if bulks is not None:
        first, second = (bulk.base + bulk.per_power * power for bulk, power in zip(bulks, powers, strict=True))
        levels = first, second
    numbers = _numbers(heating, both)
    feedback = _feedback(heating, both, powers)
    warnings = [*remarks, *_warnings(heating, numbers, feedback)]
    way = "steady" if np.isinf(heating.period) else "instants" if heating.pasts else "harmonics"
    return FlashTemperatures(heating, parts, flash, levels, way, *numbers, feedback, _across(heating), tuple(warnings))


def _response(heating: Heating, conductor: Conductor, *, moves: bool) -> Response:
    """Return the half-space that a body is."""
    sides, shape, kappa = heating.window.sides, heating.window.shape, conductor.diffusivity
    if np.isinf(heating.period):
        velocity = heating.velocity if moves else np.zeros(2)
        x, y = (float(part) / (2 * kappa) for part in velocity)
        return Instants(conductor.conductivity, cell_integrals(shape, sides, float(np.hypot(x, y)), (x, y))[None])
    if heating.pasts:
        kernels = [
            history_kernel(
                shape,
                sides,
                kappa,
                heating.period,
                past if moves else partial(_still, past),
                heating.fastest if moves else 0.0,
            )
            for past in heating.pasts
        ]
        return Instants(conductor.conductivity, np.array(kernels))
    shifts = heating.shifts if moves else np.zeros_like(heating.shifts)
    return Periodic(conductor.conductivity, kappa, heating.period, sides, shape, shifts)


def _still(past: Past, before: Array) -> tuple[Array, Array]:
    """Return the heat of before of a body that stays in its place."""
    return np.zeros((len(before), 2)), past(before)[1]


def _shared(heat: Heat, heating: Heating, sides: Sequence[HeatedSide], friction: Array) -> Array:
    """Return the part of the heat that enters the punch (t, m, n), mW/mm²."""
    if heat.conductance == 0 and heat.conductance_per_pressure is None:
        return heat.partition * friction
    if heat.conductance_per_pressure is not None:
        first, second = heat.conductance_per_pressure
        per_pressure = first * second / (first + second)
        resistance = 1 / (per_pressure * np.where(heating.touching, heating.pressure, 1.0))
    else:
        conducts = np.inf if heat.conductance == "perfect" else float(heat.conductance)
        resistance = np.full(friction.shape, 1 / conducts)
    period = np.inf if heating.pasts else heating.period
    return shared(
        sides[0],
        sides[1],
        friction,
        heating.touching,
        heating.window.sides,
        period,
        resistance=resistance,
        given=heat.partition,
    )


def _bulks(
    case: Case, heat: Heat, heating: Heating, both: Sequence[Conductor]
) -> tuple[tuple[Bulk, Bulk] | None, list[str]]:
    """Return the rise by the finite bodies, None where one has no steady state, and the warnings; collective.

    Of a strip that goes one way the meshed part is none of its own: it is as warm as it comes, `heat.inflow`.
    """
    placed, grid, window = heating.placed, heating.grid, heating.window
    bodies = build_conduction(case.model_copy(update={"heat": heat}), placed.bodies.punch, placed.bodies.strip)
    elastics: tuple[ElasticBody, ElasticBody] = placed.bodies.punch, placed.bodies.strip
    x, powers = grid.flat[window.nodes.ravel()], window.cell * heating.heat.reshape(len(heating.heat), -1)
    places = np.broadcast_to(x, (len(powers), *x.shape)), x - heating.shifts[:, None]
    bulks: list[Bulk] = []
    remarks: list[str] = []
    for name, body, elastic, conductor, at in zip(BODIES, bodies, elastics, both, places, strict=True):
        spots = spots_of(at.reshape(-1, 2), powers.ravel())
        ends = np.array([extent_along(elastic, axis) for axis in grid.axes]).T
        beyond = bool((spots.places < ends[0]).any() or (spots.places > ends[1]).any())
        one_way = name == "strip" and np.isinf(heating.period)
        if elastic.operator == HALF_SPACE or beyond or one_way:
            bulks.append(Bulk(0.0 if heat.inflow is None or not one_way else heat.inflow - heat.ambient))
            if beyond:
                remarks.append(f"the {name} is not meshed as far as it slides: it is taken as a half-space")
            continue
        bulk = bulk_of(body, elastic, conductor.conductivity, spots)
        if bulk is None:
            text = f"the {name} loses heat nowhere and has no steady temperature. Results are the flash above the"
            return None, [f"{text} bulk alone. Set heat.convection or {name}.temperatures"]
        bulks.append(bulk)
    return (bulks[0], bulks[1]), remarks


def _numbers(heating: Heating, both: Sequence[Conductor]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the largest Peclet number of each body, and the time in which heat spreads over a half-cycle's."""
    half = float(heating.extent.max()) / 2
    first, second = (heating.fastest * half / (2 * conductor.diffusivity) for conductor in both)
    quick, quick_strip = (2 * half**2 / conductor.diffusivity / heating.period for conductor in both)
    return (first, second), (quick, quick_strip)


def _across(heating: Heating) -> tuple[int, int]:
    first, second = (round(length) for length in heating.extent / heating.window.sides)
    return first, second


def _feedback(heating: Heating, both: Sequence[Conductor], powers: tuple[float, float]) -> float | None:
    """Return G of the longest wave in the contact by the largest heat for a pressure; None without expansion."""
    materials = [conductor.material for conductor in both]
    if any(material.expansion is None for material in materials):
        return None
    touching = heating.touching
    per_pressure = float((heating.heat[touching] / heating.pressure[touching]).max(initial=0.0))  # mu v
    ease = sum((1 - material.poisson**2) / float(material.young) for material in materials)
    shares = np.abs(powers) / max(sum(powers), 1e-300)
    bulge = sum(
        float(conductor.material.expansion) * (1 + conductor.material.poisson) * share / conductor.conductivity
        for conductor, share in zip(both, shares, strict=True)
    )
    return per_pressure / ease * bulge * float(heating.extent.max()) / (4 * np.pi)


def _warnings(
    heating: Heating, numbers: tuple[tuple[float, float], tuple[float, float]], feedback: float | None
) -> list[str]:
    """Return the warnings about the temperatures."""
    warnings = []
    if min(_across(heating)) < FEW:
        warnings.append(
            f"the contact is {min(_across(heating))} nodes wide, and temperatures are rough below {FEW}. Use a finer "
            "contact grid"
        )
    if heating.pasts and max(numbers[1]) > QUICK:
        warnings.append(
            "each instant of the long stroke is computed independently, as if its share of heat were constant. Heat "
            f"spreads over the contact in {max(numbers[1]):.2g} half-cycles, where 1 is expected at most"
        )
    if feedback is not None and feedback > FELT:
        warnings.append(
            f"thermoelastic feedback is left out here: thermal expansion would raise the pressure by {feedback:.2g} "
            f"times itself. From about {FELT:g} on, the contact is smaller and hotter, with higher pressures"
        )
    return warnings


WAYS = {
    "steady": "the strip goes one way: steady, a source over which its material passes",
    "harmonics": "the strip goes to and fro: {steps} steps of the cycle, in harmonics of it",
    "instants": "the strip goes far to and fro: {steps} instants of the cycle, each with all that was before it",
}


def numbers(temperatures: FlashTemperatures) -> dict[str, Any]:
    """Return the numbers of `--json`."""
    heating, powers = temperatures.heating, temperatures.powers
    both = {
        name: {
            **_largest(temperatures, flash),
            "mean_flash_K": float(_means(temperatures, flash).max()),
            "mean_flash_over_cycle_K": float(_means(temperatures, flash).mean()),
            "by_finite_body_K": None if temperatures.bulk is None else temperatures.bulk[number],
            "largest_rise_K": None if temperatures.bulk is None else float(flash.max()) + temperatures.bulk[number],
            "power_mW": powers[number],
            "largest_peclet": temperatures.peclet[number],
            "spreading_over_half_cycle": temperatures.quick[number],
        }
        for number, (name, flash) in enumerate(zip(BODIES, temperatures.flash, strict=True))
    }
    return {
        "half_cycle": heating.half_cycle,
        "way": temperatures.way,
        "instants": len(heating.times),
        **both,
        "friction_power_mW": sum(powers),
        "share_into_punch": powers[0] / sum(powers) if sum(powers) else None,
        "stroke_mm": heating.way,
        "largest_speed_mm_per_s": heating.fastest,
        "contact_mm": heating.extent.tolist(),
        "nodes_across": list(temperatures.across),
        "thermal_feedback": temperatures.feedback,
        "warnings": [heating.placed.case.names.with_names(warning) for warning in temperatures.warnings],
    }


def _largest(temperatures: FlashTemperatures, flash: Array) -> dict[str, Any]:
    """Return the largest rise of a surface, and where and when it is."""
    instant, first, second = np.unravel_index(int(flash.argmax()), flash.shape)
    grid, window = temperatures.heating.grid, temperatures.heating.window
    place = grid.flat[window.nodes[first, second]]
    at = {f"at_{'xyz'[axis]}_mm": round(float(c), 9) + 0.0 for axis, c in zip(grid.axes, place, strict=True)}
    return {"largest_flash_K": float(flash.max()), **at, "at_time_s": float(temperatures.heating.times[instant])}


def _means(temperatures: FlashTemperatures, flash: Array) -> Array:
    """Return the means over the contact at each instant (t,), K."""
    touching = temperatures.heating.touching
    return np.asarray((flash * touching).sum(axis=(1, 2)) / np.maximum(touching.sum(axis=(1, 2)), 1))


def text(temperatures: FlashTemperatures, name: str) -> str:
    """Return the flash temperatures as a table for readers."""
    of = numbers(temperatures)
    along = {key: [of[body][key] for body in BODIES] for key in of["punch"]}

    def row(label: str, key: str, form: str = ".4g") -> str:
        values = (f"{value:{form}}" if value is not None else "-" for value in along[key])
        return f"{label:48}" + "".join(f"{value:>14}" for value in values)

    axes = [key for key in of["punch"] if key.startswith("at_") and key.endswith("_mm")]
    share = of["share_into_punch"]
    lines = [
        f"flash temperatures of {name}, of the cycle that half-cycle {of['half_cycle']:,} ends",
        f"  {WAYS[temperatures.way].format(steps=of['instants'])}",
        f"{'':48}{'punch':>14}{'strip':>14}",
        row("largest flash (K)", "largest_flash_K"),
        *(row(f"at {key[3]} (mm)", key) for key in axes),
        row("mean over the contact, largest (K)", "mean_flash_K"),
        row("... over the cycle (K)", "mean_flash_over_cycle_K"),
        row("what the finite body adds (K)", "by_finite_body_K"),
        row("largest rise over the surroundings (K)", "largest_rise_K"),
        row("mean heat into the body (mW)", "power_mW"),
        row("largest v a / 2 kappa", "largest_peclet", ".3g"),
        f"share of the heat into the punch {'-' if share is None else f'{100 * share:.4g} %'}",
    ]
    if temperatures.feedback is not None:
        lines.append(f"thermoelastic feedback, over the pressure {temperatures.feedback:.2g}")
    return "\n".join([*lines, *(f"warning: {warning}" for warning in temperatures.warnings)])


def dataset(temperatures: FlashTemperatures) -> xarray.Dataset:
    """Return maps at the instants of the cycle."""
    heating = temperatures.heating
    first, second = ("xyz"[axis] for axis in heating.grid.axes)
    places = heating.grid.flat[heating.window.nodes]
    over = ("instant", first, second)
    maps = {"pressure": (heating.pressure, "MPa", "contact pressure")}
    for body, heat, flash in zip(BODIES, temperatures.heat, temperatures.flash, strict=True):
        maps[f"heat_{body}"] = heat, "mW/mm2", f"heat of friction into the {body}"
        maps[f"flash_{body}"] = flash, "K", f"rise of the surface of the {body} over its bulk"
    variables: dict[str, Any] = {
        name: (over, values, {"units": unit, "long_name": words}) for name, (values, unit, words) in maps.items()
    }
    variables["time"] = ("instant", heating.times, {"units": "s", "long_name": "time from the cycle's begin"})
    lines = {first: places[:, 0, 0], second: places[0, :, 1]}
    coordinates = {axis: (axis, x, {"units": "mm", "long_name": f"{axis} of the nodes"}) for axis, x in lines.items()}
    attributes = {"half_cycle": heating.half_cycle, "way": temperatures.way, "Conventions": "CF-1.11"}
    if temperatures.bulk is not None:
        attributes |= {f"by_finite_{body}_K": rise for body, rise in zip(BODIES, temperatures.bulk, strict=True)}
    return xarray.Dataset(variables, coordinates, attributes)
