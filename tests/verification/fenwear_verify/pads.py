"""Two pads on a disc against each pad alone, on a mesh of its own, with what the other does to the disc imposed.

The whole has both pads on one disc, which carries the loads of one to the other. Alone, pad k lies on a disc of another
mesh, whose surface is bent by the other pad's traction as that pad's own disc answers,

    gap_k = g_0 + w_k - U_kl p_l . e_n,

with U_kl the displacement at the nodes of pad k, half a turn further, by unit pressures and their friction on pad l.
Both pressures are taken in turn until they repeat. What the other pad changes is compared by its moments over the pad,
along its arc, across it and across it squared: p with the other less p without, in the whole as alone.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CloughTocher2DInterpolator

from fenwear import vary
from fenwear.common.arrays import Array, Mask
from fenwear.contact import SlidingContact
from fenwear.system import Tribosystem
from fenwear_verify.bodies import builtin
from fenwear_verify.brakes import INNER, OUTER, PADS, SPEED
from fenwear_verify.full_space import FullContact
from fenwear_verify.suite import Result, Row, number, observed_order, profile, verification

TURNS, MIDDLE = 12, (INNER + OUTER) / 2
PAD, DISC = 2e-6, 2e-7  # wear coefficients, 1/MPa
OTHER = {"front": "back", "back": "front"}


def on_disc(across: int, around: int, *settings: str) -> Tribosystem:
    """Return pads of a soft lining on a thin disc, which feel each other; collective."""
    return builtin(
        "disc-brake-two-pads",
        "geometry.parameters.same_face=1",
        "geometry.parameters.disc_height=10",
        "geometry.parameters.disc_layers=2",
        f"geometry.parameters.across={across}",
        f"geometry.parameters.around={around}",
        "materials.lining.young='0.5 GPa'",
        f"wear.punch={{coefficient={PAD}}}",
        *settings,
    )


def whole(across: int) -> Tribosystem:
    """Return both pads on one disc; collective."""
    return on_disc(
        across,
        12 * across,
        f"geometry.parameters.along={2 * across}",
        *(f"geometry.parameters.{name}_angle={angle}" for name, (angle, _) in PADS.items()),
        *(f"punch.loads.{k}.force=[0, 0, {-load}]" for k, (_, load) in enumerate(PADS.values())),
    )


def alone(name: str, across: int) -> Tribosystem:
    """Return one pad on a disc of its own, of other elements than the whole's; collective."""
    angle, load = PADS[name]
    return on_disc(
        across + 1,
        9 * across,
        f"geometry.parameters.along={2 * across + 1}",
        f"geometry.parameters.front_angle={angle}",
        "geometry.parameters.back_angle=0",
        f"punch.loads=[{{on='punch_front', force=[0, 0, {-load}]}}]",
    )


def unrolled(x: Array) -> Array:
    """Return places (n, 3) as radius and way along the mean radius from the middle of a pad at x > 0 (n, 2), mm."""
    return np.stack([np.hypot(x[:, 0], x[:, 1]), MIDDLE * np.arctan2(x[:, 1], x[:, 0])], axis=1)


def answer(system: Tribosystem, x: Array) -> Array:
    """Return the disc's displacement along z half a turn from x (n, 3) by unit pressures and their friction (n, m)."""
    pair, strip = system.pair, system.bodies.strip
    force = (pair.normal + system.phases.middle_ratio(1)) * pair.weights[:, None]
    right = strip.trace.place(-(pair.transfer.T.toarray()[:, None, :] * force.T[None]))
    right[strip.supported] = 0.0
    lifted = strip.trace.pick(strip.solve(right))[:, 2]
    behind = strip.surface.trace * np.array([-1.0, -1.0, 1.0])
    return np.asarray(CloughTocher2DInterpolator(unrolled(behind), lifted)(unrolled(x)))


def moments(system: Tribosystem, own: Mask, change: Array) -> Array:
    """Return moments of a change of pressure (own,) over a pad: along it, across it, and across it squared (3,)."""
    x = system.pair.punch.x[own]
    turned = x * np.array([np.sign(x[0, 0]), np.sign(x[0, 0]), 1.0])
    radius, way = (unrolled(turned) - np.array([MIDDLE, 0.0])).T / (OUTER - MIDDLE)
    return np.array([way, radius, radius**2]) @ (system.pair.weights[own] * change)


class Worn:
    """A system that wears step by step, an explicit turn each."""

    def __init__(self, system: Tribosystem) -> None:
        self.system, self.contact, self.worn = system, system.contact((1,)), system.unworn()
        self.pressure = np.full(len(system.pair.weights), system.rigid.mean_pressure)

    def press(self, imposed: Array | float = 0.0) -> None:
        """Find the pressure, with a gap imposed besides, mm."""
        self.pressure = self.contact.solve(self.system.gap(0, self.worn) + imposed).pressure.reshape(-1)

    def wear(self) -> None:
        """Wear for a turn."""
        self.worn = self.worn + self.system.phases.mean_wear.worn(self.pressure[None])


