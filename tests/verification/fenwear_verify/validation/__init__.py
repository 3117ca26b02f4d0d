"""Measured experiments beside what fenwear predicts for them: the gallery of `fenwear validate`."""

from fenwear_verify.validation import (
    ball_on_disc,
    block_on_ring,
    cylinder_liners,
    disc_brake,
    fretting_cylinder,
    hip_in_patients,
    hip_simulator,
    polyethylene,
    sliding_metal,
)
from fenwear_verify.validation.experiment import Comparison, Experiment, Finding, experiments

__all__ = [
    "Comparison",
    "Experiment",
    "Finding",
    "ball_on_disc",
    "block_on_ring",
    "cylinder_liners",
    "disc_brake",
    "experiments",
    "fretting_cylinder",
    "hip_in_patients",
    "hip_simulator",
    "polyethylene",
    "sliding_metal",
]
