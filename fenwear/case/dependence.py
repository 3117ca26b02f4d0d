"""Coefficients that depend on the state of the contact: expressions of a case file, and registered functions.

An expression is arithmetic on T (contact temperature, K), p (contact pressure, MPa), v (sliding speed, mm/s), the
position x, y, z (mm), the worn depth (mm), s, what has been slid (mm), debris, the thickness of the third
body (mm), edge, the distance from the edge of the contact (mm), film, the thickness of the film on the body (mm), and
of the cycle cs, the cross-shear ratio, and pm, the mean pressure over the sliding (MPa). It is parsed, checked node by
node and then computed with numpy: no other name, call or operation than those below exists for it, so that a case file
cannot run code.

Laws of one's own are functions that a program in Python has registered by name; a case file alone cannot. A law may
have states: fields at the contact's nodes that it remembers, such as the thickness of an oxide film or the damage of a
surface. They begin somewhere, and their rates are functions of the conditions of each node, of the wear there and of
the states themselves. `fenwear.laws.law_states` integrates them.
"""

from __future__ import annotations

import ast
import math
import operator
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any, TypeVar, overload

import numpy as np

from fenwear.common.arrays import Array
from fenwear.common.errors import CaseError, InputError

VARIABLES = ("T", "p", "v", "x", "y", "z", "depth", "s", "debris", "edge", "cs", "pm", "film")
UNITS = {"T": "K", "p": "MPa", "v": "mm/s", "x": "mm", "y": "mm", "z": "mm", "depth": "mm", "s": "mm",
         "debris": "mm", "edge": "mm", "cs": "", "pm": "MPa", "film": "mm"}  # fmt: skip
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

Now = Mapping[str, Array]
Function = Callable[[Now], Any]


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
    source = ast.get_source_segment(text, node) or type(node).__name__  # ast.unparse may exhaust the stack
    raise ValueError(f"expected an expression of {KNOWN}; {source!r} is not known in {text!r}")


def _constant(value: float, text: str) -> Function:
    try:
        number = np.float64(value)  # not an int: its powers would grow without end
    except OverflowError:
        number = np.float64(np.inf)
    if not np.isfinite(number):
        raise ValueError(f"expected finite numbers in {text!r}")
    constant = np.array(number)  # numpy takes twice as long for numbers that are no arrays
    return lambda _: constant


