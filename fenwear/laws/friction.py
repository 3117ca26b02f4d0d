"""Friction: the traction of sliding over the pressure.

The traction on the punch is p (e_n + d mu e_v - mu_d e_n x e_v), equation (5), with e_v the direction
of the sliding field. In a plane model its part out of the plane makes displacements of a generalised
plane state: they do not change along e_y, carry the shear alone and leave the gap as it is, so that
the contact sees the part in the plane only.

Mixed lubrication in its simplest form: asperities carry a share X of the pressure, the fluid the rest.

    wear by X p in place of p,      mu = X mu_asperities + (1 - X) mu_fluid

(K. L. Johnson, J. A. Greenwood, S. Y. Poon, Wear 19, 1972, 91, for the load that is shared; E. R. M. Gelinck and D. J.
Schipper, Tribology International 33, 2000, 175, for curves of Stribeck by it). X is given, of a node's pressure, speed
and temperature, or over lambda, the film thickness over the roughness. No film is computed: neither its pressure, which
is taken to be distributed as that of the asperities, nor where the lubricant comes from.

Coefficients of a node between material regions: a part of its area in each, under the pressure of its side.

Where unlike coefficients k_i meet, the pressure jumps in the end: k_1 f(p_1) = k_2 f(p_2), with f the effect of the
pressure. A node there has one pressure p, the mean over its parts of shares s_i. The pressures of these are to each
other as those of the nearest nodes P_i within each region:

    p_i = p P_i / (sum of s_j P_j),    k f(p) = sum of s_i k_i f(p_i).

While the pressure is even k is the mean of the k_i; in the end, of f(p) = p^b, k^(-1/b) is that of the k_i^(-1/b).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fenwear.case import Contact, Dependence, WearLaw
from fenwear.case.contact_table import Lubrication
from fenwear.case.wear_table import FILM
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.laws.sliding_tensors import CycleShear
from fenwear.surfaces import ContactPair
from fenwear.surfaces.placement import in_space
from fenwear.surfaces.sliding_field import ALONG_X, SlidingField

PURE = 1e-9  # share of other regions below which a node lies in one
SAME = 1e-6  # of the distance of the nearest node: others that are as near
FAINT = 1e-9  # of the largest pressure: where a node has none, its effect is that of so little


@dataclass(frozen=True)
class Regions:
    """The material regions of a body at the n contact nodes.

    Attributes:
        shares: Of the regions in the nodes (n,), by their names.
        mixed: Nodes that lie in several (k,).
        near: Weights from pressures (n,) to the means of the nearest nodes of each region (k, n), by their names.
    """

    shares: Mapping[str, Array] = field(default_factory=dict)
    mixed: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    near: Mapping[str, csr_array] = field(default_factory=dict)

    @classmethod
    def at(cls, shares: Mapping[str, Array], x: Array) -> Regions:
        """Return the regions at nodes in places x (n, d), mm, from their shares (n,)."""
        if len(shares) < 2:
            return cls(shares)
        of_nodes = np.array(list(shares.values()))
        mixed = np.flatnonzero(of_nodes.max(axis=0) < 1 - PURE)
        near = {}
        for name, share in shares.items():
            pure = np.flatnonzero(share >= 1 - PURE)
            if len(pure):
                distance = np.linalg.norm(x[mixed][:, None] - x[pure], axis=2)
                nearest = distance <= (1 + SAME) * distance.min(axis=1, initial=np.inf)[:, None]
                row, column = np.nonzero(nearest)
                values = 1 / nearest.sum(axis=1)[row]
            else:  # it has the pressures of the nodes themselves
                row, column, values = np.arange(len(mixed)), np.arange(len(mixed)), np.ones(len(mixed))
                pure = mixed
            near[name] = csr_array((values, (row, pure[column])), shape=(len(mixed), len(x)))
        return cls(shares, mixed, near)

    def split(self, coefficient: object) -> bool:
        """Return whether nodes lie in several regions that differ in a coefficient: it then depends on the pressure."""
        return isinstance(coefficient, Dependence) and coefficient.unlike and len(self.mixed) > 0

    @property
    def variables(self) -> dict[str, Any]:
        """The variables of coefficients: shares and the regions themselves."""
        return {"regions": self, **{f"region {name}": share for name, share in self.shares.items()}}

    def effects(self, pressure: Array, effect: Callable[[Array], Array]) -> dict[str, Array]:
        """Return the effect of the pressures of the nodes' parts over that of the nodes (n,), by region.

        Args:
            pressure: Of the nodes (n,), MPa.
            effect: The function of the pressure that coefficients multiply.
        """
        if not len(self.mixed):
            return {}
        pressure = np.maximum(pressure, 0.0)
        here = np.maximum(pressure[self.mixed], FAINT * max(float(pressure.max()), 1e-300))
        sides = {name: near @ pressure for name, near in self.near.items()}
        mean = np.sum([self.shares[name][self.mixed] * side for name, side in sides.items()], axis=0)
        of_node, by_region = effect(here), {}
        known = (mean > 0) & (of_node > 0)
        for name, side in sides.items():
            of_part = effect(here * np.divide(side, mean, out=np.ones_like(side), where=mean > 0))
            by_region[name] = np.ones_like(pressure)
            by_region[name][self.mixed] = np.divide(of_part, of_node, out=np.ones_like(of_node), where=known)
        return by_region


def regions_opposite(
    shares: tuple[Mapping[str, Array], Mapping[str, Array]], pair: ContactPair
) -> tuple[Regions, Regions]:
    """Return the regions of punch and strip at the contact nodes, from their shares in each body's own nodes."""
    of_punch, of_strip = shares
    at_contact = {name: pair.wear_interpolation @ share for name, share in of_strip.items()}
    return Regions.at(of_punch, pair.punch.x), Regions.at(at_contact, pair.punch.x)


