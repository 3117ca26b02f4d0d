"""Quantities of interest: named numbers with units, of the end of any cycle, of a steady state, or of a whole run.

    depth of strip at 3 mm after 3600 m      steady pressure      cycles until depth 0.2 mm      run-in distance

A quantity is written as: [steady] NAME [of punch|strip] [in CONTACT] [at X] [after AMOUNT], or
cycles|distance|time until NAME [of punch|strip] [in CONTACT] [at X to] LEVEL, where CONTACT is one that has a name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from fenwear.arrays import Array
from fenwear.case import Case
from fenwear.case.names import BY_ROLE, Names
from fenwear.case.units import convert
from fenwear.errors import CaseError, InputError
from fenwear.life.model import Course, Model
from fenwear.life.snapshot import Snapshot, WornSurface, edge_moved
from fenwear.results.scar import extents

LIMIT = 10_000_000  # cycles after which a level counts as never reached

UNITS = {
    "depth": "mm",
    "volume": "mm^3",
    "scar_width": "mm",
    "contact_width": "mm",
    "pressure": "MPa",
    "temperature": "K",
    "friction": "",
    "volume_rate": "mm^3",
    "lambda_F": "mm",
    "lambda_M": "rad",
}
MEANINGS = {
    "depth": "worn depth, the largest or at x",
    "volume": "worn volume",
    "scar_width": "width over which the depth is beyond a hundredth of its largest",
    "contact_width": "width in contact, of the phase with the widest",
    "pressure": "largest contact pressure, or at x",
    "temperature": "largest temperature of the contact surfaces, or at x",
    "friction": "mean friction coefficient of a cycle",
    "volume_rate": "volume worn in a cycle",
    "lambda_F": "approach of the bodies by wear in a cycle, of a steady state",
    "lambda_M": "rotation of the punch by wear in a cycle, of a steady state",
}
OF_A_BODY = ("depth", "volume", "scar_width", "volume_rate")
IN_A_CONTACT = (*OF_A_BODY, "contact_width", "pressure", "temperature")
AT_A_PLACE = ("depth", "pressure", "temperature")
GROWING = ("depth", "volume", "scar_width")  # what a life can be counted to
OF_RUNS = ("depth", "volume", "scar_width")  # grow without end: no steady state knows them
LIVES = {"cycles": "", "distance": "mm", "time": "s"}
WHOLE = {"run-in cycles": "", "run-in distance": "mm", "critical speed": "mm/s"}

_PLAIN = re.compile(
    r"(?P<steady>steady )?(?P<name>[A-Za-z_]+)( of (?P<body>[\w-]+))?( in (?P<contact>[\w-]+))?( at (?P<at>.+?))?"
    r"( after (?P<after>.+))?"
)
_UNTIL = re.compile(
    r"((?P<life>\w+) until )?(?P<name>\w+)( of (?P<body>[\w-]+))?( in (?P<contact>[\w-]+))?"
    r"( at (?P<at>.+?) to)? (?P<level>[\d.+-].*)"
)
Kind = Literal["snapshot", "steady", "life", "whole"]


@dataclass(frozen=True)
class Quantity:
    """A quantity of interest.

    Attributes:
        text: As it was written.
        name: Of the quantity.
        kind: snapshot: of the end of a cycle; steady; life: until a level; whole: of the case.
        unit: Of its value.
        body: punch or strip.
        at: Position x, mm; None for the largest.
        after: Cycles, distance (mm) or time (s) at which it is taken, with what it is; None for the end of the run.
        level: Up to which a life counts.
        life: Whether that is counted in cycles, distance or time.
        contact: The named contact that it is of; "" for all.
    """

    text: str
    name: str
    kind: Kind
    unit: str
    body: str = "punch"
    at: float | None = None
    after: tuple[float, str] | None = None
    level: float = 0.0
    life: str = "cycles"
    contact: str = ""

    @property
    def title(self) -> str:
        """Its text with its unit."""
        return f"{self.text} ({self.unit or '-'})"

    def of_snapshot(self, snapshot: Snapshot) -> float:
        """Return its value at the end of a cycle or in a steady state.

        Raises:
            CaseError: the snapshot does not know it.
        """
        return _VALUES[self.name](self, self._own(snapshot))

    def rate(self, snapshot: Snapshot) -> float:
        """Return its growth in a cycle, for depth and volume; NaN for what has no simple rate."""
        surface = self._own(snapshot).surfaces[self.body]
        if self.name == "volume":
            return surface.volume_rate
        if self.name == "depth" and surface.depth is not None:
            if self.at is not None:
                return _at(surface.x, surface.rate, self.at, self.text)
            return float(surface.rate[int(np.argmax(surface.depth))])
        return float("nan")

    def _own(self, snapshot: Snapshot) -> Snapshot:
        """Return the snapshot of its contact.

        Raises:
            CaseError: there is none, or its body's surface has none of this name.
        """
        own = snapshot.within(self.contact, self.text)
        if self.body not in own.surfaces and self.name in OF_A_BODY:
            raise CaseError(InputError(self.text, f"the surface of the {self.body} is not named by contacts"))
        return own

    def within(self, contact: str) -> Quantity:
        """Return the same of one named contact."""
        text = re.sub(rf"\b{self.name}\b( of [\w-]+)?", lambda at: f"{at[0]} in {contact}", self.text, count=1)
        return replace(self, text=text, contact=contact)


def parse_amount(text: str, option: str) -> tuple[float, str]:
    """Return an amount of cycles (a pure number), sliding distance (mm) or time (s), with what it is.

    Raises:
        CaseError: none of them.
    """
    stripped = re.sub(r"\s*cycles?$", "", text.strip())
    for unit, what in (("", "cycles"), ("mm", "distance"), ("s", "time")):
        try:
            if (unit == "") != bool(re.fullmatch(r"[-+\d.eE]+", stripped)):
                continue  # a number alone is a number of cycles, and nothing else is: neither ppm nor percent
            amount = convert(stripped, unit)
        except ValueError:
            continue
        if amount <= 0:
            raise CaseError(InputError(option, f"expected more than zero, got {text!r}"))
        return amount, what
    raise CaseError(InputError(option, f"expected cycles, a distance or a time such as '3600 m', got {text!r}"))


def parse_quantity(text: str, option: str = "--of", names: Names = BY_ROLE) -> Quantity:
    """Return the quantity that a text names.

    Args:
        text: The text.
        option: That gave it, for messages.
        names: Of the bodies.

    Raises:
        CaseError: it names none; says what is known.
    """
    words = " ".join(text.split())
    if words in WHOLE:
        return Quantity(words, words, "whole", WHOLE[words])
    match = _UNTIL.fullmatch(words)
    if match is not None and match["name"] in UNITS:
        return _life(words, match, option, names)
    match = _PLAIN.fullmatch(words)
    if match is None or match["name"] not in UNITS:
        known = ", ".join([*UNITS, *WHOLE])
        examples = "'depth of punch at 3 mm after 3600 m', 'steady pressure' or 'cycles until depth 0.2 mm'"
        raise CaseError(InputError(option, f"expected a quantity such as {examples}, got {text!r}; known are {known}"))
    name, is_steady = match["name"], match["steady"] is not None
    if is_steady and (name in OF_RUNS or match["after"]):
        raise CaseError(InputError(option, f"{words!r}: a steady state lasts for ever; {name} is of a run"))
    if name.startswith("lambda_") and not is_steady:
        raise CaseError(InputError(option, f"expected 'steady {name}', got {words!r}"))
    body, at = _place(name, match, words, option, names)
    after = None if match["after"] is None else parse_amount(match["after"], option)
    kind: Kind = "steady" if is_steady else "snapshot"
    return Quantity(words, name, kind, UNITS[name], body, at, after, contact=match["contact"] or "")


def _life(words: str, match: re.Match[str], option: str, names: Names) -> Quantity:
    name, life = match["name"], match["life"] or "cycles"
    if life not in LIVES:
        raise CaseError(InputError(option, f"expected cycles, distance or time until a level, got {words!r}"))
    if name not in GROWING:
        raise CaseError(InputError(option, f"expected one of {', '.join(GROWING)} with a level, got {words!r}"))
    body, at = _place(name, match, words, option, names)
    try:
        level = convert(match["level"], UNITS[name])
    except ValueError as error:
        raise CaseError(InputError(option, f"{words!r}: {error}")) from None
    if re.fullmatch(r"[-+\d.eE]+", match["level"]):
        raise CaseError(InputError(option, f"expected a level with its unit, such as '0.2 mm', got {words!r}"))
    if level <= 0:
        raise CaseError(InputError(option, f"expected a level above zero, got {words!r}"))
    return Quantity(words, name, "life", LIVES[life], body, at, None, level, life, match["contact"] or "")


def _place(name: str, match: re.Match[str], words: str, option: str, names: Names) -> tuple[str, float | None]:
    body = names.role_of(match["body"] or "punch")
    if body not in ("punch", "strip") or (match["body"] and name not in OF_A_BODY):
        raise CaseError(
            InputError(
                option, names.told(f"expected 'of punch' or 'of strip' behind {', '.join(OF_A_BODY)}, got {words!r}")
            )
        )
    if match["contact"] and name not in IN_A_CONTACT:
        raise CaseError(InputError(option, f"expected a contact behind {', '.join(IN_A_CONTACT)} only, got {words!r}"))
    if match["at"] is None:
        return body, None
    if name not in AT_A_PLACE:
        raise CaseError(InputError(option, f"expected a place behind {', '.join(AT_A_PLACE)} only, got {words!r}"))
    try:
        return body, convert(match["at"], "mm")
    except ValueError as error:
        raise CaseError(InputError(option, f"{words!r}: {error}")) from None


def of_case(quantity: Quantity, case: Case, option: str = "--of") -> Quantity:
    """Return a quantity with the unit that it has in a case: speeds of a strip that turns are angular.

    Raises:
        CaseError: it needs heat, or the wear of a body that does not wear.
    """
    if quantity.name in ("temperature", "critical speed") and case.heat is None:
        raise CaseError(InputError(option, f"{quantity.text!r} needs the table heat, which the case does not have"))
    if quantity.name in OF_A_BODY and getattr(case.wear, quantity.body) is None:
        other = "strip" if quantity.body == "punch" else "punch"
        message = f"{quantity.text!r}: the case has no wear.{quantity.body}; expected it 'of {other}'"
        raise CaseError(InputError(option, message))
    return replace(quantity, unit="rad/s") if quantity.name == "critical speed" and case.turns else quantity


# ---- Values of a snapshot ---------------------------------------------------------------------


def _at(x: Array, values: Array, place: float, text: str) -> float:
    slack = 1e-9 * (x[-1] - x[0])
    if not x[0] - slack <= place <= x[-1] + slack:
        raise CaseError(InputError(text, f"x = {place:g} mm is not on the contact, from {x[0]:g} to {x[-1]:g} mm"))
    return float(np.interp(place, x, values))


def _worn(quantity: Quantity, snapshot: Snapshot) -> tuple[WornSurface, Array]:
    surface = snapshot.surfaces[quantity.body]
    if surface.depth is None:
        raise CaseError(InputError(quantity.text, "a steady state knows no worn depth: it grows without end"))
    return surface, surface.depth


def _depth(quantity: Quantity, snapshot: Snapshot) -> float:
    surface, depth = _worn(quantity, snapshot)
    return float(depth.max()) if quantity.at is None else _at(surface.x, depth, quantity.at, quantity.text)


def _volume(quantity: Quantity, snapshot: Snapshot) -> float:
    _worn(quantity, snapshot)
    return snapshot.surfaces[quantity.body].volume or 0.0


def _scar_width(quantity: Quantity, snapshot: Snapshot) -> float:
    surface, depth = _worn(quantity, snapshot)
    nodes = np.arange(len(depth) - 1)
    return float(extents(depth[None], surface.x[:, None], np.stack([nodes, nodes + 1], axis=1))[0, 0])


def _contact_width(_: Quantity, snapshot: Snapshot) -> float:
    return float(((snapshot.pressure > 0) @ snapshot.weights).max())


def _pressure(quantity: Quantity, snapshot: Snapshot) -> float:
    highest = snapshot.pressure.max(axis=0)
    return float(highest.max()) if quantity.at is None else _at(snapshot.x, highest, quantity.at, quantity.text)


def _temperature(quantity: Quantity, snapshot: Snapshot) -> float:
    if snapshot.temperature is None:
        raise CaseError(InputError(quantity.text, "needs the table heat, which the case does not have"))
    highest = snapshot.temperature.max(axis=(0, 1))
    return float(highest.max()) if quantity.at is None else _at(snapshot.x, highest, quantity.at, quantity.text)


def _volume_rate(quantity: Quantity, snapshot: Snapshot) -> float:
    return snapshot.surfaces[quantity.body].volume_rate


def _velocity(quantity: Quantity, snapshot: Snapshot) -> float:
    if quantity.name not in snapshot.velocity:
        known = " and ".join(snapshot.velocity) or "none"
        raise CaseError(InputError(quantity.text, f"the punch does not move so; its rigid motions are {known}"))
    return snapshot.velocity[quantity.name]


_VALUES: Mapping[str, Callable[[Quantity, Snapshot], float]] = {
    "depth": _depth,
    "volume": _volume,
    "scar_width": _scar_width,
    "contact_width": _contact_width,
    "pressure": _pressure,
    "temperature": _temperature,
    "friction": lambda _, snapshot: snapshot.friction,
    "volume_rate": _volume_rate,
    "lambda_F": _velocity,
    "lambda_M": _velocity,
}

# ---- Values of a run ---------------------------------------------------------------------------


def cycles_of(amount: tuple[float, str], distance: float, period: float) -> float:
    """Return the cycles of an amount, for the distance (mm) and the time (s) of one."""
    value, what = amount
    return value / {"cycles": 1.0, "distance": distance, "time": period}[what]


@dataclass(frozen=True)
class Path:
    """How a quantity is computed again for other values, so that its values are smooth.

    Attributes:
        course: Of the run; None of what is not one.
        rough: Whether values are smooth as long as the same nodes are in contact, and no further: an edge of contact or
            scar has moved on the way to them and lies within the mesh, or they are the place of one.
        grain: The smallest step of a value that is counted in nodes.
    """

    course: Course | None = None
    rough: bool = False
    grain: float = 0.0


def evaluate(
    model: Model,
    quantity: Quantity,
    values: Mapping[str, float],
    settings: Sequence[str] = (),
    path: Path | None = None,
    limit: int = LIMIT,
) -> tuple[float, Path]:
    """Return a quantity for values of keys, and the path on which to compute it for values nearby.

    Args:
        model: The case.
        quantity: What is wanted.
        values: Of keys, in their internal units.
        settings: Overrides besides.
        path: Of an evaluation nearby.
        limit: Cycles after which a life counts as infinite.

    Raises:
        CaseError: a value is not possible.
        ConvergenceError: a run or a steady state did not converge.
    """
    if quantity.kind == "steady":
        state = model.steady(values, settings)
        of_nodes = quantity.name == "contact_width" and state.parts
        return quantity.of_snapshot(state), Path(rough=of_nodes, grain=_grain(quantity, state))
    distance, period = model.cycle_measures(values, settings)
    if quantity.kind == "whole":
        return _whole(model, quantity, values, settings, distance, path)
    if quantity.kind == "life":
        found, path = _until(model, (quantity,), values, settings, path, limit, (distance, period))
        return float(found[0]), path
    if quantity.after is None:
        half_cycles = model.system(values, settings).motion.half_cycles
        wanted = float(max(1, model.case.run.half_cycles // half_cycles))
    else:
        wanted = cycles_of(quantity.after, distance, period)
    course = None if path is None else path.course
    last = max(1, round(wanted)) if course is None else course.ends[-1]
    run = model.samples(values, last, settings, course)
    made = Path(run.course, run.moved, _grain(quantity, run.last))
    return quantity.of_snapshot(run.last.at_cycle(wanted)), made


def _grain(quantity: Quantity, snapshot: Snapshot) -> float:
    return float(snapshot.weights.max()) if quantity.name == "contact_width" else 0.0


def _whole(
    model: Model,
    quantity: Quantity,
    values: Mapping[str, float],
    settings: Sequence[str],
    distance: float,
    path: Path | None,
) -> tuple[float, Path]:
    if quantity.name == "critical speed":
        return model.critical_speed(values, settings), Path()
    cycles, course = model.run_in(values, settings, None if path is None else path.course)
    return cycles * distance if quantity.name == "run-in distance" else cycles, Path(course)


def lives(model: Model, quantities: Sequence[Quantity], values: Mapping[str, float], limit: int = LIMIT) -> Array:
    """Return the lives of one run until each of several levels (q,), for values of keys.

    Raises:
        CaseError: a value is not possible, or a contact is not known.
        ConvergenceError: the run did not converge.
    """
    return _until(model, quantities, values, (), None, limit, model.cycle_measures(values))[0]


def _until(
    model: Model,
    quantities: Sequence[Quantity],
    values: Mapping[str, float],
    settings: Sequence[str],
    path: Path | None,
    limit: int,
    measures: tuple[float, float],
) -> tuple[Array, Path]:
    """Run until all levels are passed, and count to where a cubic through values and rates meets each."""
    taken = [[(0.0, 0.0, float("nan"))] for _ in quantities]
    levels, passed = np.array([one.level for one in quantities]), np.zeros(len(quantities), dtype=int)
    course = None if path is None else path.course
    run: list[Snapshot] = []

    def enough(_: Snapshot) -> bool:
        return bool((passed > 1).all())  # one jump more, so that values nearby find their level on the same path

    cycles = limit if course is None else course.ends[-1]
    for snapshot in model.run(values, cycles, settings=settings, course=course, until=enough):
        for rows, one in zip(taken, quantities, strict=True):
            rows.append((snapshot.cycle, one.of_snapshot(snapshot), one.rate(snapshot)))
        passed += np.array([rows[-1][1] for rows in taken]) >= levels
        run.append(snapshot)
    made = Path(Course.of(run), edge_moved(run))
    factors = {"cycles": 1.0, "distance": measures[0], "time": measures[1]}
    found = [
        _crossing(np.array(rows), one.level) * factors[one.life] for rows, one in zip(taken, quantities, strict=True)
    ]
    return np.array(found), made


def _crossing(taken: Array, level: float) -> float:
    """Return where values (cycle, value, growth in a cycle) first reach a level; infinite if they do not."""
    from scipy.interpolate import CubicHermiteSpline  # which takes long to load

    cycles, values, rates = taken.T
    beyond = np.flatnonzero(values >= level)
    if not len(beyond):
        return float("inf")
    k = int(beyond[0])
    pair = slice(k - 1, k + 1)
    slopes = rates[pair].copy()
    secant = (values[k] - values[k - 1]) / (cycles[k] - cycles[k - 1])
    slopes[~np.isfinite(slopes)] = secant
    spline = CubicHermiteSpline(cycles[pair], values[pair], slopes)
    return float(brentq(lambda cycle: spline(cycle) - level, cycles[k - 1], cycles[k], xtol=1e-12, rtol=1e-14))
