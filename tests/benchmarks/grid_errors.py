"""Errors of contact grids against closed forms by the nodes across the contact: Hertz, Cattaneo, Spence, a layer.

Errors are over the largest value; "at nodes" is the largest of any node inside, two spacings from borders, where
pressures and tractions turn with a root; "of means" is the mean square beside exact means over the nodes' rectangles.

python3 tests/benchmarks/grid_errors.py [NODES...]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "verification"))
sys.path.insert(0, str(Path(__file__).parents[1] / "bodies"))

from test_fine import on_layer

from fenwear.common.arrays import Array
from fenwear.laws.local_laws import BodyRate, LocalWear
from fenwear.steps.stick_cycle import PartialSlipProblem
from fenwear.steps.stick_final import final_shape
from fenwear.steps.stick_increment import advance
from fenwear.steps.stick_interface import untouched
from fenwear.steps.stick_state import Imposed, StickState
from fenwear_verify.half_space_stick import Elastic, OppositeBodies, on_grid
from fenwear_verify.stick_solids import RIGID, to_and_fro

YOUNG, LOAD, RADIUS, FRICTION, PULLED = 210_000.0, 100.0, 10.0, 0.5, 0.7
SPENCE = 0.2986  # friction by which half of the contact's radius sticks, with a rigid plane and nu = 0
HALF_AXES, TOP = (0.2080002, 0.1311640), 1750.100  # mm, MPa: crossed cylinders of 10 and 5 mm
WIDER, WORN = 1.08, 1.75  # grid over the contact, and over that before it has worn
POINTS = 64  # along the side of a node's square, for means over it
LAYERS = ((0.3, 1.0), (0.6, 1.1), (0.85, 1.2))  # radii over the thickness, and loads over those of a half-space
MESHES = ((8, 2), (12, 3), (16, 4))  # of the layer
AMPLITUDE, DEPTH, VOLUME = 1.58597e-3, 1.83246e-3, 2.55879e-4  # mm, mm³: to and fro, and where its wear ends


def pressed(bodies: OppositeBodies, gap: Array) -> tuple[StickState, Imposed]:
    """Return the state of bodies that are pressed on each other, and what is imposed at its end."""
    load, friction = bodies.loaded(None), np.full(len(gap), FRICTION)
    start = Imposed(load.times(0), gap)
    end = replace(start, loaded=load)
    return advance(bodies, untouched(bodies), start, end, friction), end


def cap(r: Array) -> Array:
    """Return sqrt(1 - r²) within 1, else zero."""
    return np.sqrt(np.maximum(1 - r**2, 0))


def mean_square(found: Array, exact: Array) -> float:
    """Return the error in the mean square over the exact values'."""
    return float(np.sqrt(((found - exact) ** 2).sum() / (exact**2).sum()))


def means(of: Callable[[Array], Array], x: Array, step: float) -> Array:
    """Return the means of a function of places (..., 2) over the squares of nodes (n,), to some 1e-5 at roots."""
    one = step * ((np.arange(POINTS) + 0.5) / POINTS - 0.5)
    within = np.stack(np.meshgrid(one, one), axis=-1).reshape(-1, 2)
    return np.array([of(node + within).mean() for node in x[:, :2]])


def told(
    row: str, nodes: int, begin: float, found: Array, exact: Array, inner: Array, over: Array | None = None
) -> None:
    """Print a row: errors of the largest value, in the mean square, at nodes, and beside means over their squares."""
    top, wrong, seconds = exact.max(), np.abs(found - exact), time.process_time() - begin
    largest, at_nodes = abs(found.max() / top - 1), (wrong / top)[inner].max()
    beside = "" if over is None else f"{mean_square(found, over):9.1e}"
    errors = f"{largest:9.1e} {mean_square(found, exact):12.1e} {at_nodes:9.1e} {beside:>9} {seconds:8.1f}"
    print(f"{row:38} {nodes:4} {errors}", flush=True)


def worn(nodes: int) -> None:
    """Print the errors of where the wear of partial slip ends, row 37: depth and volume."""
    body, begin = Elastic(YOUNG / 2.6, 0.3), time.process_time()
    a = (3 * LOAD * RADIUS / (4 * YOUNG / 0.91 / 2)) ** (1 / 3)
    count = 2 * int(WORN * nodes / 2)
    bodies = on_grid(body, body, 2 * a / nodes, (count, count), LOAD, RADIUS)
    n = len(bodies.middle.pair.weights)
    wear = LocalWear(BodyRate(np.full(n, 1e-8)), BodyRate(np.zeros(n), wears=False))
    problem = PartialSlipProblem(bodies, to_and_fro(AMPLITUDE, 2), wear, np.full(n, FRICTION))
    found = final_shape(problem)
    depth, volume = found.depth.max() / DEPTH - 1, problem.weights @ found.depth / VOLUME - 1
    seconds = time.process_time() - begin
    print(f"37 end of partial slip: {nodes} nodes, depth {depth:.1e}, volume {volume:.1e}, {seconds:.1f} s", flush=True)


