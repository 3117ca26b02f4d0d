"""Two blocks as input decks: 10 x 4 mm (punch, 40 mm²) on 20 x 4 mm (strip, 80 mm²), and changes of their writing."""

from __future__ import annotations

import textwrap
from collections.abc import Callable

STRIP = [(i * 2 - 10, k * 2 - 4) for k in range(3) for i in range(11)]
PUNCH = [(i * 2 - 5, k * 2) for k in range(3) for i in range(6)]
RIGHT = {"punch_body": 40, "punch_contact": 10, "punch_top": 10, "strip_body": 80, "strip_contact": 20,
         "strip_bottom": 20}  # fmt: skip


def quads(across: int, first: int) -> list[list[int]]:
    """Return the nodes of two rows of quadrilaterals."""
    corner = [first + k * (across + 1) + i for k in range(2) for i in range(across)]
    return [[n, n + 1, n + across + 2, n + across + 1] for n in corner]


def rows(values: list[list[int]], first: int) -> str:
    return "\n".join(f"{first + k}, " + ", ".join(map(str, row)) for k, row in enumerate(values))


def nodes(points: list[tuple[int, int]], first: int) -> str:
    return "\n".join(f"{first + k}, {x}, {y}" for k, (x, y) in enumerate(points))


N1, N2 = nodes(STRIP, 1), nodes(PUNCH, 101)
E1, E2 = rows(quads(10, 1), 1), rows(quads(5, 101), 101)
SETS = """*NSET, NSET=PUNCH_CONTACT, GENERATE
101, 106
*NSET, NSET=PUNCH_TOP, GENERATE
113, 118
*NSET, NSET=STRIP_CONTACT
23, 24, 25, 26, 27, 28,
29, 30, 31, 32, 33
*NSET, NSET=STRIP_BOTTOM, GENERATE
1, 11, 1
"""
BASE = f"""*HEADING
two blocks
*NODE
{N1}
{N2}
*ELEMENT, TYPE=CPE4, ELSET=STRIP_BODY
{E1}
*ELEMENT, TYPE=CPE4, ELSET=PUNCH_BODY
{E2}
{SETS}"""


def part(name: str, points: list[tuple[int, int]], across: int, body: str) -> str:
    return f"*Part, name={name}\n*Node\n{nodes(points, 1)}\n*Element, type=CPE4R, elset={body}\n{rows(quads(across, 1), 1)}\n*End Part\n"


def swapped(old: str, new: str) -> Callable[[], str]:
    assert old in BASE, old
    return lambda: BASE.replace(old, new)


def turned() -> str:
    """Return an assembly whose pad is made upside down far away, shifted and turned about its own middle."""
    away = [(30 - x, 50 - y) for x, y in PUNCH]
    return (
        part("Pad", away, 5, "PUNCH_BODY")
        + part("Disc", STRIP, 10, "STRIP_BODY")
        + textwrap.dedent("""\
        *Assembly, name=A
        *Instance, name=Pad-1, part=Pad
        -30., -50., 0.
        0., 0., 0., 0., 0., 1., 180.
        *End Instance
        *Instance, name=Disc-1, part=Disc
        *End Instance
        *Nset, nset=PUNCH_CONTACT, instance=Pad-1, generate
        1, 6
        *Nset, nset=PUNCH_TOP
        Pad-1.13, Pad-1.14, Pad-1.15, Pad-1.16, Pad-1.17, Pad-1.18
        *Elset, elset=_S, instance=Disc-1, internal, generate
        11, 20
        *Surface, name=STRIP_CONTACT
        _S, S3
        *Nset, nset=STRIP_BOTTOM, instance=Disc-1, generate
        1, 11
        *End Assembly
        """)
    )


