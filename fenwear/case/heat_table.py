"""The table of heat: its sharing, its ways out, and how it is computed.

The depth of heat in a strip that slides one way or turns is its diffusivity over its speed: below a contact of length
L, under which material passes at v, a layer sqrt(a L / v) heats up, a = k / (rho c) (J. C. Jaeger, Moving sources of
heat and the temperature at sliding contacts, 1942).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from fenwear.case.material_tables import Material
from fenwear.case.motion_table import OneWay, Rotation
from fenwear.case.table_parts import CONDUCTANCE, Check, Conductance, Number, Part, Temperature, Unit, quantity
from fenwear.common.units import convert, quantity_text, shown


def _perfect_or_conductance(value: object) -> float | str:
    """Convert a conductance, which may be perfect, or that of the layer."""
    if value in ("perfect", "layer"):
        return str(value)
    try:
        conductance = convert(value, CONDUCTANCE)
    except ValueError as error:
        raise ValueError(f"{error}; or 'perfect' or 'layer'") from None
    if conductance < 0:
        raise ValueError(f"expected greater than or equal to 0, got {shown(value)}")
    return conductance


PerfectOrConductance = Annotated[
    float | Literal["perfect", "layer"],
    Unit(CONDUCTANCE),
    BeforeValidator(_perfect_or_conductance),
    PlainSerializer(lambda value: value if isinstance(value, str) else quantity_text(value, CONDUCTANCE)),
]


class Track(Part):
    """The rest of a disc or ring whose material passes under the punch, warms up and comes back."""

    volume: Annotated[float, *quantity("mm^3"), Field(ge=0)] = Field(
        default=0.0, description="volume outside the mesh; its heat capacity is that of the strip's material"
    )
    area: Annotated[float, *quantity("mm^2"), Field(ge=0)] = Field(
        default=0.0, description="free surface of that volume, which loses heat by heat.convection"
    )
    heat_capacity: Annotated[float, *quantity("N*mm/K"), Field(ge=0)] = Field(
        default=0.0, description="heat capacity outside the mesh, in place of volume; 1 J/K = 1000"
    )
    loss: Annotated[float, *quantity("N*mm/(s*K)"), Field(ge=0)] = Field(
        default=0.0, description="heat loss to the surroundings, in addition to that of area; 1 W/K = 1000"
    )

    checks = (
        Check(lambda s: (s.volume > 0) == (s.heat_capacity > 0), "expected either volume or heat_capacity, above zero"),
    )


class Heat(Part):
    """Friction heat and its conduction; without this table a case knows no temperature."""

    partition: Annotated[Number, Field(ge=0, le=1)] = Field(
        default=0.5, description="kappa, the punch's share of the friction heat"
    )
    debris: Annotated[Number, Field(ge=0, lt=1)] = Field(
        default=0.0, description="gamma_d, share of the heat that debris carries off"
    )
    conductance: PerfectOrConductance = Field(
        default="perfect",
        description="h_c between punch and strip where they touch, 1 W/(m² K) = 0.001; by default 0 where partition "
        "is given; 'layer': that of the asperities of contact.layer",
    )
    conductance_per_pressure: tuple[Annotated[float, *quantity("N/(mm*s*K*MPa)"), Field(gt=0)], ...] | None = Field(
        default=None, min_length=2, max_length=2, description="h_1, h_2: the conductance is p h_1 h_2 / (h_1 + h_2)"
    )
    conducting: Literal["closed", "nominal"] = Field(
        default="closed", description="nodes that conduct: those in contact, or the whole nominal interface"
    )
    convection: Annotated[Conductance, Field(ge=0)] = Field(
        default=0.0, description="h on all other boundaries and on the two faces of the plane model, 1 W/(m² K) = 0.001"
    )
    convecting_faces: bool = Field(default=True, description="whether the faces of the plane model also convect")
    ambient: Temperature = Field(default=0.0, description="temperature theta_a of the surroundings, from any zero")
    inflow: Temperature | None = Field(
        default=None,
        description="temperature of the strip's material that enters through free ends, sliding one way; by default "
        "the ambient",
    )
    track: Track | None = Field(default=None, description="closed track of one-way sliding, which warms up as a whole")
    initial: Temperature = Field(default=0.0, description="temperature at the start, free of thermal stress")
    steps: Annotated[int, Field(ge=1, le=1000, strict=True)] | None = Field(
        default=None,
        description="time steps of each half-cycle; by default as many as step_tolerance requires, or 5 where nothing "
        "passes",
    )
    step_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=0.005,
        description="largest relative change of contact temperatures by halving the steps",
    )
    coupling: Literal["implicit", "split"] = Field(
        default="implicit", description="solution of heat and contact: together, or in turn by the operator split"
    )
    split_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=1e-4, description="change of the gap volume that ends the operator split, equation (30)"
    )
    relaxation: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.5, description="relaxation of the pressure in the operator split, equation (29)"
    )
    operator: Literal["reduced", "full"] = Field(
        default="reduced", description="temperatures on a small basis, or on the whole mesh"
    )
    # The keys that the operators of the bodies do not depend on.
    exchange_keys: ClassVar[frozenset[str]] = frozenset(
        (
            *("partition", "debris", "conductance", "conductance_per_pressure", "conducting"),
            *("coupling", "split_tolerance", "relaxation"),
        )
    )

    property_tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=0.02,
        description="relative change of a material's property with the temperature after which the bodies are "
        "assembled again",
    )
    # Finer than 1e-8 the basis, found by squares, would be made of rounding.
    reduction_tolerance: Annotated[Number, Field(ge=1e-7, lt=1)] = Field(
        default=3e-5, description="relative tolerance of the reduced operator's basis"
    )
    reduction_difference: Annotated[Number, Field(gt=0, lt=1)] = Field(
        default=2e-3,
        description="largest relative difference of contact temperatures and thermal gap from those of the whole "
        "mesh; above it the basis is enlarged, and then a run warns",
    )

    @model_validator(mode="before")
    @classmethod
    def _conductance_by_default(cls, data: object) -> object:
        """Let a partition that is given rule, and leave the sharing to conduction where none is."""
        if not isinstance(data, Mapping) or data.get("conductance") is not None:
            return data
        ruled = data.get("partition") is not None or data.get("conductance_per_pressure") is not None
        return {**data, "conductance": 0.0 if ruled else "perfect"}

    checks = (
        Check(lambda s: s.track and s.present("inflow"), "inflow: expected none with heat.track, whose bulk enters"),
        Check(lambda s: s.track and s.operator != "reduced", "operator: expected 'reduced' with heat.track"),
        Check(
            lambda s: s.conductance_per_pressure and s.conductance != 0,
            "conductance: give either conductance or conductance_per_pressure",
        ),
    )


def diffusion_of(motion: OneWay | Rotation, steps: Iterable[Any], materials: Iterable[Material]) -> dict[str, float]:
    """Return a / v, mm, or where the strip turns a / omega, mm²/rad, by the parameter of the ready geometries.

    The smallest of all materials and speeds; none where the strip stands.

    Args:
        motion: Of the strip that conducts heat and passes.
        steps: Of its program, whose speeds count, too.
        materials: Of its regions, with constants.
    """
    name, key, speed = (
        ("diffusion_length", "speed", motion.speed)
        if isinstance(motion, OneWay)
        else ("diffusion_area", "angular_speed", motion.angular_speed)
    )
    fastest = max([speed, *(step_speed for step in steps for step_speed in getattr(step, key) or ())])
    diffusivities = [(m.conductivity or 0.0) / ((m.density or 0.0) * (m.heat_capacity or 0.0)) for m in materials]
    return {name: min(diffusivities) / fastest} if fastest > 0 else {}
