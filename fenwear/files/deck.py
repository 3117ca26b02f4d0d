"""Input decks of Abaqus and CalculiX: a strict reader of their nodes, elements, sets, surfaces, parts and instances.

A table says what each keyword does. Keywords that carry no mesh (materials, steps, output) are counted and passed over;
an unknown one, or an option that would change the mesh in a way that the reader does not know, ends the reading with
the keyword and its line. Sets may name what comes later; they add up; names do not depend on case.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError
from fenwear.common.table_files import TableError, decoded
from fenwear.files.mesh_file import KINDS, ORDERS, Block, Ints, MeshFile, MeshSet, in_space, listed, wrong

DEEPEST = 20  # includes within each other, and sets of sets
# Keywords that say nothing of nodes, elements and sets; those of a step are passed over with it.
_NOT_OF_THE_MESH = """
AMPLITUDE, BASE MOTION, BEAM GENERAL SECTION, BEAM SECTION, BIAXIAL TEST DATA, BOUNDARY, BULK VISCOSITY, CAP
HARDENING, CAP PLASTICITY, CFLUX, CHANGE FRICTION, CHANGE SURFACE BEHAVIOR, CLEARANCE, CLOAD, COHESIVE SECTION,
CONDUCTIVITY, CONNECTOR BEHAVIOR, CONNECTOR SECTION, CONSTRAINT CONTROLS, CONTACT, CONTACT CLEARANCE, CONTACT
CONTROLS, CONTACT DAMPING, CONTACT EXCLUSIONS, CONTACT FILE, CONTACT FORMULATION, CONTACT INCLUSIONS, CONTACT
INITIALIZATION ASSIGNMENT, CONTACT INITIALIZATION DATA, CONTACT INTERFERENCE, CONTACT OUTPUT, CONTACT PAIR, CONTACT
PRINT, CONTACT PROPERTY ASSIGNMENT, CONTROLS, COUPLING, CREEP, CYCLIC, CYCLIC HARDENING, CYCLIC SYMMETRY MODEL, DAMAGE
EVOLUTION, DAMAGE INITIATION, DAMPING, DASHPOT, DEFORMATION PLASTICITY, DENSITY, DEPVAR, DESIGN VARIABLES,
DISTRIBUTING, DISTRIBUTING COUPLING, DISTRIBUTION, DISTRIBUTION TABLE, DLOAD, DRUCKER PRAGER, DRUCKER PRAGER
HARDENING, DSLOAD, EL FILE, EL PRINT, ELASTIC, ELECTRICAL CONDUCTIVITY, ELEMENT OUTPUT, EMBEDDED ELEMENT, END LOAD
CASE, ENERGY FILE, ENERGY OUTPUT, ENERGY PRINT, EQUATION, EXPANSION, FASTENER, FILE FORMAT, FILM, FILTER, FLUID
CONSTANTS, FRICTION, GAP, GAP CONDUCTANCE, GAP HEAT GENERATION, GAP RADIATION, GASKET BEHAVIOR, GASKET CONTACT AREA,
GASKET ELASTICITY, GASKET SECTION, GASKET THICKNESS BEHAVIOR, HEADING, HEAT GENERATION, HISTORY OUTPUT, HOURGLASS
STIFFNESS, HYPERELASTIC, HYPERFOAM, INCIDENT WAVE, INELASTIC HEAT FRACTION, INERTIA RELIEF, INITIAL CONDITIONS,
INITIAL STRAIN INCREASE, INTEGRATED OUTPUT SECTION, JOULE HEAT FRACTION, KINEMATIC, KINEMATIC COUPLING, LATENT HEAT,
MASS, MASS FLOW, MATERIAL, MEMBRANE SECTION, MODEL CHANGE, MONITOR, MPC, MULLINS EFFECT, NO COMPRESSION, NO TENSION,
NODE FILE, NODE OUTPUT, NODE PRINT, NONSTRUCTURAL MASS, NORMAL, OBJECTIVE, ORIENTATION, OUTPUT, PERMEABILITY, PHYSICAL
CONSTANTS, PLANAR TEST DATA, PLASTIC, POROSITY, POTENTIAL, PRE-TENSION SECTION, PREPRINT, PRESSURE STRESS, RADIATE,
RATE DEPENDENT, RELEASE, RESTART, RIGID BODY, RIGID SURFACE, ROTARY INERTIA, SECTION CONTROLS, SECTION FILE, SECTION
PRINT, SELECT CYCLIC SYMMETRY MODES, SENSITIVITY, SFILM, SHEAR TEST DATA, SHELL GENERAL SECTION, SHELL SECTION, SHELL
TO SOLID COUPLING, SIMPLE SHEAR TEST DATA, SOLID SECTION, SPECIFIC GAS CONSTANT, SPECIFIC HEAT, SPRING, SURFACE
BEHAVIOR, SURFACE FLAW, SURFACE INTERACTION, SURFACE PROPERTY ASSIGNMENT, SURFACE SECTION, TEMPERATURE, TIE, TIME
POINTS, TIMEPOINTS, TRANSFORM, UNIAXIAL TEST DATA, USER MATERIAL, VALUES AT INFINITY, VIEWFACTOR, VISCOELASTIC,
VISCOUS, VOLUMETRIC TEST DATA
"""
PASSED = frozenset(" ".join(word.split()) for word in _NOT_OF_THE_MESH.split(","))
CONTINUUM = re.compile(r"(?:CP[ES]|CPEG|CG?AX|CAXA|C3D|CG?PE|DC2D|DC3D|DCC2D|DCAX|F2D|F3D|AC2D|AC3D|ACAX)(\d+)\w*")
SHELLS = re.compile(r"(?:S|STRI|DS|M3D|SFM3D|R3D|SC)(\d+)[A-Z]*\d?\w*")
LINES = re.compile(r"(?:T2D|T3D|B2|B3|R2D|RAX|SAX|MAX|RB2D|RB3D|DC1D|PIPE2|PIPE3)(\d)\w*")
SHAPELESS = re.compile(r"(?:MASS|ROTARYI|SPRING|DASHPOT|CONN|GAP|DGAP|ITT|ITS|HEATCAP|DCOUP|DRAG|JOINTC|CAPACITY)\w*|D")
FLAT_KINDS = {3: 2, 4: 3, 6: 9, 8: 16, 9: 10}
GLOBAL: tuple[Array, Array] = (np.eye(3), np.zeros(3))  # a turn, and a point: that of no turn
SOLID_KINDS = {4: 4, 5: 7, 6: 6, 8: 5, 10: 11, 15: -15, 20: 17, 27: 12}


@dataclass
class _Entry:
    """One row of a set's data, or what its keyword names."""

    line: int
    names: tuple[str, ...] = ()
    labels: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    scope: str = ""
    ranges: bool = False
    sides: str = ""


