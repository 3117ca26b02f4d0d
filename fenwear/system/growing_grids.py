"""Contact grids that grow: around the first contact as fine as asked for, wider with the scar, and coarser.

All grids of a run are parts of lattices through one point, the middle of the largest: a wider one has the nodes of
the one before, a coarser one every second of them. Values at nodes stay there, nothing is interpolated, and depths are
multiplied by a factor that keeps the worn volume, 1 but for the square of a spacing over the contact's width. Nothing
is factored again: half-spaces answer anywhere, and what a finite body does besides is known over the largest. The
stages of a program continue with the grid of the stage before; each begins with room for what its loads bring together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fenwear.bodies.grid_surface import RegularGrid
from fenwear.case import CONDENSED, Case
from fenwear.case.program import stages_of
from fenwear.common.arrays import Array, Mask
from fenwear.laws.wear import WornDepths
from fenwear.system.both_bodies import with_surfaces
from fenwear.system.contact_grids import on_grid
from fenwear.system.contact_setup import ContactSetup
from fenwear.system.placing import place_case_bodies
from fenwear.system.strokes import make_sliding
from fenwear.system.tribosystem import Tribosystem

T = TypeVar("T")

ROOM, NEAR = 0.25, 0.08  # of the contact's width beside it: what a new grid has, and below which a larger one is due
TRIES = 8  # of grids around the first contact
WITHIN = 0.06  # of the nodes across it: how far they may be off
EDGE = 1e-9  # of a spacing


def grows(placed: ContactSetup) -> bool:
    """Return whether the contact grid of placed bodies grows."""
    return placed.bodies.punch.reach is not None


def _grids(placed: ContactSetup) -> tuple[RegularGrid, RegularGrid, int]:
    """Return a grid that grows, the largest that it may become, and how many nodes its case asks for across."""
    grid, reach, wanted = placed.pair.punch.grid, placed.bodies.punch.reach, placed.case.grid
    assert grid
    assert reach
    assert wanted
    assert wanted.across
    return grid, reach.grid, wanted.across


def on_first_contact(system: Tribosystem) -> Tribosystem:
    """Return a system on a grid around its first contact, with as many nodes across as its case asks for; collective.

    Raises:
        ConvergenceError: a contact did not converge.
    """
    if not grows(system):
        return system
    for _ in range(TRIES):
        grid = system.team.lead(partial(_around_first, system))
        if grid is None:
            return system
        system = regridded(system, grid)
    return system


def regridded(system: Tribosystem, grid: RegularGrid) -> Tribosystem:
    """Return a system on another grid of its punch; collective."""
    before = system.bodies
    punch, strip = on_grid(system.case, system.sliding, before.punch, before.strip, grid)
    return system.law.renewed(system, with_surfaces(system.case, replace(before, punch=punch, strip=strip)))


def placed_on(placed: ContactSetup, grid: RegularGrid) -> ContactSetup:
    """Return placed bodies on another grid of their punch, without any elasticity; collective."""
    before, case = placed.bodies, placed.case
    punch, strip = on_grid(case, placed.sliding, before.punch, before.strip, grid)
    bodies = with_surfaces(case, replace(before, punch=punch, strip=strip))
    return place_case_bodies(case, bodies, placed.sliding)


def relaid(system: Tribosystem, case: Case, grid: RegularGrid | None = None) -> Tribosystem:
    """Return the system of a case whose grid or motion alone is another one, on the same bodies; collective.

    Args:
        system: Whose bodies answer on any grid, on meshes as they were made.
        case: The other one.
        grid: Its grid, where it stays; by default the same.
    """
    reach = system.bodies.punch.reach
    first = (grid or system.pair.punch.grid) if reach is None else reach.grid
    assert first is not None
    sliding = make_sliding(case).over(system.pair, system.sliding.pairs)
    return on_first_contact(regridded(replace(system, case=case, sliding=sliding), first))


def answers_anywhere(system: Tribosystem) -> bool:
    """Return whether the bodies of a system answer on any grid, on meshes as they were made."""
    case, bodies = system.case, system.bodies
    if case.grid is None or bodies.followed is not None or bodies.warmed is not None:
        return False
    return CONDENSED not in (bodies.punch.operator, bodies.strip.operator)


def outgrown(system: ContactSetup, touched: Mask) -> RegularGrid | None:
    """Return a larger or coarser grid where the contact asks for one, else None.

    Args:
        system: Placed bodies.
        touched: Nodes of the punch that touch or have worn (n,).
    """
    if not grows(system) or not touched.any():
        return None
    grid, largest, across = _grids(system)
    low, high = _ends(grid, touched)
    width = high - low + 1
    coarser = bool(width.max() >= 2 * across)
    first, last = _within(grid, largest)  # of the largest grid, in places of this one
    beside = np.maximum(NEAR * width, 2.0)
    close = ((low < beside) & (first < 0)) | ((np.array(grid.counts) - 1 - high < beside) & (last >= grid.counts))
    if not coarser and not close.any():
        return None
    room = np.ceil(ROOM * width).astype(np.int64)
    wider = low - room, high + room
    if not coarser:  # what it has stays
        wider = np.minimum(wider[0], 0), np.maximum(wider[1], np.array(grid.counts) - 1)
    return _part(grid, largest, *wider, 2 if coarser else 1)


def on_sufficient_grid(
    system: Tribosystem, find: Callable[[Tribosystem], T], touched: Callable[[T], Mask]
) -> tuple[Tribosystem, T]:
    """Return a system on a grid with room for an end that is found on it, and this end; collective.

    Args:
        system: To begin with.
        find: The end of a system.
        touched: Nodes of the punch that touch or have worn in an end (n,).
    """
    end = find(system)
    while (grid := outgrown(system, touched(end))) is not None:
        system = regridded(system, grid)
        end = find(system)
    return system, end


def with_room(system: Tribosystem, worn: WornDepths, carries: Mask, load: float) -> RegularGrid | None:
    """Return a larger grid where loads that begin to act ask for one, else None; collective.

    Args:
        system: On the grid as it is.
        worn: Depths.
        carries: Nodes of the punch that have touched or worn (n,).
        load: Factor of all loads.
    """

    def larger_grid() -> RegularGrid | None:
        contact = system.phase_contact((0,))
        contact.press(load)
        return outgrown(system, carries | (contact.solve(system.gap(0, worn)).pressure[0] > 0))

    return system.team.lead(larger_grid)


def at_rim(system: ContactSetup, touched: Mask) -> bool:
    """Return whether some nodes of the punch lie on the rim of a grid that can still grow there."""
    if not grows(system) or not touched.any():
        return False
    grid, largest, _ = _grids(system)
    low, high = _ends(grid, touched)
    first, last = _within(grid, largest)
    return bool((((low == 0) & (first < 0)) | ((high == np.array(grid.counts) - 1) & (last >= grid.counts))).any())


def carried(worn: WornDepths, before: Tribosystem, after: Tribosystem) -> WornDepths:
    """Return depths and states on another grid: old values at common nodes, initial values elsewhere."""
    (on_punch, on_strip), start = node_maps(before, after), after.unworn()
    return replace(
        start,
        crept=after.elastic.creep.from_other(before.elastic.creep, worn.crept, on_punch),
        punch=kept_volume(worn.punch, on_punch, before.pair.weights, after.pair.weights),
        strip=kept_volume(worn.strip, on_strip, before.pair.strip.weights, after.pair.strip.weights),
        between=on_nodes(worn.between, on_punch, start.between),
        carried=on_nodes(worn.carried, on_strip, start.carried),
    )


def node_maps(before: ContactSetup, after: ContactSetup) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the node before at the place of each node of the punch and of the strip after, -1 for none."""
    maps = []
    for old, new in ((before.pair.punch, after.pair.punch), (before.pair.strip, after.pair.strip)):
        assert old.grid
        assert new.grid
        maps.append(new.grid.of_other(old.grid))
    return maps[0], maps[1]


