"""The table of the contact: its law, its friction, and what lies between the surfaces.

Debris that stays (the third body), compliant layers, and mixed lubrication.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, WrapValidator

from fenwear.case.material_tables import Creep
from fenwear.case.table_parts import Hardness, Length, Number, Part, Stress, quantity, rising
from fenwear.case.wear_table import Dependence, WearLaw, constant_or_dependence, depends_on, of_place, varies

STIFFNESS, DENSITY = "MPa/mm", "1/mm^2"
_Share = Annotated[Number, Field(ge=0, le=1)] | None
_Film = Annotated[Length, Field(gt=0)] | None
_ShareOverLambda = Annotated[
    tuple[tuple[Number, Annotated[Number, Field(ge=0, le=1)]], ...],
    rising("at least two pairs [lambda, share] with rising lambda"),
]
OF = ("T", "p", "v", "x", "y", "z")  # what the share of asperities and the film may depend on
CONTACT_LAWS: set[str] = set()  # that are registered beside fenwear's own, see `system.contact_laws`


def _built_in_or_registered(name: Any, handler: Callable[[Any], Any]) -> Any:
    return name if isinstance(name, str) and name in CONTACT_LAWS else handler(name)


class ThirdBody(Part):
    """Debris that stays between the surfaces as a layer of thickness t >= 0, until it is lost.

    Over the sliding distance s of a place, dt/ds = share * (worn depth of both bodies)' - t / life, and at the distance
    d from an edge of the contact - exp(-d / edge_length) t / edge_life besides: what is worn is kept in part, and lost
    as it slides. The gap is the worn one less t.
    """

    share: Annotated[Number, Field(ge=0, le=1)] = Field(
        description="share of the worn volume of both bodies that stays at its place as debris; the rest is ejected "
        "at once"
    )
    life: constant_or_dependence(Annotated[Length, Field(gt=0)], "mm", forms=("expression", "table", "law")) = Field(  # type: ignore[valid-type]
        description="sliding distance over which 1 - 1/e of the debris at a place is ejected; an expression, a table "
        "or a registered law of the variables of coefficients, such as debris (its thickness, mm) and edge; the loss "
        "is t / life over sliding distance"
    )
    edge_life: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="life of debris at an edge of the contact, where surfaces part or the punch's surface ends, in "
        "addition to life; by default edges lose as any place does",
    )
    edge_length: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="with edge_life: distance from the edge over which that loss falls by a factor of e"
    )
    initial: Annotated[Length, Field(ge=0)] = Field(
        default=0.0, description="thickness at the start, such as of a powder or a solid lubricant"
    )
    carried_by: str = Field(
        default="punch",
        description="name of the body that carries the debris; on the strip it passes through the contact and comes "
        "back, or lies along a closed track",
    )

    together = (("edge_life", "edge_length"),)

    def asks(self, name: str) -> bool:
        """Return whether the loss depends on a variable of coefficients."""
        return bool(name == "edge" and self.present("edge_life")) or depends_on(self.life, name)

    @property
    def varies(self) -> bool:
        """Whether the loss changes with more than the place."""
        return bool(self.present("edge_life")) or varies(self.life)


class LinearLayer(Part):
    """A layer that closes by p / stiffness, after Winkler."""

    kind: Literal["linear"] = Field(description="closure proportional to the pressure")
    stiffness: of_place(Annotated[float, *quantity(STIFFNESS), Field(gt=0)], STIFFNESS) = Field(  # type: ignore[valid-type]
        description="pressure over closure"
    )
    creep: Creep | None = Field(default=None, description="growth of its closure under load; by default none")

    units: ClassVar[Mapping[str, str]] = {"stiffness": STIFFNESS}


class PowerLayer(Part):
    """A layer that closes by reference (p / pressure)^exponent, as ground joints of machine tools do."""

    kind: Literal["power"] = Field(description="closure as a power of the pressure")
    reference: of_place(Annotated[Length, Field(gt=0)], "mm") = Field(  # type: ignore[valid-type]
        description="closure at the pressure"
    )
    pressure: of_place(Annotated[Stress, Field(gt=0)], "MPa") = Field(  # type: ignore[valid-type]
        description="pressure that closes it by the reference"
    )
    exponent: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.5, description="exponent of the pressure; 0.5 of ground joints"
    )

    units: ClassVar[Mapping[str, str]] = {"reference": "mm", "pressure": "MPa"}


class ExponentialLayer(Part):
    """A layer whose pressure grows by p = pressure (exp(closure / length) - 1)."""

    kind: Literal["exponential"] = Field(description="pressure that grows exponentially with the closure")
    length: of_place(Annotated[Length, Field(gt=0)], "mm") = Field(  # type: ignore[valid-type]
        description="closure by which the pressure grows by a factor of e, as of rough surfaces: 0.3 to 0.5 of their "
        "rms height"
    )
    pressure: of_place(Annotated[Stress, Field(gt=0)], "MPa") = Field(  # type: ignore[valid-type]
        description="scale of the pressure, reached at 0.69 lengths"
    )

    units: ClassVar[Mapping[str, str]] = {"length": "mm", "pressure": "MPa"}


class RoughLayer(Part):
    """Rough surfaces after Greenwood and Williamson: round asperities of one radius and Gaussian heights."""

    kind: Literal["rough"] = Field(description="asperities after Greenwood and Williamson")
    roughness: of_place(Annotated[Length, Field(gt=0)], "mm") = Field(  # type: ignore[valid-type]
        description="Sa of both surfaces together, the root of the sum of both squares; their rms height is 1.2533 Sa"
    )
    asperity_radius: of_place(Annotated[Length, Field(gt=0)], "mm") = Field(  # type: ignore[valid-type]
        description="mean radius of the asperities' tips"
    )
    asperity_density: of_place(Annotated[float, *quantity(DENSITY), Field(gt=0)], DENSITY) = Field(  # type: ignore[valid-type]
        description="number of asperities on an area"
    )
    modulus: Annotated[Stress, Field(gt=0)] | None = Field(
        default=None, description="E* of the asperities; by default that of the materials at the contact"
    )

    units: ClassVar[Mapping[str, str]] = {"roughness": "mm", "asperity_radius": "mm", "asperity_density": DENSITY}


Layers = LinearLayer | PowerLayer | ExponentialLayer | RoughLayer


class Lubrication(Part):
    """Mixed lubrication: asperities carry a share of the pressure, by which they wear, and the fluid the rest.

    The share is given as a law of speed, pressure and temperature, or over lambda, film thickness over roughness.
    """

    asperity_share: constant_or_dependence(_Share, "", OF, ("expression", "table")) = Field(  # type: ignore[valid-type]
        default=None,
        description="share of the pressure that asperities carry, from 0 to 1; a function of p, v, T and the place",
    )
    film: constant_or_dependence(_Film, "mm", OF, ("expression", "table")) = Field(  # type: ignore[valid-type]
        default=None, description="film thickness as a function of p, v, T and the place, in place of asperity_share"
    )
    roughness: Annotated[Length, Field(gt=0)] | None = Field(
        default=None, description="rms height of both surfaces together, with film: lambda = film / roughness"
    )
    share_over_lambda: _ShareOverLambda | None = Field(
        default=None, description="[lambda, share] pairs with straight lines between, with film"
    )
    fluid_friction: Annotated[Number, Field(ge=0)] = Field(
        default=0.0, description="coefficient of friction of the fluid; contact.friction is that of the asperities"
    )

    one_of = (("asperity_share", "film"),)
    together = (("film", "roughness", "share_over_lambda"),)

    @property
    def key(self) -> str:
        """The key that gives the share."""
        return self.present("asperity_share", "film")[0]

    @property
    def coefficient(self) -> Any:
        """The value that gives the share."""
        return getattr(self, self.key)

    @property
    def uniform_share(self) -> float | None:
        """The share where it is one number; None where it depends on anything."""
        value = self.coefficient
        if isinstance(value, Dependence):
            return None
        if self.share_over_lambda and self.roughness:
            return float(np.interp(value / self.roughness, *np.array(self.share_over_lambda).T))
        return float(value)

    @property
    def varies(self) -> bool:
        """Whether the share changes with more than the place."""
        return varies(self.coefficient)


class Contact(Part):
    """Unilateral contact with Coulomb friction: in gross sliding of known direction, or with stick."""

    law: Annotated[Literal["gross-sliding", "coulomb", "auto"], WrapValidator(_built_in_or_registered)] = Field(
        default="auto",
        description="gross-sliding: every node slips in the direction of the motion; coulomb: nodes stick or slip, as "
        "in fretting; auto: coulomb where the bodies take up more than a tenth of the stroke elastically "
        "and the case supports it, else gross-sliding",
    )
    between: tuple[str, str] | None = Field(
        default=None,
        description="names of both bodies, such as ['bushing', 'shaft'], in place of punch and strip; their tables are "
        "bodies.NAME and wear.NAME",
    )
    slides: str = Field(default="", description="name of the body that slides; by default the second of between")
    friction: constant_or_dependence(Annotated[Number, Field(ge=0)], "") = Field(  # type: ignore[valid-type]
        default=0.0, description="coefficient of friction mu"
    )
    friction_temperature: str = Field(
        default="mean",
        description="temperature T of friction and of lubrication: mean or hotter of both surfaces, or that of a "
        "body, by its name",
    )
    transverse_friction: Number = Field(
        default=0.0, description="mu_d of the traction -mu_d p across the sliding direction, equation (5)"
    )
    lubrication: Lubrication | None = Field(
        default=None, description="mixed lubrication; without this table asperities carry all"
    )
    third_body: ThirdBody | None = Field(
        default=None, description="debris that stays between the surfaces; without this table none does"
    )
    hardness: Hardness | None = Field(
        default=None,
        description="H, the largest pressure; beyond it the surface flows, to a plastic depth apart from wear",
    )
    layer: Annotated[Layers, Field(discriminator="kind")] | None = Field(
        default=None,
        description="compliant layer between the bodies in addition to their elasticity, such as roughness",
    )

    def asks(self, name: str, wear: Iterable[WearLaw]) -> bool:
        """Return whether friction, these wear laws or the loss of debris depend on a variable of coefficients."""
        lost = self.third_body is not None and self.third_body.asks(name)
        wear = tuple(wear)
        if name == "p" and any(self.splits_pressure(law) for law in wear):
            return True
        return lost or self.friction_asks(name) or any(law.depends_on(name) for law in wear)

    @property
    def uniform_share(self) -> float | None:
        """Share of the pressure that asperities carry; None where it depends on anything."""
        return 1.0 if self.lubrication is None else self.lubrication.uniform_share

    def splits_pressure(self, law: WearLaw) -> bool:
        """Return whether a share of the pressure that is not uniform stands in a law that is more than a power."""
        return self.uniform_share is None and (law.pressure_threshold > 0 or law.cap < float("inf"))

    def friction_asks(self, *names: str, of_share: bool = True) -> bool:
        """Return whether friction, or that of asperities alone, depends on one of these variables of coefficients."""
        share = self.lubrication.coefficient if of_share and self.lubrication is not None else None
        return depends_on(self.friction, *names) or depends_on(share, *names)
