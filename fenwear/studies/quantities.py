"""Quantities of interest: named numbers with units, of the end of any cycle, of a steady state, or of a whole run.

    wear of strip at 3 mm after 3600 m       steady largest_pressure
    cycles until largest_depth 0.2 mm        run_in_distance

A quantity is written as: [steady] NAME [of punch|strip|both] [in CONTACT] [at X[, Y]] [after AMOUNT], or
cycles|distance|time until NAME [of punch|strip|both] [in CONTACT] [at X[, Y] to] LEVEL, where CONTACT is one that has a
name. `of both` is of both bodies together: what opens between them. `approach` is how far they have come nearer along
z. NAME is that of the registry (`fenwear.results.registry`), by which runs compute it, too. In the plane a place is x,
or the length along a curve; in rings r; in solids x and y, y being 0 by default.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from fenwear.case import Case
from fenwear.case.body_names import BY_ROLE, Names
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.units import convert
from fenwear.results import registry
from fenwear.results.history_surfaces import at_places
from fenwear.results.quantity import RECORD
from fenwear.results.quantity import Quantity as Registered
from fenwear.studies.model import FREE, Course, Model, Snapshot, cycle_of, edge_moved

LIMIT = 10_000_000  # cycles after which a level counts as never reached

# What quantities were called here; a value at nodes without a place is the largest, see `registry.LARGEST`.
OLD_NAMES = {
    "depth": "wear",
    "volume": "worn_volume",
    "volume_rate": "worn_volume_increment",
    "friction": "friction_coefficient",
    "run-in cycles": "run_in_cycles",
    "run-in distance": "run_in_distance",
    "critical speed": "critical_speed",
}
APPROACH, BOTH = "approach", "both"  # of the bodies along z; both bodies together
OF_BOTH = ("wear", "largest_depth", "worn_volume")
GROWING = (
    "wear",
    "largest_depth",
    "worn_volume",
    "worn_area",
    "scar_width",
    "scar_length",
    APPROACH,
)  # that lives count to
OF_NODES = ("contact_width", "contact_area")  # what is counted in nodes
LIVES = {"cycles": "", "distance": "mm", "time": "s"}
WARMER = ("temperature_punch", "temperature_strip")  # the larger of which is the temperature at a place
WHOLE = {"run_in_cycles": "", "run_in_distance": "mm", "critical_speed": "mm/s"}
MAIN = ("largest_depth", "worn_volume", "scar_width", "largest_pressure", "largest_temperature", *WHOLE)

_PLAIN = re.compile(
    r"(?P<steady>steady )?(?P<name>\w+)( of (?P<body>[\w-]+))?( in (?P<contact>[\w-]+))?( at (?P<at>.+?))?"
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
        at: Place of what has values at nodes, mm: x, in a solid x and y; none of what is one number.
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
    at: tuple[float, ...] = ()
    after: tuple[float, str] | None = None
    level: float = 0.0
    life: str = "cycles"
    contact: str = ""

    @property
    def title(self) -> str:
        """Its text with its unit."""
        return f"{self.text} ({self.unit or '-'})"

    @property
    def level_unit(self) -> str:
        """The unit of its level."""
        return unit_of(self.name)

    @property
    def of_strip(self) -> str:
        """Suffix of the strip's names."""
        return "_strip" if self.body == "strip" else ""

    def of_snapshot(self, snapshot: Snapshot) -> float:
        """Return its value at the end of a cycle or in a steady state, as a run computes it.

        Raises:
            CaseError: the snapshot does not know it.
        """
        of_contact = self._of_contact(snapshot)
        if self.name.startswith("lambda_"):
            return self._velocity(of_contact)
        if self.body == BOTH:
            return self._of_both(of_contact)
        known = registry.quantities_of(of_contact.end.system)
        if self.name == APPROACH:
            moved = [self._registered(known, "moved_z", of_contact), *filter(None, [known.get("moved_z_strip")])]
            return float(
                sum(sign * entry.of_cycle(of_contact.end) for sign, entry in zip((-1, 1), moved, strict=False))
            )
        if not self.at:
            return float(self._registered(known, self.name + self.of_strip, of_contact).of_cycle(of_contact.end))
        fields = WARMER if self.name == "temperature" else (self.name + self.of_strip,)
        entries = [self._registered(known, name, of_contact) for name in fields]
        on_strip = entries[0].dims[-1].endswith("_strip")
        return self._at_place(
            of_contact, np.max([entry.of_cycle(of_contact.end) for entry in entries], axis=0), on_strip=on_strip
        )

    def _of_both(self, snapshot: Snapshot) -> float:
        """Return the volume worn off both bodies, or the depth that is worn off both between them."""
        if self.name == "worn_volume":
            return sum(replace(self, body=body).of_snapshot(snapshot) for body in ("punch", "strip"))
        end: Any = snapshot.end
        depth = end.system.pair.opening(end.wear[-1], end.wear_strip[-1])
        return self._at_place(snapshot, depth, on_strip=False) if self.at else float(depth.max())

    def _at_place(self, snapshot: Snapshot, values: Array, *, on_strip: bool) -> float:
        """Return nodal values (n,) at the place of the quantity.

        Raises:
            CaseError: it is beside the contact.
        """
        pair, places = snapshot.end.system.pair, np.array([self.at])
        surface = pair.strip if on_strip else pair.punch
        nodes = surface.nodes_of(self.contact) if self.contact else None
        at_place = at_places(surface, values, padded(places, surface.dim - 1), nodes)
        if np.isnan(at_place).any():
            x = surface.abscissa if nodes is None else surface.abscissa[nodes]
            place = ", ".join(f"{coordinate:g}" for coordinate in places[0])
            message = f"{place} mm is not on the contact, which goes from {x.min():g} to {x.max():g} mm"
            raise CaseError(InputError(self.text, message))
        return float(at_place[0])

    def _registered(self, known: Mapping[str, Registered], name: str, snapshot: Snapshot) -> Registered:
        """Return the quantity of the registry.

        Raises:
            CaseError: this system has none of the name, or not in a steady state, or not of one contact.
        """
        entry = known.get(name)
        if entry is None:
            names = ", ".join(known_entry.name for known_entry in known.values() if known_entry.dims == RECORD)
            raise CaseError(InputError(self.text, f"this case has no {name}; expected one of {names}"))
        if np.isinf(snapshot.cycle) and not entry.steady:
            raise CaseError(InputError(self.text, f"a steady state has no {name}: it is of a run"))
        if self.contact and not entry.nodal:
            raise CaseError(InputError(self.text, f"{name} is of all contacts together; leave out 'in {self.contact}'"))
        return entry

    def _velocity(self, snapshot: Snapshot) -> float:
        if self.name not in snapshot.velocity:
            known = " and ".join(snapshot.velocity) or "none"
            raise CaseError(InputError(self.text, f"the punch does not move so; its rigid motions are {known}"))
        return snapshot.velocity[self.name]

    def rate(self, snapshot: Snapshot) -> float:
        """Return its growth in a cycle, for depth and volume; NaN for what has no simple rate."""
        of_contact = self._of_contact(snapshot)
        if self.body == BOTH or self.name == APPROACH:
            return float("nan")
        depth: Array = getattr(of_contact.rate, self.body)
        if self.name == "worn_volume":
            return float(cycle_of(of_contact.end).of(f"volume_{self.body}"))
        if self.at:
            return self._at_place(of_contact, depth, on_strip=self.body == "strip")
        if self.name == "largest_depth":
            return float(depth[int(getattr(of_contact.end, f"wear{self.of_strip}")[-1].argmax())])
        return float("nan")

    def _of_contact(self, snapshot: Snapshot) -> Snapshot:
        """Return the snapshot of its contact.

        Raises:
            CaseError: there is none, or its body's surface has none of this name.
        """
        of_contact = snapshot.within(self.contact, self.text)
        names = getattr(of_contact.end.system.pair, "punch" if self.body == BOTH else self.body).names
        if self.contact and self.contact not in names:
            raise CaseError(InputError(self.text, f"the surface of the {self.body} is not named by contacts"))
        return of_contact

    def within(self, contact: str) -> Quantity:
        """Return the quantity of one named contact."""
        match = _UNTIL.fullmatch(self.text) or _PLAIN.fullmatch(self.text)
        written = match["name"] if match else self.name
        text = re.sub(rf"\b{written}\b( of [\w-]+)?", lambda at: f"{at[0]} in {contact}", self.text, count=1)
        return replace(self, text=text, contact=contact)


