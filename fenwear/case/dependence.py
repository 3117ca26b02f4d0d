"""Coefficients that depend on the state of the contact: expressions of a case file.

An expression is arithmetic on T (contact temperature, K), p (contact pressure, MPa), v (sliding speed, mm/s), the
position x, y, z (mm), the worn depth (mm), s, what has been slid (mm), debris, the thickness of the third
body (mm), edge, the distance from the edge of the contact (mm), and of the cycle cs, the cross-shear ratio, and pm, the
mean pressure over the sliding (MPa). It is parsed, checked node by node and then
computed with numpy: no other name, call or operation than those below exists for it, so that a case file cannot run
code.
"""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from fenwear.arrays import Array

VARIABLES = ("T", "p", "v", "x", "y", "z", "depth", "s", "debris", "edge", "cs", "pm")
UNITS = {"T": "K", "p": "MPa", "v": "mm/s", "x": "mm", "y": "mm", "z": "mm", "depth": "mm", "s": "mm",
         "debris": "mm", "edge": "mm", "cs": "", "pm": "MPa"}  # fmt: skip
LONGEST = 500  # characters of an expression
DEEPEST = 30  # levels of its operations
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
}
OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
KNOWN = f"numbers, {', '.join(VARIABLES)}, + - * / **, {', '.join(FUNCTIONS)}"

State = Mapping[str, Array]
Function = Callable[[State], Any]


@lru_cache(maxsize=100)
def parse_expression(text: str) -> Function:
    """Return the function of the state that an expression stands for.

    Raises:
        ValueError: not an expression, or one that uses more than is allowed; says what.
    """
    if len(text) > LONGEST:
        raise ValueError(f"expected at most {LONGEST} characters, got {len(text)}")
    text = text.strip()
    try:
        with warnings.catch_warnings(action="ignore"):  # of what is refused below in our words
            tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"expected an expression of {KNOWN}, got {text!r}") from None
    return _build(tree.body, text, DEEPEST)


@lru_cache(maxsize=100)
def variables_of(text: str) -> frozenset[str]:
    """Return which of the variables a valid expression depends on."""
    tree = ast.parse(text.strip(), mode="eval")
    return frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id in VARIABLES)


def _build(node: ast.AST, text: str, depth: int) -> Function:
    if depth == 0:
        raise ValueError(f"expected at most {DEEPEST} nested operations in {text!r}")
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value):
            return _constant(value, text)
        case ast.Name(id=name) if name in VARIABLES:
            return lambda state: state[name]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATIONS:
            apply, inner = OPERATIONS[type(op)], _build(operand, text, depth - 1)
            return lambda state: apply(inner(state))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATIONS:
            apply = OPERATIONS[type(op)]
            first, second = _build(left, text, depth - 1), _build(right, text, depth - 1)
            return lambda state: apply(first(state), second(state))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            if len(args) != (2 if name in ("min", "max") else 1):
                raise ValueError(f"wrong number of arguments of {name} in {text!r}")
            function, inners = FUNCTIONS[name], [_build(argument, text, depth - 1) for argument in args]
            if len(inners) == 1:
                (only,) = inners
                return lambda state: function(only(state))
            return lambda state: function(*(inner(state) for inner in inners))
    found = ast.get_source_segment(text, node) or type(node).__name__  # ast.unparse may exhaust the stack
    raise ValueError(f"expected an expression of {KNOWN}; {found!r} is not known in {text!r}")


def _constant(value: float, text: str) -> Function:
    try:
        number = np.float64(value)  # not an int: its powers would grow without end
    except OverflowError:
        number = np.float64(np.inf)
    if not np.isfinite(number):
        raise ValueError(f"expected finite numbers in {text!r}")
    constant = np.array(number)  # numpy takes twice as long for numbers that are no arrays
    return lambda _: constant


def evaluate(function: Function, state: State, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a parsed expression; NaN and infinities are left to the caller."""
    with np.errstate(all="ignore"):
        found = np.array(function(state), dtype=float)
    return found if found.shape == shape else np.broadcast_to(found, shape).copy()
