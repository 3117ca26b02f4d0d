"""The tables of wear and of the rig: coefficients, constant or dependent on the state, and the laws they belong to."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from fenwear.case.dependence import (
    UNITS,
    VARIABLES,
    State,
    check_law,
    evaluate,
    evaluate_law,
    parse_expression,
    states_of_law,
    variables_of,
    variables_of_law,
)
from fenwear.case.table_parts import (
    Check,
    Force,
    Hardness,
    Length,
    Number,
    OverCycle,
    Pairs,
    Part,
    Speed,
    Stress,
    Unit,
    quantity,
    rising,
)
from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, CoefficientError, InputError
from fenwear.common.units import convert, quantity_text


def _parsed(expression: str) -> str:
    parse_expression(expression)
    return expression


def _registered(law: str) -> str:
    check_law(law)
    return law


class _State(Part):
    """Keys that all forms of a number that depends on the state share."""

    expression: Annotated[str, AfterValidator(_parsed)] | None = Field(
        default=None,
        description="arithmetic on T (K), p (MPa), v (mm/s), x, y, z (mm), depth (mm, worn), s (mm, slid); "
        "debris (mm, thickness of the third body), edge (mm, distance from the edge of the contact); "
        "cs (cross-shear ratio of the cycle) and pm (MPa, mean pressure over its sliding); film (mm, thickness of the "
        "body's film)",
    )
    table: Annotated[Pairs, rising("at least two pairs [argument, value] with rising arguments")] | None = Field(
        default=None, description="[argument, value] pairs; the end values hold beyond the ends"
    )
    of: Literal["T", "p", "v", "x", "y", "z", "depth", "s", "debris", "edge", "cs", "pm", "film"] = Field(
        default="T", description="argument of the table"
    )

    def depends_on(self, name: str) -> bool:
        """Return whether a variable such as T, p or depth is in it."""
        if self.expression is not None:
            return name in variables_of(self.expression)
        return self.table is not None and name == self.of

    def at(self, state: Mapping[str, Any], shape: tuple[int, ...]) -> Array:
        """Return the unchecked values (shape) at a state."""
        if self.table is not None:
            return np.interp(np.broadcast_to(state[self.of], shape), *np.array(self.table).T)
        return evaluate(parse_expression(self.expression or ""), state, shape)


class OfState(_State):
    """A number that depends on the state: an expression, or a table with straight lines."""

    one_of = (("expression", "table"),)


def _form(value: object) -> str:
    return "dependence" if isinstance(value, (Mapping, _State)) else "number"


FORMS = {"expression": "an expression", "table": "a table", "regions": "regions", "law": "a law"}


class Dependence(_State):
    """A coefficient that depends on the state: an expression, a table with straight lines, values of regions, a law."""

    regions: (
        dict[
            str,
            Annotated[
                Annotated[Number, Field(ge=0), Tag("number")] | Annotated[OfState, Tag("dependence")],
                Discriminator(_form),
            ],
        ]
        | None
    ) = Field(
        default=None,
        description="value of each material region of the body, of the punch for friction: a number, or a table with "
        "expression or table; all in the same unit",
    )
    law: Annotated[str, AfterValidator(_registered)] | None = Field(
        default=None, description="name of a law registered in Python"
    )
    unit: str = Field(
        default="", description="unit of the values; by default that of the key's bare numbers, which commands report"
    )

    one_of = (tuple(FORMS),)

    @property
    def form(self) -> str:
        """The key of its form."""
        return self.present(*FORMS)[0]

    def check(self, unit: str | None, of: Sequence[str], forms: Sequence[str]) -> None:
        """Raise where it is no coefficient of a key.

        Args:
            unit: Of the key; None where it is checked elsewhere.
            of: Variables that it may depend on.
            forms: That it may have.

        Raises:
            ValueError: it depends on something else, has another form, or a unit of another kind; says what.
        """
        others = [name for name in VARIABLES if name not in of and self.depends_on(name)]
        if others or self.form not in forms:
            known = "" if tuple(of) == VARIABLES else f" of {', '.join(of)} alone"
            got = others[0] if others else FORMS[self.form]
            *words, last = (FORMS[form] for form in forms)
            raise ValueError(f"expected {', '.join(words)} or {last}{known}, got {got}")
        if unit == "" and self.unit:
            raise ValueError(f"unit: expected none: its values are pure numbers, got {self.unit!r}")
        try:
            self.scale(unit or self.unit)
        except ValueError as error:
            raise ValueError(f"unit: {error}") from None

    def depends_on(self, name: str) -> bool:
        """Return whether a variable such as T, p or depth is in it."""
        if self.law is not None:
            return name in variables_of_law(self.law)
        if self.regions is not None:
            return any(depends_on(region, name) for region in self.regions.values())
        return super().depends_on(name)

    @property
    def states(self) -> Mapping[str, State]:
        """The states of a registered law, by their names."""
        return {} if self.law is None else states_of_law(self.law)

    @property
    def varies(self) -> bool:
        """Whether it changes with more than the place."""
        names = [name for name in VARIABLES if name not in ("x", "y", "z")]
        return bool(self.states) or any(self.depends_on(name) for name in names)

    @property
    def unlike(self) -> bool:
        """Whether regions differ in it."""
        given = list((self.regions or {}).values())
        return any(value != given[0] for value in given)

    def scale(self, unit: str) -> float:
        """Return the factor that converts the values to a unit.

        Raises:
            ValueError: its own unit is of another kind.
        """
        return _in_unit(self.unit, unit) if self.unit else 1.0

    def values(
        self,
        state: Mapping[str, Any],
        shape: tuple[int, ...],
        factor: float,
        key: str,
        least: float = 0.0,
        *,
        checked: bool = True,
        effect: Callable[[Array], Array] = np.asarray,
    ) -> Array:
        """Return the coefficient times `factor` at the `state` (shape), which has the shares of regions.

        On the way to a solution, whose own values are, they need not be `checked`.

        Args:
            state: The variables of laws by their names, and those of `fenwear.laws.friction`.
            shape: Of the values.
            factor: Unit of the coefficient.
            key: The case's key.
            least: Smallest value that is allowed.
            checked: Whether values are held against it.
            effect: The function of the pressure that the coefficient multiplies; by default the pressure.

        Raises:
            CaseError: a law fails.
            CoefficientError: it is less than `least` or not finite somewhere.
        """
        if self.regions is not None:
            values = self._of_regions(state, shape, effect)
        elif self.law is not None:
            try:
                values = evaluate_law(self.law, state, shape)
            except ValueError as error:
                raise CaseError(InputError(key, str(error))) from error
        else:
            values = self.at(state, shape)
        if checked and not (np.minimum.reduce(values) >= least and np.maximum.reduce(values) < np.inf):
            node = int(np.flatnonzero(~(np.isfinite(values) & (values >= least)))[0])
            named = [name for name in VARIABLES if (name in ("T", "p", "v") and name in state) or self.depends_on(name)]
            at = ", ".join(f"{name} = {np.broadcast_to(state[name], shape)[node]:g} {UNITS[name]}" for name in named)
            wanted = "zero or more" if least == 0 else "more than zero" if least > 0 else "a finite number"
            raise CoefficientError(InputError(key, f"expected {wanted}, got {values[node]:g} at {at}"))
        return values if factor == 1 else values * factor

    def _of_regions(self, state: Mapping[str, Any], shape: tuple[int, ...], effect: Callable[[Array], Array]) -> Array:
        """Return the coefficient of nodes of one or several regions (shape), see `fenwear.laws.friction`."""
        coefficient, effects = np.zeros(shape), state["regions"].effects(np.broadcast_to(state["p"], shape), effect)
        for name, given in (self.regions or {}).items():
            share = state[f"region {name}"] * effects.get(name, 1.0)
            coefficient += np.where(
                share > 0, share * (given.at(state, shape) if isinstance(given, OfState) else given), 0.0
            )
        return coefficient


@lru_cache(maxsize=100)
def _in_unit(unit: str, other: str) -> float:
    """Return a unit in another one.

    Raises:
        ValueError: it is of another kind.
    """
    return convert(f"1 {unit}", other)


@lru_cache(maxsize=100)
def _of_unit(unit: str, pressure_exponent: float, speed_exponent: float) -> float:
    """Return a unit of a coefficient in the internal one of its exponents."""
    return convert(f"1 {unit}", WearLaw.coefficient_unit(pressure_exponent, speed_exponent))


def _checked(value: Any, unit: str | None, of: Sequence[str] = VARIABLES, forms: Sequence[str] = tuple(FORMS)) -> Any:
    if isinstance(value, Dependence):
        value.check(unit, of, forms)
    return value


def constant_or_dependence(
    constant: Any, unit: str | None = None, of: Sequence[str] = VARIABLES, forms: Sequence[str] = tuple(FORMS)
) -> Any:
    """Return the type of a coefficient that is a constant of this type, or depends on the state, see `check`."""
    return Annotated[
        Annotated[constant, Tag("number")] | Annotated[Dependence, Tag("dependence")],
        Discriminator(_form),
        AfterValidator(partial(_checked, unit=unit, of=of, forms=forms)),
    ]


def of_place(constant: Any, unit: str) -> Any:
    """Return the type of a coefficient that is a constant, or depends on the place alone."""
    return constant_or_dependence(constant, unit, ("x", "y", "z"), ("expression", "table"))


def depends_on(value: object, *names: str) -> bool:
    """Return whether a coefficient depends on one of these variables; a constant does not."""
    return isinstance(value, _State) and any(map(value.depends_on, names))


def varies(value: object) -> bool:
    """Return whether a coefficient changes with more than the place."""
    return isinstance(value, Dependence) and value.varies


def place_values(value: Any, place: Mapping[str, Any], n: int, unit: str, key: str, least: float = 1e-300) -> Array:
    """Return a constant or what depends on the place at n nodes (n,), in a unit.

    Raises:
        CaseError: it is less than `least` somewhere, by default not positive; names the key.
    """
    if isinstance(value, Dependence):
        return value.values(place, (n,), value.scale(unit), key, least)
    return np.full(n, float(value))


class Stick(Part):
    """Drive of a contact with stick by the rig, and its time steps; with contact.law = "coulomb"."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        default=None,
        description="largest tangential force on the strip; it follows the course of the motion in place of the "
        "displacement",
    )
    bulk_stress: Stress = Field(
        default=0.0,
        description="largest bulk stress along x in the strip, as in fretting fatigue; it follows the motion",
    )
    bulk_over_cycle: OverCycle | None = Field(
        default=None,
        description="[fraction of the cycle, factor] pairs from 0 to 1 of the bulk stress; by default it follows the "
        "motion",
    )
    steps: Annotated[int, Field(ge=2, le=1000, strict=True)] = Field(
        default=20, description="smallest number of time steps of a half-cycle"
    )
    step_tolerance: Annotated[Number, Field(gt=0)] = Field(
        default=0.02,
        description="change of force and friction work of the first cycle below which the steps are fine enough; "
        "their number doubles until then",
    )
    load_steps: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(
        default=5, description="steps in which the loads rise at the start"
    )