# Ways of writing that must give the numbers above.
SAME: dict[str, Callable[[], str]] = {
    "parts, shift and rotation": turned,
    "comments within blocks": lambda: BASE.replace("\n12, -10", "\n** row\n12, -10").replace("\n11, 12,", "\n**\n11, 12,"),
    "a set adds up, in any case": swapped("*NSET, NSET=PUNCH_CONTACT, GENERATE\n101, 106",
                                          "*NSET, NSET=PUNCH_CONTACT\n101, 102\n*nset, nset=punch_contact\n103,104,105,106"),
    "Latin-1, quotes and spaces": lambda: BASE.replace("ELSET=PUNCH_BODY", 'ELSET="Punch  Body"').replace("two", "zwei Kl\u00f6tze"),
    "continued lines": lambda: BASE.replace("101, 101, 102, 108, 107", "101, 101, 102,\n108, 107"),
    "keyword on two lines": swapped("*NSET, NSET=PUNCH_TOP, GENERATE", "*NSET, NSET=PUNCH_TOP,\nGENERATE"),
    "Fortran exponents": lambda: BASE.replace("101, -5, 0", "101, -0.5D+01, 0.0d0").replace("106, 5, 0", "106, 5.0+0, 0."),
    "empty coordinates, trailing commas": lambda: BASE.replace("6, 0, -4", "6, , -4,"),
    "surface of element faces": swapped("*NSET, NSET=PUNCH_CONTACT, GENERATE\n101, 106",
                                        "*ELSET, ELSET=P, GENERATE\n101, 105\n*SURFACE, NAME=PUNCH_CONTACT\nP, S1"),
    "surface of free faces and of nodes": swapped(
        "*NSET, NSET=PUNCH_CONTACT, GENERATE\n101, 106",
        "*NSET, NSET=LOW, GENERATE\n101, 106\n*SURFACE, TYPE=NODE, NAME=PUNCH_CONTACT\nLOW, 1.0"),
    "sets of sets, before what they name": lambda: BASE.replace("ELSET=PUNCH_BODY", "ELSET=LINING").replace(
        "*NODE\n", "*ELSET, ELSET=PUNCH_BODY\nLINING\n*NODE\n", 1),
    "thermal, reduced and rigid elements, masses": lambda: BASE.replace("CPE4, ELSET=S", "CPS4RT, ELSET=S").replace(
        "*NSET", "*NODE\n999, 0, 10\n*ELEMENT, TYPE=MASS, ELSET=M\n900, 999\n*MASS, ELSET=M\n1e-3\n"
        "*ELEMENT, TYPE=R2D2, ELSET=R\n901, 1, 2\n*NSET", 1),
    "a step with output": lambda: BASE + "*STEP\n*STATIC\n*NODE FILE\nU\n*END STEP\n",
    "a local coordinate system": lambda: BASE.replace(N2, "*SYSTEM\n0, 5, 0, 0, 6, 0\n*NODE\n" + nodes(
        [(y - 5, -x) for x, y in PUNCH], 101) + "\n*SYSTEM"),
    "cylindrical coordinates": lambda: BASE.replace(
        N2, "*NODE, SYSTEM=C\n" + "\n".join(
            f"{101 + k}, {(x * x + y * y) ** 0.5!r}, {__import__('math').degrees(__import__('math').atan2(y, x))!r}"
            for k, (x, y) in enumerate(PUNCH))),
    "NGEN, NFILL and ELGEN": lambda: BASE.replace(N2, "101, -5, 0\n106, 5, 0\n113, -5, 4\n118, 5, 4\n*NGEN, NSET=LO\n"
        "101, 106, 1\n*NGEN, NSET=HI\n113, 118\n*NFILL\nLO, HI, 2, 6").replace(
        f"*ELEMENT, TYPE=CPE4, ELSET=PUNCH_BODY\n{E2}",
        "*ELEMENT, TYPE=CPE4\n101, 101, 102, 108, 107\n*ELGEN, ELSET=PUNCH_BODY\n101, 5, 1, 1, 2, 6, 5"),
    "clockwise elements": lambda: BASE.replace(E2, rows([row[::-1] for row in quads(5, 101)], 101)),
    "in the plane of x and z": lambda: BASE.replace(N1, nodes(STRIP, 1).replace(", -4\n", ", 0, -4\n").replace(
        ", -2\n", ", 0, -2\n").replace("33, 10, 0", "33, 10, 0, 0")).replace(
        N2, "\n".join(f"{101 + k}, {x}, 0, {y}" for k, (x, y) in enumerate(PUNCH))),
    "names of CAE: a node and an element set": lambda: BASE + "*ELSET, ELSET=PUNCH_CONTACT, GENERATE\n101, 105\n"
        "*NSET, NSET=PUNCH_BODY, GENERATE\n101, 118\n",
    "a ragged range": lambda: BASE.replace("*NSET, NSET=STRIP_BOTTOM, GENERATE\n1, 11, 1",
                                           "*NSET, NSET=STRIP_BOTTOM, GENERATE\n-1, 11, 2\n0, 10, 2"),
}  # fmt: skip

