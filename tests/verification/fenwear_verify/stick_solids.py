"""Contact with stick in solids: spheres and a flat punch on half-spaces, whose compliance is exact."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from fenwear.common.arrays import Array, Mask
from fenwear.laws.local_laws import BodyRate, LocalWear
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_final import final_shape, stick_zone
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import untouched
from fenwear.steps.stick_jump import first_cycle, jumped
from fenwear.steps.stick_program import Program, TimeStep
from fenwear.steps.stick_state import Imposed, StickState
from fenwear_verify.half_space_stick import Elastic, OppositeBodies, half_spaces
from fenwear_verify.suite import Line, Plot, Result, Row, number, order, verification

YOUNG, RADIUS, LOAD, FRICTION = 210_000.0, 10.0, 100.0, 0.5  # MPa, mm, N
MOST = 0.7  # largest Q / (mu P) of the loop
RIGID = Elastic(1e12, 0.0)


def elastic(poisson: float) -> Elastic:
    """Return a half-space of Young's modulus YOUNG."""
    return Elastic(YOUNG / (2 * (1 + poisson)), poisson)


class Sphere:
    """A sphere of 10 mm on a flat under 100 N, both of steel but for Poisson's ratio, n squares over the radius a.

    Attributes:
        a, peak: Hertz' radius, mm, and largest pressure, MPa.
        softness: S, the sum of (2 - nu) / G of both bodies, 1/MPa.
    """

    def __init__(self, poisson: float, squares: int, reach: float = 1.2) -> None:
        body = elastic(poisson)
        modulus = YOUNG / (1 - poisson**2) / 2
        self.a = float((3 * LOAD * RADIUS / (4 * modulus)) ** (1 / 3))
        self.peak = 1.5 * LOAD / (np.pi * self.a**2)
        self.softness = 2 * (2 - poisson) / body.shear
        self.spacing = self.a / squares
        self.bodies = half_spaces(body, body, self.spacing, reach * self.a, LOAD, RADIUS)
        pair = self.bodies.middle.pair
        self.weights, self.r = pair.weights, np.linalg.norm(pair.punch.x, axis=1)

    def cap(self, radius: float) -> Array:
        """Return sqrt(1 - r²/R²), zero outside (n,)."""
        return np.asarray(np.sqrt(np.maximum(1 - (self.r / radius) ** 2, 0)))

    def traction(self, force: float) -> Array:
        """Return Cattaneo's traction at a force Q / (mu P) of one sign (n,), MPa."""
        c = (1 - abs(force)) ** (1 / 3)
        return np.sign(force) * FRICTION * self.peak * (self.cap(self.a) - c * self.cap(c * self.a))

    def displacement(self, force: float) -> float:
        """Return what the half-spaces give way by, mm: 3 mu P S / (16 a) [1 - (1 - Q/(mu P))^(2/3)]."""
        return float(3 * FRICTION * LOAD * self.softness / (16 * self.a) * (1 - (1 - force) ** (2 / 3)))

    def loop_energy(self) -> float:
        """Return the work of friction of a force that goes between plus and minus MOST, N mm."""
        q = MOST
        share = 1 - (1 - q) ** (5 / 3) - 5 * q / 6 * (1 + (1 - q) ** (2 / 3))
        return float(9 * (FRICTION * LOAD) ** 2 * self.softness / (10 * self.a) * share)

    def error(self, found: Array, exact: Array) -> float:
        """Return the L2 error over the norm of the exact field."""
        return self.norm(found - exact) / self.norm(exact)

    def norm(self, values: Array) -> float:
        """Return the L2 norm of a field (n,)."""
        return float(np.sqrt(self.weights @ values**2))

    def area_radius(self, zone: Mask) -> float:
        """Return the radius of a disc as large as a zone, over a."""
        return float(np.sqrt(self.weights @ zone / np.pi) / self.a)


def pressed(bodies: OppositeBodies, friction: float) -> tuple[StickState, Imposed]:
    """Return the contact under its load alone, and what is imposed then: no tangential force."""
    load, gap = bodies.loaded(None), bodies.middle.pair.initial_gap
    end = Imposed(load, gap)
    state = advance(bodies, untouched(bodies), replace(end, loaded=load.times(0)), end, np.full(len(gap), friction))
    return state, replace(end, displacement=None, force=0.0)


def follow(bodies: OppositeBodies, state: StickState, start: Imposed, forces: Iterable[float]) -> Iterator[StickState]:
    """Yield the contact after each of the tangential forces Q / (mu P)."""
    friction = np.full(len(start.opening), FRICTION)
    for force in forces:
        end = replace(start, force=force * FRICTION * LOAD)
        state = advance(bodies, state, start, end, friction)
        start = end
        yield state


