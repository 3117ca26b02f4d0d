"""States that the model computes and that can hardly be true: a table of rules.

rules     the table: what each rule looks at, the key it is about, and its message
monitor   applies the table to the first contact, to the blocks and stages of a run, and to steady states
boundary  where a contact surface ends: rims, chamfers, thickness
meshes    meshes that are too coarse for a contact, or in another unit
elastic   displacements beyond small strain, and strokes that the bodies take up elastically
"""

from fenwear.plausibility.elastic import TAKEN_UP, elastic_share, elastic_way
from fenwear.plausibility.monitor import (
    HeatMonitor,
    StateMonitor,
    fineness_text,
    law_warnings,
    passing_text,
    sliding_text,
    unique_text,
    uniques,
)
from fenwear.plausibility.rules import RULES, Made, Rule, Seen, remarks

__all__ = [
    "RULES",
    "TAKEN_UP",
    "HeatMonitor",
    "Made",
    "Rule",
    "Seen",
    "StateMonitor",
    "elastic_share",
    "elastic_way",
    "fineness_text",
    "law_warnings",
    "passing_text",
    "remarks",
    "sliding_text",
    "unique_text",
    "uniques",
]
