"""The table of a topography: a measured height map, or a made rough or wavy surface, on top of a body's shape."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from fenwear.case.quantities import Length, Number, Part

Positive = Annotated[Length, Field(gt=0)]


def _degree(value: object) -> object:
    """Return the degree of a polynomial that has a name."""
    return {"plane": 1, "mean": 0}.get(value, value) if isinstance(value, str) else value


class Topography(Part):
    """Heights of a surface above its shape: of a map in a file, self-affine, or wavy; on a contact grid alone."""

    file: str | None = Field(
        default=None,
        description="a height map: .npz with height, x (and y) and the unit of all, .nc with them and a unit of each; "
        ".csv with columns x, (y,) height and their units; .sur, .plu, .al3d, .opd, .xyz, ... by SurfaceTopography or "
        "surfalize, where one of them is installed",
    )
    holes: Literal["reject", "fill", "keep"] = Field(
        default="reject",
        description="of a map: points without a number, fill values such as -9999 and spikes; fill: by their "
        "neighbours; keep: heights far beyond the others are real",
    )
    level: Annotated[int, BeforeValidator(_degree), Field(ge=0, le=8)] | None = Field(
        default=None,
        description="what is taken off a map: plane, or a polynomial of this degree; by default nothing",
    )
    rms: Positive | None = Field(default=None, description="Sq of a made self-affine surface, mean zero")
    hurst: Annotated[Number, Field(gt=0, le=1)] = Field(default=0.8, description="H: the spectrum falls by q^-2(1+H)")
    longest: Positive | None = Field(default=None, description="wave length from which on it has roughness")
    shortest: Positive | None = Field(default=None, description="down to which; by default 8 spacings of the grid")
    seed: Annotated[int, Field(ge=0, strict=True)] = Field(
        default=0, description="of its phases: the same surface again"
    )
    amplitude: Positive | None = Field(default=None, description="or of a wave, half of peak to valley")
    wavelength: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=2)] | None = Field(
        default=None, description="of the wave along the grid, [x] or [x, y]; of two the product of both cosines"
    )
    height_factor: Number = Field(default=1.0, description="by which all heights are taken")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = {
            "file": self.file is not None,
            "rms": self.rms is not None or self.longest is not None,
            "amplitude": self.amplitude is not None or self.wavelength is not None,
        }
        if sum(given.values()) != 1:
            raise ValueError("expected one of file, rms (with longest) and amplitude (with wavelength)")
        if given["rms"] and (self.rms is None or self.longest is None):
            raise ValueError("expected rms and longest of a self-affine surface")
        if given["amplitude"] and (self.amplitude is None or self.wavelength is None):
            raise ValueError("expected amplitude and wavelength of a wavy surface")
        if self.shortest is not None and self.longest is not None and self.shortest >= self.longest:
            raise ValueError("shortest: expected less than longest")
        return self