COEFFICIENTS = ("coefficient", "archard", "energy", "per_area")
FILM = "film"  # the state of a film
TOUCHING = 0.1  # MPa: the pressure above which a place touches, by default


class Coating(Part):
    """A coating above the base of a body: it wears by its own coefficient until it is worn through at a place."""

    thickness: of_place(Annotated[Length, Field(ge=0)], "mm") = Field(  # type: ignore[valid-type]
        description="thickness above the base, on the body's own material; a function of the place where it is "
        "uneven; 0 without a coating"
    )
    coefficient: Annotated[float | None, Unit("")] = Field(
        default=None, description="beta~ of the coating, in the unit and with the exponents of the base"
    )
    archard: Annotated[Number, Field(gt=0)] | None = Field(default=None, description="K of the coating")
    hardness: Hardness | None = Field(default=None, description="H of the coating, with archard")
    energy: Annotated[float, *quantity("mm^3/(N*mm)"), Field(gt=0)] | None = Field(
        default=None, description="worn volume of the coating over the energy of friction"
    )
    per_area: Annotated[Number, Field(gt=0)] | None = Field(
        default=None, description="k_A of the coating, depth over length wherever surfaces touch; above any base"
    )
    touching_from: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None,
        description="with per_area: pressure above which a place of the coating touches; by default that of the base",
    )
    modulus: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None,
        description="M of a compliant coating: its remaining thickness c closes by c (1 - exp(-p / M)); E (1 - nu) / "
        "((1 + nu) (1 - 2 nu)) of a thin coating; by default as stiff as its base",
    )
    friction: Annotated[Number, Field(ge=0)] | None = Field(
        default=None,
        description="mu of the coating, which changes to contact.friction over its last tenth; by default that",
    )

    one_of = (COEFFICIENTS,)
    together = (("archard", "hardness"),)
    checks = (
        Check(
            lambda s: s.present("touching_from") and not s.present("per_area"), "touching_from: expected with per_area"
        ),
        Check(
            lambda s: s.present("coefficient") and not 0 < s.coefficient < math.inf,
            "coefficient: expected a finite number above zero",
        ),
    )


