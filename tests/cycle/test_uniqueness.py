"""Contact with heat that has one answer, and contact that has several."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fenwear import Tribosystem
from fenwear.arrays import Array
from fenwear.cycle import heat_gain, heat_warnings

NAME = "ring-on-ring-heat"
SMALL = ("geometry.degree=2", "geometry.parameters.across=8")


def dense(system: Tribosystem) -> tuple[Array, Array, Array, Array]:
    """Return S + Theta, S, H and E of full contact, made column by column from the compliance and the heat."""
    n, interface, exchange = len(system.pair.weights), system.interface, system.exchange
    assert exchange is not None
    uniform = np.full(n, system.rigid.mean_pressure)
    states, _ = exchange.change(0, exchange.conductance(uniform), pressure=np.eye(n))
    ratio = system.friction_ratio(1)
    compliance = interface.compliance(ratio)
    rigid = interface.rigid
    return compliance + exchange.gap_change(states), compliance, rigid.rigid_normal, rigid.equilibrium(ratio)


def both(matrix: Array, modes: Array, rows: Array) -> Array:
    zeros = np.zeros((len(rows), modes.shape[1]))
    return np.block([[matrix / np.abs(matrix).max(), modes], [rows, zeros]])


@pytest.mark.mpi
def test_the_gain_is_one_where_contact_and_heat_are_singular(assembled: Callable[..., Tribosystem]) -> None:
    """The determinant of contact with heat over that without changes its sign just where the gain passes 1."""
    gain = heat_gain(assembled(NAME, *SMALL, "contact.friction=0.45"))
    assert gain is not None
    signs = []
    for factor in (0.999, 1.001):
        system = assembled(NAME, *SMALL, f"contact.friction={factor * 0.45 / gain}")
        near = heat_gain(system)
        assert near == pytest.approx(factor, rel=1e-4)
        assert bool(heat_warnings(near)) == (factor > 1)
        hot, cold, modes, rows = dense(system)
        signs.append(np.linalg.slogdet(both(hot, modes, rows))[0] * np.linalg.slogdet(both(cold, modes, rows))[0])
    assert signs[0] == -signs[1] != 0


def test_beyond_it_contact_has_several_answers(assembled: Callable[..., Tribosystem]) -> None:
    """Surfaces so worn that the even pressure is an answer: at mu = 0.45, where fenwear warns, there are others that
    satisfy g + S p + Theta p + H a >= 0, p >= 0 with the load; at the built-in friction there is none."""
    others = []
    for mu in (0.1, 0.45):
        system = assembled(NAME, *SMALL, f"contact.friction={mu}")
        assert bool(heat_warnings(heat_gain(system))) == (mu == 0.45)
        hot, _, modes, rows = dense(system)
        n, r = modes.shape
        even = np.full(n, system.rigid.mean_pressure)
        matrix = both(hot, modes, rows)
        shape = -matrix[:n, :n] @ even
        away = []
        for low, high in itertools.combinations(range(n + 1), 2):  # contact on all nodes between two
            kept = np.append(np.arange(low, high), n + np.arange(r))
            right = np.append(-shape, -system.rigid.resultant)
            solved: Array = np.zeros(n + r)
            solved[kept] = np.linalg.solve(matrix[np.ix_(kept, kept)], right[kept])
            pressure, gap = solved[:n], shape + matrix[:n] @ solved
            if pressure.min() >= 0 and gap.min() > -1e-9 * np.abs(shape).max():
                away.append(float(np.abs(pressure - even).max() / even[0]))
        others.append(away)
    assert max(others[0]) < 1e-8
    assert max(others[1]) > 0.5


def test_a_run_and_the_steady_state_say_so(fenwear: Callable[..., Any], tmp_path: Any) -> None:
    """The warning of check, run and steady, and none at the built-in friction."""
    small = [word for one in SMALL for word in ("--set", one)]
    for command in (("check",), ("steady",), ("run", "--set", "run.half_cycles=1", "-o", str(tmp_path / "out"))):
        name, *more = command
        done = fenwear(name, NAME, *small, *more, "--set", "contact.friction=0.45", "--set", "output.report=false")
        assert "the contact may have several answers" in done.stderr
    done = fenwear("check", NAME, *small)
    assert "several answers" not in done.stderr