def parse_amount(text: str, option: str) -> tuple[float, str]:
    """Return an amount of cycles (a pure number), sliding distance (mm) or time (s), with what it is.

    Raises:
        CaseError: none of them.
    """
    stripped = re.sub(r"\s*cycles?$", "", text.strip())
    for unit, kind in (("", "cycles"), ("mm", "distance"), ("s", "time")):
        try:
            if (unit == "") != bool(re.fullmatch(r"[-+\d.eE]+", stripped)):
                continue  # a number alone is a number of cycles, and nothing else is: neither ppm nor percent
            amount = convert(stripped, unit)
        except ValueError:
            continue
        if amount <= 0:
            raise CaseError(InputError(option, f"expected more than zero, got {text!r}"))
        return amount, kind
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
    word = OLD_NAMES.get(words, words)
    if word in WHOLE:
        return Quantity(words, word, "whole", WHOLE[word])
    match = _UNTIL.fullmatch(words)
    if match and registered_name(match["name"], at_a_place=bool(match["at"])):
        return _life(words, match, option, names)
    match = _PLAIN.fullmatch(words)
    name = registered_name(match["name"], at_a_place=bool(match["at"])) if match else ""
    if not match or not name:
        raise CaseError(InputError(option, _unknown(text, match["name"] if match else "")))
    is_steady = bool(match["steady"])
    if name.startswith("lambda_") and not is_steady:
        raise CaseError(InputError(option, f"expected 'steady {name}', got {words!r}"))
    body, at = _place(name, match, words, option, names)
    if is_steady and (match["after"] or not registered(name, body).steady):
        raise CaseError(
            InputError(option, f"{words!r}: a steady state lasts for ever. Leave out 'steady' for {name} in a run")
        )
    after = parse_amount(match["after"], option) if match["after"] else None
    kind: Kind = "steady" if is_steady else "snapshot"
    return Quantity(words, name, kind, unit_of(name), body, at, after, contact=match["contact"] or "")


