"""How large the package is: ceilings in pyproject.toml that only go down."""

import ast
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONG = 50  # lines of a function


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