def any_split(regions: tuple[Regions, Regions], wear: tuple[WearLaw, WearLaw]) -> bool:
    """Return whether nodes between regions share their pressure among unlike coefficients of wear."""
    both = zip(regions, wear, strict=True)
    return any(body_regions.split(law.given_coefficient) for body_regions, law in both)


def asperity_share(
    lubrication: Lubrication, state: Mapping[str, Array], shape: tuple[int, ...], *, checked: bool = True
) -> Array:
    """Return X at nodes (n,).

    Args:
        lubrication: Table of the lubrication.
        state: Variables of laws at the nodes, by name.
        shape: Of nodal values.
        checked: Whether values of a law are: not on the way to a solution.

    Raises:
        CaseError: it is not between 0 and 1 somewhere, or the film is not positive.
    """
    name, value = lubrication.key, lubrication.coefficient
    key = f"contact.lubrication.{name}"
    if not isinstance(value, Dependence):
        values = np.full(shape, float(value))
    else:
        of_film = name == "film"
        factor, least = (value.scale("mm"), 1e-300) if of_film else (1.0, 0.0)
        values = value.values(state, shape, factor, key, least, checked=checked)
    if name == "film":
        return np.asarray(
            np.interp(values / (lubrication.roughness or 1.0), *np.array(lubrication.share_over_lambda).T)
        )
    if checked and np.maximum.reduce(values) > 1:
        at = int(values.argmax())
        state_text = ", ".join(
            f"{variable} = {np.broadcast_to(state[variable], shape)[at]:g}" for variable in ("p", "v", "T")
        )
        raise CaseError(InputError(key, f"expected at most 1, got {values[at]:g} at {state_text}"))
    return np.asarray(values)


# Temperature of friction, from those of the punch's and the strip's surface.
FRICTION_TEMPERATURES: Mapping[str, Callable[[Array, Array], Array]] = {
    "mean": lambda punch, strip: (punch + strip) / 2,
    "hotter": np.maximum,
    "punch": lambda punch, _: punch,
    "strip": lambda _, strip: strip,
}