def _unknown(text: str, word: str) -> str:
    """Return the error of a text that names no quantity."""
    if registered_name(word, at_a_place=False):
        return f"{word} is one number; a place applies to wear, pressure and other values at nodes, got {text!r}"
    listed = [*registry.names_known(), *registry.LARGEST, *OLD_NAMES, *WHOLE]
    near = difflib.get_close_matches(word or text, listed, n=3)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(MAIN)} and others of the results"
    examples = "'wear of punch at 3 mm after 3600 m', 'steady largest_pressure' or 'cycles until largest_depth 0.2 mm'"
    return f"expected a quantity such as {examples}, got {text!r}; {hint}"


def registered_name(word: str, *, at_a_place: bool) -> str:
    """Return the registry's name of a quantity, of values at a place or of one number; "" where it has none."""
    name = OLD_NAMES.get(word, word)
    if name == APPROACH:
        return "" if at_a_place else name
    if at_a_place:
        field = registry.known(WARMER[0] if name == "temperature" else name)
        return "" if field.dims[1:] not in (("x",), ("x_strip",)) else name
    name = registry.LARGEST.get(name, name)
    entry = registry.known(name)
    return "" if entry.dims not in (RECORD, ()) else name


def registered(name: str, body: str = "punch") -> Registered:
    """Return the entry of the registry of a name; that of the strip where the strip has one."""
    name = "moved_z" if name == APPROACH else name
    names = (f"{name}_strip", name) if body == "strip" else (name, f"{name}_punch")
    return next(entry for candidate in names if (entry := registry.known(candidate)).name)


def unit_of(name: str) -> str:
    """Return the unit of a quantity of the registry, as keys of a case are given."""
    unit = re.sub(r"(?<=m)(?=[23])", "^", registered(OLD_NAMES.get(name, name)).unit)
    return "" if unit == "1" else unit