def changed(across: int) -> tuple[dict[str, list[Array]], dict[str, list[Array]], Tribosystem]:
    """Return moments of what the other pad changes, in the whole and alone, of each pad at the start and at the end."""
    both = whole(across)
    front, back = (f"punch.loads.{k}.force=[0, 0, {-1e-9 * load}]" for k, (_, load) in enumerate(PADS.values()))
    together = Worn(both)
    without = {"front": Worn(vary(both, back)), "back": Worn(vary(both, front))}
    apart = {name: Worn(alone(name, across)) for name in PADS}
    single = {name: Worn(apart[name].system) for name in PADS}
    through = {name: answer(apart[OTHER[name]].system, apart[name].system.pair.punch.x) for name in PADS}
    found: tuple[dict[str, list[Array]], dict[str, list[Array]]] = ({n: [] for n in PADS}, {n: [] for n in PADS})
    for turn in range(TURNS + 1):
        for one in (together, *without.values(), *single.values()):
            one.press()
        for _ in range(4):  # what goes through the disc and back falls by a hundred each time
            for name, one in apart.items():
                one.press(-(through[name] @ apart[OTHER[name]].pressure) * one.system.pair.normal[:, 2])
        if turn in (0, TURNS):
            for name, one in apart.items():
                own, every = both.pair.punch.nodes_of(name), np.full(len(one.pressure), fill_value=True)
                found[0][name].append(moments(both, own, (together.pressure - without[name].pressure)[own]))
                found[1][name].append(moments(one.system, every, one.pressure - single[name].pressure))
        for one in (together, *without.values(), *single.values(), *apart.values()):
            one.wear()
    return *found, both


@verification(
    "pads-apart",
    "Two pads on a disc meshed whole against each pad alone on its own mesh, the other imposed; against full space",
    "What the other pad changes, by its moments; approach of worn-in pads; all displacements as unknowns",
    slow=True,
)
def pads_apart() -> Result:
    """Pads of row `two-pads` that wear, from flat on through 12 turns; what one does to the other falls into place."""
    rows: list[Row] = []
    errors: dict[str, list[float]] = {}
    for across in (2, 4):
        ours, theirs, both = changed(across)
        for name in PADS:
            for k, when in enumerate(("at the start", f"after {TURNS} turns")):
                known, found = theirs[name][k], ours[name][k]
                scale, what = float(np.abs(known).max()), f"{name} pad {when}"
                errors.setdefault(what, []).append(float(np.abs(found - known).max()) / scale)
                if across == 4:
                    rows.append(
                        profile(f"{what}: moments of what the other changes (N)", known, found, 0.05, scale=scale)
                    )
        if across == 2:
            rows.append(_in_full_space(both))
    for what, (coarse, fine) in errors.items():
        told = f"{what}: its error, with elements of half the size (of first order: at most the half)"
        rows.append(Row(told, coarse, fine, fine / coarse, 0.5, observed_order([coarse, fine])))
    return Result(rows + _worn_in())


def _in_full_space(both: Tribosystem) -> Row:
    """Compare the condensed contact of both pads with that of all displacements."""
    gap = both.pair.initial_gap + 2e-3 * np.cos(both.pair.punch.x[:, 0] / 7) ** 2
    whole = [(both.bodies.punch, both.bodies.strip)]
    full = FullContact([SlidingContact(both.elastic.interface, both.phases.middle_ratio(1))], whole).solve(gap)
    ours = both.contact((1,)).solve(gap).pressure.reshape(-1)
    known = full.pressure.reshape(-1)
    return profile("both pads in full space: pressure (MPa)", known, ours, 1e-8, scale=float(known.max()))


def _worn_in() -> list[Row]:
    """Compare the approach of worn-in pads with that of each alone and the other's wear of the disc imposed."""
    wears = f"wear.strip={{coefficient={DISC}}}"
    apart = {name: vary(alone(name, 4), wears) for name in PADS}
    best = {name: system.optimum(1) for name, system in apart.items()}
    together, rows = vary(whole(4), wears).optimum(1), []
    for name in PADS:
        other, track = apart[OTHER[name]], best[OTHER[name]].pressure
        receding = other.phases.mean_wear.worn(track[None]).strip / (2 * np.pi / SPEED)
        radius = np.hypot(*other.pair.strip.x[:, :2].T)
        imposed = float(receding[np.abs(radius - MIDDLE) < 0.3 * (OUTER - INNER)].mean())
        (own,) = best[name].velocity.values()
        what = f"{name} pad worn in: approach with the other's wear of the disc imposed (mm/s)"
        rows.append(number(what, own + imposed, together.velocity[f"lambda_F_{name}"], 1e-3))
        rows.append(number(f"{name} pad worn in: the other's wear of the disc is seen", 1, imposed > 1e-3 * own, 0))
    return rows