class Film(Part):
    """A film that grows on a body: dh/dt = growth - R dw/dt, with R its Pilling-Bedworth ratio and w the worn depth.

    R volumes of oxide grow from one volume of metal, so that a film h has lowered its metal by h / R, and the surface
    stands h (1 - 1/R) above the unworn one. Wear counts metal, that in the worn oxide as well: it takes off R times its
    depth of film (T. F. J. Quinn, Wear 199, 1996, 169). A film that consumes no metal, as that of an additive, stands
    by all of h, and its growth has what takes it off.
    """

    growth: constant_or_dependence(  # type: ignore[valid-type]
        Annotated[Speed, Field(ge=0)], "mm/s", forms=("expression", "table")
    ) = Field(description="rate at which the film thickens, such as an expression of T, p and film, its thickness")
    initial: Annotated[Length, Field(ge=0)] = Field(default=0.0, description="thickness at the start")
    pilling_bedworth: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="volume of the film over that of the metal that it grows from; by default it consumes no metal, "
        "and wear takes nothing off it",
    )

    def state(self, body: str) -> State:
        """Return the thickness (mm) as a state of a body's wear law."""
        metal = 0.0 if self.pilling_bedworth is None else 1 / self.pilling_bedworth
        worn, key = f"wear_{body}", f"wear.{body}.film.growth"

        def rate(now: Mapping[str, Array]) -> Array:
            growth = place_values(self.growth, now, len(now[FILM]), "mm/s", key, -math.inf)
            return growth - now[worn] / metal if metal else growth

        asked = [name for name in (*VARIABLES, worn) if depends_on(self.growth, name) or (name == worn and metal)]
        return State(rate, asked, self.initial, "mm", 1 - metal, least=0.0)