def parse_level(text: str, option: str, names: Names = BY_ROLE) -> Quantity:
    """Return the quantity with a level that a text names, such as "depth 0.2 mm" or "approach 5 um".

    Raises:
        CaseError: it names none.
    """
    level = parse_quantity(text, option, names)
    if level.kind != "life":
        raise CaseError(InputError(option, f"expected a quantity with a level, such as 'depth 0.1 mm', got {text!r}"))
    return level


def _life(words: str, match: re.Match[str], option: str, names: Names) -> Quantity:
    life = match["life"] or "cycles"
    name = registered_name(match["name"], at_a_place=bool(match["at"]))
    if life not in LIVES:
        raise CaseError(InputError(option, f"expected cycles, distance or time until a level, got {words!r}"))
    if name not in GROWING:
        raise CaseError(InputError(option, f"expected one of {', '.join(GROWING)} with a level, got {words!r}"))
    body, at = _place(name, match, words, option, names)
    try:
        level = convert(match["level"], unit_of(name))
    except ValueError as error:
        raise CaseError(InputError(option, f"{words!r}: {error}")) from None
    if re.fullmatch(r"[-+\d.eE]+", match["level"]):
        raise CaseError(InputError(option, f"expected a level with its unit, such as '0.2 mm', got {words!r}"))
    if level <= 0:
        raise CaseError(InputError(option, f"expected a level above zero, got {words!r}"))
    return Quantity(words, name, "life", LIVES[life], body, at, None, level, life, match["contact"] or "")


def _place(name: str, match: re.Match[str], words: str, option: str, names: Names) -> tuple[str, tuple[float, ...]]:
    """Return the body and the place of a quantity."""
    body = names.role_of(match["body"] or "punch")
    wrong = {
        "punch": False,
        "strip": name == "temperature" or not registry.known(f"{name}_strip").name,
        BOTH: name not in OF_BOTH,
    }
    if wrong.get(body, True) or (match["body"] and name == APPROACH):
        message = "expected 'of punch', or 'of strip' or 'of both' behind what each body has"
        raise CaseError(InputError(option, names.with_names(f"{message}, such as wear and worn_volume, got {words!r}")))
    if match["contact"] and not registered(name, body).nodal:
        raise CaseError(InputError(option, f"{name} is of all contacts together: expected no contact, got {words!r}"))
    if not match["at"]:
        return body, ()
    parts = [part.strip() for part in match["at"].split(",")]
    try:
        if len(parts) > 2:
            raise ValueError(f"expected x, or x and y, got {match['at']!r}")
        return body, tuple(convert(part, "mm") for part in parts)
    except ValueError as error:
        raise CaseError(InputError(option, f"{words!r}: {error}")) from None


def padded(places: Array, count: int) -> Array:
    """Return places (k, c) of so many coordinates, mm: zero where none is given."""
    return np.column_stack([places, np.zeros((len(places), max(0, count - places.shape[1])))])[:, :count]


def of_case(quantity: Quantity, case: Case, option: str = "--of") -> Quantity:
    """Return a quantity with the unit that it has in a case: speeds of a strip that turns are angular.

    Raises:
        CaseError: it needs heat, or the wear of a body that does not wear.
    """
    if (quantity.name == "critical_speed" or "temperature" in quantity.name) and case.heat is None:
        raise CaseError(InputError(option, f"{quantity.text!r} needs the table heat, which the case does not have"))
    worn = quantity.name in (*GROWING, "worn_volume_increment", "worn_mass") and quantity.name != APPROACH
    lacking = [body for body in ("punch", "strip") if getattr(case.wear, body) is None]
    if worn and (quantity.body in lacking or (quantity.body == BOTH and lacking)):
        other = next(body for body in ("strip", "punch") if body not in lacking)
        message = f"{quantity.text!r}: the case has no wear.{lacking[0]}; write 'of {other}'"
        raise CaseError(InputError(option, message))
    return replace(quantity, unit="rad/s") if quantity.name == "critical_speed" and case.turns else quantity


def cycles_of(amount: tuple[float, str], distance: float, period: float) -> float:
    """Return the cycles of an amount, for the distance (mm) and the time (s) of one."""
    value, kind = amount
    return value / {"cycles": 1.0, "distance": distance, "time": period}[kind]


