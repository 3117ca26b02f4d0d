"""What is told of states that were computed as asked but can hardly be: clipped, too hot, harder pressed than hard."""

from __future__ import annotations

import numpy as np

from fenwear.arrays import Array
from fenwear.assembly import Tribosystem
from fenwear.bodies.elasticity import ElasticBody
from fenwear.case import Case
from fenwear.case.plausible import HOT
from fenwear.contact.complementarity import broken_text, complementarity_error
from fenwear.cycle import Block, SteadyState
from fenwear.plausibility.chamfer import contact_chamfer
from fenwear.plausibility.curved import curved_text
from fenwear.plausibility.depth import depth_text
from fenwear.plausibility.ends import ContactEnds, contact_ends, opened
from fenwear.plausibility.few import few_text
from fenwear.plausibility.grid_rim import grid_limits
from fenwear.plausibility.large import large_warnings
from fenwear.plausibility.layer import layer_warnings
from fenwear.plausibility.polygon import polygon_text
from fenwear.plausibility.rim import ContactRim, contact_rim
from fenwear.plausibility.size import size_warnings
from fenwear.plausibility.stroke import stroke_warnings
from fenwear.plausibility.thickness import least_thickness, thickness, worn_through
from fenwear.results.shakedown import shakedown_text
from fenwear.results.summary import net_of

SHALLOW = 1e-3  # of the contact surface's extent: depths that no body is thin enough for
STRONGEST = 0.1  # of Young's modulus: the strength of a perfect crystal, which no hardness exceeds


class StateMonitor:
    """Looks at the blocks of a run.

    Args:
        system: The assembled problem on meshes as they were made, not moved by wear; collective.
    """

    def __init__(self, system: Tribosystem) -> None:
        self.system, self.limits, self.chamfer = system, contact_limits(system), contact_chamfer(system)
        self._texts: dict[str, str] = {}
        self._first_clipped = 0
        self._first = True  # block
        self._thick: dict[str, Array] = {}
        self._least: dict[str, float] = {}

    def move(self, system: Tribosystem) -> None:
        """Look at another contact grid from now on; collective."""
        self.system, self.limits, self._thick, self._least = system, contact_limits(system), {}, {}

    def see(self, block: Block) -> list[str]:
        """Take the next block and return what is to be said of it that was not said of an earlier one."""
        case, weights = self.system.case, block.system.pair.weights
        found = {"clipped": self._clipped(block)}
        if self.chamfer is not None:
            found["chamfer"] = self.chamfer.text(self.chamfer.widened(self.system, block.end.worn))
        found["pressed"] = pressed(case, float(mean_pressures(block.pressure, weights).max()))
        hardest = int(np.argmax(block.pressure.max(axis=1)))
        when = f"in half-cycle {int(block.half_cycle[hardest]):,}"
        found["shakedown"] = shakedown_text(block.system, float(block.pressure.max()), when)
        last = block.end.worn
        deep = block.system.pair.opening(last.punch, last.strip)
        found["curved"] = curved_text(self.system.pair, deep, f"by half-cycle {int(block.half_cycle[-1]):,}")
        for name, elastic, depths in (
            ("punch", self.system.bodies.punch, block.wear),
            ("strip", self.system.bodies.strip, block.wear_strip),
        ):
            found[f"worn through, {name}"] = self._worn_through(block, name, elastic, depths)
        if self._first:
            found["few"] = few_across(self.system, self.limits, block.pressure[0], "at the start")
            found["polygon"] = polygon_text(self.system, block.pressure[0], "at the start")
            found |= {f"large {k}": text for k, text in enumerate(large_warnings(self.system))}
            self._first = False
        worst = int(np.argmax(block.complementarity_error))
        when = f"in half-cycle {int(block.half_cycle[worst]):,}"
        found["broken"] = broken_text(float(block.complementarity_error[worst]), when)
        if block.heat is not None:
            hottest = int(np.argmax(block.heat.largest_temperature))
            when = f"in half-cycle {int(block.half_cycle[hottest]):,}"
            found["hot"] = hot(float(block.heat.largest_temperature[hottest]), when)
        said = {kind: text for kind, text in found.items() if text}
        new = [text for kind, text in said.items() if kind not in self._texts]
        # The width that is needed grows with the scar; of the others the first time is what counts.
        self._texts = {**said, **self._texts, **{kind: said[kind] for kind in ("clipped", "chamfer") if kind in said}}
        return new

    def _worn_through(self, block: Block, name: str, elastic: ElasticBody, depths: Array) -> str:
        """Say that a body is worn through; "" if it is not."""
        if depths.max(initial=0.0) < SHALLOW * elastic.surface.extent():
            return ""
        if name not in self._least:
            self._least[name] = least_thickness(elastic)
        if depths.max(initial=0.0) < self._least[name]:
            return ""
        if name not in self._thick:
            self._thick[name] = thickness(elastic)
        thick = self._thick[name]
        gone = worn_through(elastic, thick, depths)
        if not gone.any():
            return ""
        first = int(np.argmax(gone))
        deepest = int(np.argmax(depths[first] - thick))
        return (
            f"from half-cycle {int(block.half_cycle[first]):,} on the {name} is worn through: it has lost "
            f"{depths[first, deepest]:.4g} mm where it was {thick[deepest]:.4g} mm thick, and what is computed from "
            f"there on is of no body; expected fewer half-cycles, or a higher {name}"
        )

    def warnings(self) -> list[str]:
        """Return what is to be said of all blocks so far."""
        return list(self._texts.values())

    def _clipped(self, block: Block) -> str:
        if self.limits is None:
            return ""
        carried = (block.pressure > 0) | (block.wear > 0)
        for contact in block.end.contacts:
            if contact is not None:
                carried[-1] |= contact.pressure[0] > 0
        touched = self.limits.touched(carried)
        if not touched.any():
            return ""
        self._first_clipped = self._first_clipped or int(block.half_cycle[np.argmax(touched)])
        worn, load = opened(self.system, block.end.worn), float(block.system.pair.weights @ block.pressure[-1])
        needed = self.limits.width_needed(worn, load)
        text = clipped_text(self.limits, self.limits.where(np.asarray(carried.any(axis=0))), needed, self.system.case)
        return f"from half-cycle {self._first_clipped:,} on {text}"