def spence(nodes: int) -> None:
    """Print stick over contact and the largest pressure of a sphere held by a rigid plane, row 36: half, and 1.31."""
    begin, a = time.process_time(), (3 * LOAD * RADIUS / (4 * YOUNG)) ** (1 / 3)
    step, count, steps = 2 * a / nodes, 2 * round(WIDER * nodes / 2), nodes // 2
    bodies = on_grid(Elastic(YOUNG / 2, 0.0), RIGID, step, (count, count), LOAD, RADIUS)
    pair, state, load = bodies.middle.pair, untouched(bodies), bodies.loaded(None)
    start, friction = Imposed(load.times(0), pair.initial_gap), np.full(len(pair.weights), SPENCE)
    ratios = []
    for k in range(1, steps + 1):
        end = replace(start, loaded=load.times((k / steps) ** 3))  # the contact grows evenly
        state, start = advance(bodies, state, start, end, friction), end
        ratios.append(float(np.sqrt(pair.weights @ state.sticking / (pair.weights @ state.closed))))
    upper, top = np.array(ratios[steps // 2 :]), 1.5 * LOAD / (np.pi * a**2)
    seconds = time.process_time() - begin
    print(
        f"36 sphere held by a rigid plane: {nodes} nodes, stick over contact {upper.mean():.4f} in the mean of loads, "
        f"at most {np.abs(upper - 0.5).max():.1e} off, pressure {state.pressure.max() / top:.4f}, {seconds:.1f} s",
        flush=True,
    )


def layer_pressed(nodes: int, radius: float, larger: float, mesh: tuple[int, int]) -> None:
    """Print the errors of a sphere on a bonded layer against its exact kernel, row 55, by the mesh of the layer."""
    begin, wide = time.process_time(), 2.3 * radius
    ours, exact, x = on_layer(radius, larger, round(wide / (2 * radius) * nodes) + 1, wide, mesh)
    r, a = np.hypot(x[:, 0], x[:, 1]), np.hypot(x[:, 0], x[:, 1])[exact[0] > 0].max()
    row = f"55 sphere on a layer, {mesh[0]} by {mesh[1]}, a = {a:.2f} H"
    told(row, nodes, begin, ours[0], exact[0], r < a - 2 * wide / nodes)
    print(f"{'':38} {'':4} approach {ours[1] / exact[1] - 1:.1e}", flush=True)


def main() -> None:
    """Print the table."""
    print(f"{'':38} {'':4} {'largest':>9} {'mean square':>12} {'at nodes':>9} {'of means':>9} {'time (s)':>8}")
    for nodes in [int(text) for text in sys.argv[1:]] or [32, 64, 128]:
        for poisson in (0.3, 0.0):
            body, modulus = Elastic(YOUNG / (2 * (1 + poisson)), poisson), YOUNG / (1 - poisson**2) / 2
            a = (3 * LOAD * RADIUS / (4 * modulus)) ** (1 / 3)
            step, count, top = 2 * a / nodes, 2 * round(WIDER * nodes / 2), 1.5 * LOAD / (np.pi * a**2)
            begin, bodies = time.process_time(), on_grid(body, body, step, (count, count), LOAD, RADIUS)
            places = bodies.middle.pair.punch.x[:, :2]
            r = np.linalg.norm(places, axis=1)

            def pressure(x: Array, a: float = a, top: float = top) -> Array:
                return top * cap(np.linalg.norm(x, axis=-1) / a)

            state, start = pressed(bodies, bodies.middle.pair.initial_gap)
            if poisson:
                over = means(pressure, places, step)
                told("19 sphere, pressure", nodes, begin, state.pressure, pressure(places), r < a - 2 * step, over)
                continue
            c, begin = a * (1 - PULLED) ** (1 / 3), time.process_time()
            start = replace(start, displacement=None, force=0.0)
            end = replace(start, force=PULLED * FRICTION * LOAD)
            state = advance(bodies, state, start, end, np.full(len(r), FRICTION))

            def traction(x: Array, a: float = a, c: float = c, top: float = top) -> Array:
                r = np.linalg.norm(x, axis=-1)
                return np.asarray(FRICTION * top * (cap(r / a) - c / a * cap(r / c)))

            exact, over = traction(places), means(traction, places, step)
            inner = (np.abs(r - a) > 2 * step) & (np.abs(r - c) > 2 * step)
            told("34 sphere, traction, Q = 0.7 mu P", nodes, begin, state.traction[:, 0], exact, inner, over)
            wrong, near = (
                (state.traction[:, 0] - exact) ** 2 / (exact**2).sum(),
                [np.abs(r - one) < 2 * step for one in (a, c)],
            )
            shares = [float(np.sqrt(wrong[one].sum())) for one in (*near, ~near[0] & ~near[1])]
            print(f"{'':38} {nodes:4} of the mean square at the borders of contact and stick, elsewhere", *shares)
        body, step = Elastic(YOUNG / 2.6, 0.3), 2 * HALF_AXES[0] / nodes
        counts = tuple(2 * round(WIDER * half / step) for half in HALF_AXES)
        begin, bodies = time.process_time(), on_grid(body, body, step, counts, LOAD, RADIUS)
        places = bodies.middle.pair.punch.x[:, :2]
        state, _ = pressed(bodies, places**2 @ [0.5 / RADIUS, 1 / RADIUS])

        def crossed(x: Array) -> Array:
            return TOP * cap(np.linalg.norm(x / HALF_AXES, axis=-1))

        inner = np.linalg.norm(places / HALF_AXES, axis=1) < 1 - 2 * step / HALF_AXES[1]
        exact, over = crossed(places), means(crossed, places, step)
        told("20 crossed cylinders, pressure", nodes, begin, state.pressure, exact, inner, over)
        worn(nodes)
        spence(nodes)
        for radius, larger in LAYERS:
            for mesh in MESHES:
                layer_pressed(nodes, radius, larger, mesh)


if __name__ == "__main__":
    main()
