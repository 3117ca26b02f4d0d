"""What is refused together though each by itself is fine: of every such message why; read by the docs, too.

`test_refusals.py` walks the source: a message that names two things which do not go together is entered here, or the
test fails. Physics: there is no such thing, or no such state. Model: the equations, or a way to solve them, are of
something else, and what to take instead says the message. Nothing is refused as it is not written.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import fenwear

PHYSICS, MODEL = "physics", "model"
KINDS = {MODEL: "Of the model, or of the way it is solved", PHYSICS: "Of nature"}
ROOMS = (
    "assembly",
    "bodies",
    "case",
    "contact",
    "cycle",
    "flash",
    "heat",
    "interface",
    "layers",
    "life",
    "sliding",
    "stick",
)

ASKS = re.compile(
    r"\b(expected|missing|exists?|solved for|belongs?|depends|act|grow|loads?|lose no|solves)\b|not (go|change)|^with ",
    re.IGNORECASE,
)
TOGETHER = re.compile(
    r"\bwith(out)?\b|only then|\bin (rings|solids|a plane|plane|one-way|a cycle)\b|belongs to|not (go|change)\b|where "
    r"|depends on|to and fro|turns|creep|for ever|way there|heat\.|rigid|different ways|'reduced'|in its place"
    r"|every node"
)
ACROSS = ("case/checks.py",)  # all that it says is of several tables

# By the file below `fenwear`: a part of the message, and what of the model or of nature it is.
REFUSALS: dict[str, dict[str, tuple[str, str]]] = {
    "assembly/bodies.py": {
        "act where supports hold": (PHYSICS, "a load where its own motion is held: no force comes to the contact")
    },
    "assembly/grids.py": {
        "none in rings": (MODEL, "`grid` in rings: their forces are of whole circles, no kernel of a half-space is")
    },
    "assembly/strokes.py": {
        "does not slide along itself": (PHYSICS, "a cycle that moves the strip into or off the punch")
    },
    "bodies/half_space.py": {
        "then has as much of the surface": (
            MODEL,
            '`operator = "half-space"` on elements of degree 2, whose nodes have unequal areas',
        ),
        "knows of no supports": (PHYSICS, "a half-space and supports that move it: it is held far away"),
    },
    "bodies/mesh.py": {"has physical volumes": (PHYSICS, "volumes in a plane model")},
    "bodies/supports.py": {
        "may be free along z alone": (
            MODEL,
            "a body that is free along the surface's normal where this is not z: turn the geometry",
        ),
        "parts that share no node": (PHYSICS, "a part that nothing holds"),
    },
    "case/bodies.py": {
        "belongs to plane models": (PHYSICS, "a state of the plane in solids or rings"),
        "what acts on them is the same all around": (PHYSICS, "loads through a point, and moments that bend, on rings"),
    },
    "case/laws.py": {
        "with exponents of 1 only": (PHYSICS, "`archard` and `energy`, laws of p v, with other exponents"),
        "without pressure_cap and pressure_threshold": (
            PHYSICS,
            "wear per contact area, whose pressure is given, with bounds of pressure",
        ),
    },
    "case/motions.py": {
        "ends where it begins": (PHYSICS, "a cycle that does not come back"),
        "a motion that ends where it starts": (PHYSICS, "a stroke that does not come back"),
    },
    "case/checks.py": {
        "as thin as its own nodes are wide": (MODEL, 'heat on contact grids, `"fine"` bodies and half-spaces: above'),
        "one solution for each node; or": (
            MODEL,
            "`grid.across` with condensed bodies: each growth would condense them anew",
        ),
        "which a coarser grid would lose": (
            PHYSICS,
            "`grid.across` with topography: a coarser grid has no place for its heights",
        ),
        ".fix.{}: expected": (PHYSICS, "supports along axes that a model does not have"),
        "components ({})": (PHYSICS, "vectors along axes that a model does not have"),
        "[0, 1, 0], out of the plane": (PHYSICS, "turning about another axis than a plane model's"),
        "expected the axis z of the rings": (PHYSICS, "rings that turn about another axis than theirs"),
        "rotation or oscillation, or a cycle": (PHYSICS, "rings that slide along a line: they open"),
        "motion.along: belongs to solids": (PHYSICS, "directions in space of a plane model"),
        "takes heat out of a plane model": (
            MODEL,
            "heat and sliding along x and y together: what leaves along y carries heat away; a solid has it",
        ),
        "the strip stays in its place": (PHYSICS, "gross sliding without motion"),
        "expected 1 for sliding out of the plane": (
            PHYSICS,
            "places of a strip that slides out of the plane: all are alike",
        ),
        "the table heat does not know": (PHYSICS, "coefficients of T without heat"),
        "expected friction where beta or energy": (PHYSICS, "wear by the work of friction without friction"),
        "without contact.third_body does not know": (PHYSICS, "coefficients of debris without debris"),
        "no load of the case acts on it": (PHYSICS, "factors of loads that do not exist"),
        "}.{}: does not change with motion.kind": (
            PHYSICS,
            "steps of a program that change what their motion does not have",
        ),
        "nodes slide different ways in a cycle": (
            PHYSICS,
            "steps of a cycle's table by distance, or coefficients of it: each node has its own",
        ),
        "expected a case with the table heat": (PHYSICS, "ambient temperatures without heat"),
        "which does not turn": (PHYSICS, "a radius of what does not turn"),
        "cycles do not repeat while": (PHYSICS, "`run.periodic_within` while loads still change"),
        "motion.kind = '{}': expected 'cycle'": (PHYSICS, "other tables in a program whose motion is none"),
        "cycles slide different ways": (PHYSICS, "coefficients of s where a program changes the table"),
        "since the strip's wear": (PHYSICS, "a strip that wears in a single place: its wear spreads over the stroke"),
        "with contact.law = 'coulomb' only": (PHYSICS, "what a rig imposes on stick, in gross sliding"),
        "friction being against the slip": (PHYSICS, "stick with a given transverse friction: its direction is found"),
        "allow no stick there": (MODEL, "stick in rings, whose model has no displacement around the axis"),
        "as a matrix of its tractions": (
            MODEL,
            'stick with `heat.operator = "full"`, the check of the reduced basis: the basis is that of gross sliding, '
            "where it is checked; a time step needs temperatures as a matrix of its tractions, a solve on the mesh for "
            "each contact node and step",
        ),
        "found together with its heat": (
            MODEL,
            'stick with `heat.coupling = "split"`, which heats by the step before: stick takes one Newton step '
            "of contact and heat together: nothing is saved, and a node may stick by what heated it a step before",
        ),
        "motion.kind: expected a motion to and fro": (
            PHYSICS,
            "stick one way: after the first of it all slips, and gross sliding is the answer",
        ),
        "motion.axis: expected 'x'": (
            MODEL,
            "stick and sliding out of a plane model, whose tractions lie in the plane: a solid has it",
        ),
        "whose tractions lie in the plane": (MODEL, "the same by a cycle's table"),
        "none for a motion that turns": (
            PHYSICS,
            "a force of the rig that a turning motion does not have: it would be a couple",
        ),
        "to and fro the same material stays": (PHYSICS, "inflow and a closed track, to and fro"),
        "crept material leaves": (PHYSICS, "a strip that creeps, one way: no crept material stays"),
        "whose steps every rank makes alike": (MODEL, "the same with all temperatures, which the ranks share"),
    },
    "case/thermal.py": {
        "whose bulk comes in": (PHYSICS, "inflow on a closed track"),
        "'reduced' with heat.track": (
            MODEL,
            'a closed track with `heat.operator = "full"`: its bulk is one of the numbers that the basis has',
        ),
    },
    "cycle/steady.py": {
        "no single rigid motion follows the wear": (PHYSICS, "an end where loads press to either side in turn"),
        "its track deepens": (PHYSICS, "an end where the strip wears to and fro"),
        "with the worn depth or the distance slid": (PHYSICS, "an end of laws of depth or distance"),
        "the logarithm of time": (PHYSICS, "an end of creep without end"),
        "with any pressure exists": (PHYSICS, "an end of wear between bodies that are held apart"),
        "by a rigid motion": (PHYSICS, "an end whose loads no wear balances"),
        "beyond it wear grows no more": (PHYSICS, "an end beyond `pressure_cap`"),
        "without plastic flow exists": (PHYSICS, "an end beyond `contact.hardness`, in gross sliding"),
    },
    "cycle/steady_inequality.py": {
        "no shape stays": (
            PHYSICS,
            "an end where only a strip's turning about a hinge that slides with it could follow the wear: each place "
            "wears a facet of its own, deeper for ever",
        )
    },
    "flash/temperatures.py": {
        "to and fro the same material stays": (PHYSICS, "`flash` with `heat.inflow` of a strip that goes to and fro")
    },
    "flash/source.py": {
        "shifts and turns the strip in many ways": (
            MODEL,
            "`flash` of a cycle that is a table: kernels of sources have one way to and fro",
        ),
        "where a cycle is done again": (MODEL, "`flash` of a test program with stick, whose last cycle is done again"),
        "sources that move as a whole": (MODEL, "`flash` where the strip turns about a point near to the contact"),
    },
    "heat/fitted.py": {"grow without heat": (MODEL, "a reduced basis whose temperatures grow of themselves")},
    "layers/between.py": {
        "A layer of asperities does not follow it": (
            MODEL,
            "`contact.lubrication` whose share changes during the cycle, with a layer that gives way by a law",
        )
    },
    "stick/coulomb.py": {
        "with a pressure_threshold": (
            PHYSICS,
            "an end of partial slip with a threshold, which depends on the way there",
        )
    },
    "stick/final.py": {
        "the logarithm of time": (PHYSICS, "the same of creep without end"),
        "the plastic flow until then": (
            PHYSICS,
            "an end of partial slip beyond `contact.hardness`, which depends on the way there",
        ),
        "every node slips": (PHYSICS, "an end of partial slip where all slips"),
    },
    "life/model.py": {
        "it changes throughout a run": (PHYSICS, "steady quantities with laws of depth or distance"),
        "requires constant properties": (
            MODEL,
            "run-in and critical speeds with properties of T: rates of small disturbances of bodies that stay",
        ),
    },
    "stick/heat.py": {
        "the bodies lose no heat": (PHYSICS, "an end of bodies that lose no heat"),
        "'reduced' with contact.law": (MODEL, 'of parts: stick with `heat.operator = "full"`, as above'),
    },
    "stick/program.py": {"a motion to and fro with": (PHYSICS, "of parts: stick one way, as above")},
    "stick/setup.py": {
        "is solved by factors of its contact nodes": (
            MODEL,
            "stick with a strip that passes under a grid of over 3,000 nodes: both grids "
            "move against each other, which no product by waves has, and factors do not fit",
        )
    },
}

# Messages of another kind: half of what belongs together is missing, a value or file is wrong, nothing converged.
OTHERS: dict[str, tuple[str, ...]] = {
    "bodies/contact_surface.py": ("contacts that lie apart",),
    "bodies/fine.py": ("missing, but required",),
    "bodies/mesh.py": (
        "no facet on the boundary",
        "belongs to a .geo file",
        "belongs to a shape from CAD",
        "belongs to the mesh of another",
    ),
    "case/motions.py": ("only then",),
    "case/laws.py": (
        "with per_area",
        "a coefficient with other exponents",
    ),
    "case/materials.py": ("or per_decade with an onset",),
    "case/quantities.py": ("only then",),
    "case/reading.py": ("with a base", "a list of keys", "with meshes that are given"),
    "case/checks.py": (
        "less than 0.5",
        "missing, but required",
        "at least one load",
        "expected none {}",
        "expected '{}' {}",
        "of a grid that stays, {}",
        "expected no column {} {}",
        "at least one whole cycle",
        "contact.{}: expected {}",
        "load is the sum",
        "a table contact.layer",
        "whose forces are columns",
    ),
    "case/units.py": ("a string with a unit",),
    "bodies/shape.py": ("has used up the elements",),
    "cycle/stability.py": ("beyond all numbers", "did not converge"),
    "flash/temperatures.py": (
        "its temperatures in its history",
        "expected one material where",
        "each instant of the long stroke",
    ),
    "interface/pair.py": ("the punch lies below",),
    "layers/between.py": ("Plastic flow did not converge"),
    "layers/debris.py": ("the conditions of the phases",),
    "life/calibrate.py": ("where the fit begins",),
    "life/commands.py": ("with --scatter",),
    "life/data.py": (
        "expected a profile",
        "with one column",
        "together with a column",
        "belongs to one measured column",
    ),
    "life/least_squares.py": ("with profiles only", "gives no sigma"),
    "life/runs.py": ("belongs to another study",),
    "life/quantities.py": ("with a level", "a level with its unit"),
    "life/scatter.py": ("gives impossible values", "KEY=KIND"),
    "stick/cycle.py": ("did not converge",),
    "stick/final.py": ("did not converge",),
    "stick/heat.py": ("did not converge",),
    "stick/interface.py": ("bodies with meshes",),
    "stick/setup.py": ("expected 'coulomb'", "too coarse"),
}


def messages() -> Iterator[tuple[str, str]]:
    """Yield file and text of what may say that things do not go together; {} stands for what is filled in."""
    root = Path(fenwear.__file__).parent
    for path in sorted(path for room in ROOMS for path in (root / room).glob("*.py")):
        for text in _texts(ast.parse(path.read_text())):
            where = str(path.relative_to(root))
            if ASKS.search(text) and (where in ACROSS or TOGETHER.search(text)):
                yield where, text


def _texts(node: ast.AST) -> Iterator[str]:
    """Yield the strings of a part of the source, but for docstrings and descriptions of keys."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Field":
        return
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return
    if isinstance(node, ast.Constant | ast.JoinedStr):
        text = _text(node)
        if " " in text:
            yield text
        return
    for part in ast.iter_child_nodes(node):
        yield from _texts(part)


def _text(node: ast.AST) -> str:
    """Return a string as it is written."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    return "{}"