def contact_limits(system: Tribosystem) -> ContactEnds | ContactRim | None:
    """Return how the contact surface of a system ends; collective. None where nothing can clip the contact.

    Args:
        system: On meshes as they were made, not moved by wear.
    """
    grid = system.pair.punch.grid
    if grid is not None:
        return grid_limits(system, grid)
    return contact_rim(system) if system.pair.punch.dim == 3 else contact_ends(system)


def few_across(system: Tribosystem, limits: ContactEnds | ContactRim | None, pressure: Array, when: str) -> str:
    """Say that elements below the contact of pressures (n,) are deep, or few nodes lie across it; "" else; collective.

    A contact above deep elements is too narrow, so that few nodes across it are no cause.
    """
    width, net = None if limits is None else limits.hertzian(float(system.pair.weights @ pressure)), net_of(system)
    return depth_text(system, net, pressure, when, width or 0.0) or few_text(system.case, net, pressure, when, width)


def clipped_text(limits: ContactEnds | ContactRim, where: str, needed: float | None, case: Case) -> str:
    """Say that the contact is clipped, and how wide the surface should be."""
    how = "; set geometry.parameters.contact_width" if "contact_width" in case.geometry.parameters else ""
    if limits.of_grid:
        how = "; set grid.size, within the contact surface"
    wide = "" if needed is None else f"; a width of about {needed:.3g} mm is needed, it has {limits.width:.3g} mm"
    return (
        f"contact reaches the end of the {_ending(limits)} {where}, where the bodies go on smoothly: "
        f"it is clipped there, and pressures and depths are not those of a surface that is wide enough{wide}{how}"
    )


def _ending(limits: ContactEnds | ContactRim) -> str:
    """Return what ends where contact is clipped."""
    return "contact grid" if limits.of_grid else "meshed contact surface"


def mean_pressures(pressure: Array, weights: Array) -> Array:
    """Return the mean over what is in contact (k,), MPa, of pressures (k, n)."""
    return (pressure @ weights) / np.maximum((pressure > 0) @ weights, 1e-300)