@verification(
    "sphere-mindlin",
    "Partial slip of a sphere on a half-space: tangential force raised, taken back, and to and fro",
    "C. Cattaneo, 1938; R. D. Mindlin, 1949; R. D. Mindlin and H. Deresiewicz, J. Appl. Mech. 20, 1953",
)
def sphere_mindlin() -> Result:
    """Stick radius c = a (1 - Q/(mu P))^(1/3), exact for nu = 0, where tractions along the force displace along it.

    For nu = 0.3 theory leaves out the slip across the force. On the way back slip of the other sign enters from
    the edge; the work of friction of a whole loop is 9 mu² P² S / (10 a) times
    1 - (1 - q)^(5/3) - (5 q / 6) (1 + (1 - q)^(2/3)), q = Q / (mu P).
    """
    rows: list[Row] = []
    lines: list[Line] = []
    for poisson, close in ((0.0, 1e-3), (0.3, 5e-3)):
        sphere = Sphere(poisson, 16)
        state, start = pressed(sphere.bodies, FRICTION)
        up = list(follow(sphere.bodies, state, start, np.linspace(0, MOST, 15)[1:]))
        name, top = f"nu = {poisson:g}", up[-1]
        down = list(follow(sphere.bodies, top, replace(start, force=top.force), np.linspace(MOST, 0, 15)[1:]))
        back = sphere.traction(MOST) - 2 * sphere.traction(MOST / 2)
        left = sphere.norm(down[-1].traction[:, 0] - back) / sphere.norm(sphere.traction(MOST))
        node = sphere.spacing / sphere.a
        c = (1 - MOST) ** (1 / 3)
        rows += [
            number(
                f"{name}: displacement at Q = {MOST:g} mu P (mm)", sphere.displacement(MOST), top.displacement, close
            ),
            number(f"{name}: c / a, to half a node", c, sphere.area_radius(top.sticking), node / 2, scale=1.0),
            number(
                f"{name}: traction, L2 error", 0, sphere.error(top.traction[:, 0], sphere.traction(MOST)), 0.02, scale=1
            ),
            number(f"{name}: back at Q = 0, L2 error over the norm before", 0, left, 0.04, scale=1),
        ]
        path = [*np.linspace(MOST, -MOST, 41)[1:], *np.linspace(-MOST, MOST, 41)[1:]]
        loop = list(follow(sphere.bodies, top, replace(start, force=top.force), path))
        work = -sum(float(sphere.weights @ (one.traction * one.slip).sum(axis=1)) for one in loop)
        rows.append(number(f"{name}: work of friction of a loop (N mm)", sphere.loop_energy(), work, 0.02))
        if poisson == 0.0:
            across = max(float(np.abs(one.traction[:, 1]).max()) for one in loop)
            rows.append(number(f"{name}: traction across the force (MPa)", 0, across, 1e-9 * sphere.peak, scale=1))
            line = np.argsort(sphere.r)
            for what, found, exact in (("Q = 0.7 mu P", top, sphere.traction(MOST)), ("back to 0", down[-1], back)):
                lines += [
                    Line(f"exact, {what}", sphere.r[line], exact[line], reference=True),
                    Line(f"fenwear, {what}", sphere.r[line], found.traction[line, 0]),
                ]
    errors = [np.mean([_mean_error(squares, force) for force in (0.2, 0.4, 0.6, 0.8)]) for squares in (5, 10, 20)]
    rows.append(order("order of the L2 error, mean of four forces", 1, np.array(errors), 0.25))
    squares = 1 / np.array([5, 10, 20])
    plots = [
        Plot("Sphere in partial slip: traction", "r (mm)", "traction (MPa)", lines),
        Plot("Sphere in partial slip: error of the traction", "element size over a", "L2 error over its norm",
             [Line("mean over forces", squares, np.array(errors))], ("log", "log"), (1.0,)),
    ]  # fmt: skip
    return Result(rows, plots)


def _mean_error(squares: int, force: float) -> float:
    sphere = Sphere(0.0, squares)
    (state,) = follow(sphere.bodies, *pressed(sphere.bodies, FRICTION), [force])
    return sphere.error(state.traction[:, 0], sphere.traction(force))