@dataclass(frozen=True)
class ContactConditions:
    """The variables that coefficients may depend on, at the interface nodes in one phase.

    Attributes:
        pressure: p (n,), MPa.
        speed: Mean sliding speed v of each node (n,), or of all, mm/s.
        temperatures: Of the punch's and the strip's surface (n,) each, K; the initial ones without heat.
        places: Of the nodes on the punch and on the strip's material (n, 3) each, mm.
        depths: Worn off punch and strip there (n,) each, mm.
        slid: Distance that each node has slid from the start (n,), mm.
        regions: Of punch and strip in the nodes.
        cycle: Cross-shear and mean pressure of the cycle; None where they are not known, which counts as sliding
            straight at the present pressure.
        states: That laws of one's own remember (n,), by their names: as those of punch and strip know them.
        debris: Thickness of the third body (n,), mm.
        edge: Distance from the edge of the contact (n,), mm; None where nothing asks for it.
        friction_temperature: Which one friction depends on, see `FRICTION_TEMPERATURES`.
        covered: Remaining share of the friction of both bodies' coatings (n,), see `fenwear.laws.coating`.
    """

    pressure: Array
    speed: float | Array
    temperatures: tuple[Array, Array]
    places: tuple[Array, Array]
    depths: tuple[Array, Array]
    slid: Array
    regions: tuple[Regions, Regions]
    cycle: CycleShear | None = None
    states: tuple[Mapping[str, Array], Mapping[str, Array]] = field(default_factory=lambda: ({}, {}))
    covered: tuple[Array | float, Array | float] = (0.0, 0.0)
    debris: Array | float = 0.0
    edge: Array | None = None
    friction_temperature: str = "mean"

    @classmethod
    def at(cls, pressure: Array, speed: float = 0.0, temperatures: tuple[Array, Array] | None = None) -> Self:
        """Return conditions of which no more is known: at the origin, unworn, before any sliding."""
        none, places = np.zeros_like(pressure), np.zeros((len(pressure), 3))
        surfaces = (none, none) if temperatures is None else temperatures
        return cls(pressure, speed, surfaces, (places, places), (none, none), none, (Regions(), Regions()))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of nodal values."""
        return self.pressure.shape

    def pressed(self, pressure: Array, debris: Array | None = None) -> Self:
        """Return the conditions under another pressure (n,), MPa, with debris (n,), mm, by default the present one."""
        changes = {"p": pressure, "pm": pressure} if self.cycle is None else {"p": pressure}
        if debris is None:
            return self._but((changes, changes), pressure=pressure)
        changes["debris"] = debris
        return self._but((changes, changes), pressure=pressure, debris=debris)

    def remembering(self, states: tuple[Mapping[str, Array], Mapping[str, Array]]) -> Self:
        """Return the conditions with states of laws, as the laws of punch and strip know them."""
        return self._but(states, states=states)

    def _but(self, variables: tuple[Mapping[str, Array], Mapping[str, Array]], **changes: object) -> Self:
        """Return the conditions with other attributes, and with these variables, as punch and strip have them."""
        conditions = object.__new__(type(self))
        conditions.__dict__.update(self.__dict__)
        conditions.__dict__.pop("derived", None)
        conditions.__dict__.update(changes, _known={}, _changed=(self, *variables))
        return conditions

    def of(self, body: Literal["punch", "strip", "friction"]) -> Mapping[str, Array]:
        """Return the variables of laws, of a body; or of the punch, with the temperature of friction."""
        if (known := self._known.get(body)) is not None:
            return known
        if self._changed is not None:
            before, of_punch, of_strip = self._changed
            variables = self._known[body] = {**before.of(body), **(of_strip if body == "strip" else of_punch)}
            return variables
        body_index = 1 if body == "strip" else 0
        x, y, z = self.places[body_index].T
        none = np.zeros(self.shape)
        variables = self._known[body] = {
            "T": FRICTION_TEMPERATURES[self.friction_temperature if body == "friction" else body](*self.temperatures),
            "p": self.pressure,
            "v": np.asarray(self.speed),
            "x": x,
            "y": y,
            "z": z,
            "depth": self.depths[body_index],
            "s": self.slid,
            "debris": none + self.debris,
            "edge": none if self.edge is None else self.edge,
            "cs": none if self.cycle is None else self.cycle.ratio[body_index],
            "pm": self.pressure if self.cycle is None else self.cycle.pressure,
            FILM: none,
            **self.regions[body_index].variables,
            **self.states[body_index],
        }
        return variables

    @cached_property
    def _changed(self) -> tuple[ContactConditions, Mapping[str, Array], Mapping[str, Array]] | None:
        """Its origin, and the variables of punch and strip that changed."""
        return None

    @cached_property
    def _known(self) -> dict[str, dict[str, Array]]:
        """Values computed so far, by body."""
        return {}

    @cached_property
    def derived(self) -> dict[str, Array]:
        """Results of laws, by name."""
        return {}


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of known direction: gross sliding.

    Attributes:
        contact: mu and mu_d.
        field: Of the sliding.
        of_coatings: mu of the coatings of punch and strip; None where there is none of its own.
        friction_temperature: Which one friction depends on, see `FRICTION_TEMPERATURES`.
        split: Whether nodes between regions share their pressure among unlike coefficients.
    """

    contact: Contact
    field: SlidingField = ALONG_X
    of_coatings: tuple[float | None, float | None] = (None, None)
    friction_temperature: str = "mean"
    split: bool = False

    def asks(self, *names: str, of_share: bool = True) -> bool:
        """Return whether mu, or that of asperities alone, depends on one of these variables of coefficients."""
        return (self.split and "p" in names) or self.contact.friction_asks(*names, of_share=of_share)

    @cached_property
    def constant(self) -> bool:
        """Whether mu depends on nothing but the place."""
        varies = isinstance(self.contact.friction, Dependence) and self.contact.friction.varies
        return not (varies or self.split or self.mixed) and self.of_coatings == (None, None)

    @cached_property
    def mixed(self) -> bool:
        """Whether the share of the load that asperities carry changes with more than the place."""
        return self.contact.lubrication is not None and self.contact.lubrication.varies

    @property
    def remembers(self) -> bool:
        """Whether mu is a law that has states of its own."""
        return isinstance(self.contact.friction, Dependence) and bool(self.contact.friction.states)

    def share(self, conditions: ContactConditions) -> Array | float:
        """Return the share of the pressure that asperities carry (n,); 1 without lubrication.

        Raises:
            CaseError: it is not between 0 and 1.
        """
        lubrication = self.contact.lubrication
        if lubrication is None:
            return 1.0
        if "share" not in conditions.derived:
            conditions.derived["share"] = asperity_share(lubrication, conditions.of("friction"), conditions.shape)
        return conditions.derived["share"]

    def _values(
        self, state: Mapping[str, Array], conditions: ContactConditions, share: Array | float, *, checked: bool = True
    ) -> Array:
        """Return mu at the nodes (n,) by the variables of laws, a share, and of conditions what coatings are left."""
        asperities, lubrication = self.of_asperities(state, conditions, checked=checked), self.contact.lubrication
        if lubrication is None:
            return asperities
        return np.asarray(lubrication.fluid_friction + share * (asperities - lubrication.fluid_friction))

    def values(self, conditions: ContactConditions) -> Array:
        """Return mu at the nodes (n,): of asperities and fluid by their shares of the load.

        Raises:
            CaseError: it is negative or not finite.
        """
        return self._values(conditions.of("friction"), conditions, self.share(conditions))

    def of_asperities(
        self, state: Mapping[str, Array], conditions: ContactConditions, *, checked: bool = True
    ) -> Array:
        """Return the friction coefficient of the touching asperities at the nodes (n,), as `_values`.

        Raises:
            CaseError: it is negative or not finite.
        """
        mu = self.contact.friction
        if isinstance(mu, Dependence):
            ratio = mu.values(state, conditions.shape, 1.0, "contact.friction", checked=checked)
        else:
            ratio = np.full(conditions.shape, float(mu))
        if self.of_coatings == (None, None):
            return ratio
        for of_coating, share in zip(reversed(self.of_coatings), reversed(conditions.covered), strict=True):
            if of_coating is not None:  # the punch's before the strip's, where both have one
                ratio = ratio + share * (of_coating - ratio)
        return ratio

    def ratio(self, direction: int, mu: Array, pair: ContactPair) -> Array:
        """Return tau, the traction of friction on the punch over the pressure, in space (n, 3).

        Args:
            direction: d, the sign of the sliding of the whole motion.
            mu: (n,).
            pair: The contact nodes.
        """
        return self.along(direction * self.field.direction(pair.opposite, pair.normal), mu, pair, direction)

    def along(self, sliding: Array, mu: Array, pair: ContactPair, direction: int) -> Array:
        """Return the friction ratio where the sliding has the direction d e_v (n, 3)."""
        if self.contact.transverse_friction == 0:
            return mu[:, None] * sliding
        across = direction * np.cross(in_space(pair.normal), sliding)
        return mu[:, None] * sliding - self.contact.transverse_friction * across


class FollowingFriction:
    """mu by the pressure, where all else is as in some conditions: on the way to a solution its values are not checked.

    Args:
        friction: Law of friction.
        conditions: Of all else.
    """

    def __init__(self, friction: Friction, conditions: ContactConditions) -> None:
        self._friction, self._conditions, self._state = friction, conditions, dict(conditions.of("friction"))
        self._follows = ("p", "pm") if conditions.cycle is None else ("p",)

    def __call__(self, pressure: Array) -> Array:
        """Return mu (n,) at pressures (n,), MPa, as `Friction.values`."""
        state, conditions, lubrication = self._state, self._conditions, self._friction.contact.lubrication
        state.update(dict.fromkeys(self._follows, pressure))
        share = 1.0 if lubrication is None else asperity_share(lubrication, state, conditions.shape, checked=False)
        return self._friction._values(state, conditions, share, checked=False)

    def at(self, pressure: Array) -> ContactConditions:
        """Return the conditions under a pressure (n,), MPa."""
        return self._conditions.pressed(pressure)
