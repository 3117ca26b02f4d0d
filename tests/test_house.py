"""How large the package is: ceilings in pyproject.toml that only go down."""

import ast
import tomllib
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

from fenwear import Tribosystem

ROOT = Path(__file__).parents[1]
LONG = 50  # lines of a function
NAMES = 25  # public names of an assembled system, at most
ROOMS, FLOORS = 20, 12  # at most; the highest floor is the door: fenwear/__init__.py and __main__.py


def measured(tree: ast.Module) -> Counter[str]:
    """Return the figures of a module that formatting cannot change."""
    figures = Counter(modules=1)
    for node in ast.walk(tree):
        docstring = (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        )
        figures["statements"] += isinstance(node, ast.stmt) and not docstring
        function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        figures["functions over 50 lines"] += function and node.end_lineno - node.lineno >= LONG
        comparison = isinstance(node, ast.Compare) and any(isinstance(op, ast.Is | ast.IsNot) for op in node.ops)
        figures["tests for None"] += comparison and any(
            isinstance(other, ast.Constant) and other.value is None for other in node.comparators
        )
    return figures


def test_the_figures_of_a_small_module():
    lines = [
        "def f(x):",
        '    """Doc."""',
        "    if x is not None or None is x:",
        "        return 1",
        "    return x is True",
    ]
    lines += ["def g():", *["    pass"] * LONG]
    wanted = {"modules": 1, "statements": 5 + LONG, "functions over 50 lines": 1, "tests for None": 1}
    assert measured(ast.parse("\n".join(lines))) == wanted


def test_the_package_is_no_larger_than_its_ceilings():
    figures: Counter[str] = Counter()
    for path in (ROOT / "fenwear").rglob("*.py"):
        figures += measured(ast.parse(path.read_text("utf-8")))
    ceilings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["fenwear"]["house"]
    ceilings = {name.replace("-", " "): ceiling for name, ceiling in ceilings.items()}
    assert set(ceilings) == set(figures)
    above = {name: (figures[name], ceiling) for name, ceiling in ceilings.items() if figures[name] > ceiling}
    assert not above, "larger than [tool.fenwear.house] in pyproject.toml: remove as much as you add"


def imported_rooms() -> dict[str, set[str]]:
    """Return the rooms that each room imports, also within functions and for types; the door may import all."""
    package = ROOT / "fenwear"
    names = {path.parent.name for path in package.glob("*/__init__.py")}
    rooms: dict[str, set[str]] = {name: set() for name in names}
    for path in package.glob("*/*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom):
                imported = [node.module or ""]
            elif isinstance(node, ast.Import):
                imported = [alias.name for alias in node.names]
            else:
                continue
            rooms[path.parent.name].update(*(set(name.split(".")[1:2]) for name in imported if "fenwear." in name))
    return {room: (others - {room}) & names for room, others in rooms.items()}


def test_rooms_import_lower_rooms_alone():
    """No circle, few floors."""
    rooms = imported_rooms()
    floors: dict[str, int] = {}
    for room in TopologicalSorter(rooms).static_order():  # raises at a circle, with its rooms
        floors[room] = 1 + max((floors[other] for other in rooms[room]), default=0)
    assert {"case", "bodies", "steps", "cli"} < set(rooms)
    assert len(rooms) <= ROOMS
    assert max(floors.values()) < FLOORS, floors


def test_a_system_has_few_names():
    names = {name for name in {*dir(Tribosystem), *Tribosystem.__dataclass_fields__} if not name.startswith("_")}
    assert len(names) <= NAMES, sorted(names)


def test_no_file_name_stands_in_two_rooms():
    """Nor is a file called as a room is."""
    names = Counter(path.stem for path in (ROOT / "fenwear").rglob("*.py") if path.stem != "__init__")
    assert [name for name, number in (names + Counter(list(imported_rooms()))).items() if number > 1] == []