@verification(
    "sphere-spence",
    "A sphere on a rigid plane that holds it by friction, under a load that rises in steps",
    "D. A. Spence, J. Elasticity 5, 1975: nu = 0, mu = 0.2986",
)
def sphere_spence() -> Result:
    """Stick radius half of the contact radius at every load; largest pressure 1.31 of Hertz. History matters."""
    friction, rows, peaks = 0.2986, list[Row](), list[float]()
    a = (3 * LOAD * RADIUS / (4 * YOUNG)) ** (1 / 3)
    peak = 1.5 * LOAD / (np.pi * a**2)
    lines: list[Line] = []
    for squares in (6, 12, 24):
        bodies = half_spaces(elastic(0.0), RIGID, a / squares, 1.1 * a, LOAD, RADIUS, "pressed")
        weights, gap = bodies.middle.pair.weights, bodies.middle.pair.initial_gap
        ratios, last = list[float](), None
        for count in (1, 2 * squares) if squares == 12 else (2 * squares,):
            state, load, ratios = untouched(bodies), bodies.loaded(None), []
            start = Imposed(load.times(0), gap)
            for k in range(1, count + 1):
                end = replace(start, loaded=load.times((k / count) ** 3))  # the contact grows evenly
                state, start = advance(bodies, state, start, end, np.full(len(gap), friction)), end
                ratios.append(float(np.sqrt(weights @ state.sticking / (weights @ state.closed))))
            if count == 1:
                rows.append(number("a single load step is wrong: stick radius over that of contact, less than", 0.3,
                                   ratios[0], 0.1, scale=1.0))  # fmt: skip
            last = state
        assert last is not None
        peaks.append(float(last.pressure.max() / peak))
        upper = np.array(ratios[len(ratios) // 2 :])
        rows += [
            number(f"{squares} squares over a: stick radius over that of contact, mean of loads", 0.5, upper.mean(),
                   0.3 / squares, scale=1.0),
            number(f"{squares} squares: its largest departure, to a node", 0.0, np.abs(upper - 0.5).max(),
                   1.0 / squares, scale=1.0),
        ]  # fmt: skip
        r = np.linalg.norm(bodies.middle.pair.punch.x, axis=1)
        line = np.argsort(r)
        lines.append(Line(f"{squares} squares over a", r[line] / a, last.pressure[line] / peak))
    rows += [
        number("largest pressure over Hertz', 24 squares", 1.31, peaks[-1], 0.01),
        order("order of it", 1, np.abs(np.diff(peaks)), 0.6),
    ]
    return Result(
        rows, [Plot("Sphere that sticks to a rigid plane: pressure", "r / a", "p over Hertz' largest", lines)]
    )


@verification(
    "flat-punch-stick",
    "A flat round punch that sticks to a half-space: its stiffness over that without friction",
    "V. I. Mossakovskii, 1963; D. A. Spence, 1968: (1 - nu) ln(3 - 4 nu) / (1 - 2 nu)",
)
def flat_punch_stick() -> Result:
    """1.0397 for nu = 0.25, 1.0286 for 0.3; ln 3 for nu = 0."""
    rows: list[Row] = []
    for poisson in (0.0, 0.25, 0.3):
        exact = (1 - poisson) * np.log(3 - 4 * poisson) / (1 - 2 * poisson)
        found = []
        for squares in (6, 12, 24):
            approaches = []
            for friction in (0.0, 1e3):
                bodies = half_spaces(elastic(poisson), RIGID, 1 / squares, 1.0, LOAD, np.inf, "pressed")
                approaches.append(float(pressed(bodies, friction)[0].rigid[0]))
            found.append(approaches[0] / approaches[1])
        rows += [
            number(f"nu = {poisson:g}: stiffness over that without friction", exact, found[-1], 1.5e-3),
            order(f"nu = {poisson:g}: order of its error", 1, np.abs(np.array(found) - exact), 0.4),
        ]
    return Result(rows)


def worn_end(sphere: Sphere, c: float, r: Array) -> Array:
    """Return the depth of the scar beside a stick zone of radius c, mm, at radii r.

    The zone alone carries the load: Hertz' pressure of this radius, and a flat punch for the rest of the load.
    """
    modulus = LOAD * 3 * RADIUS / (4 * sphere.a**3)
    rest = (LOAD - 4 * modulus * c**3 / (3 * RADIUS)) / (2 * modulus * c)  # what the flat punch sinks
    out = np.maximum(r, c)
    angle = np.arcsin(c / out)
    of_hertz = ((2 * c**2 - out**2) * angle + c * np.sqrt(out**2 - c**2)) / (np.pi * RADIUS)
    gap = out**2 / (2 * RADIUS) - c**2 / RADIUS - rest + of_hertz + 2 * rest / np.pi * angle
    return np.where(r > c, np.maximum(-gap, 0.0), 0.0)


def to_and_fro(amplitude: float, steps: int) -> Program:
    """Return cycles of a displacement to and fro, from minus to plus an amplitude, mm."""
    ends = amplitude * np.concatenate([np.linspace(-1, 1, steps + 1)[1:], np.linspace(1, -1, steps + 1)[1:]])
    step = partial(TimeStep, duration=1.0, offset=0.0, force=None, strain=0.0)
    lead = tuple(step(-1, None, displacement=float(e)) for e in np.linspace(0, -amplitude, steps // 2 + 1)[1:])
    cycle = tuple(step(k // steps, (k + 1) / (2 * steps), displacement=float(e)) for k, e in enumerate(ends))
    return Program(4, lead, cycle, 2, 2.0 * steps)


@verification(
    "sphere-wear-end",
    "Where partial slip wears a sphere to: the stick zone alone carries the load",
    "M. Ciavarella and D. A. Hills, J. Strain Anal. 34, 1999; closed form of the sphere",
)
def sphere_wear_end() -> Result:
    """Fixed amplitude, c = a / 2: scar to r = 0.280438, 1.83246e-3 deep, 2.55879e-4 mm³; and jumps that lead to it."""
    rows: list[Row] = []
    lines: list[Line] = []
    errors, volumes, ratios = list[float](), list[float](), list[float]()
    dense = np.linspace(0, 0.32, 3201, dtype=np.float64)
    for squares in (5, 10, 20):
        sphere = Sphere(0.3, squares, reach=1.7)
        amplitude = sphere.displacement(0.875)
        problem = _rig(sphere, amplitude, 1e-8)
        zone = sphere.r < sphere.a / 2
        if squares == 10:
            sticks = sphere.area_radius(stick_zone(problem))
            rows.append(number("amplitude of 1.58597e-3 mm: c / a of the first cycle, to half a node", 0.5, sticks,
                               0.5 / squares, scale=1.0))  # fmt: skip
        found = final_shape(problem, zone)
        exact = worn_end(sphere, sphere.area_radius(zone) * sphere.a, sphere.r)
        errors.append(sphere.error(found.depth, exact))
        volumes.append(float(problem.weights @ found.depth))
        ratios.append(volumes[-1] / float(problem.weights @ exact))
    modelled = worn_end(sphere, sphere.a / 2, dense)
    rows += [
        number("closed form: radius of the scar (mm)", 0.280438, dense[modelled > 0].max(), 1e-3),
        number("closed form: largest depth (mm)", 1.83246e-3, modelled.max(), 1e-5),
        number(
            "20 squares over a: pressure outside of the stick zone (MPa)", 0, found.pressure[~zone].max(), 0, scale=1
        ),
        number(
            "radius of the scar (mm), to a node", 0.280438, sphere.r[found.depth > 0].max(), sphere.spacing, scale=1
        ),
        number("largest depth (mm)", 1.83246e-3, found.depth.max(), 0.05),
        number("worn volume (mm³)", 2.55879e-4, volumes[-1], 0.07),
        number("worn volume over that of a zone of this area, from two sizes", 1, 2 * ratios[2] - ratios[1], 0.01),
        order("order of the worn volume", 1, np.array(ratios) - 1, 0.15),
        order("order of the depth's L2 error", 1, errors, 0.15),
    ]
    line = np.argsort(sphere.r)
    lines += [
        Line("closed form", dense, modelled, reference=True),
        Line("fenwear, directly", sphere.r[line], found.depth[line]),
    ]
    coarse = Sphere(0.3, 6, reach=1.7)
    problem = _rig(coarse, amplitude, 2e-7)
    end = final_shape(problem, stick_zone(problem))
    cycles = 10_000_000
    cycle = problem.led(lambda: first_cycle(problem, problem.beginning(), problem.unworn(), 0))
    while cycle.number < cycles:
        cycle = problem.led(partial(jumped, problem, cycle, cycles, 0.1))
    rows.append(number("6 squares over a: depth after 10,000,000 cycles by jumps, L2 error against it", 0,
                       coarse.error(cycle.worn.punch, end.depth), 5e-3, scale=1))  # fmt: skip
    return Result(rows, [Plot("End of partial-slip wear of a sphere: depth", "r (mm)", "depth (mm)", lines)])


def _rig(sphere: Sphere, amplitude: float, rate: float) -> PartialSlipProblem:
    n = len(sphere.weights)
    wear = LocalWear(BodyRate(np.full(n, rate)), BodyRate(np.zeros(n), wears=False))
    return PartialSlipProblem(sphere.bodies, to_and_fro(amplitude, 10), wear, np.full(n, FRICTION))