@dataclass
class _Set:
    name: str
    line: int
    entries: list[_Entry] = field(default_factory=list)


@dataclass
class _Elements:
    kind: int
    nodes: Ints
    labels: Ints
    lines: Ints


@dataclass
class _Scope:
    """A part, or what stands outside of parts."""

    name: str = ""
    labels: list[Ints] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)
    lines: list[Ints] = field(default_factory=list)
    elements: list[_Elements] = field(default_factory=list)
    nsets: dict[str, _Set] = field(default_factory=dict)
    elsets: dict[str, _Set] = field(default_factory=dict)
    surfaces: dict[str, _Set] = field(default_factory=dict)


@dataclass
class _Instance:
    name: str
    part: str
    line: int
    scope: _Scope
    shift: Array
    turn: tuple[Array, Array]  # matrix, point


def read_deck(path: Path) -> MeshFile:
    """Return the mesh of an input deck.

    Raises:
        CaseError: it cannot be read; names the file, the line, what was expected, and what to do.
    """
    return _Deck(path).read()


def deck_text(path: Path) -> str:
    """Return a text file in UTF-8, UTF-16 or Latin-1, with or without a byte order mark.

    Raises:
        CaseError: it cannot be read, or is no text.
    """
    try:
        return decoded(path)[0]
    except TableError as error:
        raise CaseError(InputError(path.name, str(error))) from None


def _key(name: str) -> str:
    """Return a name of the deck as it is compared."""
    return re.sub(r"\s+", " ", name.strip().strip('"').strip()).casefold()


def _split(text: str) -> list[str]:
    """Return the fields of a line; commas within quotes belong to the name."""
    if '"' not in text:
        return [part.strip() for part in text.split(",")]
    return [part.strip() for part in re.split(r',(?=(?:[^"]*"[^"]*")*[^"]*$)', text)]


def _float(text: str) -> float:
    """Return a number, with Fortran's exponents (1.0D+00, 1.0+3) and 0 for an empty field."""
    if not text:
        return 0.0
    clean = text.upper().replace("D", "E")
    return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", clean) if "E" not in clean else clean)


