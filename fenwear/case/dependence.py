"""Coefficients that depend on the state of the contact: expressions and tables of a case file, laws from Python.

An expression is arithmetic on T (contact temperature, K), p (contact pressure, MPa), v (sliding speed, mm/s), the
position x, y, z (mm), the worn depth (mm), s, what has been slid (mm), and of the cycle cs, the cross-shear ratio, and
pm, the mean pressure over the sliding (MPa). It is parsed, checked node by node and then
computed with numpy: no other name, call or operation than those below exists for it, so that a case file cannot run
code. Laws are functions that a program in Python has registered; a case file alone cannot.
"""

from __future__ import annotations

import ast
import operator
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from fenwear.arrays import Array
from fenwear.errors import CaseError, InputError

VARIABLES = ("T", "p", "v", "x", "y", "z", "depth", "s", "cs", "pm")
UNITS = {"T": "K", "p": "MPa", "v": "mm/s", "x": "mm", "y": "mm", "z": "mm", "depth": "mm", "s": "mm",
         "cs": "", "pm": "MPa"}  # fmt: skip
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
FIRST, SLOW = 3, 0.02  # calls of a law that are timed, and seconds of each that are told
_CALLS: dict[str, list[float]] = {}  # CPU seconds of the first ones, by the law's name
_LAWS: dict[str, tuple[Function, frozenset[str]]] = {}  # by their names, with their variables: those of this process


def register_law(name: str, function: Function, of: Sequence[str] = ("T", "p", "v")) -> None:
    """Make a law of one's own known by its name, as `law = "name"` in a case made in Python.

    It is called with the values of its variables at the contact nodes (n,), by their names, and returns the
    coefficient at each (n,), or one number. Derivatives are taken by differences, where any are needed.

    Args:
        name: A word; registered again, the new function takes its place.
        function: Of the state.
        of: Which of T, p, v, x, y, z, depth, s, cs and pm it depends on; with depth or s nothing ever repeats.

    Raises:
        CaseError: `name` is no word, or `function` cannot be called.
    """
    if not (isinstance(name, str) and name.isidentifier()):
        raise CaseError(InputError("law", f"expected a word as the name of a law, got {str(name)!r}"))
    if not callable(function):
        raise CaseError(InputError(f"law {name!r}", "expected a function of the state"))
    unknown = [one for one in of if one not in VARIABLES]
    if unknown or isinstance(of, str):
        message = f"expected a list of some of {', '.join(VARIABLES)}, got {unknown[0] if unknown else of!r}"
        raise CaseError(InputError(f"law {name!r}", message))
    _LAWS[name] = function, frozenset(of)
    _CALLS.pop(name, None)


def variables_of_law(name: str) -> frozenset[str]:
    """Return what a registered law depends on; nothing where there is none."""
    return _LAWS[name][1] if name in _LAWS else frozenset()


def check_law(name: str) -> None:
    """Raise where no law of this name is registered.

    Raises:
        ValueError: says what is.
    """
    if name not in _LAWS:
        known = f"known are {', '.join(sorted(_LAWS))}" if _LAWS else "there is none"
        raise ValueError(
            f"no law {name!r} is registered, {known}: laws of one's own are made known in Python, by "
            "fenwear.register_law, and do not exist on the command line"
        )


def _tell_slow(name: str, seconds: float, nodes: int) -> None:
    """Warn once of a law whose fastest of its first calls takes long: it is called some ten times in a half-cycle."""
    calls = _CALLS.setdefault(name, [])
    if len(calls) >= FIRST:
        return
    calls.append(seconds)
    if len(calls) == FIRST and min(calls) > SLOW:
        warnings.warn(
            f"the law {name!r} takes {min(calls):.2g} s for {nodes} nodes, and a half-cycle calls it some ten times: "
            "make it faster, with arrays of numpy in place of loops",
            stacklevel=2,
        )


def evaluate_law(name: str, state: State, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a registered law.

    Raises:
        ValueError: it fails, or gives what is no number for each node; says so.
    """
    check_law(name)
    function, variables = _LAWS[name]
    given = {key: np.array(np.broadcast_to(state[key], shape)) for key in variables}
    begin = time.thread_time()
    try:
        found = np.asarray(function(given))
        if np.iscomplexobj(found):
            raise ValueError("it gives complex numbers")
        values = found.astype(float)
    except KeyError as error:
        asked = f"asks for {error}, but is of {', '.join(sorted(variables))}"
        raise ValueError(f"the law {name!r} {asked}: expected it among what `of` names") from error
    except Exception as error:  # a user's own code may raise anything
        raise ValueError(f"the law {name!r} fails: {error}") from error
    _tell_slow(name, time.thread_time() - begin, shape[0] if shape else 1)
    if values.shape not in ((), shape):
        raise ValueError(f"the law {name!r} gives {values.shape} values; expected one for each of {shape[0]} nodes")
    return np.broadcast_to(values, shape).copy()


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
    return lambda _: number


def evaluate(function: Function, state: State, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a parsed expression; NaN and infinities are left to the caller."""
    with np.errstate(all="ignore"):
        return np.broadcast_to(np.asarray(function(state), dtype=float), shape).copy()