def kept_volume(depth: Array, nodes: NDArray[np.int64], before: Array, after: Array) -> Array:
    """Return depths (..., n) at other nodes, zero where none was, times what keeps the volume.

    Args:
        depth: Worn (..., n), mm.
        nodes: The old node of each new one (n_new,), -1 for none.
        before, after: Areas of old and new nodes, mm or mm².
    """
    moved = on_nodes(depth, nodes, np.zeros((*depth.shape[:-1], len(nodes))))
    volume, now = depth @ before, moved @ after
    return np.asarray(moved * np.divide(volume, now, out=np.ones_like(now), where=now != 0)[..., None])


def on_nodes(values: Array, nodes: NDArray[np.int64], start: Array) -> Array:
    """Return values (..., n) at other nodes, where none was those at the start (..., n_new)."""
    if not values.size:
        return start
    return np.where(nodes >= 0, values[..., np.maximum(nodes, 0)], start)


def _first_load(system: Tribosystem) -> float:
    """Return the factor of all loads at the beginning of a run: that of a program, where the case has one."""
    stages = stages_of(system.case)
    if not stages:
        return 1.0
    load, factor = stages[0].load, stages[0].load_factor[0]
    return factor if load is None or system.normal_force <= 0 else load[0] / system.normal_force


def _ends(grid: RegularGrid, touched: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the least and largest places of some nodes along the axes of a grid."""
    places = grid.places[touched]
    return places.min(axis=0), places.max(axis=0)


def _within(grid: RegularGrid, reach: RegularGrid) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and last places of a grid's lattice within the largest grid."""
    steps = np.array(grid.spacing)
    low = (np.array(reach.corner) - np.array(grid.corner)) / steps
    return np.ceil(low - EDGE).astype(np.int64), np.floor(low + reach.sides / steps + EDGE).astype(np.int64)


def _part(
    grid: RegularGrid, reach: RegularGrid, low: NDArray[np.int64], high: NDArray[np.int64], every: int
) -> RegularGrid:
    """Return the grid of every so many places of another one, from some on to others, within the largest grid."""
    steps = np.array(grid.spacing)
    middle = np.rint((reach.middle - np.array(grid.corner)) / steps).astype(np.int64)  # which all lattices go through
    half = np.floor(reach.sides / 2 / (every * steps) + EDGE).astype(np.int64)
    first = np.maximum(np.floor((low - middle) / every).astype(np.int64), -half)
    last = np.minimum(np.ceil((high - middle) / every).astype(np.int64), half)
    corner = reach.middle + first * every * steps
    return replace(
        grid,
        corner=tuple(float(coordinate) for coordinate in corner),
        spacing=tuple(float(every * step) for step in steps),
        counts=tuple(int(count) for count in last - first + 1),
    )


def _around_first(system: Tribosystem) -> RegularGrid | None:
    """Return a grid around the first contact with as many nodes across as asked for; None where it has them."""
    grid, largest, across = _grids(system)
    contact = system.phase_contact((0,))
    contact.press(_first_load(system))
    touched = contact.solve(system.gap(0, system.unworn())).pressure[0] > 0
    low, high = _ends(grid, touched)
    steps, width = np.array(grid.spacing), high - low + 1
    longest = int(np.argmax(width * steps))
    even = grid is not largest
    if even and abs(width[longest] - across) <= max(WITHIN * across, 1.0) and not at_rim(system, touched):
        return None
    spacing = float(width[longest] * steps[longest]) / across
    middle = np.array(grid.corner) - largest.middle + steps * (low + high) / 2
    half = (0.5 + ROOM) * width * steps
    lattice = replace(largest, corner=tuple(largest.middle), spacing=(spacing,) * len(steps))
    first, last = (np.floor((middle + side * half) / spacing).astype(np.int64) for side in (-1, 1))
    return _part(lattice, largest, first, last, 1)
