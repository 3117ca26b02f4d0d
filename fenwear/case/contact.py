"""The table of the contact: its law, its friction, and what lies between the surfaces."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import Field, WrapValidator, model_validator

from fenwear.case.laws import Dependence, WearLaw, constant_or_dependence
from fenwear.case.layers import Layers, ThirdBody
from fenwear.case.lubrication import Lubrication
from fenwear.case.quantities import Hardness, Number, Part

CONTACT_LAWS: set[str] = set()  # that are registered beside fenwear's own, see `assembly.laws`


def _own_or_registered(name: Any, own: Callable[[Any], Any]) -> Any:
    return name if isinstance(name, str) and name in CONTACT_LAWS else own(name)


class Contact(Part):
    """Unilateral contact with Coulomb friction: in gross sliding of known direction, or with stick."""

    law: Annotated[Literal["gross-sliding", "coulomb", "auto"], WrapValidator(_own_or_registered)] = Field(
        default="auto",
        description="gross-sliding: every node slips in the direction of the motion; coulomb: nodes stick or slip, "
        "as in fretting; auto: coulomb where the bodies take up more than a tenth of the stroke elastically and "
        "nothing goes against it, else gross-sliding",
    )
    friction: constant_or_dependence(Annotated[Number, Field(ge=0)]) = Field(  # type: ignore[valid-type]
        default=0.0, description="coefficient of friction mu"
    )
    friction_temperature: str = Field(
        default="mean",
        description="T of friction and of lubrication: mean or hotter of both surfaces, or that of a body, by its name",
    )
    transverse_friction: Number = Field(
        default=0.0, description="mu_d, of the traction -mu_d p across the sliding direction, equation (5)"
    )
    lubrication: Lubrication | None = Field(
        default=None, description="mixed lubrication; without this table asperities carry all"
    )
    third_body: ThirdBody | None = Field(
        default=None, description="debris that stays between the surfaces; without this table none does"
    )
    hardness: Hardness | None = Field(
        default=None,
        description="H: no pressure is beyond it; what would be flows, to a plastic depth that stays, apart from wear",
    )
    layer: Annotated[Layers, Field(discriminator="kind")] | None = Field(
        default=None, description="what gives way between the bodies beside their own elasticity, such as roughness"
    )

    def asks(self, name: str, wear: Iterable[WearLaw | None]) -> bool:
        """Return whether friction, these wear laws or the loss of debris depend on a variable of coefficients."""
        lost = self.third_body is not None and self.third_body.asks(name)
        wear = tuple(wear)
        if name == "p" and any(self.splits_pressure(law) for law in wear):
            return True
        given = (law.given_coefficient for law in wear if law is not None)
        return lost or self.friction_asks(name) or any(_asks(one, name) for one in given)

    @property
    def uniform_share(self) -> float | None:
        """Share of the pressure that asperities carry; None where it depends on anything."""
        return 1.0 if self.lubrication is None else self.lubrication.uniform_share

    def splits_pressure(self, law: WearLaw | None) -> bool:
        """Return whether a share of the pressure that is not uniform stands in a law that is more than a power."""
        return law is not None and self.uniform_share is None and (law.pressure_threshold > 0 or law.cap < float("inf"))

    def friction_asks(self, *names: str, of_share: bool = True) -> bool:
        """Return whether friction, or that of asperities alone, depends on one of these variables of coefficients."""
        share = self.lubrication.given[1] if of_share and self.lubrication is not None else None
        return _asks(self.friction, *names) or _asks(share, *names)

    @model_validator(mode="after")
    def _pure_number(self) -> Self:
        if isinstance(self.friction, Dependence) and self.friction.unit:
            raise ValueError(f"friction: expected no unit: its values are pure numbers, got {self.friction.unit!r}")
        return self


def _asks(value: object, *names: str) -> bool:
    """Return whether a coefficient depends on one of these variables."""
    return isinstance(value, Dependence) and any(map(value.depends_on, names))