def evaluate(function: Function, state: Now, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a parsed expression; NaN and infinities are left to the caller."""
    with np.errstate(all="ignore"):
        values = np.array(function(state), dtype=float)
    return values if values.shape == shape else np.broadcast_to(values, shape).copy()


F = TypeVar("F", bound=Function)
BELOW: Any = object()  # in place of a function that follows a decorator
WEAR = ("wear", "wear_punch", "wear_strip")  # off both bodies and off each at a node, mm/s, for rates of states


@dataclass(frozen=True)
class State:
    """A state that a law of one's own remembers at each node of the contact: dy/dt = rate.

    It is on the material of the body whose wear law depends on it, a state of friction alone on the punch's. Strip that
    is not under the punch has its rate without pressure, speed and wear.

    Attributes:
        rate: Function of the variables in `of` and of the state itself, by their names at n nodes (n,), that returns
            the change in a second (n,), or one number.
        of: Variables of the rate: which of T, p, v, x, y, z, depth, s, debris, edge, cs, pm and film, which other
            states, and `wear`, what both bodies lose there (mm/s), or one of them, `wear_punch` and `wear_strip`.
        initial: Value at the start, or a function of the places x, y, z of the nodes, mm.
        unit: Unit of its values in results.
        fills: Gap that a unit of it fills, mm: 1 of a film's thickness in mm that carries as third bodies do.
        least, most: Between which its values are.
        slope: Derivative of the rate to the state itself, a function as the rate; by default by differences.
    """

    rate: Function
    of: Sequence[str] = ("T", "p", "v")
    initial: float | Function = 0.0
    unit: str = "1"
    fills: float = 0.0
    least: float = -np.inf
    most: float = np.inf
    slope: Function | None = None


@dataclass(frozen=True)
class _Law:
    """A registered function, and the names of what it depends on."""

    function: Function
    of: frozenset[str]


NO_STATES: Mapping[str, State] = MappingProxyType({})
_LAWS: dict[str, _Law] = {}  # by their names: those of this process
_STATES: dict[str, State] = {}


@overload
def register_law(
    name: str, *, of: Sequence[str] = ("T", "p", "v"), states: Mapping[str, State] = NO_STATES
) -> Callable[[F], F]: ...
@overload
def register_law(
    name: str, function: F, of: Sequence[str] = ("T", "p", "v"), states: Mapping[str, State] = NO_STATES
) -> F: ...
def register_law(
    name: str, function: Any = BELOW, of: Sequence[str] = ("T", "p", "v"), states: Mapping[str, State] = NO_STATES
) -> Any:
    """Make a law of one's own known by its name, as `law = "name"` in a case made in Python.

    Without a function it is a decorator: `@register_law("name")` above the function.

    It is called with the values of its variables at the contact nodes (n,), by their names, and returns the
    coefficient at each (n,), or one number. Derivatives are taken by differences, where any are needed.

    Args:
        name: A word; registered again, the new function takes its place.
        function: Of the state of the contact; without it, what the decorator stands above.
        of: Which of T, p, v, x, y, z, depth, s, debris, edge, cs, pm and film it depends on, and which states; with
            depth or s nothing ever repeats.
        states: Its states, by names that are words; laws that name the same state share it.

    Returns:
        The function, or the decorator.

    Raises:
        CaseError: `name` is no word, `function` cannot be called, or a state is wrong.
    """
    if function is BELOW:
        return partial(register_law, name, of=of, states=states)
    key = f"law {name!r}"
    if not (isinstance(name, str) and name.isidentifier()):
        raise CaseError(InputError("law", f"expected a word as the name of a law, got {str(name)!r}"))
    if not callable(function):
        raise CaseError(InputError(key, "expected a function of the state"))
    new_states = dict(states)
    known = {**_STATES, **new_states}
    _check_of(key, of, (*VARIABLES, *known))
    for word, state in new_states.items():
        _check_state(word, state, (*VARIABLES, *WEAR, *known))
    _STATES.update(new_states)
    _LAWS[name] = _Law(function, frozenset({*of, *new_states}))
    return function


def forget_laws() -> None:
    """Forget all laws and states."""
    for known in (_LAWS, _STATES):
        known.clear()


def _check_of(key: str, of: Sequence[str], known: Sequence[str]) -> None:
    unknown = [variable for variable in of if variable not in known]
    if unknown or isinstance(of, str):
        message = f"expected a list of some of {', '.join(known)}, got {unknown[0] if unknown else of!r}"
        raise CaseError(InputError(key, message))


def _check_state(name: str, state: State, known: Sequence[str]) -> None:
    key = f"state {name!r}"
    taken = (*VARIABLES, *FUNCTIONS, *WEAR)
    if not (isinstance(name, str) and name.isidentifier()) or name in taken:
        raise CaseError(InputError(key, f"expected a word that is none of {', '.join(taken)}"))
    if not isinstance(state, State):
        raise CaseError(InputError(key, "expected a fenwear.State"))
    if not callable(state.rate) or not (state.slope is None or callable(state.slope)):
        raise CaseError(InputError(key, "expected functions as its rate and its slope"))
    _check_of(key, state.of, known)
    if not state.least < state.most:
        raise CaseError(InputError(key, f"expected least < most, got {state.least:g} and {state.most:g}"))
    if not (np.isfinite(state.fills) and state.fills >= 0):
        raise CaseError(InputError(key, f"expected fills of zero or more, got {state.fills!r}"))
    if not callable(state.initial) and not state.least <= state.initial <= state.most:
        wanted = f"expected an initial value from {state.least:g} to {state.most:g}"
        raise CaseError(InputError(key, f"{wanted}, got {state.initial!r}"))


def states_of_law(name: str) -> dict[str, State]:
    """Return the states that a registered law depends on, and those that these depend on; none where there is none."""
    states: dict[str, State] = {}
    left = list(_LAWS[name].of) if name in _LAWS else []
    while left:
        word = left.pop()
        if word in _STATES and word not in states:
            states[word] = _STATES[word]
            left += _STATES[word].of
    return {word: states[word] for word in sorted(states)}


def variables_of_law(name: str) -> frozenset[str]:
    """Return the variables of a registered law and of its states; none of an unknown law."""
    states = states_of_law(name)
    return frozenset(
        {*(_LAWS[name].of if name in _LAWS else ()), *(variable for s in states.values() for variable in s.of)}
    )


def check_law(name: str) -> None:
    """Raise where no law of this name is registered.

    Raises:
        ValueError: says what is.
    """
    if name not in _LAWS:
        known = f"known are {', '.join(sorted(_LAWS))}" if _LAWS else "there is none"
        raise ValueError(
            f"no law {name!r} is registered, {known}. Register your own in Python by fenwear.register_law. The "
            "command line has none of them"
        )


def evaluate_law(name: str, now: Now, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a registered law.

    Raises:
        ValueError: it fails, or gives what is no number for each node; says so.
    """
    check_law(name)
    law = _LAWS[name]
    return _called(f"the law {name!r}", law.function, law.of, now, shape)


def evaluate_of_state(name: str, function: Function, of: Iterable[str], now: Now, shape: tuple[int, ...]) -> Array:
    """Return the values (shape) of a function of a state: its rate, a slope, or its values at the start.

    Raises:
        CaseError: it fails, or gives what is no finite number for each node; says so.
    """
    try:
        values = _called(f"the state {name!r}", function, of, now, shape)
    except ValueError as error:
        raise CaseError(InputError(f"state {name!r}", str(error))) from error
    if (
        not math.isfinite(float(values @ values)) and not np.isfinite(values).all()
    ):  # a square may be beyond all numbers
        node = int(np.flatnonzero(~np.isfinite(values))[0])
        at = ", ".join(f"{variable} = {np.broadcast_to(now[variable], shape)[node]:g}" for variable in of)
        raise CaseError(InputError(f"state {name!r}", f"expected finite numbers, got {values[node]:g} at {at}"))
    return values


def _called(subject: str, function: Function, of: Iterable[str], now: Now, shape: tuple[int, ...]) -> Array:
    given = {key: now[key].copy() if now[key].shape == shape else np.full(shape, now[key]) for key in of}
    try:
        result = np.asarray(function(given))
        if result.dtype.kind == "c":
            raise ValueError("it gives complex numbers")
        values = result.astype(float)  # a copy of what may be the user's own
    except KeyError as error:
        named = ", ".join(sorted(given))
        raise ValueError(f"{subject} needs {error}, and `of` names {named}. Add it to `of`") from error
    except Exception as error:  # a user's own code may raise anything
        raise ValueError(f"{subject} fails: {error}") from error
    if values.shape not in ((), shape):
        raise ValueError(f"{subject} gives {values.shape} values; expected one for each of {shape[0]} nodes")
    return values if values.shape == shape else np.full(shape, values)
