"""Expressions of case files: what they compute, and that they compute nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from fenwear.case.dependence import DEEPEST, LONGEST, evaluate, parse_expression

STATE = {"T": np.array([300.0, 400.0]), "p": np.array([4.0, 9.0]), "v": np.array([2.0, 2.0])}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2e-8", [2e-8, 2e-8]),
        ("-p + +T / v", [146.0, 191.0]),
        ("p ** 0.5 * (v - 1)", [2.0, 3.0]),
        ("max(p, 5) - min(p, 5)", [1.0, 4.0]),
        ("sqrt(p) + abs(p - 10)", [8.0, 4.0]),
        ("exp(log(p))", [4.0, 9.0]),
        ("tanh(0 * p)", [0.0, 0.0]),
        ("2 ** 3 ** 2", [512.0, 512.0]),
    ],
)
def test_values(text: str, expected: list[float]) -> None:
    """Python's precedence, node by node; a constant stands at every node."""
    np.testing.assert_allclose(evaluate(parse_expression(text), STATE, (2,)), expected, rtol=1e-14)


def test_what_has_no_value_is_left_to_the_caller() -> None:
    """Poles and powers beyond all floats give infinities and NaN, without warnings."""
    values = evaluate(parse_expression("1 / (p - 4)"), STATE, (2,))
    assert np.isinf(values[0])
    assert np.isnan(evaluate(parse_expression("log(-p)"), STATE, (2,))).all()
    assert np.isinf(evaluate(parse_expression("10 ** 10 ** 10 * p"), STATE, (2,))).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("p +", "expected an expression of numbers, T, p, v"),
        ("p if T else v", "is not known"),
        ("q", "'q' is not known"),
        ("True", "'True' is not known"),
        ("'p'", "is not known"),
        ("p.real", "'p.real' is not known"),
        ("p // 2", "is not known"),
        ("not p", "is not known"),
        ("open(p)", r"'open\(p\)' is not known"),
        ("().__class__", "is not known"),
        ("exp(p, v)", "wrong number of arguments of exp"),
        ("min(p)", "wrong number of arguments of min"),
        ("exp(x=p)", "is not known"),
        ("-" * (DEEPEST + 1) + "p", f"at most {DEEPEST} nested operations"),
        ("p" + " " * LONGEST, f"at most {LONGEST} characters, got {LONGEST + 1}"),
    ],
)
def test_refused(text: str, message: str) -> None:
    """Anything but arithmetic on T, p and v is an error that says what is wrong."""
    with pytest.raises(ValueError, match=message):
        parse_expression(text)