class _Deck:
    def __init__(self, path: Path) -> None:
        self.path, self.file = path, path.name
        self.model = _Scope()
        self.parts: dict[str, _Scope] = {}
        self.instances: dict[str, _Instance] = {}
        self.scope = self.model
        self.system = GLOBAL
        self.passed: Counter[str] = Counter()
        self.shapeless: Counter[str] = Counter()
        self.in_step = 0
        self.depth = 0
        self.grammar: Mapping[str, Callable[[int, dict[str, str], list[tuple[int, str]]], None]] = {
            "NODE": self.node, "ELEMENT": self.element, "NSET": self.nset, "ELSET": self.elset, "NGEN": self.ngen,
            "NFILL": self.nfill, "ELGEN": self.elgen, "SURFACE": self.surface, "PART": self.part,
            "END PART": self.end, "ASSEMBLY": self.end, "END ASSEMBLY": self.end, "INSTANCE": self.instance,
            "END INSTANCE": self.end, "SYSTEM": self.set_system, "INCLUDE": self.include,
        }  # fmt: skip

    def fail(self, line: int, message: str) -> CaseError:
        return wrong(self.file, line, message)

    def read(self) -> MeshFile:
        self.lines_of(self.path, 0)
        if not self.model.labels and not any(part.labels for part in self.parts.values()):
            raise self.fail(0, "has no nodes: expected a *NODE block. Give the deck with the mesh, or write it again.")
        return _assembled(self)

    # ------------------------------------------------------------------------------------------------ lines

    def lines_of(self, path: Path, line: int) -> None:
        """Read the blocks of a file: a keyword with its options, and the lines of data below it."""
        if self.depth > DEEPEST:
            raise self.fail(line, "*INCLUDE: files include each other. Remove the circle.")
        self.depth += 1
        outer, self.file = self.file, path.name
        text = deck_text(path).replace("\t", " ")
        keyword: str | None = None
        head, began = "", 0
        data: list[tuple[int, str]] = []
        for number, raw in enumerate(text.splitlines(), 1):
            stripped = raw.strip()
            if not stripped or stripped.startswith("**"):
                continue
            if stripped[0] == "*":
                if keyword is not None:
                    self.block(began, head, data)
                keyword, head, data, began = stripped, stripped, [], number
            elif keyword is None:
                message = f"expected a keyword such as *NODE, got {stripped[:30]!r}: no deck of Abaqus or CalculiX"
                raise self.fail(number, message)
            elif head.endswith(",") and not data:
                head += stripped
            else:
                data.append((number, stripped))
        if keyword is not None:
            self.block(began, head, data)
        self.file = outer
        self.depth -= 1

    def block(self, line: int, head: str, data: list[tuple[int, str]]) -> None:
        """Do what the table says of a keyword."""
        first, *options = _split(head[1:])
        name = re.sub(r"\s+", " ", first).upper()
        if name == "STEP":
            self.in_step += 1
        if self.in_step:
            self.passed["STEP"] += name == "STEP"
            self.in_step -= name == "END STEP"
            if name in ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"):
                raise self.fail(line, f"*{name} within a step is not supported. Move it before *STEP.")
            return
        given = {}
        for option in options:
            key, _, value = option.partition("=")
            given[key.strip().upper()] = value.strip()
        if name in self.grammar:
            self.grammar[name](line, given, data)
        elif name in PASSED or name.startswith(("OUTPUT", "CONTACT")):
            self.passed[name] += 1
        else:
            message = f"the keyword *{name} is not supported. Remove it, or write the mesh without it as .inp or .med."
            raise self.fail(line, message)

    def only(self, line: int, name: str, given: Mapping[str, str], known: Sequence[str]) -> None:
        """Raise where a keyword has an option that is not known."""
        unknown = [key for key in given if key and key not in known]
        if unknown:
            raise self.fail(line, f"*{name}: the option {unknown[0]} is not supported. Known are {', '.join(known)}.")

    def integer(self, line: int, text: str) -> int:
        """Return a whole number."""
        try:
            value = _float(text)
            if not text or value != int(value) or abs(value) > 2**62:
                raise ValueError
        except (ValueError, OverflowError):
            raise self.fail(line, f"expected a whole number, got {text!r}") from None
        return int(value)

    def number(self, line: int, text: str) -> float:
        """Return a finite number."""
        try:
            value = _float(text)
        except ValueError:
            raise self.fail(line, f"expected a number, got {text!r}") from None
        if not np.isfinite(value):
            raise self.fail(line, f"expected a finite number, got {text!r}")
        return value

    # ------------------------------------------------------------------------------------------------ nodes

    def node(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "NODE", given, ("NSET", "SYSTEM", "INPUT"))
        data = self.input(line, given, data)
        table = self.table(data)
        if table is None or not 2 <= table.shape[1] <= 7:
            rows = [_split(text) for _, text in data]
            table = np.zeros((len(rows), 4))
            for k, ((number, _), row) in enumerate(zip(data, rows, strict=True)):
                table[k, 0] = self.integer(number, row[0])
                table[k, 1 : 1 + len(row[1:4])] = [self.number(number, cell) for cell in row[1:4]]
        bad = np.flatnonzero((table[:, 0] != np.round(table[:, 0])) | ~np.isfinite(table).all(axis=1)
                             | (np.abs(table[:, 0]) > 2**62))  # fmt: skip
        if len(bad):
            raise self.fail(data[bad[0]][0], f"expected a node number and finite coordinates, got {data[bad[0]][1]!r}")
        points = in_space(table[:, 1:4])
        system = given.get("SYSTEM", "R").upper() or "R"
        if system not in ("R", "C", "S"):
            raise self.fail(line, f"*NODE: SYSTEM={system} is not known. Expected R, C or S.")
        self.add_nodes(
            table[:, 0].astype(np.int64), self.placed(_cartesian(points, system)), np.array([n for n, _ in data], int),
            given, line,
        )  # fmt: skip

    def placed(self, points: Array) -> Array:
        """Return points of the local system in the global one."""
        return points @ self.system[0].T + self.system[1]

    def add_nodes(self, labels: Ints, points: Array, lines: Ints, given: Mapping[str, str], line: int) -> None:
        if not len(labels):
            return
        self.scope.labels.append(labels)
        self.scope.points.append(points)
        self.scope.lines.append(lines)
        self.enter(self.scope.nsets, given.get("NSET"), line, _Entry(line, labels=labels))

    def enter(self, sets: dict[str, _Set], name: str | None, line: int, entry: _Entry) -> None:
        """Add to the set of a name, if the keyword in this line gives one."""
        if name:
            self.set_of(sets, name, line).entries.append(entry)

    def input(self, line: int, given: Mapping[str, str], data: list[tuple[int, str]]) -> list[tuple[int, str]]:
        """Return the data of the file that a keyword names by INPUT, or its own."""
        if not given.get("INPUT"):
            return data
        text = deck_text(self.beside(line, given["INPUT"])).replace("\t", " ")
        rows = ((n, row.strip()) for n, row in enumerate(text.splitlines(), 1))
        return [(n, row) for n, row in rows if row and not row.startswith("*")] + data

    @staticmethod
    def table(data: list[tuple[int, str]]) -> Array | None:
        """Return rows of as many numbers each; None where they are written in another way."""
        try:
            return np.loadtxt([text for _, text in data], delimiter=",", ndmin=2) if data else np.zeros((0, 4))
        except ValueError:
            return None

    def point(self, line: int, label: int) -> Array:
        """Return the node of a label, as it is given last."""
        for labels, points in zip(reversed(self.scope.labels), reversed(self.scope.points), strict=True):
            same = np.flatnonzero(labels == label)
            if len(same):
                return points[same[-1]]
        raise self.fail(line, f"node {label} is not defined before this line")

    def ngen(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "NGEN", given, ("NSET", "LINE", "SYSTEM"))
        if given.get("LINE", "").upper() not in ("", "S") or given.get("SYSTEM", "RC").upper() != "RC":
            raise self.fail(line, "*NGEN along a curve or in another system is not supported. Write the nodes out.")
        for number, text in data:
            row = _split(text)
            first, last = self.integer(number, row[0]), self.integer(number, row[1] if len(row) > 1 else "")
            step = self.integer(number, row[2]) if len(row) > 2 and row[2] else 1
            labels = self.range(number, first, last, step)
            ends = self.point(number, first), self.point(number, last)
            share = np.linspace(0, 1, len(labels))[:, None]
            points = ends[0] * (1 - share) + ends[1] * share
            inner = slice(1, -1)
            self.add_nodes(labels[inner], points[inner], np.full(len(labels), number)[inner], {}, line)
            self.enter(self.scope.nsets, given.get("NSET"), line, _Entry(number, labels=labels))

    def range(self, line: int, first: int, last: int, step: int) -> Ints:
        """Return the numbers from the first to the last."""
        if step == 0 or (last - first) % step or (last - first) // step < 0 or (last - first) // step > 10**8:
            raise self.fail(
                line, f"expected numbers from {first} to {last} in steps that reach it, got a step of {step}"
            )
        return np.arange(first, last + (1 if step > 0 else -1), step, dtype=np.int64)

    def nfill(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "NFILL", given, ("NSET", "BIAS"))
        if self.number(line, given.get("BIAS", "1")) != 1:
            raise self.fail(line, "*NFILL with BIAS is not supported. Write the nodes out.")
        for number, text in data:
            row = _split(text)
            if len(row) < 4:
                raise self.fail(number, f"*NFILL: expected two sets, rows and an increment, got {text!r}")
            low, high = (self.nodes_now(number, name) for name in row[:2])
            rows, step = self.integer(number, row[2]), self.integer(number, row[3])
            if len(low) != len(high) or not 1 <= rows <= 10**6:
                raise self.fail(number, f"*NFILL: expected two sets of as many nodes, got {len(low)} and {len(high)}")
            ends = [np.array([self.point(number, label) for label in labels]) for labels in (low, high)]
            every = [low, high]
            for k in range(1, rows):
                labels, share = low + k * step, k / rows
                points = ends[0] * (1 - share) + ends[1] * share
                self.add_nodes(labels, points, np.full(len(labels), number), {}, line)
                every.append(labels)
            self.enter(self.scope.nsets, given.get("NSET"), line, _Entry(number, labels=np.concatenate(every)))

    def nodes_now(self, line: int, name: str) -> Ints:
        """Return the numbers of a node set that is complete, in their order."""
        node_set = self.scope.nsets.get(_key(name))
        if node_set is None:
            raise self.fail(line, f"the node set {name!r} is not defined before this line; known are "
                            f"{listed(s.name for s in self.scope.nsets.values())}")  # fmt: skip
        if not node_set.entries or any(entry.names for entry in node_set.entries):
            raise self.fail(line, f"the node set {name!r} is one of sets, which is not supported here")
        return np.concatenate([entry.labels for entry in node_set.entries])

    def set_system(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        """Take the local coordinate system of the nodes that follow."""
        self.only(line, "SYSTEM", given, ())
        values = [self.number(n, cell) for n, text in data for cell in _split(text) if cell]
        if len(values) in (0, 3):
            self.system = (np.eye(3), np.array(values)) if values else GLOBAL
            return
        values += [0.0] * (9 - len(values)) if len(values) > 6 else []
        a, b = np.array(values[:3]), np.array(values[3:6])
        x = b - a
        if len(values) != 9:  # a turn about z
            x = x * [1.0, 1.0, 0.0] if len(b) == 3 else x
            y = np.array([-x[1], x[0], 0.0])
        else:
            c = np.array(values[6:9])
            y = (c - a) - ((c - a) @ x) / max(x @ x, 1e-300) * x
        if len(values) not in (6, 9) or not np.linalg.norm(x) or not np.linalg.norm(y):
            raise self.fail(line, "*SYSTEM: expected an origin, a point on the axis x, and one in the plane of x and y")
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        self.system = np.column_stack([x, y, np.cross(x, y)]), a

    # --------------------------------------------------------------------------------------------- elements

    def element(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "ELEMENT", given, ("TYPE", "ELSET", "INPUT", "FILE"))
        data = self.input(line, given, data)
        name = given.get("TYPE", "").upper()
        kind = self.kind_of(line, name)
        if kind == 0:
            self.shapeless[name] += len(data)
            labels = np.array([self.integer(number, _split(text)[0]) for number, text in data], dtype=np.int64)
            lines = np.array([n for n, _ in data], int)
            block = _Elements(0, np.zeros((len(labels), 0), np.int64), labels, lines)
        else:
            count = 15 if kind == -15 else KINDS[kind].nodes
            rows, lines = self.rows(line, data, count, name)
            nodes = rows[:, 1:]
            if kind in ORDERS:
                nodes = nodes[:, ORDERS[kind]]
            if kind == -15:
                kind, nodes = 6, nodes[:, :6]
            block = _Elements(kind, nodes, rows[:, 0], lines)
        self.scope.elements.append(block)
        self.enter(self.scope.elsets, given.get("ELSET"), line, _Entry(line, labels=block.labels))

    def kind_of(self, line: int, name: str) -> int:
        """Return gmsh's number of a type of element; 0 of one without a shape."""
        if match := CONTINUUM.fullmatch(name):
            count = int(match[1])
            count = 20 if name.startswith("C3D20") else count
            kinds = SOLID_KINDS if "3D" in name else FLAT_KINDS
            if count in kinds:
                return kinds[count]
        if match := SHELLS.fullmatch(name):
            count = 3 if name.startswith("STRI3") else 6 if name.startswith("STRI65") else int(match[1][0])
            count = {1: 8}.get(count, count) if not name.startswith("SC") else 0
            if count in FLAT_KINDS:
                return FLAT_KINDS[count]
        if match := LINES.fullmatch(name):
            return 8 if int(match[1]) == 3 or name[:4] in ("B22", "B32") else 1
        if SHAPELESS.fullmatch(name):
            return 0
        raise self.fail(line, f"*ELEMENT, TYPE={name or '(none)'} is not supported. Known are solids, plane and "
                        "axisymmetric elements, shells, trusses and beams by their shape.")  # fmt: skip

    def rows(self, line: int, data: list[tuple[int, str]], count: int, name: str) -> tuple[Ints, Ints]:
        """Return number and nodes of each element (n, 1 + count), and its lines; rows continue after a comma."""
        wide = 1 + count
        try:
            if data and count < 16:
                with warnings.catch_warnings():
                    warnings.simplefilter("error", DeprecationWarning)  # 1.5 as a whole number
                    table = np.loadtxt([text for _, text in data], delimiter=",", dtype=np.int64, ndmin=2)
                if table.shape[1] == wide:
                    return table, np.array([number for number, _ in data], dtype=np.int64)
        except (ValueError, DeprecationWarning):
            pass
        values: list[int] = []
        lines: list[int] = []
        open_row: list[int] = []
        for number, text in data:
            cells = text.split(",")
            goes_on = not cells[-1].strip()
            if not open_row:
                lines.append(number)
            try:
                open_row += [int(cell) for cell in (cells[:-1] if goes_on else cells)]
            except ValueError:
                open_row += [self.integer(number, cell.strip()) for cell in (cells[:-1] if goes_on else cells)]
            if len(open_row) > wide or (len(open_row) < wide and not goes_on):
                raise self.fail(number, f"expected {count} nodes of a {name}, got {len(open_row) - 1}")
            if len(open_row) == wide:
                values += open_row
                open_row = []
        if open_row:
            raise self.fail(lines[-1], f"expected {count} nodes of a {name}, got {len(open_row) - 1}")
        if any(abs(value) > 2**62 for value in values):
            raise self.fail(line, "has numbers of nodes beyond what the reader holds")
        return np.array(values, dtype=np.int64).reshape(-1, wide), np.array(lines, dtype=np.int64)

    def elgen(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "ELGEN", given, ("ELSET", "ALL NODES"))
        for number, text in data:
            values = [self.integer(number, cell) if cell else 1 for cell in _split(text)]
            master = self.one_element(number, values[0])
            rest = values[1:] + [1] * (-len(values[1:]) % 3)
            labels, shifts = np.array([values[0]], np.int64), np.zeros(1, np.int64)
            for count, of_nodes, of_elements in (rest[k : k + 3] for k in range(0, min(len(rest), 9), 3)):
                if not 1 <= count <= 10**7 or count * len(labels) > 10**8:
                    raise self.fail(number, f"*ELGEN: expected a number of elements, got {count}")
                steps = np.arange(count)
                labels = (labels[None, :] + of_elements * steps[:, None]).ravel()
                shifts = (shifts[None, :] + of_nodes * steps[:, None]).ravel()
            block, row = master
            nodes = block.nodes[row] + shifts[1:, None]
            made = _Elements(block.kind, nodes, labels[1:], np.full(len(labels) - 1, number))
            self.scope.elements.append(made)
            self.enter(self.scope.elsets, given.get("ELSET"), line, _Entry(number, labels=labels))

    def one_element(self, line: int, label: int) -> tuple[_Elements, int]:
        for block in self.scope.elements:
            matches = np.flatnonzero(block.labels == label)
            if len(matches) and block.kind:
                return block, int(matches[0])
        raise self.fail(line, f"element {label} is not defined before this line")

    # ------------------------------------------------------------------------------------------------- sets

    def set_of(self, sets: dict[str, _Set], name: str, line: int) -> _Set:
        """Return a set by its name, new or begun before."""
        clean = re.sub(r"\s+", " ", name.strip().strip('"').strip())
        return sets.setdefault(_key(name), _Set(clean, line))

    def nset(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "NSET", given, ("NSET", "GENERATE", "ELSET", "INSTANCE", "INTERNAL", "UNSORTED", "INPUT"))
        self.any_set(line, "NSET", self.scope.nsets, given, data)
        if given.get("ELSET"):
            entry = _Entry(line, names=(given["ELSET"],), scope=given.get("INSTANCE", ""), sides="nodes")
            self.enter(self.scope.nsets, given["NSET"], line, entry)

    def elset(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "ELSET", given, ("ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED", "INPUT"))
        self.any_set(line, "ELSET", self.scope.elsets, given, data)

    def any_set(
        self, line: int, word: str, sets: dict[str, _Set], given: Mapping[str, str], data: list[tuple[int, str]]
    ) -> None:
        if not given.get(word):
            raise self.fail(line, f"*{word} has no name: expected *{word}, {word}=NAME")
        target = self.set_of(sets, given[word], line)
        instance = given.get("INSTANCE", "")
        for number, text in self.input(line, given, data):
            cells = [cell for cell in _split(text) if cell]
            if "GENERATE" in given:
                if len(cells) < 2:
                    raise self.fail(number, f"GENERATE: expected first, last and step, got {text!r}")
                first, last = (self.integer(number, cell) for cell in cells[:2])
                step = self.integer(number, cells[2]) if len(cells) > 2 else 1
                labels = self.range(number, first, last, step)
                target.entries.append(_Entry(number, labels=labels, scope=instance, ranges=True))
                continue
            numbers = [int(cell) for cell in cells if cell.isdecimal()]
            if any(label > 2**62 for label in numbers):
                raise self.fail(number, f"expected numbers or names of sets, got {text[:40]!r}")
            names = tuple(cell for cell in cells if not cell.isdecimal())
            target.entries.append(_Entry(number, names, np.array(numbers, dtype=np.int64), instance))

    def surface(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "SURFACE", given, ("NAME", "TYPE", "INTERNAL", "TRIM", "REGION TYPE", "NO OFFSET", "NO THICK"))
        if not given.get("NAME"):
            raise self.fail(line, "*SURFACE has no name: expected *SURFACE, NAME=NAME")
        kind = given.get("TYPE", "ELEMENT").upper()
        if kind not in ("ELEMENT", "NODE"):
            message = f"*SURFACE, TYPE={kind} is not supported. Give the surface by faces of elements, or by nodes."
            raise self.fail(line, message)
        of_nodes = kind == "NODE"
        target = self.set_of(self.scope.nsets if of_nodes else self.scope.surfaces, given["NAME"], line)
        for number, text in data:
            cells = _split(text)
            side = "" if of_nodes else "".join(cells[1:2]).upper() or "free"
            if side and not re.fullmatch(r"S[1-6]|SPOS|SNEG|E[1-4]|free", side):
                raise self.fail(number, f"the face {side} is not supported. Expected S1 to S6, SPOS or SNEG.")
            digit = cells[0].isdecimal()
            labels = np.array([int(cells[0])] if digit else [], dtype=np.int64)
            target.entries.append(_Entry(number, () if digit else (cells[0],), labels, sides=side))

    # ------------------------------------------------------------------------------------- parts, instances

    def part(self, line: int, given: dict[str, str], _data: list[tuple[int, str]]) -> None:
        name = given.get("NAME", "")
        if not name or _key(name) in self.parts:
            raise self.fail(line, f"*PART: expected a name that no other part has, got {name!r}")
        self.scope = self.parts[_key(name)] = _Scope(name.strip('"'))
        self.system = GLOBAL

    def end(self, _line: int, _given: dict[str, str], _data: list[tuple[int, str]]) -> None:
        """Go on outside of parts and instances."""
        self.scope, self.system = self.model, GLOBAL

    def instance(self, line: int, given: dict[str, str], data: list[tuple[int, str]]) -> None:
        self.only(line, "INSTANCE", given, ("NAME", "PART"))
        name, part = given.get("NAME", ""), given.get("PART", "")
        if not name or _key(name) in self.instances:
            raise self.fail(line, f"*INSTANCE: expected a name that no other instance has, got {name!r}")
        if _key(part) not in self.parts:
            known = listed(part.name for part in self.parts.values())
            raise self.fail(line, f"*INSTANCE {name}: the part {part!r} does not exist; the deck has {known}")
        rows = [[self.number(number, cell) for cell in _split(text)] for number, text in data]
        if len(rows) > 2 or (rows and len(rows[0]) > 3) or (len(rows) > 1 and len(rows[1]) < 7):
            raise self.fail(line, "*INSTANCE: expected a line of 3 shifts, and one of two points and an angle")
        shift = np.array([*(rows[0] if rows else ()), 0.0, 0.0, 0.0][:3])
        turn = _turn(self.file, data[1][0], rows[1]) if len(rows) > 1 else GLOBAL
        scope = _Scope(name.strip('"'))
        self.instances[_key(name)] = _Instance(name.strip('"'), _key(part), line, scope, shift, turn)
        self.scope, self.system = scope, GLOBAL

    def include(self, line: int, given: dict[str, str], _data: list[tuple[int, str]]) -> None:
        self.lines_of(self.beside(line, given.get("INPUT", "")), line)

    def beside(self, line: int, name: str) -> Path:
        """Return a file that the deck names, beside it."""
        clean = name.strip().strip('"')
        path = self.path.parent / clean
        try:
            if clean and path.is_file():
                return path
        except (OSError, ValueError):
            pass
        raise self.fail(line, f"the file {clean!r} does not exist in {self.path.parent}. Put it beside the deck.")


def _cartesian(points: Array, system: str) -> Array:
    """Return points of a cylindrical (C) or spherical (S) system, with angles in degrees, in a Cartesian one."""
    if system == "R":
        return points
    first, angle, third = points[:, 0], np.radians(points[:, 1]), points[:, 2]
    if system == "C":
        return np.column_stack([first * np.cos(angle), first * np.sin(angle), third])
    up = np.radians(third)
    flat = first * np.cos(up)
    return np.column_stack([flat * np.cos(angle), flat * np.sin(angle), first * np.sin(up)])


def _turn(file: str, line: int, row: Sequence[float]) -> tuple[Array, Array]:
    """Return the rotation about an axis through two points by an angle in degrees, and a point of the axis."""
    start, end, angle = np.array(row[:3]), np.array(row[3:6]), np.radians(row[6])
    length = np.linalg.norm(end - start)
    if not length:
        raise wrong(file, line, "expected an axis of rotation through two different points")
    x, y, z = (end - start) / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross, start


# ------------------------------------------------------------------------------------------------ one mesh


@dataclass
class _Placed:
    """An instance, or what stands outside of them, within the whole mesh."""

    scope: _Scope
    labels: Ints  # of nodes, ascending
    order: Ints  # their points
    element_labels: Ints  # ascending
    element_order: Ints


class _Assembly:
    """Points and elements of all instances, and where each one's labels are."""

    def __init__(self, deck: _Deck) -> None:
        self.deck = deck
        self.points: list[Array] = []
        self.blocks: list[Block] = []
        self.count = self.elements = 0
        self.placed: dict[str, _Placed] = {}
        if deck.parts and not deck.instances:
            raise deck.fail(0, "has parts and no *INSTANCE of them. Write the assembly with the deck.")
        if deck.model.labels or deck.model.elements:
            self.add("", deck.model, lambda x: x)
        for key, instance in deck.instances.items():
            scope = _joined(deck.parts[instance.part], instance.scope)
            self.add(key, scope, lambda x, instance=instance: _moved(x, instance))  # type: ignore[misc]

    def add(self, key: str, scope: _Scope, move: Callable[[Array], Array]) -> None:
        fail = self.deck.fail
        labels = np.concatenate(scope.labels) if scope.labels else np.zeros(0, np.int64)
        points = np.concatenate(scope.points) if scope.labels else np.zeros((0, 3))
        lines = np.concatenate(scope.lines) if scope.labels else np.zeros(0, np.int64)
        order = np.argsort(labels, kind="stable")
        twice = np.flatnonzero(np.diff(labels[order]) == 0)
        moved = np.abs(points[order[twice]] - points[order[twice + 1]]).max(axis=1, initial=0) > 0
        if moved.any():
            a, b = order[twice[moved][0]], order[twice[moved][0] + 1]
            message = f"node {labels[a]} is given twice, in lines {lines[a]} and {lines[b]}, in two places. Remove one."
            raise fail(int(lines[b]), message)
        unique = np.concatenate([[True], np.diff(labels[order]) != 0]) if len(order) else np.zeros(0, bool)
        order = order[unique]
        known = labels[order]
        element_labels = []
        for block in scope.elements:
            element_labels.append(block.labels)
            there = np.isin(block.nodes, known)
            if not there.all():
                row, column = np.argwhere(~there)[0]
                raise fail(
                    int(block.lines[row]),
                    f"element {block.labels[row]} has the node {block.nodes[row, column]}, which is not defined",
                )
            kind = block.kind or 15
            nodes = self.count + order[np.searchsorted(known, block.nodes)]
            nodes = nodes if block.kind else np.zeros((len(block.labels), 1), np.int64)
            self.blocks.append(Block(kind, nodes, block.labels, block.lines))
        every = np.concatenate(element_labels) if element_labels else np.zeros(0, np.int64)
        by_label = np.argsort(every, kind="stable")
        twice = np.flatnonzero(np.diff(every[by_label]) == 0)
        if len(twice):
            rows = np.concatenate([block.lines for block in scope.elements])
            a, b = by_label[twice[0]], by_label[twice[0] + 1]
            message = f"element {every[a]} is given twice, in lines {rows[a]} and {rows[b]}. Give each its own number."
            raise fail(int(rows[b]), message)
        self.placed[key] = _Placed(scope, known, self.count + order, every[by_label], self.elements + by_label)
        self.points.append(move(points))
        self.count += len(points)
        self.elements += len(every)


def _joined(part: _Scope, added: _Scope) -> _Scope:
    """Return a part with what its instance adds."""
    return _Scope(
        added.name, part.labels + added.labels, part.points + added.points, part.lines + added.lines,
        part.elements + added.elements, {**part.nsets, **added.nsets}, {**part.elsets, **added.elsets},
        {**part.surfaces, **added.surfaces},
    )  # fmt: skip


def _moved(points: Array, instance: _Instance) -> Array:
    turn, about = instance.turn
    return (points + instance.shift - about) @ turn.T + about


def _assembled(deck: _Deck) -> MeshFile:
    """Return the mesh of all instances with all sets."""
    assembly = _Assembly(deck)
    points = np.concatenate(assembly.points)
    mesh = MeshFile(deck.path.name, points, tuple(assembly.blocks), ())
    resolve = _Resolver(deck, assembly, mesh)
    sets = resolve.all_sets()
    notes = resolve.notes + [f"no shape: {count:,} elements of type {name}" for name, count in deck.shapeless.items()]
    used = np.zeros(len(points), dtype=bool)
    for block in assembly.blocks:
        if block.kind != 15:
            used[block.nodes] = True
    if not used.all():
        notes.append(f"in no element: {int((~used).sum()):,} nodes")
    if deck.passed:
        text = ", ".join(f"*{name}" + (f" ({n})" if n > 1 else "") for name, n in sorted(deck.passed.items()) if n)
        notes.append(f"not of the mesh: {text}")
    return MeshFile(deck.path.name, points, tuple(assembly.blocks), tuple(sets), tuple(note for note in notes if note))


class _Resolver:
    """Sets of sets, of labels and of faces, as members of the whole mesh."""

    def __init__(self, deck: _Deck, assembly: _Assembly, mesh: MeshFile) -> None:
        self.deck, self.assembly, self.mesh = deck, assembly, mesh
        self.notes: list[str] = []
        self.known: dict[tuple[str, str, str], Ints] = {}

    def all_sets(self) -> list[MeshSet]:
        mesh_sets = []
        scopes = dict(self.assembly.placed)
        scopes.setdefault("", _Placed(self.deck.model, *(np.zeros(0, np.int64) for _ in range(4))))
        for key, placed in scopes.items():
            prefix = f"{placed.scope.name}." if key else ""
            for word, sets, of in (("nset", placed.scope.nsets, "nodes"), ("elset", placed.scope.elsets, "elements")):
                for name, deck_set in sets.items():
                    members = np.unique(self.members(word, key, name, deck_set.line, ()))
                    mesh_sets.append(MeshSet(prefix + deck_set.name, of, members, deck_set.line))  # type: ignore[arg-type]
            for deck_set in placed.scope.surfaces.values():
                mesh_sets.append(MeshSet(prefix + deck_set.name, "sides", self.faces(deck_set, key), deck_set.line))
        return mesh_sets

    def find(self, word: str, scope: str, name: str, line: int) -> tuple[str, str, _Set]:
        """Return the scope, key and set of a name, which may begin with that of its instance."""
        places = [(scope, _key(name))]
        first, dot, rest = name.partition(".")
        if dot:
            places.append((_key(first), _key(rest)))
        for place, key in places:
            holder = self.assembly.placed[place].scope if place in self.assembly.placed else self.deck.model
            sets = {"nset": holder.nsets, "elset": holder.elsets}[word]
            if (place in self.assembly.placed or not place) and key in sets:
                return place, key, sets[key]
        holder = self.assembly.placed[scope].scope if scope in self.assembly.placed else self.deck.model
        has = {"nset": holder.nsets, "elset": holder.elsets}[word].values()
        kind = "node" if word == "nset" else "element"
        raise self.deck.fail(
            line, f"no {kind} set is named {name!r}; the deck has {listed(deck_set.name for deck_set in has)}"
        )

    def members(self, word: str, scope: str, name: str, line: int, within: tuple[str, ...]) -> Ints:
        """Return the points or elements of a set."""
        place, key, deck_set = self.find(word, scope, name, line)
        at = (word, place, key)
        if at in self.known:
            return self.known[at]
        path = f"{word} {place}.{key}"
        if path in within or len(within) > DEEPEST:
            raise self.deck.fail(deck_set.line, f"the set {deck_set.name!r} holds itself. Remove the circle.")
        parts: list[Ints] = [np.zeros(0, np.int64)]
        for entry in deck_set.entries:
            of = _key(entry.scope) if entry.scope else place
            if entry.scope and of not in self.assembly.placed:
                known = listed(p.scope.name for k, p in self.assembly.placed.items() if k)
                raise self.deck.fail(entry.line, f"no instance is named {entry.scope!r}; the deck has {known}")
            if entry.sides == "nodes":
                elements = self.members("elset", of, entry.names[0], entry.line, (*within, path))
                parts += [cells.ravel() for kind, cells in self.mesh.cells(elements).items() if kind != 15]
                continue
            if len(entry.labels):
                parts.append(self.labelled(word, of, entry, deck_set))
            for other in entry.names:
                instance, dot, number = other.partition(".")
                if dot and number.isdecimal() and _key(instance) in self.assembly.placed:
                    label = _Entry(entry.line, labels=np.array([int(number)]))
                    parts.append(self.labelled(word, _key(instance), label, deck_set))
                else:
                    parts.append(self.members(word, of, other, entry.line, (*within, path)))
        self.known[at] = np.concatenate(parts)
        return self.known[at]

    def labelled(self, word: str, scope: str, entry: _Entry, deck_set: _Set) -> Ints:
        """Return the numbers of the labelled nodes or elements."""
        placed = self.assembly.placed.get(scope)
        kind = "node" if word == "nset" else "element"
        labels = entry.labels
        if placed is None:
            raise self.deck.fail(entry.line, f"the set {deck_set.name!r} names {kind} {labels[0]} without its instance")
        known, order = (
            (placed.labels, placed.order) if word == "nset" else (placed.element_labels, placed.element_order)
        )
        there = np.isin(labels, known)
        if not there.all():
            missing = labels[~there]
            if not entry.ranges or not there.any():
                message = f"the set {deck_set.name!r} names {kind} {missing[0]}, which does not exist. Correct the set."
                raise self.deck.fail(entry.line, message)
            self.notes.append(f"set {deck_set.name}, line {entry.line}: {len(missing)} of its range are no {kind}s")
        return order[np.searchsorted(known, labels[there])]

    def faces(self, deck_set: _Set, scope: str) -> Ints:
        """Return the sides of a surface: of given faces, or all free ones of its elements."""
        parts: list[Ints] = [np.zeros((0, 2), np.int64)]
        for entry in deck_set.entries:
            if entry.names and not entry.names[0]:
                raise self.deck.fail(entry.line, f"the surface {deck_set.name!r} names no elements")
            if entry.names:
                elements = np.unique(self.members("elset", scope, entry.names[0], entry.line, ()))
            else:
                elements = self.labelled("elset", scope, entry, deck_set)
            if entry.sides == "free":
                dims = self.mesh.element_dims(np.arange(self.mesh.starts[-1]))
                free = self.mesh.boundary(np.flatnonzero(dims == self.mesh.dim))
                parts.append(free[np.isin(free[:, 0], elements)])
                continue
            if entry.sides in ("SPOS", "SNEG"):
                self.notes.append(f"surface {deck_set.name}, line {entry.line}: faces of shells are no sides, left out")
                continue
            side = int(entry.sides[1]) - 1
            counts = np.array([len(KINDS[block.kind].sides) for block in self.mesh.blocks])
            few = elements[counts[self.mesh.block_of(elements)] <= side]
            if len(few):
                raise self.deck.fail(entry.line, f"{self.mesh.place(int(few[0]))} has no face {entry.sides}")
            parts.append(np.column_stack([elements, np.full(len(elements), side)]))
        every = np.concatenate(parts)
        return np.unique(every, axis=0) if len(every) else every