@dataclass(frozen=True)
class Path:
    """The way to compute a quantity for other values, so that its values are smooth.

    Attributes:
        course: Of the run; `FREE` of what is not one.
        rough: Whether values are smooth as long as the same nodes are in contact, and no further: an edge of contact or
            scar has moved on the way to them and lies within the mesh, or they are the place of one.
        grain: The smallest step of a value that is counted in nodes.
    """

    course: Course = FREE
    rough: bool = False
    grain: float = 0.0


NO_PATH = Path()


def evaluate(
    model: Model,
    quantity: Quantity,
    values: Mapping[str, float],
    settings: Sequence[str] = (),
    path: Path = NO_PATH,
    limit: int = LIMIT,
) -> tuple[float, Path]:
    """Return a quantity for values of keys, and the path on which to compute it for values nearby.

    Args:
        model: The case.
        quantity: The quantity.
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
        of_nodes = quantity.name in OF_NODES and state.parts
        return quantity.of_snapshot(state), Path(rough=of_nodes, grain=_grain(quantity, state))
    distance, period = model.cycle_measures(values, settings)
    if quantity.kind == "whole":
        return _system_quantity(model, quantity, values, settings, distance, path)
    if quantity.kind == "life":
        lives, path = _until(model, (quantity,), values, settings, path, limit, (distance, period))
        return float(lives[0]), path
    if quantity.after is None:
        half_cycles = model.system(values, settings).motion.half_cycles
        wanted = float(max(1, model.case.run.half_cycles // half_cycles))
    else:
        wanted = cycles_of(quantity.after, distance, period)
    run = model.samples(values, path.course.last(max(1, round(wanted))), settings, path.course)
    made = Path(run.course, run.moved, _grain(quantity, run.last))
    return quantity.of_snapshot(run.last.at_cycle(wanted)), made


def _grain(quantity: Quantity, snapshot: Snapshot) -> float:
    return float(snapshot.end.system.pair.weights.max()) if quantity.name in OF_NODES else 0.0


def _system_quantity(
    model: Model,
    quantity: Quantity,
    values: Mapping[str, float],
    settings: Sequence[str],
    distance: float,
    path: Path,
) -> tuple[float, Path]:
    if quantity.name == "critical_speed":
        return model.critical_speed(values, settings), Path()
    cycles, course = model.run_in(values, settings, path.course)
    return cycles * distance if quantity.name == "run_in_distance" else cycles, Path(course)


def lives(model: Model, quantities: Sequence[Quantity], values: Mapping[str, float], limit: int = LIMIT) -> Array:
    """Return the lives of one run until each of several levels (q,), for values of keys.

    Raises:
        CaseError: a value is not possible, or a contact is not known.
        ConvergenceError: the run did not converge.
    """
    return _until(model, quantities, values, (), NO_PATH, limit, model.cycle_measures(values))[0]


def _until(
    model: Model,
    quantities: Sequence[Quantity],
    values: Mapping[str, float],
    settings: Sequence[str],
    path: Path,
    limit: int,
    measures: tuple[float, float],
) -> tuple[Array, Path]:
    """Run until all levels are passed, and count to where a cubic through values and rates meets each."""
    taken = [[(0.0, 0.0, float("nan"))] for _ in quantities]
    levels, passed = np.array([quantity.level for quantity in quantities]), np.zeros(len(quantities), dtype=int)
    course = path.course
    run: list[Snapshot] = []

    def enough(_: Snapshot) -> bool:
        return bool((passed > 1).all())  # one jump more, so that values nearby find their level on the same path

    for snapshot in model.run(values, course.last(limit), settings=settings, course=course, until=enough):
        for rows, asked in zip(taken, quantities, strict=True):
            rows.append((snapshot.cycle, asked.of_snapshot(snapshot), asked.rate(snapshot)))
        passed += np.array([rows[-1][1] for rows in taken]) >= levels
        run.append(snapshot)
    made = Path(Course.of(run), edge_moved(run))
    counted = np.array([cycles_of((1.0, quantity.life), *measures) for quantity in quantities])
    cycles = [crossing(np.array(rows), level) for rows, level in zip(taken, levels, strict=True)]
    return np.array(cycles) / counted, made


def crossing(taken: Array, level: float) -> float:
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
