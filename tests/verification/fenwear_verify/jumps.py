"""Cycle jumps: scars that grow by far, and laws of temperature, pressure and speed, against marches and geometry."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fenwear.case import load_case, make_case
from fenwear.common.arrays import Array
from fenwear.steps import Block, jump, march
from fenwear.steps.driver import RunLimits
from fenwear.steps.evolve import jump_within
from fenwear.system import Tribosystem, assemble
from fenwear_verify.suite import Line, Plot, Result, Row, number, verification

RADIUS, FORCE = 17.5, 15.75  # mm; N/mm
RING_WEAR, STEPS, SLID = 2.27e-9, 450, 8000.0  # 1/MPa; of so many mm each
COARSE = ("geometry.degree=2", "geometry.parameters.elements_along_contact=8")  # as for what it is compared with
HEAT = ("heat.partition=0.2", "heat.debris=0", "heat.conductance=0.08", "heat.convecting_faces=true", *COARSE)
BY_TEMPERATURE = "wear.punch.coefficient={table=[[0, 4e-8], [50, 2.4e-7]]}"  # over K, six times as much at 50 K
LAWS = {
    "wear of p": ("example2", (*COARSE, "wear.punch.coefficient={expression='4e-8 * (1 + p / 20)'}")),
    "friction of p, wear of v": (
        "example1",
        (
            *COARSE,
            "contact.friction={expression='0.3 / (1 + p / 50)'}",
            "wear.punch.coefficient={expression='4e-8 * (1 + v / 20)'}",
        ),
    ),
    "constant, with heat": ("example1-heat", HEAT),
    "wear of T, friction of T and p": (
        "example1-heat",
        (*HEAT, BY_TEMPERATURE, "contact.friction={expression='0.2 + 0.001 * T - 0.0005 * p'}"),
    ),
}


def ring(elements: int = 80) -> Tribosystem:
    """Return a cylinder that wears on a flat as a block does on a ring, `elements` of degree 2 on 4 mm; collective."""
    sizes = {"radius": RADIUS, "punch_width": 16, "strip_length": 20, "strip_height": 10, "contact_width": 4.0}
    tables = load_case("fretting").model_dump(mode="json", exclude_unset=True, exclude={"folder"})
    tables["geometry"]["parameters"] |= {**sizes, "elements_along_contact": elements}
    tables["punch"]["loads"] = [{"on": "punch_top", "force": [0, -FORCE]}]
    tables["contact"]["friction"] = 0.3
    tables["wear"] = {"punch": {"coefficient": RING_WEAR}}
    tables["motion"] = {"kind": "one-way", "direction": "rightward", "speed": 200, "duration": SLID / 200}
    return assemble(make_case(tables))


@verification(
    "block-on-ring",
    "A block worn by a ring, whose contact grows, by cycle jumps",
    "geometry: area 2 a³ / 3 R and depth a² / 2 R of the scar, R the ring's radius; implicit steps one by one",
)
def block_on_ring() -> Result:
    """450 steps of 8 m with nodes 0.025 mm apart; the bodies give way by far less than the scar is deep."""
    system = ring()
    weights = system.pair.weights
    area = RING_WEAR * FORCE * STEPS * SLID
    half_width = (1.5 * area * RADIUS) ** (1 / 3)
    *_, whole = march(system, STEPS, implicit=True)
    blocks = list(jump(system, STEPS, tolerance=3e-3))
    last, count = blocks[-1], sum(len(block) for block in blocks)
    apart = weights @ np.abs(last.wear[-1] - whole.wear[-1])
    rows: list[Row] = [
        number("worn area (mm²)", area, weights @ last.wear[-1], 1e-9),
        number("depth (mm), by geometry", half_width**2 / (2 * RADIUS), last.wear[-1].max(), 5e-3),
        number("width of the scar (mm), by geometry", 2 * half_width, weights @ (last.pressure[-1] > 0), 2e-2),
        number("depth (mm), by single steps", whole.wear[-1].max(), last.wear[-1].max(), 1e-3),
        number("depths, by single steps: area between them over the scar's", 0, apart / area, 1e-3, scale=1),
        number("jumps, over those of 60 that are allowed at most", 0, max(0, count - 60), 1e-9, scale=1),
    ]
    x = system.pair.x
    plot = Plot(
        "Block on ring: worn depth",
        "x (mm)",
        "depth (mm)",
        [
            Line("single steps", x, whole.wear[-1], reference=True),
            Line(f"{count} jumps", x, last.wear[-1]),
        ],
    )
    return Result(rows, [plot])


@verification(
    "block-on-ring-published",
    "The built-in block on a ring: depth of the scar after 800 and 1,600 m",
    "two published finite-element models of Cruzado's test, one of level sets, one of moving meshes, 18 and 25 hours",
)
def published_ring() -> Result:
    """16.155 and 25.709 um by level sets; (1.5 R A)^(2/3) / 2R of rigid bodies, A = beta~ P' s."""
    system = assemble(load_case("block-on-ring"))
    case = system.case
    depths, rows = (16.155e-3, 25.709e-3), list[Row]()
    blocks = list(jump_within(system, RunLimits(3200, stops=frozenset((1600,)), block=1), tolerance=3e-3))
    for steps, depth in zip((1600, 3200), depths, strict=True):
        (worn,) = (block.wear[-1] for block in blocks if block.half_cycle[-1] == steps)
        area = 2e-9 * 65 / case.model.thickness * 500 * steps
        rigid = (1.5 * 20 * area) ** (2 / 3) / 40
        what = f"after {steps // 2:,} m"
        rows += [
            number(f"{what}: depth (mm), published", depth, worn.max(), 5e-3),
            number(f"{what}: depth (mm), of rigid bodies", rigid, worn.max(), 5e-3),
            number(f"{what}: worn area (mm²)", area, system.pair.weights @ worn, 1e-3),
        ]
    return Result(rows)


@verification(
    "jumps-of-laws",
    "Cycle jumps against half-cycles one by one, for laws of temperature, pressure and speed",
    "the mean of explicit and implicit marches, whose own difference is the wear within a cycle",
    slow=True,
)
def jumps_of_laws() -> Result:
    """200 half-cycles at two tolerances: the errors fall, to below what the two marches differ by."""
    rows: list[Row] = []
    for law, (case, settings) in LAWS.items():
        system = assemble(load_case(case, settings))
        explicit, implicit = (_end(march(system, 200, implicit=way)) for way in (False, True))
        for tolerance, bound in ((3e-2, 1e-2), (3e-4, 5e-4)):
            found = _end(jump(system, 200, tolerance=tolerance))
            for name, one, other, value in zip(("depth", "temperature"), explicit, implicit, found, strict=False):
                error = _apart(system.pair.weights, (one + other) / 2, value)
                what = f"{law}: {name}, tolerance {tolerance:g} (error over its mean)"
                rows.append(number(what, 0, error, bound, scale=1))
    return Result(rows)


def _end(blocks: Iterator[Block]) -> list[Array]:
    """Return depth and, with heat, the punch's contact temperature at the end of a run."""
    *_, last = blocks
    return [last.wear[-1]] if last.heat is None else [last.wear[-1], last.heat.temperature_punch[-1]]


def _apart(weights: Array, exact: Array, value: Array) -> float:
    """Return the mean difference over the mean, over the contact."""
    return float(weights @ np.abs(value - exact) / (weights @ np.abs(exact)))
