"""The shape to which partial slip wears in the end, directly.

Wear continues wherever there is slip and pressure. Half-planes of one material that stick in the middle of their
contact under a fixed load and tangential force keep this zone; around it wear continues until the pressure has vanished
there. So in the end the stick zone alone carries the load, and beside it the surfaces are worn by what they would
otherwise overlap at any time of the cycle (M. Ciavarella and D. A. Hills, J. Strain Anal. 34, 1999): one cycle with
contact in the stick zone only,

    p >= 0, gap >= 0, p gap = 0 in the stick zone;    p = 0, depth = max(0, -gap) outside of it.

Under a prescribed approach wear takes load off the contact. A prescribed motion of the strip then loses force with it,
and the zone stays, too. A tangential force Q stays: the zone shrinks. By the theorem of Ciavarella and Jaeger tractions
are mu times the difference of two normal problems, so that contact in a zone alone under the load P' holds

    Q = mu (P' - P_c),    P_c = P - Q_1 / mu,

P the load of the unworn bodies, and Q_1 the force whose zone this is on them: Q_1 = Q + mu (P - P'). Where no force
below mu P fulfils this the contact slides as a whole before.

A percent of the zone's width is ten of the depth, so that a zone of whole nodes would not do. In the plane its edges
are located within their elements (`edge`). A zone of nodes has an edge, too, which is that of a flat punch by the
surface beside it: the shape of the located zone lies between those of the two zones of nodes whose edges are on either
side, in equilibrium as they are. The remaining interval of each edge is reported.

Creep has come to its end: the state of a cycle that leaves it as it is.

Where nothing slips under pressure friction makes no heat. So in the end both bodies are as warm as held temperatures
and surroundings make them, and the shape is that of bodies of these temperatures.

Ends of a stick zone within their elements: in the plane, where the zone is one or more lengths along x.

From the edge c of a stick zone the slip of a cycle grows as (x - c)^(3/2), as that of half-planes does (Cattaneo).
A line through s^(2/3) at the second and third node that slip is zero there; the first one carries what the discrete
edge makes of it. On the exact solution that is within a tenth of the distance of the nodes, mostly: ends are known to
a quarter of it, where the edge of nodes that stick is off by up to a whole one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
import scipy

from fenwear.algebra.fixed_point import fixed_point
from fenwear.bodies.contact_surface import ContactSurface
from fenwear.common.arrays import Array, Mask
from fenwear.common.errors import ConvergenceError
from fenwear.laws.layers import PLASTIC
from fenwear.laws.wear import WornDepths
from fenwear.steps.run_state import none_yet, stacked
from fenwear.steps.steady_cycle import SteadyCycle, heat_of
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_state import TimeStepRecords

KNOWN = 0.25  # of the distance of nodes: how far an edge may be from where it is located


@dataclass(frozen=True)
class Edge:
    """An end of a stick zone.

    Attributes:
        node: The last one that sticks.
        side: 1 for an end to the right, -1 for one to the left.
        x: Where it is, mm.
        within: Half the interval that is left, mm.
    """

    node: int
    side: int
    x: float
    within: float


def stick_edges(x: Array, stick: Mask, slid: Array, closed: Mask) -> list[Edge]:
    """Return the ends of each stick zone, from left to right.

    Args:
        x: Of the contact nodes, ascending (n,), mm.
        stick: Nodes that stick all through a cycle (n,).
        slid: Slip of each in the cycle, to and fro (n,), mm.
        closed: Nodes that carry pressure at any time of it (n,).
    """
    step = np.diff(np.concatenate([[0], stick.astype(np.int8), [0]]))
    edges = []
    for first, last in zip(np.flatnonzero(step == 1), np.flatnonzero(step == -1) - 1, strict=True):
        edges += [_edge(x, int(first), -1, slid, closed), _edge(x, int(last), 1, slid, closed)]
    return edges


def _edge(x: Array, node: int, side: int, slid: Array, closed: Mask) -> Edge:
    beside, far = node + side, node + 3 * side
    if not 0 <= beside < len(x):
        return Edge(node, side, float(x[node]), 0.0)
    spacing = abs(float(x[beside] - x[node]))
    unknown = Edge(node, side, float(x[beside] + x[node]) / 2, spacing / 2)
    if not 0 <= far < len(x):
        return unknown
    places = np.array([node + 2 * side, far])
    grown = slid[places] ** (2 / 3)
    if not closed[[beside, *places]].all() or not 0 < grown[0] < grown[1]:
        return unknown
    near, away = x[places]
    at = side * float(near - grown[0] * (away - near) / (grown[1] - grown[0]))
    low, high = side * float(x[node]) - KNOWN * spacing, side * float(x[beside])
    return Edge(node, side, side * min(max(at, low), high), KNOWN * spacing)


def zone_width(edges: Sequence[Edge]) -> tuple[float, float]:
    """Return the width of the zones between these ends, and half the interval that is left of it, mm."""
    return sum(edge.side * edge.x for edge in edges), sum(edge.within for edge in edges)


def beside(surface: ContactSurface, zone: Mask) -> Mask:
    """Return the nodes beside a zone of pressure nodes: they share a facet with it (n,)."""
    facets = surface.number[surface.facets]
    touched = (zone[facets] & (facets >= 0)).any(axis=1)
    neighbours = np.zeros(len(zone), dtype=bool)
    neighbours[facets[touched][facets[touched] >= 0]] = True
    return neighbours & ~zone


FAR = 1e3  # times the largest gap: never closes
KEPT = 1e-3  # rise of the force over itself whose stick zone is the same
MOST_TIMES, SAME = 30, 1e-9  # times that contact and temperatures are found; their change, over the warmest
INSIDE = 0.12  # of a side of squares: by which a flat punch of them is as stiff as a smaller round one, F = 2 E* a d
LEFT, NEAR, BEYOND, FITTED = 0.25, 1.0, 4.0, 12  # nodes: what is left of an edge, and where slip is read; of them many
AWAY = ((6, 9), (3, 5))  # nodes beside a zone that place its end, the first two that there are
DOUBLED, HALVED = 40, 60  # times that bounds are doubled and halved to share a depth between coated bodies


@dataclass(frozen=True)
class FinalShape:
    """The end of partial-slip wear.

    Attributes:
        stick: The nodes within the zone that carries the load (n,).
        pressure: At the end of a cycle (n,), MPa.
        depth: Worn off both bodies together (n,), mm.
        gap: Beside the scar (n,), mm.
        worn: The depth shared between the bodies by their wear rates.
        pressures: In each time step of a cycle (k, n), MPa.
        size: Of the stick zone, mm; in a solid mm².
        deepest, volume: Largest depth, mm, and worn area, mm², in a solid volume, mm³, with the stick zone as large and
            as small as it may be; None where it was given as nodes.
        within: Half the interval that is left of the size.
        temperature: Of the contact surfaces of punch and strip (2, n), K; None without heat.
        system: The `Tribosystem` whose nodes these are: on a contact grid that grows, that of the end; None where it
            was found of a problem alone.
    """

    stick: Mask
    pressure: Array
    depth: Array
    gap: Array
    worn: WornDepths
    pressures: Array
    size: float
    deepest: tuple[float, float] | None = None
    volume: tuple[float, float] | None = None
    within: float = 0.0
    temperature: Array | None = None
    system: Any = None


def stick_zone(problem: PartialSlipProblem) -> Mask:
    """Return the nodes that stick all through the second cycle without wear (n,); collective.

    Nodes that slip in the first cycle only, until it has settled, do not wear further. Finite bodies rock, and their
    compliance along the surface differs from that across it; in the course of the wear that takes about a node at the
    edge.

    Raises:
        ConvergenceError: a time step did not converge.
    """
    return problem.led(lambda: _second_cycle(problem).stuck)


def _second_cycle(problem: PartialSlipProblem) -> TimeStepRecords:
    settled, _ = problem.cycle(problem.beginning(_crept(problem, problem.unworn())))
    return TimeStepRecords.joined(problem.cycle(settled)[1])


def _crept(problem: PartialSlipProblem, shape: WornDepths) -> WornDepths:
    """Return a shape whose bodies have crept as far as its cycles let them.

    Raises:
        ConvergenceError: something creeps without an end, or cycle and creep do not converge.
    """
    creep = problem.interface.creep
    if not creep.creeps:
        return shape
    if creep.endless:
        raise ConvergenceError(
            f"no final shape exists: {creep.endless} grows with the logarithm of time, for ever: follow it by `run`, "
            "or give it terms alone"
        )

    def advance(crept: Array) -> tuple[Array, WornDepths, bool]:
        crept_shape = replace(shape, crept=crept)
        at, _ = problem.cycle(problem.beginning(crept_shape))
        return creep.lasting(crept, at.contact.crept, problem.program.period), crept_shape, False

    def close(change: Array, crept: Array) -> bool:
        return float(np.abs(change).max()) <= SAME * max(float(np.abs(crept).max()), 1e-300)

    first = creep.beginning()
    return fixed_point(advance, first, close, "creep and the cycle that it belongs to did not converge")


def final_shape(problem: PartialSlipProblem, stick: Mask | None = None) -> FinalShape:
    """Return the shape to which partial slip wears; collective. With heat it and its temperatures go together.

    Args:
        problem: The bodies and what is done to them.
        stick: The nodes that never slip (n,); by default those of the second cycle, see `stick_zone`, in the plane
            between ends that are located within their elements.

    Raises:
        ConvergenceError: nothing sticks, so that wear never ends; the contact did not converge.
        CaseError: the bodies lose no heat.
    """
    return problem.led(partial(_without_flow, problem, stick))


def _without_flow(problem: PartialSlipProblem, stick: Mask | None) -> FinalShape:
    """Return the shape of bodies that nowhere flow: elsewhere it depends on the way there."""
    layers = problem.interface.layers
    if layers.hardness == np.inf:
        return _with_heat(problem, stick)
    at, _ = problem.cycle(problem.beginning())
    if not at.worn.between[layers.row(PLASTIC)].any():
        shape = _with_heat(problem.elastic(), stick)
        if shape.pressures.max() <= layers.hardness:
            return shape
    raise ConvergenceError(
        f"no final shape without plastic flow exists: pressures reach contact.hardness = {layers.hardness:.4g} MPa, "
        "and the plastic flow until then depends on the way there. Follow it by `run`"
    )


def _with_heat(problem: PartialSlipProblem, stick: Mask | None) -> FinalShape:
    heat = problem.heat
    if heat is None:
        return _final_shape(problem, stick)
    pressures = problem.beginning().contact.pressure[None].repeat(len(problem.program.steps), axis=0)
    before: Array = np.zeros((2, len(problem.weights)))
    for _ in range(MOST_TIMES):
        conductance = np.array([heat.exchange.conductance(pressure) for pressure in pressures])
        warm = heat.through(np.zeros_like(pressures), conductance).at_rest()
        shape, now = _final_shape(problem.kept_at(heat, warm), stick), heat.surfaces(warm)
        if np.abs(now - before).max() <= SAME * max(float(np.abs(now).max()), 1e-300):
            return replace(shape, temperature=now)
        pressures, before = shape.pressures, now
    raise ConvergenceError(f"contact and temperatures of the end did not converge in {MOST_TIMES} times")


def _final_shape(problem: PartialSlipProblem, stick: Mask | None) -> FinalShape:
    """Return the shape of bodies whose temperatures stay."""
    if stick is not None:
        return _of_nodes(problem, stick)
    forces = [step.force or 0.0 for step in problem.program.steps]
    force = max(map(abs, forces))
    shape, factor = _of_cycle(problem, problem), 1.0
    friction = float(problem.weights @ problem.friction / problem.weights.sum())
    load = problem.weights @ problem.beginning().contact.pressure if force else 0.0
    for _ in range(MOST_TIMES if force else 0):
        before, factor = factor, 1 + friction * float(load - (shape.pressures @ problem.weights).mean()) / force
        if factor - before <= KEPT:
            return shape
        try:
            shape = _of_cycle(problem, problem.driven(problem.program.with_force(factor)))
        except ConvergenceError as error:
            raise ConvergenceError(
                "no final shape exists: the approach is prescribed, so that wear unloads the contact until friction "
                "cannot hold the tangential force. The contact then slides as a whole. Follow it by `run`, or reduce "
                "stick.force"
            ) from error
    return shape


def _of_cycle(problem: PartialSlipProblem, driven: PartialSlipProblem) -> FinalShape:
    """Return the shape whose stick zone is that of the second cycle of a problem, the same or under another force."""
    records, middle = _second_cycle(driven), problem.interface.middle
    if middle.compliance.on_grid is not None and problem.interface.dim > 2:
        return _of_grid(problem, records)
    shape = None
    if problem.interface.dim == 2:
        slid = records.slip_magnitude.sum(axis=0)
        edges = stick_edges(middle.pair.x, records.stuck, slid, records.touched)
        shape = _of_edges(problem, edges) if len(edges) == 2 else None
    return _of_surface(problem, records.stuck) if shape is None else shape


def _of_nodes(problem: PartialSlipProblem, zone: Mask) -> FinalShape:
    """Return the shape with a zone of whole nodes."""
    return _shape(problem, zone, _carried(problem, zone), float(problem.weights @ zone))


def _of_surface(problem: PartialSlipProblem, zone: Mask) -> FinalShape:
    """Return the shape with a zone of whole nodes, and the shapes with one node more and less at each edge."""
    shape, surface = _of_nodes(problem, zone), problem.interface.middle.pair.punch
    wider, rim = beside(surface, zone), beside(surface, ~zone)
    inner = zone & ~rim
    other = [_of_nodes(problem, other_zone) if other_zone.any() else shape for other_zone in (zone | wider, inner)]
    return _ranged(problem, shape, [ranged.depth for ranged in other], float(problem.weights @ wider) / 2)


def _of_grid(problem: PartialSlipProblem, records: TimeStepRecords) -> FinalShape:
    """Return the shape whose zone has the size given by the slip beside the sticking nodes of a cycle, on a grid.

    From the edge of the zone on slip grows as distance^(3/2), so that the root of the area with less slip grows evenly
    with slip^(2/3), from that of the zone. A zone of squares carries as a round one whose radius is INSIDE of a side
    less than that of its area: so does a flat punch of squares, on 8 to 36 of them to a radius.
    """
    weights, stuck = problem.weights, records.stuck
    if not stuck.any():
        return _of_nodes(problem, stuck)
    slid = np.where(stuck, 0.0, records.slip_magnitude.sum(axis=0))
    slid = np.where(records.touched, slid, np.inf)
    order = np.argsort(slid, kind="stable")
    area, level = np.cumsum(weights[order]) - weights[order] / 2, slid[order] ** (2 / 3)
    least = float(weights @ stuck)
    side = float(np.sqrt(np.median(weights)))
    size, ring = least, 2 * np.sqrt(np.pi * least) * side
    beyond = (area > least + NEAR * ring) & (area < least + BEYOND * ring) & np.isfinite(level)
    if beyond.sum() > FITTED:
        size = float(np.polynomial.polynomial.polyfit(level[beyond], np.sqrt(area[beyond]), 1)[0] ** 2)

    def zone(extra: float) -> Mask:
        """Return the nodes that slip least, as many as carry like a zone so many nodes wider."""
        carried = size + (extra + INSIDE) * ring
        inside = np.zeros(len(weights), dtype=bool)
        inside[order[: max(int(np.searchsorted(area, carried)), 1)]] = True
        return inside

    shape = _of_nodes(problem, zone(0.0))
    other = [_of_nodes(problem, zone(extra)) for extra in (LEFT, -LEFT)]
    return replace(_ranged(problem, shape, [ranged.depth for ranged in other], LEFT * ring), size=size)


def _of_edges(problem: PartialSlipProblem, edges: Sequence[Edge]) -> FinalShape | None:
    """Return the shape with a zone between two located ends; None where the nodes beside it do not determine them."""
    x = problem.interface.middle.pair.x

    @lru_cache
    def between(left: int, right: int) -> tuple[Array, Array]:
        zone = np.zeros(len(x), dtype=bool)
        zone[left : right + 1] = True
        return _carried(problem, zone)

    nodes = [edge.node for edge in edges]
    pairs, ends = list[tuple[int, int]](), list[tuple[float, float]]()
    for k, edge in enumerate(edges):

        def end(node: int, k: int = k, edge: Edge = edge) -> float | None:
            zone_ends = [*nodes[:k], node, *nodes[k + 1 :]]
            if zone_ends[0] >= zone_ends[1] or not 0 <= node < len(x):
                return None
            return _end_of_nodes(problem, zone_ends[0], zone_ends[1], edge.side)

        here = end(edge.node)
        if here is None:
            return None
        other = edge.node + (edge.side if edge.side * (edge.x - here) > 0 else -edge.side)
        there = end(other)
        if there is None or there == here:
            return None
        pairs.append((edge.node, other))
        ends.append((here, there))

    def blended(shift: float) -> tuple[Array, Array]:
        """Return pressures and gaps with both ends moved out by a share of the remaining intervals."""
        shares = [
            (edge.x + edge.side * shift * edge.within - here) / (there - here)
            for edge, (here, there) in zip(edges, ends, strict=True)
        ]
        pressures, gap = (np.zeros_like(part) for part in between(nodes[0], nodes[1]))
        for which in itertools.product((0, 1), repeat=2):
            weight = float(np.prod([share if w else 1 - share for w, share in zip(which, shares, strict=True)]))
            parts = between(pairs[0][which[0]], pairs[1][which[1]])
            pressures, gap = pressures + weight * parts[0], gap + weight * parts[1]
        return pressures, gap

    width, within = zone_width(edges)
    zone = np.asarray((x > edges[0].x) & (x < edges[1].x))
    shape = _shape(problem, zone, blended(0.0), width)
    return _ranged(problem, shape, [np.maximum(-blended(shift)[1], 0.0) for shift in (1.0, -1.0)], within)


def _end_of_nodes(problem: PartialSlipProblem, first: int, last: int, side: int) -> float | None:
    """Return the place where the contact of a zone of nodes ends, mm; None where too few nodes are beside it.

    None, too, where a layer has a closure that is not linear.

    Beside a flat punch of this zone the surface goes down by kappa arcosh(x / c), x from the middle; kappa and the
    edge c follow from two nodes some way off. The nearest ones carry what the discrete edge makes of them: the second
    and third place the end of a zone that ends at a corner of quadratic elements 0.15 of a node's distance too far out.
    """
    position = problem.interface.creep.grown(problem.interface.middle, np.inf)
    x, n, zone = position.pair.x, len(problem.weights), np.arange(first, last + 1)
    end = last if side > 0 else first
    pairs = [(end + side * near, end + side * other) for near, other in AWAY]
    inside = [pair for pair in pairs if min(pair) >= 0 and max(pair) < n]
    if not inside:
        return None
    places = np.array(inside[0])
    if problem.interface.layers.closure is not None or problem.interface.layers.softens:
        return None
    r, k = position.modes.shape[1], len(zone)
    scale = float(np.median(position.compliance.diagonal()[:n]))
    system, load = np.zeros((k + r, k + r)), np.zeros(k + r)
    system[:k, :k] = position.compliance.entries(zone, zone) / scale
    system[:k, k:], system[k:, :k] = position.modes[zone], position.balance[:, zone]
    load[k:] = -problem.interface.loaded(None).resultant
    approach: Array = np.zeros(n)
    if not load.any():  # the punch is moved: as a flat one by as much as it comes nearer
        approach = position.interface.load_gap
        load[:k] = -approach[zone]
    if not load.any():
        return None
    solution = np.linalg.solve(system, load)
    beside = position.compliance.entries(places, zone) / scale @ solution[:k] + position.modes[places] @ solution[k:]
    beside += approach[places]
    near, far = -beside
    middle = (x[first] + x[last]) / 2
    distance, away = np.abs(x[places] - middle)
    if not 0 < near < far:
        return None

    def missing(inverse: float) -> float:
        return float(distance * np.cosh(far * inverse) - away * np.cosh(near * inverse))

    most = 1 / far
    while missing(most) < 0:
        most *= 2
    edge = distance / np.cosh(near * scipy.optimize.brentq(missing, 0, most))
    return float(middle + side * edge)


def _ranged(problem: PartialSlipProblem, shape: FinalShape, depths: Sequence[Array], within: float) -> FinalShape:
    """Return a shape with the largest depths and worn volumes of two others, the smaller first, and what is left."""
    low, high = sorted(float(depth.max()) for depth in depths)
    smaller, larger = sorted(float(problem.weights @ depth) for depth in depths)
    return replace(shape, deepest=(low, high), volume=(smaller, larger), within=within)


def _carried(problem: PartialSlipProblem, zone: Mask) -> tuple[Array, Array]:
    """Return pressures (k, n) and least gap (n,) of a cycle with contact in a zone only; negative where they overlap.

    Raises:
        ConvergenceError: the zone is empty; a time step did not converge.
    """
    if not zone.any():
        raise ConvergenceError(
            "no final shape exists: every node slips in a cycle, so that wear never ends. Reduce the "
            "stroke or the force, or set contact.law = 'gross-sliding'"
        )
    unworn = problem.unworn()
    gap = problem.opening(problem.interface.middle, unworn)
    far = FAR * (np.abs(gap).max() + float(np.abs(problem.interface.middle.compliance.diagonal()).max()))
    opened = np.where(zone, 0.0, far)
    carried = _crept(problem, replace(_with_debris_left(problem, zone), punch=opened))
    records = TimeStepRecords.joined(problem.cycle(problem.beginning(carried))[1])
    return records.pressure, np.asarray(records.gap.min(axis=0) - opened)


def _with_debris_left(problem: PartialSlipProblem, zone: Mask) -> WornDepths:
    """Return the unworn bodies with the debris that remains in the end: all of it where nothing slips."""
    unworn, layers, pair = problem.unworn(), problem.interface.layers, problem.interface.middle.pair
    if not layers.debris.present:
        return unworn
    share = zone.astype(float)
    if layers.strip_carries:
        share = (pair.wear_projection @ zone) / np.maximum(pair.wear_projection @ np.ones(len(zone)), 1e-300)
    return layers.with_thickness(unworn, share * layers.debris.initial)


def _shape(problem: PartialSlipProblem, zone: Mask, carried: tuple[Array, Array], size: float) -> FinalShape:
    """Return the shape of a zone, from the pressures and the least gap of a cycle."""
    pressures, gap = carried
    depth = np.maximum(-gap, 0.0)
    of_punch = _of_punch(problem, depth)
    worn = WornDepths(of_punch, problem.interface.middle.pair.wear_projection @ (depth - of_punch))
    return FinalShape(zone, pressures[-1], depth, np.maximum(gap, 0.0), worn, pressures, size)


def _of_punch(problem: PartialSlipProblem, depth: Array) -> Array:
    """Return the punch's part of a depth (n,): both bodies wear by their rates, through their coatings."""
    rates = [float(law.rate.mean()) for law in (problem.wear.punch, problem.wear.strip)]
    share = rates[0] / sum(rates) if sum(rates) > 0 else 1.0
    punch, strip = problem.coatings
    if not (punch.thickness.any() or strip.thickness.any()) or not 0 < share < 1:
        return np.asarray(share * depth)
    strip = strip.at(problem.interface.middle.pair.wear_interpolation)

    def lost(rubbed: Array) -> tuple[Array, Array]:
        return punch.depth(share * rubbed), strip.depth((1 - share) * rubbed)

    low, high = np.zeros_like(depth), np.maximum(depth, 1e-300)
    for _ in range(DOUBLED):
        high = np.where(sum(lost(high)) < depth, 2 * high, high)
    for _ in range(HALVED):
        middle = (low + high) / 2
        less = sum(lost(middle)) < depth
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return np.minimum(lost(high)[0], depth)


def cycle_of_final(shape: FinalShape) -> SteadyCycle:
    """Return the half-cycles of the end of partial-slip wear, with the pressures of their ends: nothing wears on."""
    system = shape.system
    strokes, steps = system.motion.half_cycles, system.law_state.problem.program.steps
    ends = [k for k, step in enumerate(steps) if steps[(k + 1) % len(steps)].half_cycle != step.half_cycle]
    adds, rate = stacked([none_yet(system.pair)] * strokes), shape.worn.times(0.0)
    warm = shape.temperature
    heat = None if warm is None else heat_of(*(np.tile(side, (strokes, 1)) for side in warm))
    return SteadyCycle(system, shape.pressures[ends], shape.pressures, adds, rate, {}, heat, moves=False)