def pressed(case: Case, pressure: float) -> str:
    """Say that a mean pressure is more than a body can carry; "" if it is not."""
    for body, law in case.wear.by_body.items():
        if law is not None and law.hardness is not None and pressure > law.hardness:
            return (
                f"the mean pressure of the contact reaches {pressure:,.4g} MPa, more than wear.{body}.hardness, "
                f"{law.hardness:,.4g} MPa: the surface would yield, and a linear-elastic contact does not"
            )
    used = case.used_materials
    softest = min(used, key=lambda name: case.initial_materials[name].young)
    young = case.initial_materials[softest].young
    if pressure > STRONGEST * young:
        return (
            f"the mean pressure of the contact reaches {pressure:,.4g} MPa, more than a tenth of Young's modulus of "
            f"{softest}, {young:,.4g} MPa: no material is so strong; expected a smaller load or another unit"
        )
    return ""


def hot(temperature: float, when: str) -> str:
    """Say that a temperature is too high to be believed; "" if it is not."""
    if not temperature > HOT:
        return ""
    return (
        f"the contact surfaces reach {temperature:,.4g} K {when}, more than {HOT:,.0f} K: most metals have melted, and "
        "no property holds; look at the units of the heat data, heat.conductance and what takes the heat away"
    )


def initial_warnings(system: Tribosystem) -> list[str]:
    """Return what is to be said of the contact before any wear; collective."""
    contact = system.phase_contact((0,)).solve(system.gap(0, system.unworn()))
    pressure, weights, limits = contact.pressure[0], system.pair.weights, contact_limits(system)
    texts = [pressed(system.case, float(mean_pressures(pressure[None], weights)[0]))]
    texts.append(shakedown_text(system, float(pressure.max()), "at the start"))
    error = complementarity_error(pressure, contact.gap[0], system.interface.elastic_length)
    texts.append(broken_text(float(error), "at the start"))
    texts.append(few_across(system, limits, pressure, "at the start"))
    texts.append(polygon_text(system, pressure, "at the start"))
    where = "" if limits is None else limits.where(pressure > 0)
    if limits is not None and where:
        needed = limits.width_needed(0.0, float(weights @ pressure))
        texts.append(clipped_text(limits, where, needed, system.case))
    told = size_warnings(system.case, system.bodies, system.rigid)
    return [*told, *(text for text in texts if text), *large_warnings(system, contact), *stroke_warnings(system)]


def steady_warnings(system: Tribosystem, state: SteadyState) -> list[str]:
    """Return what is to be said of a cyclic steady state; collective."""
    weights, limits = system.pair.weights, contact_limits(system)
    texts = [*size_warnings(system.case, system.bodies, system.rigid), *layer_warnings(system)]
    texts.append(pressed(system.case, float(mean_pressures(state.phase_pressure, weights).max())))
    texts.append(shakedown_text(system, float(state.phase_pressure.max()), "in the cyclic steady state"))
    texts.append(broken_text(state.complementarity_error, "in the cyclic steady state"))
    few = (few_across(system, limits, pressure, "in the cyclic steady state") for pressure in state.phase_pressure)
    texts.append(next((text for text in few if text), ""))
    texts.append(polygon_text(system, state.phase_pressure, "in the cyclic steady state"))
    if state.heat is not None:
        texts.append(hot(float(max(state.heat.punch.max(), state.heat.strip.max())), "in the cyclic steady state"))
    where = "" if limits is None else limits.where((state.phase_pressure > 0).any(axis=0) | (state.wear_per_cycle > 0))
    if limits is not None and where:
        reach = f"; a width of about {limits.reach:.4g} mm is needed, from edge to edge" if limits.reach else ""
        texts.append(
            f"contact reaches the end of the {_ending(limits)} {where}, where the bodies go on "
            f"smoothly: the scar of the cyclic steady state is as wide as what is meshed, "
            f"{limits.width:.4g} mm, whatever that is, and so are its pressures{reach}. "
            "A scar that still grows is followed by `run`"
        )
    return [text for text in texts if text]