def _zero_or_more(key: str) -> Check:
    """Return the check of a constant coefficient."""

    def wrong(law: WearLaw) -> bool:
        value = getattr(law, key)
        return isinstance(value, float) and not 0 <= value < math.inf

    return Check(wrong, f"{key}: expected a finite number, zero or larger")


def _of_linear_laws(key: str) -> Check:
    """Return the check of a coefficient that belongs to exponents of 1."""
    message = f"{key}: expected with exponents of 1 only; give coefficient"
    return Check(lambda law: law.present(key) and law.exponents != (1.0, 1.0), message)


class WearLaw(Part):
    """Wear rate normal to the surface = beta~ p^b v^a, equation (1).

    beta~ is given in one of three ways: as `coefficient`; or, for a = b = 1, by Archard's dimensionless coefficient K
    and the `hardness` H, beta~ = K / H; or by the volume worn for each energy of friction, `energy`, beta~ = energy mu.
    """

    coefficient: constant_or_dependence(Annotated[float | None, Unit("")]) = Field(  # type: ignore[valid-type]
        default=None,
        description="beta~, in (mm/s) MPa^-b (mm/s)^-a; with b = a = 1 also in other units of volume over load and "
        'distance, such as "1e-5 mm^3/(N m)"',
    )
    archard: Annotated[Number, Field(ge=0)] | None = Field(
        default=None, description="Archard's K; beta~ = K / hardness"
    )
    hardness: Hardness | None = Field(default=None, description="H, with archard")
    energy: Annotated[float, *quantity("mm^3/(N*mm)"), Field(ge=0)] | None = Field(
        default=None, description="worn volume over the energy of friction; beta~ = energy mu"
    )
    per_area: constant_or_dependence(Annotated[Number | None, Field(ge=0)], "") = Field(  # type: ignore[valid-type]
        default=None,
        description="k_A, worn depth over the sliding length wherever surfaces touch, whatever the pressure, as of "
        "polyethylene; in place of a law of the pressure",
    )
    touching_from: Annotated[Stress, Field(gt=0)] = Field(
        default=TOUCHING,
        description="with per_area: pressure above which a place touches; below it the wear is proportional to the "
        "pressure",
    )
    pressure_exponent: Annotated[Number, Field(gt=0)] = Field(default=1.0, description="exponent b of the pressure")
    pressure_threshold: Annotated[Stress, Field(ge=0)] = Field(
        default=0.0, description="p_0, below which nothing wears; above it the wear follows (p - p_0)^b"
    )
    pressure_cap: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None, description="pressure above which wear grows no more, such as the hardness"
    )
    speed_exponent: Annotated[Number, Field(gt=0)] = Field(default=1.0, description="exponent a of the speed")
    coating: Coating | None = Field(
        default=None,
        description="coating above this base, which wears where the coating is worn through; by default none",
    )
    film: Film | None = Field(
        default=None, description="film of oxide or tribofilm that grows on this body; by default none"
    )

    wears: ClassVar[bool] = True

    @staticmethod
    def coefficient_unit(pressure_exponent: float, speed_exponent: float) -> str:
        """Return the unit of beta~ for the exponents b and a: with 1 and 1 that of a specific wear rate."""
        if (pressure_exponent, speed_exponent) == (1, 1):
            return "mm^3/(N*mm)"
        unit = f"MPa^-{pressure_exponent:g}"
        return unit if speed_exponent == 1 else f"{unit}*mm^{1 - speed_exponent:g}*s^{speed_exponent - 1:g}"

    @property
    def unit(self) -> str:
        """The unit of beta~."""
        return self.coefficient_unit(self.pressure_exponent, self.speed_exponent)

    @model_validator(mode="before")
    @classmethod
    def _convert_coefficients(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        exponents = (data.get("pressure_exponent", 1.0), data.get("speed_exponent", 1.0))
        if not all(isinstance(e, (int, float)) and not isinstance(e, bool) and 0 < e < 100 for e in exponents):
            return data
        converted = dict(data)
        if not isinstance(data.get("coefficient"), (Mapping, Dependence, type(None))):
            try:
                converted["coefficient"] = convert(data["coefficient"], cls.coefficient_unit(*exponents))
            except ValueError as error:
                raise ValueError(f"coefficient: {error}") from None
        coating = data.get("coating")
        if isinstance(coating, Mapping) and coating.get("coefficient") is not None:
            try:
                unit = cls.coefficient_unit(*exponents)
                converted["coating"] = {**coating, "coefficient": convert(coating["coefficient"], unit)}
            except ValueError as error:
                raise ValueError(f"coating.coefficient: {error}") from None
        return converted

    @model_validator(mode="after")
    def _unit_of_coefficient(self) -> Self:
        try:
            _checked(self.coefficient, self.unit)
        except ValueError as error:
            raise ValueError(f"coefficient: {error}") from None
        return self

    one_of = (COEFFICIENTS,)
    together = (("archard", "hardness"),)
    checks = (
        Check(
            lambda s: s.present("per_area") and (s.present("pressure_cap") or s.pressure_threshold > 0),
            "per_area: expected without pressure_cap and pressure_threshold",
        ),
        Check(
            lambda s: not (s.present("per_area") or math.isclose(s.touching_from, TOUCHING)),
            "touching_from: expected with per_area",
        ),
        _zero_or_more("coefficient"),
        Check(
            lambda s: s.present("pressure_cap") and s.pressure_cap <= s.pressure_threshold,
            "pressure_cap: expected more than pressure_threshold",
        ),
        *map(_of_linear_laws, COEFFICIENTS[1:]),
        Check(
            lambda s: s.coating and not s.coating.present("coefficient") and s.exponents != (1.0, 1.0),
            "coating: expected a coefficient with other exponents than 1",
        ),
        Check(lambda s: s.film and s.coating, "film: expected without coating"),
    )

    @property
    def exponents(self) -> tuple[float, float]:
        """The exponents b and a."""
        return self.pressure_exponent, self.speed_exponent

    @property
    def gives_way(self) -> bool:
        """Whether a coating has a compliance beside that of the base."""
        return self.coating is not None and self.coating.modulus is not None

    @property
    def of_coating(self) -> WearLaw | None:
        """The law by which the coating wears; None without."""
        coating = self.coating
        if coating is None:
            return None
        keys = ("coefficient", "archard", "hardness", "energy", "per_area")
        changes: dict[str, Any] = {key: getattr(coating, key) for key in keys}
        if coating.per_area is not None:
            changes |= {"pressure_threshold": 0.0, "pressure_cap": None}
        if coating.touching_from is not None:
            changes["touching_from"] = coating.touching_from
        return self.model_copy(update={**changes, "coating": None})

    @property
    def cap(self) -> float:
        """Pressure beyond which wear grows no more, MPa; infinite without."""
        if self.per_area is not None:
            return self.touching_from
        return math.inf if self.pressure_cap is None else self.pressure_cap

    @property
    def coefficient_key(self) -> str:
        """Key of what may depend on the state."""
        return "coefficient" if self.per_area is None else "per_area"

    @property
    def given_coefficient(self) -> float | Dependence | None:
        """Coefficients that may depend on the state: the coefficient, or k_A."""
        coefficient: float | Dependence | None = self.coefficient if self.per_area is None else self.per_area
        return coefficient

    def states_of(self, body: str) -> Mapping[str, State]:
        """Return the states that the law of a body remembers, by their names."""
        given = self.given_coefficient
        states = given.states if isinstance(given, Dependence) else {}
        return {**states, FILM: self.film.state(body)} if self.film else states

    def depends_on(self, name: str) -> bool:
        """Return whether a variable such as T, p or depth is in it."""
        return depends_on(self.given_coefficient, name) or (
            self.film is not None and depends_on(self.film.growth, name)
        )

    @property
    def varies(self) -> bool:
        """Whether its wear changes with more than the place, or it remembers a state."""
        return self.film is not None or varies(self.given_coefficient)

    @property
    def scale(self) -> float:
        """The factor from values of a dependent coefficient to its internal unit."""
        if isinstance(self.coefficient, Dependence) and self.coefficient.unit:
            return _of_unit(self.coefficient.unit, *self.exponents)
        return 1.0

    def resolved(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return the dumped tables `data` of this law with the units of its coefficients."""
        if isinstance(self.coefficient, float):
            data["coefficient"] = quantity_text(self.coefficient, self.unit)
        if self.coating is not None and self.coating.coefficient is not None:
            data["coating"]["coefficient"] = quantity_text(self.coating.coefficient, self.unit)
        return data


class NoWear(WearLaw):
    """Stands for the law of a body that does not wear."""

    wears: ClassVar[bool] = False


NO_WEAR = NoWear.model_construct(coefficient=0.0)


class Wear(Part):
    """The wear law of each body that wears."""

    punch: WearLaw | None = Field(default=None, description="law of the punch; without it the punch does not wear")
    strip: WearLaw | None = Field(default=None, description="law of the strip; without it the strip does not wear")

    @property
    def laws(self) -> list[WearLaw]:
        """Laws of the bodies that wear."""
        return list(self.by_body.values())

    @property
    def of_bodies(self) -> tuple[WearLaw, WearLaw]:
        """The laws of punch and strip."""
        return self.by_body.get("punch", NO_WEAR), self.by_body.get("strip", NO_WEAR)

    @property
    def by_body(self) -> dict[str, WearLaw]:
        """The laws of the bodies that wear, by their roles."""
        return {body: getattr(self, body) for body in self.present("punch", "strip")}

    checks = (Check(lambda s: not s.laws, "expected the wear law of punch, strip or both"),)