# What is wrong: a change, and what the error names.
WRONG: dict[str, tuple[Callable[[], str], str]] = {
    "an unknown keyword": (swapped("*NSET, NSET=PUNCH_TOP", "*IMPERFECTION\n*NSET, NSET=PUNCH_TOP"), r"line 89.*IMPERFECTION"),
    "an unknown option": (swapped("*NSET, NSET=PUNCH_TOP", "*NSET, PART=Q, NSET=PUNCH_TOP"), r"line 89.*PART"),
    "a type without a shape": (swapped("TYPE=CPE4, ELSET=P", "TYPE=U1, ELSET=P"), r"line 76.*U1"),
    "a node that is missing": (swapped("101, 101, 102, 108, 107", "101, 101, 102, 108, 777"), r"line 77.*777"),
    "too few nodes": (swapped("101, 101, 102, 108, 107", "101, 101, 102, 108"), r"line 77.*4 nodes"),
    "a set of nothing": (swapped("\n113, 118", "\n"), r"empty"),
    "a label that is missing": (swapped("29, 30, 31", "29, 30, 3100"), r"line 93.*3100"),
    "a circle of sets": (swapped("*NSET, NSET=PUNCH_TOP", "*NSET, NSET=A\nB\n*NSET, NSET=B\nA\n*NSET, NSET=PUNCH_TOP"), r"circle"),
    "a set of no set": (swapped("23, 24, 25", "NOWHERE, 24, 25"), r"line 92.*NOWHERE"),
    "a node in two places": (swapped("102, -3, 0", "102, -3, 0\n101, 7, 7"), r"101.*lines 37 and 39"),
    "a bow tie": (swapped("101, 101, 102, 108, 107", "101, 101, 108, 102, 107"), r"element 101 \(line 77\)"),
    "no include": (lambda: "*INCLUDE, INPUT=none.inc\n" + BASE, r"line 1.*none.inc"),
    "two kinds of elements": (lambda: BASE + "*ELEMENT, TYPE=CPE3, ELSET=PUNCH_MORE\n500, 115, 116, 101\n", r"500 \(line 97\)"),
    "an element in two regions": (lambda: BASE + "*ELSET, ELSET=PUNCH_ALL, GENERATE\n101, 110\n", r"share 10 surface"),
    "a contact of elements": (lambda: BASE.replace("NSET=PUNCH_CONTACT", "NSET=LOW") + "*ELSET, ELSET=PUNCH_CONTACT\n101, 102\n",
                              r"punch_contact.*line 96"),
    "metres": (lambda: BASE.replace(N1, "*NODE\n" + "\n".join(f"{1 + k}, {x}e-3, {y}e-3" for k, (x, y) in enumerate(STRIP)))
               .replace(N2, "\n".join(f"{101 + k}, {x}e-3, {y}e-3" for k, (x, y) in enumerate(PUNCH))), r"geometry.unit = 'm'"),
    "no mesh": (lambda: "hello\n", r"line 1.*keyword"),
    "nothing": (lambda: "", r"no nodes"),
    "a face that is missing": (lambda: BASE + "*SURFACE, NAME=X\nPUNCH_BODY, S5\n", r"line 97.*S5"),
    "a turn without an axis": (lambda: turned().replace("0., 0., 1., 180.", "0., 0., 0., 180."), r"axis"),
}  # fmt: skip
